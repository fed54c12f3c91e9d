"""MoveIt's files: what they say in each of the ways they are written, and the sentence for each that is no good."""

from __future__ import annotations

import json
import math
import os
import random
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from spacearm import load_moveit, load_moveit_scene
from spacearm.core.errors import FileFormatError, ProblemError, RobotError, SceneError, SpacearmError
from spacearm.geometry import Box, Cylinder, HalfSpace, PolytopeSet, Scene, Sphere, pose
from spacearm.planner import ConfigurationGoal, ConfigurationsGoal, PoseGoal, PositionGoal, clearance
from spacearm.robot import Robot, load_robot
from support import urdf_text
from support.messages import assert_refused
from support.oracles.solids import point_distance

POINT, TURN = [0.5, -0.1, 0.3], [0.0, 0.6, 0.0, 0.8]  # a quaternion of length 1 in decimals, x y z w
AT = {"position": POINT, "orientation": TURN}
T_AT = np.eye(4)
T_AT[:3, :3], T_AT[:3, 3] = Rotation.from_quat(TURN).as_matrix(), POINT

CORNERS = [[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.0, 0.0, 0.1]]
FACES = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]


def robot() -> Robot:
    ball = urdf_text.collision('<sphere radius="0.05"/>', xyz="0 0 0.15")
    joints = [
        urdf_text.joint("shoulder", "base", "upper", xyz="0 0 0.3"),
        urdf_text.joint("elbow", "upper", "fore", xyz="0.3 0 0"),
        urdf_text.joint("wrist", "fore", "hand", kind="continuous", limit='velocity="1" effort="1"', xyz="0.3 0 0"),
    ]
    links = [urdf_text.link(name, ball) for name in ("base", "upper", "fore", "hand")]
    return urdf_text.loaded(urdf_text.robot(*links, *joints), acceleration_limit=1.0)


ARM = robot()


def scene_with(*objects: dict[str, Any], **more: Any) -> dict[str, Any]:
    return {"name": "", "world": {"collision_objects": list(objects)}, **more}


def item(kind: Any = "box", size: Any = (0.1, 0.2, 0.3), at: Any = AT, **more: Any) -> dict[str, Any]:
    size = list(size) if isinstance(size, tuple) else size
    return {"id": "it", "primitives": [{"type": kind, "dimensions": size}], "primitive_poses": [at], **more}


def joints(*values: float, **more: float) -> dict[str, Any]:
    names = ("wrist", "elbow", "shoulder")  # not the robot's order
    return {"joint_constraints": [{"position": v, **more, "joint_name": n} for n, v in zip(names, values, strict=True)]}


def region(kind: str = "sphere", size: tuple[float, ...] = (0.02,), link: str = "hand", **more: Any) -> dict[str, Any]:
    solid = {"primitives": [{"type": kind, "dimensions": list(size)}], "primitive_poses": [AT]}
    return {"link_name": link, "constraint_region": solid, "weight": 1, **more}


def turned(x: float = 0.01, y: float = 0.02, z: float = 0.03, link: str = "hand") -> dict[str, Any]:
    named = dict(zip((f"absolute_{a}_axis_tolerance" for a in "xyz"), (x, y, z), strict=True))
    return {"link_name": link, "orientation": TURN, **named}


def state(names: Any = ("gripper", "wrist", "shoulder", "elbow"), positions: Any = (9, 0.3, 0.1, -0.2)) -> dict[str, Any]:
    return {"joint_state": {"position": list(positions), "name": list(names)}}


def attaching(thing: dict[str, Any], link_name: str = "hand", **more: Any) -> dict[str, Any]:
    return {**state(), "attached_collision_objects": [{"link_name": link_name, "object": thing, **more}]}


def request_with(*goals: dict[str, Any], **more: Any) -> dict[str, Any]:
    return {"start_state": state(), "goal_constraints": list(goals or [joints(0.6, 0.5, 0.4)]), "group_name": "arm", **more}


def written(directory: Path, content: Any, name: str) -> Path:
    """JSON is YAML; each key on a line of its own, so that lines mean something."""
    path = directory / name
    path.write_text(content if isinstance(content, str) else json.dumps(content, indent=1))
    return path


@pytest.fixture
def load(tmp_path: Path) -> Callable[..., Any]:
    def load(scene: Any = None, request: Any = None, **options: Any) -> Any:
        first = written(tmp_path, scene_with() if scene is None else scene, "scene.yaml")
        second = written(tmp_path, request_with() if request is None else request, "request.yaml")
        return load_moveit(ARM, first, second, **options)

    return load


@pytest.fixture
def obstacles(tmp_path: Path) -> Callable[[Any], tuple[Any, ...]]:
    return lambda scene: load_moveit_scene(written(tmp_path, scene, "scene.yaml"), mesh_excess=0.02).obstacles


