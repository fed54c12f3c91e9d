"""Everything that reads a file, each with valid texts to begin with."""

from __future__ import annotations

import contextlib
import io
import json
import struct
from collections.abc import Callable
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import numpy as np

from spacearm.files import load_problem_file, load_trajectory, plan_as_dict
from spacearm.files.plan_file import load_plan, load_saved_plan, recheck_plan
from spacearm.geometry import Box, Cylinder, HalfSpace, Scene, Sphere, SphereSet, pose
from spacearm.planner import PlannerSettings, Problem, plan
from spacearm.planner.goals import ConfigurationGoal
from spacearm.proof import certify
from spacearm.robot import Robot, load_robot
from spacearm.swarm import IPSO, PSO, Swarm
from support import srdf_text
from support.yaml_text import ARM


class Reader(NamedTuple):
    """What is read, from which valid files, and how; the folder holds the other files that a text may name."""

    suffix: str
    texts: tuple[bytes, ...]
    read: Callable[[Path], object]


@cache
def robot() -> Robot:
    """The robot of the trajectories and of MoveIt's files."""
    return load_robot("zhang2022")


URDF = srdf_text.two_arms_with_a_mass()
SRDF = srdf_text.two_arms_srdf()
ROBOT = (ARM.replace("lower: -1, upper: 1,", "lower_deg: -100, upper_deg: 100,") + 'tip: hand\nnotes: ["drawn"]\n').encode()

PROBLEMS = (
    b"""\
spacearm: 1
robot: zhang2022
scene:
  - sphere: {center: [0.5, 0.5, 0.0], radius: 0.1}
  - box: {size: [0.1, 0.1, 0.1], position: [-0.5, 0.5, 0.5], rpy_deg: [0, 0, 45]}
  - cylinder: {radius: 0.1, length: 0.3, position: [-0.5, 0.5, -0.5]}
  - half_space: {normal: [0, 0, 1], point: [0, 0, -1]}
start: [0, 0, 0, 0, 0, 0, 0]
goal: {position: [0.7, 0.3, 0.0], tolerance: 0.001}
planner: {islands: 2, weights: {length: 1, tip: 0.5}, interior_points: [2, 3], swarm: {particles: 20}}
""",
    b"""\
spacearm: 1
robot: {file: arm.urdf, srdf: arm.srdf, group: left, velocity_limit: 1.0, acceleration_limit: 1.0}
scene:
  - capsule: {a: [0, 0.9, -0.5], b: [0, 0.9, -0.3], radius: 0.02}
  - mesh: {file: block.stl, excess: 0.05}
  - points: {file: cloud.xyz, point_radius: 0.01}
start: {left_shoulder: 0.1}
goal: {configurations: [{left_shoulder: 0.2}, {left_shoulder: 0.3}]}
base: fixed
""",
    b"""\
spacearm: 1
robot: arm.yaml
start_deg: {shoulder: 30}
goal: {pose: {position: [0.7, 0.3, 0.0], rpy_deg: [0, 0, 0]}, orientation_tolerance_deg: 1, free_axis: z}
planner:
  time_budget: 0.5
  swarm: {kind: IPSO, particles: 12}
""",
)

MOVEIT_SCENE = b"""\
name: drawn
robot_model_name: zhang2022
fixed_frame_transforms:
  - header: {frame_id: world}
    child_frame_id: table
    transform: {translation: [0, 0, -1], rotation: [0, 0, 0, 1]}
allowed_collision_matrix:
  entry_names: [upper_arm, hand]
  entry_values:
    - [false, true]
    - [true, false]
world:
  collision_objects:
    - id: can
      header: {frame_id: table}
      pose: {position: {x: 0.1, y: 0, z: 0}, orientation: {x: 0, y: 0, z: 0, w: 1}}
      primitives:
        - {type: cylinder, dimensions: [0.14, 0.03]}
        - {type: 1, dimensions: [0.1, 0.2, 0.3]}
      primitive_poses:
        - {position: [0.5, 0.3, -0.3], orientation: [0, 0, 0.6, 0.8]}
        - {position: [0.5, 0.3, 0.3], orientation: [0, 0, 0, 1]}
    - id: floor
      planes: [{coef: [0, 0, 1, 2]}]
      plane_poses: [{position: [0, 0, 0], orientation: [0, 0, 0, 1]}]
"""

# A file of its own, for enclosing a mesh takes a while.
MOVEIT_MESH = b"""\
world:
  collision_objects:
    - id: wedge
      meshes:
        - vertices: [{x: 0, y: 0, z: 1}, {x: 0.1, y: 0, z: 1}, {x: 0, y: 0.1, z: 1}, {x: 0, y: 0, z: 1.1}]
          triangles:
            - {vertex_indices: [0, 2, 1]}
            - {vertex_indices: [0, 1, 3]}
            - {vertex_indices: [0, 3, 2]}
            - {vertex_indices: [1, 2, 3]}
      mesh_poses: [{position: [0, 0, 0], orientation: [0, 0, 0, 1]}]
"""

