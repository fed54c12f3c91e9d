"""Statistics of records: spreads, shares, targets, and the rank-sum test."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from spacearm.study.study_tables import Table
from spacearm.swarm import SwarmResult

_EXACT = 50  # values a sample, up to which the p-value is exact; the number of ways to rank more takes long to count


@dataclass(frozen=True, slots=True, kw_only=True)
class Spread:
    """Of some numbers; NaN where there are none."""

    median: float
    p95: float
    greatest: float

    @classmethod
    def of(cls, values: Sequence[float]) -> Spread:
        """Return the median, the 95th percentile and the greatest."""
        if not values:
            return cls(median=np.nan, p95=np.nan, greatest=np.nan)
        middle, p95 = np.percentile(values, [50, 95])
        return cls(median=float(middle), p95=float(p95), greatest=float(max(values)))


@dataclass(frozen=True, slots=True, kw_only=True)
class Target:
    """What was to be reached, and what was.

    Attributes:
        what: in words.
        target: the number to reach.
        measured: the number measured; NaN where there is none.
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


def target_table(title: str, targets: Iterable[Target], *, digits: int) -> Table:
    """Return a table of targets; the measured numbers have this number of significant digits."""
    rows = [
        (
            target.what,
            f"{'>=' if target.at_least else '<='} {target.target:g} {target.unit}".strip(),
            f"{target.measured:.{digits}g} {target.unit}".strip(),
            "yes" if target.met else "no",
        )
        for target in targets
    ]
    return Table(title, ("what", "target", "measured", "met"), rows)


def mean(values: Sequence[float]) -> float:
    """Return the mean; NaN of nothing."""
    return float(np.mean(values)) if len(values) else math.nan


def median(values: Sequence[float]) -> float:
    """Return the median; NaN of nothing."""
    return float(np.median(values)) if len(values) else math.nan


def share(records: Sequence[Any], holds: Callable[[Any], bool]) -> float:
    """Return the share of the records for which something holds; NaN of nothing."""
    return sum(map(holds, records)) / len(records) if records else math.nan


def share_interval(count: int, of: int, *, confidence: float = 0.95) -> tuple[float, float]:
    """Return the interval of confidence of a share that was counted (Wilson 1927).

    Args:
        count: how many hold.
        of: of how many, at least 1.
        confidence: with which the true share is in the interval.
    """
    from scipy.stats import binomtest

    interval = binomtest(count, of).proportion_ci(confidence, method="wilson")
    return float(interval.low), float(interval.high)


def rank_sum(first: Sequence[float], second: Sequence[float]) -> float:
    """Return the two-sided p-value of the rank-sum test of Wilcoxon, Mann and Whitney.

    Exact without ties and with at most 50 values a sample; otherwise the normal approximation, corrected for ties and
    continuity. (Mann and Whitney 1947.)

    Args:
        first: values of one sample; infinite ones rank last, as ties.
        second: of the other.

    Returns:
        The p-value to 12 digits, which are the same with every release of SciPy and on every processor.
    """
    from scipy.stats import mannwhitneyu, rankdata

    ranks = rankdata([*first, *second])  # what is infinite has a rank, too
    distinct = len(np.unique(ranks))
    if distinct == 1:
        return 1.0
    exact = distinct == len(ranks) and max(len(first), len(second)) <= _EXACT
    method = "exact" if exact else "asymptotic"
    found = mannwhitneyu(ranks[: len(first)], ranks[len(first) :], alternative="two-sided", method=method)
    return float(f"{found.pvalue:.12g}")


@dataclass(frozen=True, slots=True, kw_only=True)
class Summary:
    """A swarm's runs in a row of numbers, as in Table 3 of the paper; fitness is over the feasible runs, NaN if there is none.

    Attributes:
        worst, best, mean: fitness.
        threshold_share: share of all runs that are feasible and reach a threshold.
        near_share: share of all runs that are feasible and near the best known value.
        feasible_share: share of all runs.
        p_value: of the two-sided rank-sum test against a reference; None without one.
    """

    worst: float
    best: float
    mean: float
    threshold_share: float
    near_share: float
    feasible_share: float
    p_value: float | None


def summarise(
    runs: Sequence[SwarmResult],
    *,
    threshold: float,
    best_known: float | None,
    near: float,
    reference: Sequence[SwarmResult] | None = None,
) -> Summary:
    """Sum up runs.

    Args:
        runs: one or more.
        threshold: of the fitness.
        best_known: fitness; None if none is known.
        near: share of the best known fitness within which a run is near to it.
        reference: runs of another swarm to test against.
    """
    feasible = [run.fitness for run in runs if run.success]
    near_enough = -math.inf if best_known is None else best_known * (1 + near)
    values = np.array(feasible or [math.nan])
    return Summary(
        worst=float(values.max()),
        best=float(values.min()),
        mean=float(values.mean()),
        threshold_share=sum(f <= threshold for f in feasible) / len(runs),
        near_share=sum(f <= near_enough for f in feasible) / len(runs),
        feasible_share=len(feasible) / len(runs),
        p_value=None if reference is None else rank_sum(_ranked(runs), _ranked(reference)),
    )


def _ranked(runs: Sequence[SwarmResult]) -> list[float]:
    return [run.fitness if run.success else math.inf for run in runs]
