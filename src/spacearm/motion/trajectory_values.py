"""Trajectories as plain values, which a file holds in full, and as rows at equal steps, which a controller runs."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from spacearm.core.brief import brief
from spacearm.core.checks import as_number
from spacearm.core.errors import ProblemError, SettingsError
from spacearm.core.records import record_as_dict, record_from_dict
from spacearm.dynamics import Momentum
from spacearm.motion.piecewise import PiecewisePath
from spacearm.motion.recorded import (
    AnyTrajectory,
    RecordedTrajectory,
    for_robot,
    in_order,
    require_trajectory,
    robot_in_order,
)
from spacearm.motion.spline import Motion
from spacearm.motion.time_laws import TimeLaw, over_time
from spacearm.motion.trajectory import Trajectory
from spacearm.robot import Robot

Array = NDArray[np.float64]

_MOST = 10_000_000  # samples
_LONGEST = 1e9  # [s] of a step
_ROUNDING = 1e-9  # of a step: a shorter last step is rounding


@dataclass(frozen=True, slots=True, kw_only=True)
class _OfAnyBase:
    """The keys of both kinds of trajectory. Without `base` the base is fixed, also for a robot whose own base floats."""

    joints: tuple[str, ...] | None = None
    base: str = "fixed"
    base_start: Array | None = None
    momentum: Momentum | None = None
    notes: tuple[str, ...] = ()

    @property
    def on_a_base(self) -> dict[str, Any]:
        """Return what a trajectory's constructor takes of them."""
        return {key: getattr(self, key) for key in ("base", "base_start", "momentum", "notes")}


@dataclass(frozen=True, slots=True, kw_only=True)
class _MotionValues(_OfAnyBase):
    """The keys of a motion."""

    control_points: Array
    duration_s: float
    time_law: TimeLaw | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class _RecordedValues(_OfAnyBase):
    """The keys of a recorded trajectory."""

    breaks: Array
    coefficients: Array
    contradictions: tuple[str, ...] = ()


def trajectory_as_dict(trajectory: AnyTrajectory) -> dict[str, Any]:
    """Return a trajectory as plain values, without its robot.

    Keys: `joints`, the names that the n columns go by; `control_points` (K + 2, n), `duration_s`, `time_law` (null: uniform;
    else `breaks` and `coefficients`) and `notes` of a motion; `breaks` [s], `coefficients` (Bernstein's, piece by piece) and
    `notes` of a recorded one. Those of the base are there only if it is not fixed at the origin: `base`,
    `base_start` T_w_b (4, 4), and `momentum`.
    """
    notes, joints = list(trajectory.notes), list(trajectory.robot.dof_names)
    if isinstance(trajectory, RecordedTrajectory):
        wrong = {"contradictions": list(trajectory.contradictions)} if trajectory.contradictions else {}
        return {"joints": joints, **record_as_dict(trajectory.path), **_base_as_dict(trajectory), "notes": notes, **wrong}
    law = trajectory.time_law
    return {
        "joints": joints,
        "control_points": trajectory.motion.control_points.tolist(),
        "duration_s": trajectory.duration,
        "time_law": None if law is None else record_as_dict(law),
        **_base_as_dict(trajectory),
        "notes": notes,
    }


def _base_as_dict(trajectory: AnyTrajectory) -> dict[str, Any]:
    base: dict[str, Any] = {}
    if trajectory.base != "fixed":
        base["base"] = trajectory.base
    if not np.array_equal(trajectory.base_start, np.eye(4)):
        base["base_start"] = trajectory.base_start.tolist()
    if not trajectory.momentum.is_zero:
        base["momentum"] = record_as_dict(trajectory.momentum)
    return base


def trajectory_from_dict(robot: Robot, values: Any, *, within_limits: bool = True) -> AnyTrajectory:
    """Make a trajectory of plain values.

    Args:
        robot: whose joints move.
        values: as `trajectory_as_dict` gives them. Columns of joints in another order than the robot's are put into its own,
            which a note says; without `joints`, as in older files, they are taken to be in the robot's.
        within_limits: refuse a motion that breaks the robot's limits; otherwise it comes back as a recorded trajectory, to be
            judged.

    Raises:
        ProblemError: values that are no trajectory of the robot.
    """
    recorded = isinstance(values, dict) and "breaks" in values
    given = record_from_dict(_RecordedValues if recorded else _MotionValues, values, "", ProblemError)
    columns = None if given.joints is None else in_order(given.joints, robot.dof_names, who="the trajectory")
    if columns is None or columns == list(range(robot.dof)):
        return _made(robot, given, within_limits)
    read = _made(robot_in_order(robot, np.argsort(columns).tolist()), given, within_limits)
    made, notes = for_robot(read, robot)
    return replace(made, robot=robot, notes=(*made.notes, *notes))


def _made(robot: Robot, given: _RecordedValues | _MotionValues, within_limits: bool) -> AnyTrajectory:
    """Make a trajectory of a robot whose joints are in the order of the columns."""
    if isinstance(given, _RecordedValues):
        path = PiecewisePath(given.breaks, given.coefficients)
        return RecordedTrajectory(robot, path, **given.on_a_base, contradictions=given.contradictions)
    motion, law, duration = Motion(given.control_points), given.time_law, given.duration_s
    try:
        return Trajectory(robot, motion, duration=duration, time_law=law, **given.on_a_base)
    except ProblemError:
        if within_limits or motion.dof != robot.dof or not 0 < duration < math.inf:
            raise
    return RecordedTrajectory(robot, over_time(motion, law or TimeLaw.uniform(), duration), **given.on_a_base)


class Samples(NamedTuple):
    """A trajectory at equal steps: t (m,) [s], and q, dq, ddq, each (m, n)."""

    t: Array
    q: Array
    dq: Array
    ddq: Array

    def __repr__(self) -> str:
        return brief(self)


def resampled(trajectory: AnyTrajectory, *, rate_hz: float | None = None, dt: float | None = None) -> Samples:
    """Sample a trajectory at equal steps from 0, the last at its end or less than a step after, where the arm rests.

    Args:
        trajectory: ours or recorded.
        rate_hz: samples per second, or
        dt: the step [s].

    Raises:
        SettingsError: both or neither is given, it is no positive number, or gives more than ten million samples.
    """
    require_trajectory(trajectory)
    if (rate_hz is None) == (dt is None):
        raise SettingsError(f"rate_hz is {rate_hz} and dt is {dt}, expected one of them: samples per second, or the step [s]")
    if rate_hz is not None:
        step = 1 / as_number("rate_hz", rate_hz, SettingsError, above=0, unit="Hz")
    else:
        step = as_number("dt", dt, SettingsError, above=0, unit="s")
    step = min(step, _LONGEST)
    steps = trajectory.duration / step
    if steps > _MOST:
        raise SettingsError(f"a step of {step:.4g} s gives {steps:.4g} samples, expected at most {_MOST:,}; take a longer step")
    count = max(math.ceil(steps - _ROUNDING), int(trajectory.duration > 0))
    t = np.arange(count + 1, dtype=np.float64) * step
    return Samples(t, *trajectory.sample(t))
