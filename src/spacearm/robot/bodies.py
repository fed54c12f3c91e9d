"""The masses of a robot's links."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spacearm.checks import Frozen, as_name, as_number, as_readonly, as_whole, keep, shown
from spacearm.errors import RobotError

Array = NDArray[np.float64]

_SKEW = 1e-9  # share of its largest entry by which an inertia may miss symmetry


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Body(Frozen):
    """The mass of one link; links that are fixed to each other are bodies of their own on the same joint.

    Attributes:
        name: of the link.
        joint: index of the joint whose moving frame it rides on, -1 for the base.
        mass: [kg].
        com: (3,) centre of mass, in that frame [m].
        inertia: (3, 3) about the centre of mass, along the axes of that frame [kg m^2].

    Raises:
        RobotError: a mass below 0, numbers that are not finite, or an inertia that is not symmetric.
    """

    name: str
    joint: int
    mass: float
    com: Array
    inertia: Array

    def __post_init__(self) -> None:
        where = f"body '{as_name('a body name', self.name, RobotError)}'"
        inertia = as_readonly(f"{where}: inertia", self.inertia, (3, 3), RobotError)
        half = inertia / 2  # of large numbers the sum would be infinite
        if np.abs(half - half.T).max() > _SKEW * np.abs(half).max():
            raise RobotError(f"{where}: inertia is {shown(inertia.tolist())}, expected a symmetric one")
        keep(
            self,
            joint=as_index(f"{where}: joint", self.joint),
            mass=as_number(f"{where}: mass", self.mass, RobotError, at_least=0, unit="kg"),
            com=as_readonly(f"{where}: com", self.com, (3,), RobotError),
            inertia=as_readonly(f"{where}: inertia", half + half.T, (3, 3), RobotError),
        )


def as_index(name: str, value: Any) -> int:
    """Check the index of a joint; -1 is the base.

    Raises:
        RobotError: none.
    """
    return as_whole(name, value, RobotError, at_least=-1, wanted="an index, or -1")
