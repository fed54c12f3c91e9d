"""Trajectories: within every limit at every instant, and no slower than that takes."""

from __future__ import annotations

import pickle
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from spacearm.core.errors import ProblemError
from spacearm.dynamics import Momentum
from spacearm.motion import Motion, Trajectory, fastest_duration, limit_margins
from spacearm.robot import Robot, forward_kinematics, load_robot
from support import strategies
from support.drawn_motions import motions_of
from support.messages import assert_refused
from support.small_robots import two_link

ARM = load_robot("zhang2022")
STRAIGHT = Motion([np.zeros(7), np.full(7, 0.1)])
FEWER = settings(max_examples=25)  # robots take their time to draw
SHAPES = pytest.mark.parametrize("shape", [(), (1,), (3, 2), (0,)])


@st.composite
def trajectories(draw: st.DrawFn) -> Trajectory:
    robot = draw(strategies.robots(min_joints=1, max_joints=5))
    return Trajectory(robot, draw(motions_of(robot)))


@FEWER
@given(trajectories(), st.integers(0, 2**32 - 1))
def test_no_limit_is_broken_at_any_of_10000_instants(trajectory: Trajectory, seed: int) -> None:
    robot = trajectory.robot
    t = np.random.default_rng(seed).uniform(0, trajectory.duration, 10_000)
    state = trajectory.sample(t)
    assert (state.q >= robot.lower - 1e-12).all()
    assert (state.q <= robot.upper + 1e-12).all()
    assert (np.abs(state.dq) <= robot.velocity * (1 + 1e-9)).all()
    assert (np.abs(state.ddq) <= robot.acceleration * (1 + 1e-9)).all()
    assert trajectory.limits.holds


@FEWER
@given(trajectories())
def test_some_joint_comes_within_a_percent_of_a_limit(trajectory: Trajectory) -> None:
    assume(trajectory.duration > 1e-6)
    state = trajectory.sample(np.linspace(0, trajectory.duration, 20_001))
    used = np.abs(state.dq) / trajectory.robot.velocity, np.abs(state.ddq) / trajectory.robot.acceleration
    assert max(share.max() for share in used) >= 0.99


@FEWER
@given(trajectories())
def test_rates_and_accelerations_are_those_of_the_positions(trajectory: Trajectory) -> None:
    assume(trajectory.duration > 1e-3)
    t, h = np.linspace(0.1, 0.9, 17) * trajectory.duration, 1e-5 * trajectory.duration
    before, now, after = (trajectory.sample(t + step) for step in (-h, 0, h))
    robot = trajectory.robot
    np.testing.assert_allclose((after.q - before.q) / (2 * h), now.dq, rtol=0, atol=1e-5 * robot.velocity.max())
    np.testing.assert_allclose((after.dq - before.dq) / (2 * h), now.ddq, rtol=0, atol=1e-4 * robot.acceleration.max())


@FEWER
@given(trajectories(), st.floats(1.0, 50.0))
def test_a_longer_duration_is_the_same_path_slower(trajectory: Trajectory, factor: float) -> None:
    slow = Trajectory(trajectory.robot, trajectory.motion, duration=factor * trajectory.duration)
    assert slow.duration == factor * trajectory.duration
    share = np.linspace(0, 1, 33)
    quick, slowed = trajectory.sample(share * trajectory.duration), slow.sample(share * slow.duration)
    np.testing.assert_allclose(slowed.q, quick.q, rtol=0, atol=1e-12)
    np.testing.assert_allclose(slowed.dq * factor, quick.dq, rtol=0, atol=1e-9 * trajectory.robot.velocity.max())
    np.testing.assert_allclose(slowed.ddq * factor**2, quick.ddq, rtol=0, atol=1e-9 * trajectory.robot.acceleration.max())


