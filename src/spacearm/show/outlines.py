"""Outlines, extents, faces and cuts of shapes, for pictures in the plane and in space."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

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
    bounding_points,
    support,
)

Array = NDArray[np.float64]

_TURN = np.linspace(0.0, 2 * np.pi, 73)[:-1]
_COS, _SIN = np.cos(_TURN)[:, None], np.sin(_TURN)[:, None]
_STILL = 1e-12  # an axis that moves less than this share of itself along a coordinate does not move along it
_MOST_ARCS = 2000  # balls whose common outline is still worked out; each is compared with all others


def span(obstacle: Obstacle) -> tuple[Array, Array]:
    """Return the least and the greatest coordinates, (3,) each [m]; of a half-space, those of its point."""
    if isinstance(obstacle, SphereSet):
        reach = obstacle.radii[:, None]
        return (obstacle.centers - reach).min(axis=0), (obstacle.centers + reach).max(axis=0)
    if isinstance(obstacle, HalfSpace):
        return obstacle.point, obstacle.point
    if isinstance(obstacle, PolytopeSet):
        low, high = zip(*map(span, obstacle.pieces), strict=True)
        return np.min(low, axis=0), np.max(high, axis=0)
    return -support(obstacle, -np.eye(3)), support(obstacle, np.eye(3))


def middle(obstacle: Obstacle) -> Array:
    """Return the point (3,) by which obstacles are told nearer or farther [m]."""
    low, high = span(obstacle)
    return (low + high) / 2


def silhouette(obstacle: ConvexShape, across: Array, up: Array) -> Array:
    """Return the outline of a convex obstacle seen at right angles to two unit vectors.

    Args:
        obstacle: the obstacle.
        across, up: (3,) the picture's axes, at right angles.

    Returns:
        (k, 3) points of the obstacle, in the order of the outline, counter-clockwise [m].
    """
    disc = _COS * across + _SIN * up
    if isinstance(obstacle, Sphere):
        return obstacle.center + obstacle.radius * disc
    points, radius = bounding_points(obstacle)
    if isinstance(obstacle, Box):
        points = np.concatenate(box_faces(obstacle))
    elif isinstance(obstacle, Cylinder):
        points = np.concatenate(cylinder_ends(obstacle))
    if radius > 0:
        points = (points[:, None] + radius * disc).reshape(-1, 3)
    return points[hull(points @ np.column_stack([across, up]))]


def cut_off(body: ConvexShape, low: Array, high: Array) -> list[ConvexShape]:
    """Return what of a body is inside a box: a capsule's axis is cut there, with a flat end where it is."""
    if not isinstance(body, (Sphere, Capsule)):
        return _clipped(body, low, high)
    if isinstance(body, Sphere):
        return [body] if (body.center >= low).all() and (body.center <= high).all() else []
    along = body.b - body.a
    moves = np.abs(along) > _STILL * max(float(np.abs(along).max()), 1.0)
    if (~moves & ((body.a < low) | (body.a > high))).any():
        return []
    ends = np.sort(np.array([low - body.a, high - body.a])[:, moves] / along[moves], axis=0)
    first, last = max(0.0, float(ends[0].max())), min(1.0, float(ends[1].min()))
    if not first < last:
        return []
    if (first, last) == (0.0, 1.0):
        return [body]
    length = (last - first) * float(np.linalg.norm(along))
    pose = np.eye(4)
    pose[:3, 2] = along / np.linalg.norm(along)
    pose[:3, :2] = _plane_axes(pose[:3, 2])
    pose[:3, 3] = body.a + (first + last) / 2 * along
    parts: list[ConvexShape] = [Cylinder(radius=body.radius, length=length, pose=pose)]
    parts += [Sphere(end, body.radius) for end, kept in ((body.a, first == 0), (body.b, last == 1)) if kept]
    return parts


