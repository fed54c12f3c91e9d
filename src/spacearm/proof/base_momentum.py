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
from spacearm.proof.mechanism import ancestors, free_base_data, free_base_model, joints_of, pinocchio
from spacearm.robot import Robot
from spacearm.robot.inertias import inertia_fault
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
        """Keep what does not depend on the path.

        Args:
            robot: with masses.
            linear, angular: (3,) the momentum [N s, N m s], inertial frame.
            time_rate: dt/du [s].
            attitude_error: by how much the attitudes at midpoints may be wrong [rad].
        """
        self._tree = tree_of(robot)
        self._linear, self._angular, self._attitude_error = linear * time_rate, angular * time_rate, attitude_error

    def bounds_on(self, frames: Array, rate: Array, deviation: Array, step: Array, half: Array) -> BaseMotionBounds:
        """Bound the base's motion on intervals.

        Args:
            frames: (r, j + 1, 4, 4) T_w_joint at the midpoints; the last is the base.
            rate, deviation: (r, j) w_k of the joints' values per unit of u, and e_k, how far they deviate from that line.
            step: (r, j) delta_k, how far the values get from those at the midpoint.
            half: (r,) half the intervals' lengths in u.
        """
        placed = _PlacedMasses(self._tree, frames)
        W, D = _rates(self._tree, placed)
        W_size = np.sqrt(_dot(W, W))  # (r, k)
        bound = _bounds(self._tree, placed, W_size, step)
        omega = (rate[:, None] @ W)[:, 0] + placed.inverse @ self._angular
        curved = (D @ _pairs(rate).reshape(len(half), -1, 1))[..., 0]
        size = np.sqrt(np.einsum("rcp,rcp->rp", D, D))  # (r, k i)
        moved = np.abs(rate) * half[:, None]
        off_line = (_pairs(step) - _pairs(moved)).reshape(size.shape)
        second = np.sqrt(_dot(curved, curved)) * half**2 / 2 + _dot(size, off_line) + bound.third
        second = np.minimum(second, bound.second)
        own = np.sqrt(self._angular @ self._angular) * bound.inverse * half  # the rotation by the angular momentum, at most
        crude = bound.moved + own
        turned = crude + bound.inverse * bound.lost + self._attitude_error  # by which H^-1 R^T L may be turned, or changed
        second_order = _dot(W_size, deviation) + second + own * turned
        second_order = second_order * _OUTWARD + crude * _ROUNDING
        rotation = np.minimum(crude, np.sqrt(_dot(omega, omega)) * half + second_order) * _OUTWARD
        return BaseMotionBounds(
            com=placed.com,
            com_lever=placed.com_lever,
            mass_share=self._tree.share,
            com_velocity=np.broadcast_to(self._linear / self._tree.masses.total, placed.com.shape),
            omega=omega,
            rotation=rotation,
            rotation_second_order=second_order,
            attitude_error=self._attitude_error,
        )


class _Tree:
    """What moves what in a robot with j joints and b bodies.

    Attributes:
        masses: the bodies.
        joints: the joints.
        revolute: (j,) 1 for a revolute joint, 0 for a prismatic one.
        mass, share: (j,) the mass that a joint moves [kg], and its share mu_k of the whole.
        sums: (j + 1, b) which bodies a joint moves; the last row is of all bodies.
        own, above: (j, j) [k, i]: 1 if joint i moves what joint k moves; the same for i other than k.
        greatest, spread: (j,) the sums of the moments of what a joint moves; the spread of a prismatic one is 0.
        related, outer: (j, j) 1 if two joints are on one chain from the base; and the outer one of the two.
        triples: (3, t) all k >= i >= n.
        weight: (t,) how many permutations such a triple has, over 6.
        chain: (t,) 1 if the three are on one chain.
    """

    def __init__(self, robot: Robot) -> None:
        self.masses = masses = masses_of(robot)
        self.joints = joints_of(robot)
        count = len(robot.joints)
        self.revolute = self.joints.revolute * 1.0
        self.mass = masses.beyond @ masses.mass
        self.share = self.mass / masses.total
        self.sums = np.concatenate([masses.beyond, np.ones((1, len(masses.mass)))])
        above = ancestors(robot)
        own = above | np.eye(count, dtype=bool)
        related = own | own.T
        self.own, self.above, self.related = own * 1.0, above * 1.0, related * 1.0
        self.greatest, self.spread = masses.beyond @ masses.greatest, masses.beyond @ masses.spread * self.revolute
        number = np.arange(count)
        self.outer = np.maximum.outer(number, number)
        k, i, n = np.nonzero((number[:, None, None] >= number[:, None]) & (number[:, None] >= number))
        self.triples = np.stack([k, i, n])
        self.weight = np.where(k == i, np.where(i == n, 1 / 6, 1 / 2), np.where(i == n, 1 / 2, 1.0))
        self.chain = (related[k, i] & related[k, n] & related[i, n]) * 1.0


