"""Whatever is proven is true: of robots, scenes of every shape, self-collision and trajectories that are drawn."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from spacearm.geometry import Scene
from spacearm.motion import AnyTrajectory, PiecewisePath, RecordedTrajectory, Trajectory
from spacearm.proof import certify
from spacearm.robot import Robot
from support import strategies
from support.dense_samples import Setting, arms
from support.drawn_motions import motions_of
from support.drawn_shapes import obstacles
from support.oracles.coal_shapes import least_distances
from support.oracles.pinocchio_points import joint_frames

INSTANTS = 40  # of each of the drawn trajectories
ROUNDING = 1e-7  # [m] Coal's and Pinocchio's, of arms a few metres long
DEPTH = 1e-4  # [m] Coal's, where it measures penetration step by step


@st.composite
def any_trajectories(draw: st.DrawFn, robot: Robot) -> AnyTrajectory:
    """Of ours, and of others: straight from point to point, or by cubics."""
    if draw(st.booleans()):
        return Trajectory(robot, draw(motions_of(robot, most=3)))
    q = np.array(draw(st.lists(strategies.configurations(robot), min_size=2, max_size=40)))
    t = np.concatenate([[0.0], np.cumsum(draw(st.lists(st.floats(0.01, 1), min_size=len(q) - 1, max_size=len(q) - 1)))])
    make = draw(st.sampled_from([PiecewisePath.from_linear, PiecewisePath.from_cubic]))
    return RecordedTrajectory(robot, make(t, q))


def clearances_at(setting: Setting, trajectory: AnyTrajectory, u: np.ndarray) -> np.ndarray:
    """The least clearances at parameters of the curve, by Pinocchio and Coal."""
    return least_distances(setting.robot, setting.scene, joint_frames(setting.robot, trajectory.curve.sample(u)))


@settings(max_examples=40)
@given(st.data(), st.integers(0, 2**32 - 1))
def test_a_certificate_is_true_of_any_robot_scene_and_trajectory(data: st.DataObject, seed: int) -> None:
    robot = data.draw(arms(self_pairs=True))
    minimum = data.draw(st.sampled_from([0.0, 0.0, 0.01]))
    setting = Setting(robot, Scene(data.draw(st.lists(obstacles(), max_size=4))), clearance=minimum)
    trajectory = data.draw(any_trajectories(robot))
    certificate = certify(setting, trajectory, limits=())
    near, minimum = certificate.closest, min([minimum, *(pair.held_to for pair in certificate.near_pairs)])
    if near is None:
        assert not setting.scene.obstacles
        assert not robot.self_pairs
        assert certificate.holds
        return
    measured = float(clearances_at(setting, trajectory, np.array([near.u]))[0])
    u = np.random.default_rng(seed).uniform(*trajectory.curve.domain, INSTANTS)
    if certificate.holds:
        assert certificate.clearance is not None
        least = min([certificate.clearance, *(pair.proven or 0.0 for pair in certificate.near_pairs)])
        assert certificate.clearance > minimum
        assert clearances_at(setting, trajectory, u).min() >= least - ROUNDING
        assert measured >= least - ROUNDING
        if not certificate.near_pairs:
            assert certificate.clearance - minimum >= (near.clearance - minimum) / 2 - ROUNDING
    elif certificate.status == "fails":
        assert measured <= near.required + ROUNDING
        assert measured < near.clearance + DEPTH
        gap = np.linalg.norm(near.points[1] - near.points[0])
        assert abs(gap - abs(near.clearance)) < DEPTH
    else:
        assert near.clearance <= near.required + 1e-3
