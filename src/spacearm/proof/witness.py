"""Distances by Coal: what is measured beside a proof, apart from the search, its kernel and the finder.

Coal has no type stubs. The protocols below describe the parts of it that are used.
"""

from __future__ import annotations

from collections.abc import Callable, MutableSequence
from importlib import import_module
from itertools import product
from typing import TYPE_CHECKING, Protocol, cast

import numpy as np
from numpy.typing import NDArray

from spacearm.geometry import ConvexShape, HalfSpace, PolytopeSet, Scene, Sphere, SphereSet, core_of
from spacearm.proof.convex_bodies import WORLD, ConvexBodies
from spacearm.proof.mechanism import pinocchio
from spacearm.robot import Robot

if TYPE_CHECKING:
    from scipy.spatial import ConvexHull  # pyright: ignore[reportMissingTypeStubs]

Array = NDArray[np.float64]

_COAL_TOLERANCE = 1e-9  # [m] with Coal's default 1e-6 its distance of a capsule and a cylinder can be 0.34 mm too large
_COAL_ITERATIONS = 256  # of GJK, at most: twice the default, for the tolerance is a thousandth of the default
_SHORT = 0.01  # [m] of two capsules shorter than 3.5 mm Coal's closed form takes the axes for points
_ASIDE = (1e-6, 1e-5, 1e-4)  # [m] Coal has no answer for some cylinders that touch: it is asked with one of them moved aside
_THICKER = 1e-9  # times the size of a flat hull: how much thicker it is made to every side
_SMALLEST = 1e-3  # [m] in place of the size of a smaller flat hull


class CoalRequest(Protocol):
    """How exact a distance has to be."""

    gjk_tolerance: float
    gjk_max_iterations: int


class CoalResult(Protocol):
    """The distance measured last."""

    def getNearestPoint1(self) -> Array:
        """Return the nearest point (3,) of the first shape."""
        ...

    def getNearestPoint2(self) -> Array:
        """Return the nearest point (3,) of the second shape."""
        ...


class CoalShape(Protocol):
    """A shape of Coal's."""

    def setSweptSphereRadius(self, radius: float, /) -> None:
        """Make it all points within a radius of it."""
        ...


class CoalLibrary(Protocol):
    """The functions of Coal that a proof calls."""

    __version__: str
    DistanceRequest: Callable[[], CoalRequest]
    DistanceResult: Callable[[], CoalResult]
    Transform3s: Callable[[Array, Array], object]
    Sphere: Callable[[float], CoalShape]
    Capsule: Callable[[float, float], CoalShape]
    Cylinder: Callable[[float, float], CoalShape]
    Box: Callable[[float, float, float], CoalShape]
    Halfspace: Callable[[Array, float], CoalShape]
    Convex: Callable[[MutableSequence[Array], MutableSequence[object]], CoalShape]
    Triangle: Callable[[int, int, int], object]
    StdVec_Vec3s: Callable[[], MutableSequence[Array]]
    StdVec_Triangle: Callable[[], MutableSequence[object]]
    distance: Callable[[object, object, object, object, CoalRequest, CoalResult], float]


def coal() -> CoalLibrary:
    """Import Coal."""
    return cast(CoalLibrary, import_module("coal"))


def coal_box(half: Array, radius: float) -> CoalShape:
    """Return a box with half edges (3,) and a rounding [m]."""
    return _rounded(coal().Box(*(2 * half).tolist()), radius)


def coal_cylinder(round_: float, half: float, radius: float) -> CoalShape:
    """Return a cylinder of a radius `round_` and a half length, with a rounding `radius` [m]."""
    return _rounded(coal().Cylinder(round_, 2 * half), radius)


def coal_polytope(vertices: Array, radius: float) -> CoalShape:
    """Return the hull of vertices (k, 3), with a rounding [m].

    A hull without volume is made thicker by _THICKER of its size to all sides, because Coal needs triangles around it. Its
    clearance is then measured that much too small, which is less than what is a disagreement.
    """
    hull = _hull(vertices)
    library, number = coal(), {int(k): i for i, k in enumerate(hull.vertices)}
    points, triangles = library.StdVec_Vec3s(), library.StdVec_Triangle()
    points.extend(np.asarray(hull.points, dtype=np.float64)[hull.vertices])
    for corners, plane in zip(hull.simplices, hull.equations, strict=True):
        a, b, c = hull.points[corners]
        outward = float(np.cross(b - a, c - a) @ plane[:3]) > 0
        triangles.append(library.Triangle(*(number[int(k)] for k in (corners if outward else corners[::-1]))))
    return _rounded(library.Convex(points, triangles), radius)


def _hull(vertices: Array) -> ConvexHull:
    """Return the hull of vertices (k, 3), made thicker if it has no volume."""
    from scipy.spatial import ConvexHull, QhullError  # pyright: ignore[reportMissingTypeStubs]

    corners = np.array(list(product((-1.0, 1.0), repeat=3)))
    size = max(float(np.abs(vertices).max()), _SMALLEST)
    spread = np.linalg.svd(vertices - vertices.mean(axis=0), compute_uv=False)
    flat = len(spread) < 3 or float(spread[2]) <= _THICKER * size  # of rounding alone Qhull makes a hull without some corners
    for thicker in (0.0, _THICKER, 1e2 * _THICKER)[flat:]:
        try:
            return ConvexHull((vertices[:, None] + thicker * size * corners).reshape(-1, 3) if thicker else vertices)
        except QhullError:  # no volume, or less than rounding
            continue
    raise AssertionError("a hull with volume is refused")