MOVEIT_TEXTS = (
    b"(noname)+\n* shelf\n0.5 0 0.2\n0 0 0 1\n1\nbox\n0.4 0.8 0.02\n0 0 0\n0 0 0 1\n0.5 0.5 0.5 1\n0\n.\n",
    b"old\n* a\n2\nsphere\n0.1\n0 0 1\n0 0 0 1\n0 0 0 0\ncylinder\n0.1 0.3\n1 0 1\n0 0 0.6 0.8\n0 0 0 0\n* b\n1\n"
    b"cone\n0.1 0.2\n0 1 1\n0 0 0 1\n0 0 0 0\n.\n",
    b"mesh\n* m\n0 0 0\n0 0 0 1\n1\nmesh\n4 4\n0 0 1\n0.1 0 1\n0 0.1 1\n0 0 1.1\n0 2 1\n0 1 3\n0 3 2\n1 2 3\n0 0 0\n0 0 0 1\n"
    b"0 0 0 0\n1\ntop\n0 0 1\n0 0 0 1\n.\n",
)

REQUESTS = (
    b"""\
group_name: arm
goal_constraints:
  - joint_constraints:
      - {joint_name: shoulder_1, position: 0.45, tolerance_above: 0.01, tolerance_below: 0.02}
      - {joint_name: elbow, position: 1.0}
      - {joint_name: shoulder_2, position: 0.1}
      - {joint_name: shoulder_3, position: 0.1}
      - {joint_name: wrist_1, position: 0.1}
      - {joint_name: wrist_2, position: 0.1}
      - {joint_name: wrist_3, position: 0.1}
start_state:
  joint_state:
    name: [shoulder_1, shoulder_2, shoulder_3, elbow, wrist_1, wrist_2, wrist_3]
    position: [0, 0, 0, 0, 0, 0, 0]
""",
    b"""\
start_state:
  joint_state:
    name: [elbow, shoulder_1, shoulder_2, shoulder_3, wrist_1, wrist_2, wrist_3]
    position: [0.5, 0, 0, 0, 0, 0, 0]
goal_constraints:
  - position_constraints:
      - header: {frame_id: world}
        link_name: end_effector
        target_point_offset: {x: 0, y: 0, z: 0}
        constraint_region:
          primitives: [{type: sphere, dimensions: [0.01]}]
          primitive_poses: [{position: [0.7, 0.3, 0], orientation: [0, 0, 0, 1]}]
        weight: 1
    orientation_constraints:
      - header: {frame_id: world}
        link_name: end_effector
        orientation: [0, 0, 0, 1]
        absolute_x_axis_tolerance: 0.1
        absolute_y_axis_tolerance: 0.1
        absolute_z_axis_tolerance: 3.2
        weight: 1
""",
)


def _csv() -> tuple[bytes, ...]:
    names = robot().dof_names
    t = np.linspace(0, 2, 9)
    rows = 0.1 * np.sin(np.outer(t, np.arange(1, 8)))
    plain = (
        "time,"
        + ",".join(names)
        + "\n"
        + "\n".join(",".join(f"{v:.6g}" for v in (a, *r)) for a, r in zip(t, rows, strict=True))
    )
    head = "t_s," + ",".join(f"{kind}_{name}" for kind in ("q", "dq", "ddq") for name in names)
    whole = (
        head + "\n" + "\n".join(",".join(f"{v:.6g}" for v in (a, *r, *(0 * r), *(0 * r))) for a, r in zip(t, rows, strict=True))
    )
    return plain.encode() + b"\n", whole.encode() + b"\n"


@cache
def saved_plans() -> tuple[bytes, ...]:
    """Plans as files, by different time laws."""
    scene = Scene([
        Sphere((0.6, 0.6, 0.5), 0.1), Box((0.1, 0.2, 0.1), pose((-0.6, 0.6, 0.5), (1, 0, 0, 0))),
        HalfSpace((0, 0, 1), (0, 0, -1.5)),
        Cylinder(0.1, 0.2, pose((0, -1, 0), (1, 0, 0, 0)), name="can"), SphereSet([(1, 1, 1), (1, 1, 1.1)], [0.1, 0.1]),
    ])  # fmt: skip
    out = []
    for law in ("uniform", "time_optimal"):
        problem = Problem(robot(), scene, start=np.zeros(7), goal=ConfigurationGoal([0.3, 0.1, 0, 0.4, 0, 0, 0]))
        found = plan(problem, PlannerSettings(evaluations=300, time_law=law), rng=0)
        assert found.found, found.message
        out.append(json.dumps(plan_as_dict(found)).encode())
    return tuple(out)


