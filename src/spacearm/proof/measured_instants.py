"""Which pairs of bodies are near at the start or the goal, what they have there, and when they are out.

All of this is measured, and nothing proven rests on it: a measured instant only says up to where a pair is held to less than
the required clearance, and the proof has to succeed with that.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from spacearm.proof.bodies import Bodies, JointMap, RelativeBodies
from spacearm.proof.displacement import Frames, IntervalMidpoints
from spacearm.proof.pair_requirements import NearEnd, PairRequirements
from spacearm.proof.path_intervals import LinearBounds
from spacearm.proof.required_clearance import held_to, out_level
from spacearm.proof.separation import (
    ClearanceBounds,
    MeasuredPair,
    ObstacleGroup,
    OpenPairs,
    link_pairs,
    out_of_cells,
    shape_pairs,
)
from spacearm.proof.solids import Solids
from spacearm.proof.witness import Witness

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

_AROUND = 2.5e-4  # [m] above the required clearance it does not matter what a pair has: it is out
_LOOSE = 1e-7  # [m] Coal is asked about a pair if its bounds are further apart than this
_INSTANTS = 128  # at which it is measured whether near pairs are out
_ZOOMS, _ZOOM_INSTANTS = 2, 17  # how often, and at how many instants, between the last that is not out and the first that is

Bound = Callable[[IntervalMidpoints, int, OpenPairs, bool], ClearanceBounds]
"""Bounds the clearances of pairs of a group at midpoints; the last argument says whether the solids are the group's cells."""


class Measured(NamedTuple):
    """Measured clearances of t pairs of shapes and solids at instants.

    Attributes:
        instant: (t,) index of the instant.
        link, other: (t,) the link and the other body, as in `NearEnd`.
        clearance: (t,) [m].
        group, shape, solid: (t,) the group, and in it the shape and the solid.
    """

    instant: Indices
    link: Indices
    other: Indices
    clearance: Array
    group: Indices
    shape: Indices
    solid: Indices


