"""How closely a robot's envelope follows its collision shapes."""

from __future__ import annotations

import math
import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from spacearm.checks import as_whole
from spacearm.errors import RobotError
from spacearm.reading import located
from spacearm.robot.capsule_fit import Segment, union_volume
from spacearm.robot.envelope import Shape, enclosed, link_shapes
from spacearm.robot.excess import greatest_excess
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
