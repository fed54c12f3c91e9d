"""URDF files: links with masses and collision shapes, and the joints between them, as a `LinkTree`.

The XML is checked first: what spacearm uses, links with their collision shapes, and joints. A mass that cannot be read stops
nobody, and is told in a note.
"""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal

import numpy as np

from spacearm.core.checks import shown
from spacearm.core.errors import FileFormatError, nearest
from spacearm.core.reading import located, read_bytes
from spacearm.core.rotations import rotation_from_rpy
from spacearm.geometry.convex_pieces import PIECES
from spacearm.robot.assembly import Assembly, assemble
from spacearm.robot.build_robot import require_collision
from spacearm.robot.collision_shapes import SHAPES, WITH_COMMAS, Shape, chain_length, link_shapes, origin_of
from spacearm.robot.envelope import ShapeLimits, envelopes_of
from spacearm.robot.inertias import inertia_fault
from spacearm.robot.link_tree import LinkJoint, LinkMass, LinkTree, Mimic
from spacearm.robot.link_visuals import link_visuals
from spacearm.robot.model import Robot
from spacearm.robot.robot_xml import note_on_repairs, numbers_in, xacro_left_in, xml_document, xml_root

_KINDS = ("revolute", "continuous", "prismatic", "fixed", "floating", "planar")

_NUMBERS: dict[str, dict[str, tuple[tuple[int, ...], bool, bool]]] = {
    "origin": {"xyz": ((3,), False, True), "rpy": ((3,), False, True)},
    "axis": {"xyz": ((3,), False, True)},
    "limit": dict.fromkeys(("lower", "upper", "velocity", "effort"), ((1,), False, True)),
    "mimic": dict.fromkeys(("multiplier", "offset"), ((1,), False, True)),
    "box": {"size": ((3,), True, False)},
    "cylinder": {"radius": ((1,), True, False), "length": ((1,), True, False)},
    "capsule": {"radius": ((1,), True, False), "length": ((1,), True, False)},
    "sphere": {"radius": ((1,), True, False)},
    "mesh": {"scale": ((1, 3), False, True)},
}
"""By tag and attribute: how many numbers, whether it must be there, whether it may be negative."""

_MOMENTS = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")


def load_urdf(
    path: str | os.PathLike[str],
    *,
    collision: Literal["urdf", "none"] = "urdf",
    pieces_per_mesh: int | Mapping[str, int] = PIECES,
    excess: float | Mapping[str, float] | None = None,
    capsules_per_shape: int | None = None,
    **choices: Any,
) -> Robot:
    """Read a robot from a URDF file; `load_robot` explains the options.

    Fixed joints are folded away, mimic joints share the degree of freedom of the joint they follow, and q has
    the file's order of joints as far as parents come first. A rotation within 1e-9 of a signed permutation is
    taken as one. Collision shapes are taken as they are, meshes in convex pieces (`envelope` says how).

    Args:
        path: the file.
        collision: "urdf" takes the envelope from the collision shapes, "none" leaves the robot without one.
        pieces_per_mesh, excess, capsules_per_shape: as in `load_robot`.
        choices: fields of `Assembly`.

    Raises:
        FileFormatError: no such file, or no URDF.
        RobotError: a robot that cannot be, or that spacearm does not support (planar and floating joints,
            loops); a mesh that cannot be read.
    """
    limits = ShapeLimits(pieces=pieces_per_mesh, excess=excess, capsules=capsules_per_shape)
    tree = urdf_tree(path, collision=collision, limits=limits)
    return assemble(tree, Assembly(**choices))


def urdf_tree(
    path: str | os.PathLike[str],
    *,
    collision: Literal["urdf", "none"],
    limits: ShapeLimits | None = None,
) -> LinkTree:
    """Read a URDF file as a tree of links.

    Args:
        path: the file.
        collision: as in `load_urdf`.
        limits: how closely shapes are to be enclosed; None: as by default.

    Raises:
        FileFormatError, RobotError: as those of `load_urdf`.
    """
    require_collision(collision)
    content = read_bytes(path, what="a URDF")
    with located(path):
        root, repairs = xml_document(content, what="a URDF", root="robot")
        masses, unreadable = link_masses(root)
        soft = _soft_limits(root)
        shaped = shaped_links(root)
        visuals = link_visuals(root, Path(path).parent)
        strip_and_check(root, with_collision=collision == "urdf")
        joints = tuple(_joint(joint) for joint in root.findall("joint"))
        notes = (*note_on_repairs(repairs, "the URDF"), *notes_on_masses(unreadable), *_notes_on_soft_limits(joints, soft))
        chain = chain_length((one.parent, one.child, float(np.linalg.norm(one.T_parent_child[:3, 3]))) for one in joints)
        shapes = _shapes_by_link(root, Path(path).parent)
        found, said = envelopes_of(shapes, ShapeLimits() if limits is None else limits, chain=chain)
        return LinkTree(
            name=root.get("name"),
            links=tuple(link.get("name") for link in root.findall("link")),
            joints=joints,
            shapes=tuple((one.link, part) for one in found for part in one.parts),
            envelopes=found,
            masses=masses,
            visuals=visuals,
            shaped=shaped,
            unreadable=unreadable,
            with_envelope=collision == "urdf",
            self_collision="computed",
            source=str(path),
            notes=(*notes, *said),
        )


def collision_shapes(path: str | os.PathLike[str]) -> dict[str, list[Shape]]:
    """Return the collision shapes of a URDF file by link.

    Raises:
        FileFormatError: no such file, or no URDF.
        RobotError: a mesh that is missing.
    """
    content = read_bytes(path, what="a URDF")
    with located(path):
        root = xml_root(content, what="a URDF", root="robot")
        strip_and_check(root, with_collision=True)
        return _shapes_by_link(root, Path(path).parent)


