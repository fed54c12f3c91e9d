"""Shapes of a report's page as triangles with normals, for glTF: unit shapes that nodes scale, and meshes with creases."""

from __future__ import annotations

from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from spacearm.report.report_page import unpacked, unquantised

Array = NDArray[np.float64]
Faces = NDArray[np.intp]

_AROUND = 40  # corners of a circle
_CREASE = np.cos(np.radians(30))  # edges that are sharper stay sharp
_BALL = 3  # times that an icosahedron is halved for a ball


class Solid(NamedTuple):
    """Triangles: points and normals (k, 3), indices (m, 3), and the triangles' colours (m, 3) 0 to 1, if they have some."""

    points: Array
    normals: Array
    faces: Faces
    colors: Array | None = None


@cache
def unit_box() -> Solid:
    """Return a cube with edges of 1, about the origin."""
    points, normals, faces = [], [], []
    for axis in range(3):
        for side in (-1.0, 1.0):
            u, v = (axis + 1) % 3, (axis + 2) % 3
            corner = np.zeros((4, 3))
            corner[:, axis] = side / 2
            corner[:, u], corner[:, v] = [-0.5, 0.5, 0.5, -0.5], [-0.5, -0.5, 0.5, 0.5]
            normal = np.zeros(3)
            normal[axis] = side
            turns = [[0, 1, 2], [0, 2, 3]] if side > 0 else [[0, 2, 1], [0, 3, 2]]
            faces.append(np.array(turns) + 4 * len(points))
            points.append(corner)
            normals.append(np.tile(normal, (4, 1)))
    return Solid(np.concatenate(points), np.concatenate(normals), np.concatenate(faces))


@cache
def unit_ball(halved: int = _BALL) -> Solid:
    """Return a ball of radius 1 about the origin: an icosahedron whose triangles were halved some times."""
    points, faces = _icosahedron()
    for _ in range(halved):
        edges = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
        pairs, index = np.unique(edges, axis=0, return_inverse=True)
        a, b, c = (index.reshape(-1, 3)[:, i] + len(points) for i in range(3))
        middle = points[pairs].mean(axis=1)
        points = np.concatenate([points, middle / np.linalg.norm(middle, axis=1, keepdims=True)])
        i, j, k = faces.T
        faces = np.concatenate([np.stack(row, axis=1) for row in ((i, a, c), (j, b, a), (k, c, b), (a, b, c))])
    return Solid(points, points, faces)


def _icosahedron() -> tuple[Array, Faces]:
    golden = (1 + 5**0.5) / 2
    signs = [(a, b) for a in (-1, 1) for b in (-golden, golden)]
    points = np.array([p for a, b in signs for p in ((0, a, b), (a, b, 0), (b, 0, a))], dtype=np.float64)
    apart = np.linalg.norm(points[:, None] - points[None], axis=2) < 2.1
    rows = [(i, j, k) for i in range(12) for j in range(i) for k in range(j) if apart[i, j] and apart[j, k] and apart[k, i]]
    faces = np.array(rows)
    outwards = np.linalg.det(points[faces]) > 0
    faces = np.where(outwards[:, None], faces, faces[:, ::-1])
    return points / np.linalg.norm(points, axis=1, keepdims=True), faces


@cache
def unit_cylinder() -> Solid:
    """Return a cylinder of radius 1 and length 1 along z, about the origin."""
    rim = _rim()
    side = np.concatenate([np.column_stack([rim, np.full(_AROUND, z)]) for z in (-0.5, 0.5)])
    normals = np.tile(np.column_stack([rim, np.zeros(_AROUND)]), (2, 1))
    points, all_normals, faces = [side], [normals], [_band(0, _AROUND)]
    for end in (-1.0, 1.0):
        first = 2 * _AROUND if end < 0 else 3 * _AROUND
        points.append(np.column_stack([rim, np.full(_AROUND, end / 2)]))
        all_normals.append(np.tile([0.0, 0.0, end], (_AROUND, 1)))
        fan = np.array([[0, i, i + 1] for i in range(1, _AROUND - 1)]) + first
        faces.append(fan if end > 0 else fan[:, ::-1])
    return Solid(np.concatenate(points), np.concatenate(all_normals), np.concatenate(faces))