@FEWER
@given(trajectories())
def test_the_way_back_takes_as_long(trajectory: Trajectory) -> None:
    back = Trajectory(trajectory.robot, Motion(trajectory.motion.control_points[::-1]))
    assert back.duration == pytest.approx(trajectory.duration, rel=1e-9, abs=1e-300)
    t = np.linspace(0, trajectory.duration, 33)
    np.testing.assert_allclose(back.sample(trajectory.duration - t).q, trajectory.sample(t).q, rtol=0, atol=1e-8)


@FEWER
@given(st.data(), st.integers(0, 6))
def test_a_motion_that_does_not_move_takes_no_time_and_can_be_sampled(data: st.DataObject, interior: int) -> None:
    robot = data.draw(strategies.robots(max_joints=4))
    q = data.draw(strategies.configurations(robot))
    trajectory = Trajectory(robot, Motion(np.tile(q, (interior + 2, 1))))
    assert trajectory.duration == 0
    assert trajectory.limits.holds
    state = trajectory.sample([-1.0, 0.0, 5.0])
    np.testing.assert_array_equal(state.q, np.tile(q, (3, 1)))
    assert not state.dq.any()
    assert not state.ddq.any()
    slow = Trajectory(robot, trajectory.motion, duration=2.0)
    assert slow.duration == 2.0
    np.testing.assert_allclose(slow.sample(1.0).q, q, rtol=0, atol=1e-14)


@SHAPES
def test_samples_keep_the_batchs_shape(shape: tuple[int, ...]) -> None:
    for trajectory in (Trajectory(ARM, STRAIGHT), Trajectory(ARM, Motion(np.zeros((2, 7))))):
        t = np.full(shape, 0.2)
        assert all(values.shape == (*shape, 7) for values in trajectory.sample(t))
        assert trajectory.tip(t).shape == (*shape, 4, 4)
        position, q_wxyz = trajectory.base_pose(t)
        assert (position.shape, q_wxyz.shape) == ((*shape, 3), (*shape, 4))


@FEWER
@given(trajectories())
def test_before_and_after_the_arm_rests_at_the_ends(trajectory: Trajectory) -> None:
    state = trajectory.sample([-1.0, trajectory.duration + 1.0])
    np.testing.assert_array_equal(state.q, trajectory.motion.control_points[[0, -1]])
    np.testing.assert_allclose(state.dq, 0, atol=1e-9)
    np.testing.assert_allclose(state.ddq, 0, atol=1e-9 * trajectory.robot.acceleration.max())


@FEWER
@given(trajectories())
def test_the_tip_is_where_forward_kinematics_puts_it(trajectory: Trajectory) -> None:
    t = np.linspace(0, trajectory.duration, 6).reshape(3, 2)
    q = trajectory.sample(t).q
    np.testing.assert_array_equal(trajectory.tip(t), forward_kinematics(trajectory.robot, q))
    frame = trajectory.robot.frames[0].name
    np.testing.assert_array_equal(trajectory.tip(t, frame=frame), forward_kinematics(trajectory.robot, q, frame=frame))


def test_a_fixed_base_stays_where_it_is() -> None:
    position, q_wxyz = Trajectory(ARM, STRAIGHT).base_pose([0.0, 0.3])
    np.testing.assert_array_equal(position, np.zeros((2, 3)))
    np.testing.assert_array_equal(q_wxyz, [[1, 0, 0, 0]] * 2)


def test_a_single_joint_has_the_textbooks_duration() -> None:
    """The quintic's greatest rate is 15/8 and its greatest acceleration 10/sqrt(3), over 1 in unit time."""
    slow_turner: dict[str, Any] = {"velocity": (1, 1e-2), "acceleration": (1, 1e9)}
    robot = two_link(**slow_turner)
    assert fastest_duration(robot, Motion([[0, 0], [0, 1]])) == pytest.approx(100 * 15 / 8, rel=2e-3)
    heavy = two_link(velocity=(1e9, 1e9), acceleration=(4.0, 4.0))
    assert fastest_duration(heavy, Motion([[0, 0], [0, 1]])) == pytest.approx((10 / 3**0.5 / 4) ** 0.5, rel=2e-3)


