"""The base of a robot as a proof knows it: how it is held, where it goes along a trajectory, and what is found about it.

There is one `BaseProof` for each base model, found by the model's name. It places the links in the inertial frame, in which the
obstacles are at rest, bounds the base's motion on intervals, and states how much the base is disturbed. It uses the robot, the
joints' path, the base setup and Pinocchio. It uses nothing that the trajectory or the search says of the base.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from spacearm.core.brief import Brief
from spacearm.core.checks import as_readonly, as_transform, shown
from spacearm.core.errors import ProblemError
from spacearm.dynamics import Momentum
from spacearm.dynamics.base_models import BASE_MODELS, BaseModel
from spacearm.motion import AnyTrajectory, Curve, Motion, PiecewisePath, TimeLaw, Trajectory
from spacearm.motion.time_laws import over_time
from spacearm.proof.base_attitude import BaseAttitude
from spacearm.proof.base_momentum import BaseMotionBounds, FloatingBaseArrays, Reaction, masses_of, some_of, stated_base_errors
from spacearm.proof.mechanism import joints_of, kinematics_of
from spacearm.robot import Frame, Robot

Array = NDArray[np.float64]

CONSERVED = 1e-6
"""A residual momentum up to this, relative to the greatest momentum of a link, is taken for rounding."""

SAME = 1e-6
"""[m or rad] The stated pose of the base may differ by this, and by the error of the attitude, from the proven one."""

LOST = 1e-3
"""[rad] If an attitude may be wrong by more than this, the proof says nothing about collisions."""

_SAME_SETUP = 1e-9  # of a place or a momentum, times its size; of a rotation [rad]: the last digit of a file
_SLACK = 1e-9  # times a limit of the base: an excess up to this is rounding
_MODELS_REMEMBERED = 4  # attitudes and paths over time that are remembered, for a trajectory that is proven again
_MOST_REMEMBERED = 5_000  # evaluations: a longer integration is not remembered, for its memory

# ---- Base setup ------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class BaseSetup(Brief):
    """How a base is held: its model, its start pose, and the total momentum.

    Attributes:
        model: the base model.
        start: T_w_b (4, 4) at the start, in the inertial frame [m].
        linear: (3,) total momentum [N s], inertial frame.
        angular: (3,) total angular momentum about the system's centre of mass [N m s], inertial frame.
    """

    model: BaseModel
    start: Array
    linear: Array
    angular: Array

    @property
    def base(self) -> str:
        """The name of the base model."""
        return self.model.name

    @property
    def drifting(self) -> bool:
        """Whether it moves even if the joints rest. Then its motion depends on time."""
        return self.model.keeps_momentum and bool(self.linear.any() or self.angular.any())

    @property
    def at_origin(self) -> bool:
        """Whether its start pose is the identity."""
        return bool((self.start == np.eye(4)).all())


def base_setup_of(holder: object, robot: Robot, *, who: str) -> BaseSetup:
    """Read the base setup of a problem or a trajectory. Defaults: the robot's base model, the identity, no momentum.

    Args:
        holder: may have `base`, `base_start` and `momentum`.
        robot: whose base.
        who: "problem" or "trajectory", for messages.

    Raises:
        ProblemError: no base model has this name, the start is no pose, or the momentum is none.
    """
    base = getattr(holder, "base", None)
    base = robot.base if base is None else base
    if not isinstance(base, str) or base not in BASE_MODELS:
        raise ProblemError(f"the {who}'s base is {shown(base)}, expected {' or '.join(map(repr, BASE_MODELS))}")
    start, momentum = getattr(holder, "base_start", None), getattr(holder, "momentum", None)
    pose = np.eye(4) if start is None else as_transform(f"the {who}'s base_start", start, ProblemError)
    if isinstance(momentum, Momentum):  # checked already
        return BaseSetup(model=BASE_MODELS[base], start=pose, linear=momentum.linear, angular=momentum.angular)
    linear, angular = (
        np.zeros(3) if momentum is None else as_readonly(f"momentum.{part}", getattr(momentum, part), (3,), ProblemError)
        for part in ("linear", "angular")
    )
    return BaseSetup(model=BASE_MODELS[base], start=pose, linear=linear, angular=angular)


def require_same(problem: BaseSetup, trajectory: BaseSetup) -> None:
    """Check that a trajectory was made for the base that a problem has.

    Raises:
        ProblemError: it was made for another base, start pose or momentum.
    """
    if trajectory.base != problem.base:
        raise ProblemError(
            f"the trajectory is of a {trajectory.base} base, expected the problem's, which is {problem.base}; "
            f"make it with Trajectory(..., base='{problem.base}')"
        )
    mine, other = problem.start[:3], trajectory.start[:3]
    away, turned = (float(np.abs(difference).max()) for difference in (other[:, 3] - mine[:, 3], other[:, :3] - mine[:, :3]))
    if away > _SAME_SETUP * (1 + np.abs(mine[:, 3]).max()) or turned > _SAME_SETUP:
        raise ProblemError(
            f"the trajectory's base starts elsewhere than the problem's (its base_start differs by {away:.3g} m and "
            f"{turned:.3g} rad), expected the same pose; make it with Trajectory(..., base_start=problem.base_start)"
        )
    if not problem.model.keeps_momentum:
        return
    for what, unit in (("linear", "N s"), ("angular", "N m s")):
        mine, other = getattr(problem, what), getattr(trajectory, what)
        if np.abs(other - mine).max() > _SAME_SETUP * np.abs(mine).max():
            raise ProblemError(
                f"the trajectory has the {what} momentum {np.array2string(other, precision=6)} {unit}, expected the problem's "
                f"{np.array2string(mine, precision=6)} {unit}; make it with Trajectory(..., momentum=problem.momentum)"
            )


# ---- Findings about the base -----------------------------------------------------------------------------------------


class HasBaseLimits(Protocol):
    """Limits of how much an arm may disturb its base; None is no limit. `planner.BaseLimits` fulfils it."""

    @property
    def final(self) -> float | None:
        """The angle between the last attitude and the first [rad]."""
        ...

    @property
    def peak(self) -> float | None:
        """The greatest angle to the first attitude [rad]."""
        ...

    @property
    def rate(self) -> float | None:
        """The greatest rate of turn [rad/s]."""
        ...

    @property
    def joint_momentum(self) -> float | None:
        """The greatest angular momentum of the joints' motion [N m s]."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class BaseFigures(Brief):
    """How much a base is disturbed by a trajectory: bounds for every t, a few parts in a million above what is reached.

    Attributes:
        error: no attitude of the proof is wrong by more than this [rad].
        final: the angle between the last attitude and the first, which may be wrong by `error` [rad].
        peak: no attitude is further from the first one [rad].
        rate: the base turns no faster [rad/s].
        joint_momentum: the arm's angular momentum, of its joints' motion alone, is never greater [N m s].
    """

    error: float
    final: float
    peak: float
    rate: float
    joint_momentum: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class BaseFindings(Brief):
    """What was found about a base that the arm moves.

    Attributes:
        residual_momentum: the greatest difference between the given momentum and that of the base motion which the trajectory
            states, over the greatest momentum of a link; computed by Pinocchio, at instants.
        elsewhere: the greatest distance of that motion from the proven one, at instants: angle [rad] plus distance [m].
        error: no attitude of the proof is wrong by more than this [rad]; the proof allows for it.
        rotation_final: the angle between the last attitude and the first, which may be wrong by `error` [rad].
        rotation_peak, rate, joint_momentum: bounds for all t of the angle to the first attitude [rad], of the base's rate of
            turn [rad/s], and of the angular momentum of the joints' motion [N m s].
        checked: which of the problem's limits were checked: "final", "peak", "rate", "joint_momentum".
        broken_limits: those that are not proven to be kept, a phrase each.
    """

    residual_momentum: float
    elsewhere: float
    error: float
    rotation_final: float
    rotation_peak: float
    rate: float
    joint_momentum: float
    checked: tuple[str, ...] = ()
    broken_limits: tuple[str, ...] = ()

    @property
    def followed(self) -> bool:
        """Whether the attitude is known well enough for a proof."""
        return self.error <= LOST

    @property
    def broken(self) -> str:
        """What is wrong with the base motion that the trajectory states, in a sentence; "" if nothing is."""
        if not self.residual_momentum <= CONSERVED:
            return (
                f"the trajectory's base motion does not conserve momentum: it misses {self.residual_momentum:.3g} of the "
                f"greatest link's, expected at most {CONSERVED:g}"
            )
        if self.followed and not self.elsewhere <= SAME + self.error:
            return f"the trajectory has its base {self.elsewhere:.3g} m or rad from where momentum takes it"
        return ""


