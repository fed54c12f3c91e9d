"""The convex bodies that a proof keeps apart, as one table: the robot's shapes, the obstacles, and balls around some of them.

Every body is the set of all points within a radius of its *core*. The core is the hull of the body's points; a cylinder's core
is that of two points, widened by a disc across its axis. A *bundle* is a ball around other bodies of the table: around the
shapes of a link, the balls of a large scene, or a polytope. What is proven of a bundle is proven of all its members.

Bodies ride on frames: frame 0 is the inertial frame, with the obstacles; frame 1 is the base, and frame 2 + k is joint k's. The
motion of a body is described in the frame of the other body of its pair, and there only the joints between the two move it.
"""

from __future__ import annotations

import itertools
from collections import defaultdict
from dataclasses import dataclass, fields
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from spacearm.core.exact import product
from spacearm.core.identity_cache import cached_by_identity
from spacearm.geometry import (
    Capsule,
    ConvexShape,
    Core,
    HalfSpace,
    Polytope,
    PolytopeSet,
    Scene,
    Sphere,
    SphereSet,
    core_of,
)
from spacearm.proof.mechanism import chain
from spacearm.robot import Robot

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

WORLD, BASE, FIRST_JOINT = 0, 1, 2
"""Frames: the inertial one, the base's, and that of joint 0."""

_OUTWARD = 1 + 1e-12  # times the size of an enclosing ball, which covers its rounding
_MEMBERS = 16  # of a bundle of a scene
_FEW = 16  # up to this number of balls a scene has no bundles of them

_CORNERS = {"box": np.array(list(itertools.product((-1.0, 1.0), repeat=3)))}  # times half the edges
_ENDS = np.array([[0.0, 0.0, -1.0], [0.0, 0.0, 1.0]])  # likewise of what is along z


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ConvexBodies:
    """A table of b bodies, with v points in all.

    Attributes:
        frame: (b,) the frame that carries a body.
        first_point, points: (b,) its points are `vertices[first_point : first_point + points]`.
        vertices: (v, 3) in the frames of their bodies [m].
        disc, axis: (b,) and (b, 3) the radius [m] of the disc that widens the hull of the points, and its axis; 0 for none.
        radius: (b,) of the body around its core [m].
        center, reach: (b, 3) and (b,) no point of the core is further than `reach` from `center`, in the body's frame [m].
        half_space: (b,) whether it is all that lies below its only point along `axis`; then nothing else counts.
        first_member, members: (b,) a bundle's members are the bodies first_member to first_member + members - 1; no members: a
            shape.
        owner: (b,) the link, by its place in `RequiredClearance.links`, or the obstacle, by its place in the scene; -1: a
            bundle of several obstacles.
        shape: (b,) the place in `robot.shapes`; -1 for bundles and obstacles.
    """

    frame: Indices
    first_point: Indices
    points: Indices
    vertices: Array
    disc: Array
    axis: Array
    radius: Array
    center: Array
    reach: Array
    half_space: NDArray[np.bool_]
    first_member: Indices
    members: Indices
    owner: Indices
    shape: Indices

    def __len__(self) -> int:
        """Return b."""
        return len(self.frame)

    def followed_by(self, other: ConvexBodies) -> ConvexBodies:
        """Return a table of these bodies and then those of another one."""
        shifted = {"first_point": len(self.vertices), "first_member": len(self)}
        columns = {
            one.name: np.concatenate([getattr(self, one.name), getattr(other, one.name) + shifted.get(one.name, 0)])
            if one.name in shifted
            else np.concatenate([getattr(self, one.name), getattr(other, one.name)])
            for one in fields(self)
        }
        return ConvexBodies(**columns)


# ---- The robot's bodies and the scene's ------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Body:
    """One row of the table; see `ConvexBodies`."""

    frame: int
    points: Array
    owner: int
    radius: float
    disc: float = 0.0
    axis: tuple[float, float, float] = (0.0, 0.0, 0.0)
    half_space: bool = False
    first_member: int = 0
    members: int = 0
    shape: int = -1


