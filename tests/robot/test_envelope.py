"""Every collision shape lies inside the capsule that stands for it."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

import strategies
import urdf_text
from spacearm.robot import LinkCapsule, load_urdf
from spacearm.robot.envelope import box_capsule, points_capsule

ROUNDING = 1e-12  # [m] sums of a few products of lengths of about one metre

edges = st.floats(0.0, 2.0, allow_subnormal=False)


def distance_to_segment(points: np.ndarray, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Distance of points (k, 3) from the segment a b."""
    d = b - a
    share = np.clip((points - a) @ d / (d @ d), 0, 1) if d @ d > 0 else np.zeros(len(points))
    return np.linalg.norm(points - (a + share[:, None] * d), axis=1)


def corners(size: tuple[float, float, float]) -> np.ndarray:
    return np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * np.array(size) / 2


def the_capsule(shape: str, **pose: str) -> LinkCapsule:
    text = urdf_text.robot(
        urdf_text.link("base"),
        urdf_text.link("arm", urdf_text.collision(shape, **pose)),
        urdf_text.joint("elbow", "base", "arm"),
    )
    (capsule,) = urdf_text.loaded(text).capsules
    return capsule


@given(st.tuples(edges, edges, edges))
def test_a_box_lies_in_its_capsule_and_touches_it(size: tuple[float, float, float]) -> None:
    a, b, radius = box_capsule(np.array(size))
    distance = distance_to_segment(corners(size), a, b)
    assert distance.max() == pytest.approx(radius, abs=ROUNDING)


@given(hnp.arrays(float, st.tuples(st.integers(1, 30), st.just(3)), elements=strategies.lengths(2.0)))
def test_points_lie_in_their_capsule_and_touch_it(points: np.ndarray) -> None:
    a, b, radius = points_capsule(points)
    distance = distance_to_segment(points, a, b)
    assert distance.max() <= radius + ROUNDING
    assert distance.max() >= radius - ROUNDING
    assert np.linalg.norm(b - a) <= np.ptp(points, axis=0).max() + ROUNDING


@given(st.floats(0.05, 1.0), st.floats(0.0, 2.0))
def test_a_fine_cylinder_mesh_gives_a_capsule_no_longer_than_it(radius: float, length: float) -> None:
    # Long cylinders: the rims lie at the full radius, so nothing can be pulled in; the axis is found.
    angles = np.linspace(0, 2 * math.pi, 64, endpoint=False)
    ring = np.column_stack((radius * np.cos(angles), radius * np.sin(angles), np.zeros(64)))
    half = np.array([0.0, 0.0, 2 * radius + length])
    a, b, found = points_capsule(np.vstack((ring - half, ring + half)))
    assert found == pytest.approx(radius)
    np.testing.assert_allclose((a, b), (-half, half), atol=1e-7)  # a root of rounding is left of the slack


def test_a_ball_of_points_gives_nearly_a_sphere() -> None:
    ball = trimesh.creation.icosphere(subdivisions=3, radius=0.5).vertices
    a, b, radius = points_capsule(np.asarray(ball))
    assert radius == pytest.approx(0.5, abs=1e-3)
    assert np.linalg.norm(b - a) < 1e-2


def test_a_sphere_is_exact() -> None:
    capsule = the_capsule('<sphere radius="0.2"/>', xyz="0.1 0.2 0.3", rpy="1 2 3")
    np.testing.assert_allclose(capsule.a, (0.1, 0.2, 0.3), atol=ROUNDING)
    np.testing.assert_array_equal(capsule.a, capsule.b)
    assert capsule.radius == 0.2


def test_a_cylinder_keeps_axis_radius_and_length() -> None:
    quarter = str(math.pi / 2)
    capsule = the_capsule('<cylinder radius="0.2" length="1.0"/>', xyz="1 0 0", rpy=f"0 {quarter} 0")
    np.testing.assert_allclose(sorted((capsule.a[0], capsule.b[0])), (0.5, 1.5), atol=ROUNDING)
    np.testing.assert_allclose((capsule.a[1:], capsule.b[1:]), np.zeros((2, 2)), atol=ROUNDING)
    assert capsule.radius == 0.2


