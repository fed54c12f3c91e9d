"""Robots as Pinocchio models: the one place where the two are converted."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from spacearm.robot import Robot


def pinocchio_model(robot: Robot) -> tuple[pin.Model, dict[str, int]]:
    """Build a Pinocchio model from a robot's own numbers, one Pinocchio joint per Joint, mimics included.

    Returns:
        The model, whose q is `full_q`'s, and the frame id of each of the robot's frames.
    """
    model = pin.Model()
    model.name = robot.name
    ids: list[int] = []
    for joint in robot.joints:
        # Not RUBZ, which has two numbers in q: RZ takes the angle itself, whatever its size.
        kind = pin.JointModelRZ() if joint.kind == "revolute" else pin.JointModelPZ()
        parent = 0 if joint.parent < 0 else ids[joint.parent]
        ids.append(model.addJoint(parent, kind, pin.SE3(np.array(joint.T_parent_joint)), joint.name))
    assert [model.joints[i].idx_q for i in ids] == list(range(len(ids)))  # full_q relies on it
    frame_ids = {}
    for frame in robot.frames:
        parent = 0 if frame.joint < 0 else ids[frame.joint]
        T = pin.SE3(np.array(frame.T_joint_frame))
        frame_ids[frame.name] = model.addFrame(pin.Frame(frame.name, parent, T, pin.FrameType.OP_FRAME))
    return model, frame_ids


def full_q(robot: Robot, q: np.ndarray) -> np.ndarray:
    """Turn q (..., n) into the model's (..., joints), in which mimic joints have numbers of their own."""
    dofs = [joint.dof for joint in robot.joints]
    multipliers = np.array([joint.multiplier for joint in robot.joints])
    offsets = np.array([joint.offset for joint in robot.joints])
    return np.asarray(q)[..., dofs] * multipliers + offsets
