"""Stretches of a curve, and how far it strays on each from the straight line through its middle.

A stretch is a run of the curve's own pieces, or a part of one piece. On each, for every u,

    |q(u) - q(m) - w (u - m)| <= drift,    |u - m| <= h,

joint by joint, with m the middle and w a rate. On a part of a piece w is q'(m), and the drift is h^2/2 times the greatest
|q''| by the piece's hull (Taylor); on a run of pieces, between which q' may jump, w is the middle of all rates that occur, by
their hulls, and the drift is h times half their width.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spacearm.motion import Curve

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

_AT_FIRST = 12  # stretches to begin with, at least
_EPS = float(np.finfo(np.float64).eps)
_ROUNDING = 64 * _EPS  # of a sample of the curve, relative to the greatest of its coefficients, joint by joint
_PER_DEGREE = 4 * _EPS  # the same, more for every degree of the polynomials
_JOINT = 64 * _EPS  # between two pieces, likewise; what PiecewisePath takes for no jump


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Stretches:
    """So many stretches r.

    Attributes:
        first, last: (r,) the pieces first to last - 1.
        ends: (r, 2) where they begin and end.
        share: (r,) of the curve, all its pieces counting alike.
    """

    first: Indices
    last: Indices
    ends: Array
    share: Array

    def __len__(self) -> int:
        """Return how many there are."""
        return len(self.first)

    def some(self, which: Indices) -> Stretches:
        """Return some of them."""
        return Stretches(first=self.first[which], last=self.last[which], ends=self.ends[which], share=self.share[which])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Lines:
    """The straight lines through the middles of stretches.

    Attributes:
        u: (r,) the middles.
        h: (r,) half the lengths.
        q, rate: (r, n) there.
        drift: (r, n) how far the curve strays.
    """

    u: Array
    h: Array
    q: Array
    rate: Array
    drift: Array


class Spans:
    """A curve's pieces, cut until there are enough to begin with, and bounds on each."""

    def __init__(self, curve: Curve) -> None:
        self._curve = curve
        bisections = 0
        while curve.pieces << bisections < _AT_FIRST:
            bisections += 1
        self._ends, self._least_rate, self._greatest_rate = curve.hulls(1, bisections=bisections)
        _, low, high = curve.hulls(2, bisections=bisections)
        self._bend = np.maximum(-low, high)  # (p, n)
        self._reach = np.maximum(-self._least_rate, self._greatest_rate)  # (p, n)
        _, low, high = curve.hulls(0, bisections=0)  # the coefficients themselves: what is between may be far smaller
        self._size = np.maximum(1.0, np.maximum(-low, high).max(axis=0))  # (n,)
        self._rounding = _ROUNDING + _PER_DEGREE * curve.degree

    def first(self) -> Stretches:
        """Return stretches that make up the whole curve."""
        pieces = len(self._ends)
        cuts = np.unique(np.linspace(0, pieces, min(pieces, 2 * _AT_FIRST) + 1).astype(np.intp))
        return self._runs(cuts[:-1], cuts[1:])

    def halved(self, of: Stretches) -> Stretches:
        """Return two for each: a run of pieces is parted between two of them, a part of a piece in its middle."""
        run = of.last - of.first > 1
        between = (of.first + of.last) // 2
        middle = np.where(run, self._ends[np.minimum(between, len(self._ends) - 1), 0], of.ends.mean(axis=1))
        first = np.stack([of.first, np.where(run, between, of.first)], axis=1).ravel()
        last = np.stack([np.where(run, between, of.last), of.last], axis=1).ravel()
        return Stretches(
            first=first,
            last=last,
            ends=np.stack([of.ends[:, 0], middle, middle, of.ends[:, 1]], axis=1).reshape(-1, 2),
            share=np.where(np.repeat(run, 2), (last - first) / len(self._ends), np.repeat(of.share, 2) / 2),
        )

    def lines(self, of: Stretches) -> Lines:
        """Return the straight lines, and the drifts for every u of the stretches."""
        u = of.ends.mean(axis=1)
        h = (np.diff(of.ends, axis=1)[:, 0] / 2 + 2 * _EPS * np.abs(of.ends).max(axis=1))[:, None]
        rate, bend = self._curve.sample(u, 1), self._bend[of.first]
        drift = bend * h**2 / 2
        reach = self._reach[of.first]
        # A part of a piece so short that its middle is one of its ends is bounded as a run is: q' there may be another's.
        inside = (u > of.ends[:, 0]) & (u < of.ends[:, 1])
        for i in np.flatnonzero((of.last - of.first > 1) | ~inside):
            low = self._least_rate[of.first[i] : of.last[i]].min(axis=0)
            high = self._greatest_rate[of.first[i] : of.last[i]].max(axis=0)
            rate[i], drift[i] = (low + high) / 2, (high - low) / 2 * h[i]
            reach[i] = np.maximum(-low, high)
        joints = _JOINT * np.maximum(0, of.last - of.first - 1)[:, None] * self._size
        rounding = joints + self._rounding * (self._size + reach * h + drift)
        return Lines(u=u, h=h[:, 0], q=self._curve.sample(u), rate=rate, drift=drift + rounding)

    def _runs(self, first: Indices, last: Indices) -> Stretches:
        ends = np.stack([self._ends[first, 0], self._ends[last - 1, 1]], axis=1)
        return Stretches(first=first, last=last, ends=ends, share=(last - first) / len(self._ends))