def test_start_and_goal_are_taken_by_name(load: Callable[..., Any]) -> None:
    problem = load()
    assert problem.start.tolist() == [0.1, -0.2, 0.3]
    assert problem.goal == ConfigurationGoal([0.4, 0.5, 0.6], shortest=True)
    assert problem.robot is ARM
    assert problem.scene == Scene()


def test_the_files_state_no_clearance_so_the_caller_does(load: Callable[..., Any]) -> None:
    assert (load().clearance, load(clearance=0.0).clearance) == (0.01, 0.0)
    with pytest.raises(ProblemError, match="clearance is -1"):
        load(clearance=-1.0)


def test_ros_ends_a_message_with_dashes(load: Callable[..., Any]) -> None:
    assert load(json.dumps(scene_with(item())) + "\n---\n", json.dumps(request_with()) + "\n---\n") == load(scene_with(item()))


def test_each_primitive_is_its_shape(obstacles: Callable[[Any], Any]) -> None:
    box, ball, tin, cone = obstacles(
        scene_with(
            item("box", (0.1, 0.2, 0.3), id="a"),
            item("sphere", (0.1,), id="b"),
            item("cylinder", (0.4, 0.1), id="c"),
            item("cone", (0.4, 0.1), id="d"),
        )
    )
    assert (type(box), type(ball), type(tin), type(cone)) == (Box, Sphere, Cylinder, Cylinder)
    assert [shape.name for shape in (box, ball, tin, cone)] == ["a", "b", "c", "d"]
    np.testing.assert_allclose(box.pose, T_AT, atol=1e-15)
    assert box.size.tolist() == [0.1, 0.2, 0.3]
    assert (ball.center.tolist(), ball.radius) == (POINT, 0.1)
    assert (tin.length, tin.radius) == (0.4, 0.1)
    assert (cone.length, cone.radius) == (0.4, 0.1)
    np.testing.assert_allclose(tin.pose, T_AT, atol=1e-15)


def test_a_cone_is_within_its_cylinder(obstacles: Callable[[Any], Any]) -> None:
    (tin,) = obstacles(scene_with(item("cone", (0.4, 0.1))))
    rng = np.random.default_rng(0)
    z, angle, share = rng.uniform(-0.2, 0.2, 500), rng.uniform(0, math.tau, 500), np.sqrt(rng.random(500))
    r = 0.1 * (0.2 - z) / 0.4 * share  # the base is at -h/2, the tip at h/2
    points = np.stack([r * np.cos(angle), r * np.sin(angle), z], axis=1) @ T_AT[:3, :3].T + T_AT[:3, 3]
    assert point_distance(tin, points).max() <= 1e-12


def test_ros_and_robowflex_write_the_same(obstacles: Callable[[Any], Any]) -> None:
    by_letters = {
        "position": dict(zip("xyz", POINT, strict=True)),
        "orientation": dict(zip("xyzw", TURN, strict=True)),
    }
    for number, kind, size in (
        (1, "box", (0.1, 0.2, 0.3)),
        (2, "sphere", (0.1,)),
        (3, "cylinder", (0.4, 0.1)),
        (4, "cone", (1.0, 2.0)),
    ):
        assert obstacles(scene_with(item(number, size, by_letters))) == obstacles(scene_with(item(kind, size, AT)))
        assert obstacles(scene_with(item(kind.upper(), size))) == obstacles(scene_with(item(kind, size)))


def test_quaternions_are_taken_at_any_length(obstacles: Callable[[Any], Any]) -> None:
    longer = {"position": POINT, "orientation": [1.001 * value for value in TURN]}
    np.testing.assert_allclose(obstacles(scene_with(item(at=longer)))[0].pose, T_AT, atol=1e-12)


def test_an_objects_own_pose_comes_first(obstacles: Callable[[Any], Any]) -> None:
    own = {"position": [1.0, 2.0, 3.0], "orientation": [0.0, 0.0, 1.0, 0.0]}
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = Rotation.from_quat([0, 0, 1, 0]).as_matrix(), [1, 2, 3]
    np.testing.assert_allclose(obstacles(scene_with(item(pose=own)))[0].pose, T @ T_AT, atol=1e-15)
    alone = {"id": "x", "pose": own, "primitives": [{"type": "box", "dimensions": [1, 1, 1]}]}
    np.testing.assert_allclose(obstacles(scene_with(alone))[0].pose, T, atol=1e-15)
    never_set = {"position": [0, 0, 0], "orientation": [0, 0, 0, 0]}
    np.testing.assert_allclose(obstacles(scene_with(item(pose=never_set)))[0].pose, T_AT, atol=1e-15)


