"""Meshes and point clouds from files: the one reader that robots, obstacles, the doctor and the figures share.

Coordinates are taken as the file has them, in metres, with every node's transform and each instance. A unit that the file
states (COLLADA's `<unit>`, 3MF's) is applied, as RViz and Gazebo do. The axis that points up (COLLADA's `<up_axis>`, glTF's
y) is not: RViz, MoveIt and Pinocchio ignore it, and models are made for them.
"""

from __future__ import annotations

import io
import math
import os
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm.core.checks import as_readonly, dimensions_of, shown, shown_error
from spacearm.core.errors import FileFormatError, SceneError
from spacearm.core.reading import LFS_ADVICE, is_lfs_pointer, read_bytes
from spacearm.geometry.mesh_colors import collada_colors, trimesh_colors

Array = NDArray[np.float64]

LARGEST = 1e6
"""[m] coordinates beyond this are refused."""

_VAST = 100.0  # [m] a larger mesh may be in millimetres, which a note says
_STL_HEADER = 84  # bytes: a text of 80, and the number of triangles
_STL_TRIANGLE = np.dtype([("numbers", "<f4", 12), ("attribute", "<u2")])  # a normal and three corners
_VERTEX = re.compile(rb"\bvertex\s+(\S+)\s+(\S+)\s+(\S+)", re.IGNORECASE)
_RELATIVE = re.compile(rb"^[ \t]*f[ \t][^\r\n]*-\d", re.MULTILINE)
_DEEPEST = 200  # nodes below one another
_FACES = ("triangles", "polylist", "polygons", "tristrips", "trifans")  # COLLADA's elements that hold a surface
_KINDS = {b"ply": "ply", b"OFF": "off", b"glTF": "glb"}  # what a file begins with


@dataclass(frozen=True, slots=True, eq=False)
class Mesh:
    """A surface.

    Attributes:
        triangles: (n, 3, 3) corners, n > 0 [m].
        notes: what was assumed or applied; a few words each, without the file's name.
        colors: (n, 4) red, green, blue and opacity of each triangle, 0 to 1; nan where the file states none. None if they were
            not asked for, or the format has none.
    """

    triangles: Array
    notes: tuple[str, ...] = ()
    colors: Array | None = None


def read_mesh(path: str | os.PathLike[str], *, with_colors: bool = False) -> Mesh:
    """Read a mesh file: STL, OBJ, PLY, OFF, DAE, GLB, and what else trimesh reads.

    The format follows from the content where that is clear, else from the ending of the name, in any case.

    Args:
        path: of the file.
        with_colors: read the colours as well, for a picture: materials, and textures that are beside the file.

    Raises:
        ValueError: it holds no mesh that can be used; the message says why, in a few words.
        OSError: it cannot be opened.
    """
    content = Path(path).read_bytes()
    if is_lfs_pointer(content):
        raise ValueError(f"it is a Git LFS pointer, not the mesh itself; {LFS_ADVICE}")
    if not content.strip():
        raise ValueError("it is empty")
    try:
        mesh = _read(content, Path(path), with_colors)
    except ValueError:
        raise
    except Exception as error:  # each of the loaders has exceptions of its own
        raise ValueError(shown_error(error)) from None
    if not mesh.triangles.size:
        raise ValueError("it has no triangles")
    if not np.isfinite(mesh.triangles).all():
        raise ValueError("it has vertices that are not finite")
    return mesh


def stl_of(triangles: Array) -> bytes:
    """Return triangles (n, 3, 3) as a file of binary STL."""
    rows = np.zeros(len(triangles), dtype=_STL_TRIANGLE)
    normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    rows["numbers"][:, :3] = normal / np.where(length > 0, length, 1.0)
    rows["numbers"][:, 3:] = triangles.reshape(-1, 9)
    return b"spacearm".ljust(_STL_HEADER - 4) + len(rows).to_bytes(4, "little") + rows.tobytes()


def mesh_triangles(path: str | os.PathLike[str]) -> Array:
    """Return the triangles (n, 3, 3) of a mesh file, n > 0 [m]; errors as those of `read_mesh`."""
    return read_mesh(path).triangles


def _read(content: bytes, path: Path, with_colors: bool) -> Mesh:
    ending = path.suffix.lower().lstrip(".")
    start = content[:400].lstrip(b"\xef\xbb\xbf \t\r\n")
    if b"<COLLADA" in content[:4000] or (ending == "dae" and start.startswith(b"<")):
        return _collada(content, path.parent if with_colors else None)
    known = next((kind for mark, kind in _KINDS.items() if start.startswith(mark)), None)
    if known is None and (ending == "stl" or _is_text_stl(content) or is_binary_stl(content)):
        return Mesh(_stl(content))
    if ending == "obj" and _RELATIVE.search(content):
        return Mesh(_obj(content))
    return _by_trimesh(path, known or ending, with_colors)


