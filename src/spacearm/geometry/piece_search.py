"""Where to cut a solid so that the convex hulls of few parts stand out little.

The part whose hull stands out most is cut in two, again and again. Cuts that are tried are at right angles to some directions:
the axes, the part's own axes, and the normals of its flat faces; at equal steps, and where flat faces are. The cut that leaves
the least room that is not solid in the hulls of both halves is made. Some cuts save nothing at first: a ring is halved before
its halves are, and one wall after the other is taken off a hollow box. So there are two ways to choose of cuts that are much
the same: the most even one, or the one that takes a convex part off. In the end, parts whose common hull stands out no more
than is asked for become one again: a plane cuts through more than it has to.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from spacearm.geometry.mesh_parts import Part, clipped, halves, whole
from spacearm.geometry.mesh_topology import Solid
from spacearm.geometry.piece_excess import Excess
from spacearm.geometry.point_hulls import Hull, axes_of, hull_of

Array = NDArray[np.float64]

_STEPS = 7  # cuts at equal steps along each direction
_FACES = 5  # cuts along flat faces for each direction
_NORMALS = 3  # directions of flat faces
_KRONECKER = 1.2207440846057596 ** -np.arange(1.0, 4.0)  # powers of the root of x^4 = x + 1
_VERY_FEW = 8  # pieces: no other way is tried if these are enough
_INSIDE = 30_000  # points spread in the box around the solid: those inside of it tell how much of a part is solid
_NEARLY = 1.15  # times the solid volume: the hull of a convex part, as these points tell it
_BESIDE = 2e-6  # of the part's extent: how far from a flat face the cut is, so that all of the face is on one side
_ROUGH = 500  # triangles, of larger surfaces, by which cuts are compared
_EDGE = 1e-4  # of the part's extent: no cut is nearer to its ends
_SPHERE = 90  # directions in which the farthest points stand for a hull
_JOINED = 8  # pairs of neighbours whose common hull is looked at in a round
_PRECISION = 0.1  # of an excess, or of what is wanted: how precise its upper bound is
_FINEST, _COARSEST = 1e-4, 2e-3  # of the solid's size: more and less precise than this is not needed
_SKIN = 0.02  # of the solid's size: flat hulls have a volume, too


class Way(NamedTuple):
    """How cuts are chosen that leave much the same room that is not solid.

    Attributes:
        even: cost of a difference of the volumes of both hulls, over the difference.
        even_room: the same, of the room in them that is not solid.
        convex: what a half without such room saves, over its volume.
    """

    even: float
    even_room: float
    convex: float


_WAYS = (Way(0.15, 0.0, 0.0), Way(0.0, 0.02, 0.5))


@dataclass(frozen=True, slots=True, eq=False)
class Piece:
    """A convex hull of one part of a solid, or of several.

    Attributes:
        hull: of all of it.
        surface: (n, 3, 3) what of the solid's surface is in it [m].
        points: (p, 3) whose hull it is [m].
        filled: (m, 3) points spread in it where it is solid [m].
        excess: about how far it stands out, or an upper bound [m].
        is_sure: whether it is an upper bound.
        part: what may be cut further; None if it was joined of several.
    """

    hull: Hull
    surface: Array
    points: Array
    filled: Array
    excess: float
    is_sure: bool = False
    part: Part | None = None


class Search:
    """Finds pieces of one solid."""

    def __init__(self, solid: Solid, excess: Excess, *, size: float, tell: Callable[[int], None]) -> None:
        """Take a solid, what measures excesses, the solid's size [m], and what is told the number of pieces now and then."""
        self._inside, self._excess, self._size, self._tell = solid.inside, excess, size, tell
        self._whole = whole(solid)
        self._filled, self._cell = _spread_inside(solid)

    def pieces(self, most: int, wanted: float) -> list[Piece]:
        """Return few pieces that together hold the solid.

        Args:
            most: how many, at most.
            wanted: how far they may stand out [m]; if that takes too many pieces, they stand out further.
        """
        first = self._piece(self._whole, self._filled)
        best: list[Piece] = []
        for way in _WAYS:
            found = self._cut_up(first, most, wanted, way)
            if not best or (max(wanted, _worst(found)), len(found)) < (max(wanted, _worst(best)), len(best)):
                best = found
            if most == 1 or (_worst(best) <= wanted and len(best) <= _VERY_FEW):
                break
        measured = [self._measured(piece, wanted) for piece in best]
        least = _worst(measured)
        if least <= wanted:
            return measured
        # Pieces that stand out less than the worst one save nothing.
        return [piece if piece.is_sure else self._measured(piece, wanted) for piece in self._joined(measured, least)]

    def _cut_up(self, first: Piece, most: int, wanted: float, way: Way) -> list[Piece]:
        pieces, count = [first], 0
        while count < len(pieces) < most or count == 0:
            count = len(pieces)
            pieces = self._joined(self._cut_further(pieces, most, wanted, way), wanted)
            if _worst(pieces) <= wanted:
                break
        return pieces

    def _cut_further(self, pieces: list[Piece], most: int, wanted: float, way: Way) -> list[Piece]:
        """Cut the piece that stands out most, again and again, until none stands out too far or there are enough."""
        done: list[Piece] = []
        open_ = list(pieces)
        while open_ and len(open_) + len(done) < most:
            worst = max(range(len(open_)), key=lambda i: open_[i].excess)
            piece = self._judged(open_.pop(worst), wanted)
            parts = None if piece.excess <= wanted else self._cut(piece, way)
            if parts is None:
                done.append(piece)
                continue
            open_ += parts
            self._tell(len(open_) + len(done))
        return [*(self._judged(piece, wanted) for piece in open_), *done]

    def _piece(self, part: Part, filled: Array) -> Piece:
        return Piece(part.hull, part.triangles, part.points, filled, self._excess.about(part.hull), part=part)

    def _judged(self, piece: Piece, wanted: float) -> Piece:
        """Return a piece with an excess of which it is sure whether it is no more than is wanted."""
        if piece.is_sure or piece.excess > wanted:
            return piece
        length = min(_PRECISION * wanted, _COARSEST * self._size)
        excess = self._excess.bound(piece.hull, piece.surface, share=_PRECISION, length=length, enough=wanted)
        return replace(piece, excess=excess, is_sure=excess <= wanted)

    def _measured(self, piece: Piece, wanted: float) -> Piece:
        """Return a piece with a close upper bound of its excess."""
        length = min(max(_PRECISION * wanted, _FINEST * self._size), _COARSEST * self._size)
        excess = self._excess.bound(piece.hull, piece.surface, share=_PRECISION, length=length)
        return replace(piece, excess=excess, is_sure=True)

    def _cut(self, piece: Piece, way: Way) -> list[Piece] | None:
        """Return the two halves of a piece; None if no cut is of use."""
        if piece.part is None:
            return None
        plane = self._best_plane(piece.part, piece.filled, way)
        if plane is None:
            return None
        normal, offset = plane
        found = halves(piece.part, normal, offset, inside=self._inside, size=self._size)
        above = piece.filled @ normal > offset
        parts = [
            self._piece(part, piece.filled[side]) for part, side in zip(found, (~above, above), strict=True) if part is not None
        ]
        return parts if len(parts) > 1 else None

    def _best_plane(self, part: Part, filled: Array, way: Way) -> tuple[Array, float] | None:
        """Return the normal and the offset of the best cut of a part."""
        rough = _selection(part.triangles)
        best, least = None, np.inf
        for normal in _directions(part):
            along = filled @ normal
            for offset in _offsets(part.triangles, normal):
                below, above = clipped(rough, -normal, -offset), clipped(rough, normal, offset)
                if not len(below) or not len(above):
                    continue
                first = int((along <= offset).sum())
                hulls, rooms, saved = [], [], 0.0
                for half, count in ((below, first), (above, len(filled) - first)):
                    hull, skin = self._bulk(half, normal)
                    solid = count * self._cell
                    hulls.append(hull + skin)
                    rooms.append(max(hull - solid, 0.0) + skin)
                    saved += solid if hull <= _NEARLY * solid else 0.0
                uneven = way.even * abs(hulls[0] - hulls[1]) + way.even_room * abs(rooms[0] - rooms[1])
                cost = sum(hulls) + uneven - way.convex * saved
                if cost < least:
                    best, least = (normal, offset), cost
        return best

    def _bulk(self, triangles: Array, normal: Array | None = None) -> tuple[float, float]:
        """Return about the volume of the hull of triangles, and that of a thin skin around it [m^3].

        The hull is that of the corners that are farthest in some directions, those along a normal among them.
        """
        from scipy.spatial import ConvexHull, QhullError

        corners = triangles.reshape(-1, 3)
        farthest = (corners @ _SPREAD.T).argmax(axis=0)
        if normal is not None:
            along = corners @ normal
            farthest = np.append(farthest, [along.argmin(), along.argmax()])
        points = corners[np.unique(farthest)]
        try:
            hull = ConvexHull(points)
        except (QhullError, ValueError):
            extent = np.sort(np.linalg.svd(points - points.mean(axis=0), compute_uv=False))[::-1]
            return 0.0, float(np.prod(np.append(extent, np.zeros(3))[:2]) * self._size * _SKIN)
        return float(hull.volume), float(hull.area * self._size * _SKIN)

    def _joined(self, pieces: list[Piece], wanted: float) -> list[Piece]:
        """Join pieces whose common hull stands out no more than is wanted."""
        tried: dict[tuple[int, int], Piece] = {}
        kept = list(pieces)  # all that ever was, so that no two have one identity
        while len(pieces) > 1:
            for a, b in (pairs := self._pairs(pieces)):
                if (id(a), id(b)) not in tried:
                    tried[id(a), id(b)] = self._both(a, b)
            if not pairs:
                break
            first, second = min(pairs, key=lambda pair: tried[id(pair[0]), id(pair[1])].excess)
            joined = self._judged(tried[id(first), id(second)], wanted)
            tried[id(first), id(second)] = joined
            if not joined.is_sure:
                if min(tried[id(a), id(b)].excess for a, b in pairs) > wanted:
                    break
                continue
            pieces = [piece for piece in pieces if piece is not first and piece is not second] + [joined]
            kept.append(joined)
        return pieces

    def _both(self, a: Piece, b: Piece) -> Piece:
        hull = hull_of(np.concatenate([a.hull.vertices, b.hull.vertices]))
        surface, points = np.concatenate([a.surface, b.surface]), np.concatenate([a.points, b.points])
        return Piece(hull, surface, points, np.concatenate([a.filled, b.filled]), self._excess.about(hull))

    def _pairs(self, pieces: list[Piece]) -> list[tuple[Piece, Piece]]:
        """Return the pairs of neighbours whose common hulls have the least volume more than their own."""
        low = np.array([piece.hull.vertices.min(axis=0) for piece in pieces])
        high = np.array([piece.hull.vertices.max(axis=0) for piece in pieces])
        own = [sum(self._bulk(piece.hull.vertices)) for piece in pieces]
        found: list[tuple[float, int, int]] = []
        for i, k in itertools.combinations(range(len(pieces)), 2):
            if (np.maximum(low[i], low[k]) <= np.minimum(high[i], high[k]) + 1e-6 * self._size).all():
                both = np.concatenate([pieces[i].hull.vertices, pieces[k].hull.vertices])
                found.append((sum(self._bulk(both)) - own[i] - own[k], i, k))
        return [(pieces[i], pieces[k]) for _, i, k in sorted(found)[:_JOINED]]


