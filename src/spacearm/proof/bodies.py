"""The convex bodies that a proof keeps apart, as arrays: the robot's capsules, the balls around its links, and the obstacles.

A *relative body* is a body of the robot whose motion is described in the frame of another body, or of the base. Only the joints
between the two move it there. In the inertial frame, a body of a robot whose arm moves its base is moved by all joints.
Relative bodies come in families: first the ball around a link, then the link's capsules, all in the same frame.

A *solid* is an obstacle, or one of the robot's own bodies that another one is kept away from. It has a core and a radius around
the core: the core of a ball is a point, that of a capsule is a segment, a box is all core. Points and directions are given in
the solid's own axes. A proof uses the support function (how far the core extends in a direction). The nearest point only
proposes a direction.
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from spacearm.core.identity_cache import cached_by_identity
from spacearm.geometry import Box, Capsule, Cylinder, HalfSpace, Obstacle, Scene, Sphere, SphereSet
from spacearm.robot import Robot

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

_INERTIAL = -2  # stands for the inertial frame in place of the joint of the other body
_OUTWARD = 1 + 1e-12  # times the radius of an enclosing ball, which covers its rounding
_CELL = 16  # balls in a cell
_FEW = 64  # up to this number of balls no cells are made


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
class Bodies:
    """The robot's b bodies: its c capsules, then a ball around each of its links.

    Attributes:
        capsules: c.
        ends: (b, e, 3) the ends of the axes, in the frame of the body's joint [m]; e is 1 if all bodies are balls, else 2.
        radius: (b,) [m].
        joint: (b,) the joint that carries the body, -1 for the base.
        members: (c,) the capsules, link by link.
        first, count: (b,) the capsules in a link's ball are `members[first : first + count]`; count is 0 for a capsule.
    """

    capsules: int
    ends: Array
    radius: Array
    joint: Indices
    members: Indices
    first: Indices
    count: Indices


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RelativeBodies:
    """m relative bodies, and the p relative motions that they share.

    Attributes:
        body: (m,) the body.
        motion: (m,) its relative motion.
        count: (m,) how many of the relative bodies after it are inside it; 0 for a capsule.
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
    for i, capsule in enumerate(robot.capsules):
        by_link[capsule.name, capsule.joint].append(i)
    inside = list(by_link.values())
    count = np.array([len(link) for link in inside], dtype=np.intp)
    members = np.array([i for link in inside for i in link], dtype=np.intp)
    a, b = (np.array([getattr(c, end) for c in robot.capsules]).reshape(-1, 3) for end in ("a", "b"))
    radius = np.array([capsule.radius for capsule in robot.capsules])
    ends = np.stack([a, b], axis=1)
    balls = [_ball(ends[link], radius[link]) for link in inside]
    centers = np.array([center for center, _ in balls]).reshape(-1, 1, 3)
    ends = np.concatenate([ends, np.repeat(centers, 2, axis=1)])
    return Bodies(
        capsules=len(members),
        ends=ends[:, :1] if np.array_equal(a, b) else ends,
        radius=np.concatenate([radius, [r for _, r in balls]]),
        joint=np.array([c.joint for c in robot.capsules] + [joint for _, joint in by_link], dtype=np.intp),
        members=members,
        first=np.concatenate([np.zeros(len(members), np.intp), np.cumsum(count) - count]),
        count=np.concatenate([np.zeros(len(members), np.intp), count]),
    )


def _ball(ends: Array, radius: Array) -> tuple[Array, float]:
    """Return the centre and the radius of a ball around capsules: ends (k, 2, 3), radius (k,)."""
    grown = radius[:, None, None]
    center = ((ends - grown).min(axis=(0, 1)) + (ends + grown).max(axis=(0, 1))) / 2
    return center, float((np.linalg.norm(ends - center, axis=2).max(axis=1) + radius).max()) * _OUTWARD


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

    balls = range(bodies.capsules, len(bodies.radius))
    scene_relative = [family(ball, scene) for ball in balls]
    named: dict[str, list[int]] = defaultdict(list)
    for ball in balls:
        named[robot.capsules[bodies.members[bodies.first[ball]]].name].append(ball)
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


# ---- Solids ----------------------------------------------------------------------------------------------------------


