"""The keys of problem files: each is what the library makes of the same values, and wrong ones are told by their line."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from spacearm.core.errors import FileFormatError, ProblemError, RobotError, SceneError, SettingsError, SpacearmError
from spacearm.dynamics import hold
from spacearm.files import load_moveit_scene
from spacearm.files.problem_file import load_problem, load_problem_file
from spacearm.files.scene_file import placed
from spacearm.geometry import (
    Box,
    Capsule,
    Cylinder,
    HalfSpace,
    Obstacle,
    Polytope,
    PolytopeSet,
    Sphere,
    SphereSet,
    convex_pieces,
    enclose_mesh,
    enclose_points,
    pose,
    support,
)
from spacearm.planner.goals import ConfigurationGoal, ConfigurationsGoal, PoseGoal, PositionGoal
from spacearm.planner.planner_settings import PlannerSettings, Weights
from spacearm.robot import load_robot
from spacearm.swarm import IPSO, PSO, Penalty
from support import urdf_text
from support.messages import assert_refused

ROBOT = "robot: zhang2022\n"
START = "start: [0, 0, 0, 0, 0, 0, 0]\n"
GOAL = "goal: {position: [0.7, 0.3, 0.0]}\n"
CUBE_AT = (0.5, 0.2, 0.1)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Return a folder with a mesh, clouds, a MoveIt scene, and an arm of two joints, the second of which may slide."""
    trimesh.creation.box((0.2, 0.1, 0.1)).export(tmp_path / "box.stl")
    np.save(tmp_path / "scan.npy", np.array([[0.5, 0.5, 0.5], [0.5, 0.51, 0.5]]))
    (tmp_path / "scan.csv").write_text("x,y,z\n0.5,0.5,0.5\n0.5,0.51,0.5\n")
    (tmp_path / "moveit.yaml").write_text(
        "world:\n  collision_objects:\n    - id: shelf\n      primitives: [{type: box, dimensions: [0.1, 0.2, 0.3]}]\n"
        "      primitive_poses: [{position: [0.5, 0, 0], orientation: [0, 0, 0, 1]}]\n"
    )
    joints = (urdf_text.joint("a", "link_0", "link_1"), urdf_text.joint("b", "link_1", "link_2"))
    (tmp_path / "arm.urdf").write_text(urdf_text.chain(*joints))
    slide = urdf_text.joint("b", "link_1", "link_2", kind="prismatic", limit='lower="0" upper="1" velocity="1"')
    (tmp_path / "slide.urdf").write_text(urdf_text.chain(joints[0], slide))
    (tmp_path / "arm.srdf").write_text(
        '<robot name="arm"><group name="both"><joint name="a"/><joint name="b"/></group>'
        '<group name="first"><joint name="a"/></group>'
        '<group_state name="ready" group="both"><joint name="a" value="0.5"/><joint name="b" value="-0.5"/></group_state>'
        '<group_state name="home" group="both"><joint name="a" value="0"/><joint name="b" value="0"/></group_state></robot>'
    )
    return tmp_path


def written(folder: Path, text: str) -> Path:
    path = folder / "problem.yaml"
    path.write_text(f"spacearm: 1\n{text}", encoding="utf-8")
    return path


def obstacles(folder: Path, entry: str) -> tuple[Obstacle, ...]:
    return load_problem(written(folder, f"{ROBOT}scene:\n  - {entry}\n{START}{GOAL}")).scene.obstacles


R45 = Rotation.from_euler("xyz", (10, 20, 45), degrees=True)


def at(position: Any, rotation: Rotation) -> np.ndarray:
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = rotation.as_matrix(), position
    return T


