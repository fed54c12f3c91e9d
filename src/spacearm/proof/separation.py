"""Separating planes: which pairs of bodies must be kept apart, and how far apart they are proven to be.

If n . x >= c for every point x of a body and n . y < c for every point y of a solid, then the two are apart, whoever proposed
n. A proof uses nothing else. The clearance at an interval's midpoint is at least the gap along n. On the interval the body
loses no more of this gap than its displacement bound, and no more than its speed along n and its second-order bound allow.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from spacearm.geometry import Scene
from spacearm.proof.bodies import Bodies, RelativeBodies
from spacearm.proof.displacement import IntervalMidpoints, PointBounds
from spacearm.proof.solids import Balls, Boxes, Cylinders, HalfSpaces, Polytopes, Solids, cells_of, solids_of
from spacearm.proof.witness import Witness

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

GUARD = 1e-9
"""[m] A gap is reduced by this, for the rounding of numbers of a few metres; see `_RELATIVE_GUARD` for larger ones."""

DISAGREEMENT = 1e-6
"""[m] If a measured clearance is below what is proven by more than this, neither is believed."""

_RELATIVE_GUARD = 1e-13  # times the coordinates that a gap comes from: the gap is reduced by this, too
_SHORTEST = 1e-140  # [m] below it the squares of a direction's coordinates underflow, and its length is lost
_PROJECTIONS = 4  # alternating projections between a segment and a solid
_ZOOMS, _ZOOM_POINTS = 2, 9  # how often, and at how many points, it is measured around the closest approach

# ---- Pairs of bodies that must be kept apart -------------------------------------------------------------------------


class ObstacleGroup(NamedTuple):
    """What relative bodies are to be kept apart from.

    Attributes:
        solids: obstacles of one shape; None: the robot's own bodies.
        cells: around the balls of a large scene, or around polytopes; else None.
    """

    solids: Solids | None
    cells: Balls | None


class OpenPairs(NamedTuple):
    """t pairs on intervals that are not proven to be apart yet.

    Attributes:
        interval: (t,) the interval.
        relative: (t,) the relative body.
        solid: (t,) the solid, or the cell, or the other body of the robot.
    """

    interval: Indices
    relative: Indices
    solid: Indices

    def select(self, which: Indices | NDArray[np.bool_] | slice) -> OpenPairs:
        """Return some of them."""
        return OpenPairs(self.interval[which], self.relative[which], self.solid[which])


def obstacle_groups(scene: Scene, relative_bodies: RelativeBodies) -> list[ObstacleGroup]:
    """Return all that the robot's links are to be kept apart from; the robot itself is the last group."""
    groups: list[ObstacleGroup] = []
    if len(relative_bodies.scene_relative):
        for solids in solids_of(scene):
            groups.append(ObstacleGroup(solids, cells_of(solids)))
    if len(relative_bodies.self_relative):
        groups.append(ObstacleGroup(None, None))
    return groups


def link_pairs(group: ObstacleGroup, relative_bodies: RelativeBodies, intervals: int) -> OpenPairs:
    """Return every pair of a link's ball and a solid (or a cell) on every one of some intervals."""
    if group.solids is None:
        count = len(relative_bodies.self_relative)
        interval, pair = np.divmod(np.arange(intervals * count), count)
        return OpenPairs(interval, relative_bodies.self_relative[pair], relative_bodies.self_body[pair])
    solids = len((group.cells or group.solids).radius)
    links = len(relative_bodies.scene_relative)
    interval, pair = np.divmod(np.arange(intervals * links * solids), links * solids)
    link, solid = np.divmod(pair, solids)
    return OpenPairs(interval, relative_bodies.scene_relative[link], solid)


def out_of_cells(cells: Balls, pairs: OpenPairs) -> OpenPairs:
    """Return the pairs with the solids in place of their cells."""
    row, solid = _ranges(cells.first[pairs.solid], cells.count[pairs.solid])
    return OpenPairs(pairs.interval[row], pairs.relative[row], solid)


