"""Magnus's series for turning frames: one rotation vector for a step, from the rates at Gauss's nodes.

With rates omega in the turning axes, R' = R [omega]x, a step is R exp([turn]x). Commutators are cross products. Blanes, Casas,
Oteo and Ros, The Magnus expansion and some of its applications, 2009, section 5.
"""

from __future__ import annotations

from math import sqrt

import numpy as np
from numpy.typing import NDArray

from spacearm._kernel.exact import inverse3, powers, product
from spacearm.momentum.turning import cross

Array = NDArray[np.float64]

NODES: dict[int, Array] = {
    2: np.array([1 / 2]),
    4: np.array([1 / 2 - sqrt(3) / 6, 1 / 2 + sqrt(3) / 6]),
    6: np.array([1 / 2 - sqrt(15) / 10, 1 / 2, 1 / 2 + sqrt(15) / 10]),
}
"""Where in a step, from 0 to 1, a method of each order asks for the rates."""


def step_turn(rates: Array, length: Array, order: int = 6) -> Array:
    """Return the rotation vectors (..., 3) [rad] of steps.

    Args:
        rates: (..., nodes, 3) at the order's nodes, per unit of the length, in the turning axes.
        length: (...,) of each step.
        order: 2, 4 or 6: errors of a whole motion fall by 2^order when steps are halved.
    """
    turns = rates * length[..., None, None]
    if order == 2:
        return turns[..., 0, :]
    if order == 4:
        first, last = turns[..., 0, :], turns[..., 1, :]
        return (first + last) / 2 + sqrt(3) / 12 * cross(first, last)
    first, middle, last = turns[..., 0, :], turns[..., 1, :], turns[..., 2, :]
    # The equation solved in the book is that of R^T, whose matrix is -[omega]x.
    a1, a2, a3 = -middle, -sqrt(15) / 3 * (last - first), -10 / 3 * (last - 2 * middle + first)
    c1 = cross(a1, a2)
    c2 = -cross(a1, 2 * a3 + c1) / 60
    return -(a1 + a3 / 12 + cross(-20 * a1 - a3 + c1, a2 + c2) / 240)


def _partial() -> Array:
    """Return the rates at the nodes of each part from 0 to a node, of those at the step's nodes: parabolas through these."""
    nodes = NODES[6]
    return product(powers(nodes[:, None] * nodes, 2), inverse3(powers(nodes, 2)))  # (part, node, power) by (power, node)


PARTIAL = _partial()
