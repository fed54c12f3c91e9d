"""How well a trajectory's own account of its floating base keeps the total momentum, judged with Pinocchio."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from spacearm.momentum.turning import conjugate, multiplied
from spacearm.motion import AnyTrajectory
from spacearm.proof.masses import free_model
from spacearm.proof.middles import JointMap

Array = NDArray[np.float64]

_STENCIL = np.array([-3, -2, -1, 1, 2, 3]), np.array([-1, 9, -45, 45, -9, 1]) / 60  # a derivative, of sixth order
_STEP = 2e-3  # of the duration


class Residual(NamedTuple):
    """By how much the total momentum misses what is conserved, over time, (m,) each and relative to the greatest of a link.

    Attributes:
        linear: with the velocity that the trajectory states for its base.
        angular: about the system's centre of mass, with the rate that it states.
        of_poses: angular, with the rate that follows from the poses that it states, by differences; NaN near the ends.
    """

    linear: Array
    angular: Array
    of_poses: Array


def residual_momentum(trajectory: AnyTrajectory, t: Array) -> Residual:
    """Compare the momentum of a trajectory whose base floats with what it has to be.

    Args:
        trajectory: with masses.
        t: (m,) instants [s].
    """
    import pinocchio  # pyright: ignore[reportMissingImports]

    model, at_q, at_v = free_model(trajectory.robot)
    state, joints = model.createData(), JointMap(trajectory.robot)
    moved = trajectory.sample(t)
    position, wxyz = trajectory.base_pose(t)
    velocity, omega = trajectory.base_rate(t)
    q, v = np.zeros((len(t), model.nq)), np.zeros((len(t), model.nv))
    q[:, :3], q[:, 3:7], q[:, at_q] = position, wxyz[:, [1, 2, 3, 0]], joints.values(moved.q)
    v[:, at_v] = moved.dq[:, joints.dof] * joints.multiplier
    differenced = differenced_rates(trajectory, t)
    given = np.concatenate([trajectory.momentum.linear, trajectory.momentum.angular])
    missed, by_poses, links = np.empty((len(t), 6)), np.empty((len(t), 3)), np.empty((len(t), model.njoints - 1, 6))
    for i, (row, rate) in enumerate(zip(q, v, strict=True)):
        R = pinocchio.Quaternion(row[3:7]).toRotationMatrix()
        rate[:3] = R.T @ velocity[i]
        rate[3:6] = differenced[i]
        by_poses[i] = pinocchio.computeCentroidalMomentum(model, state, row, rate).angular - given[3:]
        rate[3:6] = omega[i]
        missed[i] = pinocchio.computeCentroidalMomentum(model, state, row, rate).vector - given
        for k in range(1, model.njoints):
            own = state.oMi[k].act(model.inertias[k] * state.v[k])  # about the world's origin
            links[i, k - 1, :3], links[i, k - 1, 3:] = own.linear, own.angular - np.cross(state.com[0], own.linear)
    linear, angular = (float(np.linalg.norm(links[..., part], axis=-1).max()) for part in (slice(0, 3), slice(3, 6)))
    return Residual(
        np.linalg.norm(missed[:, :3], axis=1) / (linear or 1.0),
        np.linalg.norm(missed[:, 3:], axis=1) / (angular or 1.0),
        np.linalg.norm(by_poses, axis=1) / (angular or 1.0),
    )


def differenced_rates(trajectory: AnyTrajectory, t: Array) -> Array:
    """Return how the base turns, (m, 3) in base axes [rad/s], by differences of its attitude; NaN too near to the ends."""
    step = _STEP * trajectory.duration
    at = t[:, None] + step * _STENCIL[0]  # (m, 6)
    middle, around = trajectory.base_pose(t)[1], trajectory.base_pose(at)[1]
    turns = multiplied(conjugate(middle)[:, None], around)
    turns *= np.where(turns[..., :1] < 0, -1.0, 1.0)
    # The rotation vector from the middle's attitude begins at 0, where its derivative is the rate itself.
    size = np.linalg.norm(turns[..., 1:], axis=-1, keepdims=True)
    vectors = turns[..., 1:] * np.where(size > 0, 2 * np.arctan2(size, turns[..., :1]) / np.where(size > 0, size, 1.0), 2.0)
    rates = np.einsum("k,mkc->mc", _STENCIL[1], vectors) / (step or 1.0)
    rates[(at[:, 0] < 0) | (at[:, -1] > trajectory.duration)] = np.nan
    return rates
