"""Laws that the kernel's swarm keeps whatever it is told, each shown without the equations' reference."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kernel.builds import Build
from support.swarm_states import EVOLVING, IPSO, VARIANTS, rows, told

BOX_3 = (np.array([1.0, -5.0, -0.5]), np.array([3.0, -4.0, 0.5]))


def told_rounds(build: Build, swarm: Any, rounds: int, *, seed: int = 0, odd: bool = True) -> list[tuple[np.ndarray, ...]]:
    """Positions, fitness and violation of each round."""
    rng, trace = np.random.default_rng(seed), []
    for _ in range(rounds):
        swarm.ask()
        fitness, violation = told(build, rng, swarm.active, odd=odd)
        trace.append((swarm.positions(), fitness, violation))
        swarm.tell(fitness, violation)
    return trace


def velocities(swarm: Any, dims: int) -> np.ndarray:
    return rows(swarm.state(), "velocity", dims, swarm.active)


def chosen(variant: str, **more: Any) -> dict[str, Any]:
    return {**EVOLVING, "variant": variant, **({} if variant == "evolving" else {"shrink_to": 0}), **more}


# ---- the first round -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("variant", VARIANTS)
def test_first_positions_fill_the_box_and_first_velocities_their_share(build: Build, variant: str) -> None:
    lower, upper = BOX_3
    swarm = build.swarm(chosen(variant, particles=3000, start_velocity=0.3), lower, upper)
    swarm.ask()
    share = (swarm.positions() - lower) / (upper - lower)
    speed = velocities(swarm, 3) / (upper - lower)
    eps = 10 * float(np.finfo(build.scalar).eps)
    assert share.min() >= -eps
    assert share.max() <= 1 + eps
    assert np.abs(speed).max() <= 0.3 + eps
    # Of 3000 numbers the least is above 0.01 with a chance of 1e-13.
    assert share.min(axis=0) == pytest.approx(0, abs=0.01)
    assert share.max(axis=0) == pytest.approx(1, abs=0.01)
    assert np.abs(speed).max(axis=0) == pytest.approx(0.3, abs=0.01)


def test_known_positions_take_the_place_of_the_first_drawn_ones(build: Build) -> None:
    swarm, other = (build.swarm({"particles": 10}, *BOX_3) for _ in range(2))
    known = build.array([[1.5, -4.5, 0.0], [2.0, -4.0, 0.25]])
    swarm.ask()
    other.ask()
    swarm.place_first(known)
    np.testing.assert_array_equal(swarm.positions()[:2], known)
    np.testing.assert_array_equal(swarm.positions()[2:], other.positions()[2:])


@pytest.mark.parametrize("variant", VARIANTS)
def test_a_seed_and_a_trial_make_a_swarm_and_another_makes_another(build: Build, variant: str) -> None:
    def second_round(seed: int, trial: int) -> np.ndarray:
        swarm = build.swarm(chosen(variant), *BOX_3, seed=seed, trial=trial)
        told_rounds(build, swarm, 2)
        return swarm.positions()

    np.testing.assert_array_equal(second_round(0, 0), second_round(0, 0))
    for seed, trial in ((1, 0), (0, 1), (2**32, 0)):
        assert np.mean(second_round(seed, trial) == second_round(0, 0)) < 0.05


# ---- flying ----------------------------------------------------------------------------------------------------------

WIDE = (np.full(3, -1e6), np.full(3, 1e6))
COASTING = {"particles": 20, "cognitive": 0.0, "social": 0.0, "start_velocity": 1e-6}


def test_the_inertia_weight_falls_along_a_line(build: Build) -> None:
    """Eq. (14), seen where nothing attracts: each round's velocity is w times the last."""
    swarm = build.swarm({**COASTING, "evaluations": 200, "inertia_start": 0.9, "inertia_end": 0.4}, *WIDE)
    swarm.ask()
    before, eps = velocities(swarm, 3), 4 * float(np.finfo(build.scalar).eps)
    for round_ in range(1, 12):
        swarm.tell(np.ones(20, build.scalar), np.zeros(20, build.scalar))
        swarm.ask()
        now = velocities(swarm, 3)
        w = 0.9 - 0.5 * min(1.0, round_ / 10)
        np.testing.assert_allclose(now, w * before, rtol=eps)
        before = now


