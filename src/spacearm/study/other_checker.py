"""A second collision checker, for motions that were found and proven: Pinocchio's kinematics and Coal's shapes.

It shares nothing with the planner but the configurations. Pinocchio reads the robot's bodies from the URDF and the pairs that
may touch from the SRDF; the planning scene and the request are read here once more, by other code than the planner's.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spacearm.core.checks import shown_error
from spacearm.core.errors import FileFormatError
from spacearm.core.reading import read_bytes
from spacearm.motion import Motion
from spacearm.robot import Robot, UncheckedPair, unchecked_pairs
from spacearm.study.motionbenchmaker import Item, RobotFiles

Array = NDArray[np.float64]

STEP = 0.005
"""How far apart the configurations looked at are at most: the norm over the joints [rad]."""

_GRID = 1000  # instants to learn from where a motion is fast
_TOLERANCE = 1e-9  # of Coal's GJK; by default it may miss by 0.3 mm

_DIMENSIONS = {"box": 3, "cylinder": 2, "sphere": 1}


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


def overlapping_pairs(robot: Robot) -> tuple[UncheckedPair, ...]:
    """Return the pairs of links that no plan keeps apart although nobody allows them to touch: they always overlap."""
    return tuple(pair for pair in unchecked_pairs(robot) if pair.reason in ("always", "adjacent"))


class OtherChecker:
    """Pinocchio and Coal for one robot.

    Args:
        files: of the robot.
        joints: the names of the columns of q.
        overlapping: pairs of links that are not looked at, for they overlap in every configuration; see `overlapping_pairs`.

    Raises:
        FileFormatError: Pinocchio cannot read them, as where a mesh is missing.
    """

    def __init__(self, files: RobotFiles, joints: tuple[str, ...], *, overlapping: Iterable[UncheckedPair] = ()) -> None:
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
        self._leave_out({frozenset(pair.links) for pair in overlapping})
        names = list(self._model.names)
        moved = [self._model.joints[names.index(name)] for name in joints]
        turning = [name for name, joint in zip(joints, moved, strict=True) if joint.nq != 1]
        if turning:
            raise FileFormatError(
                f"{files.urdf} has the continuous joint '{turning[0]}', expected revolute and prismatic ones; give it limits"
            )
        self._columns = [joint.idx_q for joint in moved]
        self._stated: dict[Item, tuple[list[StatedSolid], dict[str, float]]] = {}

    def _leave_out(self, pairs: set[frozenset[str]]) -> None:
        links = [str(self._model.frames[body.parentFrame].name) for body in self._bodies.geometryObjects]
        for pair in [pair for pair in self._bodies.collisionPairs if {links[pair.first], links[pair.second]} in pairs]:
            self._bodies.removeCollisionPair(pair)

    def read(self, item: Item) -> None:
        """Read a problem's files.

        Raises:
            FileFormatError: there is something in them that this checker does not know.
        """
        self._stated[item] = stated_solids(item.scene), stated_start(item.request)

    def look(self, item: Item, q: Array) -> Recheck:
        """Look at configurations (m, n) of a problem, as `dense_configurations` gives them.

        Bodies that no joint moves are not checked against obstacles.
        """
        import pinocchio as pin  # pyright: ignore[reportMissingImports]

        if item not in self._stated:
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


# ---- what the files state ----------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class StatedSolid:
    """A primitive of a planning scene.

    Attributes:
        name: of the object it belongs to.
        kind: "box", "cylinder" or "sphere".
        size: edges x y z, or height and radius, or radius [m].
        poses: (position [m], quaternion x y z w) from the planning frame inwards.
    """

    name: str
    kind: str
    size: tuple[float, ...]
    poses: tuple[tuple[tuple[float, ...], tuple[float, ...]], ...]


def stated_solids(path: Path) -> list[StatedSolid]:
    """Read a planning scene's primitives.

    Raises:
        FileFormatError: there is something in it that the other checker does not know.
    """
    out = []
    try:
        scene = _mapping(path)
        frames = _frames(scene)
        if (scene.get("robot_state") or {}).get("attached_collision_objects"):
            raise FileFormatError(f"{path} attaches objects to the robot, expected none: the other checker knows no others")
        for body in scene["world"]["collision_objects"]:
            frame = _name(body.get("header"))
            if body.get("meshes") or body.get("planes") or frame not in frames:
                raise FileFormatError(
                    f"{path} has an object '{body['id']}' with meshes or planes or in a frame of its own, expected primitives "
                    "in a frame that the scene fixes: the other checker knows no others"
                )
            outer = [*frames[frame], *([_pose(body["pose"])] if body.get("pose") else [])]
            for solid, at in zip(body["primitives"], body["primitive_poses"], strict=True):
                kind, size = str(solid["type"]), _numbers(solid["dimensions"])
                if len(size) != _DIMENSIONS[kind]:
                    raise ValueError
                out.append(StatedSolid(name=str(body["id"]), kind=kind, size=size, poses=(*outer, _pose(at))))
    except (AttributeError, IndexError, KeyError, TypeError, ValueError):
        raise FileFormatError(
            f"{path} cannot be read by the other checker, expected a planning scene of boxes, cylinders and spheres by name"
        ) from None
    return out


def stated_start(path: Path) -> dict[str, float]:
    """Read a request's start by joint [rad or m]; empty where it has none."""
    request = _mapping(path)
    try:
        if request["start_state"].get("attached_collision_objects"):
            raise FileFormatError(f"{path} attaches objects to the robot, expected none: the other checker knows no others")
        state = request["start_state"]["joint_state"]
        return {str(name): float(at) for name, at in zip(state["name"], state["position"], strict=True)}
    except (AttributeError, KeyError, TypeError, ValueError):
        return {}


def _frames(scene: dict[str, Any]) -> dict[str, list[Any]]:
    """Return the poses that lead to each frame: MoveIt has the named one in the header, and the planning frame as child."""
    fixed = scene.get("fixed_frame_transforms") or []
    planning = {str(item["child_frame_id"]).lstrip("/") for item in fixed}
    frames: dict[str, list[Any]] = {"": [], "world": [], **{name: [] for name in planning}}
    if len(planning) == 1:
        for item in fixed:
            at, name = item["transform"], _name(item.get("header")) or "world"
            frames[name] = [(_numbers(at["translation"]), _numbers(at["rotation"]))]
    return frames


def _name(header: Any) -> str:
    return str((header or {}).get("frame_id") or "").lstrip("/")


def _pose(given: Any) -> tuple[tuple[float, ...], tuple[float, ...]]:
    position, xyzw = (_numbers(given[key]) for key in ("position", "orientation"))
    if (len(position), len(xyzw)) != (3, 4):
        raise ValueError
    return position, xyzw


def _numbers(given: Any) -> tuple[float, ...]:
    """Return numbers that are listed, or named as ROS does."""
    values: Iterable[Any] = [given[key] for key in "xyzw" if key in given] if isinstance(given, dict) else given
    return tuple(float(value) for value in values)


def _mapping(path: Path) -> dict[str, Any]:
    import yaml

    content = read_bytes(path, what="a file of MoveIt in YAML")
    try:
        found = yaml.load(content, Loader=getattr(yaml, "CSafeLoader", yaml.SafeLoader))
    except (yaml.YAMLError, ValueError, RecursionError):
        found = None
    if not isinstance(found, dict):
        raise FileFormatError(f"{path} is no mapping in YAML, expected a file of MoveIt; correct the file")
    return found
