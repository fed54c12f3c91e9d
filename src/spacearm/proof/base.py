"""Where the base is along a trajectory, and so where all links are in the inertial frame, in which the obstacles rest."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from spacearm.motion import AnyTrajectory, Curve, Trajectory
from spacearm.proof.drift import Drift
from spacearm.proof.masses import masses_of
from spacearm.proof.recoil import Reaction
from spacearm.proof.stance import Stance
from spacearm.robot import Robot

Array = NDArray[np.float64]


class Base:
    """A base that is held, or that floats, along a trajectory.

    Attributes:
        stance: how it is held.
        curve: the joints' path that is to be proven: the trajectory's own, and over time where the base tumbles by itself.
        drift: where it turns to; None if it is fixed.
        reaction: how it gives way on a stretch; None if it is fixed.
    """

    def __init__(self, robot: Robot, trajectory: AnyTrajectory, stance: Stance) -> None:
        """Choose the curve; nothing is computed before `begin`."""
        self.stance, self._robot, self._trajectory = stance, robot, trajectory
        self.curve: Curve = trajectory.curve
        self.drift: Drift | None = None
        self.reaction: Reaction | None = None
        law = trajectory.time_law if isinstance(trajectory, Trajectory) else None
        if stance.tumbling and law is not None and trajectory.duration > 0:
            self.curve = trajectory.path

    def begin(self, frames: Array) -> None:
        """Integrate the motion.

        Args:
            frames: (j + 1, 4, 4) T_b_joint at the beginning, the last the base itself.

        Raises:
            RobotError: it floats, and the robot's masses cannot be.
            ProblemError: it tumbles too often.
        """
        if not self.stance.floating:
            return
        begin, end = self.curve.domain
        time_rate = self._trajectory.duration / (end - begin)
        self._masses, self._begin = masses_of(self._robot), begin
        self.drift = Drift(self._robot, self.curve, self.stance, time_rate=time_rate)
        linear, angular = self.stance.linear, self.stance.angular
        self.reaction = Reaction(self._robot, linear=linear, angular=angular, time_rate=time_rate, off=self.drift.error)
        self._velocity = linear * time_rate / self._masses.total
        start = self.stance.start
        self._center = start[:3, :3] @ self._center_of(frames[None])[0] + start[:3, 3]

    def placed(self, u: Array, frames: Array) -> Array:
        """Place links in the inertial frame.

        Args:
            u: (r,) parameters of the curve.
            frames: (r, j + 1, 4, 4) T_b_joint there, the last the base itself.

        Returns:
            T_w_joint, of the same shape.
        """
        if self.drift is None:
            return frames if self.stance.at_origin else self.stance.start @ frames
        T = np.zeros((len(u), 1, 4, 4))
        T[:, 0, :3, :3] = self.drift.attitude(u)
        T[:, 0, 3, 3] = 1.0
        center = self._center + (u - self._begin)[:, None] * self._velocity
        T[:, 0, :3, 3] = center - np.einsum("rcd,rd->rc", T[:, 0, :3, :3], self._center_of(frames))
        return T @ frames

    def own_parameter(self, u: float) -> float:
        """Return the parameter of the trajectory's own curve."""
        if self.curve is self._trajectory.curve:
            return u
        assert isinstance(self._trajectory, Trajectory)
        assert self._trajectory.time_law is not None
        return float(self._trajectory.time_law.sample(u / self._trajectory.duration))

    def time_at(self, u: Array) -> Array:
        """Return when parameters (r,) of the curve are reached, (r,) [s].

        Where the curve goes by time that is the time itself: the place on the path does not tell it where the arm dwells.
        """
        at = np.asarray(u, dtype=np.float64)
        return self._trajectory.time_at(at) if self.curve is self._trajectory.curve else at

    def _center_of(self, frames: Array) -> Array:
        """Return the system's centre of mass (r, 3) in the frames' frame."""
        at = frames[:, self._masses.joint]
        com = np.einsum("rbcd,bd->rbc", at[..., :3, :3], self._masses.com) + at[..., :3, 3]
        return np.einsum("b,rbc->rc", self._masses.mass, com) / self._masses.total