def asked_limits(limits: HasBaseLimits | None) -> tuple[str, ...]:
    """Return the names of the limits that are set."""
    return tuple(name for name in ("final", "peak", "rate", "joint_momentum") if getattr(limits, name, None) is not None)


def broken_base_limits(figures: BaseFigures, limits: HasBaseLimits | None) -> tuple[str, ...]:
    """Return a phrase for each limit that is not proven to be kept at every instant."""
    if limits is None:
        return ()
    out: list[str] = []
    for what, value, limit, scale, unit in (
        ("the base ends turned by", figures.final + figures.error, limits.final, math.degrees(1), "deg"),
        ("the base turns by", figures.peak, limits.peak, math.degrees(1), "deg"),
        ("the base turns at", figures.rate, limits.rate, math.degrees(1), "deg/s"),
        ("the arm's momentum reaches", figures.joint_momentum, limits.joint_momentum, 1.0, "N m s"),
    ):
        if limit is not None and not value <= limit * (1 + _SLACK):
            digits = 4 if value > 1.001 * limit else 10  # so that the two differ
            out.append(f"{what} {value * scale:.{digits}g} {unit}, more than {limit * scale:.{digits}g}")
    return tuple(out)


# ---- Base proofs along a trajectory ----------------------------------------------------------------------------------


