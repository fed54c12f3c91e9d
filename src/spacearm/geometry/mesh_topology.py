"""What of a mesh is solid: its closed parts, its small holes, and faces that are there twice.

Meshes come double-sided, mirrored, in several parts that overlap, with cracks between faces and with holes. All conventions
count: a point is inside if the surface winds around it, if a ray meets the surface an odd number of times, if one part alone
holds it, or if the surface shuts it off from outside (`mesh_queries`). To take free space for solid is the safe side.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from spacearm.core.checks import shown
from spacearm.core.errors import SceneError, nearest
from spacearm.geometry.mesh_queries import Array, Indices, Inside, Winding, Within

CONVENTIONS = ("filled", "oriented", "none")
"""Which part of a mesh is solid."""

_FLOAT32 = 2.0**-22  # of a coordinate: an upper bound of the rounding in files of single precision
_MOST = 200_000  # open edges; of a mesh with more no holes are closed
_SMALL = 0.1  # of its part's area: a hole no larger is taken for closed
_NARROW = 0.02  # of its part's size: a slit no wider is taken for closed, however long
_LOOKED_AT = 1000  # faces, in looking for cavities
_NEAR = 1e-6  # of the mesh's size: corners so near are one, where the mesh is otherwise not closed


@dataclass(frozen=True, slots=True, eq=False)
class Surfaces:
    """A mesh's faces, each once, and what is known of them.

    Attributes:
        vertices: (k, 3), each place once [m].
        faces: (n, 3) indices of vertices; none is there twice.
        source: (n,) which of the given triangles each face is; -1 for one that closes a hole.
        odd: (n,) whether a face is there an odd number of times.
        edge: (n, 3) the number of each face's edges.
    """

    vertices: Array
    faces: NDArray[np.intp]
    source: Indices
    odd: NDArray[np.bool_]
    edge: Indices


@dataclass(frozen=True, slots=True, eq=False)
class Solid:
    """What of a mesh is solid.

    Attributes:
        triangles: (n, 3, 3) its surface: each of its triangles once, and what closes its holes [m].
        inside: the test for the inside; None if nothing is inside.
        notes: what was found and assumed.
        slack: how far the surface may be from that of the test [m], in which corners that are nearly one are one.
    """

    triangles: Array
    inside: Within | Inside | Winding | None
    notes: tuple[str, ...] = ()
    slack: float = 0.0


def require_inside(inside: Any) -> None:
    """Refuse what is no convention of `meant_solid`.

    Raises:
        SceneError: such a one.
    """
    if inside not in CONVENTIONS:
        raise SceneError(f"inside is {shown(inside)}, which is not known; {nearest(str(inside), CONVENTIONS)}")


def meant_solid(triangles: Array, inside: str, *, what: str, largest: float) -> Solid:
    """Return what of a mesh is solid by one of the conventions.

    Args:
        triangles: (n, 3, 3) [m].
        inside: "filled": all that may be meant as solid. "oriented": what the surface winds around. "none": the surface alone.
        what: the mesh, for messages.
        largest: coordinate that its file has [m], of which the rounding follows.

    Raises:
        SceneError: a mesh of which cannot be told what its surface winds around.
    """
    if inside == "none":
        return Solid(triangles, None, ("its surface alone is enclosed, as asked for",))
    if inside == "filled":
        return solid_of(triangles, fuzz=_FLOAT32 * largest)
    found = wound_solid(triangles)
    if isinstance(found, str):
        raise SceneError(
            f'{what} has cavities that cannot be told, since {found}; expected a closed mesh for inside="oriented": '
            'mend it, or let inside="filled" take them for solid'
        )
    return found


def solid_of(triangles: Array, *, fuzz: float = 0.0) -> Solid:
    """Find all that may be meant as solid by a mesh.

    Args:
        triangles: (n, 3, 3) [m].
        fuzz: how far corners that are meant as one may be apart through rounding [m].
    """
    found = surfaces_of(triangles)
    given = _once(triangles, found)
    notes: list[str] = []
    size = float(np.ptp(triangles.reshape(-1, 3), axis=0).max())
    slack = max(_NEAR * size, fuzz) if _open_edges(found).any() else 0.0
    if slack:
        found = surfaces_of(triangles, near=slack)
    if not len(found.faces):
        return Solid(given, None, ("it has no inside: all its faces are without area",))
    if _open_edges(found).any():
        found, holes = _closed_where_small(found)
        notes += [] if holes is None else [holes]
    if (~found.odd).any():
        notes.append("faces that are there twice count once")
    testers, open_faces = _layers(found)
    surface = np.concatenate([given, found.vertices[found.faces[found.source < 0]]])
    crossed = bool((np.bincount(found.edge.reshape(-1)) > 2).any())
    look = crossed or bool(open_faces.any())
    within = Within(testers, found.vertices, found.faces, look_behind=look, crossed=crossed)
    notes += _open_notes(found, open_faces, within)
    inside = within if within else None
    if inside is not None and not open_faces.any() and _has_cavity(found, inside, size):
        notes.append(
            'cavities, or parts inside out, are taken for solid (inside="oriented" leaves what faces turn inward free)'
        )
    return Solid(_outward(surface, inside, size), inside, tuple(notes), slack if inside is not None else 0.0)


def wound_solid(triangles: Array) -> Solid | str:
    """Find what a mesh winds around, so that cavities which are turned inward stay free; the reason if that cannot be found."""
    found = surfaces_of(triangles)
    if not len(found.faces):
        return "all its faces are flat"
    if _open_edges(found).any():
        return "it is not closed"
    if (~found.odd).any() or len(found.faces) < int((~_flat(triangles)).sum()):
        return "faces are there twice"
    if _turns(found.faces, found.edge).any():
        return "neighbouring faces are turned against each other"
    inside = Winding(found.vertices, found.faces)
    size = float(np.ptp(found.vertices, axis=0).max())
    return Solid(_outward(triangles, inside, size), inside)


def surfaces_of(triangles: Array, *, near: float = 0.0) -> Surfaces:
    """Take triangles (n, 3, 3) apart: corners at one place, or so near [m], are one, and each face is there once."""
    vertices, corners = _merged(triangles)
    if near:
        vertices, corners = _joined(vertices, corners, near)
    which = np.flatnonzero((corners != np.roll(corners, 1, axis=1)).all(axis=1))
    key = np.sort(corners[which], axis=1)
    _, first, count = np.unique(key, axis=0, return_index=True, return_counts=True)
    order = np.argsort(first)
    source = which[first[order]]
    return _numbered(vertices, corners[source], source, count[order] % 2 == 1)


def _once(triangles: Array, found: Surfaces) -> Array:
    """Leave out the triangles that are there already, corner by corner the same; segments and points stay."""
    return np.concatenate([triangles[found.source], triangles[_flat(triangles)]])


def _numbered(vertices: Array, faces: NDArray[np.intp], source: Indices, odd: NDArray[np.bool_]) -> Surfaces:
    ends = np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2)
    _, edge = np.unique(ends.min(axis=1) * len(vertices) + ends.max(axis=1), return_inverse=True)
    return Surfaces(vertices, faces, source, odd, edge.reshape(-1, 3))


def _flat(triangles: Array) -> NDArray[np.bool_]:
    return (triangles == np.roll(triangles, 1, axis=1)).all(axis=2).any(axis=1)


def _open_edges(found: Surfaces) -> NDArray[np.bool_]:
    return np.bincount(found.edge.reshape(-1)) % 2 == 1


def _closed_where_small(found: Surfaces) -> tuple[Surfaces, str | None]:
    """Close cracks and holes that are small against the part they are in."""
    part = parts_of(found.edge)
    loops = boundary_loops(found.faces, found.edge, part)
    patches, widest = patched(found.vertices, loops, found.faces, part)
    if not len(patches.faces):
        return found, None
    faces = np.concatenate([found.faces, patches.faces])
    source = np.concatenate([found.source, np.full(len(patches.faces), -1)])
    odd = np.concatenate([found.odd, np.ones(len(patches.faces), dtype=bool)])
    new = _numbered(patches.vertices, faces, source, odd)
    if widest <= 2 * _NEAR * float(np.ptp(found.vertices, axis=0).max()):
        return new, None  # cracks of rounding, where edges meet the middle of others
    plural = "s" if patches.holes > 1 else ""
    return new, f"{patches.holes} hole{plural} of up to {widest:.3g} m in it taken for closed"


def _layers(found: Surfaces) -> tuple[list[Inside], NDArray[np.bool_]]:
    """Return tests for the inside of closed parts, and which faces (n,) are in none.

    The faces are looked at twice: each once, and without those that are there an even number of times. The first finds a
    double-sided part, the second two parts that have a wall in common.
    """
    testers: list[Inside] = []
    still_open, of = np.ones(len(found.faces), dtype=bool), parts_of(found.edge)
    for layer in (np.ones_like(found.odd), found.odd) if (~found.odd).any() else (np.ones_like(found.odd),):
        if not layer.any():
            continue
        part, edge = parts_of(found.edge[layer]), found.edge[layer]
        uneven = np.bincount(edge.reshape(-1)) % 2 == 1
        closed = ~np.isin(part, part[uneven[edge].any(axis=1)])
        if not closed.any():
            continue
        faces, oriented, number = _oriented(found.faces[layer][closed], edge[closed], part[closed])
        testers.append(Inside(found.vertices, faces, part=number, oriented=oriented))
        still_open[np.isin(of, np.setdiff1d(of[layer], of[layer][~closed]))] = False
    return testers, still_open


def _oriented(faces: NDArray[np.intp], edge: Indices, part: Indices) -> tuple[NDArray[np.intp], NDArray[np.bool_], Indices]:
    """Turn faces (n, 3) of closed parts so that neighbours agree, where that can be.

    Returns:
        The faces, for each part whether they agree, and the number of each face's part, from 0.
    """
    _, part = np.unique(part, return_inverse=True)
    wrong = np.isin(part, part[(_turns(faces, edge) != 0)[edge].any(axis=1)])
    if wrong.any():
        faces = faces.copy()
        flip = _flips(faces[wrong], edge[wrong])
        turned = np.flatnonzero(wrong)[flip]
        faces[turned] = faces[turned, ::-1]
        edge = edge.copy()
        edge[turned] = edge[turned][:, [1, 0, 2]]  # edge i goes from corner i to the next
    agree = np.ones(int(part.max()) + 1, dtype=bool)
    agree[part[(_turns(faces, edge) != 0)[edge].any(axis=1)]] = False
    return faces, agree, part


def _turns(faces: NDArray[np.intp], edge: Indices) -> NDArray[np.intp]:
    """Return for each edge how often it is passed one way, less the other way."""
    way = np.where(faces < np.roll(faces, -1, axis=1), 1.0, -1.0)
    return np.bincount(edge.reshape(-1), weights=way.reshape(-1)).astype(np.intp)


def _flips(faces: NDArray[np.intp], edge: Indices) -> NDArray[np.bool_]:
    """Return which faces are to be turned so that they agree with the first of their part, from neighbour to neighbour."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import breadth_first_order, connected_components

    face = np.repeat(np.arange(len(faces)), 3)
    way = (faces < np.roll(faces, -1, axis=1)).reshape(-1)
    order = np.argsort(edge.reshape(-1), kind="stable")
    same = np.diff(edge.reshape(-1)[order]) == 0
    a, b = order[:-1][same], order[1:][same]  # sides of faces that share an edge
    graph = coo_matrix((np.ones(len(a)), (face[a], face[b])), shape=(len(faces), len(faces))).tocsr()
    against = {}
    for i, k, disagree in zip(face[a].tolist(), face[b].tolist(), (way[a] == way[b]).tolist(), strict=True):
        against[i, k] = against[k, i] = disagree
    flip = np.zeros(len(faces), dtype=bool)
    count, label = connected_components(graph, directed=False)
    for first in np.unique(label, return_index=True)[1].tolist() if count else ():
        passed, before = breadth_first_order(graph, first, directed=False)
        for i in passed[1:].tolist():
            flip[i] = flip[before[i]] ^ against[i, before[i]]
    return flip