def _is_text_stl(content: bytes) -> bool:
    return content[:400].lstrip().lower().startswith(b"solid") and b"facet" in content[:4000].lower()


def is_binary_stl(content: bytes) -> bool:
    """Whether a file is as long as its number of triangles says; it may begin with "solid" all the same."""
    return len(content) > _STL_HEADER and len(content) == _STL_HEADER + _stl_count(content) * _STL_TRIANGLE.itemsize


def _stl_count(content: bytes) -> int:
    return int.from_bytes(content[_STL_HEADER - 4 : _STL_HEADER], "little") if len(content) >= _STL_HEADER else -1


def _stl(content: bytes) -> Array:
    if content[:400].lstrip().lower().startswith(b"solid") and not is_binary_stl(content):
        rows = _VERTEX.findall(content)
        if len(rows) % 3:
            raise ValueError(f"it has {len(rows)} vertices, which make no whole number of triangles; it is cut off")
        return np.array(rows, dtype="S").astype(np.float64).reshape(-1, 3, 3)
    count = _stl_count(content)
    if count < 0 or _STL_HEADER + count * _STL_TRIANGLE.itemsize > len(content):
        said = f"is to hold {count:,} triangles and is cut off" if count > 0 else "is no STL file"
        raise ValueError(f"it {said}")
    numbers = np.frombuffer(content, dtype=_STL_TRIANGLE, count=count, offset=_STL_HEADER)["numbers"]
    return numbers[:, 3:].reshape(-1, 3, 3).astype(np.float64)


def _obj(content: bytes) -> Array:
    """Read an OBJ whose faces count vertices back from where they stand, which trimesh counts from the end of the file."""
    vertices: list[list[float]] = []
    triangles: list[tuple[int, int, int]] = []
    for line in content.decode("utf-8", errors="replace").replace("\\\n", " ").splitlines():
        word, *rest = line.split("#")[0].split() or [""]
        if word == "v":
            vertices.append([float(number) for number in rest[:3]])
        elif word == "f":
            numbers = [int(corner.split("/")[0]) for corner in rest]
            corners = [number - 1 if number > 0 else len(vertices) + number for number in numbers]
            if not all(0 <= corner < len(vertices) for corner in corners):
                raise ValueError(f"a face has a vertex that is not there: {shown(line)}")
            triangles += [(corners[0], *corners[i : i + 2]) for i in range(1, len(corners) - 1)]  # type: ignore[misc]
    return np.array(vertices, dtype=np.float64).reshape(-1, 3)[np.array(triangles, dtype=np.intp).reshape(-1, 3)]


def _by_trimesh(path: Path, kind: str, with_colors: bool) -> Mesh:
    import trimesh

    scene = trimesh.load_scene(os.fspath(path), file_type=kind, process=False)
    colors: Array | None = None
    said: tuple[str, ...] = ()
    if with_colors:
        parts = [part for part in scene.dump() if isinstance(part, trimesh.Trimesh)]
        painted = [trimesh_colors(part) for part in parts]
        triangles = np.concatenate([np.zeros((0, 3, 3)), *(np.asarray(part.triangles, dtype=np.float64) for part in parts)])
        colors = np.concatenate([np.zeros((0, 4)), *(own for own, _ in painted)])
        said = tuple(dict.fromkeys(note for _, notes in painted for note in notes))
    else:
        mesh = scene.to_mesh()
        vertices, faces = np.asarray(mesh.vertices, dtype=np.float64), np.asarray(mesh.faces, dtype=np.intp)
        triangles = vertices[faces] if len(vertices) else np.zeros((0, 3, 3))
    if kind in ("glb", "gltf"):
        upward = "glTF's y axis, which points up, is not turned to z: coordinates are the file's own"
        return Mesh(triangles, (upward, *said), colors)
    units = scene.units
    factor = trimesh.units.unit_conversion(units, "meters") if units else 1.0
    applied = (f"the file's unit, {units}, is applied",) if factor != 1.0 else ()
    return Mesh(triangles * factor, (*applied, *said), colors)


