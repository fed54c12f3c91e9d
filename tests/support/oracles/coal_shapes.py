"""Distances by Coal: the one place where shapes are converted."""

from __future__ import annotations

import coal
import numpy as np
from scipy.spatial import ConvexHull, QhullError

from spacearm.geometry import ConvexShape, HalfSpace, Obstacle, PolytopeSet, Scene, Sphere, SphereSet, core_of
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


def geometry_of(shape: ConvexShape) -> tuple[coal.CollisionGeometry, np.ndarray]:
    """Coal's geometry of a convex shape, and its pose (4, 4) in the frame of the shape's coordinates [m]."""
    core = core_of(shape)
    if core.kind == "point":
        return coal.Sphere(core.radius), core.T
    if core.kind == "segment":
        length = float(2 * core.half[2])
        if length < 1e-100:  # has no direction that could be computed
            return coal.Sphere(core.radius), core.T
        return coal.Capsule(core.radius, length), core.T
    if core.kind == "box":
        made = coal.Box(*(2 * core.half).tolist())
    elif core.kind == "cylinder":
        made = coal.Cylinder(float(core.half[0]), float(2 * core.half[2]))
    else:
        made = _convex(core.vertices)
    made.setSweptSphereRadius(core.radius)
    return made, core.T


def _convex(vertices: np.ndarray) -> coal.Convex:
    """Coal's polytope of the hull of points; it may be flat, or a line."""
    points, triangles = coal.StdVec_Vec3s(), coal.StdVec_Triangle()
    corners, faces = hull_of(vertices)
    for corner in corners:
        points.append(corner)
    for face in faces:
        triangles.append(coal.Triangle(*face))
    return coal.Convex(points, triangles)


def hull_of(vertices: np.ndarray) -> tuple[np.ndarray, list[list[int]]]:
    """The corners (k, 3) of a hull, and its triangles; those of a flat one from both sides."""
    try:
        hull = ConvexHull(vertices)
    except QhullError:
        center = vertices.mean(axis=0)
        _, _, axes = np.linalg.svd(vertices - center)
        flat = (vertices - center) @ axes[:2].T
        try:
            ring = ConvexHull(flat).vertices
        except QhullError:  # a line
            ring = np.array([np.argmin(flat[:, 0]), np.argmax(flat[:, 0])])
        corners = vertices[ring]
        fan = [[0, i, i + 1] for i in range(1, len(ring) - 1)] or [[0, 1, 1]]
        return corners, [*fan, *(face[::-1] for face in fan)]
    number = {int(old): new for new, old in enumerate(hull.vertices)}
    return vertices[hull.vertices], [[number[int(i)] for i in face] for face in hull.simplices]


def placed_shape(shape: ConvexShape) -> Placed:
    """A convex shape where it is."""
    made, T = geometry_of(shape)
    return made, coal.Transform3s(np.ascontiguousarray(T[:3, :3]), np.array(T[:3, 3]))


def placed_obstacle(obstacle: Obstacle) -> list[Placed]:
    """An obstacle's shapes where they are: one, but for sets."""
    if isinstance(obstacle, SphereSet):
        return [placed_capsule(c, c, float(r)) for c, r in zip(obstacle.centers, obstacle.radii, strict=True)]
    if isinstance(obstacle, PolytopeSet):
        return [placed_shape(piece) for piece in obstacle.pieces]
    if isinstance(obstacle, HalfSpace):
        plane = coal.Halfspace(np.array(obstacle.normal), float(obstacle.normal @ obstacle.point))
        return [(plane, coal.Transform3s(np.eye(3), np.zeros(3)))]
    return [placed_shape(obstacle)]


def distance(one: Placed, other: Placed) -> float:
    """Signed distance of two placed shapes [m]."""
    return coal.distance(*one, *other, _REQUEST, coal.DistanceResult())


def least_distances(robot: Robot, scene: Scene, frames: np.ndarray) -> np.ndarray:
    """The least clearance (rows,) [m] of a robot to a scene and, by its pairs of links, to itself; frames as above.

    With one frame more than there are joints, the last is that of the base (a base that floats).
    """
    solids = [shape for obstacle in scene.obstacles for shape in placed_obstacle(obstacle)]
    pairs = shape_pairs(robot)
    own = [(part.joint, *geometry_of(part.shape)) for part in robot.shapes]
    out = np.full(len(frames), np.inf)
    for row, T in enumerate(frames):
        links = []
        for joint, made, T_joint_core in own:
            still = joint < 0 and len(T) == len(robot.joints)
            at = T_joint_core if still else T[joint] @ T_joint_core
            links.append((made, coal.Transform3s(np.ascontiguousarray(at[:3, :3]), np.array(at[:3, 3]))))
        found = [distance(link, solid) for link in links for solid in solids] + [distance(links[i], links[k]) for i, k in pairs]
        out[row] = min(found, default=np.inf)
    return out


def shape_pairs(robot: Robot) -> list[tuple[int, int]]:
    """The pairs of the robot's shapes that must keep clear of each other, as indices."""
    return [
        (i, k)
        for one, other in robot.self_pairs
        for i, link in enumerate(robot.shapes)
        for k, far in enumerate(robot.shapes)
        if (link.name, far.name) == (one, other)
    ]
