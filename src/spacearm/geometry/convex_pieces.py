"""Convex pieces that hold a mesh: its surface, and what is solid behind it.

The convex hull is taken if it stands out little. Else planes cut the solid into parts, and each piece is the hull of one part,
or of several (`piece_search`). That nothing lies between the pieces follows from how they are made (`mesh_parts`). That each
piece holds its part is looked at point by point: what is outside of it, by rounding or because it has fewer vertices, makes
its rounding radius grow.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm.core.checks import as_number, as_pose, as_whole
from spacearm.core.errors import SceneError
from spacearm.core.long_work import LongWork
from spacearm.core.user_cache import Arrays, cached_arrays
from spacearm.geometry.mesh_topology import Solid, meant_solid, require_inside
from spacearm.geometry.meshes import Mesh, scale_factors, scaled_mesh
from spacearm.geometry.piece_excess import Excess
from spacearm.geometry.piece_search import Search
from spacearm.geometry.point_hulls import Hull, few_vertices, holding
from spacearm.geometry.shapes import Polytope, PolytopeSet

Array = NDArray[np.float64]

PIECES = 16
"""How many pieces hold a mesh at most, where nothing else is asked for."""

VERTICES = 64
"""How many vertices a piece has at most, where nothing else is asked for."""

SHARE = 0.02
"""Of the mesh's largest edge: how far pieces may stand out, where nothing else is asked for."""

MOST_PIECES = 1000
"""No more pieces may be asked for."""

ALGORITHM = 2
"""Its version in the cache: raise it when other pieces come from the same mesh."""

_WHOLE = (".stl", ".obj", ".ply", ".off", ".dae", ".glb")  # endings of files that hold all of a mesh themselves
_SHARES = (1.0, 0.8, 0.4)  # of the excess that is wanted: what is left of it for the pieces beside their rounding
_TOLD = 1e-6  # [m] pieces that stand out by no more are exact but for rounding
_FINEST = 1e-9  # [m] shorter lengths are taken for 0


def convex_pieces(
    mesh: Mesh | str | os.PathLike[str] | Any,
    *,
    pieces: int = PIECES,
    excess: float | None = None,
    vertices: int = VERTICES,
    pose: ArrayLike | None = None,
    scale: ArrayLike = 1.0,
    name: str = "",
    inside: Literal["filled", "oriented", "none"] = "filled",
    cache: bool = True,
) -> PolytopeSet:
    """Enclose a mesh in convex pieces.

    Its surface is enclosed, and what is solid: every point of both is in a piece. What is solid is told as by `enclose_mesh`,
    for meshes that are double-sided, mirrored, cracked, open, or of parts that overlap. The result's `notes` say what was
    found. Results are kept between runs, by the mesh's content (`SPACEARM_CACHE`).

    Args:
        mesh: the path of a mesh file (STL, OBJ, PLY, DAE, GLB, ...), a `trimesh.Trimesh`, or triangles (n, 3, 3).
        pieces: how many, at most.
        excess: how far pieces may stand out of the mesh [m]; by default 2 % of its largest edge. As few pieces are made as are
            found to keep it. If `pieces` of them do not, they stand out further, and a note says by how much.
        vertices: of a piece, at most. A hull with more becomes one with fewer and a rounding radius.
        pose: (4, 4), T_w_mesh; a point (3,) is taken for a mesh that is not turned.
        scale: of the file's coordinates, before the pose: one number or three (along its x, y and z).
        name: for messages.
        inside: what is solid: "filled", "oriented" or "none", as for `enclose_mesh`.
        cache: whether the result may come from an earlier run, and is kept for later ones.

    Returns:
        The pieces. Their `excess` is an upper bound of how far any of them stands out of the mesh [m]; the last of their notes
        is on it, too.

    Raises:
        FileFormatError: a file that is missing, or that holds no mesh.
        SceneError: numbers that are not finite, a scale of 0, fewer than 1 piece or 4 vertices, or a mesh whose inside cannot
            be found in the given way.
    """
    require_inside(inside)
    most = as_whole("pieces", pieces, SceneError, at_least=1, at_most=MOST_PIECES)
    corners = as_whole("vertices", vertices, SceneError, at_least=4)
    asked = None if excess is None else as_number("excess", excess, SceneError, at_least=_FINEST, unit="m")
    T = as_pose("the mesh's pose", pose, SceneError)
    what = f"mesh '{name}'" if name else "the mesh"
    how: dict[str, Any] = {"pieces": most, "asked": asked, "vertices": corners, "inside": inside}
    content, factors = _content(mesh) if cache else None, scale_factors(scale)
    if content is None:
        read = scaled_mesh(mesh, factors)
        found = _kept([read.triangles, read.notes], lambda: _made(read, **how, what=what), how, cache=cache)
    else:  # the file need not be taken apart
        found = _kept([*content, factors], lambda: _made(scaled_mesh(mesh, factors), **how, what=what), how, cache=cache)
    return _placed(found, T, name, asked)


