"""The collision shapes of a URDF's links as the file has them: what is drawn, where, and what is to be known of it.

Meshes are found here, and read only when somebody asks for their triangles.
"""

from __future__ import annotations

import math
import os
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np
from numpy.typing import NDArray

from spacearm.core.errors import RobotError
from spacearm.geometry.meshes import Mesh, read_mesh
from spacearm.robot.link_tree import LONGEST
from spacearm.robot.robot_xml import numbers_in

Array = NDArray[np.float64]

SHAPES = ("box", "cylinder", "sphere", "capsule", "mesh")
"""The tags of collision shapes."""

WITH_COMMAS = ("size", "scale")
"""Attributes in which commas stand for blanks, as some exporters write them."""

OVERSIZED = 20.0
"""A mesh that is larger than the whole chain of joints by this factor is taken for one in millimetres."""

OTHERWISE = 'or load with collision="none"'
"""What can be done about a shape that cannot be used."""

_URI = re.compile(r"[A-Za-z][A-Za-z0-9+.-]*://|file:(?=/)", re.IGNORECASE)  # file:/a/b is one, too
_SMALLEST = 1e-9  # [m] the least size of a mesh
_LEAST = 2.0  # [m] smaller meshes are nobody's millimetres
_NAMED = 6  # links in a note


@dataclass(frozen=True, slots=True, eq=False)
class MeshFile:
    """A collision mesh in a file.

    Attributes:
        path: where it was found.
        filename: as the URDF has it.
        scale: (3,) factors of its coordinates.
        link: whose shape it is.
    """

    path: Path
    filename: str
    scale: Array
    link: str

    @property
    def called(self) -> str:
        """The mesh for a message."""
        return f"link '{self.link}' has the collision mesh '{self.filename}'"

    def read(self) -> Mesh:
        """Return the mesh, scaled; its notes are what was assumed or applied in reading the file.

        Raises:
            RobotError: it cannot be read, is one point, or is larger than a robot can be.
        """
        try:
            mesh = read_mesh(self.path)
        except (OSError, ValueError) as error:
            raise self.unreadable(error) from None
        mesh = replace(mesh, triangles=mesh.triangles * self.scale)
        size = float(np.ptp(mesh.triangles.reshape(-1, 3), axis=0).max())
        if size < _SMALLEST:
            raise RobotError(f"{self.called} with a size of {size:g} m, expected a surface; check its scale, {OTHERWISE}")
        _require_within_reach(self.link, "mesh", [float(mesh.triangles.min()), float(mesh.triangles.max())])
        return mesh

    def unreadable(self, error: Exception) -> RobotError:
        """Return the error about a file that cannot be read."""
        return RobotError(f"{self.called}, which cannot be read ({error}); repair the file, {OTHERWISE}")


@dataclass(frozen=True, slots=True, eq=False)
class Shape:
    """A collision shape.

    Attributes:
        kind: "sphere", "cylinder", "capsule", "box" or "mesh".
        size: (radius), (radius, length), (radius, length without the round ends), the three edges, or nothing for a mesh [m].
        T_link_shape: (4, 4) [m].
        mesh: the mesh's file; else None.
    """

    kind: str
    size: tuple[float, ...]
    T_link_shape: Array
    mesh: MeshFile | None = None

    @property
    def triangles(self) -> Array | None:
        """The corners (k, 3, 3) of a mesh in its own frame [m], read anew; None for other shapes."""
        return None if self.mesh is None else self.mesh.read().triangles


def link_shapes(link: Any, directory: Path) -> list[Shape]:
    """Return the collision shapes of a link.

    Args:
        link: an lxml element that has been checked.
        directory: of the URDF, where the search for meshes begins.

    Raises:
        RobotError: a mesh that is missing, or lengths that no robot has.
    """
    name, shapes = link.get("name"), []
    for collision in link.findall("collision"):
        T, geometry = origin_of(collision), collision.find("geometry")[0]
        size: tuple[float, ...] = ()
        mesh = None
        if geometry.tag == "box":
            size = tuple(_numbers(geometry, "size"))
        elif geometry.tag == "sphere":
            size = tuple(_numbers(geometry, "radius"))
        elif geometry.tag == "mesh":
            mesh = _mesh_file(geometry, name, directory)
        else:
            size = (*_numbers(geometry, "radius"), *_numbers(geometry, "length"))
        _require_within_reach(name, geometry.tag, [*size, *T[:3, 3].tolist()])
        shapes.append(Shape(geometry.tag, size, T, mesh))
    return shapes


def origin_of(element: Any) -> Array:
    """Return the transform (4, 4) of an element's <origin> [m]: turns about the fixed x, then y, then z."""
    T, origin = np.eye(4), element.find("origin")
    if origin is None:
        return T
    T[:3, 3] = _numbers(origin, "xyz", "0 0 0")
    (si, sj, sk), (ci, cj, ck) = ([turn(angle) for angle in _numbers(origin, "rpy", "0 0 0")] for turn in (math.sin, math.cos))
    # In the order of operations of the library `transformations`: robots of earlier versions have the same bits.
    T[0, :3] = cj * ck, sj * (si * ck) - ci * sk, sj * (ci * ck) + si * sk
    T[1, :3] = cj * sk, sj * (si * sk) + ci * ck, sj * (ci * sk) - si * ck
    T[2, :3] = -sj, cj * si, cj * ci
    return T


def _numbers(element: Any, attribute: str, default: str = "") -> list[float]:
    text = element.get(attribute, default)
    return numbers_in(text.replace(",", " ") if attribute in WITH_COMMAS else text)


def _mesh_file(geometry: Any, link: str, directory: Path) -> MeshFile:
    filename = geometry.get("filename")
    scale = np.array(_numbers(geometry, "scale") or [1.0]) * np.ones(3)
    path = found_mesh(filename, directory)
    if path is None:
        raise RobotError(
            f"link '{link}' has the collision mesh '{filename}', which is not there; put the file there, {OTHERWISE}"
        )
    return MeshFile(path, filename, scale, link)


def _require_within_reach(link: str, kind: str, lengths: Sequence[float]) -> None:
    """Refuse lengths whose squares and cubes would no longer be numbers."""
    largest = max(abs(length) for length in lengths)
    if largest > LONGEST:
        raise RobotError(
            f"link '{link}' has a {kind} with a length of {largest:g} m, expected {LONGEST:g} m or less; "
            f"check its units, {OTHERWISE}"
        )


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


def notes_by_link(remarks: Mapping[str, Iterable[str]]) -> tuple[str, ...]:
    """Return a sentence for each kind of remark on links.

    Args:
        remarks: by the links' names; the same words are the same kind.
    """
    of_kind: dict[str, list[str]] = {}
    for link, own in remarks.items():
        for kind in own:
            of_kind.setdefault(kind, []).append(link)
    return tuple(f"{kind}: {listed(dict.fromkeys(links))}" for kind, links in of_kind.items())


def listed(links: Iterable[str]) -> str:
    """Return links for a note; of many the first."""
    names = list(links)
    more = f", ... ({len(names)} links)" if len(names) > _NAMED else ""
    return ", ".join(f"'{name}'" for name in names[:_NAMED]) + more
