"""ROS's trajectory_msgs/JointTrajectory as YAML or JSON, of ROS 1 or 2, as it is or inside another message.

What `ros2 topic echo`, `rostopic echo` and `write_ros_trajectory` write: `joint_names` and `points`, perhaps inside
`joint_trajectory` (moveit_msgs/RobotTrajectory) or `trajectory` (DisplayTrajectory, FollowJointTrajectory's goal). Times are
mappings of `sec` and `nanosec` or `secs` and `nsecs`, or numbers. Where the file has the base, as `base_path` and `base_twists`
or as a `multi_dof_joint_trajectory` of one joint, it is compared.
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm.core.checks import as_name, shown
from spacearm.core.errors import FileFormatError, SettingsError, nearest
from spacearm.core.output import require_writable, write_out
from spacearm.core.reading import located, yaml_documents
from spacearm.core.rotations import rotated
from spacearm.files.base_columns import unit_poses
from spacearm.files.stated_columns import PER_SECOND, STILL, Rows, Series, TimeUnit, checked_unit
from spacearm.files.written_rows import instants, rows_at, rows_of
from spacearm.motion.recorded import AnyTrajectory, require_trajectory
from spacearm.robot import Robot

Array = NDArray[np.float64]

_WHAT = "a JointTrajectory of ROS in YAML or JSON"
_HOLDS = ("joint_trajectory", "trajectory", "planned_trajectory", "motion_plan_response", "goal", "result", "msg")
_KNOWN = frozenset(
    {"joint_names", "points", "joint_trajectory", "base_path", "base_twists", "multi_dof_joint_trajectory", "model_id"}
    | {"trajectory_start"}
)
_KINDS = ("positions", "velocities", "accelerations")
_STATE_KEYS = frozenset({*_KINDS, "effort", "time_from_start"})
_SHOWN = 6

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
        message, around = different[0]
        places, t, states = _points(message, unit, only_positions)
        order = _order(robot, message, states[0], notes)
        _note_unused(message, around, notes)
        outer = {key: value for mapping in around for key, value in mapping.items()}
        begin = _seconds(_mapping(message.get("header"), "header").get("stamp", 0.0), None, "header.stamp")
        velocity, turning = _twists(outer, begin, float(t[0]))
        return Rows(
            places=places,
            t=t,
            states=[state[:, order] for state in states],
            base=_base(outer, begin, float(t[0])),
            velocity=velocity,
            turning=turning,
            robot=outer["model_id"] if isinstance(outer.get("model_id"), str) and outer["model_id"] else None,
            begin=_begin(outer.get("trajectory_start")),
        )


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


def _points(message: dict[str, Any], unit: TimeUnit | None, only_positions: bool) -> tuple[list[str], Array, list[Array]]:
    """Return where the points stand, their times [s], and their values in the file's order of joints."""
    names, points = message.get("joint_names"), message.get("points")
    if not isinstance(names, list) or not names or not all(isinstance(name, str) for name in names):
        raise FileFormatError(f"joint_names is {shown(names)}, expected a list of the joints' names")
    twice = next((name for i, name in enumerate(names) if name in names[:i]), None)
    if twice is not None:
        raise FileFormatError(f"joint_names has '{twice}' twice, expected each joint once")
    if not isinstance(points, list) or len(points) < 2:
        count = len(points) if isinstance(points, list) else 0
        raise FileFormatError(f"it holds {count} point(s), expected two or more: a start and a goal")
    for i, point in enumerate(points):
        if not isinstance(point, dict):
            raise FileFormatError(f"points[{i}] is {shown(point)}, expected a mapping with positions and time_from_start")
        for key in ("positions", "time_from_start"):
            if key not in point:
                raise FileFormatError(f"points[{i}] has no {key}, expected positions and time_from_start in every point")
        _require_keys(point, i)
    t = np.array([_seconds(point["time_from_start"], unit, f"points[{i}].time_from_start") for i, point in enumerate(points)])
    states = []
    for kind in _KINDS[:1] if only_positions else _KINDS:
        values = [_numbers(point.get(kind), f"points[{i}].{kind}", len(names)) for i, point in enumerate(points)]
        there = [i for i, row in enumerate(values) if row]
        if not there and kind != "positions":
            break
        if len(there) < len(points):
            missing = next(i for i, row in enumerate(values) if not row)
            if kind == "positions":
                raise FileFormatError(f"points[{missing}] has no positions, expected one a joint in every point")
            raise FileFormatError(
                f"points[{missing}] has no {kind}, and others have, expected all or none; leave them out, or take straight "
                "lines between the positions (interpolation 'linear')"
            )
        states.append(np.array(values, dtype=np.float64))
    return [f"point {i}" for i in range(len(points))], t, states


def _require_keys(point: dict[str, Any], i: int) -> None:
    for key in point:
        if key not in _STATE_KEYS:
            raise FileFormatError(f"points[{i}] has key {shown(key)}; {nearest(str(key), sorted(_STATE_KEYS))}")


def _seconds(given: Any, unit: TimeUnit | None, where: str) -> float:
    """Return a time [s]: a number, or whole seconds and nanoseconds as ROS 1 or 2 names them."""
    if _is_number(given):
        return float(given) / PER_SECOND[unit or "s"]
    if isinstance(given, dict):
        for whole, rest in (("sec", "nanosec"), ("secs", "nsecs"), ("sec", "nsec"), ("seconds", "nanoseconds")):
            if set(given) <= {whole, rest} and given and all(_is_number(given[key]) for key in given):
                parts = given.get(whole, 0), given.get(rest, 0)
                if all(isinstance(part, int) for part in parts):
                    return (parts[0] * 1_000_000_000 + parts[1]) / 1e9
                return float(parts[0]) + float(parts[1]) / 1e9
    raise FileFormatError(f"{where} is {shown(given)}, expected seconds, or a mapping with sec and nanosec")


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and abs(value) < 1e300 and math.isfinite(value)


