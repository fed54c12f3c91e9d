"""Limits, axes and origins of joints."""

from __future__ import annotations

import math
from typing import Any

from spacearm.core.checks import shown
from spacearm.doctor.diagnosis import Chart, child_of, number_of, numbers_of, setting, unit_of, written
from spacearm.robot.joint_limits import MEANS_NONE, is_none
from spacearm.robot.robot_xml import numbers_in

MOST_TURNS = 2
"""A revolute joint that turns further than this to one side is taken for one whose limits are in degrees, if these would be
no more than that."""

FASTEST = 20.0
"""A faster joint [rad/s or m/s] is taken for a mistake."""

FARTHEST = 50.0
"""Lengths beyond this [m] are taken for millimetres."""

_UNIT_LENGTH = 1e-3
_ANGLES = 2 * math.pi + 0.01


def look_at_limits(chart: Chart) -> None:
    """Find limits that are missing or cannot be, and axes and origins that are doubtful."""
    for joint in chart.joints:
        kind = joint.get("type")
        if kind in ("revolute", "prismatic", "continuous"):
            if kind != "continuous" and joint.find("mimic") is None:
                _range(chart, joint)
            elif kind != "continuous" and joint.find("limit") is not None and _stated(joint) == (True, True):
                _order(chart, joint)
            if joint.find("mimic") is None:
                _velocity(chart, joint)
            _effort(chart, joint)
            _axis(chart, joint)
        _origin(chart, joint)
    _notes(chart)


def _stated(joint: Any) -> tuple[bool, bool]:
    limit = joint.find("limit")
    return limit is not None and limit.get("lower") is not None, limit is not None and limit.get("upper") is not None


def _range(chart: Chart, joint: Any) -> None:
    stated = _stated(joint)
    if all(stated):
        _order(chart, joint)
        return
    missing = " and ".join(end for end, there in zip(("lower", "upper"), stated, strict=True) if not there)
    revolute = joint.get("type") == "revolute"
    chosen = chart.choices.range_limit
    other = number_of(joint.find("limit"), "lower" if stated[0] else "upper") if any(stated) else None
    fits = not any(stated) or (other is not None and (other < chosen if stated[0] else other > -chosen))
    way_out = "; a joint that turns without end is continuous" if revolute else "; nobody can guess how far it slides"
    chart.found(
        "error",
        "limit-missing",
        joint,
        f"states no {missing} limit, which by the URDF's rule is 0",
        expected=f"<limit lower upper> [{unit_of(joint)}]",
        advice=f"state it{way_out}",
        remedy=(lambda: _limited(joint, chosen)) if revolute and fits else None,
    )


def _limited(joint: Any, chosen: float) -> str:
    limit = child_of(joint, "limit")
    said = []
    for end, value in (("lower", -chosen), ("upper", chosen)):
        if limit.get(end) is None:
            said.append(setting(limit, end, written(value))())
    return "; ".join(said) + f" (chosen: up to {written(chosen)} rad)"


def _limit_of(limit: Any, attribute: str) -> float | None:
    """Read a limit, which may be infinite; None if it is not there or cannot be read."""
    numbers = [] if limit is None else numbers_in(limit.get(attribute, ""), finite=False)
    return numbers[0] if len(numbers) == 1 else None


def _order(chart: Chart, joint: Any) -> None:
    limit = joint.find("limit")
    lower, upper = _limit_of(limit, "lower"), _limit_of(limit, "upper")
    if lower is None or upper is None:
        return
    value = f"{lower:g} to {upper:g} {unit_of(joint)}"
    if lower > upper:
        chart.found(
            "error",
            "limits-exchanged",
            limit,
            "its lower limit is above its upper limit",
            value=value,
            expected="lower below upper",
            advice="exchange them",
            remedy=lambda: _exchanged(limit),
        )
    elif lower == upper:
        chart.found(
            "warning",
            "limits-equal",
            limit,
            "its limits are one value, so it cannot move; exporters write 0 for what they do not know",
            value=value,
            expected="lower below upper",
            advice="state the true range, or make the joint fixed",
        )
    elif is_none(lower) or is_none(upper):
        _means_none(chart, joint, lower, upper)
    elif joint.get("type") == "revolute" and max(abs(lower), abs(upper)) > 360 * MOST_TURNS + 0.01:
        chart.found(
            "warning",
            "limits-in-doubt",
            limit,
            f"turns {max(abs(lower), abs(upper)) / (2 * math.pi):.0f} times to one side, were these radians",
            value=value,
            expected="radians",
            advice="state the true range, or make the joint continuous",
        )
    elif joint.get("type") == "revolute" and max(abs(lower), abs(upper)) > 2 * math.pi * MOST_TURNS + 0.01:
        chart.found(
            "warning",
            "limits-in-degrees",
            limit,
            f"turns more than {MOST_TURNS} times to one side: its limits look like degrees",
            value=value,
            expected="radians",
            advice=f"write {math.radians(lower):.4g} and {math.radians(upper):.4g}, or make the joint continuous",
            remedy=lambda: _in_radians(limit, ("lower", "upper")),
        )
    elif joint.get("type") == "prismatic" and max(abs(lower), abs(upper)) > FARTHEST:
        chart.found(
            "warning",
            "limits-in-millimetres",
            limit,
            f"slides further than {FARTHEST:g} m: its limits look like millimetres",
            value=value,
            expected="metres",
            advice=f"write {lower / 1e3:g} and {upper / 1e3:g}, if so",
        )


