"""What planning gives back."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spacearm.motion import Trajectory
from spacearm.planner.problem import Problem
from spacearm.planner.settings import PlannerSettings
from spacearm.proof import Certificate

Array = NDArray[np.float64]

STATUSES = {
    "found": "a motion was found and proven",
    "goal_not_reached": "no collision-free configuration that reaches the goal was found",
    "not_found": "no collision-free motion was found",
}
"""How planning ends."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Improvement:
    """A motion better than those before it.

    Attributes:
        goal: index into the plan's goal configurations.
        restart: which search found it; -1 is the straight motion.
        length: joint path length [rad or m].
        violation: mean shortfall of clearance at the samples [m]; 0 if none.
        proven: whether its certificate holds.
    """

    goal: int
    restart: int
    length: float
    violation: float
    proven: bool


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Plan:
    """A motion, or why there is none.

    Attributes:
        status: a key of `STATUSES`.
        problem: what was planned.
        settings: of the planner.
        seed: repeats the plan with them.
        trajectory: the motion in time; if none was proven, the best that was seen, or None without a goal configuration.
        certificate: of the trajectory.
        goals: (g, n) the goal configurations planned to, nearest first.
        fitness: the trajectory's, by term: "length" [rad or m], "duration" [s].
        history: the improvements in order.
        timings: seconds by stage: "goals", "search", "certify".
        advice: what to do if there is no motion.
    """

    status: str
    problem: Problem
    settings: PlannerSettings
    seed: int
    trajectory: Trajectory | None
    certificate: Certificate | None
    goals: Array
    fitness: dict[str, float]
    history: tuple[Improvement, ...]
    timings: dict[str, float]
    advice: str = ""

    @property
    def found(self) -> bool:
        """Whether there is a proven motion."""
        return self.status == "found"

    @property
    def message(self) -> str:
        """The outcome in a sentence."""
        text = STATUSES[self.status]
        return f"{text}; {self.advice}" if self.advice else text
