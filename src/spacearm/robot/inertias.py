"""Inertias that a body can have, and those that none has."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from spacearm.core.errors import RobotError

Array = NDArray[np.float64]

INERTIA_ROUNDING = 1e-9
"""Share of the largest principal moment by which the moments may miss what those of a body satisfy. Files state six digits or
more, and the moments of a matrix (3, 3) are computed to 1e-15."""


def inertia_fault(inertia: Array, *, rounding: float = INERTIA_ROUNDING, scale: float = 0.0) -> str:
    """Say why no body can have an inertia.

    A body's principal moments are integrals over its mass: none is below 0, and none is above the sum of the other two.

    Args:
        inertia: (3, 3), symmetric [kg m^2].
        rounding: by which share of the largest moment the others may miss that.
        scale: a number that the inertia was computed from and whose rounding it has, if that is larger [kg m^2].

    Returns:
        "" for an inertia that a body can have, else "negative" or "triangle".
    """
    moments = np.linalg.eigvalsh(inertia)  # ascending
    slack = rounding * max(float(np.abs(moments).max()), scale)
    if moments[0] < -slack:
        return "negative"
    return "triangle" if moments[2] - moments[1] - moments[0] > slack else ""


def require_possible_inertia(where: str, inertia: Array) -> None:
    """Refuse an inertia (3, 3) that no body can have.

    Raises:
        RobotError: it is one.
    """
    if inertia_fault(inertia):
        least, middle, largest = np.linalg.eigvalsh(inertia)
        raise RobotError(
            f"{where}: inertia has the principal moments {least:g}, {middle:g} and {largest:g}, expected none below 0 and none "
            "above the sum of the other two; correct it"
        )
