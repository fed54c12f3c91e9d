"""Rotations: unit quaternions wxyz, rotation matrices, rotation vectors, and the roll, pitch, yaw of URDF.

Every room uses these functions. SciPy's `Rotation` is not used here. It calls the sines and angles of the C library, whose last
digits differ from machine to machine, and recorded values must be the same bits on every processor (docs/conventions.md). All
functions here use `core.exact`, or only `+`, `-`, `*`, `/`, sums and square roots.

The product of quaternions and the matrix of a quaternion are here twice, with sums in another order: `multiplied` and
`matrix_of` for recorded motions, `product_by_parts` and `matrix_by_parts` for the proof of a floating base. Their last digits
differ. Both orders are part of what is recorded: these digits of a motion are saved, and in a certificate they decide which
instant is named if two are equally close.

Arrays have any leading axes. The last axis is the quaternion (4,) or the vector (3,); the last two are the matrix (3, 3).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm.core.checks import as_readonly
from spacearm.core.errors import ProblemError
from spacearm.core.exact import angle_of, cross, length, product, sines

Array = NDArray[np.float64]

_SMALL_HALF_ANGLE = 1e-4  # [rad] below it the series of sin(x)/x up to x^2 is right to the last digit
_SMALL_SINE = 1e-8  # of an angle near 0 or pi: its axis cannot be taken from the skew part of the matrix

# ---- Unit quaternions ------------------------------------------------------------------------------------------------


def as_unit(name: str, wxyz: ArrayLike) -> Array:
    """Return an attitude as a unit quaternion, (4,).

    Raises:
        ProblemError: not four finite numbers, or all of them 0.
    """
    given = as_readonly(name, wxyz, (4,), ProblemError, advice="give a quaternion w, x, y, z")
    size = float(np.abs(given).max())
    if size == 0:
        raise ProblemError(f"{name} is all zeros, expected a quaternion w, x, y, z; (1, 0, 0, 0) is no turn")
    return given / size / length(given / size)


def multiplied(p: Array, q: Array) -> Array:
    """Return the product p q, (..., 4): the rotation q, then the rotation p, both about fixed axes."""
    out = np.empty(np.broadcast_shapes(p.shape, q.shape))
    a, b, c, d = (p[..., i] for i in range(4))
    w, x, y, z = (q[..., i] for i in range(4))
    out[..., 0] = a * w - ((b * x + c * y) + d * z)
    out[..., 1] = (a * x + w * b) + (c * z - d * y)
    out[..., 2] = (a * y + w * c) + (d * x - b * z)
    out[..., 3] = (a * z + w * d) + (b * y - c * x)
    return out


def conjugate(q: Array) -> Array:
    """Return the inverses of unit quaternions, (..., 4)."""
    return q * np.array([1.0, -1.0, -1.0, -1.0])


def exponential(rotation: Array) -> Array:
    """Return the unit quaternion (..., 4) of a rotation vector (..., 3) [rad]."""
    half = np.linalg.norm(rotation, axis=-1, keepdims=True) / 2
    sine, cosine = sines(half)
    small = half < _SMALL_HALF_ANGLE
    # sin(x)/x -> 1 - x^2/6 as x -> 0, where the quotient has no value
    ratio = np.where(small, 1 - half * half / 6, sine / np.where(small, 1.0, half))
    return np.concatenate([cosine, rotation / 2 * ratio], axis=-1)


def angle(q: Array) -> Array:
    """Return the rotation angles of unit quaternions, (...,) from 0 to pi [rad]."""
    return 2 * angle_of(np.linalg.norm(q[..., 1:], axis=-1), np.abs(q[..., 0]))


def rotated(q: Array, v: Array) -> Array:
    """Return vectors (..., 3) rotated by unit quaternions (..., 4)."""
    double = 2 * cross(q[..., 1:], v)
    return v + q[..., :1] * double + cross(q[..., 1:], double)


def product_by_parts(p: Array, q: Array) -> Array:
    """Return the product p q, (..., 4), like `multiplied`; each part is summed from left to right."""
    out = np.empty(np.broadcast_shapes(p.shape, q.shape))
    a, b, c, d = (p[..., i] for i in range(4))
    w, x, y, z = (q[..., i] for i in range(4))
    out[..., 0] = a * w - b * x - c * y - d * z
    out[..., 1] = a * x + b * w + c * z - d * y
    out[..., 2] = a * y - b * z + c * w + d * x
    out[..., 3] = a * z + b * y - c * x + d * w
    return out


def running_products(turns: Array, product_of: Callable[[Array, Array], Array] = multiplied) -> Array:
    """Return the products t_0, t_0 t_1, t_0 t_1 t_2, ... of quaternions (m, 4), by doubling: log2(m) multiplications."""
    out, reach = turns.copy(), 1
    while reach < len(out):
        out[reach:] = product_of(out[:-reach], out[reach:])
        reach *= 2
    return out / np.linalg.norm(out, axis=-1, keepdims=True)


def rate_matrices(omega: Array) -> Array:
    """Return matrices (..., 4, 4) that map a quaternion Q to the product Q (0, omega), for vectors omega (..., 3)."""
    x, y, z = np.moveaxis(omega, -1, 0)
    o = np.zeros_like(x)
    rows = [[o, -x, -y, -z], [x, o, z, -y], [y, -z, o, x], [z, y, -x, o]]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


# ---- Rotation matrices -----------------------------------------------------------------------------------------------


def matrix_of(q: Array) -> Array:
    """Return the rotation matrices (..., 3, 3) of unit quaternions (..., 4)."""
    return np.stack([rotated(q, axis) for axis in np.eye(3)], axis=-1)


def matrix_by_parts(q: Array) -> Array:
    """Return the rotation matrices (..., 3, 3) of unit quaternions (..., 4), like `matrix_of`; twice as fast."""
    out = np.empty((*q.shape[:-1], 3, 3))
    w, x, y, z = (q[..., i] for i in range(4))
    out[..., 0, 0], out[..., 0, 1], out[..., 0, 2] = 1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)
    out[..., 1, 0], out[..., 1, 1], out[..., 1, 2] = 2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)
    out[..., 2, 0], out[..., 2, 1], out[..., 2, 2] = 2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)
    return out


def quaternion_of(R: Array) -> Array:
    """Return the unit quaternion (4,) of a rotation matrix (3, 3), w not negative; Shepperd, Quaternion from matrix, 1978."""
    squares = np.array([np.trace(R), *np.diag(R)])
    i = int(np.argmax(squares))  # the largest part is the safe one to divide by
    if i == 0:
        q = np.array([1 + squares[0], R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    else:
        a, b, c = i - 1, i % 3, (i + 1) % 3
        q = np.empty(4)
        q[0] = R[c, b] - R[b, c]
        q[1 + a] = 1 + R[a, a] - R[b, b] - R[c, c]
        q[1 + b], q[1 + c] = R[a, b] + R[b, a], R[a, c] + R[c, a]
    q = q / length(q)
    return -q if q[0] < 0 else q


def rotation_from_rpy(rpy: ArrayLike) -> Array:
    """Return the rotation (3, 3) of URDF's roll, pitch, yaw [rad]: about the fixed x, then y, then z."""
    (sr, sp, sy), (cr, cp, cy) = sines(rpy)
    Rx = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    Ry = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    Rz = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
    return product(product(Rz, Ry), Rx)


