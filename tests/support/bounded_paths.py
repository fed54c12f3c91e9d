"""Paths that turn far, straight ones and bent ones, and what is bounded of a robot's relative bodies on them."""

from __future__ import annotations

import numpy as np
from hypothesis import strategies as st

from spacearm.motion import Curve, Motion, PiecewisePath
from spacearm.proof.path_intervals import Intervals, PathIntervals
from spacearm.robot import Robot


@st.composite
def curves(draw: st.DrawFn, robot: Robot) -> Curve:
    """Motions, and paths of lines and cubics, that may turn far."""
    size = draw(st.sampled_from([0.05, 1.0, 3.0]))
    count = draw(st.integers(2, 24))
    numbers = st.lists(st.floats(-size, size, allow_subnormal=False), min_size=robot.dof, max_size=robot.dof)
    q = np.array([draw(numbers) for _ in range(count)])
    if count <= 6 and draw(st.booleans()):
        return Motion(q)
    make = draw(st.sampled_from([PiecewisePath.from_linear, PiecewisePath.from_cubic]))
    return make(np.arange(count) / 2, q)


def parabola(rise: float, joints: int = 2) -> PiecewisePath:
    """The first joint moves by so much from the middle of the first sixteenth, where it stands still, to its ends."""
    m = 1 / 32
    points = np.zeros((1, 3, joints))
    points[0, :, 0] = rise, rise * (1 - 1 / m), rise * (1 / m - 1) ** 2
    return PiecewisePath([0, 1], points)


def line(*q: tuple[float, ...]) -> PiecewisePath:
    return PiecewisePath.from_linear(np.arange(len(q)), q)


def parts(path: PathIntervals, times: int = 4) -> Intervals:
    """The intervals of a path that was halved so often."""
    out = path.whole()
    for _ in range(times):
        out = path.halved(out)
    return out
