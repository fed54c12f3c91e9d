"""What a mesh shuts off from outside, whatever its faces are like: found by flooding a grid from outside."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spacearm.scene.enclose.box_tree import Array, Indices
from spacearm.scene.enclose.inside import TURNS, Inside, View

_CUBES = 800_000  # of the grid, at most about
_ALONG = 200  # cubes along the longest side, at most
_REACH = 10  # half cubes to each side of a point in which it looks for what is known
_CHUNK = 50_000  # points at once
_SURFACE, _OUTSIDE, _SHUT_OFF = 0, 1, 2


class Within:
    """Tells which points are inside a mesh by any convention: inside a closed part, or shut off from outside."""

    def __init__(
        self, parts: Sequence[Inside], vertices: Array, faces: NDArray[np.intp], *, look_behind: bool, crossed: bool = False
    ) -> None:
        """Take what tells the inside of closed parts, and the mesh they are of.

        Args:
            parts: what tells the inside of closed parts.
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

    A cube of the grid that no face may touch is outside if cubes lead out of it, else shut off. A point in another cube
    looks along three lines, up to the next faces: it is as the cubes there are. What cannot be told is taken for shut off,
    as what lies between two faces that nearly touch.

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
