"""A plan that is watched: what is told while it searches, that it is the same plan, and that the watcher may end it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import spacearm as sa
from spacearm.files import load_problem_file
from spacearm.planner.plan_result import SearchState

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
TRUSS = load_problem_file(EXAMPLES / "03_truss.yaml")


@pytest.mark.parametrize(("islands", "threads"), [(1, 1), (3, 2)])
def test_a_plan_that_is_watched_is_the_same(islands: int, threads: int) -> None:
    settings = replace(TRUSS.settings, evaluations=40_000, islands=islands, threads=threads)
    seen: list[SearchState] = []
    watched = sa.plan(TRUSS.problem, settings, rng=1, watch=seen.append)
    alone = sa.plan(TRUSS.problem, settings, rng=1)
    assert watched.trajectory == alone.trajectory
    assert [entry.fitness for entry in watched.history] == [entry.fitness for entry in alone.history]
    fitness = [state.fitness for state in seen]
    assert fitness == sorted(fitness, reverse=True)
    assert all((state.motion is None) == np.isinf(state.fitness) for state in seen)
    for state in seen:
        if state.motion is not None:
            np.testing.assert_allclose(state.motion.control_points[0], TRUSS.problem.start, atol=1e-6)


@pytest.mark.parametrize(("islands", "threads"), [(1, 1), (3, 2)])
def test_a_watcher_ends_the_search_with_the_best_motion_so_far(islands: int, threads: int) -> None:
    def look(state: SearchState) -> None:
        if state.motion is not None:
            raise KeyboardInterrupt

    settings = sa.PlannerSettings(time_budget=60.0, islands=islands, threads=threads)
    plan = sa.plan(TRUSS.problem, settings, rng=1, watch=look)
    assert plan.interrupted
    assert plan.found
    assert plan.timings["total"] < 60


def test_what_a_watcher_raises_is_passed_on() -> None:
    def look(_: SearchState) -> None:
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        sa.plan(TRUSS.problem, sa.PlannerSettings(time_budget=60.0), rng=1, watch=look)
