"""Ctrl-C and SIGTERM while a command runs: never lost, and never mistaken for an error of ours.

The exception that Python raises from a signal may come where nobody passes it on: in a finalizer, or in code of others that
catches whatever comes or trips over what it left half done. So a signal is also remembered, and raised again after a while,
until the command ends or the function that caught it says so (`interrupt_taken`).
"""

from __future__ import annotations

import contextlib
import os
import signal
import sys
import threading
from contextlib import contextmanager

from spacearm.core.interrupts import on_interrupt_taken

TYPE_CHECKING = False  # as typing has it, which is slow to load

if TYPE_CHECKING:
    from collections.abc import Iterator
    from types import FrameType
    from typing import Any

_AGAIN = 1.0  # [s] after which a signal that has not ended the command is raised once more
_SOON = 0.05  # [s] the same after a finalizer swallowed it


class Terminated(KeyboardInterrupt):
    """SIGTERM, which ends a command as Ctrl-C does."""


class Watch:
    """What came while a command ran.

    Attributes:
        number: of the first signal; 0: none came.
    """

    def __init__(self) -> None:
        self.number = 0

    @property
    def code(self) -> int:
        """The exit code for it, as shells have it."""
        return 128 + self.number

    def __call__(self, number: int, frame: FrameType | None) -> None:
        """Remember and raise."""
        self.number = self.number or number
        _repeat_after(_AGAIN)
        raise Terminated if number == signal.SIGTERM else KeyboardInterrupt


_watches: list[Watch] = []


def was_interrupted() -> bool:
    """Whether a signal has come to the command that runs."""
    return bool(_watches and _watches[-1].number)


@contextmanager
def watched(*, to_the_end: bool) -> Iterator[Watch]:
    """Watch for signals while a command runs. Those that are ignored or handled by somebody else are left so.

    Args:
        to_the_end: the process ends with the command: from then on signals are ignored, for all is done.
    """
    watch = Watch()
    if threading.current_thread() is not threading.main_thread():
        yield watch
        return
    before, hook = _install(watch), sys.unraisablehook
    sys.unraisablehook = lambda raised: _unraisable(raised, hook)
    _watches.append(watch)
    try:
        with on_interrupt_taken(_stop_repeating):
            yield watch
    finally:
        with contextlib.suppress(KeyboardInterrupt):
            _stop_repeating()
        for number, handler in before.items():
            with contextlib.suppress(KeyboardInterrupt):
                signal.signal(number, signal.SIG_IGN if to_the_end else handler)
        sys.unraisablehook = hook
        _watches.remove(watch)
        if to_the_end and watch.number:
            # An interrupt inside `exec("...")`, as dataclasses run it, has CPython end by SIGINT whatever the exit code is,
            # unless another one follows.
            exec("pass")


def _install(watch: Watch) -> dict[int, Any]:
    """Take over the signals that Python has to itself, and return their handlers."""
    before: dict[int, Any] = {}
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        before[signal.SIGINT] = signal.default_int_handler
    if signal.getsignal(signal.SIGTERM) is signal.SIG_DFL:
        before[signal.SIGTERM] = signal.SIG_DFL
    for number in before:
        signal.signal(number, watch)
    if before and hasattr(signal, "SIGALRM") and signal.getsignal(signal.SIGALRM) is signal.SIG_DFL:
        before[signal.SIGALRM] = signal.SIG_DFL
        signal.signal(signal.SIGALRM, _repeat_signal)
    return before


def _repeat_after(seconds: float) -> None:
    if hasattr(signal, "setitimer") and signal.getsignal(signal.SIGALRM) is _repeat_signal:
        signal.setitimer(signal.ITIMER_REAL, seconds)


def _stop_repeating() -> None:
    _repeat_after(0)


def _repeat_signal(number: int, frame: FrameType | None) -> None:
    """Send the signal again, by its own handler: what puts it off does so again."""
    if was_interrupted():
        os.kill(os.getpid(), _watches[-1].number)


def _unraisable(raised: Any, otherwise: Any) -> None:
    """Take note of what a finalizer could not raise."""
    if was_interrupted() and issubclass(raised.exc_type, KeyboardInterrupt):
        _repeat_after(_SOON)
    else:
        otherwise(raised)
