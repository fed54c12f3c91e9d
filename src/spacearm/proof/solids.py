"""Solids: what a moving body is kept apart from, as arrays of one shape.

A *solid* is an obstacle, a part of one, or one of the robot's own bodies at an instant. It has a core and a radius around the
core: the core of a ball is a point, that of a capsule is a segment; a box, a cylinder and a polytope are all core, and their
rounding is the radius. Points and directions are given in the solid's own axes. A proof uses the support function (how far the
core extends in a direction). The nearest point only proposes a direction.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from spacearm.core.identity_cache import cached_by_identity
from spacearm.geometry import Box, Capsule, Core, Cylinder, HalfSpace, Polytope, PolytopeSet, Scene, Sphere, SphereSet
from spacearm.geometry.convex_cores import axes_along
from spacearm.geometry.scene import Obstacle

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

_OUTWARD = 1 + 1e-12  # times the radius of an enclosing ball, which covers its rounding
_CELL = 16  # balls in a cell
_FEW = 64  # up to this number of balls no cells are made
_STEPS = 6  # towards the nearest point of a polytope: of drawn ones with 16 vertices it is reached, with 64 within 1 mm
_TINY = 1e-280  # [m^2] in place of a squared length of 0 in a quotient


class Solids(Protocol):
    """k solids of one shape."""

    @property
    def radius(self) -> Array:
        """The radius around each core, (k,) [m]."""
        ...

    @property
    def obstacle(self) -> Indices:
        """The index in the scene of the obstacle that each solid is, or is a part of, (k,)."""
        ...

    def placed(self, k: Indices) -> tuple[Array | None, Array]:
        """Return the axes (t, 3, 3) of solids k (t,), None for those of the world, and the origins (t, 3) [m]."""
        ...

    def nearest(self, k: Indices, x: Array) -> Array:
        """Return the points (t, 3) of the cores nearest to x (t, 3); of a polytope a point of it that is about the nearest."""
        ...

    def support(self, k: Indices, n: Array) -> Array:
        """Return the support functions of the cores in the directions n (t, 3): the greatest n . y, (t,) [m]."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Balls:
    """Spheres, and the balls of sphere sets; or cells, each around consecutive solids.

    Attributes:
        center: (k, 3) [m].
        radius, obstacle: as in `Solids`.
        first, count: (k,) the solids in a cell are first to first + count - 1; 0 for a ball.
    """

    center: Array
    radius: Array
    obstacle: Indices
    first: Indices
    count: Indices

    def placed(self, k: Indices) -> tuple[Array | None, Array]:
        """Return None, and the centres."""
        return None, self.center[k]

    def nearest(self, k: Indices, x: Array) -> Array:
        """Return the centres, which are the origins."""
        return np.zeros_like(x)

    def support(self, k: Indices, n: Array) -> Array:
        """Return 0: the core is a point."""
        return np.zeros(len(n))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Boxes:
    """Boxes; and capsules, as boxes without width and with a radius.

    Attributes:
        axes, origin: (k, 3, 3) and (k, 3) [m].
        half: (k, 3) half the edges [m].
        radius, obstacle: as in `Solids`.
    """

    axes: Array
    origin: Array
    half: Array
    radius: Array
    obstacle: Indices

    def placed(self, k: Indices) -> tuple[Array | None, Array]:
        """Return the axes and the centres."""
        return self.axes[k], self.origin[k]

    def nearest(self, k: Indices, x: Array) -> Array:
        """Return the points clipped to the boxes."""
        half = self.half[k]
        return np.minimum(np.maximum(x, -half), half)

    def support(self, k: Indices, n: Array) -> Array:
        """Return |n| . half."""
        return np.einsum("tc,tc->t", np.abs(n), self.half[k])

    def lowest(self, k: Indices, n: Array) -> Array:
        """Return the least n . y, (t, 1) [m]."""
        return -self.support(k, n)[:, None]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Cylinders:
    """Cylinders along z.

    Attributes:
        axes, origin: (k, 3, 3) and (k, 3) [m].
        round, half: (k,) radius and half length of the core [m].
        radius, obstacle: as in `Solids`.
    """

    axes: Array
    origin: Array
    round: Array
    half: Array
    radius: Array
    obstacle: Indices

    def placed(self, k: Indices) -> tuple[Array | None, Array]:
        """Return the axes and the centres."""
        return self.axes[k], self.origin[k]

    def nearest(self, k: Indices, x: Array) -> Array:
        """Return the points, clipped in their distance from the axis and in their height."""
        out, most, half = np.empty_like(x), self.round[k], self.half[k]
        share = most / np.maximum(np.hypot(x[:, 0], x[:, 1]), most)
        out[:, :2] = x[:, :2] * share[:, None]
        out[:, 2] = np.minimum(np.maximum(x[:, 2], -half), half)
        return out

    def support(self, k: Indices, n: Array) -> Array:
        """Return n . y of the point of the rim that is furthest along n."""
        return np.hypot(n[:, 0], n[:, 1]) * self.round[k] + np.abs(n[:, 2]) * self.half[k]

    def lowest(self, k: Indices, n: Array) -> Array:
        """Return the least n . y of both discs, (t, 2) [m], first of that at -z."""
        up = n[:, 2] * self.half[k]
        return np.stack([-up, up], axis=1) - (np.hypot(n[:, 0], n[:, 1]) * self.round[k])[:, None]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Polytopes:
    """Convex polytopes, and the pieces of polytope sets; many of them may have the same vertices.

    Attributes:
        axes, origin: (k, 3, 3) and (k, 3) [m].
        core: (k,) which of the vertices below are a solid's.
        vertices: (c, v, 3) in the solid's own axes [m]; of a polytope with fewer than v the first is repeated.
        radius, obstacle: as in `Solids`.
    """

    axes: Array
    origin: Array
    core: Indices
    vertices: Array
    radius: Array
    obstacle: Indices

    def placed(self, k: Indices) -> tuple[Array | None, Array]:
        """Return the axes and the origins."""
        return self.axes[k], self.origin[k]

    def nearest(self, k: Indices, x: Array) -> Array:
        """Return weighted means of the vertices that are about the nearest.

        Every step moves weight from the vertex that is highest along the way to x, of those with a weight, to the lowest one
        (Mitchell, Demyanov and Malozemov, 1974).
        """
        vertices, row = self.vertices[self.core[k]], np.arange(len(x))
        away = vertices - x[:, None]
        first = np.argmin(np.einsum("tvc,tvc->tv", away, away), axis=1)
        weight = np.zeros(vertices.shape[:2])
        weight[row, first] = 1.0
        point = vertices[row, first]
        for _ in range(_STEPS):
            height = np.einsum("tvc,tc->tv", vertices, point - x)
            low, high = np.argmin(height, axis=1), np.argmax(np.where(weight > 0, height, -np.inf), axis=1)
            edge = vertices[row, high] - vertices[row, low]
            squared = np.maximum(np.einsum("tc,tc->t", edge, edge), _TINY)
            moved = np.minimum((height[row, high] - height[row, low]) / squared, weight[row, high])
            if not moved.any():
                break
            weight[row, high] -= moved
            weight[row, low] += moved
            point = point - moved[:, None] * edge
        return point

    def support(self, k: Indices, n: Array) -> Array:
        """Return n . y of the vertex that is furthest along n."""
        return np.einsum("tvc,tc->tv", self.vertices[self.core[k]], n).max(axis=1)

    def lowest(self, k: Indices, n: Array) -> Array:
        """Return the least n . y, (t, 1) [m]."""
        return -self.support(k, -n)[:, None]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class HalfSpaces:
    """Half-spaces below z = 0 of their own axes.

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
        """Return the points projected onto the planes from above."""
        out = x.copy()
        out[:, 2] = np.minimum(x[:, 2], 0.0)
        return out

    def support(self, k: Indices, n: Array) -> Array:
        """Return 0 along the normal; a half-space is infinite in all other directions."""
        return np.where((n[:, 0] == 0) & (n[:, 1] == 0) & (n[:, 2] >= 0), 0.0, np.inf)


# ---- The robot's bodies as solids --------------------------------------------------------------------------------------


def solids_of_cores(cores: Sequence[Core], radius: Array, axes: Array, origin: Array) -> Boxes | Cylinders | Polytopes:
    """Return c cores of one kind at r instants as solids: core k at instant i is number i c + k.

    Args:
        cores: boxes, or cylinders, or polytopes.
        radius: (c,) around them [m].
        axes, origin: (r, c, 3, 3) and (r, c, 3) where they are [m].
    """
    count, kind = len(axes), cores[0].kind
    axes, origin, radius = axes.reshape(-1, 3, 3), origin.reshape(-1, 3), np.tile(radius, count)
    obstacle = np.zeros(len(radius), np.intp)
    half = np.tile([core.half for core in cores], (count, 1))
    if kind == "box":
        return Boxes(axes=axes, origin=origin, half=half, radius=radius, obstacle=obstacle)
    if kind == "cylinder":
        return Cylinders(axes=axes, origin=origin, round=half[:, 0], half=half[:, 2], radius=radius, obstacle=obstacle)
    vertices, core = padded([core.vertices for core in cores]), np.tile(np.arange(len(cores)), count)
    return Polytopes(axes=axes, origin=origin, core=core, vertices=vertices, radius=radius, obstacle=obstacle)


def padded(points: list[Array], width: int = 0) -> Array:
    """Return lists of points (., 3) as one array (c, v, 3), v at least `width`: the first point fills a shorter list."""
    most = max(width, *(len(some) for some in points))
    return np.array([np.concatenate([some, np.repeat(some[:1], most - len(some), axis=0)]) for some in points])


# ---- Obstacles as solids -----------------------------------------------------------------------------------------------


@cached_by_identity
def solids_of(scene: Scene) -> tuple[Solids, ...]:
    """Return the scene's obstacles, by shape."""
    makers = (_scene_balls, _scene_boxes, _scene_cylinders, _scene_half_spaces, _scene_polytopes)
    made = (maker(list(enumerate(scene.obstacles))) for maker in makers)
    return tuple(solids for solids in made if solids is not None)


