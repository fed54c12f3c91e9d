"""Time laws: where on its path a motion is at each share of its duration, and motions over time.

Motions run by a time law are composed exactly, as polynomials over time, so that limits can be checked for every t.
"""

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
from spacearm.motion.spline import DEGREE, Motion

Array = NDArray[np.float64]

_SLIVER = 1e-5  # in pieces of the spline: a law's break so near to a knot counts as at it; the error is its fifth power
_HIGHEST = 50  # degree; the motion over time has five times that
_STEEPEST = 1e8  # ds/dx; in a steeper law float64 cannot tell the time of two places on the path apart
_SAME_TIME = 4 * float(np.finfo(np.float64).eps)  # of the duration
_SHORTEST = 1e-8  # of the duration; in shorter pieces rounding would hide corners
_HALVINGS = 54  # of a bisection in [0, 1], to the last bit of float64
_ROUNDING = 1e-14  # by which coefficients may fall


@dataclass(frozen=True, slots=True, eq=False, repr=False)
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

    Derivatives are composed by the chain rule and not differentiated, because differences lose digits in short pieces.

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
    # Knots and breaks are compared by their place on the path, because a steep law passes many knots in a short time.
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
