"""What every contender minimises: vectorised functions (n, d) -> (fitness (n,), violation (n,)) in a box."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

import paper_numpy


@dataclass(frozen=True)
class Problem:
    """A function, its box, and the best value known."""

    name: str
    function: Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]
    lower: np.ndarray  # (d,)
    upper: np.ndarray  # (d,)
    constrained: bool
    best_known: float  # of the penalised value
    hit: float  # a run "hits" when it ends at most this far above the best known


def _sphere(x: np.ndarray) -> np.ndarray:
    return np.sum(x * x, axis=1)


def _rastrigin(x: np.ndarray) -> np.ndarray:
    return np.sum(x * x - 10 * np.cos(2 * np.pi * x) + 10, axis=1)


def _rosenbrock(x: np.ndarray) -> np.ndarray:
    return np.sum(100 * (x[:, 1:] - x[:, :-1] ** 2) ** 2 + (1 - x[:, :-1]) ** 2, axis=1)


def _classic(name: str, function: Callable[[np.ndarray], np.ndarray], half: float, *, shifted: bool) -> Problem:
    """A textbook function in 7-D. Where its optimum is the centre of the box it is moved away from there."""
    shift = half * np.linspace(-0.4, 0.3, 7) if shifted else np.zeros(7)

    def evaluate(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return function(x - shift), np.zeros(len(x))

    return Problem(name, evaluate, np.full(7, -half), np.full(7, half), False, 0.0, 0.01)


def _paper(name: str, mode: paper_numpy.Mode, best_known: float) -> Problem:
    function = partial(paper_numpy.objective, mode=mode)
    return Problem(name, function, paper_numpy.LOWER, paper_numpy.UPPER, True, best_known, 0.01 * best_known)


PROBLEMS = {
    problem.name: problem
    for problem in (
        _paper("paper", "goal", 2.984974500),
        _paper("paper-literal", "literal", 2.561027421),
        _classic("sphere", _sphere, 5.12, shifted=True),
        _classic("rastrigin", _rastrigin, 5.12, shifted=True),
        _classic("rosenbrock", _rosenbrock, 2.048, shifted=False),
    )
}
