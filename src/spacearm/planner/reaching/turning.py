"""Rotations as vectors: axis times angle."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from spacearm._kernel.exact import angle_of, product

Array = NDArray[np.float64]


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
