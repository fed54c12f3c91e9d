"""Shapes as triangles: closed, with the outside out, and of nearly the volume that they have."""

from __future__ import annotations

import math

import numpy as np
import pytest

import spacearm as sa
from spacearm.view.arm_nodes import envelope_of
from spacearm.view.shape_meshes import Triangles, triangles_of, triangles_of_obstacle

SHAPES = (
    (sa.Sphere((0, 0, 1), 0.5), 4 / 3 * math.pi * 0.125),
    (sa.Capsule((0, 0, 0), (1, 2, 0), 0.1), math.pi * 0.01 * 5**0.5 + 4 / 3 * math.pi * 0.001),
    (sa.Box((1, 2, 3), sa.pose((1, 1, 1), (0.5, 0.5, 0.5, 0.5))), 6.0),
    (sa.Box((1, 1, 1), rounding=0.1), 1 + 0.6 + 3 * math.pi * 0.01 + 4 / 3 * math.pi * 0.001),
    (sa.Cylinder(0.3, 2.0, sa.pose((0, 1, 0), (0.9, 0.1, 0, 0))), math.pi * 0.18),
    (sa.Polytope([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]), 1 / 6),
)


def volume(made: Triangles) -> float:
    a, b, c = np.moveaxis(made.points[made.faces], 1, 0)
    return float(np.einsum("ki,ki", a, np.cross(b, c)) / 6)


@pytest.mark.parametrize(("shape", "wanted"), SHAPES, ids=lambda one: type(one).__name__)
def test_a_shape_has_its_volume(shape: sa.Sphere, wanted: float) -> None:
    assert volume(triangles_of(shape)) == pytest.approx(wanted, rel=0.05)


@pytest.mark.parametrize("shape", [shape for shape, _ in SHAPES], ids=lambda one: type(one).__name__)
def test_no_point_is_outside_of_its_shape(shape: sa.Sphere) -> None:
    from spacearm.geometry import support

    points = triangles_of(shape).points
    for direction in np.random.default_rng(0).normal(size=(20, 3)):
        direction /= np.linalg.norm(direction)
        assert (points @ direction).max() <= float(support(shape, direction[None])[0]) + 1e-6


@pytest.mark.parametrize(
    "shape",
    [
        sa.Polytope([(0, 0, 0)]),
        sa.Polytope([(0, 0, 0), (0, 0, 1)]),
        sa.Polytope([(0, 0, 0), (1, 0, 0), (0, 1, 0)]),
        sa.Polytope([(0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 0)], rounding=0.1),
        sa.Capsule((0, 0, 0), (0, 0, 0), 0.1),
    ],
)
def test_what_is_flat_is_drawn_all_the_same(shape: sa.Polytope) -> None:
    made = triangles_of(shape)
    assert len(made.faces) >= 4
    assert np.isfinite(made.points).all()


def test_sets_and_planes_are_drawn() -> None:
    balls = sa.SphereSet([(0, 0, 0), (3, 0, 0)], [0.5, 0.5])
    pieces = sa.PolytopeSet([sa.Polytope([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)])] * 2)
    assert volume(triangles_of_obstacle(balls, extent=1)) == pytest.approx(2 * 4 / 3 * math.pi * 0.125, rel=0.1)
    assert volume(triangles_of_obstacle(pieces, extent=1)) == pytest.approx(2 / 6)
    plane = triangles_of_obstacle(sa.HalfSpace((0, 0, 2), (1, 1, 1)), extent=3)
    np.testing.assert_allclose(plane.points[:, 2], 1)


@pytest.mark.parametrize("name", sa.builtin_robots())
def test_every_robot_has_something_to_be_seen(name: str) -> None:
    robot = sa.load_robot(name)
    made = envelope_of(robot)
    assert made
    assert all(len(one.faces) for one in made.values())