FramesAt = Callable[[Array], Array]
"""Takes parameters (r,) of the curve; gives T_w_joint (r, j + 1, 4, 4), the last for the base itself."""


class BaseProof(ABC):
    """A base along a trajectory, as the proof has it.

    Attributes:
        robot, trajectory, setup: what it is about.
        curve: the joints' path that is to be proven: the trajectory's own, or the path over time if the base drifts.
    """

    robot: Robot
    trajectory: AnyTrajectory
    setup: BaseSetup
    curve: Curve

    @abstractmethod
    def begin(self) -> None:
        """Compute where the base goes. The other methods need this first.

        Raises:
            RobotError: the robot's masses are impossible.
            ProblemError: the base tumbles too often.
        """

    @abstractmethod
    def placed(self, u: Array, frames: Array) -> Array:
        """Place links in the inertial frame.

        Args:
            u: (r,) parameters of the curve.
            frames: (r, j + 1, 4, 4) T_b_joint there, the last for the base itself.

        Returns:
            T_w_joint, of the same shape.
        """

    @abstractmethod
    def motion_bounds(self, frames: Array, rate: Array, deviation: Array, step: Array, half: Array) -> BaseMotionBounds | None:
        """Bound the base's motion on r intervals, to first and second order; None: the base is at rest.

        Args:
            frames: (r, j + 1, 4, 4) T_w_joint at the midpoints; the last is the base.
            rate, deviation: (r, j) w_k of the joints' values per unit of u, and e_k, how far they deviate from that line.
            step: (r, j) delta_k, how far the values get from those at the midpoint.
            half: (r,) half the intervals' lengths in u.
        """

    @abstractmethod
    def for_finder(self) -> FloatingBaseArrays | None:
        """Return what the native finder needs of a base that the arm moves; None: the base is at rest."""

    @abstractmethod
    def findings(self, limits: HasBaseLimits | None, frames_at: FramesAt) -> BaseFindings | None:
        """Return what is found about the base, and the limits that are not kept; None: the base is at rest."""

    @abstractmethod
    def figures(self) -> BaseFigures:
        """Return how much the base is disturbed: bounds for every t."""

    @abstractmethod
    def at_end(self) -> Array:
        """Return T_w_b (4, 4) at the end; its attitude may be wrong by the error of `figures`."""

    @abstractmethod
    def turns_about_at_end(self) -> Array:
        """Return the point (3,) about which an error of the last attitude rotates all links, in the inertial frame [m]."""

    def frame_at_end(self, frame: Frame) -> Array:
        """Return where a frame of the robot is at the end, T_w_frame (4, 4), by Pinocchio; see `at_end` for its error."""
        T_b_joint = link_frames(self, np.array(self.curve.domain[1:]))[0]
        return self.at_end() @ (T_b_joint[frame.joint] @ frame.T_joint_frame)


