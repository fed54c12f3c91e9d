"""The numbers of a benchmark: by family and in all, and beside the targets. Times are the reference core's unless `raw`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spacearm.bench.mbm import Benchmark
from spacearm.bench.measure import LIMIT, Run

Array = NDArray[np.float64]

BUDGETS = (0.001, 0.01, 0.05)
"""When the length is told [s of the reference core]."""

FULL_SET_STRAIGHT = 4.18
"""Mean length of the straight motions of the 699 problems that the length targets were set on [rad]."""

LENGTH_TARGETS = (4.90, 4.55, 4.48)
"""Of the mean length after each of `BUDGETS`, on those problems [rad]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Spread:
    """Of some numbers; nan where there are none."""

    median: float
    p95: float
    greatest: float

    @classmethod
    def of(cls, values: Sequence[float]) -> Spread:
        """Return the median, the 95th percentile and the greatest."""
        if not values:
            return cls(median=np.nan, p95=np.nan, greatest=np.nan)
        median, p95 = np.percentile(values, [50, 95])
        return cls(median=float(median), p95=float(p95), greatest=float(max(values)))


@dataclass(frozen=True, slots=True, kw_only=True)
class LengthBy:
    """Lengths after a time.

    Attributes:
        solved: runs that had a motion by then.
        mean: of these [rad].
        all: the mean with the first motion of those that came later; nobody is left out who was solved at all [rad].
    """

    solved: int
    mean: float
    all: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Summary:
    """Of some runs; those whose problem cannot be solved are only counted.

    Attributes:
        runs: with a problem that can be solved.
        ends_collide: runs without.
        solved: runs with a first motion in time.
        first: time to it [s].
        with_preparation: the same, what comes before the search included [s].
        prepare: what comes before the search [s].
        first_evaluations: motions looked at before it; the same on every machine.
        first_length: its length, mean [rad]; the same on every machine.
        straight: length of the straight motion, mean [rad].
        lengths: after each of `BUDGETS`.
        certified: runs whose plan was found and proven in time.
        certificate: one proof [s].
        total: `plan()`, all in all [s].
        proofs: mean and most in a plan.
        plan_length: mean [rad].
        looked_at: configurations of plans that the other checker looked at.
        collisions: plans in which it found any.
    """

    runs: int
    ends_collide: int
    solved: int
    first: Spread
    with_preparation: Spread
    prepare: Spread
    first_evaluations: Spread
    first_length: float
    straight: float
    lengths: tuple[LengthBy, ...]
    certified: int
    certificate: Spread
    total: Spread
    proofs: tuple[float, int]
    plan_length: float
    looked_at: int
    collisions: int


def summary_of(runs: Sequence[Run], *, raw: bool = False) -> Summary:
    """Sum up some runs.

    Args:
        runs: of one family, or all.
        raw: times as they were measured here, not the reference core's. Budgets stay the reference core's.
    """
    valid = [run for run in runs if not run.ends_collide]
    solved = [run for run in valid if run.first is not None]

    def spread(of: Sequence[Run], seconds: Callable[[Run], float]) -> Spread:
        return Spread.of([seconds(run) * (1.0 if raw else run.scale) for run in of])

    return Summary(
        runs=len(valid),
        ends_collide=len(runs) - len(valid),
        solved=len(solved),
        first=spread(solved, lambda run: run.history[0][0]),
        with_preparation=spread(solved, lambda run: run.prepare + run.history[0][0]),
        prepare=spread(valid, lambda run: run.prepare),
        first_evaluations=Spread.of([float(run.first_evaluations or 0) for run in solved]),
        first_length=_mean([run.history[0][1] for run in solved]),
        straight=_mean([run.straight for run in valid]),
        lengths=tuple(_length_by(solved, budget) for budget in BUDGETS),
        certified=sum(run.certified for run in valid),
        certificate=spread([run for run in valid if run.proofs], lambda run: run.certify / run.proofs),
        total=spread(valid, lambda run: run.seconds),
        proofs=(_mean([run.proofs for run in valid]), max((run.proofs for run in valid), default=0)),
        plan_length=_mean([run.length for run in valid if run.length is not None]),
        looked_at=sum(run.looked_at for run in valid),
        collisions=sum(run.collisions > 0 for run in valid),
    )


def _length_by(solved: Sequence[Run], budget: float) -> LengthBy:
    found = [run.length_by(budget) for run in solved]
    had = [length for length in found if length is not None]
    late = [run.history[0][1] for run, length in zip(solved, found, strict=True) if length is None]
    return LengthBy(solved=len(had), mean=_mean(had), all=_mean([*had, *late]))


def _mean(values: Sequence[float]) -> float:
    return float(np.mean(values)) if len(values) else float("nan")


# ---- targets -----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class Target:
    """What was to be reached, and what was.

    Attributes:
        what: in words.
        target: the number to reach.
        measured: the number measured; nan where there is none.
        unit: of both.
        at_least: whether more is better.
    """

    what: str
    target: float
    measured: float
    unit: str
    at_least: bool = False

    @property
    def met(self) -> bool:
        """Whether it was reached."""
        return self.measured >= self.target if self.at_least else self.measured <= self.target


def targets_of(benchmark: Benchmark) -> list[Target]:
    """Return the targets: of times on the reference core, of lengths for this collection's straight motions."""
    all_runs = summary_of(benchmark.runs)
    share = all_runs.straight / FULL_SET_STRAIGHT
    by_seed = [summary_of([run for run in benchmark.runs if run.seed == seed]) for seed in range(benchmark.protocol.seeds)]
    certified = min((s.certified / s.runs for s in by_seed if s.runs), default=float("nan"))
    return [
        Target(
            what=f"found and certified within {LIMIT:g} s, the worst seed",
            target=100,
            measured=100 * certified,
            unit="%",
            at_least=True,
        ),
        Target(what="first motion, median", target=0.15, measured=1e3 * all_runs.first.median, unit="ms"),
        Target(what="first motion, 95 in 100", target=1, measured=1e3 * all_runs.first.p95, unit="ms"),
        *(
            Target(
                what=f"length after {1e3 * budget:g} ms, mean",
                target=round(share * target, 3),
                measured=length.all,
                unit="rad",
            )
            for budget, target, length in zip(BUDGETS, LENGTH_TARGETS, all_runs.lengths, strict=True)
            if budget <= benchmark.protocol.search
        ),
        Target(what="one certificate, median", target=20, measured=1e3 * all_runs.certificate.median, unit="ms"),
        Target(what="plans with a collision found afterwards", target=0, measured=all_runs.collisions, unit=""),
    ]


def lengths_over_time(runs: Sequence[Run], times: Sequence[float]) -> Array:
    """Return the mean length after each of some times [s of the reference core], as `LengthBy.all` [rad]; it never rises."""
    solved = [run for run in runs if not run.ends_collide and run.first is not None]
    return np.array([_length_by(solved, t).all for t in times])
