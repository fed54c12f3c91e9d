"""Trajectories from elsewhere: joint positions over time, and those of another robot model.

A recorded trajectory is taken as it is. It may break limits, and its certificate says so. Joints go by their names: `for_robot`
puts a trajectory's columns into a robot's order, and refuses a robot whose joints of the same names are other joints.
"""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass, replace
from typing import TYPE_CHECKING, Any, TypeAlias, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm.core.brief import Rows, counted
from spacearm.core.checks import as_numbers, as_sentences, require_kind, shown
from spacearm.core.errors import ProblemError
from spacearm.dynamics import JointPath, Momentum
from spacearm.dynamics.base_models import Base
from spacearm.motion.limit_margins import LimitMargins, path_margins
from spacearm.motion.piecewise import PiecewisePath
from spacearm.motion.spline import Motion
from spacearm.motion.trajectory import LONGEST, JointState, OnABase, Trajectory
from spacearm.robot import Joint, Robot
from spacearm.robot.model import require_robot

Array = NDArray[np.float64]

_SHORTEST = 1e-6  # [s] of a piece; in shorter ones rounding would hide corners
_FURTHEST = 1e6  # [rad or m] that a joint may go
_SAME = 1e-9  # of a transform, a multiplier or an offset, relative to its size: the last digit in a file


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class RecordedTrajectory(OnABase):
    """Joint positions over time from elsewhere. It may break limits; `limits` says by how much.

    Attributes:
        robot: whose joints move.
        path: q(t), t from 0 to the duration [s], without jumps; those of rounding are closed, see `PiecewisePath.joined`.
        base: "fixed", or "floating": free to drift and turn; None: as the robot says.
        base_start: (4, 4) T_w_b at the beginning [m]; None: at the inertial origin, unturned.
        momentum: of base and arm, if the base floats; None: none.
        notes: what was assumed in reading it, a sentence each.
        contradictions: wrong statements in its file, a sentence each; its certificate then fails.

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
        path = cast("object", self.path)
        if not isinstance(path, PiecewisePath):
            raise ProblemError(
                f"path is {shown(path)}, expected a PiecewisePath; make one with PiecewisePath.from_linear(t, q)"
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

    def _in_short(self) -> tuple[str, Rows]:
        rows = [("path", f"{counted(self.path.pieces, 'piece')} of degree {self.path.degree}")]
        rows += [("contradicts", "; ".join(self.contradictions))] if self.contradictions else []
        return self._said("RecordedTrajectory", rows)

    def _closed(self, given: PiecewisePath) -> tuple[str, ...]:
        """Return a note on closed jumps that are more than rounding in the joint's own numbers."""
        jumps = np.abs(given.jumps(0))
        if self.path is given or not jumps.any():
            return ()
        i, joint = np.unravel_index(int(np.argmax(jumps)), jumps.shape)
        return (
            f"jumps of up to {jumps[i, joint]:.3g} (joint '{self.robot.dof_names[int(joint)]}' at {given.breaks[i + 1]:.9g} s) "
            "were closed: rounding of other joints' larger numbers; the rates that this takes are counted",
        )

    def _require_sizes(self) -> None:
        """Refuse pieces and positions of which float64 has no digits left to check limits."""
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


def for_robot(trajectory: AnyTrajectory, robot: Robot, *, same_joints: bool = True) -> tuple[AnyTrajectory, tuple[str, ...]]:
    """Return a trajectory with its joints in a robot's order, and notes on what was done.

    It stays a trajectory of its own robot, except for that order. Its own limits do not count for the other robot.

    Args:
        trajectory: of any robot.
        robot: whose joints are meant.
        same_joints: refuse a robot whose joints of the same names stand elsewhere or move otherwise; else a note says so.

    Raises:
        ProblemError: the joints have other names, or are other joints: that motion is not one of this robot.
    """
    own = trajectory.robot
    if own is robot:
        return trajectory, ()
    notes: list[str] = []
    if own.dof_names != robot.dof_names:
        columns = in_order(own.dof_names, robot.dof_names, who=f"the trajectory, of robot '{own.name}',")
        trajectory = _in_order(trajectory, columns)
        notes.append(
            "the trajectory has the joints in another order than the problem: they were put into the problem's by name"
        )
    other = _other_joint(own, robot)
    if other and same_joints:
        raise ProblemError(
            f"the trajectory is of another robot than the problem: {other}; if its joint positions are meant for robot "
            f"'{robot.name}' all the same, make it anew with that robot, as in Trajectory(problem.robot, trajectory.motion)"
        )
    if other:
        notes.append(f"the trajectory was made for another robot: {other}")
    return trajectory, tuple(notes)


