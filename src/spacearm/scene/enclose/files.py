"""Meshes and point clouds from files."""

from __future__ import annotations

import io
import os
from pathlib import Path
from typing import Any

import numpy as np

from spacearm.checks import as_readonly, dimensions_of, shown, shown_error
from spacearm.errors import FileFormatError, SceneError
from spacearm.meshes import Mesh, read_mesh
from spacearm.reading import read_bytes
from spacearm.scene.enclose.box_tree import Array


def mesh_of(mesh: str | os.PathLike[str] | Any) -> Mesh:
    """Return the triangles (n, 3, 3) of a mesh, n > 0 [m], and what was assumed in reading it.

    Args:
        mesh: a file's path, a `trimesh.Trimesh` (or what else has vertices and faces), or triangles (n, 3, 3).

    Raises:
        FileFormatError: a file that is missing, or that holds no mesh.
        SceneError: something else, or no triangles.
    """
    if isinstance(mesh, (str, os.PathLike)):
        return _mesh_in(mesh)
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
