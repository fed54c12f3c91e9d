"""The robot's convex bodies that a proof keeps apart, as arrays: the shapes of its links, and a ball around each link.

A *relative body* is a body of the robot whose motion is described in the frame of another body, or of the base. Only the joints
between the two move it there. In the inertial frame, a body of a robot whose arm moves its base is moved by all joints.
Relative bodies come in families: first the ball around a link, then the link's shapes, all in the same frame.

How far a body moves is bounded at points in whose hull its core lies: the ends of a segment, the corners of a box, the vertices
of a polytope, polygons around the rims of a cylinder. Bodies are grouped by the number of these points, so that a sphere costs
no more where there are boxes.
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from spacearm.core.identity_cache import cached_by_identity
from spacearm.geometry import Core, bounding_points, core_of
from spacearm.geometry.convex_cores import axes_along
from spacearm.proof.solids import padded
from spacearm.robot import LinkShape, Robot
from spacearm.robot.link_shapes import as_capsule

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

_INERTIAL = -2  # stands for the inertial frame in place of the joint of the other body
_OUTWARD = 1 + 1e-12  # times the size of an enclosing ball or box, which covers its rounding
_MOST_POINTS = 32  # vertices of a polytope that are all followed; of one with more, the corners of a box around it


class JointMap:
    """The map from the robot's n degrees of freedom to the values of its j joints, mimic joints included.

    Attributes:
        dof: (j,) which degree of freedom a joint follows.
        multiplier, offset: (j,) its value is multiplier times that, plus offset [rad or m].
        parent_offset: (j, 3) the joint's origin in the frame of the joint before it [m].
        revolute: (j,) whether it is revolute; the others are prismatic.
    """

    def __init__(self, robot: Robot) -> None:
        self.dof = np.array([joint.dof for joint in robot.joints])
        self.multiplier = np.array([joint.multiplier for joint in robot.joints])
        self.offset = np.array([joint.offset for joint in robot.joints])
        self.parent_offset = np.array([joint.T_parent_joint[:3, 3] for joint in robot.joints])
        self.revolute = np.array([joint.kind == "revolute" for joint in robot.joints])

    def values(self, q: Array) -> Array:
        """Return the joints' values (r, j) at configurations (r, n)."""
        return q[:, self.dof] * self.multiplier + self.offset


@cached_by_identity
def joints_of(robot: Robot) -> JointMap:
    """Return the map from a robot's degrees of freedom to its joints."""
    return JointMap(robot)


def ancestors(robot: Robot) -> NDArray[np.bool_]:
    """Return [k, i] of (j, j): whether joint i is between joint k and the base."""
    out = np.zeros((len(robot.joints),) * 2, dtype=bool)
    for k, joint in enumerate(robot.joints):
        out[k, _chain(robot, joint.parent)] = True
    return out


def _chain(robot: Robot, joint: int) -> list[int]:
    """Return the joints from the base to a joint, this one included."""
    out: list[int] = []
    while joint >= 0:
        out.append(joint)
        joint = robot.joints[joint].parent
    return out[::-1]


# ---- The robot's bodies ----------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BodyGroup:
    """Bodies whose cores lie in the hull of equally many points.

    Attributes:
        body: (g,) the bodies.
        points: (g, e, 3) in the frame of the body's joint [m]. The core of a body lies in the hull of its points.
        parts: 0 if a core is the hull of its points. Else the core is the hull of this number of parts, and the points are as
            many runs of equal length, each of which holds one part: a cylinder is the hull of two discs, each in a polygon.
        cores: boxes, cylinders or polytopes, (g,); empty for points and segments, whose points are the ends of their axes.
        reach: (g,) how far the points are from the origins of the cores [m].
    """

    body: Indices
    points: Array
    parts: int
    cores: tuple[Core, ...]
    reach: Array


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Bodies:
    """The robot's b bodies: its c shapes, then a ball around each of its links.

    Attributes:
        shapes: c.
        groups: first that of all points and segments, the balls among them, with e = 1 if all are points and else e = 2; then
            those of boxes, cylinders and polytopes.
        group, place: (b,) the group of a body, and its place there.
        radius: (b,) around the core [m].
        joint: (b,) the joint that carries the body, -1 for the base.
        members: (c,) the shapes, link by link.
        first, count: (b,) the shapes in a link's ball are `members[first : first + count]`; count is 0 for a shape.
    """

    shapes: int
    groups: tuple[BodyGroup, ...]
    group: Indices
    place: Indices
    radius: Array
    joint: Indices
    members: Indices
    first: Indices
    count: Indices

    def core(self, body: int) -> Core | None:
        """Return the core of a box, a cylinder or a polytope; None for other bodies."""
        cores = self.groups[int(self.group[body])].cores
        return cores[int(self.place[body])] if cores else None

    def ends(self, body: int) -> Array:
        """Return the ends (e, 3) of the axis of a point or a segment, in the frame of the body's joint [m]."""
        return self.groups[int(self.group[body])].points[int(self.place[body])]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RelativeBodies:
    """m relative bodies, and the p relative motions that they share.

    Attributes:
        body: (m,) the body.
        motion: (m,) its relative motion.
        count: (m,) how many of the relative bodies after it are inside it; 0 for a shape.
        sign: (p, j) the factor of each joint's rate in the motion: 1, or -1 (the joint moves the other body's frame), or 0.
        order: (p, j, j) the weights c_ki of the pairs of joints in the second-order bound (docs/certificate.md, section 3).
        free: (p,) whether the motion is in the inertial frame while the arm moves the base. Then `sign` says which joints are
            between the base and the body, and `order` is for all joints.
        scene_relative: (l,) the links' balls, in the frame in which the obstacles are at rest.
        self_relative, self_body: (s,) pairs of links' balls that must keep clear of each other: the relative body, and the body
            in whose frame it moves.
    """

    body: Indices
    motion: Indices
    count: Indices
    sign: Array
    order: Array
    free: NDArray[np.bool_]
    scene_relative: Indices
    self_relative: Indices
    self_body: Indices


