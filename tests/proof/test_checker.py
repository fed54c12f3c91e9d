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
