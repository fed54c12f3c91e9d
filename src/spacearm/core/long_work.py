"""Long work that says what it does: whoever shows progress listens, and the library itself prints nothing."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

_QUIET = 1.0  # seconds of one work, before which nothing is said
_BETWEEN = 1.0  # seconds between two sentences of one work

_listeners: list[Callable[[str], None]] = []


@contextmanager
def on_progress(listener: Callable[[str], None]) -> Iterator[None]:
    """Call a function with a few words whenever a long work says how far it is, while the context lasts."""
    _listeners.append(listener)
    try:
        yield
    finally:
        _listeners.remove(listener)


class LongWork:
    """One work that may take long."""

    def __init__(self) -> None:
        self._next = time.monotonic() + _QUIET

    def say(self, words: str) -> None:
        """Tell the listeners how far it is, if it has taken more than a second, and once a second at most."""
        if time.monotonic() >= self._next:
            self._next = time.monotonic() + _BETWEEN
            for listener in list(_listeners):
                listener(words)
