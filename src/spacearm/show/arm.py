"""The arm as a drawing: its links as segments between joint centres, and its envelope."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm.momentum.turning import matrix_of
from spacearm.motion import AnyTrajectory
from spacearm.robot import LinkCapsule, Robot, forward_kinematics, joint_frames
from spacearm.scene import Capsule, Sphere

Array = NDArray[np.float64]

_COINCIDENT = 1e-9  # [m] shorter segments are none: a spherical joint's three origins are one centre


def skeleton(robot: Robot, q: ArrayLike, T_w_b: ArrayLike | None = None) -> Array:
    """Return the segments from joint centre to joint centre, and to the tip.

    Args:
        robot: the robot.
        q: (n,) one configuration [rad or m].
        T_w_b: (4, 4) where the base is [m]; None: at the origin.

    Returns:
        (s, 2, 3) their ends, inertial frame [m]; those without length are left out.
    """
    at = joint_frames(robot, q)[:, :3, 3]
    base = np.zeros(3)
    pairs = [(base if joint.parent < 0 else at[joint.parent], at[i]) for i, joint in enumerate(robot.joints)]
    tip = robot.frame(robot.tip)
    pairs.append((base if tip.joint < 0 else at[tip.joint], forward_kinematics(robot, q)[:3, 3]))
    segments = np.array(pairs)
    segments = segments[np.linalg.norm(segments[:, 1] - segments[:, 0], axis=1) > _COINCIDENT]
    return _moved(segments, T_w_b)


def envelope(robot: Robot, q: ArrayLike, T_w_b: ArrayLike | None = None) -> tuple[Sphere | Capsule, ...]:
    """Return the links' capsules that have a radius, also of what is held, where they are in one configuration.

    Args:
        robot, q, T_w_b: as for `skeleton`.
    """
    frames = _moved_frames(joint_frames(robot, q), T_w_b)
    return tuple(_placed(c, frames[c.joint]) for c in robot.capsules if c.radius > 0 and c.joint >= 0)


def base_envelope(robot: Robot, T_w_b: ArrayLike | None = None) -> tuple[Sphere | Capsule, ...]:
    """Return the base's capsules that have a radius, where the base is."""
    T = np.eye(4) if T_w_b is None else np.asarray(T_w_b, dtype=np.float64)
    return tuple(_placed(c, T) for c in robot.capsules if c.radius > 0 and c.joint < 0)


def base_frames(trajectory: AnyTrajectory, t: ArrayLike) -> Array:
    """Return where a trajectory's base is, T_w_b (..., 4, 4) [m], at times (...,) [s]."""
    position, attitude = trajectory.base_pose(t)
    T = np.zeros((*position.shape[:-1], 4, 4))
    T[..., :3, :3], T[..., :3, 3], T[..., 3, 3] = matrix_of(attitude), position, 1.0
    return T


def tips(robot: Robot, q: ArrayLike) -> Array:
    """Return where the end effector is, (..., 3) [m], for configurations (..., n) [rad or m] and the base at the origin."""
    return forward_kinematics(robot, q)[..., :3, 3]


def _moved(points: Array, T_w_b: ArrayLike | None) -> Array:
    if T_w_b is None:
        return points
    T = np.asarray(T_w_b, dtype=np.float64)
    return np.asarray(points @ T[:3, :3].T + T[:3, 3], dtype=np.float64)


def _moved_frames(frames: Array, T_w_b: ArrayLike | None) -> Array:
    return frames if T_w_b is None else np.asarray(T_w_b, dtype=np.float64) @ frames


def _placed(capsule: LinkCapsule, T: Array) -> Sphere | Capsule:
    a, b = (T[:3, :3] @ end + T[:3, 3] for end in (capsule.a, capsule.b))
    return Sphere(a, capsule.radius) if np.array_equal(a, b) else Capsule(a, b, capsule.radius)


def pose_times(trajectory: AnyTrajectory, count: int) -> Array:
    """Return so many times (count,) [s] between start and end at which the end effector is equally far along its path."""
    t = np.linspace(0.0, trajectory.duration, 513)
    steps = np.linalg.norm(np.diff(trajectory.tip(t)[:, :3, 3], axis=0), axis=1)
    gone = np.concatenate([[0.0], np.cumsum(steps)])
    shares = np.arange(1, count + 1) / (count + 1)
    return np.interp(shares * gone[-1], gone, t) if gone[-1] > 0 else shares * trajectory.duration
