"""A link's shapes are those that its file draws, where it draws them, whatever the joints before it do."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import coal
import numpy as np
import pinocchio as pin
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from spacearm.core.errors import FileFormatError, RobotError
from spacearm.geometry import Box, Capsule, Cylinder, Polytope, Sphere, moved_shape, pose, support
from spacearm.robot import Robot, envelope_report, load_robot
from spacearm.robot.collision_shapes import found_mesh
from support import srdf_text, strategies, urdf_text
from support.forward_kinematics import joint_transforms
from support.messages import assert_refused
from support.oracles.coal_shapes import distance, placed_shape

ROUNDING = 1e-9
SNAPPED = 1e-7  # load_urdf takes a rotation within 1e-9 of a signed permutation for one
DIRECTIONS = np.random.default_rng(0).normal(size=(200, 3))
BOX = '<box size="0.5 0.4 0.05"/>'


def one_link(*shapes: str, **options: Any) -> Robot:
    text = urdf_text.robot(urdf_text.link("base"), urdf_text.link("arm", *shapes), urdf_text.joint("elbow", "base", "arm"))
    return urdf_text.loaded(text, **options)


def the_shapes(*shapes: str, **options: Any) -> list[Any]:
    return [part.shape for part in one_link(*shapes, **options).shapes]


def the_shape(shape: str, **place: str) -> Any:
    (found,) = the_shapes(urdf_text.collision(shape, **place))
    return found


# ---- Pinocchio reads the same URDF -------------------------------------------------------------------------------------------


@st.composite
def drawn_urdfs(draw: st.DrawFn) -> str:
    """A tree whose links have boxes, cylinders and spheres (Pinocchio reads no capsules)."""
    text, edge = draw(urdf_text.urdfs(max_joints=6)), st.floats(0.01, 1.0, allow_subnormal=False)
    for i in range(text.count("<link")):
        name = "tip" if f'<link name="link_{i}">' not in text else f"link_{i}"
        shapes = []
        for _ in range(draw(st.integers(0, 2))):
            a, b, c = draw(edge), draw(edge), draw(edge)
            kinds = (
                f'<box size="{a!r} {b!r} {c!r}"/>',
                f'<cylinder radius="{a!r}" length="{b!r}"/>',
                f'<sphere radius="{a!r}"/>',
            )
            xyz, rpy = draw(strategies.points()), draw(st.tuples(*[strategies.ANGLES] * 3))
            place = {"xyz": " ".join(map(repr, xyz.tolist())), "rpy": " ".join(map(repr, rpy))}
            shapes.append(urdf_text.collision(draw(st.sampled_from(kinds)), **place))
        text = text.replace(f'<link name="{name}"></link>', urdf_text.link(name, *shapes))
    return text


def reach_of(made: coal.CollisionGeometry, T: pin.SE3, n: np.ndarray) -> np.ndarray:
    """How far one of Coal's shapes reaches along directions (k, 3) [m]."""
    own = n @ T.rotation
    if isinstance(made, coal.Sphere):
        reach = made.radius * np.linalg.norm(n, axis=1)
    elif isinstance(made, coal.Box):
        reach = np.abs(own) @ made.halfSide
    else:
        assert isinstance(made, coal.Cylinder)
        reach = made.radius * np.hypot(own[:, 0], own[:, 1]) + made.halfLength * np.abs(own[:, 2])
    return n @ T.translation + reach


@settings(max_examples=40)
@given(st.data())
def test_a_links_shapes_are_where_pinocchio_has_them(data: st.DataObject) -> None:
    text = data.draw(drawn_urdfs())
    robot = urdf_text.loaded(text, tip="tip", self_collision="none")
    q = data.draw(strategies.configurations(robot))
    model = pin.buildModelFromXML(text)
    geometry = pin.GeometryModel()
    pin.buildGeomFromUrdfString(model, text, pin.GeometryType.COLLISION, geometry, "")
    there, at = model.createData(), geometry.createData()
    pin.updateGeometryPlacements(model, there, geometry, at, pinocchio_q(model, robot, q))
    theirs: dict[str, list[np.ndarray]] = {}
    for part, T in zip(geometry.geometryObjects, at.oMg, strict=True):
        link = model.frames[part.parentFrame].name
        theirs.setdefault(link, []).append(reach_of(part.geometry, T, DIRECTIONS))
    frames, ours = [*joint_transforms(robot, q), np.eye(4)], {}
    for part in robot.shapes:
        ours.setdefault(part.name, []).append(support(moved_shape(part.shape, frames[part.joint]), DIRECTIONS))
    for link, reaches in theirs.items():
        mine = ours.pop(link, [])
        if len(mine) == len(reaches):  # a ball within another is left out
            for one in reaches:
                assert min(np.abs(one - other).max() for other in mine) <= SNAPPED, link
        else:
            np.testing.assert_allclose(np.max(mine, axis=0), np.max(reaches, axis=0), atol=SNAPPED)
    assert not ours


