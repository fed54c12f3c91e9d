"""Kinematics, momentum and distances by Pinocchio and Coal, apart from the search and its kernel.

Neither library has type stubs. The protocols below describe the parts of them that a proof uses.
"""

from __future__ import annotations

from collections.abc import Callable, MutableSequence, Sequence
from importlib import import_module
from itertools import product
from typing import TYPE_CHECKING, Protocol, cast

import numpy as np
from numpy.typing import NDArray

from spacearm.core.identity_cache import cached_by_identity, cached_in_thread
from spacearm.geometry import ConvexShape, HalfSpace, PolytopeSet, Scene, Sphere, SphereSet, core_of
from spacearm.geometry.convex_cores import axes_along
from spacearm.proof.bodies import Bodies
from spacearm.proof.convex_bodies import WORLD, ConvexBodies
from spacearm.proof.solids import Balls, Boxes, Cylinders, Polytopes, Solids
from spacearm.robot import Robot

if TYPE_CHECKING:
    from scipy.spatial import ConvexHull  # pyright: ignore[reportMissingTypeStubs]

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

_COAL_TOLERANCE = 1e-9  # [m] with Coal's default 1e-6 its distance of a capsule and a cylinder can be 0.34 mm too large
_COAL_ITERATIONS = 256  # of GJK, at most: twice the default, for the tolerance is a thousandth of the default
_SHORT = 0.01  # [m] of two capsules shorter than 3.5 mm Coal's closed form takes the axes for points
_ASIDE = (1e-6, 1e-5, 1e-4)  # [m] Coal has no answer for some cylinders that touch: it is asked with one of them moved aside
_THICKER = 1e-9  # times the size of a flat hull: how much thicker it is made to every side
_SMALLEST = 1e-3  # [m] in place of the size of a smaller flat hull


# ---- Pinocchio -------------------------------------------------------------------------------------------------------


class SpatialVector(Protocol):
    """A twist or a momentum."""

    linear: Array
    angular: Array
    vector: Array


class SpatialInertia(Protocol):
    """Mass, centre of mass and inertia of a body."""

    def __mul__(self, velocity: SpatialVector) -> SpatialVector:
        """Return the momentum."""
        ...

    def matrix(self) -> Array:
        """Return the matrix (6, 6) that maps a twist to the momentum."""
        ...


class Placement(Protocol):
    """A rigid transform."""

    homogeneous: Array

    def act(self, vector: SpatialVector) -> SpatialVector:
        """Return the vector in the outer frame."""
        ...


class PinocchioJoint(Protocol):
    """A joint of a model: where it stands in q and in v."""

    idx_q: int
    idx_v: int


class PinocchioData(Protocol):
    """What Pinocchio computed last."""

    oMi: Sequence[Placement]
    v: Sequence[SpatialVector]
    com: Sequence[Array]


class PinocchioModel(Protocol):
    """A tree of joints with masses."""

    joints: Sequence[PinocchioJoint]
    inertias: Sequence[SpatialInertia]
    nq: int
    nv: int
    njoints: int

    def createData(self) -> PinocchioData:
        """Return room for results."""
        ...

    def addJoint(self, parent: int, joint: object, placement: Placement, name: str, /) -> int:
        """Add a joint, and return its number."""
        ...

    def appendBodyToJoint(self, joint: int, inertia: SpatialInertia, placement: Placement, /) -> None:
        """Add a mass to what a joint carries."""
        ...


class QuaternionType(Protocol):
    """Pinocchio's quaternion xyzw."""

    def toRotationMatrix(self) -> Array:
        """Return the rotation (3, 3)."""
        ...


class PinocchioLibrary(Protocol):
    """The functions of Pinocchio that a proof calls."""

    __version__: str
    Model: Callable[[], PinocchioModel]
    SE3: Callable[[Array], Placement]
    Inertia: Callable[[float, Array, Array], SpatialInertia]
    Quaternion: Callable[[Array], QuaternionType]
    JointModelRZ: Callable[[], object]
    JointModelPZ: Callable[[], object]
    JointModelFreeFlyer: Callable[[], object]
    neutral: Callable[[PinocchioModel], Array]
    forwardKinematics: Callable[[PinocchioModel, PinocchioData, Array], None]
    computeCentroidalMap: Callable[[PinocchioModel, PinocchioData, Array], Array]
    computeCentroidalMomentum: Callable[[PinocchioModel, PinocchioData, Array, Array], SpatialVector]


def pinocchio() -> PinocchioLibrary:
    """Import Pinocchio."""
    return cast(PinocchioLibrary, import_module("pinocchio"))


