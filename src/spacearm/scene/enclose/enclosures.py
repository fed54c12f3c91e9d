"""The balls that enclose a mesh or a point cloud, as a user asks for them.

What is enclosed is the surface of a mesh, and what it bounds: an arm inside a module's wall is in collision too. Every point
of it is in one of the balls; that is not sampled, it follows from how the balls are found (see `cells`).
"""

from __future__ import annotations

import os
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from spacearm.checks import as_number, as_pose, as_readonly, as_whole, dimensions_of, shown
from spacearm.errors import SceneError, nearest
from spacearm.scene.enclose.balls import enclosing_balls
from spacearm.scene.enclose.box_tree import Array
from spacearm.scene.enclose.centers import Body
from spacearm.scene.enclose.files import mesh_of
from spacearm.scene.enclose.surface import Surface
from spacearm.scene.enclose.topology import Solid, solid_of, wound_solid
from spacearm.scene.shapes import SphereSet

_MOST_SPHERES = 50_000
_LARGEST = 1e6  # [m] coordinates beyond this are no arm's surroundings
_FINEST = 1e-9  # [m] nothing is told apart below this
_VAST = 100.0  # [m] a larger mesh may be in millimetres
_FLOAT32 = 2.0**-22  # of a coordinate: what files in single precision round by, and more
_SHARE = 0.02  # of the size of what is enclosed: the excess where none is asked for


def enclose_mesh(
    mesh: str | os.PathLike[str] | Any,
    *,
    spheres: int | None = None,
    excess: float | None = None,
    pose: ArrayLike | None = None,
    scale: ArrayLike = 1.0,
    name: str = "",
    inside: Literal["filled", "oriented", "none"] = "filled",
) -> SphereSet:
    """Enclose a mesh in balls.

    Its surface is enclosed, and what is solid. Meshes are double-sided, mirrored, cracked, or of parts that overlap; so what
    any convention calls solid is: where the surface winds around a point, where a ray from there meets it an odd number of
    times, where one closed part alone holds it, and what the surface shuts off from outside. Holes that are small against
    their part (a tenth of its area) are taken for closed. An open mesh is a skin: nothing behind it is solid. The
    result's `notes` say what was found.

    Args:
        mesh: the path of a mesh file (STL, OBJ, PLY, DAE, GLB, ...), a `trimesh.Trimesh`, or triangles (n, 3, 3).
        spheres: how many balls to use at most; the excess is then as small as can be found.
        excess: how far balls may stand out of the mesh, at most [m]. With neither, 2 % of the mesh's size; with both,
            there must be a way to keep both.
        pose: (4, 4), T_w_mesh; a point (3,) is taken for a mesh that is not turned.
        inside: what is solid. "filled": all of the above, so that a tank's inside is solid too. "oriented": where the
            surface winds around, so that a cavity whose faces are turned inward is free; for closed meshes whose faces all
            agree on which side is out. "none": the surface alone.
        scale: of the file's coordinates, before the pose: one number or three (along its x, y and z).
        name: for messages.

    Returns:
        The balls. Their `excess` is an upper bound of how far any of them stands out of what it encloses [m].

    Raises:
        FileFormatError: a file that is missing, or that holds no mesh.
        SceneError: numbers that are not finite, a scale of 0, a mesh whose inside cannot be told as asked, or an excess that
            takes more than 50,000 balls.
    """
    if inside not in ("filled", "oriented", "none"):
        raise SceneError(
            f"inside is {shown(inside)}, which is not known; {nearest(str(inside), ('filled', 'oriented', 'none'))}"
        )
    read = mesh_of(mesh)
    triangles = read.triangles * _scale(scale)
    if not np.isfinite(triangles).all() or np.abs(triangles).max() > _LARGEST:
        raise SceneError(f"the mesh has coordinates beyond {_LARGEST:g} m, expected an arm's surroundings; check its scale")
    what = f"mesh '{name}'" if name else "the mesh"
    centers, radii, most, notes = _enclosed(triangles, spheres, excess, what=what, inside=inside)
    T = as_pose("the mesh's pose", pose, SceneError)
    size = float(np.ptp(triangles.reshape(-1, 3), axis=0).max())
    if size > _VAST:
        notes = (f"it is {size:.3g} m in size: if it is in millimetres, give scale=0.001", *notes)
    return SphereSet(centers @ T[:3, :3].T + T[:3, 3], radii, excess=most, name=name, notes=(*read.notes, *notes))


