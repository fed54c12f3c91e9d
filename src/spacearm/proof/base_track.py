"""What a proof knows of a base along a trajectory: one class for each base model, found by the model's name.

A base proof places the links in the inertial frame, in which the obstacles rest, bounds how the base moves on a stretch, and
says what is found about it. It rests on the robot, the joints' path and the base setup alone, and on Pinocchio: on nothing that
the trajectory or the search says of the base.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from spacearm.core.errors import ProblemError
from spacearm.core.rotations import cross
from spacearm.motion import AnyTrajectory, Curve, Motion, PiecewisePath, TimeLaw, Trajectory
from spacearm.motion.time_laws import over_time
from spacearm.proof.base_attitude import Drift
from spacearm.proof.base_setup import BaseFigures, BaseFindings, BaseSetup, HasBaseLimits, asked, exceeded
from spacearm.proof.displacement import BaseMotionBounds, JointMap, Reaction
from spacearm.proof.moving_bodies import Bodies, RelativeBodies, bodies_in_space_of, bodies_of, free_model, masses_of
from spacearm.proof.quaternions import rotation
from spacearm.proof.witness import Witness
from spacearm.robot import Robot

# ---- Whether the base motion that a trajectory states conserves momentum, and is the one that was proven -------------

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


# ---- -----------------------------------------------------------------------------------------------------------------
# What a proof knows of a base along a trajectory: one class for each base model, found by the model's name.


FramesAt = Callable[[Array], Array]
"""Takes parameters (r,) of the curve, gives T_w_joint (r, j + 1, 4, 4); the last is the base itself."""


class BaseProof(ABC):
    """A base along a trajectory, as the proof has it.

    Attributes:
        robot, trajectory, setup: what it is about.
        curve: the joints' path that is to be proven: the trajectory's own, or over time where the base moves by itself.
    """

    robot: Robot
    trajectory: AnyTrajectory
    setup: BaseSetup
    curve: Curve

    @abstractmethod
    def bodies(self) -> tuple[Bodies, RelativeBodies]:
        """Return the robot's bodies, and what moves relative to what; see `RelativeBodies.free`."""

    @abstractmethod
    def begin(self, frames: Array) -> None:
        """Find out where the base goes, before anything else is asked.

        Args:
            frames: (j + 1, 4, 4) T_b_joint at the beginning, the last the base itself.

        Raises:
            RobotError: masses that cannot be.
            ProblemError: it tumbles too often.
        """

    @abstractmethod
    def placed(self, u: Array, frames: Array) -> Array:
        """Place links in the inertial frame.

        Args:
            u: (r,) parameters of the curve.
            frames: (r, j + 1, 4, 4) T_b_joint there, the last the base itself.

        Returns:
            T_w_joint, of the same shape.
        """

    @abstractmethod
    def motion_bounds(self, frames: Array, rate: Array, drift: Array, step: Array, half: Array) -> BaseMotionBounds | None:
        """Bound the base's motion on r stretches, first and second order; None: it stays.

        Args:
            frames: (r, j + 1, 4, 4) T_w_joint at the middles; the last is the base.
            rate, drift: (r, j) of the joints' values per unit of u, and how far these stray from the line.
            step: (r, j) how far they get from the middle's.
            half: (r,) half the stretches' lengths in u.
        """

    @abstractmethod
    def findings(self, limits: HasBaseLimits | None, frames_at: FramesAt) -> BaseFindings | None:
        """Return what is found about the base, and the limits that are not kept; None: there is nothing to say."""

    @abstractmethod
    def figures(self) -> BaseFigures:
        """Return by how much the base is disturbed; bounds for every t."""

    @abstractmethod
    def at_end(self) -> Array:
        """Return T_w_b (4, 4) in the end; its attitude may be off by the figures' error."""

    @abstractmethod
    def turns_about_at_end(self) -> Array:
        """Return the point (3,) about which an error of the attitude turns all links in the end, inertial frame [m]."""


