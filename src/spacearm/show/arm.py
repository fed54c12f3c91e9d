"""The arm as a drawing: its links as segments between joint centres, and its envelope."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm.motion import Trajectory
from spacearm.robot import LinkCapsule, Robot, forward_kinematics, joint_frames
from spacearm.scene import Capsule, Sphere

Array = NDArray[np.float64]

_COINCIDENT = 1e-9  # [m] shorter segments are none: a spherical joint's three origins are one centre


def skeleton(robot: Robot, q: ArrayLike) -> Array:
    """Return the segments from joint centre to joint centre, and to the tip.

    Args:
        robot: the robot.
        q: (n,) one configuration [rad or m].

    Returns:
        (s, 2, 3) their ends, base frame [m]; those without length are left out.
    """
    at = joint_frames(robot, q)[:, :3, 3]
    base = np.zeros(3)
    pairs = [(base if joint.parent < 0 else at[joint.parent], at[i]) for i, joint in enumerate(robot.joints)]
    tip = robot.frame(robot.tip)
    pairs.append((base if tip.joint < 0 else at[tip.joint], forward_kinematics(robot, q)[:3, 3]))
    segments = np.array(pairs)
    return segments[np.linalg.norm(segments[:, 1] - segments[:, 0], axis=1) > _COINCIDENT]


def tips(robot: Robot, q: ArrayLike) -> Array:
    """Return where the end effector is, (..., 3) [m], for configurations (..., n) [rad or m]."""
    return forward_kinematics(robot, q)[..., :3, 3]


def envelope(robot: Robot, q: ArrayLike) -> tuple[Sphere | Capsule, ...]:
    """Return the capsules that have a radius, also of what is held, where they are in one configuration (n,) [rad or m]."""
    frames = joint_frames(robot, q)
    return tuple(_placed(c, frames) for c in robot.capsules if c.radius > 0)


def _placed(capsule: LinkCapsule, frames: Array) -> Sphere | Capsule:
    T = np.eye(4) if capsule.joint < 0 else frames[capsule.joint]
    a, b = (T[:3, :3] @ end + T[:3, 3] for end in (capsule.a, capsule.b))
    return Sphere(a, capsule.radius) if np.array_equal(a, b) else Capsule(a, b, capsule.radius)


def pose_times(trajectory: Trajectory, count: int) -> Array:
    """Return so many times (count,) [s] between start and end at which the end effector is equally far along its path."""
    t = np.linspace(0.0, trajectory.duration, 513)
    steps = np.linalg.norm(np.diff(tips(trajectory.robot, trajectory.sample(t).q), axis=0), axis=1)
    gone = np.concatenate([[0.0], np.cumsum(steps)])
    shares = np.arange(1, count + 1) / (count + 1)
    return np.interp(shares * gone[-1], gone, t) if gone[-1] > 0 else shares * trajectory.duration
