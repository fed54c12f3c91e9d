"""The checker says "holds" of what is true only, whatever the proof is; and of every honest proof."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spacearm.geometry import Scene, Sphere
from spacearm.motion import Motion, PiecewisePath, RecordedTrajectory, Trajectory
from spacearm.proof.checker import check_proof
from spacearm.proof.claim import FROM_START, OUT, UP_TO_GOAL, Claim, NearEnd
from spacearm.proof.path_intervals import Intervals
from spacearm.proof.proof_tree import HALVES, MEMBERS_OF_FIRST, MEMBERS_OF_OTHER, SETTLED, ProofTree
from spacearm.robot import Body
from support import floating_cases
from support.dense_samples import planar, swing
from support.drawn_claims import (
    Drawn,
    any_pair,
    any_stretch,
    claim_about,
    cleared_claim,
    drawn_claim,
    frames_at,
    least_clearance,
    only,
    tree,
)
from support.oracles.pinocchio_points import joint_frames
from support.reference_finder import Measure, Stretch, bound, find_proof

COAL = 1e-6  # [m] the rounding of a distance that Coal measures, of bodies a few metres large
DEPTH = 1e-4  # [m] of a penetration
SEEDS = st.integers(0, 2**32 - 1)


def least_measured(claim: Claim, first: int, other: int, interval: Intervals, seed: int, instants: int = 12) -> float:
    """The least distance of two bodies of the table on a stretch, by Pinocchio and Coal; joints deviate as they may."""
    rng, measure = np.random.default_rng(seed), Measure(claim)
    u = np.concatenate([interval.ends[0], interval.ends.mean(axis=1), rng.uniform(*interval.ends[0], instants)])
    off = claim.tracking * rng.choice([-1.0, 0.0, 1.0], (len(u), len(claim.tracking)))
    frame = claim.bodies.frame
    return min(measure(first, other, T[frame[first]], T[frame[other]])[0] for T in frames_at(claim, u, off))


def proposed(claim: Claim, first: int, other: int, interval: Intervals, rng: np.random.Generator) -> np.ndarray:
    """Coal's direction at the midpoint, or another one near it."""
    T, frame = frames_at(claim, interval.ends.mean(axis=1))[0], claim.bodies.frame
    n = Measure(claim)(first, other, T[frame[first]], T[frame[other]])[1]
    if not np.linalg.norm(n) > 0.5 or rng.random() < 0.1:
        n = rng.normal(size=3)
    return (n + rng.choice([0.0, 0.01, 0.3]) * rng.normal(size=3)) * 10 ** rng.uniform(-3, 3)


def gaps_along(claim: Claim, first: int, other: int, T: np.ndarray, n: np.ndarray) -> np.ndarray:
    """The gaps (r,) for frames (r, j + 2, 4, 4), along a direction fixed in the other body's frame, which is n at first."""
    bodies = claim.bodies
    A, B = T[:, bodies.frame[first]], T[:, bodies.frame[other]]
    own = B[0, :3, :3].T @ n
    y = bodies.vertices[bodies.first_point[other] :][: bodies.points[other]]
    most = (y @ own).max() + bodies.disc[other] * np.linalg.norm(np.cross(own, bodies.axis[other]))
    C = np.linalg.inv(B) @ A
    x = bodies.vertices[bodies.first_point[first] :][: bodies.points[first]]
    turned = own @ C[:, :3, :3]
    across = np.linalg.norm(np.cross(turned, bodies.axis[first]), axis=1)
    least = (turned @ x.T).min(axis=1) + C[:, :3, 3] @ own - bodies.disc[first] * across
    return least - most - bodies.radius[first] - bodies.radius[other]


def sideways(claim: Claim, first: int, other: int, u: float, h: float, rng: np.random.Generator) -> np.ndarray:
    """A direction across the velocity of the first body's centre in the other one's frame: bounds of second order count."""
    T, frame = frames_at(claim, np.array([u - 1e-3 * h, u + 1e-3 * h, u])), claim.bodies.frame
    at = np.linalg.inv(T[:, frame[other]]) @ T[:, frame[first]] @ np.append(claim.bodies.center[first], 1.0)
    moved, n = (at[1] - at[0])[:3], rng.normal(size=3)
    if np.linalg.norm(moved) > 1e-12:
        n -= (n @ moved) / (moved @ moved) * moved
    return T[2, frame[other], :3, :3] @ n / np.linalg.norm(n)


