"""MoveIt's planning scenes in YAML (`moveit_msgs/PlanningScene`): the world's collision objects, and who may touch whom."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from spacearm.checks import shown
from spacearm.errors import nearest
from spacearm.planner.moveit.frames import Frames
from spacearm.planner.moveit.part import Part, pose_of
from spacearm.planner.moveit.shapes import MOST_OBSTACLES, NUMBERED, PRIMITIVES, Made, mesh, named, plane, primitive
from spacearm.robot.model import Robot
from spacearm.robot.self_collision import with_allowed_pairs
from spacearm.scene import Obstacle, Scene

Array = NDArray[np.float64]

_OBJECT = (
    *("header", "pose", "id", "type", "primitives", "primitive_poses", "meshes", "mesh_poses", "planes", "plane_poses"),
    *("subframe_names", "subframe_poses", "operation"),
)
_REMOVED = 1  # the operation that has no shapes


def scene_of(file: Part, frames: Frames, *, mesh_excess: float | None = None) -> Scene:
    """Read the world of a planning scene.

    Raises:
        FileFormatError, SceneError: what is wrong, with file and line.
    """
    world = file.need("world")
    world.require_keys(("collision_objects", "octomap"))
    octomap = world.deep("octomap", "octomap", "data")
    if octomap is not None and octomap.value:
        raise octomap.error("the octomap is not read, expected none; give its points to enclose_points")
    obstacles: list[Obstacle] = []
    seen: dict[str, Part] = {}
    for item in world.items("collision_objects"):
        item.require_keys(_OBJECT)
        given = item.get("id")
        name = "" if given is None else given.text()
        if given is not None and name in seen:
            raise given.error(f"object {shown(name)} is there twice, expected each id once; rename or remove one")
        seen[name] = item
        obstacles += _object(item, name, frames, mesh_excess)
        if len(obstacles) > MOST_OBSTACLES:
            raise item.error(f"the scene has more than {MOST_OBSTACLES:,} shapes; leave out what is out of reach")
    return Scene(obstacles)


def _object(item: Part, name: str, frames: Frames, mesh_excess: float | None) -> list[Obstacle]:
    shapes: list[tuple[Part, Part | None, Made]] = []
    for key, poses, read in (
        ("primitives", "primitive_poses", solid),
        ("meshes", "mesh_poses", lambda part: _mesh(part, mesh_excess)),
        ("planes", "plane_poses", _plane),
    ):
        given, places = item.items(key), item.items(poses)
        if len(places) != len(given) and (places or item.get("pose") is None):
            raise item.error(f"object {shown(name)} has {len(given)} {key} and {len(places)} {poses}, expected one for each")
        at = places or [None] * len(given)
        shapes += [(part, place, read(part)) for part, place in zip(given, at, strict=True)]
    if not shapes and item.value.get("operation") != _REMOVED:
        raise item.error(f"object {shown(name)} has no shape, expected primitives, meshes or planes; add them or remove it")
    whole = item.get("pose")
    T = frames.of(item) if whole is None else frames.of(item) @ pose_of(whole, unset=True)
    out = []
    for i, (part, place, made) in enumerate(shapes):
        T_base_shape = T if place is None else T @ pose_of(place)
        called = named(name, i, len(shapes))
        out.append(part.located(lambda made=made, T=T_base_shape, called=called: made.make(T, called)))
    return out


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


def _plane(part: Part) -> Made:
    coefficients = part
    if isinstance(part.value, dict):
        part.require_keys(("coef",))
        coefficients = part.need("coef")
    return plane(coefficients.numbers(4))


def _mesh(part: Part, excess: float | None) -> Made:
    if part.get("vertices") is None and part.get("triangles") is None:
        source = part.get("resource")
        what = f"the file {shown(source.value)}" if source is not None else "no vertices"
        raise part.error(f"the mesh is given by {what}, expected vertices and triangles; load the file with enclose_mesh")
    part.require_keys(("vertices", "triangles"))
    vertices = np.array([row.numbers(3, ("x", "y", "z")) for row in part.items("vertices")]).reshape(-1, 3)
    triangles = []
    for row in part.items("triangles"):
        indices = row.need("vertex_indices") if isinstance(row.value, dict) else row
        values = indices.numbers(3)
        if not np.array_equal(values, np.floor(values)) or np.abs(values).max() > 2**53:
            raise indices.error(f"{indices.called} is {shown(indices.value)}, expected three numbers of vertices")
        triangles.append(values)
    return mesh(vertices, np.array(triangles, dtype=np.int64).reshape(-1, 3), excess=excess)


def robot_with_matrix(robot: Robot, file: Part) -> Robot:
    """Return the robot with the pairs of links that the scene's `allowed_collision_matrix` does not allow to touch.

    As in MoveIt, a pair without an entry goes by the links' default entries, and must keep clear where there is none.
    Pairs that no joint moves against each other are left out, as for an SRDF.

    Raises:
        FileFormatError: no matrix, or one that is not square.
    """
    matrix = file.need("allowed_collision_matrix")
    names = [entry.text() for entry in matrix.items("entry_names")]
    rows = matrix.items("entry_values")
    if len(rows) != len(names):
        raise matrix.error(f"entry_values has {len(rows)} rows, expected one for each of {len(names)} entry_names")
    entries: dict[tuple[str, str], bool] = {}
    for i, row in enumerate(rows):
        values = _flags(row.need("enabled") if isinstance(row.value, dict) else row, len(names))
        for j in range(i + 1, len(names)):
            entries[names[i], names[j]] = entries[names[j], names[i]] = values[j]
    defaults_of = [entry.text() for entry in matrix.items("default_entry_names")]
    given = matrix.get("default_entry_values")
    defaults = dict(zip(defaults_of, [] if given is None else _flags(given, len(defaults_of)), strict=False))

    def may_touch(first: str, second: str) -> bool:
        stated = [defaults[name] for name in (first, second) if name in defaults]
        return entries.get((first, second), bool(stated) and all(stated))

    kept = tuple(note for note in robot.notes if not note.startswith("self-collision "))
    return with_allowed_pairs(replace(robot, notes=kept), may_touch, by="MoveIt's matrix")


def _flags(part: Part, count: int) -> list[bool]:
    if not isinstance(part.value, list) or len(part.value) != count or not all(v in (0, 1) for v in part.value):
        raise part.error(f"{part.called} is {shown(part.value)}, expected a list of {count} true or false")
    return [bool(value) for value in part.value]
