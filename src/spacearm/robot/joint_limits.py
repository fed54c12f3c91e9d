"""The limits of each degree of freedom, from those that every source states for its joints.

A joint's own limits are the narrowest of what the robot's file, MoveIt's joint_limits.yaml and the user say of it. MoveIt lets
that file replace what the URDF says; here the narrower of the two holds, and a note names the joints for which it asks for
more. Joints that move together share an entry of q: with the value m q + offset, limits of position become (limit - offset) /
m, those of rate and acceleration limit / |m|, and the narrowest of them all holds.
"""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from spacearm.core.checks import as_number, as_readonly, shown
from spacearm.core.errors import FileFormatError, RobotError, nearest
from spacearm.core.reading import YamlFile, complaint, read_text, yaml_of_others
from spacearm.robot.link_tree import LinkJoint, LinkTree, Mimic
from spacearm.robot.model import Robot

Array = NDArray[np.float64]

MEANS_NONE = 1e4
"""A limit of this size or more [rad, m, rad/s, m/s] says that there is none: no joint comes near, and exporters write 1e16, inf
or the largest number there is. 1e4 rad are 1,600 turns; a winch of 1,000 rad keeps its limit."""

_ROUNDING = 1e-12  # of limits that leave one value


def is_none(limit: float) -> bool:
    """Whether a limit's size says that there is none."""
    return not abs(limit) < MEANS_NONE


def usable_velocity(stated: float | None) -> float | None:
    """Return a velocity limit; None where the file states none, or what means none: 0, a number below, or a vast one.

    MoveIt too takes 0 for none, SDF a negative one and infinity.
    """
    return None if stated is None or stated <= 0 or is_none(stated) else stated


def narrowed(tree: LinkTree, position_limits: Mapping[str, Any] | None) -> LinkTree:
    """Narrow joints' ranges to those that the user gives.

    Args:
        tree: links and joints.
        position_limits: (lower, upper) [rad or m] by joint; a continuous joint gets them, too.

    Raises:
        RobotError: no such joint, no range, or one that has nothing in common with the file's.
    """
    if position_limits is None:
        return tree
    if not isinstance(position_limits, Mapping):
        given = shown(position_limits)
        raise RobotError(f"position_limits is {given}, expected a mapping from joint to range, as in {{'slide': (0, 0.8)}}")
    _require_known("position_limits", position_limits, tree)
    joints = []
    for joint in tree.joints:
        if joint.name in position_limits:
            where = f"position_limits[{shown(joint.name)}]"
            lower, upper = as_readonly(where, position_limits[joint.name], (2,), RobotError, advice="give (lower, upper)")
            if lower > upper:
                raise RobotError(f"{where} is {lower:g} to {upper:g}, expected the lower one first; exchange them")
            if joint.kind in ("revolute", "continuous", "prismatic"):
                joint = with_range(joint, float(lower), float(upper), where)
        joints.append(joint)
    said = ", ".join(f"{name} ({float(low):g} to {float(high):g})" for name, (low, high) in position_limits.items())
    return replace(tree, joints=tuple(joints), notes=(*tree.notes, f"position limits were narrowed to those given: {said}"))


def with_range(joint: LinkJoint, lower: float, upper: float, where: str) -> LinkJoint:
    """Narrow a joint's range [rad or m]; a continuous joint becomes a revolute one.

    Raises:
        RobotError: the two ranges have nothing in common.
    """
    if joint.kind == "continuous":
        return replace(joint, kind="revolute", lower=lower, upper=upper)
    low = lower if joint.lower is None else max(lower, joint.lower)
    high = upper if joint.upper is None else min(upper, joint.upper)
    if low > high and (joint.lower is None or joint.upper is None or joint.lower <= joint.upper):
        raise RobotError(
            f"{where} is {lower:g} to {upper:g}, which has nothing in common with the file's {joint.lower:g} to {joint.upper:g}"
            "; correct one of them"
        )
    return replace(joint, lower=low, upper=high)


def _require_known(what: str, names: Mapping[str, Any], tree: LinkTree) -> None:
    known = [joint.name for joint in tree.joints]
    for name in names:
        if name not in known:
            raise RobotError(f"{what} names joint {shown(name)}, which does not exist; {nearest(str(name), known)}")


