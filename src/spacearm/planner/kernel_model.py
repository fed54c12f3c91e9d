"""A robot and a scene as the kernel sees them: points, an envelope of capsules, obstacles."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm.core.errors import RobotError, SceneError
from spacearm.core.native import native
from spacearm.geometry import Box, Capsule, Cylinder, HalfSpace, Scene, Sphere, SphereSet
from spacearm.robot import Robot, joint_centres
from spacearm.robot.kinematics import tree_arrays

_SHAPE = {"Sphere": 1, "Capsule": 2, "Box": 3, "Cylinder": 4, "HalfSpace": 5}
_NUMBERS = 15  # an obstacle's row
_WIDEST = 1e9  # [m, or what a joint multiplies by]


@dataclass(frozen=True, slots=True, kw_only=True)
class KernelModel:
    """The kernel's model and the meaning of its indices.

    Attributes:
        native: the kernel's own object.
        precision: 32 or 64, the bits of its numbers.
        centres: indices of the points that are the robot's distinct joint centres and its tip, eq. (5).
        tip: index of the point that is the end effector.
        points: indices of the further points that were asked for.
        capsules: the names of the links, one for each capsule.
        obstacle_of: (k,) which of the scene's obstacles each of the kernel's is; a sphere set is several.
        dof: number of degrees of freedom.
    """

    native: Any
    precision: int
    centres: tuple[int, ...]
    tip: int
    points: tuple[int, ...]
    capsules: tuple[str, ...]
    obstacle_of: NDArray[np.intp]
    dof: int


def native_class(name: str, precision: int) -> Any:
    """Return the kernel's class of that name for numbers of 32 or 64 bits."""
    return getattr(native, f"{name}{precision}")


class _Kept:
    """What was made for the objects seen last: the same objects, not equal ones, for comparing large ones takes longer."""

    def __init__(self, most: int) -> None:
        self._most, self._made = most, OrderedDict[tuple[Any, ...], tuple[Any, Any]]()

    def get(self, objects: tuple[Any, ...], rest: tuple[Any, ...], make: Callable[[], Any]) -> Any:
        key = (*map(id, objects), *rest)
        if key not in self._made:
            self._made[key] = objects, make()  # kept alive with what was made, so that no other object gets its id
            while len(self._made) > self._most:
                self._made.popitem(last=False)
        return self._made[key][1]


_models, _arms = _Kept(8), _Kept(8)


def kernel_model(robot: Robot, scene: Scene, *, precision: int = 64) -> KernelModel:
    """Return `make_kernel_model`'s; kept for the robots and scenes seen last."""
    return _models.get((robot, scene), (precision,), lambda: make_kernel_model(robot, scene, precision=precision))


