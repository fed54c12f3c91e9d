"""Trajectories that somebody else made: taken as they are, and judged."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm.checks import as_numbers, as_sentences, require_kind, shown
from spacearm.errors import ProblemError
from spacearm.momentum import JointPath, Momentum
from spacearm.momentum.base_models import Base
from spacearm.motion.margins import LimitMargins, path_margins
from spacearm.motion.on_a_base import OnABase
from spacearm.motion.piecewise import PiecewisePath
from spacearm.motion.trajectory import LONGEST, JointState, Trajectory
from spacearm.robot import Robot
from spacearm.robot.model import require_robot

Array = NDArray[np.float64]

_SHORTEST = 1e-6  # [s]; in shorter pieces rounding would hide corners
_FURTHEST = 1e6  # [rad or m]


@dataclass(frozen=True, slots=True, eq=False)
class RecordedTrajectory(OnABase):
    """Joint positions over time from elsewhere. It may break limits: `limits` tells.

    Attributes:
        robot: whose joints move.
        path: q(t), t from 0 to the duration [s], without jumps; those of rounding are closed, see `PiecewisePath.joined`.
        base: "fixed", or "floating": free to drift and turn; None: as the robot says.
        base_start: (4, 4) T_w_b at the beginning [m]; None: at the inertial origin, unturned.
        momentum: of base and arm, if the base floats; None: none.
        notes: what was assumed in reading it, a sentence each.
        contradictions: what its file states that is not so, a sentence each; its certificate then fails.

    Raises:
        ProblemError: the path is for another number of joints, does not begin at 0, or jumps; or a base that cannot be.
        RobotError: a floating base of a robot whose masses cannot be.
    """

    robot: Robot
    path: PiecewisePath
    _: KW_ONLY
    base: Base = None  # type: ignore[assignment]  # filled in below
    base_start: Array = None  # type: ignore[assignment]
    momentum: Momentum = None  # type: ignore[assignment]
    notes: tuple[str, ...] = ()
    contradictions: tuple[str, ...] = ()

    if TYPE_CHECKING:

        def __init__(
            self,
            robot: Robot,
            path: PiecewisePath,
            *,
            base: Base | None = None,
            base_start: ArrayLike | None = None,
            momentum: Momentum | None = None,
            notes: tuple[str, ...] = (),
            contradictions: tuple[str, ...] = (),
        ) -> None: ...

    def __post_init__(self) -> None:
        require_robot(self.robot)
        if not isinstance(self.path, PiecewisePath):
            raise ProblemError(
                f"path is {shown(self.path)}, expected a PiecewisePath; make one with PiecewisePath.from_linear(t, q)"
            )
        if self.path.dof != self.robot.dof:
            raise ProblemError(
                f"the path has {self.path.dof} joints, expected the {self.robot.dof} of robot '{self.robot.name}'"
            )
        self._check_base()
        if self.path.domain[0] != 0:
            raise ProblemError(f"the path begins at {self.path.domain[0]:.9g} s, expected 0; take its first time from all")
        self._require_sizes()
        given, path = self.path, self.path.joined()
        jumps = np.abs(path.jumps(0))
        if jumps.any():
            i, joint = np.unravel_index(int(np.argmax(jumps)), jumps.shape)
            raise ProblemError(
                f"joint '{self.robot.dof_names[int(joint)]}' jumps by {jumps[i, joint]:.4g} "
                f"at {self.path.breaks[i + 1]:.9g} s, expected a path without jumps; join its pieces"
            )
        object.__setattr__(self, "path", path)
        object.__setattr__(self, "notes", (*as_sentences("notes", self.notes, ProblemError), *self._closed(given)))
        object.__setattr__(self, "contradictions", as_sentences("contradictions", self.contradictions, ProblemError))

    def _closed(self, given: PiecewisePath) -> tuple[str, ...]:
        """Say where jumps were closed that are more than rounding in the joint's own numbers."""
        jumps = np.abs(given.jumps(0))
        if self.path is given or not jumps.any():
            return ()
        i, joint = np.unravel_index(int(np.argmax(jumps)), jumps.shape)
        return (
            f"jumps of up to {jumps[i, joint]:.3g} (joint '{self.robot.dof_names[int(joint)]}' at {given.breaks[i + 1]:.9g} s) "
            "were closed: rounding of other joints' larger numbers; the rates that this takes are counted",
        )

    def _require_sizes(self) -> None:
        """Refuse what would leave no digits to check."""
        lengths = np.diff(self.path.breaks)
        shortest = int(np.argmin(lengths))
        if lengths[shortest] < _SHORTEST:
            raise ProblemError(
                f"the path has a piece of {lengths[shortest]:.3g} s at {self.path.breaks[shortest]:.9g} s, "
                f"expected {_SHORTEST:g} s or more; leave it out"
            )
        if self.path.domain[1] > LONGEST:
            raise ProblemError(
                f"the path takes {self.path.domain[1]:.4g} s, expected at most {LONGEST:g} s; check the unit of its times"
            )
        furthest = np.abs(self.path.coefficients).max(axis=(0, 1))
        joint = int(np.argmax(furthest))
        if furthest[joint] > _FURTHEST:
            raise ProblemError(
                f"joint '{self.robot.dof_names[joint]}' goes to {furthest[joint]:.4g}, expected less than {_FURTHEST:g}; "
                "check the units, and the rates"
            )

    @property
    def curve(self) -> PiecewisePath:
        """The path over time."""
        return self.path

    @property
    def duration(self) -> float:
        """[s]."""
        return self.path.domain[1]

    @property
    def limits(self) -> LimitMargins:
        """How far it stays inside the joints' limits, for all t."""
        return self.margins()

    def margins(self, robot: Robot | None = None, *, jerk_limit: ArrayLike | None = None) -> LimitMargins:
        """Return how far it stays inside the joints' limits, for all t; at a corner the acceleration is infinite.

        Args:
            robot: whose limits; None: its own.
            jerk_limit: of |dddq|, one number or (n,) [rad/s^3 or m/s^3]; None: none.

        Raises:
            ProblemError: a jerk limit that is no positive number.
        """
        robot = self.robot if robot is None else robot
        require_robot(robot)
        return path_margins(robot, self.path, jerk_limit=jerk_limit)

    def time_at(self, u: ArrayLike) -> Array:
        """Return when the path's parameter is reached, which is time itself, (...,) [s]."""
        return np.clip(as_numbers("u", u, ProblemError), *self.path.domain)

    def sample(self, t: ArrayLike) -> JointState:
        """Return positions, rates and accelerations.

        Args:
            t: (...,) time [s]; before 0 and after the duration the arm rests at the ends.

        Returns:
            q, dq, ddq, each (..., n) [rad or m, per s, per s^2].
        """
        time = as_numbers("t", t, ProblemError)
        within = ((time >= 0) & (time <= self.duration))[..., None]
        q, dq, ddq = (self.path.sample(time, k) for k in (0, 1, 2))
        return JointState(q, np.where(within, dq, 0.0), np.where(within, ddq, 0.0))

    def _configuration(self, t: Array) -> Array:
        return self.path.sample(t)

    def _span(self) -> float:
        return self.duration

    def _base_path(self) -> tuple[JointPath, float]:
        return self.path, self.duration

    def _along(self, t: Array) -> tuple[Array, Array]:
        return t, np.ones_like(t)


AnyTrajectory: TypeAlias = Trajectory | RecordedTrajectory
"""What can be sampled, proven and drawn: a motion with its time law, or joint positions over time from elsewhere."""


def require_trajectory(trajectory: Any) -> None:
    """Refuse what is no trajectory.

    Raises:
        ProblemError: it is none.
    """
    kinds = (Trajectory, RecordedTrajectory)
    require_kind("trajectory", trajectory, kinds, ProblemError, advice="make one with Trajectory(robot, motion)")
