"""Every collision shape lies inside the capsules that stand for it, and they are not much larger than it."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from spacearm.core.errors import RobotError
from spacearm.robot import LinkCapsule, envelope_report, load_robot, load_urdf
from spacearm.robot.capsule_fit import Segment, fit_capsule, smallest_circle, union_volume
from spacearm.robot.envelope import Plane, cut, enclose, enclosed, greatest_excess, shape_triangles
from spacearm.robot.urdf import Shape, found_mesh
from support import strategies, urdf_text
from support.messages import assert_refused
from support.oracles.solids import from_segments

ROUNDING = 1e-12  # [m] sums of a few products of lengths of about one metre

edges = st.floats(0.001, 2.0)
counts = st.sampled_from([1, 2, 3, 3, 4])


def outside(points: np.ndarray, capsules: list[Segment] | tuple[Segment, ...]) -> float:
    """By how much the farthest of points (k, 3) is outside of the capsules together [m]; negative inside."""
    return float(np.min([from_segments(points, c.a, c.b) - c.radius for c in capsules], axis=0).max())


def lattice(size: tuple[float, float, float], steps: int = 9) -> np.ndarray:
    """Points of a box, its corners, edges, faces and inside."""
    t = np.linspace(-0.5, 0.5, steps)
    return np.stack(np.meshgrid(t, t, t), axis=-1).reshape(-1, 3) * size


def drum(radius: float, length: float) -> np.ndarray:
    """Points of a cylinder, its rims and inside."""
    turn, r, z = np.meshgrid(np.linspace(0, 2 * math.pi, 97), (0, 0.5, 0.9, 1), np.linspace(-0.5, 0.5, 21))
    return np.stack([radius * r * np.cos(turn), radius * r * np.sin(turn), length * z], axis=-1).reshape(-1, 3)


def enclose_box(size: tuple[float, ...], count: int) -> list[Segment]:
    return enclosed([Shape("box", size, np.eye(4))], count)


def enclose_cylinder(radius: float, length: float, count: int) -> list[Segment]:
    return enclosed([Shape("cylinder", (radius, length), np.eye(4))], count)


def the_capsules(*shapes: str, **options: int) -> tuple[LinkCapsule, ...]:
    text = urdf_text.robot(urdf_text.link("base"), urdf_text.link("arm", *shapes), urdf_text.joint("elbow", "base", "arm"))
    return urdf_text.loaded(text, **options).capsules


def the_capsule(shape: str, **pose: str) -> LinkCapsule:
    (capsule,) = the_capsules(urdf_text.collision(shape, **pose), capsules_per_shape=1)
    return capsule


@settings(max_examples=15)
@given(st.tuples(edges, edges, edges), counts)
def test_a_box_lies_in_its_capsules(size: tuple[float, float, float], count: int) -> None:
    capsules = enclose_box(size, count)
    assert 1 <= len(capsules) <= count
    assert outside(lattice(size), capsules) <= ROUNDING


@settings(max_examples=8)
@given(edges, edges, counts)
def test_a_cylinder_lies_in_its_capsules(radius: float, length: float, count: int) -> None:
    capsules = enclose_cylinder(radius, length, count)
    assert 1 <= len(capsules) <= count
    assert outside(drum(radius, length), capsules) <= ROUNDING


@settings(max_examples=10)
@given(st.lists(st.tuples(strategies.transforms(), st.tuples(edges, edges, edges)), min_size=1, max_size=4), counts)
def test_a_solid_of_several_boxes_lies_in_its_capsules_with_all_that_is_inside(parts: list, count: int) -> None:
    # Boxes at any angle: not convex, in several pieces, their surfaces crossing each other.
    meshes = [trimesh.creation.box(size, transform=T) for T, size in parts]
    capsules = enclose(np.asarray(trimesh.util.concatenate(meshes).triangles), count)
    for T, size in parts:
        assert outside(lattice(size) @ T[:3, :3].T + T[:3, 3], capsules) <= 10 * ROUNDING


@pytest.mark.parametrize("count", [1, 3, 4, 9])
def test_a_ring_lies_in_its_capsules(count: int) -> None:
    T = trimesh.transformations.rotation_matrix(0.7, (1, 2, 3))
    ring = trimesh.creation.torus(0.3, 0.05, transform=T)
    capsules = enclose(np.asarray(ring.triangles), count)
    turn = np.linspace(0, 2 * math.pi, 300)
    spine = 0.3 * np.column_stack([np.cos(turn), np.sin(turn), np.zeros(300)]) @ T[:3, :3].T
    assert outside(np.vstack([spine, ring.sample(5000, seed=3)]), capsules) <= ROUNDING
    if count >= 4:  # the hole is left free as far as that goes
        assert union_volume(capsules, 20_000) < 3 * abs(ring.volume)


def test_many_triangles_lie_in_their_capsules_too() -> None:
    # More than are looked at in choosing where to cut, with one spike that a selection could miss.
    ball = trimesh.creation.icosphere(subdivisions=5, radius=0.5)
    ball.vertices[4711] *= 1.5
    for count in (1, 3):
        capsules = enclose(np.asarray(ball.triangles), count)
        assert outside(np.asarray(ball.vertices), capsules) <= ROUNDING
        assert outside(ball.sample(5000, seed=1), capsules) <= ROUNDING


@settings(max_examples=25)
@given(hnp.arrays(float, st.tuples(st.integers(1, 30), st.just(3)), elements=strategies.lengths(2.0)))
def test_points_lie_in_their_capsule_and_touch_it(points: np.ndarray) -> None:
    capsule = fit_capsule(points)
    distance = from_segments(points, capsule.a, capsule.b)
    assert distance.max() == pytest.approx(capsule.radius, abs=ROUNDING)


@settings(max_examples=20)
@given(strategies.transforms(), st.floats(0.01, 1.0), st.floats(0.0, 3.0))
def test_the_points_of_a_capsule_give_that_capsule_however_it_is_turned(T: np.ndarray, radius: float, length: float) -> None:
    fine = trimesh.creation.capsule(height=length, radius=radius, count=[24, 24])
    fine.apply_transform(T)
    true = math.pi * radius**2 * (length + 4 / 3 * radius)
    assert fit_capsule(np.asarray(fine.vertices)).volume <= 1.02 * true


@settings(max_examples=25)
@given(hnp.arrays(float, st.tuples(st.integers(1, 12), st.just(2)), elements=strategies.lengths(2.0)))
def test_the_smallest_circle_is_the_smallest(points: np.ndarray) -> None:
    radius = np.linalg.norm(points - smallest_circle(points), axis=1).max()
    # No circle is smaller than that of any two or three of its points; the largest of those holds them all.
    pairs = [np.linalg.norm(a - b) / 2 for a in points for b in points]
    threes = [_triangle_circle(a, b, c) for a in points for b in points for c in points]
    assert radius == pytest.approx(max(*pairs, *threes), rel=1e-6, abs=1e-7)


def _triangle_circle(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> float:
    """Radius of the smallest circle around a triangle."""
    x, y, z = sorted((np.linalg.norm(a - b), np.linalg.norm(b - c), np.linalg.norm(c - a)))
    area = abs(np.cross([*(b - a), 0], [*(c - a), 0])[2]) / 2
    return z / 2 if x * x + y * y <= z * z or area < 1e-12 else x * y * z / (4 * area)


@given(strategies.points(0.4), strategies.transforms())
def test_a_cut_parts_a_surface_and_loses_nothing_of_it(through: np.ndarray, turn: np.ndarray) -> None:
    solid = trimesh.creation.cone(0.5, 1.0, sections=7)
    plane = Plane(turn[:3, 2], float(turn[:3, 2] @ through))
    behind, before = cut(np.asarray(solid.triangles), plane)
    assert (behind @ plane.normal <= plane.offset + ROUNDING).all()
    assert (before @ plane.normal >= plane.offset - ROUNDING).all()
    area = sum(trimesh.triangles.area(part).sum() for part in (behind, before))
    assert area == pytest.approx(solid.area, rel=1e-9)
    lidded = cut(np.asarray(solid.triangles), plane, lids=True)
    volumes = [abs(_signed_volume_of_convex(part)) for part in lidded if len(part)]
    assert sum(volumes) == pytest.approx(abs(solid.volume), rel=1e-9, abs=1e-12)


def test_cuts_in_three_directions_keep_the_corner_inside_the_solid() -> None:
    # The middle of a box is on no triangle of it: only the lids hold it in each of the eight parts.
    pieces = [shape_triangles("box", (1.0, 2.0, 3.0))]
    for axis in np.eye(3):
        pieces = [part for piece in pieces for part in cut(piece, Plane(axis, 0.0), lids=True)]
    assert len(pieces) == 8
    for piece in pieces:
        assert np.linalg.norm(piece.reshape(-1, 3), axis=1).min() == pytest.approx(0, abs=ROUNDING)
    assert outside(lattice((1, 1, 1)), enclose_box((1.0, 1.0, 1.0), 8)) <= ROUNDING


def _signed_volume_of_convex(triangles: np.ndarray) -> float:
    """Volume of a convex surface, whichever way its triangles are turned."""
    middle = triangles.mean(axis=(0, 1))
    a, b, c = np.moveaxis(triangles - middle, 1, 0)
    return float(np.abs(np.einsum("ki,ki->k", a, np.cross(b, c))).sum() / 6)


@pytest.mark.parametrize(
    ("size", "count", "used", "ratio"),
    [
        ((1, 0.1, 0.1), 1, 1, 1.75),
        ((1, 1, 0.1), 1, 1, 12.2),
        ((1, 1, 0.1), 3, 3, 3.5),
        ((1, 1, 0.1), 8, 8, 1.85),
        ((1, 0.5, 0.3), 3, 2, 1.8),
        ((1, 1, 1), 3, 1, 2.7),
        ((0.05, 0.08, 0.2), 3, 2, 1.75),
    ],
)
def test_boxes_get_as_many_capsules_as_pay(size: tuple[float, ...], count: int, used: int, ratio: float) -> None:
    capsules = enclose_box(size, count)
    assert len(capsules) == used
    assert union_volume(capsules, 40_000) <= ratio * math.prod(size)


def test_an_angle_of_two_rods_gets_a_capsule_for_each() -> None:
    rods = [trimesh.creation.box((1, 0.1, 0.1)), trimesh.creation.box((0.1, 0.1, 1.0))]
    rods[1].apply_translation((0.45, 0, 0.5))
    capsules = enclose(np.asarray(trimesh.util.concatenate(rods).triangles), 3)
    assert len(capsules) == 2
    assert max(capsule.radius for capsule in capsules) < 0.08


@pytest.mark.parametrize(("radius", "length"), [(0.05, 0.4), (0.05, 0.1), (0.1, 0.05)])
def test_a_cylinders_capsule_is_smaller_than_the_one_of_its_radius(radius: float, length: float) -> None:
    (capsule,) = enclose_cylinder(radius, length, 1)
    assert capsule.volume < 0.995 * math.pi * radius**2 * (length + 4 / 3 * radius)


def test_a_sphere_is_exact() -> None:
    capsule = the_capsule('<sphere radius="0.2"/>', xyz="0.1 0.2 0.3", rpy="1 2 3")
    np.testing.assert_allclose(capsule.a, (0.1, 0.2, 0.3), atol=ROUNDING)
    np.testing.assert_array_equal(capsule.a, capsule.b)
    assert capsule.radius == 0.2


def test_a_cylinder_with_a_sphere_on_each_end_is_one_exact_capsule() -> None:
    rpy = "0.3 0.4 0"
    rod = urdf_text.collision('<cylinder radius="0.1" length="0.5"/>', xyz="1 0 0", rpy=rpy)
    z = trimesh.transformations.euler_matrix(0.3, 0.4, 0)[:3, 2]
    ends = [np.array([1, 0, 0]) + side * 0.25 * z for side in (-1, 1)]
    caps = [urdf_text.collision('<sphere radius="0.1"/>', xyz=" ".join(map(repr, end.tolist()))) for end in ends]
    (capsule,) = the_capsules(caps[1], rod, caps[0])
    np.testing.assert_allclose(
        sorted([capsule.a.tolist(), capsule.b.tolist()]), sorted(end.tolist() for end in ends), atol=1e-9
    )
    assert capsule.radius == pytest.approx(0.1, abs=1e-9)
    assert len(the_capsules(rod, caps[0])) == 2  # one end only: no


def test_a_capsule_inside_another_is_left_out() -> None:
    spheres = [urdf_text.collision(f'<sphere radius="{r}"/>', xyz=f"{x} 0 0") for r, x in ((0.1, 0.05), (0.2, 0), (0.2, 0))]
    (capsule,) = the_capsules(*spheres)
    assert capsule.radius == 0.2
    assert len(the_capsules(spheres[1], urdf_text.collision('<sphere radius="0.1"/>', xyz="0.11 0 0"))) == 2


def test_shapes_without_extent_have_capsules_without_extent() -> None:
    assert the_capsule('<box size="0 0 0"/>').radius == 0
    line = the_capsule('<box size="0 2 0"/>')
    assert line.radius == 0
    assert np.linalg.norm(line.b - line.a) == pytest.approx(2)
    assert outside(lattice((2, 1, 0)), enclose_box((2.0, 1.0, 0.0), 3)) <= ROUNDING


def test_sizes_may_be_separated_by_commas() -> None:
    assert the_capsule('<box size="1, 0.6, 0.8"/>') == the_capsule('<box size="1 0.6 0.8"/>')


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
    turned = [Segment(R @ capsule.a, R @ capsule.b, capsule.radius)]
    assert abs(outside(drum(0.1, 2.0) + np.array([0.5, 0, 1]), turned)) <= 1e-9


def test_shapes_on_links_fixed_to_the_base_ride_on_the_base() -> None:
    sphere = urdf_text.collision('<sphere radius="1"/>', xyz="0 0 1")
    text = urdf_text.robot(
        urdf_text.link("world"),
        urdf_text.link("base", sphere),
        urdf_text.link("arm", sphere, urdf_text.collision('<sphere radius="1"/>', xyz="0 0 3")),
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
def test_a_mesh_lies_in_its_capsules(suffix: str, filename: str, place: str, tmp_path: Path) -> None:
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
    capsules = [Segment(c.a, c.b, c.radius) for c in load_urdf(path, capsules_per_shape=2).capsules]
    assert abs(outside(mesh.vertices * (1.0, 2.0, 0.5), capsules)) <= 1e-6  # the files hold single precision


def test_a_mesh_is_named_by_every_form_of_uri_but_never_fetched(tmp_path: Path) -> None:
    (tmp_path / "arm" / "my meshes").mkdir(parents=True)
    path = tmp_path / "arm" / "my meshes" / "part.stl"
    trimesh.creation.box((1, 1, 1)).export(path)
    for name in (
        f"file:{path}",
        f"file://{path}",
        path.as_uri(),
        f"file://localhost{path}",
        "package://arm/my%20meshes/part.stl",
    ):
        assert found_mesh(name, tmp_path) == path, name
    for name in ("http://arm/my%20meshes/part.stl", "https://arm/my meshes/part.stl"):
        assert found_mesh(name, tmp_path) is None, name


SHAPES = {
    "ball": '<sphere radius="0.3"/>',
    "rod": '<cylinder radius="0.05" length="0.6"/>',
    "plate": '<box size="0.5 0.4 0.05"/>',
    "mesh": '<mesh filename="plate.stl"/>',
}


def reported(directory: Path, count: int) -> dict[str, object]:
    trimesh.creation.box((0.5, 0.4, 0.05)).export(directory / "plate.stl")
    names = list(SHAPES)
    path = directory / "arm.urdf"
    path.write_text(
        urdf_text.robot(
            urdf_text.link("base"),
            *(urdf_text.link(name, urdf_text.collision(shape, xyz="1 2 3", rpy="1 2 3")) for name, shape in SHAPES.items()),
            *(urdf_text.joint(f"joint_{name}", "base" if i == 0 else names[i - 1], name) for i, name in enumerate(names)),
        )
    )
    report = {record.link: record for record in envelope_report(path, capsules_per_shape=count)}
    robot = load_robot(path, capsules_per_shape=count)
    for name, record in report.items():
        assert record.capsules == sum(capsule.name == name for capsule in robot.capsules)
    return report


@pytest.mark.parametrize("count", [1, 3])
def test_the_report_measures_excess_and_volume(count: int, tmp_path: Path) -> None:
    report = reported(tmp_path, count)
    assert list(report) == list(SHAPES)  # the base has no shape
    ball, rod, plate, mesh = report.values()
    assert (ball.capsules, ball.excess) == (1, pytest.approx(0, abs=1e-12))
    assert ball.ratio == pytest.approx(1)
    # Around a convex body a single capsule stands out most in the direction where their widths differ most.
    (capsule,) = enclose_cylinder(0.05, 0.6, 1)
    u = trimesh.creation.icosphere(subdivisions=5).vertices
    wide = np.maximum(u @ capsule.a, u @ capsule.b) + capsule.radius
    assert rod.excess == pytest.approx((wide - 0.05 * np.hypot(u[:, 0], u[:, 1]) - 0.3 * np.abs(u[:, 2])).max(), rel=0.02)
    assert rod.volume == pytest.approx(capsule.volume, rel=0.02)
    # The mesh is the same plate, but its distance is measured by Coal.
    assert (mesh.capsules, mesh.shapes) == (plate.capsules, ("mesh",))
    assert mesh.excess == pytest.approx(plate.excess, rel=0.02)
    assert mesh.ratio == pytest.approx(plate.ratio, rel=0.02)


def test_more_capsules_stand_out_less(tmp_path: Path) -> None:
    one, two, four = (reported(tmp_path, count)["plate"] for count in (1, 2, 4))
    assert one.excess > 1.4 * two.excess > 1.4 * four.excess
    assert one.volume > two.volume > four.volume


def test_the_prism_around_a_cylinder_holds_it() -> None:
    T = shape_triangles("cylinder", (0.3, 1.0))
    assert np.hypot(*np.moveaxis(T.reshape(-1, 3)[:, :2], 1, 0)).max() < 0.302
    assert trimesh.Trimesh(*trimesh.triangles.to_kwargs(T).values()).volume != 0
    normals = np.cross(T[:, 1] - T[:, 0], T[:, 2] - T[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    points = drum(0.3, 1.0)
    reach = np.abs(np.einsum("ki,ki->k", normals, T[:, 0]))
    assert (np.abs(points @ normals.T) <= reach + ROUNDING).all()


@pytest.mark.parametrize("count", [0, 1.5, True, "3", None, 10**12])
def test_capsules_per_shape_that_is_no_number_is_refused(count: object) -> None:
    case = f"capsules_per_shape is {count!r}"
    assert_refused("robot_file", case, RobotError, lambda: load_robot("zhang2022", capsules_per_shape=count))  # type: ignore[arg-type]


SQUAT = {
    "a bus": Shape("cylinder", (0.28, 0.37), np.eye(4)),
    "a plate": Shape("box", (1.0, 0.9, 0.1), np.eye(4)),
    "a brick": Shape("box", (1.0, 0.7, 0.6), np.eye(4)),
}


@pytest.mark.parametrize("name", SQUAT)
def test_more_capsules_never_stand_out_more_and_hold_all(name: str) -> None:
    shape = SQUAT[name]
    points = drum(*shape.size) if shape.kind == "cylinder" else lattice(shape.size)  # type: ignore[arg-type]
    excess = []
    for count in (1, 3, 8):
        capsules = enclosed([shape], count)
        assert len(capsules) <= count
        assert outside(points, capsules) <= ROUNDING
        excess.append(greatest_excess([shape], capsules))
    assert excess == sorted(excess, reverse=True)
    assert excess[-1] < 0.75 * excess[0]


def test_more_capsules_follow_an_angle_of_plates() -> None:
    plates = [trimesh.creation.box((1, 0.3, 0.4)), trimesh.creation.box((0.3, 1, 0.4))]
    plates[1].apply_translation((-0.35, 0.65, 0))
    shape = Shape("mesh", (), np.eye(4), np.asarray(trimesh.util.concatenate(plates).triangles))
    few, many = (enclosed([shape], count) for count in (3, 6))
    assert greatest_excess([shape], many) < 0.75 * greatest_excess([shape], few)
    for size, shift in (((1, 0.3, 0.4), 0), ((0.3, 1, 0.4), np.array((-0.35, 0.65, 0)))):
        assert outside(lattice(size) + shift, many) <= ROUNDING