def test_a_particle_moves_by_its_velocity(build: Build) -> None:
    swarm = build.swarm({"particles": 20, "evaluations": 200}, *WIDE)
    swarm.ask()
    for _ in range(3):
        before = swarm.positions()
        swarm.tell(*told(build, np.random.default_rng(0), 20, odd=False))
        swarm.ask()
        inside = np.abs(swarm.positions()) < 1e6
        assert inside.any()
        np.testing.assert_array_equal(swarm.positions()[inside], (before + velocities(swarm, 3))[inside])


@pytest.mark.parametrize("variant", ["pso", "symbiotic", "cooperative"])
def test_no_velocity_exceeds_the_clamp(build: Build, variant: str) -> None:
    lower, upper = BOX_3
    swarm = build.swarm(chosen(variant, velocity_clamp=0.15, start_velocity=5.0), lower, upper)
    swarm.ask()
    for round_ in range(6):
        swarm.tell(*told(build, np.random.default_rng(round_), 30, odd=False))
        swarm.ask()
        share = np.abs(velocities(swarm, 3)) / (upper - lower)
        assert share.max() <= 0.15 * (1 + 4 * np.finfo(build.scalar).eps)
        assert share.max() > 0.1


@settings(max_examples=15)
@given(st.sampled_from(VARIANTS), st.sampled_from(["absorb", "reflect", "periodic"]), st.integers(0, 99))
def test_positions_stay_within_the_bounds(build: Build, variant: str, rule: str, seed: int) -> None:
    swarm = build.swarm(chosen(variant, bounds=rule, velocity_clamp=0.0, start_velocity=20.0), *BOX_3)
    lower, upper = (bound.astype(build.scalar) for bound in BOX_3)
    for positions, _, _ in told_rounds(build, swarm, 6, seed=seed):
        assert (positions >= lower).all()
        assert (positions <= upper).all()


def coasted(build: Build, rule: str) -> tuple[np.ndarray, ...]:
    """Where the particles were, would be, are, and the velocities before and after, in the box 0 to 1."""
    settings_ = {**COASTING, "particles": 200, "inertia_start": 1.0, "inertia_end": 1.0, "start_velocity": 1.5}
    swarm = build.swarm({**settings_, "bounds": rule}, np.zeros(2), np.ones(2))
    swarm.ask()
    x, v = swarm.positions(), velocities(swarm, 2)
    swarm.tell(np.ones(200, build.scalar), np.zeros(200, build.scalar))
    swarm.ask()
    assert ((x + v < 0).sum(), (x + v > 1).sum()) > (20, 20)
    return x + v, swarm.positions(), v, velocities(swarm, 2)


def test_absorb_stops_a_particle_on_the_bound(build: Build) -> None:
    would, now, v, w = coasted(build, "absorb")
    outside = (would < 0) | (would > 1)
    np.testing.assert_array_equal(now, np.clip(would, 0, 1))
    np.testing.assert_array_equal(w, np.where(outside, 0, v))


def test_reflect_mirrors_a_particle_at_the_bound_it_crossed(build: Build) -> None:
    would, now, v, w = coasted(build, "reflect")
    outside = (would < 0) | (would > 1)
    mirrored = np.where(would < 0, -would, 2 - would)
    # Mirrored beyond the other bound, it stays on that.
    expected = np.where(outside, np.clip(mirrored, 0, 1), would)
    np.testing.assert_allclose(now, expected, atol=4 * np.finfo(build.scalar).eps)
    np.testing.assert_array_equal(w, np.where(outside, -v, v))


def test_periodic_lets_a_particle_enter_on_the_other_side(build: Build) -> None:
    would, now, v, w = coasted(build, "periodic")
    np.testing.assert_allclose(now, would % 1, atol=8 * np.finfo(build.scalar).eps)
    np.testing.assert_array_equal(w, v)


