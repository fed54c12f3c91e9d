"""What a swarm's run gives back."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spacearm.swarm.settings import SwarmSettings

Array = NDArray[np.float64]

MESSAGES = {
    "budget": "the evaluation budget is spent",
    "target": "the target fitness was reached without violation",
    "stalled": "the best has not improved for the stated number of iterations",
    "time": "the time limit was reached",
    "callback": "the callback asked to stop",
    "interrupted": "interrupted from the keyboard",
    "feasible": "a candidate without violation was found, as asked",
}
"""Why a run stopped: the status, and its sentence."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SwarmHistory:
    """The swarm's best after each of T iterations, and what it had cost.

    Attributes:
        fitness: (T,) of the best so far, judged feasible first: it rises when a less violating one takes over.
        violation: (T,) of the same, 0 once it is feasible.
        evaluations: (T,) spent so far.
        positions: (T, d) of the best so far; None unless asked for.
    """

    fitness: Array
    violation: Array
    evaluations: NDArray[np.int64]
    positions: Array | None = None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SwarmResult:
    """The best that a swarm found, and why it stopped.

    Attributes:
        x: (d,) the best position evaluated, within the bounds. If nothing was feasible, the one of least violation.
        fitness: f at x, exactly as f returned it; infinite if that was NaN or minus infinity.
        violation: at x; 0 if feasible.
        status: a key of `MESSAGES`.
        iterations: rounds done.
        evaluations: positions evaluated, exactly.
        failed_evaluations: those where f gave NaN or minus infinity; they counted as the worst there is.
        seed: repeats the run together with the settings and the trial.
        trial: which of the seed's independent runs this is.
        settings: of the swarm.
        history: over the iterations.
        seconds: wall time; for one of several native trials, an even share of what all took.
        minus_infinite_evaluations: those of the failed where f gave minus infinity.
        infinite_evaluations: those where fitness or violation was infinite, which is the worst there is, and not failed.
    """

    x: Array
    fitness: float
    violation: float
    status: str
    iterations: int
    evaluations: int
    failed_evaluations: int
    seed: int
    trial: int
    settings: SwarmSettings
    history: SwarmHistory
    seconds: float
    minus_infinite_evaluations: int = 0
    infinite_evaluations: int = 0

    @property
    def success(self) -> bool:
        """Whether x is feasible and was not a failed evaluation."""
        return bool(self.violation <= 0 and np.isfinite(self.fitness))

    @property
    def message(self) -> str:
        """A sentence on why the run stopped and what is worth knowing about it."""
        text = MESSAGES[self.status]
        useless = self.failed_evaluations + self.infinite_evaluations
        if useless >= self.evaluations:
            return f"{text}; every evaluation failed (NaN or infinite): check f on a single position"
        if self.violation <= 0 and not np.isfinite(self.fitness):
            text += (
                f"; f is infinite wherever nothing is violated, and finite in {self.evaluations - useless} evaluations that do"
            )
        elif self.violation > 0:
            text += f"; nothing feasible was found, x violates least, by {self.violation:.3g}: allow more evaluations"
        if self.failed_evaluations:
            gave = "NaN or minus infinity" if self.minus_infinite_evaluations else "NaN"
            text += f"; {self.failed_evaluations} of {self.evaluations} evaluations gave {gave} and counted as the worst"
        if self.infinite_evaluations:
            text += f"; {self.infinite_evaluations} of {self.evaluations} evaluations gave infinity"
        return text
