"""Drawn spacecraft: trees of turning and sliding joints, joints that follow others, bodies with inertias that can be."""

from __future__ import annotations

import numpy as np

from spacearm.motion import Motion
from spacearm.robot import Body, Frame, Joint, Robot


def spacecraft(seed: int, *, plain: bool = False) -> Robot:
    """A robot of 2 to 8 joints on a base of 20 to 500 kg; unless plain, some joints follow others and some move no mass."""
    rng = np.random.default_rng(seed)
    count = int(rng.integers(2, 9))
    joints = []
    for i in range(count):
        follows = not plain and i > 0 and rng.random() < 0.2
        joints.append(
            Joint(
                name=f"joint{i}",
                kind="revolute" if rng.random() < 0.7 else "prismatic",
                parent=int(rng.integers(max(-1, i - 3), i)),
                T_parent_joint=transform(rng),
                dof=0 if follows else -1,
                multiplier=float(rng.uniform(-2, 2)) if follows else 1.0,
                offset=float(rng.uniform(-1, 1)) if follows else 0.0,
            )
        )
    bodies = [body(rng, "base", -1, float(rng.uniform(20, 500)), 0.8)]
    for i in range(count):
        for k in range(int(rng.choice([int(plain), 1, 1, 1, 2])) if i < count - 1 else 1):
            bodies.append(body(rng, f"link{i}.{k}", i, float(rng.uniform(0.5, 20)), 0.3))
    free = sum(joint.dof < 0 for joint in joints)
    return Robot(
        name=f"drawn{seed}",
        joints=tuple(joints),
        frames=(Frame(name="tip", joint=count - 1, T_joint_frame=transform(rng)),),
        tip="tip",
        lower=np.full(free, -4.0),
        upper=np.full(free, 4.0),
        velocity=np.full(free, 0.5),
        acceleration=np.full(free, 0.5),
        base="floating",
        bodies=tuple(bodies),
    )


def motion_of(robot: Robot, seed: int, *, interior: int = 2, size: float = 2.0) -> Motion:
    return Motion(np.random.default_rng(seed).uniform(-size, size, (interior + 2, robot.dof)))


def body(rng: np.random.Generator, name: str, joint: int, mass: float, size: float) -> Body:
    """A body of twenty points' masses: its inertia is one that can be."""
    points = rng.normal(size=(20, 3)) * size * rng.uniform(0.2, 1, 3)
    shares = rng.uniform(0.5, 1.5, 20)
    masses = mass * shares / shares.sum()
    com = masses @ points / mass
    r = points - com
    second = (r * masses[:, None]).T @ r
    return Body(name=name, joint=joint, mass=mass, com=com, inertia=np.trace(second) * np.eye(3) - second)


def transform(rng: np.random.Generator) -> np.ndarray:
    T = np.eye(4)
    Q, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    T[:3, :3] = Q * np.sign(np.linalg.det(Q))
    T[:3, 3] = rng.uniform(-0.5, 0.5, 3)
    return T
