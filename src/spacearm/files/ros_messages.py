"""ROS's trajectory_msgs/JointTrajectory, read from YAML or JSON, as it is or inside another message, and written as JSON.

What `ros2 topic echo`, `rostopic echo` and `write_ros_trajectory` write: `joint_names` and `points`, perhaps inside
`joint_trajectory` (moveit_msgs/RobotTrajectory) or `trajectory` (DisplayTrajectory, FollowJointTrajectory's goal). Times are
mappings of `sec` and `nanosec` or `secs` and `nsecs`, or numbers. Where the file has the base, as `base_path` and `base_twists`
or as a `multi_dof_joint_trajectory` of one joint, it is compared.

Written are messages of ROS 2 with their own field names: `joint_trajectory`; and of a floating base `base_path`, a
nav_msgs/Path whose poses are stamped with the time from the start, and `base_twists`, a list of geometry_msgs/TwistStamped: the
linear and the angular velocity in the inertial frame. Orientations are x, y, z, w by name.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Sequence
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm.core.checks import as_name, shown
from spacearm.core.errors import FileFormatError, SettingsError, nearest
from spacearm.core.output import require_writable, write_out
from spacearm.core.reading import complaint, located, yaml_documents
from spacearm.core.rotations import rotated
from spacearm.files.base_columns import unit_poses
from spacearm.files.stated_columns import STILL, Rows, Series, TimeUnit, checked_unit
from spacearm.files.written_rows import instants, rows_at, rows_of
from spacearm.motion.recorded import AnyTrajectory, require_trajectory
from spacearm.robot import Robot

if TYPE_CHECKING:
    from spacearm.files.ros_models import (
        Header,
        JointTrajectory,
        OnABase,
        Path,
        Point,
        PoseStamped,
        Quaternion,
        Time,
        TwistStamped,
        Vector3,
    )

Array = NDArray[np.float64]

_WHAT = "a JointTrajectory of ROS in YAML or JSON"
_HOLDS = ("joint_trajectory", "trajectory", "planned_trajectory", "motion_plan_response", "goal", "result", "msg")
_KNOWN = frozenset(
    {"joint_names", "points", "joint_trajectory", "base_path", "base_twists", "multi_dof_joint_trajectory", "model_id"}
    | {"trajectory_start"}
)
_KINDS = ("positions", "velocities", "accelerations")
_SHOWN = 6
_FLOATS = 1e300  # a whole number may be too large for a float; no joint is there
_TICKS = 1_000_000_000  # of a second, as ROS has them
_POINTS = 201  # that are written, at least

Found = tuple[dict[str, Any], list[dict[str, Any]]]
"""A JointTrajectory, and the mappings that it is in, the outermost first, itself last."""


def rows_of_messages(
    robot: Robot,
    path: str | os.PathLike[str],
    content: bytes,
    *,
    unit: TimeUnit | None,
    only_positions: bool,
    notes: list[str],
) -> Rows:
    """Read the trajectory that a file of messages holds.

    Args:
        robot: whose joints move.
        path: of the file.
        content: of it.
        unit: of times that are numbers; None: seconds.
        only_positions: other values are not needed, and may be missing in some points.
        notes: to be added to.

    Raises:
        FileFormatError: it holds none or several, lacks a joint, or has one twice, or one that moves and is not the robot's.
    """
    checked_unit(unit)
    documents = _documents(path, content)
    with located(path):
        found = [one for document in documents for one in _found(document, [], 0)]
        different = [one for i, one in enumerate(found) if all(one[0] != other[0] for other in found[:i])]
        if len(different) != 1:
            raise FileFormatError(f"it holds {len(different) or 'no'} joint trajectories, expected one: joint_names and points")
        values, around = different[0]
        outer = {key: value for mapping in around for key, value in mapping.items()}
        from spacearm.files.ros_models import JointTrajectory, OnABase, seconds

        context = {"unit": unit, "only_positions": only_positions}
        message: JointTrajectory = _parsed(JointTrajectory, values, context)
        states = _states(message, only_positions)
        order = _order(robot, message, states[0], notes)
        _note_unused(message, around, notes)
        t = np.array([seconds(point["time_from_start"]) for point in message["points"]])
        on_base: OnABase = _parsed(OnABase, outer, context)
        begin = seconds((message.get("header") or {}).get("stamp") or {"sec": 0, "nanosec": 0}) + float(t[0])
        velocity, turning = _twists(on_base, begin)
        return Rows(
            places=[f"point {i}" for i in range(len(t))],
            t=t,
            states=[state[:, order] for state in states],
            base=_base(on_base, begin, float(t[0])),
            velocity=velocity,
            turning=turning,
            robot=outer["model_id"] if isinstance(outer.get("model_id"), str) and outer["model_id"] else None,
            begin=_begin(outer.get("trajectory_start")),
        )


def _parsed(message: type, values: dict[str, Any], context: dict[str, Any]) -> Any:
    """Check a message against its typed dictionary, and return it."""
    from pydantic import ValidationError

    try:
        return _adapter(message).validate_python(values, context=context)
    except ValidationError as error:
        cut = any(detail["input"] == "..." for detail in error.errors(include_url=False))
        advice = "; the file was cut short as it was printed, print it in full" if cut else ""
        raise FileFormatError(f"{complaint(error)[1]}{advice}") from None


@cache
def _adapter(message: type) -> Any:
    from pydantic import TypeAdapter

    return TypeAdapter(message)


def _documents(path: str | os.PathLike[str], content: bytes) -> list[Any]:
    if content.lstrip()[:1] in (b"{", b"["):
        try:
            return [json.loads(content, object_pairs_hook=_once)]
        except (ValueError, RecursionError):  # YAML may begin so too, and says better what is wrong
            pass
    return yaml_documents(path, what=_WHAT)


def _once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    if len({key for key, _ in pairs}) < len(pairs):
        raise ValueError("a key is given twice")
    return dict(pairs)


def _found(value: Any, around: list[dict[str, Any]], depth: int) -> Iterator[Found]:
    """Yield the trajectories in a value that move joints at all."""
    if depth > len(_HOLDS):
        return
    if isinstance(value, list):
        for entry in value:
            yield from _found(entry, around, depth + 1)
    elif isinstance(value, dict):
        inside = [*around, value]
        if "points" in value or "joint_names" in value:
            if value.get("points") or value.get("joint_names"):
                yield value, inside
            return
        for key in _HOLDS:
            if key in value:
                yield from _found(value[key], inside, depth + 1)


def _states(message: JointTrajectory, only_positions: bool) -> list[Array]:
    """Return the points' positions, and their rates and accelerations if there are any, in the file's order of joints."""
    names, points = message["joint_names"], message["points"]
    if not names:
        raise FileFormatError("joint_names is [], expected a list of the joints' names")
    twice = next((name for i, name in enumerate(names) if name in names[:i]), None)
    if twice is not None:
        raise FileFormatError(f"joint_names has '{twice}' twice, expected each joint once")
    if len(points) < 2:
        raise FileFormatError(f"it holds {len(points)} point(s), expected two or more: a start and a goal")
    states = []
    for kind in _KINDS[:1] if only_positions else _KINDS:
        values = [point.get(kind) or [] for point in points]
        missing = [i for i, row in enumerate(values) if not row]
        if len(missing) == len(points) and kind != "positions":
            break
        if missing and kind == "positions":
            raise FileFormatError(f"points[{missing[0]}] has no positions, expected one a joint in every point")
        if missing:
            raise FileFormatError(
                f"points[{missing[0]}] has no {kind}, and others have, expected all or none; leave them out, or take straight "
                "lines between the positions (interpolation 'linear')"
            )
        for i, row in enumerate(values):
            if len(row) != len(names):
                raise FileFormatError(f"points[{i}].{kind} is {shown(row)}, expected {len(names)} finite numbers, one a joint")
        states.append(np.array(values, dtype=np.float64))
    return states


def _order(robot: Robot, message: JointTrajectory, q: Array, notes: list[str]) -> list[int]:
    """Return where each of the robot's joints stands in the file."""
    names = message["joint_names"]
    for joint in robot.dof_names:
        if joint not in names:
            raise FileFormatError(
                f"joint_names has no '{joint}', expected all joints of robot '{robot.name}'; {nearest(joint, names)}"
            )
    others = [name for name in names if name not in robot.dof_names]
    moved = [name for name in others if np.ptp(q[:, names.index(name)]) > STILL]
    if moved:
        raise FileFormatError(
            f"joint_names has '{moved[0]}', which moves and which robot '{robot.name}' does not have or holds still; "
            f"{nearest(moved[0], robot.dof_names)}; leave it out if it does not count"
        )
    if others:
        where = ", ".join(f"'{name}' at {q[0, names.index(name)]:.6g}" for name in others[:_SHOWN])
        notes.append(f"joints left alone, for they do not move and are none of the robot's: {where}")
    order = [names.index(joint) for joint in robot.dof_names]
    if order != sorted(order):
        notes.append("the file has the joints in another order; they are taken by their names")
    return order


