"""MoveIt's motion requests in YAML (`moveit_msgs/MotionPlanRequest`): where a motion ends, and what else is asked."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from difflib import get_close_matches
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from spacearm.core.checks import shown
from spacearm.core.errors import nearest
from spacearm.files.moveit_scene import Frames
from spacearm.files.moveit_state import planned_values
from spacearm.planner.goals import ConfigurationGoal, ConfigurationsGoal, Goal, PoseGoal, PositionGoal
from spacearm.robot.assembly import locked_leaders, locked_values
from spacearm.robot.model import Frame, Robot

if TYPE_CHECKING:
    from spacearm.files.moveit_messages import (
        BoundingVolume,
        Constraints,
        JointConstraint,
        Message,
        MotionPlanRequest,
        OrientationConstraint,
        PositionConstraint,
    )

Array = NDArray[np.float64]

_KINDS = ("joint_constraints", "position_constraints", "orientation_constraints", "visibility_constraints")
_USED = (
    *("start_state", "goal_constraints", "path_constraints", "trajectory_constraints"),
    *("group_name", "max_velocity_scaling_factor", "max_acceleration_scaling_factor"),
    *("max_cartesian_speed", "cartesian_speed_limited_link", "cartesian_speed_end_effector_link"),
)
_HINTS = (
    *("workspace_parameters", "reference_trajectories", "pipeline_id", "planner_id", "num_planning_attempts"),
    "allowed_planning_time",
)
_ANGLE = 1e-3  # [-] a quaternion whose length is off by more is none for MoveIt
_AT_ONCE = 1e-9  # [rad or m]
_QUARTER = math.pi / 2


def leftovers(part: Message, used: tuple[str, ...], hints: tuple[str, ...], notes: list[str], *, what: str) -> None:
    """Say in a note which keys of a message are left out.

    Args:
        part: the message.
        used: keys that are read.
        hints: keys that are MoveIt's, and say nothing that would change the problem.
        notes: gets the sentence.
        what: what the message is called.

    Raises:
        FileFormatError: a key that is nearly one of those that are read, and so is most likely a slip.
    """
    given = part.file.value
    for key in [key for key in given if key not in used and key not in hints]:
        near = get_close_matches(str(key), [*used, *hints], n=1, cutoff=0.8)
        if near:
            raise part.error(f"key {shown(key)} is not known; did you mean '{near[0]}'? correct it", str(key))
    stated = sorted(str(key) for key, value in given.items() if key not in used and _says_something(value))
    if stated:
        notes.append(f"{what} states what is left out: {', '.join(stated)}")


def _says_something(value: Any) -> bool:
    if isinstance(value, dict):
        return any(_says_something(inner) for inner in value.values())
    if isinstance(value, list):
        return any(_says_something(inner) for inner in value)
    return bool(value)


def require_no_other_demands(request: MotionPlanRequest, notes: list[str]) -> None:
    """Refuse what a request asks of the way and is not kept, and say what of it is left out.

    Raises:
        FileFormatError: constraints on the way, or a ceiling on a link's speed.
    """
    leftovers(request, _USED, _HINTS, notes, what="the request")
    for part in (request.path_constraints, *request.trajectory_constraints.constraints):
        for kind in _KINDS:
            if getattr(part, kind):
                raise part.error(f"{part.called} has {kind}, which are not kept on the way, expected none; remove them")
    speed = request.max_cartesian_speed
    if speed > 0:
        raise request.error(
            f"max_cartesian_speed is {speed:g} m/s, which is not kept, expected 0; remove it, and lower "
            "max_velocity_scaling_factor",
            "max_cartesian_speed",
        )


def with_group_and_speed(robot: Robot, request: MotionPlanRequest, notes: list[str]) -> Robot:
    """Return the robot as fast as the request lets it be; as in MoveIt, a factor that is not in (0, 1] is 1.

    Raises:
        FileFormatError: a factor that is no number.
    """
    group = request.group_name
    mine = None if robot.origin is None else robot.origin.choices.group
    if mine is not None and group not in ("", mine):
        notes.append(f"the request is for group '{group}', and the robot moves that of group '{mine}'")
    changes = {}
    for kind in ("velocity", "acceleration"):
        factor = getattr(request, f"max_{kind}_scaling_factor")
        if 0 < factor < 1:
            changes[kind] = getattr(robot, kind) * factor
            notes.append(f"{kind} limits are {factor:g} times the robot's, as max_{kind}_scaling_factor says")
        elif factor not in (0.0, 1.0):
            notes.append(f"max_{kind}_scaling_factor is {factor:g}, which is not in (0, 1]: the robot's own limits hold")
    return replace(robot, **changes) if changes else robot


def goal_of(request: MotionPlanRequest, robot: Robot, frames: Frames, notes: list[str]) -> tuple[Goal, Robot]:
    """Read the goal; it is never wider than what the request allows.

    Args:
        request: the file.
        robot: the robot.
        frames: at the start.
        notes: gets sentences on what was narrowed.

    Returns:
        The goal, and the robot, with a frame more where the goal is for a point beside a link.

    Raises:
        FileFormatError, ProblemError: no goal, or one that is not supported.
    """
    alternatives = request.goal_constraints
    if not alternatives:
        raise request.error("goal_constraints are none, expected at least one; add joint_constraints")
    if len(alternatives) == 1:
        return _goal(alternatives[0], robot, frames, notes)
    goals = [_goal(item, robot, frames, notes)[0] for item in alternatives]
    for item, goal in zip(alternatives, goals, strict=True):
        if not isinstance(goal, ConfigurationGoal):
            raise item.error("several goals of which one is in space, expected all in joint_constraints; leave one goal")
    joint_goals = [goal for goal in goals if isinstance(goal, ConfigurationGoal)]
    tolerance = np.min([np.broadcast_to(goal.tolerance, robot.dof) for goal in joint_goals], axis=0)
    q = [goal.q for goal in joint_goals]
    return ConfigurationsGoal(q, tolerance=_one_if_equal(tolerance), shortest=True), robot


def _goal(item: Constraints, robot: Robot, frames: Frames, notes: list[str]) -> tuple[Goal, Robot]:
    joints, positions, orientations = item.joint_constraints, item.position_constraints, item.orientation_constraints
    if item.visibility_constraints:
        raise item.error("visibility_constraints are not read, expected none; remove them", "visibility_constraints", 0)
    if joints and (positions or orientations):
        raise item.error("the goal has joint_constraints and constraints in space, expected one of them; remove the other")
    if joints:
        return _configuration(item, robot, notes), robot
    if len(positions) != 1 or len(orientations) > 1:
        raise item.error(
            f"the goal has no joint_constraints, {len(positions)} position_constraints and {len(orientations)} "
            "orientation_constraints, expected one position, with or without one orientation"
        )
    return _pose_goal(positions[0], orientations[0] if orientations else None, robot, frames, notes)


def _configuration(item: Constraints, robot: Robot, notes: list[str]) -> Goal:
    q: dict[str, float] = {}
    tolerances: dict[str, float] = {}
    for joint in item.joint_constraints:
        name = joint.joint_name
        if name in q:
            raise joint.error(f"joint_constraints name joint {shown(name)} twice, expected each joint once; remove one")
        q[name] = joint.position
        above, below = (_not_negative(joint, key) for key in ("tolerance_above", "tolerance_below"))
        tolerances[name] = min(above, below)
        if above != below:
            notes.append(
                f"the goal's tolerances of joint '{name}' differ ({above:g} above, {below:g} below): the smaller is kept"
            )
        _require_locked_there(joint, name, q[name], (below, above), robot)
    goal = planned_values(robot, q, item, "joint_constraints", notes)
    return ConfigurationGoal(goal, tolerance=_one_if_equal(_by_dof(robot, tolerances)), shortest=True)


def _by_dof(robot: Robot, tolerances: Mapping[str, float]) -> list[float]:
    """Return a tolerance for each degree of freedom that keeps all joints that it moves within theirs."""
    out = []
    for dof, name in enumerate(robot.dof_names):
        each = [tolerances[name]] if name in tolerances else []
        for joint in robot.joints:
            if joint.dof == dof and joint.name != name and joint.name in tolerances and joint.multiplier:
                each.append(tolerances[joint.name] / abs(joint.multiplier))
        out.append(min(each))
    return out


def _require_locked_there(joint: JointConstraint, name: str, at: float, tolerance: tuple[float, float], robot: Robot) -> None:
    """Refuse a goal for a joint that is locked elsewhere, or that the robot does not have."""
    if name in robot.dof_names or any(name == moved.name for moved in robot.joints):
        return
    lead, values = locked_leaders(robot).get(name), locked_values(robot)
    if lead is None:
        fixed = robot.origin is not None and any(j.name == name and j.kind == "fixed" for j in robot.origin.tree.joints)
        if robot.origin is None or fixed:
            return
        known = nearest(name, [*robot.dof_names, *values])
        raise joint.error(f"joint_constraints name joint {shown(name)}, which robot '{robot.name}' does not have; {known}")
    now = lead.multiplier * values[lead.leader] + lead.offset
    if not at - tolerance[0] - _AT_ONCE <= now <= at + tolerance[1] + _AT_ONCE:
        raise joint.error(
            f"the goal wants joint '{name}' at {at:g}, which robot '{robot.name}' does not plan for and which is locked at "
            f"{now:g}; load the robot with a group that moves it, or remove the constraint"
        )


def _pose_goal(
    position: PositionConstraint, orientation: OrientationConstraint | None, robot: Robot, frames: Frames, notes: list[str]
) -> tuple[Goal, Robot]:
    link = position.link_name
    robot, target = _with_target_point(position, link, robot)
    T, near = _region(position.constraint_region)
    T = frames.of(position, still=True) @ T
    if orientation is None:
        return position.located(lambda: PositionGoal(T[:3, 3], tolerance=near, frame=target)), robot
    if orientation.link_name != link:
        raise orientation.error(
            f"the orientation is of link '{orientation.link_name}' and the position of '{link}', expected the same link"
        )
    length = float(np.linalg.norm(orientation.orientation))
    if length and abs(length - 1) > _ANGLE:
        words = f"orientation has the length {length:.4g}, for which MoveIt takes no turn, expected 1; correct it"
        raise orientation.error(words, "orientation")
    R = orientation.matrix()[:3, :3]
    T[:3, :3] = frames.of(orientation, still=True)[:3, :3] @ R
    limits = {axis: abs(getattr(orientation, f"absolute_{axis}_axis_tolerance")) for axis in "xyz"}  # as MoveIt: either way
    settings = _turning(orientation, limits, R, notes)
    if settings is None:
        return position.located(lambda: PositionGoal(T[:3, 3], tolerance=near, frame=target)), robot
    return orientation.located(lambda: PoseGoal(T, position_tolerance=near, frame=target, **settings)), robot


def _turning(
    orientation: OrientationConstraint, limits: Mapping[str, float], R: Array, notes: list[str]
) -> dict[str, Any] | None:
    """Return a PoseGoal's tolerance and free axis for MoveIt's three angles; None if it may be turned in any way.

    A turn by an angle up to a quarter has none of its three Euler angles, and no component of its rotation vector, greater than
    itself. Euler angles about x, y, z in the link let it turn freely about x or z, and the other two stay below that axis's
    tilt; about y they go no further than a quarter turn. A rotation vector is told along the header's axes; beside a turn about
    one of these, a tilt appears in it at most pi sin(tilt / 2) long.
    """
    free = [axis for axis, angle in limits.items() if angle >= math.pi]
    if len(free) == 3:
        return None
    if len(free) == 2:
        raise orientation.error(f"axes {' and '.join(free)} are both free, expected at most one; lower a tolerance below pi")
    tolerance = min(_QUARTER, *(angle for axis, angle in limits.items() if axis not in free))
    by_vector = orientation.parameterization == 1
    if free and by_vector:
        return {
            "orientation_tolerance": 2 * math.asin(min(1.0, tolerance / math.pi)),
            "free_axis": R.T[:, "xyz".index(free[0])],
        }
    if free == ["y"]:
        notes.append(
            "the goal's y axis is free by Euler angles, in which MoveIt lets it turn by a quarter at most: it is planned for "
            "the orientation itself; state parameterization 1 (a rotation vector) for any turn about it"
        )
        return {"orientation_tolerance": tolerance}
    return {"orientation_tolerance": tolerance, **({"free_axis": free[0]} if free else {})}


def _with_target_point(position: PositionConstraint, link: str, robot: Robot) -> tuple[Robot, str]:
    """Give the robot a frame at the point of the link that the goal is for, if that is not the link's origin."""
    offset = np.array(position.target_point_offset)
    if not offset.any():
        return robot, link
    holder = next((frame for frame in robot.frames if frame.name == link), None)
    if holder is None:
        return robot, link  # which the problem refuses
    name = f"{link} target point"
    T = holder.T_joint_frame.copy()
    T[:3, 3] += T[:3, :3] @ offset
    point = Frame(name=name, joint=holder.joint, T_joint_frame=T, parent=link)
    return replace(robot, frames=(*robot.frames, point)), name


