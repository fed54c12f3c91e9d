"""Drawn planning problems, each from (seed, number): trees of joints, scenes of every shape, goals of every kind."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from spacearm.geometry import Box, Capsule, Cylinder, HalfSpace, Obstacle, Scene, Sphere, SphereSet, pose
from spacearm.planner import ConfigurationGoal, ConfigurationsGoal, PlannerSettings, PoseGoal, PositionGoal, Problem, Weights
from spacearm.planner.goals import Goal
from spacearm.robot import Frame, Joint, LinkCapsule, Robot
from spacearm.swarm import IPSO, PSO
from support.oracles.pinocchio_points import joint_frames
from support.oracles.solids import point_distance

_ALONG = np.linspace(0.0, 1.0, 7)  # where an axis is looked at to tell roughly what is clear


class DrawnProblem(NamedTuple):
    """A problem, and how it is to be planned."""

    problem: Problem
    settings: PlannerSettings


def drawn_problem(seed: int, number: int) -> DrawnProblem:
    """Draw a problem: nine in ten with a clear start and, as far as is known, a goal that can be reached."""
    rng = np.random.default_rng((seed, number))
    robot = drawn_robot(rng)
    start, end = drawn_configuration(rng, robot), drawn_configuration(rng, robot)
    if rng.random() < 0.02:
        end = start.copy()
    between = start + rng.random((3, robot.dof)) * (end - start)
    on_the_way = _axis_points(robot, joint_frames(robot, between)).reshape(-1, 3)
    obstacles = [drawn_obstacle(rng, i, on_the_way) for i in range(_count(rng))]
    if rng.random() < 0.9:
        robot, obstacles = _cleared(rng, robot, obstacles, np.stack([start, end]))
    goal = drawn_goal(rng, robot, start, end)
    settings = drawn_settings(rng)
    clearance = float(rng.choice([0.0, 0.002, 0.01, 0.03], p=[0.2, 0.2, 0.4, 0.2]))
    return DrawnProblem(Problem(robot, Scene(obstacles), start=start, goal=goal, clearance=clearance), settings)


def drawn_robot(rng: np.random.Generator) -> Robot:
    """A chain or a tree of 2 to 8 joints, with capsules along its links."""
    count = int(rng.integers(2, 9))
    joints: list[Joint] = []
    free = 0
    for i in range(count):
        parent = i - 1 if rng.random() < 0.85 else int(rng.integers(-1, i)) if i else -1
        follows = free > 0 and rng.random() < 0.06
        joints.append(
            Joint(
                name=f"joint_{i}",
                kind="prismatic" if rng.random() < 0.2 else "revolute",
                parent=parent,
                T_parent_joint=pose(rng.choice([0.05, 0.2, 0.4]) * rng.normal(size=3), _turn(rng)),
                dof=int(rng.integers(0, free)) if follows else free,
                multiplier=float(rng.choice([-1.0, 0.5, 2.0])) if follows else 1.0,
                offset=float(rng.choice([0.0, 0.3])) if follows else 0.0,
            )
        )
        free += not follows
    T_last_tip = pose(0.2 * rng.normal(size=3), _turn(rng))
    frames = [Frame(name=f"link_{i}", joint=i, T_joint_frame=np.eye(4)) for i in range(count)]
    frames.append(Frame(name="tip", joint=count - 1, T_joint_frame=T_last_tip))
    leaders = [next(joint for joint in joints if joint.dof == i) for i in range(free)]
    lower, upper = np.array([_range(rng, joint) for joint in leaders]).T
    return Robot(
        name="drawn",
        joints=tuple(joints),
        capsules=_capsules(rng, joints, T_last_tip),
        frames=tuple(frames),
        tip="tip",
        dof_names=tuple(joint.name for joint in leaders),
        lower=lower,
        upper=upper,
        velocity=np.exp(rng.uniform(-2, 1, free)),
        acceleration=np.exp(rng.uniform(-2, 2, free)),
    )


def _turn(rng: np.random.Generator) -> np.ndarray:
    """A quaternion: any, none, or a quarter turn, as robots have them."""
    kind = rng.random()
    if kind < 0.4:
        return rng.normal(size=4)
    if kind < 0.5:
        return np.array([1.0, 0, 0, 0])
    axis = np.zeros(3)
    axis[rng.integers(3)] = rng.choice([-1.0, 1.0]) * math.sqrt(0.5)
    return np.array([math.sqrt(0.5), *axis])


def _range(rng: np.random.Generator, joint: Joint) -> tuple[float, float]:
    if joint.kind == "prismatic":
        return -float(rng.uniform(0, 0.4)), float(rng.uniform(0.1, 0.6))
    if rng.random() < 0.2:
        return -math.inf, math.inf
    low = float(rng.uniform(-3.2, 1.0))
    return low, low + float(rng.choice([0.0, 0.5, 3.0, 6.5], p=[0.03, 0.17, 0.4, 0.4]))


def _capsules(rng: np.random.Generator, joints: list[Joint], T_last_tip: np.ndarray) -> tuple[LinkCapsule, ...]:
    """Along the links, a few elsewhere on them, some of them balls, some without thickness; at times none at all."""
    if rng.random() < 0.01:
        return ()
    thickness = float(rng.choice([0.0, 0.01, 0.04, 0.08]))
    ends = [(joint.parent, joint.T_parent_joint[:3, 3]) for joint in joints] + [(len(joints) - 1, T_last_tip[:3, 3])]
    out = []
    for rider, to in ends:
        if rng.random() < 0.85:
            a, b = 0.1 * rng.random() * to, to * rng.uniform(0.6, 1)
            out.append(LinkCapsule(name=f"link_{rider}", joint=rider, a=a, b=b, radius=thickness * rng.uniform(0.5, 1.2)))
    for _ in range(rng.integers(0, 4)):
        rider, a = int(rng.integers(-1, len(joints))), 0.15 * rng.normal(size=3)
        b = a if rng.random() < 0.5 else a + 0.2 * rng.normal(size=3)
        out.append(LinkCapsule(name=f"link_{rider}", joint=rider, a=a, b=b, radius=thickness))
    return tuple(out)


def drawn_configuration(rng: np.random.Generator, robot: Robot) -> np.ndarray:
    """A configuration (n,) within the limits, at times on one of them."""
    lower, upper = np.maximum(robot.lower, -4.0), np.minimum(robot.upper, 4.0)
    q = rng.uniform(lower, upper)
    at_limit = rng.random(robot.dof) < 0.03
    return np.clip(np.where(at_limit, rng.choice([lower, upper]), q), lower, upper)


def _count(rng: np.random.Generator) -> int:
    """How many obstacles: mostly few, at most 40."""
    most = int(rng.choice([0, 4, 12, 40], p=[0.05, 0.35, 0.4, 0.2]))
    return int(rng.integers(0, most + 1))


def drawn_obstacle(rng: np.random.Generator, i: int, points: np.ndarray) -> Obstacle:
    """An obstacle within reach, from 1 mm thin to 60 cm; a third are near one of the points (k, 3)."""
    size = float(rng.choice([0.001, 0.03, 0.1, 0.25]))
    at = 0.6 * rng.normal(size=3)
    if len(points) and rng.random() < 0.35:
        at = points[rng.integers(len(points))] + 0.1 * rng.normal(size=3)
    placed = pose(at, _turn(rng))
    name = f"thing {i}" if rng.random() < 0.3 else ""
    kind = int(rng.choice(6, p=[0.22, 0.18, 0.25, 0.2, 0.05, 0.1]))
    if kind == 0:
        return Sphere(at, size, name=name)
    if kind == 1:
        b = at if rng.random() < 0.05 else at + 0.3 * rng.normal(size=3)
        return Capsule(at, b, size, name=name)
    if kind == 2:
        return Box(np.exp(rng.uniform(math.log(1e-3), math.log(0.6), 3)), placed, name=name)
    if kind == 3:
        return Cylinder(size, float(np.exp(rng.uniform(math.log(1e-3), 0.0))), placed, name=name)
    if kind == 4:
        normal = rng.normal(size=3)
        return HalfSpace(normal, -rng.uniform(0.3, 1.5) * normal / np.linalg.norm(normal), name=name)
    count = int(rng.integers(1, 60))
    return SphereSet(at + 0.1 * rng.normal(size=(count, 3)), rng.uniform(0.005, 0.05, count), name=name)


def _cleared(
    rng: np.random.Generator, robot: Robot, obstacles: list[Obstacle], ends: np.ndarray
) -> tuple[Robot, list[Obstacle]]:
    """Leave out what is in the way of the ends (rows), roughly, and name pairs of links that are clear of each other there."""
    if not robot.capsules:
        return robot, obstacles
    points = _axis_points(robot, joint_frames(robot, ends))  # (ends, capsules, 7, 3)
    radii = np.array([capsule.radius for capsule in robot.capsules])
    room = float(rng.choice([0.001, 0.01, 0.05]))
    kept = [each for each in obstacles if (point_distance(each, points).min(axis=(0, 2)) - radii).min() > room]
    names = [capsule.name for capsule in robot.capsules]
    closest: dict[tuple[str, str], float] = {}
    for i, one in enumerate(names):
        for k in range(i + 1, len(names)):
            if names[k] != one:
                apart = np.linalg.norm(points[:, i, :, None] - points[:, k, None], axis=-1).min() - radii[i] - radii[k]
                key = (min(one, names[k]), max(one, names[k]))
                closest[key] = min(closest.get(key, np.inf), float(apart))
    clear = sorted(pair for pair, apart in closest.items() if apart > 0.03)
    pairs = tuple(pair for pair in clear if rng.random() < 0.5) if rng.random() < 0.6 else ()
    return replace(robot, self_pairs=pairs), kept


def _axis_points(robot: Robot, frames: np.ndarray) -> np.ndarray:
    """Points (rows, capsules, 7, 3) of the capsules' axes."""
    out = np.empty((len(frames), len(robot.capsules), len(_ALONG), 3))
    for i, capsule in enumerate(robot.capsules):
        local = capsule.a + _ALONG[:, None] * (capsule.b - capsule.a)
        if capsule.joint < 0:
            out[:, i] = local
        else:
            T = frames[:, capsule.joint]
            out[:, i] = np.einsum("rij,pj->rpi", T[:, :3, :3], local) + T[:, None, :3, 3]
    return out


