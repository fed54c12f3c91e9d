"""Volume, centre and inertia of evenly filled shapes, against MuJoCo, trimesh, and points counted by Coal."""

from __future__ import annotations

import math
from typing import Any

import coal
import mujoco
import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from spacearm.geometry import (
    Box,
    Capsule,
    Cylinder,
    Polytope,
    PolytopeSet,
    Sphere,
    SphereSet,
    core_of,
    moved_shape,
    pose,
    support,
)
from spacearm.geometry.solid_moments import SolidMoments, solid_moments
from support import drawn_shapes, strategies
from support.oracles.coal_shapes import distance, placed_obstacle

ROUNDING = 1e-9
DENSITY = 1700.0
TURNED = pose((0.1, -0.2, 0.3), (0.5, 0.1, -0.7, 0.2))


def by_mujoco(geometry: str) -> SolidMoments:
    """What MuJoCo makes of a geom of even density, in its body's frame."""
    xml = f'<mujoco><worldbody><body><freejoint/><geom density="{DENSITY}" {geometry}/></body></worldbody></mujoco>'
    model = mujoco.MjModel.from_xml_string(xml)
    R = np.zeros(9)
    mujoco.mju_quat2Mat(R, model.body_iquat[1])
    R = R.reshape(3, 3)
    return SolidMoments(
        volume=float(model.body_mass[1]) / DENSITY,
        center=model.body_ipos[1].copy(),
        inertia=R @ np.diag(model.body_inertia[1]) @ R.T / float(model.body_mass[1]),
    )


def numbers(values: Any) -> str:
    return " ".join(repr(float(value)) for value in values)


def placed(T: np.ndarray) -> str:
    return f'pos="{numbers(T[:3, 3])}" xyaxes="{numbers(T[:3, :2].T.ravel())}"'


def assert_alike(found: SolidMoments, expected: SolidMoments, tolerance: float) -> None:
    size = math.sqrt(float(np.trace(expected.inertia)))
    assert found.volume == pytest.approx(expected.volume, rel=tolerance)
    np.testing.assert_allclose(found.center, expected.center, rtol=0, atol=tolerance * (size + np.linalg.norm(expected.center)))
    np.testing.assert_allclose(found.inertia, expected.inertia, rtol=0, atol=2 * tolerance * size**2)


@settings(max_examples=20)
@given(strategies.transforms(), st.tuples(*[st.floats(0.02, 1.0)] * 3))
def test_shapes_with_formulas_are_as_heavy_as_mujocos(T: np.ndarray, size: tuple[float, float, float]) -> None:
    r, l, _ = size  # noqa: E741
    ends = [T[:3, :3] @ (0, 0, side * l / 2) + T[:3, 3] for side in (-1, 1)]
    shapes = {
        f'type="sphere" size="{r!r}" {placed(T)}': Sphere(T[:3, 3], r),
        f'type="capsule" size="{r!r} {l / 2!r}" {placed(T)}': Capsule(*ends, r),
        f'type="cylinder" size="{r!r} {l / 2!r}" {placed(T)}': Cylinder(r, l, T),
        f'type="box" size="{numbers(np.array(size) / 2)}" {placed(T)}': Box(size, T),
    }
    for geometry, shape in shapes.items():
        assert_alike(solid_moments(shape), by_mujoco(geometry), ROUNDING)


@settings(max_examples=20)
@given(st.integers(4, 30), st.integers(0, 999), strategies.transforms())
def test_a_polytope_is_as_heavy_as_trimeshs(count: int, seed: int, T: np.ndarray) -> None:
    points = np.random.default_rng(seed).normal(size=(count, 3)) @ T[:3, :3].T + T[:3, 3]
    hull = trimesh.convex.convex_hull(points)
    expected = SolidMoments(volume=hull.volume, center=hull.center_mass, inertia=hull.moment_inertia / hull.volume)
    assert_alike(solid_moments(Polytope(points)), expected, 1e-7)


