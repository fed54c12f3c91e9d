"""A robot that was read from a file, with joints held at other values than when it was loaded."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spacearm.core.checks import value_fields
from spacearm.core.errors import RobotError
from spacearm.robot.assembly import Origin, assemble, moved, rest_value
from spacearm.robot.build_robot import require_tree
from spacearm.robot.kinematics import base_and_joint_frames
from spacearm.robot.link_tree import LinkJoint, LinkTree, Mimic, leader_of
from spacearm.robot.model import Robot

Array = NDArray[np.float64]

_MOVING = ("revolute", "continuous", "prismatic")
_SHAPES = ("joints", "capsules", "frames", "bodies")


def held_leaders(robot: Robot) -> dict[str, Mimic]:
    """Name the joints of the file that the robot holds, by the joint that leads each; none of a robot without a file."""
    origin: Origin | None = robot.origin
    if origin is None:
        return {}
    plans_for = {joint.name for joint in robot.joints}
    return {
        joint.name: leader_of(joint, origin.tree)
        for joint in origin.tree.joints
        if joint.kind in _MOVING and joint.name not in plans_for
    }


def joint_limits_in_file(robot: Robot, name: str) -> tuple[float | None, float | None]:
    """Return a joint's limits as its file states them [rad or m]; None where it states none."""
    joint = next(joint for joint in robot.origin.tree.joints if joint.name == name)
    return (None, None) if joint.kind == "continuous" else (joint.lower, joint.upper)


def held_values(robot: Robot) -> dict[str, float]:
    """Return where the robot holds joints of its file, by the names of those that lead others or none [rad or m]."""
    leaders = {lead.leader for lead in held_leaders(robot).values()}
    values = _fixed_by_user(robot.origin) if leaders else {}
    return {
        joint.name: values.get(joint.name, rest_value(joint, robot.origin.tree))
        for joint in (robot.origin.tree.joints if leaders else ())
        if joint.name in leaders
    }


def _fixed_by_user(origin: Origin) -> dict[str, float]:
    joints = {joint.name: joint for joint in origin.tree.joints}
    values = {}
    for name, value in (origin.choices.fixed or {}).items():
        if joints[name].kind in _MOVING:
            lead = leader_of(joints[name], origin.tree)
            values[lead.leader] = (float(value) - lead.offset) / (lead.multiplier or 1.0)
    return values


def held_elsewhere(robot: Robot, values: Mapping[str, float]) -> Robot:
    """Return the robot with joints that it holds held at other values, as if it had been loaded with `fixed` so.

    The values need not be within the joints' limits: a joint that does not move breaks none. What was changed since the
    robot was loaded (limits, tip, configurations, pairs of links) stays changed.

    Args:
        robot: read from a file.
        values: [rad or m] by the names of joints that lead others or none, of `held_leaders`.

    Raises:
        RobotError: the robot's shape was changed since it was loaded, as by `hold`.
    """
    origin: Origin = robot.origin
    if any(getattr(robot, name) != getattr(origin.made, name) for name in _SHAPES):
        said = ", ".join(f"'{name}': {value:g}" for name, value in values.items())
        raise RobotError(
            f"robot '{robot.name}' has been changed since it was loaded, as by hold(), and joints that it holds are to stand "
            f"elsewhere; give load_robot fixed={{{said}}} and change it then"
        )
    fixed = {**(origin.choices.fixed or {}), **values}
    tree = _without_limits(origin.tree, values)
    made = assemble(tree, replace(origin.choices, fixed=_leading(fixed, values, tree)), srdf=origin.srdf)
    own: dict[str, Any] = {
        name: getattr(robot, name)
        for name in value_fields(robot)
        if name not in (*_SHAPES, "notes") and not np.array_equal(getattr(origin.made, name), getattr(robot, name))
    }
    notes = [note for note in robot.notes if note not in origin.made.notes]
    made_so = replace(made, origin=replace(made.origin, tree=origin.tree))
    return replace(made_so, **own, notes=(*made.notes, *notes))


def _leading(fixed: Mapping[str, float], values: Mapping[str, float], tree: LinkTree) -> dict[str, float]:
    """Leave out what the user said of joints that follow one of those given: these come from the one that leads."""
    followers = {
        joint.name
        for joint in tree.joints
        if joint.kind in _MOVING and joint.name not in values and leader_of(joint, tree).leader in values
    }
    return {name: value for name, value in fixed.items() if name not in followers}


def _without_limits(tree: LinkTree, values: Mapping[str, float]) -> LinkTree:
    def freed(joint: LinkJoint) -> LinkJoint:
        moves = joint.kind in _MOVING
        held = moves and leader_of(joint, tree).leader in values
        return replace(joint, lower=None, upper=None) if held else joint

    return replace(tree, joints=tuple(freed(joint) for joint in tree.joints))


def frame_poses(robot: Robot, values: Mapping[str, float]) -> dict[str, Array]:
    """Return where every frame of the robot is, (4, 4) T_base_frame [m], with its joints at given values.

    Joints that the robot holds stand there, too, if they are given one; else where the robot has them.

    Args:
        robot: the robot.
        values: [rad or m] by joint; of a joint that follows another, that one's counts. Joints without one are at 0, or
            the nearest to it that their limits allow.
    """
    rest = np.clip(np.zeros(robot.dof), robot.lower, robot.upper)
    q = np.array([values.get(name, at) for name, at in zip(robot.dof_names, rest, strict=True)])
    joints = base_and_joint_frames(robot, q[None])[0]
    poses = {frame.name: joints[frame.joint + 1] @ frame.T_joint_frame for frame in robot.frames}
    held = {name: lead for name, lead in held_leaders(robot).items() if lead.leader in values}
    return poses if not held else {**poses, **_tree_poses(robot, {**dict(zip(robot.dof_names, q, strict=True)), **values})}


def _tree_poses(robot: Robot, values: Mapping[str, float]) -> dict[str, Array]:
    """Walk the file's own links, by its own joints."""
    origin: Origin = robot.origin
    tree, ordered, fixed = origin.tree, require_tree(origin.tree), _fixed_by_user(origin)
    children = {joint.child for joint in ordered}
    poses = {link: np.eye(4) for link in tree.links if link not in children}
    by_name = {joint.name: joint for joint in tree.joints}
    for joint in ordered:
        T = np.asarray(joint.T_parent_child)
        if joint.kind in _MOVING:
            lead = leader_of(joint, tree)
            at = values.get(lead.leader, fixed.get(lead.leader, rest_value(by_name[lead.leader], tree)))
            T = T @ moved(joint, lead.multiplier * float(at) + lead.offset)
        poses[joint.child] = poses[joint.parent] @ T
    return poses