def require_ceiling(what: str, given: Any, tree: LinkTree, unit: str) -> Any:
    """Check a limit that the user gives: a number for every joint, a mapping from joint to number, or an array (n,), one for
    each entry of q; None is none.

    Raises:
        RobotError: no such joint, or what is no number above 0.
    """
    if given is None:
        return None
    if isinstance(given, Mapping):
        _require_known(what, given, tree)
        return {name: as_number(f"{what}['{name}']", value, RobotError, above=0, unit=unit) for name, value in given.items()}
    if isinstance(given, (list, tuple)) or (isinstance(given, np.ndarray) and given.ndim > 0):
        array = as_readonly(what, given, (None,), RobotError)
        if not (array > 0).all():
            raise RobotError(f"{what} is {shown(array.tolist())}, expected numbers above 0 [{unit}]")
        return array
    return as_number(what, given, RobotError, above=0)


def joint_limits(
    moving: list[LinkJoint],
    leads: dict[str, Mimic],
    leaders: list[str],
    velocity_limit: Any = None,
    acceleration_limit: Any = None,
) -> tuple[Array, list[str]]:
    """Intersect, per degree of freedom, the limits of every joint that it moves.

    Args:
        moving: the joints that are not fixed.
        leads: by joint, what it follows; a leader follows itself.
        leaders: the joints whose values are q.
        velocity_limit, acceleration_limit: what the user gives, as `require_ceiling` returns it.

    Returns:
        Rows lower, upper, velocity, acceleration (4, n), and notes on what was assumed.

    Raises:
        RobotError: a joint without a limit that it needs, or limits that contradict each other.
    """
    n = len(leaders)
    low, high, speed, push, stated = (np.full(n, end) for end in (-math.inf, math.inf, math.inf, math.inf, math.inf))
    for joint in moving:
        lead = leads[joint.name]
        i, m, follows = leaders.index(lead.leader), lead.multiplier, lead.leader != joint.name
        lower, upper = _range(joint, follows)
        if m == 0.0:
            _require_still(joint, lead.offset, lower, upper)
            continue
        ends = sorted(((lower - lead.offset) / m, (upper - lead.offset) / m))
        low[i], high[i] = max(low[i], ends[0]), min(high[i], ends[1])
        for limit, value in (
            (speed, usable_velocity(joint.velocity)),
            (speed, _ceiling_of(joint.name, velocity_limit)),
            (stated, joint.acceleration),
            (push, _ceiling_of(joint.name, acceleration_limit)),
        ):
            limit[i] = min(limit[i], math.inf if value is None else value / abs(m))
    push = np.minimum(push, stated)
    for limit, ceiling, what in (
        (speed, velocity_limit, "velocity_limit"),
        (push, acceleration_limit, "acceleration_limit"),
    ):
        if isinstance(ceiling, np.ndarray):
            if ceiling.shape != (n,):
                raise RobotError(
                    f"{what} has {len(ceiling)} numbers, expected {n}: one for each of {', '.join(leaders)}; a mapping from "
                    "joint to number may name some of them"
                )
            limit[:] = np.minimum(limit, ceiling)
    _require_common_range(leaders, low, high)
    _require_velocities(moving, leads, leaders, speed)
    notes = _notes_on_none(moving, leads, leaders, velocity_limit)
    notes += _notes_on_acceleration(leaders, push, stated, acceleration_limit)
    push = np.where(np.isfinite(push), push, speed)
    for what, given in (("velocity_limit", velocity_limit), ("acceleration_limit", acceleration_limit)):
        idle = set(given) - {joint.name for joint in moving} if isinstance(given, Mapping) else ()
        if idle:
            notes.append(f"{what} names joints that do not move: {', '.join(sorted(idle))}")
    if velocity_limit is not None:
        notes.append(f"velocity limits were set to at most {_ceiling_text(velocity_limit, leaders)}")
    return np.array([low, high, speed, push]), notes


