"""Progress of a command, one line on stderr: how far it is, how long it has taken, and the time left.

The line comes after a second, so that quick work does not flash; it is written whole, only where it changes, and taken away in
the end. Where stderr is no terminal, or one that cannot go back on a line, nothing is shown.
"""

from __future__ import annotations

import os
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

from spacearm.core.long_work import TimeLeft, duration_in_words, on_progress

Bar = Callable[[int, int, str], None]
"""Called with the work done, the work in all (0 where it is not known), and what is being done."""

QUIET = 1.0
"""[s] Work that is done by then shows nothing."""

_EVERY = 0.2  # [s]
_BAR, _SHORT = 24, 8  # columns of the bar, at most and at least
_AROUND = 34  # columns of the times and of the space around the bar
_CLEAR = "\r\x1b[K"  # back to the beginning, and nothing to the right of it


@contextmanager
def progress_bar(title: str) -> Iterator[Bar]:
    """Show progress on stderr while the context lasts; what long work says of itself is shown too."""
    if not moves(sys.stderr):
        yield lambda done, total, what: None
        return
    line = _Line(title)
    try:
        with on_progress(line.say):
            yield line.tell
    finally:
        line.end()


def moves(stream: object) -> bool:
    """Whether a stream is a terminal that can go back on a line."""
    return bool(getattr(stream, "isatty", lambda: False)()) and os.environ.get("TERM") != "dumb"


def line_of(
    title: str, *, columns: int, took: float, share: float | None = None, left: str = "", what: str = "", plain: bool = False
) -> str:
    """Return the line, of no more than a number of columns.

    Args:
        title: of the work.
        columns: of the terminal.
        took: [s] since the beginning.
        share: that is done, 0 up to 1; None where it is not known.
        left: the time left in words; "" where it is not known.
        what: is being done.
        plain: without characters beyond ASCII.
    """
    parts = [title]
    if share is not None:
        size = max(_SHORT, min(_BAR, columns - _AROUND - len(title) - len(what)))
        full = min(size, int(share * size))
        parts += [("#" if plain else "━") * full + ("." if plain else "╌") * (size - full), f"{min(share, 1.0):4.0%}"]
    parts.append(f"{duration_in_words(took)}{f', {left}' if left else ''}")
    if what:
        parts.append(what)
    text = "  ".join(parts)
    return text if len(text) < columns else text[: max(columns - 4, 0)] + "..."


class _Line:
    """A line on stderr that a thread of its own keeps up to date."""

    def __init__(self, title: str) -> None:
        self._title, self._begun = title, time.monotonic()
        self._state: tuple[float | None, str] = None, ""
        self._left = TimeLeft()
        self._lock, self._over = threading.Lock(), threading.Event()
        self._shown = ""
        self._thread = threading.Thread(target=self._keep, daemon=True)
        self._thread.start()

    def tell(self, done: int, total: int, what: str) -> None:
        """Take note of how far the work is."""
        with self._lock:
            self._left.see(done, total, time.monotonic())
            self._state = (done / total if total else None), what

    def say(self, words: str) -> None:
        """Take note of what a part of the work says of itself."""
        with self._lock:
            self._state = self._state[0], words

    def end(self) -> None:
        """Take the line away."""
        self._over.set()
        self._thread.join()
        if self._shown:
            self._write(_CLEAR)

    def _keep(self) -> None:
        wait = QUIET
        while not self._over.wait(wait):
            wait = _EVERY
            text = self._text()
            if text != self._shown:
                self._shown = text
                self._write(f"{_CLEAR}{text}")

    def _text(self) -> str:
        now = time.monotonic()
        with self._lock:
            (share, what), left = self._state, self._left.words(now)
        columns = 80
        with suppress(OSError, ValueError):
            columns = os.get_terminal_size(sys.stderr.fileno()).columns
        plain = "utf" not in (getattr(sys.stderr, "encoding", None) or "").lower()
        what = " ".join(what.split())
        took = now - self._begun
        return line_of(self._title, columns=columns, took=took, share=share, left=left, what=what, plain=plain)

    def _write(self, text: str) -> None:
        with suppress(OSError, ValueError):  # the terminal may be gone; the work goes on
            sys.stderr.write(text)
            sys.stderr.flush()
