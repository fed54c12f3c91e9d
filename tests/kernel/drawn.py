"""Drawn inputs of the kernel: robots with mimic joints, batches of configurations, obstacles by their links."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from hypothesis import strategies as st

from kernel.builds import Build
from spacearm.geometry import Box, Capsule, Cylinder, HalfSpace, Obstacle, Sphere
from spacearm.robot import Robot
from support import strategies
from support.oracles import coal_shapes

# Which coordinates of a point are kept; the kernel leaves out what zeros make needless.
MASKS = st.sampled_from([(1, 1, 1), (0, 0, 1), (1, 0, 0), (0, 1, 0), (0, 0, 0), (1, 1, 0)]).map(np.array)


def points() -> st.SearchStrategy[np.ndarray]:
    """Points (3,), often on an axis or in a coordinate plane [m]."""
    return st.builds(np.multiply, strategies.points(), MASKS)


@st.composite
def right_angled(draw: st.DrawFn) -> np.ndarray:
    """Transforms (4, 4) that exchange and flip axes, without a rounding error, as most robots' do."""
    T = np.eye(4)
    order = draw(st.permutations(range(3)))
    T[:3, :3] = np.eye(3)[order] * draw(st.tuples(*[st.sampled_from([1.0, -1.0])] * 3))
    if np.linalg.det(T[:3, :3]) < 0:
        T[:3, 0] *= -1
    T[:3, 3] = draw(points())
    return T


@st.composite
def robots(draw: st.DrawFn, min_joints: int = 2, max_joints: int = 12) -> Robot:
    """The robots of strategies.robots, some right-angled, some with joints that follow an earlier one."""
    robot = draw(strategies.robots(min_joints, max_joints))
    given, mimics = robot.joints, draw(st.booleans())
    if draw(st.booleans()):
        given = [replace(joint, T_parent_joint=draw(right_angled())) for joint in given]
    joints, leaders = [given[0]], [given[0].name]
    for joint in given[1:]:
        if mimics and draw(st.booleans()):
            leader = draw(st.integers(0, len(leaders) - 1))
            factor, offset = draw(st.floats(-2, 2)), draw(st.floats(-2, 2))
            joints.append(replace(joint, dof=leader, multiplier=factor, offset=offset))
        else:
            joints.append(replace(joint, dof=len(leaders)))
            leaders.append(joint.name)
    names = ("lower", "upper", "velocity", "acceleration")
    limits = {name: getattr(robot, name)[: len(leaders)] for name in names}
    return replace(robot, joints=tuple(joints), dof_names=tuple(leaders), **limits)


@st.composite
def batches(draw: st.DrawFn, robot: Robot, build: Build, rows: int) -> np.ndarray:
    """Configurations (rows, n) about 0, quarter and half turns, or many turns away, in the build's numbers.

    They are some distance, which may be tiny or 0, from a common centre, so that they shrink to zeros.
    """
    centre = draw(st.sampled_from([0.0, math.pi, -math.pi, math.pi / 2, 2 * math.pi, 100.0, -1000.0]))
    distance = draw(st.sampled_from([0.0, 1e-12, 1e-6, 1e-3, 1.0, math.pi]))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    return build.array(centre + distance * rng.uniform(-1, 1, (rows, robot.dof)))


@st.composite
def balls_near(draw: st.DrawFn, robot: Robot, frames: np.ndarray) -> tuple[Sphere, ...]:
    """Spheres anywhere, and some placed by a link: on its axis, beyond its ends, touching it, deep inside it."""
    balls = list(draw(strategies.scenes(3)).obstacles)
    for link in draw(st.lists(st.sampled_from(robot.capsules), max_size=3)) if robot.capsules else ():
        T = np.eye(4) if link.joint < 0 else frames[link.joint]
        along = draw(st.sampled_from([0.0, 0.5, 1.0, -0.7, 1.8]))
        radius = draw(st.floats(0.01, 0.5))
        away = draw(st.sampled_from([0.0, 1e-9, link.radius, link.radius + radius, 2.0]))
        side = coal_shapes.frame_along(link.b - link.a)[:, 0] if np.any(link.a != link.b) else np.eye(3)[0]
        centre = link.a + along * (link.b - link.a) + away * side
        balls.append(Sphere(T[:3, :3] @ centre + T[:3, 3], radius))
    return tuple(balls)


