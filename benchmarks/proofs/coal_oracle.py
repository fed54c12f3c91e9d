"""Clearances of all pairs of shapes by Pinocchio and Coal: at many instants natively, and around the closest approach."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import coal
import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from spacearm.geometry import Capsule, ConvexShape, Obstacle, PolytopeSet, Scene, SphereSet, core_of
from spacearm.robot import Robot
from support.oracles.coal_shapes import geometry_of, hull_of, placed_obstacle, shape_pairs
from support.oracles.pinocchio_model import full_q

Array = NDArray[np.float64]

GJK_TOLERANCE, GJK_ITERATIONS = 1e-9, 256


@dataclass(frozen=True, slots=True)
class Pair:
    """Two shapes that must keep apart.

    Attributes:
        shape: of the robot.
        other: another shape of the robot; -1: an obstacle.
        obstacle, part: the obstacle, and which of its convex parts; -1: a shape of the robot.
    """

    shape: int
    other: int = -1
    obstacle: int = -1
    part: int = -1


class CoalOracle:
    """A robot among obstacles, in Pinocchio and Coal.

    Attributes:
        pairs: of shapes, in the order of the columns of `distances`.
        first_of_obstacle: where each obstacle's first part is among `bodies`, which begin with the robot's shapes.
    """

    def __init__(self, robot: Robot, scene: Scene) -> None:
        self.robot, self.scene = robot, scene
        self.model = pin.Model()
        base = self.model.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3.Identity(), "the base")
        kinds = {"revolute": pin.JointModelRZ, "prismatic": pin.JointModelPZ}
        ids: list[int] = []
        for joint in robot.joints:
            parent = ids[joint.parent] if joint.parent >= 0 else base
            ids.append(self.model.addJoint(parent, kinds[joint.kind](), pin.SE3(np.array(joint.T_parent_joint)), joint.name))
        self._ids = ids
        self._columns = np.array([self.model.joints[i].idx_q for i in ids], dtype=np.intp)
        self.bodies = pin.GeometryModel()
        for i, part in enumerate(robot.shapes):
            made, T = geometry_of(part.shape)
            self._add(f"shape {i}", ids[part.joint] if part.joint >= 0 else base, made, T)
        self.pairs: list[Pair] = []
        self.first_of_obstacle: list[int] = []
        for o, obstacle in enumerate(scene.obstacles):
            self.first_of_obstacle.append(len(self.bodies.geometryObjects))
            for part, (made, at) in enumerate(placed_obstacle(obstacle)):
                T = np.eye(4)
                T[:3, :3], T[:3, 3] = at.getRotation(), at.getTranslation()
                index = self._add(f"obstacle {o}, part {part}", 0, made, T)
                for i in range(len(robot.shapes)):
                    self.bodies.addCollisionPair(pin.CollisionPair(i, index))
                    self.pairs.append(Pair(i, obstacle=o, part=part))
        for i, k in self_pairs(robot):
            self.bodies.addCollisionPair(pin.CollisionPair(i, k))
            self.pairs.append(Pair(i, other=k))
        self.data, self.found = self.model.createData(), self.bodies.createData()
        for request in self.found.distanceRequests:
            request.gjk_tolerance, request.gjk_max_iterations = GJK_TOLERANCE, GJK_ITERATIONS

    def _add(self, name: str, joint: int, made: coal.CollisionGeometry, T: Array) -> int:
        made.computeLocalAABB()
        return self.bodies.addGeometryObject(pin.GeometryObject(name, joint, pin.SE3(np.array(T)), made))

    def full(self, q: Array, T_w_b: Array | None = None) -> Array:
        """Return the model's q (r, 7 + joints) of configurations (r, n) and poses of the base (r, 4, 4) or (4, 4)."""
        out = np.zeros((len(q), self.model.nq))
        out[:, 6] = 1.0
        out[:, self._columns] = full_q(self.robot, q)
        if T_w_b is not None:
            for row, T in zip(out, np.broadcast_to(T_w_b, (len(q), 4, 4)), strict=True):
                row[:7] = pin.SE3ToXYZQUAT(pin.SE3(np.array(T)))
        return out

    def distances(self, full: Array) -> Array:
        """Return the signed distances (r, pairs) [m] at the model's configurations (r, 7 + joints)."""
        out = np.empty((len(full), len(self.pairs)))
        for row, values in zip(out, full, strict=True):
            pin.computeDistances(self.model, self.data, self.bodies, self.found, values)
            row[:] = [one.min_distance for one in self.found.distanceResults]
        return out

    def of_pair(self, pair: int, full: Array) -> Array:
        """Return the signed distances (r,) [m] of one pair."""
        out = np.empty(len(full))
        for i, values in enumerate(full):
            self.place(values)
            out[i] = pin.computeDistance(self.bodies, self.found, pair).min_distance
        return out

    def joint_frames(self, values: Array) -> Array:
        """Return the poses (joints, 4, 4) of all joints' frames [m]."""
        pin.forwardKinematics(self.model, self.data, values)
        return self.placed_joints()

    def placed_joints(self) -> Array:
        """Return the poses (joints, 4, 4) of all joints' frames where they were placed last [m]."""
        return np.array([self.data.oMi[i].homogeneous for i in self._ids]).reshape(-1, 4, 4)

    def place(self, values: Array) -> None:
        """Place all bodies."""
        pin.updateGeometryPlacements(self.model, self.data, self.bodies, self.found, values)

    def at_most(self, pair: int, values: Array) -> float:
        """Return what the distance of a pair is at most, whatever Coal's tolerance: that of two points that are in the bodies.

        Coal's nearest points are moved into the bodies, and the distance of the two is taken; where the bodies overlap, it is
        0 or a little more.
        """
        self.place(values)
        result = pin.computeDistance(self.bodies, self.found, pair)
        if result.min_distance <= 0:
            return 0.0
        points = np.array(result.getNearestPoint1()), np.array(result.getNearestPoint2())
        one = self.pairs[pair]
        far = 0.0
        for point, geometry, shape in zip(points, self._geometries(pair), self._shapes(one), strict=True):
            if shape is not None:  # half-spaces: their nearest point is a projection, exact but for rounding
                far += outside(shape, self._local(geometry, point, shape))
        return float(np.linalg.norm(points[0] - points[1])) + far

    def _geometries(self, pair: int) -> tuple[int, int]:
        return self.bodies.collisionPairs[pair].first, self.bodies.collisionPairs[pair].second

    def _shapes(self, pair: Pair) -> tuple[ConvexShape, ConvexShape | None]:
        first = self.robot.shapes[pair.shape].shape
        if pair.other >= 0:
            return first, self.robot.shapes[pair.other].shape
        return first, part_of(self.scene.obstacles[pair.obstacle], pair.part)

    def _local(self, geometry: int, point: Array, shape: ConvexShape) -> Array:
        """Return a point of the world in the axes of a shape's core."""
        T = self.found.oMg[geometry].homogeneous
        return T[:3, :3].T @ (point - T[:3, 3])