def _shapes_by_link(root: Any, directory: Path) -> dict[str, list[Shape]]:
    return {link.get("name"): link_shapes(link, directory) for link in root.findall("link")}


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
        if len(shapes) != 1 or shapes[0].tag not in SHAPES:
            given = " and ".join(f"<{shape.tag}>" for shape in shapes) or "no geometry in it"
            raise FileFormatError(
                f"{where} has a collision shape with {given}, expected one of <{'>, <'.join(SHAPES)}>; "
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
        numbers = numbers_in(text.replace(",", " ") if attribute in WITH_COMMAS else text, finite=element.tag != "limit")
        if len(numbers) not in counts:
            raise FileFormatError(f"{place} is {shown(text)}, expected {wanted}{_advice(text)}")
        if attribute == "scale" and not all(numbers):
            raise FileFormatError(f"{place} is {shown(text)}, expected factors other than 0: a mesh without size is no shape")
        if not signed and min(numbers) < 0:
            raise FileFormatError(f"{place} is {shown(text)}, expected {wanted}, none below 0")


def _advice(text: str) -> str:
    return " separated by spaces" if "," in text else ""


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


def _joint(joint: Any) -> LinkJoint:
    mimic, axis = joint.find("mimic"), joint.find("axis")
    along = numbers_in("1 0 0" if axis is None else axis.get("xyz", "1 0 0"))
    return LinkJoint(
        name=joint.get("name"),
        kind=joint.get("type"),
        parent=joint.find("parent").get("link"),
        child=joint.find("child").get("link"),
        T_parent_child=origin_of(joint),
        axis=None if joint.get("type") == "fixed" else np.array(along),
        lower=_limit(joint, "lower"),
        upper=_limit(joint, "upper"),
        velocity=_limit(joint, "velocity"),
        mimic=None
        if mimic is None
        else Mimic(
            leader=mimic.get("joint"), multiplier=_number(mimic, "multiplier", 1.0), offset=_number(mimic, "offset", 0.0)
        ),
    )


def _limit(joint: Any, name: str) -> float | None:
    limit = joint.find("limit")
    return None if limit is None or limit.get(name) is None else _number(limit, name, 0.0)


def _number(element: Any, attribute: str, default: float) -> float:
    text = element.get(attribute)
    return default if text is None else numbers_in(text, finite=False)[0]


def link_masses(root: Any) -> tuple[tuple[LinkMass, ...], tuple[tuple[str, str], ...]]:
    """Read the <inertial> of every link that has one.

    Args:
        root: a URDF, an lxml element.

    Returns:
        The masses; and for each <inertial> that cannot be used, the link and what is wrong: it is left without a mass.
    """
    found, wrong = [], []
    for link in root.findall("link"):
        inertial = link.find("inertial")
        if inertial is None:
            continue
        try:
            found.append(_link_mass(link.get("name"), inertial))
        except ValueError as error:
            wrong.append((str(link.get("name")), str(error)))
    return tuple(found), tuple(wrong)


def notes_on_masses(wrong: tuple[tuple[str, str], ...]) -> tuple[str, ...]:
    """Say in one note which links are left without a mass, and why."""
    said = f"the masses of {len(wrong)} links cannot be read, which are left without one: "
    said += ", ".join(f"{link} ({why})" for link, why in wrong)
    return (said.replace("masses of 1 links", "mass of 1 link"),) if wrong else ()


def shaped_links(root: Any) -> tuple[str, ...]:
    """Return the names of the links of a URDF that have a shape, drawn or for collision; others are frames."""
    found = [link.get("name") for link in root.findall("link") if any(_has_shape(part) for part in link)]
    return tuple(name for name in found if name)


def _has_shape(part: Any) -> bool:
    return part.tag in ("visual", "collision") and part.find("geometry") is not None and len(part.find("geometry")) > 0


def _link_mass(link: str, inertial: Any) -> LinkMass:
    com, rpy = _numbers(inertial, "origin", "xyz", 3, "0 0 0"), _numbers(inertial, "origin", "rpy", 3, "0 0 0")
    (mass,) = _numbers(inertial, "mass", "value", 1, None)
    if mass < 0:
        raise ValueError(f"<mass value> is {mass:g}, below 0")
    if mass > 0 and inertial.find("inertia") is None:
        raise ValueError("<inertia> is missing")
    xx, xy, xz, yy, yz, zz = (_numbers(inertial, "inertia", moment, 1, "0")[0] for moment in _MOMENTS)
    inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    if mass == 0 and inertia.any():
        raise ValueError("<mass value> is 0, but <inertia> is not")
    if inertia_fault(inertia) == "negative":
        raise ValueError("<inertia> is that of no body: it has a negative principal moment")
    R = rotation_from_rpy(rpy)
    turned = R @ inertia @ R.T
    return LinkMass(link, mass, np.array(com), (turned + turned.T) / 2)


def _numbers(inertial: Any, tag: str, attribute: str, count: int, default: str | None) -> list[float]:
    element = inertial.find(tag)
    text = default if element is None else element.get(attribute, default)
    if text is None:
        raise ValueError(f"<{tag} {attribute}> is missing")
    numbers = numbers_in(text)
    if len(numbers) != count or not all(abs(number) < 1e12 for number in numbers):
        raise ValueError(f"<{tag} {attribute}> is {shown(text)}")
    return numbers
