"""cma: CMA-ES, BIPOP restarts until the budget is spent, populations evaluated together, box scaled to 1."""

import cma
import numpy as np

from contenders.protocol import Task, serve


def bipop(task: Task) -> None:
    span = task.upper - task.lower
    rng = np.random.default_rng(task.seed)

    def evaluate(rows: list[np.ndarray]) -> list[float]:
        return task.penalised(task.lower + span * np.asarray(rows)).tolist()

    cma.fmin2(
        None,
        lambda: rng.uniform(size=len(span)),
        0.25,
        {
            "bounds": [0, 1],
            "seed": task.seed + 1,  # 0 would mean the clock
            "maxfevals": task.budget,
            "verbose": -9,
            "verb_log": 0,
        },
        restarts=100,
        bipop=True,
        parallel_objective=evaluate,
    )


if __name__ == "__main__":
    serve("cma", {("BIPOP-CMA-ES", "penalty"): bipop})