@cached_by_identity
def tree_of(robot: Robot) -> _Tree:
    """Return what moves what in a robot."""
    return _Tree(robot)


class _PlacedMasses:
    """A robot's masses at r configurations, in inertial axes. Places are relative to the system's centre of mass.

    Attributes:
        z, origin: (r, j, 3) the joints' axes and origins.
        arm: (r, j, 3) the centre of mass C_k of what a joint moves.
        push: (r, j, 3) the velocity of C_k per unit of the joint's rate, with the base at rest.
        com_lever: (r, j, 3) the lever arm mu_k (C_k - o_k) by which a joint moves the system's centre of mass.
        inertia: (r, j, 3, 3) of what a joint moves, about C_k.
        inverse: (r, 3, 3) H^-1.
        com: (r, 3) the system's centre of mass, in the inertial frame [m].
        gyration: (r, j) G_k, the root of the sum of m times squared distance from the joint's axis [kg^1/2 m].
        size: (r,) |r|, the root of the sum of m times squared distance from the centre of mass, of all bodies [kg^1/2 m].
        least: (r,) the least moment of inertia of the system [kg m^2].
    """

    def __init__(self, tree: _Tree, frames: Array) -> None:
        masses, count = tree.masses, len(frames)
        at = frames[:, masses.joint]  # (r, b, 4, 4)
        R, m = at[..., :3, :3], masses.mass
        com = (R @ masses.com[..., None])[..., 0] + at[..., :3, 3]
        self.com = m @ com / masses.total
        com = com - self.com[:, None]
        own = R @ masses.inertia @ np.swapaxes(R, -1, -2)  # (r, b, 3, 3)
        whole = tree.sums @ (own + _point_inertia(m, com)).reshape(count, -1, 9)
        whole = whole.reshape(count, -1, 3, 3)  # of what each joint moves, and of all
        self.z, self.origin = np.ascontiguousarray(frames[:, :-1, :3, 2]), frames[:, :-1, :3, 3] - self.com[:, None]
        arm: Array = (masses.beyond * m) @ com / np.maximum(tree.mass, _LEAST)[:, None]
        self.arm = np.where(tree.mass[:, None] > 0, arm, self.origin)
        lever = self.arm - self.origin
        self.push = np.where(tree.revolute[:, None] > 0, cross(self.z, lever), self.z)
        self.com_lever = tree.share[:, None] * lever
        self.inertia = whole[:, :-1] - _point_inertia(tree.mass, self.arm)
        H = whole[:, -1]
        self.inverse: Array = np.linalg.inv(H).astype(np.float64)
        self.least = np.linalg.eigvalsh(H)[:, 0]
        self.size = np.sqrt(_dot(com, com) @ m) * _OUTWARD
        away = com[:, None] - self.origin[:, :, None]  # (r, j, b, 3)
        height = (away @ self.z[..., None])[..., 0]
        squared = _dot(away, away)
        squared = np.maximum(squared - height**2, 0.0) + 1e-14 * squared
        squared = np.where(tree.revolute[:, None] > 0, squared, 1.0)
        self.gyration = np.sqrt(np.einsum("jb,rjb->rj", masses.beyond * m, squared)) * _OUTWARD