def test_an_object_of_several_shapes_numbers_them(obstacles: Callable[[Any], Any]) -> None:
    two = [{"type": "box", "dimensions": [1, 1, 1]}, {"type": "sphere", "dimensions": [1]}]
    shelf = {
        "id": "shelf",
        "primitives": two,
        "primitive_poses": [AT, AT],
        "planes": [{"coef": [0, 0, 1, 0]}],
        "plane_poses": [AT],
    }
    assert [shape.name for shape in obstacles(scene_with(shelf))] == ["shelf 1", "shelf 2", "shelf 3"]


@given(
    coefficients=st.lists(st.floats(-2, 2), min_size=4, max_size=4).filter(lambda c: np.linalg.norm(c[:3]) > 0.1),
    at=st.lists(st.floats(-1, 1), min_size=3, max_size=3),
    point=st.lists(st.floats(-3, 3), min_size=3, max_size=3),
)
def test_a_plane_is_solid_on_the_side_away_from_the_base(
    tmp_path_factory: pytest.TempPathFactory, coefficients: list[float], at: list[float], point: list[float]
) -> None:
    wall = {"id": "w", "planes": [{"coef": coefficients}], "plane_poses": [{"position": at, "orientation": TURN}]}
    path = written(tmp_path_factory.getbasetemp(), scene_with(wall), "plane.yaml")
    (half,) = load_moveit_scene(path).obstacles
    assert isinstance(half, HalfSpace)
    local = Rotation.from_quat(TURN).inv().apply(np.array(point) - at)
    base = Rotation.from_quat(TURN).inv().apply(-np.array(at))
    above, base_above = (
        (np.dot(coefficients[:3], p) + coefficients[3]) / np.linalg.norm(coefficients[:3]) for p in (local, base)
    )
    side = -1 if base_above < -1e-9 else 1
    assert point_distance(half, np.array([point]))[0] == pytest.approx(side * above, abs=1e-9)


@pytest.mark.parametrize("up", [1, -1])
@pytest.mark.parametrize("height", [2.0, -0.5, 0.0])
def test_ceiling_and_floor_leave_the_robot_free_whichever_way_they_face(
    up: int, height: float, obstacles: Callable[[Any], Any]
) -> None:
    (half,) = obstacles(
        scene_with({"id": "w", "planes": [{"coef": [0, 0, up, -up * height]}], "plane_poses": [{"position": [0, 0, 0]}]})
    )
    free = -1 if height > 0 else 1 if height < 0 else up  # a base on the plane goes by its normal
    np.testing.assert_allclose(half.normal, [0, 0, free], atol=1e-15)
    np.testing.assert_allclose(half.point, [0, 0, height], atol=1e-15)


@pytest.mark.parametrize("as_ros", [False, True])
def test_a_mesh_is_enclosed(as_ros: bool, obstacles: Callable[[Any], Any]) -> None:
    vertices: Any = [dict(zip("xyz", row, strict=True)) for row in CORNERS] if as_ros else CORNERS
    triangles: Any = [{"vertex_indices": row} for row in FACES] if as_ros else FACES
    rock = {"id": "rock", "meshes": [{"vertices": vertices, "triangles": triangles}], "mesh_poses": [AT]}
    (held,) = obstacles(scene_with(rock))
    assert isinstance(held, PolytopeSet)
    assert held.name == "rock"
    weights = np.random.default_rng(0).dirichlet(np.ones(4), size=500)
    points = weights @ np.array(CORNERS) @ T_AT[:3, :3].T + T_AT[:3, 3]
    (piece,) = held.pieces
    planes = ConvexHull(piece.vertices).equations
    assert (points @ planes[:, :3].T + planes[:, 3]).max() <= 1e-9


def test_a_meshs_excess_is_the_users(tmp_path: Path) -> None:
    ring = trimesh.creation.annulus(0.3, 0.6, 0.3, sections=8)
    mesh = {"vertices": ring.vertices.tolist(), "triangles": ring.faces.tolist()}
    path = written(tmp_path, scene_with({"id": "ring", "meshes": [mesh], "mesh_poses": [AT]}), "scene.yaml")
    fine, coarse = (load_moveit_scene(path, mesh_excess=excess).obstacles[0] for excess in (0.06, 0.4))
    assert isinstance(fine, PolytopeSet)
    assert isinstance(coarse, PolytopeSet)
    assert len(coarse.pieces) == 1
    assert len(fine.pieces) > 1
    assert fine.excess is not None
    assert fine.excess <= 0.06


def test_headers_name_frames(load: Callable[..., Any]) -> None:
    # MoveIt has the frame that is named in the header, and the planning frame as the child (Transforms::copyTransforms).
    tray = {
        "header": {"frame_id": "tray"},
        "child_frame_id": "world",
        "transform": {"translation": [1, 0, 0], "rotation": [0, 0, 0, 1]},
    }
    for frame, expected in (
        ("", POINT),
        ("world", POINT),
        ("/world", POINT),
        ("base", POINT),
        ("tray", np.add(POINT, [1, 0, 0])),
    ):
        scene = scene_with(item(header={"frame_id": frame}), fixed_frame_transforms=[tray])
        np.testing.assert_allclose(load(scene).scene.obstacles[0].pose[:3, 3], expected, atol=1e-15)


