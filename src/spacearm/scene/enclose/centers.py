"""Where balls may be centred that hold a part of a body, and by how much they then stand out of it.

A ball about a point at depth d inside a solid stands out by no more than its radius - d; about a point at a distance d from
what is enclosed by no more than its radius + d. So deep points are good centres: those of the medial axis, and those
between it and the surface.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spacearm.scene.enclose.box_tree import Array
from spacearm.scene.enclose.cells import Cells, Test
from spacearm.scene.enclose.surface import Surface

_SHARES = (1.0, 0.7, 0.5, 0.35, 0.25, 0.12, 0.06)  # of the way from the surface to the medial axis
_SAMPLE = 200


@dataclass(frozen=True, slots=True)
class Body:
    """What is to be enclosed.

    Attributes:
        triangles: (n, 3, 3) of its surface [m].
        surface: measures distances from them; None if they are all points.
        inside: tells what is inside; None of what has no inside.
    """

    triangles: Array
    surface: Surface | None
    inside: Test | None

    def depth(self, points: Array, cells: Cells) -> tuple[Array, Array]:
        """Return how deep points (k, 3), one a cell, are inside (k,), below 0 outside [m], and where the surface is nearest.

        Of points only the cell's own are looked at: the nearest of all may be nearer.
        """
        if self.surface is None:
            away = np.linalg.norm(cells.points - np.repeat(points, np.diff(cells.start), axis=0), axis=1)
            return -np.minimum.reduceat(away, cells.start[:-1]), points
        distance, nearest = self.surface.nearest(points)
        if self.inside is None:
            return -distance, nearest
        return np.where(self.inside(points), distance, -distance), nearest


@dataclass(frozen=True, slots=True)
class Centers:
    """For each cell, where a ball that holds it may be centred.

    Attributes:
        best: (k, 3) the centre of the ball for this cell alone that stands out least [m].
        best_depth: (k,) its depth [m].
        excess: (k,) by how much that ball stands out [m].
        anchor: (k, 3) a point of the surface in or near each cell [m].
        inward: (k, 3) unit vectors from there to the medial axis.
        room: (k,) how far that is [m]; 0 where there is no inside.
        slack: (k,) the depth on the way from the anchor to the medial axis is the way gone, less this [m].
    """

    best: Array
    best_depth: Array
    excess: Array
    anchor: Array
    inward: Array
    room: Array
    slack: Array

    def take(self, which: NDArray[np.bool_]) -> Centers:
        """Return those of some of the cells."""
        return Centers(*(getattr(self, name)[which] for name in Centers.__slots__))

    def candidates(self, excess: float) -> tuple[Array, Array]:
        """Return centres (c, 3) and their depths (c,) [m] that are worth trying for balls of an excess [m]."""
        centers, depths = [self.best], [self.best_depth]
        for way in (self.room, 0.5 * self.room, *(np.full(len(self.room), factor * excess) for factor in (0.6, 1.2, 2.4))):
            fits = (self.room >= way) & (way > self.slack)
            centers.append(self.anchor[fits] + way[fits, None] * self.inward[fits])
            depths.append(way[fits] - self.slack[fits])
        return np.concatenate(centers), np.concatenate(depths)


def joined_centers(parts: list[Centers]) -> Centers:
    """Return the centres of several lists of cells in one."""
    return Centers(*(np.concatenate([getattr(part, name) for part in parts]) for name in Centers.__slots__))


def centers_for(body: Body, cells: Cells, *, tolerance: float) -> Centers:
    """Find where balls for each cell may be centred; the medial axis to a tolerance [m]."""
    best = _middle(cells)
    best_depth, nearest = body.depth(best, cells)
    excess = _reach(cells, best) - best_depth
    anchor, inward = nearest, np.zeros_like(best)
    room, slack = np.zeros(len(best)), np.zeros(len(best))
    if body.inside is not None:
        anchor, inward = _anchors(cells, best, nearest)
        room, slack = _room(body, anchor, inward, tolerance)
        for share in _SHARES:
            way = share * room
            center, depth = anchor + way[:, None] * inward, way - slack
            own = _reach(cells, center) - depth
            better = (room > 0) & (own < excess)
            excess, best_depth = np.where(better, own, excess), np.where(better, depth, best_depth)
            best = np.where(better[:, None], center, best)
    return Centers(best, best_depth, excess, anchor, inward, room, slack)


def _reach(cells: Cells, centers: Array) -> Array:
    """Return the radius that holds each cell from its centre (k, 3), (k,) [m]."""
    away = cells.points - np.repeat(centers, np.diff(cells.start), axis=0)
    return np.sqrt(np.maximum.reduceat(np.einsum("ij,ij->i", away, away), cells.start[:-1]))


def _middle(cells: Cells) -> Array:
    """Return nearly the centres of the least balls that hold each cell (steps towards the farthest point)."""
    center = (cells.low + cells.high) / 2
    cell = np.repeat(np.arange(len(center)), np.diff(cells.start))
    for step in range(2, 10):
        away = cells.points - center[cell]
        squared = np.einsum("ij,ij->i", away, away)
        farthest = np.flatnonzero(squared == np.maximum.reduceat(squared, cells.start[:-1])[cell])
        far = np.empty_like(center)
        far[cell[farthest]] = cells.points[farthest]
        center = center + (far - center) / (step + 1)
    return center


def _anchors(cells: Cells, middle: Array, nearest: Array) -> tuple[Array, Array]:
    """Return a point of the surface for each cell, (k, 3), and the unit vector from it into the solid, (k, 3).

    It is on the cell's largest polygon; of a cell without one it is the point nearest to the middle.
    """
    anchor = nearest.copy()
    inward = middle - nearest
    inward = inward / np.maximum(np.linalg.norm(inward, axis=1), 1e-300)[:, None]
    polygons = cells.polygons
    if len(polygons.count):
        corners = polygons.corners - polygons.corners[:, :1]
        area = np.zeros((len(corners), 3))
        for i in range(1, corners.shape[1] - 1):
            area += np.cross(corners[:, i], corners[:, i + 1])
        size = np.linalg.norm(area, axis=1)
        order = np.lexsort((size, polygons.cell))
        last = order[np.flatnonzero(np.diff(polygons.cell[order], append=-1))]
        last = last[size[last] > 0]
        anchor[polygons.cell[last]] = polygons.corners[last].mean(axis=1)
        inward[polygons.cell[last]] = -area[last] / size[last, None]
    return anchor, inward


def _room(body: Body, anchor: Array, inward: Array, tolerance: float) -> tuple[Array, Array]:
    """Return the radius of the largest ball inside that touches the surface at each anchor, (m,) [m], and its slack (m,).

    It shrinks from too large a ball: the nearest point of the surface to its centre is to be on the next one. By the slack
    the ball is smaller than what would touch the anchor.
    """
    corners = body.triangles
    sample = corners[:: max(1, len(corners) // _SAMPLE)].mean(axis=1)
    radius = np.full(len(anchor), float((corners.max(axis=(0, 1)) - corners.min(axis=(0, 1))).max()))
    for point in sample:
        radius = np.minimum(radius, _touching(anchor, inward, point))
    room, slack = np.zeros(len(anchor)), np.zeros(len(anchor))
    todo = np.flatnonzero(radius > tolerance)
    assert body.surface is not None
    assert body.inside is not None
    for _ in range(8):
        distance, nearest = body.surface.nearest(anchor[todo] + radius[todo, None] * inward[todo])
        fits = distance >= radius[todo] - tolerance
        done = todo[fits]
        room[done], slack[done] = radius[done], radius[done] - np.minimum(distance[fits], radius[done])
        todo, nearest = todo[~fits], nearest[~fits]
        radius[todo] = np.minimum(radius[todo] - tolerance / 2, _touching(anchor[todo], inward[todo], nearest))
        todo = todo[radius[todo] > tolerance]
        if not todo.size:
            break
    found = np.flatnonzero(room)
    room[found[~body.inside(anchor[found] + room[found, None] * inward[found])]] = 0.0
    return room, slack


def _touching(anchor: Array, inward: Array, point: Array) -> Array:
    """Return the radius of the ball that touches the surface at each anchor and has a point on it; infinite if none has."""
    away = point - anchor
    along = 2 * np.einsum("ij,ij->i", away, inward)
    squared = np.einsum("ij,ij->i", away, away)
    ahead = along > 1e-9 * np.sqrt(squared)
    return np.where(ahead, squared / np.where(ahead, along, 1.0), np.inf)
