"""Clearances of a report, beside Coal's, pair by pair; of motions that are proven, and of those that collide."""

from __future__ import annotations

import numpy as np
import pytest

import spacearm as sa
from spacearm.core.rotations import matrix_of
from spacearm.motion import AnyTrajectory
from spacearm.report.report_clearance import MOST_PAIRS, MeasuredMotion
from support.drawn_claims import drawn_claim
from support.oracles.pinocchio_points import joint_frames
from support.pair_distances import distances

Array = np.ndarray

TOUCHING = 1e-4  # [m] what is nearer may be told as 0 or less by the native measurement


def placed(trajectory: AnyTrajectory, t: Array) -> Array:
    """T_w_joint (m, j + 1, 4, 4), the last for the base."""
    position, attitude = trajectory.base_pose(t)
    base = np.tile(np.eye(4), (len(t), 1, 1, 1))
    base[:, 0, :3, :3], base[:, 0, :3, 3] = matrix_of(attitude), position
    return np.concatenate([base @ joint_frames(trajectory.robot, trajectory.sample(t).q), base], axis=1)


@pytest.mark.parametrize("floating", [False, True], ids=["fixed", "floating"])
@pytest.mark.parametrize("seed", range(12))
def test_the_least_clearance_and_each_pairs_are_coals(seed: int, floating: bool) -> None:
    drawn = drawn_claim(seed, floating=floating)
    motion = MeasuredMotion(drawn.scene, drawn.trajectory)
    t = np.linspace(0, drawn.trajectory.duration, 40)
    by_pair = {
        frozenset(name.split("'")[1] if "'" in name else name for name in pair): values
        for pair, values in distances(drawn.robot, drawn.scene, placed(drawn.trajectory, t))
    }
    if not by_pair:
        assert motion.is_free
        return
    found, least = motion.over(t), np.min(list(by_pair.values()), axis=0)
    apart = least > TOUCHING
    np.testing.assert_allclose(found.least[apart], least[apart], atol=1e-6)
    assert (found.least[~apart] <= 2 * TOUCHING).all()
    assert found.pairs == len(by_pair)
    for name, values in zip(found.names, found.values.T, strict=True):
        true = by_pair[frozenset(name.split(" - "))]
        np.testing.assert_allclose(values[true > TOUCHING], true[true > TOUCHING], atol=1e-6)
    nearest = sorted(float(values.min()) for values in by_pair.values())[:MOST_PAIRS]
    told = sorted(found.values.min(axis=0).tolist())
    np.testing.assert_allclose(np.maximum(told, TOUCHING), np.maximum(nearest, TOUCHING), atol=2e-2)  # chosen at other instants


@pytest.mark.parametrize("seed", range(6))
def test_the_closest_pairs_points_are_as_far_apart_as_it_says(seed: int) -> None:
    drawn = drawn_claim(seed, floating=bool(seed % 2))
    motion = MeasuredMotion(drawn.scene, drawn.trajectory)
    if motion.is_free:
        return
    t = np.linspace(0, drawn.trajectory.duration, 25)
    found = motion.closest(t)
    between = np.linalg.norm(found.points[:, 0] - found.points[:, 1], axis=1)
    np.testing.assert_allclose(between, np.abs(found.distance), atol=1e-5)
    least = np.min([values for _, values in distances(drawn.robot, drawn.scene, placed(drawn.trajectory, t))], axis=0)
    np.testing.assert_allclose(found.distance[least > TOUCHING], least[least > TOUCHING], atol=1e-6)
    assert all(name.count(" - ") == 1 for name in found.names)
    assert found.pair.max() < len(found.names)


def test_what_is_told_is_what_clearance_tells() -> None:
    robot = sa.load_robot("zhang2022")
    begin, end = np.zeros(robot.dof), np.full(robot.dof, 0.2)
    balls = [sa.Sphere([0.4, 0.3, 0.9], 0.05, name="buoy"), sa.Sphere([-0.5, 0.2, 0.7], 0.1)]
    problem = sa.Problem(robot, balls, start=begin, goal=end)
    trajectory = sa.Trajectory(robot, sa.Motion([begin, end]))
    t = np.linspace(0, trajectory.duration, 30)
    found = MeasuredMotion(problem.scene, trajectory).over(t)
    np.testing.assert_allclose(found.least, sa.clearance(problem, trajectory.sample(t).q), atol=1e-9)
    assert any("buoy" in name for name in found.names)
    assert any("obstacle 1" in name for name in found.names)


def test_links_that_cannot_meet_are_left_out() -> None:
    robot = sa.load_robot("srs7")
    begin, end = np.zeros(robot.dof) + 0.1, np.full(robot.dof, 0.5)
    trajectory = sa.Trajectory(robot, sa.Motion([begin, end]))
    motion = MeasuredMotion(sa.Scene(), trajectory)
    assert motion.is_free == (not robot.self_pairs)
    if robot.self_pairs:
        kept = {frozenset(pair) for pair in robot.self_pairs}
        assert {frozenset(name.split(" - ")) for name in motion.over(np.array([0.0])).names} <= kept