class FixedBaseProof(BaseProof):
    """A base at rest."""

    def __init__(self, robot: Robot, trajectory: AnyTrajectory, setup: BaseSetup) -> None:
        self.robot, self.trajectory, self.setup = robot, trajectory, setup
        self.curve = trajectory.curve
        self._start = None if setup.at_origin else setup.start

    def begin(self) -> None:
        """Do nothing: the base is where it starts."""

    def placed(self, u: Array, frames: Array) -> Array:
        """Place links in the inertial frame."""
        return frames if self._start is None else self._start @ frames

    def motion_bounds(self, frames: Array, rate: Array, deviation: Array, step: Array, half: Array) -> None:
        """Return None: the base is at rest."""

    def for_finder(self) -> None:
        """Return None: the base is at rest."""

    def findings(self, limits: HasBaseLimits | None, frames_at: FramesAt) -> None:
        """Return None: the base is at rest."""

    def figures(self) -> BaseFigures:
        """Return zeros."""
        return BaseFigures(error=0.0, final=0.0, peak=0.0, rate=0.0, joint_momentum=0.0)

    def at_end(self) -> Array:
        """Return T_w_b (4, 4), the start pose."""
        return self.setup.start

    def turns_about_at_end(self) -> Array:
        """Return the base's origin (3,) [m]; its attitude has no error."""
        return self.setup.start[:3, 3]


class FloatingBaseProof(BaseProof):
    """A base that drifts and turns by the conservation of momentum.

    Attributes:
        attitude: its attitude along the curve; set by `begin`.
        reaction: how it reacts to the joints; set by `begin`.
    """

    attitude: BaseAttitude
    reaction: Reaction

    def __init__(self, robot: Robot, trajectory: AnyTrajectory, setup: BaseSetup) -> None:
        """Choose the curve; nothing is computed before `begin`."""
        self.robot, self.trajectory, self.setup = robot, trajectory, setup
        self.curve = trajectory.curve
        law = trajectory.time_law if isinstance(trajectory, Trajectory) else None
        if setup.drifting and law is not None and trajectory.duration > 0:
            self.curve = trajectory.path

    def begin(self) -> None:
        """Integrate the base's attitude."""
        begin, end = self.curve.domain
        time_rate = self.trajectory.duration / (end - begin)
        self._masses, self._begin = masses_of(self.robot), begin
        self.attitude = _attitude_of(self.robot, self.curve, self.setup, time_rate=time_rate)
        linear, angular = self.setup.linear, self.setup.angular
        self.reaction = Reaction(
            self.robot, linear=linear, angular=angular, time_rate=time_rate, attitude_error=self.attitude.error
        )
        self._velocity = linear * time_rate / self._masses.total
        start = self.setup.start
        at_start = link_frames(self, np.array([begin]))
        self._center = start[:3, :3] @ self._center_of(at_start)[0] + start[:3, 3]

    def placed(self, u: Array, frames: Array) -> Array:
        """Place links in the inertial frame."""
        T = np.zeros((len(u), 1, 4, 4))
        T[:, 0, :3, :3] = self.attitude.at(u)
        T[:, 0, 3, 3] = 1.0
        center = self._center + (u - self._begin)[:, None] * self._velocity
        T[:, 0, :3, 3] = center - np.einsum("rcd,rd->rc", T[:, 0, :3, :3], self._center_of(frames))
        return T @ frames

    def motion_bounds(self, frames: Array, rate: Array, deviation: Array, step: Array, half: Array) -> BaseMotionBounds:
        """Bound the base's motion by its reaction to the joints and by the momentum."""
        return self.reaction.bounds_on(frames, rate, deviation, step, half)

    def findings(self, limits: HasBaseLimits | None, frames_at: FramesAt) -> BaseFindings:
        """Return the figures, and how far the base motion that the trajectory states is from the proven one."""
        u = some_of(self.attitude.instants)
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
            checked=asked_limits(limits),
            broken_limits=broken_base_limits(figures, limits),
        )

    def figures(self) -> BaseFigures:
        """Return how much the base is disturbed: bounds for every t."""
        begin, end = self.curve.domain
        rate = momentum = 0.0
        if self.trajectory.duration > 0:
            attitude, speed = self.attitude, (end - begin) / self.trajectory.duration
            law = self.trajectory.time_law if isinstance(self.trajectory, Trajectory) else None
            if law is not None and self.curve is self.trajectory.curve:  # the rates depend on the law: use the path over time
                assert isinstance(self.trajectory, Trajectory)
                attitude = _attitude_of(self.robot, _path_over_time(self.trajectory.motion, law), self.setup, time_rate=0.0)
                speed = 1 / self.trajectory.duration
            rate, momentum = attitude.rate() * speed, attitude.joint_momentum() * speed
        return BaseFigures(
            error=self.attitude.error,
            final=self.attitude.final(),
            peak=self.attitude.peak(),
            rate=rate,
            joint_momentum=momentum,
        )

    def at_end(self) -> Array:
        """Return T_w_b (4, 4) at the end."""
        u = np.array(self.curve.domain[1:])
        return self.placed(u, link_frames(self, u))[0, -1]

    def turns_about_at_end(self) -> Array:
        """Return the system's centre of mass (3,) [m]."""
        begin, end = self.curve.domain
        return self._center + (end - begin) * self._velocity

    def for_finder(self) -> FloatingBaseArrays:
        """Return what the native finder needs of the base."""
        masses, (begin, end) = self._masses, self.curve.domain
        ends, start, coefficients = map(np.ascontiguousarray, self.attitude.panels)
        return FloatingBaseArrays(
            parent=np.array([joint.parent for joint in self.robot.joints], dtype=np.int32),
            revolute=np.array([joint.kind == "revolute" for joint in self.robot.joints], dtype=bool),
            joint_of_body=masses.joint.astype(np.int32),
            mass=masses.mass,
            com=masses.com,
            inertia=masses.inertia,
            greatest=masses.greatest,
            spread=masses.spread,
            base_least=masses.base_least,
            ends=ends,
            start=start,
            coefficients=coefficients,
            begin=begin,
            center=self._center,
            velocity=self._velocity,
            angular=self.setup.angular * (self.trajectory.duration / (end - begin)),
            attitude_error=self.attitude.error,
        )

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
        ProblemError: the model has no base proof.
    """
    if setup.base not in BASE_PROOFS:
        raise ProblemError(
            f"base is '{setup.base}', of which there is no proof, expected one of {', '.join(map(repr, BASE_PROOFS))}"
        )
    return BASE_PROOFS[setup.base](robot, trajectory, setup)


def begun_base_proof(robot: Robot, trajectory: AnyTrajectory, setup: BaseSetup) -> BaseProof:
    """Return a base proof that knows where the base goes, for uses without a clearance proof.

    Raises:
        RobotError: the robot's masses are impossible.
        ProblemError: the base tumbles too often.
    """
    base = base_proof(robot, trajectory, setup)
    base.begin()
    return base


def link_frames(base: BaseProof, u: Array) -> Array:
    """Return T_b_joint (r, j + 1, 4, 4) at parameters (r,) of the curve of a base proof; the last is the base itself."""
    return kinematics_of(base.robot).frames(joints_of(base.robot).values(base.curve.sample(u)))


def own_parameter(base: BaseProof, u: float) -> float:
    """Return the parameter of the trajectory's own curve, for a parameter of the curve of a base proof."""
    trajectory = base.trajectory
    if base.curve is trajectory.curve:
        return u
    assert isinstance(trajectory, Trajectory)
    assert trajectory.time_law is not None
    return float(trajectory.time_law.sample(u / trajectory.duration))


