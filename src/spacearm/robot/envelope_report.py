"""How closely a robot's envelope follows its collision shapes."""

from __future__ import annotations

import itertools
import math
import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from spacearm.core.checks import as_whole
from spacearm.core.errors import RobotError
from spacearm.core.reading import located
from spacearm.robot.capsule_fit import Segment, union_volume
from spacearm.robot.envelope import Shape, enclosed, greatest_excess, link_shapes
from spacearm.robot.urdf import CAPSULES_PER_SHAPE, MOST_CAPSULES_PER_SHAPE, parsed_urdf

Array = NDArray[np.float64]

_IN_VOLUME = 60_000  # points in the box around all of them


@dataclass(frozen=True, slots=True, kw_only=True)
class LinkEnvelope:
    """The envelope of one link.

    Attributes:
        link: its name.
        shapes: the kinds of its collision shapes: "sphere", "cylinder", "box" or "mesh".
        capsules: how many capsules enclose them.
        excess: how far the envelope stands out of the shapes, at most [m].
        volume: of the envelope [m^3].
        ratio: of that volume to the sum of the shapes' own [-]; inf if they have none.
    """

    link: str
    shapes: tuple[str, ...]
    capsules: int
    excess: float
    volume: float
    ratio: float


def envelope_report(urdf: str | os.PathLike[str], *, capsules_per_shape: int = CAPSULES_PER_SHAPE) -> tuple[LinkEnvelope, ...]:
    """Measure the envelope that `load_robot` gives to the links of a URDF file.

    The excess is the greatest found among 1500 points on each capsule, and the volume is that of 60,000 points
    spread evenly: both are good to about two percent.

    Args:
        urdf: path of the file.
        capsules_per_shape: as in `load_robot`.

    Returns:
        One record for each link with collision shapes.

    Raises:
        FileFormatError: no such file, or no URDF.
        RobotError: a mesh that cannot be read, or `capsules_per_shape` below 1.
    """
    count = as_whole("capsules_per_shape", capsules_per_shape, RobotError, at_least=1, at_most=MOST_CAPSULES_PER_SHAPE)
    links = parsed_urdf(urdf).links
    with located(urdf):
        found = [(link.name, link_shapes(link, Path(urdf).parent)) for link in links]
    return tuple(_measured(name, shapes, enclosed(shapes, count)) for name, shapes in found if shapes)


def _measured(link: str, shapes: list[Shape], capsules: list[Segment]) -> LinkEnvelope:
    volume = union_volume(capsules, _IN_VOLUME)
    own = sum(_shape_volume(shape) for shape in shapes)
    return LinkEnvelope(
        link=link,
        shapes=tuple(shape.kind for shape in shapes),
        capsules=len(capsules),
        excess=greatest_excess(shapes, capsules),
        volume=volume,
        ratio=volume / own if own > 0 else math.inf,
    )


def _shape_volume(shape: Shape) -> float:
    if shape.kind == "sphere":
        return 4 / 3 * math.pi * shape.size[0] ** 3
    if shape.kind == "cylinder":
        return math.pi * shape.size[0] ** 2 * shape.size[1]
    if shape.kind == "box":
        return math.prod(shape.size)
    assert shape.triangles is not None
    a, b, c = np.moveaxis(shape.triangles - shape.triangles.mean(axis=(0, 1)), 1, 0)
    return abs(float(np.einsum("ki,ki->", a, np.cross(b, c)))) / 6


# ---- A box enclosed in rows of parallel capsules that stand out of it as little as their number allows ---------------
#
# The box is cut into columns along one of its edges, a grid of them across, and each column gets a capsule. Where the
# box is w across a column, by v, and the capsule's ends lie d inside the box, the radius is that of the column's
# corners, r^2 = (w/2)^2 + (v/2)^2 + d^2, and the capsule stands out by r - min(w/2, v/2, d) at most: along a face's
# normal, for to any other side there is more box around it. The least of that over d is at d = min(w, v)/2.

_ROUNDING = 1e-12  # share of the radius, so that the corners are inside


@dataclass(frozen=True, slots=True)
class _Grid:
    """Columns along the edge `along`, so many of them across in each of the other directions."""

    along: int
    numbers: tuple[int, int, int]
    inset: float
    radius: float

    @property
    def excess(self) -> float:
        return self.radius - self.inset


