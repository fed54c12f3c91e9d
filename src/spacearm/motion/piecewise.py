"""Piecewise polynomials by their Bernstein coefficients: p(x) = sum_i c_i C(d, i) x^i (1 - x)^(d - i) on [0, 1].

A polynomial stays in the hull of its coefficients. Cutting and multiplying use only weights that are not negative, so nothing
cancels (Farin, Curves and Surfaces for CAGD, 2002; Farouki, The Bernstein polynomial basis: a centennial retrospective, 2012).

`Curve` is what all checks ask of a path through joint space: samples, and bounds between samples that hold for every
parameter. `PiecewisePath` is a curve of any polynomials, which need not fit each other smoothly. Sampling is not
`scipy.interpolate.BPoly`'s, because samples and bounds are recorded: their bits must be the same on every processor
(docs/conventions.md).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from math import comb, perm
from typing import TYPE_CHECKING, Literal, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm.core.checks import Frozen, as_numbers, as_readonly, as_whole, shown
from spacearm.core.errors import ProblemError
from spacearm.core.exact import power, powers, product

Array = NDArray[np.float64]

_BISECTIONS = 3  # each piece is cut into 2^3 for its hulls
_LEVELS = 12  # halvings of a piece, at most, in search of close bounds
_MOST_PIECES = 4096  # that are halved at once, or as many as the curve has; more means that their values are all rounding
_AT_ONCE = 6  # halvings by one matrix
_MOST_DERIVATIVES = 100
_HIGHEST = 256  # degree; of higher ones finite coefficients may have values that are not finite
_DIGITS = 64 * np.finfo(np.float64).eps  # relative: smaller differences between pieces are rounding
_LEAST_SIZE = 1.0  # [rad or m] in that comparison: a joint near 0 has the rounding of larger numbers


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
    least, most = widest(low, high)
    return np.maximum(-least, most).clip(min=0.0)


def widest(low: Array, high: Array) -> tuple[Array, Array]:
    """Return the least of the lows and the greatest of the highs, (n,) each, of many rows (p, n)."""
    columns = np.ascontiguousarray(low.T), np.ascontiguousarray(high.T)  # several times quicker than along the first axis
    return columns[0].min(axis=1), columns[1].max(axis=1)


def extremes(curve: Curve, derivative: int, *, tolerance: float = 1e-4) -> tuple[Array, Array]:
    """Bound a derivative for every u, closely: pieces are halved where their hulls exceed the values at their middles.

    Args:
        curve: whose pieces may be many and of any degree.
        derivative: with respect to u.
        tolerance: by what share of the greatest size a bound may exceed the values that are reached.

    Returns:
        The least and the greatest value of each joint, (n,) each. They hold also where halving ended early.
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


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class PiecewisePath(Frozen):
    """A piecewise polynomial q(u); u is time [s] in a trajectory.

    Attributes:
        breaks: (p + 1,) where pieces begin and end, increasing.
        coefficients: (p, d + 1, n) Bernstein coefficients of each piece [rad or m].

    Raises:
        ProblemError: shapes that do not fit, a degree above 256, numbers that are not finite, or breaks that do not increase.
    """

    breaks: Array
    coefficients: Array

    if TYPE_CHECKING:

        def __init__(self, breaks: ArrayLike, coefficients: ArrayLike) -> None: ...

    def __post_init__(self) -> None:
        breaks = as_readonly("breaks", self.breaks, (None,), ProblemError)
        coefficients = as_readonly("coefficients", self.coefficients, (None, None, None), ProblemError)
        if len(breaks) < 2 or 0 in coefficients.shape or len(coefficients) != len(breaks) - 1:
            raise ProblemError(
                f"breaks has shape {breaks.shape} and coefficients {coefficients.shape}, "
                "expected (p + 1,) and (p, degree + 1, n)"
            )
        if coefficients.shape[1] - 1 > _HIGHEST:
            raise ProblemError(
                f"coefficients has polynomials of degree {coefficients.shape[1] - 1}, expected at most {_HIGHEST}; "
                "cut the path into more pieces of a lower one"
            )
        _require_increasing("breaks", breaks)
        object.__setattr__(self, "breaks", breaks)
        object.__setattr__(self, "coefficients", coefficients)

    @classmethod
    def from_linear(cls, t: ArrayLike, q: ArrayLike) -> PiecewisePath:
        """Join points by straight lines.

        Args:
            t: (m,) increasing [s].
            q: (m, n) [rad or m].

        Raises:
            ProblemError: shapes, numbers or times that do not fit.
        """
        t, q = _points(t, q)
        return cls(t, np.stack([q[:-1], q[1:]], axis=1))

    @classmethod
    def from_cubic(
        cls, t: ArrayLike, q: ArrayLike, dq: ArrayLike | None = None, *, ends: Literal["clamped", "natural"] = "clamped"
    ) -> PiecewisePath:
        """Join points by cubics: Hermite's where rates are given, else the spline with continuous accelerations.

        Args:
            t: (m,) increasing [s].
            q: (m, n) [rad or m].
            dq: (m, n) rates at the points; None: those of the spline.
            ends: of the spline: "clamped" (at rest) or "natural" (without acceleration).

        Raises:
            ProblemError: shapes, numbers or times that do not fit.
        """
        t, q = _points(t, q)
        if ends not in ("clamped", "natural"):
            raise ProblemError(f"ends is {shown(ends)}, expected 'clamped' (at rest) or 'natural' (without acceleration)")
        if dq is None:
            from scipy.interpolate import CubicSpline  # pyright: ignore[reportMissingTypeStubs]

            rates = CubicSpline(t, q, bc_type=ends)(t, 1)
            if ends == "clamped":
                rates[[0, -1]] = 0.0
        else:
            rates = as_readonly("dq", dq, q.shape, ProblemError)
        third = np.diff(t)[:, None] / 3
        return cls(t, np.stack([q[:-1], q[:-1] + third * rates[:-1], q[1:] - third * rates[1:], q[1:]], axis=1))

    @classmethod
    def from_quintic(cls, t: ArrayLike, q: ArrayLike, dq: ArrayLike, ddq: ArrayLike) -> PiecewisePath:
        """Join points by quintics with the given rates and accelerations, each (m, n).

        Raises:
            ProblemError: shapes, numbers or times that do not fit.
        """
        t, q = _points(t, q)
        v, a = (as_readonly(name, value, q.shape, ProblemError) for name, value in (("dq", dq), ("ddq", ddq)))
        h = np.diff(t)[:, None]
        points = [
            q[:-1],
            q[:-1] + h / 5 * v[:-1],
            q[:-1] + h * 2 / 5 * v[:-1] + h**2 / 20 * a[:-1],
            q[1:] - h * 2 / 5 * v[1:] + h**2 / 20 * a[1:],
            q[1:] - h / 5 * v[1:],
            q[1:],
        ]
        return cls(t, np.stack(points, axis=1))

    @property
    def dof(self) -> int:
        """Number of joints n."""
        return self.coefficients.shape[2]

    @property
    def degree(self) -> int:
        """The pieces' degree d."""
        return self.coefficients.shape[1] - 1

    @property
    def pieces(self) -> int:
        """Number of polynomial pieces p."""
        return len(self.coefficients)

    @property
    def domain(self) -> tuple[float, float]:
        """The first and the last break."""
        return float(self.breaks[0]), float(self.breaks[-1])

    def sample(self, u: ArrayLike, derivative: int = 0) -> Array:
        """Return q(u), or a derivative; where pieces disagree, that of the later piece.

        Args:
            u: (...,); beyond the domain, the ends.
            derivative: 0 or more.

        Returns:
            (..., n).
        """
        derivative = as_whole("derivative", derivative, ProblemError, at_least=0, at_most=_MOST_DERIVATIVES)
        at = np.clip(as_numbers("u", u, ProblemError), *self.domain)
        flat = at.ravel()
        piece = np.clip(np.searchsorted(self.breaks, flat, side="right") - 1, 0, self.pieces - 1)
        length = self.breaks[piece + 1] - self.breaks[piece]
        points = self._derived(derivative)
        rows = weights(points.shape[1] - 1, (flat - self.breaks[piece]) / length)
        return np.einsum("mb,mbn->mn", rows, points[piece]).reshape(*at.shape, self.dof)

    def hulls(
        self, derivative: int, *, bisections: int = _BISECTIONS, pieces: NDArray[np.int64] | None = None
    ) -> tuple[Array, Array, Array]:
        """Bound a derivative on every piece, for *every* u of it, by the hull of its Bernstein coefficients.

        Args:
            derivative: 0 or more.
            bisections: how often the path's own pieces are halved first; each quarters the bounds' excess.
            pieces: (p,) indices of those wanted, of `self.pieces` 2^bisections; None: all.

        Returns:
            The pieces' ends (p, 2), and the least and greatest values on each, (p, n).
        """
        parts = 1 << bisections
        points = self._derived(derivative)
        if pieces is None:
            ours, part = np.divmod(np.arange(self.pieces * parts), parts)
            every = halvings(points.shape[1] - 1, bisections).reshape(-1, points.shape[1])
            cut = product(every, points).reshape(-1, *points.shape[1:])
        else:
            ours, part = np.divmod(np.asarray(pieces), parts)
            cut, left = points[ours], bisections
            while left:
                now = min(left, _AT_ONCE)
                left -= now
                cut = product(halvings(points.shape[1] - 1, now)[(part >> left) % (1 << now)], cut)
        ends = self._ends(ours, part, parts)
        cut = np.ascontiguousarray(cut.swapaxes(0, 1))  # the first axis is the quickest to reduce, five times
        return ends, cut.min(axis=0), cut.max(axis=0)

    def bezier(self, derivative: int = 0) -> Array:
        """Return a derivative's Bernstein coefficients on each piece, (p, degree + 1, n)."""
        return self._derived(derivative)

    def derivative(self, order: int = 1) -> PiecewisePath:
        """Return a derivative as a path of its own, whose pieces need not meet."""
        return PiecewisePath(self.breaks, self._derived(order))

    def jumps(self, derivative: int) -> Array:
        """Return by how much a derivative jumps at each inner break, (p - 1, n); 0 where the jump is only rounding.

        Rounding is measured joint by joint, by the joint's own numbers in the two pieces that meet.
        """
        jump = self._steps(derivative)
        return np.where(np.abs(jump) > self._rounding(np.abs(self.coefficients).max(axis=1), derivative), jump, 0.0)

    def slips(self, derivative: int) -> Array:
        """Return what those jumps of a derivative that `jumps` takes for rounding add at most to the next derivative, (n,).

        Each counts as made within the shorter of the two pieces that meet, because many such jumps in a row are a slope.
        """
        jump = self._steps(derivative)
        small = np.where(self.jumps(derivative) == 0, np.abs(jump), 0.0)
        lengths = np.diff(self.breaks)
        return (small / np.minimum(lengths[1:], lengths[:-1])[:, None]).max(axis=0, initial=0.0)

    def joined(self) -> PiecewisePath:
        """Return the path with every piece beginning exactly where the one before it ends.

        Only jumps that may be rounding are closed. They are measured by the largest number of any joint in the two pieces that
        meet, because joints that were computed together share their rounding. The path then moves by what was closed, so its
        rates change too. Larger jumps stay.
        """
        jump = self._steps(0)
        whole = np.abs(self.coefficients).max(axis=(1, 2), keepdims=True)[:, 0]
        small = (jump != 0) & (np.abs(jump) <= self._rounding(whole, 0))
        if not small.any():
            return self
        coefficients = self.coefficients.copy()
        if self.degree == 0:  # a constant has one coefficient for both of its ends
            coefficients = np.repeat(coefficients, 2, axis=1)
        coefficients[1:, 0] = np.where(small, self.coefficients[:-1, -1], self.coefficients[1:, 0])
        return PiecewisePath(self.breaks, coefficients)

    def _steps(self, derivative: int) -> Array:
        """Return the first value of each piece but one, less the last value of the piece before, (p - 1, n)."""
        points = self._derived(derivative)
        with np.errstate(invalid="ignore"):
            return points[1:, 0] - points[:-1, -1]

    def _rounding(self, size: Array, derivative: int) -> Array:
        """Return what rounding may make of a derivative's jumps where numbers are so large, (p, n) or (p, 1)."""
        scale = _DIGITS * 2**derivative * perm(self.degree, derivative)
        with np.errstate(over="ignore"):
            rounding = scale * np.maximum(size, _LEAST_SIZE) / power(np.diff(self.breaks), derivative)[:, None]
        return np.maximum(rounding[1:], rounding[:-1])

    def _derived(self, derivative: int) -> Array:
        """Return the coefficients of a derivative."""
        if not derivative:
            return self.coefficients
        with np.errstate(over="ignore", invalid="ignore"):  # infinite values break every limit
            return differences(self.coefficients, derivative) / power(np.diff(self.breaks), derivative)[:, None, None]

    def _ends(self, piece: NDArray[np.int64], part: NDArray[np.int64], parts: int) -> Array:
        """Return where parts of pieces begin and end; the pieces' own ends are exactly the breaks."""
        share = (part[:, None] + np.arange(2)) / parts
        begin, end = self.breaks[piece, None], self.breaks[piece + 1, None]
        return np.where(share == 1, end, begin + share * (end - begin))


def _points(t: ArrayLike, q: ArrayLike) -> tuple[Array, Array]:
    """Check times and the points at them."""
    times, points = as_readonly("t", t, (None,), ProblemError), as_readonly("q", q, (None, None), ProblemError)
    if len(times) < 2 or len(points) != len(times) or not points.shape[1]:
        raise ProblemError(f"t has shape {times.shape} and q {points.shape}, expected (m,) and (m, n) with two points or more")
    _require_increasing("t", times)
    return times, points


def _require_increasing(name: str, values: Array) -> None:
    still = np.diff(values) <= 0
    if still.any():
        i = int(np.argmax(still))
        raise ProblemError(f"{name}[{i + 1}] is {values[i + 1]:.9g} after {values[i]:.9g}, expected increasing values")


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
    count = 1 << bisections
    ends = np.arange(count + 1) / count
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
