"""Distances by Coal: the one place where shapes are converted."""

from __future__ import annotations

import coal
import numpy as np

from scipy.spatial import ConvexHull

from spacearm.geometry import (
    Box,
    Capsule,
    Cylinder,
    HalfSpace,
    Obstacle,
    Polytope,
    PolytopeSet,
    Scene,
    Sphere,
    SphereSet,
)
from spacearm.robot import LinkCapsule, Robot

Placed = tuple[coal.CollisionGeometry, coal.Transform3s]


def frame_along(z: np.ndarray) -> np.ndarray:
    """A rotation (3, 3) whose z column is the direction given."""
    z = z / np.linalg.norm(z)
    x = np.cross(np.eye(3)[np.argmin(np.abs(z))], z)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])


def capsule_clearance(a: np.ndarray, b: np.ndarray, radius: float, ball: Sphere) -> float:
    """Signed distance [m] of a capsule, axis from a to b, and a ball; Coal has a closed form for this pair."""
    length = float(np.linalg.norm(b - a))
    R = frame_along(b - a) if length > 0 else np.eye(3)
    return coal.distance(
        coal.Capsule(radius, length),
        coal.Transform3s(R, (a + b) / 2),
        coal.Sphere(float(ball.radius)),
        coal.Transform3s(np.eye(3), np.array(ball.center)),
        coal.DistanceRequest(),
        coal.DistanceResult(),
    )


def clearances(frames: np.ndarray, capsules: tuple[LinkCapsule, ...], balls: tuple[Sphere, ...]) -> np.ndarray:
    """Signed distances (rows, capsules, balls) [m]; frames (rows, joints, 4, 4) are the moving frames."""
    out = np.empty((len(frames), len(capsules), len(balls)))
    for row, T in enumerate(frames):
        for i, link in enumerate(capsules):
            T_base_joint = np.eye(4) if link.joint < 0 else T[link.joint]
            a, b = (T_base_joint[:3, :3] @ end + T_base_joint[:3, 3] for end in (link.a, link.b))
            for k, ball in enumerate(balls):
                out[row, i, k] = capsule_clearance(a, b, link.radius, ball)
    return out


# ---- every shape -----------------------------------------------------------------------------------------------------

_REQUEST = coal.DistanceRequest()
_REQUEST.gjk_tolerance = 1e-9  # by default it may put a capsule 0.3 mm too far from a cylinder
_REQUEST.gjk_max_iterations = 256


def placed_capsule(a: np.ndarray, b: np.ndarray, radius: float) -> Placed:
    """A capsule, or a ball, where it is."""
    length = float(np.linalg.norm(b - a))
    if length < 1e-100:  # has no direction that could be computed
        return coal.Sphere(radius), coal.Transform3s(np.eye(3), (a + b) / 2)
    return coal.Capsule(radius, length), coal.Transform3s(frame_along(b - a), (a + b) / 2)


def placed_obstacle(obstacle: Obstacle) -> list[Placed]:
    """An obstacle's shapes where they are: one, but for sets of spheres."""
    if isinstance(obstacle, Capsule):
        return [placed_capsule(obstacle.a, obstacle.b, obstacle.radius)]
    if isinstance(obstacle, Sphere):
        return [placed_capsule(obstacle.center, obstacle.center, obstacle.radius)]
    if isinstance(obstacle, SphereSet):
        return [placed_capsule(c, c, float(r)) for c, r in zip(obstacle.centers, obstacle.radii, strict=True)]
    if isinstance(obstacle, PolytopeSet):
        return [placed_polytope(piece) for piece in obstacle.pieces]
    if isinstance(obstacle, Polytope):
        return [placed_polytope(obstacle)]
    if isinstance(obstacle, HalfSpace):
        plane = coal.Halfspace(np.array(obstacle.normal), float(obstacle.normal @ obstacle.point))
        return [(plane, coal.Transform3s(np.eye(3), np.zeros(3)))]
    at = coal.Transform3s(np.ascontiguousarray(obstacle.pose[:3, :3]), np.array(obstacle.pose[:3, 3]))
    assert isinstance(obstacle, (Box, Cylinder))
    shape = coal.Box(*obstacle.size.tolist()) if isinstance(obstacle, Box) else coal.Cylinder(obstacle.radius, obstacle.length)
    shape.setSweptSphereRadius(obstacle.rounding)
    return [(shape, at)]


THIN = 1e-8  # [m] how much thicker a polytope without volume is made to all sides


def placed_polytope(polytope: Polytope) -> Placed:
    """The hull of its vertices. One with less than four vertices, or a flat one, is made a little thicker."""
    points = np.array(polytope.vertices)
    center = points.mean(axis=0)
    points = points - center
    if np.linalg.matrix_rank(points, tol=1e-6) < 3:
        points = np.concatenate([points + THIN * np.array(sign) for sign in np.ndindex(2, 2, 2)])
        points -= THIN / 2
    hull = ConvexHull(points)
    number = {int(k): i for i, k in enumerate(hull.vertices)}
    corners, faces = coal.StdVec_Vec3s(), coal.StdVec_Triangle()
    for point in points[hull.vertices]:
        corners.append(point)
    for i, j, k in hull.simplices:
        turned = np.linalg.det(points[[i, j, k]]) > 0  # the origin is inside
        faces.append(coal.Triangle(*(number[int(one)] for one in ((i, j, k) if turned else (i, k, j)))))
    shape = coal.Convex(corners, faces)
    shape.setSweptSphereRadius(polytope.rounding)
    return shape, coal.Transform3s(np.eye(3), center)


def distance(one: Placed, other: Placed) -> float:
    """Signed distance of two placed shapes [m]."""
    return coal.distance(*one, *other, _REQUEST, coal.DistanceResult())


def least_distances(robot: Robot, scene: Scene, frames: np.ndarray) -> np.ndarray:
    """The least clearance (rows,) [m] of a robot to a scene and, by its pairs of links, to itself; frames as above."""
    solids = [shape for obstacle in scene.obstacles for shape in placed_obstacle(obstacle)]
    pairs = [
        (i, k)
        for one, other in robot.self_pairs
        for i, link in enumerate(robot.shapes)
        for k, far in enumerate(robot.shapes)
        if (link.name, far.name) == (one, other)
    ]
    own = [placed_obstacle(part.shape)[0] for part in robot.shapes]
    out = np.full(len(frames), np.inf)
    for row, T in enumerate(frames):
        links = [moved(shape, np.eye(4) if part.joint < 0 else T[part.joint]) for part, shape in zip(robot.shapes, own, strict=True)]
        found = [distance(link, solid) for link in links for solid in solids] + [distance(links[i], links[k]) for i, k in pairs]
        out[row] = min(found, default=np.inf)
    return out


def moved(placed: Placed, T: np.ndarray) -> Placed:
    """A placed shape, moved by a rigid transform (4, 4)."""
    shape, at = placed
    return shape, coal.Transform3s(np.ascontiguousarray(T[:3, :3]), np.ascontiguousarray(T[:3, 3])) * at
