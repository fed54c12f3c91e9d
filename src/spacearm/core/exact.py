"""Arithmetic whose bits depend on no processor: what is recorded is computed with it.

NumPy's own sines, powers and products of matrices are quicker on long arrays, but a newer processor gives them other last
digits. `+`, `-`, `*`, `/` and square roots are the same everywhere, NumPy's too; so are sums, and `einsum` without `optimize`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm.core.native import native

Array = NDArray[np.float64]


def product(a: ArrayLike, b: ArrayLike) -> Array:
    """Return a @ b, whose sums run from the first term to the last.

    Args:
        a: (..., m, k) or (k,).
        b: (..., k, n) with the same leading axes or none; or (k,).
    """
    left, right = np.asarray(a, dtype=np.float64), np.asarray(b, dtype=np.float64)
    if right.ndim == 1:
        return product(left, right[:, None])[..., 0]
    if left.ndim == 1:
        return product(left[None], right)[..., 0, :]
    m, k = left.shape[-2:]
    if right.ndim == 2:  # one for all rows
        rows = native.product(np.ascontiguousarray(left.reshape(1, -1, k)), np.ascontiguousarray(right[None]))
        return rows.reshape(*left.shape[:-1], right.shape[1])
    lead = left.shape[:-2]
    if right.shape[:-2] != lead:
        lead = np.broadcast_shapes(lead, right.shape[:-2])
        left, right = np.broadcast_to(left, (*lead, m, k)), np.broadcast_to(right, (*lead, *right.shape[-2:]))
    n = right.shape[-1]
    out = native.product(np.ascontiguousarray(left.reshape(-1, m, k)), np.ascontiguousarray(right.reshape(-1, k, n)))
    return out.reshape(*lead, m, n)


def sines(x: ArrayLike) -> tuple[Array, Array]:
    """Return sin x and cos x, each (...,), right to 2e-15 for x up to 1e4 [rad]."""
    angles = np.asarray(x, dtype=np.float64)
    sine, cosine = native.sines(np.ascontiguousarray(angles.ravel()))
    return sine.reshape(angles.shape), cosine.reshape(angles.shape)


def angle_of(y: ArrayLike, x: ArrayLike) -> Array:
    """Return the angle of the vectors (x, y), (...,) from -pi to pi, as `arctan2` does; right to 1e-15 [rad]."""
    up, along = np.broadcast_arrays(np.asarray(y, dtype=np.float64), np.asarray(x, dtype=np.float64))
    return native.angles(np.ascontiguousarray(up.ravel()), np.ascontiguousarray(along.ravel())).reshape(up.shape)


def root(x: ArrayLike, degree: int) -> Array:
    """Return the square or cube root, (...,), of numbers that are not negative; `degree` 1 returns them."""
    values = np.asarray(x, dtype=np.float64)
    if degree == 3:
        return native.cube_roots(np.ascontiguousarray(values.ravel())).reshape(values.shape)
    return np.sqrt(values) if degree == 2 else values


def powers(x: ArrayLike, most: int) -> Array:
    """Return x^0, x^1, ... up to x^most, (..., most + 1), each of the one before it."""
    values = np.asarray(x, dtype=np.float64)
    out = np.ones((*values.shape, most + 1))
    for i in range(most):
        out[..., i + 1] = out[..., i] * values
    return out


def power(x: ArrayLike, exponent: int) -> Array:
    """Return x^exponent, (...,), for a whole exponent of 0 or more."""
    return powers(x, exponent)[..., exponent]


def length(v: ArrayLike) -> float:
    """Return the length of one vector (n,); `norm` without an axis asks a BLAS for it."""
    values = np.asarray(v, dtype=np.float64)
    return float(np.sqrt((values * values).sum()))


def cross(a: Array, b: Array) -> Array:
    """Return a x b, (..., 3); several times faster than NumPy's for many small vectors."""
    out = np.empty(np.broadcast_shapes(a.shape, b.shape))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        out[..., i] = a[..., j] * b[..., k] - a[..., k] * b[..., j]
    return out


def solved3(A: Array, b: Array) -> Array:
    """Solve A x = b for matrices (..., 3, 3) that are far from singular and vectors (..., 3), by Cramer's rule."""
    c0, c1, c2 = A[..., :, 0], A[..., :, 1], A[..., :, 2]
    across = cross(c1, c2)
    determinant = dot(c0, across)
    parts = [dot(b, across), dot(c0, cross(b, c2)), dot(c0, cross(c1, b))]
    return np.stack(parts, axis=-1) / determinant[..., None]


def inverse3(A: Array) -> Array:
    """Return the inverses of matrices (..., 3, 3) that are far from singular."""
    return np.stack([solved3(A, np.broadcast_to(axis, A.shape[:-1])) for axis in np.eye(3)], axis=-1)


def dot(a: Array, b: Array) -> Array:
    """Return a . b of vectors (..., 3)."""
    return a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1] + a[..., 2] * b[..., 2]
