"""The shapes of a robot's links: convex shapes, each on the joint that carries it, and as plain values, which a file holds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from spacearm.core.checks import Frozen, as_name, as_number, as_readonly, as_whole, keep, shown
from spacearm.core.errors import RobotError
from spacearm.core.exact import product
from spacearm.core.reading import located
from spacearm.core.records import record_as_dict, record_from_dict
from spacearm.geometry.convex_cores import bounding_points, core_of
from spacearm.geometry.shapes import Box, Capsule, ConvexShape, Cylinder, Polytope, Sphere

Array = NDArray[np.float64]

_KINDS: dict[str, type[ConvexShape]] = {
    "sphere": Sphere,
    "capsule": Capsule,
    "box": Box,
    "cylinder": Cylinder,
    "polytope": Polytope,
}
"""Shapes of links by the names that files give them."""

CONVEX = tuple(_KINDS.values())
"""The classes of convex shapes."""


def as_index(name: str, value: Any) -> int:
    """Check the index of a joint; -1 is the base.

    Raises:
        RobotError: none.
    """
    return as_whole(name, value, RobotError, at_least=-1, wanted="an index, or -1")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class LinkShape(Frozen):
    """A convex shape that moves with a link; several shapes may make up one link.

    Attributes:
        name: of the link.
        joint: index of the joint whose moving frame it rides on, -1 for the base.
        shape: with its coordinates in that frame [m].

    Raises:
        RobotError: what is no convex shape.
    """

    name: str
    joint: int
    shape: ConvexShape
    read_before: ClassVar[bool] = True  # files name the shape's kind: `robot_from_dict` reads them itself

    def __post_init__(self) -> None:
        where = f"shape of link '{as_name('the name of a shape of a link', self.name, RobotError)}'"
        keep(self, joint=as_index(f"{where}: joint", self.joint))
        if not isinstance(self.shape, CONVEX):  # pyright: ignore[reportUnnecessaryIsInstance]
            names = ", ".join(kind.__name__ for kind in CONVEX)
            raise RobotError(f"{where}: shape is {shown(self.shape)}, expected one of {names}")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class LinkCapsule(Frozen):
    """A capsule that moves with a link: all points within a radius of a segment; a sphere has a = b.

    Attributes:
        name: of the link; several capsules may make up one link.
        joint: index of the joint whose moving frame it rides on, -1 for the base.
        a: (3,) one end of the segment, in that frame [m].
        b: (3,) the other end [m].
        radius: [m]; 0 is allowed, for the paper's links are lines without thickness.

    Raises:
        RobotError: numbers that are not finite, or a negative radius.
    """

    name: str
    joint: int
    a: Array
    b: Array
    radius: float

    def __post_init__(self) -> None:
        where = f"capsule '{as_name('a capsule name', self.name, RobotError)}'"
        keep(
            self,
            joint=as_index(f"{where}: joint", self.joint),
            a=as_readonly(f"{where}: a", self.a, (3,), RobotError),
            b=as_readonly(f"{where}: b", self.b, (3,), RobotError),
            radius=as_number(f"{where}: radius", self.radius, RobotError, at_least=0, unit="m"),
        )

    @property
    def as_shape(self) -> LinkShape:
        """The same as a shape: a sphere, a capsule, or with radius 0 the hull of its ends."""
        one = np.array_equal(self.a, self.b)
        shape: ConvexShape = Polytope([self.a] if one else [self.a, self.b])
        if self.radius > 0:
            shape = Sphere(self.a, self.radius) if one else Capsule(self.a, self.b, self.radius)
        return LinkShape(name=self.name, joint=self.joint, shape=shape)


def as_capsule(part: LinkShape) -> LinkCapsule | None:
    """Return a shape that is a sphere, a capsule, a point or a segment as a capsule; None for others."""
    shape = part.shape
    if isinstance(shape, Sphere):
        a, b, radius = shape.center, shape.center, shape.radius
    elif isinstance(shape, Capsule):
        a, b, radius = shape.a, shape.b, shape.radius
    elif isinstance(shape, Polytope) and len(shape.vertices) < 3:
        a, b, radius = shape.vertices[0], shape.vertices[-1], shape.rounding
    else:
        return None
    return LinkCapsule(name=part.name, joint=part.joint, a=a, b=b, radius=radius)


def bounding_capsule(part: LinkShape) -> LinkCapsule:
    """Return a capsule around a shape of a link, along the longest edge of the shape's box."""
    core = core_of(part.shape)
    points, rounding = bounding_points(part.shape)
    own = product(points - core.T[:3, 3], core.T[:3, :3])
    half = np.abs(own).max(axis=0) if core.kind == "polytope" else core.half
    along = np.eye(3)[2 if core.kind == "cylinder" else int(np.argmax(half))] * half
    aside = core.half[0] if core.kind == "cylinder" else float(np.sqrt(((own * (along == 0)) ** 2).sum(axis=1)).max())
    a, b = (core.T[:3, 3] + product(core.T[:3, :3], end) for end in (-along, along))
    return LinkCapsule(name=part.name, joint=part.joint, a=a, b=b, radius=aside + rounding)


def part_as_dict(part: LinkShape) -> dict[str, Any]:
    """Return a shape of a link as plain values: name, joint, and the shape's own values under its kind."""
    kind = next(name for name, kind in _KINDS.items() if isinstance(part.shape, kind))
    return {"name": part.name, "joint": part.joint, kind: record_as_dict(part.shape)}


def part_of_capsule(values: Any, what: str) -> LinkShape:
    """Return a shape of the plain values of a LinkCapsule."""
    return record_from_dict(LinkCapsule, values, what, RobotError).as_shape


def part_from_dict(values: Any, what: str) -> LinkShape:
    """Return a shape of plain values, as `part_as_dict` makes them.

    Raises:
        RobotError: they are none; `what` names the place.
    """
    kinds = [key for key in values if key in _KINDS] if isinstance(values, dict) else []
    if len(kinds) != 1 or set(values) - {"name", "joint", *kinds}:
        raise RobotError(f"{what} is {shown(values)}, expected a mapping with name, joint, and one shape: {', '.join(_KINDS)}")
    shape = record_from_dict(_KINDS[kinds[0]], values[kinds[0]], f"{what}: {kinds[0]}", RobotError)
    with located(what):
        return LinkShape(name=values.get("name", ""), joint=values.get("joint", None), shape=shape)  # type: ignore[arg-type]