def greatest_multipliers(robot: Robot) -> Array:
    """Return (n,) how much further than q the joint goes that goes furthest: a limit of every joint, divided by it, is q's."""
    greatest = np.zeros(robot.dof)
    for joint in robot.joints:
        greatest[joint.dof] = max(greatest[joint.dof], abs(joint.multiplier))
    return np.where(greatest > 0, greatest, 1.0)


def _ceiling_of(name: str, ceiling: Any) -> float | None:
    if isinstance(ceiling, Mapping):
        return ceiling.get(name)
    return None if isinstance(ceiling, np.ndarray) else ceiling


def _range(joint: LinkJoint, follows: bool) -> tuple[float, float]:
    if joint.kind == "continuous" or (follows and joint.lower is None and joint.upper is None):
        return -math.inf, math.inf
    if joint.lower is None or joint.upper is None:
        missing = " and ".join(end for end in ("lower", "upper") if getattr(joint, end) is None)
        way_out = ", or make it continuous if it turns without end" if joint.kind == "revolute" else ""
        raise RobotError(f"joint '{joint.name}' ({joint.kind}) states no {missing} limit; add it{way_out}")
    if joint.upper < joint.lower:
        raise RobotError(
            f"joint '{joint.name}' has lower limit {joint.lower:g} above its upper limit {joint.upper:g}; exchange them"
        )
    if joint.lower >= MEANS_NONE or joint.upper <= -MEANS_NONE:
        raise RobotError(
            f"joint '{joint.name}' is limited to {joint.lower:g} to {joint.upper:g}, expected a range near 0; correct it"
        )
    lower = -math.inf if is_none(joint.lower) else joint.lower
    upper = math.inf if is_none(joint.upper) else joint.upper
    if joint.kind == "prismatic" and not follows and math.isinf(upper - lower):
        raise RobotError(
            f"joint '{joint.name}' slides from {joint.lower:g} to {joint.upper:g} m, which means without limit, expected less "
            f"than {MEANS_NONE:g} m; state the true range, or give position_limits={{'{joint.name}': (lower, upper)}}, or "
            "fixed= to lock it"
        )
    return lower, upper


def _require_still(joint: LinkJoint, value: float, lower: float, upper: float) -> None:
    if not lower <= value <= upper:
        raise RobotError(
            f"joint '{joint.name}' stays at {value:g} (its mimic multiplier is 0), expected "
            f"{lower:g} to {upper:g}; change the offset or the limits"
        )


def _require_common_range(leaders: list[str], low: Array, high: Array) -> None:
    """Refuse limits of joints that move together where no value satisfies all; rounding may leave a single one."""
    for i, name in enumerate(leaders):
        if low[i] > high[i]:
            if low[i] - high[i] <= _ROUNDING * max(1.0, abs(low[i])):
                low[i] = high[i] = (low[i] + high[i]) / 2
                continue
            raise RobotError(
                f"joint '{name}' and its mimics have limits that exclude each other (from {low[i]:g} to "
                f"{high[i]:g}), expected a common range; widen one of them"
            )


def _require_velocities(moving: list[LinkJoint], leads: dict[str, Mimic], leaders: list[str], speed: Array) -> None:
    for i, name in enumerate(leaders):
        if speed[i] < np.finfo(np.float64).tiny:
            raise RobotError(
                f"joint '{name}' may move by {speed[i]:g} [rad/s or m/s] only, since one that follows it goes so much further; "
                "correct the <mimic multiplier> or the velocity limits"
            )
    without = [joint for joint in moving if joint.name in leaders and not np.isfinite(speed[leaders.index(joint.name)])]
    if not without:
        return
    first = without[0]
    given = "no velocity limit" if first.velocity is None else f"velocity limit {first.velocity:g}, which means none"
    others = [joint.name for joint in without[1:]]
    also = f" (so do {', '.join(others[:8])}{', ...' if len(others) > 8 else ''})" if others else ""
    raise RobotError(
        f"joint '{first.name}' has {given}, expected more than 0 and less than {MEANS_NONE:g}{also}; state it in the file or "
        "give velocity_limit="
    )


