"""Numbers that are none, or that only some readers can read.

A blank after a number looks harmless; urdfdom, and so ROS and Pinocchio, refuses the number and drops the whole
<inertial> with it: the link becomes massless. A blank before it does no harm.
"""

from __future__ import annotations

import re
from typing import Any

from spacearm.checks import shown
from spacearm.robot.doctor.chart import Chart, setting
from spacearm.robot.xml_root import numbers_in, xacro_left_in

# tag -> attribute -> (how many numbers, must it be there)
_NUMBERS: dict[str, dict[str, tuple[tuple[int, ...], bool]]] = {
    "origin": {"xyz": ((3,), False), "rpy": ((3,), False)},
    "axis": {"xyz": ((3,), False)},
    "limit": dict.fromkeys(("lower", "upper", "velocity", "effort"), ((1,), False)),
    "mimic": dict.fromkeys(("multiplier", "offset"), ((1,), False)),
    "mass": {"value": ((1,), True)},
    "inertia": {
        **dict.fromkeys(("ixx", "iyy", "izz"), ((1,), True)),
        **dict.fromkeys(("ixy", "ixz", "iyz"), ((1,), False)),
    },
    "box": {"size": ((3,), True)},
    "cylinder": {"radius": ((1,), True), "length": ((1,), True)},
    "sphere": {"radius": ((1,), True)},
    "mesh": {"scale": ((1, 3), False)},
}
_PLACES = (
    "link/inertial/*",
    "link/collision/origin",
    "link/collision/geometry/*",
    "link/visual/origin",
    "link/visual/geometry/*",
    "joint/*",
)
_SIZES = ("size", "radius", "length")
_DECIMAL_COMMA = re.compile(r"[-+]?\d*,\d+(?:[eE][-+]?\d+)?")


def look_at_numbers(chart: Chart) -> None:
    """Find every number of links and joints that cannot be read, or not by everybody."""
    for place in _PLACES:
        for element in chart.root.findall(place):
            for attribute, (counts, needed) in _NUMBERS.get(element.tag, {}).items():
                _look_at(chart, element, attribute, counts, needed)
    _expressions(chart)


def _expressions(chart: Chart) -> None:
    """Find names and paths that xacro should have replaced; numbers are told one by one."""
    for top in (*chart.root.findall("link"), *chart.root.findall("joint")):
        for element in top.iter("*"):
            for attribute, text in element.attrib.items():
                if xacro_left_in(text) and attribute not in _NUMBERS.get(element.tag, {}):
                    chart.found(
                        "error",
                        "xacro-expression",
                        element,
                        f"<{element.tag} {attribute}> holds what xacro should have replaced",
                        value=shown(text),
                        expected="plain text",
                        advice="expand the file first, as in: xacro arm.xacro > arm.urdf",
                    )


def _look_at(chart: Chart, element: Any, attribute: str, counts: tuple[int, ...], needed: bool) -> None:
    text = element.get(attribute)
    where = f"<{element.tag} {attribute}>"
    wanted = f"{' or '.join(map(str, counts))} finite number{'s' if max(counts) > 1 else ''}"
    if text is None:
        if needed:
            chart.found("error", "number-missing", element, f"{where} is missing", expected=wanted, advice="add it")
        return
    numbers = numbers_in(text, finite=element.tag != "limit")  # infinite limits are told by who looks at limits
    if len(numbers) in counts:
        _look_at_value(chart, element, attribute, text, numbers)
        return
    meant = _meant(text, counts)
    remedy = setting(element, attribute, meant) if meant else None
    chart.found(
        "error",
        "not-a-number",
        element,
        f"{where} cannot be read",
        value=shown(text),
        expected=wanted,
        advice=_advice(text, meant),
        remedy=remedy,
    )


def _look_at_value(chart: Chart, element: Any, attribute: str, text: str, numbers: list[float]) -> None:
    where = f"<{element.tag} {attribute}>"
    if len(numbers) == 1 and text != text.rstrip():
        physics = element.tag in ("mass", "inertia")
        chart.found(
            "error" if physics else "warning",
            "number-with-blank",
            element,
            f"{where} ends in a blank, which urdfdom (ROS, Pinocchio) refuses"
            + (": it drops the whole <inertial>, and the link has no mass there" if physics else ""),
            value=shown(text),
            expected=shown(text.strip()),
            advice="remove the blank",
            remedy=setting(element, attribute, text.strip()),
        )
    if attribute in _SIZES and min(numbers) <= 0:
        below = min(numbers) < 0
        chart.found(
            "error" if below else "warning",
            "size-not-positive",
            element,
            f"{where} has a length {'below 0' if below else 'of 0'}",
            value=shown(text),
            expected="above 0 [m]",
            advice="give the true size, or remove the shape",
        )


def _meant(text: str, counts: tuple[int, ...]) -> str:
    """Guess what was meant where commas stand for points or for blanks; "" if it is not plain."""
    if counts == (1,) and _DECIMAL_COMMA.fullmatch(text.strip()):
        return text.strip().replace(",", ".")
    parted = " ".join(text.replace(",", " ").split())
    return parted if max(counts) > 1 and len(numbers_in(parted)) in counts else ""


def _advice(text: str, meant: str) -> str:
    if xacro_left_in(text):
        return "expand the file first, as in: xacro arm.xacro > arm.urdf"
    if meant:
        return f"write {shown(meant)}"
    return "correct it"