def one_step(build: Build, settings_: dict[str, Any], fitness: np.ndarray, *, dims: int = 2) -> tuple[np.ndarray, np.ndarray]:
    """Positions before and after the first step, in a box that is never left."""
    swarm = build.swarm(settings_, np.full(dims, -1e3), np.full(dims, 1e3))
    swarm.ask()
    swarm.place_first(build.array(np.random.default_rng(0).uniform(-1, 1, (settings_["particles"], dims))))
    before = swarm.positions()
    swarm.tell(build.array(fitness), np.zeros(len(fitness), build.scalar))
    swarm.ask()
    return before, swarm.positions()


# Nothing carries on, and no particle has left its own best: only the social pull moves.
PULLED = {"inertia_start": 0.0, "inertia_end": 0.0, "cognitive": 0.0, "social": 1.0, "velocity_clamp": 0.0}


def pulled_towards(before: np.ndarray, after: np.ndarray) -> list[int]:
    """Whom each particle moved towards: by a share in [0, 1] of the way, in every coordinate; itself if it stayed."""
    found = []
    for i, (x, y) in enumerate(zip(before, after, strict=True)):
        others = [j for j in range(len(before)) if j != i]
        share = (y - x) / (before[others] - x)
        fits = ((share > -1e-3) & (share < 1 + 1e-3)).all(axis=1)
        found.append(i if np.array_equal(x, y) else others[int(np.flatnonzero(fits).item())])
    return found


def test_all_are_pulled_towards_the_swarms_best(build: Build) -> None:
    fitness = np.arange(12.0)[::-1]
    before, after = one_step(build, {**PULLED, "particles": 12}, fitness, dims=13)
    np.testing.assert_array_equal(pulled_towards(before, after), np.full(12, 11))


@pytest.mark.parametrize("reach", [1, 2])
def test_on_a_ring_each_is_pulled_towards_the_best_of_its_neighbours(build: Build, reach: int) -> None:
    fitness = np.array([5, 3, 9, 1, 4, 8, 7, 2, 6, 0, 11, 10], dtype=float)
    before, after = one_step(build, {**PULLED, "particles": 12, "ring": reach}, fitness, dims=13)
    near = [[(i + o) % 12 for o in range(-reach, reach + 1)] for i in range(12)]
    best = [min(group, key=lambda j: fitness[j]) for group in near]
    np.testing.assert_array_equal(pulled_towards(before, after), best)


def test_many_neighbours_are_followed_as_few_are(build: Build) -> None:
    """Of equals the particle itself, else the first from the far end of its neighbourhood on."""
    reach, count = 40, 100
    fitness = np.random.default_rng(1).integers(0, 9, count).astype(float)
    before, after = one_step(build, {**PULLED, "particles": count, "ring": reach}, fitness, dims=13)
    best = []
    for i in range(count):
        near = [(i + o) % count for o in range(-reach, reach + 1)]
        first = min(near, key=lambda j: fitness[j])
        best.append(i if fitness[i] <= fitness[first] else first)
    np.testing.assert_array_equal(pulled_towards(before, after), best)


def test_a_ring_that_reaches_all_is_the_swarms_best(build: Build) -> None:
    fitness = np.random.default_rng(0).permutation(11).astype(float)
    whole, ring = (one_step(build, {**PULLED, "particles": 11, "ring": reach}, fitness)[1] for reach in (0, 5))
    np.testing.assert_array_equal(whole, ring)


@pytest.mark.parametrize(("slaves", "master", "phi"), [(1.0, 2.0, 0.0), (1.0, 1.0, 0.5), (2.0, 1.0, 1.0)])
def test_the_master_follows_the_better_of_its_own_and_the_slaves_best(
    build: Build, slaves: float, master: float, phi: float
) -> None:
    """Variant M: Phi = 0, 1/2, 1 as f(gS) <, =, > f(gM). The step is linear in c2 and c3, each pull times its weight."""
    fitness = np.array([5, slaves, 5, 5, 6, 5, 5, 5, master])

    def master_step(c2: float, c3: float) -> np.ndarray:
        weights = {"social": c2, "cooperation": c3, "particles": 9, "variant": "symbiotic"}
        before, after = one_step(build, {**PULLED, **weights}, fitness)
        return (after - before)[6:]

    assert np.any(master_step(1, 0) != 0) == (phi > 0)
    assert np.any(master_step(0, 1) != 0) == (phi < 1)
    whole = master_step(1, 1)
    np.testing.assert_allclose(master_step(1, 0) + master_step(0, 1), whole, atol=20 * np.finfo(build.scalar).eps)


