"""A robot and a scene as the kernel sees them: points, an envelope of bodies, obstacles."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import Generic, TypeAlias, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm.core.errors import RobotError, SceneError
from spacearm.core.identity_cache import cached_by_identity
from spacearm.core.native import native
from spacearm.geometry import (
    Box,
    Capsule,
    ConvexShape,
    HalfSpace,
    Obstacle,
    Polytope,
    PolytopeSet,
    Scene,
    Sphere,
    SphereSet,
    core_of,
)
from spacearm.robot import Robot, joint_centres
from spacearm.robot.kinematics import kernel_joints
from spacearm.robot.link_shapes import as_capsule, bounding_capsule

Made = TypeVar("Made")

_CACHED = 8  # robots, and pairs of a robot and a scene, whose models are cached
_WIDEST = 1e9  # [m, or what a joint multiplies by]: beyond, squares overflow in float32


class KernelModel:
    """A robot and a scene as the kernel has them, and the meaning of its indices.

    Attributes:
        world: what its models are built from.
        centres: indices of the points that are the robot's distinct joint centres and its tip, eq. (5).
        tip: index of the point that is the end effector.
        points: indices of the further points that were asked for.
        bodies: the names of the links, one for each of the robot's shapes.
        obstacle_of: (k,) which of the scene's obstacles each of the kernel's is; a set of shapes is several.
        dof: number of degrees of freedom.
    """

    def __init__(self, world: native.World, arm: _Arm, robot: Robot, obstacle_of: NDArray[np.intp]) -> None:
        self.world = world
        self.centres, self.tip, self.points = arm.centres, arm.tip, arm.points
        self.bodies = tuple(part.name for part in robot.shapes)
        self.obstacle_of = obstacle_of
        self.dof = robot.dof

    @cached_property
    def model64(self) -> native.Model64:
        """The kernel's model in float64."""
        return native.Model64(self.world)

    @cached_property
    def model32(self) -> native.Model32:
        """The kernel's model in float32, for searching."""
        return native.Model32(self.world)


class IdentityCache(Generic[Made]):
    """What was made for the objects seen last: the same objects, not equal ones, for comparing large ones takes longer."""

    def __init__(self, most: int) -> None:
        self._most, self._made = most, OrderedDict[tuple[object, ...], tuple[tuple[object, ...], Made]]()

    def get(self, objects: tuple[object, ...], rest: tuple[object, ...], make: Callable[[], Made]) -> Made:
        """Return what was made for these objects and for what equals the rest, or make it."""
        key = (*map(id, objects), *rest)
        if key not in self._made:
            self._made[key] = objects, make()  # kept alive with what was made, so that no other object gets its id
            while len(self._made) > self._most:
                self._made.popitem(last=False)
        return self._made[key][1]


def kernel_model(robot: Robot, scene: Scene) -> KernelModel:
    """Return `make_kernel_model`'s; cached by identity for the robots and scenes seen last."""
    return _models.get((robot, scene), (), lambda: make_kernel_model(robot, scene))


def make_kernel_model(
    robot: Robot,
    scene: Scene,
    *,
    frame: str | None = None,
    points: Iterable[tuple[int, ArrayLike]] = (),
    pair_margins: native.PairMargins | None = None,
    masses: native.Masses | None = None,
) -> KernelModel:
    """Translate robot and scene for the kernel.

    Args:
        robot: its shapes become bodies; for the paper's objective each is a capsule between two points as well, which encloses
            it. Points that coincide are carried once.
        scene: obstacles of any shape.
        frame: whose origin is the end effector's point; `robot.tip` unless given.
        points: further points to carry, each a joint's index (-1: the base) and a place in its frame (3,) [m].
        pair_margins: of pairs whose margin is another than that of all others.
        masses: of a robot whose arm moves its base.

    Raises:
        SceneError, RobotError: a number so large that the kernel, which works in float32 too, cannot compute with it.
    """
    asked = tuple((joint, np.asarray(point, dtype=np.float64)) for joint, point in points)
    arm = _arm(robot, frame, asked) if asked else _arms.get((robot,), (frame,), lambda: _arm(robot, frame, ()))
    obstacles, of = _obstacles(scene)
    spheres = [o for o in scene.obstacles if isinstance(o, Sphere)]
    world = native.World(
        joints=arm.joints,
        points=arm.carried,
        point_capsules=arm.point_capsules,
        point_spheres=_spheres([s.center for s in spheres], [s.radius for s in spheres]),
        envelope=arm.envelope,
        obstacles=obstacles,
        pair_margins=pair_margins,
        masses=masses,
    )
    return KernelModel(world, arm, robot, of)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Arm:
    """What depends on the robot alone."""

    joints: native.Joints
    carried: native.Points
    point_capsules: native.PointCapsules
    envelope: native.Envelope
    centres: tuple[int, ...]
    tip: int
    points: tuple[int, ...]


