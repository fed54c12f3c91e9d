"""Drawn motions, and the same spline by SciPy."""

from __future__ import annotations

import numpy as np
from hypothesis import strategies as st
from scipy.interpolate import BSpline

from spacearm.motion import Motion, PiecewisePath
from spacearm.robot import Robot

INTERIORS = st.integers(0, 6)


@st.composite
def motions(draw: st.DrawFn, size: float = 10.0, least: int = 0) -> Motion:
    """Motions of 1 to 4 joints with K from 0 to 6; some joints rest."""
    n, interior = draw(st.integers(1, 4)), draw(st.integers(least, 6))
    number = st.one_of(st.sampled_from([0.0, 1.0, -1.0]), st.floats(-size, size, allow_subnormal=False))
    points = np.array([[draw(number) for _ in range(n)] for _ in range(interior + 2)])
    rests = draw(st.lists(st.booleans(), min_size=n, max_size=n))
    points[:, rests] = points[0, rests]
    return Motion(points)


@st.composite
def motions_of(draw: st.DrawFn, robot: Robot, most: int = 4) -> Motion:
    """Motions whose control points are within a robot's limits."""
    count = draw(st.integers(0, most)) + 2
    share = st.one_of(st.sampled_from([0.0, 0.5, 1.0]), st.floats(0.0, 1.0, allow_subnormal=False))
    shares = np.array([[draw(share) for _ in range(robot.dof)] for _ in range(count)])
    lower, upper = np.maximum(robot.lower, -np.pi), np.minimum(robot.upper, np.pi)
    return Motion(np.clip(lower + shares * (upper - lower), lower, upper))


def scipy_spline(motion: Motion) -> BSpline:
    """The same curve: the start and the goal three times, uniform inner knots."""
    points = motion.control_points
    repeated = np.vstack([points[:1], points[:1], points, points[-1:], points[-1:]])
    inner = np.linspace(0, 1, motion.interior + 2)[1:-1]
    return BSpline(np.concatenate([np.zeros(6), inner, np.ones(6)]), repeated, 5)


def size_of(motion: Motion, derivative: int) -> float:
    """The scale of a derivative's numbers, by which its rounding is judged."""
    return float(np.abs(motion.control_points).max()) * (5.0 * (motion.interior + 1)) ** derivative + 1e-300


def is_continuous(path: PiecewisePath, derivative: int = 0) -> bool:
    """Whether a derivative, and all before it, have no jump."""
    return not any(path.jumps(k).any() for k in range(derivative + 1))
