"""pyswarms, one run at a time: each line of stdin names a formulation of the objective, the answer is the run's seconds.

So that another process can take turns with it (`kernel_speed.py`). Settings as in `pyswarms.py`.
"""

import sys
import time

import numpy as np
import pyswarms as ps

import paper_numpy


def run(formulation: paper_numpy.Formulation, seed: int) -> float:
    """One run with Table 1's settings, F + 100 violation."""

    def penalised(x: np.ndarray) -> np.ndarray:
        fitness, violation = formulation(x, "goal")
        return fitness + paper_numpy.PENALTY * violation

    np.random.seed(seed)  # noqa: NPY002 - the only way to seed it
    begun = time.perf_counter()
    swarm = ps.single.GlobalBestPSO(
        n_particles=300,
        dimensions=7,
        options={"c1": 2.0, "c2": 2.0, "w": 0.5},
        bounds=(paper_numpy.LOWER, paper_numpy.UPPER),
    )
    swarm.optimize(penalised, iters=100, verbose=False)
    return time.perf_counter() - begun


if __name__ == "__main__":
    for seed, line in enumerate(sys.stdin):
        print(run(paper_numpy.FORMULATIONS[line.strip()], seed), flush=True)
