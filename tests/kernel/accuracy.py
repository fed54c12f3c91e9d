"""How near the kernel's numbers must come to the oracles', with the reasons."""

from __future__ import annotations

import numpy as np

from kernel.builds import Build
from spacearm.robot import Robot

# Sine and cosine, absolute. The kernel takes them by halves: cos x = 1 - 2 sin(x/2)^2 makes four of each rounding of
# the sine near x = pi, and the product adds its own. Up to |x| = 1e4; beyond, in float, the reduction by multiples of
# pi rounds as well.
SINCOS_ERROR = {64: 1.2e-15, 32: 6e-7}
SINCOS_ERROR_FAR = {64: 1.2e-15, 32: 1.4e-6}

# Positions [m] and distances, as a share of the robot's reach: a chain of up to twelve joints, each turned by an
# angle with the errors above, whose frames have entries of about 1 that are rounded some ten times a joint. Some five
# times the worst of many thousand configurations.
PLACEMENT = {64: 1e-14, 32: 3e-6}


def reach(robot: Robot, q: np.ndarray) -> float:
    """How far from the base any part of the robot, with its capsules, can be at q (rows, n) [m]; at least 1."""
    far = 1.0
    for joint in robot.joints:
        far += float(np.linalg.norm(joint.T_parent_joint[:3, 3]))
        if joint.kind == "prismatic":
            far += float(np.abs(joint.multiplier * np.asarray(q)[..., joint.dof] + joint.offset).max(initial=0))
    return far + max((float(np.linalg.norm([c.a, c.b], axis=1).max()) for c in robot.capsules), default=0.0)


def placement_error(build: Build, robot: Robot, q: np.ndarray) -> float:
    """What a position of the robot may be off by at q [m]."""
    # A mimic's value is a product and a sum, rounded before its sine is taken.
    turned = sum(
        float(np.abs(j.multiplier * np.asarray(q)[..., j.dof]).max(initial=0)) + abs(j.offset)
        for j in robot.joints
        if (j.multiplier, j.offset) != (1.0, 0.0)
    )
    return reach(robot, q) * (PLACEMENT[build.bits] + float(np.finfo(build.scalar).eps) * turned)