def test_tolerances_are_the_smaller_ones(load: Callable[..., Any]) -> None:
    assert load(request=request_with(joints(0, 0, 0, tolerance_above=0.1, tolerance_below=0.2))).goal.tolerance == 0.1
    goal = joints(0, 0, 0)
    goal["joint_constraints"][0] |= {"tolerance_below": 0.3, "tolerance_above": 0.4}  # of the wrist, the robot's last
    assert load(request=request_with(goal)).goal.tolerance.tolist() == [0, 0, 0.3]
    one_sided = load(request=request_with(joints(0, 0, 0, tolerance_above=0.1)))  # what a message leaves out is 0
    assert one_sided.goal.tolerance == 0.0
    assert any("0.1 above, 0 below" in note for note in one_sided.notes)


def test_alternatives_are_goal_configurations(load: Callable[..., Any]) -> None:
    first = joints(0.6, 0.5, 0.4, tolerance_above=0.1, tolerance_below=0.1)
    second = joints(-0.6, -0.5, -0.4, tolerance_above=0.05, tolerance_below=0.05)
    goal = load(request=request_with(first, second)).goal
    assert goal == ConfigurationsGoal([[0.4, 0.5, 0.6], [-0.4, -0.5, -0.6]], tolerance=0.05, shortest=True)


def test_a_joint_without_limits_takes_the_short_way(load: Callable[..., Any]) -> None:
    assert load(request=request_with(joints(0.3 + math.tau, 0, 0))).goal.q[2] == pytest.approx(0.3)


def test_goals_in_space(load: Callable[..., Any]) -> None:
    goal = load(request=request_with({"position_constraints": [region()]})).goal
    assert goal == PositionGoal(POINT, tolerance=0.02, frame="hand")
    whole = {"position_constraints": [region("box", (0.1, 0.06, 0.2))], "orientation_constraints": [turned()]}
    goal = load(request=request_with(whole)).goal
    assert isinstance(goal, PoseGoal)
    np.testing.assert_allclose(goal.pose, T_AT, atol=1e-15)
    assert (goal.position_tolerance, goal.orientation_tolerance, goal.frame) == (0.03, 0.01, "hand")
    assert goal.free_axis is None
    whole["orientation_constraints"] = [turned(z=7)]
    goal = load(request=request_with(whole)).goal
    assert goal.orientation_tolerance == 0.01
    assert goal.free_axis.tolist() == [0, 0, 1]
    whole["orientation_constraints"] = [turned(4, 4, 4)]
    assert load(request=request_with(whole)).goal == PositionGoal(POINT, tolerance=0.03, frame="hand")


@pytest.mark.parametrize(
    ("size", "kind"), [((0.1, 0.06, 0.2), "box"), ((0.3, 0.1), "cylinder"), ((0.1, 0.3), "cylinder"), ((0.1,), "sphere")]
)
def test_a_goals_ball_is_within_its_region(size: tuple[float, ...], kind: str, load: Callable[..., Any]) -> None:
    goal = load(request=request_with({"position_constraints": [region(kind, size)]})).goal
    shapes: dict[str, Any] = {
        "box": lambda: Box(size, T_AT),
        "cylinder": lambda: Cylinder(size[1], size[0], T_AT),
        "sphere": lambda: Sphere(POINT, size[0]),
    }
    assert point_distance(shapes[kind](), goal.position[None])[0] == pytest.approx(-goal.tolerance)


def test_a_request_without_a_start_begins_in_the_scenes_state(load: Callable[..., Any]) -> None:
    empty = {"joint_state": {"name": [], "position": []}}
    for start in (None, {}, empty):
        scene = scene_with(robot_state=state(("wrist", "elbow", "shoulder"), (0.3, 0.2, 0.1)))
        assert load(scene, request_with(start_state=start)).start.tolist() == [0.1, 0.2, 0.3]


def test_the_matrix_says_which_links_must_keep_clear(load: Callable[..., Any]) -> None:
    names = ["base", "cup", "fore", "upper"]
    values = [[a != b and {a, b} != {"base", "fore"} for b in names] for a in names]
    for rows in (values, [{"enabled": row} for row in values]):
        problem = load(scene_with(allowed_collision_matrix={"entry_names": names, "entry_values": rows}), acm=True)
        # The hand has no entry: it may touch nothing.
        assert problem.robot.self_pairs == (("base", "fore"), ("base", "hand"), ("fore", "hand"), ("hand", "upper"))
    defaults = {"default_entry_names": ["hand"], "default_entry_values": [True]}
    problem = load(scene_with(allowed_collision_matrix={"entry_names": names, "entry_values": values, **defaults}), acm=True)
    assert problem.robot.self_pairs == (("base", "fore"),)
    assert load(scene_with(allowed_collision_matrix={"entry_names": names, "entry_values": values})).robot is ARM


