"""The worker: one thing at a time, the latest of each kind, ticks while it is asked to, and errors that end nothing."""

from __future__ import annotations

import threading

from spacearm.view.latest_worker import LatestWorker

LONG = 60.0


def test_of_a_flood_the_first_and_the_last_are_done() -> None:
    done: list[int] = []
    gate = threading.Event()
    worker = LatestWorker("test", lambda error: None)
    worker.post("a", lambda: gate.wait(LONG))
    for i in range(1000):
        worker.post("b", lambda i=i: done.append(i))
    worker.post("c", lambda: done.append(-1))
    gate.set()
    assert worker.settle(LONG)
    assert done == [999, -1]
    worker.close()


def test_an_error_is_told_and_the_next_action_is_done() -> None:
    told: list[Exception] = []
    done = threading.Event()
    worker = LatestWorker("test", told.append)
    worker.post("a", lambda: 1 // 0)
    assert worker.settle(LONG)
    worker.post("a", done.set)
    assert worker.settle(LONG)
    assert done.is_set()
    assert isinstance(told[0], ZeroDivisionError)
    worker.close()


def test_it_ticks_until_it_is_enough() -> None:
    ticks: list[float] = []
    enough = threading.Event()

    def tick(elapsed: float) -> bool:
        ticks.append(elapsed)
        if len(ticks) == 5:
            enough.set()
        return len(ticks) < 5

    worker = LatestWorker("test", lambda error: None, tick)
    assert worker.settle(LONG)
    assert not ticks
    worker.wake()
    assert enough.wait(LONG)
    worker.post("a", lambda: None)
    assert worker.settle(LONG)
    assert len(ticks) == 5
    assert all(0 < one <= 0.25 for one in ticks)
    worker.close()


def test_it_goes_on_if_it_is_woken_during_its_last_tick() -> None:
    ticks: list[float] = []
    again = threading.Event()

    def tick(elapsed: float) -> bool:
        ticks.append(elapsed)
        if len(ticks) == 1:
            worker.wake()  # as by another thread, before this tick says that it was the last one
        else:
            again.set()
        return False

    worker = LatestWorker("test", lambda error: None, tick)
    worker.wake()
    assert again.wait(LONG)
    worker.close()


def test_after_it_is_closed_nothing_is_done() -> None:
    worker = LatestWorker("test", lambda error: None)
    worker.close()
    done: list[int] = []
    worker.post("a", lambda: done.append(1))
    assert not done
    assert not worker.settle(0.05)