def self_pairs(robot: Robot) -> list[tuple[int, int]]:
    """Return the pairs of the robot's shapes that must keep apart, with those that cannot meet."""
    out = shape_pairs(robot)
    if robot.apart is not None:
        for one, other in robot.apart.pairs:
            here = [i for i, part in enumerate(robot.shapes) if part.name == one]
            there = [k for k, part in enumerate(robot.shapes) if part.name == other]
            out += [(i, k) for i in here for k in there]
    return out


def part_of(obstacle: Obstacle, part: int) -> Any:
    """Return a convex part of an obstacle; None for a half-space."""
    from spacearm.geometry import HalfSpace, Sphere

    if isinstance(obstacle, HalfSpace):
        return None
    if isinstance(obstacle, SphereSet):
        return Sphere(obstacle.centers[part], float(obstacle.radii[part]))
    return obstacle.pieces[part] if isinstance(obstacle, PolytopeSet) else obstacle


def outside(shape: ConvexShape, point: Array) -> float:
    """Return by how much a point is outside of a shape [m]; the point is in the axes of the shape's core."""
    core = core_of(shape)
    if core.kind == "point":
        off = float(np.linalg.norm(point))
    elif core.kind == "segment" or isinstance(shape, Capsule):
        off = float(np.linalg.norm(point - np.array([0, 0, np.clip(point[2], -core.half[2], core.half[2])])))
    elif core.kind == "box":
        off = float(np.linalg.norm(point - np.clip(point, -core.half, core.half)))
    elif core.kind == "cylinder":
        across = float(np.hypot(point[0], point[1]))
        off = float(np.hypot(max(0.0, across - core.half[0]), max(0.0, abs(point[2]) - core.half[2])))
    else:
        off = _outside_hull(core.vertices, point)
    return max(0.0, off - core.radius)


def _outside_hull(vertices: Array, point: Array) -> float:
    """Return at least the distance of a point to a hull: that to a weighted mean of its vertices."""
    from scipy.optimize import nnls

    corners, _ = hull_of(vertices) if len(vertices) > 3 else (vertices, None)
    weight = 1e3 * max(1.0, float(np.abs(corners).max()))
    weights, _ = nnls(np.vstack([corners.T, np.full(len(corners), weight)]), np.append(point, weight))
    weights /= weights.sum()
    return float(np.linalg.norm(weights @ corners - point))