def _spread_inside(solid: Solid) -> tuple[Array, float]:
    """Return points (m, 3), evenly spread, that are inside a solid [m], and the volume that each stands for [m^3]."""
    corners = solid.triangles.reshape(-1, 3)
    low, extent = corners.min(axis=0), np.ptp(corners, axis=0)
    if solid.inside is None or not extent.all():
        return np.zeros((0, 3)), 0.0
    # Kronecker's sequence, not a grid: no wall lies along it.
    points = low + extent * (np.arange(1, _INSIDE + 1)[:, None] * _KRONECKER % 1.0)
    return points[solid.inside(points)], float(np.prod(extent)) / _INSIDE


def _worst(pieces: list[Piece]) -> float:
    return max(piece.excess for piece in pieces)


def _selection(triangles: Array) -> Array:
    """Return some of many triangles: those at the ends of many directions, and others evenly."""
    if len(triangles) <= _ROUGH:
        return triangles
    ends = np.unique((triangles.reshape(-1, 3) @ _SPREAD.T).argmax(axis=0) // 3)
    return triangles[np.union1d(ends, np.linspace(0, len(triangles) - 1, _ROUGH - _SPHERE).astype(np.intp))]


def _directions(part: Part) -> list[Array]:
    """Return unit normals (3,) of cuts: the axes, the part's principal axes, and the normals of its largest flat faces."""
    corners = part.hull.vertices
    principal = axes_of(corners)[0].T
    normals, area = _normals(part.triangles)
    flat: list[Array] = []
    if len(normals):
        alike, which = np.unique(np.round(normals, 3), axis=0, return_inverse=True)
        total = np.bincount(which.reshape(-1), weights=area)
        flat = [alike[i] / np.linalg.norm(alike[i]) for i in np.argsort(-total, kind="stable")[:_NORMALS]]
    out: list[Array] = []
    for normal in (*np.eye(3), *flat, *principal):
        if all(abs(float(normal @ other)) < 0.999 for other in out):
            out.append(normal)
    return out


def _normals(triangles: Array) -> tuple[Array, Array]:
    """Return the normals (n, 3), each or its opposite, and the areas (n,) of triangles with an area."""
    normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    length = np.linalg.norm(normal, axis=1)
    normal, length = normal[length > 0], length[length > 0]
    normal = normal / length[:, None]
    first = (np.abs(normal) > 1e-6).argmax(axis=1)
    return normal * np.sign(normal[np.arange(len(normal)), first])[:, None], length / 2


def _offsets(triangles: Array, normal: Array) -> list[float]:
    """Return where to cut along a direction: at equal steps, and at the largest flat faces at right angles to it [m]."""
    along = triangles @ normal
    low, high = along.min(axis=1), along.max(axis=1)
    first, last = float(low.min()), float(high.max())
    span = last - first
    steps = (first + span * np.arange(1, _STEPS + 1) / (_STEPS + 1)).tolist()
    flat = (high - low <= 1e-6 * span) & (low > first + _EDGE * span) & (high < last - _EDGE * span)
    if not flat.any():
        return steps
    levels, which = np.unique(np.round((low[flat] - first) / span, 6), return_inverse=True)
    area = np.bincount(which.reshape(-1), weights=_normals_area(triangles[flat]))
    chosen = [first + span * float(levels[i]) for i in np.argsort(-area, kind="stable")[:_FACES]]
    return steps + [level + side * _BESIDE * span for level in chosen for side in (-1, 1)]


def _normals_area(triangles: Array) -> Array:
    return np.linalg.norm(np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]), axis=1)


def _sphere(count: int) -> Array:
    """Return directions (count, 3) all around, evenly (Fibonacci's lattice)."""
    i = np.arange(count) + 0.5
    z, turn = 1 - 2 * i / count, np.pi * (1 + 5**0.5) * i
    across = np.sqrt(1 - z * z)
    return np.stack([across * np.cos(turn), across * np.sin(turn), z], axis=1)


_SPREAD = np.concatenate([np.eye(3), -np.eye(3), _sphere(_SPHERE)])
