"""Planning is bounded: by its deadline, by limits however wide, by threads that do not start, and by sizes that are refused."""

from __future__ import annotations

import threading
import time
from dataclasses import replace
from itertools import count
from typing import Any

import numpy as np
import pytest

import spacearm as sa
from spacearm.core.errors import ProblemError, RobotError, SceneError, SettingsError
from spacearm.planner import plan_clock
from spacearm.planner import planning as search

ROBOT = sa.load_robot("srs7")
START, GOAL = np.radians([-25, 63, 0, 41, 0, 0, 0]), np.radians([60, 40, 10, 60, 10, 20, 0])
POSTS = [sa.Capsule((x, y, -0.6), (x, y, 1.2), 0.04) for x, y in ((0.82, 0.15), (0.67, -0.12))]
PROBLEM = sa.Problem(ROBOT, POSTS, start=START, goal=GOAL, base="fixed")


def limited(to: float) -> sa.Robot:
    """The arm with joint limits that stand for none."""
    return replace(ROBOT, lower=np.full(7, -to), upper=np.full(7, to))


@pytest.mark.parametrize("to", [1e4, 1e9, 1e16, 1e300])
@pytest.mark.parametrize("goal", [GOAL, sa.PositionGoal((0.58, 0.36, 0.39))], ids=["configuration", "position"])
def test_limits_that_stand_for_none_are_planned_with(to: float, goal: Any) -> None:
    problem = sa.Problem(limited(to), POSTS, start=START, goal=goal, base="fixed")
    made = sa.plan(problem, sa.PlannerSettings(evaluations=1500), rng=0)
    assert made.found
    assert made.trajectory is not None
    assert np.abs(made.trajectory.motion.control_points).max() < 10


def test_trees_end_where_nothing_is_in_reach() -> None:
    """A start without a way out, in a box of a thousand turns to either side."""
    walled = [sa.Sphere((0.9, 0.35, 0.0), 0.3), *POSTS]
    problem = sa.Problem(limited(6e3), walled, start=START, goal=GOAL + 900.0, base="fixed")
    made = sa.plan(problem, sa.PlannerSettings(evaluations=200), rng=0)
    assert made.status in ("found", "not_found", "not_proven", "start_in_collision", "goal_in_collision")


@pytest.mark.parametrize("what", ["start", "goal"])
def test_a_position_where_float32_has_no_digits_is_refused(what: str) -> None:
    far = {"start": START, "goal": GOAL, what: np.full(7, 1e5)}
    problem = sa.Problem(limited(1e16), POSTS, **far, base="fixed")  # it can be proven
    with pytest.raises(ProblemError, match="expected at most 10000 rad"):
        sa.plan(problem)


@pytest.mark.parametrize("what", ["start", "goal"])
def test_a_position_where_float64_has_no_digits_is_refused(what: str) -> None:
    far = {"start": START, "goal": GOAL, what: np.full(7, 1e15)}
    with pytest.raises(ProblemError, match=r"expected at most 1e\+06 rad"):
        sa.Problem(limited(1e16), POSTS, **far, base="fixed")


def test_threads_that_do_not_start_change_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    chosen = sa.PlannerSettings(evaluations=400, islands=5, threads=5)
    expected = sa.plan(PROBLEM, chosen, rng=3)
    left, start = count(), threading.Thread.start

    def refuse(thread: threading.Thread) -> None:
        if next(left) >= 2:
            raise RuntimeError("can't start new thread")
        start(thread)

    monkeypatch.setattr(threading.Thread, "start", refuse)
    found = sa.plan(PROBLEM, chosen, rng=3)
    assert found.trajectory is not None
    assert expected.trajectory is not None
    np.testing.assert_array_equal(found.trajectory.motion.control_points, expected.trajectory.motion.control_points)
    assert found.evaluations == expected.evaluations


class Clock:
    """Time that goes on by a second whenever it is asked for."""

    def __init__(self) -> None:
        self.now = time.perf_counter()

    def perf_counter(self) -> float:
        self.now += 1.0
        return self.now


