"""Which pairs have to be kept apart: links and solids first, then the capsules and balls inside of them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from spacearm.proof.bodies import Bodies, RelativeBodies
from spacearm.proof.solids import Balls, Solids, cells_of, solids_of
from spacearm.scene import Scene

Indices = NDArray[np.intp]


class Kind(NamedTuple):
    """What relative bodies are to be kept apart from.

    Attributes:
        solids: of one kind; None: the robot's own bodies.
        cells: around balls, if they are many.
    """

    solids: Solids | None
    cells: Balls | None


class Tasks(NamedTuple):
    """Pairs to be kept apart, (t,) each: the stretch, the relative body, and the solid, cell, or body of the robot."""

    stretch: Indices
    relative: Indices
    solid: Indices

    def some(self, which: Indices | NDArray[np.bool_] | slice) -> Tasks:
        """Return some of them."""
        return Tasks(*(column[which] for column in self))


def kinds_of(scene: Scene, relative_bodies: RelativeBodies) -> list[Kind]:
    """Return all that the robot's links are to be kept apart from."""
    kinds = []
    if len(relative_bodies.over_scene):
        for solids in solids_of(scene):
            kinds.append(Kind(solids, cells_of(solids) if isinstance(solids, Balls) else None))
    if len(relative_bodies.self_relative):
        kinds.append(Kind(None, None))
    return kinds


def link_pairs(kind: Kind, relative_bodies: RelativeBodies, stretches: int) -> Tasks:
    """Return every pair of links' balls and solids, or their cells, on every stretch."""
    if kind.solids is None:
        stretch, pair = np.divmod(np.arange(stretches * len(relative_bodies.self_relative)), len(relative_bodies.self_relative))
        return Tasks(stretch, relative_bodies.self_relative[pair], relative_bodies.self_body[pair])
    solids = len((kind.cells or kind.solids).radius)
    links = len(relative_bodies.over_scene)
    stretch, pair = np.divmod(np.arange(stretches * links * solids), links * solids)
    link, solid = np.divmod(pair, solids)
    return Tasks(stretch, relative_bodies.over_scene[link], solid)


def out_of_cells(cells: Balls, tasks: Tasks) -> Tasks:
    """Return the pairs with the balls in place of their cells."""
    row, solid = _inside(cells.first[tasks.solid], cells.count[tasks.solid])
    return Tasks(tasks.stretch[row], tasks.relative[row], solid)


def capsule_pairs(kind: Kind, bodies: Bodies, relative_bodies: RelativeBodies, tasks: Tasks) -> Tasks:
    """Return the pairs with the capsules in place of their links' balls."""
    row, relative = _inside(tasks.relative + 1, relative_bodies.count[tasks.relative])
    stretch, solid = tasks.stretch[row], tasks.solid[row]
    if kind.solids is None:
        row, member = _inside(bodies.first[solid], bodies.count[solid])
        stretch, relative, solid = stretch[row], relative[row], bodies.members[member]
    return Tasks(stretch, relative, solid)


def halved(tasks: Tasks, which: Indices) -> Tasks:
    """Return the pairs on both halves of stretches, of which only some (sorted) are left and number i becomes 2 i, 2 i + 1."""
    left = 2 * np.searchsorted(which, tasks.stretch)
    return Tasks(np.concatenate([left, left + 1]), np.tile(tasks.relative, 2), np.tile(tasks.solid, 2))


def _inside(first: Indices, count: Indices) -> tuple[Indices, Indices]:
    """Return the row that each number of the ranges first to first + count - 1 belongs to, and the numbers."""
    row = np.repeat(np.arange(len(count)), count)
    return row, np.arange(len(row)) - np.repeat(np.cumsum(count) - count, count) + first[row]
