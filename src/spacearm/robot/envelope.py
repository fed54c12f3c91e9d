"""The envelope of a link: the convex shapes that stand for its collision shapes, and how far they stand out of these.

Spheres, boxes, cylinders and capsules are taken as they are. A mesh is enclosed in convex pieces (`convex_pieces`), which hold
all of it. Capsules are fitted around every shape only where somebody asks for them by `capsules_per_shape`.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spacearm.core.brief import Brief
from spacearm.core.checks import as_number, as_whole, shown
from spacearm.core.errors import RobotError, nearest
from spacearm.core.long_work import LongWork
from spacearm.core.user_cache import cached_arrays
from spacearm.geometry.convex_cores import moved_shape
from spacearm.geometry.convex_pieces import ALGORITHM, MOST_PIECES, PIECES, convex_pieces
from spacearm.geometry.meshes import Mesh
from spacearm.geometry.shapes import Box, Capsule, ConvexShape, Cylinder, Polytope, Sphere
from spacearm.geometry.solid_moments import solid_moments
from spacearm.robot.collision_shapes import MeshFile, Shape, looks_like_millimetres, notes_by_link

Array = NDArray[np.float64]

MOST_CAPSULES_PER_SHAPE = 100
"""How many capsules may enclose a shape at most."""

_CACHED = ("stl", "obj", "ply", "off", "dae", "glb")  # formats whose triangles are all in the one file
_VERSION = 2  # of what is kept of a mesh
_TOLD = 1e-6  # [m] what stands out by less needs no note: it is rounding
_SIDES = 32  # of the polygon around a disc, a cylinder of length 0
_SAME = 1e-6  # [m] and as a share: by so much a sphere may miss the end of its cylinder
_FLAT = 1e-9  # share of a mesh's largest extent, below which it is a surface
_LOOKED_AT = 2000  # corners by which that is told


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class ShapeLimits(Brief):
    """How closely, and in how many pieces, collision shapes are enclosed; `load_robot` explains each.

    Attributes:
        pieces: of a mesh at most, or by link.
        excess: by how much the pieces of a mesh may stand out while fewer of them do, or by link [m]; None: by the size.
        capsules: around each shape at most; None: shapes are taken as they are.

    Raises:
        RobotError: numbers that are none.
    """

    pieces: int | Mapping[str, int] = PIECES
    excess: float | Mapping[str, float] | None = None
    capsules: int | None = None

    def __post_init__(self) -> None:
        for what, value in _each("pieces_per_mesh", self.pieces):
            as_whole(what, value, RobotError, at_least=1, at_most=MOST_PIECES)
        for what, value in () if self.excess is None else _each("excess", self.excess):
            as_number(what, value, RobotError, above=0, unit="m")
        if self.capsules is not None:
            as_whole("capsules_per_shape", self.capsules, RobotError, at_least=1, at_most=MOST_CAPSULES_PER_SHAPE)

    def of(self, link: str) -> tuple[int, float | None]:
        """Return the number of pieces, and the excess [m], for the meshes of a link."""
        pieces = self.pieces.get(link, PIECES) if isinstance(self.pieces, Mapping) else self.pieces
        excess = self.excess.get(link) if isinstance(self.excess, Mapping) else self.excess
        most = int(pieces) if self.capsules is None else min(int(pieces), self.capsules)
        return most, None if excess is None else float(excess)

    def require_links(self, links: Sequence[str]) -> None:
        """Refuse names of links that are not there.

        Raises:
            RobotError: there is one.
        """
        for what, given in (("pieces_per_mesh", self.pieces), ("excess", self.excess)):
            for link in given if isinstance(given, Mapping) else ():
                if link not in links:
                    raise RobotError(f"{what} names link {shown(link)}, which does not exist; {nearest(str(link), links)}")


def _each(what: str, given: Any) -> Iterable[tuple[str, Any]]:
    if isinstance(given, Mapping):
        return [(f"{what} of link {shown(link)}", value) for link, value in given.items()]
    return [(what, given)]


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class LinkEnvelope(Brief):
    """The envelope of one link.

    Attributes:
        link: its name.
        shapes: the kinds of its collision shapes: "sphere", "cylinder", "capsule", "box", "polytope" or "mesh".
        parts: how many convex shapes stand for them.
        excess: how far these stand out of the collision shapes, at most [m]; 0 where they are these.
        volume: of the convex shapes, in sum [m^3].
        ratio: of that volume to the sum of the collision shapes' own [-]; inf if these have none.
    """

    link: str
    shapes: tuple[str, ...]
    parts: int
    excess: float
    volume: float
    ratio: float

    @property
    def capsules(self) -> int:
        """The same as `parts`, from the time when all parts were capsules."""
        return self.parts


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class Enclosure(Brief):
    """What stands for one collision shape.

    Attributes:
        parts: convex shapes in the link's frame [m].
        excess: how far they stand out of the collision shape, at most [m].
        mesh_volume: of a mesh [m^3]; None for other shapes, which are their own part.
        remarks: on what was assumed, a kind each.
    """

    parts: tuple[ConvexShape, ...]
    excess: float = 0.0
    mesh_volume: float | None = None
    remarks: tuple[str, ...] = ()

    @property
    def volume(self) -> float:
        """The collision shape's own volume [m^3]."""
        return solid_moments(self.parts[0]).volume if self.mesh_volume is None else self.mesh_volume


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class LinkEnclosure(Brief):
    """What stands for the collision shapes of a link.

    Attributes:
        link: its name.
        kinds: of its collision shapes.
        each: what stands for each of them.
        parts: convex shapes of the envelope, in the link's frame [m]: those of `each` that lie in no other, or capsules.
        excess: how far these stand out of the collision shapes, at most [m].
    """

    link: str
    kinds: tuple[str, ...]
    each: tuple[Enclosure, ...]
    parts: tuple[ConvexShape, ...]
    excess: float

    def measured(self) -> LinkEnvelope:
        """Return what is reported of it."""
        volume, own = (sum(solid_moments(part).volume for part in self.parts), sum(one.volume for one in self.each))
        return LinkEnvelope(
            link=self.link,
            shapes=self.kinds,
            parts=len(self.parts),
            excess=self.excess,
            volume=volume,
            ratio=volume / own if own > 0 else math.inf,
        )


