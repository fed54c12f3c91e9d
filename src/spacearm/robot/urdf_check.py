"""A URDF's XML, checked before anyone reads it: its root, its names, and every number spacearm will use."""

from __future__ import annotations

from typing import Any

from spacearm.checks import shown
from spacearm.errors import FileFormatError, nearest
from spacearm.reading import located
from spacearm.robot.xml_root import numbers_in, xacro_left_in

_KINDS = ("revolute", "continuous", "prismatic", "fixed", "floating", "planar")
_SHAPES = ("box", "cylinder", "sphere", "mesh")

# tag -> attribute -> (how many numbers, must it be there, may it be negative)
_NUMBERS: dict[str, dict[str, tuple[tuple[int, ...], bool, bool]]] = {
    "origin": {"xyz": ((3,), False, True), "rpy": ((3,), False, True)},
    "axis": {"xyz": ((3,), False, True)},
    "limit": dict.fromkeys(("lower", "upper", "velocity", "effort"), ((1,), False, True)),
    "mimic": dict.fromkeys(("multiplier", "offset"), ((1,), False, True)),
    "box": {"size": ((3,), True, False)},
    "cylinder": {"radius": ((1,), True, False), "length": ((1,), True, False)},
    "sphere": {"radius": ((1,), True, False)},
    "mesh": {"scale": ((1, 3), False, True)},
}

_WITH_COMMAS = ("size", "scale")  # there yourdfpy takes commas for spaces, as some exporters write them


def strip_and_check(root: Any, *, with_collision: bool) -> None:
    """Leave in a URDF what spacearm uses, links with collision shapes, and joints, and check that.

    Args:
        root: an lxml element, changed in place.
        with_collision: whether collision shapes are to be kept, and checked.

    Raises:
        FileFormatError: no links, a name or number that is missing or none; line and place are named.
    """
    _strip(root, with_collision)
    for element in root.iter("*"):
        for attribute, value in element.attrib.items():
            if xacro_left_in(value):
                raise FileFormatError(
                    f"line {element.sourceline}: <{element.tag} {attribute}> is {shown(value)}, which xacro should have "
                    "replaced; expand the file first, as in: xacro arm.xacro > arm.urdf"
                )
    links, joints = root.findall("link"), root.findall("joint")
    if not root.get("name"):
        raise FileFormatError('<robot> has no name, expected <robot name="...">; add one')
    if not links:
        raise FileFormatError("<robot> has no <link>, expected links and joints; is this an SRDF rather than a URDF?")
    for element in (*links, *joints):
        with located(f"line {element.sourceline}"):
            if not element.get("name"):
                raise FileFormatError(f'<{element.tag}> has no name, expected <{element.tag} name="...">; add one')
            where = f"{element.tag} '{element.get('name')}'"
            _check_joint(element, where) if element.tag == "joint" else _check_link(element, where)


def _strip(root: Any, with_collision: bool) -> None:
    """Drop what is not used, so that nothing wrong in it can stop anybody."""
    for child in list(root):
        if child.tag not in ("link", "joint"):
            root.remove(child)
        elif child.tag == "link":
            for part in list(child):
                if not (with_collision and part.tag == "collision"):
                    child.remove(part)
        else:
            for part in list(child):
                if part.tag in ("dynamics", "calibration", "safety_controller"):
                    child.remove(part)


def _check_joint(joint: Any, where: str) -> None:
    kind = joint.get("type")
    if kind not in _KINDS:
        given = "no type" if kind is None else f"type {shown(kind)}, which is none"
        raise FileFormatError(f"{where} has {given}; {nearest(str(kind), _KINDS[:4])}")
    for role in ("parent", "child"):
        element = joint.find(role)
        if element is None or not element.get("link"):
            raise FileFormatError(f'{where} has no {role} link, expected <{role} link="..."/>; add it')
    mimic = joint.find("mimic")
    if mimic is not None and not mimic.get("joint"):
        raise FileFormatError(f'{where} mimics no joint, expected <mimic joint="..."/>; name one or drop <mimic>')
    for part in joint:
        _check_numbers(part, where)


def _check_link(link: Any, where: str) -> None:
    for collision in link.findall("collision"):
        geometry = collision.find("geometry")
        shapes = [] if geometry is None else list(geometry)
        if len(shapes) != 1 or shapes[0].tag not in _SHAPES:
            given = " and ".join(f"<{shape.tag}>" for shape in shapes) or "no geometry in it"
            raise FileFormatError(
                f"{where} has a collision shape with {given}, expected one of <{'>, <'.join(_SHAPES)}>; "
                'replace it, or load with collision="none"'
            )
        if shapes[0].tag == "mesh" and not shapes[0].get("filename"):
            raise FileFormatError(f'{where} has a mesh without a file, expected <mesh filename="..."/>; name one')
        for part in (*collision.findall("origin"), shapes[0]):
            _check_numbers(part, where)


def _check_numbers(element: Any, where: str) -> None:
    for attribute, (counts, needed, signed) in _NUMBERS.get(element.tag, {}).items():
        text = element.get(attribute)
        place = f"{where}: <{element.tag} {attribute}>"
        finite = "" if element.tag == "limit" else "finite "  # infinity says that there is none
        wanted = f"{' or '.join(map(str, counts))} {finite}number{'s' if max(counts) > 1 else ''}"
        if text is None:
            if needed:
                raise FileFormatError(f"{place} is missing, expected {wanted}; add it")
            continue
        numbers = numbers_in(text.replace(",", " ") if attribute in _WITH_COMMAS else text, finite=element.tag != "limit")
        if len(numbers) not in counts:
            raise FileFormatError(f"{place} is {shown(text)}, expected {wanted}{_advice(text)}")
        if attribute == "scale" and not all(numbers):
            raise FileFormatError(f"{place} is {shown(text)}, expected factors other than 0: a mesh without size is no shape")
        if not signed and min(numbers) < 0:
            raise FileFormatError(f"{place} is {shown(text)}, expected {wanted}, none below 0")


def _advice(text: str) -> str:
    return " separated by spaces" if "," in text else ""
