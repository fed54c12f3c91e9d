"""The paper's objective in plain NumPy, vectorised over configurations: what a kernel is measured against.

Equations (1) to (7), (10) and (11) of Zhang et al. 2022 (doi 10.3390/sym14050938) with rotation matrices, as one writes it
first. Its time on a core says how fast that core is, so that times of different machines can be compared. Needs NumPy only,
and no kernel: the comparisons in `benchmarks/` load it in environments where spacearm is not installed.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Mode = Literal["goal", "literal"]

AXES = "zxyzyxz"  # joint axes at q = 0
LINKS = np.array([0.668, 0.4128, 0.2552])  # (3,) m, along +y at q = 0
OBSTACLES = np.array([[0.5, 0.5, 0.0], [0.4, 0.7, 0.0], [0.2, 0.8, 0.0]])  # (3, 3) m, sphere centres
RADIUS = 0.10  # A_R [m]
GOAL = np.array([0.7, 0.3, 0.0])  # (3,) m
GOAL_TOLERANCE = 1e-3  # m
WEIGHTS = (0.5, 0.25, 0.25)  # of f1, f2, f3
LOWER = np.deg2rad([-160.0, -20.0, -180.0, -150.0, -180.0, -46.0, -80.0])  # (7,) rad
UPPER = np.deg2rad([160.0, 20.0, 180.0, 170.0, 20.0, 20.0, 180.0])  # (7,) rad


def by_matrices(q: Array, mode: Mode = "goal") -> tuple[Array, Array]:
    """Return fitness (4) and violation: matrices joint by joint, `@` over the batch, distances by broadcasting.

    Args:
        q: (n, 7) configurations [rad]; their number type is kept.
        mode: whether the distance to the goal counts as a violation.

    Returns:
        Both (n,).
    """
    links, obstacles, goal = (a.astype(q.dtype) for a in (LINKS, OBSTACLES, GOAL))
    turn = rotation(AXES[0], q[:, 0])
    points = [np.zeros((len(q), 3), q.dtype)]
    for joint in range(1, 8):
        if joint in (3, 4, 7):  # the links lie behind joints 3, 4 and 7
            points.append(points[-1] + links[len(points) - 1] * turn[:, :, 1])
        if joint < 7:
            turn = turn @ rotation(AXES[joint], q[:, joint])
    centres = np.stack(points, axis=1)  # (n, 4, 3)

    offset = obstacles - centres[:, :, None, :]  # (n, 4, 3 obstacles, 3)
    f1 = np.linalg.norm(offset, axis=-1).sum(axis=(1, 2))  # (5)
    along = np.diff(centres, axis=1)[:, :, None, :]  # (n, 3 links, 1, 3)
    t = np.sum(offset[:, :3] * along, axis=-1) / (links**2)[:, None]  # (n, 3 links, 3 obstacles)
    nearest = offset[:, :3] - np.clip(t, 0, 1)[..., None] * along  # (1)-(3): the projection, or an end
    violation = np.maximum(0, RADIUS - np.linalg.norm(nearest, axis=-1)).sum(axis=(1, 2))  # (10), (11)
    return with_goal(f1, np.linalg.norm(centres[:, 3] - goal, axis=-1), violation, mode)


def rotation(axis: str, angle: Array) -> Array:
    """Return rotations about a coordinate axis, (n, 3, 3)."""
    i = "xyz".index(axis)
    j, k = (i + 1) % 3, (i + 2) % 3
    matrix = np.zeros((len(angle), 3, 3), angle.dtype)
    matrix[:, i, i] = 1
    matrix[:, j, j] = matrix[:, k, k] = np.cos(angle)
    matrix[:, k, j] = np.sin(angle)
    matrix[:, j, k] = -matrix[:, k, j]
    return matrix


def with_goal(f1: Array, distance: Array, violation: Array, mode: Mode) -> tuple[Array, Array]:
    """Return the fitness and violation of f1 (n,), the distance to the goal (n,) and the violation (n,) without it."""
    f2 = np.sqrt(distance * distance + 1)  # (6), in 3-D
    fitness = WEIGHTS[0] * f1 + WEIGHTS[1] * f2 + WEIGHTS[2] * distance  # (4), (7)
    if mode == "goal":
        violation = violation + np.maximum(0, distance - GOAL_TOLERANCE)
    return fitness, violation
