"""Robots on a floating base in Pinocchio: a free-flyer joint with the bodies' own numbers, and the momentum of the whole."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from spacearm.robot import Robot
from support.oracles.pinocchio_model import full_q


def floating_model(robot: Robot) -> pin.Model:
    """A free-flyer, then one Pinocchio joint per Joint, each body by itself."""
    model = pin.Model()
    ids = [model.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3.Identity(), "base")]
    for joint in robot.joints:
        kind = pin.JointModelRZ() if joint.kind == "revolute" else pin.JointModelPZ()
        ids.append(model.addJoint(ids[1 + joint.parent], kind, pin.SE3(np.array(joint.T_parent_joint)), joint.name))
    for body in robot.bodies:
        inertia = pin.Inertia(body.mass, np.array(body.com), np.array(body.inertia))
        model.appendBodyToJoint(ids[1 + body.joint], inertia, pin.SE3.Identity())
    return model


def floating_q(robot: Robot, position: np.ndarray, attitude_wxyz: np.ndarray, q: np.ndarray) -> np.ndarray:
    """The model's configuration, whose quaternion is xyzw."""
    return np.concatenate([position, np.roll(attitude_wxyz, -1), full_q(robot, q)])


def floating_v(
    robot: Robot, attitude_wxyz: np.ndarray, velocity_w: np.ndarray, omega_b: np.ndarray, dq: np.ndarray
) -> np.ndarray:
    """The model's velocity: the base's in base axes, then the joints' as their multipliers have it."""
    R = pin.Quaternion(np.roll(attitude_wxyz, -1)).toRotationMatrix()
    rates = np.array([joint.multiplier * dq[joint.dof] for joint in robot.joints])
    return np.concatenate([R.T @ velocity_w, omega_b, rates])


def momentum(model: pin.Model, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, float, float]:
    """The total momentum (6,) about the system's centre of mass, linear first, in world axes; and the greatest of any link's
    linear and angular momentum about that centre, by which residuals are judged."""
    data = model.createData()
    total = pin.computeCentroidalMomentum(model, data, q, v).vector.copy()
    center = pin.centerOfMass(model, data, q, v).copy()
    linear, angular = 0.0, 0.0
    for i in range(1, model.njoints):
        own = data.oMi[i].act(model.inertias[i] * data.v[i])
        linear = max(linear, float(np.linalg.norm(own.linear)))
        angular = max(angular, float(np.linalg.norm(own.angular - np.cross(center, own.linear))))
    return total, linear, angular


def free_rate(model: pin.Model, q: np.ndarray, joint_rates: np.ndarray, angular: np.ndarray) -> np.ndarray:
    """The base's rate (3,) in base axes, in which the angular momentum about the system's centre of mass is `angular`,
    by Pinocchio's centroidal map and without linear momentum."""
    data = model.createData()
    A = pin.computeCentroidalMap(model, data, q)
    base = np.linalg.solve(A[:, :6], np.concatenate([np.zeros(3), angular]) - A[:, 6:] @ joint_rates)
    return base[3:]