@cached_by_identity
def bodies_of(robot: Robot) -> tuple[Bodies, RelativeBodies]:
    """Return a robot's bodies, and its relative bodies while its base stays at rest."""
    bodies = _bodies(robot)
    return bodies, _relative_bodies(robot, bodies, scene=-1)


@cached_by_identity
def bodies_in_space_of(robot: Robot) -> tuple[Bodies, RelativeBodies]:
    """Return a robot's bodies, and its relative bodies while its arm moves its base."""
    bodies = _bodies(robot)
    return bodies, _relative_bodies(robot, bodies, scene=_INERTIAL)


def _bodies(robot: Robot) -> Bodies:
    by_link: dict[tuple[str, int], list[int]] = defaultdict(list)
    for i, part in enumerate(robot.shapes):
        by_link[part.name, part.joint].append(i)
    inside = list(by_link.values())
    count = np.array([len(link) for link in inside], dtype=np.intp)
    members = np.array([i for link in inside for i in link], dtype=np.intp)
    shapes = [_ShapePoints.of(part) for part in robot.shapes]
    balls = [_ball([shapes[i] for i in link]) for link in inside]
    groups = _groups([*shapes, *balls])
    group, place = np.zeros((2, len(shapes) + len(balls)), dtype=np.intp)
    for g, some in enumerate(groups):
        group[some.body], place[some.body] = g, np.arange(len(some.body))
    return Bodies(
        shapes=len(shapes),
        groups=groups,
        group=group,
        place=place,
        radius=np.array([one.radius for one in (*shapes, *balls)]),
        joint=np.array([part.joint for part in robot.shapes] + [joint for _, joint in by_link], dtype=np.intp),
        members=members,
        first=np.concatenate([np.zeros(len(members), np.intp), np.cumsum(count) - count]),
        count=np.concatenate([np.zeros(len(members), np.intp), count]),
    )


class _ShapePoints(NamedTuple):
    """Points (e, 3) in whose hull the core of a shape lies, and the radius around it; see `BodyGroup`."""

    points: Array
    radius: float
    parts: int
    core: Core | None

    @classmethod
    def of(cls, part: LinkShape) -> _ShapePoints:
        """Return the points of a shape of a link."""
        capsule = as_capsule(part)
        if capsule is not None:
            return cls(np.stack([capsule.a, capsule.b]), capsule.radius, 0, None)
        core, (points, radius) = core_of(part.shape), bounding_points(part.shape)
        if core.kind == "polytope" and len(points) > _MOST_POINTS:
            return cls(_corners_around(points), radius, 1, core)
        return cls(points, radius, 2 if core.kind == "cylinder" else 0, core)


def _corners_around(points: Array) -> Array:
    """Return the corners (8, 3) of a box around points, along their principal axes."""
    center = points.mean(axis=0)
    axes = np.linalg.svd(points - center, full_matrices=True)[2]
    own = (points - center) @ axes.T
    low, high = own.min(axis=0), own.max(axis=0)
    out = (_OUTWARD - 1) * np.abs(own).max()
    corners = np.array(list(product(*zip(low - out, high + out, strict=True))))
    return corners @ axes + center


def _ball(inside: list[_ShapePoints]) -> _ShapePoints:
    """Return a ball around shapes."""
    points = np.concatenate([one.points for one in inside])
    radius = np.concatenate([np.full(len(one.points), one.radius) for one in inside])
    grown = radius[:, None]
    center = ((points - grown).min(axis=0) + (points + grown).max(axis=0)) / 2
    around = float((np.linalg.norm(points - center, axis=1) + radius).max()) * _OUTWARD
    return _ShapePoints(np.stack([center, center]), around, 0, None)