def _notes_on_none(moving: list[LinkJoint], leads: dict[str, Mimic], leaders: list[str], velocity_limit: Any) -> list[str]:
    """Tell which stated limits were taken for none."""
    endless, one_sided, slow = [], [], []
    for joint in moving:
        lower, upper = _range(joint, leads[joint.name].leader != joint.name)
        if joint.kind != "continuous" and joint.lower is not None and math.isinf(upper - lower):
            (endless if math.isinf(lower) and math.isinf(upper) else one_sided).append(joint.name)
        if velocity_limit is not None and joint.name in leaders and usable_velocity(joint.velocity) is None:
            slow.append(joint.name)
    notes = []
    bound = f"position limits of {MEANS_NONE:g} rad or more mean none"
    if endless:
        notes.append(f"{bound}: without end turn{'s' if len(endless) == 1 else ''} {', '.join(endless)}")
    if one_sided:
        notes.append(f"{bound}: without end to one side turn{'s' if len(one_sided) == 1 else ''} {', '.join(one_sided)}")
    if slow:
        notes.append(f"no velocity limit, or one that means none, is stated for {', '.join(slow)}: velocity_limit holds")
    return notes


def _notes_on_acceleration(leaders: list[str], push: Array, stated: Array, given: Any) -> list[str]:
    notes = []
    if given is not None and (push < stated).any():
        notes.append(f"acceleration limits were set to at most {_ceiling_text(given, leaders)}")
    unstated = [name for i, name in enumerate(leaders) if not np.isfinite(push[i])]
    if unstated:
        notes.append(f"no acceleration limit is stated for {', '.join(unstated)}: full speed in one second is assumed")
    return notes


def _ceiling_text(ceiling: Any, leaders: list[str]) -> str:
    if isinstance(ceiling, np.ndarray):
        ceiling = dict(zip(leaders, ceiling.tolist(), strict=True))
    return ", ".join(f"{v:g} ({k})" for k, v in ceiling.items()) if isinstance(ceiling, Mapping) else f"{ceiling:g}"


_WHAT = "MoveIt's joint limits"
_USED = ("max_velocity", "max_acceleration", "min_position", "max_position")
_NOT_USED = ("max_jerk", "max_deceleration", "max_effort")


def with_joint_limits_file(tree: LinkTree, path: str | os.PathLike[str]) -> LinkTree:
    """Narrow a tree's limits to those of MoveIt's joint_limits.yaml.

    Read for each joint: `max_velocity`, `max_acceleration`, `min_position`, `max_position`, and the `has_..._limits` that
    switch them off. MoveIt lets the file replace what the URDF says. Here the narrower of the two holds: a motor does not grow
    stronger in a file.

    Raises:
        FileFormatError: no such file, or another one.
        RobotError: limits that have nothing in common with the robot's, or none of whose joints the robot has.
    """
    file, place = _located(path)
    given = file.value
    for part in place:
        given = given[part]
    joints = {joint.name: joint for joint in tree.joints}
    unknown = [str(name) for name in given if name not in joints]
    if given and len(unknown) == len(given):
        raise RobotError(
            f"{path} names no joint of robot '{tree.name}'; {nearest(unknown[0], joints)}; give the file of that robot"
        )
    wider: list[str] = []
    unused: set[str] = set()
    for name, entry in given.items():
        with file.at(*place, name):
            entry = _entry(name, entry)
            if name in joints and joints[name].kind in ("revolute", "continuous", "prismatic"):
                joints[name] = _narrowed(joints[name], entry, wider)
                unused |= {key for key in _NOT_USED if _stated(entry, key) is not None}
    notes = [*tree.notes, f"limits of joints were narrowed to those of {path}"]
    if wider:
        notes.append(f"{path} allows more than the robot's file, whose limits hold, for {', '.join(wider)}")
    if unknown:
        notes.append(f"{path} names joints that the robot does not have and were ignored: {', '.join(unknown)}")
    if unused:
        notes.append(f"{path} states {', '.join(sorted(unused))}, which is not used; a limit of jerk is given to the planner")
    scaling = _scaling(file, place)
    if scaling:
        notes.append(f"{path} states {', '.join(scaling)}, which MoveIt applies to requests: not used here")
    return replace(tree, joints=tuple(joints.values()), notes=tuple(notes))


