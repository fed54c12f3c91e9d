"""URDF files: links with masses and collision shapes, and the joints between them, as a `LinkTree`.

The joints and the shapes are read by yourdfpy. It is lenient: it repairs broken XML without a word, lets a later link of the
same name win, takes NaN for a number, and answers a missing attribute with a bare KeyError. So the XML is checked first, and
yourdfpy is given only what spacearm uses: links with their collision shapes, and joints. Masses are read here; one that cannot
be read stops nobody, and is told in a note.
"""

from __future__ import annotations

import io
import math
import os
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal
from urllib.parse import unquote

import numpy as np

from spacearm.core.checks import as_whole, shown, shown_error
from spacearm.core.errors import FileFormatError, RobotError, nearest
from spacearm.core.reading import located, read_bytes
from spacearm.core.rotations import rotation_from_rpy
from spacearm.geometry.meshes import Mesh, read_mesh
from spacearm.robot.assembly import Assembly, assemble
from spacearm.robot.build_robot import require_collision
from spacearm.robot.link_tree import LONGEST, Array, LinkJoint, LinkMass, LinkTree, Mimic
from spacearm.robot.model import Robot, inertia_fault
from spacearm.robot.robot_xml import note_on_repairs, numbers_in, xacro_left_in, xml_document, xml_root

if TYPE_CHECKING:
    import yourdfpy

CAPSULES_PER_SHAPE = 3
"""The default of how many capsules may enclose one cylinder, box or mesh."""

MOST_CAPSULES_PER_SHAPE = 100
"""How many that may be at most: the time to find them grows with the square of it."""

OVERSIZED = 20.0
"""A mesh that is larger than the whole chain of joints by this factor is taken for one in millimetres."""

_KINDS = ("revolute", "continuous", "prismatic", "fixed", "floating", "planar")
_SHAPES = ("box", "cylinder", "sphere", "mesh")

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
"""By tag and attribute: how many numbers, whether it must be there, whether it may be negative."""

_WITH_COMMAS = ("size", "scale")  # there yourdfpy takes commas for spaces, as some exporters write them
_MOMENTS = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")

_OTHERWISE = 'or load with collision="none"'
_URI = re.compile(r"[A-Za-z][A-Za-z0-9+.-]*://|file:(?=/)", re.IGNORECASE)  # file:/a/b is one, too
_SMALLEST = 1e-9  # [m] the least size of a mesh
_LEAST = 2.0  # [m] smaller meshes are nobody's millimetres
_FLAT = 1e-9  # share of a shape's largest extent, below which it is a surface
_NAMED = 6  # links in a note


@dataclass(frozen=True, slots=True, eq=False)
class Shape:
    """A collision shape.

    Attributes:
        kind: "sphere", "cylinder", "box" or "mesh".
        size: (radius), (radius, length), the three edges, or nothing for a mesh [m].
        T_link_shape: (4, 4) [m].
        triangles: (k, 3, 3) corners of a mesh in its own frame [m]; else None.
        notes: what was assumed or applied in reading the mesh's file.
    """

    kind: str
    size: tuple[float, ...]
    T_link_shape: Array
    triangles: Array | None = None
    notes: tuple[str, ...] = ()


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
            from spacearm.robot.envelope import enclosed
            from spacearm.robot.urdf import chain_length, link_shapes, shape_notes

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


def link_shapes(link: yourdfpy.Link, directory: Path) -> list[Shape]:
    """Return the collision shapes of a link.

    Args:
        link: as yourdfpy read it.
        directory: of the URDF, where the search for meshes begins.

    Raises:
        RobotError: a mesh that is missing, cannot be read, or has no extent.
    """
    shapes = []
    for collision in link.collisions:
        T = np.eye(4) if collision.origin is None else np.asarray(collision.origin)
        geometry: Any = collision.geometry
        if geometry.sphere is not None:
            shapes.append(Shape("sphere", (float(geometry.sphere.radius),), T))
        elif geometry.cylinder is not None:
            shapes.append(Shape("cylinder", (float(geometry.cylinder.radius), float(geometry.cylinder.length)), T))
        elif geometry.box is not None:
            shapes.append(Shape("box", tuple(float(edge) for edge in geometry.box.size), T))
        else:
            scale = 1.0 if geometry.mesh.scale is None else geometry.mesh.scale
            mesh = _mesh(geometry.mesh.filename, link.name, directory)
            shapes.append(
                Shape("mesh", (), T, _with_extent(mesh.triangles * scale, geometry.mesh.filename, link.name), mesh.notes)
            )
    for shape in shapes:
        _require_within_reach(shape, link.name)
    return shapes


def _require_within_reach(shape: Shape, link: str) -> None:
    """Refuse lengths whose squares and cubes would no longer be numbers."""
    lengths = [*shape.size, *shape.T_link_shape[:3, 3]]
    if shape.triangles is not None:
        lengths += [shape.triangles.min(), shape.triangles.max()]
    largest = max(abs(float(length)) for length in lengths)
    if largest > LONGEST:
        raise RobotError(
            f"link '{link}' has a {shape.kind} with a length of {largest:g} m, expected {LONGEST:g} m or less; "
            f"check its units, {_OTHERWISE}"
        )


