"""Shapes of links: files that cannot be loaded, of another unit or missing; and the mass that would fill them evenly."""

from __future__ import annotations

import copy
import math
import os
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spacearm.core.checks import shown
from spacearm.core.rotations import rotation_from_rpy
from spacearm.doctor.diagnosis import Chart, link_of, number_of, numbers_of, setting, written
from spacearm.doctor.limit_checks import FARTHEST
from spacearm.geometry.meshes import mesh_triangles
from spacearm.geometry.shapes import Capsule
from spacearm.geometry.solid_moments import solid_moments
from spacearm.robot.collision_shapes import SHAPES, chain_length, found_mesh, looks_like_millimetres
from spacearm.robot.link_tree import LONGEST

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Solid:
    """A body of even density in a link's frame.

    Attributes:
        low, high: (3,) corners of the box around it, along the link's axes [m].
        volume: [m^3], 0 for a surface.
        center: (3,) of its volume [m].
        moments: (3, 3) about that, for a density of 1 [m^5].
    """

    low: Array
    high: Array
    volume: float
    center: Array
    moments: Array

    @property
    def edges(self) -> Array:
        """The edges (3,) of the box around it [m]."""
        return self.high - self.low

    def inertia(self, mass: float) -> Array:
        """Return its inertia (3, 3) about its centre [kg m^2] with a mass [kg]."""
        return self.moments * (mass / self.volume)


def link_solid(link: Any, directory: Path) -> Solid | None:
    """Unite a link's collision shapes, or where it has none its visual ones; overlaps count twice.

    Returns:
        None if there is no shape, or one that cannot be read.
    """
    for tag in ("collision", "visual"):
        parts = link.findall(tag)
        if parts:
            solids = [_solid(part, directory) for part in parts]
            return None if None in solids else _united([solid for solid in solids if solid is not None])
    return None


def mesh_path(mesh: Any, directory: Path) -> Path | None:
    """Return the file of a <mesh>, None if it is not there."""
    name = mesh.get("filename")
    try:
        return found_mesh(name, directory) if name else None
    except (OSError, ValueError):
        return None


def mesh_size(path: Path) -> Array:
    """Return the edges (3,) of the box around a mesh as the file has it.

    Raises:
        ValueError: it holds no triangles that can be used.
    """
    triangles = _triangles(str(path), _stamp(path))
    return np.ptp(triangles.reshape(-1, 3), axis=0)


def _stamp(path: Path) -> tuple[int, int]:
    status = os.stat(path)
    return status.st_mtime_ns, status.st_size


@lru_cache(maxsize=256)
def _triangles(path: str, stamp: tuple[int, int]) -> Array:
    return mesh_triangles(path)


@lru_cache(maxsize=256)
def _hull(path: str, stamp: tuple[int, int]) -> tuple[Array, Array, Array]:
    """Return the corners (k, 3) of a mesh's convex hull, and the first and second moments' ground: its triangles."""
    from scipy.spatial import ConvexHull, QhullError

    points = _triangles(path, stamp).reshape(-1, 3)
    try:
        hull = ConvexHull(points)
    except (QhullError, ValueError):
        return points, np.zeros((0, 3, 3)), points.mean(axis=0)
    return points[hull.vertices], points[hull.simplices], points[hull.vertices].mean(axis=0)


def _solid(part: Any, directory: Path) -> Solid | None:
    geometry, origin = part.find("geometry"), part.find("origin")
    xyz, rpy = numbers_of(origin, "xyz", 3, (0, 0, 0)), numbers_of(origin, "rpy", 3, (0, 0, 0))
    shapes = [] if geometry is None else [shape for shape in geometry if isinstance(shape.tag, str)]
    if len(shapes) != 1 or xyz is None or rpy is None or max(map(abs, xyz)) > LONGEST:
        return None
    R, p = rotation_from_rpy(rpy), np.array(xyz)
    own = _own(shapes[0], directory)
    if own is None:
        return None
    corners, volume, center, moments = own
    if corners is None:  # round shapes: the box around them follows from their support
        half = _round_half(shapes[0], R)
        low, high = p - half, p + half
    else:
        placed = corners @ R.T + p
        low, high = placed.min(axis=0), placed.max(axis=0)
    return Solid(low, high, volume, R @ center + p, R @ moments @ R.T)


