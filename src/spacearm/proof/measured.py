"""Clearances that are measured: of all pairs at instants, natively; and the closest approach, by Coal.

Nothing proven rests on a measurement. Measurements say which pairs are near at an end, what to tell the user of the closest
approach, and that a motion fails. They are a control, too: a measurement below what is proven means that one of the two is
wrong.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from spacearm.core.native_finder import native_finder
from spacearm.proof.base_proofs import BaseProof, link_frames
from spacearm.proof.claim import Claim, NearEnd
from spacearm.proof.convex_bodies import WORLD, BodyPairs, ConvexBodies
from spacearm.proof.finder import native_motion
from spacearm.proof.path_intervals import PathIntervals
from spacearm.proof.witness import CoalBodies

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

AROUND = 2.5e-4
"""[m] A pair that has this much more than is required need not be measured exactly."""

DISAGREEMENT = 1e-6
"""[m] If a measured clearance is below what is proven by more than this, neither is believed."""

_ZOOMS, _ZOOM_POINTS = 2, 9  # how often, and at how many points, it is measured around the closest approach
_FARTHEST = 0.1  # times the length of the curve: so far away it is looked for at most
_JUST_OUT = 1e-9  # times the length of the curve: so soon after it gets out a pair is measured
_REMEMBERED = 4  # tables of robots and scenes seen last


# ---- Clearances at instants ------------------------------------------------------------------------------------------


def frames_at(claim: Claim, u: Array) -> Array:
    """Return where the frames of a claim's bodies are (r, j + 2, 3, 4) at parameters (r,) of its curve.

    The inertial frame comes first, then the base's and the joints' frames.
    """
    placed = claim.base.placed(u, link_frames(claim.base, u))
    out = np.empty((len(u), placed.shape[1] + 1, 3, 4))
    out[:, WORLD] = np.eye(4)[:3]
    out[:, 1], out[:, 2:] = placed[:, -1, :3], placed[:, :-1, :3]
    return out


def _clearances(claim: Claim) -> native_finder.Clearances:
    """Return what measures a claim's clearances; the same object for the motions seen last."""
    about, tracking = (claim.path, claim.base, claim.bodies, claim.pairs), claim.tracking
    for seen, error, made in list(_CLEARANCES):
        if all(one is other for one, other in zip(seen, about, strict=True)) and np.array_equal(error, tracking):
            return made
    made = native_finder.Clearances(**native_motion(claim)._asdict(), tracking=np.array(tracking, dtype=np.float64))
    _CLEARANCES.append((about, tracking, made))
    return made


_About = tuple[PathIntervals, BaseProof, ConvexBodies, BodyPairs]
_CLEARANCES: deque[tuple[_About, Array, native_finder.Clearances]] = deque(maxlen=_REMEMBERED)


def required_by_owner(claim: Claim) -> Array:
    """Return what is required of every link and other body (l, k + l), obstacles first, then links [m]."""
    bodies, held = claim.bodies, claim.held
    links, obstacles = len(held.required), len(claim.scene.obstacles)
    out = np.zeros((links, obstacles + links))
    shapes = np.flatnonzero((bodies.members == 0) & (bodies.owner >= 0))
    column = np.where(bodies.frame[shapes] == WORLD, bodies.owner[shapes], obstacles + bodies.owner[shapes])
    out[:, column] = held.required[:, shapes]
    return out


def least_clearances(claim: Claim, u: Array, limit: Array | None = None, *, in_tube: bool = False) -> tuple[Array, Indices]:
    """Measure the least clearance of every link and every other body at instants.

    Args:
        claim: the bodies, the pairs of them that are kept apart, and their path.
        u: (r,) the instants, in the parameter of the curve.
        limit: (l, k + l) above it clearances need not be exact; pairs with minus infinity are left out [m]. None: a quarter of
            a millimetre above what is required, of all pairs of which more than 0 is.
        in_tube: take from all clearances what the claim's tracking error may take.

    Returns:
        The clearances (r, l, k + l) by link and other body, obstacles first, then links: at most the limit, and infinite for
        pairs that are left out [m]. Two links are in the row of the one that comes first. Where the cores of two bodies meet,
        it is no depth of penetration, but 0 or less. And the two shapes (r, l, k + l, 2), bodies of the table; -1: none that
        are nearer than the limit.
    """
    if limit is None:
        required = required_by_owner(claim)
        limit = np.where(required > 0, required + AROUND, -np.inf)
    fill = np.where(np.isfinite(limit), limit, np.inf)
    return _clearances(claim).least(np.asarray(u, dtype=np.float64), limit, fill, in_tube)


# ---- The closest approach --------------------------------------------------------------------------------------------

_COAL_BODIES: deque[tuple[ConvexBodies, CoalBodies]] = deque(maxlen=_REMEMBERED)


def coal_bodies(claim: Claim) -> CoalBodies:
    """Return a claim's bodies as Coal's shapes; the same object for the tables seen last."""
    for bodies, made in list(_COAL_BODIES):
        if bodies is claim.bodies:
            return made
    made = CoalBodies(claim.robot, claim.scene, claim.bodies)
    _COAL_BODIES.append((claim.bodies, made))
    return made


