"""Clearances of a motion over time for a report: which pairs come nearest, how near, and the closest pair's points.

All is measured natively, as the proof measures; the points of the closest pair are Coal's. Nothing proven rests on it. A motion
need not be proven, nor be free of collision: a pair that touches has 0 or less.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spacearm.core.errors import ProblemError
from spacearm.geometry import Scene
from spacearm.motion import AnyTrajectory, Trajectory
from spacearm.proof.base_proofs import base_setup_of, begun_base_proof
from spacearm.proof.claim import Claim, claim_of
from spacearm.proof.convex_bodies import WORLD
from spacearm.proof.measured import coal_bodies, frames_at, least_clearances
from spacearm.proof.path_intervals import PathIntervals
from spacearm.proof.required_clearance import RequiredClearance
from spacearm.report.report_page import packed

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

MOST_PAIRS = 7
"""Pairs that have a curve of their own: those that come nearest."""

INSTANTS = 170
"""At which the closest pair's points are computed, at least; evenly spread."""

_COARSE = 65  # instants at which it is found out which pairs come nearest
_AT_ONCE = 3_000_000  # clearances of all pairs and instants of one measurement
_WITHIN = (0.05, 0.3, 2.0, np.inf)  # [m] it is first looked for near pairs, since that is quicker
_AROUND = 1e-4  # [m] by which a limit is above what is known


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PairClearances:
    """Clearances of the nearest pairs, and of all pairs.

    Attributes:
        t: (m,) instants [s].
        names: of the nearest pairs, the nearest first, as "link 'hand' and obstacle 'mast'".
        values: (m, number of names) their clearances [m].
        least: (m,) the least of all pairs [m].
        pairs: how many pairs there are in all.
    """

    t: Array
    names: tuple[str, ...]
    values: Array
    least: Array
    pairs: int


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ClosestPairs:
    """The closest pair at instants.

    Attributes:
        t: (m,) instants [s].
        distance: (m,) [m]; negative for a penetration.
        points: (m, 2, 3) the nearest points, or those that penetrate deepest, in the inertial frame [m].
        pair: (m,) indices of names.
        names: as in `PairClearances`.
    """

    t: Array
    distance: Array
    points: Array
    pair: Indices
    names: tuple[str, ...]

    def data(self) -> dict[str, Any]:
        """Return this as the page reads it."""
        return {
            "t": packed(self.t),
            "distance": packed(self.distance),
            "points": packed(self.points),
            "pair": packed(self.pair, "u16"),
            "names": list(self.names),
        }


