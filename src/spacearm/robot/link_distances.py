"""How far two links are from each other in many configurations at once, whatever their shapes are.

Balls around links and around shapes come first; the kernel decides what they leave open.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from spacearm.core.exact import length, product
from spacearm.core.native import native
from spacearm.geometry.convex_cores import Core, bounding_points, core_of
from spacearm.robot.link_shapes import LinkShape
from spacearm.robot.model import Robot

Array = NDArray[np.float64]
Rows = NDArray[np.intp]

CONTACT = 1e-9
"""[m] links that are nearer than this meet: what touches is never free to move."""

_AT_ONCE = 1_000_000  # pairs of balls, so that the arrays stay small


@dataclass(frozen=True, slots=True, eq=False)
class LinkBody:
    """The shapes of a link, prepared.

    Attributes:
        joint: (k,) what each shape rides on, -1 for the base.
        poses: of the shapes' cores, (4, 4) each, in these joints' moving frames [m].
        shapes: as the kernel takes them, in their cores' frames.
        points: (p, 3) of each shape: its core lies in the hull of them [m].
        center: (k, 3) of a ball around each shape [m].
        reach: (k,) of this ball [m].
        is_ball: (k,) whether the shape is the ball.
    """

    joint: NDArray[np.intp]
    poses: tuple[Array, ...]
    shapes: tuple[native.ConvexShape, ...]
    points: tuple[Array, ...]
    center: Array
    reach: Array
    is_ball: NDArray[np.bool_]


@dataclass(frozen=True, slots=True, eq=False)
class PlacedBody:
    """The same in m configurations.

    Attributes:
        body: the shapes.
        frames: (m, 1 + joints, 4, 4) the frames of the base and the joints [m].
        center: (m, k, 3) of the balls around the shapes [m].
        middle: (m, 3) of a ball around the link [m].
        radius: (m,) of this ball [m].
        poses: of the cores that were asked for, (m, 4, 4) each.
    """

    body: LinkBody
    frames: Array
    center: Array
    middle: Array
    radius: Array
    poses: dict[int, Array] = field(default_factory=dict)

    def pose(self, shape: int) -> Array:
        """Return the pose of a shape's core (m, 4, 4)."""
        if shape not in self.poses:
            frames = self.frames[:, self.body.joint[shape] + 1]
            self.poses[shape] = np.ascontiguousarray(product(frames, self.body.poses[shape]))
        return self.poses[shape]


def body_of(parts: Iterable[LinkShape]) -> LinkBody:
    """Prepare the shapes of a link."""
    listed = tuple(parts)
    cores = tuple(core_of(part.shape) for part in listed)
    return LinkBody(
        joint=np.array([part.joint for part in listed], dtype=np.intp),
        poses=tuple(core.T for core in cores),
        shapes=tuple(map(_kernel_shape, cores)),
        points=tuple(bounding_points(part.shape)[0] for part in listed),
        center=np.array([core.T[:3, 3] for core in cores]).reshape(-1, 3),
        reach=np.array([_extent(core) + core.radius for core in cores]),
        is_ball=np.array([core.kind == "point" for core in cores], dtype=bool),
    )


def link_bodies(robot: Robot) -> dict[str, LinkBody]:
    """Prepare the shapes of each link of a robot, by its name."""
    links: dict[str, list[LinkShape]] = {}
    for part in robot.shapes:
        links.setdefault(part.name, []).append(part)
    return {name: body_of(parts) for name, parts in links.items()}


def placed(body: LinkBody, frames: Array) -> PlacedBody:
    """Place a link by the base's and the joints' frames (m, 1 + joints, 4, 4)."""
    center = np.empty((len(frames), len(body.joint), 3))
    for joint in np.unique(body.joint):
        own, T = body.joint == joint, frames[:, joint + 1]
        center[:, own] = product(T[:, :3, :3], body.center[own].T).swapaxes(1, 2) + T[:, None, :3, 3]
    middle = center.mean(axis=1)
    radius = (np.linalg.norm(center - middle[:, None], axis=2) + body.reach).max(axis=1)
    return PlacedBody(body, frames, center, middle, radius)


def distances(first: PlacedBody, second: PlacedBody, *, enough: float = np.inf) -> Array:
    """Return the signed distances (m,) of two links [m]: where they overlap, less the depth of the deepest two shapes.

    Args:
        first, second: the links, in the same configurations.
        enough: where the distance is this or more, the result is this or more, and no more than the distance.
    """
    gap = np.linalg.norm(first.middle - second.middle, axis=1) - first.radius - second.radius
    near = np.flatnonzero(gap < enough)
    step = max(1, _AT_ONCE // (len(first.body.shapes) * len(second.body.shapes)))
    for i in range(0, len(near), step):
        rows = near[i : i + step]
        gap[rows] = _distances(first, second, rows, enough)
    return gap


def _distances(first: PlacedBody, second: PlacedBody, rows: Rows, enough: float) -> Array:
    square = 0.0
    for axis in range(3):
        square += (first.center[rows, :, axis][:, :, None] - second.center[rows, :, axis][:, None]) ** 2
    least = np.sqrt(square) - (first.body.reach[:, None] + second.body.reach)  # (r, k, l), of the balls
    balls = first.body.is_ball[:, None] & second.body.is_ball
    best = np.minimum(least.min(axis=(1, 2), where=balls, initial=np.inf), enough)
    others = np.argwhere(~balls)
    for i, k in others[np.argsort(least.mean(axis=0)[~balls], kind="stable")]:
        open_rows = np.flatnonzero(least[:, i, k] < best)
        if len(open_rows):
            found = _of_shapes(first, int(i), second, int(k), rows[open_rows], float(best[open_rows].max()))
            best[open_rows] = np.minimum(best[open_rows], found)
    return best


def _of_shapes(first: PlacedBody, i: int, second: PlacedBody, k: int, rows: Rows, enough: float) -> Array:
    one, other = first.body.shapes[i], second.body.shapes[k]
    return native.convex_distances64(one, first.pose(i)[rows], other, second.pose(k)[rows], enough=enough)


def least_distance(first: PlacedBody, second: PlacedBody) -> tuple[float, float]:
    """Return the least signed distance of two links in m configurations [m], and the share of these in which they meet."""
    far = np.linalg.norm(first.middle - second.middle, axis=1) - first.radius - second.radius
    nearest = np.argsort(far)[:20]
    guess = float(_distances(first, second, nearest, np.inf).min())
    gap = distances(first, second, enough=max(guess, CONTACT))
    return min(guess, float(gap.min())), float((gap < CONTACT).mean())


def _kernel_shape(core: Core) -> native.ConvexShape:
    kind = native.CoreKind.segment if core.kind == "point" else getattr(native.CoreKind, core.kind)
    vertices = np.array(core.vertices, dtype=np.float64).reshape(-1, 3)
    return native.ConvexShape(kind=kind, half=np.array(core.half, dtype=np.float64), radius=core.radius, vertices=vertices)


def _extent(core: Core) -> float:
    """Return how far a core reaches from the origin of its own frame [m]."""
    if core.kind == "polytope":
        return float(np.linalg.norm(core.vertices, axis=1).max())
    return length(core.half[1:] if core.kind == "cylinder" else core.half)