def test_sizes_may_be_separated_by_commas() -> None:
    assert the_capsule('<box size="1, 0.6, 0.8"/>').radius == pytest.approx(0.5)


@pytest.mark.parametrize("axis", ["0 0 1", "0 1 0", "1 0 0", "-1 0 0", "0.3 -0.5 0.2"])
def test_a_capsule_is_given_in_the_joints_moving_frame(axis: str) -> None:
    # At q = 0 and without offset, the base sees the link's shape where the URDF put it.
    text = urdf_text.robot(
        urdf_text.link("base"),
        urdf_text.link("arm", urdf_text.collision('<cylinder radius="0.1" length="2"/>', xyz="0.5 0 1")),
        urdf_text.joint("elbow", "base", "arm", axis=axis),
    )
    robot = urdf_text.loaded(text)
    R = robot.joints[0].T_parent_joint[:3, :3]
    (capsule,) = robot.capsules
    ends = sorted((tuple(R @ capsule.a), tuple(R @ capsule.b)), key=lambda point: point[2])
    np.testing.assert_allclose(ends, ((0.5, 0, 0), (0.5, 0, 2)), atol=ROUNDING)


def test_shapes_on_links_fixed_to_the_base_ride_on_the_base() -> None:
    sphere = urdf_text.collision('<sphere radius="1"/>', xyz="0 0 1")
    text = urdf_text.robot(
        urdf_text.link("world"),
        urdf_text.link("base", sphere),
        urdf_text.link("arm", sphere, sphere),
        urdf_text.link("flange", sphere),
        urdf_text.joint("mount", "world", "base", kind="fixed", xyz="1 0 0"),
        urdf_text.joint("elbow", "base", "arm"),
        urdf_text.joint("screw", "arm", "flange", kind="fixed", xyz="0 0 1"),
    )
    capsules = urdf_text.loaded(text).capsules
    assert [(c.name, c.joint) for c in capsules] == [("base", -1), ("arm", 0), ("arm", 0), ("flange", 0)]
    np.testing.assert_array_equal(capsules[0].a, (1, 0, 1))
    np.testing.assert_array_equal(capsules[3].a, (0, 0, 2))
    assert urdf_text.loaded(text, collision="none").capsules == ()


@pytest.mark.parametrize("suffix", ["stl", "obj", "ply", "dae", "glb"])
@pytest.mark.parametrize(
    ("filename", "place"),
    [
        ("part", "arm/urdf"),
        ("../meshes/part", "arm/meshes"),
        ("package://arm/meshes/part", "arm/meshes"),
        ("package://renamed/meshes/part", "arm/meshes"),
        ("package://elsewhere/part", "elsewhere"),
    ],
)
def test_a_mesh_lies_in_its_capsule(suffix: str, filename: str, place: str, tmp_path: Path) -> None:
    for directory in ("arm/urdf", place):
        (tmp_path / directory).mkdir(parents=True, exist_ok=True)
    mesh = trimesh.creation.cone(radius=0.3, height=0.9)
    mesh.apply_translation((0.1, 0.2, 0.3))
    mesh.export(tmp_path / place / f"part.{suffix}")
    shape = f'<mesh filename="{filename}.{suffix}" scale="1 2 0.5"/>'
    path = tmp_path / "arm" / "urdf" / "arm.urdf"
    path.write_text(
        urdf_text.robot(
            urdf_text.link("base"),
            urdf_text.link("arm", urdf_text.collision(shape)),
            urdf_text.joint("elbow", "base", "arm"),
        )
    )
    (capsule,) = load_urdf(path).capsules
    distance = distance_to_segment(mesh.vertices * (1.0, 2.0, 0.5), capsule.a, capsule.b)
    assert distance.max() == pytest.approx(capsule.radius, abs=1e-6)  # the files hold single precision