_models = IdentityCache[KernelModel](_CACHED)
_arms = IdentityCache[_Arm](_CACHED)


def _arm(robot: Robot, frame: str | None, further: tuple[tuple[int, NDArray[np.float64]], ...]) -> _Arm:
    carried = _Points(robot)
    centres = tuple(carried.index(joint, point) for joint, point in joint_centres(robot))
    tip_frame = robot.frame(frame or robot.tip)
    tip = carried.index(tip_frame.joint, tip_frame.T_joint_frame[:3, 3])
    points = tuple(carried.index(joint, point) for joint, point in further)
    capsules = [as_capsule(part) or bounding_capsule(part) for part in robot.shapes]
    ends = [(carried.index(c.joint, c.a), carried.index(c.joint, c.b)) for c in capsules]
    local = np.array([point for _, point in carried.listed], dtype=np.float64).reshape(-1, 3)
    radius = np.array([c.radius for c in capsules], dtype=np.float64)
    _require_within_reach(robot, local, radius)
    return _Arm(
        joints=kernel_joints(robot),
        carried=native.Points(joint=np.array([joint for joint, _ in carried.listed], dtype=np.int32), local=local),
        point_capsules=native.PointCapsules(
            a=np.array([a for a, _ in ends], dtype=np.int32), b=np.array([b for _, b in ends], dtype=np.int32), radius=radius
        ),
        envelope=_envelope(robot),
        centres=centres,
        tip=tip,
        points=points,
    )


def _require_within_reach(robot: Robot, *arrays: NDArray[np.float64]) -> None:
    numbers = [*arrays, *(joint.T_parent_joint for joint in robot.joints)]
    numbers += [np.array([joint.multiplier, joint.offset]) for joint in robot.joints]
    numbers += [np.asarray(number) for part in robot.shapes for number in _numbers(part.shape)]
    far = max(float(np.abs(values).max(initial=0.0)) for values in numbers)
    if far > _WIDEST:
        raise RobotError(
            f"robot '{robot.name}' has a number of {far:.3g} among its frames and shapes, expected at most "
            f"{_WIDEST:g} m; check its units"
        )


@cached_by_identity
def self_shape_pairs(robot: Robot) -> NDArray[np.int32]:
    """Return the pairs of shapes that must keep clear of each other, (p, 2) indices into `robot.shapes`."""
    of: dict[str, list[int]] = {}
    for i, part in enumerate(robot.shapes):
        of.setdefault(part.name, []).append(i)
    listed = [(i, k) for one, two in robot.self_pairs for i in of[one] for k in of[two]]
    pairs = np.array(listed, dtype=np.int32).reshape(-1, 2)
    pairs.flags.writeable = False
    return pairs


def _envelope(robot: Robot) -> native.Envelope:
    """Return the bodies with their links; the links' pairs are of bodies that one joint carries."""
    groups: dict[tuple[str, int], int] = {}
    link = np.array([groups.setdefault((part.name, part.joint), len(groups)) for part in robot.shapes], dtype=np.int32)
    of: dict[str, list[int]] = {}
    for (name, _), group in groups.items():
        of.setdefault(name, []).append(group)
    pairs = [(i, k) for one, two in robot.self_pairs for i in of[one] for k in of[two]]
    capsules = [as_capsule(part) for part in robot.shapes]
    solid = np.cumsum([capsule is None for capsule in capsules]) - 1
    return native.Envelope(
        joint=np.array([part.joint for part in robot.shapes], dtype=np.int32),
        link=link,
        a=np.array([np.zeros(3) if c is None else c.a for c in capsules], dtype=np.float64).reshape(-1, 3),
        b=np.array([np.zeros(3) if c is None else c.b for c in capsules], dtype=np.float64).reshape(-1, 3),
        radius=np.array([0.0 if c is None else c.radius for c in capsules], dtype=np.float64),
        pairs=np.array(pairs, dtype=np.int32).reshape(-1, 2),
        solid=np.array([solid[i] if c is None else -1 for i, c in enumerate(capsules)], dtype=np.int32),
        solids=[_solid(part.shape) for part, c in zip(robot.shapes, capsules, strict=True) if c is None],
    )


def _solid(shape: ConvexShape) -> native.Solid:
    core = core_of(shape)
    kinds = {"box": native.CoreKind.box, "cylinder": native.CoreKind.cylinder, "polytope": native.CoreKind.polytope}
    return native.Solid(
        shape=native.ConvexShape(
            kind=kinds[core.kind], half=np.array(core.half), radius=core.radius, vertices=np.array(core.vertices)
        ),
        axes=np.ascontiguousarray(core.T[:3, :3].T),
        origin=core.T[:3, 3].copy(),
    )


