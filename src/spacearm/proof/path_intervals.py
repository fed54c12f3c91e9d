"""Intervals of a path, and straight lines through their midpoints with bounds of how far the joints deviate from them.

An interval is a run of consecutive pieces of the curve, or a part of one piece. On each, for every u and for each joint,

    |q(u) - q(m) - w (u - m)| <= e,    |u - m| <= h

with the midpoint m, a rate w and a deviation e. On a part of a piece, w is q'(m) and e is h^2/2 times the greatest |q''| by the
hull of the piece (Taylor). On a run of pieces q' may jump between them. There w is the centre of all rates that occur, by their
hulls, and e is h times half their range. docs/certificate.md, section 4, has the proofs.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spacearm.motion import Curve

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

_LEAST_PIECES = 12  # pieces that a curve is cut into, at least
_EPS = float(np.finfo(np.float64).eps)
_SAMPLE_ROUNDING = 64 * _EPS  # times the greatest coefficient of a joint: the rounding of its samples and rates
_ROUNDING_PER_DEGREE = 4 * _EPS  # likewise, in addition for every degree of the polynomials
_JOIN_ROUNDING = 64 * _EPS  # likewise, for each join of two pieces: what PiecewisePath takes for no jump


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Intervals:
    """r intervals of a curve.

    Attributes:
        first, last: (r,) its pieces are first to last - 1.
        ends: (r, 2) where they begin and end, in u.
        share: (r,) of the curve, if all its pieces count alike.
    """

    first: Indices
    last: Indices
    ends: Array
    share: Array

    def __len__(self) -> int:
        """Return r."""
        return len(self.first)

    def select(self, which: Indices) -> Intervals:
        """Return some of them."""
        return Intervals(first=self.first[which], last=self.last[which], ends=self.ends[which], share=self.share[which])

    def followed_by(self, other: Intervals) -> Intervals:
        """Return these intervals and then others."""
        return Intervals(
            first=np.concatenate([self.first, other.first]),
            last=np.concatenate([self.last, other.last]),
            ends=np.concatenate([self.ends, other.ends]),
            share=np.concatenate([self.share, other.share]),
        )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LinearBounds:
    """Straight lines through the midpoints of intervals, and how far the curve deviates from them.

    Attributes:
        u: (r,) the midpoints m.
        half: (r,) half the lengths h.
        q, rate: (r, n) the configuration and the rate w there.
        deviation: (r, n) e, for every u of the interval.
    """

    u: Array
    half: Array
    q: Array
    rate: Array
    deviation: Array


class PathIntervals:
    """A curve's pieces, cut until there are a few, and bounds of the joints' motion on intervals.

    Attributes:
        curve: the path.
        ends: (p, 2) where the pieces begin and end, in u.
        least_rate, greatest_rate: (p, n) bounds of q' on them.
        second, speed: (p, n) the greatest |q''| and |q'| on them.
        size: (n,) the greatest coefficients of the joints, at least 1, to which rounding is relative.
        rounding: of a sample, relative to them.
    """

    def __init__(self, curve: Curve) -> None:
        self.curve = curve
        bisections = 0
        while curve.pieces << bisections < _LEAST_PIECES:
            bisections += 1
        self.ends, self.least_rate, self.greatest_rate = curve.hulls(1, bisections=bisections)
        _, low, high = curve.hulls(2, bisections=bisections)
        self.second = np.maximum(-low, high)  # (p, n) the greatest |q''|
        self.speed = np.maximum(-self.least_rate, self.greatest_rate)  # (p, n) the greatest |q'|
        _, low, high = curve.hulls(0, bisections=0)  # the coefficients themselves: values between them may be far smaller
        self.size = np.maximum(1.0, np.maximum(-low, high).max(axis=0))  # (n,)
        self.rounding = _SAMPLE_ROUNDING + _ROUNDING_PER_DEGREE * curve.degree

    def whole(self) -> Intervals:
        """Return one interval, which is the whole curve."""
        count = len(self.ends)
        ends = np.array([[self.ends[0, 0], self.ends[-1, 1]]])
        return Intervals(first=np.zeros(1, np.intp), last=np.full(1, count), ends=ends, share=np.ones(1))

    def halved(self, of: Intervals) -> Intervals:
        """Return two for each: a run of pieces is divided between two of them, a part of a piece at its midpoint."""
        run, between = of.last - of.first > 1, (of.first + of.last) // 2
        middle = np.where(run, self.ends[np.minimum(between, len(self.ends) - 1), 0], (of.ends[:, 0] + of.ends[:, 1]) / 2)
        first, last, ends = np.repeat(of.first, 2), np.repeat(of.last, 2), np.repeat(of.ends, 2, axis=0)
        first[1::2], last[::2] = np.where(run, between, of.first), np.where(run, between, of.last)
        ends[::2, 1] = ends[1::2, 0] = middle
        share = np.where(np.repeat(run, 2), (last - first) / len(self.ends), np.repeat(of.share / 2, 2))
        return Intervals(first=first, last=last, ends=ends, share=share)

    def linear_bounds(self, of: Intervals) -> LinearBounds:
        """Return the straight lines, and the deviations for every u of the intervals."""
        begin, end = of.ends.T
        u = (begin + end) / 2
        half = ((end - begin) / 2 + 2 * _EPS * np.maximum(np.abs(begin), np.abs(end)))[:, None]
        rate, second = self.curve.sample(u, 1), self.second[of.first]
        deviation = second * half**2 / 2
        speed = self.speed[of.first]
        # A part of a piece so short that its midpoint is one of its ends is bounded like a run: q' there may be of another.
        runs = np.flatnonzero((of.last - of.first > 1) | ~((u > begin) & (u < end)))
        if runs.size:
            low = _of_runs(np.minimum, self.least_rate, of.first[runs], of.last[runs])
            high = _of_runs(np.maximum, self.greatest_rate, of.first[runs], of.last[runs])
            rate[runs], deviation[runs] = (low + high) / 2, (high - low) / 2 * half[runs]
            speed[runs] = np.maximum(-low, high)
        joins = _JOIN_ROUNDING * np.maximum(0, of.last - of.first - 1)[:, None] * self.size
        rounding = joins + self.rounding * (self.size + speed * half + deviation)
        return LinearBounds(u=u, half=half[:, 0], q=self.curve.sample(u), rate=rate, deviation=deviation + rounding)


def _of_runs(least_or_greatest: np.ufunc, values: Array, first: Indices, last: Indices) -> Array:
    """Return the least or greatest values (r, n) of the rows first to last - 1 of values (p, n)."""
    ends = np.stack([first, last], axis=1).ravel()
    return least_or_greatest.reduceat(np.concatenate([values, values[-1:]]), ends, axis=0)[::2]