def _means_none(chart: Chart, joint: Any, lower: float, upper: float) -> None:
    """Report limits so large that they say that there is none."""
    limit, unit = joint.find("limit"), unit_of(joint)
    both, revolute = is_none(lower) and is_none(upper), joint.get("type") == "revolute"
    words = " and ".join(shown(limit.get(end)) for end in ("lower", "upper") if is_none(_limit_of(limit, end) or 0.0))
    infinite = "; urdfdom (ROS, Pinocchio) cannot read an infinite one" if math.inf in (abs(lower), abs(upper)) else ""
    follows = joint.find("mimic") is not None
    if follows:
        what, advice = "its limits mean that there is none; those of the joint that it follows hold", "state the true ones"
    elif revolute and both:
        what, advice = "its limits mean that there is none, and spacearm takes it for continuous", 'write type="continuous"'
    elif revolute:
        what, advice = "one of its limits means that there is none", "state the true one"
    else:
        what, advice = "its limits mean that there is none; nobody can guess how far it slides", "state the true range"
    chart.found(
        "note" if follows else "warning" if revolute else "error",
        "limits-none",
        limit,
        what + infinite,
        value=words,
        expected=f"less than {MEANS_NONE:g} {unit}",
        advice=advice + ("" if revolute or follows else ", or give load_robot(position_limits=...)"),
        remedy=(lambda: _continuous(joint, limit)) if revolute and both and not follows else None,
    )


def _continuous(joint: Any, limit: Any) -> str:
    said = (
        f"{setting(joint, 'type', 'continuous')()}; limits {shown(limit.get('lower'))} and {shown(limit.get('upper'))} removed"
    )
    for end in ("lower", "upper"):
        limit.attrib.pop(end)
    return said


def _exchanged(limit: Any) -> str:
    lower, upper = limit.get("lower"), limit.get("upper")
    limit.set("lower", upper)
    limit.set("upper", lower)
    return f"<limit lower upper>: {lower} and {upper} exchanged"


def _in_radians(element: Any, attributes: tuple[str, ...]) -> str:
    said = []
    for attribute in attributes:
        degrees = element.get(attribute)
        radians = " ".join(written(math.radians(float(word))) for word in degrees.split())
        said.append(setting(element, attribute, radians)())
    return "; ".join(said) + " (taken for degrees)"


def _velocity(chart: Chart, joint: Any) -> None:
    limit, unit = joint.find("limit"), unit_of(joint)
    stated = limit is not None and limit.get("velocity") is not None
    velocity = _limit_of(limit, "velocity")
    if stated and velocity is None:
        return  # it cannot be read, which has been said
    chosen = chart.choices.velocity_limit
    expected = f"more than 0 [{unit}/s]"

    def choose() -> str:
        return f"{setting(child_of(joint, 'limit'), 'velocity', written(chosen))()} (chosen: {chosen:g} {unit}/s)"

    if velocity is None or velocity == 0:
        chart.found(
            "error",
            "velocity-zero" if stated else "velocity-missing",
            joint,
            "has the velocity limit 0, which says that it cannot move" if stated else "states no velocity limit",
            value="0" if stated else "",
            expected=expected,
            advice='state it in <limit velocity="...">, or give load_robot(velocity_limit=...)',
            remedy=choose,
        )
    elif velocity < 0:
        chart.found(
            "error",
            "velocity-negative",
            limit,
            "has a velocity limit below 0, by which SDF means none, and MoveIt the number without its sign",
            value=f"{velocity:g}",
            expected=expected,
            advice="state the true one, or give load_robot(velocity_limit=...)",
            remedy=choose,
        )
    elif is_none(velocity):
        infinite = "; urdfdom (ROS, Pinocchio) cannot read an infinite one" if math.isinf(velocity) else ""
        chart.found(
            "error",
            "velocity-none",
            limit,
            f"its velocity limit means that there is none{infinite}",
            value=f"{velocity:g}",
            expected=f"less than {MEANS_NONE:g} [{unit}/s]",
            advice="state the true one, or give load_robot(velocity_limit=...)",
            remedy=choose,
        )
    elif velocity > FASTEST:
        chart.found(
            "warning",
            "velocity-in-doubt",
            limit,
            f"is faster than {FASTEST:g} {unit}/s; are these {'millimetres' if unit == 'm' else 'degrees'} per second?",
            value=f"{velocity:g} {unit}/s",
            expected=f"{unit}/s",
            advice=f"write {velocity / 1e3 if unit == 'm' else math.radians(velocity):.4g}, if so",
        )


