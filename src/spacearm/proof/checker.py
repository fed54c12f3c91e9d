"""The check of a proof: little code that decides alone whether a proof tree shows what a claim says.

It makes all nodes of the proof by itself, level by level, from the pairs and the path of the claim (`_expanded`). So no pair and
no instant can be missing, whatever the proof says. The proof only says how nodes are divided, and gives a direction for each
node that is not. For that node the direction must prove, on the whole stretch, that the two bodies keep more than what they are
held to (`_Planes`). docs/certificate.md, sections 2 to 6, has the formulas and their proofs; the letters are the same.

Trusted are the claim, Pinocchio's kinematics, the bounds of the path (`path_intervals`) and of a base that the arm moves
(`base_momentum`), and this file. The search, the finder and the native kernel are not: nothing of them is used.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from spacearm.core.exact import cross
from spacearm.core.identity_cache import cached_by_identity
from spacearm.proof.base_momentum import BaseMotionBounds
from spacearm.proof.bodies import JointMap
from spacearm.proof.claim import Claim
from spacearm.proof.convex_bodies import WORLD, BodyPairs, ConvexBodies
from spacearm.proof.path_intervals import Intervals
from spacearm.proof.proof_tree import MEMBERS_OF_OTHER, SETTLED, ProofTree
from spacearm.proof.witness import Witness
from spacearm.robot import Robot

Array = NDArray[np.float64]
Indices = NDArray[np.intp]
Mask = NDArray[np.bool_]

GUARD = 1e-9
"""[m] Every gap is reduced by this, for the rounding of numbers of a few metres; see `_RELATIVE_GUARD` for larger ones."""

_RELATIVE_GUARD = 1e-13  # times the coordinates that a gap comes from: it is reduced by this, too
_VALUE_ROUNDING = 1e-15  # times a joint's value at the midpoint: the rounding of multiplier and offset
_DISTANCE_ROUNDING = 1e-14  # times a squared distance, which is added to rho^2, a difference of squares
_SHORTEST, _LONGEST = 1e-140, 1e140  # of a direction: outside, the squares of its coordinates underflow or overflow
_INWARD = 1 - 1e-13  # times a distance that must be within a bundle's radius: the rounding of this check alone
_MOST_NODES = 100_000_000  # of a proof
_STRETCH = 2  # the column of a node's stretch; that of its first body is 0, and that of the other body is 1
_REPLACED = np.array([-1, _STRETCH, 0, 1])  # by what a proof says of a node: the column whose parts follow
_STRETCHES, _ROWS = 1024, 65_536  # of a batch, so that a large proof does not exhaust the memory


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Checked:
    """What the check of a proof says.

    Attributes:
        fault: why the proof does not show the claim, in one sentence; "" if it does.
        proven: (phases,) by phase of the claim, no pair ever has less clearance than this [m]; infinite where nothing is in the
            way, and minus infinity if there is a fault.
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
        claim: what must be shown. It must not be of the proof's author.
        proof: may be of anybody.
    """
    proven = np.full(claim.held.phases, np.inf)
    try:
        if not _bundles_enclose(claim.bodies):
            raise _Fault("a bundle of the table of bodies does not enclose its members")
        if claim.tracking.any() and claim.pairs.free.any():
            raise _Fault("the attitude of a floating base under a tracking error has no bound")
        settled, stretches = _expanded(claim, proof)
        for some, on in _batches(settled, stretches):
            _check(claim, some, on, proven)
    except _Fault as fault:
        return Checked(fault=str(fault), proven=np.full_like(proven, -np.inf), nodes=0, stretches=0, finest=1.0)
    share = stretches.share[np.unique(settled.stretch)]
    return Checked(fault="", proven=proven, nodes=len(proof.steps), stretches=len(share), finest=float(share.min(initial=1.0)))


@cached_by_identity
def _bundles_enclose(bodies: ConvexBodies) -> bool:
    """Return whether every bundle encloses its members, and no core gets further from its centre than its reach."""
    disc, count = bodies.disc, bodies.points
    row, point = _ranges(bodies.first_point, count)
    away = bodies.vertices[point] - bodies.center[row]
    rim = _across(away, bodies.axis[row])  # the furthest point of a disc at this point is where this adds most
    reached = np.sqrt(_dot(away, away) + 2 * rim * disc[row] + disc[row] ** 2)
    within = bool((reached * _INWARD <= bodies.reach[row]).all())
    bundle = np.flatnonzero(bodies.members)
    member_of, member = _ranges(bodies.first_member[bundle], bodies.members[bundle])
    around = bundle[member_of]
    same = (bodies.frame[member] == bodies.frame[around]) & ~bodies.half_space[member]
    whole = (bodies.points[bundle] == 1).all() and not bodies.disc[bundle].any() and not bodies.half_space[bundle].any()
    center = bodies.vertices[bodies.first_point[around]]
    row, point = _ranges(bodies.first_point[member], count[member])
    away = bodies.vertices[point] - center[row]
    size = np.sqrt(_dot(away, away)) + (disc + bodies.radius)[member][row]
    return within and bool(whole) and bool(same.all()) and bool((size * _INWARD <= bodies.radius[around][row]).all())


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
        return _Settled(*(column[which] for column in self))


def _expanded(claim: Claim, proof: ProofTree) -> tuple[_Settled, Intervals]:
    """Make all nodes of a proof; return those that are settled, and the stretches of the path.

    A node that is divided is replaced by nodes that together are the same: by two halves of its stretch, or by all members of a
    bundle. So one of its three numbers is replaced: the first body, the other one, or the stretch.

    Raises:
        _Fault: the proof does not fit.
    """
    bodies, steps = claim.bodies, proof.steps
    _require_arrays(claim, proof)
    stretches, halves_of = claim.path.whole(), np.full(1, -1)
    level = np.stack([claim.pairs.first, claim.pairs.other, np.zeros(len(claim.pairs.first), np.intp)], axis=1)
    levels, begin = [level], 0
    while len(level):
        step = steps[begin : begin + len(level)]
        begin += len(level)
        divided = np.flatnonzero(step)
        level, column = level[divided], _REPLACED[step[divided]]
        whole = level[np.arange(len(level)), column]
        halved = column == _STRETCH
        stretches, halves_of = _with_halves(claim, stretches, halves_of, whole[halved])
        body = np.where(halved, 0, whole)
        count = np.where(halved, 2, bodies.members[body])
        if not count.all():
            raise _Fault(f"the proof opens body {whole[count == 0][0]}, which has no members")
        following = int(count.sum())
        if begin + following > len(steps):
            raise _Fault(f"the proof has {len(steps)} nodes, expected at least {begin + following}")
        parts = bodies.first_member[body]
        parts[halved] = halves_of[whole[halved]]
        parent, part = _ranges(parts, count)
        level = level[parent]
        level[np.arange(following), column[parent]] = part
        levels.append(level)
    if begin != len(steps):
        raise _Fault(f"the proof has {len(steps)} nodes, expected {begin}")
    first, other, stretch = np.ascontiguousarray(np.concatenate(levels)[steps == SETTLED].T)
    if len(first) != len(proof.directions):
        raise _Fault(f"the proof has {len(proof.directions)} directions, expected {len(first)}")
    return _Settled(first, other, stretch, proof.directions), stretches


def _require_arrays(claim: Claim, proof: ProofTree) -> None:
    steps, directions = proof.steps, proof.directions
    if steps.ndim != 1 or steps.dtype != np.uint8 or len(steps) > _MOST_NODES:
        raise _Fault(f"the proof's steps are {steps.dtype} {steps.shape}, expected at most {_MOST_NODES} of uint8")
    if directions.ndim != 2 or directions.shape[1] != 3 or directions.dtype != np.float64:
        raise _Fault(f"the proof's directions are {directions.dtype} {directions.shape}, expected float64 (d, 3)")
    if len(steps) < len(claim.pairs.first):
        raise _Fault(f"the proof has {len(steps)} nodes, expected at least {len(claim.pairs.first)}")
    if len(steps) and steps.max() > MEMBERS_OF_OTHER:
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
        settled = settled.select(np.argsort(settled.stretch, kind="stable"))
    for begin in range(0, len(which), _STRETCHES):
        rows = slice(None)
        if len(which) > _STRETCHES:
            rows = slice(*np.searchsorted(settled.stretch, [begin, begin + _STRETCHES]).tolist())
        some = settled.select(rows)
        yield some._replace(stretch=some.stretch - begin), stretches.select(which[begin : begin + _STRETCHES])


# ---- How far bodies move ---------------------------------------------------------------------------------------------


class _Motions(NamedTuple):
    """The p relative motions of a claim with j joints; see `BodyPairs`.

    Attributes:
        sign: (p, j) the joints between the two bodies.
        moves: (p, j) 1 for joints that move the first body in the frame of the other one, else 0.
        order: (p, j, j) the weights c_ki of pairs of joints.
    """

    sign: Array
    moves: Array
    order: Array

    @classmethod
    def of(cls, pairs: BodyPairs) -> _Motions:
        """Return the motions of pairs: where the arm moves the base, all joints move all bodies."""
        moves = np.where(pairs.free[:, None], 1.0, np.abs(pairs.sign))
        return cls(pairs.sign, moves, np.where(pairs.free[:, None, None], pairs.whole_order, pairs.order))


@cached_by_identity
def _joints_of(robot: Robot) -> JointMap:
    return JointMap(robot)


class _Midpoints:
    """The robot at the midpoints of r stretches, and how its joints move on the stretches.

    Attributes:
        ends, half: (r, 2) and (r,) where the stretches begin and end, and half their lengths h.
        R, place: (r, j + 2, 3, 3) and (r, j + 2, 3) of all frames, in the inertial frame [m].
        omega, velocity: (r, p, 3) the twists of the relative motions, per unit of u, about the inertial frame's origin.
    """

    def __init__(self, claim: Claim, stretches: Intervals) -> None:
        joints, line = _joints_of(claim.robot), claim.path.linear_bounds(stretches)
        values = joints.values(line.q)
        T = claim.base.placed(line.u, Witness(claim.robot, claim.base.bodies()[0]).frames(values))
        self.ends, self.half, self._pairs = stretches.ends, line.half, claim.pairs
        self._motions, self._revolute = _Motions.of(claim.pairs), joints.revolute * 1.0
        rate = line.rate[:, joints.dof] * joints.multiplier
        deviation = line.deviation[:, joints.dof] * np.abs(joints.multiplier) + _VALUE_ROUNDING * np.abs(values)
        self._tube = claim.tracking[joints.dof] * np.abs(joints.multiplier)  # (j,)
        step = np.abs(rate) * line.half[:, None] + deviation + self._tube
        self._base = claim.base.motion_bounds(T, rate, deviation, step, line.half)
        world = np.broadcast_to(np.eye(4), (len(T), 1, 4, 4))
        T = np.concatenate([world, T[:, -1:], T[:, :-1]], axis=1)
        self.R, self.place = np.ascontiguousarray(T[..., :3, :3]), np.ascontiguousarray(T[..., :3, 3])
        self._z, self._origin = self.R[:, 2:, :, 2], self.place[:, 2:]
        self._sums(step, deviation)
        self._twists(rate)

    def _sums(self, step: Array, deviation: Array) -> None:
        """Compute what all bodies of a motion share: sums over the joints, (r, p) or (r, p, j)."""
        motions, own = self._motions, np.abs(self._motions.sign)
        g = step[:, None] * np.einsum("pki,ri->rpk", motions.order, step) / 2
        self._first = step[:, None] * motions.moves
        self._second = deviation[:, None] * motions.moves + g
        self._theta = np.einsum("rpk,pk->rp", self._first, own * self._revolute)
        self._theta_2 = np.einsum("rpk,pk->rp", self._second, own * self._revolute)
        self._turned = np.einsum("rpk,k->rp", g, self._revolute)

    def tube(self, on: Indices, motion: Indices, center: Array, reach: Array, n: Array) -> Array:
        """Bound how far bodies get along directions n (t, 3) by the tracking error alone, to first order, (t,) [m].

        The centre of a body moves by n . (z x (c - o)) per rad of a joint, and an offset from it by its length at most.
        """
        steps = self._motions.moves[motion] * self._tube  # (t, j)
        away, z = center[:, None] - self._origin[on], self._z[on]
        along = np.where(self._revolute > 0, _dot(cross(n[:, None], z), away), _dot(n[:, None], z))
        return np.einsum("tk,tk->t", np.abs(along), steps) + reach * (steps @ self._revolute)

    def _twists(self, rate: Array) -> None:
        spin = self._z * (rate * self._revolute)[..., None]
        push = cross(self._origin, spin) + self._z * (rate * (1 - self._revolute))[..., None]
        self.omega = np.einsum("pk,rkc->rpc", self._motions.sign, spin)
        self.velocity = np.einsum("pk,rkc->rpc", self._motions.sign, push)
        base, free = self._base, np.flatnonzero(self._pairs.free)
        if base is None or not free.size:
            return
        lever = cross(spin, base.com_lever) + self._z * (rate * (1 - self._revolute) * base.mass_share)[..., None]
        drift = base.com_velocity - lever.sum(axis=1) - cross(base.omega, base.com)
        self.omega[:, free] += base.omega[:, None]
        self.velocity[:, free] += drift[:, None]

    def displacements(self, on: Indices, motion: Indices, center: Array, reach: Array) -> tuple[Array, Array]:
        """Bound the motion of c bodies, to first and second order: D1 and D2 (c,) [m].

        Args:
            on, motion: (c,) the stretch and the relative motion of each.
            center, reach: (c, 3) and (c,) its centre, in the inertial frame, and how far its core gets from there [m].
        """
        away = center[:, None] - self._origin[on]  # (c, j, 3)
        prismatic = 1.0
        free = np.flatnonzero(self._pairs.free[motion]) if self._base is not None else motion[:0]
        if self._base is not None and free.size:
            carried = self._motions.sign[motion[free]]
            away[free] = away[free] * carried[..., None] - self._base.com_lever[on[free]]
            prismatic = np.ones(away.shape[:2])
            prismatic[free] = np.abs(carried - self._base.mass_share)
        along = _dot(away, self._z[on])
        squared = _dot(away, away)
        rho = np.sqrt(np.maximum(squared - along * along, 0.0) + _DISTANCE_ROUNDING * squared)
        rho = np.where(self._revolute > 0, rho, prismatic)
        of_center = np.einsum("ck,ck->c", rho, self._first[on, motion])
        first = of_center + reach * self._theta[on, motion]
        second = np.einsum("ck,ck->c", rho, self._second[on, motion]) + reach * self._theta_2[on, motion]
        second += of_center * self._turned[on, motion]
        if self._base is not None and free.size:
            about = center[free] - self._base.com[on[free]]
            radius = np.sqrt(_dot(about, about)) + reach[free]
            self._add_base_motion(self._base, on[free], free, radius, first, second)
        return first, second

    def _add_base_motion(
        self, base: BaseMotionBounds, on: Indices, free: Indices, radius: Array, first: Array, second: Array
    ) -> None:
        """Add the base's rotation and the motion of the centre of mass to bodies that move in the inertial frame."""
        rotation, error = base.rotation[on], base.attitude_error
        beyond = rotation**2 / 2 + base.rotation_second_order[on] + error
        moved = first[free] + radius * rotation
        second[free] += rotation * first[free] + radius * beyond + error * moved
        drift = np.sqrt(_dot(base.com_velocity, base.com_velocity))[on] * self.half[on]
        first[free] = moved + radius * error + drift