# ---- Rotation vectors: axis times angle ------------------------------------------------------------------------------


def rotation_vectors(R: Array) -> Array:
    """Return axis times angle [rad] of rotations (..., 3, 3), (..., 3); angles up to pi."""
    skew: Array = 0.5 * np.stack(
        [R[..., 2, 1] - R[..., 1, 2], R[..., 0, 2] - R[..., 2, 0], R[..., 1, 0] - R[..., 0, 1]], axis=-1
    )
    cosine: Array = 0.5 * (R[..., 0, 0] + R[..., 1, 1] + R[..., 2, 2] - 1.0)
    out, turn, half = _scaled_to_angle(skew, cosine)
    if half.any():  # near pi the skew part vanishes: R + I is 2 a a^T with the axis a
        whole = R[half] + np.eye(3)
        longest = np.argmax(np.diagonal(whole, axis1=-2, axis2=-1), axis=-1)
        column = whole[np.arange(len(whole)), :, longest]
        out[half] = turn[half, None] * column / np.linalg.norm(column, axis=-1, keepdims=True)
    return out


def turns_between(a: Array, b: Array) -> Array:
    """Return axis times angle [rad] of the least turns from unit vectors a (k, 3) to a unit vector b (3,), (k, 3)."""
    out, turn, half = _scaled_to_angle(cross(a, b), product(a, b))
    if half.any():  # opposite directions: any axis across them serves
        across = cross(a[half], np.eye(3)[np.argmin(np.abs(b))])
        out[half] = turn[half, None] * across / np.linalg.norm(across, axis=-1, keepdims=True)
    return out


def _scaled_to_angle(axis: Array, cosine: Array) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Scale vectors, whose length is an angle's sine, to the angle; return them, the angle, and where it is too near pi."""
    sine = np.linalg.norm(axis, axis=-1)
    turn = angle_of(sine, cosine)
    small = sine < _SMALL_SINE
    scaled = axis * np.where(small, 1.0, turn / np.where(small, 1.0, sine))[..., None]
    return scaled, turn, small & (cosine < 0)
