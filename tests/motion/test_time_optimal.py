"""Time-optimal trajectories: never beyond a limit, never slower than uniform, close to toppra's own optimum."""

from __future__ import annotations

from dataclasses import replace
from importlib import import_module
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spacearm.core.errors import ProblemError, SettingsError, SpacearmError
from spacearm.motion import Motion, TimeLaw, Trajectory, fastest_duration, resampled, time_optimal
from spacearm.motion.time_laws import over_time
from spacearm.robot import Robot, load_robot
from support import strategies
from support.drawn_motions import is_continuous, motions_of
from support.messages import assert_refused
from support.small_robots import two_link

MODULE = import_module(time_optimal.__module__)  # the package's attribute of this name is the function
ARM = load_robot("zhang2022")
FEW = settings(max_examples=15)  # each is a whole optimisation


def lively(robot: Robot) -> Robot:
    """The robot with accelerations high enough that its rates matter too."""
    return replace(robot, acceleration=5 * robot.velocity)


def wandering(seed: int, interior: int = 2) -> Motion:
    rng = np.random.default_rng(seed)
    begin, end = rng.uniform(-1.5, 1.5, (2, 7))
    points = begin + (end - begin) * np.linspace(0, 1, interior + 2)[:, None]
    points[1:-1] += rng.normal(scale=0.3, size=(interior, 7))
    return Motion(np.clip(points, ARM.lower, ARM.upper))


def assert_within_limits(trajectory: Trajectory, jerk_limit: np.ndarray | float | None = None) -> None:
    """By hulls, at random instants, and by the hulls of the one polynomial in time that all of it is."""
    robot = trajectory.robot
    margins = trajectory.margins(jerk_limit=jerk_limit)
    assert margins.holds
    if trajectory.duration < 1e-3:
        return
    t = np.random.default_rng(0).uniform(0, trajectory.duration, 20_000)
    state = trajectory.sample(t)
    assert (np.abs(state.dq) <= robot.velocity * (1 + 1e-9)).all()
    assert (np.abs(state.ddq) <= robot.acceleration * (1 + 1e-9)).all()
    path = trajectory.path
    for derivative, limit in enumerate((robot.velocity, robot.acceleration), start=1):
        _, low, high = path.hulls(derivative, bisections=6)
        assert (np.maximum(-low, high).max(axis=0) <= limit * (1 + 1e-3)).all()
    if jerk_limit is not None:
        jerk = over_time(trajectory.motion, trajectory.time_law or TimeLaw.uniform(), trajectory.duration, 3)
        assert (np.abs(jerk.sample(t)) <= jerk_limit * (1 + 1e-6)).all()


def assert_smooth_from_rest_to_rest(trajectory: Trajectory) -> None:
    ends = trajectory.sample([0.0, trajectory.duration])
    np.testing.assert_array_equal(ends.q, trajectory.motion.control_points[[0, -1]])
    np.testing.assert_allclose(ends.dq, 0, atol=1e-9 * trajectory.robot.velocity.max())
    np.testing.assert_allclose(ends.ddq, 0, atol=1e-9 * trajectory.robot.acceleration.max())
    if trajectory.time_law is not None:
        assert is_continuous(trajectory.time_law.path, 2)


@FEW
@given(st.data())
def test_any_motion_of_any_robot_is_run_within_its_limits_and_no_slower_than_uniformly(data: st.DataObject) -> None:
    robot = data.draw(strategies.robots(min_joints=1, max_joints=4))
    motion = data.draw(motions_of(robot))
    trajectory = time_optimal(robot, motion)
    assert_within_limits(trajectory)
    assert_smooth_from_rest_to_rest(trajectory)
    assert trajectory.duration <= fastest_duration(robot, motion)
    assert len(trajectory.notes) == 1


@settings(max_examples=8)
@given(st.data())
def test_so_it_is_with_a_limit_on_jerk(data: st.DataObject) -> None:
    robot = data.draw(strategies.robots(min_joints=1, max_joints=3))
    motion = data.draw(motions_of(robot, most=2))
    jerk_limit = np.array([data.draw(st.floats(0.1, 100.0)) for _ in range(robot.dof)])
    trajectory = time_optimal(robot, motion, jerk_limit=jerk_limit)
    assert_within_limits(trajectory, jerk_limit)
    assert_smooth_from_rest_to_rest(trajectory)
    assert trajectory.duration <= fastest_duration(robot, motion, jerk_limit=jerk_limit)
    assert trajectory.duration >= time_optimal(robot, motion).duration * (1 - 0.02)


