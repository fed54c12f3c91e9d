"""The volume, the centre and the inertia of evenly filled shapes.

Spheres, capsules, boxes and cylinders, rounded or not, have formulas; a polytope is a sum over tetrahedra. A rounded polytope
is taken as the hull of its vertices, each with a polyhedron of a ball's volume around it. Of shapes that overlap each other,
what is counted twice is measured on a grid and taken off.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from spacearm.core.exact import product, sines
from spacearm.geometry.convex_cores import core_of
from spacearm.geometry.shapes import ConvexShape, Polytope, PolytopeSet, Sphere, SphereSet

Array = NDArray[np.float64]

_POINTS = 64  # of the grid along the longest edge of the box around shapes that overlap
_DIRECTIONS = 642  # points on the polyhedron that stands for the ball around a vertex
_FLAT = 1e-9  # share of a hull's largest extent, below which it has no extent
_W2, _W3, _W4, _W5 = math.pi / 4, 2 / 3, 3 * math.pi / 16, 8 / 15  # integrals of cos^n from 0 to pi/2


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SolidMoments:
    """What evenly filled shapes have in common.

    Attributes:
        volume: [m^3]; 0 of what is flat: its mass is spread over the surface, the line or the point.
        center: (3,) centre of mass, in the coordinates of the shape [m].
        inertia: (3, 3) per mass, about the centre, along the axes of the coordinates [m^2].
    """

    volume: float
    center: Array
    inertia: Array


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Integrals:
    """The integrals of 1, x (3,) and x x^T (3, 3) over a body of a dimension from 0 to 3."""

    dimension: int
    measure: float
    first: Array
    second: Array

    def scaled(self, factor: float) -> _Integrals:
        return replace(self, measure=factor * self.measure, first=factor * self.first, second=factor * self.second)

    def plus(self, other: _Integrals) -> _Integrals:
        return replace(
            self,
            measure=self.measure + other.measure,
            first=self.first + other.first,
            second=self.second + other.second,
        )


def solid_moments(shape: ConvexShape | SphereSet | PolytopeSet) -> SolidMoments:
    """Return the volume, the centre and the inertia of an evenly filled shape.

    Of overlapping balls or polytopes they are good to about two percent, of a rounded polytope to about 0.2 percent, and else
    to rounding.
    """
    if isinstance(shape, SphereSet):
        balls = [Sphere(center, float(radius)) for center, radius in zip(shape.centers, shape.radii, strict=True)]
        found = _union(balls)
    else:
        found = _union(shape.pieces) if isinstance(shape, PolytopeSet) else _integrals(shape)
    center = found.first / found.measure
    about = found.second / found.measure - np.outer(center, center)
    about = (about + about.T) / 2
    return SolidMoments(
        volume=found.measure if found.dimension == 3 else 0.0,
        center=center,
        inertia=np.trace(about) * np.eye(3) - about,
    )


def _integrals(shape: ConvexShape) -> _Integrals:
    core = core_of(shape)
    if core.kind == "polytope":
        points = core.vertices if core.radius == 0 else _rounded(core.vertices, core.radius)
        return _placed(_hull(points), core.T)
    if core.kind == "box":
        return _placed(_box(2 * core.half, core.radius), core.T)
    if core.kind in ("point", "segment") and core.radius == 0:
        end = np.array([0.0, 0.0, core.half[2]])
        return _placed(_hull(np.stack([-end, end])), core.T)
    return _placed(_round(float(core.half[0]) if core.kind == "cylinder" else 0.0, float(core.half[2]), core.radius), core.T)


def _placed(own: _Integrals, T: Array) -> _Integrals:
    """Return the integrals in a frame of those in a body's own, by T_frame_own (4, 4)."""
    R, t = T[:3, :3], T[:3, 3]
    turned = product(R, own.first)
    second = product(product(R, own.second), R.T)
    second = second + np.outer(turned, t) + np.outer(t, turned) + own.measure * np.outer(t, t)
    return replace(own, first=turned + own.measure * t, second=second)


