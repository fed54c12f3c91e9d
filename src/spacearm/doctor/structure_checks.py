"""Names and numbers of a URDF, and whether its links and joints form one tree.

A blank after a number looks harmless; urdfdom, and so ROS and Pinocchio, refuses the number and drops the whole <inertial> with
it: the link becomes massless. A blank before it does no harm.
"""

from __future__ import annotations

import re
from collections import Counter
from typing import Any

from spacearm.core.checks import shown
from spacearm.core.errors import nearest
from spacearm.doctor.diagnosis import KINDS, Chart, link_of, setting
from spacearm.robot.robot_xml import numbers_in, xacro_left_in

_LISTED = 6

BROKEN = ("name-twice", "link-unknown", "two-parents", "loop", "several-roots")
"""With one of these nobody knows where the links are."""


def look_at_structure(chart: Chart) -> None:
    """Find names that are missing or used twice, joints that join nothing, loops, several roots, and open mimics."""
    _names(chart)
    _kinds(chart)
    _ends(chart)
    _tree(chart)
    _mimics(chart)


def roots_of(chart: Chart) -> list[str]:
    """List the links that are no joint's child."""
    children = {link_of(joint, "child") for joint in chart.joints}
    return [link.get("name") for link in chart.links if link.get("name") not in children]


def _names(chart: Chart) -> None:
    root = chart.root
    if not root.get("name"):
        chart.found(
            "error",
            "name-missing",
            root,
            "<robot> has no name",
            expected='<robot name="...">',
            advice="add one",
            remedy=setting(root, "name", chart.path.stem or "robot"),
        )
    for tag in ("link", "joint"):
        elements = root.findall(tag)
        counts = Counter(element.get("name") for element in elements)
        seen: set[str] = set()
        for element in elements:
            name = element.get("name")
            if not name:
                chart.found("error", "name-missing", element, f"<{tag}> has no name", expected="a name", advice="add one")
            elif counts[name] > 1 and name in seen:
                chart.found(
                    "error",
                    "name-twice",
                    element,
                    f"the name is used by {counts[name]} {tag}s",
                    value=shown(name),
                    expected="each name once",
                    advice="rename this one, and what refers to it",
                )
            if name:
                seen.add(name)


def _kinds(chart: Chart) -> None:
    if all(joint.get("type") == "fixed" for joint in chart.joints):
        chart.found(
            "error",
            "nothing-moves",
            chart.root,
            "no joint moves, so nothing can be planned",
            expected="a revolute, continuous or prismatic joint",
            advice="give a joint its true type; exporters make joints fixed that they do not know",
        )
    for joint in chart.joints:
        kind = joint.get("type")
        if kind in ("floating", "planar"):
            _cannot_be_represented(chart, joint, kind)
        elif kind not in KINDS:
            chart.found(
                "error",
                "joint-type-unknown",
                joint,
                "states no type" if kind is None else "has a type that a URDF does not know",
                value="" if kind is None else shown(kind),
                expected="revolute, continuous, prismatic or fixed",
                advice=f"{nearest(str(kind), KINDS[:4])}; a ball joint is three revolute ones that meet in a point",
            )


def _cannot_be_represented(chart: Chart, joint: Any, kind: str) -> None:
    parent = link_of(joint, "parent")
    holds_base = kind == "floating" and roots_of(chart) == [parent]
    alone = [other for other in chart.joints if link_of(other, "parent") == parent] == [joint]
    link = next((link for link in chart.links if link.get("name") == parent), None)
    bare = link is not None and all(link.find(tag) is None for tag in ("inertial", "visual", "collision"))
    if holds_base and alone and bare:
        chart.found(
            "note",
            "joint-holds-the-base",
            joint,
            f"a floating joint from the empty link {shown(parent)} stands for a base that floats; spacearm holds it",
            value="floating",
            advice='load_robot(..., base="floating") lets the base float; the joint and the empty link may go',
            remedy=lambda: _without(joint, link),
        )
    elif roots_of(chart) == [parent]:
        chart.found(
            "note",
            "joint-held",
            joint,
            f"a {kind} joint between the root and the rest cannot be represented; spacearm holds it at its origin",
            value=kind,
            advice="replace it by a chain of revolute and prismatic joints, if it is to move",
        )
    else:
        chart.found(
            "error",
            "joint-not-supported",
            joint,
            f"a {kind} joint cannot be represented",
            value=kind,
            expected="revolute, continuous, prismatic or fixed",
            advice="replace it by a chain of these, or leave it out by an SRDF's group: it then stays where the file has it",
        )