def shape_pairs(group: ObstacleGroup, bodies: Bodies, relative_bodies: RelativeBodies, pairs: OpenPairs) -> OpenPairs:
    """Return the pairs with the shapes in place of their links' balls."""
    row, relative = _ranges(pairs.relative + 1, relative_bodies.count[pairs.relative])
    interval, solid = pairs.interval[row], pairs.solid[row]
    if group.solids is None:
        row, member = _ranges(bodies.first[solid], bodies.count[solid])
        interval, relative, solid = interval[row], relative[row], bodies.members[member]
    return OpenPairs(interval, relative, solid)


def halved(pairs: OpenPairs, which: Indices) -> OpenPairs:
    """Return the pairs on both halves of their intervals: `which[i]` (sorted) becomes the intervals 2 i and 2 i + 1."""
    left = 2 * np.searchsorted(which, pairs.interval)
    return OpenPairs(np.concatenate([left, left + 1]), np.tile(pairs.relative, 2), np.tile(pairs.solid, 2))


def _ranges(first: Indices, count: Indices) -> tuple[Indices, Indices]:
    """Return the numbers of the ranges first to first + count - 1, one after the other, as (which range, number)."""
    row = np.repeat(np.arange(len(count)), count)
    return row, np.arange(len(row)) - np.repeat(np.cumsum(count) - count, count) + first[row]


# ---- Clearance bounds of pairs ---------------------------------------------------------------------------------------


class ClearanceBounds(NamedTuple):
    """Bounds of the clearance of t pairs [m].

    Attributes:
        on_interval: (t,) proven: the clearance is more than this on the whole interval.
        at_midpoint: (t,) proven: it is more than this at the midpoint.
        at_most: (t,) the clearance at the midpoint is at most this.
    """

    on_interval: Array
    at_midpoint: Array
    at_most: Array

    def select(self, which: Indices | NDArray[np.bool_]) -> ClearanceBounds:
        """Return some of them."""
        return ClearanceBounds(self.on_interval[which], self.at_midpoint[which], self.at_most[which])


def clearance_bounds(
    midpoints: IntervalMidpoints,
    bodies: Bodies,
    relative_bodies: RelativeBodies,
    pairs: OpenPairs,
    solids: Solids,
    *,
    enough: Array | float | None,
    n: Array | None = None,
) -> ClearanceBounds:
    """Bound the clearance of pairs, at the midpoints and on the whole intervals.

    Args:
        midpoints: where the bodies are, and how far they get.
        bodies, relative_bodies: of the robot.
        pairs: the pairs.
        solids: those that the pairs name.
        enough: a bound on the interval that is more than this [m], one number or (t,), is not improved. None: nothing is proven
            on intervals.
        n: (t, 3) directions in the inertial frame from solid to body, of any length. A vector that is no direction proves
            nothing. None: the directions to the nearest points.
    """
    body = relative_bodies.body[pairs.relative]
    planes = _Planes(midpoints, bodies, solids)

    def of_group(group: int, rows: Indices | slice) -> ClearanceBounds:
        some = pairs.select(rows)
        return planes.bounds(group, some, body[rows], enough=some_of(enough, rows), n=None if n is None else n[rows])

    if len(bodies.groups) == 1:
        return of_group(0, slice(None))
    return by_group(bodies.group[body], of_group)


def some_of(values: Any, which: Indices | NDArray[np.bool_] | slice) -> Any:
    """Return some of an array; a number, or None, stays."""
    if values is None or isinstance(values, (int, float)):
        return values
    return values[which]


def by_group(group: Indices, bounds: Callable[[int, Indices], ClearanceBounds]) -> ClearanceBounds:
    """Return the bounds of t pairs, of which `bounds` gives those of one group: it takes a group and rows."""
    out = ClearanceBounds(*np.empty((3, len(group))))
    for one in np.unique(group).tolist():
        rows = np.flatnonzero(group == one)
        for into, found in zip(out, bounds(one, rows), strict=True):
            into[rows] = found
    return out


