"""A thread that does what it was asked for last, of each kind: of a flood of events from a dragged handle, one in a while."""

from __future__ import annotations

import threading
import time
from collections import OrderedDict
from collections.abc import Callable
from functools import partial

_PERIOD = 1 / 30  # [s] between two ticks
_LONGEST = 0.25  # [s] that a tick is told of at most, after a long action


class LatestWorker:
    """Does actions one after the other, each kind's latest only.

    Args:
        name: of the thread.
        failed: called with what an action raised.
        tick: called with the time since the last one [s], some 30 times a second, until it returns False; `wake` begins it
            again. None: there is nothing to be done regularly.
    """

    def __init__(self, name: str, failed: Callable[[Exception], object], tick: Callable[[float], bool] | None = None) -> None:
        self._failed, self._tick = failed, tick
        self._waiting = OrderedDict[str, Callable[[], object]]()
        self._condition = threading.Condition()
        self._closed, self._busy, self._ticking = False, False, False
        self._thread = threading.Thread(target=self._work, name=name, daemon=True)
        self._thread.start()

    def post(self, kind: str, action: Callable[[], object]) -> None:
        """Do an action soon; it takes the place of one of the same kind that has not begun."""
        with self._condition:
            self._waiting[kind] = action
            self._condition.notify_all()

    def wake(self) -> None:
        """Begin to tick."""
        with self._condition:
            self._ticking = True
            self._condition.notify_all()

    def settle(self, seconds: float) -> bool:
        """Wait until nothing waits and nothing is done, and return whether that is so."""
        until = time.monotonic() + seconds
        with self._condition:
            while self._waiting or self._busy:
                left = until - time.monotonic()
                if left <= 0:
                    return False
                self._condition.wait(left)
            return True

    def close(self) -> None:
        """End after the action that is being done."""
        with self._condition:
            self._closed = True
            self._waiting.clear()
            self._condition.notify_all()
        if threading.current_thread() is not self._thread:
            self._thread.join(2.0)

    def _work(self) -> None:
        last = time.monotonic()
        while True:
            with self._condition:
                if not (self._waiting or self._closed):
                    self._condition.wait(_PERIOD if self._ticking else None)
                if self._closed:
                    return
                action = self._waiting.popitem(last=False)[1] if self._waiting else None
                self._busy = True
            now = time.monotonic()
            if action is not None:
                self._done(action)
            if self._ticking and self._tick is not None and now - last >= 0.9 * _PERIOD:
                elapsed, last = min(now - last, _LONGEST), now
                with self._condition:
                    self._ticking = False  # unless it is woken during the tick, or the tick wants another one
                if self._done(partial(self._tick, elapsed)):
                    self.wake()
            elif not self._ticking:
                last = now
            with self._condition:
                self._busy = False
                self._condition.notify_all()

    def _done(self, action: Callable[[], object]) -> object:
        try:
            return action()
        except Exception as error:
            self._failed(error)
            return False
