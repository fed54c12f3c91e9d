"""Where a robot's links are: the Python face of the kernel's kinematics."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm.core.checks import as_readonly, shown
from spacearm.core.errors import RobotError
from spacearm.core.exact import product
from spacearm.core.identity_cache import cached_by_identity
from spacearm.core.native import native
from spacearm.robot.model import Robot, require_robot

Array = NDArray[np.float64]

_FURTHEST = 1e9  # [rad or m] beyond, sines have no digit left


def kernel_joints(robot: Robot) -> native.Joints:
    """Return the joints as the kernel takes them."""
    joints = robot.joints
    return native.Joints(
        parent=np.array([joint.parent for joint in joints], dtype=np.int32),
        prismatic=np.array([joint.kind == "prismatic" for joint in joints], dtype=bool),
        dof=np.array([joint.dof for joint in joints], dtype=np.int32),
        multiplier=np.array([joint.multiplier for joint in joints], dtype=np.float64),
        offset=np.array([joint.offset for joint in joints], dtype=np.float64),
        rotation=np.array([joint.T_parent_joint[:3, :3] for joint in joints], dtype=np.float64).reshape(-1, 3, 3),
        translation=np.array([joint.T_parent_joint[:3, 3] for joint in joints], dtype=np.float64).reshape(-1, 3),
        dofs=robot.dof,
    )


def as_configurations(robot: Robot, q: ArrayLike) -> Array:
    """Check a batch of configurations and return it as an array (..., n) of floats.

    Raises:
        RobotError: the last axis is not n long, or a value is not finite or beyond measure.
    """
    try:
        array = np.asarray(None if np.iscomplexobj(q) else q, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        raise RobotError(f"q is {shown(q)}, expected numbers of shape (..., {robot.dof})") from None
    if array.ndim == 0 or array.shape[-1] != robot.dof:
        raise RobotError(
            f"q has shape {array.shape}, expected (..., {robot.dof}): one value for each of {', '.join(robot.dof_names)}"
        )
    sane = np.abs(array) <= _FURTHEST
    if not sane.all():
        at = tuple(int(i) for i in np.argwhere(~sane)[0])
        wanted = f"at most {_FURTHEST:g}" if np.isfinite(array[at]) else "a finite value"
        raise RobotError(f"q{list(at)} is {array[at]:g}, expected {wanted} for joint '{robot.dof_names[at[-1]]}'")
    return array


@cached_by_identity
def tree_model(robot: Robot) -> native.Model64:
    """Return the kernel's model of a robot's joints alone; for those who ask for many small batches of `joint_frames`."""
    return native.Model64(native.World(joints=kernel_joints(robot)))


def joint_frames(robot: Robot, q: ArrayLike) -> Array:
    """Return the moving frame of every joint.

    Args:
        robot: with j joints and n degrees of freedom.
        q: (..., n) configurations [rad or m].

    Returns:
        (..., j, 4, 4) transforms T_base_joint [m].

    Raises:
        RobotError: q does not fit the robot or is not finite.
    """
    array = as_configurations(robot, q)
    rows = np.ascontiguousarray(array.reshape(-1, robot.dof))
    frames = tree_model(robot).joint_frames(rows)
    return frames.reshape(*array.shape[:-1], len(robot.joints), 4, 4)


def base_and_joint_frames(robot: Robot, q: Array) -> Array:
    """Return the base's frame and the moving frame of every joint, (m, 1 + joints, 4, 4), at q (m, n)."""
    base = np.broadcast_to(np.eye(4), (len(q), 1, 4, 4))
    return np.concatenate([base, joint_frames(robot, q)], axis=1)


def skeleton(robot: Robot) -> Robot:
    """Return the robot without all that does not move it: quicker to find in a cache."""
    tip = replace(robot.frame(robot.tip), parent="")
    nothing = dict.fromkeys(
        ("shapes", "bodies", "self_pairs", "unchecked", "solid", "unweighed", "configurations", "notes"), ()
    )
    return replace(robot, frames=(tip,), apart=None, **nothing)


def forward_kinematics(robot: Robot, q: ArrayLike, *, frame: str | None = None) -> Array:
    """Return where a frame of the robot is, with the base at the origin.

    Args:
        robot: with n degrees of freedom.
        q: (..., n) configurations [rad or m].
        frame: its name; the end effector (`robot.tip`) unless given.

    Returns:
        (..., 4, 4) transforms T_base_frame [m].

    Raises:
        RobotError: no such frame, or q does not fit the robot or is not finite.
    """
    require_robot(robot)
    wanted = robot.frame(robot.tip if frame is None else frame)
    frames = joint_frames(robot, q)
    if wanted.joint < 0:
        return np.broadcast_to(wanted.T_joint_frame, (*frames.shape[:-3], 4, 4)).copy()
    return product(frames[..., wanted.joint, :, :], wanted.T_joint_frame)


_COINCIDENT = 1e-9  # [m] origins nearer than this are one joint centre


def joint_centres(robot: Robot) -> tuple[tuple[int, Array], ...]:
    """List the distinct joint centres and the tip: the fixed control points of the paper.

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
