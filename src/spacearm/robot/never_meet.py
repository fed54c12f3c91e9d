"""Proof that two links of a robot cannot meet, whatever the configuration.

The distance of two links changes at most as fast as their points move against each other: per radian of a
joint between them by the reach of the points beyond it from its axis, per metre of a sliding joint by a
metre. So where, in the middle of a box of joint values, the clearance is more than the half edges of the box
allow, the whole box is clear; other boxes are halved.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from spacearm.robot.kinematics import base_and_joint_frames
from spacearm.robot.model import Robot
from spacearm.robot.segments import Axes, clearance, placed

Array = NDArray[np.float64]

_JOINTS = 4  # boxes of more dimensions are too many
_BOXES = 10_000  # looked at before giving up
_AT_ONCE = 64  # boxes to begin with, since as many cost no more than one
_ROUNDING = 1e-9  # [m]

VAST = 1e6
"""Limits beyond this are none [rad or m]."""


def joints_between(robot: Robot, first: Axes, second: Axes) -> list[int]:
    """List the joints that move two links against each other; those whose limits are one value do not move."""
    ways: list[set[int]] = []
    for axes in (first, second):
        for joint in {int(j) for j in axes.joint}:
            way = set()
            while joint >= 0:
                way.add(joint)
                joint = robot.joints[joint].parent
            ways.append(way)
    between = set.union(*ways) - set.intersection(*ways)
    return [j for j in sorted(between) if _moves(robot, j)]


def never_meet(robot: Robot, first: Axes, second: Axes, between: list[int]) -> bool | None:
    """Try to prove that two links never meet within the limits.

    Args:
        robot: the robot.
        first, second: the envelopes of the links.
        between: `joints_between` of them.

    Returns:
        True if they cannot meet, False if a configuration was found in which they do, None if neither.
    """
    dofs = sorted({robot.joints[j].dof for j in between})
    lower, upper = _whole_range(robot, dofs, between)
    if len(dofs) > _JOINTS or max(np.abs(lower).max(), np.abs(upper).max()) > VAST:
        return None
    speed = np.zeros(len(dofs))  # of the distance, per unit of each dof
    for j in between:
        speed[dofs.index(robot.joints[j].dof)] += abs(robot.joints[j].multiplier) * _reach(robot, j, first, second, between)
    q_rest = np.clip(np.zeros(robot.dof), robot.lower, robot.upper)
    centers, half, seen = ((lower + upper) / 2)[None], (upper - lower) / 2, 0
    while len(centers) < _AT_ONCE:
        centers = _halved(centers, half, speed)
    while len(centers):
        seen += len(centers)
        if seen > _BOXES:
            return None
        q = np.tile(q_rest, (len(centers), 1))
        q[:, dofs] = centers
        frames = base_and_joint_frames(robot, q)
        moved = float(speed @ half) + _ROUNDING  # at most, from the middle of a box
        gap = clearance(placed(first, frames), placed(second, frames), up_to=moved)
        if (gap < 0).any():
            return False
        centers = _halved(centers[gap <= moved], half, speed)
    return True


def _halved(centers: Array, half: Array, speed: Array) -> Array:
    """Cut every box in two where it moves the links most; `half`, the half edges (k,), is changed in place."""
    widest = int(np.argmax(speed * half))
    half[widest] /= 2
    step = np.zeros(len(half))
    step[widest] = half[widest]
    return np.concatenate([centers - step, centers + step])


def _moves(robot: Robot, joint: int) -> bool:
    dof = robot.joints[joint].dof
    return bool(robot.lower[dof] < robot.upper[dof]) and robot.joints[joint].multiplier != 0.0


def _whole_range(robot: Robot, dofs: list[int], between: list[int]) -> tuple[Array, Array]:
    """Return the limits of the dofs; a joint that turns a whole turn or more needs but one."""
    lower, upper = robot.lower[dofs].copy(), robot.upper[dofs].copy()
    for i, dof in enumerate(dofs):
        moved = [robot.joints[j] for j in between if robot.joints[j].dof == dof]
        if float(upper[i]) - float(lower[i]) > 2 * math.pi and all(
            j.kind == "revolute" and abs(j.multiplier) == 1.0 for j in moved
        ):
            lower[i], upper[i] = -math.pi, math.pi
    return lower, upper


def _reach(robot: Robot, joint: int, first: Axes, second: Axes, between: list[int]) -> float:
    """Bound how far points of the links beyond a joint, on the side away from the base, are from its axis [m]."""
    if robot.joints[joint].kind == "prismatic":
        return 1.0
    return max(_reach_of(robot, joint, axes) for axes in (first, second))


def _reach_of(robot: Robot, joint: int, axes: Axes) -> float:
    furthest = 0.0
    for j, a, b in zip(axes.joint, axes.a, axes.b, strict=True):
        at, across = int(j), max(math.hypot(p[0], p[1]) for p in (a, b))
        ball = max(float(np.linalg.norm(p)) for p in (a, b))  # about the origin of the joint's frame
        while at >= 0 and at != joint:
            here = robot.joints[at]
            slide = 0.0
            if here.kind == "prismatic":
                ends = (robot.lower[here.dof], robot.upper[here.dof])
                slide = max(abs(here.multiplier * end + here.offset) for end in ends)
            offset = here.T_parent_joint[:3, 3]
            across = math.hypot(offset[0], offset[1]) + ball + slide
            ball = float(np.linalg.norm(offset)) + ball + slide
            at = here.parent
        if at == joint:
            furthest = max(furthest, across)
    return furthest
