"""Several Python threads may share a search: each call has its turn, and its numbers are right."""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from kernel import objectives
from kernel.builds import Build
from spacearm.core.native import available_levels
from spacearm.robot import forward_kinematics

BUILD = Build(available_levels()[0], 32)


def search() -> Any:
    arm = objectives.thick_arm()
    return objectives.motion_search(BUILD, arm, objectives.CLUTTER, *map(np.array, objectives.AROUND))


def at_once(*calls: Callable[[], Any]) -> list[Any]:
    """What comes of calls made by as many threads at the same time."""
    out: list[Any] = [None] * len(calls)
    gate = threading.Barrier(len(calls))

    def run(i: int) -> None:
        gate.wait()
        out[i] = calls[i]()

    threads = [threading.Thread(target=run, args=(i,)) for i in range(len(calls))]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    return out


@pytest.fixture
def often() -> Any:
    """Threads that take turns as often as Python can."""
    before = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    yield
    sys.setswitchinterval(before)


def test_motions_are_judged_alike_by_one_thread_and_by_many(often: None) -> None:
    shared, rng = search(), np.random.default_rng(0)
    batches = [BUILD.array(rng.uniform(-1, 1, (200, 7 * k))) for k in (1, 2, 3, 4)]
    expected = [shared.judge(rows, k, 0) for k, rows in enumerate(batches, start=1)]
    for _ in range(5):
        calls = [lambda rows=rows, k=k: shared.judge(rows, k, 0) for k, rows in enumerate(batches, start=1)]
        for found, wanted in zip(at_once(*calls), expected, strict=True):
            np.testing.assert_array_equal(found.violation, wanted.violation)
            np.testing.assert_array_equal(found.terms, wanted.terms)


def test_a_search_that_others_ask_meanwhile_finds_the_same(often: None) -> None:
    alone, shared = search(), search()
    objectives.run_motions(alone, 600)
    rows = BUILD.array(np.zeros((50, 14)))

    def ask() -> None:
        for _ in range(20):
            shared.judge(rows, 2, 0)
            shared.best, shared.fallback, shared.evaluations, shared.history, shared.configurations  # noqa: B018

    at_once(lambda: objectives.run_motions(shared, 600), ask, ask)
    found, expected = ([(e.evaluations, e.fitness, e.by) for e in search.history] for search in (shared, alone))
    assert found == expected
    np.testing.assert_array_equal(shared.best.points, alone.best.points)


def test_instants_are_added_while_others_look(often: None) -> None:
    shared, rows = search(), BUILD.array(np.zeros((20, 14)))
    objectives.run_motions(shared, 600)
    at_once(
        lambda: [shared.add_instant(0.1 * i, 0.01) for i in range(5)], lambda: [shared.judge(rows, 2, 0) for _ in range(50)]
    )
    assert shared.best is None or shared.judge(shared.best.points.reshape(1, -1), len(shared.best.points), 0).free[0]


def test_a_callback_that_comes_back_is_refused() -> None:
    shared, said = search(), list[str]()

    def progress(done: int) -> bool:
        try:
            shared.judge(BUILD.array(np.zeros((1, 14))), 2, 0)
        except ValueError as error:
            said.append(str(error))
        return False

    shared.run(evaluations=10**6, seconds=1.0, until_first=False, stall=0, progress=progress)
    assert said == ["called by its own callback"]


def test_a_callback_may_look_at_what_was_found() -> None:
    alone, watched, seen = search(), search(), list[tuple[int, float]]()

    def progress(_: int) -> bool:
        best, history = watched.best, watched.history
        assert (best is None) == (not history)
        seen.append((watched.evaluations, np.inf if best is None else best.fitness))
        return True

    for one, told in ((alone, None), (watched, progress)):
        one.run(evaluations=40_000, seconds=0.0, until_first=False, stall=0, progress=told)
    assert seen == sorted(seen, key=lambda row: (row[0], -row[1]))
    np.testing.assert_array_equal(watched.best.points, alone.best.points)


def test_guesses_looked_at_by_many_threads_are_those_of_one(often: None) -> None:
    arm = objectives.thick_arm()
    pose = forward_kinematics(arm, objectives.AROUND[1])
    made = [objectives.goal_search(BUILD, arm, objectives.CLUTTER, pose, objectives.AROUND[0]) for _ in range(2)]
    at_once(*[lambda: made[0].look(50)] * 4)
    made[1].look(200)
    assert made[0].begun == made[1].begun == 200
    np.testing.assert_array_equal(made[0].differing(16), made[1].differing(16))
    np.testing.assert_array_equal(made[0].missed(300), made[1].missed(300))
