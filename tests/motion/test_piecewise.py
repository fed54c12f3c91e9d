"""Piecewise paths: SciPy's polynomials, hulls that hold, and jumps told from rounding."""

from __future__ import annotations

import pickle
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.interpolate import BPoly, CubicHermiteSpline, CubicSpline

from spacearm.core.errors import ProblemError
from spacearm.motion import Motion, PiecewisePath
from spacearm.motion.piecewise import Curve, after, binomials, cuts, extremes, greatest, times, weights
from support.drawn_motions import is_continuous
from support.messages import assert_refused

ROUNDING = 1e-12  # of the numbers' size, degree 5 and pieces of a tenth at the least
NUMBERS = st.one_of(st.sampled_from([0.0, 1.0, -1.0]), st.floats(-10, 10, allow_subnormal=False))
UNIT = np.linspace(0, 1, 33)


@st.composite
def breaks(draw: st.DrawFn, most: int = 5) -> np.ndarray:
    steps = draw(st.lists(st.floats(0.1, 2.0), min_size=1, max_size=most))
    return draw(st.floats(-3, 3)) + np.concatenate([[0.0], np.cumsum(steps)])


@st.composite
def paths(draw: st.DrawFn, degree: int | None = None) -> PiecewisePath:
    """Of any pieces, which need not meet."""
    u, n = draw(breaks()), draw(st.integers(1, 3))
    d = draw(st.integers(0, 5)) if degree is None else degree
    shape = (len(u) - 1, d + 1, n)
    points = draw(st.lists(NUMBERS, min_size=int(np.prod(shape)), max_size=int(np.prod(shape))))
    return PiecewisePath(u, np.reshape(points, shape))


@st.composite
def points(draw: st.DrawFn, rows: int = 1) -> tuple[np.ndarray, ...]:
    """Times (m,), and so many tables (m, n)."""
    t, n = draw(breaks()), draw(st.integers(1, 3))
    size = len(t) * n
    tables = [draw(st.lists(NUMBERS, min_size=size, max_size=size)) for _ in range(rows)]
    return t - t[0], *(np.reshape(table, (-1, n)) for table in tables)


def scipy_path(path: PiecewisePath) -> BPoly:
    return BPoly(np.moveaxis(path.coefficients, 1, 0), path.breaks)


def size_of(path: PiecewisePath, derivative: int) -> float:
    """The scale of a derivative's numbers."""
    scale = (2 * max(path.degree, 1) / np.diff(path.breaks).min()) ** derivative
    return float(np.abs(path.coefficients).max()) * scale + 1e-300


def inside(path: PiecewisePath) -> np.ndarray:
    """Instants of every piece, (p, 31), its ends left out, for there pieces may disagree."""
    return path.breaks[:-1, None] + UNIT[1:-1] * np.diff(path.breaks)[:, None]


@given(paths(), st.integers(0, 4))
def test_values_and_derivatives_are_scipys(path: PiecewisePath, derivative: int) -> None:
    u = inside(path)
    known = derivative <= path.degree  # SciPy knows no derivatives beyond
    expected = scipy_path(path)(u, nu=derivative) if known else np.zeros((*u.shape, path.dof))
    np.testing.assert_allclose(path.sample(u, derivative), expected, rtol=0, atol=ROUNDING * size_of(path, derivative))
    np.testing.assert_array_equal(path.derivative(derivative).sample(u), path.sample(u, derivative))


@given(paths())
def test_beyond_the_ends_it_is_what_it_is_there(path: PiecewisePath) -> None:
    begin, end = path.domain
    beyond = path.sample([begin - 1, end + 7])
    np.testing.assert_array_equal(beyond, [path.coefficients[0, 0], path.coefficients[-1, -1]])


@given(paths(), st.integers(0, 3), st.integers(0, 8), st.data())
def test_hulls_contain_every_sample_of_their_piece(
    path: PiecewisePath, derivative: int, bisections: int, data: st.DataObject
) -> None:
    count = path.pieces * 2**bisections
    some = np.array(data.draw(st.lists(st.integers(0, count - 1), min_size=1, max_size=8)))
    ends, low, high = path.hulls(derivative, bisections=bisections, pieces=some)
    assert ends.shape == (len(some), 2)
    assert low.shape == high.shape == (len(some), path.dof)
    # Which piece an instant at a break belongs to is seen from within.
    u = ends[:, :1] + UNIT[1:-1] * np.diff(ends, axis=1)
    values = path.sample(u, derivative)
    slack = ROUNDING * size_of(path, derivative)
    assert (values >= low[:, None] - slack).all()
    assert (values <= high[:, None] + slack).all()
    if bisections <= 4:
        for whole, part in zip(path.hulls(derivative, bisections=bisections), (ends, low, high), strict=True):
            np.testing.assert_allclose(part, whole[some], rtol=0, atol=slack)