def test_margins_tell_how_far_a_joint_stays_inside() -> None:
    robot = two_link()
    margins = limit_margins(robot, Motion([[0, 0], [0.25, -1.5]]), 100.0)
    np.testing.assert_allclose(margins.position, [0.75, 0.5], rtol=0, atol=1e-12)
    np.testing.assert_allclose(margins.velocity, np.array([0.25, 1.5]) * 15 / 8 / 100, rtol=5e-3)
    assert margins.holds
    assert not limit_margins(robot, Motion([[0, 0], [0.25, -1.5]]), 1.0).holds
    assert not limit_margins(robot, Motion([[0, 0], [1.25, -1.5]]), 100.0).holds


@FEWER
@given(trajectories())
def test_a_trajectory_survives_pickle(trajectory: Trajectory) -> None:
    again = pickle.loads(pickle.dumps(trajectory))
    assert again == trajectory
    assert again.duration == trajectory.duration


def test_a_files_last_digit_below_the_fastest_duration_is_set_onto_it() -> None:
    fastest = Trajectory(ARM, STRAIGHT).duration
    for digits in (10, 12):
        assert Trajectory(ARM, STRAIGHT, duration=float(f"{fastest:.{digits}g}")).duration >= fastest


def turned(robot: Robot = ARM, **changes: Any) -> Any:
    return lambda: Trajectory(robot, STRAIGHT, **changes)


def bent(joint: int, value: float) -> Any:
    points = np.zeros((3, 7))
    points[1, joint] = value
    return lambda: Trajectory(ARM, Motion(points))


REFUSED: dict[str, Any] = {
    "control points none": lambda: Motion([]),
    "control points one": lambda: Motion([[0.0, 1.0]]),
    "control points of no joint": lambda: Motion(np.zeros((2, 0))),
    "control points flat": lambda: Motion([0.0, 1.0]),
    "control points NaN": lambda: Motion([[0.0, 1.0], [np.nan, 0.0]]),
    "control points infinite": lambda: Motion([[0.0, 1.0], [0.0, np.inf]]),
    "control points of different lengths": lambda: Motion([[0.0, 1.0], [0.0]]),
    "control points text": lambda: Motion("home"),
    "control points None": lambda: Motion(None),  # type: ignore[arg-type]
    "another robot's motion": turned(two_link()),
    "duration too short": turned(duration=0.1),
    "duration zero": turned(duration=0),
    "duration negative": turned(duration=-1.0),
    "duration NaN": turned(duration=np.nan),
    "duration infinite": turned(duration=np.inf),
    "duration vast": turned(duration=1e300),
    "limits next to nothing": lambda: Trajectory(replace(ARM, velocity=[1e-300] * 7), Motion(np.outer([0.0, 0.1], np.ones(7)))),
    "duration text": turned(duration="1 s"),
    "base mistyped": turned(base="Fixed"),
    "base_start no transform": turned(base_start=np.ones((4, 4))),
    "momentum of a fixed base": turned(base="fixed", momentum=Momentum(angular=(0.0, 0.0, 1.0))),
    "momentum a list": turned(base="floating", momentum=[0.0, 0.0, 1.0]),
    "bent beyond the upper limit": bent(3, 9.0),
    "bent beyond the lower limit": bent(1, -2.0),
}


@pytest.mark.parametrize("case", REFUSED)
def test_motions_and_trajectories_that_cannot_be_are_refused(case: str) -> None:
    assert_refused("motion", case, ProblemError, REFUSED[case])


def test_limits_that_change_are_noticed() -> None:
    weak = replace(ARM, velocity=ARM.velocity / 2)
    duration = Trajectory(ARM, STRAIGHT).duration
    with pytest.raises(ProblemError, match="faster breaks"):
        Trajectory(weak, STRAIGHT, duration=duration / 2)
