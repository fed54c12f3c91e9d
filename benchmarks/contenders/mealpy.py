"""mealpy: OriginalPSO with Table 1's settings; it evaluates one particle at a time."""

import numpy as np
from mealpy import PSO, FloatVar

from contenders.protocol import Task, serve


def pso(task: Task) -> None:
    def evaluate(x: np.ndarray) -> float:
        return float(task.penalised(x[None, :])[0])

    problem = {
        "obj_func": evaluate,
        "bounds": FloatVar(lb=task.lower.tolist(), ub=task.upper.tolist()),
        "minmax": "min",
        "log_to": None,
    }
    swarm = PSO.OriginalPSO(epoch=task.iterations - 1, pop_size=task.particles, c1=2.0, c2=2.0, w=0.5)
    swarm.solve(problem, seed=task.seed)


if __name__ == "__main__":
    serve("mealpy", {("PSO", "penalty"): pso})