# MoveIt's own text.

NEWER = """\
(noname)+
* shelf one
0.5 -0.1 0.3
0 0.6 0 0.8
2
box
0.1 0.2 0.3
1 0 0
0 0 0 1
0 0 0 0
cylinder
0.1 0.4
0 0 0
0 0 0 1
0.5 0.5 0.5 1
1
handle 0 0 1
0 0 0 1
* ball
0 0 0
0 0 0 1
1
sphere
0.25
0.5 -0.1 0.3
0 0.6 0 0.8
0 0 0 0
0
* rock
0 0 0
0 0 0 1
2
mesh
4 4
0 0 0
0.1 0 0
0 0.1 0
0 0 0.1
0 2 1
0 1 3
1 2 3
0 3 2
0 0 1
0 0 0 1
0 0 0 0
plane
0 0 2 1
0 0 0
0 0 0 1
0 0 0 0
0
.
"""

OLDER = """\

* tin
2
cone
0.1 0.4
0.5 -0.1 0.3
0 0.6 0 0.8
0 0 0 0
cylinder
0.1 0.4
0.5 -0.1 0.3
0 0.6 0 0.8
0 0 0 0
* nothing
0
.
"""


def test_newer_scene_text(obstacles: Callable[[Any], Any]) -> None:
    box, tin, ball, rock, floor = obstacles(NEWER)
    assert [shape.name for shape in (box, tin, ball, rock, floor)] == ["shelf one 1", "shelf one 2", "ball", "rock 1", "rock 2"]
    np.testing.assert_allclose(box.pose, T_AT @ pose((1, 0, 0)), atol=1e-15)
    np.testing.assert_allclose(tin.pose, T_AT, atol=1e-15)
    assert (tin.radius, tin.length) == (0.1, 0.4)  # the radius comes first here
    assert (ball.center.tolist(), ball.radius) == (POINT, 0.25)
    assert isinstance(rock, PolytopeSet)
    np.testing.assert_allclose(rock.pieces[0].vertices.min(), 0, atol=0.1)
    assert (floor.normal.tolist(), floor.point.tolist()) == ([0, 0, 1], [0, 0, -0.5])


def test_older_scene_text(obstacles: Callable[[Any], Any]) -> None:
    cone, tin = obstacles(OLDER)
    np.testing.assert_allclose(tin.pose, T_AT, atol=1e-15)
    assert (cone.radius, cone.length, tin.name) == (0.1, 0.4, "tin 2")


def test_scene_text_cares_for_no_line_ends(obstacles: Callable[[Any], Any]) -> None:
    name, _, rest = OLDER.replace("* nothing\n0\n", "").partition("* tin\n")
    assert obstacles(f"{name}* tin\n2\n{'  '.join(rest.split()[1:])}\n") == obstacles(OLDER)
    assert obstacles(NEWER.replace("\n", "\r\n")) == obstacles(NEWER)
    assert obstacles(NEWER.replace("0 0 0 0\n0\n.", "0 0 0 0\n.")) == obstacles(NEWER)  # no number of subframes
    assert obstacles("(noname)+\n.\n") == ()


def test_text_and_yaml_say_the_same(tmp_path: Path, load: Callable[..., Any]) -> None:
    yaml = scene_with(item("cylinder", (0.4, 0.1), id="tin"))
    text = "s\n* tin\n1\ncylinder\n0.1 0.4\n0.5 -0.1 0.3\n0 0.6 0 0.8\n0 0 0 0\n.\n"
    assert load(yaml) == load(text)
    assert load_moveit_scene(written(tmp_path, yaml, "yaml.scene")) == load_moveit_scene(written(tmp_path, text, "text.yaml"))


# What is refused, each with its sentence.


def without(values: dict[str, Any], key: str) -> dict[str, Any]:
    return {name: value for name, value in values.items() if name != key}


FLIPPED = {"translation": [0, 0, 0.5], "rotation": [0, 0, 0, 1]}
LINE = {"id": "it", "primitive_poses": [AT], "primitives": [{"type": "box"}]}

