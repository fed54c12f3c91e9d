"""Polynomials by their Bernstein coefficients on [0, 1]: p(x) = sum_i c_i C(d, i) x^i (1 - x)^(d - i).

A polynomial stays in the hull of its coefficients, and cutting and multiplying take only weights that are not
negative, so nothing cancels. Farin, Curves and Surfaces for CAGD, 2002; Farouki, The Bernstein polynomial basis: a
centennial retrospective, 2012.
"""

from __future__ import annotations

from functools import lru_cache
from math import comb

import numpy as np
from numpy.typing import NDArray

from spacearm._kernel.exact import powers

Array = NDArray[np.float64]


@lru_cache(maxsize=64)
def binomials(degree: int) -> Array:
    """Return C(d, i) for i = 0 to d."""
    return _fixed(np.array([comb(degree, i) for i in range(degree + 1)], dtype=np.float64))


def weights(degree: int, x: Array) -> Array:
    """Return the Bernstein polynomials at x, (..., d + 1)."""
    x = np.asarray(x, dtype=np.float64)
    return binomials(degree) * powers(x, degree) * powers(1 - x, degree)[..., ::-1]


def differences(coefficients: Array, derivative: int) -> Array:
    """Return the coefficients of a derivative with respect to x, the degree axis being the last but one."""
    for _ in range(derivative):
        degree = coefficients.shape[-2] - 1
        if degree == 0:
            return np.zeros_like(coefficients)
        coefficients = degree * np.diff(coefficients, axis=-2)
    return coefficients


def cuts(degree: int, begin: Array, end: Array) -> Array:
    """Map coefficients on [0, 1] to those on [begin, end] within it.

    Coefficient k on the part is the polynomial's blossom at d - k times `begin` and k times `end`.

    Args:
        degree: of the polynomial.
        begin, end: (p,) in [0, 1].

    Returns:
        (p, d + 1, d + 1); the rows are not negative and sum to 1.
    """
    first = [weights(k, begin) for k in range(degree + 1)]
    last = [weights(k, end) for k in range(degree + 1)]
    out = np.zeros((len(begin), degree + 1, degree + 1))
    for k in range(degree + 1):
        for i in range(k + 1):
            out[:, k, i : i + degree - k + 1] += last[k][:, i, None] * first[degree - k]
    return out


@lru_cache(maxsize=64)
def halvings(degree: int, bisections: int) -> Array:
    """Return the cuts of [0, 1] into 2^b equal parts, (2^b, d + 1, d + 1)."""
    ends = np.arange(2**bisections + 1) / 2**bisections
    return _fixed(cuts(degree, ends[:-1], ends[1:]))


def times(a: Array, b: Array) -> Array:
    """Multiply polynomials, the degree axis being the last: (..., d + 1), (..., e + 1) -> (..., d + e + 1)."""
    d, e = a.shape[-1] - 1, b.shape[-1] - 1
    a, b = a * binomials(d), b * binomials(e)
    out = np.zeros((*np.broadcast_shapes(a.shape[:-1], b.shape[:-1]), d + e + 1))
    for i in range(e + 1):
        out[..., i : i + d + 1] += a * b[..., i : i + 1]
    return out / binomials(d + e)


def after(degree: int, inner: Array) -> Array:
    """Return the Bernstein polynomials of another polynomial: what composing with it asks for.

    Args:
        degree: d of the outer polynomial.
        inner: (..., e + 1) coefficients of x(t), whose values lie in [0, 1].

    Returns:
        (..., d e + 1, d + 1): times the outer coefficients, those of the composition.
    """
    power, opposite = [np.ones((*inner.shape[:-1], 1))], [np.ones((*inner.shape[:-1], 1))]
    for _ in range(degree):
        power.append(times(power[-1], inner))
        opposite.append(times(opposite[-1], 1 - inner))
    columns = [comb(degree, i) * times(power[i], opposite[degree - i]) for i in range(degree + 1)]
    return np.stack(columns, axis=-1)


def _fixed(array: Array) -> Array:
    array.setflags(write=False)
    return array
