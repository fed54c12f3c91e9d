"""Where Pinocchio places a robot's joints, and points that ride on them, for batches of configurations."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pinocchio as pin

from spacearm.robot import Robot
from support.oracles.pinocchio_model import full_q, pinocchio_model


def joint_frames(robot: Robot, q: np.ndarray) -> np.ndarray:
    """T_base_joint (rows, joints, 4, 4) of the moving frames at q (rows, n)."""
    model, _ = pinocchio_model(robot)
    placed = model.createData()
    out = np.empty((len(q), len(robot.joints), 4, 4))
    for row, values in enumerate(full_q(robot, np.asarray(q, dtype=np.float64))):
        pin.forwardKinematics(model, placed, values)
        for j in range(len(robot.joints)):
            out[row, j] = placed.oMi[j + 1].homogeneous
    return out


def points(frames: np.ndarray, riders: Sequence[tuple[int, Sequence[float]]]) -> np.ndarray:
    """Points (rows, riders, 3) [m] in the base frame; a rider is a joint, -1 for the base, and a local point."""
    out = np.empty((len(frames), len(riders), 3))
    for i, (joint, local) in enumerate(riders):
        if joint < 0:
            out[:, i] = local
        else:
            out[:, i] = frames[:, joint, :3, :3] @ np.asarray(local, dtype=np.float64) + frames[:, joint, :3, 3]
    return out