def _outward(triangles: Array, inside: Within | Inside | Winding | None, size: float) -> Array:
    """Turn triangles so that their normals point out of the solid; that makes for fewer balls."""
    if inside is None:
        return triangles

    def inward(chosen: Array) -> NDArray[np.bool_]:
        first, second = _beside(chosen, size)
        return inside(first) & ~inside(second)

    if not inward(triangles[:: max(1, len(triangles) // _LOOKED_AT)]).any():  # most meshes are turned right
        return triangles
    wrong, out = inward(triangles), triangles.copy()
    out[wrong] = out[wrong, ::-1]
    return out


def _beside(triangles: Array, size: float) -> tuple[Array, Array]:
    """Return a place just before and one just behind the middle of each triangle (n, 3, 3), (n, 3) each [m]."""
    normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    step = 1e-6 * size * normal / np.maximum(np.linalg.norm(normal, axis=1), 1e-300)[:, None]
    return triangles.mean(axis=1) + step, triangles.mean(axis=1) - step


def _has_cavity(found: Surfaces, inside: Within, size: float) -> bool:
    """Whether beside some face is a place that is taken for solid and that the surface does not wind around."""
    if _turns(found.faces, found.edge).any():
        return False
    beside = np.concatenate(_beside(found.vertices[found.faces[:: max(1, len(found.faces) // _LOOKED_AT)]], size))
    return bool((inside(beside) & ~Winding(found.vertices, found.faces)(beside)).any())


def _open_notes(found: Surfaces, open_faces: NDArray[np.bool_], within: Within) -> list[str]:
    notes = list(within.notes)
    if open_faces.any():
        share = "" if open_faces.all() else f" ({int(open_faces.sum()):,} of its {len(open_faces):,} faces)"
        behind = " but for what it shuts off" if within.notes else ""
        notes.append(f"it is open{share}: its surface is enclosed there, and nothing behind it{behind}")
    return notes


def _merged(triangles: Array) -> tuple[Array, NDArray[np.intp]]:
    """Return the places (k, 3) that corners have [m], and for each triangle (n, 3) its corners among them."""
    corners = triangles.reshape(-1, 3)
    order = np.lexsort(corners.T)
    placed = corners[order]
    new = np.ones(len(placed), dtype=bool)
    new[1:] = (placed[1:] != placed[:-1]).any(axis=1)
    number = np.empty(len(corners), dtype=np.intp)
    number[order] = np.cumsum(new) - 1
    return placed[new], number.reshape(-1, 3)


def _joined(vertices: Array, corners: NDArray[np.intp], near: float) -> tuple[Array, NDArray[np.intp]]:
    """Make vertices that are so near one."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import KDTree

    pairs = KDTree(vertices).query_pairs(near, output_type="ndarray")
    if not len(pairs):
        return vertices, corners
    graph = coo_matrix((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(vertices), len(vertices)))
    _, label = connected_components(graph, directed=False)
    _, first = np.unique(label, return_index=True)
    return vertices[first], label.astype(np.intp)[corners]


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


def parts_of(edges: Indices) -> Indices:
    """Return for each face (n, 3 edges) the number of its part: faces with a common edge are in one."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    count, size = len(edges), len(edges) + int(edges.max()) + 1  # nodes: the faces, then the edges
    pairs = np.repeat(np.arange(count), 3), count + edges.reshape(-1)
    _, label = connected_components(coo_matrix((np.ones(3 * count), pairs), shape=(size, size)), directed=False)
    return label[:count].astype(np.intp)
