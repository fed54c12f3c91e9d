"""What the checker proves of two bodies at rest: never more than there is, and nearly all of it for the right direction."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spacearm.geometry import ConvexShape, HalfSpace, Obstacle, Scene, Sphere, core_of
from spacearm.motion import RecordedTrajectory
from spacearm.proof.checker import GUARD, check_proof
from spacearm.proof.claim import Claim
from spacearm.proof.convex_bodies import WORLD
from spacearm.robot import LinkCapsule, LinkShape, Robot
from support import strategies
from support.bounded_paths import line
from support.dense_samples import planar
from support.drawn_claims import claim_about, frames_at, only, tree
from support.drawn_links import obstacles, points_of, shapes
from support.drawn_shapes import directions
from support.oracles.coal_shapes import distance, placed_obstacle
from support.reference_finder import Measure

COALS = 1e-7  # [m] tolerance of Coal where it has no closed form, and how much thicker the oracle makes flat polytopes


def resting(shape: ConvexShape, obstacle: Obstacle) -> Claim:
    """The claim of an arm at rest, whose only shape is bolted to the base, and an obstacle."""
    robot = planar(capsules=None, shapes=(LinkShape(name="bolted", joint=-1, shape=shape),))
    return about(robot, Scene([obstacle]), (0.0, 0.0))


def about(robot: Robot, scene: Scene, q: tuple[float, ...]) -> Claim:
    return claim_about(robot, scene, RecordedTrajectory(robot, line(q, q)))


def proven(claim: Claim, n: np.ndarray | None) -> float:
    """What a direction proves of the robot's shape and all parts of an obstacle; of each part Coal's, if none is given."""
    bodies = claim.bodies
    (first,) = np.flatnonzero((bodies.frame != WORLD) & (bodies.members == 0)).tolist()
    found, T = [], frames_at(claim, np.zeros(1))[0]
    for other in np.flatnonzero((bodies.frame == WORLD) & (bodies.members == 0)).tolist():
        own = Measure(claim)(first, other, T[bodies.frame[first]], T[WORLD])[1] if n is None else n
        checked = check_proof(only(claim, first, other), tree([0], [own]))
        assert not checked.fault or "no direction" in checked.fault  # Coal has none of some that touch
        found.append(float(checked.proven[0]))
    return min(found)


def coals(shape: ConvexShape, obstacle: Obstacle) -> float:
    (link,) = placed_obstacle(shape)
    return min(distance(link, solid) for solid in placed_obstacle(obstacle))


@settings(max_examples=100)
@given(shapes(), obstacles(), directions(), strategies.points(3.0))
def test_no_direction_proves_more_than_coal_measures(
    shape: ConvexShape, obstacle: Obstacle, n: np.ndarray, aside: np.ndarray
) -> None:
    claim, true = resting(shape, obstacle), coals(shape, obstacle)
    for given_one in (None, n, aside if np.linalg.norm(aside) > 1e-6 else n):
        assert proven(claim, given_one) <= max(0.0, true) + COALS


@settings(max_examples=100)
@given(shapes(), shapes())
def test_along_coals_direction_nearly_all_of_a_gap_is_proven(shape: ConvexShape, obstacle: ConvexShape) -> None:
    """A plane across the shortest connection proves the distance of any two convex bodies."""
    true = coals(shape, obstacle)
    if true > 1e-3:
        assert proven(resting(shape, obstacle), None) == pytest.approx(true, abs=1e-5)


@settings(max_examples=60)
@given(shapes(), directions(), strategies.points(), st.integers(0, 2**32 - 1))
def test_the_gap_to_a_half_space_is_exact_whatever_the_direction(
    shape: ConvexShape, n: np.ndarray, aside: np.ndarray, seed: int
) -> None:
    n = n / np.linalg.norm(n)
    claim = resting(shape, HalfSpace(n, -3.0 * n))
    points = points_of(shape, 500, np.random.default_rng(seed))
    gap = (points @ n).min() + 3.0 - core_of(shape).radius
    found = proven(claim, n)
    assert gap - 0.1 <= found <= gap + 1e-12  # of which the points of a rim miss some
    assert proven(claim, -n) == found
    assert proven(claim, aside + 2 * n) == found


@settings(max_examples=40)
@given(shapes(), obstacles(), directions(), st.floats(-9, 9))
def test_a_direction_of_any_length_proves_no_more_than_that_of_length_1(
    shape: ConvexShape, obstacle: Obstacle, n: np.ndarray, size: float
) -> None:
    claim, n = resting(shape, obstacle), n / np.linalg.norm(n)
    assert proven(claim, n * 10.0**size) == pytest.approx(proven(claim, n), rel=0, abs=1e-12)


def test_inside_of_a_body_nothing_is_proven() -> None:
    claim = resting(Sphere((0, 0, 0), 0.01), Sphere((0, 0, 0), 0.5))
    for n in np.random.default_rng(0).normal(size=(50, 3)):
        assert proven(claim, n) < 0


@pytest.mark.parametrize("gap", [0.0, 1e-12, 1e-10, GUARD / 2])
def test_the_guard_outweighs_rounding(gap: float) -> None:
    """Far from the origin too, where a coordinate's last digit is coarser."""
    z = np.array([0.0, 0.0, 1.0])
    for far in (0.0, 1e3, 1e6):
        at = np.array([far, 0.3, 0.7])
        found = proven(resting(Sphere(at, 0.1), Sphere(at + (0.3 + gap) * z, 0.2)), -z)
        assert -1e-5 * max(1, far / 1e6) <= found <= 0
    apart = proven(resting(Sphere(at, 0.1), Sphere(at + (0.3 + 1e-8) * z, 0.2)), -z)
    assert apart <= 0  # at 1,000 km no 10 nm are told apart


def test_links_are_where_their_joints_have_them() -> None:
    """A forearm that is folded back over the upper arm has the distance of parallel rods."""
    aside = np.array([0.0, 0.0, 0.3])
    rods = [
        LinkCapsule(name=name, joint=joint, a=np.zeros(3) + joint * aside, b=np.array([1.0, 0, 0]) + joint * aside, radius=0.05)
        for joint, name in enumerate(("upper", "fore"))
    ]
    robot = planar(capsules=tuple(rods), self_pairs=(("upper", "fore"),))
    claim = about(robot, Scene([]), (0.3, np.pi))
    (upper, fore) = (int(np.flatnonzero(claim.bodies.shape == k)[0]) for k in (0, 1))
    checked = check_proof(only(claim, fore, upper), tree([0], [aside]))
    assert checked.proven[0] == pytest.approx(0.2, abs=1e-8)
    met = claim_about(
        replace(robot, capsules=planar().capsules), Scene([]), RecordedTrajectory(robot, line((0.3, 3.0), (0.3, 3.0)))
    )
    T = frames_at(met, np.zeros(1))[0]
    n = Measure(met)(fore, upper, T[met.bodies.frame[fore]], T[met.bodies.frame[upper]])[1]
    assert not check_proof(only(met, fore, upper), tree([0], [n])).proven[0] > 0  # they meet in the elbow
