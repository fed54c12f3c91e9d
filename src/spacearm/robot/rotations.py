"""Rotations as files state them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from spacearm._kernel.exact import product, sines

Array = NDArray[np.float64]


def rotation_from_rpy(rpy: Any) -> Array:
    """Return the rotation (3, 3) of URDF's roll, pitch, yaw [rad]: about the fixed x, then y, then z."""
    (sr, sp, sy), (cr, cp, cy) = sines(rpy)
    Rx = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    Ry = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    Rz = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
    return product(product(Rz, Ry), Rx)
