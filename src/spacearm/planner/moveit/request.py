"""MoveIt's motion requests in YAML (`moveit_msgs/MotionPlanRequest`): where a motion starts and where it is to end."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from spacearm.checks import shown
from spacearm.errors import nearest
from spacearm.planner.goals import ConfigurationGoal, ConfigurationsGoal, Goal, PoseGoal, PositionGoal
from spacearm.planner.moveit.frames import Frames, require_plain_state
from spacearm.planner.moveit.part import XYZ, Part, pose_of, transform
from spacearm.planner.moveit.scene import kind_and_size
from spacearm.planner.problem import within_limits
from spacearm.robot.model import Robot

Array = NDArray[np.float64]

_KINDS = ("joint_constraints", "position_constraints", "orientation_constraints", "visibility_constraints")
_JOINT = ("joint_name", "position", "tolerance_above", "tolerance_below", "weight")


def start_of(request: Part, scene: Part | None, robot: Robot) -> Array:
    """Read the start (n,) [rad or m], by the joints' names; a request without one starts in the scene's state.

    Raises:
        FileFormatError: no state, a joint without a position, or numbers that are none.
        ProblemError: a joint beyond its limits.
    """
    state = request.get("start_state")
    require_plain_state(state)
    joints = None if state is None else state.get("joint_state")
    if scene is not None:
        require_plain_state(scene.get("robot_state"))
        if joints is None or not joints.items("name"):
            joints = scene.deep("robot_state", "joint_state")
    if joints is None or not joints.items("name"):
        raise request.error("there is no start, expected start_state.joint_state with name and position; add it")
    positions = joints.need("position").numbers(None)
    names = [name.text() for name in joints.items("name")]
    if len(names) != len(positions):
        raise joints.error(f"joint_state has {len(names)} names and {len(positions)} positions, expected one for each")
    if len(set(names)) != len(names):
        twice = next(name for name in names if names.count(name) > 1)
        raise joints.error(f"joint_state names joint {shown(twice)} twice, expected each joint once; remove one")
    q = _by_name(dict(zip(names, positions, strict=True)), robot, joints, "joint_state")
    return joints.located(lambda: within_limits(robot, q, what="start"))


def goal_of(request: Part, robot: Robot, frames: Frames) -> Goal:
    """Read the goal; it is never wider than what the request allows.

    Raises:
        FileFormatError, ProblemError: no goal, or one that is not supported.
    """
    path = request.get("path_constraints")
    for kind in _KINDS if path is not None else ():
        if path is not None and path.items(kind):
            raise path.error(f"path_constraints has {kind}, which are not kept on the way, expected none; remove them")
    alternatives = request.items("goal_constraints")
    if not alternatives:
        raise request.error("goal_constraints are none, expected at least one; add joint_constraints")
    if len(alternatives) == 1:
        return _goal(alternatives[0], robot, frames)
    goals = [_goal(item, robot, frames) for item in alternatives]
    for item, goal in zip(alternatives, goals, strict=True):
        if not isinstance(goal, ConfigurationGoal):
            raise item.error("several goals of which one is in space, expected all in joint_constraints; leave one goal")
    joint_goals = [goal for goal in goals if isinstance(goal, ConfigurationGoal)]
    tolerance = np.min([np.broadcast_to(goal.tolerance, robot.dof) for goal in joint_goals], axis=0)
    return ConfigurationsGoal([goal.q for goal in joint_goals], tolerance=_one_if_equal(tolerance), shortest=True)


def _goal(item: Part, robot: Robot, frames: Frames) -> Goal:
    item.require_keys(("name", *_KINDS))
    joints, positions, orientations, seen = (item.items(kind) for kind in _KINDS)
    if seen:
        raise seen[0].error("visibility_constraints are not read, expected none; remove them")
    if joints and (positions or orientations):
        raise item.error("the goal has joint_constraints and constraints in space, expected one of them; remove the other")
    if joints:
        return _configuration(item, joints, robot)
    if len(positions) != 1 or len(orientations) > 1:
        raise item.error(
            f"the goal has no joint_constraints, {len(positions)} position_constraints and {len(orientations)} "
            "orientation_constraints, expected one position, with or without one orientation"
        )
    return _in_space(positions[0], orientations[0] if orientations else None, frames)


def _configuration(item: Part, joints: list[Part], robot: Robot) -> Goal:
    q: dict[str, float] = {}
    tolerances: dict[str, float] = {}
    for joint in joints:
        joint.require_keys(_JOINT)
        name = joint.need("joint_name").text()
        if name in q:
            raise joint.error(f"joint_constraints name joint {shown(name)} twice, expected each joint once; remove one")
        q[name] = joint.need("position").number()
        either = [joint.get(key) for key in ("tolerance_above", "tolerance_below")]
        tolerances[name] = min((_not_negative(part) for part in either if part is not None), default=0.0)
    goal = _by_name(q, robot, item, "joint_constraints")
    return ConfigurationGoal(goal, tolerance=_one_if_equal([tolerances[name] for name in robot.dof_names]), shortest=True)


def _by_name(values: Mapping[str, float], robot: Robot, part: Part, what: str) -> Array:
    for name in robot.dof_names:
        if name not in values:
            known = nearest(name, values)
            raise part.error(f"{what} does not name joint '{name}', which robot '{robot.name}' plans for; {known}")
    return np.array([values[name] for name in robot.dof_names])


def _in_space(position: Part, orientation: Part | None, frames: Frames) -> Goal:
    link = position.need("link_name").text()
    offset = position.get("target_point_offset")
    if offset is not None and offset.numbers(3, XYZ).any():
        raise offset.error(
            f"target_point_offset is {shown(offset.value)}, expected zeros; give the robot a frame at that point"
        )
    T, near = _region(position.need("constraint_region"))
    T = frames.of(position) @ T
    if orientation is None:
        return position.located(lambda: PositionGoal(T[:3, 3], tolerance=near, frame=link))
    other = orientation.need("link_name").text()
    if other != link:
        raise orientation.error(f"the orientation is of link '{other}' and the position of '{link}', expected the same link")
    turned, T = frames.of(orientation) @ transform(None, orientation.need("orientation")), T.copy()
    T[:3, :3] = turned[:3, :3]
    angles = [orientation.get(f"absolute_{axis}_axis_tolerance") for axis in XYZ]
    limits = {axis: _not_negative(part) for axis, part in zip(XYZ, angles, strict=True) if part is not None}
    free = [axis for axis, angle in limits.items() if angle >= math.pi]
    if len(free) == 3:
        return position.located(lambda: PositionGoal(T[:3, 3], tolerance=near, frame=link))
    if len(free) == 2:
        raise orientation.error(f"axes {' and '.join(free)} are both free, expected at most one; lower a tolerance below pi")
    kept = [angle for axis, angle in limits.items() if axis not in free]
    settings = {"orientation_tolerance": min(kept)} if kept else {}
    return orientation.located(
        lambda: PoseGoal(T, position_tolerance=near, frame=link, free_axis=free[0] if free else None, **settings)  # type: ignore[arg-type]
    )


def _region(region: Part) -> tuple[Array, float]:
    """Return the pose of a goal's region, and the radius [m] of the greatest ball about its middle that is within it."""
    solids, poses, meshes = region.items("primitives"), region.items("primitive_poses"), region.items("meshes")
    if len(solids) != 1 or len(poses) != 1 or meshes:
        raise region.error(
            f"constraint_region has {len(solids)} primitives with {len(poses)} primitive_poses and {len(meshes)} meshes, "
            "expected one primitive with its pose"
        )
    kind, size = kind_and_size(solids[0])
    if kind == "cone":
        raise solids[0].error("a cone for the goal's region is not supported, expected a sphere, a box or a cylinder")
    within = {"box": size.min() / 2, "sphere": size[0], "cylinder": min(size[0] / 2, size[-1])}[kind]
    return pose_of(poses[0]), float(within)


def _not_negative(part: Part) -> float:
    number = part.number()
    if number < 0:
        raise part.error(f"{part.called} is {number:g}, expected a finite number, 0 or more")
    return number


def _one_if_equal(values: list[float] | Array) -> float | Array:
    row = np.array(values)
    return float(row[0]) if (row == row[0]).all() else row