def _with_joints(robot: Robot, model: PinocchioModel, base: int) -> list[int]:
    """Add a robot's joints to a model, those of the base at its joint `base`; return their numbers."""
    library = pinocchio()
    makers = {"revolute": library.JointModelRZ, "prismatic": library.JointModelPZ}
    ids: list[int] = []
    for joint in robot.joints:
        parent = ids[joint.parent] if joint.parent >= 0 else base
        ids.append(model.addJoint(parent, makers[joint.kind](), library.SE3(np.array(joint.T_parent_joint)), joint.name))
    return ids


@cached_by_identity
def _fixed_base_model(robot: Robot) -> tuple[PinocchioModel, list[int]]:
    """Return Pinocchio's model of a robot without masses, and the numbers of the robot's joints in it."""
    model = pinocchio().Model()
    return model, _with_joints(robot, model, 0)


class _Kinematics:
    """The kinematics of a robot on a fixed base, for one thread: Pinocchio's room for results."""

    def __init__(self, robot: Robot) -> None:
        self._forward = pinocchio().forwardKinematics
        self._model, ids = _fixed_base_model(robot)
        self._order = np.argsort([self._model.joints[i].idx_q for i in ids])
        self._data = self._model.createData()
        self._placed = [self._data.oMi[i] for i in ids]  # views: they change with the data

    def frames(self, values: Array) -> Array:
        """Return T_base_joint (r, j + 1, 4, 4) at joint values (r, j); the last is the base itself."""
        out = np.empty((len(values), len(self._placed) + 1, 4, 4))
        out[:, -1] = np.eye(4)
        forward, model, data = self._forward, self._model, self._data
        for row, into in zip(values[:, self._order], out, strict=True):
            forward(model, data, row)
            into[:-1] = [T.homogeneous for T in self._placed]
        return out


kinematics_of: Callable[[Robot], _Kinematics] = cached_in_thread(_Kinematics)
"""The kinematics of a robot, for the thread that asks."""


@cached_by_identity
def free_base_model(robot: Robot) -> tuple[PinocchioModel, Indices, Indices]:
    """Return Pinocchio's model with a free base and all masses, and where the robot's joints stand in its q and its v."""
    library = pinocchio()
    model, identity = library.Model(), library.SE3(np.eye(4))
    base = model.addJoint(0, library.JointModelFreeFlyer(), identity, "the base, free")
    ids = _with_joints(robot, model, base)
    for body in robot.bodies:
        inertia = library.Inertia(body.mass, np.array(body.com), np.array(body.inertia))
        model.appendBodyToJoint(ids[body.joint] if body.joint >= 0 else base, inertia, identity)
    at_q = np.array([model.joints[i].idx_q for i in ids], dtype=np.intp)
    return model, at_q, np.array([model.joints[i].idx_v for i in ids], dtype=np.intp)


@cached_in_thread
def free_base_data(robot: Robot) -> PinocchioData:
    """Return room for results of `free_base_model`, for the thread that asks; the next call of Pinocchio changes it."""
    return free_base_model(robot)[0].createData()


# ---- Coal ------------------------------------------------------------------------------------------------------------


class CoalRequest(Protocol):
    """How exact a distance has to be."""

    gjk_tolerance: float
    gjk_max_iterations: int


class CoalResult(Protocol):
    """The distance measured last."""

    normal: Array

    def clear(self) -> None:
        """Forget it."""
        ...

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
    for thicker in (0.0, _THICKER, 1e2 * _THICKER):
        try:
            return ConvexHull((vertices[:, None] + thicker * size * corners).reshape(-1, 3) if thicker else vertices)
        except QhullError:  # no volume, or less than rounding
            continue
    raise AssertionError("a hull with volume is refused")


def _rounded(shape: CoalShape, radius: float) -> CoalShape:
    if radius:
        shape.setSweptSphereRadius(radius)
    return shape


def _cached_polytope(of: Bodies | Polytopes, k: int, vertices: Array, radius: float) -> CoalShape:
    """Return `coal_polytope` of body or solid k; a hull of many vertices takes as long as some hundred distances."""
    made = _polytopes(of)
    if k not in made:
        made[k] = coal_polytope(vertices, radius)
    return made[k]


@cached_by_identity
def _polytopes(_: Bodies | Polytopes) -> dict[int, CoalShape]:
    """Return room for the polytopes of a robot or a scene."""
    return {}


def witness_name() -> str:
    """Return the libraries for kinematics and measured distances, with their versions."""
    return f"pinocchio {pinocchio().__version__}, coal {coal().__version__}"


