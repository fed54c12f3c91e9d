"""Turns in space: unit quaternions wxyz, rotation vectors, and products of many turns in order."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm.core.checks import as_readonly
from spacearm.core.errors import ProblemError
from spacearm.core.exact import angle_of, length, product, sines

Array = NDArray[np.float64]

_SMALL = 1e-4  # [rad]; below, sin(x)/x by its series is right to the last digit


def cross(a: Array, b: Array) -> Array:
    """Return a x b, (..., 3); several times quicker than NumPy's for many small vectors."""
    out = np.empty(np.broadcast_shapes(a.shape, b.shape))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        out[..., i] = a[..., j] * b[..., k] - a[..., k] * b[..., j]
    return out


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
    """Return p q, (..., 4): the turn q, then p, both in fixed axes; or p, then q about the axes that p has turned."""
    w = p[..., :1] * q[..., :1] - (p[..., 1:] * q[..., 1:]).sum(axis=-1, keepdims=True)
    v = p[..., :1] * q[..., 1:] + q[..., :1] * p[..., 1:] + cross(p[..., 1:], q[..., 1:])
    return np.concatenate([w, v], axis=-1)


def conjugate(q: Array) -> Array:
    """Return the opposite turn of unit quaternions, (..., 4)."""
    return q * np.array([1.0, -1.0, -1.0, -1.0])


def exponential(rotation: Array) -> Array:
    """Return the unit quaternion (..., 4) of a rotation vector (..., 3) [rad]."""
    half = np.linalg.norm(rotation, axis=-1, keepdims=True) / 2
    sine, cosine = sines(half)
    small = half < _SMALL
    # sin(x)/x -> 1 - x^2/6 as x -> 0, where the quotient has no value
    ratio = np.where(small, 1 - half * half / 6, sine / np.where(small, 1.0, half))
    return np.concatenate([cosine, rotation / 2 * ratio], axis=-1)


def angle(q: Array) -> Array:
    """Return by how much unit quaternions turn, (...,) from 0 to pi [rad]."""
    return 2 * angle_of(np.linalg.norm(q[..., 1:], axis=-1), np.abs(q[..., 0]))


def rotated(q: Array, v: Array) -> Array:
    """Return vectors (..., 3) turned by unit quaternions (..., 4)."""
    double = 2 * cross(q[..., 1:], v)
    return v + q[..., :1] * double + cross(q[..., 1:], double)


def matrix_of(q: Array) -> Array:
    """Return the rotation matrices (..., 3, 3) of unit quaternions (..., 4)."""
    return np.stack([rotated(q, axis) for axis in np.eye(3)], axis=-1)


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


def running_products(turns: Array) -> Array:
    """Return the products t_0, t_0 t_1, t_0 t_1 t_2, ... of quaternions (m, 4), by doubling: log2(m) multiplications."""
    out, reach = turns.copy(), 1
    while reach < len(out):
        out[reach:] = multiplied(out[:-reach], out[reach:])
        reach *= 2
    return out / np.linalg.norm(out, axis=-1, keepdims=True)


# ---- Rotations as files state them -----------------------------------------------------------------------------------


def rotation_from_rpy(rpy: Any) -> Array:
    """Return the rotation (3, 3) of URDF's roll, pitch, yaw [rad]: about the fixed x, then y, then z."""
    (sr, sp, sy), (cr, cp, cy) = sines(rpy)
    Rx = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    Ry = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    Rz = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
    return product(product(Rz, Ry), Rx)


# ---- Rotations as vectors: axis times angle --------------------------------------------------------------------------


def rotation_vectors(R: Array) -> Array:
    """Return axis times angle [rad] of rotations (..., 3, 3), (..., 3); angles up to pi."""
    skew: Array = 0.5 * np.stack(
        [R[..., 2, 1] - R[..., 1, 2], R[..., 0, 2] - R[..., 2, 0], R[..., 1, 0] - R[..., 0, 1]], axis=-1
    )
    sine = np.linalg.norm(skew, axis=-1)
    cosine = 0.5 * (R[..., 0, 0] + R[..., 1, 1] + R[..., 2, 2] - 1.0)
    angle = angle_of(sine, cosine)
    small = sine < 1e-8
    out = skew * np.where(small, 1.0, angle / np.where(small, 1.0, sine))[..., None]
    half = small & (cosine < 0)
    if half.any():  # by pi the skew part is gone: R + I is 2 a a^T
        whole = R[half] + np.eye(3)
        longest = np.argmax(np.diagonal(whole, axis1=-2, axis2=-1), axis=-1)
        column = whole[np.arange(len(whole)), :, longest]
        out[half] = angle[half, None] * column / np.linalg.norm(column, axis=-1, keepdims=True)
    return out


def turns_between(a: Array, b: Array) -> Array:
    """Return axis times angle [rad] of the least turns from directions a (k, 3) to a direction b (3,), (k, 3)."""
    cross = np.cross(a, b)
    sine, cosine = np.linalg.norm(cross, axis=-1), product(a, b)
    angle = angle_of(sine, cosine)
    small = sine < 1e-8
    out: Array = cross * np.where(small, 1.0, angle / np.where(small, 1.0, sine))[:, None]
    half = small & (cosine < 0)
    if half.any():  # opposite: about any axis across
        across = np.cross(a[half], np.eye(3)[np.argmin(np.abs(b))])
        out[half] = angle[half, None] * across / np.linalg.norm(across, axis=-1, keepdims=True)
    return out


# ---- Cross products of many vectors ----------------------------------------------------------------------------------
