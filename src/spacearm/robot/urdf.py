"""URDF files, read through yourdfpy.

yourdfpy is lenient: it repairs broken XML without a word, lets a later link of the same name win, takes NaN
for a number, and answers a missing attribute with a bare KeyError. So the XML is checked here first
(`urdf_check`), and yourdfpy is handed only what spacearm uses: links with their collision shapes, and joints.
"""

from __future__ import annotations

import io
import math
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from spacearm.core.checks import as_whole, shown, shown_error
from spacearm.core.errors import FileFormatError, RobotError, nearest
from spacearm.core.reading import located, read_bytes
from spacearm.robot.assembly import Assembly, assemble
from spacearm.robot.build_robot import require_collision
from spacearm.robot.link_masses import link_masses, notes_on_masses, shaped_links
from spacearm.robot.link_tree import Array, LinkJoint, LinkTree, Mimic
from spacearm.robot.model import Robot
from spacearm.robot.robot_xml import note_on_repairs, numbers_in, xacro_left_in, xml_document, xml_root

if TYPE_CHECKING:
    import yourdfpy

# ---- A URDF's XML, checked before anyone reads it: its root, its names, and every number spacearm will use -----------

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


# ---- URDF files, read through yourdfpy -------------------------------------------------------------------------------

CAPSULES_PER_SHAPE = 3
"""The default of how many capsules may enclose one cylinder, box or mesh."""

MOST_CAPSULES_PER_SHAPE = 100
"""How many that may be at most: the time to find them grows with the square of it."""


def load_urdf(
    path: str | os.PathLike[str],
    *,
    collision: Literal["urdf", "none"] = "urdf",
    capsules_per_shape: int = CAPSULES_PER_SHAPE,
    **choices: Any,
) -> Robot:
    """Read a robot from a URDF file; `load_robot` explains the options.

    Fixed joints are folded away, mimic joints share the degree of freedom of the joint they follow, and q has
    the file's order of joints as far as parents come first. A rotation within 1e-9 of a signed permutation is
    taken as one. Collision shapes become capsules that enclose them (`envelope` says how).

    Args:
        path: the file.
        collision: "urdf" takes the envelope from the collision shapes, "none" leaves the robot without one.
        capsules_per_shape: how many capsules may enclose one cylinder, box or mesh.
        choices: fields of `Assembly`.

    Raises:
        FileFormatError: no such file, or no URDF.
        RobotError: a robot that cannot be, or that spacearm does not support (planar and floating joints,
            loops); a mesh that cannot be read.
    """
    tree = urdf_tree(path, collision=collision, capsules_per_shape=capsules_per_shape)
    return assemble(tree, Assembly(**choices))


def urdf_tree(
    path: str | os.PathLike[str], *, collision: Literal["urdf", "none"], capsules_per_shape: int = CAPSULES_PER_SHAPE
) -> LinkTree:
    """Read a URDF file as a tree of links; arguments and errors as those of `load_urdf`."""
    require_collision(collision)
    count = as_whole("capsules_per_shape", capsules_per_shape, RobotError, at_least=1, at_most=MOST_CAPSULES_PER_SHAPE)
    content = read_bytes(path, what="a URDF")
    with located(path):
        root, repairs = xml_document(content, what="a URDF", root="robot")
        masses, unreadable = link_masses(root)
        soft = _soft_limits(root)
        shaped = shaped_links(root)
        urdf = _parsed(root, with_collision=collision == "urdf")
        joints = tuple(_joint(joint) for joint in urdf.joints)
        notes = (*note_on_repairs(repairs, "the URDF"), *notes_on_masses(unreadable), *_notes_on_soft_limits(joints, soft))
        capsules: list[tuple[str, Array, Array, float]] = []
        if collision == "urdf":
            from spacearm.robot.envelope import enclosed, link_shapes
            from spacearm.robot.envelope_report import chain_length, shape_notes

            shapes = {link.name: link_shapes(link, Path(path).parent) for link in urdf.links}
            capsules = [(link, one.a, one.b, one.radius) for link, own in shapes.items() for one in enclosed(own, count)]
            chain = chain_length((one.parent, one.child, float(np.linalg.norm(one.T_parent_child[:3, 3]))) for one in joints)
            notes = (*notes, *shape_notes(shapes, chain))
        return LinkTree(
            name=urdf.name,
            links=tuple(link.name for link in urdf.links),
            joints=joints,
            capsules=tuple(capsules),
            masses=masses,
            shaped=shaped,
            unreadable=unreadable,
            with_envelope=collision == "urdf",
            self_collision="computed",
            source=str(path),
            notes=notes,
        )