def _own(shape: Any, directory: Path) -> tuple[Array | None, float, Array, Array] | None:
    """Return corners (k, 3) (None for round shapes), volume, centre and moments of a shape in its own frame."""
    if shape.tag == "mesh":
        return _mesh(shape, directory)
    size = _size(shape)
    if size is None:
        return None
    if shape.tag == "box":
        x, y, z = size
        volume = x * y * z
        signs = np.array([(i, j, k) for i in (-0.5, 0.5) for j in (-0.5, 0.5) for k in (-0.5, 0.5)])
        moments = np.diag([y * y + z * z, x * x + z * z, x * x + y * y]) * (volume / 12)
        return signs * size, volume, np.zeros(3), moments
    if shape.tag == "sphere":
        volume = 4 / 3 * math.pi * size[0] ** 3
        return None, volume, np.zeros(3), np.eye(3) * (0.4 * volume * size[0] ** 2)
    r, h = size
    if shape.tag == "capsule":
        found = solid_moments(Capsule((0, 0, -h / 2), (0, 0, h / 2), r)) if r > 0 else None
        volume, inertia = (0.0, np.zeros((3, 3))) if found is None else (found.volume, found.inertia)
        return None, volume, np.zeros(3), inertia * volume
    volume, across = math.pi * r * r * h, (3 * r * r + h * h) / 12
    return None, volume, np.zeros(3), np.diag([across, across, r * r / 2]) * volume


def _size(shape: Any) -> tuple[float, ...] | None:
    """Return the edges of a box, the radius of a sphere, radius and length of others; None if they cannot be used."""
    long = (("radius", 1), ("length", 1))
    parts = {"box": (("size", 3),), "sphere": (("radius", 1),), "cylinder": long, "capsule": long}.get(shape.tag, ())
    size: tuple[float, ...] = ()
    for attribute, count in parts:
        numbers = numbers_of(shape, attribute, count)
        if numbers is None or min(numbers) < 0 or max(numbers) > LONGEST:
            return None
        size += numbers
    return size or None


def _mesh(shape: Any, directory: Path) -> tuple[Array | None, float, Array, Array] | None:
    path = mesh_path(shape, directory)
    scale = numbers_of(shape, "scale", 3, (1, 1, 1)) or (numbers_of(shape, "scale", 1) or (0,)) * 3
    if path is None or not all(scale) or max(map(abs, scale)) > LONGEST:
        return None
    try:
        corners, faces, inside = (part * np.array(scale) for part in _hull(str(path), _stamp(path)))
    except (OSError, ValueError):
        return None
    if not len(corners) or np.abs(corners).max() > LONGEST:
        return None
    # The hull is the sum of the tetrahedra from a point inside to its faces; which way a face is turned does not matter.
    edges = faces - inside  # (k, 3 corners, 3)
    volumes = np.abs(np.linalg.det(edges)) / 6
    volume = float(volumes.sum())
    if volume <= 0:
        return corners, 0.0, inside, np.zeros((3, 3))
    total = edges.sum(axis=1)
    first = (volumes[:, None] * total).sum(axis=0) / 4
    second = np.einsum("k,kci,kcj->ij", volumes, edges, edges) + np.einsum("k,ki,kj->ij", volumes, total, total)
    center = first / volume
    second = second / 20 - volume * np.outer(center, center)
    return corners, volume, inside + center, np.trace(second) * np.eye(3) - second


def _round_half(shape: Any, R: Array) -> Array:
    radius = (numbers_of(shape, "radius", 1) or (0.0,))[0]
    if shape.tag == "sphere":
        return np.full(3, radius)
    length = (numbers_of(shape, "length", 1) or (0.0,))[0]
    along = np.abs(R[:, 2])
    if shape.tag == "capsule":
        return along * length / 2 + radius
    return along * length / 2 + radius * np.sqrt(np.clip(1 - along * along, 0, None))