def _stl() -> bytes:
    corners = np.array([[0, 0, 1], [0.1, 0, 1], [0, 0.1, 1], [0, 0, 1.1]])
    faces = corners[[[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]]
    return bytes(80) + struct.pack("<I", 4) + b"".join(struct.pack("<12fH", 0, 0, 0, *face.ravel(), 0) for face in faces)


OBJ = b"v 0 0 1\nv 0.1 0 1\nv 0 0.1 1\nv 0 0 1.1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
CLOUD = b"# x y z\n0.0 0.0 1.0\n0.1 0.0 1.0\n0.0 0.1 1.0\n0.2 0.1 1.1\n"


def beside(folder: Path) -> None:
    """Write the files that the texts name."""
    for name, content in (
        ("arm.urdf", URDF.encode()), ("arm.srdf", SRDF.encode()), ("arm.yaml", ROBOT), ("block.stl", _stl()),
        ("cloud.xyz", CLOUD),
        ("problem.yaml", PROBLEMS[0]), ("world.yaml", MOVEIT_SCENE), ("request.yaml", REQUESTS[0]),
    ):  # fmt: skip
        (folder / name).write_bytes(content)


def readers() -> dict[str, Reader]:
    """All readers by name."""
    from spacearm.files.moveit import load_moveit, load_moveit_scene
    from spacearm.geometry.meshes import mesh_of, read_points

    def proven(path: Path) -> object:
        saved = load_saved_plan(path)
        return certify(saved.problem, saved.trajectory).message

    def srdf(path: Path) -> object:
        return load_robot(path.with_name("arm.urdf"), srdf=path, group="left")

    return {
        "urdf": Reader("urdf", (URDF.encode(),), lambda path: load_robot(path, tip="left_tool", self_collision="computed")),
        "srdf": Reader("srdf", (SRDF.encode(),), srdf),
        "robot": Reader("yaml", (ROBOT,), load_robot),
        "problem": Reader("yaml", PROBLEMS, load_problem_file),
        "plan": Reader("json", saved_plans(), load_plan),
        "plan proven": Reader("json", saved_plans(), proven),
        "plan again": Reader("json", saved_plans(), lambda path: recheck_plan(path).notes),
        "csv": Reader("csv", _csv(), lambda path: load_trajectory(robot(), path)),
        "csv proven": Reader("csv", _csv(), _csv_proven),
        "moveit scene": Reader("yaml", (MOVEIT_SCENE, MOVEIT_SCENE, MOVEIT_SCENE, MOVEIT_MESH), load_moveit_scene),
        "moveit text": Reader("scene", MOVEIT_TEXTS, load_moveit_scene),
        "moveit request": Reader("yaml", REQUESTS, lambda path: load_moveit(robot(), path.with_name("world.yaml"), path)),
        "moveit matrix": Reader(
            "yaml", (MOVEIT_SCENE,), lambda path: load_moveit(robot(), path, path.with_name("request.yaml"), acm=True)
        ),
        "mesh stl": Reader("stl", (_stl(),), mesh_of),
        "mesh obj": Reader("obj", (OBJ,), mesh_of),
        "checkpoint": Reader("npz", _checkpoints(), _checkpoint_read),
        "points": Reader("xyz", (CLOUD,), read_points),
    }


@cache
def _checkpoints() -> tuple[bytes, ...]:
    """Checkpoints as JSON text, which `_checkpoint_read` makes files of: a zip of our own is whole, whatever it holds."""
    out = []
    for settings in (PSO(particles=3, iterations=4), IPSO(particles=6, iterations=4)):
        swarm = Swarm([-1.0, -1.0], [1.0, 1.0], settings, rng=0, keep_positions=True)
        for _ in range(2):
            swarm.tell(np.sum(swarm.ask() ** 2, axis=1))
        with TemporaryDirectory() as place:
            swarm.save(Path(place) / "swarm.npz")
            with np.load(Path(place) / "swarm.npz") as file:
                arrays = {name: file[name] for name in file.files}
        header = json.loads(arrays.pop("header").tobytes())
        values = {name: [str(array.dtype), array.tolist()] for name, array in arrays.items()}
        out.append(json.dumps({"header": header, "arrays": values}).encode())
    return tuple(out)


def _checkpoint_read(path: Path) -> object:
    """Make a checkpoint of the text, where that can be done, and read it and go on."""
    with contextlib.suppress(Exception):
        values = json.loads(path.read_bytes())
        arrays = {name: np.array(rows, dtype=kind) for name, (kind, rows) in values["arrays"].items()}
        header = np.frombuffer(json.dumps(values["header"]).encode(), dtype=np.uint8)
        buffer = io.BytesIO()
        np.savez(buffer, **{"header": header, **arrays})  # type: ignore[arg-type]
        path.write_bytes(buffer.getvalue())
    swarm = Swarm.load(path)
    if swarm.settings.particles < 1000 and not swarm.done:
        swarm.tell(np.sum(np.asarray(swarm.ask()) ** 2, axis=1))
    return swarm.iteration


def _csv_proven(path: Path) -> object:
    trajectory = load_trajectory(robot(), path)
    scene = Scene([Sphere((0.6, 0.6, 0.5), 0.1)])
    problem = Problem(robot(), scene, start=np.zeros(7), goal=ConfigurationGoal(np.zeros(7)))
    return certify(problem, trajectory).message
