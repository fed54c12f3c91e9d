"""Robots as YAML: the format of the built-in ones, and of any other arm.

Key by key::

    spacearm-robot: 1          # format and version
    name: my_arm               # for people
    notes: [...]               # optional sentences: where the numbers are from, what was assumed
    base: floating             # the base, unless a problem says otherwise: fixed (default) or floating
    tip: hand                  # the link that is the end effector; optional where there is one chain
    link_radius: 0.05          # optional: the radius of capsules that state none [m]
    joints:
      - name: elbow            # unique
        kind: revolute         # revolute, continuous (turns without end), prismatic or fixed
        parent: upper_arm      # a link; links exist by being named, and one, the base, is no joint's child
        child: forearm         # the link that the joint moves
        xyz: [0, 0.6, 0]       # origin of the child's frame in the parent's at value 0 [m]; default 0 0 0
        rpy: [0, 0, 1.57]      # its orientation: turns about the parent's fixed x, y, z [rad]; default 0 0 0
        rpy_deg: [0, 0, 90]    #   or in degrees
        axis: [0, 0, 1]        # direction of the axis in the child's frame; any joint but fixed needs it
        lower: -1.5            # limits [rad, or m for a prismatic joint]; revolute and prismatic need them
        upper: 1.5
        lower_deg: -90         #   or in degrees
        upper_deg: 90
        velocity: 1.0          # limit [rad/s or m/s]
        acceleration: 1.0      # limit [rad/s^2 or m/s^2]; default: full speed within one second
        mimic: {joint: shoulder, multiplier: -1, offset: 0}   # follows another joint; default 1 and 0
    capsules:                  # optional: what encloses the links; the segment's ends in the link's frame [m]
      - {link: forearm, from: [0, 0, 0], to: [0, 0.4, 0], radius: 0.05}
    boxes:                     # optional: boxes on the links
      - {link: panel, size: [3, 6, 0.1], xyz: [0, 4, 0], rpy_deg: [0, 0, 0], rounding: 0}
                               #   edges and centre [m]; rpy [rad] instead of rpy_deg; rounding: all within it belongs to it [m]
    shapes:                    # optional: shapes of any kind; xyz, rpy, rpy_deg and rounding as those of boxes, default 0
      - {link: base, box: {size: [1, 1, 2], xyz: [0, 0, 1]}}
      - {link: base, cylinder: {radius: 0.4, length: 1, rpy_deg: [0, 90, 0]}}      # about its middle, along its z [m]
      - {link: forearm, sphere: {xyz: [0, 0, 0], radius: 0.1}}
      - {link: forearm, capsule: {from: [0, 0, 0], to: [0, 0.4, 0], radius: 0.05}}
      - {link: hand, polytope: {vertices: [[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0], [0, 0, 0.1]]}}   # the hull of points [m]
    masses:                    # optional: of links, each once
      - {link: forearm, mass: 12, com: [0, 0.2, 0], inertia: [0.2, 0.1, 0.2, 0, 0, 0]}
                               #   [kg]; centre of mass in the link's frame [m], default 0 0 0; moments about that centre along
                               #   the axes of the link's frame: the matrix's entries xx, yy, zz, xy, xz, yz [kg m^2]
    configurations:            # optional: named ones
      - {name: home, q: [0, 0.5]}        # a value for each joint that moves and follows no other, in the order of joints
      - {name: out, q_deg: [0, 90]}      #   or in degrees where all of them turn
    self_collision: none       # optional: computed, or the pairs of links that must keep clear: [[base, forearm], ...]

A link's frame is that of the joint whose child it is. Imported only when such a file is read.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, Strict, field_validator

from spacearm.core.checks import as_number, as_readonly, as_whole, shown
from spacearm.core.errors import RobotError, SceneError, nearest
from spacearm.core.reading import YamlFile
from spacearm.core.rotations import rotation_from_rpy
from spacearm.core.strict_model import Number, StrictModel, wrong_form
from spacearm.geometry.convex_cores import moved_shape
from spacearm.geometry.shapes import Box, Capsule, ConvexShape, Cylinder, Polytope, Sphere
from spacearm.robot.collision_shapes import listed
from spacearm.robot.envelope import Enclosure, LinkEnclosure, ShapeLimits, link_enclosure, notes_on_excess
from spacearm.robot.inertias import require_possible_inertia
from spacearm.robot.link_shapes import LinkCapsule
from spacearm.robot.link_tree import LONGEST, LinkJoint, LinkMass, LinkTree, Mimic

Array = NDArray[np.float64]

_MOST = 1000  # capsules around one box

Text = Annotated[str, Strict()]


class MimicModel(StrictModel):
    """A joint that follows another."""

    joint: Text
    multiplier: Number = 1.0
    offset: Number = 0.0


class JointModel(StrictModel):
    """A joint between two links."""

    name: Text
    kind: Literal["revolute", "continuous", "prismatic", "fixed"]
    parent: Text
    child: Text
    xyz: list[Number] = [0.0, 0.0, 0.0]  # noqa: RUF012 (pydantic copies defaults)
    rpy: list[Number] | None = None
    rpy_deg: list[Number] | None = None
    axis: list[Number] | None = None
    lower: Number | None = None
    upper: Number | None = None
    lower_deg: Number | None = None
    upper_deg: Number | None = None
    velocity: Number | None = None
    acceleration: Number | None = None
    mimic: MimicModel | None = None


class CapsuleModel(StrictModel):
    """A capsule on a link."""

    link: Text
    start: list[Number] = Field(alias="from")
    end: list[Number] = Field(alias="to")
    radius: Number | None = None


class PlacedModel(StrictModel):
    """A shape with a place and a rounding."""

    xyz: list[Number] = [0.0, 0.0, 0.0]  # noqa: RUF012
    rpy: list[Number] | None = None
    rpy_deg: list[Number] | None = None
    rounding: Number = 0.0


class SizedModel(PlacedModel):
    """A box about its own origin."""

    size: list[Number]


class BoxModel(SizedModel):
    """A box on a link."""

    link: Text
    count: int | None = Field(default=None, alias="capsules", strict=True)


class CylinderModel(PlacedModel):
    """A cylinder about its own origin, along its z."""

    radius: Number
    length: Number


class PolytopeModel(PlacedModel):
    """The convex hull of points."""

    vertices: list[list[Number]]


class SphereModel(StrictModel):
    """A ball."""

    xyz: list[Number] = [0.0, 0.0, 0.0]  # noqa: RUF012
    radius: Number


class RodModel(StrictModel):
    """A capsule."""

    start: list[Number] = Field(alias="from")
    end: list[Number] = Field(alias="to")
    radius: Number


class ShapeModel(StrictModel):
    """A shape of any kind on a link."""

    link: Text
    box: SizedModel | None = None
    cylinder: CylinderModel | None = None
    sphere: SphereModel | None = None
    capsule: RodModel | None = None
    polytope: PolytopeModel | None = None


class MassModel(StrictModel):
    """The mass of a link."""

    link: Text
    mass: Number
    com: list[Number] = [0.0, 0.0, 0.0]  # noqa: RUF012
    inertia: list[Number]


class ConfigurationModel(StrictModel):
    """A configuration with a name."""

    name: Text
    q: list[Number] | None = None
    q_deg: list[Number] | None = None


class RobotModel(StrictModel):
    """A robot file."""

    version: int = Field(alias="spacearm-robot")
    name: Text
    notes: list[Text] = []  # noqa: RUF012
    tip: Text | None = None
    base: Literal["fixed", "floating"] = "fixed"
    link_radius: Number | None = None
    joints: list[JointModel]
    capsules: list[CapsuleModel] = []  # noqa: RUF012
    boxes: list[BoxModel] = []  # noqa: RUF012
    shapes: list[ShapeModel] = []  # noqa: RUF012
    masses: list[MassModel] = []  # noqa: RUF012
    configurations: list[ConfigurationModel] = []  # noqa: RUF012
    self_collision: Literal["none", "computed"] | list[list[Text]] = "none"

    @field_validator("self_collision", mode="before")
    @classmethod
    def _word_or_pairs(cls, given: Any) -> Any:
        if not isinstance(given, list) and given not in ("none", "computed"):
            raise wrong_form("none, computed, or a list of pairs of links")
        return given


Stated = tuple[str, tuple[tuple[str, float], ...]]
"""A configuration: its name, and the value of each joint that it names [rad or m]."""


def box_on_link(box: BoxModel, links: Sequence[str]) -> ConvexShape:
    """Return a box in the frame of its link [m].

    Raises:
        RobotError: a link that is not there, or edges that are none.
    """
    where = f"box of link '{box.link}'"
    require_link(where, box.link, links)
    if box.count is not None:
        as_whole(f"{where}: capsules", box.count, RobotError, at_least=1, at_most=_MOST)
    return _box(where, box)


def shape_on_link(given: ShapeModel, links: Sequence[str]) -> tuple[str, ConvexShape]:
    """Return the kind of a shape, and the shape in the frame of its link [m].

    Raises:
        RobotError: a link that is not there, no shape or several, or one that cannot be.
    """
    where = f"shape of link '{given.link}'"
    require_link(where, given.link, links)
    kinds = [kind for kind in _MAKERS if getattr(given, kind) is not None]
    if len(kinds) != 1:
        raise RobotError(f"{where} has {' and '.join(kinds) or 'no kind'}, expected one of {', '.join(_MAKERS)}")
    (kind,) = kinds
    where = f"{kind} of link '{given.link}'"
    try:
        return kind, _MAKERS[kind](where, getattr(given, kind))
    except SceneError as error:  # what shapes themselves refuse: no length above 0, a negative rounding
        raise RobotError(f"{where}: {error}") from None


def _box(where: str, box: SizedModel) -> ConvexShape:
    size = as_readonly(f"{where}: size", box.size, (3,), RobotError)
    if not (size > 0).all() or size.max() > LONGEST:
        raise RobotError(f"{where}: size is {size.tolist()}, expected three edges above 0 and at most {LONGEST:g} [m]")
    return Box(size, placed(where, box), rounding=_rounding(where, box))


def _cylinder(where: str, given: CylinderModel) -> ConvexShape:
    return Cylinder(given.radius, given.length, placed(where, given), rounding=_rounding(where, given))


def _sphere(where: str, given: SphereModel) -> ConvexShape:
    return Sphere(as_readonly(f"{where}: xyz", given.xyz, (3,), RobotError), given.radius)


def _rod(where: str, given: RodModel) -> ConvexShape:
    ends = (
        as_readonly(f"{where}: from", given.start, (3,), RobotError),
        as_readonly(f"{where}: to", given.end, (3,), RobotError),
    )
    return Capsule(*ends, given.radius)


def _polytope(where: str, given: PolytopeModel) -> ConvexShape:
    points = [as_readonly(f"{where}: vertices[{i}]", point, (3,), RobotError) for i, point in enumerate(given.vertices)]
    return moved_shape(Polytope(np.reshape(points, (-1, 3)), rounding=_rounding(where, given)), placed(where, given))


def _rounding(where: str, given: PlacedModel) -> float:
    return as_number(f"{where}: rounding", given.rounding, RobotError, at_least=0, unit="m")


_MAKERS: dict[str, Callable[[str, Any], ConvexShape]] = {
    "box": _box,
    "cylinder": _cylinder,
    "sphere": _sphere,
    "capsule": _rod,
    "polytope": _polytope,
}
"""What makes a shape of each kind."""


def link_mass(mass: MassModel, links: Sequence[str], earlier: Sequence[str]) -> LinkMass:
    """Make a link's mass of what the file states.

    Raises:
        RobotError: a link that is not there, or has a mass already, or numbers that are no body's.
    """
    where = f"mass of link '{mass.link}'"
    require_link(where, mass.link, links)
    if mass.link in earlier:
        raise RobotError(f"{where} is there twice, expected once; add them up, or give the second its own link")
    xx, yy, zz, xy, xz, yz = as_readonly(
        f"{where}: inertia", mass.inertia, (6,), RobotError, advice="give the entries xx, yy, zz, xy, xz, yz"
    )
    inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    require_possible_inertia(where, inertia)
    return LinkMass(
        mass.link,
        as_number(f"{where}: mass", mass.mass, RobotError, above=0, unit="kg"),
        as_readonly(f"{where}: com", mass.com, (3,), RobotError),
        inertia,
    )


def stated_configuration(given: ConfigurationModel, joints: Sequence[LinkJoint], earlier: Sequence[str]) -> Stated:
    """Give each joint that moves and follows no other its value.

    Raises:
        RobotError: a name twice, no values, both units, or another number of them.
    """
    where = f"configuration '{given.name}'"
    if given.name in earlier:
        raise RobotError(f"{where} is there twice, expected once; rename the other")
    moving = [joint for joint in joints if joint.kind != "fixed" and joint.mimic is None]
    lengths = [joint.name for joint in moving if joint.kind == "prismatic"]
    if given.q_deg is not None and given.q is None and lengths:
        raise RobotError(f"{where} states q_deg, but joint '{lengths[0]}' is prismatic; write q [rad or m]")
    q = radians(where, given, "q")
    if q is None:
        raise RobotError(f"{where} states no q, expected one number per joint; add it, or q_deg")
    advice = f"give one number per joint: {', '.join(joint.name for joint in moving)}"
    values = as_readonly(where, q, (len(moving),), RobotError, advice=advice)
    return given.name, tuple((joint.name, float(value)) for joint, value in zip(moving, values, strict=True))


def placed(where: str, given: JointModel | PlacedModel) -> Array:
    """Return the transform (4, 4) of the keys xyz and rpy or rpy_deg.

    Raises:
        RobotError: lists of another length, or both units.
    """
    T = np.eye(4)
    T[:3, 3] = as_readonly(f"{where}: xyz", given.xyz, (3,), RobotError)
    rpy = radians(where, given, "rpy") or (0.0, 0.0, 0.0)
    T[:3, :3] = rotation_from_rpy(as_readonly(f"{where}: rpy", rpy, (3,), RobotError))
    return T


def radians(where: str, given: Any, key: str) -> Any:
    """Take a key in radians (or metres), or its twin in degrees; None if there is neither.

    Raises:
        RobotError: both.
    """
    plain, degrees = getattr(given, key), getattr(given, f"{key}_deg")
    if degrees is None:
        return plain
    if plain is not None:
        raise RobotError(f"{where} states both {key} and {key}_deg, expected one; remove the other")
    return [math.radians(angle) for angle in degrees] if isinstance(degrees, list) else math.radians(degrees)


def require_link(where: str, link: str, links: Sequence[str]) -> None:
    """Refuse a link that no joint names.

    Raises:
        RobotError: it is one.
    """
    if link not in links:
        raise RobotError(f"{where}: no joint names that link; {nearest(link, links)}")


def tree_from_yaml(file: YamlFile, *, source: str, limits: ShapeLimits) -> LinkTree:
    """Make a tree of links from a robot file.

    Args:
        file: the file, read.
        source: how the robot is to name its origin.
        limits: how closely shapes are to be enclosed, if they are.

    Raises:
        FileFormatError: keys or values that are not those of the format.
        RobotError: numbers that make no joint, capsule, box, mass or configuration.
    """
    model = file.parsed(RobotModel)
    joints = []
    for i, joint in enumerate(model.joints):
        with file.at("joints", i):
            joints.append(_joint(joint))
    links = tuple(dict.fromkeys(link for joint in joints for link in (joint.parent, joint.child)))
    enclosed, notes = _envelopes(file, model, links, limits)
    masses: list[LinkMass] = []
    for i, mass in enumerate(model.masses):
        with file.at("masses", i):
            masses.append(link_mass(mass, links, [other.link for other in masses]))
    configurations: list[Stated] = []
    for i, configuration in enumerate(model.configurations):
        with file.at("configurations", i):
            configurations.append(stated_configuration(configuration, joints, [name for name, _ in configurations]))
    return LinkTree(
        name=model.name,
        links=links,
        joints=tuple(joints),
        shapes=tuple((one.link, part) for one in enclosed for part in one.parts),
        envelopes=_by_link(enclosed),
        self_collision=_self_collision(file, model, links),
        masses=tuple(masses),
        base=model.base,
        configurations=tuple(configurations),
        tip=model.tip,
        source=source,
        notes=(*model.notes, *notes),
    )


def _envelopes(
    file: YamlFile, model: RobotModel, links: tuple[str, ...], limits: ShapeLimits
) -> tuple[list[LinkEnclosure], tuple[str, ...]]:
    """Return what stands for each shape of the file, in its order, and what is to be said of it."""
    limits.require_links(links)
    found: list[LinkEnclosure] = []

    def add(link: str, kind: str, shape: ConvexShape, capsules: int | None = None) -> None:
        found.append(link_enclosure(link, (kind,), [Enclosure(parts=(shape,))], [shape], capsules))

    for i, capsule in enumerate(model.capsules):
        with file.at("capsules", i):
            add(capsule.link, "capsule", _capsule(capsule, links, model.link_radius))
    for i, box in enumerate(model.boxes):
        with file.at("boxes", i):
            count = None if limits.capsules is None else box.count or limits.capsules
            add(box.link, "box", box_on_link(box, links), count)
    for i, shape in enumerate(model.shapes):
        with file.at("shapes", i):
            add(shape.link, *shape_on_link(shape, links), limits.capsules)
    told = [box.link for box in model.boxes if box.count is not None and limits.capsules is None]
    notes = [f"boxes keep their shape, their number of capsules is not used: {listed(dict.fromkeys(told))}"] if told else []
    return found, (*notes, *notes_on_excess(_by_link(found), limits))


def _by_link(found: Sequence[LinkEnclosure]) -> tuple[LinkEnclosure, ...]:
    """Gather what stands for the shapes of each link."""
    links: dict[str, list[LinkEnclosure]] = {}
    for one in found:
        links.setdefault(one.link, []).append(one)
    return tuple(
        LinkEnclosure(
            link=link,
            kinds=tuple(kind for one in own for kind in one.kinds),
            each=tuple(part for one in own for part in one.each),
            parts=tuple(part for one in own for part in one.parts),
            excess=max(one.excess for one in own),
        )
        for link, own in links.items()
    )


def _self_collision(file: YamlFile, model: RobotModel, links: tuple[str, ...]) -> str | tuple[tuple[str, str], ...]:
    if isinstance(model.self_collision, str):
        return model.self_collision
    enclosed = {shape.link for shape in (*model.capsules, *model.boxes, *model.shapes)}
    for i, pair in enumerate(model.self_collision):
        with file.at("self_collision", i):
            if len(pair) != 2 or pair[0] == pair[1]:
                raise RobotError(f"self_collision[{i}] is {shown(pair)}, expected the names of two different links")
            for link in pair:
                if link not in enclosed:
                    lack = "has no shapes" if link in links else "does not exist"
                    raise RobotError(
                        f"self_collision[{i}] names link '{link}', which {lack}; {nearest(link, sorted(enclosed))}"
                    )
    return tuple((pair[0], pair[1]) for pair in model.self_collision)


def _joint(joint: JointModel) -> LinkJoint:
    where = f"joint '{joint.name}'"
    if joint.kind != "fixed" and joint.axis is None:
        raise RobotError(f"{where} ({joint.kind}) has no axis, expected a direction; add one such as axis: [0, 0, 1]")
    return LinkJoint(
        name=joint.name,
        kind=joint.kind,
        parent=joint.parent,
        child=joint.child,
        T_parent_child=placed(where, joint),
        axis=None if joint.axis is None else as_readonly(f"{where}: axis", joint.axis, (3,), RobotError),
        lower=_limit(where, joint, "lower"),
        upper=_limit(where, joint, "upper"),
        velocity=joint.velocity,
        acceleration=_positive(where, "acceleration", joint.acceleration),
        mimic=None
        if joint.mimic is None
        else Mimic(leader=joint.mimic.joint, multiplier=joint.mimic.multiplier, offset=joint.mimic.offset),
    )


def _limit(where: str, joint: JointModel, key: str) -> Any:
    if joint.kind == "prismatic" and getattr(joint, f"{key}_deg") is not None and getattr(joint, key) is None:
        raise RobotError(f"{where} is prismatic and states {key}_deg; write {key} [m]")
    return radians(where, joint, key)


def _positive(where: str, what: str, value: float | None) -> float | None:
    return None if value is None else as_number(f"{where}: {what}", value, RobotError, above=0)


def _capsule(capsule: CapsuleModel, links: tuple[str, ...], link_radius: float | None) -> ConvexShape:
    where = f"capsule of link '{capsule.link}'"
    require_link(where, capsule.link, links)
    radius = link_radius if capsule.radius is None else capsule.radius
    if radius is None:
        raise RobotError(f"{where} states no radius; add radius [m], or link_radius for all")
    return LinkCapsule(
        name=capsule.link,
        joint=-1,
        a=as_readonly(f"{where}: from", capsule.start, (3,), RobotError),
        b=as_readonly(f"{where}: to", capsule.end, (3,), RobotError),
        radius=as_number(f"{where}: radius", radius, RobotError, at_least=0, unit="m"),
    ).as_shape.shape
