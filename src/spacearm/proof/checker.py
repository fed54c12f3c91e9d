"""The check of a proof: little code that decides alone whether a proof tree shows what a claim says.

It makes all nodes of the proof by itself, level by level, from the pairs and the path of the claim (`_expanded`). So no pair
and no instant can be missing, whatever the proof says. The proof only says how nodes are divided, and gives a direction for
each node that is not. On the whole stretch of that node, the direction must prove that the two bodies keep more than what they
are held to (`_clearances`). docs/certificate.md, sections 2 to 6, has the formulas and their proofs; the letters are the same.

Trusted are the claim, Pinocchio's kinematics, the bounds of the path (`path_intervals`) and of a base that the arm moves
(`base_momentum`), and this file. The search and the finder are not: nothing of them is used.
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

GUARD = 1e-9
"""[m] Every gap is reduced by this, for the rounding of numbers of a few metres; see `_RELATIVE_GUARD` for larger ones."""

_RELATIVE_GUARD = 1e-13  # times the size of the numbers that a gap comes from: it is reduced by this, too
_VALUE_ROUNDING = 1e-15  # times a joint's value at the midpoint: the rounding of multiplier and offset
_DISTANCE_ROUNDING = 1e-14  # times a squared distance, which is added to rho^2, a difference of squares
_SHORTEST, _LONGEST = 1e-140, 1e140  # of a direction: beyond, the squares of its coordinates underflow or overflow
_INWARD = 1 - 1e-13  # times the size of what a bundle must enclose: the rounding of that size
_MOST_NODES = 100_000_000  # of a proof
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


# ---- How far bodies move ---------------------------------------------------------------------------------------------


@cached_by_identity
def _joint_map(robot: Robot) -> JointMap:
    return JointMap(robot)


@cached_by_identity
def _moving_joints(pairs: BodyPairs) -> tuple[Array, Array, Indices]:
    """Return which joints move a body in each relative motion, (p, j), 1 or 0; and the weights c_ki.

    In the inertial frame, all joints move every body of a robot that moves its base. Of the p j rows of weights, the different
    ones (w, j) are returned, and for each row which one it is.
    """
    moves = np.where(pairs.free[:, None], 1.0, np.abs(pairs.sign))
    order = np.where(pairs.free[:, None, None], pairs.whole_order, pairs.order)
    weights, row = np.unique(order.reshape(-1, order.shape[-1]), axis=0, return_inverse=True)
    return moves, weights, row.ravel()


class _Midpoints:
    """The robot at the midpoints of r stretches, and how its joints move on them.

    Attributes:
        ends, half: (r, 2) and (r,) where the stretches begin and end, and half their lengths h.
        frames: j + 2, how many frames there are.
        R, place: (r (j + 2), 3, 3) and (r (j + 2), 3) of all frames, in the inertial frame [m].
        omega, velocity: (r p, 3) the twists of the relative motions, per unit of u, about the inertial frame's origin.
    """

    def __init__(self, claim: Claim, stretches: Intervals) -> None:
        joints, line = _joint_map(claim.robot), claim.path.linear_bounds(stretches)
        values = joints.values(line.q)
        placed = claim.base.placed(line.u, Witness(claim.robot, claim.base.bodies()[0]).frames(values))
        rate = line.rate[:, joints.dof] * joints.multiplier
        deviation = line.deviation[:, joints.dof] * np.abs(joints.multiplier) + _VALUE_ROUNDING * np.abs(values)
        self._tube: Array = claim.tracking[joints.dof] * np.abs(joints.multiplier)  # (j,)
        step = np.abs(rate) * line.half[:, None] + deviation + self._tube
        self._base = claim.base.motion_bounds(placed, rate, deviation, step, line.half)
        self._pairs, self._turns = claim.pairs, joints.revolute * 1.0
        self.ends, self.half, self.frames = stretches.ends, line.half, placed.shape[1] + 1
        world = np.broadcast_to(np.eye(4), (len(placed), 1, 4, 4))
        T = np.concatenate([world, placed[:, -1:], placed[:, :-1]], axis=1)
        self.R: Array = T[..., :3, :3].reshape(-1, 3, 3)
        self.place: Array = T[..., :3, 3].reshape(-1, 3)
        self._z, self._origin = np.ascontiguousarray(T[:, 2:, :3, 2]), np.ascontiguousarray(T[:, 2:, :3, 3])
        self._sums(step, deviation)
        self._twists(rate)

    def _sums(self, step: Array, deviation: Array) -> None:
        """Compute what all bodies of a motion share: sums over the joints, (r, p) or (r, p, j)."""
        moves, weights, row = _moving_joints(self._pairs)
        between = np.abs(self._pairs.sign) * self._turns
        sums: Array = np.einsum("ri,wi->rw", step / 2, weights)
        g = step[:, None] * sums.take(row, axis=1).reshape(-1, *moves.shape)
        first, second = step[:, None] * moves, deviation[:, None] * moves + g
        self._theta: Array = np.einsum("rpk,pk->rp", first, between)
        self._theta_2: Array = np.einsum("rpk,pk->rp", second, between)
        self._g: Array = np.einsum("rpk,k->rp", g, self._turns)
        self._first, self._second = first.reshape(-1, len(self._turns)), second.reshape(-1, len(self._turns))

    def _twists(self, rate: Array) -> None:
        spin, slide = self._z * (rate * self._turns)[..., None], self._z * (rate * (1 - self._turns))[..., None]
        twists = np.concatenate([spin, cross(self._origin, spin) + slide], axis=2)  # (r, j, 6)
        rows = np.ascontiguousarray(twists.swapaxes(0, 1)).reshape(len(self._turns), -1)
        relative: Array = np.einsum("pk,kx->px", self._pairs.sign, rows).reshape(-1, len(rate), 6).swapaxes(0, 1)
        omega, velocity = relative[..., :3], relative[..., 3:]
        if self._base is not None:
            base, free = self._base, np.flatnonzero(self._pairs.free)
            of_joints = cross(spin, base.com_lever) + slide * base.mass_share[:, None]  # of the centre of mass
            drift = base.com_velocity - of_joints.sum(axis=1) - cross(base.omega, base.com)
            omega[:, free] += base.omega[:, None]
            velocity[:, free] += drift[:, None]
        self.omega, self.velocity = omega.reshape(-1, 3), velocity.reshape(-1, 3)

    def displacements(self, on: Indices, motion: Indices, center: Array, reach: Array) -> tuple[Array, Array]:
        """Bound the motion of c bodies, to first and second order: D1 and D2 (c,) [m].

        Args:
            on, motion: (c,) the stretch and the relative motion of each.
            center, reach: (c, 3) and (c,) its centre, in the inertial frame, and how far its core gets from there [m].
        """
        base, free = self._base, np.flatnonzero(self._pairs.free[motion])
        away = center[:, None] - _rows(self._origin, on)  # (c, j, 3)
        rho = np.ones(away.shape[:2])
        if base is not None:
            carried = self._pairs.sign[motion[free]]
            away[free] = away[free] * carried[..., None] - base.com_lever[on[free]]
            rho[free] = np.abs(carried - base.mass_share)
        along, squared = _dot(away, _rows(self._z, on)), _dot(away, away)
        across = np.sqrt(np.maximum(squared - along * along, 0.0) + _DISTANCE_ROUNDING * squared)
        rho = np.where(self._turns > 0, across, rho)
        row = on * len(self._pairs.sign) + motion
        d_1: Array = np.einsum("ck,ck->c", rho, _rows(self._first, row))
        d_2: Array = np.einsum("ck,ck->c", rho, _rows(self._second, row))
        first = d_1 + reach * self._theta.take(row)
        second = d_2 + d_1 * self._g.take(row) + reach * self._theta_2.take(row)
        if base is not None:
            about = center[free] - base.com[on[free]]
            moved = self._with_base(base, on[free], np.sqrt(_dot(about, about)) + reach[free], first[free], second[free])
            first[free], second[free] = moved
        return first, second

    def tubes(self, on: Indices, motion: Indices, center: Array, reach: Array, n: Array) -> Array:
        """Bound how far c bodies get along directions n (c, 3) by the tracking error alone, to first order, (c,) [m]."""
        steps = np.abs(self._pairs.sign[motion]) * self._tube  # (c, j)
        away, z, n = center[:, None] - _rows(self._origin, on), _rows(self._z, on), n[:, None]
        of_center = np.abs(np.where(self._turns > 0, _dot(cross(z, away), n), _dot(z, n)))
        return np.einsum("ck,ck->c", of_center + reach[:, None] * self._turns, steps)

    def _with_base(
        self, base: BaseMotionBounds, on: Indices, radius: Array, first: Array, second: Array
    ) -> tuple[Array, Array]:
        """Return D1 and D2 with the base's motion; no point is further than `radius` (c,) from the centre of mass."""
        theta, error = base.rotation[on], base.attitude_error
        drift = np.sqrt(_dot(base.com_velocity, base.com_velocity))[on] * self.half[on]
        turned = first + radius * theta
        second = second + theta * first + radius * (theta**2 / 2 + base.rotation_second_order[on] + error) + error * turned
        return turned + radius * error + drift, second


