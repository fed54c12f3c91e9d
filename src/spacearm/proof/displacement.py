"""How its arm moves a floating base: exactly at the middles of stretches, and bounds for all of each stretch.

Per unit of each joint's rate the base turns by W_k = -H^-1 h_k, in its own axes (H and h_k are the system's inertia and joint
k's share in its angular momentum, about the centre of mass). W depends on the joint values v alone. Here are W and its first
derivatives D_ki at the middle, and from bounds of H, h and their derivatives on the whole stretch a bound of the second ones;
by Taylor, then, the base's turn over the stretch is the rate at the middle times the way in u, and an error that goes with the
square of the stretch. docs/certificate.md has the proofs.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spacearm.core.rotations import cross
from spacearm.motion import Curve
from spacearm.proof.moving_bodies import Bodies, Masses, RelativeBodies, ancestors, masses_of
from spacearm.robot import Robot

# ---- Stretches of a curve, and how far it strays on each from the straight line through its middle -------------------
#
# A stretch is a run of the curve's own pieces, or a part of one piece. On each, for every u,
#
#     |q(u) - q(m) - w (u - m)| <= drift,    |u - m| <= h,
#
# joint by joint, with m the middle and w a rate. On a part of a piece w is q'(m), and the drift is h^2/2 times the
# greatest |q''| by the piece's hull (Taylor); on a run of pieces, between which q' may jump, w is the middle of all
# rates that occur, by their hulls, and the drift is h times half their width.

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

_AT_FIRST = 12  # stretches to begin with, at least
_EPS = float(np.finfo(np.float64).eps)
_ROUNDING = 64 * _EPS  # of a sample of the curve, relative to the greatest of its coefficients, joint by joint
_PER_DEGREE = 4 * _EPS  # the same, more for every degree of the polynomials
_JOINT = 64 * _EPS  # between two pieces, likewise; what PiecewisePath takes for no jump


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Stretches:
    """So many stretches r.

    Attributes:
        first, last: (r,) the pieces first to last - 1.
        ends: (r, 2) where they begin and end.
        share: (r,) of the curve, all its pieces counting alike.
    """

    first: Indices
    last: Indices
    ends: Array
    share: Array

    def __len__(self) -> int:
        """Return how many there are."""
        return len(self.first)

    def some(self, which: Indices) -> Stretches:
        """Return some of them."""
        return Stretches(first=self.first[which], last=self.last[which], ends=self.ends[which], share=self.share[which])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Lines:
    """The straight lines through the middles of stretches.

    Attributes:
        u: (r,) the middles.
        h: (r,) half the lengths.
        q, rate: (r, n) there.
        drift: (r, n) how far the curve strays.
    """

    u: Array
    h: Array
    q: Array
    rate: Array
    drift: Array


class Spans:
    """A curve's pieces, cut until there are enough to begin with, and bounds on each."""

    def __init__(self, curve: Curve) -> None:
        self._curve = curve
        bisections = 0
        while curve.pieces << bisections < _AT_FIRST:
            bisections += 1
        self._ends, self._least_rate, self._greatest_rate = curve.hulls(1, bisections=bisections)
        _, low, high = curve.hulls(2, bisections=bisections)
        self._bend = np.maximum(-low, high)  # (p, n)
        self._reach = np.maximum(-self._least_rate, self._greatest_rate)  # (p, n)
        _, low, high = curve.hulls(0, bisections=0)  # the coefficients themselves: what is between may be far smaller
        self._size = np.maximum(1.0, np.maximum(-low, high).max(axis=0))  # (n,)
        self._rounding = _ROUNDING + _PER_DEGREE * curve.degree

    def first(self) -> Stretches:
        """Return stretches that make up the whole curve."""
        pieces = len(self._ends)
        cuts = np.unique(np.linspace(0, pieces, min(pieces, 2 * _AT_FIRST) + 1).astype(np.intp))
        return self._runs(cuts[:-1], cuts[1:])

    def halved(self, of: Stretches) -> Stretches:
        """Return two for each: a run of pieces is parted between two of them, a part of a piece in its middle."""
        run = of.last - of.first > 1
        between = (of.first + of.last) // 2
        middle = np.where(run, self._ends[np.minimum(between, len(self._ends) - 1), 0], of.ends.mean(axis=1))
        first = np.stack([of.first, np.where(run, between, of.first)], axis=1).ravel()
        last = np.stack([np.where(run, between, of.last), of.last], axis=1).ravel()
        return Stretches(
            first=first,
            last=last,
            ends=np.stack([of.ends[:, 0], middle, middle, of.ends[:, 1]], axis=1).reshape(-1, 2),
            share=np.where(np.repeat(run, 2), (last - first) / len(self._ends), np.repeat(of.share, 2) / 2),
        )

    def lines(self, of: Stretches) -> Lines:
        """Return the straight lines, and the drifts for every u of the stretches."""
        u = of.ends.mean(axis=1)
        h = (np.diff(of.ends, axis=1)[:, 0] / 2 + 2 * _EPS * np.abs(of.ends).max(axis=1))[:, None]
        rate, bend = self._curve.sample(u, 1), self._bend[of.first]
        drift = bend * h**2 / 2
        reach = self._reach[of.first]
        # A part of a piece so short that its middle is one of its ends is bounded as a run is: q' there may be another's.
        inside = (u > of.ends[:, 0]) & (u < of.ends[:, 1])
        for i in np.flatnonzero((of.last - of.first > 1) | ~inside):
            low = self._least_rate[of.first[i] : of.last[i]].min(axis=0)
            high = self._greatest_rate[of.first[i] : of.last[i]].max(axis=0)
            rate[i], drift[i] = (low + high) / 2, (high - low) / 2 * h[i]
            reach[i] = np.maximum(-low, high)
        joints = _JOINT * np.maximum(0, of.last - of.first - 1)[:, None] * self._size
        rounding = joints + self._rounding * (self._size + reach * h + drift)
        return Lines(u=u, h=h[:, 0], q=self._curve.sample(u), rate=rate, drift=drift + rounding)

    def _runs(self, first: Indices, last: Indices) -> Stretches:
        ends = np.stack([self._ends[first, 0], self._ends[last - 1, 1]], axis=1)
        return Stretches(first=first, last=last, ends=ends, share=(last - first) / len(self._ends))