def counted(shape: Any, steps: int = 32) -> SolidMoments:
    """Points on a grid that Coal has inside a shape."""
    solids = placed_obstacle(shape)
    ball = coal.Sphere(0.0)
    parts = shape.pieces if isinstance(shape, PolytopeSet) else [shape]
    if isinstance(shape, SphereSet):
        parts = [Sphere(c, float(r)) for c, r in zip(shape.centers, shape.radii, strict=True)]
    high, low = (sign * np.max([support(part, sign * np.eye(3)) for part in parts], axis=0) for sign in (1, -1))
    ticks = [np.linspace(a, b, steps, endpoint=False) + (b - a) / steps / 2 for a, b in zip(low, high, strict=True)]
    points = np.stack(np.meshgrid(*ticks, indexing="ij"), axis=-1).reshape(-1, 3)
    inside = [p for p in points if any(distance((ball, coal.Transform3s(np.eye(3), p)), solid) <= 0 for solid in solids)]
    off = np.array(inside) - np.mean(inside, axis=0)
    second = off.T @ off / len(off)
    return SolidMoments(
        volume=len(inside) * float(np.prod((high - low) / steps)),
        center=np.mean(inside, axis=0),
        inertia=np.trace(second) * np.eye(3) - second,
    )


CORNERS = [(x, y, z) for x in (0, 0.3) for y in (0, 0.2) for z in (0, 0.4)]
COUNTED: dict[str, Any] = {
    "rounded box": Box((0.4, 0.3, 0.2), TURNED, rounding=0.1),
    "rounded cylinder": Cylinder(0.2, 0.3, TURNED, rounding=0.1),
    "rounded polytope": Polytope([(0, 0, 0), (0.5, 0, 0), (0, 0.4, 0), (0.1, 0.1, 0.3)], rounding=0.1),
    "rounded plate": Polytope([(0, 0, 0), (0.5, 0, 0), (0, 0.4, 0)], rounding=0.1),
    "overlapping balls": SphereSet([(0.1, 0, 0), (0.2, 0, 0), (0.1, 0.1, 0.3)], [0.1, 0.15, 0.08]),
    "overlapping polytopes": PolytopeSet(
        (Polytope(CORNERS), Polytope(np.array(CORNERS) + 0.1), Polytope(np.array(CORNERS) + np.array((0.6, 0, 0))))
    ),
}


@pytest.mark.parametrize("name", COUNTED)
def test_rounded_shapes_and_unions_are_as_heavy_as_the_points_in_them(name: str) -> None:
    assert_alike(solid_moments(COUNTED[name]), counted(COUNTED[name]), 0.03)


@settings(max_examples=20)
@given(drawn_shapes.convex_shapes(), strategies.transforms())
def test_moments_go_with_the_shape(shape: Any, T: np.ndarray) -> None:
    own, moved = solid_moments(shape), solid_moments(moved_shape(shape, T))
    R = T[:3, :3]
    expected = SolidMoments(volume=own.volume, center=R @ own.center + T[:3, 3], inertia=R @ own.inertia @ R.T)
    rough = getattr(shape, "rounding", 0.0) > 0 and core_of(shape).kind == "polytope"
    assert_alike(moved, expected, 5e-3 if rough else 1e-6)


def test_what_is_flat_has_no_volume_and_its_mass_is_spread_over_it() -> None:
    square = solid_moments(Polytope([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0.3, 0.4, 0)]))
    assert square.volume == 0
    np.testing.assert_allclose(square.center, (0.5, 0.5, 0), atol=ROUNDING)
    np.testing.assert_allclose(square.inertia, np.diag([1, 1, 2]) / 12, atol=ROUNDING)
    rod, point = solid_moments(Polytope([(0, 0, 0), (0, 3, 0), (0, 1, 0)])), solid_moments(Polytope([(1, 2, 3)]))
    np.testing.assert_allclose(rod.inertia, np.diag([9, 0, 9]) / 12, atol=ROUNDING)
    np.testing.assert_allclose(point.inertia, np.zeros((3, 3)), atol=ROUNDING)
    np.testing.assert_allclose(point.center, (1, 2, 3))
    both = PolytopeSet((Polytope(CORNERS), Polytope([(0, 0, 0), (9, 9, 0), (0, 9, 9)])))
    assert solid_moments(both).volume == pytest.approx(0.3 * 0.2 * 0.4)
