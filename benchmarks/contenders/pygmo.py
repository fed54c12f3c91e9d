"""pygmo: generational PSO with Table 1's settings and its defaults, in batches; sade, one by one."""

import numpy as np
import pygmo as pg

from contenders.protocol import Task, serve


class _Problem:
    def __init__(self, task: Task) -> None:
        self.task = task

    def fitness(self, x: np.ndarray) -> np.ndarray:
        return self.task.penalised(x[None, :])

    def batch_fitness(self, x: np.ndarray) -> np.ndarray:
        return self.task.penalised(x.reshape(-1, len(self.task.lower)))

    def get_bounds(self) -> tuple[np.ndarray, np.ndarray]:
        return self.task.lower, self.task.upper


# inertia weight and global best instead of its defaults, constriction and a ring
TABLE_1 = {"omega": 0.5, "eta1": 2.0, "eta2": 2.0, "max_vel": 1.0, "variant": 1, "neighb_type": 1}


def _pso(task: Task, **settings: float) -> None:
    batch = pg.bfe(pg.member_bfe())
    population = pg.population(pg.problem(_Problem(task)), size=task.particles, b=batch, seed=task.seed)
    swarm = pg.pso_gen(gen=task.iterations - 1, seed=task.seed, **settings)
    swarm.set_bfe(batch)
    pg.algorithm(swarm).evolve(population)


def pso(task: Task) -> None:
    _pso(task, **TABLE_1)


def pso_default(task: Task) -> None:
    _pso(task)


def sade(task: Task) -> None:
    size = 100
    population = pg.population(pg.problem(_Problem(task)), size=size, seed=task.seed)
    pg.algorithm(pg.sade(gen=task.budget // size - 1, ftol=0, xtol=0, seed=task.seed)).evolve(population)


if __name__ == "__main__":
    serve(
        "pygmo",
        {
            ("PSO (pso_gen)", "penalty"): pso,
            ("PSO, its defaults", "penalty"): pso_default,
            ("sade", "penalty"): sade,
        },
    )