def _with_extent(triangles: Array, filename: str, link: str) -> Array:
    """Refuse a mesh that is one point: nothing would be kept clear of it."""
    size = float(np.ptp(triangles.reshape(-1, 3), axis=0).max())
    if size < _SMALLEST:
        raise RobotError(
            f"link '{link}' has the collision mesh '{filename}' with a size of {size:g} m, expected a surface; "
            f"check its scale, {_OTHERWISE}"
        )
    return triangles


def _mesh(filename: str, link: str, directory: Path) -> Mesh:
    path = found_mesh(filename, directory)
    if path is None:
        raise RobotError(
            f"link '{link}' has the collision mesh '{filename}', which is not there; put the file there, {_OTHERWISE}"
        )
    try:
        return read_mesh(path)
    except (OSError, ValueError) as error:
        raise RobotError(
            f"link '{link}' has the collision mesh '{filename}', which cannot be read ({error}); repair the file, {_OTHERWISE}"
        ) from None


def found_mesh(filename: str, directory: Path) -> Path | None:
    """Look for a mesh: beside the URDF, and for package:// in the directories above it as well.

    In a URI %20 may stand for a blank, and so on; a file of exactly that name goes first. Nothing is fetched from the web.
    """
    for name in dict.fromkeys((filename, unquote(filename) if _URI.match(filename) else filename)):
        for path in _candidates(name, directory):
            if os.path.isfile(path):  # which, unlike Path.is_file, answers False to a name that is too long
                return path
    return None


def _candidates(filename: str, directory: Path) -> Iterator[Path]:
    uri = _URI.match(filename)
    scheme, rest = (filename.partition(":")[0].lower(), filename[uri.end() :]) if uri else ("file", filename)
    if scheme in ("http", "https"):
        return  # a file here that only has the same name may be another one
    if scheme == "file":
        yield directory / (rest[len("localhost") :] if uri and rest.startswith("localhost/") else rest)
        return
    inside_package = Path(*Path(rest).parts[1:])
    for base in (directory, *directory.resolve().parents):
        yield base / rest
        yield base / inside_package


def chain_length(joints: Iterable[tuple[str, str, float]]) -> float:
    """Return the longest way from a root to a link along the joints' origins [m].

    Args:
        joints: parent link, child link, and the length of the joint's origin [m]; circles are cut.
    """
    above = {child: (parent, length) for parent, child, length in joints}
    longest = 0.0
    for link in above:
        at, total, passed = link, 0.0, set[str]()
        while at in above and at not in passed:
            passed.add(at)
            at, length = above[at]
            total += length
        longest = max(longest, total)
    return longest


def looks_like_millimetres(size: float, chain: float) -> bool:
    """Whether a mesh of a size [m] is too large for a robot whose joints reach so far [m]."""
    return size > _LEAST and 0 < chain * OVERSIZED < size


def shape_notes(shapes: Mapping[str, Sequence[Shape]], chain: float) -> tuple[str, ...]:
    """Return a sentence for each kind of thing that is to be known.

    Args:
        shapes: each link's collision shapes.
        chain: `chain_length` of the robot [m].
    """
    of_kind: dict[str, list[str]] = {}
    for link, own in shapes.items():
        for shape in own:
            for kind in _remarks(shape, chain):
                of_kind.setdefault(kind, []).append(link)
    return tuple(f"{kind}: {_listed(dict.fromkeys(links))}" for kind, links in of_kind.items())


def _remarks(shape: Shape, chain: float) -> list[str]:
    kinds = [f"mesh files, {note}" for note in shape.notes]
    if shape.triangles is None:
        if min(shape.size) <= 0:
            kinds.append(f"a {shape.kind} with an edge or radius of 0 m is enclosed as what is left of it, a line or a point")
        return kinds
    extent = np.ptp(shape.triangles.reshape(-1, 3), axis=0)
    if looks_like_millimetres(float(extent.max()), chain):
        kinds.append(
            f"meshes far larger than the {chain:.3g} m that the joints reach; if they are in millimetres, write "
            'scale="0.001 0.001 0.001"'
        )
    spread = np.linalg.svd(_corners(shape) - _corners(shape)[0], compute_uv=False)
    if spread[-1] <= _FLAT * spread[0]:
        kinds.append("a mesh that is flat has no inside, and is enclosed as a plate without thickness")
    return kinds


def _corners(shape: Shape) -> np.ndarray:
    assert shape.triangles is not None
    points = shape.triangles.reshape(-1, 3)
    return points[:: max(1, len(points) // 2000)]


def _listed(links: Iterable[str]) -> str:
    names = list(links)
    more = f", ... ({len(names)} links)" if len(names) > _NAMED else ""
    return ", ".join(f"'{name}'" for name in names[:_NAMED]) + more