def make_kernel_model(
    robot: Robot,
    scene: Scene,
    *,
    precision: int = 64,
    frame: str | None = None,
    points: Iterable[tuple[int, ArrayLike]] = (),
) -> KernelModel:
    """Translate robot and scene for the kernel.

    Args:
        robot: its capsules become pairs of points; points that coincide are carried once.
        scene: obstacles of any shape.
        precision: 32 or 64.
        frame: whose origin is the end effector's point; `robot.tip` unless given.
        points: further points to carry, each a joint's index (-1: the base) and a place in its frame (3,) [m].

    Raises:
        SceneError, RobotError: a number so large that the kernel, which works in float32 too, cannot compute with it.
    """
    asked = tuple((joint, np.asarray(point, dtype=np.float64)) for joint, point in points)
    arm = (
        _arms.get((robot,), (precision, frame), lambda: _arm(robot, precision, frame, ()))
        if not asked
        else _arm(robot, precision, frame, asked)
    )
    kinds, rows, of = _obstacle_rows(scene)
    spheres = [o for o in scene.obstacles if isinstance(o, Sphere)]
    plain = native_class("Model", precision).make(
        **arm.arrays,
        sphere_center=np.array([s.center for s in spheres], dtype=np.float64).reshape(-1, 3),
        sphere_radius=np.array([s.radius for s in spheres], dtype=np.float64),
    )
    return KernelModel(
        native=plain.surrounded(
            **arm.envelope,
            obstacle_kind=kinds,
            obstacle_numbers=rows,
        ),
        precision=precision,
        centres=arm.centres,
        tip=arm.tip,
        points=arm.points,
        capsules=tuple(c.name for c in robot.capsules),
        obstacle_of=of,
        dof=robot.dof,
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class _Arm:
    """What depends on the robot alone."""

    arrays: dict[str, Any]
    envelope: dict[str, Any]
    centres: tuple[int, ...]
    tip: int
    points: tuple[int, ...]


def _arm(robot: Robot, precision: int, frame: str | None, further: tuple[tuple[int, NDArray[np.float64]], ...]) -> _Arm:
    carried = _Points(robot)
    centres = tuple(carried.index(joint, point) for joint, point in joint_centres(robot))
    tip_frame = robot.frame(frame or robot.tip)
    tip = carried.index(tip_frame.joint, tip_frame.T_joint_frame[:3, 3])
    points = tuple(carried.index(joint, point) for joint, point in further)
    ends = [(carried.index(c.joint, c.a), carried.index(c.joint, c.b)) for c in robot.capsules]
    arrays = {
        **tree_arrays(robot),
        "point_joint": np.array([joint for joint, _ in carried.listed], dtype=np.int32),
        "point_local": np.array([point for _, point in carried.listed], dtype=np.float64).reshape(-1, 3),
        "capsule_a": np.array([a for a, _ in ends], dtype=np.int32),
        "capsule_b": np.array([b for _, b in ends], dtype=np.int32),
        "capsule_radius": np.array([c.radius for c in robot.capsules], dtype=np.float64),
    }
    far = max(float(np.abs(values).max(initial=0.0)) for values in arrays.values() if isinstance(values, np.ndarray))
    if far > _WIDEST:
        raise RobotError(
            f"robot '{robot.name}' has a number of {far:.3g} among its frames and capsules, expected at most "
            f"{_WIDEST:g} m; check its units"
        )
    return _Arm(arrays=arrays, envelope=_envelope(robot), centres=centres, tip=tip, points=points)


def self_capsule_pairs(robot: Robot) -> NDArray[np.int32]:
    """Return the pairs of capsules that must keep clear of each other, (p, 2) indices into `robot.capsules`."""
    of: dict[str, list[int]] = {}
    for i, capsule in enumerate(robot.capsules):
        of.setdefault(capsule.name, []).append(i)
    pairs = [(i, k) for one, two in robot.self_pairs for i in of[one] for k in of[two]]
    return np.array(pairs, dtype=np.int32).reshape(-1, 2)


def _envelope(robot: Robot) -> dict[str, Any]:
    """Return the capsules as arrays, link by link; the links' pairs are of such groups."""
    groups: dict[tuple[str, int], int] = {}
    link = np.array([groups.setdefault((c.name, c.joint), len(groups)) for c in robot.capsules], dtype=np.int32)
    of: dict[str, list[int]] = {}
    for (name, _), group in groups.items():
        of.setdefault(name, []).append(group)
    pairs = [(i, k) for one, two in robot.self_pairs for i in of[one] for k in of[two]]
    order = np.argsort(link, kind="stable").astype(np.int32)
    capsules = [robot.capsules[i] for i in order]
    return {
        "index": order,
        "joint": np.array([c.joint for c in capsules], dtype=np.int32),
        "link": link[order],
        "a": np.array([c.a for c in capsules], dtype=np.float64).reshape(-1, 3),
        "b": np.array([c.b for c in capsules], dtype=np.float64).reshape(-1, 3),
        "radius": np.array([c.radius for c in capsules], dtype=np.float64),
        "pairs": np.array(pairs, dtype=np.int32).reshape(-1, 2),
    }


def _obstacle_rows(scene: Scene) -> tuple[NDArray[np.int32], NDArray[np.float64], NDArray[np.intp]]:
    """Return each obstacle's shape and numbers as the kernel has them, and which of the scene's it is."""
    counts = np.array([len(o.radii) if isinstance(o, SphereSet) else 1 for o in scene.obstacles], dtype=np.intp)
    of = np.repeat(np.arange(len(counts)), counts)
    kinds, rows = np.full(len(of), _SHAPE["Sphere"], dtype=np.int32), np.zeros((len(of), _NUMBERS))
    first = 0
    for obstacle, count in zip(scene.obstacles, counts.tolist(), strict=True):
        if isinstance(obstacle, SphereSet):
            rows[first : first + count, :3], rows[first : first + count, 3] = obstacle.centers, obstacle.radii
        else:
            kinds[first] = _SHAPE[type(obstacle).__name__]
            _write(obstacle, rows[first])
        first += count
    far = np.abs(rows).max(axis=1, initial=0.0)
    if (far > _WIDEST).any():
        worst = int(np.argmax(far))
        raise SceneError(
            f"obstacle {scene.called(int(of[worst]))} has a number of {far[worst]:.3g}, expected at most {_WIDEST:g} m; check "
            "its units"
        )
    return kinds, rows, of


def _write(o: Sphere | Capsule | Box | Cylinder | HalfSpace, row: NDArray[np.float64]) -> None:
    if isinstance(o, Sphere):
        row[:3], row[3] = o.center, o.radius
    elif isinstance(o, Capsule):
        row[:3], row[3:6], row[6] = o.a, o.b, o.radius
    elif isinstance(o, Box):
        row[:3], row[3:12], row[12:] = o.pose[:3, 3], o.pose[:3, :3].T.ravel(), o.size / 2
    elif isinstance(o, Cylinder):
        row[:3], row[3:6], row[6], row[7] = o.pose[:3, 3], o.pose[:3, 2], o.length / 2, o.radius
    else:
        row[:3], row[3] = o.normal, float((o.normal * o.point).sum())


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