SCENES: dict[str, Any] = {
    "a request": request_with(),
    "no world": {"name": "x"},
    "a list": [1, 2],
    "no YAML": "a: [",
    "too deep": "world: " + "[" * 50_000,
    "octomap": {"world": {"collision_objects": [], "octomap": {"octomap": {"id": "OcTree", "data": [1, 2]}}}},
    "mistyped objects": {"world": {"colision_objects": []}},
    "objects no list": {"world": {"collision_objects": 3}},
    "mistyped key": scene_with({"id": "it", "primitves": []}),
    "no shape": scene_with({"id": "it"}),
    "twice": scene_with(item(), item()),
    "no pose": scene_with(without(item(), "primitive_poses")),
    "poses missing": scene_with({**item(), "primitive_poses": [AT, AT]}),
    "no dimensions": scene_with(LINE),
    "two dimensions": scene_with(item("box", (0.1, 0.2))),
    "dimensions words": scene_with(item("box", ["a", "b", "c"])),
    "dimensions a number": scene_with(item("box", 0.1)),
    "flat box": scene_with(item("box", (0.1, 0.2, 0.0))),
    "endless box": json.dumps(scene_with(item("box", (0.1, 0.2, 77)))).replace("77", ".inf"),
    "no number": json.dumps(scene_with(item("box", (0.1, 0.2, 77)))).replace("77", ".nan"),
    "negative radius": scene_with(item("sphere", (-1.0,))),
    "unknown type": scene_with(item("bx")),
    "prism": scene_with(item(5)),
    "type true": scene_with(item(True)),
    "short quaternion": scene_with(item(at={"position": POINT, "orientation": [0, 0, 1]})),
    "letters missing": scene_with(item(at={"position": {"x": 0, "y": 0}, "orientation": TURN})),
    "no position": scene_with(item(at={"orientation": TURN})),
    "frame unknown": scene_with(item(header={"frame_id": "table"})),
    "frame the wrong way round": scene_with(
        item(header={"frame_id": "tray"}),
        fixed_frame_transforms=[
            {"header": {"frame_id": "base"}, "child_frame_id": "base", "transform": {}},
            {"header": {"frame_id": "tray"}, "child_frame_id": "map", "transform": {}},
        ],
    ),
    "mesh file": scene_with({"id": "it", "meshes": [{"resource": "package://x/y.stl"}], "mesh_poses": [AT]}),
    "mesh vertex": scene_with({"id": "it", "meshes": [{"vertices": CORNERS, "triangles": [[0, 1, 4]]}], "mesh_poses": [AT]}),
    "mesh half": scene_with({"id": "it", "meshes": [{"vertices": CORNERS, "triangles": [[0, 1, 2.5]]}], "mesh_poses": [AT]}),
    "mesh empty": scene_with({"id": "it", "meshes": [{"vertices": [], "triangles": []}], "mesh_poses": [AT]}),
    "plane": scene_with({"id": "it", "planes": [{"coef": [0, 0, 0, 1]}], "plane_poses": [AT]}),
    "two bases moved": scene_with(robot_state={"multi_dof_joint_state": {"transforms": [FLIPPED, FLIPPED]}}),
    "attached without object": scene_with(robot_state={"attached_collision_objects": [{"link_name": "hand"}]}),
    "attached without shape": scene_with(robot_state=attaching({"id": "cup"})),
    "attached to no link": scene_with(robot_state=attaching(item(id="cup"), link_name="hnd")),
    "attached plane": scene_with(robot_state=attaching({"id": "cup", "planes": [{"coef": [0, 0, 1, 0]}], "plane_poses": [AT]})),
    "attached under a link's name": scene_with(robot_state=attaching(item(id="fore"))),
    "padding": scene_with(link_padding=[{"link_name": "hand", "padding": 0.02}]),
    "scale": scene_with(link_scale=[{"link_name": "hand", "scale": 1.1}]),
    "mistyped world": {"wordl": {}, **scene_with()},
    "subframes": scene_with(item(subframe_names=["tip"])),
    "operation": scene_with(item(operation=4)),
    "moved and not there": scene_with(item(operation=3)),
}

TEXTS = {
    "no asterisk": "* shelf\n1\nbox\n",
    "cut off": NEWER[: NEWER.index("0.25")],
    "no dot": NEWER.replace("\n.\n", "\n"),
    "no shape of that name": NEWER.replace("cylinder", "cylindre"),
    "too few numbers": NEWER.replace("0.1 0.2 0.3\n", "0.1 0.2\n"),
    "word": NEWER.replace("0.25", "big"),
    "nan": NEWER.replace("0.25", "nan"),
    "too large": NEWER.replace("0.25", "1e999"),
    "negative radius": NEWER.replace("0.25", "-1"),
    "number of shapes": NEWER.replace("0 0 0 1\n1\nsphere", "0 0 0 1\nsphere"),
    "zero quaternion": NEWER.replace("0 0.6 0 0.8", "0 0 0 0"),
    "twice": NEWER.replace("* ball", "* rock"),
    "vertex": NEWER.replace("0 2 1\n", "0 2 4\n"),
}

