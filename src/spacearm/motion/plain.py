"""Trajectories as plain values, so that a file may hold one in full."""

from __future__ import annotations

from typing import Any

from spacearm.checks import shown
from spacearm.errors import ProblemError
from spacearm.motion.piecewise import PiecewisePath
from spacearm.motion.recorded import AnyTrajectory, RecordedTrajectory
from spacearm.motion.spline import Motion
from spacearm.motion.timelaw import TimeLaw, over_time
from spacearm.motion.trajectory import Trajectory
from spacearm.records import record_as_dict, record_from_dict
from spacearm.robot import Robot

_KEYS = ("control_points", "duration_s", "time_law", "notes")
_RECORDED_KEYS = ("breaks", "coefficients", "notes")


def trajectory_as_dict(trajectory: AnyTrajectory) -> dict[str, Any]:
    """Return a trajectory as plain values, without its robot.

    Keys: `control_points` (K + 2, n), `duration_s`, `time_law` (null: uniform; else `breaks` and `coefficients`) and `notes`
    of a motion; `breaks` [s], `coefficients` (Bernstein's, piece by piece) and `notes` of one that somebody else made.
    """
    notes = list(trajectory.notes)
    if isinstance(trajectory, RecordedTrajectory):
        return {**record_as_dict(trajectory.path), "notes": notes}
    law = trajectory.time_law
    return {
        "control_points": trajectory.motion.control_points.tolist(),
        "duration_s": trajectory.duration,
        "time_law": None if law is None else record_as_dict(law),
        "notes": notes,
    }


def trajectory_from_dict(robot: Robot, values: Any, *, within_limits: bool = True) -> AnyTrajectory:
    """Make a trajectory of plain values.

    Args:
        robot: whose joints move.
        values: as `trajectory_as_dict` gives them.
        within_limits: refuse a motion that breaks the robot's limits; otherwise it comes back as a recorded trajectory, to be
            judged.

    Raises:
        ProblemError: values that are no trajectory of the robot.
    """
    if not isinstance(values, dict):
        raise ProblemError(f"the trajectory is {shown(values)}, expected a mapping with the keys {', '.join(_KEYS)}")
    notes = _notes(values.get("notes", []))
    if "breaks" in values:
        _require_keys(values, _RECORDED_KEYS)
        path = {key: value for key, value in values.items() if key != "notes"}
        return RecordedTrajectory(robot, record_from_dict(PiecewisePath, path, "the path", ProblemError), notes=notes)
    _require_keys(values, _KEYS)
    for key in ("control_points", "duration_s"):
        if key not in values:
            raise ProblemError(f"the trajectory has no key '{key}', expected it; add it")
    points = {"control_points": values["control_points"]}
    motion = record_from_dict(Motion, points, "the trajectory", ProblemError)
    given = values.get("time_law")
    law = None if given is None else record_from_dict(TimeLaw, given, "time_law", ProblemError)
    duration = values["duration_s"]
    if duration is None:
        raise ProblemError("duration_s is null, expected a time [s]")
    try:
        return Trajectory(robot, motion, duration=duration, time_law=law, notes=notes)
    except ProblemError:
        if within_limits or motion.dof != robot.dof or not _is_time(duration):
            raise
    return RecordedTrajectory(robot, over_time(motion, law or TimeLaw.uniform(), float(duration)), notes=notes)


def _is_time(duration: Any) -> bool:
    return isinstance(duration, (int, float)) and not isinstance(duration, bool) and 0 < duration < float("inf")


def _require_keys(values: dict[str, Any], known: tuple[str, ...]) -> None:
    for key in values:
        if key not in known:
            raise ProblemError(f"the trajectory has key {shown(key)}, expected {', '.join(known)}")


def _notes(given: Any) -> tuple[str, ...]:
    if not isinstance(given, list) or not all(isinstance(note, str) for note in given):
        raise ProblemError(f"the trajectory's notes are {shown(given)}, expected a list of sentences")
    return tuple(given)