def in_order(own: tuple[str, ...], wanted: tuple[str, ...], *, who: str) -> list[int]:
    """Return where each of a robot's joints is among the given names.

    Args:
        own: the names given, in the order of the numbers.
        wanted: the robot's.
        who: whose names these are, for the message, as in "the trajectory".

    Raises:
        ProblemError: they are not the same names.
    """
    missing = [name for name in wanted if name not in own]
    strange = [name for name in own if name not in wanted]
    if missing or strange or len(own) != len(wanted):
        lacks = f"has no {_listed(missing)}" if missing else ""
        has = f"moves {_listed(strange)}, which the robot does not have" if strange else ""
        said = " and ".join(filter(None, (lacks, has))) or f"names {len(own)} joints for {len(wanted)}"
        raise ProblemError(f"{who} {said}, expected the joints {', '.join(wanted)}, in any order")
    return [own.index(name) for name in wanted]


def _listed(names: list[str]) -> str:
    return (
        f"joint{'s' if len(names) > 1 else ''} {', '.join(repr(name) for name in names[:6])}{', ...' if len(names) > 6 else ''}"
    )


def _in_order(trajectory: AnyTrajectory, columns: list[int]) -> AnyTrajectory:
    """Return the same trajectory with its columns, and those of its robot, in another order."""
    robot = robot_in_order(trajectory.robot, columns)
    if isinstance(trajectory, RecordedTrajectory):
        path = PiecewisePath(trajectory.path.breaks, trajectory.path.coefficients[..., columns])
        return replace(trajectory, robot=robot, path=path)
    return replace(trajectory, robot=robot, motion=Motion(trajectory.motion.control_points[:, columns]))


def robot_in_order(robot: Robot, columns: list[int]) -> Robot:
    """Return the same robot with its degrees of freedom in another order."""
    place = {dof: i for i, dof in enumerate(columns)}
    return replace(
        robot,
        joints=tuple(replace(joint, dof=place[joint.dof]) for joint in robot.joints),
        dof_names=tuple(robot.dof_names[dof] for dof in columns),
        configurations=tuple(replace(one, q=one.q[columns]) for one in robot.configurations),
        **{limit: getattr(robot, limit)[columns] for limit in ("lower", "upper", "velocity", "acceleration")},
    )


def _other_joint(own: Robot, robot: Robot) -> str:
    """Return how the first joint that differs between two robots differs; "" if all are the same."""
    mine, theirs = ({joint.name: joint for joint in each.joints} for each in (own, robot))
    for name in mine.keys() ^ theirs.keys():
        return f"only the {'trajectory' if name in mine else 'problem'}'s has a joint '{name}'"
    for name, joint in theirs.items():
        differs = _difference(own, mine[name], robot, joint)
        if differs:
            return f"its joint '{name}' {differs}"
    return ""


def _difference(own: Robot, mine: Joint, robot: Robot, joint: Joint) -> str:
    parents = [each.joints[j.parent].name if j.parent >= 0 else "" for each, j in ((own, mine), (robot, joint))]
    leaders = [each.dof_names[j.dof] for each, j in ((own, mine), (robot, joint))]
    if mine.kind != joint.kind:
        return f"is {mine.kind}, not {joint.kind}"
    if parents[0] != parents[1]:
        return f"is moved by '{parents[0]}', not by '{parents[1]}'" if all(parents) else "is carried by another one"
    if leaders[0] != leaders[1]:
        return f"goes with '{leaders[0]}', not with '{leaders[1]}'"
    for what in ("multiplier", "offset"):
        one, other = getattr(mine, what), getattr(joint, what)
        if abs(one - other) > _SAME * (1 + abs(other)):
            return f"has {what} {one:g}, not {other:g}"
    off = float(np.abs(mine.T_parent_joint - joint.T_parent_joint).max())
    if off > _SAME * (1 + float(np.abs(joint.T_parent_joint).max())):
        return f"stands elsewhere (T_parent_joint differs by {off:.3g})"
    return ""
