"""How quickly the base's attitude becomes right as steps become short: what is behind the choice of method."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from spacearm.core.rotations import angle, conjugate, exponential, multiplied, running_products
from spacearm.dynamics.base_motion import NODES, BaseMotion, JointPath, step_turn
from spacearm.dynamics.momentum import free_rate, moments
from spacearm.robot import Robot

Array = NDArray[np.float64]


class Convergence(NamedTuple):
    """Errors of the final attitude.

    Attributes:
        steps: (k,) equal ones, over the whole path.
        errors: by the method's order, (k,) [rad] each.
        evaluations: by the method's order, (k,) of the momentum map.
    """

    steps: NDArray[np.int64]
    errors: dict[int, Array]
    evaluations: dict[int, NDArray[np.int64]]


def convergence(
    robot: Robot, curve: JointPath, *, steps: Sequence[int] = (2, 4, 8, 16, 32, 64, 128, 256, 512, 1024)
) -> Convergence:
    """Measure Magnus's series of order 2 (the midpoint rule), 4 and 6 against an adaptive integration.

    Args:
        robot: whose base floats, without momentum.
        curve: the path of its joints.
        steps: numbers of equal ones; multiples of the number of the path's pieces show the orders best.

    Raises:
        RobotError: masses that cannot be, or a path for another number of joints.
    """
    begin, end = curve.domain
    right = BaseMotion(robot, curve, tolerance=1e-13).pose(end)[1]
    counts = np.array(steps, dtype=np.int64)
    errors = {order: np.zeros(len(counts)) for order in NODES}
    for i, count in enumerate(counts):
        ends = np.linspace(begin, end, count + 1)
        for order, nodes in NODES.items():
            length = np.diff(ends)
            at = ends[:-1, None] + length[:, None] * nodes
            rates = free_rate(moments(robot, curve.sample(at)), curve.sample(at, 1))
            final = running_products(exponential(step_turn(rates, length, order)))[-1]
            errors[order][i] = angle(multiplied(conjugate(right), final))
    return Convergence(counts, errors, {order: counts * len(nodes) for order, nodes in NODES.items()})
