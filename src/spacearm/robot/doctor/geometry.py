"""Shapes of links that nobody can load, that are of another unit, or that are not there."""

from __future__ import annotations

import copy
import math
import os
from pathlib import Path
from typing import Any

from spacearm.checks import shown
from spacearm.robot.doctor.chart import Chart, link_of, number_of, numbers_of, setting, written
from spacearm.robot.doctor.limits import FARTHEST
from spacearm.robot.doctor.shapes import mesh_path, mesh_size
from spacearm.robot.shape_notes import chain_length, looks_like_millimetres

_SHAPES = ("box", "cylinder", "sphere", "mesh")
_LONGEST = 80  # characters of a path
_SEARCHED = 5000  # files looked at for a mesh that has moved
_LEAST = 1e-9  # [m] smaller meshes are points
_SMALLEST = 1e-3  # [m] a mesh in millimetres is at least this large in metres


def look_at_geometry(chart: Chart) -> None:
    """Find meshes that are missing, cannot be read or are in millimetres, and links without a shape."""
    for link in chart.links:
        for tag in ("collision", "visual"):
            for part in link.findall(tag):
                _look_at_shape(chart, part, needed=tag == "collision")
    _without_shape(chart)


def _look_at_shape(chart: Chart, part: Any, *, needed: bool) -> None:
    geometry = part.find("geometry")
    shapes = [] if geometry is None else [shape for shape in geometry if isinstance(shape.tag, str)]
    severity = "error" if needed else "warning"
    if len(shapes) != 1 or shapes[0].tag not in _SHAPES:
        given = " and ".join(f"<{shape.tag}>" for shape in shapes)
        chart.found(
            severity,
            "shape-unknown",
            part,
            f"a <{part.tag}> needs one shape",
            value=given,
            expected=f"one of <{'>, <'.join(_SHAPES)}>",
            advice="replace it; for a capsule, take a cylinder with a sphere on each end",
        )
        return
    mesh = shapes[0]
    if mesh.tag != "mesh":
        return
    name, directory = mesh.get("filename") or "", chart.path.parent
    path = mesh_path(mesh, directory)
    if path is None:
        found = _elsewhere(name, directory)
        chart.found(
            severity,
            "mesh-missing",
            mesh,
            f"its {part.tag} mesh is not there",
            value=_path(name) if name else "no filename",
            expected="a file beside the URDF, or for package:// in a directory above it",
            advice=f"write {shown(found)}, the only file of that name" if found else "put the file there, or correct the path",
            remedy=setting(mesh, "filename", found) if found else None,
        )
    elif needed or not part.getparent().findall("collision"):
        _look_at_mesh(chart, part, mesh, path, needed)


def _path(name: str) -> str:
    """Show a path, a long one by its end, which tells the file."""
    return repr(name if len(name) <= _LONGEST else f"...{name[-_LONGEST:]}")


def _look_at_mesh(chart: Chart, part: Any, mesh: Any, path: Path, needed: bool) -> None:
    scale = numbers_of(mesh, "scale", 3, (1, 1, 1)) or (numbers_of(mesh, "scale", 1) or (1,)) * 3
    try:
        edges = mesh_size(path) * [abs(s) for s in scale]
    except (OSError, ValueError) as error:
        if needed:  # a visual one may be of a format that only others read
            chart.found(
                "error",
                "mesh-unreadable",
                mesh,
                f"its mesh cannot be read ({error})",
                value=_path(mesh.get("filename")),
                expected="triangles, as in STL, OBJ, PLY",
                advice="repair or convert the file",
            )
        return
    size = float(edges.max())
    if not all(scale) or size < _LEAST:
        chart.found(
            "error" if needed else "warning",
            "mesh-without-size",
            mesh,
            f"its {part.tag} mesh is nothing but a point" if all(scale) else f"its {part.tag} mesh is scaled to nothing",
            value=mesh.get("scale") or "no scale",
            expected="a surface, and factors other than 0",
            advice="correct the scale or the file",
        )
        return
    chain = chain_length((link_of(one, "parent"), link_of(one, "child"), _length(one)) for one in chart.joints)
    if size > FARTHEST or looks_like_millimetres(size, chain):
        small = " ".join(written(s / 1e3) for s in scale)
        chart.found(
            "warning",
            "mesh-in-millimetres",
            mesh,
            f"its {part.tag} mesh is {size:g} m long"
            + ("" if size > FARTHEST else f", and the joints reach {chain:.3g} m")
            + ": it looks like millimetres",
            value=mesh.get("scale") or "no scale",
            expected="metres",
            advice=f'write scale="{small}", if so',
            remedy=setting(mesh, "scale", small) if size > FARTHEST and size / 1e3 >= _SMALLEST else None,
        )


