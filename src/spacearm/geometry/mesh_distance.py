"""How far points are from a surface of triangles, from segments, or from a cloud of points."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

# ---- A tree of boxes over many items, searched for many queries at once: what is nearest, what a ball meets ----------
#
# The items are sorted along a Morton curve and paired up level by level, so a node is a range of items and the tree a
# few arrays. A search holds all pairs of query and node of one level and goes down with those that may still matter.

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


# ---- How far points are from a surface of triangles, from segments, or from a cloud of points ------------------------

_CHUNK = 20_000  # queries at once, for the memory's sake
_FLAT = 1e-9  # a triangle no higher than this share of its longest side is taken for that side


class Surface:
    """Triangles, some of which may be segments or points, in trees that find the nearest."""

    def __init__(self, triangles: Array) -> None:
        """Take triangles (n, 3, 3), at least one [m]."""
        sides = np.roll(triangles, -1, axis=1) - triangles
        length = np.linalg.norm(sides, axis=2)
        longest = length.argmax(axis=1)
        area = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
        flat = area <= _FLAT * length.max(axis=1) ** 2
        start, end = triangles[flat, longest[flat]], triangles[flat, (longest[flat] + 1) % 3]
        self._parts: list[_Triangles | _Segments] = []
        if not flat.all():
            self._parts.append(_Triangles(triangles[~flat]))
        if flat.any():
            self._parts.append(_Segments(*_distinct(start, end)))

    def nearest(self, points: Array) -> tuple[Array, Array]:
        """Return for points (m, 3) the distance (m,) and the nearest point of the surface (m, 3) [m]."""
        distance, at = self._parts[0].nearest(points)
        for part in self._parts[1:]:
            other, there = part.nearest(points)
            nearer = other < distance
            distance[nearer], at[nearer] = other[nearer], there[nearer]
        return distance, at


class _Triangles:
    """Triangles in Coal's tree."""

    def __init__(self, triangles: Array) -> None:
        import coal  # pyright: ignore[reportMissingImports]

        self._coal: Any = coal
        tree = coal.BVHModelOBBRSS()
        tree.beginModel(len(triangles), 3 * len(triangles))
        tree.addVertices(np.ascontiguousarray(triangles.reshape(-1, 3)))
        tree.addTriangles(np.arange(3 * len(triangles), dtype=np.uint32).reshape(-1, 3))
        tree.endModel()
        self._tree = tree

    def nearest(self, points: Array) -> tuple[Array, Array]:
        coal = self._coal
        point, here, there = coal.Sphere(0.0), coal.Transform3s(), coal.Transform3s()
        request, result = coal.DistanceRequest(), coal.DistanceResult()
        at = np.empty((len(points), 3))
        for i, place in enumerate(points):
            there.setTranslation(place)
            result.clear()
            coal.distance(self._tree, here, point, there, request, result)
            at[i] = result.getNearestPoint1()
        return np.linalg.norm(at - points, axis=1), at


class _Segments:
    """Segments and points in a tree of boxes."""

    def __init__(self, start: Array, end: Array) -> None:
        self._start, self._along = start, end - start
        length2 = np.einsum("ij,ij->i", self._along, self._along)
        self._length2 = np.where(length2 > 0, length2, 1.0)
        self._tree = BoxTree(np.minimum(start, end), np.maximum(start, end))

    def nearest(self, points: Array) -> tuple[Array, Array]:
        distance, at = np.full(len(points), np.inf), np.zeros((len(points), 3))
        for i in range(0, len(points), _CHUNK):
            part = slice(i, i + _CHUNK)
            near = self._tree.first_leaf(points[part])
            self._take(points[part], np.arange(len(near)), near, distance[part], at[part])
            self._take(points[part], *self._tree.leaves_within(points[part], distance[part]), distance[part], at[part])
        return distance, at

    def _take(self, points: Array, point: Indices, leaf: Indices, best: Array, found: Array) -> None:
        """Compare with the segments of leaves, and keep what is nearer than the best so far."""
        place, item = self._tree.items(leaf)
        point = point[place]
        start, along = self._start[item], self._along[item]
        share = np.clip(np.einsum("ij,ij->i", points[point] - start, along) / self._length2[item], 0.0, 1.0)
        at = start + share[:, None] * along
        distance = np.linalg.norm(at - points[point], axis=1)
        order = np.lexsort((distance, point))
        point, distance, at = point[order], distance[order], at[order]
        first = np.flatnonzero(np.diff(point, prepend=-1))
        point, distance, at = point[first], distance[first], at[first]
        nearer: NDArray[np.bool_] = distance < best[point]
        best[point[nearer]], found[point[nearer]] = distance[nearer], at[nearer]


def _distinct(start: Array, end: Array) -> tuple[Array, Array]:
    both = np.unique(np.concatenate([start, end], axis=1), axis=0)
    return both[:, :3], both[:, 3:]
