"""The columns of tables that say where the base and the end effector are, and their poses as numbers."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from spacearm.core.errors import FileFormatError
from spacearm.core.rotations import matrix_of

Array = NDArray[np.float64]

BASE_COLUMNS = ("base_x", "base_y", "base_z", "base_qw", "base_qx", "base_qy", "base_qz")
VELOCITY_COLUMNS = ("base_vx", "base_vy", "base_vz")
TURNING_COLUMNS = ("base_wx", "base_wy", "base_wz")
TIP_COLUMNS = ("tip_x_m", "tip_y_m", "tip_z_m")

_UNIT = 1e-3  # deviation from length 1 that a quaternion with few digits may have


def columns_of(names: tuple[str, ...], columns: dict[str, int], values: Array) -> Array | None:
    """Return these columns of a table, (m, k); None without them.

    Raises:
        FileFormatError: some of them only.
    """
    there = [name for name in names if name in columns]
    if not there:
        return None
    if len(there) < len(names):
        missing = next(name for name in names if name not in columns)
        raise FileFormatError(f"column '{there[0]}' is there and '{missing}' is not, expected all of {', '.join(names)}")
    return values[:, [columns[name] for name in names]]


def unit_poses(poses: Array, places: list[str]) -> Array:
    """Return positions and quaternions wxyz, (m, 7), the quaternions of length 1.

    Args:
        poses: (m, 7) as a file has them.
        places: (m,) where each stands in it.

    Raises:
        FileFormatError: quaternions that are none.
    """
    length = np.linalg.norm(poses[:, 3:].clip(-2, 2), axis=1)  # the squares of what is far too large may be no numbers
    wrong = np.abs(length - 1) > _UNIT
    if wrong.any():
        i = int(np.argmax(wrong))
        raise FileFormatError(
            f"{places[i]}: the base's quaternion has length {length[i]:.6g}, expected 1: an attitude w, x, y, z in "
            f"{', '.join(BASE_COLUMNS[3:])}"
        )
    return np.column_stack([poses[:, :3], poses[:, 3:] / length[:, None]])


def as_matrix(pose: Array) -> Array:
    """Return a pose (7,) as T_w_b (4, 4)."""
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = matrix_of(pose[3:]), pose[:3]
    return T
