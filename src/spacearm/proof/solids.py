"""Solids as arrays: for many points at once, the nearest point of a solid, and how far a solid extends in a direction.

Each kind is a *core* and a radius around it: a ball's core is a point, a capsule's a segment, a box is all core. Points and
directions are given in the solid's own frame. How far the core extends (its support function) is what a proof rests on; the
nearest point only proposes the direction.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from spacearm.core.identity_cache import kept
from spacearm.geometry import Box, Capsule, Cylinder, HalfSpace, Scene, Sphere, SphereSet
from spacearm.proof.moving_bodies import Bodies

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

_CELL = 16  # balls in a cell
_FEW = 64  # balls that need no cells
_OUTWARD = 1 + 1e-12  # a cell is made larger by more than its rounding


class Solids(Protocol):
    """k solids of one kind."""

    @property
    def radius(self) -> Array:
        """How far each reaches around its core, (k,) [m]."""
        ...

    @property
    def obstacle(self) -> Indices:
        """Index in the scene of the obstacle that each is, or is part of, (k,)."""
        ...

    def placed(self, k: Indices) -> tuple[Array | None, Array]:
        """Return the axes (t, 3, 3) of solids k (t,), None for the world's, and the origins (t, 3)."""
        ...

    def nearest(self, k: Indices, x: Array) -> Array:
        """Return the points (t, 3) of the cores nearest to x (t, 3)."""
        ...

    def support(self, k: Indices, n: Array) -> Array:
        """Return how far the cores extend in the directions n (t, 3): the greatest n . y, (t,) [m]."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Balls:
    """Spheres, and the balls of sphere sets; or, with `count`, cells of balls that come one after the other.

    Attributes:
        center: (k, 3) [m].
        radius, obstacle: as in `Solids`.
        first, count: (k,) which balls are in a cell.
    """

    center: Array
    radius: Array
    obstacle: Indices
    first: Indices
    count: Indices

    def placed(self, k: Indices) -> tuple[Array | None, Array]:
        """Return no axes, and the centres."""
        return None, self.center[k]

    def nearest(self, k: Indices, x: Array) -> Array:
        """Return the centres: the origin."""
        return np.zeros_like(x)

    def support(self, k: Indices, n: Array) -> Array:
        """Return 0: the core is a point."""
        return np.zeros(len(n))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Boxes:
    """Boxes; with a radius, round ones: a capsule is a box without width.

    Attributes:
        axes, origin: (k, 3, 3) and (k, 3) [m].
        half: (k, 3) half edges [m].
        radius, obstacle: as in `Solids`.
    """

    axes: Array
    origin: Array
    half: Array
    radius: Array
    obstacle: Indices

    def placed(self, k: Indices) -> tuple[Array | None, Array]:
        """Return the axes and the middles."""
        return self.axes[k], self.origin[k]

    def nearest(self, k: Indices, x: Array) -> Array:
        """Clip every coordinate."""
        half = self.half[k]
        return np.minimum(np.maximum(x, -half), half)

    def support(self, k: Indices, n: Array) -> Array:
        """Return |n| . half."""
        return np.einsum("tc,tc->t", np.abs(n), self.half[k])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Cylinders:
    """Round cylinders along z.

    Attributes:
        axes, origin: (k, 3, 3) and (k, 3) [m].
        round, half: (k,) radius and half length of the core [m].
        radius, obstacle: as in `Solids`; the radius around the core is 0.
    """

    axes: Array
    origin: Array
    round: Array
    half: Array
    radius: Array
    obstacle: Indices

    def placed(self, k: Indices) -> tuple[Array | None, Array]:
        """Return the axes and the middles."""
        return self.axes[k], self.origin[k]

    def nearest(self, k: Indices, x: Array) -> Array:
        """Clip the distance from the axis, and the height."""
        out, most, half = np.empty_like(x), self.round[k], self.half[k]
        share = most / np.maximum(np.hypot(x[:, 0], x[:, 1]), most)
        out[:, :2] = x[:, :2] * share[:, None]
        out[:, 2] = np.minimum(np.maximum(x[:, 2], -half), half)
        return out

    def support(self, k: Indices, n: Array) -> Array:
        """Return that of the rim that lies furthest."""
        return np.hypot(n[:, 0], n[:, 1]) * self.round[k] + np.abs(n[:, 2]) * self.half[k]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class HalfSpaces:
    """Half-spaces, in frames whose z is the normal.

    Attributes:
        axes, origin: (k, 3, 3) and (k, 3) [m].
        radius, obstacle: as in `Solids`.
    """

    axes: Array
    origin: Array
    radius: Array
    obstacle: Indices

    def placed(self, k: Indices) -> tuple[Array | None, Array]:
        """Return the axes, z along the normal, and the points on the planes."""
        return self.axes[k], self.origin[k]

    def nearest(self, k: Indices, x: Array) -> Array:
        """Fall onto the plane."""
        out = x.copy()
        out[:, 2] = np.minimum(x[:, 2], 0.0)
        return out

    def support(self, k: Indices, n: Array) -> Array:
        """Return 0 along the normal; in all other directions a half-space extends without end."""
        return np.where((n[:, 0] == 0) & (n[:, 1] == 0) & (n[:, 2] >= 0), 0.0, np.inf)


@kept
def solids_of(scene: Scene) -> tuple[Solids, ...]:
    """Return the scene's obstacles by kind."""
    rows: dict[type, list[tuple[Any, ...]]] = {Balls: [], Boxes: [], Cylinders: [], HalfSpaces: []}
    for i, item in enumerate(scene.obstacles):
        if isinstance(item, Sphere):
            rows[Balls].append((item.center[None], [item.radius], [i]))
        elif isinstance(item, SphereSet):
            rows[Balls].append((item.centers, item.radii, np.full(len(item.radii), i)))
        elif isinstance(item, Box):
            rows[Boxes].append((item.pose[:3, :3], item.pose[:3, 3], item.size / 2, 0.0, i))
        elif isinstance(item, Capsule):
            half = float(np.linalg.norm(item.b - item.a)) / 2
            rows[Boxes].append((axes_along(item.b - item.a), (item.a + item.b) / 2, (0.0, 0.0, half), item.radius, i))
        elif isinstance(item, Cylinder):
            rows[Cylinders].append((item.pose[:3, :3], item.pose[:3, 3], item.radius, item.length / 2, 0.0, i))
        elif isinstance(item, HalfSpace):
            rows[HalfSpaces].append((axes_along(item.normal), item.point, 0.0, i))
    out: list[Solids] = []
    if rows[Balls]:
        out.append(_balls(*(np.concatenate(column) for column in zip(*rows[Balls], strict=True))))
    for kind in (Boxes, Cylinders, HalfSpaces):
        if rows[kind]:
            columns = [np.array(column) for column in zip(*rows[kind], strict=True)]
            out.append(kind(**dict(zip(kind.__slots__, columns, strict=True))))
    return tuple(out)