def test_slaves_follow_their_own_best_only(build: Build) -> None:
    fitness = np.array([3.0, 2, 4, 5, 7, 6, 0, 1, 2])
    settings_ = {**PULLED, "particles": 9, "variant": "symbiotic", "cooperation": 1.0}
    before, after = one_step(build, settings_, fitness, dims=13)
    np.testing.assert_array_equal(pulled_towards(before, after)[:6], [1, 1, 1, 3, 3, 3])


def test_population_three_is_carried_by_the_velocities_of_one_and_two(build: Build) -> None:
    """Variant S: v3 <- w (G/G1 v1 + G/G2 v2 + v3) where nothing attracts, G = G1 + G2."""
    settings_ = {**COASTING, "variant": "cooperative", "particles": 9, "inertia_start": 0.5, "inertia_end": 0.5}
    swarm = build.swarm(settings_, *WIDE)
    swarm.ask()
    v = velocities(swarm, 3).astype(np.float64)
    fitness = np.array([1.0, 2, 4, 3, 5, 0.5, 9, 9, 9])
    swarm.tell(build.array(fitness), np.zeros(9, build.scalar))
    swarm.ask()
    G1, G2 = fitness[:3, np.newaxis], fitness[3:6, np.newaxis]
    G = G1 + G2
    expected = 0.5 * (G / G1 * v[:3] + G / G2 * v[3:6] + v[6:])
    eps = 20 * float(np.finfo(build.scalar).eps)
    np.testing.assert_allclose(velocities(swarm, 3)[6:], expected, rtol=0, atol=eps * np.abs(v).max() * 20)
    np.testing.assert_allclose(velocities(swarm, 3)[:6], 0.5 * v[:6], rtol=eps)


def test_variant_s_shares_one_best(build: Build) -> None:
    fitness = np.array([3.0, 2, 4, 5, 0.5, 6, 7, 8, 9])
    settings_ = {**PULLED, "particles": 9, "variant": "cooperative", "start_velocity": 0.0}
    before, after = one_step(build, settings_, fitness, dims=13)
    np.testing.assert_array_equal(pulled_towards(before, after), np.full(9, 4))


# ---- judging ---------------------------------------------------------------------------------------------------------


def replaced(build: Build, settings_: dict[str, Any], first: tuple[float, float], then: tuple[float, float]) -> bool:
    """Whether the personal best of one particle among twenty gives way, told (fitness, violation) twice."""
    swarm = build.swarm({"particles": 20, "evaluations": 200, **settings_}, *BOX_3)
    for fitness, violation in (first, then):
        swarm.ask()
        f, c = build.array(np.full(20, 50.0)), build.array(np.arange(20.0))
        c[0], f[7], c[7] = 7, fitness, violation  # with 0 for the one, the violations are still 0, 1, ..., 19
        swarm.tell(f, c)
    return swarm.state()["best_fitness"][7] == build.scalar(then[0])


@pytest.mark.parametrize(
    ("first", "then", "better"),
    [
        ((1, 0), (0.5, 0), True),  # both feasible: fitness
        ((1, 0), (2, 0), False),
        ((1, 0), (-9, 0.1), False),  # feasible beats violating
        ((-9, 0.1), (1, 0), True),
        ((1, 0.2), (9, 0.1), True),  # less violation beats more
        ((1, 0.1), (-9, 0.2), False),
        ((1, 0.1), (0.5, 0.1), True),  # equal violation: fitness
        ((1, 0), (0.5, -3), True),  # less than none is none
        ((1, -3), (2, 0), False),
    ],
)
def test_feasible_first_judges_by_violation_then_fitness(
    build: Build, first: tuple[float, float], then: tuple[float, float], better: bool
) -> None:
    assert replaced(build, {}, first, then) == better