SHAPES: dict[str, Obstacle] = {
    "{name: ball, sphere: {center: [1, 2, 3], radius: 0.1}}": Sphere((1, 2, 3), 0.1, name="ball"),
    "capsule: {a: [1, 2, 3], b: [1, 2, 4], radius: 0.1}": Capsule((1, 2, 3), (1, 2, 4), 0.1),
    "{name: b, box: {size: [1, 2, 3]}}": Box((1, 2, 3), name="b"),
    "box: {size: [1, 2, 3], position: [4, 5, 6]}": Box((1, 2, 3), (4, 5, 6)),
    "box: {size: [1, 2, 3], position: [4, 5, 6], q_wxyz: [2, 0, 0, 2]}": Box((1, 2, 3), pose((4, 5, 6), (1, 0, 0, 1))),
    "cylinder: {radius: 0.1, length: 2, position: [4, 5, 6]}": Cylinder(0.1, 2, (4, 5, 6)),
    "box: {size: [1, 2, 3], rounding: 0.1}": Box((1, 2, 3), rounding=0.1),
    "cylinder: {radius: 0.1, length: 2, rounding: 0.02}": Cylinder(0.1, 2, rounding=0.02),
    "{name: wedge, polytope: {vertices: [[0, 0, 0], [1, 0, 0], [0, 1, 0]], rounding: 0.01}}": Polytope(
        [(0, 0, 0), (1, 0, 0), (0, 1, 0)], rounding=0.01, name="wedge"
    ),
    "polytope: {vertices: [[1, 0, 0], [0, 0, 2]], position: [4, 5, 6], q_wxyz: [0, 0, 0, 1]}": Polytope([(3, 5, 6), (4, 5, 8)]),
    "half_space: {normal: [0, 0, 2], point: [0, 0, -1]}": HalfSpace((0, 0, 1), (0, 0, -1)),
}


@pytest.mark.parametrize("entry", SHAPES)
def test_an_obstacle_is_the_librarys_of_the_same_values(entry: str, folder: Path) -> None:
    assert obstacles(folder, entry) == (SHAPES[entry],)


@pytest.mark.parametrize("shape", ["box: {size: [1, 2, 3], ", "cylinder: {radius: 1, length: 2, "])
@pytest.mark.parametrize("turn", ["rpy_deg: [10, 20, 45]", f"q_wxyz: {R45.as_quat(scalar_first=True).tolist()}"])
def test_orientations_are_those_of_scipy(shape: str, turn: str, folder: Path) -> None:
    (found,) = obstacles(folder, f"{shape}position: [4, 5, 6], {turn}}}")
    assert isinstance(found, (Box, Cylinder))
    np.testing.assert_allclose(found.pose, at((4, 5, 6), R45), atol=1e-15)


@given(st.tuples(*[st.floats(-1e4, 1e4)] * 3))
@settings(max_examples=25)
def test_any_turns_about_the_axes_are_those_of_scipy(rpy_deg: tuple[float, float, float]) -> None:
    class Turned:
        position, q_wxyz = None, None

    model: Any = Turned()
    model.rpy_deg = rpy_deg
    expected = Rotation.from_euler("xyz", rpy_deg, degrees=True).as_matrix()
    np.testing.assert_allclose(placed(model)[:3, :3], expected, atol=1e-11)  # 1e4 degrees have 1e-12 of rounding


def test_meshes_and_points_are_enclosed_where_they_are_placed(folder: Path) -> None:
    T = at((1, 2, 3), R45)
    (held,) = obstacles(folder, "mesh: {file: box.stl, position: [1, 2, 3], rpy_deg: [10, 20, 45], scale: 2, pieces: 1}")
    assert isinstance(held, PolytopeSet)
    (piece,) = convex_pieces(folder / "box.stl", pose=T, scale=2, pieces=1, name="box").pieces
    np.testing.assert_allclose(held.pieces[0].vertices, piece.vertices, atol=1e-12)
    assert (held.name, held.pieces[0].name) == ("box", "box")
    (found,) = obstacles(folder, "mesh: {file: box.stl, position: [1, 2, 3], rpy_deg: [10, 20, 45], scale: 2, spheres: 20}")
    expected = enclose_mesh(folder / "box.stl", pose=T, scale=2, spheres=20, name="box")
    assert isinstance(found, SphereSet)
    assert found.name == "box"
    np.testing.assert_allclose(found.centers, expected.centers, atol=1e-12)
    corners = np.array([(x, y, z) for x in (-0.2, 0.2) for y in (-0.1, 0.1) for z in (-0.1, 0.1)]) @ T[:3, :3].T + T[:3, 3]
    for corner in corners:
        assert (np.linalg.norm(found.centers - corner, axis=1) <= found.radii).any()
    for file in ("scan.npy", "scan.csv"):
        (cloud,) = obstacles(folder, f"{{name: scan, points: {{file: {file}, point_radius: 0.01, excess: 0.02}}}}")
        assert cloud == enclose_points(np.load(folder / "scan.npy"), point_radius=0.01, excess=0.02, name="scan")
    (moved,) = obstacles(folder, "points: {file: scan.csv, scale: [1, 1, -2], position: [1, 0, 0], rpy_deg: [0, 0, 90]}")
    assert isinstance(moved, SphereSet)
    for point in ((0.5, 0.5, -1.0), (0.49, 0.5, -1.0)):  # (x, y, z) is turned to (-y, x, z)
        assert (np.linalg.norm(moved.centers - point, axis=1) <= moved.radii + 1e-12).any()