@kept
def cells_of(balls: Balls) -> Balls | None:
    """Return balls around up to 16 neighbours each; None if there are too few to be worth it."""
    if len(balls.radius) <= _FEW:
        return None
    starts = np.arange(0, len(balls.radius), _CELL)
    counts = np.diff(np.append(starts, len(balls.radius)))
    cell = np.repeat(np.arange(len(starts)), counts)
    grown = balls.radius[:, None]
    low = np.minimum.reduceat(balls.center - grown, starts)
    high = np.maximum.reduceat(balls.center + grown, starts)
    center = (low + high) / 2
    reach = np.linalg.norm(balls.center - center[cell], axis=1) + balls.radius
    return Balls(
        center=center,
        radius=np.maximum.reduceat(reach, starts) * _OUTWARD,
        obstacle=balls.obstacle[starts],
        first=starts.astype(np.intp),
        count=counts.astype(np.intp),
    )


def lengths(solids: Solids) -> list[Array]:
    """Return all numbers of solids that are lengths [m]."""
    names = ("center", "origin", "half", "round", "radius")
    return [getattr(solids, name) for name in names if hasattr(solids, name)]


def axes_along(z: Array) -> Array:
    """Return a rotation (3, 3) whose z is along a vector; of length 0, the world's."""
    length = float(np.linalg.norm(z))
    if length == 0:
        return np.eye(3)
    z = z / length
    x = np.cross(z, np.eye(3)[int(np.argmin(np.abs(z)))])
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z]).astype(np.float64)


@kept
def body_axes(bodies: Bodies) -> Array:
    """Return rotations (b, 3, 3) whose z is along the bodies' axes, in the frames of their joints."""
    return np.array([axes_along(ends[-1] - ends[0]) for ends in bodies.ends]).reshape(-1, 3, 3)


def _balls(center: Array, radius: Array, obstacle: Indices) -> Balls:
    """Sort balls so that neighbours follow each other."""
    order = np.arange(len(radius))
    if len(radius) > _FEW:
        order = _neighbours(center, order)
    none = np.zeros(len(radius), np.intp)
    return Balls(center=center[order], radius=radius[order], obstacle=obstacle[order].astype(np.intp), first=none, count=none)


def _neighbours(center: Array, order: Indices) -> Indices:
    """Halve along the longest side until the parts are cells."""
    if len(order) <= _CELL:
        return order
    points = center[order]
    axis = int(np.argmax(np.ptp(points, axis=0)))
    cells = -(-len(order) // _CELL)
    half = cells // 2 * _CELL
    order = order[np.argpartition(points[:, axis], half)]
    return np.concatenate([_neighbours(center, order[:half]), _neighbours(center, order[half:])])
