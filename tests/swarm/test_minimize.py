"""minimize: the same run by hand, by seed and by anyone; inside the bounds; and exactly the budget."""

from __future__ import annotations

import pickle
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spacearm.core.random_seed import seed_of
from spacearm.swarm import IPSO, PSO, Swarm, SwarmSettings, minimize, named_settings
from support.swarm_boxes import SEEDS, SMALL_NAMED, Box, Hills, assert_same_run, boxes, by_hand, swarms

PLAIN = PSO(particles=20, iterations=15)
BOX = np.array([3.0, -9.0]), np.array([5.0, -8.5])
DRAWN = settings(max_examples=30)


@DRAWN
@given(boxes(), swarms(), SEEDS, st.booleans())
def test_a_run_is_the_same_bits_by_minimize_and_by_ask_and_tell(
    box: Box, chosen: SwarmSettings, seed: int, constrained: bool
) -> None:
    f = Hills(*box, constrained=constrained)
    run = minimize(f, *box, chosen, rng=seed, history="positions")
    assert_same_run(run, by_hand(Swarm(*box, chosen, rng=seed, keep_positions=True), f))


@pytest.mark.parametrize("name", SMALL_NAMED)
def test_one_seed_gives_one_result_and_another_seed_another(name: str) -> None:
    f = Hills(*BOX)
    runs = [minimize(f, *BOX, SMALL_NAMED[name], rng=seed) for seed in (7, 7, 8)]
    assert_same_run(runs[0], runs[1])
    assert not np.array_equal(runs[0].x, runs[2].x)


@given(SEEDS, SEEDS)
def test_seeds_that_differ_in_any_bit_begin_elsewhere(one: int, other: int) -> None:
    first = [Swarm(*BOX, PSO(particles=4), rng=seed).ask() for seed in (one, other)]
    assert np.array_equal(*first) == (one == other)


def test_without_settings_a_swarm_has_those_named_ring_small() -> None:
    assert Swarm([0.0], [1.0], rng=0).settings == named_settings("ring-small")
    assert minimize(lambda x: x[:, 0], [0.0], [1.0], rng=0, max_seconds=1e-6).settings == named_settings("ring-small")


def test_zero_is_a_seed_and_not_the_absence_of_one() -> None:
    f = Hills(*BOX)
    run = minimize(f, *BOX, PLAIN, rng=0)
    assert run.seed == 0
    assert_same_run(run, minimize(f, *BOX, PLAIN, rng=np.int64(0)))


def test_a_generator_is_drawn_from_and_its_seed_recorded() -> None:
    f = Hills(*BOX)
    generator = np.random.default_rng(5)
    one, two = (minimize(f, *BOX, PLAIN, rng=generator) for _ in range(2))
    assert one.seed != two.seed
    assert_same_run(one, minimize(f, *BOX, PLAIN, rng=np.random.default_rng(5)))
    assert_same_run(two, minimize(f, *BOX, PLAIN, rng=two.seed))


def test_none_is_a_fresh_seed_that_repeats_the_run() -> None:
    f = Hills(*BOX)
    one, two = (minimize(f, *BOX, PLAIN) for _ in range(2))
    assert one.seed != two.seed  # wrong once in 2^63
    assert_same_run(one, minimize(f, *BOX, PLAIN, rng=one.seed))
    assert seed_of(None) != seed_of(None)


@DRAWN
@given(boxes(), swarms(), SEEDS, st.booleans())
def test_f_is_asked_inside_the_bounds_only_and_gives_the_result(
    box: Box, chosen: SwarmSettings, seed: int, constrained: bool
) -> None:
    f = Hills(*box, constrained=constrained)
    run = minimize(f, *box, chosen, rng=seed)
    asked = np.vstack(f.asked)
    assert (asked >= box[0]).all()
    assert (asked <= box[1]).all()
    assert (asked == run.x).all(axis=1).any()
    told: Any = Hills(*box, constrained=constrained)(run.x[None])
    fitness, violation = (told[0][0], max(told[1][0], 0.0)) if constrained else (told[0], 0.0)
    assert (run.fitness, run.violation) == (fitness, violation)


@DRAWN
@given(boxes(), swarms(), SEEDS)
def test_the_budget_is_spent_exactly_and_a_shrinking_swarm_never_exceeds_it(box: Box, chosen: SwarmSettings, seed: int) -> None:
    f = Hills(*box)
    run = minimize(f, *box, chosen, rng=seed)
    budget = chosen.particles * chosen.iterations
    assert run.status == "budget"
    assert run.evaluations == f.evaluations
    assert len(f.asked) == run.iterations
    if isinstance(chosen, IPSO) and chosen.shrink_to is not None:
        assert budget - chosen.particles < run.evaluations <= budget
    else:
        assert (run.evaluations, run.iterations) == (budget, chosen.iterations)
        assert all(len(rows) == chosen.particles for rows in f.asked)


@DRAWN
@given(boxes(), swarms(), SEEDS)
def test_a_fixed_dimension_keeps_its_value(box: Box, chosen: SwarmSettings, seed: int) -> None:
    fixed = box[0] == box[1]
    f = Hills(*box)
    minimize(f, *box, chosen, rng=seed)
    assert (np.vstack(f.asked)[:, fixed] == box[0][fixed]).all()