def envelopes_of(
    links: Mapping[str, Sequence[Shape]], limits: ShapeLimits, *, chain: float = 0.0
) -> tuple[tuple[LinkEnclosure, ...], tuple[str, ...]]:
    """Enclose the collision shapes of links.

    Args:
        links: each link's collision shapes.
        limits: how closely they are to be enclosed.
        chain: how far the robot's joints reach, `chain_length` [m].

    Returns:
        What stands for the shapes of each link that has some, and what was assumed and enlarged, a sentence a kind.

    Raises:
        RobotError: a mesh that cannot be used, or a link in the limits that is not there.
    """
    limits.require_links(list(links))
    total, done, work = sum(len(shapes) for shapes in links.values()), 0, LongWork()
    found: list[LinkEnclosure] = []
    for link, shapes in links.items():
        each: list[Enclosure] = []
        for shape in shapes:
            work.say(f"shapes of link '{link}': {done} of {total} of the robot are done", done=done, total=total)
            each.append(_enclosure(shape, *limits.of(link), chain))
            done += 1
        if shapes:
            kinds = tuple(shape.kind for shape in shapes)
            found.append(link_enclosure(link, kinds, each, _merged(shapes, each), limits.capsules))
    remarks = {one.link: dict.fromkeys(kind for part in one.each for kind in part.remarks) for one in found}
    return tuple(found), (*notes_by_link(remarks), *notes_on_excess(found, limits))


def link_enclosure(
    link: str, kinds: tuple[str, ...], each: Sequence[Enclosure], parts: Sequence[ConvexShape], capsules: int | None
) -> LinkEnclosure:
    """Put together what stands for the shapes of a link.

    Args:
        link: its name.
        kinds: of its collision shapes.
        each: what stands for each of them.
        parts: convex shapes that stand for all of them.
        capsules: how many capsules may enclose each shape; None: none are put around them.
    """
    excess = max(one.excess for one in each)
    if capsules is not None:
        from spacearm.robot.capsule_fit import enclosing_capsules

        fitted = [enclosing_capsules(one.parts, capsules) for one in each]
        parts = [part for found, _ in fitted for part in found]
        excess = max(one.excess + out for one, (_, out) in zip(each, fitted, strict=True))
    return LinkEnclosure(link=link, kinds=kinds, each=tuple(each), parts=tuple(without_inner(parts)), excess=excess)


