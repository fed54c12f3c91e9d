"""Floating robots and their motions, drawn so that certificates may go wrong.

Robots with slides, mimics and branches, of all sizes, some lighter in the base than in the arm; splines, recorded tables with
rests and stairs, time laws, paths whose rates vanish in Gauss points, spacecraft that tumble. An obstacle is put where the arm
just passes it, or just does not, and limits of the base are drawn close to what the motion does.
"""

from __future__ import annotations

from math import comb
from typing import Any

import numpy as np

from spacearm.dynamics import Momentum
from spacearm.geometry import Capsule, HalfSpace, Scene, Sphere, pose
from spacearm.motion import AnyTrajectory, Motion, PiecewisePath, RecordedTrajectory, TimeLaw, Trajectory
from spacearm.planner import BaseLimits
from spacearm.robot import Body, Frame, Joint, LinkCapsule, Robot
from support.floating_checker import Array, Case, Motions, checked, distances, moving, speed_of, turned


def drawn_robot(rng: np.random.Generator) -> Robot:
    count, size = int(rng.integers(1, 8)), float(rng.choice([0.01, 1.0, 1.0, 1.0, 30.0]))
    heavy, light = float(rng.choice([0.01, 1.0, 1.0, 1e3])), float(rng.choice([0.2, 1.0, 10.0, 100.0]))
    joints: list[Joint] = []
    dofs = 0
    for i in range(count):
        parent = i - 1 if rng.random() < 0.85 else int(rng.integers(-1, i)) if i else -1
        follows = dofs > 0 and rng.random() < 0.12
        at = pose(0.5 * size * rng.normal(size=3), rng.normal(size=4))
        kind: Any = "prismatic" if rng.random() < 0.2 else "revolute"
        joints.append(
            Joint(
                name=f"joint_{i}",
                kind=kind,
                parent=parent,
                T_parent_joint=at,
                dof=int(rng.integers(0, dofs)) if follows else dofs,
                multiplier=float(rng.choice([-1.0, 0.5, 2.0])) if follows else 1.0,
                offset=0.3 if follows else 0.0,
            )
        )
        dofs += not follows
    bodies = [_body(rng, "base", -1, heavy * light, size)]
    for i in range(count):
        if rng.random() < 0.8:
            bodies.append(_body(rng, f"b{i}", i, heavy * rng.uniform(0.1, 3), size))
        else:  # stated to weigh nothing: a robot of unknown masses may not float
            bodies.append(Body(name=f"b{i}", joint=i, mass=0.0, com=np.zeros(3), inertia=np.zeros((3, 3))))
    capsules = []
    for k in range(int(rng.integers(2, 5))):
        joint = -1 if k == 0 else int(rng.integers(-1, count))
        a = 0.4 * size * rng.normal(size=3)
        b = a + 0.5 * size * rng.normal(size=3) * (rng.random() < 0.8)
        capsules.append(LinkCapsule(name=f"c{k}", joint=joint, a=a, b=b, radius=float(rng.choice([0.0, 0.02, 0.1])) * size))
    turns = [next(joint.kind for joint in joints if joint.dof == i) for i in range(dofs)]
    mixed = any(joint.kind != turns[joint.dof] for joint in joints)
    names = tuple(next(joint.name for joint in joints if joint.dof == i) for i in range(dofs))
    return Robot(
        name="drawn",
        joints=tuple(joints),
        bodies=tuple(bodies),
        capsules=tuple(capsules),
        frames=(Frame(name="tip", joint=count - 1, T_joint_frame=np.eye(4)),),
        tip="tip",
        dof_names=names if mixed else tuple(f"dof_{i}" for i in range(dofs)),
        lower=np.full(dofs, -np.inf),
        upper=np.full(dofs, np.inf),
        velocity=np.full(dofs, 1e3),
        acceleration=np.full(dofs, 1e5),
        base="floating",
    )


