"""Planes between a body and a solid, and whether the body stays beyond its plane for a whole stretch.

If n . x >= c for every point x of a body and n . y < c for every point y of a solid, the two are apart, whoever proposed n:
this is all that a proof rests on. The clearance at a stretch's middle is at least the gap along n; in the stretch the body
loses no more of it than `way`, nor than its speed along n and `bend` allow.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from spacearm.geometry import Scene
from spacearm.proof.displacement import Middles
from spacearm.proof.moving_bodies import Bodies, RelativeBodies
from spacearm.proof.solids import Balls, Boxes, Solids, body_axes, cells_of, solids_of
from spacearm.proof.witness import Witness

# ---- Which pairs have to be kept apart: links and solids first, then the capsules and balls inside of them -----------

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


# ---- Planes between a body and a solid, and whether the body stays beyond its plane for a whole stretch --------------

Array = NDArray[np.float64]

GUARD = 1e-9
"""[m] for the rounding of what is a few metres in size; more for what is larger."""

_RELATIVE_GUARD = 1e-13
_LEAST = 1e-140  # [m] shorter, the squares of a direction's parts have no digits left, and its length is anything
_TURNS = 4  # of falling from segment to solid and back


class Gaps(NamedTuple):
    """What is known of pairs (t,), in [m].

    Attributes:
        left: proven for the whole stretch: the clearance is more than this.
        least: proven at the middle.
        most: the clearance at the middle is at most this.
    """

    left: Array
    least: Array
    most: Array

    def some(self, which: Indices | NDArray[np.bool_]) -> Gaps:
        """Return some of them."""
        return Gaps(*(column[which] for column in self))


def gaps(
    middles: Middles,
    bodies: Bodies,
    relative_bodies: RelativeBodies,
    tasks: Tasks,
    solids: Solids,
    *,
    enough: float,
    n: Array | None = None,
) -> Gaps:
    """Bound the clearance of pairs, at the middles and for the whole stretches.

    Args:
        middles: where the bodies are.
        bodies, relative_bodies: of the robot.
        tasks: the pairs.
        solids: those that the tasks name.
        enough: once `left` exceeds this [m] it is not made any better.
        n: (t, 3) directions in the inertial frame from solid to body, of any length; those that are none prove nothing.
            None: those to the nearest point.
    """
    stretch, body, k = tasks.stretch, relative_bodies.body[tasks.relative], tasks.solid
    axes, origin = solids.placed(k)
    x = middles.position[stretch, body] - origin[:, None]  # (t, e, 3)
    if axes is not None:
        x = x @ axes  # a row times R is R^T x
    toward, apart = _proposed(x, solids, k)
    if n is not None:
        toward = _unit(n if axes is None else np.einsum("tc,tcd->td", n, axes))
    none = apart < _LEAST if n is None else (apart < _LEAST) | ~toward.any(axis=1)
    radii = bodies.radius[body] + solids.radius[k]
    guard = GUARD + _RELATIVE_GUARD * (np.sqrt(np.einsum("tec,tec->t", x, x)) + _length(origin))
    height = np.einsum("tc,tec->te", toward, x)
    at_middle = height - (solids.support(k, toward) + radii + guard)[:, None]  # (t, e)
    at_middle[none] = -np.inf  # inside the core, or no direction was found
    row = middles.row[tasks.relative]
    way = middles.way[stretch, row]
    left = (at_middle - way).min(axis=1)
    short = np.flatnonzero(left <= enough)
    if short.size:
        at = stretch[short], row[short]
        velocity = middles.velocity[at] if axes is None else middles.velocity[at] @ axes[short]
        speed = np.abs(np.einsum("tc,tec->te", toward[short], velocity))
        loss = speed * middles.half[at[0], None] + middles.bend[at]
        left[short] = (at_middle[short] - np.minimum(loss, way[short])).min(axis=1)
    return Gaps(left, at_middle.min(axis=1), apart - radii)


def link_solids(bodies: Bodies, middles: Middles) -> Balls | Boxes:
    """Return the robot's own bodies as solids where they are, r times b of them: body k of stretch i is number i b + k."""
    count, one_end = len(middles.half), bodies.ends.shape[1] == 1
    radius = np.tile(bodies.radius, count)
    none = np.zeros(len(radius), np.intp)
    center = middles.position.mean(axis=2).reshape(-1, 3)
    if one_end:
        return Balls(center=center, radius=radius, obstacle=none, first=none, count=none)
    half = np.zeros((len(radius), 3))
    half[:, 2] = np.tile(np.linalg.norm(bodies.ends[:, 1] - bodies.ends[:, 0], axis=1) / 2, count)
    axes = middles.frames[:, bodies.joint, :3, :3] @ body_axes(bodies)
    return Boxes(axes=axes.reshape(-1, 3, 3), origin=center, half=half, radius=radius, obstacle=none)