def drawn_goal(rng: np.random.Generator, robot: Robot, start: np.ndarray, end: np.ndarray) -> Goal:
    """A goal of any kind; those in space are where a frame is at the end given, but for a few that are anywhere."""
    kind = int(rng.choice(4, p=[0.45, 0.15, 0.2, 0.2]))
    if kind < 2:
        slack = float(rng.choice([0.0, 0.05]))
        tolerance = np.full(robot.dof, slack) if rng.random() < 0.2 else slack
        shortest = bool(rng.random() < 0.3)
        if kind == 0:
            return ConfigurationGoal(end, tolerance=tolerance, shortest=shortest)
        others = [drawn_configuration(rng, robot) for _ in range(rng.integers(0, 4))]
        return ConfigurationsGoal([*others, end], tolerance=tolerance, shortest=shortest)
    frame = robot.frames[int(rng.integers(len(robot.frames)))] if rng.random() < 0.2 else robot.frame("tip")
    T = joint_frames(robot, end[None])[0, frame.joint] @ frame.T_joint_frame
    if rng.random() < 0.1:
        T = pose(rng.normal(size=3), rng.normal(size=4))
    if kind == 2:
        return PositionGoal(T[:3, 3], tolerance=float(rng.choice([1e-4, 1e-3, 0.02])), frame=frame.name)
    axis = [None, "x", "z", rng.normal(size=3)][int(rng.integers(4))]
    turn = float(rng.choice([0.003, 0.01, 0.2]))
    return PoseGoal(T, orientation_tolerance=turn, frame=frame.name, free_axis=axis)


