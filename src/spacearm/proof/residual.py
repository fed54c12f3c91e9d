"""Whether the base motion that a trajectory states conserves momentum, and is the one that was proven."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from spacearm.motion import AnyTrajectory
from spacearm.proof.masses import free_model
from spacearm.proof.middles import JointMap
from spacearm.proof.quaternions import rotation
from spacearm.proof.vectors import cross
from spacearm.robot import Robot

Array = NDArray[np.float64]

_INSTANTS = 1025  # compared at most; of many more panels every second, third, ... end
_RESIDUALS = 33  # of these, at which momentum is added up


class StatedBaseErrors(NamedTuple):
    """By how much the base motion that a trajectory states is wrong.

    Attributes:
        residual: what its momentum misses of what was given, at most, relative to the greatest of any link; linear [N s] and
            angular [N m s] by one scale, as at 1 m from the centre of mass.
        elsewhere: how far the base is from where it has to be, at most: angle [rad] plus distance [m].
    """

    residual: float
    elsewhere: float


def some_of(instants: Array) -> Array:
    """Return the instants that are compared, of those that the proof's integration has, at most 1,025."""
    return instants[np.unique(np.linspace(0, len(instants) - 1, min(len(instants), _INSTANTS)).astype(np.intp))]


def stated_base_errors(
    robot: Robot, trajectory: AnyTrajectory, t: Array, frames: Array, *, linear: Array, angular: Array
) -> StatedBaseErrors:
    """Compare what a trajectory states of its base with the proof, at instants; the proof itself does not rest on that.

    Args:
        robot: with masses.
        trajectory: with `base_pose` and `base_rate`.
        t: (r,) instants [s].
        frames: (r, 4, 4) T_w_b of the proof there.
        linear, angular: (3,) the momentum that is conserved [N s, N m s].
    """
    position, wxyz = trajectory.base_pose(t)
    elsewhere = stated_elsewhere(position, wxyz, frames)
    some = np.unique(np.linspace(0, len(t) - 1, min(len(t), _RESIDUALS)).astype(np.intp))
    conserved = np.array([linear, angular])
    return StatedBaseErrors(_residual(robot, trajectory, conserved, t[some], position[some], wxyz[some]), elsewhere)


def stated_elsewhere(position: Array, wxyz: Array, frames: Array) -> float:
    """Return how far stated poses (r, 3), (r, 4) are from frames (r, 4, 4), at most: angle [rad] plus distance [m]."""
    R = rotation(wxyz / np.linalg.norm(wxyz, axis=1)[:, None])
    # Of a rotation by the angle x the difference's Frobenius norm is root 8 times sin x/2.
    turned = 2 * np.arcsin(np.minimum(1.0, np.linalg.norm(R - frames[:, :3, :3], axis=(1, 2)) / np.sqrt(8)))
    return float((turned + np.linalg.norm(position - frames[:, :3, 3], axis=1)).max())


def _residual(robot: Robot, trajectory: AnyTrajectory, conserved: Array, t: Array, position: Array, wxyz: Array) -> float:
    """Add up the momentum of all links, by Pinocchio, at times (r,) and with the base where the trajectory says."""
    import pinocchio  # pyright: ignore[reportMissingImports]

    model, at_q, at_v = free_model(robot)
    state, joints = model.createData(), JointMap(robot)
    joint_state = trajectory.sample(t)
    velocity, omega = trajectory.base_rate(t)
    q, v = np.zeros((len(t), model.nq)), np.zeros((len(t), model.nv))
    q[:, :3], q[:, 3:7], q[:, at_q] = position, wxyz[:, [1, 2, 3, 0]], joints.values(joint_state.q)
    v[:, 3:6], v[:, at_v] = omega, joint_state.dq[:, joints.dof] * joints.multiplier
    bodies = range(1, model.njoints)
    totals, linear, angular = np.empty((len(t), 2, 3)), np.empty((len(t), len(bodies), 3)), np.empty((len(t), len(bodies), 3))
    center = np.empty((len(t), 3))
    for i, (row, rate, moved) in enumerate(zip(q, v, velocity, strict=True)):
        rate[:3] = pinocchio.Quaternion(row[3:7]).toRotationMatrix().T @ moved
        total = pinocchio.computeCentroidalMomentum(model, state, row, rate)
        totals[i], center[i] = (total.linear, total.angular), state.com[0]
        for k in bodies:
            own = state.oMi[k].act(model.inertias[k] * state.v[k])  # about the world's origin
            linear[i, k - 1], angular[i, k - 1] = own.linear, own.angular
    angular -= cross(center[:, None], linear)
    missed = np.linalg.norm(totals - conserved, axis=2).max(axis=0)
    greatest = np.array([np.linalg.norm(of, axis=2).max() for of in (linear, angular)])
    scale = float(greatest.max())  # of both, per metre: where links only turn, their linear momentum is all rounding
    return float(missed.max()) / scale if scale > 0 else (np.inf if missed.any() else 0.0)