@given(paths(), st.integers(0, 5))
def test_hulls_lie_end_to_end(path: PiecewisePath, bisections: int) -> None:
    ends, _, _ = path.hulls(0, bisections=bisections)
    assert len(ends) == path.pieces * 2**bisections
    np.testing.assert_array_equal(ends[1:, 0], ends[:-1, 1])
    assert (ends[0, 0], ends[-1, 1]) == path.domain
    np.testing.assert_array_equal(ends[:: 2**bisections, 0], path.breaks[:-1])


@given(paths(), st.integers(0, 3))
def test_extremes_hold_and_are_close(path: PiecewisePath, derivative: int) -> None:
    low, high = extremes(path, derivative)
    dense = path.breaks[:-1, None] + np.linspace(1e-9, 1 - 1e-9, 4001) * np.diff(path.breaks)[:, None]
    values = path.sample(dense, derivative).reshape(-1, path.dof)
    slack = ROUNDING * size_of(path, derivative)
    assert (values >= low - slack).all()
    assert (values <= high + slack).all()
    reached = np.abs(values).max(axis=0)
    assert (np.maximum(-low, high) <= reached * (1 + 3e-4) + slack).all()


@given(st.integers(0, 6), st.data())
def test_cuts_take_no_negative_weights_and_are_the_polynomial_on_a_part(degree: int, data: st.DataObject) -> None:
    begin, end = sorted(data.draw(st.lists(st.floats(0, 1), min_size=2, max_size=2)))
    matrix = cuts(degree, np.array([begin]), np.array([end]))[0]
    assert (matrix >= 0).all()
    np.testing.assert_allclose(matrix.sum(axis=1), 1, atol=1e-14)
    whole = weights(degree, begin + UNIT * (end - begin))
    np.testing.assert_allclose(weights(degree, UNIT) @ matrix, whole, rtol=0, atol=1e-14)


@given(st.lists(NUMBERS, min_size=1, max_size=5), st.lists(NUMBERS, min_size=1, max_size=5))
def test_a_product_has_the_values_product(a: list[float], b: list[float]) -> None:
    values = [weights(len(c) - 1, UNIT) @ c for c in (a, b)]
    product = times(np.array(a), np.array(b))
    np.testing.assert_allclose(weights(len(product) - 1, UNIT) @ product, values[0] * values[1], rtol=0, atol=1e-12)


@given(st.integers(0, 5), st.lists(st.floats(0, 1), min_size=1, max_size=4))
def test_a_composition_has_the_outer_polynomials_values_at_the_inners(degree: int, inner: list[float]) -> None:
    rows = after(degree, np.array(inner))
    assert rows.shape == (degree * (len(inner) - 1) + 1, degree + 1)
    assert (rows >= 0).all()
    x = weights(len(inner) - 1, UNIT) @ inner
    np.testing.assert_allclose(weights(len(rows) - 1, UNIT) @ rows, weights(degree, x), rtol=0, atol=1e-13)


def test_binomials_are_pascals() -> None:
    np.testing.assert_array_equal(binomials(4), [1, 4, 6, 4, 1])


@given(points())
def test_lines_are_numpys(given_points: tuple[np.ndarray, ...]) -> None:
    t, q = given_points
    path = PiecewisePath.from_linear(t, q)
    u = np.linspace(t[0] - 1, t[-1] + 1, 101)
    expected = np.column_stack([np.interp(u, t, column) for column in q.T])
    np.testing.assert_allclose(path.sample(u), expected, rtol=0, atol=1e-13 * size_of(path, 0))
    np.testing.assert_array_equal(path.sample(t), q)


@given(points(2))
def test_cubics_with_rates_are_scipys(given_points: tuple[np.ndarray, ...]) -> None:
    t, q, dq = given_points
    path = PiecewisePath.from_cubic(t, q, dq)
    assert is_continuous(path, 1)
    np.testing.assert_allclose(path.sample(inside(path)), CubicHermiteSpline(t, q, dq)(inside(path)), rtol=0, atol=1e-12 * 100)