class InstantMeasurements:
    """Measures the clearances of pairs of links and other bodies at instants."""

    def __init__(
        self,
        bodies: Bodies,
        relative_bodies: RelativeBodies,
        joints: JointMap,
        groups: list[ObstacleGroup],
        requirements: PairRequirements,
        witness: Witness,
        sample: Callable[[Array], Array],
        frames: Frames,
        bound: Bound,
    ) -> None:
        """Note down what is needed.

        Args:
            bodies, relative_bodies, joints, groups: of the proof.
            requirements: which link and which other body each pair belongs to.
            witness: it measures pairs whose bounds are loose.
            sample: takes parameters of the curve (r,), gives configurations (r, n).
            frames: where the robot is.
            bound: bounds the clearances of pairs.
        """
        self._bodies, self._relative_bodies, self._joints, self._groups = bodies, relative_bodies, joints, groups
        self._requirements, self._witness, self._sample, self._frames, self._bound = (
            requirements,
            witness,
            sample,
            frames,
            bound,
        )

    def below(self, u: Array, limit: Array) -> Measured:
        """Measure the pairs of bodies that may have less than a limit.

        Args:
            u: (r,) the instants, in the parameter of the curve.
            limit: (l, k + l) by link and other body; pairs with minus infinity are left out [m].
        """
        q = self._sample(u)
        at_rest = LinearBounds(u=u, half=np.zeros(len(u)), q=q, rate=np.zeros_like(q), deviation=np.zeros_like(q))
        midpoints = IntervalMidpoints(self._bodies, self._relative_bodies, self._joints, self._frames, at_rest)
        parts = [self._of_group(group, midpoints, limit) for group in range(len(self._groups))]
        return Measured(*(np.concatenate(column) for column in zip(*parts, strict=True)))

    def _of_group(self, group: int, midpoints: IntervalMidpoints, limit: Array) -> Measured:
        which = self._groups[group]
        pairs = link_pairs(which, self._relative_bodies, 1)
        if which.cells is None:
            pairs = _repeated(pairs.select(np.isfinite(self._limits(group, pairs, limit))), len(midpoints.u))
        else:
            of_cells = self._requirements.of_cells(group, limit[:, : self._requirements.obstacles])
            link = self._requirements.link_of(pairs)
            pairs = _repeated(pairs.select(np.isfinite(of_cells[link, pairs.solid])), len(midpoints.u))
            known = self._bound(midpoints, group, pairs, True)
            pairs = pairs.select(known.at_midpoint < of_cells[self._requirements.link_of(pairs), pairs.solid])
            pairs = out_of_cells(which.cells, pairs)
        pairs, _ = self._close(group, midpoints, pairs, limit)
        pairs, known = self._close(group, midpoints, shape_pairs(which, self._bodies, self._relative_bodies, pairs), limit)
        clearance = self._measured(group, midpoints, pairs, known)
        shape = self._relative_bodies.body[pairs.relative]
        of_pairs = self._requirements.bodies_of(group, pairs)
        return Measured(pairs.interval, *of_pairs, clearance, np.full(len(shape), group), shape, pairs.solid)

    def nearest(self, near: NearEnd, u: Array) -> list[tuple[int, MeasuredPair]]:
        """Return the instants at which a near pair has about what is required or less, and its nearest shapes there.

        Args:
            near: the pair.
            u: (r,) the instants, in the parameter of the curve.
        """
        limit = np.full(self._requirements.required.shape, -np.inf)
        limit[near.link, near.other] = near.required + _AROUND
        if near.other >= self._requirements.obstacles:
            limit[near.other - self._requirements.obstacles, self._requirements.obstacles + near.link] = near.required + _AROUND
        found = self.below(u, limit)
        out: list[tuple[int, MeasuredPair]] = []
        for i in range(len(u)):
            rows = np.flatnonzero(found.instant == i)
            if rows.size:
                row = rows[np.argmin(found.clearance[rows])]
                out.append((i, MeasuredPair(int(found.group[row]), int(found.shape[row]), int(found.solid[row]))))
        return out

    def _limits(self, group: int, pairs: OpenPairs, limit: Array) -> Array:
        link, other = self._requirements.bodies_of(group, pairs)
        return limit[link, other]

    def _close(
        self, group: int, midpoints: IntervalMidpoints, pairs: OpenPairs, limit: Array
    ) -> tuple[OpenPairs, ClearanceBounds]:
        """Return the pairs that may have less than their limit, with their bounds."""
        if not len(pairs.interval):
            none = np.zeros(0)
            return pairs, ClearanceBounds(none, none, none)
        known = self._bound(midpoints, group, pairs, False)
        close = known.at_midpoint < self._limits(group, pairs, limit)
        return pairs.select(close), known.select(close)

    def _measured(self, group: int, midpoints: IntervalMidpoints, pairs: OpenPairs, known: ClearanceBounds) -> Array:
        """Return the clearances: the bounds where these are close to each other, else Coal's."""
        clearance, solids = known.at_most.copy(), self._groups[group].solids
        for row in np.flatnonzero(known.at_most - known.at_midpoint > _LOOSE).tolist():
            frames, solid = midpoints.frames[pairs.interval[row]], int(pairs.solid[row])
            shape = int(self._relative_bodies.body[pairs.relative[row]])
            clearance[row] = self._between(frames, shape, solids, solid)
        return clearance

    def _between(self, frames: Array, shape: int, solids: Solids | None, solid: int) -> float:
        if solids is None:
            return self._witness.distance_between(frames, shape, solid)[0]
        return self._witness.distance(frames, shape, solids, solid)[0]


def _repeated(pairs: OpenPairs, count: int) -> OpenPairs:
    """Return pairs on one interval on a number of intervals."""
    interval = np.repeat(np.arange(count), len(pairs.relative))
    return OpenPairs(interval, np.tile(pairs.relative, count), np.tile(pairs.solid, count))


Pair = tuple[int, int]