@cached_by_identity
def robot_bodies(robot: Robot) -> ConvexBodies:
    """Return a robot's bodies: its shapes, link by link, and then a ball around each link that is no sphere."""
    links = {name: i for i, name in enumerate(dict.fromkeys(part.name for part in robot.shapes))}
    by_link: dict[tuple[str, int], list[int]] = defaultdict(list)
    for i, part in enumerate(robot.shapes):
        by_link[part.name, part.joint].append(i)
    bodies: list[_Body] = []
    bundles: list[_Body] = []
    for (name, joint), shapes in by_link.items():
        frame, first = FIRST_JOINT + joint, len(bodies)
        bodies += [_of_shape(robot.shapes[i].shape, frame, links[name], i) for i in shapes]
        if len(shapes) > 1 or len(bodies[-1].points) > 1 or bodies[-1].disc:
            bundles.append(_bundle(bodies[first:], first))
    return _table([*bodies, *bundles])


@cached_by_identity
def scene_bodies(scene: Scene) -> ConvexBodies:
    """Return a scene's bodies: the convex parts of its obstacles, and then bundles of them.

    There is a bundle around every polytope, and around every sixteen neighbours of more than sixteen balls; and
    around those again, until there are as few.
    """
    bodies: list[_Body] = []
    polytopes: list[int] = []
    balls: list[tuple[int, Array, float]] = []
    for i, item in enumerate(scene.obstacles):
        if isinstance(item, SphereSet):
            balls += [(i, center, float(radius)) for center, radius in zip(item.centers, item.radii, strict=True)]
        elif isinstance(item, Sphere):
            balls.append((i, item.center, item.radius))
        elif isinstance(item, HalfSpace):
            normal = tuple((item.normal / np.linalg.norm(item.normal)).tolist())
            bodies.append(_Body(frame=WORLD, points=item.point[None], owner=i, radius=0.0, axis=normal, half_space=True))
        else:
            for part in item.pieces if isinstance(item, PolytopeSet) else (item,):
                bodies.append(_of_shape(part, WORLD, i))
                if isinstance(part, Polytope) and len(part.vertices) > 2:  # fewer are a segment or a point
                    polytopes.append(len(bodies) - 1)
    order = _neighbours(np.array([center for _, center, _ in balls]).reshape(-1, 3), np.arange(len(balls)))
    first = len(bodies)
    for k in order.tolist():
        owner, center, radius = balls[int(k)]
        bodies.append(_Body(frame=WORLD, points=center[None], owner=owner, radius=radius))
    level = range(first, len(bodies))
    bodies += [_bundle([bodies[k]], k) for k in polytopes]
    while len(level) > _FEW:
        some = [range(k, min(k + _MEMBERS, level.stop)) for k in range(level.start, level.stop, _MEMBERS)]
        level = range(len(bodies), len(bodies) + len(some))
        bodies += [_bundle(bodies[members.start : members.stop], members.start) for members in some]
    return _table(bodies)


def _of_shape(shape: ConvexShape, frame: int, owner: int, number: int = -1) -> _Body:
    """Return the body of a convex shape."""
    core = core_of(shape)
    axis = tuple(core.T[:3, 2].tolist()) if core.kind == "cylinder" else (0.0, 0.0, 0.0)
    disc = float(core.half[0]) if core.kind == "cylinder" else 0.0
    points = _points(shape, core)
    return _Body(frame=frame, points=points, owner=owner, radius=core.radius, disc=disc, axis=axis, shape=number)


def _points(shape: ConvexShape, core: Core) -> Array:
    """Return the points (k, 3) whose hull is the core of a shape; of a cylinder the centres of its two discs."""
    if core.kind == "point":
        return core.T[None, :3, 3]
    if isinstance(shape, Capsule):
        return np.stack([shape.a, shape.b])
    if core.kind == "polytope":
        return product(core.vertices, core.T[:3, :3].T) + core.T[:3, 3]
    return product(_CORNERS.get(core.kind, _ENDS) * core.half, core.T[:3, :3].T) + core.T[:3, 3]


