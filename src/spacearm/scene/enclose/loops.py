"""Holes of a mesh: the loops along which it is open, and what closes those that are small."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from spacearm.scene.enclose.box_tree import Array, Indices

_MOST = 200_000  # open edges; a mesh with more is a soup of triangles
_SMALL = 0.1  # of its part's area: a hole no larger is taken for closed
_NARROW = 0.02  # of its part's size: a slit no wider is taken for closed, however long


class Loop(NamedTuple):
    """A closed way along open edges: the part it is in, and its vertices, in turn."""

    part: int
    vertices: list[int]


class Patches(NamedTuple):
    """What closes holes: all vertices (k, 3) [m], old ones first, the new faces (n, 3), and how many holes they close."""

    vertices: Array
    faces: NDArray[np.intp]
    holes: int


def boundary_loops(faces: NDArray[np.intp], edge: Indices, part: Indices) -> list[Loop]:
    """Take the edges at which an odd number of faces meet apart into loops; none if there are too many.

    Args:
        faces: (n, 3) indices of vertices.
        edge: (n, 3) the number of each face's edges.
        part: (n,) of each face.
    """
    flat = edge.reshape(-1)
    _, first = np.unique(flat, return_index=True)
    first = first[np.bincount(flat)[flat[first]] % 2 == 1]
    if len(first) > _MOST:
        return []
    ends = np.stack([faces.reshape(-1)[first], np.roll(faces, -1, axis=1).reshape(-1)[first]], axis=1).tolist()
    at: dict[tuple[int, int], list[int]] = {}
    parts = part[first // 3].tolist()
    for i, (pair, own) in enumerate(zip(ends, parts, strict=True)):
        for vertex in pair:
            at.setdefault((own, vertex), []).append(i)
    used = [False] * len(ends)
    loops = []
    for start, (pair, own) in enumerate(zip(ends, parts, strict=True)):
        way, place = [pair[0]], {pair[0]: 0}
        while not used[start] or len(way) > 1:
            here = way[-1]
            free = at[own, here]
            while free and used[free[-1]]:
                free.pop()
            if not free:  # every vertex has an even number of open edges, so this is the start, and it is done
                break
            used[free[-1]] = True
            there = sum(ends[free[-1]]) - here
            if there in place:  # a loop is closed; what led to it goes on
                loops.append(Loop(own, way[place[there] :]))
                for vertex in way[place[there] + 1 :]:
                    del place[vertex]
                del way[place[there] + 1 :]
            else:
                place[there] = len(way)
                way.append(there)
    return loops


def patched(vertices: Array, loops: list[Loop], faces: NDArray[np.intp], part: Indices) -> tuple[Patches, float]:
    """Close the loops that are small against their part by a fan of faces each.

    Returns:
        What closes them, and how wide the widest of them is [m].
    """
    low, high = np.full((len(faces), 3), np.inf), np.full((len(faces), 3), -np.inf)
    for corner in range(3):
        np.minimum.at(low, part, vertices[faces[:, corner]])
        np.maximum.at(high, part, vertices[faces[:, corner]])
    size, area = (high - low).max(axis=1), np.bincount(part, weights=_areas(vertices[faces]), minlength=len(faces))
    middles: list[Array] = []
    fans: list[NDArray[np.intp]] = []
    widest = 0.0
    for loop in loops:
        points, ring = vertices[loop.vertices], np.array(loop.vertices, dtype=np.intp)
        across = float(np.linalg.norm(np.ptp(points, axis=0)))
        away = points - points.mean(axis=0)
        if _areas(np.stack([0 * away, away, np.roll(away, -1, axis=0)], axis=1)).sum() > _SMALL * area[loop.part]:
            across = float(np.ptp(away @ np.linalg.svd(away, full_matrices=False)[2][1]))
            if across > _NARROW * size[loop.part]:
                continue
        widest = max(widest, across)
        if len(ring) == 3:
            fans.append(ring[None])
            continue
        middle = np.full(len(ring), len(vertices) + len(middles))
        middles.append(points.mean(axis=0))
        fans.append(np.stack([middle, ring, np.roll(ring, -1)], axis=1))
    new = np.concatenate([vertices, np.array(middles).reshape(-1, 3)])
    return Patches(new, np.concatenate([np.zeros((0, 3), dtype=np.intp), *fans]), len(fans)), widest


def _areas(triangles: Array) -> Array:
    return np.linalg.norm(np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]), axis=1) / 2
