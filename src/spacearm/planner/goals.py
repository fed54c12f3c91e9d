"""Where a motion is to end."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm.checks import Frozen, as_name, as_number, as_readonly
from spacearm.errors import ProblemError


@dataclass(frozen=True, slots=True, eq=False)
class ConfigurationGoal(Frozen):
    """The motion ends in one configuration.

    Attributes:
        q: (n,) joint positions [rad or m].

    Raises:
        ProblemError: not a row of finite numbers.
    """

    q: NDArray[np.float64]

    if TYPE_CHECKING:  # what is taken is wider than what is kept

        def __init__(self, q: ArrayLike) -> None: ...

    def __post_init__(self) -> None:
        object.__setattr__(self, "q", as_readonly("the goal configuration", self.q, (None,), ProblemError))


@dataclass(frozen=True, slots=True, eq=False)
class PositionGoal(Frozen):
    """The motion ends with the origin of a frame at a point, in any orientation.

    Attributes:
        position: (3,) in the base frame at the start [m].
        tolerance: the greatest distance from it that counts as reached [m], above 0.
        frame: name of the frame; None is the robot's tip, and `Problem` fills it in.

    Raises:
        ProblemError: not three finite numbers, or a tolerance that is not above 0.
    """

    position: NDArray[np.float64]
    _: KW_ONLY
    tolerance: float = 1e-3
    frame: str | None = None

    if TYPE_CHECKING:

        def __init__(self, position: ArrayLike, *, tolerance: float = 1e-3, frame: str | None = None) -> None: ...

    def __post_init__(self) -> None:
        position = as_readonly("the goal position", self.position, (3,), ProblemError)
        tolerance = as_number("the goal's tolerance", self.tolerance, ProblemError, above=0, unit="m")
        object.__setattr__(self, "position", position)
        object.__setattr__(self, "tolerance", tolerance)
        if self.frame is not None:
            as_name("the goal's frame", self.frame, ProblemError)


Goal: TypeAlias = ConfigurationGoal | PositionGoal
"""Any of the goals."""
