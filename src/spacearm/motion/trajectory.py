"""Trajectories on a base: where the base is over time, and motions that run by a time law within the joints' limits."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass
from typing import TYPE_CHECKING, NamedTuple, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm.core.brief import Rows, brief, counted, named, numbers
from spacearm.core.checks import Frozen, as_number, as_numbers, as_sentences, keep, require_kind, shown
from spacearm.core.errors import ProblemError
from spacearm.core.rotations import matrix_of
from spacearm.dynamics import BaseMotion, JointPath, Momentum
from spacearm.dynamics.base_models import Base, BaseModel, BaseTrack, base_model, checked_base
from spacearm.motion.limit_margins import (
    LimitMargins,
    fastest_duration,
    fastest_duration_of_law,
    law_margins,
    limit_margins,
    position_margins,
)
from spacearm.motion.piecewise import PiecewisePath
from spacearm.motion.spline import Motion
from spacearm.motion.time_laws import TimeLaw, over_time
from spacearm.robot import Robot, forward_kinematics
from spacearm.robot.model import require_robot

Array = NDArray[np.float64]

LONGEST = 1e15  # [s] of a trajectory: beyond about 1e100 s squares and cubes of the duration overflow
_SLACK = 1e-9  # relative for a duration, [rad or m] for a position: a limit may be broken by the last digit in a file


class JointState(NamedTuple):
    """Joint positions, rates and accelerations, each (..., n)."""

    q: Array
    dq: Array
    ddq: Array

    def __repr__(self) -> str:
        return brief(self)


class OnABase(Frozen):
    """What all trajectories have in common: their base model, and where the base and the end effector are at each time.

    The base's motion is computed at its first use and cached. It does not count when trajectories are compared.
    """

    __slots__ = ("_base_track",)

    if TYPE_CHECKING:
        robot: Robot
        base: Base
        base_start: Array
        momentum: Momentum
        notes: tuple[str, ...]
        _base_track: BaseTrack | None

    def _configuration(self, t: Array) -> Array:
        """Return the joints' positions at a time."""
        raise NotImplementedError

    def _span(self) -> float:
        """Return the duration [s]."""
        raise NotImplementedError

    def _base_path(self) -> tuple[JointPath, float]:
        """Return the path of the joints that the base's motion follows from, and the duration [s]."""
        raise NotImplementedError

    def _along(self, t: Array) -> tuple[Array, Array]:
        """Return the path's parameter at a time and its derivative, both of the shape of t."""
        raise NotImplementedError

    def _check_base(self) -> None:
        """Check the base's fields and fill in their defaults."""
        keep(self, **checked_base(self.robot, self.base, self.base_start, self.momentum))
        object.__setattr__(self, "_base_track", None)

    def _said(self, what: str, rows: Rows) -> tuple[str, Rows]:
        """Return a headline and rows on a trajectory."""
        ends = [f"{numbers(self._configuration(np.array(t)))}" for t in (0.0, self._span())]
        rows = [("start", ends[0]), ("end", ends[1]), *rows]
        rows += [("notes", "; ".join(self.notes))] if self.notes else []
        held = f"robot {named(self.robot.name)}, {counted(self.robot.dof, 'joint')}, {self.base} base"
        return f"{what}: {self._span():.6g} s, {held}", rows

    @property
    def base_model(self) -> BaseModel:
        """What holds the base."""
        return base_model(self.base)

    @property
    def base_track(self) -> BaseTrack:
        """Where the base is along the path of the joints.

        Raises:
            RobotError: masses that are not known.
            ProblemError: the momentum turns the base too often.
        """
        track = self._base_track
        if track is None:
            path, duration = self._base_path()
            track = self.base_model.track(self.robot, path, start=self.base_start, momentum=self.momentum, duration=duration)
            object.__setattr__(self, "_base_track", track)
        return track

    @property
    def base_motion(self) -> BaseMotion | None:
        """The integrated motion of a floating base; None for a base whose motion is not integrated."""
        track = self.base_track
        return track if isinstance(track, BaseMotion) else None

    def base_pose(self, t: ArrayLike) -> tuple[Array, Array]:
        """Return the base's position (..., 3) [m] and attitude_wxyz (..., 4) in the inertial frame.

        Args:
            t: (...,) time [s]; before 0 and after the duration, what holds at the ends.
        """
        time = as_numbers("t", t, ProblemError)
        return self.base_track.pose(self._along(time)[0])

    def base_rate(self, t: ArrayLike) -> tuple[Array, Array]:
        """Return how fast the base moves: its origin in the inertial frame [m/s], and its turning in base axes [rad/s].

        Args:
            t: (...,) time [s]; before 0 and after the duration both are 0.

        Returns:
            Each (..., 3).
        """
        time = as_numbers("t", t, ProblemError)
        u, speed = self._along(time)
        speed = np.where((time >= 0) & (time <= self._span()), speed, 0.0)[..., None]
        velocity, omega = self.base_track.twist(u)
        return velocity * speed, omega * speed

    def base_state(self, t: ArrayLike) -> tuple[Array, Array, Array, Array]:
        """Return what `base_pose` and `base_rate` return, in one go if the base's motion is integrated."""
        time, motion, own = as_numbers("t", t, ProblemError), self.base_motion, type(self)
        if motion is None or own.base_pose is not OnABase.base_pose or own.base_rate is not OnABase.base_rate:
            return *self.base_pose(time), *self.base_rate(time)
        u, speed = self._along(time)
        speed = np.where((time >= 0) & (time <= self._span()), speed, 0.0)[..., None]
        position, attitude, velocity, omega = motion.state(u)
        return position, attitude, velocity * speed, omega * speed

    def tip(self, t: ArrayLike, *, frame: str | None = None) -> Array:
        """Return where a frame is, the end effector unless named: T_w_tip (..., 4, 4), inertial frame [m]."""
        time = as_numbers("t", t, ProblemError)
        T_b_tip = forward_kinematics(self.robot, self._configuration(time), frame=frame)
        return self.base_track.placed(self._along(time)[0], T_b_tip)