class Solids(Protocol):
    """k solids of one shape."""

    @property
    def radius(self) -> Array:
        """The radius around each core, (k,) [m]."""
        ...

    @property
    def obstacle(self) -> Indices:
        """The index in the scene of the obstacle that each solid is, or is a part of, (k,)."""
        ...

    def placed(self, k: Indices) -> tuple[Array | None, Array]:
        """Return the axes (t, 3, 3) of solids k (t,), None for those of the world, and the origins (t, 3) [m]."""
        ...

    def nearest(self, k: Indices, x: Array) -> Array:
        """Return the points (t, 3) of the cores nearest to x (t, 3)."""
        ...

    def support(self, k: Indices, n: Array) -> Array:
        """Return the support functions of the cores in the directions n (t, 3): the greatest n . y, (t,) [m]."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Balls:
    """Spheres, and the balls of sphere sets; or cells, each around consecutive balls.

    Attributes:
        center: (k, 3) [m].
        radius, obstacle: as in `Solids`.
        first, count: (k,) the balls in a cell are first to first + count - 1; 0 for a ball.
    """

    center: Array
    radius: Array
    obstacle: Indices
    first: Indices
    count: Indices

    def placed(self, k: Indices) -> tuple[Array | None, Array]:
        """Return None, and the centres."""
        return None, self.center[k]

    def nearest(self, k: Indices, x: Array) -> Array:
        """Return the centres, which are the origins."""
        return np.zeros_like(x)

    def support(self, k: Indices, n: Array) -> Array:
        """Return 0: the core is a point."""
        return np.zeros(len(n))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Boxes:
    """Boxes; and capsules, as boxes without width and with a radius.

    Attributes:
        axes, origin: (k, 3, 3) and (k, 3) [m].
        half: (k, 3) half the edges [m].
        radius, obstacle: as in `Solids`.
    """

    axes: Array
    origin: Array
    half: Array
    radius: Array
    obstacle: Indices

    def placed(self, k: Indices) -> tuple[Array | None, Array]:
        """Return the axes and the centres."""
        return self.axes[k], self.origin[k]

    def nearest(self, k: Indices, x: Array) -> Array:
        """Return the points clipped to the boxes."""
        half = self.half[k]
        return np.minimum(np.maximum(x, -half), half)

    def support(self, k: Indices, n: Array) -> Array:
        """Return |n| . half."""
        return np.einsum("tc,tc->t", np.abs(n), self.half[k])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Cylinders:
    """Cylinders along z.

    Attributes:
        axes, origin: (k, 3, 3) and (k, 3) [m].
        round, half: (k,) radius and half length of the core [m].
        radius, obstacle: as in `Solids`; the radius around the core is 0.
    """

    axes: Array
    origin: Array
    round: Array
    half: Array
    radius: Array
    obstacle: Indices

    def placed(self, k: Indices) -> tuple[Array | None, Array]:
        """Return the axes and the centres."""
        return self.axes[k], self.origin[k]

    def nearest(self, k: Indices, x: Array) -> Array:
        """Return the points, clipped in their distance from the axis and in their height."""
        out, most, half = np.empty_like(x), self.round[k], self.half[k]
        share = most / np.maximum(np.hypot(x[:, 0], x[:, 1]), most)
        out[:, :2] = x[:, :2] * share[:, None]
        out[:, 2] = np.minimum(np.maximum(x[:, 2], -half), half)
        return out

    def support(self, k: Indices, n: Array) -> Array:
        """Return n . y of the point of the rim that is furthest along n."""
        return np.hypot(n[:, 0], n[:, 1]) * self.round[k] + np.abs(n[:, 2]) * self.half[k]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class HalfSpaces:
    """Half-spaces below z = 0 of their own axes.

    Attributes:
        axes, origin: (k, 3, 3) and (k, 3) [m].
        radius, obstacle: as in `Solids`.
    """

    axes: Array
    origin: Array
    radius: Array
    obstacle: Indices

    def placed(self, k: Indices) -> tuple[Array | None, Array]:
        """Return the axes, z along the normal, and the points on the planes."""
        return self.axes[k], self.origin[k]

    def nearest(self, k: Indices, x: Array) -> Array:
        """Return the points projected onto the planes from above."""
        out = x.copy()
        out[:, 2] = np.minimum(x[:, 2], 0.0)
        return out

    def support(self, k: Indices, n: Array) -> Array:
        """Return 0 along the normal; a half-space is infinite in all other directions."""
        return np.where((n[:, 0] == 0) & (n[:, 1] == 0) & (n[:, 2] >= 0), 0.0, np.inf)


@cached_by_identity
def solids_of(scene: Scene) -> tuple[Solids, ...]:
    """Return the scene's obstacles, by shape."""
    makers = (_scene_balls, _scene_boxes, _scene_cylinders, _scene_half_spaces)
    made = (maker(list(enumerate(scene.obstacles))) for maker in makers)
    return tuple(solids for solids in made if solids is not None)


Numbered = list[tuple[int, Obstacle]]


def _scene_balls(obstacles: Numbered) -> Balls | None:
    rows: list[tuple[Array, Array, Indices]] = []
    for i, item in obstacles:
        if isinstance(item, Sphere):
            rows.append((item.center[None], np.array([item.radius]), np.array([i])))
        elif isinstance(item, SphereSet):
            rows.append((item.centers, item.radii, np.full(len(item.radii), i)))
    if not rows:
        return None
    center, radius, obstacle = (np.concatenate(column) for column in zip(*rows, strict=True))
    return _sorted_balls(center, radius, obstacle)


