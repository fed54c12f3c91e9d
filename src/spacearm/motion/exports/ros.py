"""A trajectory as messages of ROS 2, in JSON with the messages' own field names.

Keys: `joint_trajectory`, a trajectory_msgs/JointTrajectory; and of a floating base `base_path`, a nav_msgs/Path whose poses
are stamped with the time from the start, and `base_twists`, a list of geometry_msgs/TwistStamped: linear velocity in the
inertial frame, angular velocity there too. Orientations are x, y, z, w by name, as ROS has them.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm.checks import as_name
from spacearm.errors import SettingsError
from spacearm.momentum.turning import rotated
from spacearm.motion.exports.instants import instants
from spacearm.motion.exports.rows import rows_at, rows_of
from spacearm.motion.recorded import AnyTrajectory, require_trajectory
from spacearm.output import require_writable, write_out

Array = NDArray[np.float64]

_TICKS = 1_000_000_000
_POINTS = 201


def write_ros_trajectory(
    trajectory: AnyTrajectory,
    path: str | os.PathLike[str],
    *,
    step: float | None = None,
    frame_id: str = "inertial",
    jerk_limit: ArrayLike | None = None,
    overwrite: bool = False,
) -> tuple[str, ...]:
    """Write a trajectory as messages of ROS 2 in JSON: joint_names and points, and where a floating base is.

    Args:
        trajectory: to be written.
        path: of the file, a new one.
        step: between two points [s]; None: about a 200th of the duration, and less where that is needed for what is read
            between the points to be the trajectory again, within its limits.
        frame_id: the name of the inertial frame.
        jerk_limit: to be kept by what is read, too, one number or (n,) [rad/s^3 or m/s^3]; not looked at if a step is given.
        overwrite: replace a file that is there.

    Returns:
        What differs from the trajectory by more than the last digits, a sentence each; mostly nothing.

    Raises:
        OutputError: the file exists already, or cannot be written.
        SettingsError: a step or a name that cannot be.
    """
    require_trajectory(trajectory)
    frame_id = as_name("frame_id", frame_id, SettingsError)
    require_writable(path, overwrite=overwrite)
    if step is None:
        rows = rows_of(trajectory, least=_POINTS, ticks=_TICKS, jerk_limit=jerk_limit)
        at = np.round(rows.t * _TICKS).astype(np.int64)
    else:
        at = instants(trajectory, step, ticks=_TICKS)
        rows = rows_at(trajectory, at / _TICKS)
    trajectory = rows.trajectory
    stamps = [{"sec": tick // _TICKS, "nanosec": tick % _TICKS} for tick in at.tolist()]
    states = [values.tolist() for values in rows.states]
    states += [[[]] * len(stamps)] * (3 - len(states))
    begin = {"stamp": {"sec": 0, "nanosec": 0}}
    values: dict[str, Any] = {
        "joint_trajectory": {
            "header": {**begin, "frame_id": ""},
            "joint_names": list(trajectory.robot.dof_names),
            "points": [
                {"positions": q, "velocities": dq, "accelerations": ddq, "effort": [], "time_from_start": stamp}
                for q, dq, ddq, stamp in zip(*states, stamps, strict=True)
            ],
        }
    }
    if trajectory.base_model.follows_arm:
        headers = [{"stamp": stamp, "frame_id": frame_id} for stamp in stamps]
        position, wxyz = trajectory.base_pose(at / _TICKS)
        velocity, omega = trajectory.base_rate(at / _TICKS)
        poses = [{"position": p, "orientation": q} for p, q in zip(_named(position), _xyzw(wxyz), strict=True)]
        twists = [{"linear": v, "angular": w} for v, w in zip(_named(velocity), _named(rotated(wxyz, omega)), strict=True)]
        values["base_path"] = {
            "header": {**begin, "frame_id": frame_id},
            "poses": [{"header": header, "pose": pose} for header, pose in zip(headers, poses, strict=True)],
        }
        values["base_twists"] = [{"header": header, "twist": twist} for header, twist in zip(headers, twists, strict=True)]
    write_out(path, "".join(_parts(values)) + "\n", overwrite=overwrite)
    return rows.notes


def _parts(value: Any) -> Iterator[str]:
    """Yield the parts of strict JSON, a point or a pose to a line."""
    if isinstance(value, dict):
        for i, (key, entry) in enumerate(value.items()):
            yield f"{', ' if i else '{'}{json.dumps(key)}: "
            yield from _parts(entry)
        yield "}"
    elif isinstance(value, list) and value and isinstance(value[0], dict):
        yield "[\n"
        yield ",\n".join(json.dumps(entry, allow_nan=False) for entry in value)
        yield "\n]"
    else:
        yield json.dumps(value, allow_nan=False)


def _named(rows: Array) -> list[dict[str, float]]:
    return [dict(zip("xyz", row, strict=True)) for row in rows.tolist()]


def _xyzw(wxyz: Array) -> list[dict[str, float]]:
    return [dict(zip("xyzw", row, strict=True)) for row in wxyz[:, [1, 2, 3, 0]].tolist()]
