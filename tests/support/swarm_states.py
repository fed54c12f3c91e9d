"""States of a swarm in the kernel: its variants, its arrays, and what it is told."""

from __future__ import annotations

from typing import Any

import numpy as np

from kernel.builds import Build

VARIANTS = ("pso", "symbiotic", "cooperative", "evolving")
IPSO = {"inertia_start": 0.9, "inertia_end": 0.4, "velocity_clamp": 0.2, "particles": 30, "evaluations": 240}
EVOLVING = {**IPSO, "variant": "evolving", "evolving_share": 1 / 3, "shrink_to": 4}


def told(build: Build, rng: np.random.Generator, n: int, *, odd: bool = True) -> tuple[np.ndarray, np.ndarray]:
    """Fitness and violation of n particles: ties, negative and, if odd values are asked for, infinite or no number."""
    fitness = rng.choice([rng.uniform(0.1, 5, n), np.round(rng.uniform(-1, 3, n)), rng.normal(size=n)])
    violation = np.where(rng.random(n) < 0.5, 0.0, np.round(rng.exponential(size=n), 1))
    if odd:
        for values, what in ((fitness, np.nan), (violation, np.nan), (fitness, np.inf), (violation, np.inf)):
            values[rng.random(n) < 0.04] = what
    return build.array(fitness), build.array(violation)


def rows(state: dict[str, Any], name: str, dims: int, n: int) -> np.ndarray:
    """One of the state's arrays as (particles, d)."""
    return state[name].reshape(dims, -1)[:, :n].T