def _collada(content: bytes, folder: Path | None = None) -> Mesh:
    """Read COLLADA through pycollada; what that leaves out without a word is an error here."""
    from collada import Collada
    from collada.common import DaeError
    from collada.lineset import LineSet

    unit, up, faces = _asset(content)
    document = Collada(io.BytesIO(content), ignore=[DaeError])
    if document.scene is None:
        raise ValueError("it has no scene, so that nothing in it is shown")
    for geometry in document.geometries:
        read = sum(not isinstance(one, LineSet) for one in geometry.primitives)
        if read < faces.pop(geometry.id, 0):
            raise ValueError(f"a part of its geometry {shown(geometry.id)} cannot be read")
    if any(faces.values()):
        raise ValueError(f"its geometry {shown(max(faces, key=lambda name: faces[name]))} cannot be read")
    surfaces = [surface for node in document.scene.nodes for surface in _surfaces(node, np.eye(4), 0)]
    triangles = np.concatenate([np.zeros((0, 3, 3)), *(corners for corners, _, _ in surfaces)])
    colors, said = (None, ()) if folder is None else collada_colors([(node, flat) for _, node, flat in surfaces], folder)
    notes = []
    if unit != 1.0:
        notes.append(f"COLLADA's unit, {unit:g} m, is applied")
    if up not in ("", "Z_UP"):
        notes.append(f"COLLADA's up_axis, {up}, is not applied, as in RViz and MoveIt: coordinates are the file's own")
    return Mesh(triangles * unit, (*notes, *said), colors)


def _asset(content: bytes) -> tuple[float, str, dict[str, int]]:
    """Return the unit [m], the axis that is up, and how many surfaces each geometry has."""
    from lxml import etree  # pyright: ignore[reportAttributeAccessIssue] (compiled, no stubs)

    root = etree.fromstring(content, etree.XMLParser(resolve_entities=False, no_network=True, recover=True, huge_tree=True))
    if root is None:
        raise ValueError("it is no XML")
    asset = root.find("{*}asset")
    element = None if asset is None else asset.find("{*}unit")
    text = "1" if element is None else element.get("meter", "1")
    try:
        unit = float(text)
    except ValueError:
        unit = math.nan
    if not (math.isfinite(unit) and unit > 0):
        raise ValueError(f"its unit is {shown(text)} m, expected a number above 0")
    up = "" if asset is None else (asset.findtext("{*}up_axis") or "").strip()
    faces = {}
    for geometry in root.iterfind("{*}library_geometries/{*}geometry"):
        found = [one for tag in _FACES for one in geometry.iterfind(f"{{*}}mesh/{{*}}{tag}")]
        faces[geometry.get("id")] = sum(one.get("count") != "0" and one.find("{*}p") is not None for one in found)
    return unit, up, faces


def _surfaces(node: Any, T: Array, depth: int) -> Iterator[tuple[Array, Any, Any]]:
    """Yield the triangles (n, 3, 3) below a node of COLLADA's scene, placed by T (4, 4), which may scale.

    With them come pycollada's node that shows them, and its own triangles.
    """
    from collada.polylist import Polylist
    from collada.scene import ControllerNode, GeometryNode, Node
    from collada.triangleset import TriangleSet

    if depth > _DEEPEST:
        raise ValueError(f"its nodes are nested more than {_DEEPEST} deep")
    if isinstance(node, ControllerNode):
        raise ValueError("it is moved by a skeleton (instance_controller), expected a rigid mesh; export it without")
    if isinstance(node, Node):
        for child in node.children:
            yield from _surfaces(child, T @ node.matrix, depth + 1)
    elif isinstance(node, GeometryNode):
        for part in node.geometry.primitives:
            flat = part.triangleset() if isinstance(part, Polylist) else part
            if isinstance(flat, TriangleSet) and flat.vertex is not None and len(flat):
                corners = np.asarray(flat.vertex, dtype=np.float64)[flat.vertex_index]
                yield corners @ T[:3, :3].T + T[:3, 3], node, flat


def scaled_mesh(mesh: Mesh | str | os.PathLike[str] | Any, scale: ArrayLike) -> Mesh:
    """Return a mesh with its coordinates scaled, and what was assumed.

    Args:
        mesh: as for `mesh_of`.
        scale: one number, or three for x, y and z.

    Raises:
        FileFormatError: a file that is missing, or that holds no mesh.
        SceneError: no mesh, a scale of 0, or coordinates that are not finite or vast.
    """
    read = mesh_of(mesh)
    triangles = read.triangles * scale_factors(scale)
    if not np.isfinite(triangles).all() or np.abs(triangles).max() > LARGEST:
        raise SceneError(f"the mesh has coordinates beyond {LARGEST:g} m, expected an arm's surroundings; check its scale")
    size = float(np.ptp(triangles.reshape(-1, 3), axis=0).max())
    vast = (f"it is {size:.3g} m in size: if it is in millimetres, give scale=0.001",) if size > _VAST else ()
    return Mesh(triangles, (*read.notes, *vast))


