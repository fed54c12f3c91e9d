"""Few balls that hold every cell, chosen greedily: the ball that holds most of the cells not yet held is next."""

from __future__ import annotations

import numpy as np

from spacearm.scene.enclose.box_tree import Array, BoxTree, Indices
from spacearm.scene.enclose.cells import Cells


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


def held(cells: Cells, centers: Array, radii: Array) -> tuple[Indices, Indices]:
    """Return all pairs (ball, cell) of a ball that holds a cell."""
    low, high = cells.low, cells.high
    tree = BoxTree(low, high)
    count = np.diff(cells.start)
    balls, found = [], []
    for i in range(0, max(1, len(centers)), 20_000):
        ball, node = tree.leaves_within(centers[i : i + 20_000], radii[i : i + 20_000])
        place, cell = tree.items(node)
        ball = ball[place] + i
        c, squared = centers[ball], radii[ball] ** 2
        far = np.maximum(np.abs(c - low[cell]), np.abs(high[cell] - c)) ** 2
        near = np.maximum(np.maximum(low[cell] - c, c - high[cell]), 0.0) ** 2
        sure = far.sum(axis=1) <= squared
        # Some point lies on the farthest face of the box along each axis.
        least = (far + near.sum(axis=1, keepdims=True) - near).max(axis=1)
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
