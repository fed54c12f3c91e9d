"""Capsules around convex shapes, for those who ask for them: a robot of capsules is checked faster than one of boxes.

A shape is cut into columns along one of its axes, a grid of them across, and each column gets a capsule along it. Of the grids
within the number of capsules the one is taken whose capsules stand out least. The capsules hold all of the shape.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spacearm.geometry.convex_cores import core_of, moved_shape, support
from spacearm.geometry.shapes import Box, Capsule, ConvexShape, Sphere

Array = NDArray[np.float64]

_ROUNDING = 1e-12  # share of the radius, so that the corners are inside
_SIDES = 32  # of the prism around a cylinder that is cut into columns
_DIRECTIONS = 600  # along which it is measured how far a capsule stands out
_GROWTH = np.array([0.0, 0.03, 0.1, 0.2, 0.3, 0.45])  # by how much of itself a radius may grow: the capsule is shorter then
_FEW = 8  # capsules up to which every grid is tried
_MOST_ACROSS = 10  # columns in one direction, in grids of more


def enclosing_capsules(parts: Sequence[ConvexShape], count: int) -> tuple[list[ConvexShape], float]:
    """Enclose convex shapes, which together are one, in capsules.

    Args:
        parts: one shape, or the pieces of one.
        count: how many capsules at most; where the pieces are more, one each.

    Returns:
        Capsules and spheres, and how far they stand out of the shapes, at most [m].
    """
    found, excess = [], 0.0
    for part in parts:
        capsules, out = _around(part, max(1, count // len(parts)))
        found += capsules
        excess = max(excess, out)
    return found, excess


def _around(shape: ConvexShape, count: int) -> tuple[list[ConvexShape], float]:
    if isinstance(shape, (Sphere, Capsule)):
        return [shape], 0.0
    measure = _Excess(shape)
    if isinstance(shape, Box) and shape.rounding == 0:
        capsules = [moved_shape(one, shape.pose) for one in box_capsules(tuple(shape.size.tolist()), count)]
    else:
        capsules = min(_tried(shape, measure, count), key=lambda one: (max(map(measure, one)), len(one)))
    return list(capsules), max(map(measure, capsules))


class _Excess:
    """How far capsules stand out of a convex shape: the greatest difference of their support functions [m].

    That of the shape has kinks along the normals of its faces, and between those of neighbouring ones, so these are looked at.
    """

    def __init__(self, shape: ConvexShape) -> None:
        points, _, axes = _corners(shape)
        n = np.concatenate([_sphere(), axes.T, -axes.T, _normals(points)])
        self._n, self._own = n, support(shape, n)

    def __call__(self, capsule: Capsule | Sphere) -> float:
        if isinstance(capsule, Sphere):
            reach = self._n @ capsule.center
        else:
            reach = np.maximum(self._n @ capsule.a, self._n @ capsule.b)
        return max(0.0, float((reach - self._own).max()) + capsule.radius)


def _sphere() -> Array:
    k = np.arange(_DIRECTIONS)
    z = 1 - (2 * k + 1) / _DIRECTIONS
    turn, ring = k * math.pi * (3 - math.sqrt(5)), np.sqrt(1 - z * z)
    return np.column_stack([ring * np.cos(turn), ring * np.sin(turn), z])


def _normals(points: Array) -> Array:
    """Return the normals of the hull of points (k, 3), and directions between those of neighbouring faces, of length 1."""
    from scipy.spatial import ConvexHull, QhullError

    try:
        hull = ConvexHull(points)
    except QhullError:  # flat: what is about right will do
        return np.zeros((0, 3))
    own = hull.equations[:, :3]
    ends = np.stack([np.repeat(own[:, None], 3, axis=1), own[hull.neighbors]], axis=-1).reshape(-1, 3, 2)
    between = np.concatenate([ends @ np.array([1 - t, t]) for t in (0.25, 0.5)])
    n = np.concatenate([own, between])
    return n / np.linalg.norm(n, axis=1, keepdims=True)


def _tried(shape: ConvexShape, measure: _Excess, count: int) -> Iterator[list[Capsule | Sphere]]:
    """Yield capsules around a shape, one set for each grid of columns."""
    points, radius, axes = _corners(shape)
    own = points @ axes
    for along, across in itertools.product(range(3), _grids(count)):
        columns = [own]
        for axis, number in zip([i for i in range(3) if i != along], across, strict=True):
            columns = [cell for column in columns for cell in _slices(column, axis, number)]
        yield [_capsule_along(measure, cell, along, radius, axes) for cell in columns]


def _grids(count: int) -> list[tuple[int, int]]:
    if count <= _FEW:
        return [(i, k) for i in range(1, count + 1) for k in range(1, count // i + 1)]
    few = range(1, _MOST_ACROSS + 1)
    return [(1, 1), *dict.fromkeys([*((i, count // i) for i in few), *((count // i, i) for i in few)])]


def _corners(shape: ConvexShape) -> tuple[Array, float, Array]:
    """Return points (k, 3) and a radius so that the shape is within it of their hull, and the axes (3, 3) to cut along."""
    core = core_of(shape)
    if core.kind == "polytope":
        spread = core.vertices - core.vertices.mean(axis=0)
        return core.vertices + core.T[:3, 3], core.radius, np.linalg.eigh(spread.T @ spread)[1]
    angle = 2 * math.pi * np.arange(_SIDES) / _SIDES
    ring = core.half[0] / math.cos(math.pi / _SIDES) * np.column_stack([np.cos(angle), np.sin(angle), np.zeros(_SIDES)])
    if core.kind == "box":
        ring = core.half * np.array([(x, y, 0) for x in (-1, 1) for y in (-1, 1)])
    end = np.array([0.0, 0.0, core.half[2]])
    R = core.T[:3, :3]
    return np.concatenate([ring - end, ring + end]) @ R.T + core.T[:3, 3], core.radius, R


def _slices(points: Array, axis: int, number: int) -> list[Array]:
    """Cut the hull of points (k, 3) across an axis into slices of equal thickness; corners (m, 3) of each."""
    low, high = float(points[:, axis].min()), float(points[:, axis].max())
    if number == 1 or not high > low:
        return [points]
    out, rest = [], points
    for at in np.linspace(low, high, number + 1)[1:-1].tolist():
        above = rest[:, axis] > at
        if above.all() or not above.any():
            continue
        a, b = rest[~above][:, None], rest[above][None]
        share = (at - a[..., axis]) / (b[..., axis] - a[..., axis])
        crossing = _hull((a + share[..., None] * (b - a)).reshape(-1, 3))
        out.append(np.concatenate([rest[~above], crossing]))
        rest = np.concatenate([rest[above], crossing])
    return [*out, rest]


def _hull(points: Array) -> Array:
    """Return the corners of the hull of points on a plane across an axis; all points where they are too few."""
    from scipy.spatial import ConvexHull, QhullError

    flat = np.ptp(points, axis=0)
    try:
        return points[ConvexHull(np.delete(points, int(np.argmin(flat)), axis=1)).vertices]
    except QhullError:
        return points


def _capsule_along(measure: _Excess, points: Array, along: int, rounding: float, axes: Array) -> Capsule | Sphere:
    """Enclose points (k, 3) in a capsule along an axis, of the radius with which it stands out least."""
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    off = points - middle
    distance = np.linalg.norm(np.delete(off, along, axis=1), axis=1)
    tried: list[Capsule | Sphere] = []
    for radius in (float(distance.max()) * (1 + _GROWTH) * (1 + _ROUNDING)).tolist():
        slack = np.sqrt(np.maximum(radius * radius - distance * distance, 0.0))
        first, last = float((off[:, along] + slack).min()), float((off[:, along] - slack).max())
        ends = np.stack([middle, middle])
        ends[:, along] += (first, last) if first < last else ((first + last) / 2,) * 2
        a, b = ends @ axes.T
        reach = max(radius, 1e-12) * (1 + _ROUNDING) + rounding
        tried.append(Capsule(a, b, reach) if first < last else Sphere(a, reach))
    return min(tried, key=measure)


@dataclass(frozen=True, slots=True)
class _Grid:
    """Columns along the edge `along`, a given number of them across in each of the other directions."""

    along: int
    numbers: tuple[int, int, int]
    inset: float
    radius: float

    @property
    def excess(self) -> float:
        return self.radius - self.inset


def box_capsules(size: tuple[float, float, float], count: int) -> list[Capsule]:
    """Enclose a box about the origin in at most `count` parallel capsules, which stand out as little as that allows.

    The box is cut into columns along one of its edges, a grid of them across, and each column gets a capsule. Where the box is
    w across a column, by v, and the capsule's ends lie d inside the box, the radius is that of the column's corners,
    r^2 = (w/2)^2 + (v/2)^2 + d^2. The capsule stands out by r - min(w/2, v/2, d) at most, along a face's normal: to any other
    side there is more box around it. The least of that over d is at d = min(w, v)/2.

    Of the grids that stand out equally little, the one with the fewest capsules is taken.

    Args:
        size: the three edges [m].
        count: 1 or more.

    Returns:
        The capsules, parallel to one edge of the box, in the box's frame.
    """
    grid = min((_grid(size, numbers) for numbers in _numbers(count)), key=lambda g: (g.excess, math.prod(g.numbers)))
    widths = np.array(size) / grid.numbers
    half = np.zeros(3)
    half[grid.along] = size[grid.along] / 2 - grid.inset
    capsules = []
    for place in itertools.product(*(range(number) for number in grid.numbers)):
        center = (np.array(place) + 0.5) * widths - np.array(size) / 2
        capsules.append(Capsule(center - half, center + half, grid.radius * (1 + _ROUNDING)))
    return capsules


def _numbers(count: int) -> list[tuple[int, int, int]]:
    """List how many columns lie in each direction; along one of them, one."""
    pairs = [(i, k) for i in range(1, count + 1) for k in range(1, count // i + 1)]
    return [tuple(np.insert(pair, along, 1).tolist()) for along in range(3) for pair in pairs]  # type: ignore[misc]


def _grid(size: tuple[float, float, float], numbers: tuple[int, int, int]) -> _Grid:
    along = numbers.index(1) if numbers.count(1) == 1 else int(np.argmax(np.where(np.array(numbers) == 1, size, -1.0)))
    halves = [size[i] / numbers[i] / 2 for i in range(3) if i != along]
    inset = min(*halves, size[along] / 2)
    return _Grid(along, numbers, inset, math.hypot(*halves, inset))