def pinocchio_q(model: pin.Model, robot: Robot, q: np.ndarray) -> np.ndarray:
    filled = pin.neutral(model)
    for joint in robot.joints:
        value = joint.multiplier * q[joint.dof] + joint.offset
        there = model.joints[model.getJointId(joint.name)]
        filled[there.idx_q : there.idx_q + there.nq] = value if there.nq == 1 else (math.cos(value), math.sin(value))
    return filled


@pytest.mark.parametrize("axis", ["0 0 1", "0 1 0", "1 0 0", "-1 0 0", "0.3 -0.5 0.2"])
def test_shapes_are_given_in_the_joints_moving_frame_and_locking_leaves_them_there(axis: str) -> None:
    # At q = 0 and without offset, the base sees the link's shape where the URDF put it.
    text = urdf_text.robot(
        urdf_text.link("base"),
        urdf_text.link("arm", urdf_text.collision('<cylinder radius="0.1" length="2"/>', xyz="0.5 0 1")),
        urdf_text.link("hand"),
        urdf_text.joint("elbow", "base", "arm", axis=axis),
        urdf_text.joint("wrist", "arm", "hand"),
    )
    expected = support(Cylinder(0.1, 2, (0.5, 0, 1)), DIRECTIONS)
    robot = urdf_text.loaded(text)
    (part,) = robot.shapes
    np.testing.assert_allclose(support(moved_shape(part.shape, robot.joints[0].T_parent_joint), DIRECTIONS), expected)
    locked = urdf_text.loaded(text, fixed={"elbow": 0.0})
    (part,) = locked.shapes
    assert part.joint == -1
    np.testing.assert_allclose(support(part.shape, DIRECTIONS), expected)


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
    robot = urdf_text.loaded(text)
    assert [(c.name, c.joint) for c in robot.shapes] == [("base", -1), ("arm", 0), ("arm", 0), ("flange", 0)]
    assert robot.shapes[0].shape == Sphere((1, 0, 1), 1)
    assert robot.shapes[3].shape == Sphere((0, 0, 2), 1)
    assert urdf_text.loaded(text, collision="none").shapes == ()


def test_a_base_that_floats_keeps_its_shapes_when_what_is_above_it_goes() -> None:
    box = urdf_text.collision(BOX, xyz="0.1 0.2 0.3", rpy="0.1 0.2 0.3")
    text = urdf_text.robot(
        urdf_text.link("world"),
        urdf_text.link("base", box),
        urdf_text.link("arm"),
        urdf_text.joint("free", "world", "base", kind="floating", xyz="1 2 3"),
        urdf_text.joint("elbow", "base", "arm"),
    )
    (floating,), (fixed,) = (urdf_text.loaded(text, base=base).shapes for base in ("floating", "fixed"))
    own = Box((0.5, 0.4, 0.05), floating.shape.pose)
    assert floating.shape == own
    np.testing.assert_allclose(own.pose[:3, 3], (0.1, 0.2, 0.3))
    np.testing.assert_allclose(fixed.shape.pose, pose((1, 2, 3)) @ own.pose)


# ---- shape by shape ----------------------------------------------------------------------------------------------------------


def test_shapes_are_taken_as_they_are() -> None:
    place = {"xyz": "0.1 0.2 0.3", "rpy": "0 0 1.5707963267948966"}
    T = np.array([[0, -1, 0, 0.1], [1, 0, 0, 0.2], [0, 0, 1, 0.3], [0, 0, 0, 1]])
    for text, expected in {
        '<sphere radius="0.2"/>': Sphere((0, 0, 0), 0.2),
        BOX: Box((0.5, 0.4, 0.05)),
        '<cylinder radius="0.2" length="0.6"/>': Cylinder(0.2, 0.6),
        '<capsule radius="0.2" length="0.6"/>': Capsule((0, 0, -0.3), (0, 0, 0.3), 0.2),
    }.items():
        found = the_shape(text, **place)
        assert type(found) is type(expected)
        np.testing.assert_allclose(support(found, DIRECTIONS), support(moved_shape(expected, T), DIRECTIONS), atol=ROUNDING)
        assert not any("stand out" in note for note in one_link(urdf_text.collision(text, **place)).notes)


