"""Robots that float, and where they get to, by brute force: the equations of momentum and many small steps."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from hypothesis import strategies as st

from spacearm.dynamics import Momentum
from spacearm.geometry import Scene
from spacearm.motion import AnyTrajectory, Curve
from spacearm.robot import Body, Frame, Joint, LinkCapsule, Robot
from support.dense_samples import arms, moving_frames


class Adrift(NamedTuple):
    """What a proof is asked about."""

    robot: Robot
    scene: Scene
    base: str = "floating"
    base_start: Any = None
    momentum: Momentum | None = None
    clearance: float = 0.0


# ---- robots ----------------------------------------------------------------------------------------------------------


def body(name: str, joint: int, mass: float, com: Any, moments: Any) -> Body:
    return Body(name=name, joint=joint, mass=mass, com=np.array(com, dtype=float), inertia=np.diag(np.broadcast_to(moments, 3)))


def line(name: str, joint: int, a: Any, b: Any, radius: float) -> LinkCapsule:
    return LinkCapsule(name=name, joint=joint, a=np.array(a, dtype=float), b=np.array(b, dtype=float), radius=radius)


def lander(*, mass: float = 20.0, moment: float = 2.0, **changes: Any) -> Robot:
    """Two links of 1 m in the plane, 5 kg each, on a base with a panel of 2 m that points the other way."""
    shift = np.eye(4)
    shift[0, 3] = 1.0
    given: dict[str, Any] = {
        "name": "lander",
        "joints": (
            Joint(name="shoulder", kind="revolute", parent=-1, T_parent_joint=np.eye(4)),
            Joint(name="elbow", kind="revolute", parent=0, T_parent_joint=shift),
        ),
        "bodies": (
            body("base", -1, mass, (0, 0, 0), moment),
            body("upper", 0, 5.0, (0.5, 0, 0), (0.01, 0.42, 0.42)),
            body("fore", 1, 5.0, (0.5, 0, 0), (0.01, 0.42, 0.42)),
        ),
        "capsules": (
            line("panel", -1, (-0.2, 0, 0), (-2.2, 0, 0), 0.02),
            line("upper", 0, (0.2, 0, 0), (1, 0, 0), 0.05),
            line("fore", 1, (0, 0, 0), (1, 0, 0), 0.05),
        ),
        "frames": (Frame(name="base", joint=-1, T_joint_frame=np.eye(4)), Frame(name="hand", joint=1, T_joint_frame=shift)),
        "tip": "hand",
        "base": "floating",
        **{name: (value, value) for name, value in (("lower", -4.0), ("upper", 4.0), ("velocity", 1.0), ("acceleration", 1.0))},
    }
    return Robot(**{**given, **changes})


def wheel(moment: float = 1.0, **changes: Any) -> Robot:
    """A base with a panel of 1 m, and a flywheel in its middle: the base turns back by a share of the wheel's turn."""
    given: dict[str, Any] = {
        "joints": (Joint(name="wheel", kind="revolute", parent=-1, T_parent_joint=np.eye(4)),),
        "bodies": (body("base", -1, 10.0, (0, 0, 0), 3.0), body("wheel", 0, 1.0, (0, 0, 0), moment)),
        "capsules": (line("panel", -1, (1, 0, 0), (1, 0, 0), 0.05),),
        "frames": lander().frames[:1],
        "tip": "base",
        "lower": (-10.0,),
        **dict.fromkeys(("upper", "velocity", "acceleration"), (10.0,)),
    }
    return lander(**{**given, **changes})


@st.composite
def floating_arms(draw: st.DrawFn) -> Robot:
    """Drawn trees with slides, mimics and branches, a mass on most joints, and a base that may be light."""
    robot = draw(arms(self_pairs=True))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    mass = draw(st.sampled_from([1.0, 30.0, 1e4]))
    bodies = [Body(name="base", joint=-1, mass=mass, com=rng.normal(size=3), inertia=_inertia(rng))]
    for i in range(len(robot.joints)):
        if draw(st.integers(0, 3)):
            com, mass = rng.normal(size=3) / 2, rng.uniform(0.1, 5)
            bodies.append(Body(name=f"b{i}", joint=i, mass=mass, com=com, inertia=_inertia(rng)))
        else:  # said to weigh nothing, not forgotten
            bodies.append(Body(name=f"b{i}", joint=i, mass=0.0, com=np.zeros(3), inertia=np.zeros((3, 3))))
    return replace(robot, bodies=tuple(bodies), base="floating")


def _inertia(rng: np.random.Generator) -> np.ndarray:
    """Of some points of mass: what bodies have."""
    x = rng.normal(size=(3, 3)) * rng.uniform(0.3, 2, 3)
    spread = x @ x.T + 0.05 * np.eye(3)
    return np.trace(spread) * np.eye(3) - spread