def _rounded(shape: CoalShape, radius: float) -> CoalShape:
    if radius:
        shape.setSweptSphereRadius(radius)
    return shape


def witness_name() -> str:
    """Return the libraries for kinematics and measured distances, with their versions."""
    return f"pinocchio {pinocchio().__version__}, coal {coal().__version__}"


class CoalBodies:
    """The bodies of a table as Coal's shapes, built from the numbers of the robot and the scene and not from the table's."""

    def __init__(self, robot: Robot, scene: Scene, bodies: ConvexBodies) -> None:
        """Note down what is needed; each shape is built when it is first asked for."""
        self._robot, self._bodies, self._coal = robot, bodies, coal()
        self._parts, self._first = _parts(scene), int(np.count_nonzero(bodies.frame != WORLD))
        self._made: dict[int, tuple[CoalShape, Array]] = {}
        self._request = self._coal.DistanceRequest()
        self._request.gjk_tolerance = _COAL_TOLERANCE
        self._request.gjk_max_iterations = _COAL_ITERATIONS

    def distance(self, frames: Array, first: int, other: int) -> tuple[float, Array]:
        """Measure two shapes.

        Args:
            frames: (j + 2, 3, 4) where their frames are, as `frames_at` gives them.
            first, other: bodies of the table; no bundles.

        Returns:
            The clearance, negative for a penetration, and NaN where Coal has no answer [m]; and the points (2, 3) that are
            nearest, or penetrate deepest.
        """
        a, b = self._placed(frames, first), self._placed(frames, other)
        distance, points = self._between(a, b, np.zeros(3))
        if np.isfinite(points).all():
            return distance, points
        away = a[1][:, 3] - b[1][:, 3]
        away = away / np.linalg.norm(away) if away.any() else np.array([0.0, 0.0, 1.0])
        for aside in _ASIDE:
            _, points = self._between(a, b, aside * away)
            if np.isfinite(points).all():
                break
        return np.nan, points

    def _between(self, a: tuple[CoalShape, Array], b: tuple[CoalShape, Array], shift: Array) -> tuple[float, Array]:
        result = self._coal.DistanceResult()  # of its own: another thread may measure the same bodies
        (one, T), (other, U) = a, b
        at = self._coal.Transform3s(T[:, :3], T[:, 3] + shift), self._coal.Transform3s(U[:, :3], U[:, 3])
        distance = self._coal.distance(one, at[0], other, at[1], self._request, result)
        return float(distance), np.array([result.getNearestPoint1(), result.getNearestPoint2()])

    def _placed(self, frames: Array, body: int) -> tuple[CoalShape, Array]:
        """Return a shape, and its pose (3, 4) in the inertial frame."""
        if body not in self._made:
            self._made[body] = self._shape(body)
        shape, T = self._made[body]
        frame = int(self._bodies.frame[body])
        return shape, T[:3] if frame == WORLD else frames[frame] @ T

    def _shape(self, body: int) -> tuple[CoalShape, Array]:
        """Return a shape, and its pose (4, 4) in the frame of its body."""
        if self._bodies.frame[body] != WORLD:
            return coal_shape(self._robot.shapes[int(self._bodies.shape[body])].shape)
        if body - self._first < len(self._parts):
            return _coal_part(self._parts[body - self._first])
        ball = int(self._bodies.first_point[body])
        return coal_shape(Sphere(self._bodies.vertices[ball], float(self._bodies.radius[body])))


def coal_shape(shape: ConvexShape) -> tuple[CoalShape, Array]:
    """Return Coal's shape of a convex shape, and its pose (4, 4) in the frame of the shape's numbers."""
    core = core_of(shape)
    if core.kind == "box":
        return coal_box(core.half, core.radius), core.T
    if core.kind == "cylinder":
        return coal_cylinder(float(core.half[0]), float(core.half[2]), core.radius), core.T
    if core.kind == "polytope":
        return coal_polytope(core.vertices, core.radius), core.T
    if core.kind == "point":
        return coal().Sphere(core.radius), core.T
    length = 2 * float(core.half[2])
    if length >= _SHORT:
        return coal().Capsule(core.radius, length), core.T
    return coal_polytope(np.outer([-core.half[2], core.half[2]], [0.0, 0.0, 1.0]), core.radius), core.T


def _parts(scene: Scene) -> list[ConvexShape | HalfSpace]:
    """Return the convex parts of a scene in the order of its table; without balls, which come after them."""
    out: list[ConvexShape | HalfSpace] = []
    for item in scene.obstacles:
        if isinstance(item, PolytopeSet):
            out += item.pieces
        elif not isinstance(item, (Sphere, SphereSet)):
            out.append(item)
    return out


def _coal_part(part: ConvexShape | HalfSpace) -> tuple[CoalShape, Array]:
    if not isinstance(part, HalfSpace):
        return coal_shape(part)
    return coal().Halfspace(part.normal, float(part.normal @ part.point)), np.eye(4)
