"""Ctrl-C: put off where it would leave something half done, and told to the command line where it is taken.

The command line repeats a signal that does not end the command, since code of others may swallow the exception. A function that
catches KeyboardInterrupt and returns what it has so far calls `interrupt_taken`: the repeat would interrupt what is made of it.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any

_listeners: list[Callable[[], None]] = []

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


def interrupt_taken() -> None:
    """Tell that a KeyboardInterrupt was caught on purpose and the work ends with what there is: nobody needs to repeat it."""
    for listener in _listeners:
        listener()


@contextmanager
def on_interrupt_taken(listener: Callable[[], None]) -> Iterator[None]:
    """Call a function whenever an interrupt is taken (`interrupt_taken`), while the context lasts."""
    _listeners.append(listener)
    try:
        yield
    finally:
        _listeners.remove(listener)
