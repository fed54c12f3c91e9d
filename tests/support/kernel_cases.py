"""Robots, terms and tolerances that tests of the kernel share."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.interpolate import BSpline

from kernel.builds import Build
from spacearm.geometry import Box, Capsule, Cylinder, HalfSpace, Obstacle, Sphere
from spacearm.robot import Frame, Joint, LinkCapsule, Robot


def enveloped(rng: np.random.Generator, robot: Robot, most: int) -> Robot:
    """The robot with up to so many capsules a link, in some order of links, and pairs of links that must keep clear."""
    joints = len(robot.joints)
    capsules = []
    for joint in rng.permutation(np.arange(-1, joints)):
        near, spread = rng.uniform(-0.3, 0.3, 3), rng.choice([0.01, 0.1, 0.5])
        for _ in range(rng.integers(0, most + 1)):
            a = near + spread * rng.normal(size=3)
            b = a + rng.choice([0.0, 1.0]) * spread * rng.normal(size=3)
            capsules.append(LinkCapsule(name=f"link_{joint}", joint=int(joint), a=a, b=b, radius=rng.uniform(0, 0.05)))
    if rng.random() < 0.5:  # not link by link
        capsules = [capsules[i] for i in rng.permutation(len(capsules))]
    links = sorted({c.name for c in capsules})
    pairs = tuple((one, two) for i, one in enumerate(links) for two in links[i + 1 :] if rng.random() < 0.5)
    return replace(robot, capsules=tuple(capsules), self_pairs=pairs, collision="envelope" if capsules else "none")


def bench(*capsules: LinkCapsule) -> Robot:
    """A robot whose capsules stay on the base, so that their ends are known exactly."""
    return Robot(
        name="bench",
        joints=(Joint(name="joint", kind="revolute", parent=-1, T_parent_joint=np.eye(4)),),
        capsules=capsules,
        frames=(Frame(name="tip", joint=0, T_joint_frame=np.eye(4)),),
        tip="tip",
        lower=np.array([-3.0]),
        upper=np.array([3.0]),
        velocity=np.ones(1),
        acceleration=np.ones(1),
    )


def capsule(a: np.ndarray, b: np.ndarray, radius: float) -> LinkCapsule:
    return LinkCapsule(name="link", joint=-1, a=np.asarray(a, float), b=np.asarray(b, float), radius=radius)


def resized(o: Obstacle, size: float) -> Obstacle:
    """The obstacle in another unit of length."""
    if isinstance(o, Sphere):
        return Sphere(o.center * size, o.radius * size)
    if isinstance(o, Capsule):
        return Capsule(o.a * size, o.b * size, o.radius * size)
    if isinstance(o, HalfSpace):
        return HalfSpace(o.normal, o.point * size)
    assert isinstance(o, Box | Cylinder)
    T = o.pose.copy()
    T[:3, 3] *= size
    return Box(o.size * size, T) if isinstance(o, Box) else Cylinder(o.radius * size, o.length * size, T)


def rounding(build: Build, *lengths: float) -> float:
    """What a clearance may be off by when nothing moves: some ten roundings of lengths such as these [m]."""
    return 10 * float(np.finfo(build.scalar).eps) * (1 + sum(abs(length) for length in lengths))


def by_scipy(s: np.ndarray, interior: int, derivative: int) -> np.ndarray:
    """The basis' values (samples, interior + 2), those of the three first and three last control points summed."""
    spline = BSpline(clamped_quintic(interior), np.eye(interior + 6), 5)
    whole = spline(s) if derivative == 0 else spline.derivative(derivative)(s)
    return np.column_stack([whole[:, :3].sum(axis=1), whole[:, 3:-3], whole[:, -3:].sum(axis=1)])


TERMS = ("length", "duration", "tip", "clearance", "smoothness", "f1", "f2", "f3")


def looked_at(build: Build, x: np.ndarray, K: int, start: Sequence[float], goal: Sequence[float]) -> np.ndarray:
    """The configurations (rows, instants, n) at all instants that the search looks at, the last ones repeated."""
    points = [np.vstack([start, row.reshape(K, len(start)), goal]) for row in x.astype(np.float64)]
    rows = [by_scipy(fine_instants(build, row), K, 0) @ row for row in points]
    most = max((len(row) for row in rows), default=0)
    whole = [np.vstack([row, np.repeat(row[-1:], most - len(row), axis=0)]) for row in rows]
    return np.array(whole).reshape(len(x), most, len(start))


def coarsely_looked_at(build: Build, x: np.ndarray, K: int, start: Sequence[float], goal: Sequence[float]) -> np.ndarray:
    """The configurations (rows, instants, n) at the coarse instants, from which the terms and violations are."""
    points = np.stack([np.vstack([start, row.reshape(K, len(start)), goal]) for row in x.astype(np.float64)])
    return np.einsum("ik,rkd->rid", by_scipy(instants(build, 2), K, 0), points)


def fine_instants(build: Build, points: np.ndarray, *, doubled: bool = False) -> np.ndarray:
    """All instants at which the search looks at a motion: even ones, or so many evenly along its length that they are dense.

    The length is that of the chords between four steps a span; the motion has control points (K + 2, n). `doubled`: after a
    proof failed.
    """
    K, even = len(points) - 2, instants(build, 8)
    coarse, between = even[::4], even + 0.5 / len(even)
    rate = np.linalg.norm(by_scipy(coarse, K, 1) @ points, axis=1).max()
    if K <= 24 and 16 * rate <= len(even):
        return np.sort(np.concatenate([even, between])) if doubled else even
    steps = np.linspace(0, 1, 4 * (K + 1) + 1)
    chords = np.linalg.norm(np.diff(by_scipy(steps, K, 0) @ points, axis=0), axis=1)
    up_to = np.concatenate([[0], np.cumsum(chords)])
    packs = min(max(6, math.ceil(16 * (1 + doubled) * up_to[-1] / build.lanes)), 4096 // build.lanes)
    shares = (np.arange(packs * build.lanes) + 0.5) / (packs * build.lanes)
    along = np.interp(shares * up_to[-1], up_to, steps)
    return np.sort(np.concatenate([coarse, along, between] if doubled else [coarse, along]))


def clamped_quintic(interior: int) -> np.ndarray:
    """Knots of a clamped quintic spline with interior + 6 control points on [0, 1]."""
    spans = interior + 1
    return np.concatenate([np.zeros(6), np.arange(1, spans) / spans, np.ones(6)])


def instants(build: Build, packs: int) -> np.ndarray:
    """What is looked at: the coarse instants are the first two packs, the fine ones all eight."""
    return np.arange(packs * build.lanes) / (packs * build.lanes)