def _united(solids: list[Solid]) -> Solid:
    low = np.min([solid.low for solid in solids], axis=0)
    high = np.max([solid.high for solid in solids], axis=0)
    volume = sum(solid.volume for solid in solids)
    if volume <= 0:
        return Solid(low, high, 0.0, (low + high) / 2, np.zeros((3, 3)))
    center = sum((solid.volume * solid.center for solid in solids), np.zeros(3)) / volume
    moments = np.zeros((3, 3))
    for solid in solids:
        d = solid.center - center
        moments += solid.moments + solid.volume * (d @ d * np.eye(3) - np.outer(d, d))
    return Solid(low, high, volume, center, moments)


_LONGEST = 80  # characters of a path
_SEARCHED = 5000  # files looked at for a mesh that has moved
_LEAST = 1e-9  # [m] smaller meshes are points
_SMALLEST = 1e-3  # [m] a mesh in millimetres is at least this large in metres


def look_at_geometry(chart: Chart) -> None:
    """Find meshes that are missing, cannot be read or are in millimetres, and links without a shape."""
    for link in chart.links:
        for tag in ("collision", "visual"):
            for part in link.findall(tag):
                _look_at_shape(chart, part, needed=tag == "collision")
    _without_shape(chart)


def _look_at_shape(chart: Chart, part: Any, *, needed: bool) -> None:
    geometry = part.find("geometry")
    shapes = [] if geometry is None else [shape for shape in geometry if isinstance(shape.tag, str)]
    severity = "error" if needed else "warning"
    if len(shapes) != 1 or shapes[0].tag not in SHAPES:
        given = " and ".join(f"<{shape.tag}>" for shape in shapes)
        chart.found(
            severity,
            "shape-unknown",
            part,
            f"a <{part.tag}> needs one shape",
            value=given,
            expected=f"one of <{'>, <'.join(SHAPES)}>",
            advice="replace it by one of these, or by several <collision> elements",
        )
        return
    mesh = shapes[0]
    if mesh.tag == "capsule":
        chart.found(
            "note",
            "capsule-uncommon",
            mesh,
            "not every reader knows <capsule>; spacearm takes it as it is",
            advice="for other readers, take a cylinder with a sphere on each end",
        )
    if mesh.tag != "mesh":
        return
    name, directory = mesh.get("filename") or "", chart.path.parent
    path = mesh_path(mesh, directory)
    if path is None:
        found = _elsewhere(name, directory)
        chart.found(
            severity,
            "mesh-missing",
            mesh,
            f"its {part.tag} mesh is not there",
            value=_path(name) if name else "no filename",
            expected="a file beside the URDF, or for package:// in a directory above it",
            advice=f"write {shown(found)}, the only file of that name" if found else "put the file there, or correct the path",
            remedy=setting(mesh, "filename", found) if found else None,
        )
    elif needed or not part.getparent().findall("collision"):
        _look_at_mesh(chart, part, mesh, path, needed)


def _path(name: str) -> str:
    """Show a path, a long one by its end, which tells the file."""
    return repr(name if len(name) <= _LONGEST else f"...{name[-_LONGEST:]}")