# ---- -----------------------------------------------------------------------------------------------------------------
# How its arm moves a floating base: exactly at the middles of stretches, and bounds for all of each stretch.


_OUTWARD = 1 + 1e-9  # by which bounds are made larger, and the absolute part, as a share of the crude bound
_ROUNDING_RECOIL = 1e-11
_LEAST = 1e-300


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BaseMotionBounds:
    """The base's share in what moves, at the middles of r stretches, in inertial axes.

    Attributes:
        center: (r, 3) the system's centre of mass [m].
        pull: (r, j, 3) lever arm by which a joint moves that centre [m]; for a slide its share in the mass counts.
        share: (j,) the share of the whole mass that a joint moves.
        along: (r, 3) velocity of the centre of mass, in the inertial frame, per unit of u [m].
        omega: (r, 3) rate of the base's turn, per unit of u [rad].
        turn: (r,) the base turns no further than this from its attitude at the middle [rad].
        bend: (r,) its turn differs from rate times way in u by no more than this [rad], beyond turn^2 / 2.
        off: by how much the attitude at the middle may be wrong [rad].
    """

    center: Array
    pull: Array
    share: Array
    along: Array
    omega: Array
    turn: Array
    bend: Array
    off: float


class Reaction:
    """A robot's masses and its constant momentum, and what follows for stretches of a path."""

    def __init__(self, robot: Robot, *, linear: Array, angular: Array, time_rate: float, off: float) -> None:
        """Take what does not depend on the path.

        Args:
            robot: with masses.
            linear, angular: (3,) the momentum [N s, N m s], inertial frame.
            time_rate: dt/du [s].
            off: by how much attitudes may be wrong [rad].
        """
        self._masses = masses_of(robot)
        self._turns = np.array([joint.kind == "revolute" for joint in robot.joints])
        self._linear, self._angular, self._off = linear * time_rate, angular * time_rate, off
        count = len(robot.joints)
        above = ancestors(robot)  # (j, j): [k, i] if i is before k
        self._above = above
        own = above | np.eye(count, dtype=bool)
        self._own = own  # [k, i]: i moves what k moves
        related = own | own.T
        deepest = np.maximum.outer(np.arange(count), np.arange(count))
        self._pair = _Chain(related, deepest)
        third = np.maximum.outer(deepest, np.arange(count))
        self._triple = _Chain(related[:, :, None] & related[:, None, :] & related[None, :, :], third)
        greatest, spread = self._masses.beyond @ self._masses.greatest, self._masses.beyond @ self._masses.spread
        self._greatest, self._spread = greatest * 1.0, spread * self._turns

    def at(self, frames: Array, rate: Array, drift: Array, step: Array, half: Array) -> BaseMotionBounds:
        """Bound the base's motion on stretches.

        Args:
            frames: (r, j + 1, 4, 4) T_w_joint at the middles; the last is the base.
            rate, drift: (r, j) of the joints' values per unit of u, and how far these stray from the line.
            step: (r, j) how far they get from the middle's.
            half: (r,) half the stretches' lengths in u.
        """
        placed = _PlacedMasses(self._masses, self._turns, frames)
        W, D = self._rates(placed)
        bound = self._bounds(placed, W, step)
        omega = np.einsum("rkc,rk->rc", W, rate) + placed.solve(np.broadcast_to(self._angular, (len(half), 3)))
        bent = np.einsum("rkic,rk,ri->rc", D, rate, rate)
        size = np.linalg.norm(D, axis=-1)  # (r, k, i)
        off_line = _pairs(step) - _pairs(np.abs(rate) * half[:, None])
        second = np.linalg.norm(bent, axis=-1) * half**2 / 2 + np.einsum("rki,rki->r", size, off_line) + bound.third
        second = np.minimum(second, bound.second)
        own = np.linalg.norm(self._angular) * bound.yielding * half  # by the momentum it has anyhow, at most
        crude = np.einsum("rk,rk->r", bound.W, step) + own
        moved = crude + bound.yielding * np.einsum("rk,rk->r", bound.A, step)
        bend = np.einsum("rk,rk->r", np.linalg.norm(W, axis=-1), drift) + second + own * moved
        bend = bend * _OUTWARD + crude * _ROUNDING_RECOIL
        turn = np.minimum(crude, np.linalg.norm(omega, axis=-1) * half + bend) * _OUTWARD
        return BaseMotionBounds(
            center=placed.center,
            pull=placed.pull,
            share=placed.share,
            along=np.broadcast_to(self._linear / self._masses.total, placed.center.shape),
            omega=omega,
            turn=turn,
            bend=bend,
            off=self._off,
        )

    def _rates(self, placed: _PlacedMasses) -> tuple[Array, Array]:
        """Return W (r, k, 3) and its derivatives D (r, k, i, 3) with respect to joint i's value, in base axes."""
        z, turns, share = placed.z, self._turns[:, None], placed.share
        spun = np.einsum("rkcd,rkd->rkc", placed.inertia, z) * turns  # J_k z_k
        momentum = spun + placed.mass[:, None] * cross(placed.arm, placed.push)
        W = -placed.solve(momentum)
        # The levers of the centres of what k moves, by i: z_i x (C_k - o_i), or z_i for a slide.
        carried = (
            cross(z[:, None], placed.first[:, :, None] - placed.origin[:, None]) * turns + z[:, None] * ~turns
        )  # (r, k, i, 3)
        sway = share[:, None] * placed.push  # (r, i, 3) by which i moves the centre of all
        change = -placed.mass[:, None, None] * cross(sway[:, None], placed.push[:, :, None])  # (r, k, i, 3)
        outer = self._own[:, :, None] * (
            cross(z[:, None] * turns, momentum[:, :, None])
            + placed.mass[:, None, None]
            * cross(carried - cross(z[:, None] * turns, placed.arm[:, :, None]), placed.push[:, :, None])
        )
        # What joint i alone moves: the momentum of it that joint k, before i, gives.
        lever = np.swapaxes(carried, 1, 2)  # [k, i]: of what i moves, by k
        turned = _commutator(z, placed.inertia) * turns[..., None]  # (r, i, 3, 3)
        inner = np.einsum("ricd,rkd->rkic", turned, z * turns)
        inner = inner + placed.mass[:, None] * (
            cross(placed.push[:, None], lever)
            + cross(placed.arm[:, None], cross((z * turns)[:, :, None], placed.push[:, None]))
        )
        change = change + outer + self._above.T[:, :, None] * inner
        twice = 2 * np.einsum("ric,ric->ri", placed.arm, placed.push)[..., None, None] * np.eye(3)
        pair = placed.arm[..., :, None] * placed.push[..., None, :]
        yields = turned + placed.mass[:, None, None] * (twice - pair - np.swapaxes(pair, -1, -2))  # (r, i, 3, 3)
        change = change + np.einsum("ricd,rkd->rkic", yields, W)
        return W, -placed.solve(change)

    def _bounds(self, placed: _PlacedMasses, W: Array, step: Array) -> _Bounds:
        """Bound W and its derivatives on the whole stretches."""
        G = placed.sway + np.einsum("rl,li->ri", placed.sway * step, self._above * 1.0)
        r = (placed.size + np.einsum("rl,rl->r", placed.sway, step))[:, None]  # (r, 1)
        A = self._spread + 2 * r * G
        least = np.maximum(self._masses.base_least, placed.least - np.einsum("ri,ri->r", A, step))
        yielding = 1 / least
        y = yielding[:, None]
        G_2, L_2 = self._pair.of(G), self._pair.of(self._greatest)  # (r, k, i)
        G_3, L_3 = self._triple.of(G), self._triple.of(self._greatest)
        r_2, r_3 = r[..., None], r[..., None, None]
        A_2 = 2 * self._pair.of(self._spread) + 2 * _pairs(G) + 2 * r_2 * G_2
        B_2 = L_2 + _pairs(G) + r_2 * G_2
        B_3 = 2 * L_3 + G_2[:, None] * G[:, :, None, None] + r_3 * G_3
        B_3 = B_3 + G_2[:, :, None] * G[:, None, :, None] + G_2[..., None] * G[:, None, None]
        W_1 = y * (self._greatest + r * G)
        slope = y[..., None] * (B_2 + A[:, None] * W_1[..., None])
        W_1 = np.minimum(W_1, np.linalg.norm(W, axis=-1) + np.einsum("rki,ri->rk", slope, step))
        slope = y[..., None] * (B_2 + A[:, None] * W_1[..., None])  # |dW_k / dv_i| at most
        curve = B_3 + A_2[:, None] * W_1[..., None, None] + A[:, None, :, None] * slope[:, :, None]
        curve = y[..., None, None] * (curve + A[:, None, None] * slope[..., None])  # |d2W_k / dv_i dv_l| at most
        both = np.maximum(curve, np.swapaxes(curve, 1, 2))
        curve = np.maximum(both, np.swapaxes(curve, 1, 3))
        second = np.einsum("rki,rk,ri->r", np.maximum(slope, np.swapaxes(slope, 1, 2)), step, step) / 2
        third = np.einsum("rkil,rk,ri,rl->r", curve, step, step, step) / 6
        return _Bounds(W=W_1, A=A, yielding=yielding, second=second, third=third)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Bounds:
    """Bounds on r stretches.

    Attributes:
        W: (r, k) of |W_k|.
        A: (r, i) of |dH/dv_i|.
        yielding: (r,) of |H^-1|.
        second, third: (r,) of the sums of |D| / 2 and |dD| / 6 with the joints' ways.
    """

    W: Array
    A: Array
    yielding: Array
    second: Array
    third: Array