class FixedBaseProof(BaseProof):
    """A base that stays."""

    def __init__(self, robot: Robot, trajectory: AnyTrajectory, setup: BaseSetup) -> None:
        self.robot, self.trajectory, self.setup = robot, trajectory, setup
        self.curve = trajectory.curve
        self._start = None if setup.at_origin else setup.start

    def bodies(self) -> tuple[Bodies, RelativeBodies]:
        """Return bodies that are watched from the base."""
        return bodies_of(self.robot)

    def begin(self, frames: Array) -> None:
        """Do nothing: all is known."""

    def placed(self, u: Array, frames: Array) -> Array:
        """Place links in the inertial frame."""
        return frames if self._start is None else self._start @ frames

    def motion_bounds(self, frames: Array, rate: Array, drift: Array, step: Array, half: Array) -> None:
        """Return None: it stays."""

    def findings(self, limits: HasBaseLimits | None, frames_at: FramesAt) -> None:
        """Return None: there is nothing to say."""

    def figures(self) -> BaseFigures:
        """Return zeros."""
        return BaseFigures(error=0.0, final=0.0, peak=0.0, rate=0.0, joint_momentum=0.0)

    def at_end(self) -> Array:
        """Return T_w_b (4, 4), where it has always been."""
        return self.setup.start

    def turns_about_at_end(self) -> Array:
        """Return its origin (3,) [m]; its attitude has no error."""
        return self.setup.start[:3, 3]


class FloatingBaseProof(BaseProof):
    """A base that drifts and turns by the conservation of momentum.

    Attributes:
        drift: where it turns to; there from `begin` on.
        reaction: how it gives way on a stretch; likewise.
    """

    drift: Drift
    reaction: Reaction

    def __init__(self, robot: Robot, trajectory: AnyTrajectory, setup: BaseSetup) -> None:
        """Choose the curve; nothing is computed before `begin`."""
        self.robot, self.trajectory, self.setup = robot, trajectory, setup
        self.curve = trajectory.curve
        law = trajectory.time_law if isinstance(trajectory, Trajectory) else None
        if setup.drifting and law is not None and trajectory.duration > 0:
            self.curve = trajectory.path

    def bodies(self) -> tuple[Bodies, RelativeBodies]:
        """Return bodies that are watched from the inertial frame."""
        return bodies_in_space_of(self.robot)

    def begin(self, frames: Array) -> None:
        """Integrate the motion."""
        begin, end = self.curve.domain
        time_rate = self.trajectory.duration / (end - begin)
        self._masses, self._begin = masses_of(self.robot), begin
        self.drift = _drift_of(self.robot, self.curve, self.setup, time_rate=time_rate)
        linear, angular = self.setup.linear, self.setup.angular
        self.reaction = Reaction(self.robot, linear=linear, angular=angular, time_rate=time_rate, off=self.drift.error)
        self._velocity = linear * time_rate / self._masses.total
        start = self.setup.start
        self._center = start[:3, :3] @ self._center_of(frames[None])[0] + start[:3, 3]

    def placed(self, u: Array, frames: Array) -> Array:
        """Place links in the inertial frame."""
        T = np.zeros((len(u), 1, 4, 4))
        T[:, 0, :3, :3] = self.drift.attitude(u)
        T[:, 0, 3, 3] = 1.0
        center = self._center + (u - self._begin)[:, None] * self._velocity
        T[:, 0, :3, 3] = center - np.einsum("rcd,rd->rc", T[:, 0, :3, :3], self._center_of(frames))
        return T @ frames

    def motion_bounds(self, frames: Array, rate: Array, drift: Array, step: Array, half: Array) -> BaseMotionBounds:
        """Bound the base's motion by the reaction to the joints' and by the momentum."""
        return self.reaction.at(frames, rate, drift, step, half)

    def findings(self, limits: HasBaseLimits | None, frames_at: FramesAt) -> BaseFindings:
        """Return the figures, and whether the motion that the trajectory states for its base is this one."""
        u = some_of(self.drift.instants)
        stated = stated_base_errors(
            self.robot,
            self.trajectory,
            time_at(self, u),
            frames_at(u)[:, -1],
            linear=self.setup.linear,
            angular=self.setup.angular,
        )
        figures = self.figures()
        return BaseFindings(
            residual_momentum=stated.residual,
            elsewhere=stated.elsewhere,
            error=figures.error,
            rotation_final=figures.final,
            rotation_peak=figures.peak,
            rate=figures.rate,
            joint_momentum=figures.joint_momentum,
            checked=asked(limits),
            broken_limits=exceeded(figures, limits),
        )

    def figures(self) -> BaseFigures:
        """Return by how much the base is disturbed; bounds for every t."""
        begin, end = self.curve.domain
        rate = momentum = 0.0
        if self.trajectory.duration > 0:
            drift, speed = self.drift, (end - begin) / self.trajectory.duration
            law = self.trajectory.time_law if isinstance(self.trajectory, Trajectory) else None
            if law is not None and self.curve is self.trajectory.curve:  # how fast it goes along the path is the law's to say
                assert isinstance(self.trajectory, Trajectory)
                drift = _drift_of(self.robot, _share_path(self.trajectory.motion, law), self.setup, time_rate=0.0)
                speed = 1 / self.trajectory.duration
            rate, momentum = drift.rate() * speed, drift.joint_momentum() * speed
        return BaseFigures(
            error=self.drift.error, final=self.drift.final(), peak=self.drift.peak(), rate=rate, joint_momentum=momentum
        )

    def at_end(self) -> Array:
        """Return T_w_b (4, 4) in the end."""
        u = np.array(self.curve.domain[1:])
        return self.placed(u, link_frames(self, u))[0, -1]

    def turns_about_at_end(self) -> Array:
        """Return the system's centre of mass (3,) [m]."""
        begin, end = self.curve.domain
        return self._center + (end - begin) * self._velocity

    def _center_of(self, frames: Array) -> Array:
        """Return the system's centre of mass (r, 3) in the frames' frame."""
        at = frames[:, self._masses.joint]
        com = np.einsum("rbcd,bd->rbc", at[..., :3, :3], self._masses.com) + at[..., :3, 3]
        return np.einsum("b,rbc->rc", self._masses.mass, com) / self._masses.total