def _note_unused(message: JointTrajectory, around: Sequence[dict[str, Any]], notes: list[str]) -> None:
    """Name what is in the file and means nothing here."""
    unused = [
        key for mapping in around for key, value in mapping.items()
        if key not in _KNOWN and key not in _HOLDS and key != "header" and value not in (None, [], {}, "", 0, 0.0)
    ]  # fmt: skip
    frame = (message.get("header") or {}).get("frame_id")
    if frame:
        unused.append(f"header.frame_id '{frame}'")
    if any(point.get("effort") for point in message["points"]):
        unused.append("effort")
    if unused:
        notes.append(f"left alone: {', '.join(dict.fromkeys(map(str, unused)))}")


def _begin(start: Any) -> dict[str, float]:
    """Return where a DisplayTrajectory has joints before the motion."""
    state = start.get("joint_state") if isinstance(start, dict) else None
    names, values = (state.get("name"), state.get("position")) if isinstance(state, dict) else (None, None)
    if not isinstance(names, list) or not isinstance(values, list) or len(names) != len(values):
        return {}
    pairs = zip(names, values, strict=True)
    return {str(name): float(value) for name, value in pairs if isinstance(value, (int, float)) and abs(value) < _FLOATS}


def _base(message: OnABase, begin: float, first: float) -> Series | None:
    """Return the base's poses from `base_path`, or from the transforms of a planar or floating joint.

    Args:
        message: what stands around the trajectory.
        begin: stamp of the first point [s].
        first: time of the first point from the start [s].
    """
    from spacearm.files.ros_models import seconds

    path, several = message.get("base_path"), message.get("multi_dof_joint_trajectory")
    rows: list[tuple[float, list[float], str]] = []
    if path is not None:
        for i, entry in enumerate(path.get("poses") or []):
            at, pose = seconds(entry["header"]["stamp"]) - begin, entry["pose"]
            rows.append((at, _pose_row(pose["position"], pose["orientation"]), f"base_path.poses[{i}]"))
    elif several is not None and several.get("points"):
        names = several.get("joint_names") or []
        if len(names) != 1:
            raise FileFormatError(f"multi_dof_joint_trajectory moves {shown(names)}, expected one joint, which holds the base")
        for i, point in enumerate(several.get("points") or []):
            at, (pose,) = seconds(point["time_from_start"]) - first, point["transforms"]
            rows.append((at, _pose_row(pose["translation"], pose["rotation"]), f"multi_dof_joint_trajectory.points[{i}]"))
    if not rows:
        return None
    places = [where for _, _, where in rows]
    poses = unit_poses(np.array([pose for _, pose, _ in rows]), places)
    return Series(t=np.array([at for at, _, _ in rows]), values=poses, places=places)


