"""What planning gives back."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spacearm.motion import Trajectory
from spacearm.planner.base_report import BaseReport
from spacearm.planner.clearance import Margins
from spacearm.planner.problem import Problem
from spacearm.planner.reaching.explain import EndReport
from spacearm.planner.reaching.search import GoalConfigurations
from spacearm.planner.settings import PlannerSettings
from spacearm.proof import Certificate
from spacearm.robot.left_out import lacks_envelope, words_on_unchecked

Array = NDArray[np.float64]

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


@dataclass(frozen=True, slots=True, kw_only=True)
class Improvement:
    """A motion better than those before it, as the search saw it.

    Attributes:
        seconds: of searching before it, on its island.
        evaluations: candidate motions looked at before it, on its island.
        fitness: its weighted sum.
        by: "straight", "rrt_connect", "refine" or "swarm".
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


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Plan:
    """A motion, or why there is none.

    Attributes:
        status: a key of `STATUSES`.
        problem: what was planned.
        settings: of the planner.
        seed: repeats the plan with them.
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
        margins: the clearances that the search asked for, and which of them were lowered; None if there was no search.
        advice: what to do if there is no motion.
    """

    status: str
    problem: Problem
    settings: PlannerSettings
    seed: int
    trajectory: Trajectory | None
    certificate: Certificate | None
    goals: Array
    goal_search: GoalConfigurations | None
    ends: EndReport
    base: BaseReport | None
    fitness: dict[str, float]
    history: tuple[Improvement, ...]
    proofs: int
    evaluations: int
    interrupted: bool
    timings: dict[str, float]
    margins: Margins | None = None
    advice: str = ""

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
        text = STATUSES[self.status]
        proven = self.certificate is not None and (self.certificate.holds or self.certificate.fails_by_base_limits)
        if self.status == "not_proven" and proven:
            text = "a motion was found and proven free of collision, but it is not all that was asked for"
        text += "; it was interrupted" if self.interrupted else ""
        left_out = ""
        if self.found and self.certificate is not None:
            left_out = words_on_unchecked(self.certificate.unchecked, self.certificate.bare, counted=False)
        lowered = "" if self.margins is None else self.margins.message
        return "; ".join(part for part in (text, left_out, self.advice, lowered) if part)
