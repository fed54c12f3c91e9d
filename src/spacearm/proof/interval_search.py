"""The search for a proof: intervals of the motion are halved until every pair is proven to be apart on each of them.

Links are first enclosed in balls, and many balls of a scene in cells. Pairs that these do not settle are evaluated shape by
shape and ball by ball. A pair that is still open is evaluated again on both halves of its interval; settled pairs are not.
Halving goes on until half of the least measured clearance is proven. So the proven clearance does not depend on where the
intervals happen to end.
"""

from __future__ import annotations

from bisect import bisect_right
from collections import deque
from itertools import accumulate
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from spacearm.geometry import Scene
from spacearm.proof.base_proofs import BaseProof
from spacearm.proof.bodies import JointMap
from spacearm.proof.displacement import IntervalMidpoints
from spacearm.proof.measured_instants import InstantMeasurements, find_near
from spacearm.proof.pair_requirements import Held, PairRequirements
from spacearm.proof.path_intervals import Intervals, LinearBounds, PathIntervals
from spacearm.proof.required_clearance import RequiredClearance
from spacearm.proof.separation import (
    DISAGREEMENT,
    GUARD,
    ClearanceBounds,
    Measurements,
    NearestPair,
    OpenPairs,
    by_group,
    clearance_bounds,
    halved,
    link_pairs,
    obstacle_groups,
    out_of_cells,
    shape_pairs,
    some_of,
)
from spacearm.proof.solids import Polytopes, Solids, lengths
from spacearm.proof.witness import Witness
from spacearm.robot import Robot

Array = NDArray[np.float64]
Indices = NDArray[np.intp]
Status = Literal["holds", "fails", "undecided"]

_PROVEN_SHARE = 0.5  # times the least measured excess: what is to be proven above what a pair is held to
_BATCH = 128  # intervals evaluated at once
_ROWS = 100_000  # pairs evaluated at once, which bounds the memory
_ROWS_OF_CORNERS = 10_000  # likewise, if a body may have up to 32 points in place of two
_ROWS_OF_POLYTOPES = 2_000  # likewise, of solids that are polytopes: each takes some arrays of its vertices
_MOST_INTERVALS = 100_000  # evaluated before the search gives up
_LIKELY = 24  # pairs of links and solids that are evaluated first, to find the least clearance early
_CLOSE = 2.0  # times the least excess: pairs that seem to have less are measured
_CONTACTS = 8  # pairs measured at once of those that seem to touch
_JUST_OUT = 1e-9  # times the length of the curve: so soon after it gets out a pair is measured
_LOOSE = 1e-7  # [m] Coal is asked about a pair if its bounds at the midpoint are further apart than this


