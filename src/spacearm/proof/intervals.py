"""The logic of the proof: stretches of the motion are halved until each is proven.

On each stretch every pair has to be separated by a plane for all of it. Links are looked at as balls first, many balls as
cells; the pairs that this does not settle are looked at capsule by capsule, ball by ball; those that are still open are looked
at again on both halves, and only those. Halving goes on until half of the least clearance measured is proven, so that the
proven figure is not a matter of luck.
"""

from __future__ import annotations

from collections import deque
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from spacearm.geometry import Scene
from spacearm.proof.base_track import BaseProof
from spacearm.proof.displacement import JointMap, Lines, Middles, Spans, Stretches
from spacearm.proof.separation import (
    DISAGREEMENT,
    GUARD,
    Gaps,
    Measurements,
    Near,
    Tasks,
    capsule_pairs,
    gaps,
    halved,
    kinds_of,
    link_pairs,
    link_solids,
    out_of_cells,
)
from spacearm.proof.solids import Solids, lengths
from spacearm.proof.witness import Witness
from spacearm.robot import Robot

Array = NDArray[np.float64]
Indices = NDArray[np.intp]
Status = Literal["holds", "fails", "undecided"]

_WORTH = 0.5  # the share of the least clearance measured that is to be proven
_BATCH = 128  # stretches at once
_ROWS = 100_000  # pairs at once
_MOST = 100_000  # stretches looked at before giving up
_LIKELY = 24  # pairs of links and solids that are looked at first, for the least clearance
_CLOSE = 2.0  # times the least clearance: what is closer is measured
_CONTACTS = 8  # that are measured, of the pairs that seem to touch
_LOOSE = 1e-7  # [m] a pair's clearance that is not known to this is worth a measurement


