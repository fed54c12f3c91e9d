"""Trajectories as plain values, so that a file may hold one in full."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from spacearm.checks import shown
from spacearm.errors import ProblemError
from spacearm.momentum import Momentum
from spacearm.motion.for_robot import for_robot, in_order, robot_in_order
from spacearm.motion.piecewise import PiecewisePath
from spacearm.motion.recorded import AnyTrajectory, RecordedTrajectory
from spacearm.motion.spline import Motion
from spacearm.motion.timelaw import TimeLaw, over_time
from spacearm.motion.trajectory import Trajectory
from spacearm.records import record_as_dict, record_from_dict
from spacearm.robot import Robot

_BASE_KEYS = ("base", "base_start", "momentum")
_KEYS = ("joints", "control_points", "duration_s", "time_law", *_BASE_KEYS, "notes")
_RECORDED_KEYS = ("joints", "breaks", "coefficients", *_BASE_KEYS, "notes", "contradictions")


def trajectory_as_dict(trajectory: AnyTrajectory) -> dict[str, Any]:
    """Return a trajectory as plain values, without its robot.

    Keys: `joints`, the names that the n columns go by; `control_points` (K + 2, n), `duration_s`, `time_law` (null: uniform;
    else `breaks` and `coefficients`) and `notes` of a motion; `breaks` [s], `coefficients` (Bernstein's, piece by piece) and
    `notes` of one that somebody else made. Those of the base are there only if it is not fixed at the origin: `base`,
    `base_start` T_w_b (4, 4), and `momentum`.
    """
    notes, joints = list(trajectory.notes), list(trajectory.robot.dof_names)
    if isinstance(trajectory, RecordedTrajectory):
        said = {"contradictions": list(trajectory.contradictions)} if trajectory.contradictions else {}
        return {"joints": joints, **record_as_dict(trajectory.path), **_base_as_dict(trajectory), "notes": notes, **said}
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
    held: dict[str, Any] = {}
    if trajectory.base != "fixed":
        held["base"] = trajectory.base
    if not np.array_equal(trajectory.base_start, np.eye(4)):
        held["base_start"] = trajectory.base_start.tolist()
    if not trajectory.momentum.is_zero:
        held["momentum"] = record_as_dict(trajectory.momentum)
    return held


def _base_from_dict(values: dict[str, Any]) -> dict[str, Any]:
    """Return the base's arguments; what is not there is the fixed base at the origin, whatever the robot's own is."""
    momentum = values.get("momentum")
    return {
        "base": values.get("base", "fixed"),
        "base_start": values.get("base_start"),
        "momentum": None if momentum is None else record_from_dict(Momentum, momentum, "momentum", ProblemError),
    }


def trajectory_from_dict(robot: Robot, values: Any, *, within_limits: bool = True) -> AnyTrajectory:
    """Make a trajectory of plain values.

    Args:
        robot: whose joints move.
        values: as `trajectory_as_dict` gives them. Columns of joints in another order than the robot's are put into its own,
            which a note tells; without `joints`, as in older files, they are taken to be in the robot's.
        within_limits: refuse a motion that breaks the robot's limits; otherwise it comes back as a recorded trajectory, to be
            judged.

    Raises:
        ProblemError: values that are no trajectory of the robot.
    """
    if not isinstance(values, dict):
        raise ProblemError(f"the trajectory is {shown(values)}, expected a mapping with the keys {', '.join(_KEYS)}")
    columns = _columns(robot, values.get("joints"))
    if columns is not None:
        back = np.argsort(columns).tolist()
        as_written = {key: value for key, value in values.items() if key != "joints"}
        read = trajectory_from_dict(robot_in_order(robot, back), as_written, within_limits=within_limits)
        made, notes = for_robot(read, robot)
        return replace(made, robot=robot, notes=(*made.notes, *notes))
    notes = _notes(values.get("notes", []))
    if "breaks" in values:
        _require_keys(values, _RECORDED_KEYS)
        said = _notes(values.get("contradictions", []))
        path = {key: value for key, value in values.items() if key not in ("joints", *_BASE_KEYS, "notes", "contradictions")}
        curve = record_from_dict(PiecewisePath, path, "the path", ProblemError)
        return RecordedTrajectory(robot, curve, **_base_from_dict(values), notes=notes, contradictions=said)
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
    held = _base_from_dict(values)
    try:
        return Trajectory(robot, motion, duration=duration, time_law=law, **held, notes=notes)
    except ProblemError:
        if within_limits or motion.dof != robot.dof or not _is_time(duration):
            raise
    return RecordedTrajectory(robot, over_time(motion, law or TimeLaw.uniform(), float(duration)), **held, notes=notes)


def _columns(robot: Robot, joints: Any) -> list[int] | None:
    """Return where each of the robot's joints is among those that a file names; None if they are in its order."""
    if joints is None:
        return None
    if not isinstance(joints, list) or not all(isinstance(name, str) for name in joints):
        raise ProblemError(f"the trajectory's joints are {shown(joints)}, expected a list of names")
    columns = in_order(tuple(joints), robot.dof_names, who="the trajectory")
    return None if columns == list(range(robot.dof)) else columns


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
