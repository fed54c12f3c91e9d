"""How the links of a robot look: the <visual> elements of its URDF, which pictures are made of and nothing else.

Visuals are no part of what a robot is: not of its value, its hash, or a certificate. Mesh files are looked for when the robot
is loaded, and read only when a picture is made. Nothing that is wrong with a visual stops anybody: it is kept with what is
wrong, and whoever draws the robot says so.

Colours follow urdfdom and RViz: the first material of a name holds for all that use the name; a mesh's own colours go before
the URDF's, which are for those that have none.
"""

from __future__ import annotations

import math
import os
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spacearm.core.checks import UNWRITTEN, Frozen, as_name, as_readonly, as_transform, keep, shown
from spacearm.core.errors import RobotError
from spacearm.core.exact import product
from spacearm.core.rotations import rotation_from_rpy
from spacearm.robot.collision_shapes import WITH_COMMAS, found_mesh
from spacearm.robot.link_shapes import as_index
from spacearm.robot.link_tree import LONGEST
from spacearm.robot.robot_xml import numbers_in

Array = NDArray[np.float64]

VISUAL_KINDS = ("box", "cylinder", "capsule", "sphere", "mesh", "nothing")
"""What a visual may be; "nothing" is one that cannot be drawn."""

_LENGTHS = {"box": ("size",), "cylinder": ("radius", "length"), "capsule": ("radius", "length"), "sphere": ("radius",)}
_COUNTS = {"box": 3, "cylinder": 2, "capsule": 2, "sphere": 1, "mesh": 0, "nothing": 0}
_TEXTURE = "its texture {} is not drawn"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class LinkVisual(Frozen):
    """A shape that a link is drawn with; several may make up one link.

    Attributes:
        name: of the link.
        joint: index of the joint whose moving frame it rides on, -1 for the base.
        T_joint_visual: (4, 4), from the shape's frame to that frame [m].
        kind: one of `VISUAL_KINDS`.
        size: the three edges; (radius, length) along z; (radius, length without the round ends) along z; (radius); or
            nothing for a mesh [m].
        file: path of the mesh, where it was found; "" where it was not.
        filename: of the mesh, as the robot's file has it.
        scale: three factors of the mesh's coordinates.
        color: red, green, blue and opacity, each 0 to 1, as the robot's file states them; None if it states none.
        lack: what cannot be drawn of it, in a few words; "" if nothing is known to be wrong.

    Raises:
        RobotError: numbers that cannot be.
    """

    name: str
    joint: int = -1
    T_joint_visual: Array
    kind: str
    size: tuple[float, ...] = field(default=(), metadata=UNWRITTEN)
    file: str = field(default="", metadata=UNWRITTEN)
    filename: str = field(default="", metadata=UNWRITTEN)
    scale: tuple[float, ...] = field(default=(1.0, 1.0, 1.0), metadata=UNWRITTEN)
    color: tuple[float, ...] | None = field(default=None, metadata=UNWRITTEN)
    lack: str = field(default="", metadata=UNWRITTEN)

    def __post_init__(self) -> None:
        where = f"visual of link '{as_name('the name of a visual of a link', self.name, RobotError)}'"
        if self.kind not in VISUAL_KINDS:
            raise RobotError(f"{where}: kind is {shown(self.kind)}, expected one of {', '.join(VISUAL_KINDS)}")
        size = (
            as_readonly(f"{where}: size", self.size, (_COUNTS[self.kind],), RobotError) if _COUNTS[self.kind] else np.zeros(0)
        )
        color = None if self.color is None else as_readonly(f"{where}: color", self.color, (4,), RobotError)
        keep(
            self,
            joint=as_index(f"{where}: joint", self.joint),
            T_joint_visual=as_transform(f"{where}: T_joint_visual", self.T_joint_visual, RobotError),
            size=tuple(size.tolist()),
            scale=tuple(as_readonly(f"{where}: scale", self.scale, (3,), RobotError).tolist()),
            color=None if color is None else tuple(color.tolist()),
        )

    def carried(self, joint: int, T: Array) -> LinkVisual:
        """Return it on a joint, whose frame T (4, 4) leads to from its own [m]."""
        return replace(self, joint=joint, T_joint_visual=product(T, self.T_joint_visual))

    def found(self, source: str) -> Path | None:
        """Return the path of the mesh, looked for again beside the robot's file where it is not where it was; or None.

        Args:
            source: the robot's file.
        """
        if self.file and os.path.isfile(self.file):
            return Path(self.file)
        return found_mesh(self.filename, Path(source).parent) if self.filename else None


