"""Runs inside the kernel: the same bits as the Python loop over the kernel's own evaluation, on any number of threads."""

from __future__ import annotations

import pickle
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from spacearm.core.errors import SettingsError
from spacearm.core.native import native
from spacearm.geometry import Scene, Sphere
from spacearm.planner.kernel_model import make_kernel_model
from spacearm.robot import load_robot
from spacearm.swarm import NAMED_SETTINGS, PSO, SwarmResult, minimize, run_trials
from support.swarm_boxes import SMALL_NAMED, assert_same_run

ROBOT = load_robot("zhang2022")
SCENE = Scene([Sphere((0.5, 0.5, 0.0), 0.1), Sphere((0.4, 0.7, 0.0), 0.1)])
BOX = np.array(ROBOT.lower), np.array(ROBOT.upper)
PLAIN = PSO(particles=20, iterations=10)


def reach(precision: int = 64, tolerance: float = 0.05) -> Any:
    model = make_kernel_model(ROBOT, SCENE)
    given: dict[str, Any] = {
        "points": np.array([model.tip], dtype=np.int32),
        "targets": np.array([[0.7, 0.3, 0.0]]),
        "tolerances": np.array([tolerance]),
        "margin": 0.01,
        "home": np.full(7, 0.1),
    }
    if precision == 64:
        return native.ReachObjective64(scene=model.model64, **given)
    return native.ReachObjective32(scene=model.model32, **given)


def run(objective: Any, chosen: Any = PLAIN, **options: Any) -> list[SwarmResult]:
    return run_trials(objective, *BOX, chosen, **{"seed": 5, "threads": 1, **options})


@pytest.mark.parametrize("name", NAMED_SETTINGS)
def test_a_native_run_is_minimize_over_the_kernels_own_evaluation(name: str) -> None:
    objective, chosen = reach(), SMALL_NAMED[name]
    (in_kernel,) = run(objective, chosen, keep_positions=True)
    assert_same_run(in_kernel, minimize(objective.evaluate, *BOX, chosen, rng=5, history="positions"))


def test_initial_positions_go_the_same_way() -> None:
    objective = reach()
    initial = np.clip(np.linspace(-1, 1, 21).reshape(3, 7), *BOX)
    (in_kernel,) = run(objective, initial=initial)
    assert_same_run(in_kernel, minimize(objective.evaluate, *BOX, PLAIN, rng=5, initial=initial))


@pytest.mark.parametrize("precision", [32, 64])
def test_any_number_of_threads_gives_the_same_bits(precision: int) -> None:
    chosen = replace(SMALL_NAMED["ring"], iterations=10)
    one, two, five = (run(reach(precision), chosen, trials=7, threads=threads, keep_positions=True) for threads in (1, 2, 5))
    assert [entry.trial for entry in one] == list(range(7))
    for other in (two, five):
        assert len(other) == 7
        for a, b in zip(one, other, strict=True):
            assert_same_run(a, b)
    assert len({tuple(entry.x) for entry in one}) == 7


def test_a_trials_numbers_do_not_depend_on_where_it_stands() -> None:
    every = run(reach(), trials=5)
    (third,) = run(reach(), first_trial=3)
    assert third.trial == 3
    assert_same_run(third, every[3])


def test_a_run_may_stop_at_the_first_feasible_candidate() -> None:
    chosen = SMALL_NAMED["ring"]
    (whole,) = run(reach(tolerance=0.3), chosen)
    (first,) = run(reach(tolerance=0.3), chosen, stop_when_feasible=True)
    assert first.status == "feasible"
    assert first.success
    assert first.iterations == int(np.argmax(whole.history.violation <= 0)) + 1


def test_a_run_that_ran_out_of_time_or_was_stopped_says_which() -> None:
    endless = PSO(particles=3000, iterations=10**6)
    (late,) = run(reach(), endless, max_seconds=0.05)
    assert late.status == "time"
    (stopped,) = run(reach(), endless, progress=lambda done: False)
    assert stopped.status == "callback"
    assert late.iterations < endless.iterations > stopped.iterations


def test_results_survive_pickle() -> None:
    for entry in run(reach(), trials=2, keep_positions=True):
        assert_same_run(pickle.loads(pickle.dumps(entry)), entry)


@pytest.mark.parametrize("threads", [0, -1, 1.5, "all"])
def test_threads_are_a_whole_number(threads: Any) -> None:
    with pytest.raises(SettingsError, match="threads"):
        run(reach(), threads=threads)