class _Chain:
    """What belongs to the last of some joints, where these are one after the other on a way out from the base; else 0."""

    def __init__(self, related: NDArray[np.bool_], deepest: NDArray[np.intp]) -> None:
        self._related, self._deepest = related, deepest

    def of(self, values: Array) -> Array:
        """Return (..., j, j) or (..., j, j, j) for values (..., j)."""
        return values[..., self._deepest] * self._related


class _PlacedMasses:
    """A robot's masses where they are: r configurations, in inertial axes, lengths from the system's centre of mass.

    Attributes:
        z, origin: (r, j, 3) of the joints.
        mass, share: (j,) that a joint moves.
        first, arm: (r, j, 3) the centre of what a joint moves; the same, from the system's.
        push, pull: (r, j, 3) velocity of that centre per joint rate; lever arm by which the joint moves the system's.
        inertia: (r, j, 3, 3) of what a joint moves, about that centre.
        center: (r, 3) the system's [m].
        sway: (r, j) root of the sum of m times squared distance from the joint's axis, of what it moves [kg^1/2 m].
        size: (r,) root of the sum of m times squared distance from the system's centre, of all.
        least: (r,) the least moment of inertia of the system.
    """

    def __init__(self, masses: Masses, turns: NDArray[np.bool_], frames: Array) -> None:
        at = frames[:, masses.joint]  # (r, b, 4, 4)
        R, m = at[..., :3, :3], masses.mass
        com = np.einsum("rbcd,bd->rbc", R, masses.com) + at[..., :3, 3]
        self.center = np.einsum("b,rbc->rc", m, com) / masses.total
        com = com - self.center[:, None]
        own = R @ masses.inertia @ np.swapaxes(R, -1, -2)  # (r, b, 3, 3)
        whole = own + _point_inertia(m, com)
        beyond = masses.beyond
        self.z, self.origin = frames[:, :-1, :3, 2], frames[:, :-1, :3, 3] - self.center[:, None]
        self.mass = beyond @ m
        self.share = self.mass / masses.total
        self.arm = np.einsum("jb,rbc->rjc", beyond * m, com) / np.maximum(self.mass, _LEAST)[:, None]
        self.arm = np.where(self.mass[:, None] > 0, self.arm, self.origin)
        self.first = self.arm  # both are from the system's centre of mass
        lever = self.arm - self.origin
        self.push = np.where(turns[:, None], cross(self.z, lever), self.z)
        self.pull = self.share[:, None] * lever
        self.inertia = np.einsum("jb,rbcd->rjcd", beyond, whole) - _point_inertia(self.mass, self.arm)
        H = whole.sum(axis=1)
        self._inverse = np.linalg.inv(H)
        self.least = np.linalg.eigvalsh(H)[:, 0]
        self.size = np.sqrt(np.einsum("b,rbc,rbc->r", m, com, com)) * _OUTWARD
        away = com[:, None] - self.origin[:, :, None]  # (r, j, b, 3)
        height = np.einsum("rjbc,rjc->rjb", away, self.z)
        squared = np.einsum("rjbc,rjbc->rjb", away, away)
        squared = np.where(turns[:, None], np.maximum(squared - height**2, 0.0) + 1e-14 * squared, 1.0)
        self.sway = np.sqrt(np.einsum("jb,rjb->rj", beyond * m, squared)) * _OUTWARD

    def solve(self, momentum: Array) -> Array:
        """Return H^-1 times momenta (r, ..., 3)."""
        return np.einsum("rcd,r...d->r...c", self._inverse, momentum)