def _rates(tree: _Tree, placed: _PlacedMasses) -> tuple[Array, Array]:
    """Return W (r, j, 3) and its derivatives D (r, 3, j j): column k j + i is that of W_k with respect to joint i's value.

    The derivative of h_k with respect to joint i's value has three parts. The system's centre of mass moves by s_i. If i moves
    what k moves, that turns about i's axis. If k is before i, what i moves changes its share in h_k. Products of vectors are
    those of matrices here, (r, 3 j, 3) by (r, 3, j), so that all pairs are computed at once.
    """
    z, push, mass = placed.z, placed.push, tree.mass[:, None]
    spin = z * tree.revolute[:, None]
    at_center = np.where(tree.revolute[:, None] > 0, cross(placed.origin, z), z)  # of a point at the centre of mass, t_k
    given = mass * push
    h = (placed.inertia @ spin[..., None])[..., 0] + cross(placed.arm, given)
    W = -h @ placed.inverse
    # Gamma_i, how H changes: its rotating part and that of the motion of C_i.
    turned = skew(spin) @ placed.inertia - given[..., None] * placed.arm[..., None, :]
    turned[..., range(3), range(3)] += _dot(placed.arm, given)[..., None]
    change_of_H = turned + np.swapaxes(turned, -1, -2)  # (r, i, 3, 3)
    shift = push * tree.share[:, None]
    j = len(tree.mass)
    of_push = _products(skew(given), np.concatenate([shift, at_center], axis=1))  # (r, 3, k, 2 i)
    of_spin = _products(skew(spin), h)  # (r, 3, i, k)
    of_H = _products(change_of_H, np.concatenate([W, spin], axis=1))  # (r, 3, i, 2 k)
    by_outer = tree.own.T * of_spin + of_H[..., :j] + tree.above * (of_push[..., j:] + of_H[..., j:])
    change = of_push[..., :j] - tree.own * of_push[..., j:] + np.swapaxes(by_outer, -1, -2)
    return W, -placed.inverse @ change.reshape(len(z), 3, -1)


def skew(v: Array) -> Array:
    """Return the matrices (..., 3, 3) that map x to v x x."""
    out = np.zeros((*v.shape, 3))
    out[..., 0, 1], out[..., 0, 2], out[..., 1, 2] = -v[..., 2], v[..., 1], -v[..., 0]
    out[..., 1, 0], out[..., 2, 0], out[..., 2, 1] = v[..., 2], -v[..., 1], v[..., 0]
    return out


def _products(matrices: Array, vectors: Array) -> Array:
    """Return the products (r, 3, j, n) of all matrices (r, j, 3, 3) and vectors (r, n, 3)."""
    rows = np.swapaxes(matrices, 1, 2).reshape(len(matrices), -1, 3)
    return (rows @ np.swapaxes(vectors, 1, 2)).reshape(len(matrices), 3, -1, vectors.shape[1])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Bounds:
    """Bounds on r intervals.

    Attributes:
        moved: (r,) of the sum of |W_k| delta_k.
        lost: (r,) of the sum of |dH/dv_i| delta_i.
        inverse: (r,) of |H^-1|.
        second, third: (r,) of the sums of |D| / 2 and |dD| / 6 times two or three joints' steps.
    """

    moved: Array
    lost: Array
    inverse: Array
    second: Array
    third: Array


def _bounds(tree: _Tree, placed: _PlacedMasses, W_size: Array, steps: Array) -> _Bounds:
    """Bound W and its derivatives on the whole intervals, by the table at the end of section 5 of docs/certificate.md.

    The last axis of all arrays is that of the intervals, and the first ones are of joints.
    """
    step, gyration = np.ascontiguousarray(steps.T), np.ascontiguousarray(placed.gyration.T)  # (j, r)
    pushed = gyration * step
    G = gyration + tree.above.T @ pushed
    r = placed.size + pushed.sum(axis=0)
    A = tree.spread[:, None] + 2 * r * G
    lost = (A * step).sum(axis=0)
    y = 1 / np.maximum(tree.masses.base_least, placed.least - lost)
    greatest = tree.greatest[:, None]
    related = tree.related[..., None]
    G_2 = G[tree.outer] * related  # (k, i, r)
    both = G[:, None] * G[None]
    B_2 = greatest[tree.outer] * related + both + r * G_2
    A_2 = 2 * (tree.spread[tree.outer] * tree.related)[..., None] + 2 * both + 2 * r * G_2
    crude = y * (greatest + r * G)  # |W_k| at most
    slope = y * (B_2 + A * crude[:, None])
    rate = np.minimum(crude, W_size.T + np.einsum("kir,ir->kr", slope, step))
    slope = y * (B_2 + A * rate[:, None])  # |dW_k / dv_i| at most
    moved = (rate * step).sum(axis=0)
    second = np.einsum("kir,kr,ir->r", np.maximum(slope, np.swapaxes(slope, 0, 1)), step, step) / 2
    k, i, n = tree.triples
    alike = tree.chain[:, None] * (2 * greatest[k] + r * G[k]) + G_2[i, n] * G[k] + G_2[k, n] * G[i] + G_2[k, i] * G[n]
    A_k, A_i, A_n = A[k], A[i], A[n]
    of_k = A_2[i, n] * rate[k] + A_i * slope[k, n] + A_n * slope[k, i]
    of_i = A_2[k, n] * rate[i] + A_k * slope[i, n] + A_n * slope[i, k]
    of_n = A_2[k, i] * rate[n] + A_k * slope[n, i] + A_i * slope[n, k]
    curve = alike + np.maximum(np.maximum(of_k, of_i), of_n)  # |d2W_k / dv_i dv_l| at most, over y
    third = y * (tree.weight @ (curve * step[k] * step[i] * step[n]))
    return _Bounds(moved=moved, lost=lost, inverse=y, second=second, third=third)


