"""scipy: differential_evolution, vectorised, without the final polish (it would leave the budget)."""

import numpy as np
from scipy.optimize import NonlinearConstraint, differential_evolution

from contenders.protocol import Task, serve

POPSIZE = 15  # its default, times the number of variables


def _settings(task: Task) -> dict:
    generations = task.budget // (POPSIZE * len(task.lower)) - 1
    return {
        "bounds": list(zip(task.lower, task.upper, strict=True)),
        "popsize": POPSIZE,
        "maxiter": generations,
        "tol": 0,
        "atol": 0,
        "polish": False,
        "updating": "deferred",
        "vectorized": True,
        "rng": task.seed,
    }


def de(task: Task) -> None:
    differential_evolution(lambda x: task.penalised(x.T), **_settings(task))


def de_constrained(task: Task) -> None:
    """Of feasible candidates the fitness is asked separately; that costs time but is not counted again.

    While nothing is feasible scipy 1.17 evaluates the whole population a second time in every generation
    (scipy pull request 25754); those evaluations are its own and count.
    """

    def violation(x: np.ndarray) -> np.ndarray:  # (d, n), now and then (d,)
        return task.evaluate(np.atleast_2d(x.T))[1].reshape(1, *x.shape[1:])

    differential_evolution(
        lambda x: task.fitness_again(np.atleast_2d(x.T)),
        constraints=NonlinearConstraint(violation, -np.inf, 0),
        **_settings(task),
    )


if __name__ == "__main__":
    serve("scipy", {("DE", "penalty"): de, ("DE", "feasible first"): de_constrained})