def failing(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the search find one motion after the other, and every proof say that it collides midway."""
    certify, number = search.certify, count()

    def fails(*args: Any, **options: Any) -> Any:
        made = certify(*args, **options)
        return replace(
            made, status="fails", closest=None if made.closest is None else replace(made.closest, u=0.5, clearance=-1.0)
        )

    def another(_: Any) -> sa.Motion:
        return sa.Motion([START, (START + GOAL) / 2 + 1e-3 * next(number), GOAL])

    monkeypatch.setattr(search, "certify", fails)
    monkeypatch.setattr(search.Islands, "best", property(another))
    monkeypatch.setattr(search.Islands, "motions", lambda _: [another(None) for _ in range(5)])


def test_one_deadline_holds_for_all(monkeypatch: pytest.MonkeyPatch) -> None:
    failing(monkeypatch)
    monkeypatch.setattr(plan_clock, "time", Clock())
    made = sa.plan(PROBLEM, sa.PlannerSettings(time_budget=0.5), rng=0)
    assert made.proofs == 3  # what is always done, and two motions that were found earlier
    assert made.status == "not_proven"
    assert "a longer time_budget" in made.message


def test_without_a_deadline_proofs_are_tried_again(monkeypatch: pytest.MonkeyPatch) -> None:
    failing(monkeypatch)
    made = sa.plan(PROBLEM, sa.PlannerSettings(evaluations=300, proofs=3), rng=0)
    assert made.status == "not_proven"
    assert made.proofs == 3


@pytest.mark.parametrize("goal", [sa.PositionGoal((0.58, 0.36, 0.39)), sa.ConfigurationGoal(GOAL, tolerance=0.3)])
def test_the_first_look_for_a_goal_is_taken_though_time_is_up(monkeypatch: pytest.MonkeyPatch, goal: Any) -> None:
    monkeypatch.setattr(plan_clock, "time", Clock())
    problem = sa.Problem(ROBOT, POSTS, start=START, goal=goal, base="fixed")
    made = sa.plan(problem, sa.PlannerSettings(time_budget=1e-6), rng=0)
    assert made.status in ("found", "not_found", "not_proven", "goal_unreachable")


HUGE = [2**31, 2**63, 10**18, 10**300]
WHOLE = ["goal_candidates", "islands", "threads", "proofs"]


@pytest.mark.parametrize("value", HUGE, ids=lambda v: f"{v:.0e}")
@pytest.mark.parametrize("name", WHOLE)
def test_numbers_that_nothing_can_bear_are_refused(name: str, value: int) -> None:
    with pytest.raises(SettingsError, match=f"{name} is "):
        sa.PlannerSettings(**{name: value})


@pytest.mark.parametrize("name", ["preferred_clearance", "time_budget", "jerk_limit"])
def test_numbers_beyond_float32_are_refused(name: str) -> None:
    with pytest.raises(SettingsError, match=f"{name} is "):
        sa.PlannerSettings(**{name: 1e300})


@pytest.mark.parametrize("value", [1e300, 1e-300])
def test_weights_beyond_float32_are_refused(value: float) -> None:
    with pytest.raises(SettingsError, match="weight tip is "):
        sa.Weights(tip=value)


def test_no_motions_are_judged() -> None:
    swarm = sa.MotionSwarm(PROBLEM, rng=0)
    judged = swarm.judge(swarm.ask()[:0])
    assert [len(judged.fitness), len(judged.free)] == [0, 0]


def test_a_motion_of_thousands_of_points_is_refused() -> None:
    with pytest.raises(ProblemError, match="5000 points, expected at most"):
        sa.Motion(np.zeros((5000, 7)))


@pytest.mark.parametrize("value", ["a", None, [[0.1], [0.1, 0.2]], {}, 1j])
def test_times_that_are_no_numbers_are_refused(value: Any) -> None:
    trajectory = sa.Trajectory(ROBOT, sa.Motion([START, GOAL]))
    for asked in (trajectory.sample, trajectory.base_pose, trajectory.tip, trajectory.time_at, trajectory.motion.sample):
        with pytest.raises(ProblemError, match="expected a number or an array of numbers"):
            asked(value)


@pytest.mark.parametrize("com", [1e300, 1e20])
def test_masses_beyond_measure_are_refused(com: float) -> None:
    bodies = tuple(replace(b, com=(com, 0, 0)) if b.joint == 0 else b for b in ROBOT.bodies)
    with pytest.raises(RobotError, match="beyond measure"):
        sa.Problem(replace(ROBOT, bodies=bodies), POSTS, start=START, goal=GOAL, base="floating")


def test_obstacles_beyond_measure_are_refused() -> None:
    problem = sa.Problem(ROBOT, [sa.Sphere((1e300, 0, 0), 1.0)], start=START, goal=GOAL, base="fixed")
    with pytest.raises(SceneError, match="expected at most 1e"):
        sa.plan(problem, sa.PlannerSettings(evaluations=10), rng=0)
