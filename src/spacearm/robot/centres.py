"""Joint centres: the seed's fixed control points."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from spacearm.checks import as_readonly
from spacearm.errors import RobotError
from spacearm.robot.model import Robot

Array = NDArray[np.float64]

_COINCIDENT = 1e-9  # [m] origins nearer than this are one joint centre


def joint_centres(robot: Robot) -> tuple[tuple[int, Array], ...]:
    """List the distinct joint centres and the tip: the seed's fixed control points.

    Returns:
        Pairs (joint, point): a joint's index, -1 for the base, and a point (3,) [m] in its moving frame. A
        joint's centre is its origin, given in its parent's frame; one that coincides in every configuration
        with a centre already listed is left out (a spherical wrist has three origins and one centre). The tip
        comes last, unless it coincides.
    """
    tip = robot.frame(robot.tip)
    places = [(joint.parent, joint.T_parent_joint[:3, 3]) for joint in robot.joints]
    places.append((tip.joint, tip.T_joint_frame[:3, 3]))
    listed: list[tuple[int, Array]] = []
    seen: list[tuple[int, Array]] = []
    for joint, point in places:
        where, at = _carried_down(robot, joint, point)
        if not any(where == w and np.linalg.norm(at - p) <= _COINCIDENT for w, p in seen):
            seen.append((where, at))
            listed.append((joint, as_readonly("joint centre", point, (3,), RobotError)))
    return tuple(listed)


def _carried_down(robot: Robot, joint: int, point: Array) -> tuple[int, Array]:
    """Give a point in the frame nearest the base where it never moves: on a hinge's axis, points stay put."""
    while joint >= 0 and robot.joints[joint].kind == "revolute" and np.hypot(point[0], point[1]) <= _COINCIDENT:
        T = robot.joints[joint].T_parent_joint
        joint, point = robot.joints[joint].parent, T[:3, :3] @ point + T[:3, 3]
    return joint, point
