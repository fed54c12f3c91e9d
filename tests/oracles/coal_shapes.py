"""Distances by Coal: the one place where shapes are converted."""

from __future__ import annotations

import coal
import numpy as np

from spacearm.robot import LinkCapsule
from spacearm.scene import Sphere


def frame_along(z: np.ndarray) -> np.ndarray:
    """A rotation (3, 3) whose z column is the direction given."""
    z = z / np.linalg.norm(z)
    x = np.cross(np.eye(3)[np.argmin(np.abs(z))], z)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])


def capsule_clearance(a: np.ndarray, b: np.ndarray, radius: float, ball: Sphere) -> float:
    """Signed distance [m] of a capsule, axis from a to b, and a ball; Coal has a closed form for this pair."""
    length = float(np.linalg.norm(b - a))
    R = frame_along(b - a) if length > 0 else np.eye(3)
    return coal.distance(
        coal.Capsule(radius, length),
        coal.Transform3s(R, (a + b) / 2),
        coal.Sphere(float(ball.radius)),
        coal.Transform3s(np.eye(3), np.array(ball.center)),
        coal.DistanceRequest(),
        coal.DistanceResult(),
    )


def clearances(frames: np.ndarray, capsules: tuple[LinkCapsule, ...], balls: tuple[Sphere, ...]) -> np.ndarray:
    """Signed distances (rows, capsules, balls) [m]; frames (rows, joints, 4, 4) are the moving frames."""
    out = np.empty((len(frames), len(capsules), len(balls)))
    for row, T in enumerate(frames):
        for i, link in enumerate(capsules):
            T_base_joint = np.eye(4) if link.joint < 0 else T[link.joint]
            a, b = (T_base_joint[:3, :3] @ end + T_base_joint[:3, 3] for end in (link.a, link.b))
            for k, ball in enumerate(balls):
                out[row, i, k] = capsule_clearance(a, b, link.radius, ball)
    return out
