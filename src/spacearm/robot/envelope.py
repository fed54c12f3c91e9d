"""The envelope of a link: capsules that enclose its collision shapes, and how closely they do.

A sphere is exact, and so is a cylinder whose ends carry spheres of its radius. Any other cylinder, box or mesh is enclosed in
one capsule, or in a few: its surface is cut by planes where that pays, and each piece is enclosed. Capsules that lie inside
another one of the same link are removed.

A capsule is convex, so it holds a piece of a triangle if it holds its corners. The solid behind the surface
lies inside as well, not only its skin: where the planes have one or two normals, a line through any point of
the solid that runs along all the planes leaves it on both sides within its piece. With three normals there is
no such line; then each cut closes both parts with the convex hull of where the plane meets the surface.

Up to three capsules are chosen by their volume, with a price for each, since each costs time in every check. Who allows more
wants a closer envelope: then what stands out least is chosen.
"""

from __future__ import annotations

import hashlib
import itertools
import math
import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from spacearm.core.checks import as_whole
from spacearm.core.errors import RobotError
from spacearm.core.reading import located
from spacearm.robot.capsule_fit import (
    Segment,
    across,
    closer,
    fit_capsule,
    outermost,
    rough_volume,
    shortest_axis,
    surface_points,
    union_volume,
)
from spacearm.robot.capsules import point_segment_distance
from spacearm.robot.urdf import CAPSULES_PER_SHAPE, MOST_CAPSULES_PER_SHAPE, Shape, link_shapes, parsed_urdf

Array = NDArray[np.float64]

_ON_SURFACE = 1500  # points on each capsule
_ON_MESH = 20_000  # points spread over a mesh, for distances that are about right


def greatest_excess(shapes: Sequence[Shape], capsules: Sequence[Segment]) -> float:
    """Return how far capsules stand out of the shapes that they enclose, at most [m], by points on each capsule."""
    return Excess(shapes)(capsules)


class Excess:
    """Measures capsules around shapes as `greatest_excess` does; what can be prepared is, once."""

    def __init__(self, shapes: Sequence[Shape]) -> None:
        """Take the shapes that are enclosed."""
        self._shapes, self._distances = shapes, [_distance_to(shape) for shape in shapes]
        self._quick = [_about(shape) or distance for shape, distance in zip(shapes, self._distances, strict=True)]

    def about(self, points: Array) -> Array:
        """Return about how far points (m, 3) are from the shapes, 0 inside, quickly; from a mesh: from its surface [m]."""
        return self._least(points, self._quick)

    def _least(self, points: Array, distances: Sequence[Callable[[Array], Array]]) -> Array:
        places = [_inside_of(shape.T_link_shape, points) for shape in self._shapes]
        return np.min([distance(at) for distance, at in zip(distances, places, strict=True)], axis=0)

    def __call__(self, capsules: Sequence[Segment]) -> float:
        """Return how far capsules stand out of the shapes, at most [m]."""
        points = np.concatenate([surface_points(capsule, _ON_SURFACE) for capsule in capsules])
        depth = np.array([point_segment_distance(points, capsule.a, capsule.b) - capsule.radius for capsule in capsules])
        outer = points[(depth > -1e-9).all(axis=0)]
        return float(max(self._least(outer, self._distances).max(), 0.0)) if len(outer) else 0.0


def _inside_of(T: Array, points: Array) -> Array:
    return (points - T[:3, 3]) @ T[:3, :3]


def _distance_to(shape: Shape) -> Callable[[Array], Array]:
    """Return a function that gives the distance of points (k, 3), in the shape's frame, from it; 0 inside."""
    if shape.kind == "sphere":
        return lambda points: np.maximum(np.linalg.norm(points, axis=1) - shape.size[0], 0.0)
    if shape.kind == "box":
        return lambda points: np.linalg.norm(np.maximum(np.abs(points) - np.array(shape.size) / 2, 0.0), axis=1)
    if shape.kind == "cylinder":
        radius, length = shape.size
        return lambda points: np.hypot(
            np.maximum(np.hypot(points[:, 0], points[:, 1]) - radius, 0.0), np.maximum(np.abs(points[:, 2]) - length / 2, 0.0)
        )
    assert shape.triangles is not None
    return _distance_to_mesh(shape.triangles)


