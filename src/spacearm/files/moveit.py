"""Planning problems and scenes in MoveIt's files.

Read are:

- planning scenes in YAML (`moveit_msgs/PlanningScene`, as MotionBenchMaker and ROS write them): the world's collision
  objects by primitives (box, sphere, cylinder, cone), meshes (in the file, or in files of their own) and planes, with the
  object's own pose where there is one;
- scenes in MoveIt's own text (`*.scene`), older and newer, which are told apart from YAML by what they hold;
- motion requests in YAML (`moveit_msgs/MotionPlanRequest`).

The planning frame becomes the inertial frame; `frames` says what may be named in a header. Quaternions are x y z w there, of
any length but 0. Every obstacle keeps its object's id as its name, with a number from 1 where the object has several shapes.
A cone becomes the cylinder that encloses it, a mesh the convex pieces that hold it, and a plane, which has two sides in
MoveIt, the half-space on the other side of it than the robot's base; a plane through the base's origin the half-space behind
its normal.
What a state attaches to a link becomes a payload of the robot.

What would make the result wrong if it were overlooked is refused: an octomap, constraints on the way, padded or scaled links, a
ceiling on a link's speed, unknown keys of an object or a goal. What else is left out, assumed or narrowed is said in the
problem's notes.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from spacearm.core.checks import as_number, shown
from spacearm.core.errors import FileFormatError, ProblemError
from spacearm.core.reading import YamlFile, read_text, yaml_of_others
from spacearm.files.moveit_request import goal_of, leftovers, require_no_other_demands, with_group_and_speed
from spacearm.files.moveit_scene import Body, Frames, frames_of, note_matrix, read_matrix, robot_with_matrix, scene_of, world_of
from spacearm.files.moveit_shapes import is_scene_text, scene_of_text
from spacearm.files.moveit_state import (
    AttachedObject,
    State,
    attached_by,
    read_state,
    require_no_base_variables,
    start_of,
    with_attached,
    with_others_locked,
)
from spacearm.geometry import Scene
from spacearm.planner.problem import Problem, within_limits
from spacearm.proof import DEFAULT_CLEARANCE
from spacearm.robot.assembly import frame_poses
from spacearm.robot.model import Robot

if TYPE_CHECKING:
    from spacearm.files.moveit_messages import Message, MotionPlanRequest, PlanningScene

Array = NDArray[np.float64]
PathLike = str | os.PathLike[str]

_SCENE = "a MoveIt planning scene"
_REQUEST = "a MoveIt planning request"
_USED = (
    *("robot_state", "fixed_frame_transforms", "allowed_collision_matrix", "link_padding", "link_scale", "world", "is_diff"),
    *("name", "robot_model_name"),
)
_HINTS = ("object_colors",)
_NOT_MOVED = 1e-9  # [m and -]


def load_moveit(
    robot: Robot,
    scene: PathLike,
    request: PathLike,
    *,
    acm: bool = False,
    mesh_excess: float | None = None,
    clearance: float = DEFAULT_CLEARANCE,
) -> Problem:
    """Load a planning problem from MoveIt's files.

    The start is taken by the joints' names from the request's start state, over the scene's. Joints that the robot does not
    plan for are locked where it has them, and what is attached to a link becomes a payload: the problem's robot may
    differ from the one given. The goal is that of the request: `joint_constraints` make a `ConfigurationGoal`, several
    alternatives a `ConfigurationsGoal`, both with the smaller of the two tolerances of each joint, and one position with or
    without an orientation a `PoseGoal` or `PositionGoal`, within the greatest ball in the region and the least of the
    angles; an axis with a tolerance of pi or more is a free one. The problem's notes say what was assumed or left out.

    Args:
        robot: what moves; its joints and links are called as in the files.
        scene: path of a planning scene, YAML or MoveIt's own text.
        request: path of a motion request, YAML.
        acm: take from the scene's allowed collision matrix which links of the robot must keep clear of each other, instead
            of `robot.self_pairs`. A pair without an entry must keep clear.
        mesh_excess: how far the pieces of a mesh may stand out of it [m]; by default 2 % of its size.
        clearance: of the problem [m], 0 or more; MoveIt's files do not state one.

    Raises:
        FileFormatError: a file that is missing, broken or of another format, or that holds what is not supported; file and
            line are named.
        SceneError: an obstacle that cannot be.
        ProblemError: a start or goal that does not fit the robot.
        RobotError: something attached that cannot be a payload; or a joint that is to be locked elsewhere by a robot that has
            been changed since it was loaded.
    """
    if not isinstance(robot, Robot):
        raise ProblemError(f"robot is {shown(robot)}, expected a Robot; make one with load_robot(...)")
    clearance = as_number("clearance", clearance, ProblemError, at_least=0, unit="m")
    parsed, text = _read_scene(scene)
    if parsed is None and acm:
        raise FileFormatError(f"{scene} is MoveIt's text, which has no collision matrix; leave acm out or give the YAML")
    asked, notes = _read_request(request), []
    require_no_other_demands(asked, notes)
    _require_no_other_scene(parsed, robot, notes)
    states = _states(parsed, asked, robot, notes)
    robot = states.part.located(lambda: with_others_locked(robot, states.joints, notes))
    matrix = None if parsed is None else read_matrix(parsed.allowed_collision_matrix)
    if acm and parsed is not None and matrix is None:
        raise parsed.error("key 'allowed_collision_matrix' is missing in the file; add it")
    robot = robot_with_matrix(robot, matrix) if acm and matrix is not None else robot
    world = _world(parsed, robot, states, notes, mesh_excess)
    found = scene_of(world.bodies) if parsed is not None else scene_of_text(text, scene, mesh_excess=mesh_excess)
    if matrix is not None:
        note_matrix(robot, matrix, set(world.bodies), set(world.attached), notes, used=acm)
    robot = with_attached(robot, list(world.attached.values()), matrix.may_touch if acm and matrix is not None else None, notes)
    robot = with_group_and_speed(robot, asked, notes)
    start = start_of(robot, states.joints, states.part, notes)
    states.part.located(lambda: within_limits(robot, start, what="start"))
    goal, robot = goal_of(asked, robot, world.frames, notes)
    return asked.located(
        lambda: Problem(robot, found, start=start, goal=goal, base_start=states.base, clearance=clearance, notes=notes),
        "goal_constraints",
    )


def load_moveit_scene(path: PathLike, *, mesh_excess: float | None = None) -> Scene:
    """Load the obstacles of a MoveIt planning scene: YAML, or MoveIt's own text (`*.scene`).

    Args:
        path: the file. Its objects stand in the planning frame, or in frames that the file itself places.
        mesh_excess: how far the pieces of a mesh may stand out of it [m]; by default 2 % of its size.

    Raises:
        FileFormatError: a file that is missing, broken or of another format, or that says of the robot what only
            `load_moveit` takes into account; file and line are named.
        SceneError: an obstacle that cannot be.
    """
    parsed, text = _read_scene(path)
    if parsed is None:
        return scene_of_text(text, path, mesh_excess=mesh_excess)
    _require_no_other_scene(parsed, None, [])
    _require_no_robot(parsed)
    return scene_of(world_of(parsed, frames_of(parsed, None, np.eye(4), {}), mesh_excess=mesh_excess))


@dataclass(frozen=True, slots=True, kw_only=True)
class _States:
    """The robot in the scene and at the start: joints [rad or m], T_w_base (4, 4) [m], and where the start is stated."""

    scene: State
    start: State
    part: Message

    @property
    def joints(self) -> dict[str, float]:
        return {**self.scene.joints, **self.start.joints}

    @property
    def joints_in_scene(self) -> dict[str, float]:
        return {**self.start.joints, **self.scene.joints}

    @property
    def base(self) -> Array:
        return next((T for T in (self.start.base, self.scene.base) if T is not None), np.eye(4))

    @property
    def base_in_scene(self) -> Array:
        return next((T for T in (self.scene.base, self.start.base) if T is not None), np.eye(4))


def _states(scene: PlanningScene | None, request: MotionPlanRequest, robot: Robot, notes: list[str]) -> _States:
    stated = None if scene is None else scene.robot_state
    before = read_state(stated, robot, notes, what="the scene's robot_state")
    start = read_state(request.start_state, robot, notes, what="start_state")
    if not before.joints and not start.joints:
        raise request.error("there is no start, expected start_state.joint_state with name and position; add it")
    for state in (before, start):
        require_no_base_variables(state, robot)
    owner = start if start.joints else before
    assert owner.part is not None
    return _States(scene=before, start=start, part=owner.part.joint_state or owner.part)


@dataclass(frozen=True, slots=True, kw_only=True)
class _World:
    """What a scene and a start state place: the frames at the start, the world's objects, and what is attached to links."""

    frames: Frames
    bodies: dict[str, Body]
    attached: dict[str, AttachedObject]


