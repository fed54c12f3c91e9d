"""Momentum of base and arm, and how a floating base turns.

With r from the centre of mass of base and arm, and sums over all bodies,

    H_w = sum (I + m (|r|^2 E - r r^T)),    H_q = sum (I J_w + m [r]x (J_v - J_v_cm)),

the angular momentum about that centre is H_w omega + H_q dq in base axes. Without angular momentum the base turns by
omega = -H_w^-1 H_q dq (Umetani and Yoshida, Resolved motion rate control of space manipulators with generalized Jacobian
matrix, 1989). `moments` computes the blocks for any configurations. `moving` asks the kernel for what follows from them at
given rates, and is many times quicker. Both use the robot's masses lumped: links that are fixed to each other are one body.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm.core.brief import Brief
from spacearm.core.checks import Frozen, as_numbers, as_readonly, keep
from spacearm.core.errors import ProblemError, RobotError
from spacearm.core.exact import cross, product, solved3
from spacearm.core.identity_cache import cached_by_identity
from spacearm.core.native import native
from spacearm.core.rotations import as_unit, matrix_of
from spacearm.robot import Robot, joint_frames
from spacearm.robot.inertias import INERTIA_ROUNDING, inertia_fault
from spacearm.robot.kinematics import kernel_joints
from spacearm.robot.model import require_robot
from spacearm.robot.unchecked_pairs import require_all_masses

Array = NDArray[np.float64]

_AT_ONCE = 1024  # configurations at once, so that their frames and sums fit into the cache
_GREATEST = 1e15  # [kg, kg m, kg m^2] of greater masses float64 keeps no useful digits
_SLACK = 0.01  # relative: rounded published moments of inertia may miss the triangle inequality by this
_ADVICE = "run `spacearm doctor` on its model"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class Momentum(Frozen):
    """The total momentum of base and arm, which is constant while no force acts; inertial frame.

    Attributes:
        linear: (3,) [N s].
        angular: (3,) about the system's centre of mass [N m s].

    Raises:
        ProblemError: not three finite numbers.
    """

    linear: Array = None  # type: ignore[assignment]  # filled in below
    angular: Array = None  # type: ignore[assignment]

    if TYPE_CHECKING:

        def __init__(self, *, linear: ArrayLike = (0.0, 0.0, 0.0), angular: ArrayLike = (0.0, 0.0, 0.0)) -> None: ...

    def __post_init__(self) -> None:
        for name in ("linear", "angular"):
            given = getattr(self, name)
            keep(self, **{name: as_readonly(f"momentum.{name}", np.zeros(3) if given is None else given, (3,), ProblemError)})

    @property
    def is_zero(self) -> bool:
        """Whether the spacecraft neither drifts nor tumbles."""
        return not (self.linear.any() or self.angular.any())


class Moments(NamedTuple):
    """Moments of a robot's masses, in base axes.

    Attributes:
        center: (..., 3) centre of mass of base and arm [m].
        H_w: (..., 3, 3) inertia of the whole about it [kg m^2].
        H_q: (..., 3, n) angular momentum about it for each joint's unit rate, the base at rest [kg m^2 or kg m].
        J_c: (..., 3, n) velocity of the centre for each joint's unit rate, the base at rest [m or -].
    """

    center: Array
    H_w: Array
    H_q: Array
    J_c: Array


def moments(robot: Robot, q: ArrayLike) -> Moments:
    """Return the moments of a robot's masses.

    Args:
        robot: with n degrees of freedom; any tree, sliding joints and joints that follow others included.
        q: (..., n) configurations [rad or m].

    Raises:
        RobotError: masses that cannot be, or q does not fit the robot.
    """
    require_robot(robot)
    masses = lumped_masses(robot)
    frames = joint_frames(robot, q)  # (..., j, 4, 4)
    rows = frames.reshape(-1, *frames.shape[-3:])
    parts = [moments_of_frames(masses, rows[i : i + _AT_ONCE]) for i in range(0, max(len(rows), 1), _AT_ONCE)]
    joined = parts[0] if len(parts) == 1 else (np.concatenate(values) for values in zip(*parts, strict=True))
    return Moments(*(values.reshape(*frames.shape[:-3], *values.shape[1:]) for values in joined))


def momentum_map(robot: Robot, q: ArrayLike) -> tuple[Array, Array]:
    """Return H_w (..., 3, 3) and H_q (..., 3, n): the angular momentum about the system's centre of mass is their sum.

    H_w omega + H_q dq, in base axes [N m s], for the base's rate omega in base axes [rad/s].

    Args:
        robot: with n degrees of freedom.
        q: (..., n) configurations [rad or m].

    Raises:
        RobotError: masses that cannot be, or q does not fit the robot.
    """
    found = moments(robot, q)
    return found.H_w, found.H_q


def base_rate(robot: Robot, q: ArrayLike, dq: ArrayLike) -> Array:
    """Return how a floating base turns when the whole has no angular momentum, (..., 3) [rad/s], base axes.

    Args:
        robot: with n degrees of freedom.
        q, dq: (..., n) configurations and rates [rad or m, per s].

    Raises:
        RobotError: masses that cannot be, or q or dq does not fit the robot.
    """
    require_robot(robot)
    rates = as_numbers("dq", dq, RobotError)
    if rates.ndim == 0 or rates.shape[-1] != robot.dof:
        raise RobotError(f"dq has shape {rates.shape}, expected (..., {robot.dof}): one rate for each joint")
    found = moments(robot, q)
    return free_rate(found, rates)


def free_rate(found: Moments, dq: Array) -> Array:
    """Return -H_w^-1 H_q dq, (..., 3)."""
    return -solved3(found.H_w, product(found.H_q, dq[..., None])[..., 0])


def center_of_mass(robot: Robot, q: ArrayLike) -> Array:
    """Return the centre of mass of base and arm, (..., 3), base frame [m].

    Args:
        robot: with n degrees of freedom.
        q: (..., n) configurations [rad or m].

    Raises:
        RobotError: masses that cannot be, or q does not fit the robot.
    """
    return moments(robot, q).center


def system_mass(robot: Robot) -> float:
    """Return the mass of base and arm [kg]."""
    require_robot(robot)
    return float(sum(body.mass for body in robot.bodies))


def base_at_mass_center(robot: Robot, q: ArrayLike, attitude_wxyz: ArrayLike = (1.0, 0.0, 0.0, 0.0)) -> Array:
    """Return where the base is, T_w_b (4, 4), if the inertial origin is the centre of mass of base and arm [m].

    Args:
        robot: with n degrees of freedom.
        q: (n,) configuration [rad or m].
        attitude_wxyz: (4,) of the base; any length above 0.

    Raises:
        RobotError: masses that cannot be, q does not fit the robot, or an attitude that is none.
    """
    center = center_of_mass(robot, q)
    if center.shape != (3,):
        raise RobotError(f"q has shape {np.shape(q)}, expected ({robot.dof},): one configuration")
    T = np.eye(4)
    T[:3, :3] = matrix_of(as_unit("attitude_wxyz", attitude_wxyz))
    T[:3, 3] = -product(T[:3, :3], center)
    return T


class Moving(NamedTuple):
    """The momentum of m configurations whose joints move while the base rests, in base axes.

    Attributes:
        center: (m, 3) centre of mass of base and arm [m].
        center_rate: (m, 3) velocity of that centre [m].
        arm: (m, 3) angular momentum of the arm about it [kg m^2].
        H_w: (m, 3, 3) inertia of the whole about it [kg m^2].
        free_rate: (m, 3) rate of a floating base without angular momentum [rad].
    """

    center: Array
    center_rate: Array
    arm: Array
    H_w: Array
    free_rate: Array


def moving(robot: Robot, q: Array, dq: Array) -> Moving:
    """Return the momentum of a robot whose masses have been checked.

    Args:
        robot: with n degrees of freedom.
        q, dq: (m, n) configurations and rates, per whatever they are per.
    """
    rows = _model(robot).momentum_terms(np.ascontiguousarray(q), np.ascontiguousarray(dq))
    H_w = rows[:, [6, 9, 10, 9, 7, 11, 10, 11, 8]].reshape(-1, 3, 3)
    return Moving(rows[:, :3], rows[:, 15:], rows[:, 3:6], H_w, rows[:, 12:15])


def moments_of_frames(masses: Masses, frames: Array) -> Moments:
    """Return the moments of a robot's masses by its joints' moving frames.

    Args:
        masses: of the robot.
        frames: (m, j, 4, 4) T_base_joint [m].
    """
    count = len(masses.pseudo)
    placed = np.empty((len(frames), count, 4, 4))
    placed[:, 0] = masses.pseudo[0]
    placed[:, 1:] = product(product(frames, masses.pseudo[1:]), frames.swapaxes(-1, -2))  # about the base's origin
    carried = product(masses.outward, placed.reshape(-1, count, 16)).reshape(placed.shape)  # the whole, then by each joint
    mass = product(masses.outward, masses.pseudo[:, 3, 3])
    center = carried[:, 0, :3, 3] / mass[0]
    # Sums of m r r^T and m r about the system's centre of mass; of the whole the latter is 0.
    first = carried[..., :3, 3] - mass[:, None] * center[:, None]
    second = carried[..., :3, :3] - carried[..., :3, 3, None] * center[:, None, None]
    second -= center[:, None, :, None] * first[..., None, :]
    inertia = -second
    inertia[..., range(3), range(3)] += np.trace(second, axis1=-2, axis2=-1)[..., None]

    turning = masses.turning[:, None]
    axis, away = frames[..., :3, 2], frames[..., :3, 3] - center[:, None]
    # A joint's twist moves the point r by v + a x r; a revolute one's axis stays where it is.
    velocity = np.where(turning, cross(away, axis), axis)
    axis = np.where(turning, axis, 0.0)
    linear = mass[1:, None] * velocity + cross(axis, first[:, 1:])
    angular = cross(first[:, 1:], velocity) + product(inertia[:, 1:], axis[..., None])[..., 0]
    return Moments(
        center,
        inertia[:, 0],
        product(angular.swapaxes(1, 2), masses.shares),
        product(linear.swapaxes(1, 2), masses.shares) / mass[0],
    )


@dataclass(frozen=True, slots=True, repr=False)
class Masses(Brief):
    """The masses of a robot: one rigid body for the base, then one for each joint.

    Attributes:
        pseudo: (1 + j, 4, 4) sums of m [x; 1][x; 1]^T over each body in its moving frame: the second moments, the first, and
            the mass. Turning and moving a body is T P T^T, and bodies are joined by adding.
        outward: (1 + j, 1 + j) 1 where the column's body is carried by the row's joint, itself included.
        shares: (j, n) how each joint moves for a unit rate of each degree of freedom.
        turning: (j,) whether a joint turns rather than slides.
    """

    pseudo: Array
    outward: Array
    shares: Array
    turning: NDArray[np.bool_]


@lru_cache(maxsize=32)
def lumped_masses(robot: Robot) -> Masses:
    """Return the masses of a robot's bodies, one for the base and one for each joint.

    Raises:
        RobotError: masses of which nothing that floats can be made.
    """
    count, pseudo = 1 + len(robot.joints), _pseudo_inertias(robot)
    outward = np.eye(count)
    for child in range(count - 1, 0, -1):  # parents come before children
        outward[1 + robot.joints[child - 1].parent] += outward[child]
    shares = np.zeros((count - 1, robot.dof))
    for i, joint in enumerate(robot.joints):
        shares[i, joint.dof] = joint.multiplier
    _require_possible(robot, pseudo)
    require_all_masses(robot)
    masses = Masses(pseudo, outward, shares, np.array([joint.kind == "revolute" for joint in robot.joints]))
    for array in (masses.pseudo, masses.outward, masses.shares, masses.turning):
        array.setflags(write=False)
    return masses


def require_masses(robot: Robot) -> None:
    """Check that a robot can float: its base has a mass and an inertia, and no body has an impossible one.

    Raises:
        RobotError: it cannot.
    """
    require_robot(robot)
    lumped_masses(robot)


def require_possible_masses(robot: Robot) -> None:
    """Refuse masses with which no base can float. Links of unknown mass are passed over; `require_masses` refuses them.

    Raises:
        RobotError: no masses, a base without one, or some that no body has.
    """
    require_robot(robot)
    _are_possible(robot)


@cached_by_identity
def _are_possible(robot: Robot) -> bool:
    """Refuse masses with which no base can float, once for a robot: every trajectory of it asks."""
    _require_possible(robot, _pseudo_inertias(robot))
    return True


class LinkMasses(NamedTuple):
    """The masses of a robot: of the base, then of the body of each joint; j joints.

    Attributes:
        mass: (1 + j,) [kg].
        com: (1 + j, 3) centres of mass in the joint's frame [m].
        inertia: (1 + j, 6) about them: xx, yy, zz, xy, xz, yz [kg m^2].
    """

    mass: Array
    com: Array
    inertia: Array


def link_masses(robot: Robot) -> LinkMasses:
    """Return the masses of a robot as the kernel takes them."""
    pseudo = lumped_masses(robot).pseudo
    mass = pseudo[:, 3, 3]
    com = pseudo[:, :3, 3] / np.where(mass > 0, mass, 1.0)[:, None]
    second = pseudo[:, :3, :3] - mass[:, None, None] * com[:, :, None] * com[:, None, :]
    inertia = np.trace(second, axis1=1, axis2=2)[:, None, None] * np.eye(3) - second
    return LinkMasses(mass.copy(), com, inertia[:, [0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]].copy())


@cached_by_identity
def kernel_masses(robot: Robot) -> native.Masses:
    """Return the masses of a robot as the kernel's own object."""
    masses = link_masses(robot)
    return native.Masses(mass=masses.mass, com=masses.com, inertia=masses.inertia)


