"""Links and joints as files describe them: what the URDF and the YAML reader hand to `tree`."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Mimic:
    """A joint's value follows another's: ``multiplier * leader + offset``."""

    leader: str
    multiplier: float
    offset: float


@dataclass(frozen=True, slots=True, kw_only=True)
class LinkJoint:
    """A joint between two links, as a file states it; limits that the file leaves out are None.

    Attributes:
        name: unique.
        kind: "revolute", "continuous", "prismatic" or "fixed".
        parent, child: names of the links.
        T_parent_child: (4, 4), from the child link's frame at value 0 to the parent link's [m].
        axis: (3,) in the child link's frame, of any length above 0; None for a fixed joint.
        lower, upper: [rad or m].
        velocity, acceleration: [rad/s, rad/s^2 or m/s, m/s^2].
        mimic: the joint that it follows.
    """

    name: str
    kind: str
    parent: str
    child: str
    T_parent_child: Array
    axis: Array | None = None
    lower: float | None = None
    upper: float | None = None
    velocity: float | None = None
    acceleration: float | None = None
    mimic: Mimic | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class LinkTree:
    """Links, the joints between them, and capsules by link: (link, a, b, radius), in its frame [m]."""

    name: str
    links: tuple[str, ...]
    joints: tuple[LinkJoint, ...]
    capsules: tuple[tuple[str, Array, Array, float], ...] = ()
    tip: str | None = None
    source: str = ""
    notes: tuple[str, ...] = ()
