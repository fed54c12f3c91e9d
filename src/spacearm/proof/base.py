"""Where the base is along a trajectory, and so where all links are in the inertial frame, in which the obstacles rest."""

from __future__ import annotations

from collections import deque

import numpy as np
from numpy.typing import NDArray

from spacearm.motion import AnyTrajectory, Curve, Motion, PiecewisePath, TimeLaw, Trajectory
from spacearm.motion.timelaw import over_time
from spacearm.proof.base_limits import BaseFigures
from spacearm.proof.bodies import floating_bodies_of
from spacearm.proof.drift import Drift
from spacearm.proof.masses import masses_of
from spacearm.proof.middles import JointMap
from spacearm.proof.recoil import Reaction
from spacearm.proof.stance import Stance
from spacearm.proof.witness import Witness
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
        self.drift = _drift_of(self._robot, self.curve, self.stance, time_rate=time_rate)
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

    def figures(self) -> BaseFigures:
        """Return by how much a floating base is disturbed; bounds for every t."""
        assert self.drift is not None
        begin, end = self.curve.domain
        rate = momentum = 0.0
        if self._trajectory.duration > 0:
            drift, speed = self.drift, (end - begin) / self._trajectory.duration
            law = self._trajectory.time_law if isinstance(self._trajectory, Trajectory) else None
            if law is not None and self.curve is self._trajectory.curve:  # how fast it goes along the path is the law's to say
                assert isinstance(self._trajectory, Trajectory)
                drift = _drift_of(self._robot, _share_path(self._trajectory.motion, law), self.stance, time_rate=0.0)
                speed = 1 / self._trajectory.duration
            rate, momentum = drift.rate() * speed, drift.joint_momentum() * speed
        return BaseFigures(
            error=self.drift.error, final=self.drift.final(), peak=self.drift.peak(), rate=rate, joint_momentum=momentum
        )

    def at_end(self) -> Array:
        """Return T_w_b (4, 4) of a floating base in the end; its attitude may be off by the drift's error."""
        u = np.array(self.curve.domain[1:])
        return self.placed(u, self._link_frames(u))[0, -1]

    def center_at_end(self) -> Array:
        """Return the system's centre of mass (3,) in the end, inertial frame [m]."""
        begin, end = self.curve.domain
        return self._center + (end - begin) * self._velocity

    def _link_frames(self, u: Array) -> Array:
        """Return T_b_joint (r, j + 1, 4, 4)."""
        witness = Witness(self._robot, floating_bodies_of(self._robot)[0])
        return witness.frames(JointMap(self._robot).values(self.curve.sample(u)))

    def _center_of(self, frames: Array) -> Array:
        """Return the system's centre of mass (r, 3) in the frames' frame."""
        at = frames[:, self._masses.joint]
        com = np.einsum("rbcd,bd->rbc", at[..., :3, :3], self._masses.com) + at[..., :3, 3]
        return np.einsum("b,rbc->rc", self._masses.mass, com) / self._masses.total


def floating_base_of(robot: Robot, trajectory: AnyTrajectory, stance: Stance) -> Base:
    """Return a floating base with its motion integrated, for what is not about clearance.

    Raises:
        RobotError: the robot's masses cannot be.
        ProblemError: it tumbles too often.
    """
    base = Base(robot, trajectory, stance)
    base.begin(base._link_frames(np.array(base.curve.domain[:1]))[0])
    return base


_SHARE_PATHS: deque[tuple[Motion, TimeLaw, PiecewisePath]] = deque(maxlen=4)


def _share_path(motion: Motion, law: TimeLaw) -> PiecewisePath:
    """Return the path over the share of the duration; the same one if the same motion and law were seen lately."""
    for seen, with_law, made in list(_SHARE_PATHS):
        if seen is motion and with_law is law:
            return made
    made = over_time(motion, law, 1.0)
    _SHARE_PATHS.append((motion, law, made))
    return made


_SEEN: deque[tuple[Robot, Curve, bytes, Drift]] = deque(maxlen=4)
_MOST_KEPT = 5_000  # evaluations


def _drift_of(robot: Robot, curve: Curve, stance: Stance, *, time_rate: float) -> Drift:
    """Return a `Drift`; the same one if the same robot and curve were asked about lately, in whatever time without momentum."""
    key = stance.start.tobytes() + (stance.angular * time_rate).tobytes()
    for seen, path, given, made in list(_SEEN):
        if seen is robot and path is curve and given == key:
            return made
    made = Drift(robot, curve, stance, time_rate=time_rate)
    if made.evaluations <= _MOST_KEPT:
        _SEEN.append((robot, curve, key, made))
    return made
