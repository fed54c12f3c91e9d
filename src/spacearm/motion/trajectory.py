"""A motion in time."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm.checks import Frozen, as_number, shown
from spacearm.errors import ProblemError
from spacearm.motion.spline import Motion
from spacearm.motion.timelaw import LimitMargins, fastest_duration, limit_margins
from spacearm.robot import Robot, forward_kinematics

Array = NDArray[np.float64]

_SLACK = 1e-9  # a duration this much (relative) below the fastest is a file's last digit


class JointState(NamedTuple):
    """Joint positions, rates and accelerations, each (..., n)."""

    q: Array
    dq: Array
    ddq: Array


@dataclass(frozen=True, slots=True, eq=False)
class Trajectory(Frozen):
    """A motion with its time law, executable by the robot: within its limits at every instant.

    Attributes:
        robot: whose joints move.
        motion: the path.
        duration: [s]; None: the least that keeps the velocity and acceleration limits for all t.
        base: "fixed".

    Raises:
        ProblemError: the motion is for another number of joints, leaves the position limits, or the duration is too
            short for the velocity or acceleration limits.
    """

    robot: Robot
    motion: Motion
    _: KW_ONLY
    duration: float = None  # type: ignore[assignment]  # filled in below
    base: Literal["fixed"] = "fixed"

    if TYPE_CHECKING:

        def __init__(
            self, robot: Robot, motion: Motion, *, duration: float | None = None, base: Literal["fixed"] = "fixed"
        ) -> None: ...

    def __post_init__(self) -> None:
        if self.motion.dof != self.robot.dof:
            raise ProblemError(
                f"the motion has {self.motion.dof} joints, expected the {self.robot.dof} of robot '{self.robot.name}'"
            )
        if self.base != "fixed":
            raise ProblemError(f"base is {shown(self.base)}, expected 'fixed'")
        fastest = fastest_duration(self.robot, self.motion)
        if self.duration is None:
            object.__setattr__(self, "duration", fastest)
        duration = as_number("duration", self.duration, ProblemError, at_least=0, unit="s")
        if duration < fastest * (1 - _SLACK):
            raise ProblemError(
                f"duration is {duration:.6g} s, expected at least {fastest:.6g} s: faster breaks a velocity or acceleration "
                "limit; leave it out for the fastest"
            )
        object.__setattr__(self, "duration", max(duration, fastest))
        self._require_positions()

    @property
    def limits(self) -> LimitMargins:
        """How far it stays inside the joints' limits, for all t."""
        return limit_margins(self.robot, self.motion, self.duration)

    def sample(self, t: ArrayLike) -> JointState:
        """Return positions, rates and accelerations.

        Args:
            t: (...,) time [s]; before 0 and after the duration the arm rests at the ends.

        Returns:
            q, dq, ddq, each (..., n) [rad or m, per s, per s^2].
        """
        time = np.asarray(t, dtype=np.float64)
        if self.duration == 0:
            q = np.broadcast_to(self.motion.control_points[0], (*time.shape, self.robot.dof)).copy()
            return JointState(q, np.zeros_like(q), np.zeros_like(q))
        s = time / self.duration
        return JointState(
            self.motion.sample(s),
            self.motion.sample(s, 1) / self.duration,
            self.motion.sample(s, 2) / self.duration**2,
        )

    def tip(self, t: ArrayLike, *, frame: str | None = None) -> Array:
        """Return where a frame is, the end effector unless named: T_w_tip (..., 4, 4), inertial frame [m]."""
        return forward_kinematics(self.robot, self.sample(t).q, frame=frame)

    def base_pose(self, t: ArrayLike) -> tuple[Array, Array]:
        """Return the base's position (..., 3) [m] and attitude q_wxyz (..., 4) in the inertial frame; fixed: at rest."""
        shape = np.shape(t)
        return np.zeros((*shape, 3)), np.broadcast_to([1.0, 0.0, 0.0, 0.0], (*shape, 4)).copy()

    def _require_positions(self) -> None:
        margin = limit_margins(self.robot, self.motion, self.duration).position
        worst = int(np.argmin(margin))
        if margin[worst] < -_SLACK:
            raise ProblemError(
                f"joint '{self.robot.dof_names[worst]}' may pass its limit by {-margin[worst]:.4g}, expected all control "
                "points within the limits; move them inside"
            )
