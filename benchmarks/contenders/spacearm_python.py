"""spacearm as a Python user meets it: `spacearm.minimize` with the very NumPy function the others get."""

import spacearm as sa
from contenders.protocol import Task, serve


def _table_1(task: Task) -> sa.PSO:
    """Table 1: c1 = c2 = 2 and w = 0.5 are PSO's defaults."""
    return sa.PSO(particles=task.particles, iterations=task.iterations)


def pso_penalty(task: Task) -> None:
    sa.minimize(task.penalised, task.lower, task.upper, _table_1(task), rng=task.seed)


def pso(task: Task) -> None:
    """The function returns (fitness, violation): feasible first."""
    sa.minimize(task.evaluate, task.lower, task.upper, _table_1(task), rng=task.seed)


def ipso(task: Task) -> None:
    settings = sa.IPSO(particles=task.particles, iterations=task.iterations)
    sa.minimize(task.evaluate, task.lower, task.upper, settings, rng=task.seed)


if __name__ == "__main__":
    serve(
        "spacearm_python",
        {("PSO", "penalty"): pso_penalty, ("PSO", "feasible first"): pso, ("IPSO", "feasible first"): ipso},
        distribution="spacearm",
    )
