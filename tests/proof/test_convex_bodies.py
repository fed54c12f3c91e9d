"""The table of bodies has every shape of the robot and every part of the scene, and its bundles enclose their members."""

from __future__ import annotations

from collections import Counter
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spacearm.geometry import ConvexShape, HalfSpace, PolytopeSet, Scene, Sphere, SphereSet, support
from spacearm.proof.claim import Claim
from spacearm.proof.convex_bodies import FIRST_JOINT, WORLD, ConvexBodies, robot_bodies, scene_bodies
from support.drawn_claims import cleared_claim, drawn_claim
from support.drawn_links import obstacles as drawn_obstacles
from support.drawn_links import points_of, shaped_arms

SEEDS = st.integers(0, 2**32 - 1)


def directions(seed: int, count: int = 50) -> np.ndarray:
    """Directions of length 1, those along the axes among them."""
    n = np.random.default_rng(seed).normal(size=(count, 3))
    return np.concatenate([np.eye(3), -np.eye(3), n / np.linalg.norm(n, axis=1, keepdims=True)])


def support_of(bodies: ConvexBodies, body: int, n: np.ndarray) -> np.ndarray:
    """The support function of a body of the table, (r,), by what its docstring says of the columns."""
    x = bodies.vertices[bodies.first_point[body] :][: bodies.points[body]]
    across = np.linalg.norm(np.cross(n, bodies.axis[body]), axis=1)
    return (n @ x.T).max(axis=1) + bodies.disc[body] * across + bodies.radius[body]


def parts_of(scene: Scene) -> list[tuple[int, ConvexShape]]:
    """The convex parts of a scene's obstacles, and which obstacle each is of; half-spaces are not among them."""
    out: list[tuple[int, ConvexShape]] = []
    for i, item in enumerate(scene.obstacles):
        if isinstance(item, SphereSet):
            out += [(i, Sphere(c, float(r))) for c, r in zip(item.centers, item.radii, strict=True)]
        elif isinstance(item, PolytopeSet):
            out += [(i, piece) for piece in item.pieces]
        elif not isinstance(item, HalfSpace):
            out.append((i, item))
    return out


def same_support(bodies: ConvexBodies, rows: list[int], shapes: list[ConvexShape], seed: int) -> None:
    """Every one of the shapes is one of the bodies, and the other way round."""
    n = directions(seed)
    left = {row: support_of(bodies, row, n) for row in rows}
    assert len(left) == len(shapes)
    for shape in shapes:
        expected = support(shape, n)
        size = 1e-12 * (1 + np.abs(expected).max())
        row = min(left, key=lambda row: np.abs(left[row] - expected).max())
        assert np.abs(left.pop(row) - expected).max() < size


@settings(max_examples=60)
@given(st.data(), SEEDS)
def test_every_shape_of_a_robot_is_in_the_table_with_its_own_support_function(data: st.DataObject, seed: int) -> None:
    robot = data.draw(shaped_arms())
    bodies, n = robot_bodies(robot), directions(seed)
    shapes = np.flatnonzero(bodies.members == 0)
    assert Counter(bodies.shape[shapes].tolist()) == Counter(range(len(robot.shapes)))
    names = list(dict.fromkeys(part.name for part in robot.shapes))
    for row in shapes.tolist():
        part = robot.shapes[bodies.shape[row]]
        assert bodies.frame[row] == FIRST_JOINT + part.joint
        assert names[bodies.owner[row]] == part.name
        expected = support(part.shape, n)
        assert support_of(bodies, row, n) == pytest.approx(expected, rel=1e-12, abs=1e-12)


@settings(max_examples=60)
@given(st.lists(drawn_obstacles(), max_size=6), SEEDS)
def test_every_part_of_a_scene_is_in_the_table_with_its_own_support_function(items: list, seed: int) -> None:
    scene = Scene(items)
    bodies = scene_bodies(scene)
    assert (bodies.frame == WORLD).all()
    shapes = (bodies.members == 0) & ~bodies.half_space
    for i in range(len(items)):
        rows = np.flatnonzero(shapes & (bodies.owner == i)).tolist()
        same_support(bodies, rows, [part for of, part in parts_of(scene) if of == i], seed)
    flat = np.flatnonzero(bodies.half_space)
    assert bodies.owner[flat].tolist() == [i for i, item in enumerate(items) if isinstance(item, HalfSpace)]
    for row in flat.tolist():
        item = items[bodies.owner[row]]
        assert np.linalg.norm(bodies.axis[row]) == pytest.approx(1, abs=1e-15)
        assert np.linalg.norm(np.cross(bodies.axis[row], item.normal)) < 1e-15 * np.linalg.norm(item.normal)
        assert bodies.axis[row] @ item.normal > 0
        assert np.array_equal(bodies.vertices[bodies.first_point[row]], item.point)