class _Planes:
    """Planes between some bodies and some solids at midpoints, and what they prove."""

    def __init__(self, midpoints: IntervalMidpoints, bodies: Bodies, solids: Solids) -> None:
        self._midpoints, self._bodies, self._solids = midpoints, bodies, solids

    def bounds(
        self, group: int, pairs: OpenPairs, body: Indices, *, enough: Array | float | None, n: Array | None
    ) -> ClearanceBounds:
        """Bound the clearance of pairs whose bodies (t,) are of one group; see `clearance_bounds`."""
        of_rows = self._of_axes if group == 0 else self._of_cores
        return of_rows(group, pairs, body, enough=enough, n=n)

    def _of_axes(
        self, group: int, pairs: OpenPairs, body: Indices, *, enough: Array | float | None, n: Array | None
    ) -> ClearanceBounds:
        """Bound the clearance of points and segments, whose ends are evaluated at once."""
        points, solids = self._midpoints.groups[group], self._solids
        interval, k = pairs.interval, pairs.solid
        place = body if len(self._bodies.groups) == 1 else self._bodies.place[body]
        axes, origin = solids.placed(k)
        x = _in_axes(points.position[interval, place] - origin[:, None], axes)  # (t, e, 3)
        toward, apart = _proposed(x, solids, k)
        toward, none = _chosen(toward, apart, n, axes)
        radii = self._bodies.radius[body] + solids.radius[k]
        guard = GUARD + _RELATIVE_GUARD * (np.sqrt(np.einsum("tec,tec->t", x, x)) + _lengths(origin))
        height = np.einsum("tc,tec->te", toward, x)
        gap = height - (solids.support(k, toward) + radii + guard)[:, None]  # (t, e) at the midpoint
        gap[none] = -np.inf  # inside the core, or no direction was found
        at_midpoint = gap.min(axis=1)
        if enough is None:
            return ClearanceBounds(np.full(len(gap), -np.inf), at_midpoint, apart - radii)
        at = interval, self._midpoints.row[pairs.relative]
        on_interval = (gap - points.displacement_bound[at]).min(axis=1)
        short = np.flatnonzero(on_interval <= enough)
        if short.size:
            loss = self._loss(points, (at[0][short], at[1][short]), toward[short], None if axes is None else axes[short])
            on_interval[short] = (gap[short] - loss).min(axis=1)
        return ClearanceBounds(on_interval, at_midpoint, apart - radii)

    def _of_cores(
        self, group: int, pairs: OpenPairs, body: Indices, *, enough: Array | float | None, n: Array | None
    ) -> ClearanceBounds:
        """Bound the clearance of boxes, cylinders and polytopes: the points around them are evaluated where they are needed."""
        points, some, solids = self._midpoints.groups[group], self._bodies.groups[group], self._solids
        interval, k, place = pairs.interval, pairs.solid, self._bodies.place[body]
        axes, origin = solids.placed(k)
        own = _OwnCores(self._midpoints.solids(group), interval * len(some.body) + place, axes, origin)
        toward, apart = _proposed_between(own, solids, k)
        toward, none = _chosen(toward, apart, n, axes)
        radii = self._bodies.radius[body] + solids.radius[k]
        guard = GUARD + _RELATIVE_GUARD * (_lengths(own.center) + some.reach[place] + _lengths(origin))
        taken = (solids.support(k, toward) + radii + guard)[:, None]
        gap = own.lowest(toward) - taken  # (t, parts) at the midpoint
        gap[none] = -np.inf
        at_midpoint = gap.min(axis=1)
        at_most = apart - radii
        if n is None and isinstance(solids, HalfSpaces):  # the gap along the normal is exact
            at_most = np.where(none, at_most, at_midpoint + guard)
        if enough is None:
            return ClearanceBounds(np.full(len(gap), -np.inf), at_midpoint, at_most)
        row = self._midpoints.row[pairs.relative]
        on_interval = at_midpoint - points.furthest[interval, row]
        short = np.flatnonzero((on_interval <= enough) & ~none)
        if short.size:
            turned = None if axes is None else axes[short]
            loss = self._loss(points, (interval[short], row[short]), toward[short], turned)
            x = _in_axes(points.position[interval[short], place[short]] - origin[short, None], turned)
            height = np.einsum("tc,tec->te", toward[short], x) - taken[short]
            on_interval[short] = _least_left(height, gap[short] if some.parts else None, loss)
        return ClearanceBounds(on_interval, at_midpoint, at_most)

    def _loss(self, points: PointBounds, at: tuple[Indices, Indices], toward: Array, axes: Array | None) -> Array:
        """Return what points lose of their height along directions on intervals, at most, (t, e) [m]."""
        speed = np.abs(np.einsum("tc,tec->te", toward, _in_axes(points.velocity[at], axes)))
        loss = speed * self._midpoints.half[at[0], None] + points.second_order_bound[at]
        return np.minimum(loss, points.displacement_bound[at])


