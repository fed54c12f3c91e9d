"""spacearm as a Python user meets it: `spacearm.minimize` with the very NumPy function the others get."""

from dataclasses import replace

import spacearm as sa
from contenders.protocol import Task, serve
from spacearm.swarm import SwarmSettings


def fitted(task: Task, settings: SwarmSettings) -> SwarmSettings:
    """The settings with as many iterations as the budget allows."""
    return replace(settings, iterations=task.budget // settings.particles)


def _run(task: Task, settings: SwarmSettings, *, penalised: bool = False) -> None:
    f = task.penalised if penalised else task.evaluate  # or a pair: fitness and violation
    sa.minimize(f, task.lower, task.upper, fitted(task, settings), rng=task.seed)


def pso_penalty(task: Task) -> None:
    """Table 1: c1 = c2 = 2 and w = 0.5 are PSO's defaults."""
    _run(task, sa.PSO(particles=task.particles), penalised=True)


def pso(task: Task) -> None:
    _run(task, sa.PSO(particles=task.particles))


def ipso(task: Task) -> None:
    _run(task, sa.named_settings("ipso-m"))


def ring(task: Task) -> None:
    _run(task, sa.named_settings("ring-rising"))


if __name__ == "__main__":
    serve(
        "spacearm_python",
        {
            ("PSO", "penalty"): pso_penalty,
            ("PSO", "feasible first"): pso,
            ("IPSO-M", "feasible first"): ipso,
            ("ring-rising", "rising penalty"): ring,
        },
        distribution="spacearm",
    )
