"""Every position that a swarm evaluated: a run done once more by ask and tell, for pictures of the swarm.

A run inside the kernel keeps its best alone, so that it costs little. The same random seed, trial and settings by ask and tell
give the same bits, and the positions can be kept on the way.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm.core.errors import SwarmError
from spacearm.core.native import native
from spacearm.swarm.ask_tell import SwarmResult
from spacearm.swarm.swarm_settings import kernel_settings

Array = NDArray[np.float64]

BatchObjective = native.PaperObjective64 | native.ReachObjective64
"""What evaluates rows of positions: fitness and violation."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SwarmRecording:
    """All T rounds of a run with p particles in d dimensions.

    Attributes:
        positions: (T, p, d) that were evaluated; where a swarm has shrunk, its first position fills the rows that are left.
        fitness: (T, p) of each.
        violation: (T, p) of each, 0 or less where it is feasible.
        active: (T,) how many of the p rows were evaluated.
    """

    positions: Array
    fitness: Array
    violation: Array
    active: NDArray[np.int64]


def record_again(run: SwarmResult, objective: BatchObjective, lower: ArrayLike, upper: ArrayLike) -> SwarmRecording:
    """Do a run inside the kernel once more, and keep every position.

    Args:
        run: of `run_trials`, with the objective's float64 form, from no given positions.
        objective: that it minimised.
        lower: (d,) its bounds.
        upper: (d,) likewise.

    Raises:
        SwarmError: the run comes out otherwise: it had another objective, or other bounds.
    """
    low, high = (np.ascontiguousarray(bound, dtype=np.float64) for bound in (lower, upper))
    swarm = native.Swarm64(kernel_settings(run.settings), low, high, run.seed, run.trial)
    rounds: list[tuple[Array, Array, Array]] = []
    while swarm.round < run.iterations:
        swarm.ask()
        x = swarm.positions()
        fitness, violation = objective.evaluate(x)
        swarm.tell(fitness, violation)
        rounds.append((x.copy(), fitness, violation))
    if not (np.array_equal(swarm.best_position, run.x) and swarm.best_fitness == run.fitness):
        raise SwarmError(
            f"the run with seed {run.seed} and trial {run.trial} gives {swarm.best_fitness:.17g} now, expected "
            f"{run.fitness:.17g}; record it with the objective and the bounds that it was made with"
        )
    return _stacked(rounds)


def _stacked(rounds: list[tuple[Array, Array, Array]]) -> SwarmRecording:
    most = max(len(x) for x, _, _ in rounds)

    def filled(values: Array) -> Array:
        return np.concatenate([values, np.repeat(values[:1], most - len(values), axis=0)])

    return SwarmRecording(
        positions=np.array([filled(x) for x, _, _ in rounds]),
        fitness=np.array([filled(f) for _, f, _ in rounds]),
        violation=np.array([filled(c) for _, _, c in rounds]),
        active=np.array([len(x) for x, _, _ in rounds], dtype=np.int64),
    )
