"""Whole runs inside the kernel, for objectives that the kernel knows."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from spacearm._kernel import native
from spacearm.settings import whole
from spacearm.swarm.result import SwarmHistory, SwarmResult
from spacearm.swarm.settings import SwarmSettings, kernel_settings

MOST_THREADS = 1024
"""More cost memory and win nothing."""


def run_trials(
    objective: Any,
    lower: ArrayLike,
    upper: ArrayLike,
    settings: SwarmSettings,
    *,
    seed: int,
    trials: int = 1,
    first_trial: int = 0,
    threads: int | None = None,
    keep_positions: bool = False,
    stop_when_feasible: bool = False,
    max_seconds: float | None = None,
    initial: np.ndarray | None = None,
    progress: Callable[[int], Any] | None = None,
) -> list[SwarmResult]:
    """Run independent trials of a swarm on a kernel objective, spread over threads.

    A trial's numbers depend on the seed and its own number only: they are the same bits on any number of threads.

    Args:
        objective: one of the kernel's, of either precision.
        lower: (d,) lower bounds.
        upper: (d,) upper bounds.
        settings: of each swarm.
        seed: of all trials.
        trials: how many; they are numbered from `first_trial` on.
        first_trial: number of the first.
        threads: None for one a processor core.
        keep_positions: keep the best position of every iteration.
        stop_when_feasible: end a trial at its first feasible candidate.
        max_seconds: end a trial after this time.
        initial: (k, d) positions to begin with.
        progress: called now and then with the number of iterations done over all trials; returning False stops.

    Returns:
        A result a trial, in order; those not begun when the run was stopped are left out.

    Raises:
        KeyboardInterrupt: Ctrl-C, within a tenth of a second.
    """
    begun = time.perf_counter()
    found = objective.search(
        np.ascontiguousarray(lower, dtype=np.float64),
        np.ascontiguousarray(upper, dtype=np.float64),
        native.SwarmSettings.make(kernel_settings(settings)),
        seed,
        first_trial,
        trials,
        whole("threads", threads if threads is not None else os.cpu_count() or 1, at_least=1, at_most=MOST_THREADS),
        keep_positions,
        stop_when_feasible,
        float(max_seconds or 0.0),
        initial,
        progress,
    )
    seconds = time.perf_counter() - begun
    return [
        _result(run, settings, seed, first_trial + i, seconds / max(trials, 1), stop_when_feasible, bool(max_seconds))
        for i, run in enumerate(found)
        if run["rounds"]
    ]


def _result(
    run: dict[str, Any],
    settings: SwarmSettings,
    seed: int,
    trial: int,
    seconds: float,
    stop_when_feasible: bool,
    timed: bool,
) -> SwarmResult:
    budget = settings.particles * settings.iterations
    spent = run["evaluations"] + settings.particles > budget
    feasible = stop_when_feasible and run["first_feasible_round"] >= 0
    positions = run.get("position_history")
    return SwarmResult(
        x=run["position"].astype(np.float64),
        fitness=run["fitness"],
        violation=run["violation"],
        status="feasible" if feasible else "budget" if spent else "time" if timed else "callback",
        iterations=run["rounds"],
        evaluations=run["evaluations"],
        failed_evaluations=0,
        seed=seed,
        trial=trial,
        settings=settings,
        history=SwarmHistory(
            fitness=run["fitness_history"].astype(np.float64),
            violation=run["violation_history"].astype(np.float64),
            evaluations=run["evaluation_history"],
            positions=None if positions is None else positions.astype(np.float64),
        ),
        seconds=seconds,
    )