def _scene_boxes(obstacles: Numbered) -> Boxes | None:
    rows: list[tuple[Array, Array, Array, float, int]] = []
    for i, item in obstacles:
        if isinstance(item, Box):
            rows.append((item.pose[:3, :3], item.pose[:3, 3], item.size / 2, 0.0, i))
        elif isinstance(item, Capsule):
            half = np.array([0.0, 0.0, float(np.linalg.norm(item.b - item.a)) / 2])
            rows.append((axes_along(item.b - item.a), (item.a + item.b) / 2, half, item.radius, i))
    if not rows:
        return None
    axes, origin, half, radius, obstacle = (np.array(column) for column in zip(*rows, strict=True))
    return Boxes(axes=axes, origin=origin, half=half, radius=radius, obstacle=obstacle)


def _scene_cylinders(obstacles: Numbered) -> Cylinders | None:
    some = [(i, item) for i, item in obstacles if isinstance(item, Cylinder)]
    if not some:
        return None
    return Cylinders(
        axes=np.array([item.pose[:3, :3] for _, item in some]),
        origin=np.array([item.pose[:3, 3] for _, item in some]),
        round=np.array([item.radius for _, item in some]),
        half=np.array([item.length / 2 for _, item in some]),
        radius=np.zeros(len(some)),
        obstacle=np.array([i for i, _ in some]),
    )


def _scene_half_spaces(obstacles: Numbered) -> HalfSpaces | None:
    some = [(i, item) for i, item in obstacles if isinstance(item, HalfSpace)]
    if not some:
        return None
    return HalfSpaces(
        axes=np.array([axes_along(item.normal) for _, item in some]),
        origin=np.array([item.point for _, item in some]),
        radius=np.zeros(len(some)),
        obstacle=np.array([i for i, _ in some]),
    )


@cached_by_identity
def cells_of(balls: Balls) -> Balls | None:
    """Return cells of up to 16 neighbouring balls each; None for at most 64 balls, where cells do not pay."""
    if len(balls.radius) <= _FEW:
        return None
    starts = np.arange(0, len(balls.radius), _CELL)
    counts = np.diff(np.append(starts, len(balls.radius)))
    cell = np.repeat(np.arange(len(starts)), counts)
    grown = balls.radius[:, None]
    low = np.minimum.reduceat(balls.center - grown, starts)
    high = np.maximum.reduceat(balls.center + grown, starts)
    center = (low + high) / 2
    reach = np.linalg.norm(balls.center - center[cell], axis=1) + balls.radius
    return Balls(
        center=center,
        radius=np.maximum.reduceat(reach, starts) * _OUTWARD,
        obstacle=balls.obstacle[starts],
        first=starts.astype(np.intp),
        count=counts.astype(np.intp),
    )


def lengths(solids: Solids) -> list[Array]:
    """Return all arrays of solids that are lengths [m]."""
    names = ("center", "origin", "half", "round", "radius")
    return [getattr(solids, name) for name in names if hasattr(solids, name)]


def axes_along(z: Array) -> Array:
    """Return a rotation (3, 3) whose z is along a vector (3,); the identity for the vector 0."""
    length = float(np.linalg.norm(z))
    if length == 0:
        return np.eye(3)
    z = z / length
    x = np.cross(z, np.eye(3)[int(np.argmin(np.abs(z)))])
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z]).astype(np.float64)


@cached_by_identity
def body_axes(bodies: Bodies) -> Array:
    """Return rotations (b, 3, 3) whose z is along the axes of bodies, in the frames of their joints."""
    return np.array([axes_along(ends[-1] - ends[0]) for ends in bodies.ends]).reshape(-1, 3, 3)


def _sorted_balls(center: Array, radius: Array, obstacle: Indices) -> Balls:
    """Return balls in an order in which neighbours follow each other."""
    order = np.arange(len(radius))
    if len(radius) > _FEW:
        order = _neighbours(center, order)
    none = np.zeros(len(radius), np.intp)
    return Balls(center=center[order], radius=radius[order], obstacle=obstacle[order].astype(np.intp), first=none, count=none)


def _neighbours(center: Array, order: Indices) -> Indices:
    """Return an order in which neighbours follow each other: halved along the longest side, until the parts are cells."""
    if len(order) <= _CELL:
        return order
    points = center[order]
    axis = int(np.argmax(np.ptp(points, axis=0)))
    cells = -(-len(order) // _CELL)
    half = cells // 2 * _CELL
    order = order[np.argpartition(points[:, axis], half)]
    return np.concatenate([_neighbours(center, order[:half]), _neighbours(center, order[half:])])
