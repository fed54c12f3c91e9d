"""A robot's joints as the proof knows them: their values, which of them carries which, and Pinocchio's models of the robot.

The kinematics and the momentum of a proof are Pinocchio's, apart from the search and its kernel. It has no type stubs: the
protocols below describe the parts of it that a proof uses.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from importlib import import_module
from typing import Protocol, cast

import numpy as np
from numpy.typing import NDArray

from spacearm.core.identity_cache import cached_by_identity, cached_in_thread
from spacearm.robot import Robot

Array = NDArray[np.float64]
Indices = NDArray[np.intp]


class JointMap:
    """The map from the robot's n degrees of freedom to the values of its j joints, mimic joints included.

    Attributes:
        dof: (j,) which degree of freedom a joint follows.
        multiplier, offset: (j,) its value is multiplier times that, plus offset [rad or m].
        revolute: (j,) whether it is revolute; the others are prismatic.
    """

    def __init__(self, robot: Robot) -> None:
        self.dof = np.array([joint.dof for joint in robot.joints])
        self.multiplier = np.array([joint.multiplier for joint in robot.joints])
        self.offset = np.array([joint.offset for joint in robot.joints])
        self.revolute = np.array([joint.kind == "revolute" for joint in robot.joints])

    def values(self, q: Array) -> Array:
        """Return the joints' values (r, j) at configurations (r, n)."""
        return q[:, self.dof] * self.multiplier + self.offset


@cached_by_identity
def joints_of(robot: Robot) -> JointMap:
    """Return the map from a robot's degrees of freedom to its joints."""
    return JointMap(robot)


def chain(robot: Robot, joint: int) -> list[int]:
    """Return the joints from the base to a joint, this one included; none for the base and the world."""
    out: list[int] = []
    while joint >= 0:
        out.append(joint)
        joint = robot.joints[joint].parent
    return out[::-1]


def ancestors(robot: Robot) -> NDArray[np.bool_]:
    """Return [k, i] of (j, j): whether joint i is between joint k and the base."""
    out = np.zeros((len(robot.joints),) * 2, dtype=bool)
    for k, joint in enumerate(robot.joints):
        out[k, chain(robot, joint.parent)] = True
    return out


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
