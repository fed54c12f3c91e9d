"""How far the bodies of a claim move on stretches of the path: first and second order bounds, for the checker of proofs.

Joint k moves the centre of a body by at most rho_k |dv_k|. Here rho_k is the centre's distance from the joint's axis *at the
midpoint*, or 1 for a prismatic joint. What is within the body's reach of its centre turns with it like a vector. Where the arm
moves the base, all joints move every body about the system's centre of mass, and the base's rotation is added.
docs/certificate.md, sections 3 and 5, has the proofs; the letters are the same.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from spacearm.core.exact import cross, dot
from spacearm.core.identity_cache import cached_by_identity
from spacearm.proof.base_momentum import BaseMotionBounds
from spacearm.proof.claim import Claim
from spacearm.proof.convex_bodies import BodyPairs
from spacearm.proof.mechanism import joints_of, kinematics_of
from spacearm.proof.path_intervals import Intervals

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

_VALUE_ROUNDING = 1e-15  # times a joint's value at the midpoint: the rounding of multiplier and offset
_DISTANCE_ROUNDING = 1e-14  # times a squared distance, which is added to rho^2, a difference of squares


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


class Midpoints:
    """The robot at the midpoints of r stretches, and how its joints move on them.

    Attributes:
        ends, half: (r, 2) and (r,) where the stretches begin and end, and half their lengths h.
        frames: j + 2, how many frames there are.
        R, place: (r (j + 2), 3, 3) and (r (j + 2), 3) of all frames, in the inertial frame [m].
        omega, velocity: (r p, 3) the twists of the relative motions, per unit of u, about the inertial frame's origin.
    """

    def __init__(self, claim: Claim, stretches: Intervals) -> None:
        joints, line = joints_of(claim.robot), claim.path.linear_bounds(stretches)
        values = joints.values(line.q)
        placed = claim.base.placed(line.u, kinematics_of(claim.robot).frames(values))
        rate = line.rate[:, joints.dof] * joints.multiplier
        deviation = line.deviation[:, joints.dof] * np.abs(joints.multiplier) + _VALUE_ROUNDING * np.abs(values)
        self._tube: Array = claim.tracking[joints.dof] * np.abs(joints.multiplier)  # (j,)
        step = np.abs(rate) * line.half[:, None] + deviation + self._tube
        self._base = claim.base.motion_bounds(placed, rate, deviation, step, line.half)
        self._pairs, self._turns = claim.pairs, joints.revolute * 1.0
        self.ends, self.half, self.frames = stretches.ends, line.half, len(claim.robot.joints) + 2
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
        away = center[:, None] - self._origin.take(on, axis=0)  # (c, j, 3)
        rho = np.ones(away.shape[:2])
        if base is not None:
            carried = self._pairs.sign[motion[free]]
            away[free] = away[free] * carried[..., None] - base.com_lever[on[free]]
            rho[free] = np.abs(carried - base.mass_share)
        along, squared = dot(away, self._z.take(on, axis=0)), dot(away, away)
        across = np.sqrt(np.maximum(squared - along * along, 0.0) + _DISTANCE_ROUNDING * squared)
        rho = np.where(self._turns > 0, across, rho)
        row = on * len(self._pairs.sign) + motion
        d_1: Array = np.einsum("ck,ck->c", rho, self._first.take(row, axis=0))
        d_2: Array = np.einsum("ck,ck->c", rho, self._second.take(row, axis=0))
        first = d_1 + reach * self._theta.take(row)
        second = d_2 + d_1 * self._g.take(row) + reach * self._theta_2.take(row)
        if base is not None:
            about = center[free] - base.com[on[free]]
            moved = self._with_base(base, on[free], np.sqrt(dot(about, about)) + reach[free], first[free], second[free])
            first[free], second[free] = moved
        return first, second

    def tubes(self, on: Indices, motion: Indices, center: Array, reach: Array, n: Array) -> Array:
        """Bound how far c bodies get along directions n (c, 3) by the tracking error alone, to first order, (c,) [m]."""
        steps = np.abs(self._pairs.sign[motion]) * self._tube  # (c, j)
        away, z, n = center[:, None] - self._origin.take(on, axis=0), self._z.take(on, axis=0), n[:, None]
        of_center = np.abs(np.where(self._turns > 0, dot(cross(z, away), n), dot(z, n)))
        return np.einsum("ck,ck->c", of_center + reach[:, None] * self._turns, steps)

    def _with_base(
        self, base: BaseMotionBounds, on: Indices, radius: Array, first: Array, second: Array
    ) -> tuple[Array, Array]:
        """Return D1 and D2 with the base's motion; no point is further than `radius` (c,) from the centre of mass."""
        theta, error = base.rotation[on], base.attitude_error
        drift = np.sqrt(dot(base.com_velocity, base.com_velocity))[on] * self.half[on]
        turned = first + radius * theta
        second = second + theta * first + radius * (theta**2 / 2 + base.rotation_second_order[on] + error) + error * turned
        return turned + radius * error + drift, second
