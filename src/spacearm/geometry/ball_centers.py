"""Cells of what is to be enclosed, and where a ball that holds a cell may be centred.

Cells are boxes along the axes, halved again and again. Each holds corner points: those of the triangles' parts in it, and its
own corners that are inside a solid. Their convex hull holds everything of the surface and of the solid that is in the cell,
because an extreme point of what a cell and a solid have in common is a corner of the cell or on the surface. So a ball that
holds the corner points holds it too.

A ball about a point at depth d inside a solid stands out by no more than its radius - d; about a point at a distance d from
what is enclosed by no more than its radius + d. So deep points are good centres: those of the medial axis, and those between
it and the surface.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from spacearm.geometry.mesh_queries import Array, Indices, Surface

Test: TypeAlias = Callable[[Array], NDArray[np.bool_]]
"""Tells whether each point (m, 3) is inside a solid; of points on its surface either may be said."""

_SHARES = (1.0, 0.7, 0.5, 0.35, 0.25, 0.12, 0.06)  # of the way from the surface to the medial axis: centres that are tried
_SAMPLE = 200  # triangles from which a first radius of the ball that touches the surface is taken
_CORNERS = np.array([[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)], dtype=bool)


@dataclass(frozen=True, slots=True)
class Polygons:
    """Convex polygons, sorted by the cell they are in.

    Attributes:
        corners: (m, v, 3); those beyond a polygon's count repeat its last [m].
        count: (m,) corners of each.
        cell: (m,) the cell it is in.
    """

    corners: Array
    count: Indices
    cell: Indices

    def take(self, which: NDArray[np.bool_] | Indices) -> Polygons:
        """Return some of them."""
        return Polygons(self.corners[which], self.count[which], self.cell[which])


@dataclass(frozen=True, slots=True)
class Cells:
    """Boxes and what is in them; every box has at least one corner point.

    Attributes:
        polygons: of the surface.
        points: (p, 3) corner points, cell by cell [m].
        start: (k + 1,) where each cell's begin.
        low, high: (k, 3) corners of the boxes, which are as tight as the corner points allow [m].
    """

    polygons: Polygons
    points: Array
    start: Indices
    low: Array
    high: Array

    def __len__(self) -> int:
        return len(self.low)

    def take(self, which: NDArray[np.bool_]) -> Cells:
        """Return some of the cells with what is in them."""
        count = np.diff(self.start)
        kept = self.polygons.take(which[self.polygons.cell])
        number = np.cumsum(which) - 1
        return Cells(
            Polygons(kept.corners, kept.count, number[kept.cell]),
            self.points[np.repeat(which, count)],
            np.concatenate([[0], np.cumsum(count[which])]),
            self.low[which],
            self.high[which],
        )

    def halved(self, inside: Test | None, *, unit: Array) -> Cells:
        """Cut every cell across its longest side; keep those halves that hold a part of the surface or are inside.

        A side longer than its unit (k,) [m] is cut so that in the end it is in as few equal parts as are no longer than it.
        """
        cell = np.arange(len(self))
        axis = np.argmax(self.high - self.low, axis=1)
        first, last = self.low[cell, axis], self.high[cell, axis]
        units = np.maximum(np.ceil((last - first) / unit), 2.0)
        at = first + (last - first) * (np.ceil(units / 2) / units)
        low, high = np.repeat(self.low, 2, axis=0), np.repeat(self.high, 2, axis=0)
        high[2 * cell, axis], low[2 * cell + 1, axis] = at, at
        polygons, above = _cut(self.polygons, axis[self.polygons.cell], at[self.polygons.cell])
        half = 2 * polygons.cell + above
        used = np.zeros(2 * len(self), dtype=bool)
        used[half] = True
        if inside is not None:
            empty = np.flatnonzero(~used)
            used[empty] = inside((low[empty] + high[empty]) / 2)
        number = np.cumsum(used) - 1
        order = np.argsort(half, kind="stable")
        sorted_polygons = Polygons(polygons.corners[order], polygons.count[order], number[half[order]])
        return cells_of(sorted_polygons, low[used], high[used], inside)


def cells_of(polygons: Polygons, low: Array, high: Array, inside: Test | None) -> Cells:
    """Make cells of boxes (k, 3) and the polygons in them; without polygons a box must be inside."""
    real = np.arange(polygons.corners.shape[1]) < polygons.count[:, None]
    points, cell = polygons.corners[real], np.repeat(polygons.cell, polygons.count)
    if inside is not None:
        own = np.where(_CORNERS, high[:, None], low[:, None]).reshape(-1, 3)
        kept = inside(own)
        filled = np.ones(len(low), dtype=bool)
        filled[polygons.cell] = False
        kept |= np.repeat(filled, 8)
        points = np.concatenate([points, own[kept]])
        cell = np.concatenate([cell, np.repeat(np.arange(len(low)), 8)[kept]])
    points, cell = _distinct(points, cell)
    start = np.searchsorted(cell, np.arange(len(low) + 1))
    low, high = np.minimum.reduceat(points, start[:-1]), np.maximum.reduceat(points, start[:-1])
    return Cells(polygons, points, start, low, high)


def joined_cells(parts: list[Cells]) -> Cells:
    """Return the cells of several lists in one."""
    first = np.cumsum([0, *(len(part) for part in parts)])
    width = max(part.polygons.corners.shape[1] for part in parts)
    polygons = Polygons(
        np.concatenate([_widened(part.polygons.corners, width) for part in parts]),
        np.concatenate([part.polygons.count for part in parts]),
        np.concatenate([part.polygons.cell + before for part, before in zip(parts, first, strict=False)]),
    )
    counts = np.concatenate([np.diff(part.start) for part in parts])
    return Cells(
        polygons,
        np.concatenate([part.points for part in parts]),
        np.concatenate([[0], np.cumsum(counts)]),
        np.concatenate([part.low for part in parts]),
        np.concatenate([part.high for part in parts]),
    )


def one_cell(triangles: Array, inside: Test | None) -> Cells:
    """Return one cell with all triangles (n, 3, 3) in it [m]."""
    count = np.full(len(triangles), 3, dtype=np.intp)
    polygons = Polygons(triangles, count, np.zeros(len(triangles), dtype=np.intp))
    low, high = triangles.min(axis=(0, 1))[None], triangles.max(axis=(0, 1))[None]
    return cells_of(polygons, low, high, inside)


def _distinct(points: Array, cell: Indices) -> tuple[Array, Indices]:
    """Leave out points that a cell has twice; sort them by cell."""
    order = np.lexsort((points[:, 2], points[:, 1], points[:, 0], cell))
    points, cell = points[order], cell[order]
    new = np.ones(len(cell), dtype=bool)
    new[1:] = (cell[1:] != cell[:-1]) | (points[1:] != points[:-1]).any(axis=1)
    return points[new], cell[new]


def _cut(polygons: Polygons, axis: Indices, at: Array) -> tuple[Polygons, Indices]:
    """Cut polygons by planes across an axis (m,) at a place (m,) [m].

    Returns:
        The parts, and whether each is above (1) or below (0) its plane. A polygon in the plane is below.
    """
    x = np.take_along_axis(polygons.corners, axis[:, None, None], axis=2)[:, :, 0]
    below = x.max(axis=1) <= at
    above = ~below & (x.min(axis=1) >= at)
    through = ~above & ~below
    parts = [polygons.take(below), polygons.take(above)]
    parts += [_clipped(polygons.take(through), x[through] - at[through, None], axis[through], at[through], s) for s in (1, -1)]
    width = max(part.corners.shape[1] for part in parts)
    joined = Polygons(
        np.concatenate([_widened(part.corners, width) for part in parts]),
        np.concatenate([part.count for part in parts]),
        np.concatenate([part.cell for part in parts]),
    )
    return joined, np.repeat([0, 1, 0, 1], [len(part.count) for part in parts])


def _clipped(polygons: Polygons, height: Array, axis: Indices, at: Array, sign: int) -> Polygons:
    """Return the parts of polygons where sign * height <= 0 (Sutherland and Hodgman).

    Every polygon must have such a part; `height` (m, v) is that of its corners above the plane [m].
    """
    rows, width = height.shape
    following = np.arange(1, width + 1) % polygons.count[:, None]
    here, there = polygons.corners, np.take_along_axis(polygons.corners, following[:, :, None], axis=1)
    u, v = sign * height, sign * np.take_along_axis(height, following, axis=1)
    real = np.arange(width) < polygons.count[:, None]
    crossing = real & (((u < 0) & (v > 0)) | ((u > 0) & (v < 0)))
    share = np.where(crossing, u / np.where(crossing, u - v, 1.0), 0.0)
    between = here + share[:, :, None] * (there - here)
    np.put_along_axis(between, np.broadcast_to(axis[:, None, None], (rows, width, 1)), at[:, None, None], axis=2)
    both = np.stack([here, between], axis=2).reshape(rows, 2 * width, 3)
    kept = np.stack([real & (u <= 0), crossing], axis=2).reshape(rows, 2 * width)
    count = kept.sum(axis=1)
    first = np.argsort(~kept, axis=1, kind="stable")[:, : int(count.max(initial=1))]
    column = np.minimum(np.arange(first.shape[1]), count[:, None] - 1)
    chosen = np.take_along_axis(first, column, axis=1)
    return Polygons(np.take_along_axis(both, chosen[:, :, None], axis=1), count, polygons.cell)


def _widened(corners: Array, width: int) -> Array:
    missing = width - corners.shape[1]
    return corners if not missing else np.concatenate([corners, np.repeat(corners[:, -1:], missing, axis=1)], axis=1)


@dataclass(frozen=True, slots=True)
class Body:
    """What is to be enclosed.

    Attributes:
        triangles: (n, 3, 3) of its surface [m].
        surface: measures distances from them; None if they are all points.
        inside: says which points are inside; None without an inside.
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