def notes_on_excess(links: Iterable[LinkEnclosure], limits: ShapeLimits) -> tuple[str, ...]:
    """Say in a note by how much envelopes stand out of collision shapes, if any do."""
    grown = [one for one in links if one.excess > _TOLD]
    if not grown:
        return ()
    what, kind = ("convex pieces of meshes", "piece") if limits.capsules is None else ("capsules around shapes", "capsule")
    counts = [
        len(one.parts) if limits.capsules is not None else sum(len(part.parts) for part in one.each if part.excess > _TOLD)
        for one in grown
    ]
    said = [
        f"'{one.link}' {1000 * one.excess:.3g} mm ({count} {kind}{'s' if count > 1 else ''})"
        for one, count in zip(grown, counts, strict=True)
    ]
    return (f"{what} stand out of them, at most: {', '.join(said)}",)


def _enclosure(shape: Shape, pieces: int, excess: float | None, chain: float) -> Enclosure:
    if shape.mesh is not None:
        return _mesh_enclosure(shape.mesh, shape.T_link_shape, pieces, excess, chain)
    own, out = as_convex(shape.kind, shape.size)
    remarks = ()
    if min(shape.size[:1] if shape.kind == "capsule" else shape.size) <= 0:
        remarks = (f"a {shape.kind} with an edge or radius of 0 m is taken as what is left of it, a plate, a line or a point",)
    return Enclosure(parts=(moved_shape(own, shape.T_link_shape),), excess=out, remarks=remarks)


def as_convex(kind: str, size: tuple[float, ...]) -> tuple[ConvexShape, float]:
    """Return a collision shape about its own origin as a convex shape, and how far that stands out of it [m].

    Of a shape with a length of 0 what is left is a polytope without volume; only the disc that is left of a cylinder is
    enlarged, to a polygon.
    """
    if kind == "box":
        return (Box(size) if min(size) > 0 else _corners(size)), 0.0
    radius, length = size[0], size[1] if len(size) > 1 else 0.0
    end = np.array([0.0, 0.0, length / 2])
    if radius <= 0:
        return Polytope([-end, end] if length > 0 else [end]), 0.0
    if kind == "cylinder":
        return (Cylinder(radius, length), 0.0) if length > 0 else _disc(radius)
    return Capsule(-end, end, radius) if length > 0 else Sphere(np.zeros(3), radius), 0.0


def _corners(size: tuple[float, ...]) -> Polytope:
    half = np.array(size) / 2
    corners = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * half
    return Polytope(np.unique(corners + 0.0, axis=0))


def _disc(radius: float) -> tuple[Polytope, float]:
    angle = 2 * math.pi * np.arange(_SIDES) / _SIDES
    out = radius / math.cos(math.pi / _SIDES) * (1 + 1e-15)
    return Polytope(np.column_stack([out * np.cos(angle), out * np.sin(angle), np.zeros(_SIDES)])), out - radius


def _mesh_enclosure(mesh: MeshFile, T: Array, pieces: int, excess: float | None, chain: float) -> Enclosure:
    kept = _cached_pieces(mesh, pieces, excess)
    counts, roundings = kept["counts"].tolist(), kept["roundings"].tolist()
    vertices = np.split(kept["vertices"], np.cumsum(counts)[:-1])
    parts = tuple(moved_shape(Polytope(own, rounding=r), T) for own, r in zip(vertices, roundings, strict=True))
    remarks = [f"mesh files, {note}" for note in kept["notes"].tolist()]
    if looks_like_millimetres(float(kept["extent"]), chain):
        remarks.append(
            f"meshes far larger than the {chain:.3g} m that the joints reach; if they are in millimetres, write "
            'scale="0.001 0.001 0.001"'
        )
    if bool(kept["flat"]):
        remarks.append("a mesh that is flat has no inside, and is enclosed as a plate without thickness")
    if bool(kept["beyond"]):
        remarks.append(
            "meshes whose pieces do not keep the excess (excess=, by default 2 % of their size; pieces_per_mesh= allows more)"
        )
    return Enclosure(
        parts=parts,
        excess=float(kept["excess"]),
        mesh_volume=float(kept["volume"]),
        remarks=tuple(remarks),
    )