def _in_axes(x: Array, axes: Array | None) -> Array:
    """Return vectors (t, e, 3) of the inertial frame in axes (t, 3, 3)."""
    return x if axes is None else x @ axes  # a row times R is R^T x


def _chosen(toward: Array, apart: Array, n: Array | None, axes: Array | None) -> tuple[Array, NDArray[np.bool_]]:
    """Return the directions to be used, in the solids' axes, and which of them prove nothing.

    Args:
        toward, apart: the proposal, and the distance that it comes from; 0 inside of a core.
        n, axes: directions in the inertial frame in its place, if any, and the axes.
    """
    if n is None:
        return toward, apart < _SHORTEST
    toward = _normalized(n if axes is None else np.einsum("tc,tcd->td", n, axes))
    return toward, (apart < _SHORTEST) | ~toward.any(axis=1)


def _least_left(gap: Array, part_gap: Array | None, loss: Array) -> Array:
    """Return what is left of the gaps (t,) if every point loses so much of its own, at most.

    Args:
        gap: (t, e) at the midpoint, of the points around a body's core.
        part_gap: (t, p) of the parts of the core; None if the core is the hull of the points.
        loss: (t, e) of the points.
    """
    left = gap - loss
    if part_gap is not None:
        runs = (*part_gap.shape, -1)  # a part loses no more than that point of its run which loses most
        left = np.maximum(left.reshape(runs).min(axis=2), part_gap - loss.reshape(runs).max(axis=2))
    return left.min(axis=1)


class _OwnCores:
    """Cores of moving bodies, one for each pair, as they lie in the axes of the pair's solid."""

    def __init__(self, cores: Solids, k: Indices, axes: Array | None, origin: Array) -> None:
        own, center = cores.placed(k)
        assert own is not None
        self._cores, self._k, offset = cores, k, center - origin
        self._axes = own if axes is None else np.swapaxes(axes, 1, 2) @ own  # to the solid's axes
        self.center = offset if axes is None else np.einsum("tc,tcd->td", offset, axes)

    def nearest(self, x: Array) -> Array:
        """Return the points of the cores nearest to x (t, 3)."""
        own = self._cores.nearest(self._k, np.einsum("tc,tcd->td", x - self.center, self._axes))
        return np.einsum("tcd,td->tc", self._axes, own) + self.center

    def lowest(self, n: Array) -> Array:
        """Return the least n . x of the cores' parts, (t, parts)."""
        assert isinstance(self._cores, (Boxes, Cylinders, Polytopes))
        least = self._cores.lowest(self._k, np.einsum("tc,tcd->td", n, self._axes))
        return np.einsum("tc,tc->t", n, self.center)[:, None] + least


