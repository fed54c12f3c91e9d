"""Where the links are and how far from the obstacles, by other people's code: Pinocchio and Coal."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from spacearm.robot import Robot
from spacearm.scene import Scene

Array = NDArray[np.float64]


class Witness:
    """Clearances of a robot's links and a scene's obstacles, configuration by configuration.

    Built from the robot's and the scene's own numbers, apart from the kernel that the search uses.
    """

    def __init__(self, robot: Robot, scene: Scene) -> None:
        # Both install into a folder of their own that type checkers do not look into.
        import coal  # pyright: ignore[reportMissingImports]
        import pinocchio  # pyright: ignore[reportMissingImports]

        self._robot, self._coal, self._pinocchio = robot, coal, pinocchio
        self.name = f"pinocchio {pinocchio.__version__}, coal {coal.__version__}"
        self._model = pinocchio.Model()
        kinds = {"revolute": pinocchio.JointModelRZ, "prismatic": pinocchio.JointModelPZ}
        self._ids = []
        for joint in robot.joints:
            parent = self._ids[joint.parent] if joint.parent >= 0 else 0
            T = joint.T_parent_joint
            placement = pinocchio.SE3(np.ascontiguousarray(T[:3, :3]), np.ascontiguousarray(T[:3, 3]))
            self._ids.append(self._model.addJoint(parent, kinds[joint.kind](), placement, joint.name))
        self._data = self._model.createData()
        self._values = np.zeros(self._model.nq)
        self._index = [self._model.joints[i].idx_q for i in self._ids]
        self._links = [self._shape(capsule.a, capsule.b, capsule.radius) for capsule in robot.capsules]
        self._joints = [capsule.joint for capsule in robot.capsules]
        self._obstacles = [(coal.Sphere(o.radius), coal.Transform3s(np.eye(3), np.array(o.center))) for o in scene.obstacles]

    def clearances(self, q: Array) -> Array:
        """Return the clearance [m] of every link's capsule and every obstacle, (capsules, obstacles), at q (n,)."""
        for joint, at in zip(self._robot.joints, self._index, strict=True):
            self._values[at] = joint.multiplier * q[joint.dof] + joint.offset
        self._pinocchio.forwardKinematics(self._model, self._data, self._values)
        out = np.empty((len(self._links), len(self._obstacles)))
        request, result = self._coal.DistanceRequest(), self._coal.DistanceResult()
        for i, ((shape, T_joint_shape), joint) in enumerate(zip(self._links, self._joints, strict=True)):
            at = T_joint_shape if joint < 0 else self._data.oMi[self._ids[joint]] * T_joint_shape
            placed = self._coal.Transform3s(at.rotation, at.translation)
            for k, (obstacle, T) in enumerate(self._obstacles):
                result.clear()
                out[i, k] = self._coal.distance(shape, placed, obstacle, T, request, result)
        return out

    def _shape(self, a: Array, b: Array, radius: float) -> tuple[Any, Any]:
        """Return Coal's shape, whose axis is z about its middle, and its place in the joint's frame."""
        length = float(np.linalg.norm(b - a))
        middle = np.asarray((a + b) / 2)
        if length == 0:
            return self._coal.Sphere(radius), self._pinocchio.SE3(np.eye(3), middle)
        z = (b - a) / length
        x = np.cross(z, np.eye(3)[int(np.argmin(np.abs(z)))])
        x /= np.linalg.norm(x)
        rotation = np.column_stack([x, np.cross(z, x), z])
        return self._coal.Capsule(radius, length), self._pinocchio.SE3(rotation, middle)
