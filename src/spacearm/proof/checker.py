"""The check of a proof: little code that decides alone whether a proof tree shows what a claim says.

It makes all nodes of the proof by itself, level by level, from the pairs and the path of the claim (`_expanded`). So no pair
and no instant can be missing, whatever the proof says. The proof only says how nodes are divided, and gives a direction for
each node that is not. On the whole stretch of that node, the direction must prove that the two bodies keep more than what they
are held to (`_clearances`). docs/certificate.md, sections 2 to 6, has the formulas and their proofs; the letters are the same.

Trusted are this file, `body_motion` (how far bodies move), the claim, Pinocchio's kinematics, and the bounds of the path
(`path_intervals`) and of a base that the arm moves (`base_momentum`). The search and the finder are not: nothing of them is
used.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from spacearm.core.exact import cross, dot
from spacearm.core.identity_cache import cached_by_identity
from spacearm.proof.body_motion import Midpoints
from spacearm.proof.claim import Claim
from spacearm.proof.convex_bodies import WORLD, ConvexBodies
from spacearm.proof.path_intervals import Intervals
from spacearm.proof.proof_tree import MEMBERS_OF_OTHER, SETTLED, ProofTree

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

GUARD = 1e-9
"""[m] Every gap is reduced by this, for the rounding of numbers of a few metres; see `_RELATIVE_GUARD` for larger ones."""

_RELATIVE_GUARD = 1e-13  # times the size of the numbers that a gap comes from: it is reduced by this, too
_SHORTEST, _LONGEST = 1e-140, 1e140  # of a direction: beyond, the squares of its coordinates underflow or overflow
_INWARD = 1 - 1e-13  # times the size of what a bundle must enclose: the rounding of that size
_MOST_NODES = 10_000_000  # of a proof
_STRETCHES, _ROWS = 1024, 65_536  # stretches and nodes that are evaluated at once, so that the memory suffices
_STRETCH = 2  # the column of a node's stretch; that of its first body is 0, and that of the other body is 1
_REPLACED = np.array([-1, _STRETCH, 0, 1])  # by what a proof says of a node: the column whose parts follow


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Checked:
    """What the check of a proof says.

    Attributes:
        fault: why the proof does not show the claim, in one sentence; "" if it does.
        proven: (phases,) by phase of the claim: no pair ever has less clearance than this [m]. It is infinite where nothing is
            in the way, and minus infinity if there is a fault.
        nodes, stretches: how many nodes the proof has, and on how many stretches of the path planes were evaluated.
        finest: the shortest of them, as a share of the path.
    """

    fault: str
    proven: Array
    nodes: int
    stretches: int
    finest: float


class _Fault(Exception):
    """The proof does not show the claim."""


def check_proof(claim: Claim, proof: ProofTree) -> Checked:
    """Decide whether a proof shows a claim. Whatever the proof holds, this raises nothing.

    Args:
        claim: what must be shown, with a base that has begun.
        proof: may be of anybody.
    """
    proven, stretches, finest = np.full(claim.held.phases, np.inf), 0, 1.0
    try:
        if not _bundles_enclose(claim.bodies):
            raise _Fault("a bundle of the table of bodies does not enclose its members")
        if claim.tracking.any() and claim.pairs.free.any():
            raise _Fault("the attitude of a floating base under a tracking error has no bound")
        for settled, on in _batches(*_expanded(claim, proof)):
            _check(claim, settled, on, proven)
            stretches, finest = stretches + len(on), min(finest, float(on.share.min()))
    except _Fault as fault:
        return Checked(fault=str(fault), proven=np.full_like(proven, -np.inf), nodes=0, stretches=0, finest=1.0)
    return Checked(fault="", proven=proven, nodes=len(proof.steps), stretches=stretches, finest=finest)


# ---- All nodes of a proof --------------------------------------------------------------------------------------------


class _Settled(NamedTuple):
    """The t nodes that a proof settles.

    Attributes:
        first, other: (t,) the bodies.
        stretch: (t,) the stretch of the path, by its number in a table.
        direction: (t, 3) the direction that is to prove it.
    """

    first: Indices
    other: Indices
    stretch: Indices
    direction: Array

    def select(self, which: Indices | slice) -> _Settled:
        """Return some of them."""
        return _Settled(self.first[which], self.other[which], self.stretch[which], self.direction[which])


def _expanded(claim: Claim, proof: ProofTree) -> tuple[_Settled, Intervals]:
    """Make all nodes of a proof; return those that are settled, and the table of stretches.

    A node that is divided is replaced by nodes that together are the same: by two halves of its stretch, or by all members of a
    bundle. So one of its three numbers is replaced: the first body, the other one, or the stretch.

    Raises:
        _Fault: the proof does not fit.
    """
    bodies, steps, roots = claim.bodies, proof.steps, len(claim.pairs.first)
    _require_arrays(proof, roots)
    stretches, halves_of = claim.path.whole(), np.full(1, -1)
    level = np.stack([claim.pairs.first, claim.pairs.other, np.zeros(roots, np.intp)], axis=1)
    levels, begin = [level], 0
    while len(level):
        step = steps[begin : begin + len(level)]
        begin += len(level)
        divided = np.flatnonzero(step)
        level, column = level.take(divided, axis=0), _REPLACED.take(step.take(divided))
        whole = level[np.arange(len(level)), column]
        halved, opened = np.flatnonzero(column == _STRETCH), np.flatnonzero(column != _STRETCH)
        stretches, halves_of = _with_halves(claim, stretches, halves_of, whole.take(halved))
        first, count = np.empty(len(level), np.intp), np.full(len(level), 2)
        first[halved] = halves_of.take(whole.take(halved))
        if opened.size:
            body = whole.take(opened)
            first[opened], count[opened] = bodies.first_member.take(body), bodies.members.take(body)
        if not count.all():
            raise _Fault(f"the proof opens body {whole[count == 0][0]}, which has no members")
        parts = int(count.sum())
        if begin + parts > len(steps):
            raise _Fault(f"the proof has {len(steps)} nodes, expected at least {begin + parts}")
        parent, part = _ranges(first, count)
        level = level.take(parent, axis=0)
        level[np.arange(parts), column.take(parent)] = part
        levels.append(level)
    if begin != len(steps):
        raise _Fault(f"the proof has {len(steps)} nodes, expected {begin}")
    settled = np.concatenate(levels).take(np.flatnonzero(steps == SETTLED), axis=0)
    if len(settled) != len(proof.directions):
        raise _Fault(f"the proof has {len(proof.directions)} directions, expected {len(settled)}")
    first, other, stretch = np.ascontiguousarray(settled.T)
    return _Settled(first, other, stretch, proof.directions), stretches


def _require_arrays(proof: ProofTree, roots: int) -> None:
    """Check the arrays of a proof for a number of roots.

    Raises:
        _Fault: they are of another kind or size.
    """
    steps, directions = proof.steps, proof.directions
    for name, array in (("steps", steps), ("directions", directions)):
        if type(array) is not np.ndarray:  # a matrix or a masked array computes otherwise
            raise _Fault(f"the {name} of the proof are a {type(array).__name__}, expected a NumPy array")
    if steps.ndim != 1 or steps.dtype != np.uint8 or not roots <= len(steps) <= _MOST_NODES:
        raise _Fault(f"the proof has {steps.shape} nodes of {steps.dtype}, expected {roots} to {_MOST_NODES} of uint8")
    if directions.ndim != 2 or directions.shape[1] != 3 or directions.dtype != np.float64:
        raise _Fault(f"the proof has {directions.shape} directions of {directions.dtype}, expected (., 3) of float64")
    if steps.max(initial=0) > MEMBERS_OF_OTHER:
        raise _Fault(f"the proof says {steps.max()} of a node, expected 0 to {MEMBERS_OF_OTHER}")


def _with_halves(claim: Claim, stretches: Intervals, halves_of: Indices, halved: Indices) -> tuple[Intervals, Indices]:
    """Return the table of stretches, and for each the number of its first half (-1: none), with halves of some of them.

    A stretch has the same number for all pairs, so that the robot is placed on it once.
    """
    new = np.zeros(len(stretches), dtype=bool)
    new[halved] = True
    which = np.flatnonzero(new & (halves_of < 0))
    if not which.size:
        return stretches, halves_of
    halves = claim.path.halved(stretches.select(which))
    if not (halves.ends[:, 0] < halves.ends[:, 1]).all():
        raise _Fault("the proof halves a stretch of the path that is too short for it")
    out = np.full(len(stretches) + len(halves), -1)
    out[: len(stretches)] = halves_of
    out[which] = len(stretches) + 2 * np.arange(len(which))
    return stretches.followed_by(halves), out


def _batches(settled: _Settled, stretches: Intervals) -> Iterator[tuple[_Settled, Intervals]]:
    """Divide settled nodes by their stretches; give those of a batch, with the stretches on which they are."""
    which, number = _numbered(settled.stretch, len(stretches))
    settled = settled._replace(stretch=number)
    if len(which) > _STRETCHES:
        settled = settled.select(np.argsort(number, kind="stable"))
    for begin in range(0, len(which), _STRETCHES):
        rows = np.searchsorted(settled.stretch, [begin, begin + _STRETCHES]) if len(which) > _STRETCHES else (0, len(number))
        some = settled.select(slice(*rows))
        yield some._replace(stretch=some.stretch - begin), stretches.select(which[begin : begin + _STRETCHES])


# ---- What the directions prove ---------------------------------------------------------------------------------------


def _check(claim: Claim, settled: _Settled, stretches: Intervals, proven: Array) -> None:
    """Check settled nodes on some stretches, and lessen `proven` (phases,) to what they prove.

    Raises:
        _Fault: a direction does not prove what is required.
    """
    midpoints = Midpoints(claim, stretches)
    for begin in range(0, len(settled.first), _ROWS):
        some = settled.select(slice(begin, begin + _ROWS))
        clearance = _clearances(claim, midpoints, some)
        begins, ends = midpoints.ends.take(some.stretch, axis=0).T
        required, phase = claim.held.on(claim.bodies.owner.take(some.first), some.other, begins, ends)
        short = np.flatnonzero(~(clearance > required))
        if short.size:
            i = int(short[0])
            pair = " and ".join(_called(claim, int(bodies[i])) for bodies in (some.first, some.other))
            raise _Fault(
                f"a direction proves {clearance[i]:.6g} m for {pair}, "
                f"from {begins[i]:.6g} to {ends[i]:.6g} on the curve, expected more than {required[i]:.6g}"
            )
        np.minimum.at(proven, phase, clearance)


def _called(claim: Claim, body: int) -> str:
    """Name what a body of the table belongs to."""
    bodies, owner = claim.bodies, int(claim.bodies.owner[body])
    if owner < 0:
        return "several obstacles in one ball"
    if bodies.frame[body] == WORLD:
        return f"obstacle {claim.scene.called(owner)}"
    return f"link '{list(dict.fromkeys(part.name for part in claim.robot.shapes))[owner]}'"


def _clearances(claim: Claim, midpoints: Midpoints, some: _Settled) -> Array:
    """Return the clearances (t,) [m] that the directions prove of nodes, on their whole stretches."""
    bodies, at, first, other = claim.bodies, some.stretch, some.first, some.other
    frame = bodies.frame.take(other)
    motion = claim.pairs.motion_of[bodies.frame.take(first), frame]
    n = _directions(bodies, other, some.direction)
    moving = _Placed(bodies, midpoints, at, first)
    resting = _Placed(bodies, midpoints, np.where(frame == WORLD, 0, at), other)
    displacement, second_order = _displacements(midpoints, moving, motion)
    row, half = at * len(claim.pairs.sign) + motion, midpoints.half.take(at)
    turning = cross(n, midpoints.omega.take(row, axis=0))  # n . (omega x x) = turning . x
    speed = np.abs(moving.heights(turning) + moving.of_points(dot(n, midpoints.velocity.take(row, axis=0))))
    beyond = second_order + moving.discs(turning) * half
    if claim.tracking.any():
        beyond += midpoints.tubes(at, motion, moving.center.take(moving.row, axis=0), moving.reach.take(moving.row), n)
    loss = np.minimum(speed * moving.of_points(half) + moving.of_points(beyond), moving.of_points(displacement))
    least = np.minimum.reduceat(moving.heights(n) - loss, moving.begins) - moving.discs(n)
    most = np.maximum.reduceat(resting.heights(n), resting.begins) + resting.discs(n)
    guard = GUARD + _RELATIVE_GUARD * (moving.size + resting.size)
    return least - most - bodies.radius.take(first) - bodies.radius.take(other) - guard


def _directions(bodies: ConvexBodies, other: Indices, given: Array) -> Array:
    """Return the directions (t, 3) of length 1: those given, and for half-spaces their own axes.

    Raises:
        _Fault: a vector is no direction.
    """
    n, flat = given, np.flatnonzero(bodies.half_space.take(other))
    if flat.size:
        n = given.copy()
        n[flat] = bodies.axis[other[flat]]
    with np.errstate(over="ignore"):
        length = np.sqrt(dot(n, n))
    wrong = np.flatnonzero(~((length > _SHORTEST) & (length < _LONGEST)))
    if wrong.size:
        raise _Fault(f"the vector {n[wrong[0]].tolist()} is no direction")
    return n / length[:, None]


class _Placed:
    """Bodies (t,) at the midpoints of stretches (t,), and all their points, one body after the other.

    A body is placed once on a stretch, whatever the number of nodes: row `row` (t,) of `on`, `body`, `center` and `reach`.

    Attributes:
        on, body: (k,) the stretch and the body.
        center, reach: (k, 3) and (k,) in the inertial frame [m]; see `ConvexBodies`.
        begins: (t,) the number of the first point of a body.
        size: (t,) no number of a body is greater [m].
    """

    def __init__(self, bodies: ConvexBodies, midpoints: Midpoints, at: Indices, body: Indices) -> None:
        most = int(body.max(initial=0)) + 1
        key, self.row = _numbered(at * most + body, most * len(midpoints.half))
        self.on, self.body = np.divmod(key, most)
        frame = self.on * midpoints.frames + bodies.frame.take(self.body)
        self._R, place = midpoints.R.take(frame, axis=0), midpoints.place.take(frame, axis=0)
        self.center: Array = np.einsum("kcd,kd->kc", self._R, bodies.center.take(self.body, axis=0)) + place
        self.reach, self._disc = bodies.reach.take(self.body), bodies.disc.take(body)
        self._axis = bodies.axis
        self.size = (np.sqrt(dot(self.center, self.center)) + self.reach).take(self.row)
        count = bodies.points.take(self.body)
        of, point = _ranges(bodies.first_point.take(self.body), count)
        x: Array = np.einsum("pcd,pd->pc", self._R.take(of, axis=0), bodies.vertices.take(point, axis=0))
        x += place.take(of, axis=0)
        first, count = (np.cumsum(count) - count).take(self.row), count.take(self.row)
        self._of, point = _ranges(first, count)
        self._x, self.begins = x.take(point, axis=0), np.cumsum(count) - count

    def of_points(self, values: Array) -> Array:
        """Return values (t, ...) of bodies for each of their points."""
        return values.take(self._of, axis=0)

    def heights(self, n: Array) -> Array:
        """Return n . x of all points, for vectors n (t, 3)."""
        return dot(self.of_points(n), self._x)

    def discs(self, n: Array) -> Array:
        """Return how far the discs of bodies stand out along vectors n (t, 3): the radius times the part across the axis."""
        out, which = np.zeros(len(n)), np.flatnonzero(self._disc)
        if which.size:
            row = self.row[which]
            axis: Array = np.einsum("tcd,td->tc", self._R[row], self._axis[self.body[row]])
            out[which] = self._disc[which] * _across(n[which], axis)
        return out


def _displacements(midpoints: Midpoints, moving: _Placed, motion: Indices) -> tuple[Array, Array]:
    """Bound the motion of bodies by relative motions (t,), to first and second order, (t,) [m]; each combination once."""
    most = int(motion.max(initial=0)) + 1
    key, row = _numbered(moving.row * most + motion, most * len(moving.body))
    of, motion = np.divmod(key, most)
    first, second = midpoints.displacements(moving.on.take(of), motion, moving.center.take(of, axis=0), moving.reach.take(of))
    return first.take(row), second.take(row)


@cached_by_identity
def _bundles_enclose(bodies: ConvexBodies) -> bool:
    """Return whether every bundle encloses its members, and no core gets further from its centre than its reach."""
    row, point = _ranges(bodies.first_point, bodies.points)
    away, disc = bodies.vertices[point] - bodies.center[row], bodies.disc[row]
    squared = dot(away, away) + 2 * _across(away, bodies.axis[row]) * disc + disc**2  # of the furthest point of a disc
    reached = np.sqrt(squared) * _INWARD <= bodies.reach[row]
    bundle = np.flatnonzero(bodies.members)
    balls = (bodies.points[bundle] == 1) & (bodies.disc[bundle] == 0) & ~bodies.half_space[bundle]
    of, member = _ranges(bodies.first_member[bundle], bodies.members[bundle])
    around = bundle[of]
    alike = (bodies.frame[member] == bodies.frame[around]) & ~bodies.half_space[member]
    row, point = _ranges(bodies.first_point[member], bodies.points[member])
    away = bodies.vertices[point] - bodies.vertices[bodies.first_point[around]][row]
    size = np.sqrt(dot(away, away)) + (bodies.disc + bodies.radius)[member][row]
    return bool(reached.all() and balls.all() and alike.all() and (size * _INWARD <= bodies.radius[around][row]).all())


# ---- Arrays ----------------------------------------------------------------------------------------------------------


def _across(v: Array, axis: Array) -> Array:
    """Return the lengths of the parts of vectors (t, 3) across axes (t, 3) of length 1."""
    part = v - dot(v, axis)[:, None] * axis
    return np.sqrt(dot(part, part))


def _ranges(first: Indices, count: Indices) -> tuple[Indices, Indices]:
    """Return the numbers of the ranges first to first + count - 1, one after the other, as (which range, number)."""
    row = np.repeat(np.arange(len(count)), count)
    return row, np.arange(len(row)) + (first - (np.cumsum(count) - count)).take(row)


def _numbered(key: Indices, size: int) -> tuple[Indices, Indices]:
    """Return the different values of keys from 0 to size - 1, and for each key the place of its value among them."""
    if size > 16 * len(key) + 10_000:
        return np.unique(key, return_inverse=True)
    used = np.zeros(size, dtype=bool)
    used[key] = True
    return np.flatnonzero(used), (np.cumsum(used) - 1).take(key)