REQUESTS: dict[str, Any] = {
    "a scene": scene_with(),
    "scene text": NEWER,
    "no goal": {"start_state": state()},
    "goals empty": {**request_with(), "goal_constraints": []},
    "no start": without(request_with(), "start_state"),
    "joint missing": request_with(start_state=state(("wrist", "elbow", "sholder"), (0, 0, 0))),
    "joint twice": request_with(start_state=state(("wrist", "elbow", "wrist"), (0, 0, 0))),
    "positions missing": request_with(start_state=state(("wrist", "elbow", "shoulder"), (0, 0))),
    "start beyond limit": request_with(start_state=state(("wrist", "elbow", "shoulder"), (0, 9, 0))),
    "start no number": json.dumps(request_with(start_state=state(positions=(0, 77, 0, 0)))).replace("77", ".nan"),
    "start a word": request_with(start_state=state(positions=(0, "0.1", 0, 0))),
    "goal joint missing": request_with({"joint_constraints": joints(0, 0, 0)["joint_constraints"][:2]}),
    "goal joint twice": request_with({"joint_constraints": joints(0, 0, 0)["joint_constraints"] * 2}),
    "goal beyond limit": request_with(joints(0, 0, 9)),
    "second goal beyond limit": request_with(joints(0, 0, 0), joints(0, 0, 9)),
    "goal tolerance": request_with(joints(0, 0, 0, tolerance_above=-0.1)),
    "goal key": request_with(joints(0, 0, 0, tolerence_above=0.1)),
    "goal true": request_with(joints(True, 0, 0)),
    "goal empty": request_with({"name": "x"}),
    "goal both": request_with({**joints(0, 0, 0), "position_constraints": [region()]}),
    "goal seen": request_with({"visibility_constraints": [{}]}),
    "goals mixed": request_with(joints(0, 0, 0), {"position_constraints": [region()]}),
    "goal orientation only": request_with({"orientation_constraints": [turned()]}),
    "goal other link": request_with({"position_constraints": [region()], "orientation_constraints": [turned(link="fore")]}),
    "goal unknown link": request_with({"position_constraints": [region(link="hnd")]}),
    "goal two free axes": request_with({"position_constraints": [region()], "orientation_constraints": [turned(9, 9, 1)]}),
    "goal exact": request_with({"position_constraints": [region()], "orientation_constraints": [turned(0, 0, 0)]}),
    "goal in a frame that moves": request_with({"position_constraints": [region(header={"frame_id": "fore"})]}),
    "goal in an unknown frame": request_with({"position_constraints": [region(header={"frame_id": "tabel"})]}),
    "goal turned by no quaternion": request_with(
        {"position_constraints": [region()], "orientation_constraints": [{**turned(), "orientation": [0, 0, 0.5, 0.5]}]}
    ),
    "goal of a strange joint": request_with(
        {"joint_constraints": [*joints(0, 0, 0)["joint_constraints"], {"joint_name": "gripper", "position": 0}]}
    ),
    "trajectory constraints": request_with(trajectory_constraints={"constraints": [{"orientation_constraints": [turned()]}]}),
    "cartesian speed": request_with(max_cartesian_speed=0.2, cartesian_speed_limited_link="hand"),
    "mistyped constraints": request_with(path_constraint={"orientation_constraints": [turned()]}),
    "speed a word": request_with(max_velocity_scaling_factor="fast"),
    "goal cone": request_with({"position_constraints": [region("cone", (0.1, 0.1))]}),
    "goal no region": request_with({"position_constraints": [region(constraint_region={"primitives": []})]}),
    "path constraints": request_with(path_constraints={"orientation_constraints": [turned()]}),
}

MATRICES: dict[str, Any] = {
    "no matrix": scene_with(),
    "matrix rows": scene_with(allowed_collision_matrix={"entry_names": ["a", "b"], "entry_values": [[True, True]]}),
    "matrix row short": scene_with(allowed_collision_matrix={"entry_names": ["a"], "entry_values": [[]]}),
    "matrix of text": NEWER,
}


@pytest.mark.parametrize("case", [*SCENES, *(f"text {case}" for case in TEXTS)])
def test_a_scene_that_is_none_is_refused(case: str, tmp_path: Path) -> None:
    content = TEXTS[case.removeprefix("text ")] if case.startswith("text ") else SCENES[case]
    path = written(tmp_path, content, "scene.yaml")
    request = written(tmp_path, request_with(), "request.yaml")
    error = SceneError if case in ("flat box", "endless box", "negative radius", "plane", "mesh vertex", "mesh empty") else None
    error = SceneError if case in ("text negative radius", "text vertex") else error
    error = RobotError if case in ("attached plane", "attached under a link's name") else error
    error = FileFormatError if case == "endless box" or error is None else error
    assert_refused("moveit", f"scene: {case}", error, lambda: load_moveit(ARM, path, request), path=path)


@pytest.mark.parametrize("case", REQUESTS)
def test_a_request_that_is_none_is_refused(case: str, tmp_path: Path) -> None:
    scene = written(tmp_path, scene_with(), "scene.yaml")
    path = written(tmp_path, REQUESTS[case], "request.yaml")
    problem = "limit" in case or case in ("goal unknown link", "goal exact")
    error = ProblemError if problem else FileFormatError
    assert_refused("moveit", f"request: {case}", error, lambda: load_moveit(ARM, scene, path), path=path)


