"""What is nearest now: the pair of bodies that lacks most of the clearance required of it, its distance and its nearest points.

It is measured at one configuration, natively, and the points by Coal. Nothing here is a proof.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from spacearm.core.exact import product
from spacearm.geometry import ConvexShape, HalfSpace, Obstacle, PolytopeSet, Scene, SphereSet
from spacearm.geometry.scene import moved_scene
from spacearm.planner.clearance import ClearanceModel, clearance_model
from spacearm.planner.problem import Problem
from spacearm.proof.witness import CoalShape, coal, coal_shape
from spacearm.robot.kinematics import base_and_joint_frames
from spacearm.robot.unchecked_pairs import lacks_envelope

Array = NDArray[np.float64]
Tone = Literal["good", "near", "bad", "plain"]

_MOST_PARTS = 64  # shapes of one obstacle that are measured by Coal
_REMEMBERED = 256  # shapes of Coal


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Nearest:
    """The pair that lacks most of what is required of it; where none lacks anything, the nearest.

    Attributes:
        clearance: measured [m]; negative is penetration.
        required: [m].
        first: name of the link.
        other: what it is nearest to, as in "obstacle 'mast'".
        obstacle: its place in the scene; -1: it is a link.
        points: (2, 3) the nearest points, inertial frame [m]; None where Coal has no answer.
    """

    clearance: float
    required: float
    first: str
    other: str
    obstacle: int
    points: Array | None

    @property
    def tone(self) -> Tone:
        """How it is: "bad" in contact, "near" with less than is required, else "good"."""
        return "bad" if self.clearance <= 0 else "near" if self.clearance < self.required else "good"

    @property
    def message(self) -> str:
        """The pair and its distance, in words."""
        if self.clearance <= 0:
            return self.pair
        return f"{self.clearance * 1e3:.4g} mm: {self.pair}"

    @property
    def pair(self) -> str:
        """The pair in words, and what it lacks."""
        pair = f"link '{self.first}' and {self.other}"
        if self.clearance <= 0:
            return f"{pair} penetrate by {-self.clearance * 1e3:.4g} mm" if self.clearance < -1e-9 else f"{pair} touch"
        return pair + (f"; {self.required * 1e3:.4g} mm are asked for" if self.clearance < self.required else "")


def nearest(problem: Problem, q: Array, T_w_b: Array) -> Nearest | None:
    """Return the nearest pair of a configuration.

    Args:
        problem: robot, scene and clearances.
        q: (n,) joint positions [rad or m].
        T_w_b: (4, 4) where the base is [m].

    Returns:
        The pair; None without obstacles and pairs of links, or without an envelope.
    """
    if lacks_envelope(problem.robot) or not problem.robot.shapes:
        return None
    model, scene = _model(problem, T_w_b)
    to_scene, between = model.measured(q[None])
    required = model.required_by(problem)
    pairs = [
        _least(to_scene[0], required.to_obstacles, to_scene[0].shape),
        _least(between[0], required.between_links, between[0].shape),
    ]
    if not any(pairs):
        return None
    which = min((i for i, pair in enumerate(pairs) if pair is not None), key=lambda i: pairs[i].order)  # type: ignore[union-attr]
    found = pairs[which]
    assert found is not None
    links, frames = problem.robot.shapes, base_and_joint_frames(problem.robot, q[None])[0]
    if which == 1:
        one, two = (int(i) for i in model.pairs[found.place[0]])
        first, second, obstacle = one, links[two].shape, -1
        other, at = f"link '{links[two].name}'", frames[links[two].joint + 1]
        parts: list[ConvexShape | HalfSpace] = [second]
    else:
        first, kernels = found.place
        obstacle = int(model.obstacle_of[kernels])
        parts = parts_of(scene.obstacles[obstacle], kernels - int(np.argmax(model.obstacle_of == obstacle)))
        other, at = f"obstacle {problem.scene.called(obstacle)}", np.eye(4)
    points = _points(links[first].shape, frames[links[first].joint + 1], parts, at)
    return Nearest(
        clearance=found.clearance,
        required=found.required,
        first=links[first].name,
        other=other,
        obstacle=obstacle,
        points=None if points is None else product(points, T_w_b[:3, :3].T) + T_w_b[:3, 3],
    )


def _model(problem: Problem, T_w_b: Array) -> tuple[ClearanceModel, Scene]:
    """Return a problem's clearances and its scene as they are seen from a base."""
    if np.array_equal(T_w_b, problem.base_start):
        return problem.at_start, problem.local.scene
    T_b_w = np.eye(4)
    T_b_w[:3, :3], T_b_w[:3, 3] = T_w_b[:3, :3].T, -T_w_b[:3, :3].T @ T_w_b[:3, 3]
    scene = moved_scene(problem.scene, T_b_w)
    return clearance_model(problem.robot, scene), scene