KernelObstacle: TypeAlias = native.Spheres | native.Capsule | native.Box | native.Cylinder | native.HalfSpace | native.Polytope


def _obstacles(scene: Scene) -> tuple[list[KernelObstacle], NDArray[np.intp]]:
    """Return the scene's obstacles as the kernel has them, and which of the scene's each of the kernel's is."""
    numbers = [np.asarray(number).ravel() for obstacle in scene.obstacles for number in _numbers(obstacle)]
    outside = bool(numbers) and float(np.abs(np.concatenate(numbers)).max(initial=0.0)) > _WIDEST
    for i, obstacle in enumerate(scene.obstacles if outside else ()):
        far = max(float(np.abs(values).max(initial=0.0)) for values in _numbers(obstacle))
        if far > _WIDEST:
            raise SceneError(
                f"obstacle {scene.called(i)} has a number of {far:.3g}, expected at most {_WIDEST:g} m; check its units"
            )
    translated = [_translated(obstacle) for obstacle in scene.obstacles]
    counts = [
        len(obstacle.radii) if isinstance(obstacle, SphereSet) else len(made)
        for obstacle, made in zip(scene.obstacles, translated, strict=True)
    ]
    return [one for made in translated for one in made], np.repeat(np.arange(len(counts)), counts)


def _spheres(centers: Iterable[ArrayLike], radii: Iterable[float]) -> native.Spheres:
    return native.Spheres(center=np.array(centers, dtype=np.float64).reshape(-1, 3), radius=np.array(radii, dtype=np.float64))


def _translated(o: Obstacle) -> list[KernelObstacle]:
    if isinstance(o, SphereSet):
        return [native.Spheres(center=np.array(o.centers, dtype=np.float64), radius=np.array(o.radii, dtype=np.float64))]
    if isinstance(o, PolytopeSet):
        return [_polytope(piece) for piece in o.pieces]
    if isinstance(o, Polytope):
        return [_polytope(o)]
    if isinstance(o, Sphere):
        return [_spheres([o.center], [o.radius])]
    if isinstance(o, Capsule):
        return [native.Capsule(a=o.a, b=o.b, radius=o.radius)]
    if isinstance(o, HalfSpace):
        return [native.HalfSpace(normal=o.normal, offset=float((o.normal * o.point).sum()))]
    center, axes = o.pose[:3, 3].copy(), np.ascontiguousarray(o.pose[:3, :3].T)
    if isinstance(o, Box):
        return [native.Box(center=center, axes=axes, half_size=o.size / 2, rounding=o.rounding)]
    half = o.length / 2
    return [native.Cylinder(center=center, axis=axes[2].copy(), half_length=half, radius=o.radius, rounding=o.rounding)]


def _polytope(o: Polytope) -> native.Polytope:
    return native.Polytope(vertices=np.array(o.vertices), rounding=o.rounding)


def _numbers(o: Obstacle | ConvexShape) -> tuple[ArrayLike, ...]:
    """Return the numbers that the kernel has of a shape."""
    if isinstance(o, SphereSet):
        return o.centers, o.radii
    if isinstance(o, PolytopeSet):
        return tuple(number for piece in o.pieces for number in _numbers(piece))
    if isinstance(o, Polytope):
        return o.vertices, o.rounding
    if isinstance(o, Sphere):
        return o.center, o.radius
    if isinstance(o, Capsule):
        return o.a, o.b, o.radius
    if isinstance(o, HalfSpace):
        return o.normal, (o.normal * o.point).sum()
    if isinstance(o, Box):
        return o.pose, o.size, o.rounding
    return o.pose, o.length, o.radius, o.rounding


class _Points:
    """The distinct points, each named once, by the joint nearest the base that carries it.

    The origin of a revolute joint does not move when the joint turns, so it belongs to the parent as well; and where
    a child stands at its parent's origin the two are one. A link's end is thus the same point as the next joint's.
    """

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self.listed: list[tuple[int, np.ndarray]] = []
        self._known: dict[tuple[int, bytes], int] = {}

    def index(self, joint: int, point: np.ndarray) -> int:
        joint, point = self._towards_base(joint, np.asarray(point, dtype=np.float64))
        point = point + 0.0  # -0.0 and 0.0 have other bytes
        index = self._known.setdefault((joint, point.tobytes()), len(self.listed))
        if index == len(self.listed):
            self.listed.append((joint, point))
        return index

    def _towards_base(self, joint: int, point: np.ndarray) -> tuple[int, np.ndarray]:
        while joint >= 0 and self._robot.joints[joint].kind == "revolute" and not point[:2].any():
            # On the joint's own axis: carried just as well by the parent.
            T = self._robot.joints[joint].T_parent_joint
            joint, point = self._robot.joints[joint].parent, T[:3, 3] + T[:3, 2] * point[2]
        return joint, point