@pytest.mark.parametrize("iterations", [1, 3, 10])
def test_the_penaltys_weight_rises_with_the_square_of_time(build: Build, iterations: int) -> None:
    """Of two candidates, one feasible, that is better which the weight at that time makes so."""
    budget = 20 * iterations
    settings_ = {"constraints": "penalty", "evaluations": budget, "penalty_start": 2.0, "penalty_end": 10.0}
    settings_["penalty_rise"] = 0.25
    s = max(0.0, min(1.0, 40 / budget) - 0.25) / 0.75  # both rounds are spent when the second is judged
    weight = 2 + 8 * s * s
    for nudge, better in ((0.999, True), (1.001, False)):
        assert replaced(build, settings_, (1.0, 3.0), (1 + 3 * weight * nudge, 0)) == better


@pytest.mark.parametrize(("share", "power", "until"), [(0.5, 5, 0.8), (0.25, 1, 0.5), (0.25, 2, 1.0)])
def test_forgiveness_begins_at_a_quantile_and_falls_as_a_power(build: Build, share: float, power: int, until: float) -> None:
    """A violation below the tolerance counts as none, so fitness decides."""
    settings_ = {"tolerance_share": share, "tolerance_power": power, "tolerance_until": until}
    quantile = 20 * share  # of the violations 0, 1, ..., 19
    tolerance = quantile * (1 - 40 / 200 / until) ** power
    for nudge, better in ((0.999, True), (1.001, False)):
        assert replaced(build, settings_, (1.0, 0.0), (0.5, tolerance * nudge)) == better


def test_nothing_is_forgiven_at_the_end(build: Build) -> None:
    settings_ = {"tolerance_share": 0.5, "tolerance_until": 0.2}
    assert not replaced(build, settings_, (1.0, 0.0), (0.5, 1e-6))


@settings(max_examples=15)
@given(st.sampled_from(VARIANTS), st.sampled_from(["feasible_first", "penalty"]), st.integers(0, 999))
def test_the_best_is_the_least_of_all_told_violation_first(build: Build, variant: str, constraints: str, seed: int) -> None:
    """Whatever the swarm goes by; so it never gets worse, and its position is where it was found."""
    rule = {"constraints": constraints, "penalty_start": 0.1, "penalty_end": 1.0, "tolerance_share": 0.5}
    swarm = build.swarm(chosen(variant, **rule), *BOX_3, seed=seed)
    rng, best = np.random.default_rng(seed), (np.inf, np.inf, -1.0)
    for _ in range(8):
        swarm.ask()
        f, c = told(build, rng, swarm.active)
        for i in range(swarm.active):
            if not (np.isnan(f[i]) or np.isnan(c[i])):
                best = min(best, (c[i], f[i], *swarm.positions()[i]), key=lambda b: b[:2])
        swarm.tell(f, c)
        assert (swarm.best_violation, swarm.best_fitness) == best[:2]
        np.testing.assert_array_equal(swarm.best_position, best[2:])


@pytest.mark.parametrize("variant", VARIANTS)
@pytest.mark.parametrize("lost", ["fitness", "violation", "both"])
def test_what_is_no_number_counts_as_the_worst_and_is_counted(build: Build, variant: str, lost: str) -> None:
    swarm = build.swarm(chosen(variant), *BOX_3)
    swarm.ask()
    swarm.tell(build.array(np.full(30, 5.0)), build.array(np.full(30, 5.0)))
    swarm.ask()
    f, c = build.array(np.full(30, 6.0))[: swarm.active], build.array(np.full(30, 6.0))[: swarm.active]
    for values in [f] * (lost != "violation") + [c] * (lost != "fitness"):
        values[::3] = np.nan
    swarm.tell(f, c)
    assert swarm.failed_evaluations == len(f[::3])
    assert (swarm.best_fitness, swarm.best_violation) == (5, 5)
    np.testing.assert_array_equal(swarm.state()["best_fitness"][: swarm.active], 5)
    swarm.ask()
    assert np.isfinite(swarm.positions()).all()


@pytest.mark.parametrize("variant", VARIANTS)
def test_a_swarm_that_is_told_nothing_but_failures_lives_on(build: Build, variant: str) -> None:
    swarm = build.swarm(chosen(variant), *BOX_3)
    for _ in range(4):
        swarm.ask()
        nothing = np.full(swarm.active, np.nan, build.scalar)
        swarm.tell(nothing, nothing)
    assert swarm.failed_evaluations == swarm.evaluations
    assert (swarm.best_fitness, swarm.best_violation) == (np.inf, np.inf)