class PairAtInstant(Protocol):
    """Two shapes of a claim's table at an instant, such as the finder's `Suspect`."""

    @property
    def first(self) -> int:
        """The robot's."""
        ...

    @property
    def other(self) -> int:
        """The other one."""
        ...

    @property
    def u(self) -> float:
        """Where on the curve."""
        ...

    @property
    def clearance(self) -> float:
        """What they have there, natively measured [m]."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class _Pair:
    """Two shapes at an instant; see `PairAtInstant`."""

    first: int
    other: int
    u: float
    clearance: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class NearestPair:
    """Two shapes at an instant, measured by Coal.

    Attributes:
        shape: index in the robot.
        obstacle: index in the scene; None if the other one is a shape.
        other: index in the robot of the other shape, or -1.
        u: where on the curve.
        clearance: [m].
        required: what the pair is held to there [m].
        points: (2, 3) the nearest points, in the inertial frame [m].
        native: the native measurement of the same [m].
        tube: what a tracking error may take from the clearance there [m].
    """

    shape: int
    obstacle: int | None
    other: int
    u: float
    clearance: float
    required: float
    points: Array
    native: float
    tube: float = 0.0

    @property
    def lack(self) -> tuple[bool, float]:
        """Less is worse: pairs that touch come first, by how deep they penetrate; then all others, by their excess [m]."""
        return (True, self.clearance - self.tube - self.required) if self.clearance > 0 else (False, self.clearance)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MeasuredApproaches:
    """The closest approaches of a claim.

    Attributes:
        closest: by phase; None where nothing is in the way.
        worst: the pair that lacks most to what it is held to; of pairs that touch, the one that penetrates deepest.
    """

    closest: tuple[NearestPair | None, ...]
    worst: NearestPair | None

    def nearest(self, phases: Sequence[int]) -> NearestPair | None:
        """Return the closest approach in some phases."""
        found = [one for one in (self.closest[phase] for phase in phases) if one is not None]
        return min(found, key=lambda near: near.clearance, default=None)

    @property
    def fails(self) -> bool:
        """Whether a pair is measured to have at most what it is held to.

        A pair near at an end that may have nothing within a tracking error is held to all that is required, and not measured
        to have less than it could.
        """
        near = self.worst
        if near is None or near.clearance > near.required:
            return False
        return near.clearance <= 0 or near.clearance > near.tube

    def contradict(self, proven: Array) -> bool:
        """Return whether a measurement by Coal is below what is proven, or natively measured, by more than DISAGREEMENT.

        Args:
            proven: (p,) by phase [m].
        """
        pairs = zip(self.closest, proven.tolist(), strict=True)
        return any(near is not None and near.clearance < max(bound, near.native) - DISAGREEMENT for near, bound in pairs)


def measure_approaches(
    claim: Claim, closest: Sequence[PairAtInstant | None], worst: PairAtInstant | None, *, finest: float
) -> MeasuredApproaches:
    """Measure the closest approaches by Coal: near instants at which pairs are known to be close.

    Pairs that are near at an end are also looked at where they have just got out.

    Args:
        claim: what they are about.
        closest: by phase, the closest pair that is known.
        worst: the pair that lacks most, as far as is known.
        finest: how far around an instant it is looked, as a share of the curve.
    """
    begin, end = claim.base.curve.domain
    reach = (end - begin) * min(finest, _FARTHEST)
    known = [*(one for one in closest if one is not None), *_near_at_ends(claim)]
    by_phase: dict[int, PairAtInstant] = {}
    for one, phase in zip(known, _held(claim, known)[1].tolist(), strict=True):
        if phase not in by_phase or one.clearance < by_phase[phase].clearance:
            by_phase[phase] = one
    zoomed = _zoomed(claim, [*by_phase.values(), *(() if worst is None else (worst,))], reach)
    measured = _measured(claim, zoomed)
    if worst is not None and measured[-1].clearance <= 0:
        measured.append(_deepest(claim, zoomed[-1], reach))
    found = dict(zip(by_phase, measured, strict=False))
    return MeasuredApproaches(
        closest=tuple(found.get(phase) for phase in range(claim.held.phases)),
        worst=min(measured, key=lambda near: near.lack, default=None),
    )


def _held(claim: Claim, pairs: Sequence[PairAtInstant]) -> tuple[Array, NDArray[np.intp]]:
    """Return what pairs (m,) are held to at their instants [m], and the phases."""
    first, other = (np.array([getattr(one, name) for one in pairs], dtype=np.intp) for name in ("first", "other"))
    u = np.array([one.u for one in pairs])
    return claim.held.on(claim.bodies.owner[first], other, u, u)


def _near_at_ends(claim: Claim) -> list[_Pair]:
    """Return the nearest shapes of the pairs that are near at an end: at the ends, and where they have just got out."""
    pairs = claim.held.pairs
    if not pairs:
        return []
    begin, end = claim.base.curve.domain
    little = _JUST_OUT * (end - begin)
    u = np.clip([[begin, one.until + little, one.since - little, end] for one in pairs], begin, end)
    required = required_by_owner(claim)
    least, which = least_clearances(claim, u.ravel(), limit_of(required, [(one.link, one.other) for one in pairs]))
    out: list[_Pair] = []
    for i, one in enumerate(pairs):
        out += _nearest_shapes(one, u[i], least[4 * i : 4 * i + 4], which[4 * i : 4 * i + 4])
    return out


def _nearest_shapes(near: NearEnd, u: Array, least: Array, which: Indices) -> list[_Pair]:
    """Return the nearest shapes of a pair at instants (r,) where it has about what is required or less."""
    of_pair, clearance = which[:, near.link, near.other].tolist(), least[:, near.link, near.other].tolist()
    rows = zip(of_pair, u.tolist(), clearance, strict=True)
    return [_Pair(first=first, other=other, u=at, clearance=has) for (first, other), at, has in rows if first >= 0]


def limit_of(required: Array, pairs: Sequence[tuple[int, int]]) -> Array:
    """Return a limit for `least_clearances` (l, k + l) for some pairs of links and other bodies only."""
    limit, obstacles = np.full(required.shape, -np.inf), required.shape[1] - len(required)
    for link, other in pairs:
        limit[link, other] = required[link, other] + AROUND
        if other >= obstacles:
            limit[other - obstacles, obstacles + link] = limit[link, other]
    return limit


def _zoomed(claim: Claim, pairs: Sequence[PairAtInstant], reach: float) -> list[_Pair]:
    """Return pairs (m) at the instants around at which they are closest, in the same phase."""
    if not pairs:
        return []
    first, other = (np.array([getattr(one, name) for one in pairs]) for name in ("first", "other"))
    u, away = np.array([one.u for one in pairs]), np.linspace(-reach, reach, _ZOOM_POINTS)
    phase = _held(claim, pairs)[1]
    each, row = np.repeat(np.arange(len(pairs)), _ZOOM_POINTS), np.arange(len(pairs))
    clearance = np.zeros(len(pairs))
    for i in range(_ZOOMS):
        at = np.clip(u[:, None] + away * (2 / (_ZOOM_POINTS - 1)) ** i, *claim.base.curve.domain)
        found = _clearances(claim).between(at.ravel(), first[each], other[each]).reshape(at.shape)
        _, phases = claim.held.on(claim.bodies.owner[first[each]], other[each], at.ravel(), at.ravel())
        found[phases.reshape(at.shape) != phase[:, None]] = np.inf
        best = found.argmin(axis=1)
        u, clearance = at[row, best], found[row, best]
    rows = zip(first.tolist(), other.tolist(), u.tolist(), clearance.tolist(), strict=True)
    return [_Pair(first=a, other=b, u=at, clearance=has) for a, b, at, has in rows]


def _deepest(claim: Claim, pair: _Pair, reach: float) -> NearestPair:
    """Return a pair that touches, at the instant around at which it penetrates deepest."""
    found: list[NearestPair] = []
    for i in range(_ZOOMS):
        away = reach * (2 / (_ZOOM_POINTS - 1)) ** i
        u = np.clip(np.linspace(pair.u - away, pair.u + away, _ZOOM_POINTS), *claim.base.curve.domain)
        found += _measured(claim, [replace(pair, u=at) for at in u.tolist()])
        pair = replace(pair, u=min(found, key=lambda near: near.lack).u)
    return min(found, key=lambda near: near.lack)


def _measured(claim: Claim, pairs: Sequence[PairAtInstant]) -> list[NearestPair]:
    """Measure pairs by Coal; where it has no answer, the native measurement counts."""
    if not pairs:
        return []
    frames, required = frames_at(claim, np.array([one.u for one in pairs])), _held(claim, pairs)[0].tolist()
    bodies, of_coal = claim.bodies, coal_bodies(claim)
    out: list[NearestPair] = []
    for pair, placed, held, tube in zip(pairs, frames, required, _taken(claim, pairs), strict=True):
        clearance, points = of_coal.distance(placed, pair.first, pair.other)
        own = bodies.frame[pair.other] != WORLD
        near = NearestPair(
            shape=int(bodies.shape[pair.first]),
            obstacle=None if own else int(bodies.owner[pair.other]),
            other=int(bodies.shape[pair.other]) if own else -1,
            u=pair.u,
            clearance=pair.clearance if np.isnan(clearance) else clearance,
            required=held,
            points=points,
            native=pair.clearance,
            tube=tube,
        )
        out.append(near)
    return out


def _taken(claim: Claim, pairs: Sequence[PairAtInstant]) -> list[float]:
    """Return what the tracking error may take from the clearances of pairs (m,), [m]."""
    if not claim.tracking.any():
        return [0.0] * len(pairs)
    u = np.array([one.u for one in pairs])
    first, other = (np.array([getattr(one, name) for one in pairs]) for name in ("first", "other"))
    exact, within = (_clearances(claim).between(u, first, other, in_tube) for in_tube in (False, True))
    return (exact - within).tolist()
