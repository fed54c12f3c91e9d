"""Where a motion is to end."""

# pyright: reportUnnecessaryIsInstance=false
# What callers pass is checked at run time too.

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import KW_ONLY, dataclass
from typing import TYPE_CHECKING, Any, Literal, TypeAlias, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm.core.checks import Frozen, as_name, as_number, as_readonly, as_transform, keep, shown
from spacearm.core.errors import ProblemError, nearest
from spacearm.core.exact import length

Array = NDArray[np.float64]

_FURTHEST = 1e6  # [m]
_MOST_TURNED = 1e4  # [rad or m]
_AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class ConfigurationGoal(Frozen):
    """The motion ends in one configuration.

    Attributes:
        q: (n,) joint positions [rad or m].
        tolerance: how far each joint may end from it [rad or m]: a number for all, or (n,). The configuration itself is
            taken where it is free of collision, else one nearby.
        shortest: whether joints that turn without end may end whole turns away from q, wherever the start is nearest, as
            MoveIt has it. Otherwise q is taken at its word: 7 rad from the start is more than a turn.

    Raises:
        ProblemError: not a row of finite numbers, or a tolerance below 0.
    """

    q: Array
    _: KW_ONLY
    tolerance: float | Array = 0.0
    shortest: bool = False

    if TYPE_CHECKING:  # the constructor takes more types than the fields have

        def __init__(self, q: ArrayLike, *, tolerance: ArrayLike = 0.0, shortest: bool = False) -> None: ...

    def __post_init__(self) -> None:
        q = as_readonly("the goal configuration", self.q, (None,), ProblemError)
        keep(self, q=q, tolerance=_joint_tolerance(self.tolerance, len(q)), shortest=_yes_or_no("shortest", self.shortest))


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class ConfigurationsGoal(Frozen):
    """The motion ends in any of several configurations, whichever is reached best.

    Attributes:
        q: (g, n) joint positions [rad or m], a row for each.
        tolerance: how far each joint may end from them [rad or m]: a number for all, or (n,).
        shortest: whether joints that turn without end may end whole turns away, as in `ConfigurationGoal`.

    Raises:
        ProblemError: not rows of finite numbers, none at all, or a tolerance below 0.
    """

    q: Array
    _: KW_ONLY
    tolerance: float | Array = 0.0
    shortest: bool = False

    if TYPE_CHECKING:

        def __init__(self, q: ArrayLike, *, tolerance: ArrayLike = 0.0, shortest: bool = False) -> None: ...

    def __post_init__(self) -> None:
        q = as_readonly("the table of goal configurations", self.q, (None, None), ProblemError, advice="give a row for each")
        if not len(q):
            raise ProblemError("the goal configurations are none, expected at least one; give a row for each")
        keep(self, q=q, tolerance=_joint_tolerance(self.tolerance, q.shape[1]), shortest=_yes_or_no("shortest", self.shortest))


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class PositionGoal(Frozen):
    """The motion ends with the origin of a frame at a point, in any orientation.

    Attributes:
        position: (3,) in the inertial frame [m]: the base frame at the start, unless the problem has a `base_start`.
        tolerance: the greatest distance from it that counts as reached [m], above 0.
        frame: name of the frame; None is the robot's tip, and `Problem` fills it in.

    Raises:
        ProblemError: not three finite numbers, or a tolerance that is not above 0.
    """

    position: Array
    _: KW_ONLY
    tolerance: float = 1e-3
    frame: str | None = None

    if TYPE_CHECKING:

        def __init__(self, position: ArrayLike, *, tolerance: float = 1e-3, frame: str | None = None) -> None: ...

    def __post_init__(self) -> None:
        position = as_readonly("the goal position", self.position, (3,), ProblemError)
        tolerance = as_number("the goal's tolerance", self.tolerance, ProblemError, above=0, at_most=_FURTHEST, unit="m")
        _require_near(position)
        keep(self, position=position, tolerance=tolerance, frame=_frame(self.frame))

    @property
    def tolerances(self) -> tuple[float, float]:
        """The greatest distance [m] and angle [rad] that count as reached: any angle does."""
        return self.tolerance, math.pi


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class PoseGoal(Frozen):
    """The motion ends with a frame at a position and in an orientation, or in any that differ by a turn about one axis.

    Attributes:
        pose: (4, 4), T_w_frame at the end, inertial frame [m]: the base frame at the start, unless the problem has a
            `base_start`. `spacearm.pose` makes one.
        position_tolerance: the greatest distance of the origins that counts as reached [m], above 0.
        orientation_tolerance: the greatest angle of turn between the orientations that counts as reached [rad], above 0;
            with a free axis, between the two directions of that axis. From pi on, every orientation does.
        frame: name of the frame; None is the robot's tip, and `Problem` fills it in.
        free_axis: "x", "y", "z" or a direction (3,) in the frame about which it may be turned by any angle; kept as a
            vector of length 1. None: no such axis.

    Raises:
        ProblemError: a pose that is none, tolerances that are not above 0, or an axis of length 0.
    """

    pose: Array
    _: KW_ONLY
    position_tolerance: float = 1e-3
    orientation_tolerance: float = math.radians(0.5)
    frame: str | None = None
    free_axis: Array | None = None

    if TYPE_CHECKING:

        def __init__(
            self,
            pose: ArrayLike,
            *,
            position_tolerance: float = 1e-3,
            orientation_tolerance: float = math.radians(0.5),
            frame: str | None = None,
            free_axis: Literal["x", "y", "z"] | ArrayLike | None = None,
        ) -> None: ...

    def __post_init__(self) -> None:
        position = as_number("position_tolerance", self.position_tolerance, ProblemError, above=0, at_most=_FURTHEST, unit="m")
        orientation = as_number(
            "orientation_tolerance", self.orientation_tolerance, ProblemError, above=0, at_most=_MOST_TURNED, unit="rad"
        )
        pose = as_transform("the goal pose", self.pose, ProblemError)
        _require_near(pose[:3, 3])
        keep(
            self,
            pose=pose,
            position_tolerance=position,
            orientation_tolerance=orientation,
            frame=_frame(self.frame),
            free_axis=None if self.free_axis is None else _axis(self.free_axis),
        )

    @property
    def position(self) -> Array:
        """Where the frame's origin is to be, (3,) in the inertial frame [m]."""
        return self.pose[:3, 3]

    @property
    def tolerances(self) -> tuple[float, float]:
        """The greatest distance [m] and angle [rad] that count as reached."""
        return self.position_tolerance, self.orientation_tolerance


