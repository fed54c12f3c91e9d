"""Runs of a swarm from beginning to end: over any Python function (`minimize`), or inside the kernel (`run_trials`)."""

# pyright: reportUnnecessaryIsInstance=false
# What callers pass is checked at run time too.

from __future__ import annotations

import os
import time
from collections.abc import Callable
from pathlib import Path
from typing import Literal, TypeAlias, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm.core.checks import as_number, dimensions_of, shown
from spacearm.core.errors import OutputError, SettingsError, SwarmError
from spacearm.core.interrupts import interrupt_taken
from spacearm.core.native import native
from spacearm.core.random_seed import Rng
from spacearm.core.records import as_dict, one_of, whole
from spacearm.swarm.ask_tell import Swarm, SwarmHistory, SwarmResult
from spacearm.swarm.swarm_settings import SwarmSettings, kernel_settings

Array = NDArray[np.float64]

Objective = Callable[[Array], object]
"""(particles, d) -> (particles,), or -> ((particles,), (particles,)): fitness and violation."""


def minimize(
    f: Objective,
    lower: ArrayLike,
    upper: ArrayLike,
    settings: SwarmSettings | None = None,
    *,
    rng: Rng = None,
    initial: ArrayLike | None = None,
    vectorized: bool = True,
    target: float | None = None,
    stall_iterations: int | None = None,
    max_seconds: float | None = None,
    callback: Callable[[Swarm], object] | None = None,
    history: Literal["best", "positions"] = "best",
    checkpoint: str | os.PathLike[str] | None = None,
    checkpoint_every: int = 10,
    resume: bool = False,
) -> SwarmResult:
    """Minimise a function over a box, subject to constraints if it tells of any. To maximise, minimise its negative.

    Args:
        f: is given all particles at once, (particles, d), and returns their fitness (particles,), or a pair of fitness and
            violation, each (particles,); a violation of 0 or less is none. It is never called outside the bounds,
            gets every candidate once, and may return NaN where it fails. NaN and minus infinity count as the worst there is.
        lower: (d,) lower bounds, finite.
        upper: (d,) upper bounds, finite; equal to the lower one where a dimension is fixed.
        settings: `PSO(...)` or `IPSO(...)`; particles x iterations is the budget of evaluations. None: 100 x 300 of
            `named_settings("ring-small")`.
        rng: random seed, generator, or None for a fresh seed. The result records it.
        initial: (k, d) positions to begin with, evaluated as they are; the result is never worse than the best of them.
        vectorized: False if f takes one position (d,) and returns one number, or a pair.
        target: stop at a feasible fitness at most this.
        stall_iterations: stop when the best has not improved for this number of iterations.
        max_seconds: stop after this time.
        callback: called after each iteration with the swarm (its `iteration`, `best_x`, `best_fitness`,
            `best_violation`, ...); returning True or raising StopIteration stops.
        history: "positions" also keeps the best position of every iteration.
        checkpoint: a file written at the start, every `checkpoint_every` iterations, and at the end.
        checkpoint_every: iterations between two checkpoints.
        resume: go on from the checkpoint if it exists; the result is the same, bit for bit, as without the stop.

    Returns:
        The best found. Ctrl-C ends the run with what there is, status "interrupted".

    Raises:
        SettingsError: bounds, settings or limits that cannot be.
        SwarmError: f returns another shape than it should.
        OutputError: the checkpoint exists and `resume` is not set, or cannot be written.
    """
    if not callable(f):
        raise SettingsError(f"f is {shown(f)}, expected a function of positions (particles, d)")
    if callback is not None and not callable(callback):
        raise SettingsError(f"callback is {shown(callback)}, expected a function of the swarm")
    stop = _Stop(target=target, stall_iterations=stall_iterations, max_seconds=max_seconds)
    one_of("history", history, ("best", "positions"))
    whole("checkpoint_every", checkpoint_every, at_least=1, at_most=10**9)
    swarm = Swarm(lower, upper, settings, rng=rng, initial=initial, keep_positions=history == "positions")
    if checkpoint is not None:
        swarm = _opened(checkpoint, swarm, resume=resume, rng=rng, initial=initial)
        swarm.save(checkpoint)  # so that a place that cannot be written is found before the work
    elif resume:
        raise SettingsError("resume is True without a checkpoint, expected the file to go on from; pass checkpoint=...")
    evaluate = f if vectorized else _row_by_row(f)
    status = stop.caught_up(swarm) or "budget"
    try:
        while status == "budget" and not swarm.done:
            x = swarm.ask()
            swarm.tell(*_fitness_and_violation(evaluate(x), len(x)))
            if checkpoint is not None and swarm.iteration % checkpoint_every == 0:
                swarm.save(checkpoint)
            stopped = callback is not None and _asks_to_stop(callback, swarm)
            status = "callback" if stopped else stop.reason(swarm) or "budget"
    except KeyboardInterrupt:
        if swarm.iteration == 0:
            raise
        interrupt_taken()
        return swarm.result("interrupted")
    if checkpoint is not None:
        swarm.save(checkpoint)
    return swarm.result(status)


