"""The masses of a robot that floats, checked, as arrays and as a model of Pinocchio's whose base is free."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spacearm.errors import RobotError
from spacearm.proof.kept import kept
from spacearm.robot import Robot
from spacearm.robot.left_out import require_all_masses

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

_LARGEST = 1e12  # [kg, m, kg m^2]
_NEGATIVE = 1e-9  # share of an inertia's greatest moment by which the least may be below 0: a file's last digit


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Masses:
    """The b bodies of a robot with j joints.

    Attributes:
        joint: (b,) each rides on, -1 for the base.
        mass: (b,) [kg].
        com: (b, 3) in the joint's frame [m].
        inertia: (b, 3, 3) about it, there [kg m^2].
        greatest, spread: (b,) its greatest moment, and by how much that exceeds the least [kg m^2].
        beyond: (j, b) 1 if a joint moves a body, else 0.
        base_least: the least moment of all that is bolted to the base, about its own centre of mass [kg m^2], above 0.
    """

    joint: Indices
    mass: Array
    com: Array
    inertia: Array
    greatest: Array
    spread: Array
    beyond: Array
    base_least: float

    @property
    def total(self) -> float:
        """[kg]."""
        return float(self.mass.sum())


@kept
def masses_of(robot: Robot) -> Masses:
    """Return a robot's masses.

    Raises:
        RobotError: links whose mass is not known; without mass or inertia of the base no momentum can be conserved, nor with
            an inertia that no body has.
    """
    joint = np.array([body.joint for body in robot.bodies], dtype=np.intp)
    mass = np.array([body.mass for body in robot.bodies])
    com = np.array([body.com for body in robot.bodies]).reshape(-1, 3)
    inertia = np.array([body.inertia for body in robot.bodies]).reshape(-1, 3, 3)
    largest = max(float(np.abs(array).max(initial=0.0)) for array in (mass, com, inertia))
    if largest > _LARGEST:
        raise RobotError(
            f"robot '{robot.name}' has a mass or an inertia with a number of {largest:.4g}, expected at most {_LARGEST:g}; "
            "check the units"
        )
    base = joint < 0
    if not mass[base].sum() > 0:
        raise RobotError(
            f"robot '{robot.name}' floats, and its base has no mass; give it one, or plan with base='fixed' "
            "('spacearm doctor' tells what is missing)"
        )
    moments = np.linalg.eigvalsh(inertia)
    for body, (least, _, greatest) in zip(robot.bodies, moments, strict=True):
        if least < -_NEGATIVE * greatest:
            raise RobotError(
                f"body '{body.name}' of robot '{robot.name}' has a moment of inertia of {least:.4g} kg m^2, expected none "
                "below 0; 'spacearm doctor' tells more"
            )
    middle = mass[base] @ com[base] / mass[base].sum()
    base_least = float(np.linalg.eigvalsh(inertia[base].sum(axis=0) + _points(mass[base], com[base] - middle))[0])
    if not base_least > 0:
        raise RobotError(
            f"the base of robot '{robot.name}' has a moment of inertia of {base_least:.4g} kg m^2, expected all above 0; "
            "'spacearm doctor' tells more"
        )
    require_all_masses(robot)
    beyond = np.zeros((len(robot.joints), len(mass)))
    for b, on in enumerate(joint.tolist()):
        while on >= 0:
            beyond[on, b] = 1.0
            on = robot.joints[on].parent
    return Masses(
        joint=joint,
        mass=mass,
        com=com,
        inertia=inertia,
        greatest=np.maximum(moments[:, 2], 0.0),
        spread=moments[:, 2] - moments[:, 0],
        beyond=beyond,
        base_least=base_least,
    )


@kept
def free_model(robot: Robot) -> tuple[Any, Indices, Indices]:
    """Return Pinocchio's model with a free base and all masses, and where the robot's joints are in its q and v."""
    import pinocchio  # pyright: ignore[reportMissingImports]

    model = pinocchio.Model()
    base = model.addJoint(0, pinocchio.JointModelFreeFlyer(), pinocchio.SE3.Identity(), "the base, free")
    kinds = {"revolute": pinocchio.JointModelRZ, "prismatic": pinocchio.JointModelPZ}
    ids: list[int] = []
    for joint in robot.joints:
        parent = ids[joint.parent] if joint.parent >= 0 else base
        ids.append(model.addJoint(parent, kinds[joint.kind](), pinocchio.SE3(np.array(joint.T_parent_joint)), joint.name))
    for body in robot.bodies:
        inertia = pinocchio.Inertia(body.mass, np.array(body.com), np.array(body.inertia))
        model.appendBodyToJoint(ids[body.joint] if body.joint >= 0 else base, inertia, pinocchio.SE3.Identity())
    at_q = np.array([model.joints[i].idx_q for i in ids], dtype=np.intp)
    return model, at_q, np.array([model.joints[i].idx_v for i in ids], dtype=np.intp)


def _points(mass: Array, at: Array) -> Array:
    """Return the inertia (3, 3) of points of mass (b,) at (b, 3) about the origin."""
    squared = np.einsum("b,bc,bc->", mass, at, at)
    return squared * np.eye(3) - np.einsum("b,bc,bd->cd", mass, at, at)
