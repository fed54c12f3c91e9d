"""Whether goal configurations are sound, by Pinocchio and Coal."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pinocchio as pin

from spacearm.planner import PoseGoal, PositionGoal, Problem
from spacearm.planner.inverse_kinematics import GoalConfigurations
from spacearm.robot import Robot
from support.oracles.coal_shapes import least_distances
from support.oracles.pinocchio_model import full_q, pinocchio_model
from support.oracles.pinocchio_points import joint_frames as pinocchio_frames

# Goals are checked against each other's kinematics; both round in the 16th digit, over a metre or so.
ROUNDING = 1e-9


def missed(robot: Robot, goal: Any, q: np.ndarray) -> tuple[float, float]:
    """By how much q (n,) misses a goal in space: distance [m] and angle [rad], by Pinocchio."""
    model, frames = pinocchio_model(robot)
    placed = model.createData()
    pin.framesForwardKinematics(model, placed, full_q(robot, q))
    T = placed.oMf[frames[goal.frame or robot.tip]]
    distance = float(np.linalg.norm(T.translation - goal.position))
    if isinstance(goal, PositionGoal):
        return distance, 0.0
    R_goal = goal.pose[:3, :3]
    if goal.free_axis is None:
        return distance, float(np.linalg.norm(pin.log3(R_goal.T @ T.rotation)))
    a, b = T.rotation @ goal.free_axis, R_goal @ goal.free_axis
    return distance, math.atan2(float(np.linalg.norm(np.cross(a, b))), float(a @ b))


def tolerances(goal: Any) -> tuple[float, float]:
    return (goal.tolerance, 0.0) if isinstance(goal, PositionGoal) else (goal.position_tolerance, goal.orientation_tolerance)


def assert_sound(problem: Problem, found: GoalConfigurations) -> None:
    """What was found is within the limits, free by Coal, distinct, nearest first, and reaches the goal by Pinocchio."""
    robot, q = problem.robot, found.q
    assert q.shape == (len(q), robot.dof)
    assert ((q >= robot.lower) & (q <= robot.upper)).all()
    away = np.linalg.norm(q - problem.start, axis=1)
    assert (np.diff(away) >= 0).all()
    if len(q):
        by_coal = least_distances(robot, problem.scene, pinocchio_frames(robot, q))
        assert (by_coal > 0).all()
        np.testing.assert_allclose(found.clearance, by_coal, rtol=0, atol=1e-6)
    if isinstance(problem.goal, (PositionGoal, PoseGoal)):
        for row in q:
            for error, tolerance in zip(missed(robot, problem.goal, row), tolerances(problem.goal), strict=True):
                assert error <= tolerance + ROUNDING
        apart = np.abs(q[:, None] - q[None]).max(axis=-1) + 10 * np.eye(len(q))
        assert (apart > 0.1).all()
    assert (found.closest is None) == bool(len(q))


def goal_at(T: np.ndarray, kind: str, **options: Any) -> Any:
    """A goal in space at a pose (4, 4)."""
    if kind == "position":
        return PositionGoal(T[:3, 3], **options)
    return PoseGoal(T, free_axis=None if kind == "pose" else "z", **options)