# ---- obstacles of every shape, and links in awkward places by them ----------------------------------------------------

SIZES = st.one_of(st.sampled_from([0.5, 1e-4, 50.0]), st.floats(0.01, 1.0))  # [m]
TILTS = st.sampled_from([0.0, 1e-8, 1e-6, 1e-4, 2.1e-4, 5e-4, 9e-4, 1.1e-3, 0.01])  # [rad] next to right angles


@st.composite
def poses(draw: st.DrawFn) -> np.ndarray:
    """Transforms (4, 4): anything, right angles, or right angles but for a little."""
    T = draw(st.one_of(strategies.transforms(), right_angled()))
    T[:3, :3] = strategies.rotation(draw(st.integers(0, 2)), draw(TILTS)) @ T[:3, :3]
    return T


@st.composite
def obstacles(draw: st.DrawFn) -> Obstacle:
    """A shape of any kind, size and turn."""
    T, kind = draw(poses()), draw(st.sampled_from([Sphere, Capsule, Box, Cylinder, HalfSpace]))
    if kind is Sphere:
        return Sphere(T[:3, 3], draw(SIZES))
    if kind is Capsule:
        length = draw(st.one_of(st.just(0.0), SIZES))
        return Capsule(T[:3, 3], T[:3, 3] + length * T[:3, 2], draw(SIZES))
    if kind is Box:
        return Box(np.array([draw(SIZES) for _ in range(3)]), T)
    if kind is Cylinder:
        return Cylinder(draw(SIZES), draw(SIZES), T)
    return HalfSpace(T[:3, 2], T[:3, 3])


def landmarks(obstacle: Obstacle) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """An obstacle's middle (3,), its directions as columns (3, 3), and how far it goes along them (3,)."""
    if isinstance(obstacle, Sphere):
        return obstacle.center, np.eye(3), np.full(3, obstacle.radius)
    if isinstance(obstacle, Capsule):
        axis, r = obstacle.b - obstacle.a, obstacle.radius
        R = coal_shapes.frame_along(axis) if np.linalg.norm(axis) > 1e-100 else np.eye(3)
        return (obstacle.a + obstacle.b) / 2, R, np.array([r, r, r + np.linalg.norm(axis) / 2])
    if isinstance(obstacle, HalfSpace):
        return obstacle.point, coal_shapes.frame_along(obstacle.normal), np.array([1.0, 1.0, 0.0])
    if isinstance(obstacle, Box):
        return obstacle.pose[:3, 3], obstacle.pose[:3, :3], obstacle.size / 2
    assert isinstance(obstacle, Cylinder)
    half = np.array([obstacle.radius, obstacle.radius, obstacle.length / 2])
    return obstacle.pose[:3, 3], obstacle.pose[:3, :3], half


@st.composite
def axes_by(draw: st.DrawFn, obstacle: Obstacle) -> tuple[np.ndarray, np.ndarray]:
    """Both ends (3,) of a link's axis by an obstacle.

    It runs between corners, middles of edges and faces, the centre, or points at the same places but a little or far away;
    along one of the obstacle's directions, or nearly so; through such a point; or it has no length.
    """
    middle, R, half = landmarks(obstacle)
    places = st.tuples(*[st.sampled_from([0.0, 1.0, -1.0, 0.3, 1.0 + 1e-6, -3.0])] * 3).map(lambda k: middle + R @ (half * k))
    point = draw(st.one_of(places, strategies.points()))
    kind = draw(st.sampled_from(["point", "between", "along", "through", "through the middle"]))
    if kind == "point":
        return point, point
    if kind == "between":
        return point, draw(st.one_of(places, strategies.points()))
    if kind == "along":
        tilted = strategies.rotation(draw(st.integers(0, 2)), draw(TILTS)) @ R[:, draw(st.integers(0, 2))]
        length = draw(st.sampled_from([1e-6, 0.3, 2.0, 100.0]))
        return point - draw(st.sampled_from([0.0, 0.5, 1.0])) * length * tilted, point + 0.5 * length * tilted
    way = draw(strategies.points())
    through = point if kind == "through" else middle
    return through - way, through + draw(st.sampled_from([1.0, 0.1, 30.0])) * way
