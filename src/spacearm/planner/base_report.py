"""What a motion does to a floating base, and whether it ends as was asked: float64, apart from the search."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spacearm.momentum.quick import moving
from spacearm.momentum.turning import angle, conjugate, multiplied
from spacearm.motion import AnyTrajectory, Trajectory
from spacearm.planner.goals import PoseGoal, PositionGoal
from spacearm.planner.problem import Problem
from spacearm.planner.reaching.onto_goal import pose_errors, tolerances

Array = NDArray[np.float64]

_INSTANTS = 129
_SLACK = 1e-6  # relative: of a limit that is met by moving slower


@dataclass(frozen=True, slots=True, kw_only=True)
class BaseReport:
    """A floating base over a trajectory; what is greatest is so of 129 instants, evenly spread over the path.

    Attributes:
        final: angle between the base's attitudes at the end and at the beginning [rad].
        peak: the greatest angle from the attitude at the beginning [rad].
        rate: the greatest rate at which the base turns [rad/s].
        joint_momentum: the arm's greatest angular momentum, of its joints' motion alone [N m s].
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
    """Report on the floating base of a problem's trajectory."""
    t = trajectory.time_at(np.linspace(*trajectory.curve.domain, _INSTANTS))
    attitude = trajectory.base_pose(t)[1]
    turned = angle(_between(attitude[0], attitude))
    state = trajectory.sample(t)
    found = moving(problem.robot, state.q, state.dq)
    omega = trajectory.base_rate(t)[1] if trajectory.momentum.angular.any() else found.free_rate
    spin, arm = np.linalg.norm(omega, axis=-1), np.linalg.norm(found.arm, axis=-1)
    final, peak, rate, momentum = float(turned[-1]), float(turned.max()), float(spin.max()), float(arm.max())
    missed = []
    limits = problem.base_limits
    for what, value, limit, scale, unit in (
        ("the base ends turned by", final, limits.final, math.degrees(1), "deg"),
        ("the base turns by", peak, limits.peak, math.degrees(1), "deg"),
        ("the base turns at", rate, limits.rate, math.degrees(1), "deg/s"),
        ("the arm's momentum reaches", momentum, limits.joint_momentum, 1.0, "N m s"),
    ):
        if limit is not None and value > limit * (1 + _SLACK):
            missed.append(f"{what} {value * scale:.4g} {unit}, more than {limit * scale:.4g}")
    distance = off = None
    if isinstance(problem.goal, (PositionGoal, PoseGoal)):
        T = trajectory.tip(trajectory.duration, frame=problem.goal.frame)
        distance, off = (float(error[0]) for error in pose_errors(problem.goal, T[None]))
        near, turn = tolerances(problem.goal)
        if distance > near or off > turn:
            angle_too = f" and {math.degrees(off):.3g} deg" if isinstance(problem.goal, PoseGoal) else ""
            missed.append(f"the end effector misses its goal by {distance * 1e3:.4g} mm{angle_too}")
    base_angle = None
    if problem.base_goal is not None:
        base_angle = float(angle(_between(problem.base_goal.attitude_wxyz, attitude[-1])))
        if base_angle > problem.base_goal.tolerance:
            missed.append(f"the base misses its goal attitude by {math.degrees(base_angle):.4g} deg")
    return BaseReport(
        final=final,
        peak=peak,
        rate=rate,
        joint_momentum=momentum,
        goal_distance=distance,
        goal_angle=off,
        base_angle=base_angle,
        missed=tuple(missed),
    )


def within_base_limits(problem: Problem, trajectory: Trajectory) -> float:
    """Return by what factor a trajectory must be slower, 1 or more, for the base to keep its limits of rate and momentum."""
    report, limits = report_base(problem, trajectory), problem.base_limits
    shares = [
        value / limit
        for value, limit in ((report.rate, limits.rate), (report.joint_momentum, limits.joint_momentum))
        if limit is not None
    ]
    return max([1.0, *shares])


def _between(one: Array, other: Array) -> Array:
    return multiplied(conjugate(np.asarray(one)), other)