def test_a_cylinder_with_a_sphere_on_each_end_is_one_capsule() -> None:
    rpy = "0.3 0.4 0"
    rod = urdf_text.collision('<cylinder radius="0.1" length="0.5"/>', xyz="1 0 0", rpy=rpy)
    z = pin.rpy.rpyToMatrix(0.3, 0.4, 0.0)[:, 2]
    ends = [np.array([1, 0, 0]) + side * 0.25 * z for side in (-1, 1)]
    caps = [urdf_text.collision('<sphere radius="0.1"/>', xyz=" ".join(map(repr, end.tolist()))) for end in ends]
    (capsule,) = the_shapes(caps[1], rod, caps[0])
    assert isinstance(capsule, Capsule)
    np.testing.assert_allclose(
        sorted([capsule.a.tolist(), capsule.b.tolist()]), sorted(end.tolist() for end in ends), atol=1e-9
    )
    assert capsule.radius == pytest.approx(0.1, abs=1e-9)
    assert len(the_shapes(rod, caps[0])) == 2  # one end only: no


def test_a_ball_inside_another_is_left_out() -> None:
    spheres = [urdf_text.collision(f'<sphere radius="{r}"/>', xyz=f"{x} 0 0") for r, x in ((0.1, 0.05), (0.2, 0), (0.2, 0))]
    (ball,) = the_shapes(*spheres)
    assert ball.radius == 0.2
    assert len(the_shapes(spheres[1], urdf_text.collision('<sphere radius="0.1"/>', xyz="0.11 0 0"))) == 2


@pytest.mark.parametrize(
    ("text", "count"),
    [
        ('<box size="0 0 0"/>', 1),
        ('<box size="0 2 0"/>', 2),
        ('<box size="2 1 0"/>', 4),
        ('<cylinder radius="0" length="2"/>', 2),
        ('<cylinder radius="0" length="0"/>', 1),
        ('<capsule radius="0" length="2"/>', 2),
        ('<sphere radius="0"/>', 1),
    ],
)
def test_a_shape_without_extent_is_the_hull_of_what_is_left_and_that_is_told(text: str, count: int) -> None:
    found = the_shape(text)
    assert isinstance(found, Polytope)
    assert len(found.vertices) == count
    assert found.rounding == 0
    assert any("is taken as what is left of it" in note for note in one_link(urdf_text.collision(text)).notes)


def test_a_disc_is_a_plate_that_holds_it() -> None:
    disc = the_shape('<cylinder radius="0.5" length="0"/>')
    assert np.abs(disc.vertices[:, 2]).max() == 0
    n = np.random.default_rng(1).normal(size=(500, 3)) * (1, 1, 0)
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    assert (support(disc, n) >= 0.5).all()
    assert support(disc, n).max() < 0.503
    assert any(
        "'arm'" in note and "stand out" in note
        for note in one_link(urdf_text.collision('<cylinder radius="0.5" length="0"/>')).notes
    )


def test_a_capsule_without_length_is_a_ball() -> None:
    assert the_shape('<capsule radius="0.5" length="0"/>', xyz="1 2 3") == Sphere((1, 2, 3), 0.5)


def test_sizes_may_be_separated_by_commas() -> None:
    assert the_shape('<box size="1, 0.6, 0.8"/>') == the_shape('<box size="1 0.6 0.8"/>')


def test_a_servicer_of_boxes_and_cylinders_loads_as_that(tmp_path: Path) -> None:
    hand = [urdf_text.collision('<box size="0.02 0.02 0.06"/>', xyz=f"{x} 0 0.11") for x in (0.045, -0.045)]
    text = urdf_text.robot(
        urdf_text.link("bus", urdf_text.collision('<box size="1.2 1.2 1.5"/>')),
        urdf_text.link("upper", urdf_text.collision('<cylinder radius="0.055" length="0.75"/>', xyz="0 0 0.375")),
        urdf_text.link("gripper", urdf_text.collision('<cylinder radius="0.05" length="0.08"/>'), *hand),
        urdf_text.joint("shoulder", "bus", "upper", xyz="0.45 0.45 0.85", axis="0 1 0"),
        urdf_text.joint("wrist", "upper", "gripper", xyz="0 0 0.75"),
    )
    robot = urdf_text.loaded(text)
    kinds = [(part.name, type(part.shape).__name__) for part in robot.shapes]
    assert kinds == [("bus", "Box"), ("upper", "Cylinder"), ("gripper", "Cylinder"), ("gripper", "Box"), ("gripper", "Box")]
    path = tmp_path / "servicer.urdf"
    path.write_text(text)
    assert [(one.link, one.parts, one.excess, one.ratio) for one in envelope_report(path)] == [
        ("bus", 1, 0, 1),
        ("upper", 1, 0, 1),
        ("gripper", 3, 0, 1),
    ]