# ---- What the directions prove ---------------------------------------------------------------------------------------


def _check(claim: Claim, settled: _Settled, stretches: Intervals, proven: Array) -> None:
    """Check settled nodes on some stretches, and lessen `proven` (phases,) to what they prove.

    Raises:
        _Fault: a direction does not prove what is required.
    """
    midpoints = _Midpoints(claim, stretches)
    for begin in range(0, len(settled.first), _ROWS):
        some = settled.select(slice(begin, begin + _ROWS))
        clearance = _clearances(claim, midpoints, some)
        begins, ends = _rows(midpoints.ends, some.stretch).T
        required, phase = claim.held.on(claim.bodies.owner.take(some.first), some.other, begins, ends)
        short = np.flatnonzero(~(clearance > required))
        if short.size:
            i = short[0]
            raise _Fault(
                f"a direction proves {clearance[i]:.6g} m for bodies {some.first[i]} and {some.other[i]} of the table, "
                f"from {begins[i]:.6g} to {ends[i]:.6g} on the curve, expected more than {required[i]:.6g}"
            )
        np.minimum.at(proven, phase, clearance)


def _clearances(claim: Claim, midpoints: _Midpoints, some: _Settled) -> Array:
    """Return the clearances (t,) [m] that the directions prove of nodes, on their whole stretches."""
    bodies, at, first, other = claim.bodies, some.stretch, some.first, some.other
    frame = bodies.frame.take(other)
    motion = claim.pairs.motion_of[bodies.frame.take(first), frame]
    n = _directions(bodies, other, some.direction)
    moving = _Placed(bodies, midpoints, at, first)
    resting = _Placed(bodies, midpoints, np.where(frame == WORLD, 0, at), other)
    displacement, second_order = _displacements(midpoints, moving, motion)
    row, half = at * len(claim.pairs.sign) + motion, midpoints.half.take(at)
    turning = cross(n, _rows(midpoints.omega, row))  # n . (omega x x) = turning . x
    speed = np.abs(moving.heights(turning) + moving.of_points(_dot(n, _rows(midpoints.velocity, row))))
    beyond = second_order + moving.discs(turning) * half
    if claim.tracking.any():
        beyond += midpoints.tubes(at, motion, _rows(moving.center, moving.row), moving.reach.take(moving.row), n)
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
        length = np.sqrt(_dot(n, n))
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

    def __init__(self, bodies: ConvexBodies, midpoints: _Midpoints, at: Indices, body: Indices) -> None:
        most = int(body.max(initial=0)) + 1
        key, self.row = _numbered(at * most + body, most * len(midpoints.half))
        self.on, self.body = np.divmod(key, most)
        frame = self.on * midpoints.frames + bodies.frame.take(self.body)
        self._R, place = _rows(midpoints.R, frame), _rows(midpoints.place, frame)
        self.center: Array = np.einsum("kcd,kd->kc", self._R, _rows(bodies.center, self.body)) + place
        self.reach, self._disc = bodies.reach.take(self.body), bodies.disc.take(body)
        self._axis = bodies.axis
        self.size = (np.sqrt(_dot(self.center, self.center)) + self.reach).take(self.row)
        count = bodies.points.take(self.body)
        of, point = _ranges(bodies.first_point.take(self.body), count)
        x: Array = np.einsum("pcd,pd->pc", _rows(self._R, of), _rows(bodies.vertices, point)) + _rows(place, of)
        first, count = (np.cumsum(count) - count).take(self.row), count.take(self.row)
        self._of, point = _ranges(first, count)
        self._x, self.begins = _rows(x, point), np.cumsum(count) - count

    def of_points(self, values: Array) -> Array:
        """Return values (t, ...) of bodies for each of their points."""
        return _rows(values, self._of)

    def heights(self, n: Array) -> Array:
        """Return n . x of all points, for vectors n (t, 3)."""
        return _dot(self.of_points(n), self._x)

    def discs(self, n: Array) -> Array:
        """Return how far the discs of bodies stand out along vectors n (t, 3): the radius times the part across the axis."""
        out, which = np.zeros(len(n)), np.flatnonzero(self._disc)
        if which.size:
            row = self.row[which]
            axis: Array = np.einsum("tcd,td->tc", self._R[row], self._axis[self.body[row]])
            out[which] = self._disc[which] * _across(n[which], axis)
        return out


