"""Motions: clamped quintic B-splines in joint space, over s in [0, 1].

The first three control points of the spline are the start, the last three the goal, and those between are free. So every
motion starts and ends with zero velocity and acceleration, and is C4 between. It stays in the convex hull of its control
points. Each of its derivatives stays, piece by piece, in the hull of its Bezier points. With no interior control point it is
the quintic 10 s^3 - 15 s^4 + 6 s^5.

The knots are uniform. Cox-de Boor recursion as in Piegl and Tiller, The NURBS Book, 1997. It is not SciPy's `BSpline`, because
motions are recorded: their bits must be the same on every processor (docs/conventions.md).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm.core.checks import Frozen, as_numbers, as_readonly, as_whole
from spacearm.core.errors import ProblemError
from spacearm.core.exact import product
from spacearm.core.native import native

Array = NDArray[np.float64]

DEGREE = 5
REPEATED = 3  # control points at each end that are equal: no velocity and no acceleration there
_MOST_POINTS = 514  # control points: 512 of the search's, and the ends
_BATCH = 16  # motions at once, so that their Bezier points fit into the cache
_BISECTIONS = 5  # each piece is cut into 2^5 for its hulls: bounds within 0.1 % of the true extremes of the quintic


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Motion(Frozen):
    """A path through joint space, smooth and at rest at both ends.

    Attributes:
        control_points: (K + 2, n) start, K interior points, goal [rad or m]. Two of them make the quintic.

    Raises:
        ProblemError: fewer than two points or more than 514, or numbers that are not finite.
    """

    control_points: Array

    if TYPE_CHECKING:  # the constructor takes more types than the fields have

        def __init__(self, control_points: ArrayLike) -> None: ...

    def __post_init__(self) -> None:
        points = as_readonly("control_points", self.control_points, (None, None), ProblemError)
        if len(points) > _MOST_POINTS:
            raise ProblemError(
                f"control_points has {len(points)} points, expected at most {_MOST_POINTS}: a path through more points is a "
                "PiecewisePath, as in RecordedTrajectory(robot, PiecewisePath.from_cubic(t, q))"
            )
        if len(points) < 2 or not points.shape[1]:
            raise ProblemError(
                f"control_points has shape {points.shape}, expected (K + 2, n): the start, K interior points, the goal"
            )
        object.__setattr__(self, "control_points", points)

    @property
    def dof(self) -> int:
        """Number of joints n."""
        return self.control_points.shape[1]

    @property
    def interior(self) -> int:
        """Number of interior control points K."""
        return len(self.control_points) - 2

    @property
    def degree(self) -> int:
        """The pieces' degree: 5."""
        return DEGREE

    @property
    def pieces(self) -> int:
        """Number of polynomial pieces, K + 1."""
        return self.interior + 1

    @property
    def domain(self) -> tuple[float, float]:
        """Where s begins and ends."""
        return 0.0, 1.0

    def sample(self, s: ArrayLike, derivative: int = 0) -> Array:
        """Return q(s), or a derivative with respect to s.

        Args:
            s: (...,) in [0, 1]; beyond, the ends.
            derivative: 0 to 5.

        Returns:
            (..., n) [rad or m].
        """
        derivative = as_whole("derivative", derivative, ProblemError, at_least=0, at_most=DEGREE)
        at = np.minimum(np.maximum(as_numbers("s", s, ProblemError), 0.0), 1.0)  # five times quicker than np.clip for few s
        rows = product(basis(at.ravel(), self.interior, derivative=derivative), self._moved(derivative))
        return rows.reshape(*at.shape, self.dof)

    def derivatives(self, s: Array, most: int) -> list[Array]:
        """Return q(s) and its derivatives up to `most`, each (m, n), for s (m,); the same bits as `sample`, in one go."""
        at = np.minimum(np.maximum(s, 0.0), 1.0)
        falling = cox_de_boor_to(at, _knots(self.interior), DEGREE, most)
        columns = (_differences(self.interior, derivative) for derivative in range(most + 1))
        return [product(product(rows, of), self._moved(k)) for k, (rows, of) in enumerate(zip(falling, columns, strict=True))]

    def moved(self, s: Array) -> tuple[Array, Array]:
        """Return q(s) and dq/ds, each (m, n), for s (m,); beyond [0, 1], the ends.

        As `sample` does, up to rounding of the rates, and several times quicker: the kernel computes the basis.
        """
        at = np.ascontiguousarray(np.minimum(np.maximum(s, 0.0), 1.0))
        q, rate = (product(native.spline_values(at, self.interior, d), self._moved(d)) for d in range(2))
        return q, rate

    def length(self, samples: int = 513) -> float:
        """Return the joint path length, the integral of |dq/ds| [rad or m], by the trapezoidal rule."""
        as_whole("samples", samples, ProblemError, at_least=2, at_most=1_000_000)
        speed = np.linalg.norm(product(_even_rates(self.interior, samples), self._moved(1)), axis=1)
        return float((speed.sum() - (speed[0] + speed[-1]) / 2) / (samples - 1))

    def hulls(
        self, derivative: int, *, bisections: int = _BISECTIONS, pieces: NDArray[np.int64] | None = None
    ) -> tuple[Array, Array, Array]:
        """Bound a derivative on every piece, for *every* s of it, by the hull of its Bezier points.

        Args:
            derivative: 0 to 3.
            bisections: how often the spline's own pieces are halved first; each quarters the bounds' excess.
            pieces: (p,) indices of those wanted, of (K + 1) 2^bisections; None: all.

        Returns:
            The pieces' ends (p, 2), and the least and greatest values on each, (p, n) [rad or m].
        """
        moved = self._moved(derivative)
        if pieces is None:
            ends, matrix = _all_hulls(self.interior, derivative, bisections)
            points = product(matrix, moved[_all_six(self.interior)]).reshape(len(ends), -1, self.dof)
        else:
            indices = np.asarray(pieces)
            ends, matrix = _hull_matrix(self.interior, derivative, bisections, indices)
            points = product(matrix, moved[_six(indices >> bisections, self.interior)])
        points = np.ascontiguousarray(points.swapaxes(0, 1))  # the first axis is the quickest to reduce, five times
        return ends, points.min(axis=0), points.max(axis=0)

    def bezier(self, derivative: int = 0) -> Array:
        """Return the Bezier points of each polynomial piece of a derivative, (K + 1, 6 - derivative, n)."""
        matrix = _all_hulls(self.interior, derivative, 0)[1]
        return product(matrix, self._moved(derivative)[_all_six(self.interior)])

    def _moved(self, derivative: int) -> Array:
        """Return the control points; for a derivative relative to the start, so that a joint at rest has exactly 0."""
        return self.control_points - self.control_points[0] if derivative else self.control_points