def time_at(base: BaseProof, u: Array) -> Array:
    """Return the times (r,) [s] at which parameters (r,) of the curve of a base proof are reached.

    If the parameter of this curve is time, they are the parameters. The place on the path would not tell the time where the arm
    dwells.
    """
    at = np.asarray(u, dtype=np.float64)
    return base.trajectory.time_at(at) if base.curve is base.trajectory.curve else at


_PATHS_OVER_TIME: deque[tuple[Motion, TimeLaw, PiecewisePath]] = deque(maxlen=_MODELS_REMEMBERED)


def _path_over_time(motion: Motion, law: TimeLaw) -> PiecewisePath:
    """Return the path over the share of the duration; the same object for the motions and laws seen last."""
    for seen, with_law, made in list(_PATHS_OVER_TIME):
        if seen is motion and with_law is law:
            return made
    made = over_time(motion, law, 1.0)
    _PATHS_OVER_TIME.append((motion, law, made))
    return made


_ATTITUDES: deque[tuple[Robot, Curve, bytes, BaseAttitude]] = deque(maxlen=_MODELS_REMEMBERED)


def _attitude_of(robot: Robot, curve: Curve, setup: BaseSetup, *, time_rate: float) -> BaseAttitude:
    """Return a `BaseAttitude`; the same object for the robots and curves seen last. Without momentum time does not matter."""
    key = setup.start.tobytes() + (setup.angular * time_rate).tobytes()
    for seen, path, given, made in list(_ATTITUDES):
        if seen is robot and path is curve and given == key:
            return made
    made = BaseAttitude(robot, curve, start=setup.start, angular=setup.angular * time_rate)
    if made.evaluations <= _MOST_REMEMBERED:
        _ATTITUDES.append((robot, curve, key, made))
    return made