def test_an_srdfs_spheres_are_shapes_of_links_without_one() -> None:
    text = urdf_text.robot(urdf_text.link("base"), urdf_text.link("arm"), urdf_text.joint("elbow", "base", "arm"))
    spheres = '<link_sphere_approximation link="arm"><sphere center="1 2 3" radius="0.5"/></link_sphere_approximation>'
    robot = srdf_text.loaded(text, srdf_text.srdf(spheres))
    assert [part.shape for part in robot.shapes] == [Sphere((1, 2, 3), 0.5)]


# ---- meshes ------------------------------------------------------------------------------------------------------------------


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
def test_a_convex_mesh_is_its_hull(suffix: str, filename: str, place: str, tmp_path: Path) -> None:
    mesh = trimesh.creation.cone(radius=0.3, height=0.9)
    mesh.apply_translation((0.1, 0.2, 0.3))
    path = with_mesh(tmp_path, mesh, place, f"{filename}.{suffix}", scale="1 2 0.5", xyz="0 0 1")
    reach = (DIRECTIONS @ (mesh.vertices * (1.0, 2.0, 0.5) + np.array((0, 0, 1))).T).max(axis=1)
    for _ in range(2):  # the second comes from the cache
        robot = load_robot(path)
        (part,) = robot.shapes
        assert isinstance(part.shape, Polytope)
        assert not any("stand out" in note for note in robot.notes)
        np.testing.assert_allclose(support(part.shape, DIRECTIONS), reach, atol=1e-5)  # the files hold single precision
        assert (support(part.shape, DIRECTIONS) >= reach - 1e-6).all()


def with_mesh(
    folder: Path, mesh: trimesh.Trimesh, place: str, filename: str, *, scale: str = "1 1 1", xyz: str = "0 0 0"
) -> Path:
    """Write a URDF of a link with a mesh, and the mesh."""
    for directory in ("arm/urdf", place):
        (folder / directory).mkdir(parents=True, exist_ok=True)
    mesh.export(folder / place / Path(filename).name)
    path = folder / "arm" / "urdf" / "arm.urdf"
    shape = urdf_text.collision(f'<mesh filename="{filename}" scale="{scale}"/>', xyz=xyz)
    path.write_text(
        urdf_text.robot(urdf_text.link("base"), urdf_text.link("arm", shape), urdf_text.joint("elbow", "base", "arm"))
    )
    return path


def angle() -> trimesh.Trimesh:
    """Two rods at a right angle."""
    rods = [trimesh.creation.box((1, 0.1, 0.1)), trimesh.creation.box((0.1, 0.1, 1.0))]
    rods[1].apply_translation((0.45, 0, 0.5))
    return trimesh.util.concatenate(rods)


def depth_of(points: np.ndarray, shapes: list[Any]) -> np.ndarray:
    """How far points are outside of shapes together, by Coal [m]."""
    solids = [placed_shape(shape) for shape in shapes]
    ball = coal.Sphere(0.0)
    return np.array([min(distance((ball, coal.Transform3s(np.eye(3), p)), one) for one in solids) for p in points])


def test_a_mesh_that_is_not_convex_is_held_by_pieces_that_stand_out_as_little_as_is_told(tmp_path: Path) -> None:
    mesh = angle()
    path = with_mesh(tmp_path, mesh, "arm/urdf", "angle.stl")
    robot = load_robot(path)
    pieces = [part.shape for part in robot.shapes]
    assert 1 < len(pieces) <= 16
    assert depth_of(mesh.sample(500, seed=3), pieces).max() <= 1e-6
    (record,) = envelope_report(path)
    assert (record.shapes, record.parts) == (("mesh",), len(pieces))
    assert record.excess <= 0.02 * 1.05 + 1e-9
    corners = np.concatenate([piece.vertices for piece in pieces])
    away = -trimesh.proximity.signed_distance(mesh, corners)
    assert away.max() <= record.excess + max(piece.rounding for piece in pieces) + 1e-6
    (note,) = [note for note in robot.notes if note.startswith("convex pieces of meshes stand out")]
    assert f"'arm' {1000 * record.excess:.3g} mm" in note


