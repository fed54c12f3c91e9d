"""The time that a plan takes: by stage, and what is left of its budget."""

from __future__ import annotations

import math
import time

_ALWAYS_AGAIN = 0.15  # [s] from the beginning: so long another motion may be tried, however short `time_budget` is


class PlanClock:
    """The time of one call of `plan`: by stage, and what is left of the budget.

    Attributes:
        budget: of all of it [s]; None: no limit.
        timings: seconds by stage.
    """

    def __init__(self, budget: float | None) -> None:
        self.budget, self.timings = budget, dict[str, float]()
        self._begun = self._last = time.perf_counter()

    def lap(self, stage: str) -> None:
        """Book the time since the last call on a stage."""
        now = time.perf_counter()
        self.timings[stage] = self.timings.get(stage, 0.0) + now - self._last
        self._last = now

    @property
    def left(self) -> float:
        """The time that is left [s]; infinite without a budget."""
        return math.inf if self.budget is None else self._begun + self.budget - time.perf_counter()

    @property
    def left_again(self) -> float:
        """The time that is left for other motions where a proof failed [s]."""
        return math.inf if self.budget is None else self._begun + max(self.budget, _ALWAYS_AGAIN) - time.perf_counter()

    def total(self) -> dict[str, float]:
        """Return the timings, with the total."""
        return {**self.timings, "total": time.perf_counter() - self._begun}