class _Stop:
    """The optional reasons to stop before the budget is spent."""

    def __init__(self, *, target: float | None, stall_iterations: int | None, max_seconds: float | None) -> None:
        self.target = None if target is None else as_number("target", target, SettingsError)
        self.stall = (
            None if stall_iterations is None else whole("stall_iterations", stall_iterations, at_least=1, at_most=10**9)
        )
        limit = (
            None
            if max_seconds is None
            else as_number("max_seconds", max_seconds, SettingsError, above=0, at_most=1e9, unit="s")
        )
        self.deadline = None if limit is None else time.perf_counter() + limit
        self._best = (np.inf, np.inf)
        self._improved = 0

    def caught_up(self, swarm: Swarm) -> str | None:
        """Look at the iterations that a resumed swarm has behind it; return why it would have stopped after the last."""
        reason = None
        history = swarm.result().history
        for i, now in enumerate(zip(history.violation, history.fitness, strict=True)):
            reason = self._after(i + 1, (float(now[0]), float(now[1])))
        return reason

    def reason(self, swarm: Swarm) -> str | None:
        return self._after(swarm.iteration, (swarm.best_violation, swarm.best_fitness)) or self._late()

    def _after(self, iteration: int, now: tuple[float, float]) -> str | None:
        if self.target is not None and now[0] <= 0 and now[1] <= self.target:
            return "target"
        if now < self._best:
            self._best, self._improved = now, iteration
        if self.stall is not None and iteration - self._improved >= self.stall:
            return "stalled"
        return None

    def _late(self) -> str | None:
        return "time" if self.deadline is not None and time.perf_counter() > self.deadline else None


def _fitness_and_violation(returned: object, n: int) -> tuple[ArrayLike, ArrayLike | None]:
    """Take apart what a function of n positions returned."""
    parts = _parts(returned)
    if not isinstance(returned, tuple):
        return parts[0], None
    if len(parts) != 2:
        raise SwarmError(
            f"f returned {len(parts)} values, expected the fitness ({n},), or a pair: fitness and violation, each ({n},)"
        )
    return parts[0], parts[1]


def _row_by_row(f: Objective) -> Objective:
    """Return a function of all positions (n, d), made of one that takes a single position (d,)."""

    def evaluate(x: Array) -> object:
        returned = [f(row) for row in x]
        pairs = isinstance(returned[0], tuple)
        for value in returned:
            parts = _parts(value)
            if isinstance(value, tuple) is not pairs or len(parts) != 1 + pairs or not all(map(_is_number, parts)):
                raise SwarmError(
                    f"f returned {shown(value)} for a single position, expected a number, or always a pair of numbers: "
                    "fitness and violation"
                )
        columns = np.array([_parts(value) for value in returned], dtype=np.float64).T
        return tuple(columns) if pairs else columns[0]

    return evaluate


def _parts(value: object) -> tuple[ArrayLike, ...]:
    return cast("tuple[ArrayLike, ...]", value if isinstance(value, tuple) else (value,))


def _is_number(value: ArrayLike) -> bool:
    return dimensions_of(value) == 0 and np.asarray(value).dtype.kind in "biuf"


def _asks_to_stop(callback: Callable[[Swarm], object], swarm: Swarm) -> bool:
    try:
        answer = callback(swarm)
        return isinstance(answer, (bool, np.bool_)) and bool(cast("bool", answer))
    except StopIteration:
        return True