@pytest.mark.parametrize("scale", ["-1 1 1", "-1 -2 -0.5", "0.001 0.002 0.001"])
def test_a_mirrored_or_scaled_mesh_is_held_where_it_is(scale: str, tmp_path: Path) -> None:
    mesh = angle()
    robot = load_robot(with_mesh(tmp_path, mesh, "arm/urdf", "angle.stl", scale=scale, xyz="0.3 0 0"))
    factors = np.array([float(word) for word in scale.split()])
    points = mesh.sample(300, seed=3) * factors + np.array((0.3, 0, 0))
    assert depth_of(points, [part.shape for part in robot.shapes]).max() <= 1e-6
    assert len(robot.shapes) > 1


def test_what_takes_long_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = with_mesh(tmp_path, angle(), "arm/urdf", "angle.stl", scale="1 1 1.01")
    said: list[str] = []
    monkeypatch.setattr("spacearm.core.long_work._QUIET", 0.0)
    load_robot(path, progress=said.append)
    assert "shapes of link 'arm': 0 of 1 of the robot are done" in said
    before = len(said)
    load_robot(path)
    assert len(said) == before


def test_the_number_of_pieces_and_their_excess_are_limited_for_all_or_by_link(tmp_path: Path) -> None:
    path = with_mesh(tmp_path, angle(), "arm/urdf", "angle.stl")

    def count(**limits: Any) -> int:
        return len(load_robot(path, **limits).shapes)

    assert count(pieces_per_mesh=1) == count(pieces_per_mesh={"arm": 1}) == count(excess=1.0) == count(excess={"arm": 1.0}) == 1
    assert count(pieces_per_mesh={"base": 1}) == count(excess={"base": 1.0}) == count() > 1
    alone = load_robot(path, pieces_per_mesh=1)
    assert any("do not keep the excess" in note and "'arm'" in note for note in alone.notes)
    (record,) = envelope_report(path, pieces_per_mesh=1)
    assert record.excess > 0.1


def test_a_mesh_that_was_changed_is_read_anew(tmp_path: Path) -> None:
    path = with_mesh(tmp_path, trimesh.creation.box((1, 1, 1)), "arm/urdf", "part.stl")
    load_robot(path)
    trimesh.creation.box((2, 1, 1)).export(path.parent / "part.stl")
    (part,) = load_robot(path).shapes
    assert support(part.shape, np.array([1.0, 0, 0])) == pytest.approx(1.0)


def test_a_flat_mesh_is_a_plate_and_that_is_told(tmp_path: Path) -> None:
    plate = trimesh.Trimesh([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], [(0, 1, 2), (0, 2, 3)])
    robot = load_robot(with_mesh(tmp_path, plate, "arm/urdf", "plate.stl"))
    (part,) = robot.shapes
    assert np.ptp(part.shape.vertices[:, 2]) + part.shape.rounding <= 1e-6
    assert any("flat" in note and "'arm'" in note for note in robot.notes)


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


# ---- spacearm's own files ----------------------------------------------------------------------------------------------------

OWN = """\
spacearm-robot: 1
name: arm
joints:
  - {name: turn, kind: revolute, parent: base, child: arm, axis: [0, 0, 1], lower: -1, upper: 1, velocity: 1}
link_radius: 0.1
capsules:
  - {link: arm, from: [0, 0, 0], to: [1, 0, 0]}
boxes:
  - {link: base, size: [1, 2, 3], xyz: [0, 0, -1.5], rounding: 0.05}
shapes:
  - {link: base, box: {size: [0.1, 0.2, 0.3], xyz: [1, 0, 0], rpy_deg: [90, 0, 0]}}
  - {link: base, cylinder: {radius: 0.4, length: 1, rpy: [0, 1.5707963267948966, 0], rounding: 0.01}}
  - {link: arm, sphere: {xyz: [1, 0, 0], radius: 0.2}}
  - {link: arm, capsule: {from: [0, 0, 0], to: [0, 0.4, 0], radius: 0.05}}
  - {link: arm, polytope: {vertices: [[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0], [0, 0, 0.1]], xyz: [0, 0, 1], rounding: 0.02}}
"""