@lru_cache(maxsize=32)
def _model(robot: Robot) -> native.Model64:
    return native.Model64(native.World(joints=kernel_joints(robot), masses=kernel_masses(robot)))


def _pseudo_inertias(robot: Robot) -> Array:
    """Return the pseudo-inertias of the base and of the body of each joint, (1 + j, 4, 4).

    Raises:
        RobotError: numbers beyond measure.
    """
    pseudo = np.zeros((1 + len(robot.joints), 4, 4))
    for body in robot.bodies:
        with np.errstate(over="ignore", invalid="ignore"):
            own = _pseudo_inertia(body.mass, body.com, body.inertia)
        if not (np.abs(own) < _GREATEST).all():
            raise RobotError(
                f"robot '{robot.name}' cannot float: body '{body.name}' has a mass of {body.mass:.4g} kg at "
                f"{body.com.tolist()} m and moments of inertia up to {np.abs(body.inertia).max():.4g} kg m^2, which is beyond "
                f"measure, expected all below {_GREATEST:g}; {_ADVICE}"
            )
        pseudo[1 + body.joint] += own
    return pseudo


def _require_possible(robot: Robot, lumped: Array) -> None:
    what = f"robot '{robot.name}' cannot float:"
    if not robot.bodies:
        raise RobotError(f"{what} its model states no masses, expected some for the base and the links; {_ADVICE}")
    for i, pseudo in enumerate(lumped):
        mass, where = pseudo[3, 3], "the base" if i == 0 else f"what joint '{robot.joints[i - 1].name}' moves"
        if mass == 0:
            if i == 0:
                raise RobotError(f"{what} its base has no mass, expected one above 0 kg; {_ADVICE}")
            if not pseudo.any():
                continue
            raise RobotError(f"{what} {where} has an inertia but no mass, expected both; {_ADVICE}")
        second = pseudo[:3, :3] - np.outer(pseudo[:3, 3], pseudo[:3, 3]) / mass  # about the centre of mass
        inertia, scale = np.trace(second) * np.eye(3) - second, float(np.trace(pseudo[:3, :3]))
        principal = np.linalg.eigvalsh(inertia)
        rounding = INERTIA_ROUNDING * max(float(np.abs(principal).max()), scale)
        least, middle, most = np.where(np.abs(principal) > rounding, principal, 0.0)
        shown = f"principal moments of inertia {least:.4g}, {middle:.4g} and {most:.4g} kg m^2"
        if inertia_fault(inertia, scale=scale) == "negative" or (i == 0 and least == 0):
            raise RobotError(f"{what} {where} has {shown}, expected them above 0; {_ADVICE}")
        if inertia_fault(inertia, rounding=_SLACK) == "triangle":
            raise RobotError(f"{what} {where} has {shown}, expected none above the sum of the others; {_ADVICE}")


def _pseudo_inertia(mass: float, com: Array, inertia: Array) -> Array:
    out = np.empty((4, 4))
    out[:3, :3] = np.trace(inertia) / 2 * np.eye(3) - inertia + mass * np.outer(com, com)
    out[:3, 3] = out[3, :3] = mass * com
    out[3, 3] = mass
    return out