def _box(size: Array, r: float) -> _Integrals:
    """Integrate over a rounded box about its middle: the box, and beyond its faces, edges and corners."""
    a, b, c = size.tolist()
    volume = a * b * c + 2 * r * (a * b + b * c + c * a) + math.pi * r * r * (a + b + c) + 4 / 3 * math.pi * r**3
    squares = [_box_square(a, b, c, r), _box_square(b, c, a, r), _box_square(c, a, b, r)]
    return _Integrals(dimension=3, measure=volume, first=np.zeros(3), second=np.diag(squares))


def _box_square(a: float, b: float, c: float, r: float) -> float:
    """Integrate x^2 over a rounded box whose edge along x is a."""
    h = a / 2
    inner = a**3 / 12 * (b * c + 2 * r * (b + c) + math.pi * r * r)  # the box, two pairs of faces, the edges along x
    faces = 2 * b * c * ((h + r) ** 3 - h**3) / 3
    edges = 4 * (b + c) * (h * h * math.pi * r * r / 4 + 2 * h * r**3 / 3 + math.pi * r**4 / 16)
    corners = 8 * (h * h * math.pi * r**3 / 6 + 2 * h * math.pi * r**4 / 16 + math.pi * r**5 / 30)
    return inner + faces + edges + corners


def _round(R: float, h: float, r: float) -> _Integrals:
    """Integrate over a rounded cylinder about its middle, 2 h long along z; of radius R = 0 it is a capsule.

    Beyond the ends z = h + r sin t, and the radius there is R + r cos t.
    """
    out, length, pi = R + r, 2 * h, math.pi
    across = R * R + 2 * R * r * _W2 + r * r * _W3  # the integral of radius^2 cos t
    fourth = R**4 + 4 * R**3 * r * _W2 + 6 * R * R * r * r * _W3 + 4 * R * r**3 * _W4 + r**4 * _W5
    along = h * h * across + 2 * h * r * (R * R / 2 + 2 * R * r / 3 + r * r / 4)
    along += r * r * (R * R * (1 - _W3) + 2 * R * r * (_W2 - _W4) + r * r * (_W3 - _W5))
    volume = pi * out * out * length + 2 * pi * r * across
    x2 = pi / 4 * (out**4 * length + 2 * r * fourth)
    z2 = pi * out * out * length**3 / 12 + 2 * pi * r * along
    return _Integrals(dimension=3, measure=volume, first=np.zeros(3), second=np.diag([x2, x2, z2]))


def _hull(points: Array) -> _Integrals:
    """Integrate over the convex hull of points (k, 3), of whatever dimension it is, as a sum over simplices."""
    simplices = _simplices(points)  # (m, d + 1, 3)
    d = simplices.shape[1] - 1
    edges = simplices[:, 1:] - simplices[:, :1]
    gram = np.einsum("mic,mjc->mij", edges, edges)
    measures = np.sqrt(np.maximum(np.linalg.det(gram), 0.0)) / math.factorial(d) if d else np.ones(len(simplices))
    sums = simplices.sum(axis=1)
    second = np.einsum("m,mic,mid->cd", measures, simplices, simplices) + np.einsum("m,mc,md->cd", measures, sums, sums)
    return _Integrals(
        dimension=d,
        measure=float(measures.sum()),
        first=np.einsum("m,mc->c", measures, sums) / (d + 1),
        second=second / ((d + 1) * (d + 2)),
    )


def _simplices(points: Array) -> Array:
    """Divide the convex hull of points (k, 3) into simplices (m, d + 1, 3) of its dimension d."""
    from scipy.spatial import ConvexHull

    middle = points.mean(axis=0)  # of the plane or line that they are in
    _, extents, axes = np.linalg.svd(points - middle, full_matrices=False)
    dimension = int((extents > _FLAT * max(float(extents[0]), 1e-300)).sum())
    if dimension == 0:
        return middle[None, None]
    own = (points - middle) @ axes[:dimension].T  # (k, d)
    if dimension == 1:
        ends = points[[int(np.argmin(own)), int(np.argmax(own))]]
        return ends[None]
    hull = ConvexHull(own)
    apex = points[hull.vertices].mean(axis=0)
    faces = points[hull.simplices]
    return np.concatenate([np.broadcast_to(apex, (len(faces), 1, 3)), faces], axis=1)


