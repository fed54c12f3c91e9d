"""The momentum of a robot that floats: its masses, how its joints turn the base, and whether a stated base motion conserves it.

Per unit of each joint's rate the base turns by W_k = -H^-1 h_k, in its own axes. H is the system's inertia and h_k the share of
joint k in its angular momentum, both about the centre of mass. W depends on the joint values v alone. At the midpoint of an
interval, W and its first derivatives D_ki are computed exactly. Bounds of H, h and their derivatives over the whole interval
give a bound of the second derivatives. So, by Taylor, the base's rotation over the interval is its rate at the midpoint times
the change of u, up to an error of second order. docs/certificate.md, section 5, has the proofs; the letters are the same.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from spacearm.core.errors import RobotError
from spacearm.core.exact import cross
from spacearm.core.identity_cache import cached_by_identity
from spacearm.core.rotations import matrix_by_parts
from spacearm.motion import AnyTrajectory
from spacearm.proof.bodies import JointMap, ancestors
from spacearm.proof.witness import free_base_model, pinocchio
from spacearm.robot import Robot
from spacearm.robot.model import inertia_fault
from spacearm.robot.unchecked_pairs import require_all_masses

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

_LARGEST = 1e12  # [kg, m, kg m^2] the largest number of a mass, a place or an inertia
_OUTWARD = 1 + 1e-9  # times a bound of the base's rotation, for its rounding
_ROUNDING = 1e-11  # times the crude bound of the rotation: the absolute part of its rounding [rad]
_LEAST = 1e-300  # [kg] in place of a mass of 0 in a quotient
_INSTANTS = 1025  # at most, at which the stated base motion is compared with the proof
_MOMENTUM_INSTANTS = 33  # of these, at which the total momentum is computed

# ---- Masses ----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Masses:
    """The b bodies of a robot with j joints.

    Attributes:
        joint: (b,) the joint that carries the body, -1 for the base.
        mass: (b,) [kg].
        com: (b, 3) the centre of mass, in the joint's frame [m].
        inertia: (b, 3, 3) about the centre of mass, in the joint's axes [kg m^2].
        greatest, spread: (b,) the greatest moment of inertia, and the difference between it and the least [kg m^2].
        beyond: (j, b) 1 if a joint moves a body, else 0.
        base_least: the least moment of inertia of the base with all that is fixed to it, about its own centre of mass [kg m^2].
    """

    joint: Indices
    mass: Array
    com: Array
    inertia: Array
    greatest: Array
    spread: Array
    beyond: Array
    base_least: float

    @property
    def total(self) -> float:
        """The mass of the whole system [kg]."""
        return float(self.mass.sum())


@cached_by_identity
def masses_of(robot: Robot) -> Masses:
    """Return a robot's masses.

    Raises:
        RobotError: the mass of a link is not known; the base has no mass or no inertia; or a body has a negative moment of
            inertia. Then the base's motion does not follow from momentum.
    """
    joint = np.array([body.joint for body in robot.bodies], dtype=np.intp)
    mass = np.array([body.mass for body in robot.bodies])
    com = np.array([body.com for body in robot.bodies]).reshape(-1, 3)
    inertia = np.array([body.inertia for body in robot.bodies]).reshape(-1, 3, 3)
    base = joint < 0
    _require_numbers(robot, mass, com, inertia, mass_of_base=float(mass[base].sum()))
    moments = np.linalg.eigvalsh(inertia).astype(np.float64)
    _require_moments(robot, moments)
    center = mass[base] @ com[base] / mass[base].sum()
    base_least = float(np.linalg.eigvalsh(inertia[base].sum(axis=0) + _inertia_of_points(mass[base], com[base] - center))[0])
    if not base_least > 0:
        raise RobotError(
            f"the base of robot '{robot.name}' has a moment of inertia of {base_least:.4g} kg m^2, expected all above 0; "
            "'spacearm doctor' tells more"
        )
    require_all_masses(robot)
    return Masses(
        joint=joint,
        mass=mass,
        com=com,
        inertia=inertia,
        greatest=np.maximum(moments[:, 2], 0.0),
        spread=moments[:, 2] - moments[:, 0],
        beyond=_beyond(robot),
        base_least=base_least,
    )


def _require_numbers(robot: Robot, mass: Array, com: Array, inertia: Array, *, mass_of_base: float) -> None:
    """Check that no number is too large, and that the base has a mass."""
    largest = max(float(np.abs(array).max(initial=0.0)) for array in (mass, com, inertia))
    if largest > _LARGEST:
        raise RobotError(
            f"robot '{robot.name}' has a mass or an inertia with a number of {largest:.4g}, expected at most {_LARGEST:g}; "
            "check the units"
        )
    if not mass_of_base > 0:
        raise RobotError(
            f"robot '{robot.name}' floats, and its base has no mass; give it one, or plan with base='fixed' "
            "('spacearm doctor' tells what is missing)"
        )


def _require_moments(robot: Robot, moments: Array) -> None:
    """Check that no body has a negative moment of inertia; moments (b, 3) in ascending order."""
    for body, (least, _, _) in zip(robot.bodies, moments, strict=True):
        if inertia_fault(body.inertia) == "negative":
            raise RobotError(
                f"body '{body.name}' of robot '{robot.name}' has a moment of inertia of {least:.4g} kg m^2, expected none "
                "below 0; 'spacearm doctor' tells more"
            )


def _beyond(robot: Robot) -> Array:
    """Return (j, b): 1 if a joint moves a body, else 0."""
    out = np.zeros((len(robot.joints), len(robot.bodies)))
    for b, body in enumerate(robot.bodies):
        on: int = body.joint
        while on >= 0:
            out[on, b] = 1.0
            on = robot.joints[on].parent
    return out


def _inertia_of_points(mass: Array, at: Array) -> Array:
    """Return the inertia (3, 3) of points of mass (b,) at (b, 3) about the origin."""
    squared = np.einsum("b,bc,bc->", mass, at, at)
    return squared * np.eye(3) - np.einsum("b,bc,bd->cd", mass, at, at)


# ---- How the joints move the base ------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BaseMotionBounds:
    """The base's motion on r intervals, in inertial axes: values at the midpoints, and bounds for the whole intervals.

    Attributes:
        com: (r, 3) the system's centre of mass [m].
        com_lever: (r, j, 3) the lever arm mu_k (C_k - o_k) by which a revolute joint moves the centre of mass [m].
        mass_share: (j,) mu_k, the share of the whole mass that a joint moves.
        com_velocity: (r, 3) velocity of the centre of mass, in the inertial frame, per unit of u [m].
        omega: (r, 3) the base's rate of turn, per unit of u [rad].
        rotation: (r,) theta: the base rotates no further than this from its attitude at the midpoint [rad].
        rotation_second_order: (r,) E: its rotation differs from rate times change of u by no more than this [rad], beyond
            theta^2 / 2.
        attitude_error: by how much the attitude at the midpoint may be wrong [rad].
    """

    com: Array
    com_lever: Array
    mass_share: Array
    com_velocity: Array
    omega: Array
    rotation: Array
    rotation_second_order: Array
    attitude_error: float


class FloatingBaseArrays(NamedTuple):
    """What the native finder needs of a floating base with j joints and b bodies, whose attitude has p panels.

    Attributes:
        parent: (j,) the joint before each joint, -1 for the base; int32.
        revolute: (j,) whether it is revolute.
        joint_of_body: (b,) the joint that carries a body, -1 for the base; int32.
        mass, com, inertia, greatest, spread: of the bodies, as in `Masses`.
        base_least: as in `Masses`.
        ends, start, coefficients: as in `BaseAttitude.panels`.
        begin: where the path begins.
        center, velocity: (3,) the system's centre of mass there, and its velocity per unit of u [m].
        angular: (3,) the angular momentum times dt/du.
        attitude_error: by how much an attitude may be wrong [rad].
    """

    parent: NDArray[np.int32]
    revolute: NDArray[np.bool_]
    joint_of_body: NDArray[np.int32]
    mass: Array
    com: Array
    inertia: Array
    greatest: Array
    spread: Array
    base_least: float
    ends: Array
    start: Array
    coefficients: Array
    begin: float
    center: Array
    velocity: Array
    angular: Array
    attitude_error: float


class Reaction:
    """How a base with given masses and momentum reacts to the motion of its joints."""

    def __init__(self, robot: Robot, *, linear: Array, angular: Array, time_rate: float, attitude_error: float) -> None:
        """Compute what does not depend on the path.

        Args:
            robot: with masses.
            linear, angular: (3,) the momentum [N s, N m s], inertial frame.
            time_rate: dt/du [s].
            attitude_error: by how much the attitudes at midpoints may be wrong [rad].
        """
        self._masses = masses_of(robot)
        self._revolute = np.array([joint.kind == "revolute" for joint in robot.joints])
        self._linear, self._angular, self._attitude_error = linear * time_rate, angular * time_rate, attitude_error
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
        self._greatest, self._spread = greatest * 1.0, spread * self._revolute

    def bounds_on(self, frames: Array, rate: Array, deviation: Array, step: Array, half: Array) -> BaseMotionBounds:
        """Bound the base's motion on intervals.

        Args:
            frames: (r, j + 1, 4, 4) T_w_joint at the midpoints; the last is the base.
            rate, deviation: (r, j) w_k of the joints' values per unit of u, and e_k, how far they deviate from that line.
            step: (r, j) delta_k, how far the values get from those at the midpoint.
            half: (r,) half the intervals' lengths in u.
        """
        placed = _PlacedMasses(self._masses, self._revolute, frames)
        W, D = self._rates(placed)
        bound = self._bounds(placed, W, step)
        omega = np.einsum("rkc,rk->rc", W, rate) + placed.solve(np.broadcast_to(self._angular, (len(half), 3)))
        curved = np.einsum("rkic,rk,ri->rc", D, rate, rate)
        size = np.linalg.norm(D, axis=-1)  # (r, k, i)
        off_line = _pairs(step) - _pairs(np.abs(rate) * half[:, None])
        second = np.linalg.norm(curved, axis=-1) * half**2 / 2 + np.einsum("rki,rki->r", size, off_line) + bound.third
        second = np.minimum(second, bound.second)
        own = np.linalg.norm(self._angular) * bound.inverse * half  # the rotation by the angular momentum, at most
        crude = np.einsum("rk,rk->r", bound.W, step) + own
        moved = crude + bound.inverse * np.einsum("rk,rk->r", bound.A, step)
        second_order = np.einsum("rk,rk->r", np.linalg.norm(W, axis=-1), deviation) + second + own * moved
        second_order = second_order * _OUTWARD + crude * _ROUNDING
        rotation = np.minimum(crude, np.linalg.norm(omega, axis=-1) * half + second_order) * _OUTWARD
        return BaseMotionBounds(
            com=placed.com,
            com_lever=placed.com_lever,
            mass_share=placed.share,
            com_velocity=np.broadcast_to(self._linear / self._masses.total, placed.com.shape),
            omega=omega,
            rotation=rotation,
            rotation_second_order=second_order,
            attitude_error=self._attitude_error,
        )

    def _rates(self, placed: _PlacedMasses) -> tuple[Array, Array]:
        """Return W (r, k, 3) and its derivatives D (r, k, i, 3) with respect to joint i's value, in base axes."""
        z, revolute, share = placed.z, self._revolute[:, None], placed.share
        spun = np.einsum("rkcd,rkd->rkc", placed.inertia, z) * revolute  # J_k z_k
        momentum = spun + placed.mass[:, None] * cross(placed.arm, placed.push)
        W = -placed.solve(momentum)
        # How joint i moves the centre C_k of what k moves: z_i x (C_k - o_i), or z_i for a prismatic i.
        carried = (
            cross(z[:, None], placed.arm[:, :, None] - placed.origin[:, None]) * revolute + z[:, None] * ~revolute
        )  # (r, k, i, 3)
        shift = share[:, None] * placed.push  # (r, i, 3) how joint i moves the centre of mass of the system
        change = -placed.mass[:, None, None] * cross(shift[:, None], placed.push[:, :, None])  # (r, k, i, 3)
        outer = self._own[:, :, None] * (
            cross(z[:, None] * revolute, momentum[:, :, None])
            + placed.mass[:, None, None]
            * cross(carried - cross(z[:, None] * revolute, placed.arm[:, :, None]), placed.push[:, :, None])
        )
        # The momentum that joint k, before i, gives to the bodies that joint i moves.
        lever = np.swapaxes(carried, 1, 2)  # [k, i]: how k moves the centre of what i moves
        turned = _commutator(z, placed.inertia) * revolute[..., None]  # (r, i, 3, 3)
        inner = np.einsum("ricd,rkd->rkic", turned, z * revolute)
        inner = inner + placed.mass[:, None] * (
            cross(placed.push[:, None], lever)
            + cross(placed.arm[:, None], cross((z * revolute)[:, :, None], placed.push[:, None]))
        )
        change = change + outer + self._above.T[:, :, None] * inner
        twice = 2 * np.einsum("ric,ric->ri", placed.arm, placed.push)[..., None, None] * np.eye(3)
        pair = placed.arm[..., :, None] * placed.push[..., None, :]
        inertia_change = turned + placed.mass[:, None, None] * (twice - pair - np.swapaxes(pair, -1, -2))  # (r, i, 3, 3)
        change = change + np.einsum("ricd,rkd->rkic", inertia_change, W)
        return W, -placed.solve(change)

    def _bounds(self, placed: _PlacedMasses, W: Array, step: Array) -> _Bounds:
        """Bound W and its derivatives on the whole intervals, by the table at the end of section 5 of docs/certificate.md."""
        G = placed.gyration + np.einsum("rl,li->ri", placed.gyration * step, self._above * 1.0)
        r = (placed.size + np.einsum("rl,rl->r", placed.gyration, step))[:, None]  # (r, 1)
        A = self._spread + 2 * r * G
        least = np.maximum(self._masses.base_least, placed.least - np.einsum("ri,ri->r", A, step))
        inverse = 1 / least
        y = inverse[:, None]
        G_2, L_2 = self._pair.of(G), self._pair.of(self._greatest)  # (r, k, i)
        G_3, L_3 = self._triple.of(G), self._triple.of(self._greatest)
        r_2, r_3 = r[..., None], r[..., None, None]
        A_2 = 2 * self._pair.of(self._spread) + 2 * _pairs(G) + 2 * r_2 * G_2
        B_2 = L_2 + _pairs(G) + r_2 * G_2
        b_3 = 2 * L_3 + G_2[:, None] * G[:, :, None, None] + r_3 * G_3
        b_3 = b_3 + G_2[:, :, None] * G[:, None, :, None] + G_2[..., None] * G[:, None, None]
        rate = y * (self._greatest + r * G)  # |W_k| at most
        slope = y[..., None] * (B_2 + A[:, None] * rate[..., None])
        rate = np.minimum(rate, np.linalg.norm(W, axis=-1) + np.einsum("rki,ri->rk", slope, step))
        slope = y[..., None] * (B_2 + A[:, None] * rate[..., None])  # |dW_k / dv_i| at most
        curve = b_3 + A_2[:, None] * rate[..., None, None] + A[:, None, :, None] * slope[:, :, None]
        curve = y[..., None, None] * (curve + A[:, None, None] * slope[..., None])  # |d2W_k / dv_i dv_l| at most
        both = np.maximum(curve, np.swapaxes(curve, 1, 2))
        curve = np.maximum(both, np.swapaxes(curve, 1, 3))
        second = np.einsum("rki,rk,ri->r", np.maximum(slope, np.swapaxes(slope, 1, 2)), step, step) / 2
        third = np.einsum("rkil,rk,ri,rl->r", curve, step, step, step) / 6
        return _Bounds(W=rate, A=A, inverse=inverse, second=second, third=third)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Bounds:
    """Bounds on r intervals.

    Attributes:
        W: (r, k) of |W_k|.
        A: (r, i) of |dH/dv_i|.
        inverse: (r,) of |H^-1|.
        second, third: (r,) of the sums of |D| / 2 and |dD| / 6 times two or three joints' steps.
    """

    W: Array
    A: Array
    inverse: Array
    second: Array
    third: Array


