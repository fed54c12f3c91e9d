"""What planning gives back: the plan, how the search came to it, and what the motion does to a base that follows the arm.

The report on the base is computed in float64 from the proof's bounds, apart from the search.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from spacearm.core.brief import Brief, Rows
from spacearm.core.errors import ProblemError
from spacearm.core.notebook_hook import InNotebooks
from spacearm.core.rotations import angle, conjugate, multiplied, quaternion_of
from spacearm.motion import AnyTrajectory, Motion, Trajectory
from spacearm.planner.explanations import EndReport
from spacearm.planner.goals import PoseGoal, PositionGoal
from spacearm.planner.inverse_kinematics import GoalConfigurations, pose_errors
from spacearm.planner.planner_settings import PlannerSettings
from spacearm.planner.plans_in_short import plan_in_short
from spacearm.planner.problem import Problem
from spacearm.planner.searched_clearance import SearchedClearance
from spacearm.proof import Certificate
from spacearm.proof.base_proofs import BaseProof, base_setup_of, begun_base_proof, broken_base_limits
from spacearm.robot.unchecked_pairs import lacks_envelope

Array = NDArray[np.float64]

_STEPS = 1e9  # a factor by which a motion is slowed down is a whole number of 1 / _STEPS


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class BaseReport(Brief):
    """A base that is moved, over a trajectory; by the proof's bounds, so nothing between instants is missed.

    Attributes:
        final: angle between the base's attitudes at the end and at the beginning, at most [rad].
        peak: the angle from the attitude at the beginning, at most, at any time [rad].
        rate: how fast the base turns, at most, at any time [rad/s].
        joint_momentum: the arm's angular momentum, of its joints' motion alone, at most, at any time [N m s].
        goal_distance: by how much the end effector misses its goal, at most [m]; None for a goal in joint space.
        goal_angle: likewise [rad].
        base_angle: by how much the base misses its goal attitude, at most [rad]; None if it has none.
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
    missed = list(broken_base_limits(figures, problem.base_limits))
    distance = off = None
    if isinstance(problem.goal, (PositionGoal, PoseGoal)):
        T = base.frame_at_end(problem.robot.frame(problem.goal.frame or problem.robot.tip))
        distance, off = (float(error[0]) for error in pose_errors(problem.goal, T[None]))
        near, turn = problem.goal.tolerances
        # An error of the last attitude turns the robot about its centre of mass.
        distance += figures.error * float(np.linalg.norm(T[:3, 3] - base.turns_about_at_end()))
        off += figures.error if isinstance(problem.goal, PoseGoal) else 0.0
        if distance > near or off > turn:
            angle_too = f" and {math.degrees(off):.3g} deg" if isinstance(problem.goal, PoseGoal) else ""
            missed.append(f"the end effector misses its goal by {distance * 1e3:.4g} mm{angle_too}")
    base_angle = None
    if problem.base_goal is not None:
        at_end = quaternion_of(T_w_b[:3, :3])
        base_angle = figures.error + float(angle(multiplied(conjugate(problem.base_goal.attitude_wxyz), at_end)))
        if base_angle > problem.base_goal.tolerance:
            missed.append(f"the base misses its goal attitude by {math.degrees(base_angle):.4g} deg")
    return BaseReport(
        final=figures.final + figures.error,
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
    # The proof's figures come from Pinocchio, whose last digits depend on the processor; those of a duration must not.
    return factor if factor == 1 else math.ceil(factor * _STEPS) / _STEPS


def _base_of(problem: Problem, trajectory: AnyTrajectory) -> BaseProof:
    if not problem.base_model.follows_arm:
        raise ProblemError("the problem's base is fixed, expected one that floats; give base='floating'")
    return begun_base_proof(problem.robot, trajectory, base_setup_of(problem, problem.robot, who="problem"))


# ---- The plan --------------------------------------------------------------------------------------------------------

STATUSES = {
    "found": "a motion was found and proven",
    "no_envelope": "the robot has no envelope",
    "start_in_collision": "the start is in collision",
    "goal_in_collision": "the goal is in collision",
    "goal_unreachable": "no collision-free configuration that reaches the goal was found",
    "not_found": "no collision-free motion was found",
    "not_proven": "a motion was found, but its proof does not hold",
}
"""How planning ends."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class SearchState(Brief):
    """What a search has found while it goes on.

    Attributes:
        evaluations: candidate motions that the island has looked at which tells it.
        motion: the best motion of all islands so far, free where the search looks at it, and not proven; the same object until
            there is a better one. None: there is none yet.
        fitness: of the motion; infinite without one.
    """

    evaluations: int
    motion: Motion | None
    fitness: float


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Improvement(Brief):
    """A motion better than those before it, as the search saw it.

    Attributes:
        seconds: of searching before it, on its island.
        evaluations: candidate motions looked at before it, on its island.
        fitness: its weighted sum.
        by: the method that found it: "straight" (the straight motion), "rrt_connect", "refine" or "swarm".
        goal: index into the plan's goal configurations.
        interior_points: its control points.
        island: which search found it.
    """

    seconds: float
    evaluations: int
    fitness: float
    by: str
    goal: int
    interior_points: int
    island: int


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class Plan(Brief, InNotebooks):
    """A motion, or why there is none.

    Attributes:
        status: a key of `STATUSES`.
        problem: what was planned.
        settings: of the planner.
        seed: random seed; it repeats the plan with them.
        trajectory: the motion in time; if none was proven, the best that was seen; None if there is no goal configuration.
        certificate: of the trajectory.
        goals: (g, n) the goal configurations planned to, nearest first.
        goal_search: how these were found; None if they were given.
        ends: what is wrong with the start or the goal, with the pairs in contact.
        base: of a floating base: how the trajectory turns it, and whether it ends as was asked; None for a fixed one.
        fitness: the trajectory's, by term, as `Weights` names them.
        history: the improvements in order, as the search saw them.
        proofs: how many motions were given to the proof.
        evaluations: candidate motions looked at.
        interrupted: whether it was ended from outside.
        timings: seconds by stage: "prepare", "goals", "search", "certify"; what is left of "total" is Python between them.
        searched: the clearances that the search asked for; None if there was no search.
        achievable: where the clearance that is required was not met: the share of it with which a motion is found and proven,
            0 up to 1; None if none was, or none was looked for.
        advice: what to do if there is no motion.
    """

    status: str
    problem: Problem
    settings: PlannerSettings
    seed: int
    goals: Array
    ends: EndReport
    timings: dict[str, float]
    trajectory: Trajectory | None = None
    certificate: Certificate | None = None
    goal_search: GoalConfigurations | None = None
    base: BaseReport | None = None
    fitness: dict[str, float] = field(default_factory=dict[str, float])
    history: tuple[Improvement, ...] = ()
    proofs: int = 0
    evaluations: int = 0
    interrupted: bool = False
    searched: SearchedClearance | None = None
    achievable: float | None = None
    advice: str = ""

    def _in_short(self) -> tuple[str, Rows]:
        return plan_in_short(self)

    @property
    def found(self) -> bool:
        """Whether there is a proven motion."""
        return self.status == "found"

    @property
    def message(self) -> str:
        """The outcome in a sentence."""
        if self.status == "no_envelope":
            return lacks_envelope(self.problem.robot)
        if self.ends.message:
            return self.ends.message
        certificate = self.certificate
        text = not_met(self.problem) if self.status == "not_found" else STATUSES[self.status]
        proven = certificate is not None and (certificate.holds or certificate.fails_by_base_limits)
        if self.status == "not_proven" and proven:
            text = "a motion was found and proven free of collision, but it is not all that was asked for"
        text += "; it was interrupted" if self.interrupted else ""
        said = certificate.message if self.found and certificate is not None else ""
        return "; ".join(part for part in (text, said, self.advice) if part)


def not_met(problem: Problem) -> str:
    """Say that no motion was found, and with what clearance."""
    least, others = problem.clearance, [pair.clearance for pair in problem.clearances]
    if not any([least, *others]):
        return STATUSES["not_found"]
    by_pair = f" ({max(others) * 1e3:.4g} mm at most for pairs of their own)" if others else ""
    return f"no motion with a clearance of {least * 1e3:.4g} mm{by_pair} was found"