Numbered = list[tuple[int, Obstacle]]


def _scene_balls(obstacles: Numbered) -> Balls | None:
    rows: list[tuple[Array, Array, Indices]] = []
    for i, item in obstacles:
        if isinstance(item, Sphere):
            rows.append((item.center[None], np.array([item.radius]), np.array([i])))
        elif isinstance(item, SphereSet):
            rows.append((item.centers, item.radii, np.full(len(item.radii), i)))
    if not rows:
        return None
    center, radius, obstacle = (np.concatenate(column) for column in zip(*rows, strict=True))
    return _sorted_balls(center, radius, obstacle)


def _scene_boxes(obstacles: Numbered) -> Boxes | None:
    rows: list[tuple[Array, Array, Array, float, int]] = []
    for i, item in obstacles:
        if isinstance(item, Box):
            rows.append((item.pose[:3, :3], item.pose[:3, 3], item.size / 2, item.rounding, i))
        elif isinstance(item, Capsule):
            half = np.array([0.0, 0.0, float(np.linalg.norm(item.b - item.a)) / 2])
            rows.append((axes_along(item.b - item.a), (item.a + item.b) / 2, half, item.radius, i))
    if not rows:
        return None
    axes, origin, half, radius, obstacle = (np.array(column) for column in zip(*rows, strict=True))
    return Boxes(axes=axes, origin=origin, half=half, radius=radius, obstacle=obstacle)


