"""How its arm moves a floating base: exactly at the middles of stretches, and bounds for all of each stretch.

Per unit of each joint's rate the base turns by W_k = -H^-1 h_k, in its own axes (H and h_k are the system's inertia and joint
k's share in its angular momentum, about the centre of mass). W depends on the joint values v alone. Here are W and its first
derivatives D_ki at the middle, and from bounds of H, h and their derivatives on the whole stretch a bound of the second ones;
by Taylor, then, the base's turn over the stretch is the rate at the middle times the way in u, and an error that goes with the
square of the stretch. docs/certificate.md has the proofs.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spacearm.proof.bodies import ancestors
from spacearm.proof.masses import Masses, masses_of
from spacearm.proof.vectors import cross
from spacearm.robot import Robot

Array = NDArray[np.float64]

_OUTWARD = 1 + 1e-9  # by which bounds are made larger, and the absolute part, as a share of the crude bound
_ROUNDING = 1e-11
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
        bend = bend * _OUTWARD + crude * _ROUNDING
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
