"""The kernel's swarm, step by step, against the equations, and the laws that it keeps whatever it is told."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from kernel.builds import Build
from support.oracles.swarm_equations import EquationSwarm
from support.swarm_states import EVOLVING, IPSO, VARIANTS, rows, told

# ---- against the equations ------------------------------------------------------------------------------------------


@st.composite
def swarm_settings(draw: st.DrawFn) -> dict[str, Any]:
    start, rise = draw(st.floats(0, 3)), draw(st.sampled_from([0.0, 0.5]))
    return {
        "variant": draw(st.sampled_from(VARIANTS)),
        "particles": draw(st.integers(1, 40)),
        "evaluations": draw(st.integers(40, 400)),
        "inertia_start": draw(st.floats(0.4, 1)),
        "inertia_end": draw(st.floats(0, 0.9)),
        "cognitive": draw(st.floats(0, 2.5)),
        "social": draw(st.floats(0, 2.5)),
        "cooperation": draw(st.floats(0, 2.5)),
        "velocity_clamp": draw(st.sampled_from([0.0, 0.2, 1.0])),
        "start_velocity": draw(st.sampled_from([0.0, 0.2, 2.0])),
        "ring": draw(st.integers(0, 4)),
        "bounds": draw(st.sampled_from(["absorb", "reflect", "periodic"])),
        "constraints": draw(st.sampled_from(["feasible_first", "penalty"])),
        "penalty_start": start,
        "penalty_end": start + draw(st.floats(0, 100)),
        "penalty_rise": rise,
        "tolerance_share": draw(st.sampled_from([0.0, 0.3, 1.0])),
        "tolerance_until": draw(st.sampled_from([0.3, 0.8, 1.0])),
        "tolerance_power": draw(st.integers(1, 5)),
        "evolving_share": draw(st.sampled_from([1.0, 1 / 3, 0.6])),
        "elite_share": draw(st.floats(0.05, 1)),
        "memory": draw(st.integers(1, 5)),
        "shrink_to": draw(st.sampled_from([0, 4, 8])),
    }


@st.composite
def boxes(draw: st.DrawFn) -> tuple[np.ndarray, np.ndarray]:
    """Bounds of 1 to 13 dimensions anywhere, some of no width."""
    dims = draw(st.sampled_from([1, 2, 3, 4, 5, 7, 8, 13]))
    lower = np.array(draw(st.lists(st.floats(-4, 4), min_size=dims, max_size=dims)))
    width = st.one_of(st.just(0.0), st.floats(0.01, 10))
    return lower, lower + draw(st.lists(width, min_size=dims, max_size=dims))


def assert_steps_agree(
    build: Build, chosen: dict[str, Any], box: tuple[np.ndarray, np.ndarray], seed: int, rounds: int = 4
) -> None:
    """Ask and tell both; every number of theirs is the same, to the last bit."""
    trial = seed % 7
    kernel = build.swarm(chosen, *box, seed=seed, trial=trial)
    equations = EquationSwarm(build, chosen, *box, seed=seed, trial=trial)
    rng, dims = np.random.default_rng(seed), len(box[0])
    for _ in range(rounds):
        kernel.ask()
        np.testing.assert_array_equal(kernel.positions(), equations.ask())
        fitness, violation = told(build, rng, kernel.active)
        kernel.tell(fitness, violation)
        equations.tell(fitness, violation)
        n, state = equations.active, kernel.state()
        assert kernel.active == n
        np.testing.assert_array_equal(rows(state, "personal_best", dims, n), equations.p[:n])
        np.testing.assert_array_equal(state["best_fitness"][:n], equations.pf[:n])
        np.testing.assert_array_equal(state["best_violation"][:n], equations.pc[:n])
        flying = n - len(equations.evolving)
        np.testing.assert_array_equal(rows(state, "velocity", dims, flying), equations.v[:flying])
        np.testing.assert_array_equal(state["archive"], np.ravel(equations.history.archive))
        np.testing.assert_array_equal(state["factor_memory"], equations.history.M_F)
        np.testing.assert_array_equal(state["crossover_memory"], equations.history.M_CR)
        assert (kernel.best_violation, kernel.best_fitness) == equations.best
        np.testing.assert_array_equal(kernel.best_position, equations.best_x)
        assert (kernel.round, kernel.evaluations) == (equations.round, equations.used)
        assert kernel.failed_evaluations == equations.failed


TABLE_1 = {"particles": 33, "evaluations": 330}
BOX_7 = (np.linspace(-3, -0.2, 7), np.linspace(0.1, 3, 7))


@settings(max_examples=20)
@given(swarm_settings(), boxes(), st.integers(0, 2**64 - 1))
@example(TABLE_1, BOX_7, 1)
@example({**TABLE_1, "ring": 2}, BOX_7, 2)
@example({**IPSO, "variant": "symbiotic"}, BOX_7, 3)
@example({**IPSO, "variant": "cooperative"}, BOX_7, 4)
@example(EVOLVING, BOX_7, 5)
@example({**EVOLVING, "constraints": "penalty", "penalty_start": 1.5, "penalty_end": 100.0}, BOX_7, 6)
def test_every_step_is_the_equations(
    build: Build, chosen: dict[str, Any], box: tuple[np.ndarray, np.ndarray], seed: int
) -> None:
    assert_steps_agree(build, chosen, box, seed)


@pytest.mark.parametrize("variant", VARIANTS)
def test_the_steps_agree_until_the_budget_is_spent(build: Build, variant: str) -> None:
    """Long enough that the archive fills up, population 3 shrinks to its least, and forgiveness ends."""
    chosen = {**EVOLVING, "variant": variant, "tolerance_share": 0.3, "memory": 3}
    if variant != "evolving":
        chosen["shrink_to"] = 0
    assert_steps_agree(build, chosen, (np.full(4, -1.0), np.full(4, 2.0)), seed=9, rounds=14)
