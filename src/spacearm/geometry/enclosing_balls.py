"""Balls that enclose a mesh or a point cloud.

The surface of a mesh is enclosed, and what it bounds: an arm inside a module's wall is in collision too. The whole is cut into
cells until each is held by a ball of its own that stands out no more than allowed. Then few balls are chosen greedily: the next
one is that which holds most of the cells not yet held. Nothing is sampled: a ball that holds the corner points of a cell holds
all that is in the cell (`ball_centers`).
"""

from __future__ import annotations

import itertools
import os
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from spacearm.core.checks import as_number, as_pose, as_readonly, as_whole
from spacearm.core.errors import SceneError
from spacearm.geometry.ball_centers import Body, Cells, Centers, centers_for, joined_cells, joined_centers, one_cell
from spacearm.geometry.mesh_queries import Array, Indices, Surface
from spacearm.geometry.mesh_topology import Solid, meant_solid, require_inside
from spacearm.geometry.meshes import LARGEST, scaled_mesh
from spacearm.geometry.shapes import SphereSet

_MOST_SPHERES = 50_000
_FINEST = 1e-9  # [m] shorter lengths are taken for 0
_SHARE = 0.02  # of the size of what is enclosed: the excess where neither excess nor spheres are given
_MOST_CELLS = 150_000
_TOLERANCE = 0.02  # of the excess: accuracy of the medial axis
_STEPS = 4  # bisections of the least excess that a number of balls allows: to 4 %
_AT_ONCE = 20_000  # balls at once, for the memory's sake

Balls = tuple[Array, Array, Array]
"""Centres (k, 3), radii (k,), and by how much each ball stands out (k,), at most [m]."""

_Cut = tuple[Cells, Centers]


def enclose_mesh(
    mesh: str | os.PathLike[str] | Any,
    *,
    spheres: int | None = None,
    excess: float | None = None,
    pose: ArrayLike | None = None,
    scale: ArrayLike = 1.0,
    name: str = "",
    inside: Literal["filled", "oriented", "none"] = "filled",
) -> SphereSet:
    """Enclose a mesh in balls.

    Its surface is enclosed, and what is solid. Meshes are double-sided, mirrored, cracked, or of parts that overlap. So a
    point is solid by any convention: where the surface winds around it, where a ray from it meets the surface an odd number
    of times, where one closed part alone holds it, or where the surface shuts it off from outside. Holes that are small
    against their part (a tenth of its area) are taken for closed. An open mesh is a skin: nothing behind it is solid. The
    result's `notes` say what was found.

    Args:
        mesh: the path of a mesh file (STL, OBJ, PLY, DAE, GLB, ...), a `trimesh.Trimesh`, or triangles (n, 3, 3).
        spheres: how many balls to use at most; the excess is then as small as can be found.
        excess: how far balls may stand out of the mesh, at most [m]. With neither, 2 % of the mesh's size; with both,
            there must be a way to keep both.
        pose: (4, 4), T_w_mesh; a point (3,) is taken for a mesh that is not turned.
        inside: what is solid. "filled": all of the above, so that a tank's inside is solid too. "oriented": where the
            surface winds around, so that a cavity whose faces are turned inward is free; for closed meshes whose faces all
            agree on which side is out. "none": the surface alone.
        scale: of the file's coordinates, before the pose: one number or three (along its x, y and z).
        name: for messages.

    Returns:
        The balls. Their `excess` is an upper bound of how far any of them stands out of what it encloses [m].

    Raises:
        FileFormatError: a file that is missing, or that holds no mesh.
        SceneError: numbers that are not finite, a scale of 0, a mesh whose inside cannot be found in the given way, or an
            excess that takes more than 50,000 balls.
    """
    require_inside(inside)
    read = scaled_mesh(mesh, scale)
    what = f"mesh '{name}'" if name else "the mesh"
    centers, radii, most, notes = _enclosed(read.triangles, spheres, excess, what=what, inside=inside)
    T = as_pose("the mesh's pose", pose, SceneError)
    return SphereSet(centers @ T[:3, :3].T + T[:3, 3], radii, excess=most, name=name, notes=(*read.notes, *notes))