class Proof:
    """A search for a proof that a robot keeps more than a clearance from a scene and from itself along a trajectory.

    Attributes:
        proven: the clearance is at least this on all that is settled so far [m]; infinite if nothing is in the way.
        measured: the closest approach, if anything is in the way.
        evaluations: configurations looked at.
        resolution: the shortest stretch looked at, as a share of the curve, all its pieces counting alike.
    """

    def __init__(
        self, robot: Robot, scene: Scene, base: BaseProof, *, minimum: float, resolution: float, worth: float = _WORTH
    ) -> None:
        self._bodies, self._relative_bodies = base.bodies()
        self._joints, self._kinds = JointMap(robot), kinds_of(scene, self._relative_bodies)
        self._base, self._curve, self._minimum, self._finest = base, base.curve, minimum, resolution
        self.witness = Witness(robot, self._bodies)
        self.measured = Measurements(self.witness, self._kinds, self._bodies, self._relative_bodies)
        self._links: Solids | None = None  # the robot itself, at the stretches that are looked at
        self.proven = self._least = np.inf
        self._worth = worth
        self.evaluations, self.resolution = 0, 1.0

    def largest(self) -> float:
        """Return the largest length and joint value that the proof computes with [m or rad]; NaN if one is none."""
        _, low, high = self._curve.hulls(0, bisections=0)
        numbers = [low, high, self._joints.offset, self._joints.multiplier, self._joints.reach]
        numbers += [self._bodies.ends, self._bodies.radius, self._base.setup.start]
        numbers += [array for kind in self._kinds if kind.solids is not None for array in lengths(kind.solids)]
        return float(np.max([np.abs(array).max(initial=0.0) for array in numbers]))

    def begin(self) -> None:
        """Find out where the base goes, before anything else; `largest` may be asked first."""
        self._base.begin(self.witness.frames(self._joints.values(self._curve.sample(np.array(self._curve.domain[:1]))))[0])

    def frames_at(self, u: Array) -> Array:
        """Return T_w_joint (r, j + 1, 4, 4) at parameters (r,); the last is the base."""
        return self._frames(u, self._joints.values(self._curve.sample(u)))

    def run(self) -> Status:
        """Search until the proof holds, a collision is found, or the two cannot be told apart."""
        if not self._kinds:
            return "holds"
        spans = Spans(self._curve)
        waiting: deque[tuple[Stretches, list[Tasks] | None]] = deque([(spans.first(), None)])
        while waiting:
            stretches, tasks = waiting.popleft()
            middles = self._middles(spans.lines(stretches))
            self.evaluations += len(stretches)
            self.resolution = min(self.resolution, float(stretches.share.min()))
            left = self._look(middles, tasks)
            if self.measured.clearance <= self._minimum:
                return "fails"
            which = np.unique(np.concatenate([pairs.stretch for pairs in left]))
            open_stretches = stretches.some(which)
            hopeless = (open_stretches.share / 2 < self._finest).any() or (which.size and self.evaluations > _MOST)
            if self.measured.doubt or hopeless or self._least <= self._minimum + GUARD:
                return "undecided"
            if not which.size:
                continue
            parts, tasks = spans.halved(open_stretches), [halved(pairs, which) for pairs in left]
            for i in range(0, len(parts), _BATCH):
                waiting.append((parts.some(np.arange(i, min(i + _BATCH, len(parts)))), [_batch(pairs, i) for pairs in tasks]))
        return "holds"

    def judged(self) -> tuple[Status, Near | None]:
        """Run, then measure around the closest approach; what is measured there counts too.

        Returns:
            The status, and the closest approach; None if nothing is in the way.
        """
        status = self.run()
        begin, end = self._curve.domain
        near = self.measured.closest((begin, end), self.frames_at, (end - begin) * min(self.resolution, 0.1))
        if near is not None and near.clearance <= self._minimum:
            return "fails", near
        if near is not None and status == "holds" and near.clearance < self.proven - DISAGREEMENT:
            return "undecided", near
        return status, near

    def _frames(self, u: Array, values: Array) -> Array:
        return self._base.placed(u, self.witness.frames(values))

    def _middles(self, lines: Lines) -> Middles:
        return Middles(self._bodies, self._relative_bodies, self._joints, self._frames, lines, self._base.motion_bounds)

    # ---- one look at some stretches ------------------------------------------------------------------------------------

    def _look(self, middles: Middles, tasks: list[Tasks] | None) -> list[Tasks]:
        """Settle what can be settled, and return the pairs that are open still, by kind; at first, all pairs are."""
        if self._kinds[-1].solids is None:  # the robot's links, too, are to be kept from
            self._links = link_solids(self._bodies, middles)
        if tasks is None:
            middles.watch(np.arange(len(self._relative_bodies.body)))
            tasks = self._close_pairs(middles)
        else:
            middles.watch(np.unique(np.concatenate([pairs.relative for pairs in tasks])))
        found = [self._sharpened(middles, kind, pairs) for kind, pairs in enumerate(tasks)]
        self._measure_nearest(middles, tasks, found)
        return [pairs.some(~self._settled(known)) for pairs, known in zip(tasks, found, strict=True)]

    def _target(self) -> float:
        """Return what is to be proven."""
        return self._minimum + self._worth * max(0.0, self._least - self._minimum)

    def _settled(self, known: Gaps) -> NDArray[np.bool_]:
        """Return which pairs are proven to be apart, and remember how far."""
        settled = known.left > self._target()
        self.proven = min(self.proven, float(known.left[settled].min(initial=np.inf)))
        return settled

    def _gaps(self, middles: Middles, kind: int, tasks: Tasks, *, enough: float, n: Array | None = None) -> Gaps:
        solids = self._kinds[kind].solids
        if solids is None:
            assert self._links is not None
            solids = self._links
            tasks = tasks._replace(solid=tasks.stretch * len(self._bodies.radius) + tasks.solid)
        return self._gaps_to(solids, middles, tasks, enough=enough, n=n)

    def _gaps_to(self, solids: Solids, middles: Middles, tasks: Tasks, *, enough: float, n: Array | None = None) -> Gaps:
        parts = []
        for i in range(0, max(1, len(tasks.stretch)), _ROWS):
            rows = slice(i, i + _ROWS)
            directions = None if n is None else n[rows]
            parts.append(
                gaps(middles, self._bodies, self._relative_bodies, tasks.some(rows), solids, enough=enough, n=directions)
            )
        return Gaps(*(np.concatenate(column) for column in zip(*parts, strict=True)))

    def _close_pairs(self, middles: Middles) -> list[Tasks]:
        """Return the pairs of capsules and solids that their links' balls do not settle, by kind."""
        coarse = []
        for i, kind in enumerate(self._kinds):
            tasks = link_pairs(kind, self._relative_bodies, len(middles.half))
            if kind.cells is None:
                known = self._gaps(middles, i, tasks, enough=self._minimum)
            else:
                known = self._gaps_to(kind.cells, middles, tasks, enough=self._minimum)
            coarse.append((kind, tasks, known))
        for i, (kind, tasks, known) in enumerate(coarse):  # the links that are closest, as if it were all
            likely = np.argpartition(known.least, min(_LIKELY, len(known.least)) - 1)[:_LIKELY]
            pairs = tasks.some(likely) if kind.cells is None else out_of_cells(kind.cells, tasks.some(likely))
            pairs = capsule_pairs(kind, self._bodies, self._relative_bodies, pairs)
            known = self._gaps(middles, i, pairs, enough=-np.inf)
            row = int(np.argmin(known.most))
            self.measured.task(i, pairs, row, middles, proven=float(known.least[row]))
            self._least = min(self._least, float(known.most[row]), self.measured.clearance)
        out = []
        for i, (kind, tasks, known) in enumerate(coarse):
            pairs = tasks.some(~self._settled(known))
            if kind.cells is not None:
                pairs = out_of_cells(kind.cells, pairs)
                pairs = pairs.some(~self._settled(self._gaps(middles, i, pairs, enough=self._target())))
            out.append(capsule_pairs(kind, self._bodies, self._relative_bodies, pairs))
        return out

    def _sharpened(self, middles: Middles, kind: int, tasks: Tasks) -> Gaps:
        """Look at pairs; where a better direction may settle one, ask Coal for it."""
        target = self._target()
        known = self._gaps(middles, kind, tasks, enough=target)
        ask = np.flatnonzero((known.left <= target) & (known.most > target))
        loose = known.most[ask] - known.least[ask]
        ask = ask[(loose > _LOOSE) & (known.left[ask] + loose > target)]
        if not ask.size:
            return known
        measured = [self.measured.task(kind, tasks, row, middles, proven=float(known.least[row])) for row in ask]
        n = np.array([direction for _, direction in measured])
        better = self._gaps(middles, kind, tasks.some(ask), enough=target, n=n)
        known.left[ask] = np.fmax(known.left[ask], better.left)
        known.least[ask] = np.fmax(known.least[ask], better.least)
        known.most[ask] = np.fmin(known.most[ask], [clearance for clearance, _ in measured])
        return known

    def _measure_nearest(self, middles: Middles, tasks: list[Tasks], found: list[Gaps]) -> None:
        """Measure what seems close: on every stretch the pair that seems closest, and some of those that seem to touch."""
        most = np.concatenate([known.most for known in found])
        self._least = min(self._least, float(most.min(initial=np.inf)))
        close = np.flatnonzero(most <= self._minimum + _CLOSE * max(self._least - self._minimum, GUARD))
        close = close[np.argsort(most[close], kind="stable")]
        stretch = np.concatenate([pairs.stretch for pairs in tasks])[close]
        _, nearest = np.unique(stretch, return_index=True)
        touching = np.flatnonzero(most[close[:_CONTACTS]] <= self._minimum + GUARD)
        first = np.cumsum([0, *(len(pairs.stretch) for pairs in tasks)])
        for i in close[np.union1d(nearest, touching)].tolist():
            kind = int(np.searchsorted(first, i, side="right")) - 1
            row = i - int(first[kind])
            self.measured.task(kind, tasks[kind], row, middles, proven=float(found[kind].least[row]))
        self._least = min(self._least, self.measured.clearance)


def _batch(tasks: Tasks, first: int) -> Tasks:
    """Return the pairs on a batch of stretches, numbered from its first."""
    within = (tasks.stretch >= first) & (tasks.stretch < first + _BATCH)
    some = tasks.some(within)
    return some._replace(stretch=some.stretch - first)