def _about(shape: Shape) -> Callable[[Array], Array] | None:
    """Return a function for a mesh that measures the distance from points spread over its surface; None for other shapes."""
    from scipy.spatial import KDTree

    if shape.triangles is None:
        return None
    a, b, c = np.moveaxis(shape.triangles, 1, 0)
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    rng = np.random.default_rng(0)
    which = rng.choice(len(area), _ON_MESH, p=area / area.sum()) if area.sum() > 0 else np.zeros(1, dtype=int)
    u, v = rng.random((2, len(which), 1))
    u, v = np.where(u + v > 1, 1 - u, u), np.where(u + v > 1, 1 - v, v)
    tree = KDTree(np.concatenate([a[which] + u * (b - a)[which] + v * (c - a)[which], shape.triangles.reshape(-1, 3)]))
    return lambda points: tree.query(points)[0]


def _distance_to_mesh(triangles: Array) -> Callable[[Array], Array]:
    import coal  # pyright: ignore[reportMissingImports]

    surface = coal.BVHModelOBBRSS()
    surface.beginModel(len(triangles), 3 * len(triangles))
    for a, b, c in triangles:
        surface.addTriangle(a, b, c)
    surface.endModel()

    def distance(points: Array) -> Array:
        out = np.empty(len(points))
        still, ball = coal.Transform3s.Identity(), coal.Sphere(0.0)
        for i, point in enumerate(points):
            at = coal.Transform3s(np.eye(3), point)
            out[i] = coal.distance(ball, at, surface, still, coal.DistanceRequest(), coal.DistanceResult())
        return np.maximum(out, 0.0)

    return distance


_PRICE = 0.2  # share of the volume that each further capsule must save, since each costs time in every check;
CHOSEN_BY_VOLUME = 3
"""How many capsules are chosen by their volume; of more it is how far they stand out that decides."""
_PAYS = 0.98  # times what stands out with fewer: more must stand out less than that
_SWOLLEN = 1.25  # times the volume of the few: more must not take up more room than that
_CLOSE = 0.01  # of the shape's size: what stands out no more needs no further capsules
_GRIDS = 2  # ways to cut into a given number of parts that are examined closely
_MANY = 1200  # triangles; of larger surfaces a selection of points tells where to cut
_PLACES = 5  # cuts tried along each direction
_IN_VOLUME = 6000  # points by which the volume of a plan is measured
_HALVINGS = 3  # of the distance between them, in placing the best


@dataclass(frozen=True, slots=True)
class Plane:
    """All points p with normal . p = offset; the normal (3,) has length 1."""

    normal: Array
    offset: float


Plan = list[tuple[int, Plane]]
"""Cuts, one after the other: which piece, and where; its two parts take its place in the list."""


def enclose(triangles: Array, count: int, excess: Excess | None = None) -> list[Segment]:
    """Enclose a surface, and what is inside it, in at most `count` capsules.

    Args:
        triangles: (k, 3, 3) corners [m], at least one.
        count: 1 or more. Fewer are used where more do not pay. Of up to three, what must fall is the volume of all together,
            times 1 + 0.2 per further capsule; of more, how far they stand out, by 2 %.
        excess: measures how far capsules stand out [m]; without it the volume decides for any count.
    """
    best = _of_least_volume(triangles, count if excess is None else min(count, CHOSEN_BY_VOLUME))
    return best if excess is None or count <= CHOSEN_BY_VOLUME else _of_least_excess(triangles, best, count, excess)


def _of_least_excess(triangles: Array, best: list[Segment], count: int, excess: Excess) -> list[Segment]:
    """Return the capsules that stand out least.

    What is tried for a number of parts does not depend on how many are allowed, so that allowing more never makes it worse.
    """
    rough = _selection(triangles)
    plans: dict[int, list[tuple[float, Plan]]] = {}
    for plan in _grids(rough, count):
        plans.setdefault(_parts_of(plan), []).append((_rough_sum(rough, plan), plan))
    greedy = {len(plan) + 1: plan for plan in _greedy(rough, count)}
    least, most = excess(best), _SWOLLEN * union_volume(best, _IN_VOLUME)
    close = _CLOSE * float(np.ptp(triangles.reshape(-1, 3), axis=0).max())
    for number in range(2, count + 1):
        if least <= close:
            break
        chosen = sorted(plans.get(number, []), key=lambda one: one[0])[:_GRIDS]
        tried: list[list[Segment]] = []
        for plan in [plan for _, plan in chosen] + [greedy[number]] * (number in greedy):
            pieces = _pieces(triangles, plan)
            capsules = [fit_capsule(piece.reshape(-1, 3), refine=False) for piece in pieces]
            tried += [capsules, closer(pieces, capsules, excess.about)]
        for capsules in tried:
            out = excess(capsules)
            if out < _PAYS * least and union_volume(capsules, _IN_VOLUME) < most:
                best, least = capsules, out
    return best