def _body(rng: np.random.Generator, name: str, joint: int, mass: float, size: float) -> Body:
    """A body whose inertia is that of some points of mass; some are thin."""
    x = rng.normal(size=(4, 3)) * size * np.array([1.0, rng.choice([0.05, 0.5]), rng.choice([0.05, 0.5])])
    spread = mass / 4 * np.einsum("pi,pj->ij", x, x) * 0.3
    inertia = np.trace(spread) * np.eye(3) - spread + 1e-4 * mass * size**2 * np.eye(3)
    return Body(
        name=name, joint=joint, mass=float(mass), com=0.3 * size * rng.normal(size=3), inertia=(inertia + inertia.T) / 2
    )


def drawn_trajectory(rng: np.random.Generator, robot: Robot, momentum: Momentum) -> AnyTrajectory:
    kind, reach = int(rng.integers(6)), _reach(rng, robot)
    held: dict[str, Any] = {"momentum": momentum}
    if kind <= 1:
        motion = Motion(reach * rng.normal(size=(rng.integers(2, 6), robot.dof)))
        law = TimeLaw([0.0, 0.3, 1.0], [[0, 0.05, 0.1, 0.2], [0.2, 0.2 + 7 / 3 * 0.1, 0.8, 1]]) if rng.random() < 0.3 else None
        least = Trajectory(robot, motion, time_law=law, base="fixed").duration
        return Trajectory(robot, motion, time_law=law, duration=max(least, float(rng.uniform(1, 6))), **held)
    count = int(rng.integers(2, 9))
    t = np.concatenate([[0.0], np.cumsum(rng.choice([0.05, 0.5, 1.0], count - 1))])
    q = reach * rng.normal(size=(1, robot.dof)) + np.cumsum(0.5 * reach * rng.normal(size=(count, robot.dof)), axis=0)
    q[1:][rng.random(count - 1) < 0.3] = q[0]
    rests = rng.random(count) < 0.4
    for i in np.flatnonzero(rests[1:]) + 1:
        q[i] = q[i - 1]
    if kind == 2:
        return RecordedTrajectory(robot, PiecewisePath.from_quintic(t, q, np.zeros_like(q), np.zeros_like(q)), **held)
    if kind == 3:
        return RecordedTrajectory(robot, PiecewisePath.from_cubic(t, q), **held)
    if kind == 4:
        return RecordedTrajectory(robot, PiecewisePath.from_linear(t, q), **held)
    return RecordedTrajectory(robot, blind_path(rng, t[:4], q[:4]), **held)


def _reach(rng: np.random.Generator, robot: Robot) -> Array:
    """How far joints are moved, (n,): slides by the robot's size."""
    size = max(float(np.linalg.norm(joint.T_parent_joint[:3, 3])) for joint in robot.joints)
    slides = [next(joint.kind for joint in robot.joints if joint.dof == i) == "prismatic" for i in range(robot.dof)]
    return np.where(slides, size, 1.0) * float(rng.choice([0.05, 0.4, 1.2]))


def blind_path(rng: np.random.Generator, t: Array, q: Array) -> PiecewisePath:
    """Pieces whose rate has double zeros in Gauss points: a sampler sees an arm that rests."""
    points = np.polynomial.legendre.leggauss(int(rng.choice([3, 5, 6, 8, 12])))[0]
    x = (1 - np.cos((np.arange(61) + 0.5) * np.pi / 61)) / 2  # Chebyshev points on [0, 1]
    rate = np.prod((2 * x[:, None] - 1 - points) ** 2, axis=1) * (x * (1 - x)) ** 2
    degree = 2 * len(points) + 4
    fit = np.polynomial.Chebyshev.fit(x, rate / rate.max(), degree, domain=[0, 1]).integ()
    share = np.polynomial.Polynomial(fit.convert(kind=np.polynomial.Polynomial, domain=[0, 1], window=[0, 1]).coef)
    power = share.coef
    bernstein = np.array([sum(_ratio(k, i, degree + 1) * power[i] for i in range(k + 1)) for k in range(degree + 2)])
    bernstein = (bernstein - bernstein[0]) / (bernstein[-1] - bernstein[0])
    pieces = q[:-1, None] + bernstein[None, :, None] * np.diff(q, axis=0)[:, None]
    pieces[:, -1] = q[1:]
    return PiecewisePath(t, pieces)


