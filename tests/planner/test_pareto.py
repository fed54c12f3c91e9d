"""Plans between quick and gentle to the base."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from spacearm.core.errors import ProblemError, SettingsError, SpacearmError
from spacearm.geometry import Sphere
from spacearm.planner import PlannerSettings, Problem, pareto_front, report_base
from spacearm.planner.pareto import not_beaten
from spacearm.robot import load_robot
from support.messages import assert_refused

ROBOT = load_robot("srs7")
START, GOAL = np.array([0, 0, 0, 0.4, 0, 0, 0]), np.array([0.9, 0.3, 0.6, 1.5, -0.5, 0.4, 0.1])
SETTINGS = PlannerSettings(evaluations=800)


def problem(**given: Any) -> Problem:
    """Return a problem of a small spacecraft."""
    return Problem(ROBOT, [Sphere((0.0, 1.2, 0.4), 0.1)], start=START, goal=GOAL, **{"base": "floating", **given})


@pytest.mark.parametrize("measure", ["peak", "final", "rate"])
def test_every_plan_is_proven_and_the_front_falls(measure: Any) -> None:
    told: list[tuple[int, int]] = []
    front = pareto_front(
        problem(), SETTINGS, points=4, measure=measure, rng=3, progress=lambda done, total, _: told.append((done, total))
    )
    assert told == [(0, 4), (1, 4), (2, 4), (3, 4), (4, 4)]
    assert len(front.plans) + front.failed == 4
    assert len(front.plans) >= 2
    for made, duration, disturbance in zip(front.plans, front.durations, front.disturbances, strict=True):
        assert made.found
        assert made.certificate is not None
        assert made.certificate.holds
        assert made.trajectory is not None
        assert made.trajectory.duration == duration
        assert getattr(report_base(made.problem, made.trajectory), measure) == disturbance
        assert made.seed == 3
    assert (np.diff(front.durations) >= 0).all()
    assert len(front.front) == front.best.sum()
    assert (np.diff(front.disturbances[front.best]) <= 0).all()
    quick, gentle = front.disturbances[0], front.disturbances.min()
    assert gentle < 0.9 * quick


def test_the_same_seed_gives_the_same_front() -> None:
    one, other = (pareto_front(problem(), SETTINGS, points=3, rng=1) for _ in range(2))
    np.testing.assert_array_equal(one.durations, other.durations)
    np.testing.assert_array_equal(one.disturbances, other.disturbances)


def test_where_nothing_is_found_the_front_is_empty() -> None:
    blocked = Problem(ROBOT, [Sphere((0.0, 0.0, 0.6), 0.5)], start=START, goal=GOAL, base="floating")
    front = pareto_front(blocked, SETTINGS, points=3)
    assert front.plans == front.front == ()
    assert front.failed == 3


@given(st.lists(st.tuples(st.integers(0, 5), st.integers(0, 5)), max_size=12))
def test_not_beaten_are_those_that_no_other_one_beats(points: list[tuple[int, int]]) -> None:
    expected = [
        not any(x <= a and y <= b and (x < a or y < b) for j, (x, y) in enumerate(points) if j != i)
        for i, (a, b) in enumerate(points)
    ]
    first, second = np.array(points, dtype=float).reshape(-1, 2).T
    assert not_beaten(first, second).tolist() == expected


WRONG: dict[str, tuple[type[SpacearmError], dict[str, Any], dict[str, Any]]] = {
    "fixed base": (ProblemError, {"base": "fixed"}, {}),
    "stated duration": (ProblemError, {"duration": 20.0}, {}),
    "final, and a goal attitude": (ProblemError, {"base_goal": (1, 0, 0, 0)}, {"measure": "final"}),
    "measure mistyped": (SettingsError, {}, {"measure": "peek"}),
    "one point": (SettingsError, {}, {"points": 1}),
}


@pytest.mark.parametrize("case", WRONG)
def test_what_leaves_no_choice_is_refused(case: str) -> None:
    error, given_problem, options = WRONG[case]
    call = lambda: pareto_front(problem(**given_problem), SETTINGS, **options)  # noqa: E731
    assert_refused("plan", f"pareto: {case}", error, call)
