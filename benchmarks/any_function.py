"""The named settings of the swarm on well-known functions: which should `minimize` take if it is told nothing?

    python benchmarks/any_function.py        # 1 min; 10 runs of 30,000 evaluations each

Prints the median fitness, less is better, and how many of the runs ended without violation if not all did.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

import spacearm as sa

Array = NDArray[np.float64]
SETTINGS = ("pso", "constriction", "ring", "ring-small", "ring-forgiving", "ring-rising", "ipso-e")
RUNS = 10


def sphere(x: Array) -> Array:
    return ((x - 0.7) ** 2).sum(1)


def rosenbrock(x: Array) -> Array:
    return (100 * (x[:, 1:] - x[:, :-1] ** 2) ** 2 + (1 - x[:, :-1]) ** 2).sum(1)


def rastrigin(x: Array) -> Array:
    y = x - 0.7
    return (y**2 - 10 * np.cos(2 * np.pi * y) + 10).sum(1)


def ackley(x: Array) -> Array:
    y = x - 0.7
    return -20 * np.exp(-0.2 * np.sqrt((y**2).mean(1))) - np.exp(np.cos(2 * np.pi * y).mean(1)) + 20 + np.e


def griewank(x: Array) -> Array:
    y = x - 7
    return (y**2).sum(1) / 4000 - np.prod(np.cos(y / np.sqrt(np.arange(1, x.shape[1] + 1))), axis=1) + 1


def broken(*g: Array) -> Array:
    """Add up constraints that should be 0 or less."""
    return sum((np.maximum(each, 0) for each in g), np.zeros(len(g[0])))


def g04(x: Array) -> tuple[Array, Array]:
    x1, x2, x3, x4, x5 = x.T
    f = 5.3578547 * x3**2 + 0.8356891 * x1 * x5 + 37.293239 * x1 - 40792.141
    u = 85.334407 + 0.0056858 * x2 * x5 + 0.0006262 * x1 * x4 - 0.0022053 * x3 * x5
    v = 80.51249 + 0.0071317 * x2 * x5 + 0.0029955 * x1 * x2 + 0.0021813 * x3**2
    w = 9.300961 + 0.0047026 * x3 * x5 + 0.0012547 * x1 * x3 + 0.0019085 * x3 * x4
    return f, broken(-u, u - 92, 90 - v, v - 110, 20 - w, w - 25)


def g06(x: Array) -> tuple[Array, Array]:
    x1, x2 = x.T
    g = 100 - (x1 - 5) ** 2 - (x2 - 5) ** 2, (x1 - 6) ** 2 + (x2 - 5) ** 2 - 82.81
    return (x1 - 10) ** 3 + (x2 - 20) ** 3, broken(*g)


def g09(x: Array) -> tuple[Array, Array]:
    x1, x2, x3, x4, x5, x6, x7 = x.T
    f = (x1 - 10) ** 2 + 5 * (x2 - 12) ** 2 + x3**4 + 3 * (x4 - 11) ** 2 + 10 * x5**6 + 7 * x6**2 + x7**4 - 4 * x6 * x7
    g = (
        2 * x1**2 + 3 * x2**4 + x3 + 4 * x4**2 + 5 * x5 - 127,
        7 * x1 + 3 * x2 + 10 * x3**2 + x4 - x5 - 282,
        23 * x1 + x2**2 + 6 * x6**2 - 8 * x7 - 196,
        4 * x1**2 + x2**2 - 3 * x1 * x2 + 2 * x3**2 + 5 * x6 - 11 * x7,
    )
    return f - 10 * x6 - 8 * x7, broken(*g)


def g11(x: Array) -> tuple[Array, Array]:
    x1, x2 = x.T
    return x1**2 + (x2 - 1) ** 2, broken(abs(x2 - x1**2) - 1e-4)


FREE = {sphere: 5, rosenbrock: 5, rastrigin: 5.12, ackley: 30, griewank: 100}
Problem = tuple[Callable[[Array], Any], list[float], list[float]]
PROBLEMS: dict[str, Problem] = {
    f"{f.__name__}, {d}": (f, [-bound] * d, [bound] * d) for d in (2, 7, 20) for f, bound in FREE.items()
} | {
    "g04, best -30665.54": (g04, [78, 33, 27, 27, 27], [102, 45, 45, 45, 45]),
    "g06, best -6961.81": (g06, [13, 0], [100, 100]),
    "g09, best 680.63": (g09, [-10] * 7, [10] * 7),
    "g11, best 0.7499": (g11, [-1, -1], [1, 1]),
}


def main() -> None:
    """Print a row for each function."""
    print("| function, dimensions | " + " | ".join(f"`{name}`" for name in SETTINGS) + " |")
    print("|---" * (1 + len(SETTINGS)) + "|")
    for name, (f, lower, upper) in PROBLEMS.items():
        cells = []
        for settings in SETTINGS:
            runs = [sa.minimize(f, lower, upper, sa.named_settings(settings), rng=seed) for seed in range(RUNS)]
            feasible = sum(run.violation <= 0 for run in runs)
            cells.append(
                f"{np.median([run.fitness for run in runs]):.5g}{'' if feasible == RUNS else f' ({feasible} of {RUNS})'}"
            )
        print(f"| {name} | " + " | ".join(cells) + " |", flush=True)


if __name__ == "__main__":
    main()
