"""MoveIt's planning scenes in YAML (`moveit_msgs/PlanningScene`): the world's collision objects."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spacearm.checks import shown
from spacearm.errors import nearest
from spacearm.planner.moveit.frames import Frames
from spacearm.planner.moveit.part import XYZ, XYZW, Part, is_empty_pose, pose_of
from spacearm.planner.moveit.shapes import (
    MOST_OBSTACLES,
    NUMBERED,
    PRIMITIVES,
    Made,
    mesh,
    mesh_file,
    named,
    plane,
    primitive,
)
from spacearm.scene import Obstacle, Scene

Array = NDArray[np.float64]

_OBJECT = (
    *("header", "pose", "id", "type", "primitives", "primitive_poses", "meshes", "mesh_poses", "planes", "plane_poses"),
    *("subframe_names", "subframe_poses", "operation"),
)
ADD, REMOVE, APPEND, MOVE = range(4)
_OPERATIONS = ("add", "remove", "append", "move")


@dataclass(frozen=True, slots=True, kw_only=True)
class Shape:
    """A shape of an object, where the file has it, and T_object_shape (4, 4) [m]."""

    part: Part
    made: Made
    T: Array


@dataclass(frozen=True, slots=True, kw_only=True)
class Body:
    """An object: its shapes, and frames of its own.

    Attributes:
        name: its id.
        T: (4, 4), from its own frame to the planning frame [m].
        shapes: in its own frame.
        subframes: (4, 4) in its own frame, by name [m].
    """

    name: str
    T: Array
    shapes: tuple[Shape, ...]
    subframes: dict[str, Array] = field(default_factory=dict)

    def obstacles(self) -> Iterator[Obstacle]:
        """Yield its shapes as obstacles, numbered if there are several.

        Raises:
            SceneError: one that cannot be, with file and line.
        """
        for i, shape in enumerate(self.shapes):
            called, T = named(self.name, i, len(self.shapes)), self.T @ shape.T
            yield shape.part.located(lambda shape=shape, T=T, called=called: shape.made.make(T, called))

    def frames(self) -> dict[str, Array]:
        """Return its frame and its subframes in the planning frame, (4, 4) by name [m]."""
        inner = {f"{self.name}/{name}": self.T @ T for name, T in self.subframes.items()}
        return {self.name: self.T, **inner}


def world_of(file: Part, frames: Frames, *, mesh_excess: float | None = None) -> dict[str, Body]:
    """Read the world of a planning scene, object by object as MoveIt does; each may name frames of those before it.

    Args:
        file: the planning scene.
        frames: its frames; those of the objects are put in.
        mesh_excess: how far the balls around a mesh may stand out of it [m].

    Raises:
        FileFormatError, SceneError: what is wrong, with file and line.
    """
    world = file.need("world")
    world.require_keys(("collision_objects", "octomap"))
    octomap = world.deep("octomap", "octomap", "data")
    if octomap is not None and octomap.value:
        raise octomap.error("the octomap is not read, expected none; give its points to enclose_points")
    bodies: dict[str, Body] = {}
    for item in world.items("collision_objects"):
        item.require_keys(_OBJECT)
        _apply(item, bodies, frames, mesh_excess)
        frames.objects.clear()
        for body in bodies.values():
            frames.objects.update(body.frames())
        if sum(len(body.shapes) for body in bodies.values()) > MOST_OBSTACLES:
            raise item.error(f"the scene has more than {MOST_OBSTACLES:,} shapes; leave out what is out of reach")
    return bodies


def scene_of(bodies: dict[str, Body]) -> Scene:
    """Return the obstacles of a world's objects.

    Raises:
        SceneError: one that cannot be.
    """
    return Scene([obstacle for body in bodies.values() for obstacle in body.obstacles()])


def _apply(item: Part, bodies: dict[str, Body], frames: Frames, mesh_excess: float | None) -> None:
    """Add, remove, append or move, as the object's operation says."""
    given, operation = item.get("id"), operation_of(item)
    name = "" if given is None else given.text()
    if operation == REMOVE:
        if name and name not in bodies:
            frames.say(f"object {shown(name)} is to be removed, which is not there; nothing was removed")
        for gone in [name] if name else list(bodies):
            bodies.pop(gone, None)
        return
    if operation == MOVE:
        if name not in bodies:
            raise item.error(f"object {shown(name)} is to be moved, which is not there; {nearest(name, bodies)}")
        bodies[name] = _moved(item, bodies[name], frames)
        return
    if operation == ADD and given is not None and name in bodies:
        raise given.error(f"object {shown(name)} is there twice, expected each id once; rename or remove one")
    body = body_of(item, name, frames, mesh_excess)
    if not body.shapes:
        raise item.error(f"object {shown(name)} has no shape, expected primitives, meshes or planes; add them or remove it")
    bodies[name if given is not None or name not in bodies else f"{name} {len(bodies)}"] = _joined(bodies.get(name), body)


def _joined(before: Body | None, body: Body) -> Body:
    """Append a body's shapes to those of an object, in that one's frame."""
    if before is None or not body.name:
        return body
    T = np.linalg.inv(before.T) @ body.T
    more = tuple(replace(shape, T=T @ shape.T) for shape in body.shapes)
    return replace(before, shapes=(*before.shapes, *more), subframes=body.subframes or before.subframes)


def _moved(item: Part, body: Body, frames: Frames) -> Body:
    """Put an object that is there to another pose, as its operation says; shapes go with it, or have poses of their own."""
    at = [*item.items("primitive_poses"), *item.items("mesh_poses"), *item.items("plane_poses")]
    if at and len(at) != len(body.shapes):
        raise item.error(
            f"object '{body.name}' is moved with {len(at)} poses, expected one for each of {len(body.shapes)} shapes"
        )
    shapes = tuple(replace(shape, T=_pose(place, frames)) for shape, place in zip(body.shapes, at, strict=False))
    whole = item.get("pose")
    T = np.eye(4) if whole is None else _pose(whole, frames)
    return replace(body, T=frames.of(item) @ T, shapes=shapes or body.shapes)