def scale_factors(scale: ArrayLike) -> Array:
    """Return the factors (3,) of a scale, one number or three.

    Raises:
        SceneError: others, or one that is 0.
    """
    each: Any = (scale, scale, scale) if dimensions_of(scale) == 0 else scale
    factors = as_readonly("scale", each, (3,), SceneError, advice="give one number, or three for x, y and z")
    if not (np.abs(factors) > 0).all():
        raise SceneError(f"scale is {factors.tolist()}, expected factors other than 0")
    return factors


def mesh_of(mesh: Mesh | str | os.PathLike[str] | Any) -> Mesh:
    """Return the triangles (n, 3, 3) of a mesh, n > 0 [m], and what was assumed in reading it.

    Args:
        mesh: a file's path, a mesh that was read, a `trimesh.Trimesh` (or what else has vertices and faces), or
            triangles (n, 3, 3).

    Raises:
        FileFormatError: a file that is missing, or that holds no mesh.
        SceneError: something else, or no triangles.
    """
    if isinstance(mesh, (str, os.PathLike)):
        return _mesh_in(mesh)
    if isinstance(mesh, Mesh):
        return mesh
    if hasattr(mesh, "vertices") and hasattr(mesh, "faces"):
        vertices = as_readonly("the mesh's vertices", mesh.vertices, (None, 3), SceneError)
        faces = np.asarray(mesh.faces if dimensions_of(mesh.faces) >= 0 else ())
        if faces.ndim != 2 or faces.shape[1] != 3 or faces.dtype.kind not in "iu":
            raise SceneError(f"the mesh's faces have shape {faces.shape}, expected (n, 3) indices of vertices")
        if faces.size and not 0 <= faces.min() <= faces.max() < len(vertices):
            raise SceneError(f"the mesh's faces go up to vertex {faces.max()}, expected 0 to {len(vertices) - 1}")
        triangles = vertices[faces]
    else:
        triangles = as_readonly("the mesh", mesh, (None, 3, 3), SceneError, advice="give a file, a Trimesh, or triangles")
    if not len(triangles):
        raise SceneError("the mesh has no triangles, expected at least one; for points use enclose_points")
    return Mesh(triangles)


def _mesh_in(path: str | os.PathLike[str]) -> Mesh:
    read_bytes(path, what="a mesh")
    try:
        return read_mesh(path)
    except (OSError, ValueError) as error:
        raise FileFormatError(
            f"{path} cannot be read as a mesh ({error}), expected STL, OBJ, PLY, DAE or GLB; check the file"
        ) from None


def read_points(path: str | os.PathLike[str]) -> Array:
    """Read a point cloud.

    Args:
        path: NumPy's .npy with an array (n, 3); .ply; or text (.xyz, .csv, .txt), a point a line: x, y and z first, split
            by commas, semicolons or blanks, other columns and one line of headings ignored, # begins a comment.

    Returns:
        The points (n, 3), n > 0 [m].

    Raises:
        FileFormatError: the file is missing, or holds no points.
    """
    content = read_bytes(path, what="a point cloud")
    kind = Path(path).suffix.lower()
    try:
        if kind == ".npy":
            points: Any = np.load(io.BytesIO(content), allow_pickle=False)
        elif kind == ".ply":
            import trimesh

            points = np.asarray(trimesh.load_scene(io.BytesIO(content), file_type="ply").to_geometry().vertices)  # type: ignore[union-attr]
        else:
            points = _table(content, path)
        reason = f"it holds {points.dtype} of shape {points.shape}"
    except FileFormatError:
        raise
    except Exception as error:  # a broken file
        points, reason = np.empty(0), shown_error(error)
    if points.ndim != 2 or points.shape[1] < 3 or not len(points) or points.dtype.kind not in "iuf":
        raise FileFormatError(f"{path} cannot be read as points ({reason}), expected rows of x, y and z [m]; check the file")
    points = points[:, :3].astype(np.float64)
    bad = ~np.isfinite(points).all(axis=1)
    if bad.any():
        at = int(np.argmax(bad))
        raise FileFormatError(f"{path}: point {at} is {shown(points[at].tolist())}, expected finite numbers; leave it out")
    return points


def _table(content: bytes, path: str | os.PathLike[str]) -> Array:
    rows: list[list[float]] = []
    for number, line in enumerate(content.decode("utf-8-sig").splitlines(), start=1):
        text = line.split("#")[0].strip()
        words = text.split(";" if ";" in text else "," if "," in text else None) if text else []
        try:
            row = [float(word) for word in words[:3]]
        except ValueError:
            row = []
            if not rows and number == 1:  # headings
                continue
        if words and len(row) < 3:
            raise FileFormatError(f"{path}: line {number} is {shown(line)}, expected x, y and z [m] of a point; correct it")
        if words:
            rows.append(row)
    return np.array(rows, dtype=np.float64).reshape(-1, 3)