def _parts_of(plan: Plan) -> int:
    return len(plan) + 1


def _rough_sum(rough: Array, plan: Plan) -> float:
    return sum(_volume(piece) for piece in _pieces(rough, plan))


def _of_least_volume(triangles: Array, count: int) -> list[Segment]:
    best = [triangles]
    least = fit_capsule(triangles.reshape(-1, 3), refine=False).volume if count > 1 else 0.0
    for plan in _promising(_selection(triangles), count) if count > 1 else ():
        pieces = _pieces(triangles, plan)
        capsules = [fit_capsule(piece.reshape(-1, 3), refine=False) for piece in pieces]
        cost = union_volume(capsules, _IN_VOLUME) * (1 + _PRICE * (len(capsules) - 1))
        if cost < least:
            best, least = pieces, cost
    return [fit_capsule(piece.reshape(-1, 3)) for piece in best]


def cut(triangles: Array, plane: Plane, *, lids: bool = False) -> tuple[Array, Array]:
    """Cut a surface (k, 3, 3) into what is behind a plane and what is before it.

    Args:
        triangles: the corners [m].
        plane: where to cut.
        lids: close both parts with the convex hull of where the plane meets the surface.
    """
    signed = triangles @ plane.normal - plane.offset  # (k, 3)
    before = signed > 0
    crossing = before.any(axis=1) & ~before.all(axis=1)
    behind_whole, before_whole = triangles[~before.any(axis=1)], triangles[before.all(axis=1)]
    if not crossing.any():
        return behind_whole, before_whole
    T, d, side = triangles[crossing], signed[crossing], before[crossing]
    # Turn each triangle so that the corner which is alone on its side comes first.
    lone_before = side.sum(axis=1) == 1
    lone = np.where(lone_before, np.argmax(side, axis=1), np.argmin(side, axis=1))
    order = (lone[:, None] + np.arange(3)) % 3
    rows = np.arange(len(T))[:, None]
    T, d = T[rows, order], d[rows, order]
    p = T[:, 0] + (d[:, :1] / (d[:, :1] - d[:, 1:2])) * (T[:, 1] - T[:, 0])
    q = T[:, 0] + (d[:, :1] / (d[:, :1] - d[:, 2:3])) * (T[:, 2] - T[:, 0])
    tips = np.stack([T[:, 0], p, q], axis=1)
    rest = np.concatenate([np.stack([p, T[:, 1], T[:, 2]], axis=1), np.stack([p, T[:, 2], q], axis=1)])
    twice = np.concatenate([lone_before, lone_before])
    lid = _lid(np.concatenate([p, q]), plane.normal) if lids else triangles[:0]
    behind = np.concatenate([behind_whole, tips[~lone_before], rest[twice], lid])
    return behind, np.concatenate([before_whole, tips[lone_before], rest[~twice], lid])


def _lid(points: Array, normal: Array) -> Array:
    """Return the convex hull of points (k, 3) on a plane, as triangles."""
    (x,), (y,) = across(normal[None])
    ring = points[_hull(points @ x, points @ y)]
    return np.array([[ring[0], ring[i], ring[i + 1]] for i in range(1, len(ring) - 1)]).reshape(-1, 3, 3)


def _hull(across: Array, up: Array) -> list[int]:
    """List the corners of the convex hull of points in a plane, in turn (Andrew's monotone chain)."""
    order = [int(i) for i in np.lexsort((up, across))]
    x, y = across.tolist(), up.tolist()

    def half(indices: list[int]) -> list[int]:
        chain: list[int] = []
        for i in indices:
            while len(chain) > 1:
                o, p = chain[-2], chain[-1]
                if (x[p] - x[o]) * (y[i] - y[o]) - (y[p] - y[o]) * (x[i] - x[o]) > 0:
                    break
                chain.pop()
            chain.append(i)
        return chain

    lower, upper = half(order), half(order[::-1])
    return lower[:-1] + upper[:-1]


