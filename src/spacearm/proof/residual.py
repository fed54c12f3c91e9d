"""Whether a trajectory's own account of its base conserves momentum, and says where the proof says that the base is."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from spacearm.motion import AnyTrajectory
from spacearm.proof.base import Base
from spacearm.proof.masses import free_model
from spacearm.proof.middles import JointMap
from spacearm.proof.quaternions import rotation
from spacearm.proof.vectors import cross
from spacearm.robot import Robot

Array = NDArray[np.float64]

CONSERVED = 1e-6
"""The greatest residual momentum that is taken for rounding, relative to the greatest momentum of a link."""

SAME = 1e-6
"""[m] by which no point of the base within 1 m of its origin may be elsewhere than the proof says."""

_INSTANTS = 1025  # at most; a motion of many more panels is compared at every second, third, ... end
_RESIDUALS = 33  # of these, at which momentum is added up


class Account(NamedTuple):
    """What a trajectory says of its floating base, compared.

    Attributes:
        residual: what its momentum misses of what was given, at most, relative to the greatest of any link; linear [N s] and
            angular [N m s] by one scale, as at 1 m from the centre of mass.
        elsewhere: how far the base is from where it has to be, at most: angle [rad] plus distance [m].
    """

    residual: float
    elsewhere: float


def instants_of(base: Base) -> Array:
    """Return the parameters of the base's curve that are compared: where panels of its integration begin, and their middles."""
    assert base.drift is not None
    every = base.drift.instants
    return every[np.unique(np.linspace(0, len(every) - 1, min(len(every), _INSTANTS)).astype(np.intp))]


def account_of(robot: Robot, trajectory: AnyTrajectory, base: Base, u: Array, frames: Array) -> Account:
    """Compare at instants what a trajectory tells; the proof itself does not rest on that.

    Args:
        robot: with masses.
        trajectory: with `base_pose` and `base_rate`.
        base: where the proof has it.
        u: (r,) parameters of the curve, as `instants_of` gives them.
        frames: (r, 4, 4) T_w_b of the proof there.
    """
    t = base.time_at(u)
    position, wxyz = trajectory.base_pose(t)
    R = rotation(wxyz / np.linalg.norm(wxyz, axis=1)[:, None])
    # Of a rotation by the angle x the difference's Frobenius norm is root 8 times sin x/2.
    turned = 2 * np.arcsin(np.minimum(1.0, np.linalg.norm(R - frames[:, :3, :3], axis=(1, 2)) / np.sqrt(8)))
    elsewhere = float((turned + np.linalg.norm(position - frames[:, :3, 3], axis=1)).max())
    some = np.unique(np.linspace(0, len(t) - 1, min(len(t), _RESIDUALS)).astype(np.intp))
    return Account(_residual(robot, trajectory, base, t[some], position[some], wxyz[some]), elsewhere)


def _residual(robot: Robot, trajectory: AnyTrajectory, base: Base, t: Array, position: Array, wxyz: Array) -> float:
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
    missed = np.linalg.norm(totals - [base.stance.linear, base.stance.angular], axis=2).max(axis=0)
    greatest = np.array([np.linalg.norm(of, axis=2).max() for of in (linear, angular)])
    scale = float(greatest.max())  # of both, per metre: where links only turn, their linear momentum is all rounding
    return float(missed.max()) / scale if scale > 0 else (np.inf if missed.any() else 0.0)