def capsule(radius: float, length: float) -> Solid:
    """Return a capsule along z about the origin; the length is without its round ends [m]."""
    steps = _AROUND // 4
    rise = np.linspace(0, np.pi / 2, steps + 1)[:-1]
    heights = np.concatenate([-np.sin(rise)[::-1], np.sin(rise)])
    widths = np.concatenate([np.cos(rise)[::-1], np.cos(rise)])
    rim, count = _rim(), 2 * steps
    normals = np.concatenate([np.column_stack([w * rim, np.full(_AROUND, h)]) for w, h in zip(widths, heights, strict=True)])
    normals = np.concatenate([normals, [[0, 0, -1.0], [0, 0, 1.0]]])
    points = radius * normals
    points[: steps * _AROUND, 2] -= length / 2
    points[steps * _AROUND : count * _AROUND, 2] += length / 2
    points[-2, 2] -= length / 2
    points[-1, 2] += length / 2
    at, following = np.arange(_AROUND), (np.arange(_AROUND) + 1) % _AROUND
    top, last = (count - 1) * _AROUND, count * _AROUND
    south = np.stack([following, at, np.full(_AROUND, last)], axis=1)
    north = np.stack([top + at, top + following, np.full(_AROUND, last + 1)], axis=1)
    return Solid(
        points, normals, np.concatenate([*(_band(_AROUND * i, _AROUND * (i + 1)) for i in range(count - 1)), south, north])
    )


def _rim() -> Array:
    angle = 2 * np.pi * np.arange(_AROUND) / _AROUND
    return np.column_stack([np.cos(angle), np.sin(angle)])


def _band(lower: int, upper: int) -> Faces:
    """Return the triangles between two circles of points."""
    at, following = np.arange(_AROUND), (np.arange(_AROUND) + 1) % _AROUND
    a, b, c, d = lower + at, lower + following, upper + following, upper + at
    return np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])


def mesh_solid(mesh: dict[str, Any]) -> Solid:
    """Return a mesh of the page as triangles, smooth over edges of less than 30 degrees."""
    points = unquantised(mesh["positions"], mesh["low"], mesh["high"])
    faces = unpacked(mesh["indices"]).reshape(-1, 3).astype(np.intp)
    colors = unpacked(mesh["colors"]).reshape(-1, 3) / 255 if "colors" in mesh else None
    normals, group = _creased(points, faces)
    return Solid(points[faces.ravel()[group[0]]], normals, group[1].reshape(-1, 3), colors)


def _creased(points: Array, faces: Faces) -> tuple[Array, tuple[Faces, Faces]]:
    """Return the normals (k, 3) of the corners that differ; which corner of all is the first of each, and each corner's."""
    a, b, c = (points[faces[:, i]] for i in range(3))
    area = np.cross(b - a, c - a)
    length = np.linalg.norm(area, axis=1, keepdims=True)
    unit = area / np.where(length > 0, length, 1.0)
    corner = np.argsort(faces.ravel(), kind="stable")  # corners by the point that they are at
    face, at = corner // 3, faces.ravel()[corner]
    count = np.bincount(at, minlength=len(points))
    first = np.cumsum(count) - count
    here = np.repeat(np.arange(len(corner)), count[at])  # every corner with every corner at its point
    step = np.arange(len(here)) - np.repeat(np.cumsum(count[at]) - count[at], count[at])
    other = face[np.repeat(first[at], count[at]) + step]
    near = (unit[face[here]] * unit[other]).sum(axis=1) >= _CREASE
    weights = area[other] * near[:, None]
    summed = np.stack([np.bincount(here, weights[:, i], len(corner)) for i in range(3)], axis=1)
    norm = np.linalg.norm(summed, axis=1, keepdims=True)
    normals = np.empty((len(corner), 3))
    normals[corner] = np.where(norm > 0, summed / np.where(norm > 0, norm, 1.0), [0.0, 0.0, 1.0])
    key = np.column_stack([faces.ravel(), np.round(normals * 1000).astype(np.int64)])
    _, chosen, index = np.unique(key, axis=0, return_index=True, return_inverse=True)
    return normals[chosen], (chosen, index.reshape(-1))
