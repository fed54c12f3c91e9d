"""A robot and a scene as the kernel sees them: points, capsules between points, spheres."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from spacearm._kernel import native
from spacearm.robot import Robot, joint_centres
from spacearm.robot.kinematics import tree_arrays
from spacearm.scene import Scene


@dataclass(frozen=True, slots=True, kw_only=True)
class KernelModel:
    """The kernel's model and the meaning of its indices.

    Attributes:
        native: the kernel's own object.
        precision: 32 or 64, the bits of its numbers.
        centres: indices of the points that are the robot's distinct joint centres and its tip, eq. (5).
        tip: index of the point that is the end effector.
        capsules: the names of the links, one for each capsule.
        dof: number of degrees of freedom.
    """

    native: Any
    precision: int
    centres: tuple[int, ...]
    tip: int
    capsules: tuple[str, ...]
    dof: int


def native_class(name: str, precision: int) -> Any:
    """Return the kernel's class of that name for numbers of 32 or 64 bits."""
    return getattr(native, f"{name}{precision}")


def make_kernel_model(robot: Robot, scene: Scene, *, precision: int = 64, frame: str | None = None) -> KernelModel:
    """Translate robot and scene for the kernel.

    Args:
        robot: its capsules become pairs of points; points that coincide are carried once.
        scene: its spheres.
        precision: 32 or 64.
        frame: whose origin is the end effector's point; `robot.tip` unless given.
    """
    points = _Points(robot)
    centres = tuple(points.index(joint, point) for joint, point in joint_centres(robot))
    tip_frame = robot.frame(frame or robot.tip)
    tip = points.index(tip_frame.joint, tip_frame.T_joint_frame[:3, 3])
    ends = [(points.index(c.joint, c.a), points.index(c.joint, c.b)) for c in robot.capsules]
    model = native_class("Model", precision).make(
        **tree_arrays(robot),
        point_joint=np.array([joint for joint, _ in points.listed], dtype=np.int32),
        point_local=np.array([point for _, point in points.listed], dtype=np.float64).reshape(-1, 3),
        capsule_a=np.array([a for a, _ in ends], dtype=np.int32),
        capsule_b=np.array([b for _, b in ends], dtype=np.int32),
        capsule_radius=np.array([c.radius for c in robot.capsules], dtype=np.float64),
        sphere_center=np.array([s.center for s in scene.obstacles], dtype=np.float64).reshape(-1, 3),
        sphere_radius=np.array([s.radius for s in scene.obstacles], dtype=np.float64),
    )
    return KernelModel(
        native=model,
        precision=precision,
        centres=centres,
        tip=tip,
        capsules=tuple(c.name for c in robot.capsules),
        dof=robot.dof,
    )


class _Points:
    """The distinct points, each named once, by the joint nearest the base that carries it.

    The origin of a revolute joint does not move when the joint turns, so it belongs to the parent as well; and where
    a child stands at its parent's origin the two are one. A link's end is thus the same point as the next joint's.
    """

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self.listed: list[tuple[int, np.ndarray]] = []

    def index(self, joint: int, point: np.ndarray) -> int:
        joint, point = self._towards_base(joint, np.asarray(point, dtype=np.float64))
        for i, (other, known) in enumerate(self.listed):
            if other == joint and np.array_equal(known, point):
                return i
        self.listed.append((joint, point))
        return len(self.listed) - 1

    def _towards_base(self, joint: int, point: np.ndarray) -> tuple[int, np.ndarray]:
        while joint >= 0 and self._robot.joints[joint].kind == "revolute" and not point[:2].any():
            # On the joint's own axis: carried just as well by the parent.
            T = self._robot.joints[joint].T_parent_joint
            joint, point = self._robot.joints[joint].parent, T[:3, 3] + T[:3, 2] * point[2]
        return joint, point