def enclose_points(
    points: ArrayLike,
    *,
    point_radius: float = 0.0,
    spheres: int | None = None,
    excess: float | None = None,
    name: str = "",
) -> SphereSet:
    """Enclose a point cloud in balls.

    Args:
        points: (n, 3), base frame [m].
        point_radius: every point stands for a ball of this radius [m]: about half the distance between neighbours makes a
            surface of them.
        spheres, excess: as for `enclose_mesh`; how far balls stand out of the points' balls.
        name: for messages.

    Raises:
        SceneError: no points, numbers that are not finite, or an excess that takes more than 50,000 balls.
    """
    cloud = as_readonly("points", points, (None, 3), SceneError)
    if not len(cloud):
        raise SceneError("points is empty, expected at least one point (x, y, z)")
    if np.abs(cloud).max() > LARGEST:
        raise SceneError(f"points has coordinates beyond {LARGEST:g} m, expected an arm's surroundings; check the units")
    radius = as_number("point_radius", point_radius, SceneError, at_least=0, unit="m")
    what = f"point cloud '{name}'" if name else "the point cloud"
    triangles = np.repeat(cloud[:, None], 3, axis=1)
    centers, radii, most, _ = _enclosed(triangles, spheres, excess, what=what, inside=None)
    return SphereSet(centers, radii + radius, excess=most, name=name)


def _enclosed(
    triangles: Array, spheres: int | None, excess: float | None, *, what: str, inside: str | None
) -> tuple[Array, Array, float, tuple[str, ...]]:
    """Return centres (k, 3), radii (k,) and the excess of balls that enclose triangles (n, 3, 3) [m], and notes.

    `inside` is as for `enclose_mesh`, None for points.
    """
    most = _MOST_SPHERES if spheres is None else as_whole("spheres", spheres, SceneError, at_least=1, at_most=_MOST_SPHERES)
    wanted = None if excess is None else as_number("excess", excess, SceneError, at_least=_FINEST, unit="m")
    low, high = triangles.min(axis=(0, 1)), triangles.max(axis=(0, 1))
    middle, size = (low + high) / 2, float((high - low).max())
    local = triangles - middle
    rounding = 1e-12 * max(size, float(np.abs(middle).max()))
    if wanted is None and spheres is None:
        wanted = max(_SHARE * size, _FINEST)
    solid = Solid(local, None)
    if size <= _FINEST:  # one place
        found = np.zeros((1, 3)), np.array([size]), np.array([size])
    else:
        body = Body(local, None, None)
        if inside is not None:
            solid = meant_solid(local, inside, what=what, largest=float(np.abs(triangles).max()))
            body = Body(solid.triangles, Surface(solid.triangles), solid.inside)
        found = enclosing_balls(body, size=size, excess=wanted, spheres=most)
    if found is None:
        raise SceneError(
            f"{what}, {size:.3g} m in size, cannot be enclosed to {wanted:g} m with no more than {most:,} balls; "
            "allow a greater excess"
        )
    centers, radii, out = found
    rounding += solid.slack
    radii = np.maximum(radii + rounding, _FINEST)
    return centers + middle, radii, float(out.max()) + rounding + _FINEST, solid.notes


def enclosing_balls(body: Body, *, size: float, excess: float | None, spheres: int) -> Balls | None:
    """Return few balls that together hold all triangles of a body and what is inside of them.

    Args:
        body: about the origin.
        size: of the whole, above 0 [m].
        excess: how far a ball may stand out, at most [m]; None for as little as the number of balls allows.
        spheres: how many balls at most.

    Returns:
        The balls; None if that number is not enough.
    """
    whole = one_cell(body.triangles, body.inside)
    if excess is None:
        return _fewest(body, whole, size, spheres)
    first = centers_for(body, whole, tolerance=_TOLERANCE * excess)
    return _tried(body, (whole, first), excess, min(_MOST_CELLS, 1000 + 30 * spheres), spheres)


def _fewest(body: Body, whole: Cells, size: float, spheres: int) -> Balls | None:
    """Return balls with nearly the least excess that their number allows: halved until they are too few, then bisected."""
    most = min(_MOST_CELLS, 200 + 10 * spheres)  # a ball seldom holds more cells on the average
    first = centers_for(body, whole, tolerance=1e-4 * size)
    high = float(first.excess[0])
    best, low = _covered([(whole, first)], high, spheres), high / 2
    while low > 1e-9 * size:
        found = _tried(body, (whole, first), low, most, spheres)
        if found is None:
            break
        best, high, low = found, low, low / 2
    for _ in range(_STEPS):
        middle = float(np.sqrt(low * high))
        found = _tried(body, (whole, first), middle, most, spheres)
        if found is None:
            low = middle
        else:
            best, high = found, middle
    return best


