"""How far points are from a surface of triangles, from segments, or from a cloud of points."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from spacearm.scene.enclose.box_tree import Array, BoxTree, Indices

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