@pytest.mark.parametrize("interior", [0, 2, 5])
def test_it_saves_time_and_comes_within_2_percent_of_toppras_own_optimum(interior: int) -> None:
    from toppra.algorithm import TOPPRA
    from toppra.constraint import JointAccelerationConstraint, JointVelocityConstraint
    from toppra.interpolator import SplineInterpolator

    robot, motion = lively(ARM), wandering(interior, interior)
    trajectory = time_optimal(robot, motion)
    assert_within_limits(trajectory)
    # The same path for toppra, with knots so close that it is the same to its eyes.
    share = np.linspace(0, 1, 401)
    arc = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(motion.sample(share), axis=0), axis=1))])
    knots = np.interp(np.linspace(0, arc[-1], 101), arc, share)
    path = SplineInterpolator(np.linspace(0, 1, 101), motion.sample(knots))
    constraints = [JointVelocityConstraint(robot.velocity), JointAccelerationConstraint(robot.acceleration)]
    optimum = TOPPRA(constraints, path, gridpoints=np.linspace(0, 1, 401), solver_wrapper="seidel").compute_trajectory(0, 0)
    assert trajectory.duration <= 1.02 * optimum.duration
    assert trajectory.duration >= 0.98 * optimum.duration  # faster than the optimum would be a broken limit
    assert trajectory.duration <= 0.85 * fastest_duration(robot, motion)


def test_a_straight_motion_of_one_joint_takes_the_textbooks_time() -> None:
    """Bang-bang: 2 sqrt(distance / acceleration); and with a rate that is reached, distance / rate + rate / acceleration."""
    quick = two_link(velocity=(1e3, 1e3), acceleration=(4.0, 4.0))
    motion = Motion([[0, 0], [0, 1]])
    assert time_optimal(quick, motion).duration == pytest.approx(2 * (1 / 4) ** 0.5, rel=0.015)
    slow = two_link(velocity=(0.5, 0.5), acceleration=(4.0, 4.0))
    assert time_optimal(slow, motion).duration == pytest.approx(1 / 0.5 + 0.5 / 4, rel=0.015)


def test_a_straight_motion_of_one_joint_takes_the_textbooks_time_under_a_jerk_limit() -> None:
    """Of the third order alone: 4 cbrt(distance / (2 jerk))."""
    robot = two_link(velocity=(1e3, 1e3), acceleration=(1e3, 1e3))
    motion = Motion([[0, 0], [0, 1]])
    best = 4 * (1 / (2 * 7.0)) ** (1 / 3)
    duration = time_optimal(robot, motion, jerk_limit=7.0).duration
    assert best * (1 - 1e-6) <= duration <= 1.1 * best
    assert fastest_duration(robot, motion, jerk_limit=7.0) > 1.2 * best


def test_a_looser_jerk_limit_is_never_slower_by_more_than_the_searches_slack() -> None:
    robot, motion = lively(ARM), wandering(3)
    durations = [time_optimal(robot, motion, jerk_limit=factor * robot.acceleration).duration for factor in (2, 10, 100, 1000)]
    free = time_optimal(robot, motion).duration
    for tight, loose in zip(durations, [*durations[1:], free], strict=True):
        assert loose <= 1.02 * tight
    assert durations[-1] <= 1.02 * free


def test_there_and_back_at_once_where_all_joints_turn_around() -> None:
    motion = Motion([[0.0, 0.0], [0.5, 0.5], [0.0, 0.0]])  # all rates vanish together in the middle
    robot = two_link(velocity=(2.0, 2.0), acceleration=(3.0, 3.0))
    trajectory = time_optimal(robot, motion)
    assert_within_limits(trajectory)
    assert trajectory.duration < fastest_duration(robot, motion)


def test_it_is_the_same_every_time() -> None:
    robot, motion = lively(ARM), wandering(5)
    for jerk_limit in (None, 20.0):
        once, twice = (time_optimal(robot, motion, jerk_limit=jerk_limit) for _ in range(2))
        assert once == twice
        assert once.duration == twice.duration


def test_a_motion_that_does_not_move_takes_no_time() -> None:
    trajectory = time_optimal(ARM, Motion(np.zeros((3, 7))), jerk_limit=1.0)
    assert trajectory.duration == 0
    assert trajectory.time_law is None


@pytest.mark.parametrize("size", [1e-9, 1e-3, 1e6])
def test_size_does_not_matter(size: float) -> None:
    wide = two_link(lower=(-1e9, -1e9), upper=(1e9, 1e9), velocity=(1e9, 1e9), acceleration=(3.0, 3.0))
    ratio = [
        time_optimal(wide, motion).duration / fastest_duration(wide, motion)
        for motion in (
            Motion([[0.0, 0.0], [0.5, -0.2], [1.0, 0.0]]),
            Motion([[0.0, 0.0], [0.5 * size, -0.2 * size], [size, 0.0]]),
        )
    ]
    assert ratio[0] == pytest.approx(ratio[1], rel=1e-3)