def box_capsules(size: tuple[float, float, float], count: int) -> list[Segment]:
    """Enclose a box about the origin in at most `count` capsules.

    Of the grids that stand out equally little, the one with the fewest capsules is taken.

    Args:
        size: the three edges [m].
        count: 1 or more.

    Returns:
        The capsules, parallel to one edge of the box, in the box's frame.
    """
    grid = min((_grid(size, numbers) for numbers in _numbers(count)), key=lambda g: (g.excess, math.prod(g.numbers)))
    widths = np.array(size) / grid.numbers
    half = np.zeros(3)
    half[grid.along] = size[grid.along] / 2 - grid.inset
    capsules = []
    for place in itertools.product(*(range(number) for number in grid.numbers)):
        center = (np.array(place) + 0.5) * widths - np.array(size) / 2
        capsules.append(Segment(center - half, center + half, grid.radius * (1 + _ROUNDING)))
    return capsules


def box_excess(size: tuple[float, float, float], count: int) -> float:
    """Return by how much `box_capsules` stand out of the box at most [m]."""
    return min(_grid(size, numbers).excess for numbers in _numbers(count))


def _numbers(count: int) -> list[tuple[int, int, int]]:
    """List how many columns lie in each direction; along one of them, one."""
    pairs = [(i, k) for i in range(1, count + 1) for k in range(1, count // i + 1)]
    return [tuple(np.insert(pair, along, 1).tolist()) for along in range(3) for pair in pairs]  # type: ignore[misc]


def _grid(size: tuple[float, float, float], numbers: tuple[int, int, int]) -> _Grid:
    along = numbers.index(1) if numbers.count(1) == 1 else int(np.argmax(np.where(np.array(numbers) == 1, size, -1.0)))
    halves = [size[i] / numbers[i] / 2 for i in range(3) if i != along]
    inset = min(*halves, size[along] / 2)
    return _Grid(along, numbers, inset, math.hypot(*halves, inset))


# ---- -----------------------------------------------------------------------------------------------------------------
# What to tell about a robot's collision shapes: how their files were read, shapes without extent, doubtful units.

OVERSIZED = 20.0
"""A mesh so many times larger than the whole chain of joints is taken for one in millimetres."""

_LEAST = 2.0  # [m] smaller meshes are nobody's millimetres
_NAMED = 6  # links in a note
_FLAT = 1e-9  # share of a shape's largest extent, below which it is a surface


def chain_length(joints: Iterable[tuple[str, str, float]]) -> float:
    """Return the longest way from a root to a link along the joints' origins [m].

    Args:
        joints: parent link, child link, and the length of the joint's origin [m]; circles are cut.
    """
    above = {child: (parent, length) for parent, child, length in joints}
    longest = 0.0
    for link in above:
        at, total, passed = link, 0.0, set[str]()
        while at in above and at not in passed:
            passed.add(at)
            at, length = above[at]
            total += length
        longest = max(longest, total)
    return longest


def looks_like_millimetres(size: float, chain: float) -> bool:
    """Whether a mesh of a size [m] is too large for a robot whose joints reach so far [m]."""
    return size > _LEAST and 0 < chain * OVERSIZED < size


def shape_notes(shapes: Mapping[str, Sequence[Shape]], chain: float) -> tuple[str, ...]:
    """Return a sentence for each kind of thing that is to be known.

    Args:
        shapes: each link's collision shapes.
        chain: `chain_length` of the robot [m].
    """
    of_kind: dict[str, list[str]] = {}
    for link, own in shapes.items():
        for shape in own:
            for kind in _kinds(shape, chain):
                of_kind.setdefault(kind, []).append(link)
    return tuple(f"{kind}: {_listed(dict.fromkeys(links))}" for kind, links in of_kind.items())


def _kinds(shape: Shape, chain: float) -> list[str]:
    kinds = [f"mesh files, {note}" for note in shape.notes]
    if shape.triangles is None:
        if min(shape.size) <= 0:
            kinds.append(f"a {shape.kind} with an edge or radius of 0 m is enclosed as what is left of it, a line or a point")
        return kinds
    extent = np.ptp(shape.triangles.reshape(-1, 3), axis=0)
    if looks_like_millimetres(float(extent.max()), chain):
        kinds.append(
            f"meshes far larger than the {chain:.3g} m that the joints reach; if they are in millimetres, write "
            'scale="0.001 0.001 0.001"'
        )
    spread = np.linalg.svd(_corners(shape) - _corners(shape)[0], compute_uv=False)
    if spread[-1] <= _FLAT * spread[0]:
        kinds.append("a mesh that is flat has no inside, and is enclosed as a plate without thickness")
    return kinds


def _corners(shape: Shape) -> np.ndarray:
    assert shape.triangles is not None
    points = shape.triangles.reshape(-1, 3)
    return points[:: max(1, len(points) // 2000)]


def _listed(links: Iterable[str]) -> str:
    names = list(links)
    more = f", ... ({len(names)} links)" if len(names) > _NAMED else ""
    return ", ".join(f"'{name}'" for name in names[:_NAMED]) + more