@settings(max_examples=40)
@given(st.data(), SEEDS)
def test_no_point_of_a_shape_is_outside_of_the_bundle_or_further_than_the_reach(data: st.DataObject, seed: int) -> None:
    rng, robot = np.random.default_rng(seed), data.draw(shaped_arms())
    bodies = robot_bodies(robot)
    for row in np.flatnonzero(bodies.members == 0).tolist():
        core = points_of(robot.shapes[bodies.shape[row]].shape, 60, rng)  # without the radius
        size = 1e-12 * (1 + np.abs(core).max())
        assert np.linalg.norm(core - bodies.center[row], axis=1).max() <= bodies.reach[row] + size
        for bundle in np.flatnonzero(bodies.members).tolist():
            first = bodies.first_member[bundle]
            if first <= row < first + bodies.members[bundle]:
                away = np.linalg.norm(core - bodies.vertices[bodies.first_point[bundle]], axis=1).max() + bodies.radius[row]
                assert away <= bodies.radius[bundle] + size


def shapes_in(bodies: ConvexBodies, body: int) -> list[int]:
    """The shapes in a body: itself, or those of the members of a bundle."""
    if not bodies.members[body]:
        return [body]
    first = int(bodies.first_member[body])
    return [shape for member in range(first, first + int(bodies.members[body])) for shape in shapes_in(bodies, member)]


def expected_pairs(claim: Claim) -> Counter[tuple[int, int]]:
    """Every pair of shapes that must be kept apart, by the robot's and the scene's own words."""
    robot, bodies = claim.robot, claim.bodies
    shape = np.flatnonzero(bodies.members == 0)
    own, other = shape[bodies.frame[shape] != WORLD].tolist(), shape[bodies.frame[shape] == WORLD].tolist()
    out = Counter((a, b) for a in own for b in other)
    names = list(dict.fromkeys(part.name for part in robot.shapes))
    for pair in (*robot.self_pairs, *(() if robot.apart is None else robot.apart.pairs)):
        near, far = ([row for row in own if names[bodies.owner[row]] == name] for name in pair)
        out.update((max(a, b), min(a, b)) for a in near for b in far)
    return out


@settings(max_examples=20)
@given(SEEDS, st.booleans())
def test_the_pairs_are_all_pairs_of_shapes_that_must_be_kept_apart_each_once(seed: int, floating: bool) -> None:
    claim = cleared_claim(seed, floating=floating, reach=0.1).claim
    found: Counter[tuple[int, int]] = Counter()
    for first, other in zip(claim.pairs.first.tolist(), claim.pairs.other.tolist(), strict=True):
        for a in shapes_in(claim.bodies, first):
            for b in shapes_in(claim.bodies, other):
                link = claim.bodies.frame[b] != WORLD
                found[(max(a, b), min(a, b)) if link else (a, b)] += 1
    assert found == expected_pairs(claim)


@settings(max_examples=40)
@given(SEEDS, st.booleans())
def test_a_motion_knows_the_joints_between_two_bodies(seed: int, floating: bool) -> None:
    claim = drawn_claim(seed, floating=floating, reach=0.1).claim
    frame = claim.bodies.frame
    for first, other in zip(claim.pairs.first.tolist(), claim.pairs.other.tolist(), strict=True):
        motion = claim.pairs.motion_of[frame[first], frame[other]]
        up, down = (ancestors_of(claim, int(frame[body]) - FIRST_JOINT) for body in (first, other))
        sign = [float(k in up) - float(k in down) for k in range(len(claim.robot.joints))]
        assert claim.pairs.sign[motion].tolist() == sign
        assert claim.pairs.free[motion] == (floating and frame[other] == WORLD)


def ancestors_of(claim: Claim, joint: int) -> set[int]:
    return set() if joint < 0 else {joint, *ancestors_of(claim, claim.robot.joints[joint].parent)}


def test_many_balls_are_in_bundles_of_bundles_and_few_are_not() -> None:
    rng = np.random.default_rng(0)
    few = scene_bodies(Scene([SphereSet(rng.normal(size=(16, 3)), np.full(16, 0.01))]))
    assert not few.members.any()
    more = scene_bodies(Scene([SphereSet(rng.normal(size=(58, 3)), np.full(58, 0.01))]))
    assert more.members[more.members > 0].tolist() == [16, 16, 16, 10]
    many = scene_bodies(Scene([SphereSet(rng.normal(size=(3000, 3)), np.full(3000, 0.01))]))
    bundles = np.flatnonzero(many.members)
    assert sum(len(shapes_in(many, int(body))) for body in bundles[-1:]) > 16
    starts = sorted(zip(many.first_member[bundles].tolist(), many.members[bundles].tolist(), strict=True))
    assert all(first + count == following for (first, count), (following, _) in pairwise(starts))