def _region(region: BoundingVolume) -> tuple[Array, float]:
    """Return the pose of a goal's region, and the radius [m] of the greatest ball about its middle that is within it."""
    solids, poses, meshes = region.primitives, region.primitive_poses, region.meshes
    if len(solids) != 1 or len(poses) != 1 or meshes:
        raise region.error(
            f"constraint_region has {len(solids)} primitives with {len(poses)} primitive_poses and {len(meshes)} meshes, "
            "expected one primitive with its pose"
        )
    kind, size = solids[0].type, np.array(solids[0].dimensions)
    if kind == "cone":
        raise solids[0].error("a cone for the goal's region is not supported, expected a sphere, a box or a cylinder")
    within = {"box": size.min() / 2, "sphere": size[0], "cylinder": min(size[0] / 2, size[-1])}[kind]
    return poses[0].matrix(unset=True), float(within)


def _not_negative(joint: JointConstraint, key: str) -> float:
    """Return a tolerance, 0 where none is stated."""
    number: float = getattr(joint, key)
    if number < 0:
        raise joint.error(f"{key} is {number:g}, expected a finite number, 0 or more", key)
    return number


def _one_if_equal(values: list[float] | Array) -> float | Array:
    row = np.array(values)
    return float(row[0]) if (row == row[0]).all() else row