def _bundle(members: list[_Body], first: int) -> _Body:
    """Return a ball around bodies that follow each other in the table."""
    points = np.concatenate([body.points for body in members])
    around = np.concatenate([np.full(len(body.points), body.radius + body.disc) for body in members])
    grown = around[:, None]
    center = ((points - grown).min(axis=0) + (points + grown).max(axis=0)) / 2
    radius = float((np.linalg.norm(points - center, axis=1) + around).max()) * _OUTWARD
    owners = {body.owner for body in members}
    return _Body(
        frame=members[0].frame,
        points=center[None],
        owner=owners.pop() if len(owners) == 1 else -1,
        radius=radius,
        first_member=first,
        members=len(members),
    )


def _neighbours(center: Array, order: Indices) -> Indices:
    """Return an order in which neighbours follow each other: halved along the longest side, until the parts are bundles."""
    if len(order) <= _MEMBERS:
        return order
    points = center[order]
    side = int(np.argmax(np.ptp(points, axis=0)))
    half = -(-len(order) // _MEMBERS) // 2 * _MEMBERS
    order = order[np.argpartition(points[:, side], half)]
    return np.concatenate([_neighbours(center, order[:half]), _neighbours(center, order[half:])])


def _table(bodies: list[_Body]) -> ConvexBodies:
    count = np.array([len(body.points) for body in bodies], dtype=np.intp)
    vertices = np.concatenate([np.zeros((0, 3)), *(body.points for body in bodies)])
    disc = np.array([body.disc for body in bodies], dtype=np.float64)
    center, reach = _enclosed(vertices, count, disc)
    return ConvexBodies(
        frame=np.array([body.frame for body in bodies], dtype=np.intp),
        first_point=np.cumsum(count) - count,
        points=count,
        vertices=vertices,
        disc=disc,
        axis=np.array([body.axis for body in bodies], dtype=np.float64).reshape(-1, 3),
        radius=np.array([body.radius for body in bodies], dtype=np.float64),
        center=center,
        reach=reach,
        half_space=np.array([body.half_space for body in bodies], dtype=bool),
        first_member=np.array([body.first_member for body in bodies], dtype=np.intp),
        members=np.array([body.members for body in bodies], dtype=np.intp),
        owner=np.array([body.owner for body in bodies], dtype=np.intp),
        shape=np.array([body.shape for body in bodies], dtype=np.intp),
    )


def _enclosed(vertices: Array, count: Indices, disc: Array) -> tuple[Array, Array]:
    """Return the middle of the box around each body's points (b, 3), and how far its core gets from there, rounded up (b,)."""
    if not len(count):
        return np.zeros((0, 3)), np.zeros(0)
    first = np.cumsum(count) - count
    center = (np.minimum.reduceat(vertices, first) + np.maximum.reduceat(vertices, first)) / 2
    away = np.linalg.norm(vertices - np.repeat(center, count, axis=0), axis=1)
    return center, np.where(count == 1, disc, np.hypot(np.maximum.reduceat(away, first), disc) * _OUTWARD)


def outermost(bodies: ConvexBodies) -> Indices:
    """Return the bodies of a table that are in no bundle."""
    inside = np.zeros(len(bodies), dtype=bool)
    for bundle in np.flatnonzero(bodies.members).tolist():
        first = bodies.first_member[bundle]
        inside[first : first + bodies.members[bundle]] = True
    return np.flatnonzero(~inside)


# ---- Pairs and their motions -----------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BodyPairs:
    """The pairs of bodies that are kept apart, outermost bodies only, and how one of each moves in the frame of the other.

    Attributes:
        first, other: (s,) the bodies of the pairs: the first one is the robot's, and moves in the frame of the other one.
        motion_of: (j + 2, j + 2) the relative motion, by the frame of the first body and that of the other one; -1: not used.
        sign: (p, j) of p motions: by which factor a joint's rate counts: 1, or -1 (it moves the other body's frame), or 0.
        order: (p, j, j) the weights c_ki of the pairs of joints between the two (docs/certificate.md, section 3).
        free: (p,) whether the motion is in the inertial frame while the arm moves the base, so that all joints count.
        whole_order: (j, j) the weights of all pairs of joints, for free motions.
    """

    first: Indices
    other: Indices
    motion_of: Indices
    sign: Array
    order: Array
    free: NDArray[np.bool_]
    whole_order: Array


def body_pairs(robot: Robot, bodies: ConvexBodies, *, floating: bool) -> BodyPairs:
    """Return the pairs of outermost bodies of a table that are kept apart: of links and obstacles, and of links.

    Pairs of links are those of `robot.self_pairs`, and those that cannot meet (`robot.apart`).

    Args:
        robot: the robot.
        bodies: its bodies, then those of a scene.
        floating: whether the arm moves the base.
    """
    links, motions = _link_pairs(robot), _motions(robot)
    top = outermost(bodies)
    scene = top[bodies.frame[top] == WORLD]
    return BodyPairs(
        first=np.concatenate([np.repeat(links.outermost, len(scene)), links.first]),
        other=np.concatenate([np.tile(scene, len(links.outermost)), links.other]),
        motion_of=motions.of,
        sign=motions.sign,
        order=motions.order,
        free=motions.in_world & floating,
        whole_order=motions.whole_order,
    )


class _LinkPairs(NamedTuple):
    """A robot's outermost bodies, and the pairs of them that are kept apart."""

    outermost: Indices
    first: Indices
    other: Indices


@cached_by_identity
def _link_pairs(robot: Robot) -> _LinkPairs:
    bodies = robot_bodies(robot)
    own = outermost(bodies)
    names = tuple(dict.fromkeys(part.name for part in robot.shapes))
    of_link: dict[str, list[int]] = defaultdict(list)
    for body in own.tolist():
        of_link[names[bodies.owner[body]]].append(body)
    kept = [*robot.self_pairs, *(() if robot.apart is None else robot.apart.pairs)]
    pairs = [
        (near, far) if bodies.frame[near] > bodies.frame[far] else (far, near)
        for one, another in kept
        for near in of_link[one]
        for far in of_link[another]
    ]
    between = np.array(pairs, dtype=np.intp).reshape(-1, 2)
    return _LinkPairs(own, between[:, 0].copy(), between[:, 1].copy())


class _Motions(NamedTuple):
    """The relative motions of a robot's links, in the world and in each other's frames; see `BodyPairs`."""

    of: Indices
    sign: Array
    order: Array
    in_world: NDArray[np.bool_]
    whole_order: Array


@cached_by_identity
def _motions(robot: Robot) -> _Motions:
    links, frame = _link_pairs(robot), robot_bodies(robot).frame
    used = {(int(k), WORLD) for k in frame[links.outermost]}
    used |= {(int(k), int(seen)) for k, seen in zip(frame[links.first], frame[links.other], strict=True)}
    joints, listed = len(robot.joints), sorted(used)
    of = np.full((joints + 2, joints + 2), -1, dtype=np.intp)
    revolute = np.array([joint.kind == "revolute" for joint in robot.joints], dtype=bool)
    sign, order = np.zeros((len(listed), joints)), np.zeros((len(listed), joints, joints))
    for p, (moved, seen_from) in enumerate(listed):
        of[moved, seen_from] = p
        sign[p], order[p] = _relative_motion(robot, moved - FIRST_JOINT, seen_from - FIRST_JOINT, revolute)
    before = np.zeros((joints, joints))
    for k in range(joints):
        before[k, chain(robot, k)] = 2.0
    in_world = np.array([seen_from == WORLD for _, seen_from in listed], dtype=bool)
    return _Motions(of, sign, order, in_world, (before - np.eye(joints)) * revolute)


def _relative_motion(robot: Robot, moved: int, seen_from: int, revolute: NDArray[np.bool_]) -> tuple[Array, Array]:
    """Return `sign` and `order` of the motion of a joint's frame in that of another joint; below 0 are base and world."""
    sign, order = np.zeros(len(robot.joints)), np.zeros((len(robot.joints),) * 2)
    up, down = chain(robot, moved), chain(robot, seen_from)
    shared = set(up) & set(down)
    # From the other body towards the base, and from there out to the body.
    away = [k for k in reversed(down) if k not in shared] + [k for k in up if k not in shared]
    for place, k in enumerate(away):
        sign[k] = -1.0 if k in down else 1.0
        before = away[:place]
        order[k, before] = 2.0 * revolute[before]
        order[k, k] = revolute[k]
    return sign, order