def greatest_entries(control_points: Array, derivative: int, *, bisections: int = _BISECTIONS) -> Array:
    """Bound the entries of a derivative of many motions, for every s, by the hulls of their Bezier points.

    Args:
        control_points: (m, K + 2, n) of each motion.
        derivative: 0 to 5.
        bisections: how often the spline's own pieces are halved first.

    Returns:
        (m,) no |d^k q_i / ds^k| of any joint i is greater.
    """
    count = control_points.shape[1]
    _, matrix = _all_hulls(count - 2, derivative, bisections)
    six = _all_six(count - 2)
    moved = control_points - control_points[:, :1] if derivative else control_points
    if len(moved) == 1:
        return np.abs(product(matrix, moved[0][six])).max(initial=0.0)[None]
    out = np.zeros(len(moved))
    for i in range(0, len(moved), _BATCH):
        some = moved[i : i + _BATCH]
        rows = some.swapaxes(0, 1)[six].reshape(*six.shape, -1)
        values = product(matrix, rows).reshape(-1, rows.shape[-1])
        out[i : i + _BATCH] = np.maximum(values.max(axis=0), -values.min(axis=0)).reshape(len(some), -1).max(axis=1)
    return out


def basis(s: Array, interior: int, *, derivative: int = 0) -> Array:
    """Return what each control point contributes to q(s) or a derivative of it.

    Args:
        s: (m,) in [0, 1].
        interior: number of interior control points K.
        derivative: 0 to 5, with respect to s.

    Returns:
        (m, K + 2); the repeated ends are summed.
    """
    degree = DEGREE - derivative
    columns = _differences(interior, derivative)
    knots = _knots(interior)[derivative : len(_knots(interior)) - derivative]
    return product(cox_de_boor(np.asarray(s, dtype=np.float64), knots, degree), columns)


@lru_cache(maxsize=16)
def _even_rates(interior: int, samples: int) -> Array:
    """Return `basis` of the first derivative at evenly spaced samples."""
    rows = basis(np.linspace(0.0, 1.0, samples), interior, derivative=1)
    rows.setflags(write=False)
    return rows


@lru_cache(maxsize=64)
def _knots(interior: int) -> Array:
    inner = np.arange(1, interior + 1) / (interior + 1)
    knots = np.concatenate([np.zeros(DEGREE + 1), inner, np.ones(DEGREE + 1)])
    knots.setflags(write=False)
    return knots


