"""Obstacles from MoveIt's shapes, and MoveIt's own text of a scene, as `*.scene` files have it::

    (noname)+            the scene's name
    * shelf              an object
    0.5 0 0.2            its position, and
    0 0 0 1              its orientation, x y z w; older files have neither
    1                    the number of its shapes
    box                  a shape: box, sphere, cylinder, cone, plane or mesh
    0.4 0.8 0.02         its size: box x y z, sphere radius, cylinder and cone radius height, plane a b c d
    0 0 0                the shape's position, and
    0 0 0 1              its orientation within the object
    0.5 0.5 0.5 1        its colour
    0                    the number of subframes, each a name, a position and an orientation; older files do not say
    .                    the end

Newer files are told from older ones by the line after the first object's name: a pose has blanks, a number has none.
"""

from __future__ import annotations

import math
import os
import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm.core.checks import shown
from spacearm.core.errors import FileFormatError, SceneError, SpacearmError, nearest
from spacearm.geometry import Box, Cylinder, HalfSpace, Obstacle, Scene, Sphere, pose

Array = NDArray[np.float64]

PRIMITIVES = {"box": ("x", "y", "z"), "sphere": ("radius",), "cylinder": ("height", "radius"), "cone": ("height", "radius")}
"""Kinds, and their dimensions in the order of ROS's messages."""

NUMBERED = {1: "box", 2: "sphere", 3: "cylinder", 4: "cone", 5: "prism"}
"""The kinds in ROS's `shape_msgs/SolidPrimitive`."""

MOST_OBSTACLES = 100_000

_ON_PLANE = 1e-9  # [m] nearer to a plane than this the base stands on it


@dataclass(frozen=True, slots=True)
class Made:
    """A shape whose name and pose are still to come; `make(T, name)` gives the obstacle."""

    make: Callable[[Array, str], Obstacle]


def primitive(kind: str, size: Array) -> Made:
    """Return a solid in the order of ROS: box x, y, z; sphere radius; cylinder and cone height, radius.

    A cone, which stands on its base about the middle of its height, becomes the cylinder that encloses it.
    """
    if kind == "box":
        return Made(lambda T, name: Box(size, T, name=name))
    if kind == "sphere":
        return Made(lambda T, name: Sphere(T[:3, 3], float(size[0]), name=name))
    return Made(lambda T, name: Cylinder(float(size[1]), float(size[0]), T, name=name))


def plane(coefficients: ArrayLike, base: ArrayLike = (0.0, 0.0, 0.0)) -> Made:
    """Return the half-space beyond a plane a x + b y + c z + d = 0.

    MoveIt's planes have two sides and no inside. The robot's base (3,) [m] does not get through one, so the side of the base
    frame's origin is the free one; where it is on the plane, the side that the normal (a, b, c) points to.
    """
    *normal, d = (float(value) for value in np.asarray(coefficients))

    def make(T: Array, name: str) -> Obstacle:
        length = math.hypot(*normal)
        if not 1e-150 < length < 1e150:
            raise SceneError(
                f"the plane's normal is {normal}, expected a direction; give a, b, c and d of ax + by + cz + d = 0"
            )
        n = T[:3, :3] @ (np.array(normal) / length)
        point = T[:3, 3] - n * (d / length)
        return HalfSpace(-n if n @ (point - np.asarray(base)) > _ON_PLANE else n, point, name=name)

    return Made(make)


def mesh(vertices: Array, triangles: NDArray[np.int64], *, excess: float | None) -> Made:
    """Return convex pieces that hold a mesh of vertices (v, 3) [m] and triangles (n, 3), which count vertices from 0."""

    def make(T: Array, name: str) -> Obstacle:
        from spacearm.geometry import convex_pieces

        if not len(triangles):
            raise SceneError("the mesh has no triangles, expected at least one")
        if triangles.min() < 0 or triangles.max() >= len(vertices):
            worst = int(triangles.min()) if triangles.min() < 0 else int(triangles.max())
            raise SceneError(f"a triangle has vertex {worst}, expected 0 to {len(vertices) - 1}")
        return convex_pieces(vertices[triangles], pose=T, excess=excess, name=name)

    return Made(make)


def mesh_file(filename: str, directory: Path, scale: Array, *, excess: float | None) -> Made:
    """Return convex pieces that hold a mesh in a file.

    Args:
        filename: a path, relative to the directory unless it is absolute, or a URI, file:// or package://; the package is
            looked for in the directories above.
        directory: of the file that names it.
        scale: (3,) factors of its coordinates.
        excess: how far the pieces may stand out of it [m].
    """

    def make(T: Array, name: str) -> Obstacle:
        from spacearm.geometry import convex_pieces
        from spacearm.robot.collision_shapes import found_mesh

        path = found_mesh(filename, directory)
        if path is None:
            raise FileFormatError(
                f"the mesh '{filename}' is not there, expected it beside the file that names it, or for package:// in a folder "
                "above; put it there"
            )
        return convex_pieces(path, pose=T, scale=scale, excess=excess, name=name)

    return Made(make)


def named(name: str, number: int, count: int) -> str:
    """Return an obstacle's name: its object's, with a number from 1 where the object has several shapes."""
    return name if count == 1 else f"{name} {number + 1}".strip()