def _cached_pieces(mesh: MeshFile, pieces: int, excess: float | None) -> dict[str, NDArray[Any]]:
    """Return the pieces of a mesh and what is to be known of it, from the cache if its file was seen before."""
    ending = mesh.path.suffix.lower().lstrip(".")

    def make() -> dict[str, Any]:
        return _described(mesh.read(), pieces, excess)

    if ending not in _CACHED:
        return {name: np.asarray(value) for name, value in make().items()}
    try:
        content = mesh.path.read_bytes()
    except OSError as error:
        raise mesh.unreadable(error) from None
    return cached_arrays("link-mesh", _VERSION, [content, ending, mesh.scale, pieces, excess, ALGORITHM], make)


def _described(mesh: Mesh, pieces: int, excess: float | None) -> dict[str, Any]:
    found = convex_pieces(mesh.triangles, pieces=pieces, excess=excess, cache=False)
    on_excess = [note for note in found.notes if "out of it by" in note]  # told for all links in one note
    corners = mesh.triangles.reshape(-1, 3)
    some = corners[:: max(1, len(corners) // _LOOKED_AT)]
    spread = np.linalg.svd(some - some[0], compute_uv=False)
    a, b, c = np.moveaxis(mesh.triangles - corners.mean(axis=0), 1, 0)
    return {
        "vertices": np.concatenate([piece.vertices for piece in found.pieces]),
        "counts": np.array([len(piece.vertices) for piece in found.pieces]),
        "roundings": np.array([piece.rounding for piece in found.pieces]),
        "excess": np.array(found.excess or 0.0),
        "extent": np.array(float(np.ptp(corners, axis=0).max())),
        "flat": np.array(bool(spread[-1] <= _FLAT * spread[0])),
        "volume": np.array(abs(float(np.einsum("ki,ki->", a, np.cross(b, c)))) / 6),
        "notes": np.array((*mesh.notes, *(note for note in found.notes if note not in on_excess)), dtype=np.str_),
        "beyond": np.array(any("allow more" in note for note in on_excess)),
    }


def _merged(shapes: Sequence[Shape], each: Sequence[Enclosure]) -> list[ConvexShape]:
    """Return the shapes of a link, a cylinder with a sphere of its radius on each end as one capsule."""
    spheres = [
        (i, shape.T_link_shape[:3, 3], shape.size[0])
        for i, shape in enumerate(shapes)
        if shape.kind == "sphere" and shape.size[0] > 0
    ]
    capsules: list[ConvexShape] = []
    merged: set[int] = set()
    for i, shape in enumerate(shapes):
        if shape.kind != "cylinder" or not min(shape.size) > 0:
            continue
        radius, length = shape.size
        T = shape.T_link_shape
        ends = [T[:3, :3] @ (0, 0, side * length / 2) + T[:3, 3] for side in (-1, 1)]
        caps = []
        for end in ends:
            near = [(k, r + float(np.linalg.norm(c - end))) for k, c, r in spheres if np.linalg.norm(c - end) <= _SAME]
            caps += [(k, r) for k, r in near if abs(r - radius) <= _SAME * max(radius, 1.0)][:1]
        if len(caps) == 2:
            capsules.append(Capsule(ends[0], ends[1], max(radius, *(r for _, r in caps))))
            merged |= {i, *(k for k, _ in caps)}
    return [*capsules, *(part for i, one in enumerate(each) if i not in merged for part in one.parts)]


def without_inner(parts: Sequence[ConvexShape]) -> list[ConvexShape]:
    """Leave out spheres and capsules that lie inside another sphere or capsule; the order is kept."""
    round_ones = [part for part in parts if isinstance(part, (Sphere, Capsule))]
    kept: list[Sphere | Capsule] = []
    for part in sorted(round_ones, key=lambda part: -part.radius):
        a, b = _ends(part)
        if not any(_is_within(np.stack([a, b]), part.radius, other) for other in kept):
            kept.append(part)
    return [part for part in parts if not isinstance(part, (Sphere, Capsule)) or any(part is one for one in kept)]


def _ends(part: Sphere | Capsule) -> tuple[Array, Array]:
    return (part.center, part.center) if isinstance(part, Sphere) else (part.a, part.b)


def _is_within(ends: Array, radius: float, other: Sphere | Capsule) -> bool:
    a, b = _ends(other)
    along = b - a
    square = float(along @ along)
    share = np.clip((ends - a) @ along / square, 0.0, 1.0) if square > 0 else np.zeros(len(ends))
    return bool(np.linalg.norm(ends - a - share[:, None] * along, axis=1).max() + radius <= other.radius)