def own_file(folder: Path, text: str = OWN) -> Path:
    path = folder / "arm.yaml"
    path.write_text(text)
    return path


def test_robot_files_have_shapes_of_every_kind(tmp_path: Path) -> None:
    path = own_file(tmp_path)
    robot = load_robot(path)
    expected = [
        ("arm", Capsule((0, 0, 0), (1, 0, 0), 0.1)),
        ("base", Box((1, 2, 3), (0, 0, -1.5), rounding=0.05)),
        ("base", Box((0.1, 0.2, 0.3), pose((1, 0, 0), (0.5**0.5, 0.5**0.5, 0, 0)))),
        ("base", Cylinder(0.4, 1, pose((0, 0, 0), (0.5**0.5, 0, 0.5**0.5, 0)), rounding=0.01)),
        ("arm", Sphere((1, 0, 0), 0.2)),
        ("arm", Capsule((0, 0, 0), (0, 0.4, 0), 0.05)),
        ("arm", Polytope([(0, 0, 1), (0.1, 0, 1), (0, 0.1, 1), (0, 0, 1.1)], rounding=0.02)),
    ]
    assert [part.name for part in robot.shapes] == [name for name, _ in expected]
    assert [part.joint for part in robot.shapes] == [-1 if name == "base" else 0 for name, _ in expected]
    for part, (_, shape) in zip(robot.shapes, expected, strict=True):
        assert type(part.shape) is type(shape)
        np.testing.assert_allclose(support(part.shape, DIRECTIONS), support(shape, DIRECTIONS), atol=ROUNDING)
    assert [(one.link, one.parts, one.excess) for one in envelope_report(path)] == [("arm", 4, 0), ("base", 3, 0)]


WRONG = {
    "shape of no kind": "{link: base}",
    "shape of two kinds": "{link: base, sphere: {radius: 1}, box: {size: [1, 1, 1]}}",
    "shape of an unknown kind": "{link: base, cone: {radius: 1}}",
    "shape of an unknown link": "{link: bse, sphere: {radius: 1}}",
    "sphere without radius": "{link: base, sphere: {xyz: [0, 0, 0]}}",
    "sphere of radius 0": "{link: base, sphere: {radius: 0}}",
    "cylinder of length 0": "{link: base, cylinder: {radius: 1, length: 0}}",
    "box with two edges": "{link: base, box: {size: [1, 1]}}",
    "negative rounding": "{link: base, box: {size: [1, 1, 1], rounding: -1}}",
    "polytope of numbers": "{link: base, polytope: {vertices: [1, 2, 3]}}",
    "polytope without vertices": "{link: base, polytope: {vertices: []}}",
    "polytope of pairs": "{link: base, polytope: {vertices: [[1, 2]]}}",
}


OF_THE_FORMAT = ("shape of an unknown kind", "sphere without radius", "polytope of numbers")


@pytest.mark.parametrize("case", WRONG)
def test_shapes_of_robot_files_that_cannot_be_are_refused(case: str, tmp_path: Path) -> None:
    path = own_file(tmp_path, OWN + f"  - {WRONG[case]}\n")
    error = FileFormatError if case in OF_THE_FORMAT else RobotError
    assert_refused("robot_file", case, error, lambda: load_robot(path), path=path)


# ---- limits ------------------------------------------------------------------------------------------------------------------

LIMITS: dict[str, dict[str, Any]] = {
    "pieces 0": {"pieces_per_mesh": 0},
    "pieces of text": {"pieces_per_mesh": "many"},
    "pieces of an unknown link": {"pieces_per_mesh": {"am": 3}},
    "pieces 0 of a link": {"pieces_per_mesh": {"arm": 0}},
    "excess 0": {"excess": 0},
    "excess of an unknown link": {"excess": {"am": 0.1}},
    "excess of text": {"excess": {"arm": "little"}},
    "no capsules": {"capsules_per_shape": 0},
    "more capsules than may be": {"capsules_per_shape": 10**12},
    "capsules of text": {"capsules_per_shape": "3"},
}


@pytest.mark.parametrize("case", LIMITS)
def test_limits_that_are_none_are_refused(case: str, tmp_path: Path) -> None:
    path = tmp_path / "arm.urdf"
    path.write_text(
        urdf_text.robot(
            urdf_text.link("base"), urdf_text.link("arm", urdf_text.collision(BOX)), urdf_text.joint("elbow", "base", "arm")
        )
    )
    assert_refused("robot_file", case, RobotError, lambda: load_robot(path, **LIMITS[case]), path=path)