def look_along(drawn: Drawn, seed: int) -> None:
    """No gap along a direction is ever less than what this direction proves."""
    claim, rng = drawn.claim, np.random.default_rng(seed)
    for _ in range(4):
        first, other = any_pair(rng, claim)
        if claim.bodies.half_space[other]:
            continue
        interval = any_stretch(rng, claim)
        (low, high), u = interval.ends[0], interval.ends.mean(axis=1)
        n = sideways(claim, first, other, float(u[0]), high - low, rng)
        checked = check_proof(only(claim, first, other, interval), tree([0], [n]))
        assert not checked.fault
        u = np.concatenate([u, np.linspace(low, high, 30), rng.uniform(low, high, 10)])
        off = claim.tracking * rng.choice([-1.0, 0.0, 1.0], (len(u), len(claim.tracking)))
        off[0] = 0.0
        proven = checked.proven[claim.held.phase[claim.bodies.owner[first], other]]
        assert proven <= gaps_along(claim, first, other, frames_at(claim, u, off), n).min() + 1e-10 * abs(proven)


def look_at(drawn: Drawn, seed: int) -> None:
    """What one direction proves of two bodies on a stretch is what the formulas say, and never more than is measured."""
    claim, rng = drawn.claim, np.random.default_rng(seed)
    for _ in range(4):
        first, other = any_pair(rng, claim)
        interval = any_stretch(rng, claim)
        n = proposed(claim, first, other, interval, rng)
        checked = check_proof(only(claim, first, other, interval), tree([0], [n]))
        assert not checked.fault
        phase = claim.held.phase[claim.bodies.owner[first], other]
        proven = float(checked.proven[phase])
        expected = bound(Stretch(claim, interval), first, other, n).left
        size = 1 + abs(expected) + float(np.abs(claim.bodies.vertices).max())
        assert abs(proven - expected) < 3e-9 * size
        measured = least_measured(claim, first, other, interval, seed)
        assert proven <= measured + (COAL if measured > 0 else DEPTH)


@settings(max_examples=100)
@given(SEEDS, st.booleans())
def test_no_gap_gets_less_than_its_direction_proves(seed: int, tracking: bool) -> None:
    look_along(drawn_claim(seed, tracking=tracking), seed)


@settings(max_examples=60)
@given(SEEDS)
def test_no_gap_gets_less_than_its_direction_proves_on_a_floating_base(seed: int) -> None:
    look_along(drawn_claim(seed, floating=True, reach=0.3), seed)


@settings(max_examples=60)
@given(SEEDS, st.integers(0, 1000))
def test_no_gap_gets_less_where_another_integrator_has_the_base(seed: int, number: int) -> None:
    case, trajectory, way = floating_cases.drawn(seed, number)
    claim, rng = claim_about(case.robot, case.scene, trajectory), np.random.default_rng(seed)
    begin, end = claim.path.curve.domain  # of the same path, if it does not count in seconds
    u = begin + (end - begin) * (way.u - way.u[0]) / (way.u[-1] - way.u[0])
    T = np.broadcast_to(np.eye(4), (len(u), len(case.robot.joints) + 2, 4, 4)).copy()
    T[:, 1, :3, :3], T[:, 1, :3, 3] = way.R, way.at
    T[:, 2:] = T[:, 1:2] @ joint_frames(case.robot, claim.path.curve.sample(u))
    to_scene = np.flatnonzero((claim.bodies.frame[claim.pairs.other] == 0) & ~claim.bodies.half_space[claim.pairs.other])
    for i in to_scene[:8].tolist():
        first, other, interval = int(claim.pairs.first[i]), int(claim.pairs.other[i]), any_stretch(rng, claim, 5)
        n = rng.normal(size=3) / 2
        inside = (u >= interval.ends[0, 0]) & (u <= interval.ends[0, 1])
        proven = check_proof(only(claim, first, other, interval), tree([0], [n])).proven[0]
        if inside.any():
            least = gaps_along(claim, first, other, T[inside], n / np.linalg.norm(n)).min()
            assert proven <= least + (1e-8 + 2 * way.off) * (1 + np.abs(T[inside, :, :3, 3]).max())


