"""Why a run stops: each reason gives its status, and the best so far."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings

from spacearm.swarm import PSO, Swarm, SwarmSettings, minimize
from spacearm.swarm.ask_tell import MESSAGES
from support.swarm_boxes import SEEDS, SMALL_NAMED, Box, Hills, assert_same_run, boxes, swarms

BOX = np.array([3.0, -9.0]), np.array([5.0, -8.5])
PLAIN = PSO(particles=10, iterations=40)


def assert_is_the_beginning(run: Any, whole: Any) -> None:
    """A stopped run went as the whole one did, as far as it went."""
    n = run.iterations
    assert n < whole.iterations
    for name in ("fitness", "violation", "evaluations"):
        np.testing.assert_array_equal(getattr(run.history, name), getattr(whole.history, name)[:n])
    assert (run.fitness, run.evaluations) == (whole.history.fitness[n - 1], whole.history.evaluations[n - 1])


@settings(max_examples=30)
@given(boxes(), swarms(), SEEDS)
def test_a_target_stops_the_run_at_the_first_iteration_that_reaches_it(box: Box, chosen: SwarmSettings, seed: int) -> None:
    whole = minimize(Hills(*box), *box, chosen, rng=seed)
    for target in (whole.history.fitness[0], whole.fitness):
        run = minimize(Hills(*box), *box, chosen, rng=seed, target=float(target))
        first = int(np.argmax(whole.history.fitness <= target)) + 1
        assert (run.status, run.iterations) == ("target", first)
        assert run.fitness <= target
    below = minimize(Hills(*box), *box, chosen, rng=seed, target=float(np.nextafter(whole.fitness, -np.inf)))
    assert_same_run(below, whole)


def test_a_target_counts_only_without_violation() -> None:
    run = minimize(lambda x: (x[:, 0], np.ones(len(x))), *BOX, PLAIN, rng=0, target=100.0)
    assert run.status == "budget"


@settings(max_examples=30)
@given(boxes(), swarms(), SEEDS)
def test_a_stall_is_so_many_iterations_without_improvement(box: Box, chosen: SwarmSettings, seed: int) -> None:
    whole = minimize(Hills(*box), *box, chosen, rng=seed)
    improved = np.diff(whole.history.fitness, prepend=np.inf) < 0
    for patience in (1, 3):
        run = minimize(Hills(*box), *box, chosen, rng=seed, stall_iterations=patience)
        streak, expected = 0, None
        for i, better in enumerate(improved):
            streak = 0 if better else streak + 1
            if streak == patience:
                expected = i + 1
                break
        if expected is None:
            assert_same_run(run, whole)
        else:
            assert (run.status, run.iterations) == ("stalled", expected)


def test_a_constant_function_stalls_at_once() -> None:
    run = minimize(lambda x: np.ones(len(x)), *BOX, PLAIN, rng=0, stall_iterations=5)
    assert (run.status, run.iterations) == ("stalled", 6)


def test_time_stops_the_run_after_the_iteration_that_passed_it() -> None:
    def slow(x: np.ndarray) -> np.ndarray:
        time.sleep(0.03)
        return Hills(*BOX)(x)

    run = minimize(slow, *BOX, PLAIN, rng=0, max_seconds=0.05)
    assert run.status == "time"
    assert 1 <= run.iterations <= 2  # two of them take 0.06 s or more, whatever the machine
    assert_is_the_beginning(run, minimize(Hills(*BOX), *BOX, PLAIN, rng=0))


@pytest.mark.parametrize("yes", [True, np.True_, StopIteration])
def test_a_callback_stops_the_run(yes: Any) -> None:
    def callback(swarm: Swarm) -> Any:
        if swarm.iteration < 7:
            return False
        if yes is StopIteration:
            raise StopIteration
        return yes

    run = minimize(Hills(*BOX), *BOX, PLAIN, rng=0, callback=callback)
    assert (run.status, run.iterations) == ("callback", 7)
    assert_is_the_beginning(run, minimize(Hills(*BOX), *BOX, PLAIN, rng=0))


@pytest.mark.parametrize("no", [None, False, np.False_, 1, "yes", np.ones(3)])
def test_a_callback_that_answers_anything_else_does_not(no: Any) -> None:
    whole = minimize(Hills(*BOX), *BOX, PLAIN, rng=0)
    assert_same_run(minimize(Hills(*BOX), *BOX, PLAIN, rng=0, callback=lambda swarm: no), whole)


def test_a_callback_sees_the_swarm_after_each_iteration() -> None:
    seen: list[tuple[Any, ...]] = []
    run = minimize(
        Hills(*BOX),
        *BOX,
        PLAIN,
        rng=0,
        history="positions",
        callback=lambda s: seen.append((s.iteration, s.best_fitness, s.best_violation, s.evaluations, s.best_x)),
    )
    assert [entry[0] for entry in seen] == list(range(1, 41))
    np.testing.assert_array_equal([entry[1] for entry in seen], run.history.fitness)
    np.testing.assert_array_equal([entry[2] for entry in seen], run.history.violation)
    np.testing.assert_array_equal([entry[3] for entry in seen], run.history.evaluations)
    np.testing.assert_array_equal([entry[4] for entry in seen], run.history.positions)


@pytest.mark.parametrize("name", SMALL_NAMED)
def test_ctrl_c_ends_the_run_with_the_best_so_far(name: str) -> None:
    f, chosen = Hills(*BOX), SMALL_NAMED[name]

    def interrupted(x: np.ndarray) -> np.ndarray:
        if len(f.asked) == 5:
            raise KeyboardInterrupt
        return f(x)

    run = minimize(interrupted, *BOX, chosen, rng=1)
    assert (run.status, run.iterations) == ("interrupted", 5)
    assert "interrupted" in run.message
    assert_is_the_beginning(run, minimize(Hills(*BOX), *BOX, chosen, rng=1))


def test_ctrl_c_in_the_callback_ends_the_run_too() -> None:
    def callback(swarm: Swarm) -> None:
        if swarm.iteration == 3:
            raise KeyboardInterrupt

    run = minimize(Hills(*BOX), *BOX, PLAIN, rng=1, callback=callback)
    assert (run.status, run.iterations) == ("interrupted", 3)


def test_ctrl_c_before_anything_was_found_stays_ctrl_c() -> None:
    def at_once(x: np.ndarray) -> np.ndarray:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        minimize(at_once, *BOX, PLAIN, rng=1)


def test_asking_on_beyond_the_budget_is_allowed() -> None:
    swarm = Swarm(*BOX, PLAIN, rng=0)
    for _ in range(PLAIN.iterations + 5):
        swarm.tell(Hills(*BOX)(swarm.ask()))
    assert swarm.done
    assert swarm.iteration == PLAIN.iterations + 5


@pytest.mark.parametrize("status", MESSAGES)
def test_every_status_has_a_sentence(status: str) -> None:
    swarm = Swarm(*BOX, PLAIN, rng=0)
    swarm.tell(Hills(*BOX)(swarm.ask()))
    assert swarm.result(status).message == MESSAGES[status]