JointGoal: TypeAlias = ConfigurationGoal | ConfigurationsGoal
"""A goal that says where the joints are to be."""

SpaceGoal: TypeAlias = PositionGoal | PoseGoal
"""A goal that says where a frame is to be, not where the joints are."""

Goal: TypeAlias = JointGoal | SpaceGoal
"""Any of the goals."""


def goal_as_dict(goal: Goal) -> dict[str, Any]:
    """Return a goal as plain values, as plan files keep it; `goal_from_dict` makes the same goal of them again.

    The first key tells the kind: `configuration` (n,), `configurations` (g, n), `position` (3,) or `pose` (4, 4); the
    others are the goal's attributes.
    """
    if isinstance(goal, PositionGoal):
        return {"position": goal.position.tolist(), "tolerance": goal.tolerance, "frame": goal.frame}
    if isinstance(goal, PoseGoal):
        return {
            "pose": goal.pose.tolist(),
            "position_tolerance": goal.position_tolerance,
            "orientation_tolerance": goal.orientation_tolerance,
            "frame": goal.frame,
            "free_axis": None if goal.free_axis is None else goal.free_axis.tolist(),
        }
    tolerance = goal.tolerance.tolist() if isinstance(goal.tolerance, np.ndarray) else goal.tolerance
    key = "configuration" if isinstance(goal, ConfigurationGoal) else "configurations"
    return {key: goal.q.tolist(), "tolerance": tolerance, "shortest": goal.shortest}


def goal_from_dict(values: Mapping[str, Any]) -> Goal:
    """Make a goal of plain values; see `goal_as_dict` for the keys. Only the first, the kind's own, is needed.

    Raises:
        ProblemError: no kind or several, a key that the kind does not have, or values that its goal refuses.
    """
    if not isinstance(values, dict):
        raise ProblemError(f"goal is {shown(values)}, expected a mapping with one of {', '.join(_KINDS)}")
    given = [key for key in _KINDS if key in values]
    if len(given) != 1:
        raise ProblemError(f"goal has {' and '.join(given) or 'no target'}, expected one of {', '.join(_KINDS)}")
    make, keys = _KINDS[given[0]]
    for key in values:
        if key not in (given[0], *keys):
            raise ProblemError(f"goal has key {shown(key)}, which a goal {given[0]} does not take; {nearest(str(key), keys)}")
    return make(values[given[0]], **{key: value for key, value in values.items() if key != given[0]})


_KINDS: dict[str, tuple[Callable[..., Goal], tuple[str, ...]]] = {
    "configuration": (ConfigurationGoal, ("tolerance", "shortest")),
    "configurations": (ConfigurationsGoal, ("tolerance", "shortest")),
    "position": (PositionGoal, ("tolerance", "frame")),
    "pose": (PoseGoal, ("position_tolerance", "orientation_tolerance", "frame", "free_axis")),
}


def _frame(name: object) -> str | None:
    return None if name is None else as_name("the goal's frame", name, ProblemError)


def _require_near(position: Array) -> None:
    far = float(np.abs(position).max())
    if far > _FURTHEST:
        raise ProblemError(f"the goal is {far:.3g} m away, expected at most {_FURTHEST:g} m; check its units")


def _yes_or_no(name: str, value: object) -> bool:
    if not isinstance(value, (bool, np.bool_)):
        raise ProblemError(f"{name} is {shown(value)}, expected True or False")
    return bool(cast("bool", value))


def _joint_tolerance(value: ArrayLike, dof: int) -> float | Array:
    name = "the goal's tolerance"
    if not _is_table(value):
        return as_number(name, value, ProblemError, at_least=0, at_most=_MOST_TURNED, unit="rad or m")
    each = as_readonly(name, value, (dof,), ProblemError, advice="give one number, or one per joint")
    wrong = ~((each >= 0) & (each <= _MOST_TURNED))
    if wrong.any():
        worst = int(np.argmax(wrong))
        raise ProblemError(f"{name}[{worst}] is {each[worst]:g}, expected a number from 0 up to {_MOST_TURNED:g} [rad or m]")
    return each


def _is_table(value: object) -> bool:
    return isinstance(value, (list, tuple)) or (isinstance(value, np.ndarray) and value.ndim > 0)


def _axis(value: str | ArrayLike) -> Array:
    if isinstance(value, str):
        if value not in _AXES:
            raise ProblemError(f"free_axis is {shown(value)}, expected 'x', 'y', 'z' or a direction (3,) in the frame")
        value = _AXES[value]
    axis = as_readonly("free_axis", value, (3,), ProblemError, advice="or give 'x', 'y' or 'z'")
    if not 1e-150 < math.hypot(*axis) < 1e150:
        raise ProblemError(f"free_axis is {axis.tolist()}, expected a direction; give 'x', 'y', 'z' or a vector")
    size = length(axis)
    return axis if abs(size - 1) <= 1e-15 else as_readonly("free_axis", axis / size, (3,), ProblemError)
