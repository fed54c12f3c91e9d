"""The base's pose in tables: seven columns, position [m] and attitude wxyz in the inertial frame."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from spacearm.errors import FileFormatError
from spacearm.momentum.turning import angle, conjugate, matrix_of, multiplied
from spacearm.motion.on_a_base import OnABase

Array = NDArray[np.float64]

BASE_COLUMNS = ("base_x", "base_y", "base_z", "base_qw", "base_qx", "base_qy", "base_qz")

_UNIT = 1e-3  # by which a quaternion of few digits may miss length 1
_STILL = 1e-6  # [m, rad] what a fixed base may move by in a file: its last digit


def base_poses(columns: dict[str, int], values: Array, lines: list[int]) -> Array | None:
    """Return the base's position and unit quaternion in each row of a table, (m, 7); None without such columns.

    Raises:
        FileFormatError: some of the columns only, or quaternions that are none.
    """
    there = [name for name in BASE_COLUMNS if name in columns]
    if not there:
        return None
    if len(there) < len(BASE_COLUMNS):
        missing = next(name for name in BASE_COLUMNS if name not in columns)
        raise FileFormatError(f"column '{there[0]}' is there and '{missing}' is not, expected all of {', '.join(BASE_COLUMNS)}")
    poses = values[:, [columns[name] for name in BASE_COLUMNS]]
    length = np.linalg.norm(poses[:, 3:].clip(-2, 2), axis=1)  # the squares of what is far too large may be no numbers
    wrong = np.abs(length - 1) > _UNIT
    if wrong.any():
        i = int(np.argmax(wrong))
        raise FileFormatError(
            f"line {lines[i]}: the base's quaternion has length {length[i]:.6g}, expected 1: an attitude w, x, y, z in "
            f"{', '.join(BASE_COLUMNS[3:])}"
        )
    return np.column_stack([poses[:, :3], poses[:, 3:] / length[:, None]])


def first_pose(poses: Array) -> Array:
    """Return the first row's pose, T_w_b (4, 4)."""
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = matrix_of(poses[0, 3:]), poses[0, :3]
    return T


def compared(trajectory: OnABase, t: Array, poses: Array, lines: list[int]) -> str:
    """Return a sentence on how the base moves in a file and by conservation of momentum.

    Args:
        trajectory: read from it.
        t: (m,) of its rows, from 0 [s].
        poses: (m, 7) in its rows.
        lines: of its rows.

    Raises:
        FileFormatError: the base moves in the file, and is fixed here.
    """
    position, attitude = trajectory.base_pose(t)
    with np.errstate(over="ignore"):
        away = np.linalg.norm(poses[:, :3] - position, axis=1)
    turned = angle(multiplied(conjugate(poses[:, 3:]), attitude))
    if trajectory.base == "fixed":
        moving = np.maximum(away, turned) > _STILL
        if moving.any():
            i = int(np.argmax(moving))
            raise FileFormatError(
                f"line {lines[i]}: the base is {away[i]:.4g} m and {turned[i]:.4g} rad from where a fixed base stays; "
                "give base='floating', or leave the base's columns out"
            )
        return "the base stays where the file has it"
    return (
        f"the base moves by conservation of momentum, from the file's first pose or the given one; the file's poses are within "
        f"{away.max():.3g} m and {turned.max():.3g} rad of that"
    )
