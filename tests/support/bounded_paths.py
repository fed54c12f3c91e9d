"""Paths that turn far, straight ones and bent ones, and what is bounded of a robot's relative bodies on them."""

from __future__ import annotations

import numpy as np
from hypothesis import strategies as st

from spacearm.motion import Curve, Motion, PiecewisePath
from spacearm.proof.bodies import JointMap, bodies_of
from spacearm.proof.displacement import IntervalMidpoints
from spacearm.proof.path_intervals import Intervals, PathIntervals
from spacearm.proof.witness import Witness
from spacearm.robot import Robot


def bounded(robot: Robot, curve: Curve, intervals: Intervals | None = None) -> tuple[IntervalMidpoints, Intervals]:
    """All relative bodies on a interval of a curve; on all of it if none is given."""
    path = PathIntervals(curve)
    if intervals is None:
        first = path.first()
        whole = np.array([[first.ends[0, 0], first.ends[-1, 1]]])
        intervals = Intervals(first=first.first[:1], last=first.last[-1:], ends=whole, share=np.ones(1))
    bodies, relative_bodies = bodies_of(robot)
    witness = Witness(robot, bodies)
    midpoints = IntervalMidpoints(
        bodies, relative_bodies, JointMap(robot), lambda _, values: witness.frames(values), path.linear_bounds(intervals)
    )
    midpoints.bound(np.arange(len(relative_bodies.body)))
    return midpoints, intervals


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
    """The first joint moves by so much from the middle of the first interval, where it stands still, to its ends."""
    m = float(PathIntervals(line((0,), (0,))).first().ends[0].mean())
    points = np.zeros((1, 3, joints))
    points[0, :, 0] = rise, rise * (1 - 1 / m), rise * (1 / m - 1) ** 2
    return PiecewisePath([0, 1], points)


def line(*q: tuple[float, ...]) -> PiecewisePath:
    return PiecewisePath.from_linear(np.arange(len(q)), q)