def _effort(chart: Chart, joint: Any) -> None:
    limit = joint.find("limit")
    if limit is None:
        return
    effort, unit = _limit_of(limit, "effort"), "N" if joint.get("type") == "prismatic" else "N m"
    if limit.get("effort") is None:
        chart.found(
            "warning",
            "effort-missing",
            limit,
            "states no effort limit; spacearm does not need it, urdfdom (ROS, Pinocchio) refuses the joint",
            expected=f"0 or more [{unit}]",
            advice='state it in <limit effort="...">, 0 if nobody knows',
            remedy=setting(limit, "effort", "0"),
        )
    elif effort is not None and effort < 0:
        chart.found(
            "warning",
            "effort-negative",
            limit,
            "has an effort limit below 0, by which SDF means none; spacearm does not use it",
            value=f"{effort:g}",
            expected=f"more than 0 [{unit}]",
            advice="state the true one",
        )
    elif effort is not None and math.isinf(effort):
        chart.found(
            "warning",
            "effort-none",
            limit,
            "has an infinite effort limit, which urdfdom (ROS, Pinocchio) cannot read",
            value=shown(limit.get("effort")),
            expected=f"more than 0 [{unit}]",
            advice="state the true one",
        )
    elif effort == 0:
        chart.found(
            "note",
            "effort-zero",
            limit,
            "has the effort limit 0; spacearm does not use it, a simulator may take it for a joint without a motor",
            value="0",
            expected=f"more than 0 [{unit}]",
            advice="state the true one",
        )


def _axis(chart: Chart, joint: Any) -> None:
    element = joint.find("axis")
    axis = numbers_of(element, "xyz", 3, default=())
    if axis is None:
        return
    if not axis:
        chart.found(
            "note",
            "axis-missing",
            joint,
            "states no axis, which by the URDF's rule is x",
            expected='<axis xyz="...">',
            advice="state it",
            remedy=lambda: setting(child_of(joint, "axis"), "xyz", "1 0 0")(),
        )
        return
    length = math.hypot(*axis)
    if length == 0:
        chart.found(
            "error",
            "axis-zero",
            element,
            "its axis has no direction",
            value=element.get("xyz"),
            expected="a direction such as 0 0 1",
            advice="give the true one",
        )
    elif abs(length - 1) > _UNIT_LENGTH and math.isfinite(length):
        chart.found(
            "note",
            "axis-not-unit",
            element,
            f"its axis has length {length:g}",
            value=element.get("xyz"),
            expected="length 1",
            advice="spacearm scales it by itself; others may take it for a gear",
            remedy=setting(element, "xyz", " ".join(written(x / length) for x in axis)),
        )


def _origin(chart: Chart, joint: Any) -> None:
    origin = joint.find("origin")
    xyz, rpy = numbers_of(origin, "xyz", 3), numbers_of(origin, "rpy", 3)
    if xyz is not None and math.hypot(*xyz) > FARTHEST:
        chart.found(
            "warning",
            "origin-in-millimetres",
            origin,
            f"lies {math.hypot(*xyz):g} m from its parent: are these millimetres?",
            value=origin.get("xyz"),
            expected="metres",
            advice=f"write {' '.join(f'{x / 1e3:g}' for x in xyz)}, if so",
        )
    if rpy is not None and max(map(abs, rpy)) > _ANGLES:
        chart.found(
            "warning",
            "origin-in-degrees",
            origin,
            "is turned by more than a whole turn: its rpy looks like degrees",
            value=origin.get("rpy"),
            expected="radians",
            advice=f"write {' '.join(f'{math.radians(x):.4g}' for x in rpy)}, if so",
            remedy=lambda: _in_radians(origin, ("rpy",)),
        )


def _notes(chart: Chart) -> None:
    moving = [joint for joint in chart.joints if joint.get("type") in ("revolute", "prismatic", "continuous")]
    endless = [joint for joint in moving if joint.get("type") == "continuous"]
    if endless:
        names = ", ".join(shown(joint.get("name")) for joint in endless[:6]) + (", ..." if len(endless) > 6 else "")
        chart.found(
            "note",
            "continuous",
            endless[0],
            f"turn{'s' if len(endless) == 1 else ''} without end; a limit of a continuous joint's position is not kept",
            place=f"joint{'s' if len(endless) > 1 else ''} {names}",
            advice="make it revolute, with limits, if cables turn with it",
        )
    if moving:
        chart.found(
            "note",
            "acceleration-unstated",
            chart.root,
            "a URDF cannot state acceleration limits; full speed within one second is assumed",
            advice="give load_robot(acceleration_limit=...) [rad/s^2 or m/s^2], or `acceleration_limit:` in a problem file",
        )
