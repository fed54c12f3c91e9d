"""The kernel's builds, one an instruction level and scalar, and models made for each from a robot."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from types import ModuleType
from typing import Any

import numpy as np

from spacearm.core.native import load_level
from spacearm.geometry import (
    Box,
    Capsule,
    ConvexShape,
    Cylinder,
    HalfSpace,
    Obstacle,
    Polytope,
    PolytopeSet,
    Sphere,
    SphereSet,
    core_of,
)
from spacearm.robot import Robot
from spacearm.robot.link_shapes import as_capsule

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
        """Settings of a swarm, checked; enumerations by their values' names."""
        out = self.module.SwarmSettings()
        enumerations = {"variant": "SwarmVariant", "bounds": "BoundsRule", "constraints": "ConstraintRule"}
        for name, value in values.items():
            setattr(out, name, getattr(self.module, enumerations[name])[value] if name in enumerations else value)
        out.check()
        return out

    def search_settings(self, swarm: dict[str, Any], **values: Any) -> Any:
        """Settings of a search for motions, checked."""
        out = self.module.SearchSettings()
        out.swarm = self.settings(**swarm)
        for name, value in values.items():
            setattr(out, name, value)
        out.check()
        return out

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


def joint_arrays(robot: Robot) -> dict[str, Any]:
    """What the kernel's `Joints` are made of."""
    joints = robot.joints
    return {
        "parent": np.array([joint.parent for joint in joints], dtype=np.int32),
        "prismatic": np.array([joint.kind == "prismatic" for joint in joints], dtype=bool),
        "dof": np.array([joint.dof for joint in joints], dtype=np.int32),
        "multiplier": np.array([joint.multiplier for joint in joints], dtype=np.float64),
        "offset": np.array([joint.offset for joint in joints], dtype=np.float64),
        "rotation": np.array([joint.T_parent_joint[:3, :3] for joint in joints], dtype=np.float64).reshape(-1, 3, 3),
        "translation": np.array([joint.T_parent_joint[:3, 3] for joint in joints], dtype=np.float64).reshape(-1, 3),
        "dofs": robot.dof,
    }


def parts(
    build: Build,
    robot: Robot,
    *,
    points: Sequence[Point] = (),
    spheres: Sequence[Sphere] = (),
    share_ends: bool = True,
) -> tuple[dict[str, Any], list[Point]]:
    """The parts of a world that have no envelope, and its points: two a capsule, or one if its ends coincide and share_ends."""
    listed = list(points)
    ends = []
    capsules = [capsule for capsule in map(as_capsule, robot.shapes) if capsule is not None]
    for capsule in capsules:
        first = len(listed)
        listed.append((capsule.joint, capsule.a))
        if not (share_ends and np.array_equal(capsule.a, capsule.b)):
            listed.append((capsule.joint, capsule.b))
        ends.append((first, len(listed) - 1))
    kernel = build.module
    made = {
        "joints": kernel.Joints(**joint_arrays(robot)),
        "points": kernel.Points(
            joint=np.array([joint for joint, _ in listed], dtype=np.int32),
            local=np.array([local for _, local in listed], dtype=np.float64).reshape(-1, 3),
        ),
        "point_capsules": kernel.PointCapsules(
            a=np.array([a for a, _ in ends], dtype=np.int32),
            b=np.array([b for _, b in ends], dtype=np.int32),
            radius=np.array([c.radius for c in capsules], dtype=np.float64),
        ),
        "point_spheres": sphere_set(build, spheres),
    }
    return made, listed


def sphere_set(build: Build, spheres: Sequence[Sphere]) -> Any:
    return build.module.Spheres(
        center=np.array([s.center for s in spheres], dtype=np.float64).reshape(-1, 3),
        radius=np.array([s.radius for s in spheres], dtype=np.float64),
    )


def place(
    build: Build,
    robot: Robot,
    *,
    points: Sequence[Point] = (),
    spheres: Sequence[Sphere] = (),
    share_ends: bool = True,
    masses: dict[str, np.ndarray] | None = None,
) -> Placed:
    """Make a kernel model with two points a capsule, or one if its ends coincide and share_ends is set."""
    made, listed = parts(build, robot, points=points, spheres=spheres, share_ends=share_ends)
    weighed = None if masses is None else build.module.Masses(**masses)
    return Placed(build.named("Model")(build.module.World(**made, masses=weighed)), tuple(listed))


# ---- envelopes among obstacles ---------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Surrounded:
    """A kernel model with its envelope among obstacles.

    Attributes:
        native: the kernel's own object.
        pairs: (p, 2) the shapes that must keep clear of each other.
    """

    native: Any
    pairs: np.ndarray