def base_frames(trajectory: OnABase, t: ArrayLike) -> Array:
    """Return where a trajectory's base is, T_w_b (..., 4, 4) [m], at times (...,) [s]."""
    position, attitude = trajectory.base_pose(t)
    T = np.zeros((*position.shape[:-1], 4, 4))
    T[..., :3, :3], T[..., :3, 3], T[..., 3, 3] = matrix_of(attitude), position, 1.0
    return T


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Trajectory(OnABase):
    """A motion with its time law, executable by the robot: within its limits at every instant.

    Attributes:
        robot: whose joints move.
        motion: the path.
        duration: [s]; None: the least that keeps the velocity and acceleration limits for all t.
        time_law: where on the path the motion is at each share of the duration; None: s = t/T.
        base: "fixed", or "floating": free to drift and turn; None: as the robot says.
        base_start: (4, 4) T_w_b at the beginning [m]; None: at the inertial origin, unturned.
        momentum: of base and arm, if the base floats; None: none.
        notes: how the time law came about, a sentence each.

    Raises:
        ProblemError: the motion is for another number of joints, leaves the position limits, the duration is too short for
            the velocity or acceleration limits or longer than 1e15 s, or a base that cannot be.
        RobotError: a floating base of a robot whose masses cannot be.
    """

    robot: Robot
    motion: Motion
    _: KW_ONLY
    duration: float = None  # type: ignore[assignment]  # filled in below
    time_law: TimeLaw | None = None
    base: Base = None  # type: ignore[assignment]
    base_start: Array = None  # type: ignore[assignment]
    momentum: Momentum = None  # type: ignore[assignment]
    notes: tuple[str, ...] = ()

    if TYPE_CHECKING:

        def __init__(
            self,
            robot: Robot,
            motion: Motion,
            *,
            duration: float | None = None,
            time_law: TimeLaw | None = None,
            base: Base | None = None,
            base_start: ArrayLike | None = None,
            momentum: Momentum | None = None,
            notes: tuple[str, ...] = (),
        ) -> None: ...

    def __post_init__(self) -> None:
        require_robot(self.robot)
        require_kind("motion", self.motion, Motion, ProblemError, advice="make one with Motion([start, ..., goal])")
        if self.motion.dof != self.robot.dof:
            raise ProblemError(
                f"the motion has {self.motion.dof} joints, expected the {self.robot.dof} of robot '{self.robot.name}'"
            )
        self._check_base()
        law = cast("object", self.time_law)
        if law is None:
            fastest = fastest_duration(self.robot, self.motion)
        elif isinstance(law, TimeLaw):
            fastest = fastest_duration_of_law(self.robot, self.motion, law)
        else:
            raise ProblemError(f"time_law is {shown(law)}, expected a TimeLaw, or None for a uniform one")
        if not fastest <= LONGEST:
            raise ProblemError(
                f"within the joints' limits the motion takes {fastest:.4g} s, expected at most {LONGEST:g} s; check the limits"
            )
        given = cast("float | None", self.duration)
        duration = as_number(
            "duration", fastest if given is None else given, ProblemError, at_least=0, at_most=LONGEST, unit="s"
        )
        if duration < fastest * (1 - _SLACK):
            raise ProblemError(
                f"duration is {duration:.6g} s, expected at least {fastest:.6g} s: faster breaks a velocity or acceleration "
                "limit; leave it out for the fastest"
            )
        object.__setattr__(self, "duration", max(duration, fastest))
        object.__setattr__(self, "notes", as_sentences("notes", self.notes, ProblemError))
        self._require_positions()

    def _in_short(self) -> tuple[str, Rows]:
        law = (
            "uniform time law" if self.time_law is None else f"time law of {counted(len(self.time_law.coefficients), 'piece')}"
        )
        points = counted(self.motion.interior, "control point")
        return self._said("Trajectory", [("path", f"{points} between the ends, {law}")])

    @property
    def curve(self) -> Motion:
        """The path as what it is geometrically, over s in [0, 1]: collisions do not depend on the time law."""
        return self.motion

    @property
    def path(self) -> PiecewisePath:
        """The trajectory as one piecewise polynomial over time [s].

        Raises:
            ProblemError: it takes no time.
        """
        if self.duration == 0:
            raise ProblemError("the trajectory takes 0 s, expected a duration; give one, as in Trajectory(..., duration=1)")
        return over_time(self.motion, self.time_law or TimeLaw.uniform(), self.duration)

    @property
    def limits(self) -> LimitMargins:
        """How far it stays inside the joints' limits, for all t."""
        return self.margins()

    def margins(self, robot: Robot | None = None, *, jerk_limit: ArrayLike | None = None) -> LimitMargins:
        """Return how far it stays inside the joints' limits, for all t.

        Args:
            robot: whose limits; None: its own.
            jerk_limit: of |dddq|, one number or (n,) [rad/s^3 or m/s^3]; None: none.

        Raises:
            ProblemError: a jerk limit that is no positive number.
        """
        robot = self.robot if robot is None else robot
        require_robot(robot)
        if self.time_law is None:
            return limit_margins(robot, self.motion, self.duration, jerk_limit=jerk_limit)
        return law_margins(robot, self.motion, self.time_law, self.duration, jerk_limit=jerk_limit)

    def time_at(self, s: ArrayLike) -> Array:
        """Return when the path's parameter s in [0, 1] is reached, (...,) [s]."""
        share = np.clip(as_numbers("s", s, ProblemError), 0.0, 1.0)
        return self.duration * (share if self.time_law is None else self.time_law.inverse(share))

    def sample(self, t: ArrayLike) -> JointState:
        """Return positions, rates and accelerations.

        Args:
            t: (...,) time [s]; before 0 and after the duration the arm rests at the ends.

        Returns:
            q, dq, ddq, each (..., n) [rad or m, per s, per s^2].
        """
        time = as_numbers("t", t, ProblemError)
        if self.duration == 0:
            q = np.broadcast_to(self.motion.control_points[0], (*time.shape, self.robot.dof)).copy()
            return JointState(q, np.zeros_like(q), np.zeros_like(q))
        share = time / self.duration
        law = self.time_law
        s = share if law is None else law.sample(share)
        q, first, second = (rows.reshape(*time.shape, self.robot.dof) for rows in self.motion.derivatives(s.ravel(), 2))
        if law is None:
            return JointState(q, first / self.duration, second / self.duration**2)
        v, a = (law.sample(share, k)[..., None] / self.duration**k for k in (1, 2))
        return JointState(q, first * v, second * v**2 + first * a)

    def _configuration(self, t: Array) -> Array:
        return self.sample(t).q

    def _span(self) -> float:
        return self.duration

    def _base_path(self) -> tuple[JointPath, float]:
        # Without momentum the base's motion does not depend on time, so the path over s is enough.
        return (self.motion if self.momentum.is_zero or self.duration == 0 else self.path), self.duration

    def _along(self, t: Array) -> tuple[Array, Array]:
        if self.duration == 0:
            return np.zeros_like(t), np.zeros_like(t)
        if not self.momentum.is_zero:
            return t, np.ones_like(t)
        share = t / self.duration
        if self.time_law is None:
            return share, np.full_like(t, 1 / self.duration)
        return self.time_law.sample(share), self.time_law.sample(share, 1) / self.duration

    def _require_positions(self) -> None:
        points = self.motion.control_points
        if ((points >= self.robot.lower) & (points <= self.robot.upper)).all():
            return  # and so is their hull
        margin = position_margins(self.robot, self.motion)
        worst = int(np.argmin(margin))
        if margin[worst] < -_SLACK:
            raise ProblemError(
                f"joint '{self.robot.dof_names[worst]}' may pass its limit by {-margin[worst]:.4g}, expected all control "
                "points within the limits; move them inside"
            )
