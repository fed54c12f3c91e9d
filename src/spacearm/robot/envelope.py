"""Capsules that enclose a URDF's collision shapes.

A sphere is exact, and so is a cylinder whose ends carry spheres of its radius. Any other cylinder, box or mesh
is enclosed in one capsule, or in a few where that pays (`capsule_split`). Capsules that lie inside another one
of the same link are left out.
"""

from __future__ import annotations

import hashlib
import os
import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import unquote

import numpy as np
from numpy.typing import NDArray

from spacearm.errors import RobotError
from spacearm.meshes import Mesh, read_mesh
from spacearm.robot.capsule_fit import Segment, shortest_axis
from spacearm.robot.capsule_split import CHOSEN_BY_VOLUME, enclose
from spacearm.robot.excess import Excess
from spacearm.robot.links import LONGEST
from spacearm.robot.segments import point_segment_distance

if TYPE_CHECKING:
    import yourdfpy

Array = NDArray[np.float64]

_OTHERWISE = 'or load with collision="none"'
_URI = re.compile(r"[A-Za-z][A-Za-z0-9+.-]*://|file:(?=/)", re.IGNORECASE)  # file:/a/b is one, too
_SIDES = 32  # of the prism around a cylinder that is cut into pieces
_REMEMBERED = 256  # shapes, so that a robot that is loaded again need not be enclosed again
_SMALLEST = 1e-9  # [m] the least size of a mesh
_SAME = 1e-6  # [m] and as a share: by so much a sphere may miss the end of its cylinder


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


def enclosed(shapes: list[Shape], count: int) -> list[Segment]:
    """Enclose the collision shapes of one link, in its frame, each in at most `count` capsules."""
    capsules, merged = _rounded_cylinders(shapes)
    for i, shape in enumerate(shapes):
        if i not in merged:
            capsules += [_carried(shape.T_link_shape, capsule) for capsule in _enclosed(shape, count)]
    return _without_inner(capsules)


def shape_triangles(kind: str, size: tuple[float, ...]) -> Array:
    """Return the surface (k, 3, 3) of a box, or of a prism around a cylinder, about the origin [m]."""
    if kind == "box":
        corners = np.array([(x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)]) * size
        quads = [(0, 1, 3, 2), (4, 5, 7, 6), (0, 1, 5, 4), (2, 3, 7, 6), (0, 2, 6, 4), (1, 3, 7, 5)]
        return np.array([corners[[q[0], *q[i : i + 2]]] for q in quads for i in (1, 2)])
    radius, length = size
    angle = 2 * np.pi * np.arange(_SIDES) / _SIDES
    ring = radius / np.cos(np.pi / _SIDES) * np.column_stack([np.cos(angle), np.sin(angle), np.zeros(_SIDES)])
    half = np.array([0, 0, length / 2])
    low, high = ring - half, ring + half
    following = np.roll(np.arange(_SIDES), -1)
    sides = [np.stack(corners, axis=1) for corners in ((low, low[following], high), (high, high[following], low[following]))]
    lids = [np.stack([np.broadcast_to(end[0], end[1:-1].shape), end[1:-1], end[2:]], axis=1) for end in (low, high)]
    return np.concatenate([*sides, *lids])


def _enclosed(shape: Shape, count: int) -> tuple[Segment, ...]:
    if shape.kind == "sphere":
        return (Segment(np.zeros(3), np.zeros(3), shape.size[0]),)
    if shape.kind == "cylinder":
        return _cylinder_capsules(*shape.size, count)
    if shape.kind == "box":
        return _box_capsules(shape.size, count)
    assert shape.triangles is not None
    return _mesh_capsules(shape.triangles, count)


@lru_cache(maxsize=_REMEMBERED)
def _box_capsules(size: tuple[float, ...], count: int) -> tuple[Segment, ...]:
    shape = Shape("box", size, np.eye(4))
    return tuple(enclose(shape_triangles("box", size), count, _excess(shape, count)))


@lru_cache(maxsize=_REMEMBERED)
def _cylinder_capsules(radius: float, length: float, count: int) -> tuple[Segment, ...]:
    first, last, larger = shortest_axis(np.array([-length / 2, length / 2]), np.array([radius, radius]))
    alone = Segment(np.array([0.0, 0.0, first]), np.array([0.0, 0.0, last]), larger)
    shape = Shape("cylinder", (radius, length), np.eye(4))
    several = enclose(shape_triangles("cylinder", (radius, length)), count, _excess(shape, count))
    return (alone,) if len(several) == 1 and alone.volume <= several[0].volume else tuple(several)


_meshes: dict[tuple[bytes, int], tuple[Segment, ...]] = {}


def _mesh_capsules(triangles: Array, count: int) -> tuple[Segment, ...]:
    key = hashlib.sha256(triangles.tobytes()).digest(), count
    if key not in _meshes:
        if len(_meshes) >= _REMEMBERED:
            _meshes.clear()
        _meshes[key] = tuple(enclose(triangles, count, _excess(Shape("mesh", (), np.eye(4), triangles), count)))
    return _meshes[key]


def _excess(shape: Shape, count: int) -> Excess | None:
    """Return what measures how far capsules stand out of a shape; None where their volume decides, and it is not needed."""
    return Excess([shape]) if count > CHOSEN_BY_VOLUME else None


def _rounded_cylinders(shapes: list[Shape]) -> tuple[list[Segment], set[int]]:
    """Find cylinders with a sphere of their radius on each end: capsules. Return these and the places of what they hold."""
    capsules: list[Segment] = []
    merged: set[int] = set()
    spheres = [(i, shape.T_link_shape[:3, 3], shape.size[0]) for i, shape in enumerate(shapes) if shape.kind == "sphere"]
    for i, shape in enumerate(shapes):
        if shape.kind != "cylinder":
            continue
        radius, length = shape.size
        T = shape.T_link_shape
        ends = [T[:3, :3] @ (0, 0, side * length / 2) + T[:3, 3] for side in (-1, 1)]
        caps = []
        for end in ends:
            near = [(k, r + float(np.linalg.norm(c - end))) for k, c, r in spheres if np.linalg.norm(c - end) <= _SAME]
            caps += [(k, r) for k, r in near if abs(r - radius) <= _SAME * max(radius, 1.0)][:1]
        if len(caps) == 2:
            capsules.append(Segment(ends[0], ends[1], max(radius, *(r for _, r in caps))))
            merged |= {i, *(k for k, _ in caps)}
    return capsules, merged


def _without_inner(capsules: list[Segment]) -> list[Segment]:
    """Leave out the capsules that lie inside another one."""
    kept: list[Segment] = []
    for capsule in sorted(capsules, key=lambda capsule: -capsule.radius):
        ends = np.array([capsule.a, capsule.b])
        if not any(point_segment_distance(ends, o.a, o.b).max() + capsule.radius <= o.radius for o in kept):
            kept.append(capsule)
    return [capsule for capsule in capsules if any(capsule is one for one in kept)]


def _carried(T: Array, capsule: Segment) -> Segment:
    return Segment(T[:3, :3] @ capsule.a + T[:3, 3], T[:3, :3] @ capsule.b + T[:3, 3], capsule.radius)


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