def _groups(every: list[_ShapePoints]) -> tuple[BodyGroup, ...]:
    """Return the groups of bodies; see `Bodies.groups`."""
    found: dict[tuple[str, int, int], list[int]] = {("axis", 2, 0): []}
    for i, one in enumerate(every):
        kind = ("axis", 2, 0) if one.core is None else (one.core.kind, _width(len(one.points)), one.parts)
        found.setdefault(kind, []).append(i)
    return tuple(_group(np.array(body, dtype=np.intp), [every[i] for i in body], *key[1:]) for key, body in found.items())


def _width(points: int) -> int:
    """Return the least power of 2 that is no less: polytopes with about as many vertices are evaluated together."""
    return 1 << (points - 1).bit_length()


def _group(body: Indices, some: list[_ShapePoints], width: int, parts: int) -> BodyGroup:
    points = padded([one.points for one in some], width) if some else np.zeros((0, width, 3))
    cores = tuple(one.core for one in some if one.core is not None)
    if not cores and np.array_equal(points[:, :1], points[:, 1:]):
        points = points[:, :1]
    origins = np.array([core.T[:3, 3] for core in cores]).reshape(-1, 1, 3)
    reach = np.linalg.norm(points[: len(cores)] - origins, axis=2).max(axis=1)
    return BodyGroup(body=body, points=points, parts=parts, cores=cores, reach=reach)


def _relative_bodies(robot: Robot, bodies: Bodies, *, scene: int) -> RelativeBodies:
    """Return the relative bodies for the scene and for the pairs of links; `scene` is -1 (the base frame) or _INERTIAL."""
    paths: dict[tuple[int, int], int] = {}  # (joint of the body, joint of the other body) -> relative motion
    families: dict[tuple[int, int], int] = {}  # (link's ball, relative motion) -> its first relative body
    body: list[int] = []
    motion: list[int] = []

    def family(ball: int, seen_from: int) -> int:
        path = paths.setdefault((int(bodies.joint[ball]), seen_from), len(paths))
        if (ball, path) not in families:
            families[ball, path] = len(body)
            first = bodies.first[ball]
            body.extend([ball, *bodies.members[first : first + bodies.count[ball]].tolist()])
            motion.extend([path] * (len(body) - len(motion)))
        return families[ball, path]

    balls = range(bodies.shapes, len(bodies.radius))
    scene_relative = [family(ball, scene) for ball in balls]
    named: dict[str, list[int]] = defaultdict(list)
    for ball in balls:
        named[robot.shapes[bodies.members[bodies.first[ball]]].name].append(ball)
    pairs: list[tuple[int, int]] = []
    for one, other in robot.self_pairs:
        for near in named[one]:
            for far in named[other]:
                low, high = (near, far) if bodies.joint[near] <= bodies.joint[far] else (far, near)
                pairs.append((family(high, int(bodies.joint[low])), low))
    sign, order = _relative_motions(robot, list(paths))
    self_relative, self_body = np.array(pairs, dtype=np.intp).reshape(-1, 2).T
    return RelativeBodies(
        body=np.array(body, dtype=np.intp),
        motion=np.array(motion, dtype=np.intp),
        count=bodies.count[body] if body else np.zeros(0, np.intp),
        sign=sign,
        order=order,
        free=np.array([seen_from == _INERTIAL for _, seen_from in paths], dtype=bool),
        scene_relative=np.array(scene_relative, dtype=np.intp),
        self_relative=self_relative,
        self_body=self_body,
    )


def _relative_motions(robot: Robot, paths: list[tuple[int, int]]) -> tuple[Array, Array]:
    """Return `sign` and `order` of relative motions, each given by the body's joint and the joint of the other body."""
    count = len(robot.joints)
    revolute = np.array([joint.kind == "revolute" for joint in robot.joints])
    sign, order = np.zeros((len(paths), count)), np.zeros((len(paths), count, count))
    for p, (moved, seen_from) in enumerate(paths):
        up, down = _chain(robot, moved), _chain(robot, seen_from)
        shared = set(up) & set(down)
        # From the other body towards the base, and from there out to the body.
        away = [k for k in reversed(down) if k not in shared] + [k for k in up if k not in shared]
        for place, k in enumerate(away):
            sign[p, k] = -1.0 if k in down else 1.0
            before = away[:place]
            order[p, k, before] = 2.0 * revolute[before]
            order[p, k, k] = revolute[k]
        if seen_from == _INERTIAL:
            order[p] = (2.0 * ancestors(robot) + np.eye(count)) * revolute
    return sign, order


@cached_by_identity
def body_axes(bodies: Bodies) -> tuple[Array, ...]:
    """Return the axes of the bodies' cores, (g, 3, 3) for each group, in the frames of their joints; z along a segment."""
    segments = np.array([axes_along(ends[-1] - ends[0]) for ends in bodies.groups[0].points]).reshape(-1, 3, 3)
    return segments, *(np.array([core.T[:3, :3] for core in group.cores]) for group in bodies.groups[1:])