# ---- What the directions prove ---------------------------------------------------------------------------------------


def _check(claim: Claim, settled: _Settled, stretches: Intervals, proven: Array) -> None:
    """Check settled nodes on some stretches, and lessen `proven` (phases,) to what they prove.

    Raises:
        _Fault: a direction does not prove what is required.
    """
    midpoints = _Midpoints(claim, stretches)
    for begin in range(0, len(settled.first), _ROWS):
        some = settled.select(slice(begin, begin + _ROWS))
        left = _proven_by(claim, midpoints, some)
        begins, ends = midpoints.ends[some.stretch].T
        required, phase = claim.held.on(claim.bodies.owner[some.first], some.other, begins, ends)
        short = np.flatnonzero(~(left > required))
        if short.size:
            i = short[0]
            raise _Fault(
                f"the direction for bodies {some.first[i]} and {some.other[i]} from {begins[i]:.6g} to {ends[i]:.6g} on the curve "
                f"proves {left[i]:.6g} m, expected more than {required[i]:.6g}"
            )
        np.minimum.at(proven, phase, left)


def _proven_by(claim: Claim, midpoints: _Midpoints, some: _Settled) -> Array:
    """Return the clearance (t,) [m] that the directions prove of nodes, on their whole stretches."""
    bodies, at, first, other = claim.bodies, some.stretch, some.first, some.other
    motion = claim.pairs.motion_of[bodies.frame[first], bodies.frame[other]]
    n = _normalized(np.where(bodies.half_space[other, None], bodies.axis[other], some.direction))
    moving = _Placed(bodies, midpoints, at, first)
    resting = _Placed(bodies, midpoints, np.where(bodies.frame[other] == WORLD, 0, at), other)
    first_order, second_order = _displacements(midpoints, moving, motion)
    turning = cross(n, midpoints.omega[at, motion])  # n . (omega x x) = turning . x
    half = midpoints.half[at]
    second_order += moving.disc(turning) * half
    if claim.tracking.any():
        second_order += midpoints.tube(at, motion, moving.center[moving.row], moving.reach[moving.row], n)
    speed = moving.along(turning) + moving.spread(_dot(n, midpoints.velocity[at, motion]))
    loss = np.minimum(np.abs(speed) * moving.spread(half) + moving.spread(second_order), moving.spread(first_order))
    least = moving.of_bodies(np.minimum, moving.along(n) - loss) - moving.disc(n)
    most = resting.of_bodies(np.maximum, resting.along(n)) + resting.disc(n)
    guard = GUARD + _RELATIVE_GUARD * (moving.size + resting.size)
    return least - most - bodies.radius[first] - bodies.radius[other] - guard