def enclose_points(
    points: ArrayLike,
    *,
    point_radius: float = 0.0,
    spheres: int | None = None,
    excess: float | None = None,
    name: str = "",
) -> SphereSet:
    """Enclose a point cloud in balls.

    Args:
        points: (n, 3), base frame [m].
        point_radius: every point stands for a ball of this radius [m]: about half the distance between neighbours makes a
            surface of them.
        spheres, excess: as for `enclose_mesh`; how far balls stand out of the points' balls.
        name: for messages.

    Raises:
        SceneError: no points, numbers that are not finite, or an excess that takes more than 50,000 balls.
    """
    cloud = as_readonly("points", points, (None, 3), SceneError)
    if not len(cloud):
        raise SceneError("points is empty, expected at least one point (x, y, z)")
    if np.abs(cloud).max() > _LARGEST:
        raise SceneError(f"points has coordinates beyond {_LARGEST:g} m, expected an arm's surroundings; check the units")
    radius = as_number("point_radius", point_radius, SceneError, at_least=0, unit="m")
    what = f"point cloud '{name}'" if name else "the point cloud"
    triangles = np.repeat(cloud[:, None], 3, axis=1)
    centers, radii, most, _ = _enclosed(triangles, spheres, excess, what=what, inside=None)
    return SphereSet(centers, radii + radius, excess=most, name=name)


def _enclosed(
    triangles: Array, spheres: int | None, excess: float | None, *, what: str, inside: str | None
) -> tuple[Array, Array, float, tuple[str, ...]]:
    """Return centres (k, 3), radii (k,) and the excess of balls that enclose triangles (n, 3, 3) [m], and notes.

    `inside` is as for `enclose_mesh`, None for points.
    """
    most = _MOST_SPHERES if spheres is None else as_whole("spheres", spheres, SceneError, at_least=1, at_most=_MOST_SPHERES)
    wanted = None if excess is None else as_number("excess", excess, SceneError, at_least=_FINEST, unit="m")
    low, high = triangles.min(axis=(0, 1)), triangles.max(axis=(0, 1))
    middle, size = (low + high) / 2, float((high - low).max())
    local = triangles - middle
    rounding = 1e-12 * max(size, float(np.abs(middle).max()))
    if wanted is None and spheres is None:
        wanted = max(_SHARE * size, _FINEST)
    solid = Solid(local, None)
    if size <= _FINEST:  # one place
        found = np.zeros((1, 3)), np.array([size]), np.array([size])
    else:
        body = Body(local, None, None)
        if inside is not None:
            solid = _solid(local, inside, what, fuzz=_FLOAT32 * float(np.abs(triangles).max()))
            body = Body(solid.triangles, Surface(solid.triangles), solid.inside)
        found = enclosing_balls(body, size=size, excess=wanted, spheres=most)
    if found is None:
        raise SceneError(
            f"{what}, {size:.3g} m in size, cannot be enclosed to {wanted:g} m with no more than {most:,} balls; "
            "allow a greater excess"
        )
    centers, radii, out = found
    rounding += solid.slack
    radii = np.maximum(radii + rounding, _FINEST)
    return centers + middle, radii, float(out.max()) + rounding + _FINEST, solid.notes


def _solid(triangles: Array, inside: str, what: str, *, fuzz: float) -> Solid:
    if inside == "none":
        return Solid(triangles, None, ("its surface alone is enclosed, as asked for",))
    if inside == "filled":
        return solid_of(triangles, fuzz=fuzz)
    found = wound_solid(triangles)
    if isinstance(found, str):
        raise SceneError(
            f'{what} has cavities that cannot be told, since {found}; expected a closed mesh for inside="oriented": '
            'mend it, or let inside="filled" take them for solid'
        )
    return found


def _scale(scale: ArrayLike) -> Array:
    each: Any = (scale, scale, scale) if dimensions_of(scale) == 0 else scale
    factors = as_readonly("scale", each, (3,), SceneError, advice="give one number, or three for x, y and z")
    if not (np.abs(factors) > 0).all():
        raise SceneError(f"scale is {factors.tolist()}, expected factors other than 0")
    return factors