@pytest.mark.parametrize("case", MATRICES)
def test_a_matrix_that_is_none_is_refused(case: str, tmp_path: Path) -> None:
    path = written(tmp_path, MATRICES[case], "scene.yaml")
    request = written(tmp_path, request_with(), "request.yaml")
    assert_refused("moveit", case, FileFormatError, lambda: load_moveit(ARM, path, request, acm=True), path=path)


def test_a_frame_is_not_known_without_a_robot(tmp_path: Path) -> None:
    path = written(tmp_path, scene_with(item(header={"frame_id": "base"})), "scene.yaml")
    assert_refused("moveit", "no robot", FileFormatError, lambda: load_moveit_scene(path), path=path)
    none: Any = "panda"
    assert_refused("moveit", "robot a name", ProblemError, lambda: load_moveit(none, path, path), path=path)


RICH = scene_with(
    item("cylinder", (0.4, 0.1), id="tin", pose=AT, header={"frame_id": "world"}),
    {"id": "wall", "planes": [{"coef": [0, 0, 1, 0]}], "plane_poses": [AT]},
    {"id": "rock", "meshes": [{"vertices": CORNERS, "triangles": FACES}], "mesh_poses": [AT]},
    fixed_frame_transforms=[{"header": {"frame_id": "tray"}, "child_frame_id": "world", "transform": FLIPPED}],
    allowed_collision_matrix={"entry_names": ["base", "hand"], "entry_values": [[False, True], [True, False]]},
    robot_state=state(),
)
SPACE = {"position_constraints": [region()], "orientation_constraints": [turned()]}


def mutated(text: str, rng: random.Random) -> str:
    """Change a word or two of a text: gone, doubled, swapped, or replaced by what is nasty."""
    words = re.findall(r"\s+|[\w.+-]+|.", text)
    nasty = [
        "",
        "-",
        "0",
        "-1",
        "1e999",
        ".nan",
        "null",
        "true",
        "{",
        "]",
        "[]",
        "{}",
        "&a [*a]",
        "*a",
        "!!int x",
        "* ",
        "\n",
        "é",
        ": ",
    ]
    for _ in range(rng.choice((1, 1, 2, 4))):
        i, j = rng.randrange(len(words)), rng.randrange(len(words))
        words[i : i + rng.choice((0, 1, 1, 3))] = [rng.choice([*nasty, words[j], words[i] * 2])]
    return "".join(words)


@pytest.mark.parametrize("seed", range(4))
def test_broken_files_are_read_or_refused_in_one_line(seed: int, tmp_path: Path) -> None:
    rng = random.Random(seed)
    scene, request = json.dumps(RICH), json.dumps(request_with())
    space = json.dumps(request_with(SPACE))
    refused = 0
    for round_ in range(50):
        first = mutated(rng.choice((scene, NEWER, OLDER)), rng) if round_ % 2 else rng.choice((scene, OLDER))
        second = rng.choice((request, space))
        second = second if round_ % 2 else mutated(second, rng)
        paths = written(tmp_path, first, "s.yaml"), written(tmp_path, second, "r.yaml")
        said = ""
        try:
            load_moveit(ARM, *paths, acm=rng.random() < 0.3, mesh_excess=0.05)
        except SpacearmError as error:
            said = str(error)
        refused += bool(said)
        assert "\n" not in said
        assert len(said) < 600 + 2 * len(str(tmp_path))
    assert refused > 10


@pytest.mark.skipif("SPACEARM_MBM" not in os.environ, reason="SPACEARM_MBM names no folder of MotionBenchMaker's problems")
def test_motion_bench_makers_problems_are_read() -> None:
    folder = Path(os.environ["SPACEARM_MBM"])
    panda = load_robot(folder / "panda_spherized.urdf", srdf=folder / "panda.srdf", group="panda_arm")
    scenes = sorted(folder.glob("*/scene*.yaml"))
    assert scenes
    in_collision = []
    for path in scenes:
        problem = load_moveit(panda, path, path.with_name(path.name.replace("scene", "request")))
        text = path.read_text()
        assert len(problem.scene.obstacles) == text.count("type: ")
        assert sorted(o.name for o in problem.scene.obstacles) == sorted(re.findall(r"\bid: (\S+)", text))
        assert isinstance(problem.goal, ConfigurationGoal)
        if clearance(problem, [problem.start, problem.goal.q]).min() <= 0:
            in_collision.append(f"{path.parent.name}/{path.name}")
    assert not in_collision
    matrix = load_moveit(panda, scenes[0], scenes[0].with_name(scenes[0].name.replace("scene", "request")), acm=True)
    assert matrix.robot.self_pairs == panda.self_pairs
