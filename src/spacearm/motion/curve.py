"""What a path is to those who check it: samples, and bounds between samples that hold for every parameter."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

_LEVELS = 12  # of halvings
_MOST_PIECES = 4096  # to be halved, or as many as the curve has: more are numbers that are all rounding


class Curve(Protocol):
    """A piecewise polynomial q(u) through joint space, whatever u is: a spline's s in [0, 1], or time [s]."""

    @property
    def dof(self) -> int:
        """Number of joints n."""
        ...

    @property
    def degree(self) -> int:
        """Of its pieces."""
        ...

    @property
    def pieces(self) -> int:
        """Number of its own polynomial pieces."""
        ...

    @property
    def domain(self) -> tuple[float, float]:
        """Where u begins and ends."""
        ...

    def sample(self, u: ArrayLike, /, derivative: int = 0) -> Array:
        """Return q(u), or a derivative with respect to u, (..., n); beyond the domain, what holds at its ends."""
        ...

    def hulls(
        self, derivative: int, *, bisections: int = ..., pieces: NDArray[np.int64] | None = None
    ) -> tuple[Array, Array, Array]:
        """Bound a derivative on every piece, for *every* u of it.

        Args:
            derivative: with respect to u.
            bisections: how often the curve's own pieces are halved first.
            pieces: (p,) indices of those wanted, of `self.pieces` 2^bisections in order of u; None: all.

        Returns:
            The pieces' ends (p, 2), and the least and greatest values on each, (p, n).
        """
        ...

    def bezier(self, derivative: int = ..., /) -> Array:
        """Return a derivative's Bernstein coefficients on each of the curve's own pieces, (pieces, degree + 1, n)."""
        ...


def greatest(curve: Curve, derivative: int) -> Array:
    """Return a bound (n,) of |d^k q / du^k| that holds for every u, by the curve's hulls."""
    _, low, high = curve.hulls(derivative)
    return np.maximum(-low.min(axis=0), high.max(axis=0)).clip(min=0.0)


def extremes(curve: Curve, derivative: int, *, tolerance: float = 1e-4) -> tuple[Array, Array]:
    """Bound a derivative for every u, closely: pieces are halved where their hulls exceed what is reached.

    Args:
        curve: whose pieces may be many and of any degree.
        derivative: with respect to u.
        tolerance: by what share of its greatest size a bound may exceed what is reached.

    Returns:
        The least and the greatest value of each joint, (n,) each; they hold even where halving was given up.
    """
    pieces = np.arange(curve.pieces)
    least, most = np.full(curve.dof, np.inf), np.full(curve.dof, -np.inf)  # reached
    lowest, highest = least.copy(), most.copy()  # bounds, of the pieces done with
    for level in range(_LEVELS + 1):
        ends, low, high = curve.hulls(derivative, bisections=level, pieces=pieces)
        reached = curve.sample(ends.mean(axis=1), derivative)
        least, most = np.minimum(least, reached.min(axis=0)), np.maximum(most, reached.max(axis=0))
        allowed = tolerance * np.maximum(np.abs(least), np.abs(most))
        undecided = ((low < least - allowed) | (high > most + allowed)).any(axis=1)
        last = level == _LEVELS or undecided.sum() > max(_MOST_PIECES, curve.pieces)
        done = slice(None) if last else ~undecided
        lowest = np.minimum(lowest, low[done].min(axis=0, initial=np.inf))
        highest = np.maximum(highest, high[done].max(axis=0, initial=-np.inf))
        if last or not undecided.any():
            break
        pieces = (2 * pieces[undecided, None] + np.arange(2)).ravel()
    return lowest, highest