def _length(joint: Any) -> float:
    xyz = numbers_of(joint.find("origin"), "xyz", 3, (0, 0, 0))
    return 0.0 if xyz is None else math.hypot(*xyz)


def _elsewhere(name: str, directory: Path) -> str:
    """Look for a file of the same name below the URDF's directory; "" unless there is exactly one."""
    wanted = name.replace("\\", "/").rpartition("/")[2]
    if not wanted or len(wanted) > 255:
        return ""
    found, seen = [], 0
    for folder, _, files in os.walk(directory):
        seen += len(files) + 1
        if wanted in files:
            found.append(Path(os.path.relpath(os.path.join(folder, wanted), directory)).as_posix())
        if seen > _SEARCHED or len(found) > 1:
            return ""
    return found[0] if found else ""


def _without_shape(chart: Chart) -> None:
    with_collision = [link for link in chart.links if link.find("collision") is not None]
    bare = []
    for link in chart.links:
        if link.find("collision") is not None:
            continue
        visuals = link.findall("visual")
        mass = number_of(link.find("inertial/mass"), "value")
        if visuals:
            readable = all(_can_enclose(visual, chart.path.parent) for visual in visuals)
            chart.found(
                "warning",
                "collision-missing",
                link,
                "is drawn but has no collision shape, so nothing keeps it clear",
                expected="<collision>",
                advice="give it one; its visual shape will do",
                remedy=(lambda link=link: _from_visual(link)) if readable else None,
            )
        elif mass:
            bare.append(link)
    if bare and not with_collision and not any(link.find("visual") is not None for link in chart.links):
        chart.found(
            "warning",
            "no-shapes",
            chart.root,
            "no link has a shape: there is nothing to keep clear of obstacles",
            expected="<collision> shapes",
            advice="give each link with a mass one; cylinders and boxes will do",
        )
    else:
        for link in bare:
            chart.found(
                "warning",
                "shape-missing",
                link,
                "has a mass but no shape, so nothing keeps it clear",
                expected="<collision>",
                advice="give it one; a cylinder or a box will do",
            )


def _can_enclose(visual: Any, directory: Path) -> bool:
    geometry = visual.find("geometry")
    shapes = [] if geometry is None else [shape for shape in geometry if isinstance(shape.tag, str)]
    if len(shapes) != 1 or shapes[0].tag not in _SHAPES:
        return False
    if shapes[0].tag != "mesh":
        return True
    path = mesh_path(shapes[0], directory)
    try:
        return path is not None and bool(mesh_size(path).max() > 0)
    except (OSError, ValueError):
        return False


def _from_visual(link: Any) -> str:
    visuals = link.findall("visual")
    for visual in visuals:
        made = copy.deepcopy(visual)
        made.tag = "collision"
        for material in made.findall("material"):
            made.remove(material)
        if visual.getnext() is None:
            visual.tail = link.text
        link.insert(link.index(visual) + 1, made)
    count = len(visuals)
    return f"<collision> copied from {count} <visual> shape{'s' if count > 1 else ''}"