def _without(joint: Any, link: Any) -> str:
    for element in (joint, link):
        before, parent = element.getprevious(), element.getparent()
        if element.tail and element.tail.strip():  # words between elements are none of ours to lose
            if before is None:
                parent.text = (parent.text or "") + element.tail
            else:
                before.tail = (before.tail or "") + element.tail
        parent.remove(element)
    return f"joint {shown(joint.get('name'))} and the empty link {shown(link.get('name'))} removed"


def _ends(chart: Chart) -> None:
    links = [link.get("name") for link in chart.links]
    for joint in chart.joints:
        for role in ("parent", "child"):
            name = link_of(joint, role)
            if not name:
                chart.found(
                    "error", "link-unknown", joint, f"names no {role} link", expected=f'<{role} link="..."/>', advice="add it"
                )
            elif name not in links:
                chart.found(
                    "error",
                    "link-unknown",
                    joint,
                    f"its {role} link does not exist",
                    value=shown(name),
                    expected="a link of the file",
                    advice=nearest(name, links),
                )


def _tree(chart: Chart) -> None:
    above: dict[str, Any] = {}
    for joint in chart.joints:
        child = link_of(joint, "child")
        if child and child in above:
            chart.found(
                "error",
                "two-parents",
                joint,
                f"link {shown(child)} is already the child of joint {shown(above[child].get('name'))}",
                expected="one parent for each link",
                advice="cut the loop at one of them; loops are not supported",
            )
        elif child:
            above[child] = joint
    for joint in _closing(above):
        chart.found(
            "error",
            "loop",
            joint,
            "joints go round in a loop that hangs on nothing",
            expected="a tree from one root",
            advice="cut the loop, or give one of its joints another parent",
        )
    roots = roots_of(chart)
    if len(roots) > 1 and not any(case.finding.code == "link-unknown" for case in chart.cases):  # which leaves links alone
        listed = ", ".join(map(shown, roots[:_LISTED])) + (", ..." if len(roots) > _LISTED else "")
        chart.found(
            "error",
            "several-roots",
            chart.root,
            f"{len(roots)} links have no parent joint",
            value=listed,
            expected="one root",
            advice="join the others to it with fixed joints",
        )


def _closing(above: dict[str, Any]) -> list[Any]:
    """Find one joint of every loop."""
    found: list[Any] = []
    settled: set[str] = set()
    for start in above:
        way: list[str] = []
        link = start
        while link in above and link not in settled and link not in way:
            way.append(link)
            link = link_of(above[link], "parent")
        if link in way:
            found.append(above[link])
        settled.update(way)
    return found


def _mimics(chart: Chart) -> None:
    moving = {joint.get("name"): joint for joint in chart.joints if joint.get("type") != "fixed"}
    for joint in moving.values():
        mimic = joint.find("mimic")
        if mimic is None:
            continue
        leader = mimic.get("joint")
        if leader not in moving:
            known = nearest(str(leader), [name for name in moving if name != joint.get("name")])
            chart.found(
                "error",
                "mimic-of-nothing",
                mimic,
                "follows what is no moving joint",
                value=shown(leader) if leader else "missing",
                expected="a joint that moves",
                advice=f"{known}; or drop <mimic>",
            )
        elif _goes_round(joint, moving):
            chart.found(
                "error",
                "mimic-circle",
                mimic,
                "follows itself, by way of others" if leader != joint.get("name") else "follows itself",
                value=shown(leader),
                expected="a joint that leads",
                advice="drop one <mimic> of the circle",
            )


def _goes_round(joint: Any, moving: dict[str, Any]) -> bool:
    at, passed = joint, set()
    while True:
        mimic = at.find("mimic")
        if mimic is None or mimic.get("joint") not in moving:
            return False
        passed.add(at.get("name"))
        at = moving[mimic.get("joint")]
        if at.get("name") in passed:
            return at is joint


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