def drawn_settings(rng: np.random.Generator) -> PlannerSettings:
    """Small budgets, and each setting away from its default now and then."""
    names = ("length", "duration", "tip", "clearance", "smoothness", "f1", "f2", "f3")
    weighed = {name: float(rng.choice([0.0, 0.1, 1.0])) for name in names}
    weights = Weights(**{**weighed, "length": 1.0}) if rng.random() < 0.2 else Weights()
    values: dict[str, object] = {"evaluations": int(rng.integers(300, 1501)), "weights": weights}
    some: list[tuple[float, str, list[object]]] = [
        (0.1, "stop_at_first", [True]),
        (0.1, "convergence", [50, 400]),
        (0.1, "interior_points", [(1,), (2,), (3, 5), (8,)]),
        (0.2, "goal_candidates", [1, 3]),
        (0.1, "islands", [2, 3]),
        (0.06, "time_law", ["time_optimal"]),
        (0.15, "jerk_limit", [0.5, 5.0, 50.0]),
        (0.1, "swarm", [PSO(particles=10, iterations=20), IPSO(particles=12, iterations=30)]),
        (0.1, "proofs", [1, 3]),
    ]
    for share, name, choices in some:
        draw, which = rng.random(), int(rng.integers(len(choices)))
        if draw < share:
            values[name] = choices[which]
    return PlannerSettings(**values)  # type: ignore[arg-type]
