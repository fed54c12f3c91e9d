"""Parts of the bounds of a floating base, against NumPy and SciPy, and what is reported of its end."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.interpolate
import scipy.spatial.transform
from hypothesis import given
from hypothesis import strategies as st

from spacearm.dynamics import BaseMotion, Momentum
from spacearm.geometry import Scene
from spacearm.motion import Motion, RecordedTrajectory, Trajectory
from spacearm.planner import PoseGoal, Problem, report_base
from spacearm.proof.base_proofs import base_setup_of, begun_base_proof
from spacearm.proof.mechanism import JointMap
from spacearm.proof.polynomial_bounds import PanelPath, outer_eigenvalues
from spacearm.robot import forward_kinematics
from support.drawn_spacecraft import motion_of, spacecraft
from support.floating_cases import blind_path


@given(st.integers(0, 2**32 - 1), st.sampled_from([0.0, 1e-14, 1e-9, 1e-3, 1.0]), st.sampled_from([1e-6, 1.0, 1e9]))
def test_outer_eigenvalues_are_bounded_and_closely_even_where_two_meet(seed: int, apart: float, size: float) -> None:
    rng = np.random.default_rng(seed)
    R = scipy.spatial.transform.Rotation.random(8, random_state=seed % 2**31).as_matrix()
    moments = rng.uniform(0.01, 1, (8, 1)) + np.array([0.0, 0.0, rng.choice([0.0, 1.0])]) + apart * rng.uniform(0, 1, (8, 3))
    H = size * np.einsum("rab,rb,rcb->rac", R, moments, R)
    expected = np.linalg.eigvalsh(H)
    low, high = outer_eigenvalues(H)
    assert (low <= expected[:, 0]).all()
    assert (high >= expected[:, 2]).all()
    np.testing.assert_allclose(np.stack([low, high], axis=1), expected[:, [0, 2]], atol=1e-6 * size * 3)


def test_panels_cut_at_once_are_those_that_are_halved_again_and_again() -> None:
    robot = spacecraft(3)
    whole = PanelPath.of(motion_of(robot, 3), JointMap(robot))
    halvings = np.arange(len(whole.ends)) % 3
    cut = whole.cut(halvings)
    again = [part for row, count in enumerate(halvings) for part in _halved(whole, row, int(count))]
    for name in PanelPath._fields:
        expected = np.concatenate([getattr(part, name) for part in again])
        np.testing.assert_allclose(getattr(cut, name), expected, rtol=1e-12, atol=1e-14, err_msg=name)


def _halved(path: PanelPath, row: int, count: int) -> list[PanelPath]:
    part = PanelPath(*(column[row : row + 1] for column in path))
    for _ in range(count):
        part = part.halves()
    return [part]


@pytest.mark.parametrize("interior", [0, 1, 2, 5, 17, 60])
def test_derivatives_of_a_spline_in_one_go_are_those_one_by_one_and_scipys(interior: int) -> None:
    rng = np.random.default_rng(interior)
    motion = Motion(rng.normal(size=(interior + 2, 3)))
    knots = np.arange(interior + 2) / (interior + 1)
    s = np.concatenate([[-0.5, 0, 1, 1.5], knots, np.nextafter(knots, -1), np.nextafter(knots, 2), rng.random(40)])
    found = motion.derivatives(s, 5)
    for order, values in enumerate(found):
        assert values.tobytes() == motion.sample(s, order).tobytes()
    points = np.concatenate(
        [motion.control_points[:1].repeat(2, 0), motion.control_points, motion.control_points[-1:].repeat(2, 0)]
    )
    spline = scipy.interpolate.BSpline(np.concatenate([np.zeros(5), knots, np.ones(5)]), points, 5)
    at = s.clip(0, 1)
    for values, expected in zip(motion.moved(s), (spline(at), spline(at, 1)), strict=True):
        np.testing.assert_allclose(values, expected, atol=1e-12 * (interior + 1))


@pytest.mark.parametrize("number", range(8))
def test_what_is_reported_of_the_end_is_never_less_than_what_is_there(number: int) -> None:
    rng = np.random.default_rng(number)
    robot = spacecraft(number)
    momentum = Momentum(angular=0.2 * rng.normal(size=3)) if number % 2 else Momentum()
    if number % 4 > 1:  # a path whose rates vanish in Gauss points
        path = blind_path(rng, np.arange(3.0), rng.uniform(-1, 1, (3, robot.dof)))
        trajectory: Trajectory | RecordedTrajectory = RecordedTrajectory(robot, path, momentum=momentum)
    else:
        trajectory = Trajectory(robot, motion_of(robot, number), momentum=momentum)
    wanted = np.eye(4)
    wanted[:3, :3], wanted[:3, 3] = scipy.spatial.transform.Rotation.random(random_state=number).as_matrix(), rng.normal(size=3)
    begin, end = trajectory.sample(0.0).q, trajectory.sample(trajectory.duration).q
    duration = None if momentum.is_zero else trajectory.duration
    problem = Problem(robot, Scene([]), start=begin, goal=PoseGoal(wanted), momentum=momentum, duration=duration, clearance=0.0)
    report = report_base(problem, trajectory)
    assert report.goal_distance is not None
    assert report.goal_angle is not None
    error = begun_base_proof(robot, trajectory, base_setup_of(problem, robot, who="problem")).figures().error
    # Another integration, with a finer tolerance.
    finer = BaseMotion(robot, trajectory.path, momentum=momentum, duration=trajectory.duration, tolerance=1e-13)
    T = finer.placed(np.array(finer.curve.domain[1]), forward_kinematics(robot, end))
    distance = np.linalg.norm(T[:3, 3] - wanted[:3, 3])
    turn = scipy.spatial.transform.Rotation.from_matrix(wanted[:3, :3] @ T[:3, :3].T).magnitude()
    assert distance - 1e-11 <= report.goal_distance <= distance + 20 * error
    assert turn - 1e-11 <= report.goal_angle <= turn + 2.1 * error + 1e-11
    final = scipy.spatial.transform.Rotation.from_quat(finer.pose(finer.curve.domain[1])[1][[1, 2, 3, 0]]).magnitude()
    assert final - 1e-11 <= report.final <= final + 2.1 * error + 1e-11
