"""Momentum by blocks: how base rate and joint rates make up a spacecraft's angular momentum.

With r from the system's centre of mass and sums over base and links,

    H_w = sum (I + m (|r|^2 E - r r^T)),    H_q = sum (I J_w + m [r]x (J_v - J_v_cm)),

the angular momentum about that centre is H_w omega + H_q dq in base axes; without any the base turns by
omega = -H_w^-1 H_q dq. Umetani and Yoshida, Resolved motion rate control of space manipulators with generalized Jacobian
matrix, 1989. Sums over the links that a joint carries are taken once, for all joints that carry them.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm._kernel.exact import product, solved3
from spacearm.checks import as_numbers
from spacearm.errors import RobotError
from spacearm.momentum.masses import Masses, lumped_masses
from spacearm.momentum.turning import as_unit, cross, matrix_of
from spacearm.robot import Robot, joint_frames
from spacearm.robot.model import require_robot

Array = NDArray[np.float64]

_AT_ONCE = 1024  # configurations whose frames and sums fit into the cache together


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
