"""Forward kinematics in plain NumPy, from the definition of Robot: independent of the kernel."""

from __future__ import annotations

import numpy as np

from spacearm.robot import Robot


def joint_transforms(robot: Robot, q: np.ndarray) -> list[np.ndarray]:
    """T_base_joint (4, 4) of each moving frame at q (n,)."""
    placed: list[np.ndarray] = []
    for joint in robot.joints:
        value = joint.multiplier * q[joint.dof] + joint.offset
        T_motion = np.eye(4)
        if joint.kind == "revolute":
            c, s = np.cos(value), np.sin(value)
            T_motion[:2, :2] = [[c, -s], [s, c]]
        else:
            T_motion[2, 3] = value
        T_base_parent = np.eye(4) if joint.parent < 0 else placed[joint.parent]
        placed.append(T_base_parent @ joint.T_parent_joint @ T_motion)
    return placed


def frame_transform(robot: Robot, q: np.ndarray, name: str) -> np.ndarray:
    """T_base_frame (4, 4) of a named frame at q (n,)."""
    frame = robot.frame(name)
    T = np.eye(4) if frame.joint < 0 else joint_transforms(robot, q)[frame.joint]
    return T @ frame.T_joint_frame