def _scene_cylinders(obstacles: Numbered) -> Cylinders | None:
    some = [(i, item) for i, item in obstacles if isinstance(item, Cylinder)]
    if not some:
        return None
    return Cylinders(
        axes=np.array([item.pose[:3, :3] for _, item in some]),
        origin=np.array([item.pose[:3, 3] for _, item in some]),
        round=np.array([item.radius for _, item in some]),
        half=np.array([item.length / 2 for _, item in some]),
        radius=np.array([item.rounding for _, item in some]),
        obstacle=np.array([i for i, _ in some]),
    )


def _scene_half_spaces(obstacles: Numbered) -> HalfSpaces | None:
    some = [(i, item) for i, item in obstacles if isinstance(item, HalfSpace)]
    if not some:
        return None
    return HalfSpaces(
        axes=np.array([axes_along(item.normal) for _, item in some]),
        origin=np.array([item.point for _, item in some]),
        radius=np.zeros(len(some)),
        obstacle=np.array([i for i, _ in some]),
    )


def _scene_polytopes(obstacles: Numbered) -> Polytopes | None:
    some = [(i, piece) for i, item in obstacles for piece in _pieces(item)]
    if not some:
        return None
    center = np.array([(piece.vertices.min(axis=0) + piece.vertices.max(axis=0)) / 2 for _, piece in some])
    return Polytopes(
        axes=np.tile(np.eye(3), (len(some), 1, 1)),
        origin=center,
        core=np.arange(len(some)),
        vertices=padded([piece.vertices - at for (_, piece), at in zip(some, center, strict=True)]),
        radius=np.array([piece.rounding for _, piece in some]),
        obstacle=np.array([i for i, _ in some]),
    )