def _displacements(midpoints: _Midpoints, moving: _Placed, motion: Indices) -> tuple[Array, Array]:
    """Bound the motion of bodies by relative motions (t,), to first and second order, (t,) [m]; each combination once."""
    most = int(motion.max(initial=0)) + 1
    key, row = _numbered(moving.row * most + motion, most * len(moving.body))
    of, motion = np.divmod(key, most)
    first, second = midpoints.displacements(moving.on.take(of), motion, _rows(moving.center, of), moving.reach.take(of))
    return first.take(row), second.take(row)


@cached_by_identity
def _bundles_enclose(bodies: ConvexBodies) -> bool:
    """Return whether every bundle encloses its members, and no core gets further from its centre than its reach."""
    row, point = _ranges(bodies.first_point, bodies.points)
    away, disc = bodies.vertices[point] - bodies.center[row], bodies.disc[row]
    squared = _dot(away, away) + 2 * _across(away, bodies.axis[row]) * disc + disc**2  # of the furthest point of a disc
    reached = np.sqrt(squared) * _INWARD <= bodies.reach[row]
    bundle = np.flatnonzero(bodies.members)
    balls = (bodies.points[bundle] == 1) & (bodies.disc[bundle] == 0) & ~bodies.half_space[bundle]
    of, member = _ranges(bodies.first_member[bundle], bodies.members[bundle])
    around = bundle[of]
    alike = (bodies.frame[member] == bodies.frame[around]) & ~bodies.half_space[member]
    row, point = _ranges(bodies.first_point[member], bodies.points[member])
    away = bodies.vertices[point] - bodies.vertices[bodies.first_point[around]][row]
    size = np.sqrt(_dot(away, away)) + (bodies.disc + bodies.radius)[member][row]
    return bool(reached.all() and balls.all() and alike.all() and (size * _INWARD <= bodies.radius[around][row]).all())


# ---- Arrays ----------------------------------------------------------------------------------------------------------


def _across(v: Array, axis: Array) -> Array:
    """Return the lengths of the parts of vectors (t, 3) across axes (t, 3) of length 1."""
    part = v - _dot(v, axis)[:, None] * axis
    return np.sqrt(_dot(part, part))


def _dot(a: Array, b: Array) -> Array:
    return a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1] + a[..., 2] * b[..., 2]


def _rows(values: Array, which: Indices) -> Array:
    """Return some rows of an array; several times quicker than `values[which]`."""
    return values.take(which, axis=0)


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
