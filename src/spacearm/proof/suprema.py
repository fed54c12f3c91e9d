"""Close upper bounds of polynomials on panels, for every point: samples, and by how much more there may be between.

With xi = cos(theta) a polynomial is a sum of c_j cos(j theta): smooth for all theta, and stationary where it is greatest. So
its greatest value exceeds the nearest of samples that are d apart in theta by no more than d^2 / 8 times a bound of its second
derivative. Where that is too much the samples are taken closer, around those that may be near the greatest.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_FINER = 16
_LOOKS = 5
_ROWS = 200_000  # at once, beyond which nothing is looked at more closely
_OUTWARD = 1 + 1e-12


def greatest_norm(coefficients: Array, scale: Array, extra: Array, *, close: float = 2e-6) -> float:
    """Bound scale times the norm of vector polynomials, plus extra, over all panels and all their points.

    Args:
        coefficients: (p, d + 1, c) Chebyshev coefficients.
        scale, extra: (p,) of each panel, 0 or more.
        close: by what share the bound may exceed a value that is reached; it holds even where that was not to be had.
    """
    count = coefficients.shape[1]
    sizes, j = np.linalg.norm(coefficients, axis=2), np.arange(float(count))
    first, second = sizes @ j, sizes @ j**2
    curved = 2 * (first**2 + sizes.sum(axis=1) * second)  # |d^2 |f|^2 / d theta^2| at most
    step = np.pi / (2 * count)
    values = _on_grid(count) @ coefficients
    squared = np.einsum("pgc,pgc->pg", values, values).ravel()
    panel = np.repeat(np.arange(len(curved)), 2 * count)
    theta = np.tile(_grid(count), len(curved))
    bound = reached = 0.0
    for look in range(_LOOKS):
        if look:
            step /= _FINER
            panel = np.repeat(panel, _FINER)
            theta = (theta[:, None] + (np.arange(_FINER) - (_FINER - 1) / 2) * step).ravel()
            values = np.einsum("rd,rdc->rc", np.cos(theta[:, None] * j), coefficients[panel])
            squared = np.einsum("rc,rc->r", values, values)
        value = scale[panel] * np.sqrt(squared) + extra[panel]
        above = scale[panel] * np.sqrt(squared + curved[panel] * step**2 / 8) + extra[panel]
        reached, most = max(reached, float(value.max())), float(above.max())
        passed = reached * (1 + close / 2)  # what is left out below is no greater
        near = above > passed
        if most <= reached * (1 + close) or look == _LOOKS - 1 or near.sum() * _FINER > _ROWS:
            return max(bound, most) * _OUTWARD
        bound = max(bound, passed)
        panel, theta = panel[near], theta[near]
    return bound


def _grid(count: int) -> Array:
    return (np.arange(2 * count) + 0.5) * np.pi / (2 * count)


@lru_cache(maxsize=32)
def _on_grid(count: int) -> Array:
    """Map Chebyshev coefficients to values on the grid, (2 count, count)."""
    out = np.cos(np.outer(_grid(count), np.arange(count)))
    out.setflags(write=False)
    return out
