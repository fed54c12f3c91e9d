"""How a robot's links look, for the report's page and for other pictures: shapes, and meshes read, thinned out and packed.

Meshes are read here and nowhere before. What cannot be drawn is told in a note, and the link's envelope is drawn in its place.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spacearm.geometry.mesh_decimation import Surface, decimated, welded
from spacearm.geometry.meshes import read_mesh
from spacearm.report.report_meshes import Meshes
from spacearm.report.report_page import transform
from spacearm.robot import LinkVisual, Robot
from spacearm.robot.collision_shapes import listed

Array = NDArray[np.float64]

TRIANGLES = 120_000
"""The most triangles of a robot's meshes: with them a report has about 2 MB, and a phone still turns it."""

_SMALLEST = 1e-9  # [m] the least size of a mesh
_WITHOUT_COLOR = (0.72, 0.73, 0.75)  # of triangles whose mesh colours others


def visual_parts(robot: Robot, meshes: Meshes, most: int = TRIANGLES) -> list[dict[str, Any]]:
    """Return what a robot is drawn with, as the page's data have it, without what cannot be drawn; [] of one without visuals.

    Args:
        robot: with its visuals.
        meshes: of the report; it gets those that are drawn, and notes: what is missing, how many triangles are drawn.
        most: triangles of the robot's meshes together.
    """
    drawn = _Drawn()
    for visual in robot.visuals:
        if visual.lack:
            drawn.say(visual.lack, visual.name)
        if visual.color is not None and visual.color[3] < 1:
            drawn.say("it is drawn opaque, which its file does not ask for", visual.name)
        if visual.kind == "mesh":
            drawn.read(visual, robot.source)
        elif visual.kind != "nothing":
            drawn.parts.append((visual, None))
    surfaces = list(drawn.surfaces.values())
    fewer, cell = decimated(surfaces, most)
    places = {key: (_added(surface, meshes), surface) for key, surface in zip(drawn.surfaces, fewer, strict=True)}
    notes = [*_notes(drawn.said), *_note_on_triangles(surfaces, fewer, cell)]
    meshes.notes.extend(note for note in notes if note not in meshes.notes)
    return [_part(visual, None if key is None else places[key]) for visual, key in drawn.parts]


_Key = tuple[str, tuple[float, ...], "tuple[float, ...] | None"]


class _Drawn:
    """What is drawn of a robot, gathered a visual at a time."""

    def __init__(self) -> None:
        self.parts: list[tuple[LinkVisual, _Key | None]] = []
        self.surfaces: dict[_Key, Surface] = {}
        self.said: dict[str, list[str]] = {}
        self._read: dict[Path, _Read] = {}

    def say(self, what: str, link: str) -> None:
        self.said.setdefault(what, []).append(link)

    def read(self, visual: LinkVisual, source: str) -> None:
        """Take a mesh, or say why that cannot be done."""
        path = visual.found(source)
        if path is None:
            self.say("the mesh is not there, and the envelope is drawn", f"{visual.name}: {visual.filename}")
            return
        read = self._read.setdefault(path, _Read.of(path))
        for note in read.notes:
            self.say(note, visual.name)
        if read.surface is None:
            return
        mixed = read.surface.colors is not None and bool(np.isnan(read.surface.colors).any())
        key = (str(path), visual.scale, visual.color if mixed else None)
        if key not in self.surfaces:
            self.surfaces[key] = _scaled(read.surface, visual)
        self.parts.append((visual, key))


@dataclass(frozen=True, slots=True)
class _Read:
    """A mesh file's triangles, None if they cannot be had, and what is to be said of it."""

    surface: Surface | None
    notes: tuple[str, ...]

    @classmethod
    def of(cls, path: Path) -> _Read:
        try:
            mesh = read_mesh(path, with_colors=True)
        except (OSError, ValueError) as error:
            return cls(None, (f"the mesh cannot be read ({error}), and the envelope is drawn",))
        if not np.ptp(mesh.triangles.reshape(-1, 3), axis=0).max() > _SMALLEST:
            return cls(None, ("the mesh has no size, and the envelope is drawn",))
        colors = None if mesh.colors is None or np.isnan(mesh.colors).all() else mesh.colors
        surface = welded(mesh.triangles, colors)
        notes = tuple(note for note in mesh.notes if note.startswith("a texture"))
        return cls(surface, notes) if len(surface.faces) else cls(None, ("the mesh has no area, and the envelope is drawn",))


def _scaled(surface: Surface, visual: LinkVisual) -> Surface:
    """Scale a surface, keep its outside out, and give triangles without a colour the visual's."""
    mirrored = np.prod(visual.scale) < 0
    colors = surface.colors
    if colors is not None and np.isnan(colors).any():
        fill = (*_WITHOUT_COLOR, 1.0) if visual.color is None else visual.color
        colors = np.where(np.isnan(colors), fill, colors)
    return Surface(surface.points * visual.scale, surface.faces[:, ::-1] if mirrored else surface.faces, colors)


def _added(surface: Surface, meshes: Meshes) -> int:
    """Add a mesh to a report's, with the triangles' colours if there are several, and return its place."""
    several = None if surface.colors is None or _only_color(surface) is not None else _bytes(surface.colors[:, :3])
    return meshes.add(surface.points, surface.faces, several)


def _bytes(colors: Array) -> NDArray[np.uint8]:
    return np.round(255 * colors).astype(np.uint8)


def _only_color(surface: Surface) -> tuple[float, ...] | None:
    """Return the colour of all triangles; None where they have several, or none."""
    if surface.colors is None or (_bytes(surface.colors) != _bytes(surface.colors[0])).any():
        return None
    return tuple(surface.colors[0].tolist())


def _part(visual: LinkVisual, mesh: tuple[int, Surface] | None) -> dict[str, Any]:
    part: dict[str, Any] = {"name": visual.name, "joint": visual.joint, "geometry": _geometry(visual, mesh and mesh[0])}
    color = visual.color if mesh is None or mesh[1].colors is None else _only_color(mesh[1])
    if color is not None:
        part["color"] = "#" + "".join(f"{value:02x}" for value in _bytes(np.array(color[:3])))
    return part


def _geometry(visual: LinkVisual, mesh: int | None) -> dict[str, Any]:
    T, size = visual.T_joint_visual, visual.size
    if mesh is not None:
        return {"kind": "mesh", "mesh": mesh, "T": transform(T)}
    if visual.kind == "box":
        return {"kind": "box", "size": list(size), "T": transform(T)}
    if visual.kind == "cylinder":
        return {"kind": "cylinder", "radius": size[0], "length": size[1], "T": transform(T)}
    if visual.kind == "sphere":
        return {"kind": "sphere", "radius": size[0], "center": T[:3, 3].tolist()}
    half = T[:3, 2] * size[1] / 2
    return {"kind": "capsule", "radius": size[0], "a": (T[:3, 3] - half).tolist(), "b": (T[:3, 3] + half).tolist()}


def _notes(said: dict[str, list[str]]) -> Iterable[str]:
    return (f"visuals: {what}: {listed(dict.fromkeys(links))}" for what, links in said.items())


def _note_on_triangles(surfaces: Sequence[Surface], fewer: Sequence[Surface], cell: float) -> Iterable[str]:
    if cell:
        total, kept = (sum(len(surface.faces) for surface in some) for some in (surfaces, fewer))
        yield (
            f"visuals: {kept:,} triangles are drawn of the {total:,} that the meshes have; details below "
            f"{1000 * cell:.2g} mm are merged. The envelope, which plans and proofs use, is not touched by that"
        )