@given(points(), st.sampled_from(["clamped", "natural"]))
def test_cubics_without_rates_are_scipys_spline(given_points: tuple[np.ndarray, ...], ends: Any) -> None:
    t, q = given_points
    path = PiecewisePath.from_cubic(t, q, ends=ends)
    assert is_continuous(path, 2)
    np.testing.assert_allclose(path.sample(inside(path)), CubicSpline(t, q, bc_type=ends)(inside(path)), rtol=0, atol=1e-9)
    derivative = 1 if ends == "clamped" else 2
    np.testing.assert_allclose(path.sample(path.domain, derivative), 0, atol=1e-9 * size_of(path, derivative))


@given(points(3))
def test_quintics_have_the_rates_and_accelerations_they_were_given(given_points: tuple[np.ndarray, ...]) -> None:
    t, *tables = given_points
    path = PiecewisePath.from_quintic(t, *tables)
    expected = BPoly.from_derivatives(t, np.stack(tables, axis=1))
    np.testing.assert_allclose(path.sample(inside(path)), expected(inside(path)), rtol=0, atol=1e-12 * size_of(path, 0))
    assert is_continuous(path, 2)
    for derivative, table in enumerate(tables):
        np.testing.assert_allclose(path.sample(t, derivative), table, rtol=0, atol=ROUNDING * size_of(path, derivative))


def test_jumps_are_told_from_rounding() -> None:
    step = PiecewisePath([0, 1, 3], [[[0.0], [1.0]], [[1.5], [2.0]]])
    np.testing.assert_allclose(step.jumps(0), [[0.5]])
    assert not is_continuous(step)
    corner = PiecewisePath.from_linear([0, 1, 3], [[0.0, 1.0], [1.0, 1.0], [5.0, 1.0]])
    np.testing.assert_allclose(corner.jumps(1), [[1.0, 0.0]])
    assert is_continuous(corner, 0)
    assert not is_continuous(corner, 1)
    assert not corner.jumps(2).any()


def test_a_joints_jump_is_measured_by_its_own_numbers() -> None:
    """Whatever the other joint is at: 1e-8 is rounding at 1e6 and a jump at 1."""
    path = PiecewisePath([0, 1, 2], [[[1e6, 0.0], [1e6, 0.0]], [[1e6 + 1e-8, 1e-8], [1e6, 1e-8]]])
    np.testing.assert_array_equal(path.jumps(0) != 0, [[False, True]])
    corner = PiecewisePath([0, 1, 2], [[[1e6, 0.0], [1e6, 0.0]], [[1e6, 0.0], [1e6 + 1e-8, 1e-8]]])
    np.testing.assert_array_equal(corner.jumps(1) != 0, [[False, True]])
    noise = PiecewisePath([0, 1, 2], [[[1.0, 1e-17], [1.0, 1e-17]], [[1.0, -1e-17], [1.0, 0.0]]])
    assert is_continuous(noise, 1)


@given(st.integers(0, 2**32 - 1), st.integers(0, 6))
def test_closed_jumps_of_rounding_leave_a_continuous_path_within_the_numbers_it_had(seed: int, degree: int) -> None:
    rng = np.random.default_rng(seed)
    b = rng.uniform(-1, 1) + 1e-8 * rng.integers(0, 2, 20)
    points = np.stack([np.full(20, 9e5), b], axis=1)[:, None] * np.ones((degree + 1, 1))
    path = PiecewisePath(np.arange(21) * 1e-3, points)
    closed = path.joined()
    assert not (closed.coefficients[1:, 0] - closed.coefficients[:-1, -1]).any()
    assert closed.joined() is closed
    least, most = points.min(axis=(0, 1)), points.max(axis=(0, 1))
    u = np.linspace(0, 0.02, 501)
    assert ((closed.sample(u) >= least - 1e-9) & (closed.sample(u) <= most + 1e-9)).all()
    # What jumped in an instant now takes a piece, and is seen as a rate.
    gone = np.abs(np.diff(b)).max()
    assert np.abs(closed.hulls(1)[1:]).max() >= gone / 1e-3 * 0.999
    apart = PiecewisePath([0, 1, 2], [[[0.0], [1.0]], [[1.5], [2.0]]])
    assert apart.joined() is apart