def _tried(body: Body, whole: _Cut, excess: float, most: int, spheres: int) -> Balls | None:
    """Return balls of an excess; None if that takes more than `most` cells, or more than `spheres` balls.

    Cells are cut until each is held by a ball of its own that stands out no more.
    """
    done: list[_Cut] = []
    cells, centers = whole
    while True:
        fine = centers.excess <= excess
        if fine.any():
            done.append((cells.take(fine), centers.take(fine)))
        if fine.all():
            return _covered(done, excess, spheres)
        deep = np.maximum(np.maximum(centers.best_depth, centers.room), 0.0)[~fine]
        # The edge of the square on a plane that a ball about a point so deep holds.
        cells = cells.take(~fine).halved(body.inside, unit=np.sqrt(2 * (2 * deep * excess + excess**2)))
        if sum(len(part) for part, _ in done) + len(cells) > most:
            return None
        centers = centers_for(body, cells, tolerance=_TOLERANCE * excess)


def _covered(cut: list[_Cut], excess: float, spheres: int) -> Balls | None:
    """Choose balls for cells; None if there are more than `spheres`."""
    cells, centers = joined_cells([part for part, _ in cut]), joined_centers([part for _, part in cut])
    center, depth = centers.candidates(excess)
    kept = np.flatnonzero(depth > -excess)
    kept = kept[thinned(center[kept], depth[kept], excess)]
    center, depth = center[kept], depth[kept]
    ball, cell = pairs_held(cells, center, excess + depth)
    alone = np.setdiff1d(np.arange(len(cells)), cell)  # held by none of the few; by their own balls, then
    center, depth = np.concatenate([center, centers.best[alone]]), np.concatenate([depth, centers.best_depth[alone]])
    more, cell_of_more = pairs_held(cells, center[len(kept) :], (excess + depth[len(kept) :]) * (1 + 1e-12))
    ball, cell = np.concatenate([ball, more + len(kept)]), np.concatenate([cell, cell_of_more])
    choice = Choice(ball, cell, len(center), len(cells))
    chosen = choice.few()
    if len(chosen) > spheres:
        return None
    center, depth = center[chosen], depth[chosen]
    radii = _tight(cells, choice, chosen, center, excess + depth)
    return center, radii, np.maximum(radii - depth, 0.0)


def _tight(cells: Cells, choice: Choice, chosen: list[int], center: Array, radii: Array) -> Array:
    """Return the least radii with which every cell is still held, by the ball that has most room left."""
    mine = [choice.held_by(ball) for ball in chosen]
    ball, cell = np.repeat(np.arange(len(chosen)), [len(one) for one in mine]), np.concatenate(mine)
    reach = reach_of(cells, center[ball], cell)
    order = np.lexsort((reach - radii[ball], cell))
    first = order[np.flatnonzero(np.diff(cell[order], prepend=-1))]
    out = np.zeros(len(chosen))
    np.maximum.at(out, ball[first], reach[first])
    return out


def thinned(centers: Array, depth: Array, excess: float) -> Indices:
    """Return which centres are left if one is enough in every box of a grid: the deepest.

    The grid is a fraction of what a ball's cap holds of a plane.
    """
    cap = np.sqrt(np.maximum(2 * depth * excess, 0.0) + excess**2)
    level = np.floor(np.log2(cap))
    place = np.floor(centers / (np.exp2(level) / 2)[:, None])
    order = np.lexsort((-depth, place[:, 2], place[:, 1], place[:, 0], level))
    key = np.column_stack([place, level])[order]
    new = np.ones(len(order), dtype=bool)
    new[1:] = (key[1:] != key[:-1]).any(axis=1)
    return np.sort(order[new])