class ClearanceProof:
    """A search for a proof that a robot keeps more than a clearance from a scene and from itself along a trajectory.

    What a pair has more than it is held to is its excess. `pair_requirements` says what a pair is held to, and in which phase
    it is; what is proven and measured is remembered by phase.

    Attributes:
        witness: kinematics and distances.
        measured: the measurements, with the closest approach.
        requirements: what pairs are held to, and which are near at an end.
        proven: (p,) the clearance is at least this for all pairs that are settled so far, by phase [m]; infinite if nothing is
            in the way.
        evaluations: configurations evaluated.
        resolution: the shortest interval evaluated, as a share of the curve, all its pieces counting alike.
    """

    def __init__(
        self,
        robot: Robot,
        scene: Scene,
        base: BaseProof,
        *,
        required: RequiredClearance,
        resolution: float,
        proven_share: float = _PROVEN_SHARE,
    ) -> None:
        """Prepare the search; nothing is computed yet.

        Args:
            robot, scene: what must keep clear.
            base: the base along the trajectory.
            required: the clearances that must be exceeded.
            resolution: intervals shorter than this share of the curve are not halved.
            proven_share: of the least measured excess, that is to be proven.
        """
        self._bodies, self._relative_bodies = base.bodies()
        self._joints, self._groups = JointMap(robot), obstacle_groups(scene, self._relative_bodies)
        self._base, self._curve, self._finest = base, base.curve, resolution
        self.witness = Witness(robot, self._bodies)
        self.requirements = PairRequirements(required, robot, self._bodies, self._relative_bodies, self._groups)
        self.measured = Measurements(self.witness, self._groups, self._bodies, self._relative_bodies, self.requirements.at)
        self.proven, self._least = np.full(1, np.inf), np.full(1, np.inf)  # _least: (p,) the least excess seen
        self._proven_share = proven_share
        self.evaluations, self.resolution = 0, 1.0

    def largest_number(self) -> float:
        """Return the largest length and joint value that the proof computes with [m or rad]; NaN if one of them is NaN."""
        _, low, high = self._curve.hulls(0, bisections=0)
        numbers = [low, high, self._joints.offset, self._joints.multiplier, self._joints.parent_offset]
        numbers += [self._bodies.radius, self._base.setup.start, *(group.points for group in self._bodies.groups)]
        numbers += [array for group in self._groups if group.solids is not None for array in lengths(group.solids)]
        return float(np.max([np.abs(array).max(initial=0.0) for array in numbers]))

    def integrate_base(self) -> None:
        """Compute where the base goes; `largest_number` alone may be asked for before."""
        self._base.begin(self.witness.frames(self._joints.values(self._curve.sample(np.array(self._curve.domain[:1]))))[0])

    def frames_at(self, u: Array) -> Array:
        """Return T_w_joint (r, j + 1, 4, 4) at parameters (r,); the last is the base."""
        return self._frames(u, self._joints.values(self._curve.sample(u)))

    def result(self) -> tuple[Status, NearestPair | None]:
        """Search, then measure around the closest approaches; these measurements count, too.

        Returns:
            The status, and the closest approach, or the worst one if it fails; None if nothing is in the way.
        """
        status = self._search()
        begin, end = self._curve.domain
        self._measure_near()
        self.measured.zoom((begin, end), self.frames_at, (end - begin) * min(self.resolution, 0.1))
        worst = self.measured.worst
        if worst is not None and worst.clearance <= worst.required:
            return "fails", worst
        if status == "holds" and (self.measured.clearance < self.proven - DISAGREEMENT).any():
            return "undecided", worst
        if status == "undecided":
            return status, worst
        nearest = self.measured.closest(self.requirements.full_phases)
        return status, nearest or self.measured.closest(range(len(self.proven)))

    @property
    def proven_in_full(self) -> float:
        """The clearance is at least this for all pairs that are held to what is required [m]; infinite if there are none.

        If none is held to that at any time, it is the clearance of all pairs.
        """
        full = float(self.proven[self.requirements.full_phases].min())
        return full if np.isfinite(full) else float(self.proven.min())

    def _find_near(
        self, midpoints: IntervalMidpoints, pairs: list[OpenPairs], found: list[ClearanceBounds], held: list[Held]
    ) -> bool:
        """Find the pairs that are near at an end, among those that are not settled on the first and the last interval.

        If there are any, what was proven and measured is forgotten.
        """
        begin, end = self._curve.domain
        at_end = (midpoints.u - midpoints.half <= begin) | (midpoints.u + midpoints.half >= end)
        among = np.zeros(self.requirements.required.shape, dtype=bool)
        for group, (some, known, of_group) in enumerate(zip(pairs, found, held, strict=True)):
            left = some.select(at_end[some.interval] & (known.on_interval <= of_group.required))
            among[self.requirements.bodies_of(group, left)] = True
        if not among.any():
            return False
        near = find_near(self.requirements, self._instants(), self._curve.domain, among)
        if not near:
            return False
        self.requirements.set_near(near)
        phases = self.requirements.phases
        self.measured.begin(phases=phases)
        self.proven, self._least = np.full(phases, np.inf), np.full(phases, np.inf)
        self._least[1:] = self.requirements.known_excess()
        return True

    def _instants(self) -> InstantMeasurements:
        return InstantMeasurements(
            self._bodies,
            self._relative_bodies,
            self._joints,
            self._groups,
            self.requirements,
            self.witness,
            self._curve.sample,
            self._frames,
            self._bounds_at_instants,
        )

    def _measure_near(self) -> None:
        """Measure the pairs near at an end at the ends, and where they have just got out: their least may be there."""
        begin, end = self._curve.domain
        little = _JUST_OUT * (end - begin)
        for near in self.requirements.near:
            u = np.clip([begin, near.until + little, near.since - little, end], begin, end)
            frames = self.frames_at(u)
            for i, pair in self._instants().nearest(near, u):
                self.measured.measure_at(pair, frames[i], float(u[i]))

    def _bounds_at_instants(self, midpoints: IntervalMidpoints, group: int, pairs: OpenPairs, cells: bool) -> ClearanceBounds:
        of_cells = self._groups[group].cells
        if cells and of_cells is not None:
            return self._bounds_to(of_cells, midpoints, pairs, enough=None)
        return self._bounds(midpoints, group, pairs, enough=None)

    def _search(self) -> Status:
        """Halve intervals until the proof holds, a collision is found, or the two cannot be distinguished."""
        if not self._groups:
            return "holds"
        path = PathIntervals(self._curve)
        waiting: deque[tuple[Intervals, list[OpenPairs] | None]] = deque([(path.first(), None)])
        while waiting:
            intervals, pairs = waiting.popleft()
            midpoints = self._midpoints(path.linear_bounds(intervals))
            self.evaluations += len(intervals)
            self.resolution = min(self.resolution, float(intervals.share.min()))
            left = self._settle(midpoints, pairs)
            if (self.measured.excess <= 0).any():
                return "fails"
            which = np.unique(np.concatenate([of_group.interval for of_group in left]))
            open_intervals = intervals.select(which)
            hopeless = (open_intervals.share / 2 < self._finest).any() or (which.size and self.evaluations > _MOST_INTERVALS)
            if self.measured.contradicted or hopeless or (self._least <= GUARD).any():
                return "undecided"
            if not which.size:
                continue
            halves, pairs = path.halved(open_intervals), [halved(of_group, which) for of_group in left]
            for i in range(0, len(halves), _BATCH):
                batch = halves.select(np.arange(i, min(i + _BATCH, len(halves))))
                waiting.append((batch, [_in_batch(of_group, i) for of_group in pairs]))
        return "holds"

    def _frames(self, u: Array, values: Array) -> Array:
        return self._base.placed(u, self.witness.frames(values))

    def _midpoints(self, linear: LinearBounds) -> IntervalMidpoints:
        return IntervalMidpoints(
            self._bodies, self._relative_bodies, self._joints, self._frames, linear, self._base.motion_bounds
        )

    # ---- one evaluation of some intervals ------------------------------------------------------------------------------

    def _settle(self, midpoints: IntervalMidpoints, pairs: list[OpenPairs] | None) -> list[OpenPairs]:
        """Settle what can be settled, and return the pairs that are still open, by group. None: all pairs are open."""
        begins = pairs is None and self.requirements.greatest > 0 and not self.requirements.near
        if pairs is None:
            midpoints.bound(np.flatnonzero(self._relative_bodies.count))  # the balls around links
            pairs = self._close_pairs(midpoints)
        midpoints.bound(_used(pairs))
        held = [self.requirements.on(group, of_group, midpoints) for group, of_group in enumerate(pairs)]
        found = [self._sharpened(midpoints, group, pairs[group], of_group) for group, of_group in enumerate(held)]
        if begins and self._find_near(midpoints, pairs, found, held):
            return self._settle(midpoints, None)
        self._measure_nearest(midpoints, pairs, found, held)
        return [pairs[i].select(~self._settled(found[i], of_group)) for i, of_group in enumerate(held)]

    def _target(self, held: Held) -> Array | float:
        """Return the clearances that are to be proven [m]."""
        if isinstance(held.phase, int):
            return held.required + self._proven_share * max(0.0, self._least.item(held.phase))
        return held.required + self._proven_share * np.maximum(0.0, self._least[held.phase])

    def _settled(self, known: ClearanceBounds, held: Held) -> NDArray[np.bool_]:
        """Return which pairs are proven to be apart, and remember how far."""
        settled = known.on_interval > self._target(held)
        _note_least(self.proven, known.on_interval[settled], some_of(held.phase, settled))
        return settled

    def _bounds(
        self,
        midpoints: IntervalMidpoints,
        group: int,
        pairs: OpenPairs,
        *,
        enough: Array | float | None,
        n: Array | None = None,
    ) -> ClearanceBounds:
        """Bound the clearance of pairs of a group; see `clearance_bounds`."""
        solids, bodies = self._groups[group].solids, self._bodies
        if solids is not None:
            return self._bounds_to(solids, midpoints, pairs, enough=enough, n=n)

        def of_group(other: int, rows: Indices | slice) -> ClearanceBounds:
            some = pairs.select(rows)
            solid = some.interval * len(bodies.groups[other].body) + bodies.place[some.solid]
            of_rows, directions = some_of(enough, rows), None if n is None else n[rows]
            return self._bounds_to(midpoints.solids(other), midpoints, some._replace(solid=solid), enough=of_rows, n=directions)

        if len(bodies.groups) == 1:
            return of_group(0, slice(None))
        return by_group(bodies.group[pairs.solid], of_group)

    def _bounds_to(
        self,
        solids: Solids,
        midpoints: IntervalMidpoints,
        pairs: OpenPairs,
        *,
        enough: Array | float | None,
        n: Array | None = None,
    ) -> ClearanceBounds:
        parts: list[ClearanceBounds] = []
        step = _ROWS if len(self._bodies.groups) == 1 else _ROWS_OF_CORNERS
        step = _ROWS_OF_POLYTOPES if isinstance(solids, Polytopes) else step
        for i in range(0, max(1, len(pairs.interval)), step):
            rows = slice(i, i + step)
            some, directions = pairs.select(rows), None if n is None else n[rows]
            of_rows = clearance_bounds(
                midpoints, self._bodies, self._relative_bodies, some, solids, enough=some_of(enough, rows), n=directions
            )
            parts.append(of_rows)
        return ClearanceBounds(*(np.concatenate(column) for column in zip(*parts, strict=True)))

    def _close_pairs(self, midpoints: IntervalMidpoints) -> list[OpenPairs]:
        """Return the pairs of shapes and solids that their links' balls and their cells do not settle, by group."""
        coarse: list[tuple[OpenPairs, ClearanceBounds, Held]] = []
        for i, group in enumerate(self._groups):
            pairs = link_pairs(group, self._relative_bodies, len(midpoints.half))
            if group.cells is None:
                held = self.requirements.on(i, pairs, midpoints)
                known = self._bounds(midpoints, i, pairs, enough=held.required)
            else:
                held = self.requirements.on_cells(i, pairs)
                known = self._bounds_to(group.cells, midpoints, pairs, enough=held.required)
            coarse.append((pairs, known, held))
        for i, (pairs, known, held) in enumerate(coarse):
            self._find_least(midpoints, i, pairs, known.at_midpoint - held.at_midpoint, held)
        out: list[OpenPairs] = []
        for i, (group, (pairs, known, held)) in enumerate(zip(self._groups, coarse, strict=True)):
            left = pairs.select(~self._settled(known, held))
            if group.cells is not None:
                left = out_of_cells(group.cells, left)
                held = self.requirements.on(i, left, midpoints)
                known = self._bounds(midpoints, i, left, enough=self._target(held))
                left = left.select(~self._settled(known, held))
            out.append(shape_pairs(group, self._bodies, self._relative_bodies, left))
        return out

    def _find_least(self, midpoints: IntervalMidpoints, i: int, pairs: OpenPairs, excess: Array, held: Held) -> None:
        """Look for the least excess of group i among the shapes of the links that seem closest, and measure one pair.

        Pairs that are near at an end are left out: what they have there is known.
        """
        group = self._groups[i]
        excess = _never_near(excess, held)
        likely = np.argpartition(excess, min(_LIKELY, len(excess)) - 1)[:_LIKELY]
        close = pairs.select(likely) if group.cells is None else out_of_cells(group.cells, pairs.select(likely))
        close = shape_pairs(group, self._bodies, self._relative_bodies, close)
        held = self.requirements.on(i, close, midpoints)
        known = self._bounds(midpoints, i, close, enough=None)
        excess = known.at_most - held.at_midpoint
        row = int(np.argmin(_never_near(excess, held)))
        self.measured.measure(i, close, row, midpoints, proven=float(known.at_midpoint[row]))
        _note_least(self._least, excess, held.phase_at_midpoint)
        self._least = np.minimum(self._least, self.measured.excess)

    def _sharpened(self, midpoints: IntervalMidpoints, group: int, pairs: OpenPairs, held: Held) -> ClearanceBounds:
        """Bound the clearance of pairs; where a better direction may settle a pair, ask Coal for one."""
        target = self._target(held)
        known = self._bounds(midpoints, group, pairs, enough=target)
        ask = np.flatnonzero((known.on_interval <= target) & (known.at_most > target))
        loose = known.at_most[ask] - known.at_midpoint[ask]
        ask = ask[(loose > _LOOSE) & (known.on_interval[ask] + loose > some_of(target, ask))]
        if not ask.size:
            return known
        measured = [
            self.measured.measure(group, pairs, row, midpoints, proven=float(known.at_midpoint[row])) for row in ask.tolist()
        ]
        n = np.array([direction for _, direction in measured])
        better = self._bounds(midpoints, group, pairs.select(ask), enough=some_of(target, ask), n=n)
        known.on_interval[ask] = np.fmax(known.on_interval[ask], better.on_interval)
        known.at_midpoint[ask] = np.fmax(known.at_midpoint[ask], better.at_midpoint)
        known.at_most[ask] = np.fmin(known.at_most[ask], [clearance for clearance, _ in measured])
        return known

    def _measure_nearest(
        self, midpoints: IntervalMidpoints, pairs: list[OpenPairs], found: list[ClearanceBounds], held: list[Held]
    ) -> None:
        """Measure what seems close: on every interval the pair that seems closest, and some of those that seem to touch.

        Close means that the pair has little more at the midpoint than it is held to there.
        """
        most = np.concatenate([known.at_most - of_group.at_midpoint for known, of_group in zip(found, held, strict=True)])
        phase: Indices | int = 0
        if self.requirements.near:
            phase = np.concatenate(
                [
                    np.broadcast_to(of_group.phase_at_midpoint, known.at_most.shape)
                    for known, of_group in zip(found, held, strict=True)
                ]
            )
        _note_least(self._least, most, phase)
        close = np.flatnonzero(most <= _CLOSE * np.maximum(self._least[phase], GUARD))
        close = close[np.argsort(most[close], kind="stable")]
        interval = np.concatenate([of_group.interval for of_group in pairs])[close]
        _, nearest = np.unique(interval, return_index=True)
        touching = np.flatnonzero(most[close[:_CONTACTS]] <= GUARD)
        first = list(accumulate((len(of_group.interval) for of_group in pairs), initial=0))
        for i in close[np.union1d(nearest, touching)].tolist():
            group = bisect_right(first, i) - 1
            row = i - first[group]
            self.measured.measure(group, pairs[group], row, midpoints, proven=float(found[group].at_midpoint[row]))
        self._least = np.minimum(self._least, self.measured.excess)


def _never_near(excess: Array, held: Held) -> Array:
    """Return the excess of pairs, infinite for those of a pair that is near at an end."""
    return excess if isinstance(held.phase, int) else np.where(held.phase_at_midpoint, np.inf, excess)


def _note_least(least: Array, values: Array, phase: Indices | int) -> None:
    """Lessen the least values of phases by values (t,) of one phase, or of a phase each."""
    if isinstance(phase, int):
        least[phase] = min(least[phase], float(values.min(initial=np.inf)))
    else:
        np.minimum.at(least, phase, values)


def _used(pairs: list[OpenPairs]) -> Indices:
    """Return the relative bodies of pairs."""
    return np.unique(np.concatenate([of_group.relative for of_group in pairs]))


def _in_batch(pairs: OpenPairs, first: int) -> OpenPairs:
    """Return the pairs on a batch of intervals, numbered from its first."""
    within = (pairs.interval >= first) & (pairs.interval < first + _BATCH)
    some = pairs.select(within)
    return some._replace(interval=some.interval - first)
