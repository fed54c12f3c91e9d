"""The settings of the paper's experiment, and how Table 3 was reported."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import Literal

from spacearm.checks import as_number, shown
from spacearm.errors import SettingsError
from spacearm.settings import one_of, settings, whole
from spacearm.swarm import NAMED_SETTINGS
from spacearm.swarm.native_run import MOST_THREADS

_WIDEST = 1e3  # [m]

MODES = ("goal", "literal")
THRESHOLD = 4.33
NEAR = 0.01  # "near" the best known value: within 1 %


@dataclass(frozen=True, slots=True, kw_only=True)
class ReportedRow:
    """A row of the paper's Table 3."""

    worst: float
    best: float
    mean: float
    threshold_share: float


REPORTED = {
    "pso": ReportedRow(worst=4.3341, best=3.3818, mean=4.2378, threshold_share=0.70),
    "ipso": ReportedRow(worst=4.3296, best=3.3760, mean=3.7699, threshold_share=1.00),
}
"""The paper's Table 3."""

REPORTED_FOR = {"pso": "pso", "ipso-m": "ipso", "ipso-s": "ipso"}
"""Which of its rows stands beside which method."""


@settings
class PaperSettings:
    """What of the experiment is run.

    Attributes:
        runs: runs of each method.
        methods: swarm settings to compare, the first with each of the others: pso, ipso-m, ipso-s (the paper's, with either
            reading of its population 3), constriction, ring, ring-small, ring-forgiving, ring-unclamped, ring-rising,
            evolving-rising, ipso-e.
        modes: goal (reaching the goal is a constraint), literal (eq. (4) alone), or both.
        radii: one or more obstacle radii A_R [m].
        tolerance: distance at which the goal counts as reached, in the goal mode [m].
        weights: omega_1, omega_2, omega_3 of eq. (4), each from 0 to 1, their sum 1.
        link_radius: radius of the cylinders round the links [m].
        constraints: feasible-first, or penalty for the weighted sum, in the methods that do not set their own.
        seed: seed of all runs.
        threads: processor threads; none: one a core. The numbers do not depend on it.
    """

    runs: int = 20
    methods: tuple[str, ...] = ("pso", "ipso-m", "ipso-s", "ring-rising", "ipso-e")
    modes: tuple[str, ...] = MODES
    radii: tuple[float, ...] = (0.10,)
    tolerance: float = 1e-3
    weights: tuple[float, float, float] = (0.5, 0.25, 0.25)
    link_radius: float = 0.0
    constraints: Literal["feasible-first", "penalty"] = "feasible-first"
    seed: int = 0
    threads: int | None = None

    def __post_init__(self) -> None:
        keep = functools.partial(object.__setattr__, self)  # plain numbers, also where NumPy's were given
        keep("runs", whole("runs", self.runs, at_least=1, at_most=100_000))
        for name, values in (("methods", self.methods), ("modes", self.modes), ("radii", self.radii)):
            if not isinstance(values, tuple) or not values:
                raise SettingsError(f"{name} is {shown(values)}, expected a tuple of one or more values")
            if any(value in values[:i] for i, value in enumerate(values)):
                raise SettingsError(f"{name} is {shown(values)}, expected each value once; leave the others out")
        for method in self.methods:
            one_of("method", method, tuple(NAMED_SETTINGS))
        for mode in self.modes:
            one_of("mode", mode, MODES)
        keep(
            "radii",
            tuple(as_number("radius", radius, SettingsError, above=0, at_most=_WIDEST, unit="m") for radius in self.radii),
        )
        keep("tolerance", as_number("tolerance", self.tolerance, SettingsError, above=0, at_most=_WIDEST, unit="m"))
        keep("link_radius", as_number("link_radius", self.link_radius, SettingsError, at_least=0, at_most=_WIDEST, unit="m"))
        one_of("constraints", self.constraints, ("feasible-first", "penalty"))
        keep("weights", _weights(self.weights))
        keep("seed", whole("seed", self.seed, at_least=0, at_most=2**63 - 1))
        if self.threads is not None:
            keep("threads", whole("threads", self.threads, at_least=1, at_most=MOST_THREADS))


def _weights(given: tuple[float, ...]) -> tuple[float, ...]:
    if not isinstance(given, tuple) or len(given) != 3:
        raise SettingsError(f"weights is {shown(given)}, expected a tuple of three: omega_1, omega_2, omega_3")
    weights = tuple(as_number(f"weights[{i}]", weight, SettingsError) for i, weight in enumerate(given))
    for i, weight in enumerate(weights):
        if not 0 <= weight <= 1:
            raise SettingsError(f"weights[{i}] is {weight:g}, expected a weight from 0 to 1, eq. (4)")
    if abs(sum(weights) - 1) > 1e-9:
        raise SettingsError(f"weights sum to {sum(weights):.12g}, expected 1, eq. (4); scale them")
    return weights


assert set(REPORTED_FOR) <= set(NAMED_SETTINGS)
