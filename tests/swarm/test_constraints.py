"""Constraints: feasible first, a known optimum on the boundary, and the least violation where nothing is feasible."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings

from spacearm.swarm import SwarmSettings, minimize
from support.swarm_boxes import SEEDS, SMALL_NAMED, Box, Hills, boxes, swarms

CORNER = np.array([1.0, 1.0]), np.array([5.0, 5.0])


def hyperbola(x: np.ndarray) -> Any:
    """x + y at least, where x y >= 4: the optimum is (2, 2), with 4, on the boundary."""
    return x.sum(axis=1), 4 - x.prod(axis=1)


@pytest.mark.parametrize("name", SMALL_NAMED)
def test_the_constrained_optimum_is_found(name: str) -> None:
    """Within 0.015 of it in 54 of 60 runs, all feasible.

    Over 1000 seeds every named swarm was feasible each time and within 0.015 in 98.5 % or more; that 7 of 60 then miss
    it has a chance of 3e-5, and 3e-4 over the ten.
    """
    runs = [minimize(hyperbola, *CORNER, SMALL_NAMED[name], rng=seed) for seed in range(60)]
    assert all(run.success and run.violation == 0 for run in runs)
    assert all(run.x.prod() >= 4 for run in runs)
    assert sum(run.fitness <= 4.015 for run in runs) >= 54


@settings(max_examples=30)
@given(boxes(), swarms(), SEEDS)
def test_no_evaluated_position_beats_the_result_feasible_first(box: Box, chosen: SwarmSettings, seed: int) -> None:
    f = Hills(*box, constrained=True)
    run = minimize(f, *box, chosen, rng=seed)
    fitness, violation = Hills(*box, constrained=True)(np.vstack(f.asked))
    assert (run.violation, run.fitness) == min(zip(np.maximum(violation, 0), fitness, strict=True))
    assert run.success == bool((violation <= 0).any())


@settings(max_examples=25)
@given(boxes(), swarms(), SEEDS)
def test_where_nothing_is_feasible_the_least_violation_is_kept(box: Box, chosen: SwarmSettings, seed: int) -> None:
    told = []

    def impossible(x: np.ndarray) -> Any:
        violation = 1 + ((x - box[0]) ** 2).sum(axis=1)
        told.append(violation)
        return 5 - violation, violation

    # Positive fitness is what the cooperative variant needs.
    run = minimize(lambda x: (np.exp(impossible(x)[0]) + 1e-300, told[-1]), *box, chosen, rng=seed)
    assert not run.success
    assert run.violation == min(v.min() for v in told)
    assert "nothing feasible was found" in run.message


def test_a_negative_violation_is_none() -> None:
    run = minimize(lambda x: (x[:, 0], np.full(len(x), -3.0)), *CORNER, SMALL_NAMED["ring"], rng=0)
    assert run.success
    assert run.violation == 0
    assert (run.history.violation == 0).all()