def _ratio(k: int, i: int, degree: int) -> float:
    return comb(k, i) / comb(degree, i)


def drawn(seed: int, number: int) -> tuple[Case, AnyTrajectory, Motions]:
    rng = np.random.default_rng((seed, number))
    robot = drawn_robot(rng)
    momentum, start = Momentum(), np.eye(4)
    if rng.random() < 0.3:
        start = pose(rng.normal(size=3), rng.normal(size=4))
    if rng.random() < 0.3:
        moments = np.linalg.eigvalsh(moving(robot, np.zeros((1, robot.dof)), np.zeros((1, robot.dof))).H[0])
        momentum = Momentum(angular=float(rng.choice([0.01, 0.3])) * moments[0] * rng.normal(size=3))
    trajectory = drawn_trajectory(rng, robot, momentum)
    trajectory = type(trajectory)(
        **{name: getattr(trajectory, name) for name in trajectory.__dataclass_fields__ if name not in ("_", "base_start")},
        base_start=start,
    )
    case = Case(robot, Scene([]), BaseLimits(), "floating", start, momentum)
    way = checked(case, trajectory)
    scene, limits = _grazed(rng, robot, way), BaseLimits()
    if rng.random() < 0.5:
        limits = _limits_near(rng, trajectory, way)
    return case._replace(scene=scene, base_limits=limits), trajectory, way


def drawn_again(case: Case, trajectory: AnyTrajectory, way: Motions, rng: np.random.Generator) -> Case:
    """The same motion beside another obstacle, and with another limit of the base or none."""
    limits = _limits_near(rng, trajectory, way) if rng.random() < 0.5 else BaseLimits()
    return case._replace(scene=_grazed(rng, case.robot, way), base_limits=limits)


def _grazed(rng: np.random.Generator, robot: Robot, way: Motions) -> Scene:
    """One obstacle as large as it can be, or a little larger or smaller."""
    size = float(np.ptp(way.ends, axis=(0, 1, 2)).max()) + 1e-6
    middle, gap = way.ends.mean(axis=(0, 1, 2)), size * float(rng.choice([-1e-3, -1e-6, 1e-6, 1e-4, 1e-2, 0.1]))
    kind, at = int(rng.integers(3)), middle + 0.6 * size * rng.normal(size=3)
    if kind == 0:
        normal = rng.normal(size=3)
        normal /= np.linalg.norm(normal)
        far = float(distances(robot, Scene([HalfSpace(normal, middle)]), way.ends).min())
        return Scene([HalfSpace(normal, middle + (far - gap) * normal)])
    other = at + 0.5 * size * rng.normal(size=3)
    shape = Sphere(at, 1e-9) if kind == 1 else Capsule(at, other, 1e-9)
    room = float(distances(robot, Scene([shape]), way.ends).min()) - gap
    if room <= 1e-6 * size:
        return Scene([Sphere(middle + 2 * size * np.ones(3), 0.1 * size)])
    return Scene([Sphere(at, room) if kind == 1 else Capsule(at, other, room)])


def _limits_near(rng: np.random.Generator, trajectory: AnyTrajectory, way: Motions) -> BaseLimits:
    speed, near = speed_of(trajectory, way), 1 + float(rng.choice([-1e-2, -1e-5, 1e-4, 1e-2]))
    most = {
        "peak": turned(way).max(),
        "rate": (way.rate * speed).max(),
        "joint_momentum": (way.carried * speed).max(),
    }
    name = str(rng.choice(list(most)))
    return BaseLimits(**{name: max(1e-8, near * float(most[name]))})