def _opened(path: str | os.PathLike[str], fresh: Swarm, *, resume: bool, rng: Rng, initial: ArrayLike | None) -> Swarm:
    """Return the swarm of an existing checkpoint, or the fresh one if there is none."""
    if not isinstance(path, (str, os.PathLike)) or not str(path):
        raise SettingsError(f"checkpoint is {shown(path)}, expected the path of a file")
    if not Path(path).exists():
        return fresh
    if not resume:
        raise OutputError(f"{path} exists, expected a new file for the checkpoint; pass resume=True to go on from it")
    saved = Swarm.load(path)
    given, stored = as_dict(fresh.settings), as_dict(saved.settings)
    differing = [name for name in given if given[name] != stored.get(name)]
    if type(fresh.settings) is not type(saved.settings) or differing:
        raise SettingsError(
            f"{path} was made with other settings ({', '.join(differing) or 'another swarm'}), expected the same"
        )
    if not (np.array_equal(fresh.lower, saved.lower) and np.array_equal(fresh.upper, saved.upper)):
        raise SettingsError(f"{path} was made with other bounds, expected the same; resume with those it was begun with")
    if isinstance(rng, (int, np.integer)) and saved.seed != rng:
        raise SettingsError(f"{path} was made with seed {saved.seed}, not {rng}; resume with the same rng, or with None")
    if initial is not None and not _equal(fresh.initial, saved.initial):
        raise SettingsError(f"{path} was made with another `initial`, expected the same; resume with it, or with None")
    if fresh.keep_positions != saved.keep_positions:
        raise SettingsError(f"{path} was made with another `history`, expected the same")
    return saved


def _equal(one: Array | None, other: Array | None) -> bool:
    return one is other if one is None or other is None else np.array_equal(one, other)


# ---- Runs inside the kernel, for objectives that the kernel knows ----------------------------------------------------

MOST_THREADS = 1024
"""More cost memory and win nothing."""


KernelObjective: TypeAlias = (
    native.PaperObjective32 | native.PaperObjective64 | native.ReachObjective32 | native.ReachObjective64
)
"""What the kernel can evaluate by itself."""


def run_trials(
    objective: KernelObjective,
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
    progress: Callable[[int], object] | None = None,
) -> list[SwarmResult]:
    """Run independent trials of a swarm on a kernel objective, spread over threads.

    A trial's numbers depend on the random seed and its own number only: they are the same bits on any number of threads.

    Args:
        objective: one of the kernel's, of either precision.
        lower: (d,) lower bounds.
        upper: (d,) upper bounds.
        settings: of each swarm.
        seed: random seed of all trials.
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
        lower=np.ascontiguousarray(lower, dtype=np.float64),
        upper=np.ascontiguousarray(upper, dtype=np.float64),
        settings=kernel_settings(settings),
        seed=seed,
        first_trial=first_trial,
        trials=trials,
        threads=whole("threads", threads if threads is not None else os.cpu_count() or 1, at_least=1, at_most=MOST_THREADS),
        keep_positions=keep_positions,
        stop_when_feasible=stop_when_feasible,
        seconds=float(max_seconds or 0.0),
        initial=initial,
        progress=progress,
    )
    seconds = time.perf_counter() - begun
    return [
        _result(
            run,
            settings,
            seed,
            first_trial + i,
            seconds / max(trials, 1),
            keep_positions=keep_positions,
            stop_when_feasible=stop_when_feasible,
            timed=bool(max_seconds),
        )
        for i, run in enumerate(found)
        if run.rounds
    ]


def _result(
    run: native.TrialResult32 | native.TrialResult64,
    settings: SwarmSettings,
    seed: int,
    trial: int,
    seconds: float,
    *,
    keep_positions: bool,
    stop_when_feasible: bool,
    timed: bool,
) -> SwarmResult:
    budget = settings.particles * settings.iterations
    spent = run.evaluations + settings.particles > budget
    feasible = stop_when_feasible and run.first_feasible_round >= 0
    return SwarmResult(
        x=run.position.astype(np.float64),
        fitness=run.fitness,
        violation=run.violation,
        status="feasible" if feasible else "budget" if spent else "time" if timed else "callback",
        iterations=run.rounds,
        evaluations=run.evaluations,
        failed_evaluations=0,
        seed=seed,
        trial=trial,
        settings=settings,
        history=SwarmHistory(
            fitness=run.fitness_history.astype(np.float64),
            violation=run.violation_history.astype(np.float64),
            evaluations=run.evaluation_history,
            positions=run.position_history.astype(np.float64) if keep_positions else None,
        ),
        seconds=seconds,
    )