def test_without_toppras_law_there_is_another(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(MODULE, "toppra_law", lambda *_args, **_settings: None)
    robot, motion = lively(ARM), wandering(4)
    trajectory = time_optimal(robot, motion)
    assert_within_limits(trajectory)
    assert trajectory.duration < 0.95 * fastest_duration(robot, motion)
    assert "linear programmes" in trajectory.notes[0]


def test_where_no_law_is_quicker_the_uniform_one_is_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(MODULE, "fastest_duration_of_law", lambda *_args, **_settings: 1e9)
    robot, motion = lively(ARM), wandering(4)
    for jerk_limit in (None, 10.0):
        trajectory = time_optimal(robot, motion, jerk_limit=jerk_limit)
        assert trajectory.time_law is None
        assert trajectory.duration == fastest_duration(robot, motion, jerk_limit=jerk_limit)
        assert "uniform" in trajectory.notes[0]


@FEW
@given(st.floats(1.0, 1000.0))
def test_resampled_rows_are_the_trajectory_from_rest_to_rest(rate_hz: float) -> None:
    trajectory = Trajectory(lively(ARM), wandering(1))
    samples = resampled(trajectory, rate_hz=rate_hz)
    np.testing.assert_allclose(np.diff(samples.t), 1 / rate_hz, rtol=1e-9)
    assert samples.t[0] == 0
    assert trajectory.duration * (1 - 1e-9) <= samples.t[-1] < trajectory.duration + 1 / rate_hz
    for values, expected in zip(samples[1:], trajectory.sample(samples.t), strict=True):
        np.testing.assert_array_equal(values, expected)
    np.testing.assert_allclose(samples.q[-1], trajectory.motion.control_points[-1], atol=1e-12)
    again = resampled(trajectory, dt=1 / rate_hz)
    np.testing.assert_array_equal(again.q, samples.q)


@pytest.mark.parametrize("parts", [1, 7, 1000])
def test_a_step_that_divides_the_duration_ends_on_it(parts: int) -> None:
    trajectory = Trajectory(lively(ARM), wandering(1))
    samples = resampled(trajectory, dt=trajectory.duration / parts)
    assert len(samples.t) == parts + 1
    assert samples.t[-1] == pytest.approx(trajectory.duration, rel=1e-12)


def test_even_the_longest_step_reaches_the_end() -> None:
    trajectory = Trajectory(lively(ARM), wandering(1))
    for steps in ({"dt": 1e300}, {"rate_hz": 1e-310}):
        samples = resampled(trajectory, **steps)
        np.testing.assert_array_equal(samples.q, trajectory.motion.control_points[[0, -1]])
    still = Trajectory(ARM, Motion(np.zeros((2, 7))))
    assert len(resampled(still, dt=0.1).t) == 1


STRAIGHT = Motion([np.zeros(7), np.full(7, 0.1)])
TRAJECTORY = Trajectory(ARM, STRAIGHT)
REFUSED: dict[str, tuple[type[SpacearmError], Any]] = {
    "optimal for another robot": (ProblemError, lambda: time_optimal(two_link(), STRAIGHT)),
    "optimal with a jerk limit below 0": (ProblemError, lambda: time_optimal(ARM, STRAIGHT, jerk_limit=-1)),
    "optimal with a jerk limit NaN": (ProblemError, lambda: time_optimal(ARM, STRAIGHT, jerk_limit=np.nan)),
    "optimal on no grid": (SettingsError, lambda: time_optimal(ARM, STRAIGHT, gridpoints=1)),
    "optimal of no pieces": (SettingsError, lambda: time_optimal(ARM, STRAIGHT, pieces=0.5)),  # type: ignore[arg-type]
    "resampled at no rate": (SettingsError, lambda: resampled(TRAJECTORY)),
    "resampled at two rates": (SettingsError, lambda: resampled(TRAJECTORY, dt=0.1, rate_hz=10)),
    "resampled at rate zero": (SettingsError, lambda: resampled(TRAJECTORY, rate_hz=0)),
    "resampled at a rate in words": (SettingsError, lambda: resampled(TRAJECTORY, rate_hz="fast")),  # type: ignore[arg-type]
    "resampled endlessly": (SettingsError, lambda: resampled(TRAJECTORY, dt=1e-9)),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_optimised_or_sampled_is_refused(case: str) -> None:
    error, call = REFUSED[case]
    assert_refused("motion", case, error, call)