def _proposed(x: Array, solids: Solids, k: Indices) -> tuple[Array, Array]:
    """Propose directions from solids to bodies, (t, 3), with the distances (t,) between points of the body's axis and the core.

    The distance of a point is exact. For a segment, alternating projections begin at its end or centre that is nearest.
    """
    point = x[:, 0]
    if x.shape[1] == 2:
        center = x.mean(axis=1)
        starts = np.stack([x[:, 0], center, x[:, 1]])
        apart = [_lengths(start - solids.nearest(k, start)) for start in starts]
        point = starts[np.argmin(apart, axis=0), np.arange(len(x))]
        along = x[:, 1] - x[:, 0]
        squared = np.maximum(np.einsum("tc,tc->t", along, along), _SHORTEST)
        for _ in range(_PROJECTIONS):
            away = solids.nearest(k, point) - x[:, 0]
            share = np.clip(np.einsum("tc,tc->t", away, along) / squared, 0.0, 1.0)
            point = x[:, 0] + share[:, None] * along
    return _direction(point - solids.nearest(k, point))


def _proposed_between(own: _OwnCores, solids: Solids, k: Indices) -> tuple[Array, Array]:
    """Propose directions from solids to bodies, by alternating projections between the cores; see `_proposed`."""
    point = own.center
    for _ in range(1 if isinstance(solids, Balls) else _PROJECTIONS):  # from a point, one projection is exact
        point = own.nearest(solids.nearest(k, point))
    return _direction(point - solids.nearest(k, point))


def _direction(away: Array) -> tuple[Array, Array]:
    length = _lengths(away)
    return away / np.maximum(length, _SHORTEST)[:, None], length


def _normalized(n: Array) -> Array:
    """Return directions (t, 3) with the length 1, whoever proposed them; 0 for vectors that are no direction.

    A proof by a plane needs |n| <= 1: a longer n would prove a gap that is not there.
    """
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        n = n / np.abs(n).max(axis=1)[:, None]  # so that no square underflows or overflows
        n = n / _lengths(n)[:, None]
    return np.where(np.isfinite(n).all(axis=1, keepdims=True), n, 0.0)


def _lengths(v: Array) -> Array:
    return np.sqrt(np.einsum("tc,tc->t", v, v))


# ---- Measured clearances ---------------------------------------------------------------------------------------------


class MeasuredPair(NamedTuple):
    """A shape of the robot, and a solid of an obstacle group or another one."""

    group: int
    shape: int
    solid: int


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class NearestPair:
    """The closest approach that was measured.

    Attributes:
        shape: index in the robot.
        obstacle: index in the scene; None if the other one is a shape.
        other: index in the robot of the other shape, or -1.
        u: where on the curve.
        clearance: [m].
        required: what the pair is held to there [m].
        points: (2, 3) the nearest points, in the inertial frame [m].
    """

    shape: int
    obstacle: int | None
    other: int
    u: float
    clearance: float
    required: float
    points: Array


