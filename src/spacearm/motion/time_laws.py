"""The time law: where on its path a motion is at each share of its duration."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import reduce
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm.core.checks import Frozen, as_numbers, as_readonly
from spacearm.core.errors import ProblemError
from spacearm.core.exact import power, product
from spacearm.motion.piecewise import PiecewisePath, after, cuts, times, weights
from spacearm.motion.spline import DEGREE, Motion, cox_de_boor

Array = NDArray[np.float64]

_SLIVER = 1e-5  # in pieces of the spline: no cut so near to a knot, whose two polynomials differ by the fifth power of it
_HIGHEST = 50  # degree: the motion over time has five times that
_STEEPEST = 1e8  # ds/dx: steeper, a share of the time has no digits to say where on the path it is
_SAME_TIME = 4 * float(np.finfo(np.float64).eps)
_SHORTEST = 1e-8  # in shorter pieces rounding would hide corners
_HALVINGS = 54
_ROUNDING = 1e-14


@dataclass(frozen=True, slots=True, eq=False)
class TimeLaw(Frozen):
    """A law s(x), x = t/T in [0, 1]: a piecewise polynomial that rises from 0 to 1 without a corner.

    It need not begin or end at rest, for motions do.

    Attributes:
        breaks: (m + 1,) from 0 to 1, increasing.
        coefficients: (m, d + 1) Bernstein coefficients of each piece, never falling.

    Raises:
        ProblemError: a law that falls, jumps, has a corner, or does not run from 0 to 1.
    """

    breaks: Array
    coefficients: Array

    if TYPE_CHECKING:

        def __init__(self, breaks: ArrayLike, coefficients: ArrayLike) -> None: ...

    def __post_init__(self) -> None:
        coefficients = as_readonly("coefficients", self.coefficients, (None, None), ProblemError)
        path = PiecewisePath(self.breaks, coefficients[:, :, None])
        if path.domain != (0.0, 1.0):
            raise ProblemError(
                f"breaks runs from {path.domain[0]:g} to {path.domain[1]:g}, expected 0 to 1: shares of the duration"
            )
        if path.degree > _HIGHEST:
            raise ProblemError(f"the time law has pieces of degree {path.degree}, expected at most {_HIGHEST}; cut it finer")
        shortest = float(np.diff(path.breaks).min())
        if shortest < _SHORTEST:
            raise ProblemError(f"the time law has a piece of {shortest:.3g} of the duration, expected {_SHORTEST:g} or more")
        if (coefficients[0, 0], coefficients[-1, -1]) != (0.0, 1.0):
            raise ProblemError(
                f"the time law runs from {coefficients[0, 0]:.6g} to {coefficients[-1, -1]:.6g}, "
                "expected 0 to 1: the whole motion"
            )
        if (np.diff(coefficients, axis=1) < -_ROUNDING).any():
            raise ProblemError("the time law's coefficients fall within a piece, expected a law that never turns back")
        steepest = float(path.hulls(1, bisections=0)[2].max())
        if steepest > _STEEPEST:
            raise ProblemError(
                f"the time law runs at up to {steepest:.3g} times its mean pace, expected at most {_STEEPEST:g}; "
                "make it less steep"
            )
        for derivative, what in enumerate(("jumps", "has a corner")):
            if path.jumps(derivative).any():
                worst = int(np.argmax(np.abs(path.jumps(derivative))))
                raise ProblemError(
                    f"the time law {what} at {path.breaks[worst + 1]:.6g} of the duration, expected one without: "
                    "no arm can follow it"
                )
        object.__setattr__(self, "breaks", path.breaks)
        object.__setattr__(self, "coefficients", _readonly(path.joined().coefficients[:, :, 0]))

    @classmethod
    def uniform(cls) -> TimeLaw:
        """Return s = x."""
        return cls([0.0, 1.0], [[0.0, 1.0]])

    @property
    def path(self) -> PiecewisePath:
        """The law as a path of one joint."""
        return PiecewisePath(self.breaks, self.coefficients[:, :, None])

    def sample(self, x: ArrayLike, derivative: int = 0) -> Array:
        """Return s, or a derivative with respect to x; beyond [0, 1], the ends.

        Args:
            x: (...,) share of the duration.
            derivative: 0 or more.

        Returns:
            (...,).
        """
        return self.path.sample(x, derivative)[..., 0]

    def inverse(self, s: ArrayLike) -> Array:
        """Return at which share x of the duration s is reached, (...,); s in [0, 1]."""
        wanted = np.clip(as_numbers("s", s, ProblemError), 0.0, 1.0)
        starts, degree = self.coefficients[:, 0], self.coefficients.shape[1] - 1
        piece = np.clip(np.searchsorted(starts, wanted, side="right") - 1, 0, len(starts) - 1)
        points = self.coefficients[piece]
        low, high = np.zeros_like(wanted), np.ones_like(wanted)
        for _ in range(_HALVINGS):
            middle = (low + high) / 2
            above = (weights(degree, middle) * points).sum(axis=-1) >= wanted
            low, high = np.where(above, low, middle), np.where(above, middle, high)
        x = self.breaks[piece] + high * (self.breaks[piece + 1] - self.breaks[piece])
        return np.where(wanted >= 1, 1.0, np.where(wanted <= 0, 0.0, x))


def over_time(motion: Motion, law: TimeLaw, duration: float, derivative: int = 0) -> PiecewisePath:
    """Return q(s(t/T)), or a derivative with respect to t, as a polynomial in t on each piece.

    The derivatives are composed by the chain rule rather than differentiated, so that short pieces cost no digits.

    Args:
        motion: q(s), of degree 5.
        law: s(x), of degree d.
        duration: T [s], above 0.
        derivative: 0 to 3.

    Returns:
        A path over [0, T] of degree 5 d - derivative, which need not be continuous where the law's derivatives are not.
    """
    x, piece, cut = _cut_at_knots(motion, law)
    degree = law.coefficients.shape[1] - 1
    s = np.einsum("pkl,pl->pk", cut(degree), law.coefficients[piece])
    span = np.clip(((s[:, 0] + s[:, -1]) / 2 * motion.pieces).astype(np.int64), 0, motion.interior)
    local = s * motion.pieces - span[:, None]  # from 0 to 1 on the spline's own piece

    def rate(k: int) -> Array:
        """The k-th derivative of s."""
        path = law.path.derivative(k)
        return np.einsum("pkl,pl->pk", cut(path.degree), path.coefficients[piece, :, 0])

    def term(k: int, *factors: Array) -> Array:
        """The k-th derivative of q at s(x), times polynomials of x."""
        factor = reduce(times, factors, np.ones((len(s), 1)))
        rows = times(np.moveaxis(after(DEGREE - k, local), 2, 1), factor[:, None, :])  # (p, 6 - k, degree + 1)
        return product(rows.swapaxes(1, 2), motion.bezier(k)[span])

    if derivative == 0:
        points = term(0)
        points[1:, 0] = points[:-1, -1]  # the same up to rounding
    elif derivative == 1:
        points = term(1, rate(1))
    elif derivative == 2:
        points = term(2, rate(1), rate(1))
        points = points + term(1, rate(2)) if degree >= 2 else points
    else:
        points = term(3, rate(1), rate(1), rate(1))
        points = points + 3 * term(2, rate(1), rate(2)) if degree >= 2 else points
        points = points + term(1, rate(3)) if degree >= 3 else points
    return PiecewisePath(x * duration, points / power(duration, derivative))


def _cut_at_knots(motion: Motion, law: TimeLaw) -> tuple[Array, NDArray[np.int64], Callable[[int], Array]]:
    """Cut the law's pieces where it passes the spline's knots.

    Returns:
        The ends (p + 1,) of what results; (p,) which piece of the law each is; and for a degree the cuts (p, d + 1, d + 1).
    """
    knots = np.arange(1, motion.pieces) / motion.pieces
    # By its place on the path a knot is where the law has a break, or not: in an instant of time a steep law passes many.
    at_breaks = np.append(law.coefficients[:, 0], law.coefficients[-1, -1])
    near = np.abs(knots[:, None] - at_breaks).min(axis=1, initial=1.0) * motion.pieces
    between = law.inverse(knots[near > _SLIVER])
    between = between[np.abs(between[:, None] - law.breaks).min(axis=1, initial=1.0) > _SAME_TIME]
    x = np.unique(np.concatenate([law.breaks, between]))
    piece = np.searchsorted(law.breaks, x[:-1], side="right") - 1
    origin, length = law.breaks[piece], np.diff(law.breaks)[piece]
    begin, end = (x[:-1] - origin) / length, np.minimum((x[1:] - origin) / length, 1.0)
    return x, piece, lambda degree: cuts(degree, begin, end)


def _readonly(array: Array) -> Array:
    array = np.ascontiguousarray(array)
    array.setflags(write=False)
    return array


# ---- -----------------------------------------------------------------------------------------------------------------
# Time laws with continuous acceleration: cubic B-splines s(x) over [0, 1], by their knots and control points.
#
# Control points that never fall make a law that never turns back. De Boor, A Practical Guide to Splines, 2001.


_DEGREE = 3


def abscissae(knots: Array) -> Array:
    """Return where each control point has its say, (m + 3,): with these as control points s = x.

    Args:
        knots: (m + 1,) increasing, each once.
    """
    all_knots = _repeated(knots, _DEGREE)
    return np.array([all_knots[i + 1 : i + _DEGREE + 1].mean() for i in range(len(knots) + _DEGREE - 1)])


def cubic_basis(knots: Array, x: Array, derivative: int = 0) -> Array:
    """Return what each control point contributes to s(x) or a derivative, (len(x), m + 3)."""
    columns = np.eye(len(knots) + _DEGREE - 1)
    all_knots = _repeated(knots, _DEGREE)
    for degree in range(_DEGREE, _DEGREE - derivative, -1):
        columns = degree * np.diff(columns, axis=0) / (all_knots[degree + 1 : -1] - all_knots[1 : -degree - 1])[:, None]
        all_knots = all_knots[1:-1]
    return product(cox_de_boor(x, all_knots, _DEGREE - derivative), columns)


def cubic_law(knots: Array, points: Array) -> TimeLaw:
    """Return the time law of knots (m + 1,) from 0 to 1 and control points (m + 3,) that rise from 0 to 1."""
    coefficients = bezier_points(knots, points)
    coefficients[1:, 0] = coefficients[:-1, -1]
    coefficients[0, 0], coefficients[-1, -1] = 0.0, 1.0
    return TimeLaw(knots, coefficients)


def bezier_points(knots: Array, points: Array) -> Array:
    """Return the Bernstein coefficients of each piece of a law, (m, 4)."""
    ends, piece = (knots[:-1], knots[1:]), np.arange(len(knots) - 1)
    return np.stack(
        [_blossom(knots, points, piece, [ends[k < later] for k in range(_DEGREE)]) for later in range(_DEGREE + 1)], axis=1
    )


def _blossom(knots: Array, points: Array, piece: NDArray[np.intp], arguments: list[Array]) -> Array:
    """Return the polar form of pieces (k,) at three arguments, each (k,), by de Boor's averages."""
    all_knots = _repeated(knots, _DEGREE)
    values = [points[piece + i] for i in range(_DEGREE + 1)]
    for turn, x in enumerate(arguments, start=1):
        for i in range(_DEGREE, turn - 1, -1):
            low, high = all_knots[piece + i], all_knots[piece + i + _DEGREE + 1 - turn]
            values[i] = ((high - x) * values[i - 1] + (x - low) * values[i]) / (high - low)
    return values[-1]


def halved(knots: Array, points: Array) -> tuple[Array, Array]:
    """Return the same law with a knot more in the middle of each piece."""
    finer = np.sort(np.concatenate([knots, (knots[1:] + knots[:-1]) / 2]))
    # A control point is the polar form, at its three knots, of any piece that it has a say in.
    piece = np.clip(np.searchsorted(knots, abscissae(finer), side="right") - 1, 0, len(knots) - 2)
    repeated = _repeated(finer, _DEGREE)
    return finer, _blossom(knots, points, piece, [repeated[1 + i : 1 + i + len(piece)] for i in range(_DEGREE)])


def _repeated(knots: Array, degree: int) -> Array:
    return np.concatenate([np.repeat(knots[0], degree), knots, np.repeat(knots[-1], degree)])
