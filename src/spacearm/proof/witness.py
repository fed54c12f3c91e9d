"""Where the links are and how far from what is in the way, by other people's code: Pinocchio and Coal."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from spacearm.core.identity_cache import kept
from spacearm.proof.moving_bodies import Bodies
from spacearm.proof.solids import Balls, Boxes, Cylinders, Solids, axes_along
from spacearm.robot import Robot

Array = NDArray[np.float64]

_TOLERANCE = 1e-9  # Coal's own, 1e-6, lets it put a capsule 0.3 mm too far from a cylinder
_ITERATIONS = 256


class Witness:
    """Kinematics and distances, built from the robot's and the scene's own numbers, apart from the kernel."""

    def __init__(self, robot: Robot, bodies: Bodies) -> None:
        # Both install into a folder of their own that type checkers do not look into.
        import coal  # pyright: ignore[reportMissingImports]
        import pinocchio  # pyright: ignore[reportMissingImports]

        self.name = f"pinocchio {pinocchio.__version__}, coal {coal.__version__}"
        self._coal, self._pinocchio, self._bodies = coal, pinocchio, bodies
        self._model, ids = _pinocchio_model(robot)
        self._order = np.argsort([self._model.joints[i].idx_q for i in ids])
        self._state = self._model.createData()
        self._placed = [self._state.oMi[i] for i in ids]  # these follow the state
        self._capsules: dict[int, tuple[Any, Array, Array]] = {}
        self._solids: dict[tuple[int, int], tuple[Any, Any]] = {}
        self._request, self._result = coal.DistanceRequest(), coal.DistanceResult()
        self._request.gjk_tolerance = _TOLERANCE
        self._request.gjk_max_iterations = _ITERATIONS

    def frames(self, values: Array) -> Array:
        """Return T_base_joint (r, j + 1, 4, 4) at joint values (r, j); the last is the base itself."""
        out = np.empty((len(values), len(self._placed) + 1, 4, 4))
        out[:, -1] = np.eye(4)
        forward, model, state = self._pinocchio.forwardKinematics, self._model, self._state
        for row, into in zip(values[:, self._order], out, strict=True):
            forward(model, state, row)
            into[:-1] = [T.homogeneous for T in self._placed]
        return out

    def distance(self, frames: Array, capsule: int, solids: Solids, k: int) -> tuple[float, Array]:
        """Measure one capsule against one solid.

        Args:
            frames: (j + 1, 4, 4) as `frames` gives them, or T_w_joint.
            capsule: index in the robot.
            solids, k: the solid.

        Returns:
            The clearance [m], negative is penetration, and the direction (3,) from the solid to the capsule.
        """
        return self._measured(*self._capsule(frames, capsule), *self._solid(solids, k))

    def distance_between(self, frames: Array, capsule: int, other: int) -> tuple[float, Array]:
        """Measure one capsule against another one; see `distance`."""
        return self._measured(*self._capsule(frames, capsule), *self._capsule(frames, other))

    def nearest_points(self) -> Array:
        """Return the points (2, 3) of the last pair measured that are nearest, or penetrate deepest, where they were."""
        return np.array([self._result.getNearestPoint1(), self._result.getNearestPoint2()])

    def _measured(self, one: Any, T_one: Any, other: Any, T_other: Any) -> tuple[float, Array]:
        self._result.clear()
        distance = self._coal.distance(one, T_one, other, T_other, self._request, self._result)
        return float(distance), -np.array(self._result.normal)

    def _capsule(self, frames: Array, capsule: int) -> tuple[Any, Any]:
        if capsule not in self._capsules:
            ends, radius = self._bodies.ends[capsule], float(self._bodies.radius[capsule])
            along = ends[-1] - ends[0]
            shape = self._coal.Capsule(radius, float(np.linalg.norm(along))) if along.any() else self._coal.Sphere(radius)
            self._capsules[capsule] = shape, axes_along(along), ends.mean(axis=0)
        shape, axes, middle = self._capsules[capsule]
        T = frames[self._bodies.joint[capsule]]
        return shape, self._coal.Transform3s(T[:3, :3] @ axes, T[:3, :3] @ middle + T[:3, 3])

    def _solid(self, solids: Solids, k: int) -> tuple[Any, Any]:
        key = id(solids), k
        if key not in self._solids:
            axes, origin = solids.placed(np.array([k]))
            T = self._coal.Transform3s(np.eye(3) if axes is None else axes[0], origin[0])
            self._solids[key] = self._shape(solids, k), T
        return self._solids[key]

    def _shape(self, solids: Solids, k: int) -> Any:
        radius = float(solids.radius[k])
        if isinstance(solids, Balls):
            return self._coal.Sphere(radius)
        if isinstance(solids, Cylinders):
            return self._coal.Cylinder(float(solids.round[k]), 2 * float(solids.half[k]))
        if isinstance(solids, Boxes):
            edges = 2 * solids.half[k]
            return self._coal.Capsule(radius, float(edges[2])) if radius else self._coal.Box(*edges.tolist())
        return self._coal.Halfspace(np.array([0.0, 0.0, 1.0]), 0.0)


@kept
def _pinocchio_model(robot: Robot) -> tuple[Any, list[int]]:
    """Return Pinocchio's model, one of its joints for each of the robot's, and their numbers in it."""
    import pinocchio  # pyright: ignore[reportMissingImports]

    model = pinocchio.Model()
    kinds = {"revolute": pinocchio.JointModelRZ, "prismatic": pinocchio.JointModelPZ}
    ids: list[int] = []
    for joint in robot.joints:
        parent = ids[joint.parent] if joint.parent >= 0 else 0
        T = pinocchio.SE3(np.array(joint.T_parent_joint))
        ids.append(model.addJoint(parent, kinds[joint.kind](), T, joint.name))
    return model, ids
