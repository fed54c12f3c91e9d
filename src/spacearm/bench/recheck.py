"""Collisions found afterwards by another checker: Pinocchio's kinematics and Coal's shapes, read from the files anew.

Nothing of ours is used but the configurations: the robot's bodies are the URDF's own collision geometry, the pairs that may
touch are the SRDF's as Pinocchio reads them, and the obstacles are built from the scene's numbers.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spacearm.bench.collection import Item, RobotFiles
from spacearm.bench.stated import StatedSolid, stated_solids, stated_start
from spacearm.checks import shown_error
from spacearm.errors import FileFormatError
from spacearm.motion import Motion

Array = NDArray[np.float64]

STEP = 0.005
"""How far apart the configurations looked at are at most: the norm over the joints [rad]."""

_GRID = 1000  # instants to learn from where a motion is fast
_TOLERANCE = 1e-9  # of Coal's GJK; by default it may miss by 0.3 mm


@dataclass(frozen=True, slots=True, kw_only=True)
class Recheck:
    """What the other checker found.

    Attributes:
        looked_at: configurations.
        collisions: those of them in collision.
        first: the pair of the first one, in words; empty if there is none.
    """

    looked_at: int
    collisions: int
    first: str = ""


def dense_configurations(motion: Motion, step: float = STEP) -> Array:
    """Return configurations (m, n) along a motion, both ends included, neighbours at most `step` apart [rad or m]."""
    s = np.linspace(0, 1, _GRID)
    gaps = np.linalg.norm(np.diff(motion.sample(s), axis=0), axis=1)
    along, wanted = np.concatenate([[0.0], np.cumsum(gaps)]), 0.97 * step
    while True:  # in steps along the path; the cords between the grid's instants are a little too short for it
        s_even = np.interp(np.linspace(0, along[-1], 2 + int(along[-1] / wanted)), along, s)
        q = motion.sample(s_even)
        if np.linalg.norm(np.diff(q, axis=0), axis=1).max() <= step:
            return q
        wanted /= 2


class OtherChecker:
    """Pinocchio and Coal for one robot.

    Args:
        files: of the robot.
        joints: the names of the columns of q.

    Raises:
        FileFormatError: Pinocchio cannot read them, as where a mesh is missing.
    """

    def __init__(self, files: RobotFiles, joints: tuple[str, ...]) -> None:
        import pinocchio as pin  # pyright: ignore[reportMissingImports]

        urdf, srdf = str(files.urdf), str(files.srdf)
        try:
            self._model = pin.buildModelFromUrdf(urdf)
            self._bodies = pin.buildGeomFromUrdf(self._model, urdf, pin.GeometryType.COLLISION)
        except Exception as error:
            raise FileFormatError(
                f"{files.urdf} cannot be read by Pinocchio ({shown_error(error)}), expected a URDF whose collision bodies are "
                "at hand; without them no other checker can look at the motions"
            ) from None
        self._bodies.addAllCollisionPairs()
        pin.removeCollisionPairs(self._model, self._bodies, srdf)
        names = list(self._model.names)
        moved = [self._model.joints[names.index(name)] for name in joints]
        turning = [name for name, joint in zip(joints, moved, strict=True) if joint.nq != 1]
        if turning:
            raise FileFormatError(
                f"{files.urdf} has the continuous joint '{turning[0]}', expected revolute and prismatic ones; give it limits"
            )
        self._columns = [joint.idx_q for joint in moved]
        self._stated: dict[Item, tuple[list[StatedSolid], dict[str, float]]] = {}

    def read(self, item: Item) -> None:
        """Read a problem's files, once.

        Raises:
            FileFormatError: there is something in them that this checker does not know.
        """
        if item not in self._stated:
            self._stated[item] = stated_solids(item.scene), stated_start(item.request)

    def look(self, item: Item, q: Array) -> Recheck:
        """Look at configurations (m, n) of a problem, as `dense_configurations` gives them.

        Bodies that no joint moves are not held against obstacles.
        """
        import pinocchio as pin  # pyright: ignore[reportMissingImports]

        self.read(item)
        bodies = self._with_obstacles(item)
        data, found = self._model.createData(), bodies.createData()
        for request in found.collisionRequests:
            request.gjk_tolerance = _TOLERANCE
        manager = pin.BroadPhaseManager_DynamicAABBTreeCollisionManager(self._model, bodies, found)
        configurations = self._filled(item, q)
        hits, first = 0, ""
        for q in configurations:
            if pin.computeCollisions(self._model, data, manager, q, True):
                hits += 1
                first = first or _pair(bodies, found)
        return Recheck(looked_at=len(configurations), collisions=hits, first=first)

    def _filled(self, item: Item, q: Array) -> Array:
        """Return the model's (m, nq): joints that do not move stand where the request has them."""
        import pinocchio as pin  # pyright: ignore[reportMissingImports]

        rest = pin.neutral(self._model)
        start = self._stated[item][1]
        for name, joint in zip(self._model.names, self._model.joints, strict=True):
            if name in start and joint.nq == 1:
                rest[joint.idx_q] = start[name]
        out = np.tile(rest, (len(q), 1))
        out[:, self._columns] = q
        return out

    def _with_obstacles(self, item: Item) -> Any:
        import pinocchio as pin  # pyright: ignore[reportMissingImports]

        bodies = self._bodies.copy()
        moving = [i for i, body in enumerate(bodies.geometryObjects) if body.parentJoint > 0]
        for number, solid in enumerate(self._stated[item][0]):
            at = pin.SE3.Identity()
            for position, xyzw in solid.poses:
                at = at * pin.SE3(pin.Quaternion(np.array(xyzw)).normalized(), np.array(position))
            name = f"{solid.name} (solid {number})"
            obstacle = bodies.addGeometryObject(pin.GeometryObject(name, 0, 0, at, _shape(solid)))
            for body in moving:
                bodies.addCollisionPair(pin.CollisionPair(body, obstacle))
        return bodies


def _shape(solid: StatedSolid) -> Any:
    import coal  # pyright: ignore[reportMissingImports]

    if solid.kind == "box":
        return coal.Box(*solid.size)
    if solid.kind == "cylinder":
        return coal.Cylinder(solid.size[1], solid.size[0])
    return coal.Sphere(solid.size[0])


def _pair(bodies: Any, found: Any) -> str:
    for pair, result in zip(bodies.collisionPairs, found.collisionResults, strict=True):
        if result.isCollision():
            return " and ".join(bodies.geometryObjects[i].name for i in (pair.first, pair.second))
    return "a pair"
