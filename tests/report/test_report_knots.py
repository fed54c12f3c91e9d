"""Knots of a report: the cubics between them place the robot where the trajectory does, in the numbers that the page has."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from spacearm.motion import AnyTrajectory, Motion, PiecewisePath, RecordedTrajectory, Trajectory
from spacearm.report.report_knots import MOST_KNOTS, hermite_knots, knots_of
from spacearm.robot import Robot, load_robot
from support.drawn_claims import drawn_claim
from support.drawn_trajectories import drawn_case
from support.oracles.pinocchio_points import joint_frames
from support.report_pages import on_page, unpacked

Array = np.ndarray

NEAR = 1e-5  # [m]


def tips(robot: Robot, q: Array, T_w_b: Array) -> Array:
    tip = robot.frame(robot.tip)
    frames = joint_frames(robot, q)[:, tip.joint] if tip.joint >= 0 else np.eye(4)
    return T_w_b @ frames @ tip.T_joint_frame


def furthest(trajectory: AnyTrajectory, knots: dict[str, Any]) -> float:
    """How far the tip is from where the trajectory has it, at most, in its place [m] or the columns of its rotation."""
    rng = np.random.default_rng(3)
    at = np.sort(np.concatenate([[0.0, trajectory.duration], rng.uniform(0, trajectory.duration, 700)]))
    drawn = tips(trajectory.robot, *on_page(knots, trajectory.robot, at))
    return float(np.abs(drawn - trajectory.tip(at)).max())


@pytest.mark.parametrize("floating", [False, True], ids=["fixed", "floating"])
@pytest.mark.parametrize("seed", range(8))
def test_the_tip_is_drawn_where_the_trajectory_has_it(seed: int, floating: bool) -> None:
    trajectory = drawn_claim(seed, floating=floating).trajectory
    notes: list[str] = []
    knots = knots_of(trajectory, notes)
    assert not notes
    assert furthest(trajectory, knots) < NEAR
    assert ("base" in knots) == floating


@pytest.mark.parametrize("number", [*range(22), 24, 26, 29])  # those between are refused as they are drawn
def test_time_laws_kinks_and_stairs_are_drawn_too(number: int) -> None:
    trajectory = drawn_case(7, number).trajectory
    notes: list[str] = []
    knots = knots_of(trajectory, notes)
    size = float(np.abs(trajectory.sample(np.linspace(0, trajectory.duration, 50)).q).max())
    assert furthest(trajectory, knots) < NEAR * max(1.0, size / 100) or notes


def test_a_kink_is_two_knots_at_the_same_time() -> None:
    robot = load_robot("zhang2022")
    rows = np.zeros((3, robot.dof))
    rows[1, 0] = 0.5
    trajectory = RecordedTrajectory(robot, PiecewisePath.from_linear([0, 1, 3], rows))
    t, x, dx = hermite_knots(trajectory, [])
    assert t.tolist() == [0, 1, 1, 3]
    np.testing.assert_allclose(x[:, 0], [0, 0.5, 0.5, 0])
    np.testing.assert_allclose(dx[:, 0], [0.5, 0.5, -0.25, -0.25], atol=1e-12)


def test_a_motion_that_takes_no_time_is_one_knot() -> None:
    robot = load_robot("zhang2022")
    q = np.full(robot.dof, 0.2)
    trajectory = Trajectory(robot, Motion([q, q]))
    assert trajectory.duration == 0
    knots = knots_of(trajectory, [])
    assert unpacked(knots["t"], -1).tolist() == [0.0]
    np.testing.assert_allclose(unpacked(knots["q"], 1, -1)[0], q, atol=1e-7)


@pytest.mark.parametrize("duration", [1e-5, 1e8])
def test_very_short_and_very_long_motions_have_few_knots(duration: float) -> None:
    robot = load_robot("zhang2022")
    begin, end = np.full(robot.dof, 0.1), np.full(robot.dof, 0.3)
    path = PiecewisePath.from_cubic([0, duration], [begin, end], [0 * begin, 0 * begin])
    trajectory = RecordedTrajectory(robot, path)
    knots = knots_of(trajectory, [])
    assert len(unpacked(knots["t"], -1)) < 40
    assert furthest(trajectory, knots) < NEAR


def test_a_long_recording_is_thinned_out_and_says_so() -> None:
    robot = load_robot("zhang2022")
    t = np.linspace(0, 60, 20_001)
    q = 0.3 * np.sin(t[:, None] / 7 + np.arange(robot.dof))
    trajectory = RecordedTrajectory(robot, PiecewisePath.from_linear(t, q))
    notes: list[str] = []
    knots = knots_of(trajectory, notes)
    assert len(unpacked(knots["t"], -1)) <= MOST_KNOTS
    assert "20,000 pieces" in notes[0]
    assert furthest(trajectory, knots) < 1e-4


def test_joints_that_turn_far_have_more_digits() -> None:
    robot = load_robot("zhang2022")
    rows = np.full((2, robot.dof), 3e5)
    rows[1] += 0.4
    trajectory = RecordedTrajectory(robot, PiecewisePath.from_cubic([0, 2], rows, 0 * rows))
    knots = knots_of(trajectory, [])
    assert knots["q"].startswith("f64:")
    assert furthest(trajectory, knots) < NEAR