def _scaling(file: YamlFile, place: tuple[str, ...]) -> list[str]:
    """List the default scaling factors beside the limits that slow the robot down, as in "...: 0.1"."""
    around = file.value
    for part in place[:-1]:
        around = around[part]
    keys = ("default_velocity_scaling_factor", "default_acceleration_scaling_factor")
    return [f"{key}: {shown(around[key])}" for key in keys if key in around and around[key] != 1]


def _located(path: str | os.PathLike[str]) -> tuple[YamlFile, tuple[str, ...]]:
    """Read the file; return it and where the joints are: ROS 2 wraps them for its parameter server."""
    text = read_text(path, what=_WHAT)
    for place in (
        ("joint_limits",),
        ("robot_description_planning", "joint_limits"),
        ("/**", "ros__parameters", "robot_description_planning", "joint_limits"),
    ):
        try:
            file = yaml_of_others(text, path, key=place[0], what=_WHAT)
        except FileFormatError:
            if place == ("joint_limits",) and "robot_description_planning" not in text:
                raise
            continue
        value: Any = file.value
        for part in place:
            value = value.get(part) if isinstance(value, dict) else None
        if isinstance(value, dict):
            return file, place
    raise FileFormatError(f"{path} has no joint_limits, expected {_WHAT}: a mapping from joints to limits")


def _narrowed(joint: LinkJoint, entry: Any, wider: list[str]) -> LinkJoint:
    where = f"joint_limits.{joint.name}"
    lower, upper = (_stated(entry, key) for key in ("min_position", "max_position"))
    if lower is not None and upper is not None and not (is_none(lower) and is_none(upper)):
        if lower > upper:
            raise RobotError(f"{where} has min_position {lower:g} above max_position {upper:g}; exchange them")
        more = joint.kind != "continuous" and None not in (joint.lower, joint.upper)
        if more and (lower < (joint.lower or 0.0) or upper > (joint.upper or 0.0)):
            wider.append(f"{joint.name} (position)")
        joint = with_range(joint, lower, upper, where)
    velocity = usable_velocity(_stated(entry, "max_velocity"))
    acceleration = _stated(entry, "max_acceleration")
    acceleration = acceleration if acceleration is not None and 0 < acceleration < math.inf else None
    for field, value, known in (
        ("velocity", velocity, usable_velocity(joint.velocity)),
        ("acceleration", acceleration, joint.acceleration),
    ):
        if value is not None and known is not None and value > known:
            wider.append(f"{joint.name} ({field})")
        if value is not None:
            joint = replace(joint, **{field: value if known is None else min(value, known)})
    return joint


def _stated(entry: Any, key: str) -> float | None:
    """Return a limit that the file states and does not switch off."""
    return None if getattr(entry, _switch_of(key)) is False else getattr(entry, key)


def _switch_of(key: str) -> str:
    """Return the key that switches a limit off, as has_velocity_limits does max_velocity."""
    return f"has_{key[4:]}_limits"


def _entry(name: object, given: Any) -> Any:
    """Check what the file states of a joint; null states nothing.

    Raises:
        FileFormatError: no mapping, or a limit that is no number.
    """
    from pydantic import ValidationError

    try:
        return _entry_model().model_validate({} if given is None else given)
    except ValidationError as error:
        raise FileFormatError(complaint(error, f"joint_limits.{name}")[1]) from None


@cache
def _entry_model() -> Any:
    """Return the pydantic model of an entry; made when it is first needed, for pydantic takes long to import."""
    from pydantic import AfterValidator, Strict, create_model

    from spacearm.core.strict_model import wrong_form

    def no_nan(number: float) -> float:
        if math.isnan(number):
            raise wrong_form("a number")
        return number

    limit: Any = Annotated[float, Strict(), AfterValidator(no_nan)]
    keys = (*_USED, *_NOT_USED)
    limits: Any = dict.fromkeys(keys, (limit | None, None))
    switches: Any = dict.fromkeys(map(_switch_of, keys), (Any, True))
    return create_model("JointLimits", **limits, **switches)
