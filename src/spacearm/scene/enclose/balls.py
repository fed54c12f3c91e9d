"""Balls that enclose triangles, for a given excess or a given number."""

from __future__ import annotations

import numpy as np

from spacearm.scene.enclose.box_tree import Array
from spacearm.scene.enclose.cells import Cells, joined_cells, one_cell
from spacearm.scene.enclose.centers import Body, Centers, centers_for, joined_centers
from spacearm.scene.enclose.choice import Choice, held, reach_of, thinned
from spacearm.scene.enclose.inside import Inside
from spacearm.scene.enclose.surface import Surface

_MOST_CELLS = 150_000
_TOLERANCE = 0.02  # of the excess: how well the medial axis needs to be known
_STEPS = 4  # of the search for the least excess that a number of balls allows: to 4 %

Balls = tuple[Array, Array, Array]
"""Centres (k, 3), radii (k,), and by how much each ball stands out (k,), at most [m]."""

_Cut = tuple[Cells, Centers]


def enclosing_balls(
    triangles: Array, surface: Surface | None, inside: Inside | None, *, size: float, excess: float | None, spheres: int
) -> Balls | None:
    """Return few balls that together hold all triangles and what is inside of them.

    Args:
        triangles: (n, 3, 3), about the origin [m].
        surface: measures distances from them; None if they are all points.
        inside: tells what is inside; None of what has no inside.
        size: of the whole, above 0 [m].
        excess: how far a ball may stand out, at most [m]; None for as little as the number of balls allows.
        spheres: how many balls at most.

    Returns:
        The balls; None if so many are not enough.
    """
    body = Body(triangles, surface, inside)
    whole = one_cell(triangles, inside)
    if excess is not None:
        first = centers_for(body, whole, tolerance=_TOLERANCE * excess)
        cut = _cut(body, [(whole, first)], excess, most=min(_MOST_CELLS, 1000 + 30 * spheres))
        return None if cut is None else _covered(cut, excess, spheres)
    return _fewest(body, whole, size, spheres)


def _fewest(body: Body, whole: Cells, size: float, spheres: int) -> Balls | None:
    """Return balls with nearly the least excess that so many allow: halve it until they are too few, then bisect."""
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
    cut = _cut(body, [whole], excess, most=most)
    return None if cut is None else _covered(cut, excess, spheres)


def _cut(body: Body, cut: list[_Cut], excess: float, *, most: int) -> list[_Cut] | None:
    """Cut cells until each is held by a ball of its own that stands out no more than `excess`; None if more than `most`."""
    done: list[_Cut] = []
    coarse: list[Cells] = []
    units: list[Array] = []
    for cells, centers in cut:
        _sort_out(cells, centers, excess, done, coarse, units)
    while coarse:
        halves = joined_cells(coarse).halved(body.inside, unit=np.concatenate(units))
        coarse, units = [], []
        if sum(len(cells) for cells, _ in done) + len(halves) > most:
            return None
        _sort_out(halves, centers_for(body, halves, tolerance=_TOLERANCE * excess), excess, done, coarse, units)
    return done


def _sort_out(cells: Cells, centers: Centers, excess: float, done: list[_Cut], coarse: list[Cells], units: list[Array]) -> None:
    """Put cells to those that are done, or to those to be cut, with the length that their parts may have [m]."""
    fine = centers.excess <= excess
    if fine.any():
        done.append((cells.take(fine), centers.take(fine)))
    if not fine.all():
        coarse.append(cells.take(~fine))
        deep = np.maximum(np.maximum(centers.best_depth, centers.room), 0.0)[~fine]
        # The edge of the square on a plane that a ball about a point so deep holds.
        units.append(np.sqrt(2 * (2 * deep * excess + excess**2)))


def _covered(cut: list[_Cut], excess: float, spheres: int) -> Balls | None:
    """Choose balls for cells; None if there are more than so many."""
    cells, centers = joined_cells([part for part, _ in cut]), joined_centers([part for _, part in cut])
    center, depth = centers.candidates(excess)
    kept = np.flatnonzero(depth > -excess)
    kept = kept[thinned(center[kept], depth[kept], excess)]
    center, depth = center[kept], depth[kept]
    ball, cell = held(cells, center, excess + depth)
    alone = np.setdiff1d(np.arange(len(cells)), cell)  # held by none of the few; by their own balls, then
    center, depth = np.concatenate([center, centers.best[alone]]), np.concatenate([depth, centers.best_depth[alone]])
    more, cell_of_more = held(cells, center[len(kept) :], (excess + depth[len(kept) :]) * (1 + 1e-12))
    ball, cell = np.concatenate([ball, more + len(kept)]), np.concatenate([cell, cell_of_more])
    choice = Choice(ball, cell, len(center), len(cells))
    chosen = choice.few()
    if len(chosen) > spheres:
        return None
    center, depth = center[chosen], depth[chosen]
    radii = _tight(cells, choice, chosen, center, excess + depth)
    return center, radii, np.maximum(radii - depth, 0.0)


def _tight(cells: Cells, choice: Choice, chosen: list[int], center: Array, radii: Array) -> Array:
    """Return the least radii with which every cell is still held, by that of its balls which has most to spare."""
    mine = [choice.held_by(ball) for ball in chosen]
    ball, cell = np.repeat(np.arange(len(chosen)), [len(one) for one in mine]), np.concatenate(mine)
    reach = reach_of(cells, center[ball], cell)
    order = np.lexsort((reach - radii[ball], cell))
    first = order[np.flatnonzero(np.diff(cell[order], prepend=-1))]
    out = np.zeros(len(chosen))
    np.maximum.at(out, ball[first], reach[first])
    return out