# ---- brute force -----------------------------------------------------------------------------------------------------


def momentum_map(robot: Robot, q: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Centre of mass (rows, 3), H_w (rows, 3, 3) and H_q (rows, 3, n) about it, base axes: the sums of the oracles' B2."""
    frames = np.concatenate([moving_frames(robot, q), np.tile(np.eye(4), (len(q), 1, 1, 1))], axis=1)
    total = sum(link.mass for link in robot.bodies)
    com = [frames[:, b.joint, :3, :3] @ b.com + frames[:, b.joint, :3, 3] for b in robot.bodies]
    center = sum(b.mass * c for b, c in zip(robot.bodies, com, strict=True)) / total
    H_w, H_q = np.zeros((len(q), 3, 3)), np.zeros((len(q), 3, robot.dof))
    for b, c in zip(robot.bodies, com, strict=True):
        R = frames[:, b.joint, :3, :3]
        inertia, r = R @ b.inertia @ np.swapaxes(R, 1, 2), c - center
        squared = (r**2).sum(axis=1)[:, None, None] * np.eye(3)
        H_w += inertia + b.mass * (squared - r[:, :, None] * r[:, None, :])
        k = b.joint
        while k >= 0:
            joint = robot.joints[k]
            z = frames[:, k, :3, 2] * joint.multiplier
            turns = joint.kind == "revolute"
            speed = np.cross(z, c - frames[:, k, :3, 3]) if turns else z
            H_q[:, :, joint.dof] += b.mass * np.cross(r, speed)
            if turns:
                H_q[:, :, joint.dof] += (inertia @ z[..., None])[..., 0]
            k = joint.parent
    return np.asarray(center), H_w, H_q


class Way(NamedTuple):
    """Instants on the way: parameters (rows,) of the curve, the joints (rows, n), and T_w_b (rows, 4, 4)."""

    u: np.ndarray
    q: np.ndarray
    T_w_b: np.ndarray


def brute_force(setting: Adrift, curve: Curve, *, time_rate: float = 0.0, steps: int = 400) -> Way:
    """The base along a curve: Runge and Kutta's classical method on every piece, in so many steps each."""
    robot, momentum = setting.robot, setting.momentum or Momentum()
    start = np.eye(4) if setting.base_start is None else np.asarray(setting.base_start)
    R, us, Rs = start[:3, :3], [], []
    for low, high in curve.hulls(0, bisections=0)[0]:
        inside = np.linspace(low, high, 2 * steps + 1)
        inner = np.clip(inside, low + 1e-12 * (high - low), high - 1e-12 * (high - low))  # of this piece, not of its neighbour
        _, H_w, H_q = momentum_map(robot, curve.sample(inner))
        push = -np.linalg.solve(H_w, (H_q @ curve.sample(inner, 1)[..., None]))[..., 0]
        own = np.linalg.inv(H_w) * time_rate
        h = (high - low) / steps

        def rate(i: int, R: np.ndarray) -> np.ndarray:
            x, y, z = push[i] + own[i] @ R.T @ momentum.angular  # noqa: B023
            return R @ np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])

        us.append(inside[0])
        Rs.append(R)
        for i in range(steps):
            a = rate(2 * i, R)
            b = rate(2 * i + 1, R + h / 2 * a)
            c = rate(2 * i + 1, R + h / 2 * b)
            d = rate(2 * i + 2, R + h * c)
            R = R + h / 6 * (a + 2 * b + 2 * c + d)
            us.append(inside[2 * i + 2])
            Rs.append(R)
    u = np.array(us)
    left, _, right = np.linalg.svd(np.array(Rs))
    q = curve.sample(u)
    center, _, _ = momentum_map(robot, q)
    total = sum(link.mass for link in robot.bodies)
    begin = start[:3, :3] @ center[0] + start[:3, 3]
    T = np.tile(np.eye(4), (len(u), 1, 1))
    T[:, :3, :3] = left @ right
    at = begin + np.outer((u - u[0]) * time_rate / total, momentum.linear)
    T[:, :3, 3] = at - (T[:, :3, :3] @ center[..., None])[..., 0]
    return Way(u, q, T)


def frames_of(robot: Robot, q: np.ndarray, T_w_b: np.ndarray) -> np.ndarray:
    """T_w_joint (rows, joints + 1, 4, 4); the last is the base."""
    frames = np.concatenate([moving_frames(robot, q), np.tile(np.eye(4), (len(q), 1, 1, 1))], axis=1)
    return T_w_b[:, None] @ frames


def along(setting: Adrift, trajectory: AnyTrajectory, *, steps: int = 200) -> Way:
    """A trajectory's way, by brute force over its own curve or, with a momentum, over time."""
    if setting.momentum is None:
        return brute_force(setting, trajectory.curve, steps=steps)
    return brute_force(setting, trajectory.path, time_rate=1.0, steps=steps)
