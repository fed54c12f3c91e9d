"""A box enclosed in rows of parallel capsules that stand out of it as little as their number allows.

The box is cut into columns along one of its edges, a grid of them across, and each column gets a capsule. Where the box
is w across a column, by v, and the capsule's ends lie d inside the box, the radius is that of the column's corners,
r^2 = (w/2)^2 + (v/2)^2 + d^2, and the capsule stands out by r - min(w/2, v/2, d) at most: along a face's normal, for to any
other side there is more box around it. The least of that over d is at d = min(w, v)/2.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

import numpy as np

from spacearm.robot.capsule_fit import Segment

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
