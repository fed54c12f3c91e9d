"""What a motion does to its base, and whether it ends as was asked: float64, apart from the search."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from spacearm.errors import ProblemError
from spacearm.momentum.turning import angle, conjugate, multiplied, quaternion_of
from spacearm.motion import AnyTrajectory, Trajectory
from spacearm.planner.goals import PoseGoal, PositionGoal
from spacearm.planner.problem import Problem
from spacearm.planner.reaching.onto_goal import pose_errors, tolerances
from spacearm.proof.base import BaseProof, begun_base_proof
from spacearm.proof.base_limits import exceeded
from spacearm.proof.stance import base_setup_of
from spacearm.robot import forward_kinematics

_STEPS = 1e9  # a factor of time is a whole number of shares so small


@dataclass(frozen=True, slots=True, kw_only=True)
class BaseReport:
    """A base that is moved, over a trajectory; by the proof's bounds, so nothing between instants is missed.

    Attributes:
        final: angle between the base's attitudes at the end and at the beginning [rad].
        peak: the angle from the attitude at the beginning, at most, at any time [rad].
        rate: how fast the base turns, at most, at any time [rad/s].
        joint_momentum: the arm's angular momentum, of its joints' motion alone, at most, at any time [N m s].
        goal_distance: by how much the end effector misses its goal [m]; None for a goal in joint space.
        goal_angle: likewise [rad].
        base_angle: by how much the base misses its goal attitude [rad]; None if it has none.
        missed: what is not as was asked, a phrase each; empty if all is.
    """

    final: float
    peak: float
    rate: float
    joint_momentum: float
    goal_distance: float | None = None
    goal_angle: float | None = None
    base_angle: float | None = None
    missed: tuple[str, ...] = ()


def report_base(problem: Problem, trajectory: AnyTrajectory) -> BaseReport:
    """Report on the base of a problem's trajectory, which the arm moves.

    Raises:
        ProblemError: the problem's base is fixed, or the momentum turns it too often.
    """
    base = _base_of(problem, trajectory)
    figures, T_w_b = base.figures(), base.at_end()
    missed = list(exceeded(figures, problem.base_limits))
    distance = off = None
    if isinstance(problem.goal, (PositionGoal, PoseGoal)):
        q = trajectory.sample(trajectory.duration).q
        T = T_w_b @ forward_kinematics(problem.robot, q, frame=problem.goal.frame)
        distance, off = (float(error[0]) for error in pose_errors(problem.goal, T[None]))
        near, turn = tolerances(problem.goal)
        lever = float(np.linalg.norm(T[:3, 3] - base.turns_about_at_end()))
        if distance + figures.error * lever > near or off + figures.error > turn:
            angle_too = f" and {math.degrees(off):.3g} deg" if isinstance(problem.goal, PoseGoal) else ""
            missed.append(f"the end effector misses its goal by {distance * 1e3:.4g} mm{angle_too}")
    base_angle = None
    if problem.base_goal is not None:
        at_end = quaternion_of(T_w_b[:3, :3])
        base_angle = float(angle(multiplied(conjugate(problem.base_goal.attitude_wxyz), at_end)))
        if base_angle + figures.error > problem.base_goal.tolerance:
            missed.append(f"the base misses its goal attitude by {math.degrees(base_angle):.4g} deg")
    return BaseReport(
        final=figures.final,
        peak=figures.peak,
        rate=figures.rate,
        joint_momentum=figures.joint_momentum,
        goal_distance=distance,
        goal_angle=off,
        base_angle=base_angle,
        missed=tuple(missed),
    )


def within_base_limits(problem: Problem, trajectory: Trajectory) -> float:
    """Return by what factor a trajectory must be slower, 1 or more, for the base to keep its limits of rate and momentum."""
    figures, limits = _base_of(problem, trajectory).figures(), problem.base_limits
    shares = [
        value / limit
        for value, limit in ((figures.rate, limits.rate), (figures.joint_momentum, limits.joint_momentum))
        if limit is not None
    ]
    factor = max([1.0, *shares])
    # The proof's figures are other people's arithmetic, whose last digits depend on the processor; a duration's must not.
    return factor if factor == 1 else math.ceil(factor * _STEPS) / _STEPS


def _base_of(problem: Problem, trajectory: AnyTrajectory) -> BaseProof:
    if not problem.base_model.follows_arm:
        raise ProblemError("the problem's base is fixed, expected one that floats; give base='floating'")
    return begun_base_proof(problem.robot, trajectory, base_setup_of(problem, problem.robot, who="problem"))