class _Chain:
    """Picks the value of the outermost of two or three joints if they are on one chain from the base, else 0."""

    def __init__(self, related: NDArray[np.bool_], deepest: NDArray[np.intp]) -> None:
        self._related, self._deepest = related, deepest

    def of(self, values: Array) -> Array:
        """Return (..., j, j) or (..., j, j, j) for values (..., j)."""
        return values[..., self._deepest] * self._related


class _PlacedMasses:
    """A robot's masses at r configurations, in inertial axes. Places are relative to the system's centre of mass.

    Attributes:
        z, origin: (r, j, 3) the joints' axes and origins.
        mass, share: (j,) the mass that a joint moves, and its share mu_k of the whole.
        arm: (r, j, 3) the centre of mass C_k of what a joint moves.
        push: (r, j, 3) the velocity of C_k per unit of the joint's rate, with the base at rest.
        com_lever: (r, j, 3) the lever arm mu_k (C_k - o_k) by which a joint moves the system's centre of mass.
        inertia: (r, j, 3, 3) of what a joint moves, about C_k.
        com: (r, 3) the system's centre of mass, in the inertial frame [m].
        gyration: (r, j) G_k, the root of the sum of m times squared distance from the joint's axis [kg^1/2 m].
        size: (r,) |r|, the root of the sum of m times squared distance from the centre of mass, of all bodies [kg^1/2 m].
        least: (r,) the least moment of inertia of the system [kg m^2].
    """

    def __init__(self, masses: Masses, revolute: NDArray[np.bool_], frames: Array) -> None:
        at = frames[:, masses.joint]  # (r, b, 4, 4)
        R, m = at[..., :3, :3], masses.mass
        com = np.einsum("rbcd,bd->rbc", R, masses.com) + at[..., :3, 3]
        self.com = np.einsum("b,rbc->rc", m, com) / masses.total
        com = com - self.com[:, None]
        own = R @ masses.inertia @ np.swapaxes(R, -1, -2)  # (r, b, 3, 3)
        whole = own + _point_inertia(m, com)
        beyond = masses.beyond
        self.z, self.origin = frames[:, :-1, :3, 2], frames[:, :-1, :3, 3] - self.com[:, None]
        self.mass = beyond @ m
        self.share = self.mass / masses.total
        arm: Array = np.einsum("jb,rbc->rjc", beyond * m, com) / np.maximum(self.mass, _LEAST)[:, None]
        self.arm = np.where(self.mass[:, None] > 0, arm, self.origin)
        lever = self.arm - self.origin
        self.push = np.where(revolute[:, None], cross(self.z, lever), self.z)
        self.com_lever = self.share[:, None] * lever
        self.inertia = np.einsum("jb,rbcd->rjcd", beyond, whole) - _point_inertia(self.mass, self.arm)
        H = whole.sum(axis=1)
        self._inverse: Array = np.linalg.inv(H)
        self.least = np.linalg.eigvalsh(H)[:, 0]
        self.size = np.sqrt(np.einsum("b,rbc,rbc->r", m, com, com)) * _OUTWARD
        away = com[:, None] - self.origin[:, :, None]  # (r, j, b, 3)
        height = np.einsum("rjbc,rjc->rjb", away, self.z)
        squared = np.einsum("rjbc,rjbc->rjb", away, away)
        squared = np.where(revolute[:, None], np.maximum(squared - height**2, 0.0) + 1e-14 * squared, 1.0)
        self.gyration = np.sqrt(np.einsum("jb,rjb->rj", beyond * m, squared)) * _OUTWARD

    def solve(self, momentum: Array) -> Array:
        """Return H^-1 times momenta (r, ..., 3)."""
        return np.einsum("rcd,r...d->r...c", self._inverse, momentum)


