"""Joints held at a value: folded away, as if the file had fixed them there."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spacearm._kernel.exact import product, sines
from spacearm.checks import as_number, shown
from spacearm.errors import RobotError, nearest
from spacearm.robot.links import LinkJoint, LinkTree, leader_of
from spacearm.robot.tree import turned_onto_z

Array = NDArray[np.float64]

_ROUNDING = 1e-6  # [rad or m] limits and held values are often rounded, each in a file of its own


def hold_joints(tree: LinkTree, values: Mapping[str, float]) -> LinkTree:
    """Fix joints at given values; those that mimic one of them are fixed with it.

    Args:
        tree: links and joints.
        values: [rad or m] by joint. A joint that mimics another sets that one, too; a joint that the file has
            fixed already stays as it is, which a note tells.

    Raises:
        RobotError: no such joint, a value out of its limits, or two that contradict each other.
    """
    held = _by_leader(tree, values)
    joints, notes, useless = [], list(tree.notes), []
    for joint in tree.joints:
        if joint.kind == "fixed":
            if joint.name in values:
                useless.append(joint.name)
        elif joint.kind not in ("floating", "planar"):
            lead = leader_of(joint, tree)
            if lead.leader in held:
                joint = _fixed(joint, lead.multiplier * held[lead.leader] + lead.offset)
        joints.append(joint)
    if useless:
        notes.append(f"fixed= names {', '.join(useless)}, which the file itself has fixed: it stays where it is there")
    if held:
        notes.append("held: " + ", ".join(f"{name} at {value:g}" for name, value in held.items()))
    return replace(tree, joints=tuple(joints), notes=tuple(notes))


def _by_leader(tree: LinkTree, values: Mapping[str, float]) -> dict[str, float]:
    """Turn the values given into those of the joints that lead."""
    if not isinstance(values, Mapping):
        raise RobotError(f"fixed is {shown(values)}, expected a mapping from joint to value, as in {{'finger': 0.02}}")
    joints = {joint.name: joint for joint in tree.joints}
    held: dict[str, float] = {}
    said: dict[str, str] = {}
    for name, given in values.items():
        if name not in joints:
            raise RobotError(f"fixed names joint {shown(name)}, which does not exist; {nearest(str(name), joints)}")
        joint = joints[name]
        value = as_number(f"fixed['{name}']", given, RobotError, unit="m" if joint.kind == "prismatic" else "rad")
        if joint.kind == "fixed":
            continue
        if joint.kind in ("floating", "planar"):
            raise RobotError(f"fixed names joint '{name}', which is {joint.kind} and has no single value; leave it out")
        lead = leader_of(joint, tree)
        _require_within(joint, value, f"fixed['{name}']")
        if lead.multiplier == 0.0:
            continue  # it does not move, and _require_within has seen its value
        value = (value - lead.offset) / lead.multiplier
        if abs(held.setdefault(lead.leader, value) - value) > _ROUNDING:
            raise RobotError(
                f"fixed puts joint '{lead.leader}' at {held[lead.leader]:g} by '{said[lead.leader]}' and at {value:g} by "
                f"'{name}', which move together; drop one of them"
            )
        said.setdefault(lead.leader, name)
    for joint in tree.joints:
        if joint.kind in ("revolute", "prismatic", "continuous"):
            lead = leader_of(joint, tree)
            if lead.leader in held:
                _require_within(joint, lead.multiplier * held[lead.leader] + lead.offset, f"joint '{joint.name}'")
    return held


def rest_value(joint: LinkJoint, tree: LinkTree) -> float:
    """Return the value nearest to 0 that a joint may have, and those that follow it with it [rad or m]."""
    low, high = -math.inf, math.inf
    for other in tree.joints:
        if other.kind not in ("revolute", "prismatic") or other.lower is None or other.upper is None:
            continue
        lead = leader_of(other, tree)
        if lead.leader == joint.name and lead.multiplier != 0.0:
            ends = sorted((end - lead.offset) / lead.multiplier for end in (other.lower, other.upper))
            low, high = max(low, ends[0]), min(high, ends[1])
    return min(max(0.0, low), max(high, low))


def _require_within(joint: LinkJoint, value: float, what: str) -> None:
    if joint.kind == "continuous" or joint.lower is None or joint.upper is None or joint.upper < joint.lower:
        return
    if not joint.lower - _ROUNDING <= value <= joint.upper + _ROUNDING:
        raise RobotError(
            f"{what} is {value:g}, expected {joint.lower:g} to {joint.upper:g}, its limits; change the value or the limits"
        )


def _fixed(joint: LinkJoint, value: float) -> LinkJoint:
    return replace(
        joint, kind="fixed", axis=None, mimic=None, T_parent_child=product(joint.T_parent_child, moved(joint, value))
    )


def moved(joint: LinkJoint, value: Any) -> Array:
    """Return the transform (4, 4) of a joint's child at a value, in the child's frame at value 0."""
    T_child_axis = turned_onto_z(joint.name, joint.axis if joint.axis is not None else (0, 0, 0))
    T = np.eye(4)
    if joint.kind == "prismatic":
        T[2, 3] = value
    else:
        s, c = (float(part) for part in sines(value))
        T[:2, :2] = [[c, -s], [s, c]]
    return product(product(T_child_axis, T), T_child_axis.T)  # a pure rotation: its transpose is its inverse