def _pieces(triangles: Array, plan: Plan) -> list[Array]:
    pieces = [triangles]
    lids = np.linalg.matrix_rank(np.array([plane.normal for _, plane in plan]).reshape(-1, 3), tol=1e-9) > 2
    for which, plane in plan:
        pieces[which : which + 1] = cut(pieces[which], plane, lids=bool(lids))
    return [piece for piece in pieces if len(piece)]


def _promising(rough: Array, count: int) -> list[Plan]:
    """Choose, for each number of pieces from 2 to `count`, the plan whose capsules have the least volume in sum."""
    best: dict[int, tuple[float, Plan]] = {}
    for plan in (*_grids(rough, count), *_greedy(rough, count)):
        pieces = _pieces(rough, plan)
        volume = sum(_volume(piece) for piece in pieces)
        if len(pieces) > 1 and volume < best.get(len(pieces), (np.inf, plan))[0]:
            best[len(pieces)] = volume, plan
    return [plan for _, plan in best.values()]


def _grids(rough: Array, count: int) -> Iterator[Plan]:
    """Propose to cut into parts of equal thickness, along one axis, or two, or three."""
    for normals in itertools.chain.from_iterable(itertools.combinations(axes, k) for axes in _frames(rough) for k in (1, 2, 3)):
        for parts in itertools.product(range(2, count + 1), repeat=len(normals)):
            if math.prod(parts) > count:
                continue
            plan: Plan = []
            pieces = 1
            for normal, number in zip(normals, parts, strict=True):
                low, high = _extent(rough, normal)
                offsets = [float(at) for at in np.linspace(low, high, number + 1)[1:-1]]
                plan += [(i * number + k, Plane(normal, at)) for i in range(pieces) for k, at in enumerate(offsets)]
                pieces *= number
            yield plan


def _greedy(rough: Array, count: int) -> Iterator[Plan]:
    """Propose to cut one by one, wherever the most is saved."""
    plan: Plan = []
    pieces, volumes = [rough], [_volume(rough)]
    while len(pieces) < count:
        which = int(np.argmax(volumes))
        split = _best_split(pieces[which])
        if split is None:
            return
        plane, parts = split
        plan = [*plan, (which, plane)]
        pieces[which : which + 1] = parts
        volumes[which : which + 1] = [_volume(part) for part in parts]
        yield plan


def _best_split(piece: Array) -> tuple[Plane, tuple[Array, Array]] | None:
    tried = []
    for normal in np.concatenate(_frames(piece)):
        low, high = _extent(piece, normal)
        tried += [_split(piece, Plane(normal, float(at))) for at in np.linspace(low, high, _PLACES + 2)[1:-1]]
    best = min(tried, key=lambda split: split[0])
    normal = best[1].normal
    low, high = _extent(piece, normal)
    step = (high - low) / (_PLACES + 1)
    for _ in range(_HALVINGS):
        step /= 2
        nearby = [_split(piece, Plane(normal, best[1].offset + side * step)) for side in (-1, 1)]
        best = min(best, *nearby, key=lambda split: split[0])
    return None if best[0] == np.inf else best[1:]


def _split(piece: Array, plane: Plane) -> tuple[float, Plane, tuple[Array, Array]]:
    parts = cut(piece, plane)
    volume = sum(_volume(part) for part in parts) if all(len(part) for part in parts) else np.inf
    return volume, plane, parts


def _volume(piece: Array) -> float:
    return rough_volume(piece.reshape(-1, 3))


def _extent(triangles: Array, normal: Array) -> tuple[float, float]:
    at = triangles.reshape(-1, 3) @ normal
    return float(at.min()), float(at.max())


def _frames(triangles: Array) -> list[Array]:
    """Return the coordinate axes, and the main axes of a surface where they are others, (3, 3) each."""
    points = triangles.reshape(-1, 3)
    spread = points - points.mean(axis=0)
    main = np.linalg.eigh(spread.T @ spread)[1].T
    return [np.eye(3)] if np.abs(main).max(axis=1).min() > 1 - 1e-6 else [np.eye(3), main]