def operation_of(item: Part) -> int:
    """Return an object's operation: a number, a word, or the byte that ROS 2 prints.

    Raises:
        FileFormatError: it is none.
    """
    part = item.get("operation")
    value: Any = ADD if part is None else part.value
    if isinstance(value, (str, bytes)) and len(value) == 1 and not str(value).isdigit():
        value = ord(value)
    if isinstance(value, str):
        value = _OPERATIONS.index(value.lower()) if value.lower() in _OPERATIONS else int(value) if value.isdigit() else value
    if isinstance(value, bool) or value not in range(4):
        assert part is not None
        raise part.error(f"operation is {shown(value)}, expected 0 (add), 1 (remove), 2 (append) or 3 (move)")
    return int(value)


def body_of(item: Part, name: str, frames: Frames, mesh_excess: float | None) -> Body:
    """Read an object's shapes, its pose and its subframes.

    As in MoveIt, an object of a single shape without a pose of its own has that of the shape.

    Raises:
        FileFormatError: what is wrong, with file and line.
    """
    whole = item.get("pose")
    shapes = _shapes(item, name, whole, frames, mesh_excess)
    T = np.eye(4) if whole is None else _pose(whole, frames)
    if len(shapes) == 1 and is_empty_pose(whole):
        T, shapes = shapes[0].T, [replace(shapes[0], T=np.eye(4))]
    labels, places = item.items("subframe_names"), item.items("subframe_poses")
    if len(labels) != len(places):
        raise item.error(
            f"object {shown(name)} has {len(labels)} subframe_names and {len(places)} subframe_poses, expected one for each"
        )
    inner = {label.text(): _pose(place, frames) for label, place in zip(labels, places, strict=True)}
    return Body(name=name, T=frames.of(item) @ T, shapes=tuple(shapes), subframes=inner)


def _shapes(item: Part, name: str, whole: Part | None, frames: Frames, mesh_excess: float | None) -> list[Shape]:
    shapes = []
    for key, poses, read in (
        ("primitives", "primitive_poses", solid),
        ("meshes", "mesh_poses", lambda part: _mesh(part, mesh_excess)),
        ("planes", "plane_poses", lambda part: _plane(part, frames.base[:3, 3])),
    ):
        given, places = item.items(key), item.items(poses)
        if len(places) > len(given) or (len(places) < len(given) and whole is None):
            raise item.error(f"object {shown(name)} has {len(given)} {key} and {len(places)} {poses}, expected one for each")
        at = [_pose(place, frames) for place in places] + [np.eye(4)] * (len(given) - len(places))
        shapes += [Shape(part=part, made=read(part), T=T) for part, T in zip(given, at, strict=True)]
    return shapes


def _pose(part: Part, frames: Frames) -> Array:
    q = part.get("orientation")
    if q is not None and not q.numbers(4, XYZW).any() and not is_empty_pose(part):
        frames.say("poses with the orientation 0 0 0 0, which is none, are not turned, as in MoveIt")
    return pose_of(part, unset=True)


def solid(part: Part) -> Made:
    """Read one of `primitives`.

    Raises:
        FileFormatError: a type or dimensions that are none.
    """
    return primitive(*kind_and_size(part))


def kind_and_size(part: Part) -> tuple[str, Array]:
    """Read the type and the dimensions [m] of one of `primitives`.

    Raises:
        FileFormatError: a type or dimensions that are none.
    """
    part.require_keys(("type", "dimensions", "polygon"))
    given = part.need("type")
    value = given.value
    kind = NUMBERED.get(value, str(value)) if isinstance(value, int) and not isinstance(value, bool) else given.text().lower()
    if kind not in PRIMITIVES:
        raise given.error(f"type is {shown(value)}, which is no solid that is read; {nearest(kind, PRIMITIVES)}")
    names = PRIMITIVES[kind]
    return kind, part.need("dimensions").numbers(len(names), advice=f"a {kind} has {', '.join(names)}")


def _plane(part: Part, base: Array) -> Made:
    coefficients = part
    if isinstance(part.value, dict):
        part.require_keys(("coef",))
        coefficients = part.need("coef")
    return plane(coefficients.numbers(4), base)


def _mesh(part: Part, excess: float | None) -> Made:
    source = part.get("resource")
    if source is not None:
        part.require_keys(("resource", "dimensions"))
        factors = part.get("dimensions")
        scale = np.ones(3) if factors is None else factors.numbers(3, XYZ, advice="factors for x, y and z")
        return mesh_file(source.text(), part.file.path.parent, scale, excess=excess)
    if part.get("vertices") is None and part.get("triangles") is None:
        raise part.error("the mesh is given by no vertices, expected vertices and triangles, or a resource: the path of a file")
    part.require_keys(("vertices", "triangles"))
    vertices = np.array([row.numbers(3, XYZ) for row in part.items("vertices")]).reshape(-1, 3)
    triangles = []
    for row in part.items("triangles"):
        indices = row.need("vertex_indices") if isinstance(row.value, dict) else row
        values = indices.numbers(3)
        if not np.array_equal(values, np.floor(values)) or np.abs(values).max() > 2**53:
            raise indices.error(f"{indices.called} is {shown(indices.value)}, expected three numbers of vertices")
        triangles.append(values)
    return mesh(vertices, np.array(triangles, dtype=np.int64).reshape(-1, 3), excess=excess)
