"""Unit quaternions wxyz, many at once: what the proof needs of them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

CONJUGATE = np.array([1.0, -1.0, -1.0, -1.0])
"""Times a quaternion: its conjugate."""


def product(a: Array, b: Array) -> Array:
    """Return a o b, (..., 4)."""
    w, x, y, z = np.moveaxis(b, -1, 0)
    p, i, j, k = np.moveaxis(a, -1, 0)
    return np.stack(
        [
            p * w - i * x - j * y - k * z,
            p * x + i * w + j * z - k * y,
            p * y - i * z + j * w + k * x,
            p * z + i * y - j * x + k * w,
        ],
        axis=-1,
    )


def times(omega: Array) -> Array:
    """Return matrices (..., 4, 4) that take Q to Q o (0, omega)."""
    x, y, z = np.moveaxis(omega, -1, 0)
    o = np.zeros_like(x)
    rows = [[o, -x, -y, -z], [x, o, z, -y], [y, -z, o, x], [z, y, -x, o]]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def running(turns: Array) -> Array:
    """Return the products (p, 4) of the first, the first two, ... of so many quaternions."""
    out, step = turns.copy(), 1
    while step < len(out):
        out[step:] = product(out[:-step], out[step:])
        step *= 2
    return out / np.linalg.norm(out, axis=1)[:, None]


def rotation(wxyz: Array) -> Array:
    """Return R (..., 3, 3) of unit quaternions."""
    w, x, y, z = np.moveaxis(wxyz, -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def quaternion(R: Array) -> Array:
    """Return the unit quaternion (4,) of a rotation (3, 3)."""
    # The greatest column of 4 q q^T is q times its greatest entry, so nothing is divided by what may be 0.
    trace = float(np.trace(R))
    outer = np.empty((4, 4))
    outer[0, 0], outer[1:, 1:] = 1 + trace, R + R.T + (1 - trace) * np.eye(3)
    outer[0, 1:] = outer[1:, 0] = R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]
    column = outer[:, int(np.argmax(np.diag(outer)))]
    return column / np.linalg.norm(column)