class _Placed:
    """Bodies (t,) at the midpoints of stretches (t,), each with its points, one after the other.

    Attributes:
        row: (t,) a body is row `row` of the bodies that are placed; there it is placed once for all stretches and motions.
        at, body: (k,) stretch and body of those.
        center, reach: (k, 3) and (k,) in the inertial frame [m]; see `ConvexBodies`.
        size: (t,) no coordinate of a point is greater [m].
    """

    def __init__(self, bodies: ConvexBodies, midpoints: _Midpoints, at: Indices, body: Indices) -> None:
        most = int(body.max(initial=0)) + 1
        key, self.row = _numbered(at * most + body, most * len(midpoints.half))
        self.at, self.body = np.divmod(key, most)
        self._bodies, frame = bodies, bodies.frame[self.body]
        self._R, place = midpoints.R[self.at, frame], midpoints.place[self.at, frame]
        self.center = np.einsum("kcd,kd->kc", self._R, bodies.center[self.body]) + place
        self.reach = bodies.reach[self.body]
        self.size = (np.sqrt(_dot(self.center, self.center)) + self.reach)[self.row]
        count = bodies.points[self.body]
        of, point = _ranges(bodies.first_point[self.body], count)
        x = np.einsum("pcd,pd->pc", self._R[of], bodies.vertices[point]) + place[of]
        self._count = count[self.row]
        self._of, at_x = _ranges((np.cumsum(count) - count)[self.row], self._count)
        self._x = x[at_x]

    def spread(self, values: Array) -> Array:
        """Return values (t, ...) of bodies for all their points."""
        return values[self._of]

    def along(self, n: Array) -> Array:
        """Return n . x of all points, for vectors n (t, 3)."""
        return _dot(n[self._of], self._x)

    def of_bodies(self, least_or_greatest: np.ufunc, values: Array) -> Array:
        """Return the least or greatest value (t,) of every body, for values of all points."""
        return least_or_greatest.reduceat(values, np.cumsum(self._count) - self._count)

    def disc(self, n: Array) -> Array:
        """Return how far the discs of the bodies stand out along vectors (t, 3): the radius times the part across the axis."""
        disc = self._bodies.disc[self.body][self.row]
        out, which = np.zeros(len(disc)), np.flatnonzero(disc)
        if which.size:
            row = self.row[which]
            axis = np.einsum("tcd,td->tc", self._R[row], self._bodies.axis[self.body[row]])
            out[which] = disc[which] * _across(n[which], axis)
        return out