def link_visuals(root: Any, directory: Path) -> tuple[LinkVisual, ...]:
    """Read the <visual> elements of a URDF, each in its link's frame, as if that were joint -1.

    Args:
        root: a URDF, an lxml element that nothing was removed from.
        directory: of the URDF, where the search for meshes begins.
    """
    materials = _materials(root)
    links = [link for link in root.findall("link") if (link.get("name") or "").strip()]
    return tuple(
        _visual(link.get("name"), element, materials, directory) for link in links for element in link.findall("visual")
    )


def _visual(link: str, element: Any, materials: dict[str, Any], directory: Path) -> LinkVisual:
    try:
        T = _origin(element)
        kind, given = _geometry(element, directory)
    except ValueError as error:
        return LinkVisual(name=link, T_joint_visual=np.eye(4), kind="nothing", lack=str(error))
    try:
        color, lack = _color(element.find("material"), materials)
    except ValueError as error:
        color, lack = None, f"its colour is left out: {error}"
    return LinkVisual(name=link, T_joint_visual=T, kind=kind, color=color, lack=lack, **given)


def _geometry(element: Any, directory: Path) -> tuple[str, dict[str, Any]]:
    """Return the kind of a visual and what it has; raise ValueError with what is wrong."""
    geometry = element.find("geometry")
    shapes = [] if geometry is None else [shape for shape in geometry if isinstance(shape.tag, str)]
    if len(shapes) != 1 or shapes[0].tag not in (*_LENGTHS, "mesh"):
        raise ValueError(f"it has {' and '.join(f'<{shape.tag}>' for shape in shapes) or 'no shape'}")
    shape = shapes[0]
    if shape.tag != "mesh":
        count = {"size": 3}
        size = [number for name in _LENGTHS[shape.tag] for number in _numbers(shape, name, (count.get(name, 1),))]
        if min(size) < 0:
            raise ValueError(f"its <{shape.tag}> has a length below 0")
        return shape.tag, {"size": tuple(size)}
    filename = shape.get("filename") or ""
    if not filename:
        raise ValueError("its mesh names no file")
    scale = tuple((np.ones(3) * _numbers(shape, "scale", (1, 3), "1")).tolist())
    if not all(scale):
        raise ValueError("its mesh has a scale of 0")
    path = found_mesh(filename, directory)
    return "mesh", {"file": "" if path is None else os.path.abspath(path), "filename": filename, "scale": scale}


def _origin(element: Any) -> Array:
    T, origin = np.eye(4), element.find("origin")
    if origin is not None:
        T[:3, :3] = rotation_from_rpy(np.array(_numbers(origin, "rpy", (3,), "0 0 0")))
        T[:3, 3] = _numbers(origin, "xyz", (3,), "0 0 0")
    return T


def _materials(root: Any) -> dict[str, Any]:
    """Return the materials that have names: the global ones, then those that links define, the first of a name."""
    found: dict[str, Any] = {}
    for element in (*root.findall("material"), *(one for link in root.findall("link") for one in link.iter("material"))):
        name = element.get("name") or ""
        if name and (element.find("color") is not None or element.find("texture") is not None):
            found.setdefault(name, element)
    return found


def _color(material: Any, materials: dict[str, Any]) -> tuple[tuple[float, ...] | None, str]:
    """Return the colour of a visual's material, and what is not drawn of it; raise ValueError with what is wrong."""
    if material is None:
        return None, ""
    named = material.get("name") or ""
    material = materials.get(named, material)
    color, texture = material.find("color"), material.find("texture")
    lack = _TEXTURE.format(shown(texture.get("filename"))) if texture is not None and texture.get("filename") else ""
    if color is None:
        return None, lack or (f"its material '{named}' is not defined" if named and texture is None else "")
    red, green, blue, *opacity = (min(max(number, 0.0), 1.0) for number in _numbers(color, "rgba", (3, 4)))
    return (red, green, blue, *(opacity or [1.0])), lack


def _numbers(element: Any, attribute: str, counts: tuple[int, ...], default: str | None = None) -> list[float]:
    text = element.get(attribute, default)
    if text is None:
        raise ValueError(f"its <{element.tag} {attribute}> is missing")
    numbers = numbers_in(text.replace(",", " ") if attribute in WITH_COMMAS else text)
    if len(numbers) not in counts or not all(math.fabs(number) <= LONGEST for number in numbers):
        raise ValueError(f"its <{element.tag} {attribute}> is {shown(text)}")
    return numbers