def _point_inertia(mass: Array, at: Array) -> Array:
    """Return inertias (r, b, 3, 3) of points of mass (b,) at (r, b, 3) about the origin."""
    squared = np.einsum("rbc,rbc->rb", at, at)[..., None, None]
    return mass[:, None, None] * (squared * np.eye(3) - at[..., :, None] * at[..., None, :])


def _commutator(z: Array, J: Array) -> Array:
    """Return [z x, J] (..., 3, 3): how a turn about z changes J."""
    half = cross(z[..., None, :], np.swapaxes(J, -1, -2))  # row c: z x (row c of J), so the transpose of [z x] J
    return np.swapaxes(half, -1, -2) + half


def _pairs(values: Array) -> Array:
    """Return the products (r, j, j) of values (r, j)."""
    return values[:, :, None] * values[:, None, :]


# ---- Bodies at the middles of stretches, and how far they can get from there -----------------------------------------
#
# With joint values v, joint k's share in a body's motion relative to the frame it is watched from is at most rho_k
# |dv_k|: rho_k is the distance of the body's axis (of an end of it, whichever is further) from joint k's axis *at the
# middle*, or 1 for a slide. Moving the joints one after the other, those nearest to the frame first, shows that no
# drift of rho_k has to be allowed for. docs/certificate.md has the proofs of `way` and `bend`.
#
# Where the arm moves the base, all is in the inertial frame. A body's motion there is its motion about the system's
# centre of mass with the base at rest, to which the same bounds apply (every joint has a lever arm, less its share in
# that centre's), and the base's turn about that centre (see `recoil`).