def _point_inertia(mass: Array, at: Array) -> Array:
    """Return the inertias (r, b, 3, 3) of points of mass (b,) at (r, b, 3) about the origin."""
    squared = np.einsum("rbc,rbc->rb", at, at)[..., None, None]
    return mass[:, None, None] * (squared * np.eye(3) - at[..., :, None] * at[..., None, :])


def _commutator(z: Array, J: Array) -> Array:
    """Return the commutator of [z x] and J (..., 3, 3): the derivative of J for a rotation about z."""
    half = cross(z[..., None, :], np.swapaxes(J, -1, -2))  # row c: z x (row c of J), so the transpose of [z x] J
    return np.swapaxes(half, -1, -2) + half


def _pairs(values: Array) -> Array:
    """Return the products (r, j, j) of values (r, j)."""
    return values[:, :, None] * values[:, None, :]


# ---- Whether a stated base motion conserves momentum -----------------------------------------------------------------


class StatedBaseErrors(NamedTuple):
    """How wrong the base motion is that a trajectory states.

    Attributes:
        residual: the greatest difference between its momentum and the given one, relative to the greatest momentum of a link;
            linear [N s] and angular [N m s] with one scale, as at 1 m from the centre of mass.
        elsewhere: the greatest distance of the base from its proven pose: angle [rad] plus distance [m].
    """

    residual: float
    elsewhere: float


