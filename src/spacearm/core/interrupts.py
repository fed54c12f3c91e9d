"""Ctrl-C where it may come, and not where it would leave something half done."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any

SIGNALS = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM") if hasattr(signal, name))


@contextmanager
def unbroken() -> Iterator[None]:
    """Put off Ctrl-C, and SIGTERM where Python handles it, until the context ends.

    For what must be whole or not at all, and for code of others that would swallow an exception from nowhere, or take it for
    an error of its own. Keep it short: nothing stops what is inside. In other threads than the main one there is nothing to
    put off, for Python's signals arrive there.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    came: list[tuple[int, FrameType | None]] = []
    before: dict[int, Any] = {}

    def note(number: int, frame: FrameType | None) -> None:
        came.append((number, frame))

    try:
        for number in SIGNALS:
            handler = signal.getsignal(number)
            if callable(handler):  # neither ignored nor the system's own
                before[number] = handler
                signal.signal(number, note)
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
        for number, frame in came[:1]:
            before[number](number, frame)