def _rounded(vertices: Array, radius: float) -> Array:
    """Return points whose hull is about the hull of vertices (k, 3) rounded by a radius [m]."""
    k = np.arange(_DIRECTIONS)
    z = 1 - (2 * k + 1) / _DIRECTIONS
    s, c = sines(k * math.pi * (3 - math.sqrt(5)))
    ring = np.sqrt(1 - z * z)
    ball = np.column_stack([ring * c, ring * s, z])
    ball *= (4 / 3 * math.pi / _hull(ball).measure) ** (1 / 3)
    return (vertices[:, None] + radius * ball).reshape(-1, 3)


def _union(parts: list[Sphere] | tuple[Polytope, ...]) -> _Integrals:
    """Integrate over the union of shapes: over each, less what is in several of them."""
    each = [_integrals(part) for part in parts]
    most = max(one.dimension for one in each)
    chosen = [(part, one) for part, one in zip(parts, each, strict=True) if one.dimension == most]
    total = chosen[0][1]
    for _, one in chosen[1:]:
        total = total.plus(one)
    if most < 3 or len(chosen) == 1:
        return total
    whole, twice = _on_grid([part for part, _ in chosen])
    return whole if twice.measure > whole.measure else total.plus(twice.scaled(-1.0))


def _on_grid(parts: list[Sphere | Polytope]) -> tuple[_Integrals, _Integrals]:
    """Integrate over the union of shapes, and over what is counted more than once in their sum, on a grid of points."""
    boxes = [_box_of(part) for part in parts]
    low, high = np.min([box[0] for box in boxes], axis=0), np.max([box[1] for box in boxes], axis=0)
    step = float((high - low).max()) / _POINTS
    counts = [max(1, math.ceil(edge / step)) for edge in (high - low).tolist()]
    cell = (high - low) / counts
    axes = [lo + (np.arange(n) + 0.5) * width for lo, n, width in zip(low, counts, cell, strict=True)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    times = np.zeros(len(points), dtype=np.intp)
    for part, (first, last) in zip(parts, boxes, strict=True):
        near = np.flatnonzero(((points >= first) & (points <= last)).all(axis=1))
        times[near[_inside(part, points[near])]] += 1
    volume = float(np.prod(cell))
    return tuple(_of_points(points, weights, volume, cell) for weights in ((times > 0) * 1.0, np.maximum(times - 1.0, 0.0)))  # type: ignore[return-value]


def _of_points(points: Array, weights: Array, volume: float, cell: Array) -> _Integrals:
    """Integrate over cells about points (k, 3)."""
    used = weights > 0
    at, w = points[used], volume * weights[used]
    second = np.einsum("k,kc,kd->cd", w, at, at) + w.sum() * np.diag(cell * cell / 12)
    return _Integrals(dimension=3, measure=float(w.sum()), first=np.einsum("k,kc->c", w, at), second=second)


def _box_of(part: Sphere | Polytope) -> tuple[Array, Array]:
    if isinstance(part, Sphere):
        return part.center - part.radius, part.center + part.radius
    return part.vertices.min(axis=0) - part.rounding, part.vertices.max(axis=0) + part.rounding


def _inside(part: Sphere | Polytope, points: Array) -> NDArray[np.bool_]:
    """Whether points (k, 3) are in a ball, or in the planes of a polytope moved outward by its rounding."""
    if isinstance(part, Sphere):
        off = points - part.center
        return np.einsum("pc,pc->p", off, off) <= part.radius**2
    from scipy.spatial import ConvexHull

    planes = ConvexHull(part.vertices).equations
    above: Array = points @ planes[:, :3].T + planes[:, 3]
    return np.all(above <= part.rounding, axis=1)