def test_many_small_jumps_of_a_rate_count_as_what_they_add_up_to() -> None:
    """Corners, each within rounding of the numbers, in pieces of a microsecond: together they turn a line into a curve."""
    t = np.arange(1001) * 1e-6
    q = 9e5 + np.cumsum(np.cumsum(np.full(1001, 1e-10)))
    path = PiecewisePath.from_linear(t, q[:, None])
    rates = path.derivative().coefficients[:, 0, 0]
    assert not path.jumps(1).any()
    assert path.slips(1)[0] >= (rates[-1] - rates[0]) / (t[-1] - t[0])
    assert PiecewisePath.from_linear([0, 1, 2], [[0.0], [1.0], [2.0]]).slips(1)[0] < 1e-15


def test_polynomials_of_any_degree_that_float64_bears_are_taken() -> None:
    assert PiecewisePath([0, 1], np.linspace(0, 1, 257)[None, :, None]).sample(0.5)[0] == pytest.approx(0.5)
    assert_refused("motion", "path of degree 1100", ProblemError, lambda: PiecewisePath([0, 1], np.zeros((1, 1101, 1))))


@given(NUMBERS, NUMBERS, st.lists(st.floats(1e-3, 1.0), min_size=2, max_size=6))
def test_a_straight_line_in_pieces_has_no_corner(begin: float, slope: float, steps: list[float]) -> None:
    t = np.concatenate([[0.0], np.cumsum(steps)])
    assert is_continuous(PiecewisePath.from_linear(t, begin + slope * t[:, None]), 1)


@given(paths())
def test_a_path_survives_pickle_read_only(path: PiecewisePath) -> None:
    again = pickle.loads(pickle.dumps(path))
    assert again == path
    assert hash(again) == hash(path)
    assert not again.coefficients.flags.writeable


@pytest.mark.parametrize("shape", [(), (1,), (3, 2), (0,)])
def test_samples_keep_the_batchs_shape(shape: tuple[int, ...]) -> None:
    path = PiecewisePath.from_linear([0, 1, 2], np.zeros((3, 2)))
    assert path.sample(np.full(shape, 0.3)).shape == (*shape, 2)


@settings(max_examples=20)
@given(st.integers(0, 4))
def test_motions_and_paths_are_both_curves(interior: int) -> None:
    motion: Curve = Motion(np.arange(2 * (interior + 2)).reshape(-1, 2))
    path: Curve = PiecewisePath.from_linear([0.0, 2.0], [[0.0, 0.0], [1.0, 1.0]])
    for curve in (motion, path):
        ends, low, _ = curve.hulls(0, bisections=2)
        assert len(low) == curve.pieces * 4
        assert (ends[0, 0], ends[-1, 1]) == curve.domain
        assert greatest(curve, 1).shape == (curve.dof,)


@given(paths(degree=3))
def test_extremes_of_a_motion_are_within_its_hulls(path: PiecewisePath) -> None:
    assume(path.dof > 1)
    motion = Motion(path.coefficients[0])
    low, high = extremes(motion, 1)
    assert (np.maximum(-low, high) <= greatest(motion, 1) * (1 + 1e-4) + 1e-12).all()


REFUSED: dict[str, Any] = {
    "path of one break": lambda: PiecewisePath([0.0], np.zeros((0, 2, 1))),
    "path of other pieces than breaks": lambda: PiecewisePath([0.0, 1.0], np.zeros((2, 2, 1))),
    "path of no joint": lambda: PiecewisePath([0.0, 1.0], np.zeros((1, 2, 0))),
    "path whose breaks fall": lambda: PiecewisePath([0.0, 1.0, 0.5], np.zeros((2, 2, 1))),
    "path with NaN": lambda: PiecewisePath([0.0, 1.0], [[[np.nan], [0.0]]]),
    "path of text": lambda: PiecewisePath("home", [[[0.0]]]),  # type: ignore[arg-type]
    "lines of one point": lambda: PiecewisePath.from_linear([0.0], [[1.0]]),
    "lines of more points than times": lambda: PiecewisePath.from_linear([0.0, 1.0], np.zeros((3, 1))),
    "lines at the same time": lambda: PiecewisePath.from_linear([0.0, 0.0], np.zeros((2, 1))),
    "cubics with rates of other joints": lambda: PiecewisePath.from_cubic([0.0, 1.0], np.zeros((2, 1)), np.zeros((2, 2))),
    "cubics with ends mistyped": lambda: PiecewisePath.from_cubic([0.0, 1.0], np.zeros((2, 1)), ends="free"),  # type: ignore[arg-type]
}


@pytest.mark.parametrize("case", REFUSED)
def test_paths_that_cannot_be_are_refused(case: str) -> None:
    assert_refused("motion", case, ProblemError, REFUSED[case])