def some_of(instants: Array) -> Array:
    """Return at most 1025 of some instants, evenly chosen."""
    return instants[np.unique(np.linspace(0, len(instants) - 1, min(len(instants), _INSTANTS)).astype(np.intp))]


def stated_base_errors(
    robot: Robot, trajectory: AnyTrajectory, t: Array, frames: Array, *, linear: Array, angular: Array
) -> StatedBaseErrors:
    """Compare what a trajectory states of its base with the proof, at instants. The proof itself does not use the statement.

    Args:
        robot: with masses.
        trajectory: with `base_pose` and `base_rate`.
        t: (r,) instants [s].
        frames: (r, 4, 4) T_w_b of the proof there.
        linear, angular: (3,) the momentum that is conserved [N s, N m s].
    """
    position, wxyz = trajectory.base_pose(t)
    elsewhere = stated_elsewhere(position, wxyz, frames)
    some = np.unique(np.linspace(0, len(t) - 1, min(len(t), _MOMENTUM_INSTANTS)).astype(np.intp))
    conserved = np.array([linear, angular])
    return StatedBaseErrors(_residual(robot, trajectory, conserved, t[some], position[some], wxyz[some]), elsewhere)


def stated_elsewhere(position: Array, wxyz: Array, frames: Array) -> float:
    """Return how far stated poses (r, 3), (r, 4) are from frames (r, 4, 4), at most: angle [rad] plus distance [m]."""
    R = matrix_by_parts(wxyz / np.linalg.norm(wxyz, axis=1)[:, None])
    # The Frobenius norm of the difference of two rotations is root 8 times sin x/2, x being the angle between them.
    turned = 2 * np.arcsin(np.minimum(1.0, np.linalg.norm(R - frames[:, :3, :3], axis=(1, 2)) / np.sqrt(8)))
    return float((turned + np.linalg.norm(position - frames[:, :3, 3], axis=1)).max())


