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
        self._left = TimeLeft()

    def say(self, words: str, *, done: int = 0, total: int = 0) -> None:
        """Tell the listeners how far it is, if it has taken more than a second, and once a second at most.

        Args:
            words: what is being done.
            done, total: the parts done, and those in all; 0 where that is not known. With them the time left is told.
        """
        now = time.monotonic()
        self._left.see(done, total, now)
        if now >= self._next:
            self._next = now + _BETWEEN
            left = self._left.words(now)
            for listener in list(_listeners):
                listener(f"{words}, {left}" if left else words)


class TimeLeft:
    """How long a work will still take, if it goes on as it did since it was first seen."""

    def __init__(self) -> None:
        self._first: tuple[float, float] | None = None  # what was done, and when
        self._end: float | None = None

    def see(self, done: float, total: float, now: float) -> None:
        """Take note of how far it is; what was done before the first look, by an earlier run, is no measure of its pace."""
        if total <= 0 or done > total:
            self._first = self._end = None
            return
        if self._first is None or done < self._first[0]:
            self._first, self._end = (done, now), None
        elif done > self._first[0]:
            self._end = now + (now - self._first[1]) * (total - done) / (done - self._first[0])

    def words(self, now: float) -> str:
        """Return the time left in words; "" where nothing is known of it."""
        return "" if self._end is None else f"about {duration_in_words(max(self._end - now, 1.0))} left"


def duration_in_words(seconds: float) -> str:
    """Return a time in two units at most: "45 s", "2 min 10 s", "3 h 5 min"."""
    whole = round(seconds)
    for size, unit, smaller, part in ((86400, "d", 3600, "h"), (3600, "h", 60, "min"), (60, "min", 1, "s")):
        if whole >= size:
            rest = whole % size // smaller
            return f"{whole // size} {unit}" + (f" {rest} {part}" if rest else "")
    return f"{whole} s"