@given(boxes((3,)), st.booleans())
def test_a_box_without_any_width_has_one_point(box: Box, evolving: bool) -> None:
    point = box[0]
    chosen = IPSO(variant="evolving" if evolving else "symbiotic", particles=9, iterations=4)
    run = minimize(lambda x: x.sum(axis=1), point, point, chosen, rng=1)
    np.testing.assert_array_equal(run.x, point)
    assert run.fitness == point.reshape(1, -1).sum(axis=1)[0]


@DRAWN
@given(boxes(), swarms(), SEEDS, st.data())
def test_initial_positions_are_evaluated_unmoved_and_never_lost(
    box: Box, chosen: SwarmSettings, seed: int, data: st.DataObject
) -> None:
    count = data.draw(st.integers(1, chosen.particles))
    share = np.array(data.draw(st.lists(st.floats(0, 1), min_size=count, max_size=count)))
    initial = np.clip(box[0] + share[:, None] * (box[1] - box[0]), *box)
    f = Hills(*box)
    run = minimize(f, *box, chosen, rng=seed, initial=initial)
    np.testing.assert_array_equal(f.asked[0][:count], initial)
    assert run.fitness <= f(initial).min()
    # The others are drawn as without.
    np.testing.assert_array_equal(f.asked[0][count:], Swarm(*box, chosen, rng=seed).ask()[count:])


def test_the_caller_keeps_its_arrays() -> None:
    lower, upper, initial = np.array([1.0, 1.0]), np.array([2.0, 2.0]), np.array([[1.5, 1.5]])
    run = minimize(Hills(lower, upper), lower, upper, PLAIN, rng=0, initial=initial)
    lower[:], upper[:], initial[:] = 7.0, 8.0, 9.0
    assert (run.x <= 2.0).all()


def test_an_f_that_writes_into_its_argument_does_not_move_the_swarm() -> None:
    def careless(x: np.ndarray) -> np.ndarray:
        fitness = Hills(*BOX)(x)
        x[:] = np.nan
        return fitness

    assert_same_run(minimize(careless, *BOX, PLAIN, rng=3), minimize(Hills(*BOX), *BOX, PLAIN, rng=3))


@DRAWN
@given(boxes(), swarms(), SEEDS, st.booleans())
def test_an_f_of_single_positions_makes_the_same_run(box: Box, chosen: SwarmSettings, seed: int, constrained: bool) -> None:
    whole = Hills(*box, constrained=constrained)

    def single(x: np.ndarray) -> Any:
        assert x.shape == box[0].shape
        told = whole(x[None])
        return (told[0][0], float(told[1][0])) if constrained else told[0]

    by_row = lambda x: tuple(np.array(v) for v in zip(*map(single, x), strict=True)) if constrained else [*map(single, x)]  # noqa: E731
    assert_same_run(minimize(single, *box, chosen, rng=seed, vectorized=False), minimize(by_row, *box, chosen, rng=seed))


@DRAWN
@given(boxes(), swarms(), SEEDS, st.booleans())
def test_the_history_is_the_best_so_far_after_each_iteration(
    box: Box, chosen: SwarmSettings, seed: int, constrained: bool
) -> None:
    f = Hills(*box, constrained=constrained)
    run = minimize(f, *box, chosen, rng=seed, history="positions")
    past = run.history
    assert past.positions is not None
    assert past.fitness.shape == past.violation.shape == past.evaluations.shape == (run.iterations,)
    assert past.positions.shape == (run.iterations, len(box[0]))
    np.testing.assert_array_equal(past.evaluations, np.cumsum([len(rows) for rows in f.asked]))
    assert (np.diff(past.violation) <= 0).all()
    same = np.diff(past.violation) == 0
    assert (np.diff(past.fitness)[same] <= 0).all()
    np.testing.assert_array_equal(past.positions[-1], run.x)
    assert (past.fitness[-1], past.violation[-1]) == (run.fitness, run.violation)
    # Feasible first, written out.
    best = (np.inf, np.inf)
    for i, rows in enumerate(list(f.asked)):
        told: Any = f(rows)
        fitness, violation = told if constrained else (told, np.zeros(len(rows)))
        best = min([best, *zip(np.maximum(violation, 0), fitness, strict=True)])
        assert (past.violation[i], past.fitness[i]) == best


def test_positions_are_kept_only_if_asked_for() -> None:
    assert minimize(Hills(*BOX), *BOX, PLAIN, rng=0).history.positions is None


@given(swarms(), SEEDS)
@DRAWN
def test_a_result_survives_pickle(chosen: SwarmSettings, seed: int) -> None:
    run = minimize(Hills(*BOX), *BOX, chosen, rng=seed, history="positions")
    assert_same_run(pickle.loads(pickle.dumps(run)), run)
    assert pickle.loads(pickle.dumps(chosen)) == chosen


@pytest.mark.parametrize("name", SMALL_NAMED)
def test_every_named_swarm_finds_the_bottom_of_a_bowl(name: str) -> None:
    """f - 1 is 0 at the bottom and 0.5 or so at a random point; 20 seeds, all of which must be much better."""
    lower, upper = np.array([5.0, -30.0, 100.0]), np.array([6.0, -20.0, 130.0])
    bottom = lower + 0.3 * (upper - lower)

    def bowl(x: np.ndarray) -> np.ndarray:
        return 1 + (((x - bottom) / (upper - lower)) ** 2).sum(axis=1)

    worst = max(minimize(bowl, lower, upper, SMALL_NAMED[name], rng=seed).fitness for seed in range(20))
    assert worst - 1 < 0.02