def _content(mesh: Any) -> list[Any] | None:
    """Return what a mesh file holds and the ending of its name; None if it cannot be told so what the mesh is."""
    if not isinstance(mesh, (str, os.PathLike)):
        return None
    path = Path(mesh)
    if path.suffix.lower() not in _WHOLE:
        return None
    try:
        return [path.read_bytes(), path.suffix.lower()]
    except (OSError, ValueError):  # told by the reader
        return None


def _kept(key: list[Any], make: Callable[[], Arrays], how: dict[str, Any], *, cache: bool) -> Arrays:
    return cached_arrays("convex-pieces", ALGORITHM, [*key, how], make) if cache else make()


def _placed(found: Arrays, T: Array, name: str, asked: float | None) -> PolytopeSet:
    placed = found["vertices"] @ T[:3, :3].T + T[:3, 3]
    moved = 1e-15 * float(np.abs(T[:3, 3]).max())  # rounding
    out = float(found["excess"]) + moved
    made = [
        Polytope(part, rounding=float(radius) + moved, name=name)
        for part, radius in zip(np.split(placed, found["ends"][:-1]), found["rounding"], strict=True)
    ]
    notes = (*found["notes"].tolist(), *_excess_note(len(made), out, asked, float(found["wanted"])))
    return PolytopeSet(made, excess=out, name=name, notes=notes)


def _excess_note(count: int, excess: float, asked: float | None, wanted: float) -> list[str]:
    held = "its convex hull stands out of it" if count == 1 else f"{count} convex pieces hold it, and stand out of it"
    said = f"{held} by up to {round(1000 * excess, 3):.3g} mm"
    if excess <= wanted:
        return [said if excess > _TOLD else "it is convex, and its convex hull is exact"]
    limit = f"more than the {1000 * wanted:.3g} mm {'that are 2 % of its size' if asked is None else 'that were asked for'}"
    return [f"{said}, {limit}; allow more pieces or vertices"]


def _made(mesh: Mesh, *, pieces: int, asked: float | None, vertices: int, inside: str, what: str) -> Arrays:
    """Return the pieces as arrays: their vertices, where each one's end, their rounding, how far they stand out, and notes."""
    triangles = mesh.triangles
    low, high = triangles.min(axis=(0, 1)), triangles.max(axis=(0, 1))
    middle, size = (low + high) / 2, float((high - low).max())
    far = max(size, float(np.abs(middle).max()))
    local, rounding = triangles - middle, 1e-12 * far
    wanted = max(SHARE * size, _FINEST) if asked is None else asked
    if size <= _FINEST:  # one place
        solid = Solid(local, None)
        hulls, out = [Hull(np.zeros((1, 3)), np.zeros((1, 3, 3)), np.zeros((0, 4)), rounding=2 * size)], [size]
    else:
        solid = meant_solid(local, inside, what=what, largest=float(np.abs(triangles).max()))
        rounding += solid.slack
        search = _search(solid, size=size, inside=inside, what=what)
        hulls, out = _with_few_vertices(search, pieces, wanted, vertices, shares=_SHARES if asked is not None else (1.0,))
    radii = np.array([hull.rounding for hull in hulls]) + rounding
    return {
        "vertices": np.concatenate([hull.vertices for hull in hulls]) + middle,
        "ends": np.cumsum([len(hull.vertices) for hull in hulls]),
        "rounding": radii,
        "excess": np.array(float((np.array(out) + radii).max()) + rounding),
        "wanted": np.array(wanted),
        "notes": np.array([*mesh.notes, *solid.notes], dtype=np.str_),
    }


def _with_few_vertices(
    search: Search, pieces: int, wanted: float, vertices: int, *, shares: tuple[float, ...]
) -> tuple[list[Hull], list[float]]:
    """Return hulls of few vertices, and how far each stands out without its rounding [m].

    Fewer vertices make them stand out further. So if that is too much, pieces that stand out less are looked for.
    """
    best: tuple[list[Hull], list[float]] = [], []
    least = np.inf
    for share in shares:
        found = search.pieces(pieces, share * wanted)
        hulls = [holding(few_vertices(piece.hull, vertices), piece.hull, piece.points) for piece in found]
        worst = max(piece.excess + hull.rounding for piece, hull in zip(found, hulls, strict=True))
        if worst < least:
            best, least = (hulls, [piece.excess for piece in found]), worst
        if least <= wanted or max(piece.excess for piece in found) > share * wanted:
            break
    return best


def _search(solid: Solid, *, size: float, inside: str, what: str) -> Search:
    work = LongWork()

    def tell(count: int) -> None:
        work.say(f"{what} is cut into convex pieces: {count} so far")

    measure = Excess(solid, size=size, has_cavities=inside == "oriented")
    return Search(solid, measure, size=size, tell=tell)