@dataclass(frozen=True, slots=True)
class _Pair:
    place: tuple[int, ...]
    clearance: float
    required: float

    @property
    def order(self) -> tuple[float, float]:
        return min(self.clearance - self.required, 0.0), self.clearance


def _least(clearances: Array, required: Array, shape: tuple[int, ...]) -> _Pair | None:
    if not clearances.size:
        return None
    lacking = np.minimum(clearances - required, 0.0).ravel()
    flat = clearances.ravel()
    i = int(np.lexsort((flat, lacking))[0]) if lacking.any() else int(np.argmin(flat))
    return _Pair(tuple(int(k) for k in np.unravel_index(i, shape)), float(flat[i]), float(required.ravel()[i]))


def parts_of(obstacle: Obstacle, index: int) -> list[ConvexShape | HalfSpace]:
    """Return a convex part of an obstacle by its place among the kernel's, or where that is not known, all of them."""
    if isinstance(obstacle, SphereSet):
        from spacearm.geometry import Sphere

        chosen = (index,) if 0 <= index < len(obstacle.centers) else range(min(_MOST_PARTS, len(obstacle.centers)))
        return [*(Sphere(obstacle.centers[i], float(obstacle.radii[i])) for i in chosen)]
    if isinstance(obstacle, PolytopeSet):
        return [obstacle.pieces[index]] if 0 <= index < len(obstacle.pieces) else list(obstacle.pieces[:_MOST_PARTS])
    return [obstacle]


def _points(first: ConvexShape, T: Array, parts: list[ConvexShape | HalfSpace], U: Array) -> Array | None:
    """Return the nearest points (2, 3) of a shape at T and of what is nearest of some shapes at U."""
    library, best = coal(), (np.inf, None)
    request = library.DistanceRequest()
    for part in parts:
        (one, A), (two, B) = _made(first), _made(part)
        result = library.DistanceResult()
        places = [product(T, A), product(U, B)]
        at = [library.Transform3s(place[:3, :3].copy(), place[:3, 3].copy()) for place in places]
        distance = float(library.distance(one, at[0], two, at[1], request, result))
        points = np.array([result.getNearestPoint1(), result.getNearestPoint2()])
        if np.isfinite(points).all() and distance < best[0]:
            best = (distance, points)
    return best[1]


def _made(shape: ConvexShape | HalfSpace) -> tuple[CoalShape, Array]:
    if isinstance(shape, HalfSpace):
        return coal().Halfspace(shape.normal, float(shape.normal @ shape.point)), np.eye(4)
    known = _coal_shapes.get(id(shape))
    if known is None or known[0] is not shape:
        if len(_coal_shapes) >= _REMEMBERED:
            _coal_shapes.clear()
        known = _coal_shapes[id(shape)] = (shape, coal_shape(shape))
    return known[1]


_coal_shapes: dict[int, tuple[ConvexShape, tuple[CoalShape, Array]]] = {}