def _point_inertia(mass: Array, at: Array) -> Array:
    """Return the inertias (r, b, 3, 3) of points of mass (b,) at (r, b, 3) about the origin."""
    scaled = mass[:, None] * at
    out = -scaled[..., :, None] * at[..., None, :]
    out[..., range(3), range(3)] += _dot(scaled, at)[..., None]
    return out


def _dot(a: Array, b: Array) -> Array:
    """Return the products (...) of vectors (..., n)."""
    return np.einsum("...c,...c->...", a, b)


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
    stated = trajectory.base_state(t)
    elsewhere = stated_elsewhere(stated[0], stated[1], frames)
    some = np.unique(np.linspace(0, len(t) - 1, min(len(t), _MOMENTUM_INSTANTS)).astype(np.intp))
    conserved, stated = np.array([linear, angular]), [column[some] for column in stated]
    return StatedBaseErrors(_residual(robot, trajectory, conserved, t[some], stated), elsewhere)


def stated_elsewhere(position: Array, wxyz: Array, frames: Array) -> float:
    """Return how far stated poses (r, 3), (r, 4) are from frames (r, 4, 4), at most: angle [rad] plus distance [m]."""
    R = matrix_by_parts(wxyz / np.linalg.norm(wxyz, axis=1)[:, None])
    # The Frobenius norm of the difference of two rotations is root 8 times sin x/2, x being the angle between them.
    turned = 2 * np.arcsin(np.minimum(1.0, np.linalg.norm(R - frames[:, :3, :3], axis=(1, 2)) / np.sqrt(8)))
    return float((turned + np.linalg.norm(position - frames[:, :3, 3], axis=1)).max())


def _residual(robot: Robot, trajectory: AnyTrajectory, conserved: Array, t: Array, stated: list[Array]) -> float:
    """Compute the momentum of all links with Pinocchio, at times (r,), with the base as `base_state` says."""
    position, wxyz, velocity, omega = stated
    library, (model, at_q, at_v) = pinocchio(), free_base_model(robot)
    state, joints = free_base_data(robot), tree_of(robot).joints
    joint_state = trajectory.sample(t)
    q, v = np.zeros((len(t), model.nq)), np.zeros((len(t), model.nv))
    q[:, :3], q[:, 3:7], q[:, at_q] = position, wxyz[:, [1, 2, 3, 0]], joints.values(joint_state.q)
    R = matrix_by_parts(wxyz / np.linalg.norm(wxyz, axis=1)[:, None])
    v[:, :3], v[:, 3:6] = (velocity[:, None] @ R)[:, 0], omega
    v[:, at_v] = joint_state.dq[:, joints.dof] * joints.multiplier
    links = range(1, model.njoints)
    placed, moved = [state.oMi[i] for i in links], [state.v[i] for i in links]  # views: they change with the data
    totals, center = np.empty((len(t), 2, 3)), np.empty((len(t), 3))
    T, twist = np.empty((len(t), len(placed), 4, 4)), np.empty((len(t), len(placed), 6))
    for i, (row, rate) in enumerate(zip(q, v, strict=True)):
        total = library.computeCentroidalMomentum(model, state, row, rate)
        totals[i], center[i] = (total.linear, total.angular), state.com[0]
        T[i], twist[i] = [one.homogeneous for one in placed], [one.vector for one in moved]
    momentum = np.array([model.inertias[i].matrix() for i in links]) @ twist[..., None]  # about the links' origins
    linear, angular = (T[..., :3, :3] @ part for part in (momentum[..., :3, :], momentum[..., 3:, :]))
    away = T[..., :3, 3] - center[:, None]
    angular = angular[..., 0] + cross(away, linear[..., 0])
    missed = np.linalg.norm(totals - conserved, axis=2).max(axis=0)
    greatest = np.array([np.linalg.norm(of, axis=-1).max() for of in (linear[..., 0], angular)])
    scale = float(greatest.max())  # of both: the linear momentum of links that only rotate is rounding, and no scale
    return float(missed.max()) / scale if scale > 0 else (np.inf if missed.any() else 0.0)