def _residual(robot: Robot, trajectory: AnyTrajectory, conserved: Array, t: Array, position: Array, wxyz: Array) -> float:
    """Compute the momentum of all links with Pinocchio, at times (r,), with the base where the trajectory says."""
    library, (model, at_q, at_v) = pinocchio(), free_base_model(robot)
    state, joints = model.createData(), JointMap(robot)
    joint_state = trajectory.sample(t)
    velocity, omega = trajectory.base_rate(t)
    q, v = np.zeros((len(t), model.nq)), np.zeros((len(t), model.nv))
    q[:, :3], q[:, 3:7], q[:, at_q] = position, wxyz[:, [1, 2, 3, 0]], joints.values(joint_state.q)
    v[:, 3:6], v[:, at_v] = omega, joint_state.dq[:, joints.dof] * joints.multiplier
    bodies = range(1, model.njoints)
    totals, linear = np.empty((len(t), 2, 3)), np.empty((len(t), len(bodies), 3))
    angular = np.empty_like(linear)
    center = np.empty((len(t), 3))
    for i, (row, rate, moved) in enumerate(zip(q, v, velocity, strict=True)):
        rate[:3] = library.Quaternion(row[3:7]).toRotationMatrix().T @ moved
        total = library.computeCentroidalMomentum(model, state, row, rate)
        totals[i], center[i] = (total.linear, total.angular), state.com[0]
        for k in bodies:
            own = state.oMi[k].act(model.inertias[k] * state.v[k])  # about the world's origin
            linear[i, k - 1], angular[i, k - 1] = own.linear, own.angular
    angular -= cross(center[:, None], linear)
    missed = np.linalg.norm(totals - conserved, axis=2).max(axis=0)
    greatest = np.array([np.linalg.norm(of, axis=2).max() for of in (linear, angular)])
    scale = float(greatest.max())  # of both: the linear momentum of links that only rotate is rounding, and no scale
    return float(missed.max()) / scale if scale > 0 else (np.inf if missed.any() else 0.0)