def _twists(message: OnABase, begin: float) -> tuple[Series | None, Series | None]:
    """Return the base's rates from `base_twists`."""
    from spacearm.files.ros_models import seconds

    given = message.get("base_twists") or []
    if not given:
        return None, None
    t = np.array([seconds(entry["header"]["stamp"]) - begin for entry in given])
    places = [f"base_twists[{i}]" for i in range(len(t))]
    linear, angular = np.array(
        [[_row(twist["linear"]), _row(twist["angular"])] for twist in (one["twist"] for one in given)]
    ).swapaxes(0, 1)
    return Series(t=t, values=linear, places=places), Series(t=t, values=angular, places=places)


def _row(vector: Vector3) -> list[float]:
    return [vector["x"], vector["y"], vector["z"]]


def _pose_row(position: Vector3, orientation: Quaternion) -> list[float]:
    """Return a position and a quaternion wxyz."""
    return [*_row(position), orientation["w"], orientation["x"], orientation["y"], orientation["z"]]


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
    stamps: list[Time] = [{"sec": tick // _TICKS, "nanosec": tick % _TICKS} for tick in at.tolist()]
    states = [values.tolist() for values in rows.states]
    states += [[[]] * len(stamps)] * (3 - len(states))
    points: list[Point] = [
        {"positions": q, "velocities": dq, "accelerations": ddq, "effort": [], "time_from_start": stamp}
        for q, dq, ddq, stamp in zip(*states, stamps, strict=True)
    ]
    header = {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": ""}
    names = list(trajectory.robot.dof_names)
    values: dict[str, Any] = {"joint_trajectory": {"header": header, "joint_names": names, "points": points}}
    if trajectory.base_model.follows_arm:
        values["base_path"], values["base_twists"] = _base_messages(trajectory, at, stamps, frame_id)
    write_out(path, "".join(_parts(values)) + "\n", overwrite=overwrite)
    return rows.notes


def _base_messages(
    trajectory: AnyTrajectory, at: NDArray[np.int64], stamps: list[Time], frame_id: str
) -> tuple[Path, list[TwistStamped]]:
    """Return the base's poses and rates in the inertial frame, at instants (m,) in ticks."""
    headers: list[Header] = [{"stamp": stamp, "frame_id": frame_id} for stamp in stamps]
    position, wxyz = trajectory.base_pose(at / _TICKS)
    velocity, omega = trajectory.base_rate(at / _TICKS)
    turns: list[Quaternion] = [{"x": x, "y": y, "z": z, "w": w} for w, x, y, z in wxyz.tolist()]
    poses: list[PoseStamped] = [
        {"header": header, "pose": {"position": p, "orientation": q}}
        for header, p, q in zip(headers, _vectors(position), turns, strict=True)
    ]
    twists: list[TwistStamped] = [
        {"header": header, "twist": {"linear": v, "angular": w}}
        for header, v, w in zip(headers, _vectors(velocity), _vectors(rotated(wxyz, omega)), strict=True)
    ]
    return {"header": {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": frame_id}, "poses": poses}, twists


def _vectors(rows: Array) -> list[Vector3]:
    return [{"x": x, "y": y, "z": z} for x, y, z in rows.tolist()]


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
