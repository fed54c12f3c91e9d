"""The quickest trajectory along a motion."""

from __future__ import annotations

from typing import Any

from numpy.typing import ArrayLike

from spacearm.checks import require_kind
from spacearm.errors import ProblemError
from spacearm.momentum import Momentum
from spacearm.momentum.base_models import Base
from spacearm.motion.margins import as_jerk_limit, fastest_duration
from spacearm.motion.refined_law import refined_law
from spacearm.motion.retimed import fastest_duration_of_law
from spacearm.motion.spline import Motion
from spacearm.motion.timelaw import TimeLaw
from spacearm.motion.toppra_law import toppra_law
from spacearm.motion.trajectory import Trajectory
from spacearm.robot import Robot
from spacearm.settings import whole

_REFINED_PIECES = 32
_REFINED_ALONE = 64  # where toppra has none to compare with
_MOST = 1000
_INSTANT = 1e-6  # [s]


def time_optimal(
    robot: Robot,
    motion: Motion,
    *,
    jerk_limit: ArrayLike | None = None,
    gridpoints: int = 100,
    pieces: int = 64,
    base: Base | None = None,
    base_start: ArrayLike | None = None,
    momentum: Momentum | None = None,
) -> Trajectory:
    """Return the quickest trajectory along a motion, with continuous acceleration and within the limits for all t.

    toppra's law is made smooth; the result is checked between samples, by hulls, and drawn out by what is missing.
    With a jerk limit a sequence of linear programmes looks for a better law yet. It is never slower than the uniform law.

    Args:
        robot: whose limits.
        motion: the path.
        jerk_limit: of |dddq|, one number or (n,) [rad/s^3 or m/s^3]; None: none, though accelerations are continuous.
        gridpoints: intervals of toppra's grid.
        pieces: of the smooth law, or up to four times as many where it needs them to come close to toppra's.
        base, base_start, momentum: of the trajectory; they change no joint's limits.

    Returns:
        The trajectory; its `notes` say how much time was saved, and lost by smoothing.

    Raises:
        ProblemError: the motion does not fit the robot, a jerk limit that is no positive number, or a base that cannot be.
        RobotError: a floating base of a robot whose masses cannot be.
        SettingsError: a number of grid points or pieces that is none.
    """
    whole("gridpoints", gridpoints, at_least=8, at_most=_MOST)
    whole("pieces", pieces, at_least=8, at_most=_MOST)
    require_kind("motion", motion, Motion, ProblemError, advice="make one with Motion([start, ..., goal])")
    held: dict[str, Any] = {"base": base, "base_start": base_start, "momentum": momentum}
    Trajectory(robot, motion, **held)  # that it fits the robot
    slow = fastest_duration(robot, motion, jerk_limit=jerk_limit)
    if slow < _INSTANT:
        notes = ("the uniform time law: it takes no time worth saving",)
        return Trajectory(robot, motion, duration=slow, **held, notes=notes)
    limits = [robot.velocity, robot.acceleration]
    if jerk_limit is not None:
        limits.append(as_jerk_limit(robot, jerk_limit))
    laws: list[tuple[TimeLaw, str]] = []
    smoothed = toppra_law(motion, limits, slow, gridpoints=gridpoints, pieces=pieces)
    if smoothed is not None:
        laws.append((smoothed[0], "toppra's law made smooth"))
    if jerk_limit is not None or smoothed is None:
        most = _REFINED_PIECES if smoothed is not None else _REFINED_ALONE
        laws.append((refined_law(motion, limits, slow, pieces=most), "a smooth law by linear programmes"))
    timed = [(fastest_duration_of_law(robot, motion, law, jerk_limit=jerk_limit), law, what) for law, what in laws]
    duration, law, what = min(timed, key=lambda entry: entry[0])
    if duration >= slow:
        return Trajectory(robot, motion, duration=slow, **held, notes=("the uniform time law: no quicker one was found",))
    note = (
        f"{what}: {duration:.6g} s, within the limits for all t; "
        f"{(1 - duration / slow) * 100:.3g} % less than the uniform law's {slow:.6g} s"
    )
    if smoothed is not None and jerk_limit is None:
        excess = (duration / smoothed[1] - 1) * 100
        note += f", {abs(excess):.2g} % {'more' if excess > 0 else 'less'} than toppra's, which heeds them at grid points only"
    return Trajectory(robot, motion, duration=duration, time_law=law, **held, notes=(note,))
