"""Paths that turn far, straight ones and bent ones, and what is bounded of a robot's bodies on stretches of them."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
from hypothesis import strategies as st

from spacearm.dynamics import BASE_MODELS, Momentum
from spacearm.geometry import Scene
from spacearm.motion import Curve, Motion, PiecewisePath
from spacearm.proof.base_proofs import BaseSetup, begun_base_proof
from spacearm.proof.body_motion import Midpoints
from spacearm.proof.claim import Claim, claim_of
from spacearm.proof.path_intervals import Intervals, PathIntervals
from spacearm.proof.required_clearance import required_clearance
from spacearm.robot import Robot
from support.drawn_claims import frames_at
from support.drawn_links import points_of


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


@st.composite
def stretches(draw: st.DrawFn, path: PathIntervals, deepest: int = 10) -> Intervals:
    """One of the intervals that a path is halved into."""
    out = path.whole()
    for _ in range(draw(st.integers(0, deepest))):
        out = path.halved(out).select(np.array([draw(st.integers(0, 1))]))
    return out


def claim_along(robot: Robot, curve: Curve, *, duration: float = 1.0, momentum: Momentum | None = None) -> Claim:
    """A claim of the pairs of a robot's links alone, along a curve, on the robot's own base."""
    pushed = Momentum() if momentum is None else momentum
    setup = BaseSetup(model=BASE_MODELS[robot.base], start=np.eye(4), linear=pushed.linear, angular=pushed.angular)
    trajectory: Any = SimpleNamespace(curve=curve, duration=duration)
    base = begun_base_proof(robot, trajectory, setup)
    return claim_of(robot, Scene([]), base, PathIntervals(curve), required=required_clearance(robot, Scene([]), 0.0))


class BodyBounds(NamedTuple):
    """What is bounded of a body's motion in the frame of another one, on a stretch of half length h.

    Attributes:
        first, second: D1 and D2 [m].
        along: (k, 3) the velocities of points times h, in the inertial frame [m].
    """

    first: float
    second: float
    along: np.ndarray


class BodyMotion:
    """The bodies of a claim on one stretch of its path."""

    def __init__(self, claim: Claim, stretch: Intervals) -> None:
        self.claim, self.stretch, self.midpoints = claim, stretch, Midpoints(claim, stretch)

    def shape(self, number: int) -> int:
        """The body of a shape of the robot."""
        return int(np.flatnonzero(self.claim.bodies.shape == number)[0])

    def moving(self) -> list[tuple[int, int]]:
        """Shapes of the table, and the frames in which they move: the inertial one, and other links'."""
        bodies, motion_of = self.claim.bodies, self.claim.pairs.motion_of
        return [
            (body, seen)
            for body in np.flatnonzero((bodies.shape >= 0) & (bodies.members == 0)).tolist()
            for seen in np.flatnonzero(motion_of[bodies.frame[body]] >= 0).tolist()
        ]

    def bounds(self, body: int, seen: int, points: np.ndarray) -> BodyBounds:
        """What is bounded of a body in a frame, and the velocities of its points (k, 3)."""
        bodies, midpoints = self.claim.bodies, self.midpoints
        frame = int(bodies.frame[body])
        motion = np.array([self.claim.pairs.motion_of[frame, seen]])
        R, place = midpoints.R[frame], midpoints.place[frame]
        center = (R @ bodies.center[body] + place)[None]
        first, second = midpoints.displacements(np.zeros(1, np.intp), motion, center, bodies.reach[[body]])
        velocity = np.cross(midpoints.omega[motion[0]], points @ R.T + place) + midpoints.velocity[motion[0]]
        return BodyBounds(float(first[0]), float(second[0]), velocity * midpoints.half[0])

    def moved(self, u: np.ndarray, body: int, seen: int, points: np.ndarray) -> np.ndarray:
        """How far points (k, 3) of a body get in a frame from where they are at the midpoint, (r, k, 3), in inertial axes."""
        T = frames_at(self.claim, np.append(u, self.stretch.ends.mean(axis=1)))
        at = np.linalg.inv(T[:, seen]) @ T[:, self.claim.bodies.frame[body]]
        x = points @ np.swapaxes(at[:, :3, :3], 1, 2) + at[:, None, :3, 3]
        return (x[:-1] - x[-1:]) @ T[-1, seen, :3, :3].T

    def points(self, body: int, count: int, rng: np.random.Generator) -> np.ndarray:
        """Points (count, 3) of a body's core, by the definition of its shape."""
        return points_of(self.claim.robot.shapes[self.claim.bodies.shape[body]].shape, count, rng)

    def require_bounded(self, n: np.ndarray, seed: int = 0, *, instants: int = 30) -> None:
        """No point of a core gets further than D1, nor further along a direction than by its velocity and D2."""
        rng = np.random.default_rng(seed)
        u = np.concatenate([self.stretch.ends[0], rng.uniform(*self.stretch.ends[0], instants)])
        for body, seen in self.moving():
            points = self.points(body, 40, rng)
            bound, moved = self.bounds(body, seen, points), self.moved(u, body, seen, points)
            size = 1e-9 * (1 + np.abs(points).max())
            assert np.linalg.norm(moved, axis=2).max() <= bound.first + size
            assert (np.abs(moved @ n) <= np.abs(bound.along @ n) + bound.second + size).all()