@pytest.mark.parametrize("variant", ["pso", "evolving"])
def test_a_failed_first_evaluation_does_not_make_the_origin_a_personal_best(build: Build, variant: str) -> None:
    """The box need not hold it. The first position is the best that is known."""
    lower, upper = np.full(3, 10.0), np.full(3, 11.0)
    swarm = build.swarm(chosen(variant, evolving_share=1.0, shrink_to=0), lower, upper)
    swarm.ask()
    first = swarm.positions()
    fitness = build.array(np.arange(30.0))
    fitness[::2] = np.nan
    swarm.tell(fitness, np.zeros(30, build.scalar))
    np.testing.assert_array_equal(rows(swarm.state(), "personal_best", 3, swarm.active), first[: swarm.active])
    swarm.ask()
    assert swarm.positions().min() >= 10


def test_the_best_position_lies_in_the_box_even_if_every_evaluation_failed(build: Build) -> None:
    swarm = build.swarm({"particles": 5}, [1.0], [2.0])
    swarm.ask()
    swarm.tell(np.full(5, np.nan, build.scalar), np.zeros(5, build.scalar))
    assert 1 <= swarm.best_position[0] <= 2


# ---- the budget ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("variant", VARIANTS)
def test_a_swarm_is_spent_when_no_whole_round_is_left(build: Build, variant: str) -> None:
    swarm = build.swarm(chosen(variant, particles=30, evaluations=100), *BOX_3)
    while not swarm.spent:
        assert swarm.evaluations + swarm.active <= 100
        told_rounds(build, swarm, 1)
    assert swarm.evaluations + swarm.active > 100
    assert swarm.evaluations <= 100


def test_population_three_shrinks_along_a_line_and_keeps_its_best(build: Build) -> None:
    settings_ = chosen("evolving", particles=30, evolving_share=1.0, shrink_to=6, evaluations=600)
    swarm = build.swarm(settings_, *BOX_3)
    rng = np.random.default_rng(0)
    while not swarm.spent:
        swarm.ask()
        f, c = build.array(rng.normal(size=swarm.active)), np.zeros(swarm.active, build.scalar)
        before = np.fmin(swarm.state()["best_fitness"][: swarm.active], f)
        swarm.tell(f, c)
        left = 30 - 24 * min(1.0, swarm.evaluations / 600)
        assert swarm.active == max(6, int(left + 0.5))
        kept = swarm.state()["best_fitness"][: swarm.active]
        np.testing.assert_array_equal(np.sort(kept), np.sort(before)[: swarm.active])
        assert len(swarm.state()["archive"]) <= int(1.4 * swarm.active) * 3
    assert swarm.active < 10


@pytest.mark.parametrize("variant", ["pso", "symbiotic", "cooperative"])
def test_only_the_evolving_population_shrinks(build: Build, variant: str) -> None:
    """A flying one would have its personal bests dealt out to other particles."""
    swarm = build.swarm({**chosen(variant), "shrink_to": 4, "evaluations": 100}, *BOX_3)
    told_rounds(build, swarm, 3)
    assert swarm.active == 30


# ---- evolving --------------------------------------------------------------------------------------------------------


@settings(max_examples=20)
@given(st.integers(0, 999), st.sampled_from([1, 2, 13]), st.sampled_from([1.0, 0.5]))
def test_a_candidate_differs_from_its_parent_within_the_bounds(build: Build, seed: int, dims: int, share: float) -> None:
    """One coordinate at least is crossed. It may equal the parent's, if that is of the elite and r1 = r2: rarely."""
    lower, upper = np.full(dims, 1.0), np.full(dims, 2.0)
    swarm = build.swarm(chosen("evolving", evolving_share=share), lower, upper, seed=seed)
    told_rounds(build, swarm, 1, seed=seed)
    same = total = 0
    for round_ in range(5):
        n = swarm.active
        flying = 2 * int((1 - share) * 30 / 2 + 1e-9)
        parents = rows(swarm.state(), "personal_best", dims, n)[flying:]
        swarm.ask()
        candidates = swarm.positions()
        assert candidates.min() >= 1
        assert candidates.max() <= 2
        same += int((candidates[flying:] == parents).all(axis=1).sum())
        total += n - flying
        swarm.tell(*told(build, np.random.default_rng(seed + round_), n))
    assert same <= 0.25 * total


