"""What may be asked of a base that moves with its arm: how it is to stand at the end, and how little the arm may disturb it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm.checks import Frozen, as_number, as_readonly, keep
from spacearm.errors import ProblemError
from spacearm.momentum.base_models import LIMITS
from spacearm.momentum.turning import as_unit

Array = NDArray[np.float64]

_LEAST = 1e-9  # [rad, rad/s or N m s]; below, rounding decides
_MOST = 1e12  # as good as no limit


@dataclass(frozen=True, slots=True, eq=False)
class AttitudeGoal(Frozen):
    """How the base is to stand when the motion ends.

    Attributes:
        attitude_wxyz: (4,) unit quaternion of R_w_b, from base to inertial frame; what is given is made one of length 1.
        tolerance: [rad] by which it may be missed, above 0; by default about 0.03 degrees.

    Raises:
        ProblemError: numbers that are no quaternion, or a tolerance that is not above 0.
    """

    attitude_wxyz: Array
    tolerance: float = 5e-4

    if TYPE_CHECKING:  # what is taken is wider than what is kept

        def __init__(self, attitude_wxyz: ArrayLike, tolerance: float = ...) -> None: ...

    def __post_init__(self) -> None:
        tolerance = as_number("the base goal's tolerance", self.tolerance, ProblemError, above=0, at_most=_MOST, unit="rad")
        unit = as_unit("the base goal's attitude_wxyz", self.attitude_wxyz)
        keep(self, attitude_wxyz=as_readonly("attitude_wxyz", unit, (4,), ProblemError), tolerance=tolerance)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BaseLimits(Frozen):
    """How little the arm may disturb its base; None is no limit.

    A rate or a momentum is kept by moving slower, unless the problem states its duration; angles do not depend on time.

    Attributes:
        final: angle between the base's attitudes at the end and at the beginning [rad].
        peak: the greatest angle from the attitude at the beginning, at any time [rad].
        rate: how fast the base may turn [rad/s].
        joint_momentum: the arm's angular momentum about the system's centre of mass, its joints' motion alone [N m s]: what
            reaction wheels would have to take up to hold the base's attitude.

    Raises:
        ProblemError: a limit that is not above 0, or so small that only rest would keep it.
    """

    final: float | None = None
    peak: float | None = None
    rate: float | None = None
    joint_momentum: float | None = None

    def __post_init__(self) -> None:
        for name, unit in (("final", "rad"), ("peak", "rad"), ("rate", "rad/s"), ("joint_momentum", "N m s")):
            given = getattr(self, name)
            if given is not None:
                keep(
                    self,
                    **{name: as_number(f"base limit {name}", given, ProblemError, at_least=_LEAST, at_most=_MOST, unit=unit)},
                )

    @property
    def asked(self) -> tuple[str, ...]:
        """The names of the limits that there are."""
        return tuple(name for name in LIMITS if getattr(self, name) is not None)

    @property
    def any(self) -> bool:
        """Whether there is a limit at all."""
        return bool(self.asked)