MotionBounds = Callable[[Array, Array, Array, Array, Array], BaseMotionBounds | None]
"""Bounds the base's motion on stretches; see `BaseProof.motion_bounds`."""

Frames = Callable[[Array, Array], Array]
"""Takes parameters (r,) of the curve and joint values (r, j), gives T_w_joint (r, j + 1, 4, 4); the last is the base itself."""

_ROUNDING_MIDDLES = 1e-15  # of a joint's value, relative
_NUMBERS = 500_000  # at once
_SQUARED_ROUNDING = 1e-14  # of a squared distance that comes as a difference


class JointMap:
    """From the robot's n degrees of freedom to its j joints' values, mimics included."""

    def __init__(self, robot: Robot) -> None:
        self.dof = np.array([joint.dof for joint in robot.joints])
        self.multiplier = np.array([joint.multiplier for joint in robot.joints])
        self.offset = np.array([joint.offset for joint in robot.joints])
        self.reach = np.array([joint.T_parent_joint[:3, 3] for joint in robot.joints])  # (j, 3) from the joint before [m]
        self.turns = np.array([joint.kind == "revolute" for joint in robot.joints])

    def values(self, q: Array) -> Array:
        """Return the joints' values (r, j) at configurations (r, n)."""
        return q[:, self.dof] * self.multiplier + self.offset


