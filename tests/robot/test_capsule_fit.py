"""Capsules around shapes, for those who ask for them: they hold the shapes, and stand out as little as they say."""

from __future__ import annotations

import itertools

import coal
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spacearm.geometry import Box, ConvexShape, Cylinder, Polytope, Sphere, bounding_points
from spacearm.robot import envelope_report, load_robot
from spacearm.robot.capsule_fit import box_capsules, enclosing_capsules
from support import drawn_shapes
from support.oracles.coal_shapes import distance, placed_shape
from support.oracles.solids import from_segments, point_distance

ROUNDING = 1e-9  # share of the box's size
SIZES = st.tuples(*[st.floats(0.01, 10)] * 3)


def points_of(size: tuple[float, float, float], generator: np.random.Generator) -> np.ndarray:
    """Points of a box (k, 3): its corners, and others on its surface and inside."""
    inside = generator.uniform(-0.5, 0.5, (400, 3))
    surface = inside.copy()
    surface[np.arange(400), np.arange(400) % 3] = np.sign(inside[:, 0]) / 2
    corners = np.array([(x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
    return np.concatenate([corners, surface, inside]) * size


@given(SIZES, st.integers(1, 30))
def test_every_point_of_the_box_is_in_a_capsule(size: tuple[float, float, float], count: int) -> None:
    capsules = box_capsules(size, count)
    assert 1 <= len(capsules) <= count
    points = points_of(size, np.random.default_rng(0))
    depths = [c.radius - from_segments(points, c.a, c.b) for c in capsules]
    assert np.max(depths, axis=0).min() >= -ROUNDING * max(size)


def box_excess(size: tuple[float, float, float], count: int) -> float:
    """Return by how much the capsules stand out of the box at most, along the normals of its faces [m]."""
    capsules = box_capsules(size, count)
    return max(float(np.max(np.abs(end) + c.radius - np.array(size) / 2)) for c in capsules for end in (c.a, c.b))


@given(SIZES, st.integers(1, 30))
def test_no_capsule_stands_out_further_than_along_the_normals_of_faces(size: tuple[float, float, float], count: int) -> None:
    generator = np.random.default_rng(1)
    directions = generator.normal(size=(2000, 3))
    directions = np.concatenate([np.eye(3), -np.eye(3), directions / np.linalg.norm(directions, axis=1)[:, None]])
    said, found = box_excess(size, count), 0.0
    for capsule in box_capsules(size, count):
        for end in (capsule.a, capsule.b):
            out = np.maximum(np.abs(end + capsule.radius * directions) - np.array(size) / 2, 0)
            found = max(found, float(np.linalg.norm(out, axis=1).max()))
    assert found == pytest.approx(said, rel=1e-9, abs=ROUNDING * max(size))


@given(SIZES)
def test_more_capsules_never_stand_out_further(size: tuple[float, float, float]) -> None:
    excesses = [box_excess(size, count) for count in range(1, 26)]
    assert all(b <= a for a, b in itertools.pairwise(excesses))


def test_a_panel_and_a_cube_by_hand() -> None:
    # 3 m in 9 rows of 1/3 m, 0.05 m to either side and as far from the ends: sqrt(1/6^2 + 2 x 0.05^2) - 0.05.
    assert box_excess((3.0, 6.2, 0.1), 9) == pytest.approx(np.sqrt(1 / 36 + 0.005) - 0.05)
    assert box_excess((2, 2, 2), 9) == pytest.approx((np.sqrt(3) - 1) / 3)
    assert len(box_capsules((2, 2, 2), 9)) == 9
    (ball,) = box_capsules((1, 1, 1), 1)
    assert ball.radius == pytest.approx(np.sqrt(3) / 2)


# ---- any convex shape --------------------------------------------------------------------------------------------------------


@settings(max_examples=15)
@given(drawn_shapes.convex_shapes(), st.integers(1, 6), st.integers(0, 999))
def test_capsules_hold_any_shape_and_stand_out_as_little_as_they_say(shape: ConvexShape, count: int, seed: int) -> None:
    capsules, excess = enclosing_capsules([shape], count)
    assert 1 <= len(capsules) <= count
    points = drawn_shapes.points_in(shape, 300, np.random.default_rng(seed))
    size = float(np.ptp(points, axis=0).max()) + 0.1
    depths = np.min([point_distance(capsule, points) for capsule in capsules], axis=0)
    assert depths.max() <= ROUNDING * size
    made, T = placed_shape(shape)
    for capsule in capsules:  # by Coal, how far points of the capsules are from the shape
        ends = np.array([capsule.center] * 2 if isinstance(capsule, Sphere) else [capsule.a, capsule.b])
        turned = np.random.default_rng(seed).normal(size=(12, 3))
        turned *= capsule.radius / np.linalg.norm(turned, axis=1, keepdims=True)
        for end in ends:
            for off in turned:
                point = coal.Sphere(0.0), coal.Transform3s(np.eye(3), end + off)
                assert distance(point, (made, T)) <= 1.05 * excess + 0.01 * size


def test_more_capsules_stand_out_less_and_spheres_are_left() -> None:
    for shape in (Cylinder(0.28, 0.37), Box((1, 0.7, 0.6)), Polytope(bounding_points(Box((1, 0.9, 0.1)))[0])):
        excess = [enclosing_capsules([shape], count)[1] for count in (1, 8, 20)]
        assert excess == sorted(excess, reverse=True)
        assert excess[1] < 0.75 * excess[0]
    ball = Sphere((1, 2, 3), 0.5)
    assert enclosing_capsules([ball], 3) == ([ball], 0.0)


def test_a_robot_of_capsules_is_there_for_those_who_ask() -> None:
    robot = load_robot("servicer7", capsules_per_shape=9)
    assert len(robot.capsules) == len(robot.shapes) == 7 + 3 * 9
    assert any(note.startswith("capsules around shapes stand out of them, at most: 'base'") for note in robot.notes)
    records = {one.link: one for one in envelope_report("servicer7", capsules_per_shape=9)}
    assert records["panel_left"].capsules == 9
    assert records["panel_left"].excess == pytest.approx(box_excess((3.0, 6.2, 0.1), 9))
    assert records["link_1"].excess == 0
