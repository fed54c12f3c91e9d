"""The checker says "holds" of what is true only, whatever the proof is; and of every honest proof."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spacearm.proof.bodies import JointMap
from spacearm.proof.checker import check_proof
from spacearm.proof.claim import Claim
from spacearm.proof.path_intervals import Intervals
from spacearm.proof.witness import Witness
from support.drawn_claims import Drawn, any_pair, any_stretch, drawn_claim, only, tree
from support.oracles.pinocchio_points import joint_frames
from support.reference_finder import Measure, Stretch, bound

COAL = 1e-6  # [m] the rounding of a distance that Coal measures, of bodies a few metres large
DEPTH = 1e-4  # [m] of a penetration
SEEDS = st.integers(0, 2**32 - 1)


def frames_at(claim: Claim, u: np.ndarray, off: np.ndarray | float = 0.0) -> np.ndarray:
    """All frames (r, j + 2, 4, 4) at parameters (r,), inertial one first, with joints that deviate."""
    q = claim.path.curve.sample(u) + off
    own = joint_frames(claim.robot, q)
    base = np.broadcast_to(np.eye(4), (len(u), 1, 4, 4))
    placed = claim.base.placed(u, np.concatenate([own, base], axis=1))
    return np.concatenate([base, placed[:, -1:], placed[:, :-1]], axis=1)


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


def gaps_along(claim: Claim, first: int, other: int, u: np.ndarray, n: np.ndarray, off: np.ndarray | float) -> np.ndarray:
    """The gaps (r,) along a direction that is fixed in the other body's frame, where it is n at the first of the instants."""
    bodies, T = claim.bodies, frames_at(claim, u, off)
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
    """A direction across the velocity of the first body's centre in the frame of the other one: bounds of second order count."""
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
        assert proven <= gaps_along(claim, first, other, u, n, off).min() + 1e-10 * abs(proven)


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
