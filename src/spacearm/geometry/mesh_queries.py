"""Where points are against a mesh: how far from its surface, and whether inside.

Distances are Coal's, except for triangles without area, which are segments or points. What is inside follows from the
triangles on a line through each point, for all points at once. Meshes come double-sided, mirrored, with parts that overlap and
with holes. So a point is inside by winding or by parity of any closed part, or where the surface shuts it off from outside.

`trimesh.Trimesh.contains` was measured in its place and is not used:

- It counts by parity alone. Where one part passes through itself (a figure eight of tube), 362 of 19,927 points that are
  inside count as outside; of bodies glued at an edge, 25 of 124. To take solid for free space is the unsafe side.
- With embreex it computes in float32, and embreex is not for every platform. Without it a query takes 10 to 200 times as long
  as here, and all points in a plate of 1 m by 1 um, and some in one of 0.1 mm, count as outside.
- It tries again in directions that it draws without a seed, so a run could not be repeated.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

_FLAT = 1e-9  # of its longest side: a triangle that is no higher is taken for that side
_NEAREST = 8  # pieces of segments that are looked at first
_CUBES = 800_000  # of the grid around a mesh, at most about
_ALONG = 200  # cubes along the longest side, at most
_REACH = 10  # half cubes to each side of a point in which it looks for cubes whose state is known
_CHUNK = 50_000  # points at once, for the memory's sake
_SURFACE, _OUTSIDE, _SHUT_OFF = 0, 1, 2  # states of a cube


class Surface:
    """Triangles, some of which may be segments or points: finds the nearest place."""

    def __init__(self, triangles: Array) -> None:
        """Take triangles (n, 3, 3), at least one [m]."""
        sides = np.roll(triangles, -1, axis=1) - triangles
        length = np.linalg.norm(sides, axis=2)
        longest = length.argmax(axis=1)
        area = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
        flat = area <= _FLAT * length.max(axis=1) ** 2
        start, end = triangles[flat, longest[flat]], triangles[flat, (longest[flat] + 1) % 3]
        self._parts: list[_Triangles | _Segments] = []
        if not flat.all():
            self._parts.append(_Triangles(triangles[~flat]))
        if flat.any():
            self._parts.append(_Segments(*_distinct(start, end)))

    def nearest(self, points: Array) -> tuple[Array, Array]:
        """Return for points (m, 3) the distance (m,) and the nearest point of the surface (m, 3) [m]."""
        distance, at = self._parts[0].nearest(points)
        for part in self._parts[1:]:
            other, there = part.nearest(points)
            nearer = other < distance
            distance[nearer], at[nearer] = other[nearer], there[nearer]
        return distance, at


class _Triangles:
    """Triangles in Coal's tree."""

    def __init__(self, triangles: Array) -> None:
        import coal  # pyright: ignore[reportMissingImports]

        self._coal: Any = coal
        tree = coal.BVHModelOBBRSS()
        tree.beginModel(len(triangles), 3 * len(triangles))
        tree.addVertices(np.ascontiguousarray(triangles.reshape(-1, 3)))
        tree.addTriangles(np.arange(3 * len(triangles), dtype=np.uint32).reshape(-1, 3))
        tree.endModel()
        self._tree = tree

    def nearest(self, points: Array) -> tuple[Array, Array]:
        coal = self._coal
        point, here, there = coal.Sphere(0.0), coal.Transform3s(), coal.Transform3s()
        request, result = coal.DistanceRequest(), coal.DistanceResult()
        at = np.empty((len(points), 3))
        for i, place in enumerate(points):
            there.setTranslation(place)
            result.clear()
            coal.distance(self._tree, here, point, there, request, result)
            at[i] = result.getNearestPoint1()
        return np.linalg.norm(at - points, axis=1), at