_NUMBER = re.compile(r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?")
_SIZES = {"box": 3, "sphere": 1, "cylinder": 2, "cone": 2, "plane": 4, "mesh": 2}


def is_scene_text(text: str) -> bool:
    """Whether a text is MoveIt's own and no YAML: after the name, a line that begins with an asterisk, or the closing dot."""
    lines = [line.strip() for line in text.splitlines()[1:]]
    first = next((line for line in lines if line), "")
    return first == "." or first == "*" or first.startswith("* ") or text.startswith("* ")


def scene_of_text(text: str, path: str | os.PathLike[str], *, mesh_excess: float | None = None) -> Scene:
    """Read MoveIt's own text of a scene.

    Raises:
        FileFormatError, SceneError: what is wrong, with file and line.
    """
    reader = _Reader(lines=text.splitlines(), path=path, row=1)
    obstacles: list[Obstacle] = []
    seen: set[str] = set()
    newer = _is_newer(reader.lines)
    while True:
        marker = reader.word("'* name' or the closing '.'")
        if marker == ".":
            return Scene(obstacles)
        if marker != "*":
            raise reader.error(f"{shown(marker)} stands where an object begins, expected '* name' or the closing '.'")
        name = reader.rest_of_line()
        if name in seen:
            raise reader.error(f"object {shown(name)} is there twice, expected each name once; rename or remove one")
        seen.add(name)
        obstacles += _object(reader, name, newer, mesh_excess)
        if len(obstacles) > MOST_OBSTACLES:
            raise reader.error(f"the scene has more than {MOST_OBSTACLES:,} shapes; leave out what is out of reach")


@dataclass(slots=True)
class _Reader:
    """Takes words one by one, as C++ does, over the ends of lines."""

    lines: list[str]
    path: str | os.PathLike[str]
    row: int
    column: int = 0
    last: int = 0

    def error(self, sentence: str) -> FileFormatError:
        return FileFormatError(f"{self.path}: line {self.last + 1}: {sentence}")

    def peek(self) -> str:
        """Return the next word, '' at the end, and leave it."""
        while self.row < len(self.lines):
            words = self.lines[self.row][self.column :].split(maxsplit=1)
            if words:
                return words[0]
            self.row, self.column = self.row + 1, 0
        return ""

    def word(self, expected: str) -> str:
        found = self.peek()
        if not found:
            raise FileFormatError(f"{self.path} ends after line {len(self.lines)}, expected {expected}; the file is cut off")
        self.last = self.row
        self.column = self.lines[self.row].index(found, self.column) + len(found)
        return found

    def rest_of_line(self) -> str:
        rest = self.lines[self.row][self.column :].strip()
        self.row, self.column = self.row + 1, 0
        return rest

    def numbers(self, count: int, what: str) -> Array:
        values = []
        for i in range(count):
            word = self.word(f"{what} ({count} numbers)")
            if not _NUMBER.fullmatch(word):
                raise self.error(f"{what} has {shown(word)} for number {i + 1} of {count}, expected a finite number")
            values.append(float(word))
        row = np.array(values)
        if not np.isfinite(row).all():
            raise self.error(f"{what} is {values}, expected finite numbers")
        return row

    def count(self, what: str) -> int:
        word = self.word(what)
        if not (word.isascii() and word.isdigit()) or len(word) > 9:
            raise self.error(f"{what} is {shown(word)}, expected a whole number")
        return int(word)

    def pose(self, what: str) -> Array:
        at = self.numbers(3, f"{what}'s position")
        x, y, z, w = q = self.numbers(4, f"{what}'s orientation")
        if not q.any():
            raise self.error(f"{what}'s orientation is 0 0 0 0, expected a unit quaternion x y z w; 0 0 0 1 turns nothing")
        try:
            return pose(at, (w, x, y, z))
        except SpacearmError as error:
            raise self.error(str(error)) from None


def _is_newer(lines: list[str]) -> bool:
    first = next((i for i, line in enumerate(lines[1:], start=1) if line.lstrip().startswith("*")), len(lines))
    return first + 1 < len(lines) and len(lines[first + 1].split()) > 1


def _object(reader: _Reader, name: str, newer: bool, mesh_excess: float | None) -> list[Obstacle]:
    T = reader.pose("the object") if newer else np.eye(4)
    count = reader.count("the number of shapes")
    out: list[Obstacle] = []
    for i in range(count):
        made = _shape(reader, mesh_excess)
        line = reader.last
        T_object_shape = reader.pose("the shape")
        reader.numbers(4, "the colour")
        try:
            out.append(made.make(T @ T_object_shape, named(name, i, count)))
        except SpacearmError as error:
            raise type(error)(f"{reader.path}: line {line + 1}: {error}") from None
    if newer and reader.peek() not in ("*", "."):  # files by hand may leave the number of subframes out
        for _ in range(reader.count("the number of subframes")):
            reader.word("the subframe's name")
            reader.pose("the subframe")
    return out


def _shape(reader: _Reader, mesh_excess: float | None) -> Made:
    kind = reader.word(f"a shape: {', '.join(_SIZES)}")
    if kind not in _SIZES:
        raise reader.error(f"{shown(kind)} is no shape; {nearest(kind, _SIZES)}")
    if kind == "mesh":
        vertex_count, triangle_count = reader.count("the number of vertices"), reader.count("the number of triangles")
        vertices = [reader.numbers(3, "a vertex") for _ in range(vertex_count)]
        triangles = [[reader.count("a triangle's vertex") for _ in range(3)] for _ in range(triangle_count)]
        corners = np.array(triangles, dtype=np.int64).reshape(-1, 3)
        return mesh(np.array(vertices).reshape(-1, 3), corners, excess=mesh_excess)
    size = reader.numbers(_SIZES[kind], f"the {kind}'s size")
    if kind == "plane":
        return plane(size)
    # The text has the radius of cylinders and cones first, ROS's messages have it last.
    return primitive(kind, size[::-1] if kind in ("cylinder", "cone") else size)
