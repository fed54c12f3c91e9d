"""Planning problems and scenes in MoveIt's files.

Read are:

- planning scenes in YAML (`moveit_msgs/PlanningScene`, as MotionBenchMaker and ROS write them): the world's collision
  objects by primitives (box, sphere, cylinder, cone), meshes and planes, with the object's own pose where there is one, and
  headers that name the world, a frame that the scene fixes, or one of the robot that no joint moves;
- scenes in MoveIt's own text (`*.scene`), older and newer, which are told apart from YAML by what they hold;
- motion requests in YAML (`moveit_msgs/MotionPlanRequest`).

Quaternions are x y z w there, of any length but 0. Every obstacle keeps its object's id as its name, with a number from 1
where the object has several shapes. A cone becomes the cylinder that encloses it, a mesh the balls that enclose it, and a
plane, which has two sides in MoveIt, the half-space on the other side of it than the base frame's origin; a plane through
the origin the half-space behind its normal.

What would change the problem if it were overlooked is refused: an octomap, attached objects, a base that does not stand in
the world's origin, path constraints, unknown keys of an object or a goal. Ignored are the workspace, planner, velocity
scaling, colours, subframes, link padding, object operations, and entries of the collision matrix that are not of two links.
"""

from __future__ import annotations

import os

from spacearm.checks import shown
from spacearm.errors import FileFormatError, ProblemError
from spacearm.planner.moveit.frames import Frames, frames_of
from spacearm.planner.moveit.part import Part
from spacearm.planner.moveit.request import goal_of, start_of
from spacearm.planner.moveit.scene import robot_with_matrix, scene_of
from spacearm.planner.moveit.text import is_scene_text, scene_of_text
from spacearm.planner.problem import Problem
from spacearm.reading import read_text, yaml_of_others
from spacearm.robot.model import Robot
from spacearm.scene import Scene

PathLike = str | os.PathLike[str]

_SCENE = "a MoveIt planning scene"
_REQUEST = "a MoveIt planning request"


def load_moveit(
    robot: Robot, scene: PathLike, request: PathLike, *, acm: bool = False, mesh_excess: float | None = None
) -> Problem:
    """Load a planning problem from MoveIt's files.

    The start is taken by the joints' names from the request's start state, or from the scene's where the request has none;
    joints that the robot does not plan for are passed over. The goal is that of the request: `joint_constraints` make a
    `ConfigurationGoal`, several alternatives a `ConfigurationsGoal`, both with the smaller of the two tolerances of each
    joint, and one position with or without an orientation a `PoseGoal` or `PositionGoal`, within the greatest ball in the
    region and the least of the angles; an axis with a tolerance of pi or more is a free one.

    Args:
        robot: what moves; its joints and links are called as in the files.
        scene: path of a planning scene, YAML or MoveIt's own text.
        request: path of a motion request, YAML.
        acm: take from the scene's allowed collision matrix which links of the robot must keep clear of each other, instead
            of `robot.self_pairs`. A pair without an entry must keep clear.
        mesh_excess: how far the balls around a mesh may stand out of it [m]; by default 2 % of its size.

    Raises:
        FileFormatError: a file that is missing, broken or of another format, or that holds what is not supported; file and
            line are named.
        SceneError: an obstacle that cannot be.
        ProblemError: a start or goal that does not fit the robot.
    """
    if not isinstance(robot, Robot):
        raise ProblemError(f"robot is {shown(robot)}, expected a Robot; make one with load_robot(...)")
    parsed, text = _read_scene(scene)
    if parsed is None:
        if acm:
            raise FileFormatError(f"{scene} is MoveIt's text, which has no collision matrix; leave acm out or give the YAML")
        frames, found = Frames(robot, {}), scene_of_text(text, scene, mesh_excess=mesh_excess)
    else:
        frames = frames_of(parsed, robot)
        found = scene_of(parsed, frames, mesh_excess=mesh_excess)
        robot = robot_with_matrix(robot, parsed) if acm else robot
    asked = _read_request(request)
    start, goal = start_of(asked, parsed, robot), goal_of(asked, robot, frames)
    return asked.need("goal_constraints").located(lambda: Problem(robot, found, start=start, goal=goal))


def load_moveit_scene(path: PathLike, *, mesh_excess: float | None = None) -> Scene:
    """Load the obstacles of a MoveIt planning scene: YAML, or MoveIt's own text (`*.scene`).

    Args:
        path: the file. Its objects stand in the world frame, or in frames that the file itself fixes.
        mesh_excess: how far the balls around a mesh may stand out of it [m]; by default 2 % of its size.

    Raises:
        FileFormatError: a file that is missing, broken or of another format; file and line are named.
        SceneError: an obstacle that cannot be.
    """
    parsed, text = _read_scene(path)
    if parsed is None:
        return scene_of_text(text, path, mesh_excess=mesh_excess)
    return scene_of(parsed, frames_of(parsed, None), mesh_excess=mesh_excess)


def _read_scene(path: PathLike) -> tuple[Part | None, str]:
    """Return a scene in YAML, or None, and the file's text."""
    text = read_text(path, what=_SCENE)
    if is_scene_text(text):
        return None, text
    return _part(text, path, "world", _SCENE), text


def _read_request(path: PathLike) -> Part:
    text = read_text(path, what=_REQUEST)
    if is_scene_text(text):
        raise FileFormatError(f"{path} is a scene in MoveIt's own text, expected {_REQUEST} in YAML; check the path")
    return _part(text, path, "goal_constraints", _REQUEST)


def _part(text: str, path: PathLike, key: str, what: str) -> Part:
    text = text.rstrip().removesuffix("\n---")  # ROS's command line ends each message so
    file = yaml_of_others(text, path, key=key, what=what)
    return Part(file, (), file.value)
