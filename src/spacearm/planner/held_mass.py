"""What something held weighs, and how it resists being turned."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm.checks import as_number, as_readonly
from spacearm.errors import RobotError
from spacearm.robot import Body
from spacearm.robot.yaml_parts import require_of_a_body
from spacearm.scene import Box, Capsule, Cylinder, Obstacle, Sphere, SphereSet

Array = NDArray[np.float64]

_POINTS = 64  # along the longest edge of the box around a sphere set


def held_body(
    name: str, joint: int, T_joint_own: Array, obstacle: Obstacle, mass: Any, com: ArrayLike | None, inertia: ArrayLike | None
) -> Body | None:
    """Return the body of something held; None if nothing says what it weighs.

    Args:
        name: of it.
        joint: that carries it.
        T_joint_own: (4, 4) from its own frame to that joint's [m].
        obstacle: its shape, with its own frame's origin in its middle.
        mass: [kg], or None.
        com: (3,) in its own frame [m]; None: that of the shape, evenly filled.
        inertia: (3, 3) about that centre along the axes of its own frame, or its entries xx, yy, zz, xy, xz, yz [kg m^2];
            None: that of the shape, evenly filled.

    Raises:
        RobotError: a centre or an inertia without a mass, or numbers that are no body's.
    """
    if mass is None:
        if com is not None or inertia is not None:
            raise RobotError(
                f"{'inertia' if com is None else 'com'} of '{name}' is given without mass, expected both; give mass"
            )
        return None
    kilograms = as_number(f"mass of '{name}'", mass, RobotError, above=0, unit="kg")
    middle, second = _even(obstacle)
    if com is not None:
        middle = as_readonly(f"com of '{name}'", com, (3,), RobotError)
    about = kilograms * second if inertia is None else _inertia(f"inertia of '{name}'", inertia)
    require_of_a_body(f"'{name}'", about)
    R = T_joint_own[:3, :3]
    turned = R @ about @ R.T
    return Body(
        name=name,
        joint=joint,
        mass=kilograms,
        com=R @ middle + T_joint_own[:3, 3],
        inertia=(turned + turned.T) / 2,
    )


def _inertia(what: str, given: ArrayLike) -> Array:
    advice = "give a matrix (3, 3), or its entries xx, yy, zz, xy, xz, yz"
    if np.ndim(given) == 1:  # type: ignore[arg-type]
        xx, yy, zz, xy, xz, yz = as_readonly(what, given, (6,), RobotError, advice=advice)
        return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    return as_readonly(what, given, (3, 3), RobotError, advice=advice)


def _even(obstacle: Obstacle) -> tuple[Array, Array]:
    """Return the centre of mass (3,) [m] and the inertia per mass about it (3, 3) [m^2] of a shape that is evenly filled."""
    none = np.zeros(3)
    if isinstance(obstacle, Sphere):
        return none, 0.4 * obstacle.radius**2 * np.eye(3)
    if isinstance(obstacle, Box):
        squared = np.square(obstacle.size)
        return none, np.diag(squared.sum() - squared) / 12
    if isinstance(obstacle, Cylinder):
        across = obstacle.radius**2 / 4 + obstacle.length**2 / 12
        return none, np.diag([across, across, obstacle.radius**2 / 2])
    if isinstance(obstacle, Capsule):
        return none, _capsule(obstacle.b - obstacle.a, obstacle.radius)
    assert isinstance(obstacle, SphereSet), "nothing else can be held"
    return _balls(obstacle)


def _capsule(along: Array, radius: float) -> Array:
    """Return the inertia per mass of a cylinder with half a ball on each end."""
    length = float(np.linalg.norm(along))
    if length == 0:
        return 0.4 * radius**2 * np.eye(3)
    share = length / (length + 4 / 3 * radius)  # of the mass in the cylinder
    axial = share * radius**2 / 2 + (1 - share) * 0.4 * radius**2
    across = share * (length**2 / 12 + radius**2 / 4)
    across += (1 - share) * (0.4 * radius**2 + length**2 / 4 + 0.375 * length * radius)
    z = along / length
    return across * np.eye(3) + (axial - across) * np.outer(z, z)


def _balls(balls: SphereSet) -> tuple[Array, Array]:
    """Return the same of balls that overlap, by points on a grid: good to about two percent."""
    low = (balls.centers - balls.radii[:, None]).min(axis=0)
    high = (balls.centers + balls.radii[:, None]).max(axis=0)
    step = float((high - low).max()) / _POINTS
    counts = [max(1, math.ceil(edge / step)) for edge in (high - low).tolist()]
    axes = [lo + (np.arange(n) + 0.5) * (edge / n) for lo, edge, n in zip(low, high - low, counts, strict=True)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    inside = np.zeros(len(points), dtype=bool)
    for center, radius in zip(balls.centers, balls.radii, strict=True):
        inside |= np.einsum("pc,pc->p", points - center, points - center) <= radius**2
    if not inside.any():  # balls far smaller than the grid: their centres will do
        points, inside = balls.centers, np.ones(len(balls.centers), dtype=bool)
    filled = points[inside]
    middle = filled.mean(axis=0)
    off = filled - middle
    second = off.T @ off / len(filled) + np.eye(3) * step**2 / 12
    return middle, np.trace(second) * np.eye(3) - second