def find_near(
    requirements: PairRequirements, measure: InstantMeasurements, domain: tuple[float, float], among: NDArray[np.bool_]
) -> tuple[NearEnd, ...]:
    """Measure which pairs are near at the start or the goal, and when they are out.

    Args:
        requirements: what is required of the pairs.
        measure: measures clearances.
        domain: of the curve.
        among: (l, k + l) by link and other body: which pairs may be near; one of two links in one of its places.
    """
    required, obstacles = requirements.required, requirements.obstacles
    among = among.copy()
    among[:, obstacles:] |= among[:, obstacles:].T
    limit = np.where(among & (required > 0), required + _AROUND, -np.inf)
    at_ends = _least(measure.below(np.array(domain), limit), limit, obstacles, instants=2)
    near = (held_to(at_ends, required) < required).any(axis=0)
    pairs: list[Pair] = [(int(link), int(other)) for link, other in np.argwhere(near)]
    if not pairs:
        return ()
    u = np.linspace(*domain, _INSTANTS + 1)
    every = _clearances(requirements, measure, u, pairs)
    return tuple(
        _near_end(requirements, measure, pair, at_ends[:, pair[0], pair[1]], u, every[:, i]) for i, pair in enumerate(pairs)
    )


def _near_end(
    requirements: PairRequirements, measure: InstantMeasurements, pair: Pair, at_ends: Array, u: Array, clearances: Array
) -> NearEnd:
    """Return a pair with what it has at the ends (2,), and when it is out, by its clearances (r,) at instants (r,)."""
    required = float(requirements.required[pair])
    level = float(out_level(clearances.max(), required))
    at_start, at_goal = at_ends.tolist()
    starts_near, ends_near = (held_to(at_ends, required) < required).tolist()
    out = np.flatnonzero(clearances >= level)
    if not out.size:
        until = since = np.inf if starts_near else -np.inf
        return NearEnd(*pair, required, at_start, at_goal, until, since, level - required)

    def crossing(inside: int, outside: int) -> float:
        """Return an instant at which the pair is out, soon after it becomes so between these two."""
        near, far = float(u[inside]), float(u[outside])
        for _ in range(_ZOOMS):
            between = np.linspace(near, far, _ZOOM_INSTANTS)
            k = max(1, int(np.argmax(_clearances(requirements, measure, between, [pair])[:, 0] >= level)))
            near, far = float(between[k - 1]), float(between[k])
        return far

    first, last = int(out[0]), int(out[-1])
    until = crossing(max(0, first - 1), first) if starts_near else -np.inf
    since = crossing(min(len(u) - 1, last + 1), last) if ends_near else np.inf
    return NearEnd(*pair, required, at_start, at_goal, until, since, level - required)


def _clearances(requirements: PairRequirements, measure: InstantMeasurements, u: Array, pairs: list[Pair]) -> Array:
    """Return the clearances of some pairs (r, number of pairs) at instants, or a little more than required if it is more."""
    obstacles, limit = requirements.obstacles, np.full(requirements.required.shape, -np.inf)
    for link, other in pairs:
        limit[link, other] = requirements.required[link, other] + _AROUND
        if other >= obstacles:
            limit[other - obstacles, obstacles + link] = limit[link, other]
    least = _least(measure.below(u, limit), limit, obstacles, instants=len(u))
    return np.stack([least[:, link, other] for link, other in pairs], axis=1)


def _least(found: Measured, limit: Array, obstacles: int, *, instants: int) -> Array:
    """Return the least clearance of each pair at each instant (r, l, k + l), and the limit where none was found below it.

    A pair of two links is in the row of the one that comes first.
    """
    out = np.repeat(np.where(np.isfinite(limit), limit, np.inf)[None], instants, axis=0)
    between = found.other >= obstacles
    other = np.where(between, found.other - obstacles, found.link)
    link = np.minimum(found.link, other)
    other = np.where(between, np.maximum(found.link, other) + obstacles, found.other)
    np.minimum.at(out, (found.instant, link, other), found.clearance)
    return out