def _proposed(x: Array, solids: Solids, k: Indices) -> tuple[Array, Array]:
    """Return a direction from solid to body, (t, 3), and the distance (t,) of two points of the body's axis and the core.

    A point's is exact. A segment's comes from falling to and fro between the two, from the best of its ends and middle.
    """
    point = x[:, 0]
    if x.shape[1] == 2:
        middle = x.mean(axis=1)
        starts = np.stack([x[:, 0], middle, x[:, 1]])
        apart = [_length(start - solids.nearest(k, start)) for start in starts]
        point = starts[np.argmin(apart, axis=0), np.arange(len(x))]
        along = x[:, 1] - x[:, 0]
        squared = np.maximum(np.einsum("tc,tc->t", along, along), _LEAST)
        for _ in range(_TURNS):
            away = solids.nearest(k, point) - x[:, 0]
            share = np.clip(np.einsum("tc,tc->t", away, along) / squared, 0.0, 1.0)
            point = x[:, 0] + share[:, None] * along
    away = point - solids.nearest(k, point)
    length = _length(away)
    return away / np.maximum(length, _LEAST)[:, None], length


def _unit(n: Array) -> Array:
    """Return directions (t, 3) with length 1, whoever proposed them; 0 for those that are none.

    All that a plane proves rests on |n| <= 1: a longer n tells of a gap that is not there.
    """
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        n = n / np.abs(n).max(axis=1)[:, None]  # so that no square is too small or too large to be a number
        n = n / _length(n)[:, None]
    return np.where(np.isfinite(n).all(axis=1, keepdims=True), n, 0.0)


def _length(v: Array) -> Array:
    return np.sqrt(np.einsum("tc,tc->t", v, v))


# ---- Measured clearances: the closest approach so far, and whether what is proven agrees with them -------------------


DISAGREEMENT = 1e-6
"""[m] by which a measurement may be below what is proven, before nothing is believed."""

_ZOOMS, _POINTS = 2, 9


class Pair(NamedTuple):
    """A capsule of the robot, and a solid of a kind or another capsule."""

    kind: int
    capsule: int
    solid: int


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Near:
    """A measured closest approach.

    Attributes:
        capsule: index in the robot.
        obstacle: index in the scene; None if it is to a capsule.
        other: index in the robot of that capsule, or -1.
        u: where on the curve.
        clearance: [m].
        points: (2, 3) the nearest points, in the inertial frame [m].
    """

    capsule: int
    obstacle: int | None
    other: int
    u: float
    clearance: float
    points: Array


class Measurements:
    """Measures pairs, and keeps the closest.

    Attributes:
        clearance: the least measured [m]; infinite at first.
        doubt: whether less was measured than was proven.
    """

    def __init__(self, witness: Witness, kinds: list[Kind], bodies: Bodies, relative_bodies: RelativeBodies) -> None:
        self._witness, self._kinds, self._bodies, self._relative_bodies = witness, kinds, bodies, relative_bodies
        self.clearance, self.doubt = np.inf, False
        self._closest: tuple[Pair, float, Array] | None = None  # which, where, and the nearest points

    def task(self, kind: int, tasks: Tasks, row: int, middles: Middles, *, proven: float) -> tuple[float, Array]:
        """Measure a task's pair at its stretch's middle, where so much is proven.

        Returns:
            The clearance [m], and the direction (3,) from the other one to the capsule.
        """
        stretch, relative, solid = (int(column[row]) for column in tasks)
        pair = Pair(kind, int(self._relative_bodies.body[relative]), solid)
        found = self._measured(pair, middles.frames[stretch], float(middles.u[stretch]))
        self.doubt |= found[0] < proven - DISAGREEMENT
        return found

    def closest(self, domain: tuple[float, float], frames: Callable[[Array], Array], reach: float) -> Near | None:
        """Return the closest approach, after looking for a closer one of the same pair no further than `reach` on the curve.

        Args:
            domain: of the curve.
            frames: takes parameters (r,), gives T_w_joint (r, j + 1, 4, 4).
            reach: in the curve's parameter.
        """
        if self._closest is None:
            return None
        for _ in range(_ZOOMS):
            pair, u, _ = self._closest
            near = np.clip(np.linspace(u - reach, u + reach, _POINTS), *domain)
            for at, placed in zip(near.tolist(), frames(near), strict=True):
                self._measured(pair, placed, at)
            reach *= 2 / (_POINTS - 1)
        pair, u, points = self._closest
        solids = self._kinds[pair.kind].solids
        obstacle, other = (None, pair.solid) if solids is None else (int(solids.obstacle[pair.solid]), -1)
        return Near(capsule=pair.capsule, obstacle=obstacle, other=other, u=u, clearance=self.clearance, points=points)

    def _measured(self, pair: Pair, frames: Array, u: float) -> tuple[float, Array]:
        solids = self._kinds[pair.kind].solids
        if solids is None:
            found = self._witness.distance_between(frames, pair.capsule, pair.solid)
        else:
            found = self._witness.distance(frames, pair.capsule, solids, pair.solid)
        if found[0] < self.clearance:
            self.clearance, self._closest = found[0], (pair, u, self._witness.nearest_points())
        return found
