"""Bodies of every shape: what is bounded and proven of boxes, cylinders and polytopes is true, by Coal and by their points."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import nnls

from spacearm.geometry import (
    Box,
    Capsule,
    ConvexShape,
    Cylinder,
    HalfSpace,
    Obstacle,
    Polytope,
    PolytopeSet,
    Scene,
    Sphere,
    core_of,
    pose,
)
from spacearm.motion import AnyTrajectory, Motion, PiecewisePath, RecordedTrajectory, Trajectory
from spacearm.proof import certify
from spacearm.proof.bodies import bodies_of
from spacearm.proof.displacement import PathIntervals
from spacearm.proof.separation import ClearanceBounds, OpenPairs, clearance_bounds
from spacearm.proof.solids import solids_of
from spacearm.proof.witness import Witness, coal_polytope
from spacearm.robot import LinkShape, Robot
from support import strategies
from support.bounded_paths import bounded, curves, line
from support.dense_samples import Setting, moving_frames, planar
from support.drawn_links import obstacles, points_of, polytopes, shaped_arms, shapes
from support.drawn_motions import motions_of
from support.drawn_shapes import directions
from support.oracles.coal_shapes import distance, least_distances, placed_obstacle
from support.oracles.pinocchio_points import joint_frames

COALS = 1e-7  # [m] tolerance of Coal where it has no closed form, and how much thicker the oracle makes flat polytopes
INSTANTS = 40  # of each of the drawn trajectories


def resting(shape: ConvexShape) -> Robot:
    """An arm whose only shape is bolted to the base."""
    return planar(capsules=None, shapes=(LinkShape(name="bolted", joint=-1, shape=shape),))


def looked(robot: Robot, obstacle: Obstacle, n: np.ndarray | None = None) -> ClearanceBounds:
    """The bounds of the robot's only shape and an obstacle's solids, at rest."""
    bodies, relative_bodies = bodies_of(robot)
    midpoints, _ = bounded(robot, line((0, 0), (0, 0)))
    (solids,) = solids_of(Scene([obstacle]))
    count = len(solids.radius)
    pairs = OpenPairs(np.zeros(count, np.intp), np.ones(count, np.intp), np.arange(count))
    directed = None if n is None else np.tile(n, (count, 1))
    return clearance_bounds(midpoints, bodies, relative_bodies, pairs, solids, enough=np.inf, n=directed)


def coals(shape: ConvexShape, obstacle: Obstacle) -> float:
    (link,) = placed_obstacle(shape)
    return min(distance(link, solid) for solid in placed_obstacle(obstacle))


# ---- at rest ---------------------------------------------------------------------------------------------------------


@settings(max_examples=150)
@given(shapes(), obstacles(), strategies.points(3.0))
def test_of_two_shapes_no_more_is_proven_than_coal_measures(shape: ConvexShape, obstacle: Obstacle, aside: np.ndarray) -> None:
    robot, true = resting(shape), coals(shape, obstacle)
    for n in (None, aside):
        known = looked(robot, obstacle, n)
        assert known.at_midpoint.min() <= max(0.0, true) + COALS
        assert known.on_interval.min() <= max(0.0, true) + COALS
        assert (known.on_interval <= known.at_midpoint + 1e-12).all()
        if true > 0:
            assert known.at_most.min() >= true - COALS


@settings(max_examples=100)
@given(shapes(), shapes())
def test_along_coals_direction_nearly_all_of_a_gap_is_proven(shape: ConvexShape, obstacle: ConvexShape) -> None:
    """A plane across the shortest connection proves the distance of any two convex bodies."""
    robot = resting(shape)
    bodies, _ = bodies_of(robot)
    witness = Witness(robot, bodies)
    (solids,) = solids_of(Scene([obstacle]))
    frames = np.tile(np.eye(4), (3, 1, 1))
    measured, n = witness.distance(frames, 0, solids, 0)
    true = coals(shape, obstacle)
    assert measured == pytest.approx(true, abs=COALS) if true > 0 else measured < COALS  # Coal's depths are rough
    if measured > 1e-3:
        assert looked(robot, obstacle, n).at_midpoint[0] == pytest.approx(measured, abs=1e-5)


@settings(max_examples=60)
@given(shapes(), directions(), st.integers(0, 2**32 - 1))
def test_the_gap_to_a_half_space_is_exact(shape: ConvexShape, n: np.ndarray, seed: int) -> None:
    n = n / np.linalg.norm(n)
    known = looked(resting(shape), HalfSpace(n, -3.0 * n))
    points = points_of(shape, 500, np.random.default_rng(seed))
    gap = (points @ n).min() + 3.0 - core_of(shape).radius
    assert known.at_midpoint[0] <= gap + 1e-12
    assert known.at_most[0] == pytest.approx(known.at_midpoint[0], abs=1e-8)
    assert known.at_midpoint[0] >= gap - 0.1  # of which the points of a rim miss some


@settings(max_examples=60)
@given(polytopes(), polytopes(), strategies.points(3.0))
def test_the_witness_measures_hulls_as_least_squares_do(one: Polytope, other: Polytope, aside: np.ndarray) -> None:
    other = Polytope(other.vertices + aside, rounding=other.rounding)
    robot = resting(one)
    witness, (solids,) = Witness(robot, bodies_of(robot)[0]), solids_of(Scene([other]))
    measured, _ = witness.distance(np.tile(np.eye(4), (3, 1, 1)), 0, solids, 0)
    weight = 1e4
    rows = [np.concatenate([one.vertices, -other.vertices]).T]
    rows += [weight * np.repeat([[1.0, 0.0], [0.0, 1.0]], [len(one.vertices), len(other.vertices)], axis=0).T]
    _, apart = nnls(np.concatenate(rows), np.array([0, 0, 0, weight, weight]), maxiter=100_000)
    if measured > 1e-6:
        assert measured == pytest.approx(apart - one.rounding - other.rounding, abs=1e-6)


@pytest.mark.parametrize("count", [1, 2, 3, 4, 9])
@pytest.mark.parametrize("size", [1e-6, 1e-3, 1.0, 100.0])
def test_flat_hulls_become_only_a_little_thicker(count: int, size: float) -> None:
    import coal

    rng = np.random.default_rng(count)
    vertices = size * rng.normal(size=(count, 3)) @ np.diag([1.0, 1.0, 0.0]) @ np.linalg.qr(rng.normal(size=(3, 3)))[0]
    shape, ball = coal_polytope(vertices, 0.0), coal.Sphere(0.0)
    n = np.array([0.6, 0.0, 0.8])
    at = coal.Transform3s(np.eye(3), vertices[np.argmax(vertices @ n)] + 0.3 * n)
    request = coal.DistanceRequest()
    request.gjk_tolerance = 1e-9
    measured = coal.distance(shape, coal.Transform3s(), ball, at, request, coal.DistanceResult())
    assert 0.3 - 2e-9 * max(np.abs(vertices).max(), 1e-3) - 1e-8 <= measured <= 0.3 + 1e-8


# ---- on intervals ----------------------------------------------------------------------------------------------------


@settings(max_examples=60)
@given(st.data())
def test_no_point_of_a_core_gets_further_than_the_points_around_it_may(data: st.DataObject) -> None:
    robot = data.draw(shaped_arms())
    curve = data.draw(curves(robot))
    path = PathIntervals(curve)
    intervals = path.first()
    intervals = intervals.select(np.array([data.draw(st.integers(0, len(intervals) - 1))]))
    for _ in range(data.draw(st.integers(0, 4))):
        intervals = path.halved(intervals).select(np.array([data.draw(st.integers(0, 1))]))
    midpoints, _ = bounded(robot, curve, intervals)
    bodies, relative_bodies = bodies_of(robot)
    rng, n = np.random.default_rng(0), data.draw(directions())
    n = n / np.linalg.norm(n)
    u = np.concatenate([midpoints.u, intervals.ends[0], rng.uniform(*intervals.ends[0], 20)])
    frames = np.concatenate([moving_frames(robot, curve.sample(u)), np.tile(np.eye(4), (len(u), 1, 1, 1))], axis=1)
    for relative in relative_bodies.scene_relative:
        for inside in range(relative + 1, relative + 1 + relative_bodies.count[relative]):
            body = relative_bodies.body[inside]
            T = frames[:, bodies.joint[body]]
            points = points_of(robot.shapes[body].shape, 60, rng) @ np.swapaxes(T[:, :3, :3], 1, 2) + T[:, None, :3, 3]
            moved = points[1:] - points[:1]
            group, row = midpoints.groups[bodies.group[body]], midpoints.row[inside]
            assert np.linalg.norm(moved, axis=-1).max() <= group.displacement_bound[0, row].max() + 1e-9
            loss = np.abs(group.velocity[0, row] @ n) * midpoints.half[0] + group.second_order_bound[0, row]
            assert np.abs(moved @ n).max() <= loss.max() + 1e-9


@st.composite
def any_trajectories(draw: st.DrawFn, robot: Robot) -> AnyTrajectory:
    """Of ours, and straight ones from point to point."""
    if draw(st.booleans()):
        return Trajectory(robot, draw(motions_of(robot, most=3)))
    q = np.array(draw(st.lists(strategies.configurations(robot), min_size=2, max_size=8)))
    return RecordedTrajectory(robot, PiecewisePath.from_linear(np.arange(len(q)), q))


@settings(max_examples=60)
@given(st.data(), st.integers(0, 2**32 - 1))
def test_a_certificate_of_bodies_of_every_shape_is_true(data: st.DataObject, seed: int) -> None:
    robot = data.draw(shaped_arms())
    setting = Setting(robot, Scene(data.draw(st.lists(obstacles(), max_size=3))))
    trajectory = data.draw(any_trajectories(robot))
    certificate = certify(setting, trajectory, limits=())
    near = certificate.closest
    if near is None:
        assert certificate.holds
        return

    def measured(u: np.ndarray) -> np.ndarray:
        return least_distances(robot, setting.scene, joint_frames(robot, trajectory.curve.sample(u)))

    if certificate.holds:
        assert certificate.clearance is not None
        u = np.random.default_rng(seed).uniform(*trajectory.curve.domain, INSTANTS)
        assert measured(u).min() >= certificate.clearance - COALS
        assert measured(np.array([near.u]))[0] >= certificate.clearance - COALS
        assert certificate.clearance >= near.clearance / 2 - COALS
    elif certificate.status == "fails":
        assert measured(np.array([near.u]))[0] <= COALS
    else:
        assert near.clearance <= 1e-3


# ---- hard to fool ----------------------------------------------------------------------------------------------------

PLATE = (0.4, 0.4, 0.002)


def plate_on_a_slide(shape: ConvexShape, at: int = 1) -> Robot:
    return planar(capsules=None, shapes=(LinkShape(name="plate", joint=at, shape=shape),))


def turned(angle: float, position: tuple[float, float, float]) -> np.ndarray:
    return pose(position, (np.cos(angle / 2), 0, np.sin(angle / 2), 0))