def _selection(triangles: Array) -> Array:
    """Stand in for a surface of many triangles by points of it, each a triangle without extent."""
    if len(triangles) <= _MANY:
        return triangles
    points = triangles.reshape(-1, 3)
    spread = points[:: max(1, len(points) // _MANY)]
    return np.repeat(np.concatenate([outermost(points, 300), spread])[:, None], 3, axis=1)


_SIDES = 32  # of the prism around a cylinder that is cut into pieces
_REMEMBERED = 256  # shapes, so that a robot that is loaded again need not be enclosed again
_SAME = 1e-6  # [m] and as a share: by so much a sphere may miss the end of its cylinder


def enclosed(shapes: list[Shape], count: int) -> list[Segment]:
    """Enclose the collision shapes of one link, in its frame, each in at most `count` capsules."""
    capsules, merged = _rounded_cylinders(shapes)
    for i, shape in enumerate(shapes):
        if i not in merged:
            capsules += [_carried(shape.T_link_shape, capsule) for capsule in _enclosed(shape, count)]
    return _without_inner(capsules)


def shape_triangles(kind: str, size: tuple[float, ...]) -> Array:
    """Return the surface (k, 3, 3) of a box, or of a prism around a cylinder, about the origin [m]."""
    if kind == "box":
        corners = np.array([(x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)]) * size
        quads = [(0, 1, 3, 2), (4, 5, 7, 6), (0, 1, 5, 4), (2, 3, 7, 6), (0, 2, 6, 4), (1, 3, 7, 5)]
        return np.array([corners[[q[0], *q[i : i + 2]]] for q in quads for i in (1, 2)])
    radius, length = size
    angle = 2 * np.pi * np.arange(_SIDES) / _SIDES
    ring = radius / np.cos(np.pi / _SIDES) * np.column_stack([np.cos(angle), np.sin(angle), np.zeros(_SIDES)])
    half = np.array([0, 0, length / 2])
    low, high = ring - half, ring + half
    following = np.roll(np.arange(_SIDES), -1)
    sides = [np.stack(corners, axis=1) for corners in ((low, low[following], high), (high, high[following], low[following]))]
    lids = [np.stack([np.broadcast_to(end[0], end[1:-1].shape), end[1:-1], end[2:]], axis=1) for end in (low, high)]
    return np.concatenate([*sides, *lids])


def _enclosed(shape: Shape, count: int) -> tuple[Segment, ...]:
    if shape.kind == "sphere":
        return (Segment(np.zeros(3), np.zeros(3), shape.size[0]),)
    if shape.kind == "cylinder":
        return _cylinder_capsules(*shape.size, count)
    if shape.kind == "box":
        return _box_capsules(shape.size, count)
    assert shape.triangles is not None
    return _mesh_capsules(shape.triangles, count)


@lru_cache(maxsize=_REMEMBERED)
def _box_capsules(size: tuple[float, ...], count: int) -> tuple[Segment, ...]:
    shape = Shape("box", size, np.eye(4))
    return tuple(enclose(shape_triangles("box", size), count, _excess(shape, count)))


@lru_cache(maxsize=_REMEMBERED)
def _cylinder_capsules(radius: float, length: float, count: int) -> tuple[Segment, ...]:
    first, last, larger = shortest_axis(np.array([-length / 2, length / 2]), np.array([radius, radius]))
    alone = Segment(np.array([0.0, 0.0, first]), np.array([0.0, 0.0, last]), larger)
    shape = Shape("cylinder", (radius, length), np.eye(4))
    several = enclose(shape_triangles("cylinder", (radius, length)), count, _excess(shape, count))
    return (alone,) if len(several) == 1 and alone.volume <= several[0].volume else tuple(several)


_meshes: dict[tuple[bytes, int], tuple[Segment, ...]] = {}


def _mesh_capsules(triangles: Array, count: int) -> tuple[Segment, ...]:
    key = hashlib.sha256(triangles.tobytes()).digest(), count
    if key not in _meshes:
        if len(_meshes) >= _REMEMBERED:
            _meshes.clear()
        _meshes[key] = tuple(enclose(triangles, count, _excess(Shape("mesh", (), np.eye(4), triangles), count)))
    return _meshes[key]


def _excess(shape: Shape, count: int) -> Excess | None:
    """Return what measures how far capsules stand out of a shape; None where their volume decides, and it is not needed."""
    return Excess([shape]) if count > CHOSEN_BY_VOLUME else None


def _rounded_cylinders(shapes: list[Shape]) -> tuple[list[Segment], set[int]]:
    """Find cylinders with a sphere of their radius on each end: capsules. Return these and the places of what they hold."""
    capsules: list[Segment] = []
    merged: set[int] = set()
    spheres = [(i, shape.T_link_shape[:3, 3], shape.size[0]) for i, shape in enumerate(shapes) if shape.kind == "sphere"]
    for i, shape in enumerate(shapes):
        if shape.kind != "cylinder":
            continue
        radius, length = shape.size
        T = shape.T_link_shape
        ends = [T[:3, :3] @ (0, 0, side * length / 2) + T[:3, 3] for side in (-1, 1)]
        caps = []
        for end in ends:
            near = [(k, r + float(np.linalg.norm(c - end))) for k, c, r in spheres if np.linalg.norm(c - end) <= _SAME]
            caps += [(k, r) for k, r in near if abs(r - radius) <= _SAME * max(radius, 1.0)][:1]
        if len(caps) == 2:
            capsules.append(Segment(ends[0], ends[1], max(radius, *(r for _, r in caps))))
            merged |= {i, *(k for k, _ in caps)}
    return capsules, merged


def _without_inner(capsules: list[Segment]) -> list[Segment]:
    """Leave out the capsules that lie inside another one."""
    kept: list[Segment] = []
    for capsule in sorted(capsules, key=lambda capsule: -capsule.radius):
        ends = np.array([capsule.a, capsule.b])
        if not any(point_segment_distance(ends, o.a, o.b).max() + capsule.radius <= o.radius for o in kept):
            kept.append(capsule)
    return [capsule for capsule in capsules if any(capsule is one for one in kept)]


def _carried(T: Array, capsule: Segment) -> Segment:
    return Segment(T[:3, :3] @ capsule.a + T[:3, 3], T[:3, :3] @ capsule.b + T[:3, 3], capsule.radius)


_IN_VOLUME = 60_000  # points in the box around all of them


@dataclass(frozen=True, slots=True, kw_only=True)
class LinkEnvelope:
    """The envelope of one link.

    Attributes:
        link: its name.
        shapes: the kinds of its collision shapes: "sphere", "cylinder", "box" or "mesh".
        capsules: how many capsules enclose them.
        excess: how far the envelope stands out of the shapes, at most [m].
        volume: of the envelope [m^3].
        ratio: of that volume to the sum of the shapes' own [-]; inf if they have none.
    """

    link: str
    shapes: tuple[str, ...]
    capsules: int
    excess: float
    volume: float
    ratio: float


def envelope_report(urdf: str | os.PathLike[str], *, capsules_per_shape: int = CAPSULES_PER_SHAPE) -> tuple[LinkEnvelope, ...]:
    """Measure the envelope that `load_robot` gives to the links of a URDF file.

    The excess is the greatest found among 1500 points on each capsule, and the volume is that of 60,000 points
    spread evenly: both are good to about two percent.

    Args:
        urdf: path of the file.
        capsules_per_shape: as in `load_robot`.

    Returns:
        One record for each link with collision shapes.

    Raises:
        FileFormatError: no such file, or no URDF.
        RobotError: a mesh that cannot be read, or `capsules_per_shape` below 1.
    """
    count = as_whole("capsules_per_shape", capsules_per_shape, RobotError, at_least=1, at_most=MOST_CAPSULES_PER_SHAPE)
    links = parsed_urdf(urdf).links
    with located(urdf):
        found = [(link.name, link_shapes(link, Path(urdf).parent)) for link in links]
    return tuple(_measured(name, shapes, enclosed(shapes, count)) for name, shapes in found if shapes)


def _measured(link: str, shapes: list[Shape], capsules: list[Segment]) -> LinkEnvelope:
    volume = union_volume(capsules, _IN_VOLUME)
    own = sum(_shape_volume(shape) for shape in shapes)
    return LinkEnvelope(
        link=link,
        shapes=tuple(shape.kind for shape in shapes),
        capsules=len(capsules),
        excess=greatest_excess(shapes, capsules),
        volume=volume,
        ratio=volume / own if own > 0 else math.inf,
    )


def _shape_volume(shape: Shape) -> float:
    if shape.kind == "sphere":
        return 4 / 3 * math.pi * shape.size[0] ** 3
    if shape.kind == "cylinder":
        return math.pi * shape.size[0] ** 2 * shape.size[1]
    if shape.kind == "box":
        return math.prod(shape.size)
    assert shape.triangles is not None
    a, b, c = np.moveaxis(shape.triangles - shape.triangles.mean(axis=(0, 1)), 1, 0)
    return abs(float(np.einsum("ki,ki->", a, np.cross(b, c)))) / 6