class MeasuredMotion:
    """A motion whose clearances can be measured: every link to every obstacle, and to the links that it keeps clear of.

    Links that cannot meet within the limits (`robot.apart`) are left out.
    """

    def __init__(self, scene: Scene, trajectory: AnyTrajectory) -> None:
        """Prepare the bodies and the motion.

        Raises:
            RobotError: a floating base of a robot whose masses cannot be.
            ProblemError: the momentum turns the base too often.
        """
        robot = trajectory.robot
        base = begun_base_proof(robot, trajectory, base_setup_of(trajectory, robot, who="trajectory"))
        links = tuple(dict.fromkeys(shape.name for shape in robot.shapes))
        none = RequiredClearance(
            links=links,
            to_obstacles=np.zeros((len(links), len(scene.obstacles))),
            between_links=np.zeros((len(links), len(links))),
        )
        self.trajectory, self._scene, self._links = trajectory, scene, links
        self._claim: Claim = claim_of(robot, scene, base, PathIntervals(base.curve), required=none)
        self._kept = self._kept_pairs()

    @property
    def is_free(self) -> bool:
        """Whether there is no pair at all."""
        return not self._kept.any()

    def over(self, t: Array) -> PairClearances:
        """Measure at instants (m,) [s].

        Raises:
            ProblemError: numbers so large that no clearance can be measured.
        """
        by_pair = self._nearest_pairs(np.linspace(t[0], t[-1], _COARSE))
        order = np.argsort(by_pair, axis=None, kind="stable")[:MOST_PAIRS]
        nearest = [divmod(int(i), by_pair.shape[1]) for i in order if np.isfinite(by_pair.flat[i])]
        if not nearest:
            raise ProblemError(
                "no pair of bodies has a clearance that can be measured, expected one; check the scene's numbers"
            )
        link, other = (np.array(part, dtype=np.intp) for part in zip(*nearest, strict=True))
        only = np.full(self._kept.shape, -np.inf)
        only[link, other] = np.inf
        values = np.concatenate([self._at(t[part], only)[0][:, link, other] for part in self._parts(len(t))])
        least, _, _ = self._least_of_all(t, values.min(axis=1))
        names = tuple(self._called(*pair) for pair in nearest)
        return PairClearances(t=t, names=names, values=values, least=least, pairs=int(self._kept.sum()))

    def closest(self, t: Array, at_most: Array | None = None) -> ClosestPairs:
        """Measure the closest pair at instants: which it is natively, its distance and points by Coal.

        Args:
            t: (m,) the instants [s].
            at_most: (m,) what it is known to have at most there [m], which makes this quicker; None: nothing is known.
        """
        u = self._parameter(t)
        known = self.over(t).values.min(axis=1) if at_most is None else at_most
        least, first, other = self._least_of_all(t, known)
        frames, of_coal, bodies = frames_at(self._claim, u), coal_bodies(self._claim), self._claim.bodies
        names: dict[str, int] = {}
        distance, points, pair = least.copy(), np.zeros((len(t), 2, 3)), np.zeros(len(t), dtype=np.int64)
        for i, (one, another) in enumerate(zip(first.tolist(), other.tolist(), strict=True)):
            exact, points[i] = of_coal.distance(frames[i], one, another)
            distance[i] = least[i] if np.isnan(exact) else exact
            own = bodies.frame[another] != WORLD
            column = int(bodies.owner[another]) + (len(self._scene.obstacles) if own else 0)
            pair[i] = names.setdefault(self._called(int(bodies.owner[one]), column), len(names))
        return ClosestPairs(t=t, distance=distance, points=points, pair=pair, names=tuple(names))

    def _least_of_all(self, t: Array, at_most: Array) -> tuple[Array, Indices, Indices]:
        """Return the least of all pairs at instants and its two shapes (m,) each, knowing that it is at most so much."""
        out, shapes = np.empty(len(t)), np.empty((len(t), 2), dtype=np.int64)
        for part in self._parts(len(t), most=16):
            limit = np.where(self._kept, float(at_most[part].max()) + _AROUND, -np.inf)
            found, which = self._at(t[part], limit)
            flat = found.reshape(len(found), -1)
            nearest = flat.argmin(axis=1)
            rows = np.arange(len(found))
            out[part] = flat[rows, nearest]
            shapes[part] = which.reshape(len(found), -1, 2)[rows, nearest]
        return out, shapes[:, 0], shapes[:, 1]

    def _nearest_pairs(self, t: Array) -> Array:
        """Return the least of every pair over instants (l, k + l); infinite for those that are not among the nearest."""
        wanted, out = min(MOST_PAIRS, int(self._kept.sum())), np.full(self._kept.shape, np.inf)
        for within in _WITHIN:
            limit, out = np.where(self._kept, within, -np.inf), np.full(self._kept.shape, np.inf)
            for part in self._parts(len(t)):
                out = np.minimum(out, self._at(t[part], limit)[0].min(axis=0))
            out[out >= within] = np.inf
            if np.count_nonzero(np.isfinite(out)) >= wanted:
                break
        return out

    def _parts(self, count: int, most: int = 10_000) -> list[slice]:
        """Return parts of a number of instants that fit into memory."""
        step = max(1, min(most, _AT_ONCE // max(self._kept.size, 1)))
        return [slice(i, i + step) for i in range(0, count, step)]

    def _at(self, t: Array, limit: Array) -> tuple[Array, Indices]:
        """Return the clearances of pairs (m, l, k + l) and their two shapes (m, l, k + l, 2), two links in one row only.

        A limit counts for the pairs that are kept apart; the measurement has two links in the row of either.
        """
        obstacles = len(self._scene.obstacles)
        both = limit.copy()
        between = both[:, obstacles:]
        np.maximum(between, between.T, out=between)
        found, which = least_clearances(self._claim, self._parameter(t), both)
        one, another = np.nonzero(self._kept[:, obstacles:])
        here, there = found[:, one, obstacles + another], found[:, another, obstacles + one]
        nearer = there < here
        which[:, one, obstacles + another] = np.where(
            nearer[..., None], which[:, another, obstacles + one], which[:, one, obstacles + another]
        )
        found[:, one, obstacles + another] = np.minimum(here, there)
        found[:, ~self._kept] = np.inf
        return found, which

    def _parameter(self, t: Array) -> Array:
        """Return where on the claim's curve the motion is at times (m,)."""
        trajectory, curve = self.trajectory, self._claim.base.curve
        begin, end = curve.domain
        if not isinstance(trajectory, Trajectory) or curve is not trajectory.curve:
            return np.clip(t, begin, end)
        if trajectory.duration == 0:
            return np.full(len(t), begin)
        share = np.clip(t / trajectory.duration, 0.0, 1.0)
        return np.clip(share if trajectory.time_law is None else trajectory.time_law.sample(share), begin, end)

    def _kept_pairs(self) -> NDArray[np.bool_]:
        """Return which pairs (l, k + l) are kept apart: each once, obstacles first, then links, in the row of the first one."""
        place, obstacles = {name: i for i, name in enumerate(self._links)}, len(self._scene.obstacles)
        kept = np.zeros((len(self._links), obstacles + len(self._links)), dtype=bool)
        kept[:, :obstacles] = True
        for one, another in self.trajectory.robot.self_pairs:
            a, b = sorted((place[one], place[another]))
            kept[a, obstacles + b] = True
        return kept

    def _called(self, link: int, other: int) -> str:
        obstacles = len(self._scene.obstacles)
        if other < obstacles:
            return f"{self._links[link]} - {self._scene.obstacles[other].name or f'obstacle {other}'}"
        return " - ".join(self._links[i] for i in sorted((link, other - obstacles)))
