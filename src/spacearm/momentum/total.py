"""The momentum that a spacecraft has, and keeps."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm.checks import Frozen, as_readonly, keep
from spacearm.errors import ProblemError

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Momentum(Frozen):
    """The total momentum of base and arm, which nothing changes while no force acts; inertial frame.

    Attributes:
        linear: (3,) [N s].
        angular: (3,) about the system's centre of mass [N m s].

    Raises:
        ProblemError: not three finite numbers.
    """

    linear: Array = None  # type: ignore[assignment]  # filled in below
    angular: Array = None  # type: ignore[assignment]

    if TYPE_CHECKING:

        def __init__(self, *, linear: ArrayLike = (0.0, 0.0, 0.0), angular: ArrayLike = (0.0, 0.0, 0.0)) -> None: ...

    def __post_init__(self) -> None:
        for name in ("linear", "angular"):
            given = getattr(self, name)
            keep(self, **{name: as_readonly(f"momentum.{name}", np.zeros(3) if given is None else given, (3,), ProblemError)})

    @property
    def is_zero(self) -> bool:
        """Whether the spacecraft neither drifts nor tumbles."""
        return not (self.linear.any() or self.angular.any())