def _clipped(body: ConvexShape, low: Array, high: Array) -> list[ConvexShape]:
    """Return what of a shape with faces is inside a box, without its rounding, as a polytope."""
    least, greatest = span(body)
    if (least >= low).all() and (greatest <= high).all():
        return [body]
    kept: list[Array] = []
    for face in shape_faces(body):
        corners = face
        for axis in range(3):
            for bound, side in ((low[axis], 1.0), (high[axis], -1.0)):
                corners = _clipped_face(corners, side * (corners[:, axis] - bound)) if len(corners) else corners
        kept.append(corners)
    points = np.concatenate([*kept, np.zeros((0, 3))])
    return [Polytope(points)] if len(points) else []


def _clipped_face(corners: Array, height: Array) -> Array:
    """Return the part of a face (k, 3) where a height (k,) that is linear on it is not below 0 (Sutherland and Hodgman)."""
    kept: list[Array] = []
    for i in range(len(corners)):
        j = (i + 1) % len(corners)
        if height[i] >= 0:
            kept.append(corners[i])
        if (height[i] >= 0) != (height[j] >= 0):
            kept.append(corners[i] + height[i] / (height[i] - height[j]) * (corners[j] - corners[i]))
    return np.array(kept).reshape(-1, 3)


def shape_faces(shape: ConvexShape) -> list[Array]:
    """Return the flat faces of a shape without its rounding, (k, 3) each, counter-clockwise seen from outside [m].

    A cylinder has its ends and narrow strips of its side. A flat polytope has one face, seen from one side.
    """
    if isinstance(shape, Box):
        return box_faces(shape)
    if isinstance(shape, Cylinder):
        bottom, top = cylinder_ends(shape)
        rim = np.roll(bottom[::-1], 1, axis=0)  # the bottom's corners turn the other way round
        strips = [np.array([rim[i - 1], rim[i], top[i], top[i - 1]]) for i in range(len(top))]
        return [bottom, top, *strips]
    return _hull_faces(bounding_points(shape)[0])


def _hull_faces(points: Array) -> list[Array]:
    """Return the faces of the convex hull of points (k, 3); triangles in one plane are one face."""
    from scipy.spatial import ConvexHull, QhullError

    try:
        triangles = ConvexHull(points)
    except (QhullError, ValueError):  # flat
        normal = np.linalg.svd(points - points.mean(axis=0))[2][-1]
        return [points[hull(points @ _plane_axes(normal))]]
    faces: dict[tuple[float, ...], set[int]] = {}
    for corners, equation in zip(triangles.simplices.tolist(), np.round(triangles.equations, 6).tolist(), strict=True):
        faces.setdefault(tuple(equation), set()).update(corners)
    out = []
    for equation, corners in faces.items():
        flat = points[sorted(corners)]
        out.append(flat[hull(flat @ _plane_axes(np.array(equation[:3])))])
    return out


def box_faces(box: Box) -> list[Array]:
    """Return the six faces, (4, 3) each, counter-clockwise seen from outside [m]: -x, +x, -y, +y, -z, +z."""
    faces = []
    for axis in range(3):
        u, v = np.roll(np.eye(3), axis, axis=1)[1:]
        for side in (-1.0, 1.0):
            corners = [(-1, -1), (1, -1), (1, 1), (-1, 1)][:: int(side)]
            local = [(side * np.eye(3)[axis] + a * u + b * v) * box.size / 2 for a, b in corners]
            faces.append(np.array(local) @ box.pose[:3, :3].T + box.pose[:3, 3])
    return faces


def cylinder_ends(cylinder: Cylinder) -> list[Array]:
    """Return the two rims, (72, 3) each, counter-clockwise seen from outside [m]: -z, +z."""
    ends = []
    for side in (-1.0, 1.0):
        rim = np.column_stack([_COS, side * _SIN, np.full_like(_COS, side * cylinder.length / 2 / cylinder.radius)])
        ends.append(cylinder.radius * rim @ cylinder.pose[:3, :3].T + cylinder.pose[:3, 3])
    return ends