def kernel_shape(build: Build, obstacle: Obstacle) -> Any:
    """A shape as the kernel's own object."""
    kernel = build.module
    if isinstance(obstacle, Sphere):
        return sphere_set(build, [obstacle])
    if isinstance(obstacle, Capsule):
        return kernel.Capsule(a=obstacle.a, b=obstacle.b, radius=obstacle.radius)
    if isinstance(obstacle, HalfSpace):
        return kernel.HalfSpace(normal=obstacle.normal, offset=float(obstacle.normal @ obstacle.point))
    if isinstance(obstacle, Polytope):
        return kernel.Polytope(vertices=obstacle.vertices.copy(), rounding=obstacle.rounding)
    assert isinstance(obstacle, (Box, Cylinder))
    rounding = obstacle.rounding
    center, axes = obstacle.pose[:3, 3].copy(), np.ascontiguousarray(obstacle.pose[:3, :3].T)
    if isinstance(obstacle, Box):
        return kernel.Box(center=center, axes=axes, half_size=obstacle.size / 2, rounding=rounding)
    half, axis = obstacle.length / 2, axes[2].copy()
    return kernel.Cylinder(center=center, axis=axis, half_length=half, radius=obstacle.radius, rounding=rounding)


def kernel_solid(build: Build, shape: ConvexShape) -> Any:
    """A link's shape that is no capsule as the kernel's own object."""
    kernel, core = build.module, core_of(shape)
    kind = getattr(kernel.CoreKind, core.kind)
    made = kernel.ConvexShape(kind=kind, half=core.half.copy(), radius=core.radius, vertices=np.array(core.vertices))
    return kernel.Solid(shape=made, axes=np.ascontiguousarray(core.T[:3, :3].T), origin=core.T[:3, 3].copy())


def single_shapes(obstacles: Sequence[Obstacle]) -> list[Obstacle]:
    """The obstacles, sets as their members."""
    out: list[Obstacle] = []
    for obstacle in obstacles:
        if isinstance(obstacle, SphereSet):
            out += [Sphere(c, float(r)) for c, r in zip(obstacle.centers, obstacle.radii, strict=True)]
        elif isinstance(obstacle, PolytopeSet):
            out += obstacle.pieces
        else:
            out.append(obstacle)
    return out


def surround(
    build: Build,
    robot: Robot,
    obstacles: Sequence[Obstacle] = (),
    *,
    points: Sequence[Point] = (),
    pair_margins: dict[str, np.ndarray] | None = None,
    masses: dict[str, np.ndarray] | None = None,
) -> Surrounded:
    """Make a kernel model whose bodies are arranged link by link, among obstacles of any shape."""
    shapes = robot.shapes
    links = sorted({(part.name, part.joint) for part in shapes})
    close = [
        (i, k)
        for one, two in robot.self_pairs
        for i, (name, _) in enumerate(links)
        for k, (other, _) in enumerate(links)
        if (name, other) == (one, two)
    ]
    kernel = build.module
    capsules = [as_capsule(part) for part in shapes]
    axes = [(np.zeros(3), np.zeros(3), 0.0) if c is None else (c.a, c.b, c.radius) for c in capsules]
    others = [i for i, c in enumerate(capsules) if c is None]
    envelope = kernel.Envelope(
        joint=np.array([part.joint for part in shapes], dtype=np.int32),
        link=np.array([links.index((part.name, part.joint)) for part in shapes], dtype=np.int32),
        a=np.array([a for a, _, _ in axes], dtype=np.float64).reshape(-1, 3),
        b=np.array([b for _, b, _ in axes], dtype=np.float64).reshape(-1, 3),
        radius=np.array([radius for _, _, radius in axes], dtype=np.float64),
        pairs=np.array(close, dtype=np.int32).reshape(-1, 2),
        solid=np.array([others.index(i) if i in others else -1 for i in range(len(shapes))], dtype=np.int32),
        solids=[kernel_solid(build, shapes[i].shape) for i in others],
    )
    world = kernel.World(
        **parts(build, robot, points=points)[0],
        envelope=envelope,
        obstacles=[kernel_shape(build, obstacle) for obstacle in single_shapes(obstacles)],
        pair_margins=None if pair_margins is None else kernel.PairMargins(**pair_margins),
        masses=None if masses is None else kernel.Masses(**masses),
    )
    native = build.named("Model")(world)
    names = [part.name for part in shapes]
    pairs = [
        (i, k)
        for one, two in robot.self_pairs
        for i, name in enumerate(names)
        for k, other in enumerate(names)
        if (name, other) == (one, two)
    ]
    return Surrounded(native, np.array(pairs, dtype=np.int32).reshape(-1, 2))
