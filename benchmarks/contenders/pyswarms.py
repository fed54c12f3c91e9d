"""pyswarms: GlobalBestPSO with Table 1's settings; it knows no constraints."""

import numpy as np
import pyswarms as ps

from contenders.protocol import Task, serve


def pso(task: Task) -> None:
    np.random.seed(task.seed)  # noqa: NPY002 - the only way to seed it
    optimizer = ps.single.GlobalBestPSO(
        n_particles=task.particles,
        dimensions=len(task.lower),
        options={"c1": 2.0, "c2": 2.0, "w": 0.5},
        bounds=(task.lower, task.upper),
    )
    optimizer.optimize(task.penalised, iters=task.iterations, verbose=False)


if __name__ == "__main__":
    serve("pyswarms", {("PSO", "penalty"): pso})
