"""How a contender runs and reports: one JSON object, the last line of its stdout.

A contender is `solve(task)`, which spends `task.budget` evaluations through `task.evaluate` (or
`task.penalised`) and returns nothing. What it found is taken from what it evaluated, not from what it claims,
and evaluations beyond the budget do not count, so nobody can be better by spending more.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import platform
import sys
import time
import traceback
from collections.abc import Callable, Sequence
from importlib.metadata import version
from typing import Any, Literal

import numpy as np

import paper_numpy
from contenders.problems import PROBLEMS, Problem

Handling = Literal["penalty", "feasible first", "rising penalty"]  # the last is judged feasible first
Solver = Callable[["Task"], None]


class Task:
    """One run of one method: a problem, a seed, a budget; counts, times and remembers what is evaluated."""

    def __init__(self, problem: Problem, seed: int, particles: int, iterations: int, handling: Handling) -> None:
        self.problem, self.seed, self.handling = problem, seed, handling
        self.lower, self.upper = problem.lower.copy(), problem.upper.copy()
        self.particles, self.iterations = particles, iterations
        self.budget = particles * iterations
        self.evaluations = self.calls = 0
        self.objective_seconds = self.bookkeeping_seconds = 0.0
        self.best: tuple[float, float] | None = None  # fitness, violation
        self.best_x: np.ndarray | None = None

    def evaluate(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Fitness and violation of the rows of x (n, d)."""
        start = time.perf_counter()
        fitness, violation = self.problem.function(x)
        middle = time.perf_counter()
        self._remember(x, fitness, violation)
        self.objective_seconds += middle - start
        self.bookkeeping_seconds += time.perf_counter() - middle
        return fitness, violation

    def penalised(self, x: np.ndarray) -> np.ndarray:
        """F + 100 violation of the rows of x (n, d), (n,)."""
        fitness, violation = self.evaluate(x)
        return fitness + paper_numpy.PENALTY * violation

    def fitness_again(self, x: np.ndarray) -> np.ndarray:
        """Fitness of rows of x that were evaluated before: it costs time, not budget."""
        start = time.perf_counter()
        fitness, _ = self.problem.function(x)
        self.objective_seconds += time.perf_counter() - start
        return fitness

    def found(self, x: np.ndarray, evaluations: int) -> None:
        """Hand in the best x (d,) of a solver that evaluates inside itself; it is evaluated again here."""
        start = time.perf_counter()
        fitness, violation = self.problem.function(x[None, :])
        self.best, self.best_x = (float(fitness[0]), float(violation[0])), np.array(x)
        self.evaluations, self.calls = evaluations, 1
        self.bookkeeping_seconds += time.perf_counter() - start

    def _remember(self, x: np.ndarray, fitness: np.ndarray, violation: np.ndarray) -> None:
        allowed = max(0, min(len(x), self.budget - self.evaluations))
        self.calls += 1
        self.evaluations += len(x)
        if allowed:
            i = int(np.lexsort(self._keys(fitness[:allowed], violation[:allowed]))[0])
            candidate = (float(fitness[i]), float(violation[i]))
            if self.best is None or self._key(candidate) < self._key(self.best):
                self.best, self.best_x = candidate, np.array(x[i])

    def _keys(self, fitness: np.ndarray, violation: np.ndarray) -> tuple[np.ndarray, ...]:
        if self.handling == "penalty":
            return (fitness + paper_numpy.PENALTY * violation,)
        return (fitness, violation)  # lexsort: the last key counts first

    def _key(self, pair: tuple[float, float]) -> tuple[float, ...]:
        fitness, violation = pair
        return (fitness + paper_numpy.PENALTY * violation,) if self.handling == "penalty" else (violation, fitness)

    def __deepcopy__(self, memo: dict) -> Task:
        return self  # some libraries copy the problem they are given; the count must stay one


def serve(
    library: str,
    methods: dict[tuple[str, Handling], Solver],
    *,
    distribution: str | None = None,
    problems: Sequence[str] = tuple(PROBLEMS),
) -> None:
    """Run every method on the problems named on the command line and print the report.

    `problems` are those that the contender can solve; the others are left out.
    """
    parser = argparse.ArgumentParser(description=f"contender: {library}")
    parser.add_argument("--problems", nargs="+", default=["paper"], choices=sorted(PROBLEMS))
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--particles", type=int, default=300)
    parser.add_argument("--iterations", type=int, default=100)
    args = parser.parse_args()
    report: dict[str, Any] = {
        "library": library,
        "version": version(distribution or library),
        "python": platform.python_version(),
        "numpy": np.__version__,
        "results": [],
    }
    with contextlib.redirect_stdout(sys.stderr):  # some libraries print
        for name in (asked for asked in args.problems if asked in problems):
            problem = PROBLEMS[name]
            for (method, handling), solve in methods.items():
                if handling == "feasible first" and not problem.constrained and (method, "penalty") in methods:
                    continue  # the same run twice
                result: dict[str, Any] = {"problem": name, "method": method, "handling": handling}
                try:
                    tasks = (Task(problem, s, args.particles, args.iterations, handling) for s in range(args.seeds))
                    result["runs"] = [_run(solve, task) for task in tasks]
                except Exception as error:  # a contender that fails is a row of the table
                    traceback.print_exc()
                    result["failure"] = f"{type(error).__name__}: {error}"
                report["results"].append(result)
    print(json.dumps(report))


def _run(solve: Solver, task: Task) -> dict[str, Any]:
    start = time.perf_counter()
    solve(task)
    seconds = time.perf_counter() - start - task.bookkeeping_seconds
    if task.best is None or task.best_x is None:
        raise RuntimeError("nothing was evaluated")
    fitness, violation = task.problem.function(task.best_x[None, :])  # again, from the data of the problem
    inside = bool(np.all(task.best_x >= task.lower) and np.all(task.best_x <= task.upper))
    return {
        "seed": task.seed,
        "seconds": seconds,
        "objective_seconds": task.objective_seconds,
        "calls": task.calls,
        "evaluations": task.evaluations,
        "fitness": float(fitness[0]),
        "violation": float(violation[0]),
        "inside_bounds": inside,
        "x": task.best_x.tolist(),
    }