@settings(max_examples=100)
@given(SEEDS)
def test_a_direction_proves_no_more_than_coal_measures(seed: int) -> None:
    look_at(drawn_claim(seed), seed)


@settings(max_examples=40)
@given(SEEDS)
def test_a_direction_proves_no_more_than_coal_measures_in_a_tube(seed: int) -> None:
    look_at(drawn_claim(seed, tracking=True), seed)


@settings(max_examples=60)
@given(SEEDS)
def test_a_direction_proves_no_more_than_coal_measures_on_a_floating_base(seed: int) -> None:
    look_at(drawn_claim(seed, floating=True, reach=0.3), seed)


# ---- Honest proofs ---------------------------------------------------------------------------------------------------

_MOST = 800  # nodes of a proof of these tests


def proven_honestly(drawn: Drawn, seed: int) -> ProofTree | None:
    """A proof of a true claim holds, and no clearance that is measured at instants is less than what it proves."""
    proof = find_proof(drawn.claim, most=_MOST)
    if proof is None:
        return None
    checked = check_proof(drawn.claim, proof)
    assert not checked.fault
    assert checked.nodes == len(proof.steps)
    assert 0 < checked.finest <= 1
    assert checked.proven.min() > 0
    assert checked.proven.min() <= least_clearance(drawn, seed) + COAL
    return proof


@settings(max_examples=20)
@given(SEEDS, st.booleans())
def test_an_honest_proof_holds(seed: int, tracking: bool) -> None:
    proven_honestly(cleared_claim(seed, reach=0.5, tracking=tracking), seed)


@settings(max_examples=10)
@given(SEEDS)
def test_an_honest_proof_holds_on_a_floating_base(seed: int) -> None:
    proven_honestly(cleared_claim(seed, floating=True, reach=0.3), seed)


