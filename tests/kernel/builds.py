"""The kernel's builds, one an instruction level and scalar, and models made for each from a robot."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from types import ModuleType
from typing import Any

import numpy as np

from spacearm.core.native import load_level
from spacearm.geometry import Box, Capsule, Cylinder, HalfSpace, Obstacle, Sphere, SphereSet
from spacearm.robot import Robot
from spacearm.robot.kinematics import tree_arrays

LEVELS = ("x86-64-v4", "x86-64-v3", "x86-64-v2", "generic")
Point = tuple[int, Sequence[float] | np.ndarray]
"""A joint's index, -1 for the base, and a point (3,) in its moving frame [m]."""


@dataclass(frozen=True)
class Build:
    """One instruction level and one scalar of the kernel."""

    level: str
    bits: int

    def __str__(self) -> str:
        return f"{self.level}-{self.bits}"

    @property
    def module(self) -> ModuleType:
        return load_level(self.level)

    @property
    def scalar(self) -> type[np.floating]:
        return np.float64 if self.bits == 64 else np.float32

    @property
    def lanes(self) -> int:
        return getattr(self.module, f"lanes{self.bits}")

    @property
    def drawn_together(self) -> int:
        """How many particles' random numbers `uniforms` draws at once."""
        return self.module.lanes32

    def named(self, name: str) -> Any:
        """The module's class or function of that name for this scalar."""
        return getattr(self.module, f"{name}{self.bits}")

    def array(self, values: Any) -> np.ndarray:
        return np.ascontiguousarray(values, dtype=self.scalar)

    def settings(self, **values: Any) -> Any:
        return self.module.SwarmSettings.make(values)

    def swarm(self, settings: dict[str, Any], lower: Any, upper: Any, *, seed: int = 0, trial: int = 0) -> Any:
        bounds = np.asarray(lower, dtype=np.float64), np.asarray(upper, dtype=np.float64)
        return self.named("Swarm")(self.settings(**settings), *bounds, seed, trial)


BUILDS = tuple(Build(level, bits) for level in LEVELS for bits in (64, 32))


@dataclass(frozen=True)
class Placed:
    """A kernel model, and what its indices mean.

    Attributes:
        native: the kernel's own object.
        points: those asked for, and after them two for each capsule.
    """

    native: Any
    points: tuple[Point, ...]


def place(
    build: Build,
    robot: Robot,
    *,
    points: Sequence[Point] = (),
    spheres: Sequence[Sphere] = (),
    share_ends: bool = True,
) -> Placed:
    """Make a kernel model with two points a capsule, or one if its ends coincide and share_ends is set."""
    listed = list(points)
    ends = []
    for capsule in robot.capsules:
        first = len(listed)
        listed.append((capsule.joint, capsule.a))
        if not (share_ends and np.array_equal(capsule.a, capsule.b)):
            listed.append((capsule.joint, capsule.b))
        ends.append((first, len(listed) - 1))
    native = build.named("Model").make(
        **tree_arrays(robot),
        point_joint=np.array([joint for joint, _ in listed], dtype=np.int32),
        point_local=np.array([local for _, local in listed], dtype=np.float64).reshape(-1, 3),
        capsule_a=np.array([a for a, _ in ends], dtype=np.int32),
        capsule_b=np.array([b for _, b in ends], dtype=np.int32),
        capsule_radius=np.array([c.radius for c in robot.capsules], dtype=np.float64),
        sphere_center=np.array([s.center for s in spheres], dtype=np.float64).reshape(-1, 3),
        sphere_radius=np.array([s.radius for s in spheres], dtype=np.float64),
    )
    return Placed(native, tuple(listed))


# ---- envelopes among obstacles ---------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Surrounded:
    """A kernel model with its envelope among obstacles.

    Attributes:
        native: the kernel's own object.
        pairs: (p, 2) the capsules that must keep clear of each other.
    """

    native: Any
    pairs: np.ndarray


def obstacle_row(obstacle: Obstacle) -> tuple[int, list[float]]:
    """A shape's kind and 15 numbers, as `add_obstacle` has them."""
    if isinstance(obstacle, Sphere):
        kind, parts = 1, [obstacle.center, obstacle.radius]
    elif isinstance(obstacle, Capsule):
        kind, parts = 2, [obstacle.a, obstacle.b, obstacle.radius]
    elif isinstance(obstacle, Box):
        kind, parts = 3, [obstacle.pose[:3, 3], *obstacle.pose[:3, :3].T, obstacle.size / 2]
    elif isinstance(obstacle, Cylinder):
        kind, parts = 4, [obstacle.pose[:3, 3], obstacle.pose[:3, 2], obstacle.length / 2, obstacle.radius]
    else:
        assert isinstance(obstacle, HalfSpace)
        kind, parts = 5, [obstacle.normal, obstacle.normal @ obstacle.point]
    numbers = np.hstack(parts)
    return kind, [*numbers, *[0.0] * (15 - len(numbers))]


def single_shapes(obstacles: Sequence[Obstacle]) -> list[Obstacle]:
    """The obstacles, sets of spheres as their spheres."""
    out: list[Obstacle] = []
    for obstacle in obstacles:
        if isinstance(obstacle, SphereSet):
            out += [Sphere(c, float(r)) for c, r in zip(obstacle.centers, obstacle.radii, strict=True)]
        else:
            out.append(obstacle)
    return out


def surround(build: Build, robot: Robot, obstacles: Sequence[Obstacle] = (), *, points: Sequence[Point] = ()) -> Surrounded:
    """Make a kernel model whose capsules are arranged link by link, among obstacles of any shape."""
    links = sorted({(c.name, c.joint) for c in robot.capsules})
    link_of = [links.index((c.name, c.joint)) for c in robot.capsules]
    order = sorted(range(len(robot.capsules)), key=lambda i: link_of[i])
    capsules = [robot.capsules[i] for i in order]
    close = [
        (i, k)
        for one, two in robot.self_pairs
        for i, (name, _) in enumerate(links)
        for k, (other, _) in enumerate(links)
        if (name, other) == (one, two)
    ]
    rows = [obstacle_row(obstacle) for obstacle in single_shapes(obstacles)]
    native = place(build, robot, points=points).native.surrounded(
        index=np.array(order, dtype=np.int32),
        joint=np.array([c.joint for c in capsules], dtype=np.int32),
        link=np.array([link_of[i] for i in order], dtype=np.int32),
        a=np.array([c.a for c in capsules], dtype=np.float64).reshape(-1, 3),
        b=np.array([c.b for c in capsules], dtype=np.float64).reshape(-1, 3),
        radius=np.array([c.radius for c in capsules], dtype=np.float64),
        pairs=np.array(close, dtype=np.int32).reshape(-1, 2),
        obstacle_kind=np.array([kind for kind, _ in rows], dtype=np.int32),
        obstacle_numbers=np.array([numbers for _, numbers in rows], dtype=np.float64).reshape(-1, 15),
    )
    names = [c.name for c in robot.capsules]
    pairs = [
        (i, k)
        for one, two in robot.self_pairs
        for i, name in enumerate(names)
        for k, other in enumerate(names)
        if (name, other) == (one, two)
    ]
    return Surrounded(native, np.array(pairs, dtype=np.int32).reshape(-1, 2))
