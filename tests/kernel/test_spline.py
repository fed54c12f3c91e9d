"""The kernel's spline: the values of its basis against SciPy, spacearm.motion and closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kernel.builds import LEVELS, Build
from spacearm.core.native import available_levels, native
from spacearm.motion import Motion
from spacearm.motion.spline import basis
from support.kernel_cases import by_scipy, clamped_quintic

COUNTS = (0, 1, 2, 3, 5, 8, 16, 24, 32)  # of interior control points


def instants(interior: int) -> np.ndarray:
    """Even and random instants, both ends, the knots, and the numbers next to these."""
    knots = np.unique(clamped_quintic(interior))
    beside = np.concatenate([np.nextafter(knots, 0), np.nextafter(knots, 1)])
    random = np.random.default_rng(interior).uniform(0, 1, 40)
    return np.concatenate([np.linspace(0, 1, 129), random, knots, np.clip(beside, 0, 1)])


def scale(interior: int, derivative: int) -> float:
    """How large the derivatives get: each brings a factor of at most 5 spans, and doubles."""
    return (10.0 * (interior + 1)) ** derivative


@pytest.mark.parametrize("derivative", range(6))
@pytest.mark.parametrize("interior", COUNTS)
def test_values_are_scipys(interior: int, derivative: int) -> None:
    s = instants(interior)
    found = native.spline_values(s, interior, derivative)
    assert found.shape == (len(s), interior + 2)
    np.testing.assert_allclose(found, by_scipy(s, interior, derivative), rtol=0, atol=1e-13 * scale(interior, derivative))


@pytest.mark.parametrize("derivative", range(5))
@pytest.mark.parametrize("interior", COUNTS)
def test_values_are_those_that_motions_are_timed_by(interior: int, derivative: int) -> None:
    """The kernel searches and spacearm.motion proves: both must mean the same curve."""
    s = instants(interior)
    found = native.spline_values(s, interior, derivative)
    expected = basis(s, interior, derivative=derivative)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-13 * scale(interior, derivative))


@settings(max_examples=50)
@given(st.integers(0, 24), st.floats(0, 1))
def test_values_sum_to_one_and_none_is_negative(interior: int, s: float) -> None:
    values = native.spline_values(np.array([s]), interior, 0)[0]
    assert values.min() >= 0
    assert values.sum() == pytest.approx(1, abs=1e-14)
    for derivative in range(1, 6):
        slope = native.spline_values(np.array([s]), interior, derivative)[0]
        assert abs(slope.sum()) <= 1e-12 * scale(interior, derivative)


def test_without_interior_points_it_is_the_quintic_of_the_literature() -> None:
    s = np.linspace(0, 1, 33)
    quintic = np.polynomial.Polynomial([0, 0, 0, 10, -15, 6])
    for derivative in range(6):
        way = quintic.deriv(derivative)(s) if derivative else quintic(s)
        found = native.spline_values(s, 0, derivative)
        np.testing.assert_allclose(found[:, 1], way, rtol=0, atol=1e-11)
        np.testing.assert_allclose(found[:, 0], (derivative == 0) - way, rtol=0, atol=1e-11)


@pytest.mark.parametrize("interior", COUNTS)
def test_motions_start_and_end_at_rest(interior: int) -> None:
    ends = np.array([0.0, 1.0])
    np.testing.assert_array_equal(native.spline_values(ends, interior, 0), np.eye(interior + 2)[[0, -1]])
    for derivative in (1, 2):
        left = np.abs(native.spline_values(ends, interior, derivative)).max()
        assert left <= 1e-15 * scale(interior, derivative)


def test_a_motion_of_drawn_points_is_where_the_values_put_it() -> None:
    rng = np.random.default_rng(0)
    for interior in COUNTS:
        points = rng.uniform(-3, 3, (interior + 2, 4))
        s = instants(interior)
        expected = Motion(points).sample(s)
        np.testing.assert_allclose(native.spline_values(s, interior, 0) @ points, expected, rtol=0, atol=1e-13)


def test_every_level_has_the_same_values() -> None:
    s = instants(24)
    for level in LEVELS:
        if level in available_levels():
            for derivative in range(6):
                found = Build(level, 64).module.spline_values(s, 24, derivative)
                np.testing.assert_array_equal(found, native.spline_values(s, 24, derivative))


def test_no_instants_have_no_values() -> None:
    assert native.spline_values(np.zeros(0), 3, 0).shape == (0, 5)


def test_the_greatest_slope_of_the_quintic_is_fifteen_eighths() -> None:
    assert native.spline_values(np.array([0.5]), 0, 1)[0, 1] == pytest.approx(15 / 8, rel=1e-14)
    assert native.spline_values(np.array([0.5 - math.sqrt(3) / 6]), 0, 2)[0, 1] == pytest.approx(10 / math.sqrt(3), rel=1e-13)