class Measurements:
    """Measures pairs with Coal, and remembers the closest approaches.

    Attributes:
        clearance: (p,) the least clearance measured so far in each phase [m]; infinite before the first measurement.
        excess: (p,) likewise, less what the pair is held to at the instant [m].
        contradicted: whether a measurement was below what is proven, by more than DISAGREEMENT.
    """

    def __init__(
        self,
        witness: Witness,
        groups: list[ObstacleGroup],
        bodies: Bodies,
        relative_bodies: RelativeBodies,
        held_to: Callable[[int, int, int, float], tuple[float, int]],
    ) -> None:
        """Prepare for a proof with one phase.

        Args:
            witness: it measures.
            groups, bodies, relative_bodies: of the proof.
            held_to: takes a group, a shape, a solid and an instant, gives what the pair is held to [m] and the phase.
        """
        self._witness, self._groups, self._bodies, self._relative_bodies = witness, groups, bodies, relative_bodies
        self._held_to, self.contradicted = held_to, False
        self.begin(phases=1)

    def begin(self, *, phases: int) -> None:
        """Forget all measurements, and expect some number of phases."""
        self.clearance, self.excess = np.full(phases, np.inf), np.full(phases, np.inf)
        self._closest: dict[int, tuple[MeasuredPair, NearestPair]] = {}  # by phase
        self._worst: tuple[MeasuredPair, NearestPair] | None = None
        self._least = (True, np.inf)  # of the worst: whether it does not touch, and the excess, or the clearance if it does

    def measure(
        self, group: int, pairs: OpenPairs, row: int, midpoints: IntervalMidpoints, *, proven: float
    ) -> tuple[float, Array]:
        """Measure one of some pairs of a group at its interval's midpoint, where `proven` is proven.

        Returns:
            The clearance [m], and the direction (3,) from the other one to the shape.
        """
        interval, relative, solid = int(pairs.interval[row]), int(pairs.relative[row]), int(pairs.solid[row])
        pair = MeasuredPair(group, int(self._relative_bodies.body[relative]), solid)
        found = self._measured(pair, midpoints.frames[interval], float(midpoints.u[interval]))
        self.contradicted |= found[0] < proven - DISAGREEMENT
        return found

    def measure_at(self, pair: MeasuredPair, frames: Array, u: float) -> None:
        """Measure a pair at an instant, with T_w_joint (j + 1, 4, 4)."""
        self._measured(pair, frames, u)

    @property
    def worst(self) -> NearestPair | None:
        """The pair that lacks most to what it is held to; of pairs that touch, the one that penetrates deepest."""
        return None if self._worst is None else self._worst[1]

    def closest(self, phases: Sequence[int]) -> NearestPair | None:
        """Return the closest approach measured in some phases."""
        found = [self._closest[phase][1] for phase in phases if phase in self._closest]
        return min(found, key=lambda near: near.clearance, default=None)

    def zoom(self, domain: tuple[float, float], frames: Callable[[Array], Array], reach: float) -> None:
        """Measure the closest pair of each phase, and the worst pair, at more instants around.

        Args:
            domain: of the curve.
            frames: takes parameters (r,), gives T_w_joint (r, j + 1, 4, 4).
            reach: how far around it, in the curve's parameter.
        """

        def around(now: Callable[[], tuple[MeasuredPair, NearestPair]]) -> None:
            for i in range(_ZOOMS):
                pair, near = now()
                away = reach * (2 / (_ZOOM_POINTS - 1)) ** i
                u = np.clip(np.linspace(near.u - away, near.u + away, _ZOOM_POINTS), *domain)
                for at, placed in zip(u.tolist(), frames(u), strict=True):
                    self._measured(pair, placed, at)

        for phase in list(self._closest):
            around(lambda phase=phase: self._closest[phase])
        if self._worst is not None and self._worst not in self._closest.values():
            around(lambda: self._worst or self._closest[0])

    def _measured(self, pair: MeasuredPair, frames: Array, u: float) -> tuple[float, Array]:
        solids = self._groups[pair.group].solids
        if solids is None:
            found = self._witness.distance_between(frames, pair.shape, pair.solid)
        else:
            found = self._witness.distance(frames, pair.shape, solids, pair.solid)
        self._remember(pair, u, found[0])
        return found

    def _remember(self, pair: MeasuredPair, u: float, clearance: float) -> None:
        required, phase = self._held_to(pair.group, pair.shape, pair.solid, u)
        excess = clearance - required
        self.excess[phase] = min(self.excess[phase], excess)
        least = (True, excess) if clearance > 0 else (False, clearance)
        nearest, lacks = clearance < self.clearance[phase], least < self._least
        if not (nearest or lacks):
            return
        solids = self._groups[pair.group].solids
        obstacle, other = (None, pair.solid) if solids is None else (int(solids.obstacle[pair.solid]), -1)
        near = NearestPair(
            shape=pair.shape,
            obstacle=obstacle,
            other=other,
            u=u,
            clearance=clearance,
            required=required,
            points=self._witness.nearest_points(),
        )
        if nearest:
            self.clearance[phase], self._closest[phase] = clearance, (pair, near)
        if lacks:
            self._least, self._worst = least, (pair, near)