@pytest.mark.parametrize("entry", ["moveit: moveit.yaml", "moveit: {file: moveit.yaml, mesh_excess: 0.1}"])
def test_a_moveit_scene_brings_all_its_obstacles(entry: str, folder: Path) -> None:
    found = obstacles(folder, f"sphere: {{center: [1, 2, 3], radius: 0.1}}\n  - {entry}")
    assert found[1:] == load_moveit_scene(folder / "moveit.yaml").obstacles
    assert found[1].name == "shelf"


def test_a_robots_group_and_states_and_held_joints(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = written(folder, "robot: {file: arm.urdf, srdf: arm.srdf, group: both}\nstart: ready\ngoal: home\n")
    monkeypatch.chdir("/")
    problem = load_problem(path)
    np.testing.assert_array_equal(problem.start, (0.5, -0.5))
    assert problem.goal == ConfigurationGoal((0, 0))
    path = written(
        folder,
        "robot: {file: arm.urdf, srdf: arm.srdf, group: first, fixed: {b: 0.3}}\nstart: [0]\ngoal: {configuration: {a: 1}}\n",
    )
    assert load_problem(path).robot == load_robot(
        folder / "arm.urdf", srdf=folder / "arm.srdf", group="first", fixed={"b": 0.3}
    )


def test_what_is_held_is_held_as_by_the_library(folder: Path) -> None:
    holding = """\
robot:
  name: zhang2022
  holding:
    - box: {size: [0.1, 0.2, 0.3], position: [0, 0.1, 0]}
      frame: hand
      position: [0, 0.2, 0]
      rpy_deg: [0, 0, 90]
      touching: [hand, forearm]
    - {sphere: {center: [0, 0.1, 0], radius: 0.05}, density: 2700}
    - {name: mast, capsule: {a: [0, 0, 0], b: [0, 0.3, 0], radius: 0.01}, frame: held_2}
"""
    found = load_problem(
        written(folder, f"{holding}{START}goal: {{position: [0.7, 0.3, 0.0], frame: mast, tolerance: 0.01}}\n")
    )
    T = at((0, 0.2, 0), Rotation.from_euler("z", 90, degrees=True))
    robot = hold(
        load_robot("zhang2022"),
        Box((0.1, 0.2, 0.3), (0, 0.1, 0)),
        frame="hand",
        pose=T,
        touching=["hand", "forearm"],
    )
    robot = hold(robot, Sphere((0, 0.1, 0), 0.05), name="held_2", density=2700)
    robot = hold(robot, Capsule((0, 0, 0), (0, 0.3, 0), 0.01), frame="held_2", name="mast")
    assert [(part.name, part.joint) for part in found.robot.shapes] == [(part.name, part.joint) for part in robot.shapes]
    n = np.random.default_rng(0).normal(size=(20, 3))
    for mine, theirs in zip(found.robot.shapes, robot.shapes, strict=True):
        np.testing.assert_allclose(support(mine.shape, n), support(theirs.shape, n), atol=1e-12)
    assert [(body.name, body.mass) for body in found.robot.bodies] == [(body.name, body.mass) for body in robot.bodies]
    assert found.robot.self_pairs == robot.self_pairs
    assert isinstance(found.goal, PositionGoal)
    assert found.goal.frame == "mast"


ELBOW = np.array((0, 0, 0, 1.5, 0, 0, 0))
GOALS: dict[str, Any] = {
    "{configuration: {elbow: 1.5}, tolerance: 0.1}": ConfigurationGoal(ELBOW, tolerance=0.1),
    "{configuration: {elbow: 1.5}, tolerance: [0, 0, 0, 1, 0, 0, 0], shortest: true}": ConfigurationGoal(
        ELBOW, tolerance=[0, 0, 0, 1, 0, 0, 0], shortest=True
    ),
    "{configuration: {elbow: 1.5}, tolerance_deg: 180}": ConfigurationGoal(ELBOW, tolerance=math.pi),
    "{configurations: [{elbow: 1.5}, [0, 0, 0, 0, 0, 0, 1]]}": ConfigurationsGoal([ELBOW, np.eye(7)[6]]),
    "{configurations_deg: [{elbow: 180e-1}], tolerance_deg: 180}": ConfigurationsGoal(
        [np.eye(7)[3] * math.pi / 10], tolerance=math.pi
    ),
    "{position: [0.7, 0.3, 0], tolerance: 0.01, frame: hand}": PositionGoal((0.7, 0.3, 0), tolerance=0.01, frame="hand"),
    "{pose: {position: [0.7, 0.3, 0], q_wxyz: [1, 0, 0, 1]}}": PoseGoal(
        pose((0.7, 0.3, 0), (1, 0, 0, 1)), frame="end_effector"
    ),
    "{pose: {position: [0.7, 0.3, 0], q_wxyz: [1, 0, 0, 1]}, position_tolerance: 0.01, orientation_tolerance_deg: 180, "
    "free_axis: y, frame: hand}": PoseGoal(
        pose((0.7, 0.3, 0), (1, 0, 0, 1)), position_tolerance=0.01, orientation_tolerance=math.pi, free_axis="y", frame="hand"
    ),
    "{pose: {position: [0.7, 0.3, 0], q_wxyz: [1, 0, 0, 1]}, orientation_tolerance: 0.1, free_axis: [0, 3, 4]}": PoseGoal(
        pose((0.7, 0.3, 0), (1, 0, 0, 1)), orientation_tolerance=0.1, free_axis=(0, 0.6, 0.8), frame="end_effector"
    ),
}


@pytest.mark.parametrize("text", GOALS)
def test_a_goal_is_the_librarys_of_the_same_values(text: str, folder: Path) -> None:
    assert load_problem(written(folder, f"{ROBOT}{START}goal: {text}\n")).goal == GOALS[text]


SETTINGS: dict[str, PlannerSettings] = {
    "{}": PlannerSettings(),
    "{evaluations: null, time_budget: 1e-1}": PlannerSettings(evaluations=None, time_budget=0.1),
    "{interior_points: [2, 4]}": PlannerSettings(interior_points=(2, 4)),
    "{interior_points: 5}": PlannerSettings(interior_points=(5,)),
    "{weights: {duration: 2}}": PlannerSettings(weights=Weights(duration=2)),
    "{swarm: {particles: 8, inertia: [0.9, 0.4]}}": PlannerSettings(swarm=PSO(particles=8, inertia=(0.9, 0.4))),
    "{swarm: {kind: IPSO, variant: evolving}}": PlannerSettings(swarm=IPSO(variant="evolving")),
    "{swarm: {constraints: {kind: Penalty, weight: 3}}}": PlannerSettings(swarm=PSO(constraints=Penalty(weight=3))),
}


@pytest.mark.parametrize("text", SETTINGS)
def test_the_planners_settings_are_those_of_the_same_values(text: str, folder: Path) -> None:
    assert load_problem_file(written(folder, f"{ROBOT}{START}{GOAL}planner: {text}\n")).settings == SETTINGS[text]


def scene(entry: str) -> str:
    return f"{ROBOT}{START}{GOAL}scene:\n  - {entry}\n"


def robot(text: str) -> str:
    return f"{START}{GOAL}robot:\n  {text}\n"


def held(text: str) -> str:
    return robot(f"name: zhang2022\n  holding:\n    - {text}")


def goal(text: str) -> str:
    return f"{ROBOT}{START}goal:\n  {text}\n"


def planner(text: str) -> str:
    return f"{ROBOT}{START}{GOAL}planner:\n  {text}\n"


BOMB = "\n".join(f"b{i}: &b{i} [{', '.join([f'*b{i - 1}' if i else '0'] * 10)}]" for i in range(9))

REFUSED: dict[str, tuple[type[SpacearmError], str]] = {
    "obstacle without shape": (FileFormatError, scene("name: nothing")),
    "obstacle shape null": (FileFormatError, scene("sphere:")),
    "obstacle name a number": (FileFormatError, scene("{name: 7, sphere: {center: [0, 0, 0], radius: 1}}")),
    "obstacle name of two lines": (FileFormatError, scene('{name: "a\\nb", sphere: {center: [0, 0, 0], radius: 1}}')),
    "obstacle name inside": (FileFormatError, scene("sphere: {center: [0, 0, 0], radius: 1, name: a}")),
    "capsule end missing": (FileFormatError, scene("capsule: {a: [0, 0, 0], radius: 1}")),
    "box edge zero": (SceneError, scene("box: {size: [1, 0, 1]}")),
    "box of two edges": (SceneError, scene("box: {size: [1, 1]}")),
    "box position empty": (SceneError, scene("box: {size: [1, 1, 1], position: []}")),
    "box turned twice": (SceneError, scene("box: {size: [1, 1, 1], q_wxyz: [1, 0, 0, 0], rpy_deg: [0, 0, 0]}")),
    "box quaternion zero": (SceneError, scene("box: {size: [1, 1, 1], q_wxyz: [0, 0, 0, 0]}")),
    "box rpy of two": (SceneError, scene("box: {size: [1, 1, 1], rpy_deg: [0, 0]}")),
    "box rpy in radians": (FileFormatError, scene("box: {size: [1, 1, 1], rpy: [0, 0, 0]}")),
    "cylinder length negative": (SceneError, scene("cylinder: {radius: 1, length: -1}")),
    "box rounding negative": (SceneError, scene("box: {size: [1, 1, 1], rounding: -0.1}")),
    "polytope without vertices": (SceneError, scene("polytope: {vertices: []}")),
    "polytope of flat points": (SceneError, scene("polytope: {vertices: [[0, 0], [1, 1]]}")),
    "polytope of numbers": (FileFormatError, scene("polytope: {vertices: [0, 0, 1]}")),
    "polytope rounding negative": (SceneError, scene("polytope: {vertices: [[0, 0, 0]], rounding: -1}")),
    "half-space without direction": (SceneError, scene("half_space: {normal: [0, 0, 0], point: [0, 0, 0]}")),
    "half-space of the second": (
        SceneError,
        scene("box: {size: [1, 1, 1]}\n  - half_space: {normal: [0, 0], point: [0, 0, 0]}"),
    ),
    "pieces and spheres": (SceneError, scene("mesh: {file: box.stl, pieces: 4, spheres: 20}")),
    "mesh missing": (FileFormatError, scene("mesh: {file: none.stl}")),
    "mesh no mesh": (FileFormatError, scene("mesh: {file: arm.urdf}")),
    "mesh with half a ball": (FileFormatError, scene("mesh: {file: box.stl, spheres: 0.5}")),
    "mesh without balls": (SceneError, scene("mesh: {file: box.stl, spheres: 0}")),
    "mesh scale a word": (FileFormatError, scene("mesh: {file: box.stl, scale: mm}")),
    "mesh scale NaN": (FileFormatError, scene("mesh: {file: box.stl, scale: .nan}")),
    "mesh scale zero": (SceneError, scene("mesh: {file: box.stl, scale: 0}")),
    "mesh scale of two": (SceneError, scene("mesh: {file: box.stl, scale: [1, 2]}")),
    "mesh in nobody's home": (FileFormatError, scene("mesh: {file: ~nobody-of-that-name/box.stl}")),
    "points missing": (FileFormatError, scene("points: {file: none.csv}")),
    "points of a mesh's text": (FileFormatError, scene("points: {file: arm.urdf}")),
    "points scale zero": (SceneError, scene("points: {file: scan.csv, scale: [1, 0, 1]}")),
    "points scale huge": (SceneError, scene("points: {file: scan.csv, scale: 1e308}")),
    "points radius negative": (SceneError, scene("points: {file: scan.csv, point_radius: -1}")),
    "moveit missing": (FileFormatError, scene("moveit: none.yaml")),
    "moveit a problem": (FileFormatError, scene("moveit: problem.yaml")),
    "moveit a list": (FileFormatError, scene("moveit: [moveit.yaml]")),
    "moveit with a name": (SceneError, scene("{name: all, moveit: moveit.yaml}")),
    "robot group without srdf": (RobotError, robot("{file: arm.urdf, group: both}")),
    "robot group unknown": (RobotError, robot("{file: arm.urdf, srdf: arm.srdf, group: bth}")),
    "robot srdf missing": (FileFormatError, robot("{file: arm.urdf, srdf: none.srdf}")),
    "robot fixed a list": (FileFormatError, robot("{file: arm.urdf, fixed: [b]}")),
    "robot fixed unknown": (RobotError, robot("{file: arm.urdf, fixed: {c: 1}}")),
    "robot self-collision mistyped": (FileFormatError, robot("{name: zhang2022, self_collision: on}")),
    "robot capsules none": (RobotError, robot("{name: zhang2022, capsules_per_shape: 0}")),
    "robot pieces of a link none": (RobotError, robot("{name: zhang2022, pieces_per_mesh: {hand: 0}}")),
    "robot excess of an unknown link": (RobotError, robot("{name: zhang2022, excess: {hnd: 0.1}}")),
    "held mass and density": (RobotError, held("{sphere: {center: [0, 0, 0], radius: 1}, mass: 1, density: 1}")),
    "held density zero": (RobotError, held("{sphere: {center: [0, 0, 0], radius: 1}, density: 0}")),
    "held mass below zero": (RobotError, held("{sphere: {center: [0, 0, 0], radius: 1}, mass: -1}")),
    "held half-space": (FileFormatError, held("half_space: {normal: [0, 0, 1], point: [0, 0, 0]}")),
    "held nothing": (FileFormatError, held("frame: hand")),
    "held by an unknown frame": (RobotError, held("{sphere: {center: [0, 0, 0], radius: 1}, frame: hnd}")),
    "held touching unknown": (RobotError, held("{sphere: {center: [0, 0, 0], radius: 1}, touching: [hnd]}")),
    "held touching a word": (FileFormatError, held("{sphere: {center: [0, 0, 0], radius: 1}, touching: hand}")),
    "held name taken": (RobotError, held("{sphere: {center: [0, 0, 0], radius: 1}, name: hand}")),
    "held radius zero": (SceneError, held("sphere: {center: [0, 0, 0], radius: 0}")),
    "start name unknown": (RobotError, f"{ROBOT}{GOAL}start: ready\n"),
    "start_deg a name": (FileFormatError, f"{ROBOT}{GOAL}start_deg: ready\n"),
    "goal name unknown": (RobotError, f"{ROBOT}{START}goal: ready\n"),
    "goal name unknown beside states": (RobotError, "robot: {file: arm.urdf, srdf: arm.srdf}\nstart: ready\ngoal: hme\n"),
    "goals empty": (ProblemError, goal("configurations: []")),
    "goals of other lengths": (ProblemError, goal("configurations: [[0, 0, 0, 0, 0, 0, 0], [0, 0]]")),
    "goals of another length": (ProblemError, goal("configurations: [[0, 0]]")),
    "goals one above its limit": (ProblemError, goal("configurations: [{elbow: 1}, {elbow: 3.2}]")),
    "goals joint mistyped": (ProblemError, goal("configurations: [{elbow: 1}, {elbo: 1}]")),
    "goals a word inside": (FileFormatError, goal("configurations: [[0, 0, 0, up, 0, 0, 0]]")),
    "goal pose without orientation": (ProblemError, goal("pose: {position: [0, 1, 0]}")),
    "goal pose without position": (FileFormatError, goal("pose: {rpy_deg: [0, 0, 0]}")),
    "goal pose turned twice": (SceneError, goal("pose: {position: [0, 1, 0], rpy_deg: [0, 0, 0], q_wxyz: [1, 0, 0, 0]}")),
    "goal pose with tolerance": (ProblemError, goal("pose: {position: [0, 1, 0], rpy_deg: [0, 0, 0]}\n  tolerance: 0.1")),
    "goal pose with both tolerances": (
        ProblemError,
        goal("{pose: {position: [0, 1, 0], rpy_deg: [0, 0, 0]}, orientation_tolerance: 1, orientation_tolerance_deg: 1}"),
    ),
    "goal pose tolerance negative": (
        ProblemError,
        goal("{pose: {position: [0, 1, 0], rpy_deg: [0, 0, 0]}, orientation_tolerance_deg: -1}"),
    ),
    "goal axis unknown": (ProblemError, goal("{pose: {position: [0, 1, 0], rpy_deg: [0, 0, 0]}, free_axis: w}")),
    "goal axis a number": (FileFormatError, goal("{pose: {position: [0, 1, 0], rpy_deg: [0, 0, 0]}, free_axis: 3}")),
    "goal position with an axis": (ProblemError, goal("position: [0, 1, 0]\n  free_axis: z")),
    "goal configuration with a frame": (ProblemError, goal("configuration: {elbow: 1}\n  frame: hand")),
    "goal shortest a word": (FileFormatError, goal("{configuration: {elbow: 1}, shortest: maybe}")),
    "goal tolerance of two": (ProblemError, goal("{configuration: {elbow: 1}, tolerance: [1, 2]}")),
    "goal tolerance in degrees of a slide": (
        ProblemError,
        "robot: slide.urdf\nstart: [0, 0]\ngoal: {configuration: [1, 1], tolerance_deg: [1, 1]}\n",
    ),
    "goal in degrees of a slide": (ProblemError, "robot: slide.urdf\nstart: [0, 0]\ngoal: {configurations_deg: [[1, 1]]}\n"),
    "planner weight mistyped": (SettingsError, planner("proofs: 9\n  weights: {lenght: 1}")),
    "planner weight negative": (SettingsError, planner("proofs: 9\n  weights: {length: -1}")),
    "planner weights a number": (SettingsError, planner("weights: 3")),
    "planner swarm unknown": (SettingsError, planner("swarm: {kind: GA}")),
    "planner swarm a list": (SettingsError, planner("swarm: [PSO]")),
    "planner constraints unknown": (SettingsError, planner("swarm: {constraints: {kind: Barrier}}")),
    "planner key a number": (FileFormatError, planner("7: 1")),
    "planner contains itself": (SettingsError, planner("weights: &a {length: *a}")),
    "planner points a word": (SettingsError, planner("proofs: 9\n  interior_points: [a]")),
    "aliases of aliases": (FileFormatError, f"{ROBOT}{START}{GOAL}{BOMB}\n"),
    "aliases of aliases, merged": (
        FileFormatError,
        f"{ROBOT}{START}{GOAL}m0: &m0 {{a: 0}}\n"
        + "\n".join(f"m{i}: &m{i} {{<<: [{', '.join([f'*m{i - 1}'] * 10)}]}}" for i in range(1, 9)),
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_is_no_good_is_told_by_its_line(case: str, folder: Path) -> None:
    error, text = REFUSED[case]
    path = written(folder, text)

    def call() -> object:
        try:
            return load_problem_file(path)
        except SpacearmError as refusal:
            raise type(refusal)(str(refusal).replace(str(path), "<path>").replace(f"{folder}/", "")) from None

    assert_refused("problem_keys", case, error, call)


def test_aliases_that_stand_for_little_are_read(folder: Path) -> None:
    text = f"{ROBOT}{GOAL}start: &q [0, 0, 0, 0, 0, 0, 0]\n".replace("goal: {position: [0.7, 0.3, 0.0]}", "")
    goal = load_problem(written(folder, f"{text}goal: {{configurations: [{', '.join(['*q'] * 1000)}]}}\n")).goal
    assert isinstance(goal, ConfigurationsGoal)
    assert goal.q.shape == (1000, 7)