def _displacements(midpoints: _Midpoints, moving: _Placed, motion: Indices) -> tuple[Array, Array]:
    """Bound the motion of bodies by relative motions (t,), to first and second order, (t,) [m]; each combination once."""
    motions = int(motion.max(initial=0)) + 1
    key, row = _numbered(moving.row * motions + motion, motions * len(moving.body))
    which, motion = np.divmod(key, motions)
    first, second = midpoints.displacements(moving.at[which], motion, moving.center[which], moving.reach[which])
    return first[row], second[row]


def _numbered(key: Indices, size: int) -> tuple[Indices, Indices]:
    """Return the different values of keys from 0 to size - 1, and for each key the place of its value among them."""
    if size > 16 * len(key) + 10_000:
        return np.unique(key, return_inverse=True)
    used = np.zeros(size, dtype=bool)
    used[key] = True
    return np.flatnonzero(used), (np.cumsum(used) - 1)[key]


def _normalized(n: Array) -> Array:
    """Return directions of length 1.

    Raises:
        _Fault: a vector is no direction.
    """
    length = np.sqrt(_dot(n, n))
    wrong = np.flatnonzero(~((length > _SHORTEST) & (length < _LONGEST)))
    if wrong.size:
        raise _Fault(f"the vector {n[wrong[0]].tolist()} is no direction")
    return n / length[:, None]


def _across(v: Array, axis: Array) -> Array:
    """Return the lengths of the parts of vectors (t, 3) across axes (t, 3) of length 1."""
    part = v - _dot(v, axis)[..., None] * axis
    return np.sqrt(_dot(part, part))


def _dot(a: Array, b: Array) -> Array:
    return np.einsum("...c,...c->...", a, b)


def _ranges(first: Indices, count: Indices) -> tuple[Indices, Indices]:
    """Return the numbers of the ranges first to first + count - 1, one after the other, as (which range, number)."""
    row = np.repeat(np.arange(len(count)), count)
    return row, np.arange(len(row)) + (first - (np.cumsum(count) - count))[row]
