"""Kinematics, momentum and distances by Pinocchio and Coal, apart from the search and its kernel.

Neither library has type stubs. The protocols below describe the parts of them that a proof uses.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from importlib import import_module
from typing import Protocol, cast

import numpy as np
from numpy.typing import NDArray

from spacearm.core.identity_cache import cached_by_identity
from spacearm.proof.bodies import Balls, Bodies, Boxes, Cylinders, Solids, axes_along
from spacearm.robot import Robot

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

_COAL_TOLERANCE = 1e-9  # [m] with Coal's default 1e-6 its distance of a capsule and a cylinder can be 0.34 mm too large
_COAL_ITERATIONS = 256  # of GJK, at most: twice the default, for the tolerance is a thousandth of the default


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


class CoalLibrary(Protocol):
    """The functions of Coal that a proof calls."""

    __version__: str
    DistanceRequest: Callable[[], CoalRequest]
    DistanceResult: Callable[[], CoalResult]
    Transform3s: Callable[[Array, Array], object]
    Sphere: Callable[[float], object]
    Capsule: Callable[[float, float], object]
    Cylinder: Callable[[float, float], object]
    Box: Callable[[float, float, float], object]
    Halfspace: Callable[[Array, float], object]
    distance: Callable[[object, object, object, object, CoalRequest, CoalResult], float]


class Witness:
    """Kinematics by Pinocchio and distances by Coal, built from the robot's and the scene's own numbers.

    Attributes:
        name: the libraries and their versions.
    """

    def __init__(self, robot: Robot, bodies: Bodies) -> None:
        self._pinocchio, self._coal = pinocchio(), cast(CoalLibrary, import_module("coal"))
        self.name = f"pinocchio {self._pinocchio.__version__}, coal {self._coal.__version__}"
        self._bodies = bodies
        self._model, ids = _fixed_base_model(robot)
        self._order = np.argsort([self._model.joints[i].idx_q for i in ids])
        self._data = self._model.createData()
        self._placed = [self._data.oMi[i] for i in ids]  # views: they change with the data
        self._capsules: dict[int, tuple[object, Array, Array]] = {}
        self._solids: dict[tuple[int, int], tuple[object, object]] = {}
        self._request, self._result = self._coal.DistanceRequest(), self._coal.DistanceResult()
        self._request.gjk_tolerance = _COAL_TOLERANCE
        self._request.gjk_max_iterations = _COAL_ITERATIONS

    def frames(self, values: Array) -> Array:
        """Return T_base_joint (r, j + 1, 4, 4) at joint values (r, j); the last is the base itself."""
        out = np.empty((len(values), len(self._placed) + 1, 4, 4))
        out[:, -1] = np.eye(4)
        forward, model, data = self._pinocchio.forwardKinematics, self._model, self._data
        for row, into in zip(values[:, self._order], out, strict=True):
            forward(model, data, row)
            into[:-1] = [T.homogeneous for T in self._placed]
        return out

    def distance(self, frames: Array, capsule: int, solids: Solids, k: int) -> tuple[float, Array]:
        """Measure one capsule against one solid.

        Args:
            frames: (j + 1, 4, 4) T_w_joint, or T_base_joint as `frames` gives them.
            capsule: index in the robot.
            solids, k: the solid.

        Returns:
            The clearance [m], negative for a penetration, and the direction (3,) from the solid to the capsule.
        """
        return self._measured(self._capsule(frames, capsule), self._solid(solids, k))

    def distance_between(self, frames: Array, capsule: int, other: int) -> tuple[float, Array]:
        """Measure one capsule against another one; see `distance`."""
        return self._measured(self._capsule(frames, capsule), self._capsule(frames, other))

    def nearest_points(self) -> Array:
        """Return the points (2, 3) [m] of the pair measured last that are nearest, or penetrate deepest."""
        return np.array([self._result.getNearestPoint1(), self._result.getNearestPoint2()])

    def _measured(self, one: tuple[object, object], other: tuple[object, object]) -> tuple[float, Array]:
        self._result.clear()
        distance = self._coal.distance(*one, *other, self._request, self._result)
        return float(distance), -np.array(self._result.normal)

    def _capsule(self, frames: Array, capsule: int) -> tuple[object, object]:
        if capsule not in self._capsules:
            ends, radius = self._bodies.ends[capsule], float(self._bodies.radius[capsule])
            along = ends[-1] - ends[0]
            shape = self._coal.Capsule(radius, float(np.linalg.norm(along))) if along.any() else self._coal.Sphere(radius)
            self._capsules[capsule] = shape, axes_along(along), ends.mean(axis=0)
        shape, axes, center = self._capsules[capsule]
        T = frames[self._bodies.joint[capsule]]
        return shape, self._coal.Transform3s(T[:3, :3] @ axes, T[:3, :3] @ center + T[:3, 3])

    def _solid(self, solids: Solids, k: int) -> tuple[object, object]:
        key = id(solids), k
        if key not in self._solids:
            axes, origin = solids.placed(np.array([k]))
            T = self._coal.Transform3s(np.eye(3) if axes is None else axes[0], origin[0])
            self._solids[key] = self._shape(solids, k), T
        return self._solids[key]

    def _shape(self, solids: Solids, k: int) -> object:
        radius = float(solids.radius[k])
        if isinstance(solids, Balls):
            return self._coal.Sphere(radius)
        if isinstance(solids, Cylinders):
            return self._coal.Cylinder(float(solids.round[k]), 2 * float(solids.half[k]))
        if isinstance(solids, Boxes):
            x, y, z = (2 * solids.half[k]).tolist()
            return self._coal.Capsule(radius, z) if radius else self._coal.Box(x, y, z)
        return self._coal.Halfspace(np.array([0.0, 0.0, 1.0]), 0.0)
