"""The shapes of obstacles, links, the base and payloads.

An obstacle's coordinates are in the inertial frame, those of a link's shape in the frame of the joint that carries it [m].
A convex shape may be rounded: then it holds all points within its rounding radius of the shape without rounding.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import KW_ONLY, dataclass, field
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm.core.checks import UNWRITTEN, Frozen, as_number, as_pose, as_readonly, as_sentences, is_a_row, keep, shown
from spacearm.core.errors import SceneError
from spacearm.core.exact import length

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Sphere(Frozen):
    """A ball, the paper's enclosure of an obstacle.

    Attributes:
        center: (3,) [m].
        radius: [m], above 0.
        name: for messages.

    Raises:
        SceneError: a centre that is not three finite numbers, or a radius that is not above 0.
    """

    center: Array
    radius: float
    _: KW_ONLY
    name: str = ""

    if TYPE_CHECKING:  # the constructor takes more types than the fields have

        def __init__(self, center: ArrayLike, radius: float, *, name: str = "") -> None: ...

    def __post_init__(self) -> None:
        keep(self, center=_point("the sphere's center", self.center), radius=_length("the sphere's radius", self.radius))
        _require_name(self.name)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Capsule(Frozen):
    """All points within a radius of a segment: a rod with round ends.

    Attributes:
        a, b: (3,) the segment's ends [m].
        radius: [m], above 0.
        name: for messages.

    Raises:
        SceneError: ends that are not three finite numbers, or a radius that is not above 0.
    """

    a: Array
    b: Array
    radius: float
    _: KW_ONLY
    name: str = ""

    if TYPE_CHECKING:

        def __init__(self, a: ArrayLike, b: ArrayLike, radius: float, *, name: str = "") -> None: ...

    def __post_init__(self) -> None:
        keep(
            self,
            a=_point("the capsule's a", self.a),
            b=_point("the capsule's b", self.b),
            radius=_length("the capsule's radius", self.radius),
        )
        _require_name(self.name)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Box(Frozen):
    """A cuboid about its own origin.

    Attributes:
        size: (3,) edge lengths along its x, y and z [m], above 0.
        pose: (4, 4), T_w_box; a point (3,) is taken for a box that is not turned. `spacearm.pose` makes one.
        rounding: the shape is all points within this distance of the box [m], 0 or more.
        name: for messages.

    Raises:
        SceneError: edges that are not above 0, a pose that is none, or a negative rounding.
    """

    size: Array
    pose: Array = None  # type: ignore[assignment]  # filled in below
    _: KW_ONLY
    rounding: float = field(default=0.0, metadata=UNWRITTEN)
    name: str = ""

    if TYPE_CHECKING:

        def __init__(
            self, size: ArrayLike, pose: ArrayLike | None = None, *, rounding: float = 0.0, name: str = ""
        ) -> None: ...

    def __post_init__(self) -> None:
        size = as_readonly("the box's size", self.size, (3,), SceneError, advice="give the edges along x, y and z")
        if not (size > 0).all():
            raise SceneError(f"the box's size is {size.tolist()}, expected three edges above 0 [m]")
        keep(self, size=size, pose=as_pose("the box's pose", self.pose, SceneError))
        keep(self, rounding=_rounding("the box's rounding", self.rounding))
        _require_name(self.name)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Cylinder(Frozen):
    """A round cylinder with flat ends, about its own origin, along its z.

    Attributes:
        radius: [m], above 0.
        length: along z [m], above 0.
        pose: (4, 4), T_w_cylinder; a point (3,) is taken for one that is not turned.
        rounding: the shape is all points within this distance of the cylinder [m], 0 or more.
        name: for messages.

    Raises:
        SceneError: a radius or length that is not above 0, a pose that is none, or a negative rounding.
    """

    radius: float
    length: float
    pose: Array = None  # type: ignore[assignment]
    _: KW_ONLY
    rounding: float = field(default=0.0, metadata=UNWRITTEN)
    name: str = ""

    if TYPE_CHECKING:

        def __init__(
            self, radius: float, length: float, pose: ArrayLike | None = None, *, rounding: float = 0.0, name: str = ""
        ) -> None: ...

    def __post_init__(self) -> None:
        keep(
            self,
            radius=_length("the cylinder's radius", self.radius),
            length=_length("the cylinder's length", self.length),
            pose=as_pose("the cylinder's pose", self.pose, SceneError),
            rounding=_rounding("the cylinder's rounding", self.rounding),
        )
        _require_name(self.name)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Polytope(Frozen):
    """The convex hull of points; it may be flat.

    Attributes:
        vertices: (k, 3) points whose hull it is [m], at least one; those inside the hull change nothing.
        rounding: the shape is all points within this distance of the hull [m], 0 or more.
        name: for messages.

    Raises:
        SceneError: no vertices, numbers that are not finite, or a negative rounding.
    """

    vertices: Array
    _: KW_ONLY
    rounding: float = field(default=0.0, metadata=UNWRITTEN)
    name: str = ""

    if TYPE_CHECKING:

        def __init__(self, vertices: ArrayLike, *, rounding: float = 0.0, name: str = "") -> None: ...

    def __post_init__(self) -> None:
        vertices = as_readonly("the polytope's vertices", self.vertices, (None, 3), SceneError)
        if not len(vertices):
            raise SceneError("the polytope has no vertices, expected at least one point (3,)")
        keep(self, vertices=vertices, rounding=_rounding("the polytope's rounding", self.rounding))
        _require_name(self.name)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class HalfSpace(Frozen):
    """Everything behind a plane: a floor, a wall, the hull of a large module.

    Attributes:
        normal: (3,) out of the solid; kept with length 1.
        point: (3,) on the plane [m].
        name: for messages.

    Raises:
        SceneError: a normal of length 0, or numbers that are not finite.
    """

    normal: Array
    point: Array
    _: KW_ONLY
    name: str = ""

    if TYPE_CHECKING:

        def __init__(self, normal: ArrayLike, point: ArrayLike, *, name: str = "") -> None: ...

    def __post_init__(self) -> None:
        normal = _point("the half-space's normal", self.normal)
        if not 1e-150 < math.hypot(*normal) < 1e150:
            raise SceneError(
                f"the half-space's normal is {normal.tolist()}, expected a direction; give a vector out of the solid"
            )
        size = length(normal)
        if abs(size - 1) > 1e-15:
            normal = as_readonly("the half-space's normal", normal / size, (3,), SceneError)
        keep(self, normal=normal, point=_point("the half-space's point", self.point))
        _require_name(self.name)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class SphereSet(Frozen):
    """Balls that together enclose something: a mesh or a point cloud. `enclose_mesh` and `enclose_points` make them.

    Attributes:
        centers: (k, 3) [m], at least one.
        radii: (k,) [m], above 0.
        excess: how far the balls stand out of what they enclose, at most [m]; None if that is not known.
        name: for messages.
        notes: what was found and assumed in enclosing a mesh, a few words each.

    Raises:
        SceneError: no balls, radii that are not above 0, or lengths that differ.
    """

    centers: Array
    radii: Array
    _: KW_ONLY
    excess: float | None = None
    name: str = ""
    notes: tuple[str, ...] = ()

    if TYPE_CHECKING:

        def __init__(
            self,
            centers: ArrayLike,
            radii: ArrayLike,
            *,
            excess: float | None = None,
            name: str = "",
            notes: tuple[str, ...] = (),
        ) -> None: ...

    def __post_init__(self) -> None:
        centers = as_readonly("the sphere set's centers", self.centers, (None, 3), SceneError)
        if not len(centers):
            raise SceneError("the sphere set is empty, expected at least one centre and radius")
        radii = as_readonly("the sphere set's radii", self.radii, (len(centers),), SceneError)
        if not (radii > 0).all():
            worst = int(np.argmin(radii))
            raise SceneError(f"the sphere set's radii[{worst}] is {radii[worst]:g}, expected a finite number above 0 [m]")
        if self.excess is not None:
            keep(self, excess=as_number("the sphere set's excess", self.excess, SceneError, at_least=0, unit="m"))
        keep(self, centers=centers, radii=radii, notes=as_sentences("the sphere set's notes", self.notes, SceneError))
        _require_name(self.name)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class PolytopeSet(Frozen):
    """Convex pieces that together enclose something, such as a mesh. `convex_pieces` makes them.

    Attributes:
        pieces: at least one polytope.
        excess: how far the pieces stand out of what they enclose, at most [m]; None if that is not known.
        name: for messages.
        notes: what was found and assumed in enclosing it, a few words each.

    Raises:
        SceneError: no pieces, or what is no polytope.
    """

    pieces: tuple[Polytope, ...]
    _: KW_ONLY
    excess: float | None = None
    name: str = ""
    notes: tuple[str, ...] = ()

    if TYPE_CHECKING:

        def __init__(
            self,
            pieces: Iterable[Polytope],
            *,
            excess: float | None = None,
            name: str = "",
            notes: tuple[str, ...] = (),
        ) -> None: ...

    def __post_init__(self) -> None:
        given: Any = self.pieces
        if not is_a_row(given):
            raise SceneError(f"the polytope set's pieces is {shown(given)}, expected a list of Polytope(...)")
        pieces = tuple(given)
        for i, piece in enumerate(pieces):
            if not isinstance(piece, Polytope):
                raise SceneError(f"the polytope set's pieces[{i}] is {shown(piece)}, expected a Polytope(...)")
        if not pieces:
            raise SceneError("the polytope set is empty, expected at least one piece")
        if self.excess is not None:
            keep(self, excess=as_number("the polytope set's excess", self.excess, SceneError, at_least=0, unit="m"))
        keep(self, pieces=pieces, notes=as_sentences("the polytope set's notes", self.notes, SceneError))
        _require_name(self.name)


ConvexShape: TypeAlias = Sphere | Capsule | Box | Cylinder | Polytope
"""The shapes of links; obstacles and payloads may have them too."""


def pose(position: ArrayLike = (0.0, 0.0, 0.0), q_wxyz: ArrayLike = (1.0, 0.0, 0.0, 0.0)) -> Array:
    """Return the rigid transform T (4, 4) of a position [m] and a quaternion.

    Args:
        position: (3,) [m].
        q_wxyz: (4,) scalar first; of any length but 0, since files round them.

    Raises:
        SceneError: other lengths, numbers that are not finite, or a quaternion of length 0.
    """
    at = as_readonly("the position", position, (3,), SceneError)
    q = as_readonly("q_wxyz", q_wxyz, (4,), SceneError)
    if not 1e-6 < math.hypot(*q) < 1e6:
        raise SceneError(f"q_wxyz is {q.tolist()}, expected a unit quaternion, scalar first; (1, 0, 0, 0) turns nothing")
    w, x, y, z = q / length(q)
    T = np.eye(4)
    T[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    T[:3, 3] = at
    return T


def _point(name: str, value: ArrayLike) -> Array:
    return as_readonly(name, value, (3,), SceneError)


def _length(name: str, value: Any) -> float:
    return as_number(name, value, SceneError, above=0, unit="m")


def _rounding(name: str, value: Any) -> float:
    return as_number(name, value, SceneError, at_least=0, unit="m")


def _require_name(name: Any) -> None:
    if not isinstance(name, str):
        raise SceneError(f"the obstacle's name is {shown(name)}, expected text")