class Witness:
    """Kinematics by Pinocchio and distances by Coal, built from the robot's and the scene's own numbers.

    Attributes:
        name: the libraries and their versions.
    """

    def __init__(self, robot: Robot, bodies: Bodies | None = None) -> None:
        self._coal = coal()
        self.name = f"pinocchio {pinocchio().__version__}, coal {self._coal.__version__}"
        self._bodies = cast(Bodies, bodies)
        self._robot = robot
        self._shapes: dict[int, tuple[CoalShape, Array, Array]] = {}
        self._solids: dict[tuple[int, int], tuple[CoalShape, object]] = {}
        self._request, self._result = self._coal.DistanceRequest(), self._coal.DistanceResult()
        self._request.gjk_tolerance = _COAL_TOLERANCE
        self._request.gjk_max_iterations = _COAL_ITERATIONS

    def frames(self, values: Array) -> Array:
        """Return T_base_joint (r, j + 1, 4, 4) at joint values (r, j); the last is the base itself."""
        return kinematics_of(self._robot).frames(values)

    def distance(self, frames: Array, body: int, solids: Solids, k: int) -> tuple[float, Array]:
        """Measure one of the robot's shapes against one solid.

        Args:
            frames: (j + 1, 4, 4) T_w_joint, or T_base_joint as `frames` gives them.
            body: index of the shape in the robot.
            solids, k: the solid.

        Returns:
            The clearance [m], negative for a penetration, and the direction (3,) from the solid to the shape.
        """
        return self._measured(self._placed_shape(frames, body), self._solid(solids, k))

    def distance_between(self, frames: Array, body: int, other: int) -> tuple[float, Array]:
        """Measure one of the robot's shapes against another one; see `distance`."""
        return self._measured(self._placed_shape(frames, body), self._placed_shape(frames, other))

    def nearest_points(self) -> Array:
        """Return the points (2, 3) [m] of the pair measured last that are nearest, or penetrate deepest."""
        return np.array([self._result.getNearestPoint1(), self._result.getNearestPoint2()])

    def _measured(self, one: tuple[object, object], other: tuple[object, object]) -> tuple[float, Array]:
        self._result.clear()
        distance = self._coal.distance(*one, *other, self._request, self._result)
        return float(distance), -np.array(self._result.normal)

    def _placed_shape(self, frames: Array, body: int) -> tuple[CoalShape, object]:
        if body not in self._shapes:
            self._shapes[body] = self._shape(body)
        shape, axes, center = self._shapes[body]
        T = frames[self._bodies.joint[body]]
        return shape, self._coal.Transform3s(T[:3, :3] @ axes, T[:3, :3] @ center + T[:3, 3])

    def _shape(self, body: int) -> tuple[CoalShape, Array, Array]:
        """Return one of the robot's shapes, with its axes and its centre in the frame of its joint."""
        core, radius = self._bodies.core(body), float(self._bodies.radius[body])
        if core is None:
            ends = self._bodies.ends(body)
            along = ends[-1] - ends[0]
            length = float(np.linalg.norm(along))
            shape = self._coal.Capsule(radius, length) if along.any() else self._coal.Sphere(radius)
            return shape, axes_along(along), ends.mean(axis=0)
        if core.kind == "box":
            shape = coal_box(core.half, radius)
        elif core.kind == "cylinder":
            shape = coal_cylinder(float(core.half[0]), float(core.half[2]), radius)
        else:
            shape = _cached_polytope(self._bodies, body, core.vertices, radius)
        return shape, core.T[:3, :3], core.T[:3, 3]

    def _solid(self, solids: Solids, k: int) -> tuple[CoalShape, object]:
        key = id(solids), k
        if key not in self._solids:
            axes, origin = solids.placed(np.array([k]))
            T = self._coal.Transform3s(np.eye(3) if axes is None else axes[0], origin[0])
            self._solids[key] = self._of_solid(solids, k), T
        return self._solids[key]

    def _of_solid(self, solids: Solids, k: int) -> CoalShape:
        radius = float(solids.radius[k])
        if isinstance(solids, Balls):
            return self._coal.Sphere(radius)
        if isinstance(solids, Cylinders):
            return coal_cylinder(float(solids.round[k]), float(solids.half[k]), radius)
        if isinstance(solids, Boxes):
            half = solids.half[k]
            return coal_box(half, radius) if half[0] else self._coal.Capsule(radius, 2 * float(half[2]))
        if isinstance(solids, Polytopes):
            return _cached_polytope(solids, k, solids.vertices[solids.core[k]], radius)
        return self._coal.Halfspace(np.array([0.0, 0.0, 1.0]), 0.0)


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
