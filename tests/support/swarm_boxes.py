"""Drawn boxes, objectives over them, and what every swarm's test needs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from hypothesis import strategies as st

from spacearm.swarm import IPSO, NAMED_SETTINGS, PSO, FeasibleFirst, Penalty, SwarmResult, SwarmSettings

Box = tuple[np.ndarray, np.ndarray]
SEEDS = st.one_of(st.sampled_from([0, 1, 2**32, 2**63 - 1]), st.integers(0, 2**63 - 1))


@st.composite
def boxes(draw: st.DrawFn, dims: tuple[int, ...] = (1, 2, 3, 13)) -> Box:
    """Bounds (d,) and (d,) that may lie anywhere, far from 0 as well; some dimensions are fixed."""
    d = draw(st.sampled_from(dims))
    lower = np.array([draw(st.floats(-100.0, 100.0, allow_subnormal=False)) for _ in range(d)])
    width = np.array([draw(st.one_of(st.just(0.0), st.floats(1e-3, 50.0))) for _ in range(d)])
    return lower, lower + width


def swarms() -> st.SearchStrategy[SwarmSettings]:
    """Small swarms of every variant, with every rule for bounds and constraints."""
    constraints = st.one_of(
        st.just(FeasibleFirst()),
        st.just(FeasibleFirst(forgiven=0.3, until=0.7)),
        st.just(Penalty(weight=2.0)),
        st.just(Penalty(weight=1.0, final_weight=50.0, rise_from=0.3)),
    )
    common: dict[str, Any] = {
        "iterations": st.integers(1, 12),
        "neighbours": st.sampled_from([None, 1, 3]),
        "bounds": st.sampled_from(["absorb", "reflect", "periodic"]),
        "constraints": constraints,
        "inertia": st.sampled_from([0.5, 0.7298, (0.9, 0.4)]),
    }
    pso = st.builds(PSO, particles=st.integers(1, 40), velocity_clamp=st.sampled_from([None, 0.2]), **common)
    flying = st.builds(IPSO, variant=st.sampled_from(["symbiotic", "cooperative"]), particles=st.integers(6, 40), **common)
    evolving = st.builds(
        IPSO,
        variant=st.just("evolving"),
        evolving_share=st.sampled_from([1 / 3, 0.9, 1.0]),
        shrink_to=st.sampled_from([None, 4]),
        particles=st.integers(6, 40),
        **common,
    )
    return st.one_of(pso, flying, evolving)


SMALL_NAMED = {
    name: replace(chosen, particles=30, iterations=30, **({"shrink_to": 4} if getattr(chosen, "shrink_to", None) else {}))
    for name, chosen in NAMED_SETTINGS.items()
}
"""The named settings with a budget for tests."""


@dataclass
class Hills:
    """A positive, bumpy objective of positions, which writes down where it was asked; with a violation if wanted.

    The optimum lies inside the box, off its middle; the constraint cuts that part off.
    """

    lower: np.ndarray
    upper: np.ndarray
    constrained: bool = False
    asked: list[np.ndarray] = field(default_factory=list)

    def __call__(self, x: np.ndarray) -> Any:
        self.asked.append(x.copy())
        width = np.where(self.upper > self.lower, self.upper - self.lower, 1.0)
        u = (x - self.lower) / width - 0.3
        fitness = 1.0 + (u**2).sum(axis=1) + 0.1 * (1 - np.cos(9 * u)).sum(axis=1)
        return (fitness, 0.1 - u.mean(axis=1)) if self.constrained else fitness

    @property
    def evaluations(self) -> int:
        return sum(len(rows) for rows in self.asked)


def assert_same_run(one: SwarmResult, other: SwarmResult) -> None:
    """Both runs are the same, bit for bit; only the clock may differ."""
    np.testing.assert_array_equal(one.x, other.x)
    for name in ("fitness", "violation", "status", "iterations", "evaluations", "failed_evaluations", "seed", "settings"):
        assert getattr(one, name) == getattr(other, name), name
    for name in ("fitness", "violation", "evaluations"):
        np.testing.assert_array_equal(getattr(one.history, name), getattr(other.history, name))
    assert (one.history.positions is None) == (other.history.positions is None)
    if one.history.positions is not None:
        np.testing.assert_array_equal(one.history.positions, other.history.positions)


def by_hand(swarm: Any, f: Callable[[np.ndarray], Any]) -> SwarmResult:
    """The loop that the documentation shows."""
    while not swarm.done:
        told = f(swarm.ask())
        if isinstance(told, tuple):
            swarm.tell(*told)
        else:
            swarm.tell(told)
    return swarm.result()