def pairs_held(cells: Cells, centers: Array, radii: Array) -> tuple[Indices, Indices]:
    """Return all pairs (ball, cell) of a ball that holds a cell."""
    from scipy.spatial import KDTree

    low, high = cells.low, cells.high
    count = np.diff(cells.start)
    # A ball that holds a cell's points holds their mean too.
    tree = KDTree(np.add.reduceat(cells.points, cells.start[:-1]) / count[:, None])
    balls: list[Indices] = []
    found: list[Indices] = []
    for i in range(0, max(1, len(centers)), _AT_ONCE):
        near = tree.query_ball_point(centers[i : i + _AT_ONCE], radii[i : i + _AT_ONCE] * (1 + 1e-9), return_sorted=False)
        cell = np.fromiter(itertools.chain.from_iterable(near), dtype=np.intp)
        ball = np.repeat(np.arange(len(near)), [len(one) for one in near]) + i
        c, squared = centers[ball], radii[ball] ** 2
        far = np.maximum(np.abs(c - low[cell]), np.abs(high[cell] - c)) ** 2
        near_side = np.maximum(np.maximum(low[cell] - c, c - high[cell]), 0.0) ** 2
        sure = far.sum(axis=1) <= squared
        # Some point lies on the farthest face of the box along each axis.
        least = (far + near_side.sum(axis=1, keepdims=True) - near_side).max(axis=1)
        maybe = np.flatnonzero(~sure & (least <= squared))
        which, points = _ranges(cells.start[cell[maybe]], count[cell[maybe]])
        away = cells.points[points] - c[maybe][which]
        outside = np.einsum("ij,ij->i", away, away) > squared[maybe][which]
        holds = np.ones(len(maybe), dtype=bool)
        holds[which[outside]] = False
        both = np.concatenate([np.flatnonzero(sure), maybe[holds]])
        balls.append(ball[both])
        found.append(cell[both])
    return np.concatenate(balls), np.concatenate(found)


def reach_of(cells: Cells, centers: Array, cell: Indices) -> Array:
    """Return the radius that holds a cell from a centre, for each pair of them, (m,) [m]."""
    count = np.diff(cells.start)[cell]
    which, points = _ranges(cells.start[cell], count)
    away = cells.points[points] - centers[which]
    return np.sqrt(np.maximum.reduceat(np.einsum("ij,ij->i", away, away), np.cumsum(count) - count))


def _ranges(start: Indices, count: Indices) -> tuple[Indices, Indices]:
    """Return the numbers start, start + 1, ... of each range one after the other, and which range each is of."""
    which = np.repeat(np.arange(len(start)), count)
    return which, np.arange(len(which)) - np.repeat(np.cumsum(count) - count - start, count)


class Choice:
    """Which balls hold which cells, both ways round."""

    def __init__(self, ball: Indices, cell: Indices, balls: int, cells: int) -> None:
        """Take all pairs of a ball and a cell that it holds."""
        self._cells = cells
        order = np.argsort(ball, kind="stable")
        self._of_ball, self._ball_start = cell[order], np.searchsorted(ball[order], np.arange(balls + 1))
        order = np.argsort(cell, kind="stable")
        self._of_cell, self._cell_start = ball[order], np.searchsorted(cell[order], np.arange(cells + 1))

    def held_by(self, ball: int) -> Indices:
        """Return the cells that a ball holds."""
        return self._of_ball[self._ball_start[ball] : self._ball_start[ball + 1]]

    def few(self) -> list[int]:
        """Return balls that together hold all cells, none of them needless; every cell must be held by one at least."""
        gain = np.diff(self._ball_start)
        free = np.ones(self._cells, dtype=bool)
        out: list[int] = []
        while free.any():
            best = int(np.argmax(gain))
            assert gain[best] > 0
            out.append(best)
            new = self.held_by(best)
            new = new[free[new]]
            free[new] = False
            _, losing = _ranges(self._cell_start[new], self._cell_start[new + 1] - self._cell_start[new])
            np.subtract.at(gain, self._of_cell[losing], 1)
        return self._needed(out)

    def _needed(self, balls: list[int]) -> list[int]:
        """Leave out balls all of whose cells are held by others too; the last chosen first."""
        times = np.zeros(self._cells, dtype=np.intp)
        for ball in balls:
            times[self.held_by(ball)] += 1
        kept = []
        for ball in reversed(balls):
            mine = self.held_by(ball)
            if (times[mine] > 1).all():
                times[mine] -= 1
            else:
                kept.append(ball)
        return kept[::-1]
