"""How far points are from a surface of triangles, or from a cloud of points."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np

from spacearm.scene.enclose.box_tree import Array, BoxTree, Indices

_CHUNK = 20_000  # queries at once, for the memory's sake


class Surface(Protocol):
    """What points have a distance from."""

    def nearest(self, points: Array) -> tuple[Array, Array]:
        """Return for points (m, 3) the distance (m,) and the nearest point of the surface (m, 3) [m]."""
        ...


def surface_of(triangles: Array) -> Surface:
    """Return what measures distances from triangles (n, 3, 3), or from their corners if none has an area [m].

    Segments and points among triangles that have an area are left out, so that a distance may be too great, but for a solid,
    whose boundary they are not.
    """
    normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    proper = normal.any(axis=1)
    return Triangles(triangles[proper]) if proper.any() else Points(np.unique(triangles.reshape(-1, 3), axis=0))


class Triangles:
    """Triangles in Coal's tree of boxes."""

    def __init__(self, triangles: Array) -> None:
        """Take triangles (n, 3, 3), each with an area [m]."""
        import coal

        self._coal: Any = coal
        tree = coal.BVHModelOBBRSS()
        tree.beginModel(len(triangles), 3 * len(triangles))
        tree.addVertices(np.ascontiguousarray(triangles.reshape(-1, 3)))
        tree.addTriangles(np.arange(3 * len(triangles), dtype=np.uint32).reshape(-1, 3))
        tree.endModel()
        self._tree = tree

    def nearest(self, points: Array) -> tuple[Array, Array]:
        """Return for points (m, 3) the distance (m,) and the nearest point of the triangles (m, 3) [m]."""
        coal = self._coal
        point, here, there = coal.Sphere(0.0), coal.Transform3s(), coal.Transform3s()
        request, result = coal.DistanceRequest(), coal.DistanceResult()
        distance, at = np.empty(len(points)), np.empty((len(points), 3))
        for i, place in enumerate(points):
            there.setTranslation(place)
            result.clear()
            coal.distance(self._tree, here, point, there, request, result)
            at[i] = result.getNearestPoint1()
        np.sqrt(np.einsum("ij,ij->i", at - points, at - points), out=distance)
        return distance, at


class Points:
    """Points in a tree of boxes."""

    def __init__(self, points: Array) -> None:
        """Take points (n, 3), at least one [m]."""
        self._points, self._tree = points, BoxTree(points, points)

    def nearest(self, points: Array) -> tuple[Array, Array]:
        """Return for points (m, 3) the distance (m,) and the nearest of the points (m, 3) [m]."""
        if len(points) > _CHUNK:
            parts = [self.nearest(points[i : i + _CHUNK]) for i in range(0, len(points), _CHUNK)]
            return np.concatenate([part[0] for part in parts]), np.concatenate([part[1] for part in parts])
        best, found = np.full(len(points), np.inf), np.zeros(len(points), dtype=np.intp)
        self._take(points, np.arange(len(points)), self._tree.first_leaf(points), best, found)
        self._take(points, *self._tree.leaves_within(points, best), best, found)
        return best, self._points[found]

    def _take(self, points: Array, point: Indices, leaf: Indices, best: Array, found: Indices) -> None:
        """Compare with the points of leaves, and keep what is nearer than the best so far."""
        place, item = self._tree.items(leaf)
        point = point[place]
        distance = np.linalg.norm(self._points[item] - points[point], axis=1)
        order = np.lexsort((distance, point))
        point, distance, item = point[order], distance[order], item[order]
        first = np.flatnonzero(np.diff(point, prepend=-1))
        point, distance, item = point[first], distance[first], item[first]
        nearer = distance < best[point]
        best[point[nearer]], found[point[nearer]] = distance[nearer], item[nearer]
