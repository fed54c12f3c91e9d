"""Balls that enclose triangles, for a given excess or a given number."""

from __future__ import annotations

import numpy as np

from spacearm.scene.enclose.box_tree import Array
from spacearm.scene.enclose.cells import Cells, joined_cells, one_cell
from spacearm.scene.enclose.centers import Body, Centers, centers_for, joined_centers
from spacearm.scene.enclose.choice import Choice, held, reach_of, thinned

_MOST_CELLS = 150_000
_TOLERANCE = 0.02  # of the excess: how well the medial axis needs to be known
_STEPS = 4  # of the search for the least excess that a number of balls allows: to 4 %

Balls = tuple[Array, Array, Array]
"""Centres (k, 3), radii (k,), and by how much each ball stands out (k,), at most [m]."""

_Cut = tuple[Cells, Centers]


def enclosing_balls(body: Body, *, size: float, excess: float | None, spheres: int) -> Balls | None:
    """Return few balls that together hold all triangles of a body and what is inside of them.

    Args:
        body: about the origin.
        size: of the whole, above 0 [m].
        excess: how far a ball may stand out, at most [m]; None for as little as the number of balls allows.
        spheres: how many balls at most.

    Returns:
        The balls; None if so many are not enough.
    """
    whole = one_cell(body.triangles, body.inside)
    if excess is None:
        return _fewest(body, whole, size, spheres)
    first = centers_for(body, whole, tolerance=_TOLERANCE * excess)
    return _tried(body, (whole, first), excess, min(_MOST_CELLS, 1000 + 30 * spheres), spheres)


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
    """Return balls of an excess; None if that takes more than `most` cells, or more than so many balls.

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