@pytest.mark.parametrize("seed", range(3))
def test_batches_change_nothing(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    claim = cleared_claim(seed, reach=0.5).claim
    proof = find_proof(claim)
    assert proof is not None
    whole = check_proof(claim, proof)
    monkeypatch.setattr("spacearm.proof.checker._STRETCHES", 3)
    monkeypatch.setattr("spacearm.proof.checker._ROWS", 7)
    parts = check_proof(claim, proof)
    assert np.array_equal(parts.proven, whole.proven)
    assert (parts.fault, parts.nodes, parts.stretches, parts.finest) == ("", whole.nodes, whole.stretches, whole.finest)


def arm_beside(distance: float, *, floating: bool = False, **more: Any) -> Claim:
    """The planar arm turns from 0 to 1 rad; a ball of 10 cm is as far from the start of its tip."""
    robot = planar(bodies=LANDER) if floating else planar()
    ball = Sphere(np.array([2.0, -0.15 - distance, 0.0]), 0.1)
    return claim_about(
        robot, Scene([ball]), Trajectory(robot, swing(0.0, 1.0), base="floating" if floating else "fixed"), **more
    )


LANDER = (
    Body(name="bus", joint=-1, mass=100.0, com=np.zeros(3), inertia=50 * np.eye(3)),
    Body(name="upper", joint=0, mass=2.0, com=np.array([0.5, 0, 0]), inertia=0.2 * np.eye(3)),
    Body(name="fore", joint=1, mass=2.0, com=np.array([0.5, 0, 0]), inertia=0.2 * np.eye(3)),
)


def near_the_start(until: float) -> Claim:
    """The arm starts 5 mm from the ball, which it must keep 20 mm from after `until`."""
    near = NearEnd(
        link=1, other=0, required=0.02, at_start=0.005, at_goal=1.0, until=until, since=np.inf, room=1e-4
    )  # the forearm
    return arm_beside(0.005, clearance=0.02, near=(near,))


def test_a_pair_near_at_the_start_is_held_to_what_it_has_there_and_then_to_all() -> None:
    claim = near_the_start(0.5)
    proof = find_proof(claim)
    assert proof is not None
    checked = check_proof(claim, proof)
    assert not checked.fault
    assert 0.0049 < checked.proven[FROM_START] <= 0.005
    assert checked.proven[OUT] > 0.02
    assert checked.proven[0] > 0.02
    assert checked.proven[[UP_TO_GOAL, 4]].tolist() == [np.inf, np.inf]


def test_a_pair_that_is_not_out_where_the_claim_says_so_has_no_proof() -> None:
    """The same planes are too few for it: the pair has less than 20 mm for a while after the start."""
    proof = find_proof(near_the_start(0.5))
    assert proof is not None
    assert "expected more than" in check_proof(near_the_start(1e-4), proof).fault


def test_tracking_on_a_floating_base_is_not_proven() -> None:
    claim = arm_beside(1.0, floating=True)
    proof = find_proof(claim)
    assert proof is not None
    assert not check_proof(claim, proof).fault
    assert "floating" in check_proof(replace(claim, tracking=np.array([0.0, 1e-9])), proof).fault


def test_a_tube_that_the_proof_has_no_room_for_is_a_fault() -> None:
    claim = arm_beside(0.01)
    proof = find_proof(claim)
    assert proof is not None
    assert not check_proof(claim, proof).fault
    assert not check_proof(replace(claim, tracking=np.full(2, 1e-5)), proof).fault
    assert check_proof(replace(claim, tracking=np.full(2, 0.006)), proof).fault


def test_nothing_in_the_way_needs_no_proof() -> None:
    claim = arm_beside(1.0)
    alone = replace(claim, pairs=replace(claim.pairs, first=np.zeros(0, np.intp), other=np.zeros(0, np.intp)))
    checked = check_proof(alone, tree([], []))
    assert (checked.fault, checked.nodes, checked.stretches) == ("", 0, 0)
    assert np.isinf(checked.proven).all()
    assert check_proof(claim, tree([], [])).fault


# ---- Attacks ---------------------------------------------------------------------------------------------------------


def refused(claim: Claim, steps: Any, directions: Any) -> str:
    """Return the fault of what is no proof; there must be one."""
    checked = check_proof(claim, ProofTree(steps=steps, directions=directions))
    assert checked.fault
    assert (checked.proven == -np.inf).all()
    assert "\n" not in checked.fault
    return checked.fault


NAN, INF = np.nan, np.inf


@pytest.mark.parametrize("vector", [(0, 0, 0), (NAN, 1, 0), (INF, 0, 0), (1e-200, 0, 0), (1e200, 0, 0), (-INF, NAN, 0)])
def test_a_vector_that_is_no_direction_proves_nothing(vector: tuple[float, float, float]) -> None:
    claim = arm_beside(1.0)
    proof = find_proof(claim)
    assert proof is not None
    for i in range(len(proof.directions)):
        directions = proof.directions.copy()
        directions[i] = vector
        assert "no direction" in refused(claim, proof.steps, directions)


def test_arrays_of_another_kind_or_size_are_faults() -> None:
    claim = arm_beside(0.01)
    proof = find_proof(claim)
    assert proof is not None
    steps, directions = proof.steps, proof.directions
    assert "steps" not in refused(claim, steps.astype(np.int64), directions)
    for some in (steps[:-1], steps[:1], np.append(steps, steps[:1]), np.append(steps, steps), np.zeros((0,), np.uint8)):
        assert "nodes" in refused(claim, some, directions)
    for some in (directions[:-1], directions[:0], np.concatenate([directions, directions])):
        assert "directions" in refused(claim, steps, some)
    refused(claim, steps[:, None], directions)
    refused(claim, steps, directions[:, :2])
    refused(claim, steps, directions.ravel())
    refused(claim, steps, directions.astype(np.float32))
    refused(claim, np.full_like(steps, 4), directions)
    refused(claim, np.full_like(steps, 255), directions)
    for none in (None, 7, steps.tolist(), np.ma.masked_array(steps), memoryview(steps)):
        assert "the steps of the proof" in refused(claim, none, directions)
    for none in (None, "x", directions.tolist(), np.ma.masked_array(directions, mask=True)):
        assert "the directions of the proof" in refused(claim, steps, none)
    for kind in (">f8", object, complex):
        refused(claim, steps, directions.astype(kind))


@pytest.mark.parametrize("step", [MEMBERS_OF_FIRST, MEMBERS_OF_OTHER])
def test_a_shape_has_no_members(step: int) -> None:
    claim = arm_beside(1.0)
    assert "no members" in refused(claim, np.full(2000, MEMBERS_OF_OTHER, np.uint8), np.zeros((0, 3)))
    assert claim.bodies.members[claim.pairs.first].any()
    shape = int(np.flatnonzero(claim.bodies.members == 0)[0])
    alone = only(claim, shape, int(claim.pairs.other[0]))
    assert "no members" in refused(alone, np.full(100, step, np.uint8), np.zeros((0, 3)))


@pytest.mark.parametrize("side", [0, 1])
def test_halving_without_end_is_a_fault(side: int) -> None:
    """One side is settled, the other one is halved again, for ever."""
    claim = arm_beside(1.0)
    alone = only(claim, int(claim.pairs.first[0]), int(claim.pairs.other[0]))
    steps = [HALVES, *([SETTLED, HALVES] if side else [HALVES, SETTLED]) * 20_000]
    assert "too short" in refused(alone, np.array(steps, np.uint8), np.ones((len(steps) // 2, 3)))


def test_a_proof_that_only_halves_is_a_fault() -> None:
    refused(arm_beside(1.0), np.full(1 << 18, HALVES, np.uint8), np.zeros((0, 3)))


@settings(max_examples=15)
@given(SEEDS, SEEDS)
def test_a_proof_that_was_tampered_with_proves_nothing_untrue(seed: int, tampering: int) -> None:
    drawn, rng = cleared_claim(seed % 40, reach=0.5), np.random.default_rng(tampering)
    claim, proof = drawn.claim, find_proof(drawn.claim, most=_MOST)
    if proof is None:
        return
    least = least_clearance(drawn, seed)
    for _ in range(20):
        steps, directions = proof.steps.copy(), proof.directions.copy()
        kind = int(rng.integers(7))
        if kind == 0:
            steps[rng.integers(len(steps), size=int(rng.integers(1, 4)))] = rng.integers(0, 4)
        elif kind == 1:
            directions = directions[rng.permutation(len(directions))]
        elif kind == 2:
            directions = np.roll(directions, 1, axis=0)
        elif kind == 3:
            directions[rng.integers(len(directions))] *= -1
        elif kind == 4:
            directions += 10 ** rng.uniform(-6, 0) * rng.normal(size=directions.shape)
        elif kind == 5:
            steps = steps[rng.permutation(len(steps))]
        else:  # a pair is left out, and its planes too
            steps, directions = steps[1:], directions[1:]
        checked = check_proof(claim, ProofTree(steps=steps, directions=directions))
        assert checked.fault or checked.proven.min() <= least + COAL


@settings(max_examples=15)
@given(st.integers(0, 30), SEEDS)
def test_a_proof_of_another_motion_proves_nothing_untrue(seed: int, other: int) -> None:
    """The same robot and obstacles, and a motion that is not cleared of them: a proof of the one is no proof of the other."""
    drawn = cleared_claim(seed, reach=0.5)
    proof = find_proof(drawn.claim, most=_MOST)
    if proof is None:
        return
    rng, robot = np.random.default_rng(other), drawn.robot
    rows = drawn.trajectory.curve.sample(np.linspace(*drawn.trajectory.curve.domain, 4))
    path = PiecewisePath.from_cubic(np.arange(4), rows + 10 ** rng.uniform(-3, 0.5) * rng.normal(size=rows.shape))
    trajectory = RecordedTrajectory(robot, path, base_start=drawn.trajectory.base_start)
    moved = Drawn(claim_about(robot, drawn.scene, trajectory), robot, drawn.scene, trajectory)
    checked = check_proof(moved.claim, proof)
    assert checked.fault or checked.proven.min() <= least_clearance(moved, other) + COAL


def grown(claim: Claim, rng: np.random.Generator, most: int) -> ProofTree:
    """A proof of the right counts that is drawn: it opens and halves as it likes, with Coal's own directions at midpoints."""
    bodies, measure = claim.bodies, Measure(claim)
    nodes = [(int(a), int(b), claim.path.whole()) for a, b in zip(claim.pairs.first, claim.pairs.other, strict=True)]
    steps: list[int] = []
    directions: list[np.ndarray] = []
    while nodes:
        following = []
        for a, b, interval in nodes:
            can = [SETTLED, HALVES, *([MEMBERS_OF_FIRST] * 4 if bodies.members[a] else [])]
            can += [MEMBERS_OF_OTHER] * 4 if bodies.members[b] else []
            step = int(rng.choice(can)) if len(steps) + len(nodes) + len(following) < most else SETTLED
            steps.append(step)
            if step == SETTLED:
                T = frames_at(claim, interval.ends.mean(axis=1))[0]
                n = measure(a, b, T[bodies.frame[a]], T[bodies.frame[b]])[1]
                directions.append(n if np.linalg.norm(n) > 0.5 else rng.normal(size=3))
            elif step == HALVES:
                both = claim.path.halved(interval)
                following += [(a, b, both.select(np.array([i]))) for i in (0, 1)]
            elif step == MEMBERS_OF_FIRST:
                following += [(int(bodies.first_member[a]) + i, b, interval) for i in range(bodies.members[a])]
            else:
                following += [(a, int(bodies.first_member[b]) + i, interval) for i in range(bodies.members[b])]
        nodes = following
    return tree(steps, directions)


@settings(max_examples=40)
@given(SEEDS, st.sampled_from([1e-7, 1e-3, 0.05]), st.booleans(), st.booleans())
def test_no_tree_whatsoever_proves_a_claim_that_is_not_true(seed: int, depth: float, floating: bool, linear: bool) -> None:
    """The arm sweeps past a ball that it touches somewhere, if only by a ten-millionth of a metre."""
    rng = np.random.default_rng(seed)
    robot = planar(bodies=LANDER, base="floating" if floating else "fixed")
    q = rng.uniform(-1.5, 1.5, (int(rng.integers(2, 5)), 2))
    made = PiecewisePath.from_linear(np.arange(len(q)), q)
    trajectory = RecordedTrajectory(robot, made) if linear else Trajectory(robot, Motion(q))
    empty = claim_about(robot, Scene([]), trajectory)
    u = float(rng.uniform(*empty.path.curve.domain))
    T = frames_at(empty, np.array([u]))[0, 3]
    side = T[:3, 1] * rng.choice([-1.0, 1.0])
    ball = Sphere(T[:3, :3] @ [rng.uniform(0, 1), 0, 0] + T[:3, 3] + (0.05 + 0.1 - depth) * side, 0.1)
    claim = claim_about(robot, Scene([ball]), trajectory)
    assert check_proof(claim, grown(claim, rng, int(rng.choice([10, 300])))).fault
    assert find_proof(claim, most=500) is None


@pytest.mark.parametrize(
    ("name", "change"),
    [
        ("radius", lambda bodies, k: bodies.radius[k] * 0.999),
        ("frame", lambda bodies, k: bodies.frame[k] - 1),
        ("first_member", lambda bodies, k: bodies.first_member[k] + 1),
        ("disc", lambda bodies, k: 0.01),
    ],
)
def test_a_bundle_that_does_not_enclose_its_members_is_a_fault(name: str, change: Any) -> None:
    claim = arm_beside(1.0)
    bundle = int(np.flatnonzero(claim.bodies.members)[0])
    column = getattr(claim.bodies, name).copy()
    column[bundle] = change(claim.bodies, bundle)
    wrong = replace(claim, bodies=replace(claim.bodies, **{name: column}))
    assert "enclose" in refused(wrong, np.zeros(2, np.uint8), np.ones((2, 3)))


def test_a_core_that_gets_further_than_its_reach_is_a_fault() -> None:
    claim = arm_beside(1.0)
    wrong = replace(claim, bodies=replace(claim.bodies, reach=claim.bodies.reach * 0.999))
    assert "enclose" in refused(wrong, np.zeros(2, np.uint8), np.ones((2, 3)))