def _stays(*_: Array) -> None:
    """Return None, the bounds of a base that stays."""


class Middles:
    """Some relative bodies at the middles of r stretches.

    Attributes:
        frames: (r, j + 1, 4, 4) T_w_joint.
        position: (r, b, e, 3) the ends of all bodies' axes, in the inertial frame [m].
        u, half: (r,) where they are on the curve, and half the stretches' lengths.
        row: where in what follows a relative body stands, -1 for those not watched.
        way: (r, m, e) no end of a relative body's axis gets further than this from where it is at the middle [m].
        velocity: (r, m, e, 3) of the ends there, per unit of u, in inertial axes.
        bend: (r, m, e) along any direction fixed in the frame watched from, an end gets no further than half the length times
            its velocity along it, and this [m].
    """

    def __init__(
        self,
        bodies: Bodies,
        relative_bodies: RelativeBodies,
        joints: JointMap,
        frames: Frames,
        lines: Lines,
        base_motion: MotionBounds = _stays,
    ) -> None:
        self._bodies, self._relative_bodies, self._joints = bodies, relative_bodies, joints
        values = joints.values(lines.q)
        self.frames = frames(lines.u, values)
        self.u, self.half = lines.u, lines.h
        at = self.frames[:, bodies.joint]  # (r, b, 4, 4)
        self.position = bodies.ends @ np.swapaxes(at[..., :3, :3], -1, -2) + at[..., None, :3, 3]
        scale = np.abs(joints.multiplier)
        self._rate = lines.rate[:, joints.dof] * joints.multiplier  # (r, j)
        self._drift = lines.drift[:, joints.dof] * scale + _ROUNDING_MIDDLES * np.abs(values)
        self._step = np.abs(self._rate) * lines.h[:, None] + self._drift
        self._z, self._origin = self.frames[:, :-1, :3, 2], self.frames[:, :-1, :3, 3]  # (r, j, 3)
        self._base_bounds = base_motion(self.frames, self._rate, self._drift, self._step, lines.h)

    def watch(self, used: Indices) -> None:
        """Bound the motions of some relative bodies (m,), and of these only."""
        self.row = np.full(len(self._relative_bodies.body), -1)
        self.row[used] = np.arange(len(used))
        size = self.position.shape[0] * self.position.shape[2] * self._step.shape[1]
        batch = max(1, _NUMBERS // max(size, 1))
        parts = [self._watched(used[i : i + batch]) for i in range(0, len(used), batch)]
        self.way, self.bend, self.velocity = (np.concatenate(column, axis=1) for column in zip(*parts, strict=True))

    def _watched(self, used: Indices) -> tuple[Array, Array, Array]:
        """Return way, bend and velocity of some relative bodies."""
        body, motion = self._relative_bodies.body[used], self._relative_bodies.motion[used]
        points = self.position[:, body]  # (r, m, e, 3)
        free = self._relative_bodies.free[motion]  # (m,)
        moves = np.where(free[:, None], 1.0, np.abs(self._relative_bodies.sign)[motion])  # (m, j)
        rho = self._reach(points, motion, free)
        way = np.einsum("rmej,rmj->rme", rho, self._step[:, None] * moves)
        pairs = self._step[:, None] * np.einsum("pki,ri->rpk", self._relative_bodies.order, self._step) / 2  # (r, p, j)
        bend = np.einsum("rmej,rmj->rme", rho, self._drift[:, None] * moves + pairs[:, motion])
        bend += way * (pairs @ self._joints.turns)[:, motion, None]
        velocity = self._velocity(points, motion)
        if self._base_bounds is not None and free.any():
            self._add_base_motion(self._base_bounds, points, free, way, bend, velocity)
        return way, bend, velocity

    def _reach(self, points: Array, motion: Indices, free: NDArray[np.bool_]) -> Array:
        """Return rho (r, m, e, j), rounded up."""
        away = points[..., None, :] - self._origin[:, None, None]
        slides = np.ones((len(free), 1, away.shape[-2]))
        if self._base_bounds is not None and free.any():
            carried = self._relative_bodies.sign[motion[free]]  # (f, j)
            pull = self._base_bounds.pull[:, None, None]
            away[:, free] = away[:, free] * carried[:, None, :, None] - pull
            slides[free, 0] = np.abs(carried - self._base_bounds.share)
        along = np.einsum("rmejc,rjc->rmej", away, self._z)
        squared = np.einsum("rmejc,rmejc->rmej", away, away)
        rho = np.sqrt(np.maximum(squared - along**2, 0.0) + _SQUARED_ROUNDING * squared)
        return np.where(self._joints.turns, rho, slides)

    def _add_base_motion(
        self,
        base: BaseMotionBounds,
        points: Array,
        free: NDArray[np.bool_],
        way: Array,
        bend: Array,
        velocity: Array,
    ) -> None:
        """Add the base's turn and the centre of mass's way to bodies that are watched from the inertial frame."""
        about = points[:, free] - base.center[:, None, None]  # (r, f, e, 3)
        radius = np.sqrt(np.einsum("rmec,rmec->rme", about, about))
        turn, half = base.turn[:, None, None], self.half[:, None, None]
        bend[:, free] += turn * way[:, free] + radius * (turn**2 / 2 + base.bend[:, None, None] + base.off)
        way[:, free] += radius * (turn + base.off) + np.linalg.norm(base.along, axis=-1)[:, None, None] * half
        turns, z = self._joints.turns[:, None], self._z
        lever = np.where(turns, cross(z, base.pull), z * base.share[:, None])
        centers = np.einsum("rj,rjc->rc", self._rate, lever)  # of the centre of mass, with the base held
        velocity[:, free] += (base.along - centers)[:, None, None] + cross(base.omega[:, None, None], about)

    def _velocity(self, points: Array, motion: Indices) -> Array:
        """Return omega x p + v, from the twists (r, p, 3) of the relative motions."""
        turns = self._joints.turns[:, None]
        spin = self._z * turns * self._rate[..., None]
        push = np.where(turns, cross(self._origin, self._z), self._z) * self._rate[..., None]
        omega, v = self._relative_bodies.sign @ spin, self._relative_bodies.sign @ push
        return cross(omega[:, motion, None], points) + v[:, motion, None]
