"""The momentum of a moving robot by the kernel, in float64: what the blocks give, many times quicker, for given rates."""

from __future__ import annotations

from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from spacearm.momentum.masses import lumped_masses
from spacearm.robot import Robot
from spacearm.robot.kinematics import tree_model

Array = NDArray[np.float64]


class Moving(NamedTuple):
    """A robot whose joints move, its base held at rest, in base axes; m of them.

    Attributes:
        center: (m, 3) centre of mass of base and arm [m].
        center_rate: (m, 3) how it moves.
        arm: (m, 3) angular momentum about it.
        H_w: (m, 3, 3) inertia of the whole about it [kg m^2].
        free_rate: (m, 3) how the base would turn if it were let go and the whole had no angular momentum.
    """

    center: Array
    center_rate: Array
    arm: Array
    H_w: Array
    free_rate: Array


def moving(robot: Robot, q: Array, dq: Array) -> Moving:
    """Return the momentum of a robot whose masses have been checked.

    Args:
        robot: with n degrees of freedom.
        q, dq: (m, n) configurations and rates, per whatever they are per.
    """
    rows = np.asarray(_native(robot).momentum_terms(np.ascontiguousarray(q), np.ascontiguousarray(dq)))
    H_w = rows[:, [6, 9, 10, 9, 7, 11, 10, 11, 8]].reshape(-1, 3, 3)
    return Moving(rows[:, :3], rows[:, 15:], rows[:, 3:6], H_w, rows[:, 12:15])


def kernel_masses(robot: Robot) -> dict[str, Array]:
    """Return the masses of a robot as the kernel takes them: a row for the base, then one for each joint."""
    pseudo = lumped_masses(robot).pseudo
    mass = pseudo[:, 3, 3]
    com = pseudo[:, :3, 3] / np.where(mass > 0, mass, 1.0)[:, None]
    second = pseudo[:, :3, :3] - mass[:, None, None] * com[:, :, None] * com[:, None, :]
    inertia = np.trace(second, axis1=1, axis2=2)[:, None, None] * np.eye(3) - second
    return {"mass": mass.copy(), "com": com, "inertia": inertia[:, [0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]].copy()}


@lru_cache(maxsize=32)
def _native(robot: Robot) -> Any:
    return tree_model(robot).weighed(**kernel_masses(robot))