def _world(scene: PlanningScene | None, robot: Robot, states: _States, notes: list[str], mesh_excess: float | None) -> _World:
    frames = frames_of(scene, robot, states.base_in_scene, frame_poses(robot, states.joints_in_scene), notes)
    shaped = [item for item in states.scene.attached if item.object.has_shapes]
    attached_by(shaped, {}, {}, frames, robot, mesh_excess=mesh_excess)  # the world's objects may stand in their frames
    bodies = {} if scene is None else world_of(scene, frames, mesh_excess=mesh_excess)
    before = attached_by(states.scene.attached, {}, bodies, frames, robot, mesh_excess=mesh_excess)
    frames = frames.at(states.base, frame_poses(robot, states.joints))
    for one in before.values():
        frames.attached.update({name: frames.links[one.link] @ T for name, T in one.body.frames().items()})
    attached = attached_by(states.start.attached, before, bodies, frames, robot, mesh_excess=mesh_excess)
    kept = [name for name in before if attached.get(name) is before[name]]
    if kept and states.start.joints and not states.start.is_diff:
        notes.append(
            f"the scene attaches {', '.join(kept)}, which stays attached at the start; MoveIt would let go of it, since "
            "start_state has no is_diff"
        )
    return _World(frames=frames, bodies=bodies, attached=attached)


