"""Drawn robots, configurations and scenes, for property tests; numbers are drawn so that they shrink."""

from __future__ import annotations

import math

import numpy as np
from hypothesis import strategies as st

from spacearm.geometry import Scene, Sphere
from spacearm.robot import Frame, Joint, LinkCapsule, Robot

# Quarter turns, their neighbourhoods and anything between.
ANGLES = st.one_of(
    st.sampled_from([0.0, math.pi / 2, -math.pi / 2, math.pi, 1e-9, math.pi - 1e-7]),
    st.floats(-math.pi, math.pi, allow_subnormal=False),
)


def lengths(largest: float = 1.0) -> st.SearchStrategy[float]:
    """Coordinates [m] of either sign."""
    return st.floats(-largest, largest, allow_subnormal=False)


def points(largest: float = 1.0) -> st.SearchStrategy[np.ndarray]:
    """Points (3,) [m]."""
    return st.tuples(*[lengths(largest)] * 3).map(np.array)


def rotation(axis: int, angle: float) -> np.ndarray:
    """Turn about a coordinate axis, (3, 3)."""
    i, j = (axis + 1) % 3, (axis + 2) % 3
    R = np.eye(3)
    R[i, i] = R[j, j] = math.cos(angle)
    R[j, i], R[i, j] = math.sin(angle), -math.sin(angle)
    return R


@st.composite
def transforms(draw: st.DrawFn) -> np.ndarray:
    """Rigid transforms (4, 4)."""
    T = np.eye(4)
    for axis in range(3):
        T[:3, :3] = rotation(axis, draw(ANGLES)) @ T[:3, :3]
    T[:3, 3] = draw(points())
    return T


@st.composite
def limits(draw: st.DrawFn) -> tuple[float, float]:
    """A lower and an upper limit; the range may lie anywhere, and need not hold 0."""
    lower = draw(st.floats(-3.0, 2.5, allow_subnormal=False))
    return lower, lower + draw(st.floats(0.05, 6.0))


@st.composite
def robots(draw: st.DrawFn, min_joints: int = 2, max_joints: int = 12) -> Robot:
    """Trees of revolute and prismatic joints with capsules on the links, the base's included."""
    count = draw(st.integers(min_joints, max_joints))
    joints = []
    for i in range(count):
        # Mostly a chain, at times a branch.
        parent = draw(st.one_of(st.just(i - 1), st.integers(-1, i - 1)))
        kind = draw(st.sampled_from(["revolute", "revolute", "revolute", "prismatic"]))
        joints.append(Joint(name=f"joint_{i}", kind=kind, parent=parent, T_parent_joint=draw(transforms())))
    frames = [Frame(name=f"link_{i}", joint=i, T_joint_frame=np.eye(4)) for i in range(-1, count)]
    frames.append(Frame(name="tip", joint=count - 1, T_joint_frame=draw(transforms())))
    ranges = np.array([draw(limits()) for _ in range(count)])
    envelope = tuple(draw(st.lists(capsules(count), max_size=count + 2)))
    return Robot(
        name="drawn",
        joints=tuple(joints),
        capsules=envelope,
        collision="envelope" if envelope else "none",
        frames=tuple(frames),
        tip="tip",
        lower=ranges[:, 0],
        upper=ranges[:, 1],
        velocity=np.array([draw(st.floats(0.1, 3.0)) for _ in range(count)]),
        acceleration=np.array([draw(st.floats(0.1, 5.0)) for _ in range(count)]),
        source="drawn",
    )


@st.composite
def capsules(draw: st.DrawFn, joints: int) -> LinkCapsule:
    """A capsule on the base or on one of so many joints; some are spheres, some have no thickness."""
    joint = draw(st.integers(-1, joints - 1))
    a = draw(points(0.5))
    b = draw(st.one_of(st.just(a), points(0.5)))
    radius = draw(st.one_of(st.just(0.0), st.floats(1e-3, 0.3)))
    return LinkCapsule(name=f"link_{joint}", joint=joint, a=a, b=b, radius=radius)


@st.composite
def configurations(draw: st.DrawFn, robot: Robot, batch: tuple[int, ...] = ()) -> np.ndarray:
    """Configurations (*batch, n) within the limits, which are reached at times [rad or m]."""
    share = st.one_of(st.sampled_from([0.0, 0.5, 1.0]), st.floats(0.0, 1.0, allow_subnormal=False))
    size = math.prod(batch) * robot.dof
    shares = np.array(draw(st.lists(share, min_size=size, max_size=size))).reshape(*batch, robot.dof)
    lower = np.maximum(robot.lower, -math.pi)
    upper = np.minimum(robot.upper, math.pi)
    return np.clip(lower + shares * (upper - lower), lower, upper)


def scenes(max_obstacles: int = 5) -> st.SearchStrategy[Scene]:
    """Scenes of spheres, the empty one included."""
    sphere = st.builds(Sphere, points(2.0), st.floats(0.01, 0.5))
    return st.lists(sphere, max_size=max_obstacles).map(Scene)
