"""A surface of triangles: how far points are from it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from spacearm.scene.enclose.box_tree import Array, BoxTree, Indices, squared_distance

_CHUNK = 20_000  # queries at once, for the memory's sake


class Surface:
    """Triangles, and a tree to find the nearest.

    Attributes:
        triangles: (n, 3, 3) corners [m]; a triangle may be a segment or a point.
    """

    def __init__(self, triangles: Array) -> None:
        """Take triangles (n, 3, 3), at least one [m]."""
        self.triangles = triangles
        self._columns = np.ascontiguousarray(np.moveaxis(triangles, 0, 2))  # corner, axis, triangle
        self._low, self._high = triangles.min(axis=1), triangles.max(axis=1)
        self._tree = BoxTree(self._low, self._high)

    def nearest(self, points: Array, *, tolerance: float = 0.0) -> tuple[Array, Array]:
        """Return for points (m, 3) the distance (m,) and the nearest point of the surface (m, 3) [m].

        With a tolerance there may be nearer ones, by no more than it [m].
        """
        if len(points) > _CHUNK:
            parts = [self.nearest(points[i : i + _CHUNK], tolerance=tolerance) for i in range(0, len(points), _CHUNK)]
            return np.concatenate([part[0] for part in parts]), np.concatenate([part[1] for part in parts])
        best, found = np.full(len(points), np.inf), np.zeros((len(points), 3))
        self._take(points, np.arange(len(points)), self._tree.first_leaf(points), best, found)
        point, leaf, away = self._tree.nearest_leaves(points, np.maximum(best - tolerance, 0.0))
        turn = np.arange(len(point)) - np.searchsorted(point, point)
        done, more = 0, 1
        while point.size:  # a few nodes of each point, then those that are still nearer than what was found
            now = turn < done + more
            self._take(points, point[now], leaf[now], best, found)
            kept = ~now & (away <= np.maximum(best - tolerance, 0.0)[point])
            point, leaf, away, turn = point[kept], leaf[kept], away[kept], turn[kept]
            done, more = done + more, 2 * more
        return best, found

    def _take(self, points: Array, point: Indices, leaf: Indices, best: Array, found: Array) -> None:
        """Compare points with the triangles of leaves, and keep what is nearer than the best so far."""
        place, triangle = self._tree.items(leaf)
        point = point[place]
        boxes = squared_distance(points[point], self._low[triangle], self._high[triangle])
        near = boxes <= (best * (1 + 1e-12))[point] ** 2
        point, triangle = point[near], triangle[near]
        at = closest_on_triangles(points[point].T, self._columns[:, :, triangle]).T
        distance = np.linalg.norm(at - points[point], axis=1)
        order = np.lexsort((distance, point))
        point, distance, at = point[order], distance[order], at[order]
        first = np.flatnonzero(np.diff(point, prepend=-1))
        point, distance, at = point[first], distance[first], at[first]
        nearer = distance < best[point]
        best[point[nearer]] = distance[nearer]
        found[point[nearer]] = at[nearer]


def closest_on_triangles(points: Array, triangles: Array) -> Array:
    """Return the nearest point of each triangle (3, 3, m), segment or point, to its point (3, m); corner first, (3, m) [m]."""
    squared, out = np.full(points.shape[1], np.inf), np.empty_like(points)
    for i in range(3):
        start, along = triangles[i], triangles[(i + 1) % 3] - triangles[i]
        length2 = _dot(along, along)
        share = np.clip(_dot(points - start, along) / np.where(length2 > 0, length2, 1.0), 0.0, 1.0)
        _keep_nearer(points, start + share * along, None, squared, out)
    a, b, c = triangles
    normal = _cross(b - a, c - a)
    length2 = _dot(normal, normal)
    foot = points - _dot(points - a, normal) / np.where(length2 > 0, length2, 1.0) * normal
    inside = length2 > 0
    for start, end in ((a, b), (b, c), (c, a)):
        inside &= _dot(_cross(end - start, foot - start), normal) >= 0
    _keep_nearer(points, foot, inside, squared, out)
    return out


def _keep_nearer(points: Array, at: Array, where: NDArray[np.bool_] | None, squared: Array, out: Array) -> None:
    away = points - at
    now = _dot(away, away)
    nearer = now < squared if where is None else where & (now < squared)
    np.copyto(squared, now, where=nearer)
    np.copyto(out, at, where=nearer)


def _dot(a: Array, b: Array) -> Array:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _cross(a: Array, b: Array) -> Array:
    return np.stack([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])