def parsed_urdf(path: str | os.PathLike[str]) -> yourdfpy.Robot:
    """Read a URDF file with yourdfpy, after a check of our own.

    Raises:
        FileFormatError: no such file, or no URDF.
    """
    content = read_bytes(path, what="a URDF")
    with located(path):
        return _parsed(xml_root(content, what="a URDF", root="robot"), with_collision=True)


def _parsed(root: Any, *, with_collision: bool) -> yourdfpy.Robot:
    import yourdfpy
    from lxml import etree  # pyright: ignore[reportAttributeAccessIssue] (compiled, no stubs)

    strip_and_check(root, with_collision=with_collision)
    try:
        urdf = yourdfpy.URDF.load(
            io.BytesIO(etree.tostring(root, encoding="utf-8")),
            build_scene_graph=False,
            load_meshes=False,
            filename_handler=yourdfpy.urdf.filename_handler_null,
        )
    except Exception as error:  # yourdfpy documents no exceptions: KeyError, IndexError, ValueError were seen
        raise FileFormatError(f"this URDF cannot be read ({shown_error(error)}); correct the file") from error
    return urdf.robot


def _soft_limits(root: Any) -> dict[str, tuple[float, float]]:
    """Return the soft limits (lower, upper) of the <safety_controller>s that state a range; 0 to 0 is urdfdom's default."""
    found = {}
    for joint in root.findall("joint"):
        element = joint.find("safety_controller")
        if element is None:
            continue
        ends = [numbers_in(element.get(f"soft_{end}_limit", "0")) for end in ("lower", "upper")]
        if all(len(end) == 1 for end in ends) and ends[0][0] < ends[1][0]:
            found[joint.get("name")] = (ends[0][0], ends[1][0])
    return found


def _notes_on_soft_limits(joints: tuple[LinkJoint, ...], soft: dict[str, tuple[float, float]]) -> tuple[str, ...]:
    """Say which soft limits are narrower than a joint's own: they are a controller's, and requests of others go beyond."""
    said = []
    for joint in joints:
        low, high = soft.get(joint.name, (-math.inf, math.inf))
        lower, upper = (-math.inf if joint.lower is None else joint.lower), (math.inf if joint.upper is None else joint.upper)
        if joint.kind in ("revolute", "prismatic", "continuous") and (low > lower or high < upper):
            said.append(f"{joint.name} ({low:.4g} to {high:.4g})")
    if not said:
        return ()
    return (
        f"soft limits of <safety_controller> are narrower than the limits, and are not followed: {', '.join(said)}; give "
        "position_limits= to keep them",
    )


def _joint(joint: yourdfpy.Joint) -> LinkJoint:
    limit: Any = joint.limit
    mimic: Any = joint.mimic
    stated = limit is not None
    return LinkJoint(
        name=joint.name,
        kind=str(joint.type),
        parent=str(joint.parent),
        child=str(joint.child),
        T_parent_child=np.eye(4) if joint.origin is None else joint.origin,
        axis=None if joint.type == "fixed" else joint.axis,
        lower=limit.lower if stated else None,
        upper=limit.upper if stated else None,
        velocity=limit.velocity if stated else None,
        mimic=None if mimic is None else Mimic(leader=mimic.joint, multiplier=mimic.multiplier, offset=mimic.offset),
    )
