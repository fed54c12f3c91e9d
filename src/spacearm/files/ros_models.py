"""ROS's trajectory messages as typed dictionaries, which pydantic checks: read in any spelling of ROS 1 or 2, written as ROS
2's.

Only what is used has a key; other keys are ignored, but in a point, where a mistyped key would change what is meant. A key with
null is one that is missing. Imported only when such a message is read.
"""

from __future__ import annotations

import math
from typing import Annotated, Any

from annotated_types import Len
from pydantic import BeforeValidator, Field, Strict, ValidationInfo
from typing_extensions import NotRequired, TypedDict

from spacearm.core.reading import require_known_keys
from spacearm.core.strict_model import wrong_form
from spacearm.files.stated_columns import PER_SECOND

_BEYOND = 1e300  # a number so large has no finite square, and differences of two may be infinite
_SPELLINGS = (("sec", "nanosec"), ("secs", "nsecs"), ("sec", "nsec"), ("seconds", "nanoseconds"))


def _is_number(given: Any) -> bool:
    return isinstance(given, (int, float)) and not isinstance(given, bool) and abs(given) < _BEYOND and math.isfinite(given)


def _time(given: Any) -> Any:
    """Take a number of seconds, or whole seconds and nanoseconds as ROS 1 or 2 names them."""
    if _is_number(given):
        return {"sec": given, "nanosec": 0}
    if isinstance(given, dict):
        for sec, nanosec in _SPELLINGS:
            if given and given.keys() <= {sec, nanosec} and all(map(_is_number, given.values())):
                return {"sec": given.get(sec, 0), "nanosec": given.get(nanosec, 0)}
    raise wrong_form("seconds, or a mapping with sec and nanosec")


def _time_in_unit(given: Any, info: ValidationInfo) -> Any:
    """Take a number in the unit that the context of validation gives under "unit"."""
    return _time(given / PER_SECOND[info.context["unit"] or "s"] if info.context and _is_number(given) else given)


def _known_keys(given: Any, info: ValidationInfo) -> Any:
    """Refuse a key that a point does not have; without rates and accelerations where only positions are asked for."""
    require_known_keys(given, list(_POINT))
    if isinstance(given, dict) and info.context and info.context["only_positions"]:
        return {key: value for key, value in given.items() if key not in ("velocities", "accelerations")}
    return given


Number = Annotated[float, Strict(), Field(gt=-_BEYOND, lt=_BEYOND)]
Text = Annotated[str, Strict()]


class Time(TypedDict):
    """`builtin_interfaces/Time` or `Duration`; of a number in a file, `sec` has the fraction too."""

    sec: int | float
    nanosec: int | float


def seconds(time: Time) -> float:
    """Return a time [s]."""
    if isinstance(time["sec"], int) and isinstance(time["nanosec"], int):
        return (time["sec"] * 1_000_000_000 + time["nanosec"]) / 1e9
    return float(time["sec"]) + float(time["nanosec"]) / 1e9


Stamp = Annotated[Time, BeforeValidator(_time)]


class Header(TypedDict):
    """`std_msgs/Header`."""

    stamp: Stamp
    frame_id: NotRequired[Any]


class LooseHeader(TypedDict):
    """The same where nobody needs the stamp."""

    stamp: NotRequired[Stamp | None]
    frame_id: NotRequired[Any]


class Vector3(TypedDict):
    """`geometry_msgs/Vector3` or `Point`."""

    x: Number
    y: Number
    z: Number


class Quaternion(TypedDict):
    """`geometry_msgs/Quaternion`."""

    x: Number
    y: Number
    z: Number
    w: Number


class Pose(TypedDict):
    """`geometry_msgs/Pose`."""

    position: Vector3
    orientation: Quaternion


class Transform(TypedDict):
    """`geometry_msgs/Transform`."""

    translation: Vector3
    rotation: Quaternion


class Twist(TypedDict):
    """`geometry_msgs/Twist`."""

    linear: Vector3
    angular: Vector3


class PoseStamped(TypedDict):
    """`geometry_msgs/PoseStamped`."""

    header: Header
    pose: Pose


class TwistStamped(TypedDict):
    """`geometry_msgs/TwistStamped`."""

    header: Header
    twist: Twist


class Path(TypedDict):
    """`nav_msgs/Path`."""

    header: NotRequired[Any]
    poses: NotRequired[list[PoseStamped] | None]


class MultiDOFPoint(TypedDict):
    """`trajectory_msgs/MultiDOFJointTrajectoryPoint` of one joint."""

    transforms: Annotated[list[Transform], Len(1, 1)]
    time_from_start: Stamp


class MultiDOFJointTrajectory(TypedDict):
    """`trajectory_msgs/MultiDOFJointTrajectory`."""

    joint_names: NotRequired[list[Text] | None]
    points: NotRequired[list[MultiDOFPoint] | None]


class Point(TypedDict):
    """`trajectory_msgs/JointTrajectoryPoint`."""

    positions: list[Number] | None
    velocities: NotRequired[list[Number] | None]
    accelerations: NotRequired[list[Number] | None]
    effort: NotRequired[Any]
    time_from_start: Annotated[Time, BeforeValidator(_time_in_unit)]


_POINT = frozenset(Point.__annotations__)


class JointTrajectory(TypedDict):
    """`trajectory_msgs/JointTrajectory`."""

    header: NotRequired[LooseHeader | None]
    joint_names: list[Text]
    points: list[Annotated[Point, BeforeValidator(_known_keys)]]


class OnABase(TypedDict):
    """What may stand around a JointTrajectory: where the base is, by either of two messages, and its rates."""

    base_path: NotRequired[Path | None]
    base_twists: NotRequired[list[TwistStamped] | None]
    multi_dof_joint_trajectory: NotRequired[MultiDOFJointTrajectory | None]