BASE_PROOFS: dict[str, Callable[[Robot, AnyTrajectory, BaseSetup], BaseProof]] = {
    "fixed": FixedBaseProof,
    "floating": FloatingBaseProof,
}
"""The base proofs by their model's name; see `BASE_MODELS`."""


def base_proof(robot: Robot, trajectory: AnyTrajectory, setup: BaseSetup) -> BaseProof:
    """Return the base proof of a setup's model; nothing is computed yet.

    Raises:
        ProblemError: the model has none.
    """
    if setup.base not in BASE_PROOFS:
        raise ProblemError(
            f"base is '{setup.base}', of which there is no proof, expected one of {', '.join(map(repr, BASE_PROOFS))}"
        )
    return BASE_PROOFS[setup.base](robot, trajectory, setup)


def begun_base_proof(robot: Robot, trajectory: AnyTrajectory, setup: BaseSetup) -> BaseProof:
    """Return a base proof that knows where the base goes, for what is not about clearance.

    Raises:
        RobotError: the robot's masses cannot be.
        ProblemError: it tumbles too often.
    """
    base = base_proof(robot, trajectory, setup)
    base.begin(link_frames(base, np.array(base.curve.domain[:1]))[0])
    return base


def link_frames(base: BaseProof, u: Array) -> Array:
    """Return T_b_joint (r, j + 1, 4, 4) at parameters (r,) of the base's curve, the last the base itself."""
    witness = Witness(base.robot, base.bodies()[0])
    return witness.frames(JointMap(base.robot).values(base.curve.sample(u)))


def own_parameter(base: BaseProof, u: float) -> float:
    """Return the parameter of the trajectory's own curve, for one of the base's curve."""
    trajectory = base.trajectory
    if base.curve is trajectory.curve:
        return u
    assert isinstance(trajectory, Trajectory)
    assert trajectory.time_law is not None
    return float(trajectory.time_law.sample(u / trajectory.duration))


def time_at(base: BaseProof, u: Array) -> Array:
    """Return when parameters (r,) of the base's curve are reached, (r,) [s].

    Where the curve goes by time that is the time itself: the place on the path does not tell it where the arm dwells.
    """
    at = np.asarray(u, dtype=np.float64)
    return base.trajectory.time_at(at) if base.curve is base.trajectory.curve else at


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


def _drift_of(robot: Robot, curve: Curve, setup: BaseSetup, *, time_rate: float) -> Drift:
    """Return a `Drift`; the same one if the same robot and curve were asked about lately, in whatever time without momentum."""
    key = setup.start.tobytes() + (setup.angular * time_rate).tobytes()
    for seen, path, given, made in list(_SEEN):
        if seen is robot and path is curve and given == key:
            return made
    made = Drift(robot, curve, setup, time_rate=time_rate)
    if made.evaluations <= _MOST_KEPT:
        _SEEN.append((robot, curve, key, made))
    return made
