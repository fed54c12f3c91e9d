"""Drawn planning problems whose links, base and obstacles are of every shape, each from (seed, number)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from spacearm.geometry import Box, Capsule, ConvexShape, Cylinder, Obstacle, Polytope, PolytopeSet, Scene, Sphere, pose
from spacearm.planner import ConfigurationGoal, PlannerSettings, Problem
from spacearm.robot import Body, LinkCapsule, LinkShape, Robot
from support.drawn_problems import DrawnProblem, drawn_configuration, drawn_goal, drawn_obstacle, drawn_robot
from support.oracles.coal_shapes import least_distances
from support.oracles.pinocchio_points import joint_frames

FLOATING = 0.3  # share of the problems whose base floats


def drawn_body_problem(seed: int, number: int) -> DrawnProblem:
    """Draw a problem with a clear start and, as far as is known, a goal that can be reached."""
    rng = np.random.default_rng((seed, number, 7))
    floating = bool(rng.random() < FLOATING)
    robot = with_bodies(rng, drawn_robot(rng), base=floating or bool(rng.random() < 0.5))
    if floating:
        robot = with_masses(rng, robot)
    start, end = drawn_configuration(rng, robot), drawn_configuration(rng, robot)
    ends = np.stack([start, end])
    obstacles = [drawn_shape_obstacle(rng, i) for i in range(int(rng.integers(1, 9)))]
    robot, obstacles = _cleared(rng, robot, obstacles, ends)
    goal = ConfigurationGoal(end) if floating or rng.random() < 0.7 else drawn_goal(rng, robot, start, end)
    clearance = float(rng.choice([0.0, 0.002, 0.01, 0.03], p=[0.2, 0.2, 0.4, 0.2]))
    settings = PlannerSettings(evaluations=int(rng.integers(300, 1501)))
    problem = Problem(
        robot, Scene(obstacles), start=start, goal=goal, clearance=clearance, base="floating" if floating else "fixed"
    )
    return DrawnProblem(problem, settings)


def with_bodies(rng: np.random.Generator, robot: Robot, *, base: bool) -> Robot:
    """Put a drawn shape in place of each capsule, and at times a large one on the base."""
    shapes = [LinkShape(name=one.name, joint=one.joint, shape=_around(rng, one)) for one in robot.capsules]
    if base:
        at = pose(rng.normal(size=3) * 0.05 - [0, 0, 0.5], rng.normal(size=4))
        size = rng.uniform(0.1, 0.9, 3)
        bus: ConvexShape = Box(size, at, rounding=_rounding(rng))
        if rng.random() < 0.3:
            bus = Cylinder(float(size[0]) / 2, float(size[1]), at, rounding=_rounding(rng))
        shapes.append(LinkShape(name="bus", joint=-1, shape=bus))
    return replace(robot, shapes=tuple(shapes))


def _rounding(rng: np.random.Generator) -> float:
    return float(rng.choice([0.0, 0.005, 0.05], p=[0.6, 0.2, 0.2]))


def _around(rng: np.random.Generator, capsule: LinkCapsule) -> ConvexShape:
    """A shape about as large as a capsule, where it is."""
    radius = max(capsule.radius, 0.003)
    along = capsule.b - capsule.a
    length = max(float(np.linalg.norm(along)), radius)
    middle = (capsule.a + capsule.b) / 2
    z = along / np.linalg.norm(along) if np.linalg.norm(along) > 1e-9 else np.array([0.0, 0.0, 1.0])
    x = np.cross(z, np.eye(3)[np.argmin(np.abs(z))])
    x /= np.linalg.norm(x)
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = np.column_stack([x, np.cross(z, x), z]), middle
    kind = int(rng.integers(5))
    if kind == 0:
        return Sphere(middle, radius)
    if kind == 1:
        return Capsule(middle - z * length / 2, middle + z * length / 2, radius)
    if kind == 2:
        return Box(np.array([*rng.uniform(0.3, 2, 2) * radius, length]), T, rounding=min(_rounding(rng), radius))
    if kind == 3:
        return Cylinder(radius, length, T, rounding=min(_rounding(rng), radius))
    count = int(rng.integers(3, 20))
    points = rng.uniform(-1, 1, (count, 3)) * [radius, radius, length / 2]
    if rng.random() < 0.15:
        points[:, 0] = 0.0  # a plate
    return Polytope(points @ T[:3, :3].T + middle, rounding=min(_rounding(rng), radius))


def with_masses(rng: np.random.Generator, robot: Robot) -> Robot:
    """Give every joint and the base a mass."""
    bodies = [Body(name="bus", joint=-1, mass=float(rng.uniform(20, 500)), com=np.zeros(3), inertia=20 * np.eye(3))]
    for i in range(len(robot.joints)):
        mass = float(rng.uniform(0.5, 8))
        bodies.append(Body(name=f"link_{i}", joint=i, mass=mass, com=0.1 * rng.normal(size=3), inertia=0.02 * mass * np.eye(3)))
    return replace(robot, bodies=tuple(bodies))


def drawn_shape_obstacle(rng: np.random.Generator, i: int) -> Obstacle:
    """An obstacle of any shape, rounded at times, from 1 mm thin to a metre."""
    kind = int(rng.integers(4))
    at = 0.7 * rng.normal(size=3)
    placed = pose(at, rng.normal(size=4))
    size = rng.choice([0.002, 0.05, 0.3], 3) * rng.uniform(0.5, 1.5, 3)
    if kind == 0:
        return Box(size, placed, rounding=_rounding(rng), name=f"box {i}")
    if kind == 1:
        return Polytope(at + size * rng.normal(size=(int(rng.integers(3, 30)), 3)), rounding=_rounding(rng), name=f"rock {i}")
    if kind == 2:
        pieces = [
            Polytope(at + 0.2 * rng.normal(size=3) + 0.1 * rng.normal(size=(int(rng.integers(4, 12)), 3)))
            for _ in range(int(rng.integers(1, 6)))
        ]
        return PolytopeSet(pieces, name=f"pieces {i}")
    return drawn_obstacle(rng, i, np.zeros((0, 3)))


def _cleared(
    rng: np.random.Generator, robot: Robot, obstacles: list[Obstacle], ends: np.ndarray
) -> tuple[Robot, list[Obstacle]]:
    """Leave out obstacles in the way of the ends (rows), and name pairs of links that are clear of each other there."""
    frames = joint_frames(robot, ends)
    room = float(rng.choice([0.001, 0.01, 0.05]))
    alone = replace(robot, self_pairs=())
    kept = [each for each in obstacles if least_distances(alone, Scene([each]), frames).min() > room]
    names = sorted({part.name for part in robot.shapes})
    pairs = []
    for i, one in enumerate(names):
        for other in names[i + 1 :]:
            two = replace(robot, self_pairs=((one, other),))
            if rng.random() < 0.5 and least_distances(two, Scene([]), frames).min() > room:
                pairs.append((one, other))
    return replace(robot, self_pairs=tuple(pairs)), kept
