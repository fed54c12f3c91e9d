"""Convex shapes as cores with radii: support functions and bounding points, against the convex hull's own arithmetic."""

import numpy as np
import pytest
from scipy.spatial import ConvexHull

import spacearm as sa
from spacearm.geometry import bounding_points, core_of, moved_shape, support

TURNED = sa.pose((0.3, -1.0, 2.0), (0.5, 0.5, -0.5, 0.5))
SHAPES = [
    sa.Sphere((1, 2, 3), 0.3),
    sa.Capsule((0, 0, 0), (1, 2, 3), 0.1),
    sa.Box((1, 2, 3), TURNED, rounding=0.05),
    sa.Cylinder(0.2, 1.0, TURNED, rounding=0.02),
    sa.Polytope([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], rounding=0.1),
    sa.Polytope([(0, 0, 0), (1, 0, 0), (0, 1, 0)]),
]


def directions(count=200):
    return np.random.default_rng(0).normal(size=(count, 3))


@pytest.mark.parametrize("shape", SHAPES, ids=lambda shape: type(shape).__name__)
def test_a_shape_lies_within_its_bounding_points(shape):
    n = directions()
    points, radius = bounding_points(shape)
    around = (n @ points.T).max(axis=1) + radius * np.linalg.norm(n, axis=1)
    assert (support(shape, n) <= around + 1e-12).all()
    if not isinstance(shape, sa.Cylinder):
        assert np.allclose(support(shape, n), around, atol=1e-12)


@pytest.mark.parametrize("shape", SHAPES, ids=lambda shape: type(shape).__name__)
def test_a_moved_shape_has_the_moved_support(shape):
    n = directions()
    there = support(moved_shape(shape, TURNED), n)
    assert np.allclose(there, support(shape, n @ TURNED[:3, :3]) + n @ TURNED[:3, 3], atol=1e-12)


def test_the_support_of_a_cylinder_is_that_of_its_rims():
    turns = np.linspace(0, 2 * np.pi, 20_001)
    ring = np.stack([0.2 * np.cos(turns), 0.2 * np.sin(turns), np.full_like(turns, 0.5)], axis=1)
    rims = np.concatenate([ring, ring * [1, 1, -1]])
    n = directions()
    assert np.allclose(support(sa.Cylinder(0.2, 1.0), n), (n @ rims.T).max(axis=1), atol=1e-6)


def test_points_inside_the_hull_change_nothing():
    points = np.random.default_rng(1).normal(size=(50, 3))
    hull = ConvexHull(points)
    n = directions()
    assert np.allclose(support(sa.Polytope(points), n), support(sa.Polytope(points[hull.vertices]), n))


def test_a_polytope_of_two_points_is_a_segment_and_of_one_a_point():
    assert core_of(sa.Polytope([(0, 0, 0), (0, 0, 2)])).kind == "segment"
    assert core_of(sa.Polytope([(0, 0, 2)], rounding=0.1)).kind == "point"
