"""Statistics of runs: Table 3's columns, and the rank-sum test."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from spacearm.swarm import SwarmResult


@dataclass(frozen=True, slots=True, kw_only=True)
class Summary:
    """A method's runs in a row of numbers; fitness is over the feasible runs, NaN if there is none.

    Attributes:
        worst, best, mean: fitness.
        threshold_share: share of all runs that are feasible and reach the paper's threshold 4.33.
        near_share: share of all runs that are feasible and within 1 % of the best known value.
        feasible_share: share of all runs.
        p_value: of the two-sided rank-sum test against the first method; None for the first.
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
    """Return the row of Table 3 for a method's runs, tested against those of the reference method, if any."""
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


def rank_sum(first: Sequence[float], second: Sequence[float]) -> float:
    """Return the two-sided p-value of the Wilcoxon-Mann-Whitney rank-sum test.

    Exact without ties and with at most 50 values a sample; otherwise the normal approximation, corrected for ties and
    continuity. (Mann and Whitney 1947.)

    Args:
        first: values of one sample; infinite ones rank last, as ties.
        second: of the other.
    """
    n, m = len(first), len(second)
    pooled = np.concatenate([np.asarray(first, dtype=np.float64), np.asarray(second, dtype=np.float64)])
    values, inverse, counts = np.unique(pooled, return_inverse=True, return_counts=True)
    upper = np.cumsum(counts)
    ranks = ((upper - counts + 1 + upper) / 2)[inverse]  # ties share the mean of their ranks
    u = float(ranks[:n].sum() - n * (n + 1) / 2)
    extreme = min(u, n * m - u)
    if len(values) == n + m and max(n, m) <= 50:
        ways = _ways(n, m)
        return min(1.0, 2 * sum(ways[: int(extreme) + 1]) / math.comb(n + m, n))
    total = n + m
    ties = float((counts.astype(np.float64) ** 3 - counts).sum())
    variance = n * m / 12 * ((total + 1) - ties / (total * (total - 1)))
    if variance <= 0:
        return 1.0
    z = max(0.0, n * m / 2 - extreme - 0.5) / math.sqrt(variance)
    return min(1.0, math.erfc(z / math.sqrt(2)))


@lru_cache(maxsize=8)
def _ways(n: int, m: int) -> tuple[int, ...]:
    """Return in how many ways each value of U, 0 to n m, comes about: the coefficients of the Gaussian binomial."""
    row = [[1] + [0] * (n * m) for _ in range(n + 1)]  # row[i]: for i of the first sample, and j of the second so far
    for i in range(1, n + 1):
        row[i] = [1] + [0] * (n * m)
    for j in range(1, m + 1):
        for i in range(1, n + 1):
            # The largest value is of the second sample, or of the first and exceeds all j of the second.
            row[i] = [row[i][u] + (row[i - 1][u - j] if u >= j else 0) for u in range(n * m + 1)]
    return tuple(row[n])


def _ranked(runs: Sequence[SwarmResult]) -> list[float]:
    return [run.fitness if run.success else math.inf for run in runs]
