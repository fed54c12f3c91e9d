"""The 7-joint servicer arm on a free-floating base of ORACLES.md B1, typed in by itself, and the numbers known of it.

From the trajectory_planning project of lirun-sat; the final attitudes and end effector positions are those of an independent
program (RK4, 2000 steps).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from spacearm.robot import Body, Frame, Joint, Robot

ROLL_PITCH_YAW = np.array(
    [
        [0, 0, np.pi / 2],
        [-np.pi / 2, np.pi / 2, 0],
        [np.pi / 2, 0, np.pi],
        [-np.pi / 2, 0, 0],
        [np.pi / 2, 0, np.pi],
        [np.pi / 2, 0, 0],
        [-np.pi / 2, 0, 0],
    ]
)
BASE = (1474.1, (17388.34, 1340.43, 17981.26))
FIRST_JOINT = (0.0, 0.0, 1.0864)
_ELBOW = (13.427, (0, 0.018673, 0.08), (0, 0.081327, 0), (0.043493, 0.031896, 0.029035), 0.0)
LINKS = (  # mass, joint to centre of mass, centre of mass to next joint, moments of inertia, Iyz
    (39.618, (0, 0.013631, 0.13304), (0, 0.136369, 0.05696), (0.30554, 0.25403, 0.15563), 0.030757),
    _ELBOW,
    (22.757, (0, 0.011017, 0.8422), (0, 0.088983, 0.2378), (2.69, 2.68, 0.06), 0.0),
    _ELBOW,
    (42.614, (0, 0.11343, 1.1109), (0, -0.03343, 0.1491), (1.75, 1.47, 0.33), 0.29),
    _ELBOW,
    (8.269, (0, 0, 0.10565), (0, 0, 0.16435), (0.04, 0.04, 0.01), 0.0),
)
RATE, ACCELERATION = 0.0873, 0.00873
AT_ZERO = (-0.381849443981743, 0.568500546238447, 1.157380648460746)  # the end effector from the system's centre of mass
ROWS = (  # final joints, duration, attitude wxyz at the end, its angle [deg], end effector from the system's centre of mass
    (
        (0.890033, 0.28735, 2.78844, 2.90451, 1.05669, 1.85941, 1.0428),
        62.38209,
        (0.9999790, -0.0010796, 0.0063876, 0.0001211),
        0.7425,
        (1.477771, -1.409764, 2.227247),
    ),
    (
        (1.11508, 0.304819, -0.678856, 3.23913, 1.23781, -2.07818, -2.15025),
        69.56894,
        (0.9998846, 0.0076675, -0.0064234, -0.0114343),
        1.7409,
        (1.524387, -1.343673, 2.271245),
    ),
)


def servicer(base_scale: float = 1.0) -> Robot:
    """The robot; mass and inertia of its base times a factor."""
    joints, bodies, reach = [], [], np.array(FIRST_JOINT)
    bodies.append(_body("base", -1, BASE[0] * base_scale, (0, 0, 0), np.diag(BASE[1]) * base_scale))
    for i, (mass, to_com, to_next, moments, yz) in enumerate(LINKS):
        T = np.eye(4)
        T[:3, :3], T[:3, 3] = _rotation(*ROLL_PITCH_YAW[i]), reach
        joints.append(Joint(name=f"joint{i + 1}", kind="revolute", parent=i - 1, T_parent_joint=T))
        inertia = np.diag(moments)
        inertia[1, 2] = inertia[2, 1] = yz
        bodies.append(_body(f"link{i + 1}", i, mass, to_com, inertia))
        reach = np.array(to_com) + to_next
    tip = np.eye(4)
    tip[:3, 3] = reach
    return Robot(
        name="servicer of the oracles",
        joints=tuple(joints),
        frames=(Frame(name="tip", joint=6, T_joint_frame=tip),),
        tip="tip",
        lower=np.radians([-360, 0, -360, -360, -360, -120, -360]),
        upper=np.radians([360, 180, 360, 360, 360, 120, 360]),
        velocity=np.full(7, RATE),
        acceleration=np.full(7, ACCELERATION),
        base="floating",
        bodies=tuple(bodies),
    )


def _body(name: str, joint: int, mass: float, com: Any, inertia: np.ndarray) -> Body:
    return Body(name=name, joint=joint, mass=mass, com=np.array(com, dtype=float), inertia=inertia.astype(float))


def _rotation(roll: float, pitch: float, yaw: float) -> np.ndarray:
    (cr, cp, cy), (sr, sp, sy) = np.cos([roll, pitch, yaw]), np.sin([roll, pitch, yaw])
    about_x = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    about_y = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    about_z = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
    return about_z @ about_y @ about_x