def _look_at_mesh(chart: Chart, part: Any, mesh: Any, path: Path, needed: bool) -> None:
    scale = numbers_of(mesh, "scale", 3, (1, 1, 1)) or (numbers_of(mesh, "scale", 1) or (1,)) * 3
    try:
        edges = mesh_size(path) * [abs(s) for s in scale]
    except (OSError, ValueError) as error:
        if needed:  # a visual one may be of a format that only others read
            chart.found(
                "error",
                "mesh-unreadable",
                mesh,
                f"its mesh cannot be read ({error})",
                value=_path(mesh.get("filename")),
                expected="triangles, as in STL, OBJ, PLY",
                advice="repair or convert the file",
            )
        return
    size = float(edges.max())
    if not all(scale) or size < _LEAST:
        chart.found(
            "error" if needed else "warning",
            "mesh-without-size",
            mesh,
            f"its {part.tag} mesh is nothing but a point" if all(scale) else f"its {part.tag} mesh is scaled to nothing",
            value=mesh.get("scale") or "no scale",
            expected="a surface, and factors other than 0",
            advice="correct the scale or the file",
        )
        return
    chain = chain_length((link_of(one, "parent"), link_of(one, "child"), _length(one)) for one in chart.joints)
    if size > FARTHEST or looks_like_millimetres(size, chain):
        small = " ".join(written(s / 1e3) for s in scale)
        chart.found(
            "warning",
            "mesh-in-millimetres",
            mesh,
            f"its {part.tag} mesh is {size:g} m long"
            + ("" if size > FARTHEST else f", and the joints reach {chain:.3g} m")
            + ": it looks like millimetres",
            value=mesh.get("scale") or "no scale",
            expected="metres",
            advice=f'write scale="{small}", if so',
            remedy=setting(mesh, "scale", small) if size > FARTHEST and size / 1e3 >= _SMALLEST else None,
        )


def _length(joint: Any) -> float:
    xyz = numbers_of(joint.find("origin"), "xyz", 3, (0, 0, 0))
    return 0.0 if xyz is None else math.hypot(*xyz)


def _elsewhere(name: str, directory: Path) -> str:
    """Look for a file of the same name below the URDF's directory; "" unless there is exactly one."""
    wanted = name.replace("\\", "/").rpartition("/")[2]
    if not wanted or len(wanted) > 255:
        return ""
    found, seen = [], 0
    for folder, _, files in os.walk(directory):
        seen += len(files) + 1
        if wanted in files:
            found.append(Path(os.path.relpath(os.path.join(folder, wanted), directory)).as_posix())
        if seen > _SEARCHED or len(found) > 1:
            return ""
    return found[0] if found else ""


def _without_shape(chart: Chart) -> None:
    with_collision = [link for link in chart.links if link.find("collision") is not None]
    bare = []
    for link in chart.links:
        if link.find("collision") is not None:
            continue
        visuals = link.findall("visual")
        mass = number_of(link.find("inertial/mass"), "value")
        if visuals:
            readable = all(_can_enclose(visual, chart.path.parent) for visual in visuals)
            chart.found(
                "warning",
                "collision-missing",
                link,
                "is drawn but has no collision shape, so nothing keeps it clear",
                expected="<collision>",
                advice="give it one; its visual shape will do",
                remedy=(lambda link=link: _from_visual(link)) if readable else None,
            )
        elif mass:
            bare.append(link)
    if bare and not with_collision and not any(link.find("visual") is not None for link in chart.links):
        chart.found(
            "warning",
            "no-shapes",
            chart.root,
            "no link has a shape: there is nothing to keep clear of obstacles",
            expected="<collision> shapes",
            advice="give each link with a mass one; cylinders and boxes will do",
        )
    else:
        for link in bare:
            chart.found(
                "warning",
                "shape-missing",
                link,
                "has a mass but no shape, so nothing keeps it clear",
                expected="<collision>",
                advice="give it one; a cylinder or a box will do",
            )


def _can_enclose(visual: Any, directory: Path) -> bool:
    geometry = visual.find("geometry")
    shapes = [] if geometry is None else [shape for shape in geometry if isinstance(shape.tag, str)]
    if len(shapes) != 1 or shapes[0].tag not in SHAPES:
        return False
    if shapes[0].tag != "mesh":
        return True
    path = mesh_path(shapes[0], directory)
    try:
        return path is not None and bool(mesh_size(path).max() > 0)
    except (OSError, ValueError):
        return False


def _from_visual(link: Any) -> str:
    visuals = link.findall("visual")
    for visual in visuals:
        made = copy.deepcopy(visual)
        made.tag = "collision"
        for material in made.findall("material"):
            made.remove(material)
        if visual.getnext() is None:
            visual.tail = link.text
        link.insert(link.index(visual) + 1, made)
    count = len(visuals)
    return f"<collision> copied from {count} <visual> shape{'s' if count > 1 else ''}"