def _numbers(given: Any, where: str, count: int) -> list[float]:
    """Return as many numbers as there are joints, or none."""
    if given is None or given == []:
        return []
    if not isinstance(given, list) or len(given) != count or not all(map(_is_number, given)):
        cut = (
            "; the file was cut short as it was printed, print it in full" if isinstance(given, list) and "..." in given else ""
        )
        raise FileFormatError(f"{where} is {shown(given)}, expected {count} finite numbers, one a joint{cut}")
    return given


def _order(robot: Robot, message: dict[str, Any], q: Array, notes: list[str]) -> list[int]:
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


def _note_unused(message: dict[str, Any], around: Sequence[dict[str, Any]], notes: list[str]) -> None:
    """Name what is in the file and means nothing here."""
    unused = [
        key for mapping in around for key, value in mapping.items()
        if key not in _KNOWN and key not in _HOLDS and key != "header" and value not in (None, [], {}, "", 0, 0.0)
    ]  # fmt: skip
    frame = _mapping(message.get("header"), "header").get("frame_id")
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
    return {str(name): float(value) for name, value in zip(names, values, strict=True) if _is_number(value)}


def _base(outer: dict[str, Any], begin: float, first: float) -> Series | None:
    """Return the base's poses from `base_path`, or from the transforms of a planar or floating joint."""
    path, several = outer.get("base_path"), outer.get("multi_dof_joint_trajectory")
    rows: list[tuple[float, list[float], str]] = []
    if isinstance(path, dict):
        for i, entry in enumerate(_listed(path.get("poses"), "base_path.poses")):
            where = f"base_path.poses[{i}]"
            pose = _member(entry, "pose", where)
            at = _seconds(_member(_member(entry, "header", where), "stamp", where), None, f"{where}.header.stamp") - begin
            rows.append((at, _pose(pose, "position", "orientation", where), where))
    elif isinstance(several, dict) and several.get("points"):
        names = several.get("joint_names")
        if not isinstance(names, list) or len(names) != 1:
            raise FileFormatError(f"multi_dof_joint_trajectory moves {shown(names)}, expected one joint, which holds the base")
        for i, point in enumerate(_listed(several["points"], "multi_dof_joint_trajectory.points")):
            where = f"multi_dof_joint_trajectory.points[{i}]"
            transforms = _member(point, "transforms", where)
            if not isinstance(transforms, list) or len(transforms) != 1:
                raise FileFormatError(f"{where}.transforms is {shown(transforms)}, expected one")
            at = _seconds(_member(point, "time_from_start", where), None, where)
            rows.append((at, _pose(transforms[0], "translation", "rotation", where), where))
    if not rows:
        return None
    places = [where for _, _, where in rows]
    poses = unit_poses(np.array([pose for _, pose, _ in rows]), places)
    return Series(t=np.array([at for at, _, _ in rows]) - first, values=poses, places=places)


def _twists(outer: dict[str, Any], begin: float, first: float) -> tuple[Series | None, Series | None]:
    """Return the base's rates from `base_twists`."""
    rows = []
    for i, entry in enumerate(_listed(outer.get("base_twists"), "base_twists")):
        where = f"base_twists[{i}]"
        twist = _member(entry, "twist", where)
        at = _seconds(_member(_member(entry, "header", where), "stamp", where), None, f"{where}.header.stamp") - begin
        rows.append((at, *(_vector(_member(twist, part, where), "xyz", where) for part in ("linear", "angular")), where))
    if not rows:
        return None, None
    t, places = np.array([row[0] for row in rows]) - first, [row[3] for row in rows]
    linear, angular = (Series(t=t, values=np.array([row[k] for row in rows]), places=places) for k in (1, 2))
    return linear, angular


def _listed(given: Any, where: str) -> list[Any]:
    if given is not None and not isinstance(given, list):
        raise FileFormatError(f"{where} is {shown(given)}, expected a list")
    return given or []


def _mapping(given: Any, where: str) -> dict[str, Any]:
    if given is not None and not isinstance(given, dict):
        raise FileFormatError(f"{where} is {shown(given)}, expected a mapping")
    return given or {}


def _member(mapping: Any, key: str, where: str) -> Any:
    if not isinstance(mapping, dict) or key not in mapping:
        raise FileFormatError(f"{where} is {shown(mapping)}, expected a mapping with '{key}'")
    return mapping[key]


def _pose(given: Any, position: str, orientation: str, where: str) -> list[float]:
    """Return a position and a quaternion wxyz; ROS names the parts x, y, z, w."""
    return [
        *_vector(_member(given, position, where), "xyz", where),
        *_vector(_member(given, orientation, where), "wxyz", where),
    ]


def _vector(given: Any, parts: str, where: str) -> list[float]:
    values = [_member(given, part, where) for part in parts]
    if not all(map(_is_number, values)):
        raise FileFormatError(f"{where} has {shown(given)}, expected finite numbers")
    return [float(value) for value in values]


# ---- A trajectory as messages of ROS 2, in JSON with the messages' own field names -----------------------------------
#
# Keys: `joint_trajectory`, a trajectory_msgs/JointTrajectory; and of a floating base `base_path`, a nav_msgs/Path
# whose poses are stamped with the time from the start, and `base_twists`, a list of geometry_msgs/TwistStamped:
# linear velocity in the inertial frame, angular velocity there too. Orientations are x, y, z, w by name, as ROS has
# them.


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