def test_the_history_stays_within_its_range(build: Build) -> None:
    swarm = build.swarm(chosen("evolving", memory=3, evaluations=900), *BOX_3)
    told_rounds(build, swarm, 30)
    for name, least in (("factor_memory", 0.0), ("crossover_memory", -1e-9)):
        memory = swarm.state()[name]
        assert memory.shape == (3,)
        assert (memory > least).all()
        assert (memory <= 1).all()
        assert (memory != 0.5).all()  # every entry has been learnt


def test_huge_improvements_do_not_spoil_the_success_history(build: Build) -> None:
    """The sum of their gains must not overflow, or F is no number, nor are the positions."""
    swarm = build.swarm(chosen("evolving", evolving_share=1.0, memory=2), *BOX_3)
    swarm.ask()
    # What an objective may well return for a candidate it cannot judge.
    swarm.tell(np.full(30, np.finfo(build.scalar).max), np.zeros(30, build.scalar))
    told_rounds(build, swarm, 3)
    assert np.isfinite(swarm.state()["factor_memory"]).all()
    assert np.isfinite(swarm.positions()).all()


# ---- checkpoints -----------------------------------------------------------------------------------------------------


@settings(max_examples=15)
@given(st.sampled_from(VARIANTS), st.integers(1, 9), st.integers(0, 999), st.data())
def test_a_restored_swarm_goes_on_bit_for_bit(build: Build, variant: str, rounds: int, seed: int, data: st.DataObject) -> None:
    rule = {"constraints": data.draw(st.sampled_from(["feasible_first", "penalty"])), "tolerance_share": 0.4}
    settings_ = chosen(variant, ring=data.draw(st.integers(0, 2)), penalty_start=1.0, penalty_end=9.0, **rule)
    whole, restored = (build.swarm(settings_, *BOX_3, seed=seed) for _ in range(2))
    told_rounds(build, whole, rounds, seed=seed)
    saved = {name: values.copy() for name, values in whole.state().items()}
    restored.restore(saved)
    assert restored.active == whole.active
    for going_on in range(6):
        whole.ask()
        restored.ask()
        np.testing.assert_array_equal(restored.positions(), whole.positions())
        f, c = told(build, np.random.default_rng(going_on), whole.active)
        whole.tell(f, c)
        restored.tell(f, c)
    for name, values in whole.state().items():
        np.testing.assert_array_equal(restored.state()[name], values, err_msg=name)


@pytest.mark.parametrize("variant", VARIANTS)
@pytest.mark.parametrize("particles", [1, 2, 30])
def test_a_swarm_may_be_restored_between_ask_and_tell(build: Build, variant: str, particles: int) -> None:
    """Also one that is so small that some of its populations are empty."""
    settings_ = chosen(variant, particles=particles, shrink_to=0)
    whole, restored = (build.swarm(settings_, *BOX_3) for _ in range(2))
    told_rounds(build, whole, 3)
    whole.ask()
    restored.restore(whole.state())
    for going_on in range(3):
        np.testing.assert_array_equal(restored.positions(), whole.positions())
        f, c = told(build, np.random.default_rng(100 + going_on), particles)
        for swarm in (whole, restored):
            swarm.tell(f - build.scalar(10), c)  # improvements, which the evolving variant learns from
            swarm.ask()
    np.testing.assert_array_equal(restored.positions(), whole.positions())


def test_taking_the_state_changes_nothing(build: Build) -> None:
    one, other = (build.swarm({**IPSO, "variant": "symbiotic"}, *BOX_3) for _ in range(2))
    for round_ in range(4):
        for swarm in (one, other):
            swarm.ask()
            swarm.tell(*told(build, np.random.default_rng(round_), 30))
        one.state()
    np.testing.assert_array_equal(one.positions(), other.positions())
