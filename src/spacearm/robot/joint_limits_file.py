"""MoveIt's joint_limits.yaml: limits of rate, acceleration and position beside those of the URDF.

MoveIt lets the file replace what the URDF says. Here the narrower of the two holds, and a note names the joints for which
the file asks for more: a motor does not grow stronger in a file. Read for each joint: `max_velocity`, `max_acceleration`,
`min_position`, `max_position`, and the `has_..._limits` that switch them off.
"""

from __future__ import annotations

import math
import os
from dataclasses import replace
from typing import Any

from spacearm.checks import shown
from spacearm.errors import FileFormatError, RobotError, nearest
from spacearm.reading import YamlFile, read_text, yaml_of_others
from spacearm.robot.limits import is_none, usable_velocity, with_range
from spacearm.robot.links import LinkJoint, LinkTree

_WHAT = "MoveIt's joint limits"
_NOT_USED = ("max_jerk", "max_deceleration", "max_effort")


def with_joint_limits_file(tree: LinkTree, path: str | os.PathLike[str]) -> LinkTree:
    """Narrow a tree's limits to those of a joint_limits.yaml.

    Raises:
        FileFormatError: no such file, or another one.
        RobotError: limits that have nothing in common with the robot's, or none of whose joints the robot has.
    """
    file, place = _located(path)
    given = file.value
    for part in place:
        given = given[part]
    joints = {joint.name: joint for joint in tree.joints}
    unknown = [str(name) for name in given if name not in joints]
    if given and len(unknown) == len(given):
        raise RobotError(
            f"{path} names no joint of robot '{tree.name}'; {nearest(unknown[0], joints)}; give the file of that robot"
        )
    wider: list[str] = []
    unused: set[str] = set()
    for name, entry in given.items():
        with file.at(*place, name):
            entry = {} if entry is None else entry
            if not isinstance(entry, dict):
                raise FileFormatError(f"joint_limits.{name} is {shown(entry)}, expected a mapping as {{max_velocity: 1.0}}")
            if name in joints and joints[name].kind in ("revolute", "continuous", "prismatic"):
                joints[name] = _narrowed(joints[name], entry, wider)
                unused |= {key for key in _NOT_USED if _stated(entry, key, flag=f"has_{key[4:]}_limits") is not None}
    notes = [*tree.notes, f"limits of joints were narrowed to those of {path}"]
    if wider:
        notes.append(f"{path} allows more than the robot's file, whose limits hold, for {', '.join(wider)}")
    if unknown:
        notes.append(f"{path} names joints that the robot does not have and were left out: {', '.join(unknown)}")
    if unused:
        notes.append(f"{path} states {', '.join(sorted(unused))}, which is not used; a limit of jerk is given to the planner")
    scaling = _scaling(file, place)
    if scaling:
        notes.append(f"{path} states {', '.join(scaling)}, which MoveIt applies to requests: not used here")
    return replace(tree, joints=tuple(joints.values()), notes=tuple(notes))


def _scaling(file: YamlFile, place: tuple[str, ...]) -> list[str]:
    """List the default scaling factors beside the limits that slow the robot down, as in "...: 0.1"."""
    around = file.value
    for part in place[:-1]:
        around = around[part]
    keys = ("default_velocity_scaling_factor", "default_acceleration_scaling_factor")
    return [f"{key}: {shown(around[key])}" for key in keys if key in around and around[key] != 1]


def _located(path: str | os.PathLike[str]) -> tuple[YamlFile, tuple[str, ...]]:
    """Read the file; return it and where the joints are: ROS 2 wraps them for its parameter server."""
    text = read_text(path, what=_WHAT)
    for place in (
        ("joint_limits",),
        ("robot_description_planning", "joint_limits"),
        ("/**", "ros__parameters", "robot_description_planning", "joint_limits"),
    ):
        try:
            file = yaml_of_others(text, path, key=place[0], what=_WHAT)
        except FileFormatError:
            if place == ("joint_limits",) and "robot_description_planning" not in text:
                raise
            continue
        value: Any = file.value
        for part in place:
            value = value.get(part) if isinstance(value, dict) else None
        if isinstance(value, dict):
            return file, place
    raise FileFormatError(f"{path} has no joint_limits, expected {_WHAT}: a mapping from joints to limits")


def _narrowed(joint: LinkJoint, entry: dict[str, Any], wider: list[str]) -> LinkJoint:
    where = f"joint_limits.{joint.name}"
    lower, upper = (_stated(entry, key, flag="has_position_limits") for key in ("min_position", "max_position"))
    if lower is not None and upper is not None and not (is_none(lower) and is_none(upper)):
        if lower > upper:
            raise RobotError(f"{where} has min_position {lower:g} above max_position {upper:g}; exchange them")
        more = joint.kind != "continuous" and None not in (joint.lower, joint.upper)
        if more and (lower < (joint.lower or 0.0) or upper > (joint.upper or 0.0)):
            wider.append(f"{joint.name} (position)")
        joint = with_range(joint, lower, upper, where)
    velocity = usable_velocity(_stated(entry, "max_velocity", flag="has_velocity_limits"))
    acceleration = _stated(entry, "max_acceleration", flag="has_acceleration_limits")
    acceleration = acceleration if acceleration is not None and 0 < acceleration < math.inf else None
    for field, value, known in (
        ("velocity", velocity, usable_velocity(joint.velocity)),
        ("acceleration", acceleration, joint.acceleration),
    ):
        if value is not None and known is not None and value > known:
            wider.append(f"{joint.name} ({field})")
        if value is not None:
            joint = replace(joint, **{field: value if known is None else min(value, known)})
    return joint


def _stated(entry: dict[str, Any], key: str, *, flag: str = "") -> float | None:
    """Return a limit that the file states and does not switch off."""
    value = entry.get(key)
    if value is None or entry.get(flag, True) is False:
        return None
    if isinstance(value, bool) or not isinstance(value, (int, float)) or math.isnan(value):
        raise FileFormatError(f"{key} is {shown(value)}, expected a number")
    return float(value)