def hull(points: Array) -> NDArray[np.intp]:
    """Return the indices of the corners of the convex hull of points (k, 2), counter-clockwise (monotone chain)."""
    order = np.lexsort((points[:, 1], points[:, 0]))
    halves = []
    for sequence in (order, order[::-1]):
        chain: list[int] = []
        for i in sequence.tolist():
            while len(chain) > 1 and _turn(points[chain[-2]], points[chain[-1]], points[i]) <= 0:
                chain.pop()
            chain.append(i)
        halves.append(chain[:-1])
    return np.array([*halves[0], *halves[1]] or [int(order[0])], dtype=np.intp)


def _turn(a: Array, b: Array, c: Array) -> float:
    return float((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))


def common_outline(centers: Array, radii: Array) -> Array:
    """Return the outline of discs in the plane that overlap, as one line with gaps.

    Args:
        centers: (k, 2) [m].
        radii: (k,) [m].

    Returns:
        (m, 2) points [m], NaN where the pen is lifted; empty if there are too many discs to draw one.
    """
    if len(centers) > _MOST_ARCS:
        return np.empty((0, 2))
    turn = np.linspace(0.0, 2 * np.pi, 97 if len(centers) < 200 else 33)
    circle = np.column_stack([np.cos(turn), np.sin(turn)])
    parts = []
    for i, (center, radius) in enumerate(zip(centers, radii, strict=True)):
        rim = center + radius * circle
        near = np.linalg.norm(centers - center, axis=1) < radius + radii
        near[i] = False
        apart = np.linalg.norm(rim[:, None] - centers[near], axis=2) - radii[near]
        rim[(apart < -1e-9 * radius).any(axis=1)] = np.nan
        parts += [rim, np.full((1, 2), np.nan)]
    return np.concatenate(parts)


def cut(half_space: HalfSpace, low: Array, high: Array) -> Array:
    """Return where the plane of a half-space cuts a box, (k, 3) corners in order [m]; empty if it does not."""
    corners = np.stack(np.meshgrid(*zip(low, high, strict=True), indexing="ij"), axis=-1).reshape(-1, 3)
    height = (corners - half_space.point) @ half_space.normal
    a, b = np.nonzero(np.triu((corners[:, None] != corners).sum(axis=2) == 1))  # the box's edges
    crossed = (height[a] > 0) != (height[b] > 0)
    a, b = a[crossed], b[crossed]
    share = (height[a] / (height[a] - height[b]))[:, None]
    points = corners[a] + share * (corners[b] - corners[a])
    if len(points) < 3:
        return np.empty((0, 3))
    return points[hull(points @ _plane_axes(half_space.normal))]


def cut_in_plane(half_space: HalfSpace, low: Array, high: Array) -> Array:
    """Return the part of a rectangle in the plane z = 0 that is solid, (k, 2) corners in order [m]; empty if none is.

    A half-space whose boundary does not cross the plane z = 0 covers all of it or nothing, and is left out.
    """
    corners = np.array([[low[0], low[1]], [high[0], low[1]], [high[0], high[1]], [low[0], high[1]]])
    normal = half_space.normal
    if np.hypot(normal[0], normal[1]) < 1e-9:
        return np.empty((0, 2))
    height = (corners - half_space.point[:2]) @ normal[:2] - half_space.point[2] * normal[2]
    kept = []
    for i in range(4):
        j = (i + 1) % 4
        if height[i] <= 0:
            kept.append(corners[i])
        if (height[i] <= 0) != (height[j] <= 0):
            kept.append(corners[i] + height[i] / (height[i] - height[j]) * (corners[j] - corners[i]))
    return np.array(kept, dtype=np.float64).reshape(-1, 2)


def _plane_axes(normal: Array) -> Array:
    """Return two unit vectors in a plane, (3, 2)."""
    u = np.asarray(np.cross(normal, np.eye(3)[int(np.argmin(np.abs(normal)))]), dtype=np.float64)
    u /= np.linalg.norm(u)
    return np.column_stack([u, np.asarray(np.cross(normal, u), dtype=np.float64)])
