"""Robots on a free joint in MuJoCo, without gravity or contact, their joints given accelerations by inverse dynamics."""

from __future__ import annotations

from collections.abc import Callable

import mujoco
import numpy as np

from spacearm.robot import Robot

Accelerations = Callable[[float], np.ndarray]


def floating_model(robot: Robot, timestep: float) -> mujoco.MjModel:
    """The model; each joint of the robot has a degree of freedom of its own."""
    assert len(robot.joints) == robot.dof, "joints that follow others are not converted"
    spec = mujoco.MjSpec()
    spec.option.gravity = np.zeros(3)
    spec.option.timestep = timestep
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_RK4
    spec.option.disableflags = mujoco.mjtDisableBit.mjDSBL_CONTACT | mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
    base = spec.worldbody.add_body(name="base")
    base.add_freejoint()
    _add_masses(base, robot, -1)
    made = []
    for i, joint in enumerate(robot.joints):
        quaternion = np.zeros(4)
        mujoco.mju_mat2Quat(quaternion, np.ascontiguousarray(joint.T_parent_joint[:3, :3]).ravel())
        parent = base if joint.parent < 0 else made[joint.parent]
        child = parent.add_body(name=f"moved by {joint.name}", pos=joint.T_parent_joint[:3, 3], quat=quaternion)
        kind = mujoco.mjtJoint.mjJNT_HINGE if joint.kind == "revolute" else mujoco.mjtJoint.mjJNT_SLIDE
        child.add_joint(name=joint.name, type=kind, axis=[0, 0, 1])
        _add_masses(child, robot, i)
        made.append(child)
    return spec.compile()


def _add_masses(body: mujoco.MjsBody, robot: Robot, joint: int) -> None:
    """Put the bodies on a joint into one: MuJoCo's bodies have one inertia each."""
    parts = [part for part in robot.bodies if part.joint == joint]
    mass = sum(part.mass for part in parts)
    assert mass > 0, "MuJoCo moves no massless bodies"
    com = sum(part.mass * part.com for part in parts) / mass
    inertia = np.zeros((3, 3))
    for part in parts:
        r = part.com - com
        inertia += part.inertia + part.mass * (r @ r * np.eye(3) - np.outer(r, r))
    body.explicitinertial = True
    body.mass, body.ipos = mass, com
    body.fullinertia = inertia[(0, 1, 2, 0, 0, 1), (0, 1, 2, 1, 2, 2)]


def run(
    robot: Robot,
    model: mujoco.MjModel,
    start: np.ndarray,
    start_velocity: np.ndarray,
    accelerations: Accelerations,
    steps: int,
) -> tuple[np.ndarray, np.ndarray]:
    """Integrate with prescribed joint accelerations and no force on the base; return qpos (7 + n,) and qvel (6 + n,).

    Args:
        robot, model: of `floating_model`.
        start: (7 + n,) base position, attitude wxyz, joints.
        start_velocity: (6 + n,) base velocity in world axes, its rate in base axes, joints.
        accelerations: of the joints at a time (n,).
        steps: of the model's timestep.
    """
    state = mujoco.MjData(model)
    # MuJoCo numbers joints branch by branch.
    joints = np.array([model.joint(joint.name).dofadr[0] - 6 for joint in robot.joints])
    state.qpos[:7], state.qpos[7 + joints] = start[:7], start[7:]
    state.qvel[:6], state.qvel[6 + joints] = start_velocity[:6], start_velocity[6:]
    mass, units = np.zeros((model.nv, model.nv)), np.eye(model.nv)

    def drive(model: mujoco.MjModel, at: mujoco.MjData) -> None:
        for row, unit in zip(mass, units, strict=True):
            mujoco.mj_mulM(model, at, row, unit)
        wanted = np.empty(len(joints))
        wanted[joints] = accelerations(at.time)
        free = -np.linalg.solve(mass[:6, :6], at.qfrc_bias[:6] + mass[:6, 6:] @ wanted)
        at.qfrc_applied[6:] = mass[6:, :6] @ free + mass[6:, 6:] @ wanted + at.qfrc_bias[6:]

    mujoco.set_mjcb_control(drive)
    try:
        for _ in range(steps):
            mujoco.mj_step(model, state)
    finally:
        mujoco.set_mjcb_control(None)
    return np.append(state.qpos[:7], state.qpos[7 + joints]), np.append(state.qvel[:6], state.qvel[6 + joints])