def _pieces(item: Obstacle) -> Iterable[Polytope]:
    """Return the polytopes of which an obstacle is made; none if it is of another shape."""
    return (item,) if isinstance(item, Polytope) else item.pieces if isinstance(item, PolytopeSet) else ()


@cached_by_identity
def cells_of(solids: Solids) -> Balls | None:
    """Return balls around consecutive solids: up to 16 balls each, or one polytope each. None where they do not pay."""
    if isinstance(solids, Polytopes):
        return _around_polytopes(solids)
    return _around_balls(solids) if isinstance(solids, Balls) and len(solids.radius) > _FEW else None


def _around_polytopes(polytopes: Polytopes) -> Balls:
    reach = np.linalg.norm(polytopes.vertices, axis=2).max(axis=1)[polytopes.core] + polytopes.radius
    return Balls(
        center=polytopes.origin,
        radius=reach * _OUTWARD,
        obstacle=polytopes.obstacle,
        first=np.arange(len(reach)),
        count=np.ones(len(reach), np.intp),
    )


def _around_balls(balls: Balls) -> Balls:
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
    """Return all arrays of solids that are lengths [m]."""
    names = ("center", "origin", "half", "round", "vertices", "radius")
    return [getattr(solids, name) for name in names if hasattr(solids, name)]


def _sorted_balls(center: Array, radius: Array, obstacle: Indices) -> Balls:
    """Return balls in an order in which neighbours follow each other."""
    order = np.arange(len(radius))
    if len(radius) > _FEW:
        order = _neighbours(center, order)
    none = np.zeros(len(radius), np.intp)
    return Balls(center=center[order], radius=radius[order], obstacle=obstacle[order].astype(np.intp), first=none, count=none)


def _neighbours(center: Array, order: Indices) -> Indices:
    """Return an order in which neighbours follow each other: halved along the longest side, until the parts are cells."""
    if len(order) <= _CELL:
        return order
    points = center[order]
    axis = int(np.argmax(np.ptp(points, axis=0)))
    cells = -(-len(order) // _CELL)
    half = cells // 2 * _CELL
    order = order[np.argpartition(points[:, axis], half)]
    return np.concatenate([_neighbours(center, order[:half]), _neighbours(center, order[half:])])
