"""A tree of boxes over many items, searched for many queries at once: what is nearest, what a ball meets.

The items are sorted along a Morton curve and paired up level by level, so a node is a range of items and the tree a few
arrays. A search holds all pairs of query and node of one level and goes down with those that may still matter.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

_LEAF = 4  # items in a node of the lowest level


class BoxTree:
    """Boxes of items, and of their groups.

    Attributes:
        order: (n,) the items as the tree holds them.
        levels: lower and upper corners (nodes, 3) [m], the root's level first; empty nodes are inside out.
    """

    def __init__(self, low: Array, high: Array) -> None:
        """Build the tree of n boxes, (n, 3) lower and upper corners each [m]."""
        count = len(low)
        self.order = np.argsort(_morton((low + high) / 2), kind="stable")
        leaves = 1 << max(0, int(np.ceil(np.log2(max(1, count) / _LEAF))))
        padded = np.full((leaves * _LEAF, 3), np.inf)
        padded[:count] = low[self.order]
        least = padded.reshape(leaves, _LEAF, 3).min(axis=1)
        padded[:] = -np.inf
        padded[:count] = high[self.order]
        greatest = padded.reshape(leaves, _LEAF, 3).max(axis=1)
        self.levels = [(least, greatest)]
        while len(least) > 1:
            least, greatest = least.reshape(-1, 2, 3).min(axis=1), greatest.reshape(-1, 2, 3).max(axis=1)
            self.levels.insert(0, (least, greatest))

    def items(self, leaves: Indices) -> tuple[Indices, Indices]:
        """Return (places in `leaves`, items) for nodes of the lowest level, each with all its items."""
        slots = leaves[:, None] * _LEAF + np.arange(_LEAF)
        row, column = np.nonzero(slots < len(self.order))
        return row, self.order[slots[row, column]]

    def leaves_within(self, points: Array, reach: Array) -> tuple[Indices, Indices]:
        """Return all pairs (point, lowest node) no farther apart than the point's reach (m,) [m]."""
        point, node, squared = np.arange(len(points)), np.zeros(len(points), dtype=np.intp), reach**2
        for level, (least, greatest) in enumerate(self.levels):
            if level:
                point, node = np.repeat(point, 2), (2 * node[:, None] + np.arange(2)).ravel()
            kept = squared_distance(points[point], least[node], greatest[node]) <= squared[point]
            point, node = point[kept], node[kept]
        return point, node

    def first_leaf(self, points: Array) -> Indices:
        """Return for each point (m, 3) a lowest node that is probably near."""
        node = np.zeros(len(points), dtype=np.intp)
        for least, greatest in self.levels[1:]:
            near = [squared_distance(points, least[2 * node + i], greatest[2 * node + i]) for i in (0, 1)]
            node = 2 * node + (near[1] < near[0])
        return node


def squared_distance(points: Array, low: Array, high: Array) -> Array:
    """Return the squared distance of each point (m, 3) from its box [m^2]; of an empty box it is infinite."""
    out = np.zeros(len(points))
    for axis in range(3):
        x = points[:, axis]
        gap = np.maximum(np.maximum(low[:, axis] - x, x - high[:, axis]), 0.0)
        out += gap * gap
    return out


def _morton(points: Array) -> NDArray[np.uint64]:
    """Return a number for each point (n, 3), near for points that are near."""
    low = points.min(axis=0)
    size = max(float((points.max(axis=0) - low).max()), 1e-300)
    cell = np.clip((points - low) / size * (2**20 - 1), 0, 2**20 - 1).astype(np.uint64)
    code = np.zeros(len(points), dtype=np.uint64)
    for axis in range(3):
        x = cell[:, axis]
        for shift, mask in ((32, 0x1F00000000FFFF), (16, 0x1F0000FF0000FF), (8, 0x100F00F00F00F00F), (4, 0x10C30C30C30C30C3)):
            x = (x | (x << np.uint64(shift))) & np.uint64(mask)
        x = (x | (x << np.uint64(2))) & np.uint64(0x1249249249249249)
        code |= x << np.uint64(axis)
    return code
