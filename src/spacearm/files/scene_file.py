"""The scene of a problem file: its obstacles, from their shapes or from files beside it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from spacearm.core.errors import FileFormatError, SceneError
from spacearm.core.reading import YamlFile, located
from spacearm.core.rotations import rotation_from_rpy
from spacearm.files.moveit import load_moveit_scene
from spacearm.geometry import (
    Box,
    Capsule,
    ConvexShape,
    Cylinder,
    HalfSpace,
    Obstacle,
    Polytope,
    PolytopeSet,
    Sphere,
    SphereSet,
    moved_shape,
    pose,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from spacearm.files.problem_schema import MeshModel, MoveItModel, ObstacleModel, PointsModel, SolidModel

Array = NDArray[np.float64]


def read_obstacles(file: YamlFile, scene: Sequence[ObstacleModel]) -> list[Obstacle]:
    """Make the obstacles of a scene.

    Raises:
        FileFormatError, SceneError: an obstacle that cannot be, or a file that holds none; file and line are named.
    """
    obstacles: list[Obstacle] = []
    for i, model in enumerate(scene):
        with file.at("scene", i):
            name, directory = model.name or "", file.path.parent
            if model.moveit is not None:
                obstacles += _moveit(model.moveit, model.name, directory)
            elif model.half_space is not None:
                obstacles.append(HalfSpace(model.half_space.normal, model.half_space.point, name=name))
            else:
                obstacles.append(read_solid(model, directory, name=name))
    return obstacles


def read_solid(model: SolidModel, directory: Path, *, name: str) -> ConvexShape | PolytopeSet | SphereSet:
    """Make the one shape that a mapping holds.

    Args:
        model: the mapping.
        directory: what its files are relative to.
        name: of the obstacle.

    Raises:
        FileFormatError, SceneError: it cannot be, or its file holds none.
    """
    if model.sphere is not None:
        return Sphere(model.sphere.center, model.sphere.radius, name=name)
    if model.capsule is not None:
        return Capsule(model.capsule.a, model.capsule.b, model.capsule.radius, name=name)
    if model.box is not None:
        return Box(model.box.size, placed(model.box), rounding=model.box.rounding, name=name)
    if model.cylinder is not None:
        round_ = model.cylinder
        return Cylinder(round_.radius, round_.length, placed(round_), rounding=round_.rounding, name=name)
    if model.polytope is not None:
        hull = Polytope(model.polytope.vertices, rounding=model.polytope.rounding, name=name)
        return moved_shape(hull, placed(model.polytope))
    if model.mesh is not None:
        return _mesh(model.mesh, directory, name)
    assert model.points is not None, "the schema lets no obstacle through without a shape"
    return _points(model.points, directory, name)


def placed(model: Any) -> Array:
    """Return the transform (4, 4) of a mapping's position [m] and q_wxyz or rpy_deg; what is left out is 0.

    Raises:
        SceneError: both orientations, or numbers that make none.
    """
    if model.q_wxyz is not None and model.rpy_deg is not None:
        raise SceneError("both q_wxyz and rpy_deg are given, expected one; remove the other")
    given = getattr(model, "position", None)  # an attitude has none
    position = (0.0, 0.0, 0.0) if given is None else given
    T = pose(position, (1.0, 0.0, 0.0, 0.0) if model.q_wxyz is None else model.q_wxyz)
    if model.rpy_deg is not None:
        if len(model.rpy_deg) != 3:
            raise SceneError(f"rpy_deg has {len(model.rpy_deg)} numbers, expected 3: turns about x, y and z [degrees]")
        T[:3, :3] = rotation_from_rpy(np.radians(np.remainder(model.rpy_deg, 360.0)))
    return T


def beside(directory: Path, name: str) -> Path:
    """Return the path of a file that a problem file names: relative to its folder, or in a home (~).

    Raises:
        FileFormatError: the home of nobody.
    """
    try:
        return directory / Path(name).expanduser()
    except RuntimeError:  # no such user
        raise FileFormatError(f"{name!r} begins with ~ but there is no such home, expected a path; write it out") from None


def _mesh(mesh: MeshModel, directory: Path, name: str) -> PolytopeSet | SphereSet:
    from spacearm.geometry import convex_pieces, enclose_mesh
    from spacearm.geometry.convex_pieces import PIECES

    source, T, called = beside(directory, mesh.file), placed(mesh), name or Path(mesh.file).stem
    if mesh.spheres is None:
        count = PIECES if mesh.pieces is None else mesh.pieces
        return convex_pieces(
            source, pieces=count, excess=mesh.excess, pose=T, scale=mesh.scale, name=called, inside=mesh.inside
        )
    if mesh.pieces is not None:
        raise SceneError("both pieces and spheres are given, expected one: convex pieces or balls; remove the other")
    return enclose_mesh(
        source, spheres=mesh.spheres, excess=mesh.excess, pose=T, scale=mesh.scale, name=called, inside=mesh.inside
    )


def _points(points: PointsModel, directory: Path, name: str) -> SphereSet:
    from spacearm.geometry import enclose_points
    from spacearm.geometry.meshes import read_points

    source = beside(directory, points.file)
    T = placed(points)
    factors = np.broadcast_to(_scale(points.scale), 3)
    with np.errstate(over="ignore", invalid="ignore"):
        cloud = (read_points(source) * factors) @ T[:3, :3].T + T[:3, 3]
    with located(source):
        return enclose_points(
            cloud,
            point_radius=points.point_radius,
            spheres=points.spheres,
            excess=points.excess,
            name=name or Path(points.file).stem,
        )


def _scale(scale: float | list[float]) -> float | list[float]:
    if isinstance(scale, list) and len(scale) != 3:
        raise SceneError(f"scale has {len(scale)} numbers, expected one, or three for x, y and z")
    if not np.all(scale):
        raise SceneError(f"scale is {scale}, expected factors other than 0")
    return scale


def _moveit(scene: MoveItModel, name: str | None, directory: Path) -> tuple[Obstacle, ...]:
    if name is not None:
        raise SceneError(f"name is {name!r} beside moveit, expected none: the objects have names of their own; remove it")
    return load_moveit_scene(beside(directory, scene.file), mesh_excess=scene.mesh_excess).obstacles