def _require_no_other_scene(scene: PlanningScene | None, robot: Robot | None, notes: list[str]) -> None:
    """Refuse what a scene says of the robot's shape, and say what of it is left out."""
    if scene is None:
        return
    leftovers(scene, _USED, _HINTS, notes, what="the scene")
    for key, value, plain in (("link_padding", "padding", 0.0), ("link_scale", "scale", 1.0)):
        for item in getattr(scene, key):
            given = getattr(item, value)
            if given != plain:
                raise item.error(
                    f"{key} of link {shown(item.link_name)} is {given:g}, which is not applied, expected {plain:g}; plan "
                    "with a clearance instead, and remove it",
                    value,
                )
    model = scene.robot_model_name
    if scene.is_diff:
        notes.append("the scene is a difference to another one (is_diff), which is not here: it is taken for the whole")
    if robot is not None and model not in ("", robot.name):
        notes.append(f"the scene is for robot '{model}', and this is '{robot.name}'")


def _require_no_robot(scene: PlanningScene) -> None:
    """Refuse a scene that attaches something to the robot, or moves its base: the obstacles alone would mislead."""
    state = scene.robot_state
    if state is None:
        return
    for item in state.attached_collision_objects:
        raise item.error(
            "the scene attaches an object to the robot, which holds it; read the scene with load_moveit(robot, ...)"
        )
    base = state.multi_dof_joint_state
    for item in [] if base is None else base.transforms:
        if np.abs(item.matrix() - np.eye(4)).max() > _NOT_MOVED:
            raise item.error(
                "the scene has the robot's base elsewhere than in the planning frame's origin; read it with "
                "load_moveit(robot, ...), which keeps that"
            )


def _read_scene(path: PathLike) -> tuple[PlanningScene | None, str]:
    """Return a scene in YAML, or None, and the file's text."""
    text = read_text(path, what=_SCENE)
    if is_scene_text(text):
        return None, text
    from spacearm.files.moveit_messages import PlanningScene, message

    return message(PlanningScene, _file(text, path, "world", _SCENE)), text


def requested_group(path: PathLike) -> str:
    """Return the name of the group that a motion request is for; "" where it names none.

    Raises:
        FileFormatError: a file that is missing, broken or of another format.
    """
    return _read_request(path).group_name


def _read_request(path: PathLike) -> MotionPlanRequest:
    text = read_text(path, what=_REQUEST)
    if is_scene_text(text):
        raise FileFormatError(f"{path} is a scene in MoveIt's own text, expected {_REQUEST} in YAML; check the path")
    from spacearm.files.moveit_messages import MotionPlanRequest, message

    return message(MotionPlanRequest, _file(text, path, "goal_constraints", _REQUEST))


def _file(text: str, path: PathLike, key: str, what: str) -> YamlFile:
    text = text.rstrip().removesuffix("\n---")  # ROS's command line ends each message so
    return yaml_of_others(text, path, key=key, what=what)
