"""What a family draws: a problem told in the base's frame at the beginning, with ends that are still to be reached for."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm.planner import BaseLimits, PoseGoal, PositionGoal
from spacearm.robot import Robot
from spacearm.scene import Capsule, Obstacle

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Site:
    """A robot as the families see it; all lengths of a scene are scaled to it.

    Attributes:
        robot: with a base that floats.
        shoulder: (3,) where its arm begins to reach out, in the base's frame [m].
        scale: of the scene; 1 suits an arm that reaches 0.87 m.
        along: axis of the tip's frame that points out of the hand.
    """

    robot: Robot
    shoulder: tuple[float, float, float]
    scale: float = 1.0
    along: Literal["x", "z"] = "z"

    def at(self, offset: ArrayLike) -> Array:
        """Return a point by its offset from the shoulder, (3,) before scaling."""
        return np.array(self.shoulder) + self.scale * np.asarray(offset, dtype=np.float64)


@dataclass(frozen=True, slots=True, kw_only=True)
class Draft:
    """A problem as it is drawn, in the base's frame at the beginning.

    Attributes:
        robot: what moves.
        obstacles: what is in the way.
        start: where the arm's tip, or each arm's, begins.
        goal: where it ends.
        in_joints: whether the goal is told as joint positions that reach it with the base at rest, rather than in space.
        keep_attitude: the base is to end as it began, within this angle [rad]; None: as it comes.
        limits: how little the base may be disturbed.
    """

    robot: Robot
    obstacles: tuple[Obstacle, ...]
    start: tuple[PositionGoal | PoseGoal, ...]
    goal: tuple[PositionGoal | PoseGoal, ...]
    in_joints: bool
    keep_attitude: float | None = None
    limits: BaseLimits = field(default_factory=BaseLimits)


Family: TypeAlias = Callable[[np.random.Generator], Draft]
"""Draws a problem."""

Asked: TypeAlias = tuple[float | None, BaseLimits]
"""Within what angle the base is to end as it began, and how little it may be disturbed."""


def asked_of_the_base(rng: np.random.Generator, *, in_joints: bool, peak: tuple[float, float]) -> Asked:
    """Draw what is asked of the base: nothing, to end as it began, or to turn little.

    Args:
        rng: of the problem.
        in_joints: no attitude is asked for at the end then.
        peak: range of the limit of its greatest angle [deg].
    """
    kind = rng.choice(["nothing", "attitude", "peak"], p=[0.5, 0.25, 0.25])
    limit, tolerance = math.radians(round(rng.uniform(*peak), 1)), math.radians(0.5)
    if kind == "attitude" and not in_joints:
        return tolerance, BaseLimits()
    return None, BaseLimits(peak=limit) if kind == "peak" else BaseLimits()


def direction(bearing: float, elevation: float) -> Array:
    """Return the unit vector (3,) at a bearing from x towards y and an elevation towards z [rad]."""
    c = math.cos(elevation)
    return np.array([c * math.cos(bearing), c * math.sin(bearing), math.sin(elevation)])


def frame_along(z: ArrayLike, turn: float = 0.0) -> Array:
    """Return a rotation (3, 3) whose third column is a direction, turned about it by an angle [rad]."""
    third = np.asarray(z, dtype=np.float64) / np.linalg.norm(z)
    helper = np.array([0.0, 0.0, 1.0]) if abs(third[2]) < 0.9 else np.array([1.0, 0.0, 0.0])
    first = np.cross(helper, third)
    first /= np.linalg.norm(first)
    second = np.cross(third, first)
    c, s = math.cos(turn), math.sin(turn)
    return np.column_stack([c * first + s * second, c * second - s * first, third])


def transform(rotation: Array, origin: ArrayLike) -> Array:
    """Return the transform (4, 4) of a rotation (3, 3) and an origin (3,) [m]."""
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = rotation, origin
    return T


def hand_at(
    site: Site, point: ArrayLike, pointing: ArrayLike, *, frame: str | None = None, within: float = math.radians(2)
) -> PoseGoal:
    """Return the goal of a hand at a point that points in a direction, turned about it as it likes.

    Args:
        site: the robot.
        point: (3,) of the tip, in the base's frame [m].
        pointing: (3,) direction out of the hand.
        frame: of the tip; None: the robot's.
        within: of the direction [rad].
    """
    R = frame_along(pointing)
    if site.along == "x":
        R = R[:, [2, 0, 1]]
    return PoseGoal(
        transform(R, point),
        position_tolerance=0.002 * site.scale,
        orientation_tolerance=within,
        free_axis=site.along,
        frame=frame,
    )


def tip_at(site: Site, point: ArrayLike, *, frame: str | None = None) -> PositionGoal:
    """Return the goal of a tip at a point (3,), in the base's frame [m], the hand pointing anywhere."""
    return PositionGoal(np.asarray(point, dtype=np.float64), tolerance=0.002 * site.scale, frame=frame)


def rods(ends: Sequence[tuple[Array, Array]], radius: float, T: Array, name: str) -> tuple[Capsule, ...]:
    """Return rods between points told in a frame T (4, 4) [m]."""
    return tuple(
        Capsule(T[:3, :3] @ a + T[:3, 3], T[:3, :3] @ b + T[:3, 3], radius, name=f"{name} {i + 1}")
        for i, (a, b) in enumerate(ends)
    )