@lru_cache(maxsize=64)
def _differences(interior: int, derivative: int) -> Array:
    """Map the control points to the control points of a derivative."""
    count = interior + 2 * REPEATED
    columns = np.zeros((count, interior + 2))
    columns[:REPEATED, 0] = 1
    columns[REPEATED : count - REPEATED, 1:-1] = np.eye(interior)
    columns[count - REPEATED :, -1] = 1
    knots, degree = _knots(interior), DEGREE
    for _ in range(derivative):
        spans = knots[degree + 1 : -1] - knots[1 : -(degree + 1)]
        columns = degree * np.diff(columns, axis=0) / spans[:, None]
        knots, degree = knots[1:-1], degree - 1
    columns.setflags(write=False)
    return columns


def cox_de_boor(s: Array, knots: Array, degree: int) -> Array:
    """Return the B-spline basis functions at s, (m, number of control points).

    Args:
        s: (m,).
        knots: never falling, each end degree + 1 times.
        degree: 0 or more.
    """
    return cox_de_boor_to(s, knots, degree, 0)[0]


def cox_de_boor_to(s: Array, knots: Array, degree: int, fewer: int) -> list[Array]:
    """Return the basis functions at s of this degree and of `fewer` lower ones, each (m, number of control points).

    Those of a lower degree are on the knots without the first and the last one, or two, ...: the basis of derivatives.
    """
    count = len(knots) - degree - 1
    span = np.minimum(np.maximum(np.searchsorted(knots, s, side="right") - 1, degree), count - 1)
    near = knots[span + np.arange(1 - degree, degree + 1)[:, None]]  # (2 degree, m): the first axis is quickest to go along
    after, before = near[degree:] - s, s - near[:degree]
    values, found, row = np.ones((1, len(s))), list[Array](), np.arange(len(s))
    for d in range(degree + 1):
        if d:
            share = values / (near[degree : degree + d] - near[degree - d : degree])
            values = np.empty((d + 1, len(s)))
            np.multiply(share, after[:d], out=values[:-1])
            values[-1] = 0.0
            values[1:] += share * before[degree - d :]
        if d >= degree - fewer:
            out = np.zeros((len(s), count - degree + d))
            out[row, span + np.arange(-degree, d - degree + 1)[:, None]] = values
            found.append(out)
    return found[::-1]


@lru_cache(maxsize=64)
def _all_hulls(interior: int, derivative: int, bisections: int) -> tuple[Array, Array]:
    """Return `_hull_matrix` of all pieces, those of a piece of the spline's own together: (K + 1, ..., 6)."""
    ends, matrix = _hull_matrix(interior, derivative, bisections, np.arange((interior + 1) << bisections))
    matrix = matrix.reshape(interior + 1, -1, matrix.shape[2])
    for array in (ends, matrix):
        array.setflags(write=False)
    return ends, matrix


@lru_cache(maxsize=64)
def _all_six(interior: int) -> NDArray[np.int64]:
    """Return `_six` of all pieces of the spline's own."""
    six = _six(np.arange(interior + 1), interior)
    six.setflags(write=False)
    return six


def _six(spans: NDArray[np.int64], interior: int) -> NDArray[np.int64]:
    """Return the control points that count on some of the spline's own pieces, (p, 6), fewer if there are no six."""
    width = min(DEGREE + 1, interior + 2)
    first = np.clip(spans - (REPEATED - 1), 0, interior + 2 - width)
    return first[:, None] + np.arange(width)


def _hull_matrix(interior: int, derivative: int, bisections: int, pieces: NDArray[np.int64]) -> tuple[Array, Array]:
    """Map the control points of `_six` to the Bezier points of some pieces of a derivative: (p, degree + 1, 6).

    Bezier point j of a piece is the derivative's blossom at degree - j times its begin and j times its end.
    """
    degree = DEGREE - derivative
    ends = (pieces[:, None] + np.arange(2)) / ((interior + 1) * (1 << bisections))
    knots, columns = _knots(interior)[derivative : interior + 12 - derivative], _differences(interior, derivative)
    spans = pieces >> bisections
    six, span = _six(spans, interior), degree + spans
    values = [columns[(span + np.arange(-degree, 1)[:, None])[..., None], six]]  # (degree + 1, p, 6)
    for turn in range(1, degree + 1):
        i = np.arange(turn, degree + 1)[:, None]
        low, high = knots[span - degree + i], knots[span + 1 + i - turn]
        at_begin, at_end = (((ends[:, k] - low) / (high - low))[..., None] for k in range(2))
        # Those that have taken fewer ends than turns take the begin from now on; only one takes ends all the time.
        values = [*(_averaged(points, at_begin) for points in values), _averaged(values[-1], at_end)]
    return ends, np.stack([points[0] for points in values], axis=1)


def _averaged(points: Array, share: Array) -> Array:
    """Return averages of neighbours along the first axis: a step of de Boor's towards the polar form of spline pieces."""
    return (1 - share) * points[:-1] + share * points[1:]
