"""Objectives that fail: NaN and infinity count as the worst there is, and the rest goes on."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spacearm.swarm import SwarmSettings, minimize
from support.swarm_boxes import SEEDS, SMALL_NAMED, Box, Hills, boxes, swarms

BOX = np.array([3.0, -9.0]), np.array([5.0, -8.5])
NAMES = pytest.mark.parametrize("name", SMALL_NAMED)


@settings(max_examples=30)
@given(boxes(), swarms(), SEEDS, st.sampled_from([np.nan, np.inf]), st.booleans())
def test_what_fails_here_and_there_is_stepped_over(
    box: Box, chosen: SwarmSettings, seed: int, failure: float, in_violation: bool
) -> None:
    hills = Hills(*box)
    counted = []

    def failing(x: np.ndarray) -> Any:
        fitness = hills(x)
        failed = np.modf(fitness * 1e6)[0] < 0.4  # the same positions always fail
        counted.append(failed.sum())
        if in_violation:
            return fitness, np.where(failed, failure, 0.0)
        return np.where(failed, failure, fitness)

    run = minimize(failing, *box, chosen, rng=seed)
    assert (np.vstack(hills.asked) >= box[0]).all()
    assert (np.vstack(hills.asked) <= box[1]).all()
    assert run.failed_evaluations == (sum(counted) if np.isnan(failure) else 0)
    survivors = [v for v in hills(np.vstack(hills.asked)) if np.modf(v * 1e6)[0] >= 0.4]
    if survivors:
        assert run.success
        assert run.fitness == min(survivors)
    else:
        assert not run.success
    if run.success and run.failed_evaluations:
        assert f"{run.failed_evaluations} of {run.evaluations} evaluations gave NaN" in run.message


@NAMES
@pytest.mark.parametrize("failure", [np.nan, np.inf])
def test_where_everything_fails_the_run_says_so(name: str, failure: float) -> None:
    run = minimize(lambda x: np.full(len(x), failure), *BOX, SMALL_NAMED[name], rng=0)
    assert not run.success
    assert run.status == "budget"
    assert run.failed_evaluations == (run.evaluations if np.isnan(failure) else 0)
    assert "every evaluation failed" in run.message
    assert run.fitness == np.inf


@pytest.mark.parametrize("name", ["evolving-rising", "ipso-e"])
def test_f_is_asked_inside_the_bounds_after_failures_too(name: str) -> None:
    f = Hills(*BOX)

    def failing(x: np.ndarray) -> np.ndarray:
        return np.where(np.arange(len(x)) % 2, f(x), np.nan)

    minimize(failing, *BOX, SMALL_NAMED[name], rng=0)
    asked = np.vstack(f.asked)
    assert (asked >= BOX[0]).all()
    assert (asked <= BOX[1]).all()


def test_where_everything_fails_the_result_still_lies_in_the_box() -> None:
    run = minimize(lambda x: np.full(len(x), np.nan), *BOX, SMALL_NAMED["pso"], rng=0)
    assert (run.x >= BOX[0]).all()
    assert (run.x <= BOX[1]).all()


@NAMES
def test_a_swarm_recovers_from_a_failed_first_round(name: str) -> None:
    rounds = []

    def late(x: np.ndarray) -> np.ndarray:
        rounds.append(len(x))
        return np.full(len(x), np.nan) if len(rounds) == 1 else Hills(*BOX)(x)

    run = minimize(late, *BOX, SMALL_NAMED[name], rng=4)
    assert run.success
    assert run.failed_evaluations == rounds[0]
    assert (run.x >= BOX[0]).all()
    assert (run.x <= BOX[1]).all()


def test_an_exception_in_f_is_the_callers_own() -> None:
    class Mine(Exception):
        pass

    def broken(x: np.ndarray) -> np.ndarray:
        raise Mine

    with pytest.raises(Mine):
        minimize(broken, *BOX, SMALL_NAMED["pso"], rng=0)


def logarithm(x: np.ndarray) -> np.ndarray:
    with np.errstate(divide="ignore"):
        return np.log(np.maximum(x[:, 0], 0.0))


@NAMES
def test_minus_infinity_is_no_best_and_is_told(name: str) -> None:
    """Half of the box has no logarithm."""
    told = []

    def f(x: np.ndarray) -> np.ndarray:
        told.append(logarithm(x) + 1000)  # one of the variants wants positive numbers
        return told[-1]

    run = minimize(f, [-5, -5], [5, 5], SMALL_NAMED[name], rng=0)
    values = np.concatenate(told)
    finite = np.isfinite(values)
    assert run.success
    assert run.fitness == values[finite].min()
    assert run.failed_evaluations == run.minus_infinite_evaluations == np.count_nonzero(~finite)
    assert f"{np.count_nonzero(~finite)} of {run.evaluations} evaluations gave NaN or minus infinity" in run.message
    assert "every evaluation" not in run.message


MIXED = [np.nan, np.inf, -np.inf]


@settings(max_examples=30)
@given(boxes(), swarms(), SEEDS, st.lists(st.sampled_from(MIXED), min_size=1, max_size=4), st.sampled_from([0.1, 0.5, 1.0]))
def test_whatever_mixture_fails_the_finite_ones_count(
    box: Box, chosen: SwarmSettings, seed: int, failures: list[float], share: float
) -> None:
    hills, told = Hills(*box), []

    def failing(x: np.ndarray) -> np.ndarray:
        fitness = hills(x)
        draw = np.modf(fitness * 1e6)[0]
        which = (np.modf(fitness * 1e9)[0] * len(failures)).astype(int)
        told.append(np.where(draw < share, np.array(failures)[which], fitness))
        return told[-1]

    run = minimize(failing, *box, chosen, rng=seed)
    values = np.concatenate(told)
    assert run.minus_infinite_evaluations == np.count_nonzero(values == -np.inf)
    assert run.infinite_evaluations == np.count_nonzero(values == np.inf)
    assert run.failed_evaluations == np.count_nonzero(np.isnan(values) | (values == -np.inf))
    finite = values[np.isfinite(values)]
    assert run.success == bool(finite.size)
    assert ("every evaluation failed" in run.message) == (not finite.size)
    if finite.size:
        assert run.fitness == finite.min()


def test_infinite_wherever_it_is_allowed_is_not_every_evaluation() -> None:
    def f(x: np.ndarray) -> Any:
        allowed = x[:, 0] < 4
        return np.where(allowed, np.inf, x[:, 1]), np.where(allowed, 0.0, 1.0)

    run = minimize(f, *BOX, SMALL_NAMED["pso"], rng=0)
    assert not run.success
    assert "f is infinite wherever nothing is violated" in run.message
    assert "every evaluation" not in run.message


def test_a_resumed_run_counts_what_failed_before(tmp_path: Any) -> None:
    path, chosen = tmp_path / "swarm.npz", SMALL_NAMED["pso"]
    whole = minimize(logarithm, [-5, -5], [5, 5], chosen, rng=3)
    minimize(logarithm, [-5, -5], [5, 5], chosen, rng=3, checkpoint=path, callback=lambda swarm: swarm.iteration == 4)
    again = minimize(logarithm, [-5, -5], [5, 5], chosen, rng=3, checkpoint=path, resume=True)
    assert again.minus_infinite_evaluations == whole.minus_infinite_evaluations > 0
    assert again.message == whole.message
