"""The rank-sum test against SciPy's, and Table 3's columns by hand."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import mannwhitneyu

from spacearm.study.statistics import Spread, Summary, mean, median, rank_sum, share, share_interval, summarise
from spacearm.swarm import PSO, SwarmResult
from spacearm.swarm.ask_tell import SwarmHistory

numbers = st.floats(-1e6, 1e6, allow_nan=False)
few_values = st.sampled_from([0.0, 1.0, 2.5, math.inf])
RELATIVE = 1e-9  # sums of ranks are exact; only the last operations round


@st.composite
def distinct_samples(draw: st.DrawFn) -> tuple[list[float], list[float]]:
    pooled = draw(st.lists(numbers, min_size=2, max_size=24, unique=True))
    cut = draw(st.integers(1, len(pooled) - 1))
    return pooled[:cut], pooled[cut:]


@given(distinct_samples())
def test_without_ties_the_p_value_is_scipys_exact_one(samples: tuple[list[float], list[float]]) -> None:
    expected = mannwhitneyu(*samples, alternative="two-sided", method="exact").pvalue
    assert rank_sum(*samples) == pytest.approx(expected, rel=RELATIVE)


@given(st.lists(few_values, min_size=1, max_size=30), st.lists(few_values, min_size=1, max_size=30))
def test_with_ties_the_p_value_is_scipys_approximation(first: list[float], second: list[float]) -> None:
    pooled = first + second
    if len(set(pooled)) in (1, len(pooled)):
        return  # all equal: below; none equal: above
    finite = [[min(value, 10.0) for value in sample] for sample in (first, second)]  # SciPy is given ranks it can tell
    expected = mannwhitneyu(*finite, alternative="two-sided", method="asymptotic", use_continuity=True).pvalue
    assert rank_sum(first, second) == pytest.approx(expected, rel=RELATIVE)


def test_with_many_values_the_p_value_is_scipys_approximation() -> None:
    rng = np.random.default_rng(0)
    for n, m in ((51, 3), (60, 60), (3, 200)):
        first, second = rng.normal(size=n), rng.normal(0.3, size=m)
        expected = mannwhitneyu(first, second, alternative="two-sided", method="asymptotic").pvalue
        assert rank_sum(list(first), list(second)) == pytest.approx(expected, rel=RELATIVE)


@pytest.mark.parametrize("value", [1.0, math.inf])
def test_equal_values_tell_nothing(value: float) -> None:
    assert rank_sum([value] * 5, [value] * 4) == 1
    assert rank_sum([value], [value]) == 1


@given(distinct_samples())
def test_the_test_is_symmetric_and_sees_ranks_only(
    samples: tuple[list[float], list[float]],
) -> None:
    p = rank_sum(*samples)
    assert 0 < p <= 1
    assert rank_sum(*reversed(samples)) == p
    order = sorted(samples[0] + samples[1])
    assert rank_sum(*([float(order.index(value)) for value in sample] for sample in samples)) == p


def test_the_smallest_p_of_20_against_20_is_2_over_all_ways() -> None:
    assert rank_sum(list(range(20)), list(range(20, 40))) == pytest.approx(2 / math.comb(40, 20), rel=RELATIVE)


def result(fitness: float, violation: float = 0.0) -> SwarmResult:
    """Return a run that ended so."""
    return SwarmResult(
        x=np.zeros(7),
        fitness=fitness,
        violation=violation,
        status="budget",
        iterations=1,
        evaluations=1,
        failed_evaluations=0,
        seed=0,
        trial=0,
        settings=PSO(),
        history=SwarmHistory(fitness=np.array([fitness]), violation=np.array([violation]), evaluations=np.array([1])),
        seconds=0.0,
    )


def summary(*runs: SwarmResult, best_known: float | None = 3.0, reference: tuple[SwarmResult, ...] | None = None) -> Summary:
    return summarise(runs, threshold=4.33, best_known=best_known, near=0.01, reference=reference)


@given(st.integers(1, 500), st.data())
def test_the_interval_of_a_share_is_wilsons(of: int, data: st.DataObject) -> None:
    count = data.draw(st.integers(0, of))
    z, p = 1.959963984540054, count / of  # the normal distribution's 97.5th percentile
    middle, half = p + z * z / (2 * of), z * math.sqrt(p * (1 - p) / of + z * z / (4 * of * of))
    expected = [(middle + sign * half) / (1 + z * z / of) for sign in (-1, 1)]
    np.testing.assert_allclose(share_interval(count, of), expected, atol=1e-12)


def test_nothing_has_no_mean_and_no_spread() -> None:
    values = [mean([]), median([]), share([], bool), *dataclasses.astuple(Spread.of([]))]
    assert all(math.isnan(value) for value in values)
    assert Spread.of([1.0, 2.0, 3.0]) == Spread(median=2.0, p95=2.9, greatest=3.0)


def test_a_row_by_hand() -> None:
    row = summary(result(3.0), result(3.03), result(3.0301), result(4.33), result(4.4), result(2.0, violation=0.1))
    assert (row.worst, row.best) == (4.4, 3.0)
    assert row.mean == pytest.approx((3.0 + 3.03 + 3.0301 + 4.33 + 4.4) / 5)
    assert row.threshold_share == 4 / 6
    assert row.near_share == 2 / 6
    assert row.feasible_share == 5 / 6
    assert row.p_value is None


def test_a_row_without_a_feasible_run() -> None:
    row = summary(result(1.0, violation=0.1), result(math.nan), best_known=None)
    assert all(math.isnan(value) for value in (row.worst, row.best, row.mean))
    assert (row.threshold_share, row.near_share, row.feasible_share) == (0, 0, 0)


def test_infeasible_runs_rank_last_as_ties() -> None:
    ours = (result(1.0), result(2.0), result(0.5, violation=1.0))
    theirs = (result(3.0), result(0.1, violation=2.0), result(0.2, violation=3.0))
    assert summary(*ours, reference=theirs).p_value == rank_sum([1, 2, math.inf], [3, math.inf, math.inf])