class _Segments:
    """Segments and points, in a tree of the middles of their pieces."""

    def __init__(self, start: Array, end: Array) -> None:
        from scipy.spatial import KDTree

        self._start, self._along = start, end - start
        length2 = np.einsum("ij,ij->i", self._along, self._along)
        self._length2 = np.where(length2 > 0, length2, 1.0)
        length = np.sqrt(length2)
        count = np.maximum(np.ceil(length / max(float(length.mean()), 1e-300)), 1.0).astype(np.intp)
        self._segment = np.repeat(np.arange(len(start)), count)
        step = np.arange(len(self._segment)) - np.repeat(np.cumsum(count) - count, count)
        share = (step + 0.5) / count[self._segment]
        self._half = 0.5 * float((length / count).max())  # no point of a piece is farther from its middle
        self._tree = KDTree(start[self._segment] + share[:, None] * self._along[self._segment])

    def nearest(self, points: Array) -> tuple[Array, Array]:
        distance, at = np.full(len(points), np.inf), np.zeros((len(points), 3))
        todo, count = np.arange(len(points)), min(_NEAREST, self._tree.n)
        while todo.size:
            unsure: list[Indices] = []
            for some in np.array_split(todo, 1 + count * len(todo) // 1_000_000):
                to_middle, piece = (found.reshape(-1, count) for found in self._tree.query(points[some], k=count))
                distance[some], at[some] = self._nearest_of(points[some], self._segment[piece])
                unsure.append(some[distance[some] > to_middle[:, -1] - self._half])
            todo = np.concatenate(unsure) if count < self._tree.n else todo[:0]
            count = min(4 * count, self._tree.n)
        return distance, at

    def _nearest_of(self, points: Array, segments: Indices) -> tuple[Array, Array]:
        """Return the distance from each point (m, 3) to the nearest of its segments (m, k), and the place there."""
        start, along = self._start[segments], self._along[segments]
        share = np.clip(np.einsum("mkc,mkc->mk", points[:, None] - start, along) / self._length2[segments], 0.0, 1.0)
        at = start + share[..., None] * along
        distance = np.linalg.norm(at - points[:, None], axis=2)
        best = distance.argmin(axis=1)
        row = np.arange(len(points))
        return distance[row, best], at[row, best]


def _distinct(start: Array, end: Array) -> tuple[Array, Array]:
    both = np.unique(np.concatenate([start, end], axis=1), axis=0)
    return both[:, :3], both[:, 3:]


class Inside:
    """Tells which points are inside a surface of closed parts.

    A point is inside where it is inside any part: where the part winds around it, or where a ray from it meets the part an
    odd number of times. So where parts overlap it is inside, whichever way their faces are turned.
    """

    def __init__(
        self,
        vertices: Array,
        faces: NDArray[np.intp],
        *,
        part: Indices | None = None,
        oriented: NDArray[np.bool_] | bool = False,
    ) -> None:
        """Take vertices (k, 3) [m] and faces (n, 3) of closed parts.

        Args:
            vertices: each place once.
            faces: indices of vertices.
            part: (n,) the number of each face's part; None for one part.
            oriented: of each part, whether neighbouring faces agree on which side is out; else parity alone decides.
        """
        self._vertices, self._faces = vertices, faces
        self._part = np.zeros(len(faces), dtype=np.intp) if part is None else part
        self._parts = int(self._part.max(initial=0)) + 1
        self._oriented = np.broadcast_to(np.asarray(oriented), (self._parts,))
        self._views: list[View] = []  # made when needed; one is enough for most points

    def __call__(self, points: Array) -> NDArray[np.bool_]:
        """Return whether each point (m, 3) is inside; of points on the surface either may be said."""
        out = np.zeros(len(points), dtype=bool)
        unsure = np.arange(len(points))
        for i, turn in enumerate(TURNS):
            if i == len(self._views):
                self._views.append(View(self._vertices @ turn.T, self._faces))
            within, doubtful = self._seen(self._views[i], points[unsure] @ turn.T)
            out[unsure] = within
            unsure = unsure[doubtful]
            if not unsure.size:
                break
        return out

    def _seen(self, view: View, points: Array) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        """Return which points are inside, and for which of them rounding decided because a line met an edge."""
        within, doubtful = np.zeros(len(points), dtype=bool), np.zeros(len(points), dtype=bool)
        for point, face, sign, over in view.hits(points):
            # What a line through a point meets of one part: how often, and how often outwards less inwards.
            number, one = np.unique(point * self._parts + self._part[face], return_inverse=True)
            of, oriented = number // self._parts, self._oriented[number % self._parts]
            above = np.bincount(one, weights=over) % 2 != 0
            above |= oriented & (np.bincount(one, weights=sign * over) != 0)
            # A whole line meets a closed part as often inwards as outwards.
            wrong = np.bincount(one) % 2 != 0
            wrong |= oriented & (np.bincount(one, weights=sign) != 0)
            within[of[above]] = True
            doubtful[of[wrong]] = True
        return within, doubtful


class Winding:
    """Tells which points a surface winds around, all its parts together: cavities turned inward are outside."""

    def __init__(self, vertices: Array, faces: NDArray[np.intp]) -> None:
        """Take vertices (k, 3) [m] and faces (n, 3) of a closed surface whose faces agree on which side is out."""
        self._vertices, self._faces = vertices, faces
        self._views: list[View] = []

    def __call__(self, points: Array) -> NDArray[np.bool_]:
        """Return whether each point (m, 3) is inside; of points on the surface either may be said."""
        out = np.zeros(len(points), dtype=bool)
        unsure = np.arange(len(points))
        for i, turn in enumerate(TURNS):
            if i == len(self._views):
                self._views.append(View(self._vertices @ turn.T, self._faces))
            above, total = np.zeros(len(unsure)), np.zeros(len(unsure))
            for point, _, sign, over in self._views[i].hits(points[unsure] @ turn.T):
                above += np.bincount(point, weights=sign * over, minlength=len(unsure))
                total += np.bincount(point, weights=sign, minlength=len(unsure))
            out[unsure] = above != 0
            unsure = unsure[total != 0]
            if not unsure.size:
                break
        return out


class Within:
    """Tells which points are inside a mesh by any convention: inside a closed part, or shut off from outside."""

    def __init__(
        self, parts: Sequence[Inside], vertices: Array, faces: NDArray[np.intp], *, look_behind: bool, crossed: bool = False
    ) -> None:
        """Take the tests for the inside of closed parts, and the mesh that they belong to.

        Args:
            parts: a test for the inside of each layer of closed parts.
            vertices: (k, 3) [m].
            faces: (n, 3) all of the mesh.
            look_behind: whether there are faces in no closed part, or edges with more than two faces, so that the parts
                may not tell all.
            crossed: whether there are such edges: then thin walls may hide what the grid cannot see.
        """
        self._parts = list(parts)
        self.behind: ShutOff | None = None
        self.notes: tuple[str, ...] = ()
        if look_behind:
            behind = ShutOff(vertices, faces)
            missed = not self._in_parts(behind.samples).all()
            if missed or crossed:
                self.behind = behind
            if missed:
                self.notes = (f"what it shuts off from outside is solid, behind gaps of up to {2 * behind.pitch:.2g} m too",)

    def __bool__(self) -> bool:
        return bool(self._parts) or self.behind is not None

    def __call__(self, points: Array) -> NDArray[np.bool_]:
        """Return whether each point (m, 3) is inside; of points on the surface either may be said."""
        out = self._in_parts(points)
        if self.behind is not None:
            rest = np.flatnonzero(~out)
            out[rest] = self.behind(points[rest])
        return out

    def _in_parts(self, points: Array) -> NDArray[np.bool_]:
        out = np.zeros(len(points), dtype=bool)
        for part in self._parts:
            rest = np.flatnonzero(~out)
            out[rest] = part(points[rest])
        return out


class ShutOff:
    """Tells which points cannot be reached from outside without passing a face or a narrow gap.

    A cube of the grid that no face touches is outside if such cubes connect it to the outside, else shut off. A point in
    another cube looks along three lines up to the next faces, and has the state of the cubes there. Points of unknown
    state, such as those between two faces that nearly touch, are taken for shut off.

    Attributes:
        pitch: edge of a cube [m]; through a gap of about two cubes nothing is reached.
        samples: (m, 3) a point of each space that is shut off [m].
    """

    def __init__(self, vertices: Array, faces: NDArray[np.intp]) -> None:
        """Flood the grid around a mesh of vertices (k, 3) [m] and faces (n, 3)."""
        from scipy.ndimage import label

        low, high = vertices[faces].min(axis=(0, 1)), vertices[faces].max(axis=(0, 1))
        size = np.maximum(high - low, 1e-3 * float((high - low).max()))
        self.pitch = max(float(size.max()) / _ALONG, float(np.prod(size) / _CUBES) ** (1 / 3))
        self._origin = low - 2.5 * self.pitch
        shape = tuple((np.ceil((high - low) / self.pitch) + 5).astype(int).tolist())
        self._state = np.full(shape, _OUTSIDE, dtype=np.int8)
        for places in _touched((vertices[faces] - self._origin) / self.pitch):
            self._state[places] = _SURFACE
        labelled: Any = label(self._state != _SURFACE)
        number, count = labelled
        self._state[(number != number[0, 0, 0]) & (number > 0)] = _SHUT_OFF
        one = np.zeros(count + 1, dtype=np.intp)
        one[number.reshape(-1)] = np.arange(number.size)
        places = np.stack(np.unravel_index(one[1:], shape), axis=1)
        shut_off = self._state.reshape(-1)[one[1:]] == _SHUT_OFF
        self.samples = (places[shut_off] + 0.5) * self.pitch + self._origin
        self._views = [View(vertices @ turn.T, faces) for turn in TURNS]

    def __call__(self, points: Array) -> NDArray[np.bool_]:
        """Return whether each point (m, 3) is shut off."""
        out = self._states(points)
        unsure = np.flatnonzero(out == _SURFACE)
        for i in range(0, len(unsure), _CHUNK):
            part = unsure[i : i + _CHUNK]
            out[part] = self._looked_around(points[part])
        return out != _OUTSIDE

    def _states(self, points: Array) -> NDArray[np.int8]:
        place = np.floor((points - self._origin) / self.pitch).astype(np.intp)
        known = ((place >= 0) & (place < self._state.shape)).all(axis=1)
        out = np.full(len(points), _OUTSIDE, dtype=np.int8)
        out[known] = self._state[tuple(place[known].T)]
        return out

    def _looked_around(self, points: Array) -> NDArray[np.int8]:
        """Return the state of points (m, 3) in cubes with faces, by what is seen along three lines."""
        free, shut = np.zeros(len(points), dtype=bool), np.zeros(len(points), dtype=bool)
        for view, turn in zip(self._views, TURNS, strict=True):
            seen = points @ turn.T
            below, above = view.gaps(seen)
            for step in range(-_REACH, _REACH + 1):
                at = seen + np.array([0.0, 0.0, 0.5 * step * self.pitch])
                state = self._states(at @ turn)
                reached = (at[:, 2] > below) & (at[:, 2] < above)
                free |= reached & (state == _OUTSIDE)
                shut |= reached & (state == _SHUT_OFF)
        return np.where(free & ~shut, _OUTSIDE, _SHUT_OFF).astype(np.int8)


def _touched(triangles: Array) -> Iterator[tuple[Indices, Indices, Indices]]:
    """Yield the places, along x, y and z, of the cubes of edge 1 that triangles (n, 3, 3) may touch."""
    while len(triangles):
        sides = np.roll(triangles, -1, axis=1) - triangles
        length = np.linalg.norm(sides, axis=2)
        small = length.max(axis=1) <= 1
        low = np.floor(triangles[small].min(axis=1)).astype(np.intp)
        high = np.floor(triangles[small].max(axis=1)).astype(np.intp)
        for corner in itertools.product((True, False), repeat=3):
            yield tuple(np.where(corner, high, low).T)  # type: ignore[misc]
        triangles, longest = triangles[~small], length[~small].argmax(axis=1)
        order = (longest[:, None] + np.arange(3)) % 3
        a, b, c = np.moveaxis(np.take_along_axis(triangles, order[:, :, None], axis=1), 1, 0)
        middle = (a + b) / 2
        triangles = np.concatenate([np.stack([a, middle, c], axis=1), np.stack([middle, b, c], axis=1)])


class View:
    """The triangles seen along z, sorted into squares."""

    def __init__(self, vertices: Array, faces: NDArray[np.intp]) -> None:
        corners = vertices[faces]
        following = np.roll(faces, -1, axis=1)
        # Edges go from the lesser index to the greater, so that two faces with a common edge compute the very same number.
        self._swapped = faces > following
        self._from = vertices[np.minimum(faces, following)][:, :, :2]
        self._along = vertices[np.maximum(faces, following)][:, :, :2] - self._from
        self._heights = np.roll(corners[:, :, 2], 1, axis=1)  # of the corner that lies opposite to each edge
        low, high = corners[:, :, :2].min(axis=1), corners[:, :, :2].max(axis=1)
        self._low, self._high = low, high
        self._origin = low.min(axis=0)
        size = np.maximum(high.max(axis=0) - self._origin, 1e-300)
        side = max(1, min(1024, int(1.5 * np.sqrt(len(faces)))))
        while True:
            self._side, self._scale = side, side / size
            first, last = self._square(low), self._square(high)
            wide = last - first + 1
            if side == 1 or wide.prod(axis=1).sum() <= 16 * len(faces) + 1000:
                break
            side //= 2
        count = wide.prod(axis=1)
        face = np.repeat(np.arange(len(faces)), count)
        step = np.arange(len(face)) - np.repeat(np.cumsum(count) - count, count)
        column, row = step % wide[face, 0], step // wide[face, 0]
        square = (first[face, 0] + column) * self._side + first[face, 1] + row
        order = np.argsort(square, kind="stable")
        self._entries = face[order]
        self._start = np.searchsorted(square[order], np.arange(self._side**2 + 1))

    def _square(self, points: Array) -> Indices:
        return np.clip(((points - self._origin) * self._scale).astype(np.intp), 0, self._side - 1)

    def hits(self, points: Array) -> Iterator[tuple[Indices, Indices, Indices, NDArray[np.bool_]]]:
        """Yield, block by block, all pairs of a point and a face on the line through it along z.

        Each block has: the points, the faces, the way in which each face is met (1 or -1), and whether it is above the point.
        All pairs of one point are in one block.
        """
        for point, face, sign, height in self._crossed(points):
            yield point, face, sign, height > points[point, 2]

    def gaps(self, points: Array) -> tuple[Array, Array]:
        """Return the heights of the next faces below and above each point, infinite where there is none, (m,) each."""
        below, above = np.full(len(points), -np.inf), np.full(len(points), np.inf)
        for point, _, _, height in self._crossed(points):
            over = height > points[point, 2]
            np.minimum.at(above, point[over], height[over])
            np.maximum.at(below, point[~over], height[~over])
        return below, above

    def _crossed(self, points: Array) -> Iterator[tuple[Indices, Indices, Indices, Array]]:
        where = self._square(points[:, :2])
        square = where[:, 0] * self._side + where[:, 1]
        order = np.argsort(square, kind="stable")  # neighbours one after the other: their triangles are at hand
        counts = (self._start[square + 1] - self._start[square])[order]
        for block in _blocks(counts, 1_000_000):
            count = counts[block]
            point = np.repeat(order[block], count)
            step = np.arange(len(point)) - np.repeat(np.cumsum(count) - count, count)
            face = self._entries[self._start[square[point]] + step]
            at = points[point, :2]
            over = ((at >= self._low[face]) & (at <= self._high[face])).all(axis=1)
            point, face = point[over], face[over]
            hit, sign, height = self._hits(points[point, :2], face)
            yield point[hit], face[hit], sign, height

    def _hits(self, points: Array, face: Indices) -> tuple[NDArray[np.bool_], Indices, Array]:
        """Return which pairs of a point and a face meet, seen along z; for those the face's turn and height."""
        away, along, swapped = points[:, None] - self._from[face], self._along[face], self._swapped[face]
        area = along[:, :, 0] * away[:, :, 1] - along[:, :, 1] * away[:, :, 0]
        left = (area > 0) != swapped
        hit = (left[:, 0] == left[:, 1]) & (left[:, 1] == left[:, 2])
        weight = np.where(swapped[hit], -area[hit], area[hit])
        z, total = self._heights[face[hit]], weight.sum(axis=1)
        flat = total == 0
        height = np.where(flat, z.max(axis=1), (weight * z).sum(axis=1) / np.where(flat, 1.0, total))
        return hit, np.where(left[hit, 0], 1, -1), height


def _blocks(counts: Indices, most: int) -> list[slice]:
    """Cut a list into slices whose counts add up to no more than `most`, or that have one entry."""
    ends = np.searchsorted(np.cumsum(counts), np.arange(most, counts.sum() + most, most), side="right")
    cuts = np.unique(np.concatenate([[0], ends, [len(counts)]]))
    return [slice(int(a), int(b)) for a, b in itertools.pairwise(cuts)]


def _turned(*angles: float) -> Array:
    out = np.eye(3)
    for i, angle in enumerate(angles):
        turn = np.eye(3)
        j, k = (i + 1) % 3, (i + 2) % 3
        turn[j, j] = turn[k, k] = np.cos(angle)
        turn[j, k], turn[k, j] = -np.sin(angle), np.sin(angle)
        out = turn @ out
    return out


TURNS = (_turned(0.6180, 1.2345, 0.4142), _turned(2.2361, 0.5772, 1.7321), _turned(1.0987, 2.7183, 0.3679))
"""Rotations to views; their axes are those of no usual mesh, so that few lines meet an edge."""
