"""Motions: SciPy's spline, at rest at the ends, smooth between, and inside hulls that are tight."""

from __future__ import annotations

import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spacearm.motion import Motion, basis
from support.drawn_motions import INTERIORS, motions, scipy_spline, size_of

ROUNDING = 1e-13  # of the derivative's scale: two recursions of doubles
DENSE = np.linspace(0, 1, 2001)


@given(motions(), st.integers(0, 5))
def test_values_and_derivatives_are_scipys(motion: Motion, derivative: int) -> None:
    s = DENSE[::10]
    expected = scipy_spline(motion)(s, nu=derivative)
    inner = np.linspace(0, 1, motion.interior + 2)
    if derivative == 5:  # jumps at the knots
        s = s[np.abs(s[:, None] - inner[1:-1]).min(axis=1, initial=1) > 1e-9]
        expected = scipy_spline(motion)(s, nu=5)
    np.testing.assert_allclose(motion.sample(s, derivative), expected, rtol=0, atol=ROUNDING * size_of(motion, derivative))


def test_without_interior_points_it_is_the_quintic_of_the_literature() -> None:
    s = DENSE[:, None]
    motion = Motion([[1.0, -3.0], [2.5, 4.0]])
    start, goal = motion.control_points
    blend = 10 * s**3 - 15 * s**4 + 6 * s**5
    np.testing.assert_allclose(motion.sample(DENSE), start + blend * (goal - start), rtol=0, atol=1e-14 * 10)
    rate = 30 * s**2 - 60 * s**3 + 30 * s**4
    np.testing.assert_allclose(motion.sample(DENSE, 1), rate * (goal - start), rtol=0, atol=1e-13 * 10)


@given(motions())
def test_it_starts_and_ends_at_rest_without_acceleration(motion: Motion) -> None:
    start, goal = motion.control_points[[0, -1]]
    np.testing.assert_array_equal(motion.sample(0.0), start)
    np.testing.assert_array_equal(motion.sample(1.0), goal)
    for derivative in (1, 2):
        ends = motion.sample([0.0, 1.0], derivative)
        np.testing.assert_allclose(ends, 0, atol=ROUNDING * size_of(motion, derivative))
    # Beyond the ends it rests there.
    np.testing.assert_array_equal(motion.sample([-3.0, 7.0]), [start, goal])


@given(motions(least=1), st.integers(0, 4))
def test_it_is_four_times_differentiable_across_the_knots(motion: Motion, derivative: int) -> None:
    knots = np.linspace(0, 1, motion.interior + 2)[1:-1]
    before, after = (motion.sample(knots + step, derivative) for step in (-1e-10, 1e-10))
    # What a bounded next derivative allows over the step.
    allowed = 2e-10 * 2**6 * size_of(motion, derivative + 1) + ROUNDING * size_of(motion, derivative)
    np.testing.assert_allclose(before, after, rtol=0, atol=allowed)


@given(INTERIORS, st.integers(0, 4))
def test_the_basis_is_a_partition_of_unity(interior: int, derivative: int) -> None:
    rows = basis(DENSE, interior, derivative=derivative)
    assert rows.shape == (len(DENSE), interior + 2)
    total = rows.sum(axis=1)
    np.testing.assert_allclose(total, float(derivative == 0), atol=1e-13 * (5.0 * (interior + 1)) ** derivative)
    if derivative == 0:
        assert (rows >= 0).all()


@given(motions())
def test_it_stays_in_the_convex_hull_of_its_control_points(motion: Motion) -> None:
    q = motion.sample(DENSE)
    slack = ROUNDING * size_of(motion, 0)
    assert (q >= motion.control_points.min(axis=0) - slack).all()
    assert (q <= motion.control_points.max(axis=0) + slack).all()


@given(motions(), st.integers(0, 3), st.integers(0, 6))
def test_hulls_contain_every_sample_of_their_piece(motion: Motion, derivative: int, bisections: int) -> None:
    ends, low, high = motion.hulls(derivative, bisections=bisections)
    pieces = (motion.interior + 1) * 2**bisections
    assert ends.shape == (pieces, 2)
    assert low.shape == high.shape == (pieces, motion.dof)
    assert (ends[0, 0], ends[-1, 1]) == (0, 1)
    np.testing.assert_array_equal(ends[1:, 0], ends[:-1, 1])
    inside = ends[:, :1] + np.linspace(0, 1, 9) * np.diff(ends, axis=1)
    values = motion.sample(inside, derivative)
    slack = ROUNDING * size_of(motion, derivative)
    assert (values >= low[:, None] - slack).all()
    assert (values <= high[:, None] + slack).all()


@given(motions(), st.integers(0, 3), st.data())
def test_hulls_of_some_pieces_are_those_of_all(motion: Motion, derivative: int, data: st.DataObject) -> None:
    count = (motion.interior + 1) * 8
    some = np.array(data.draw(st.lists(st.integers(0, count - 1), min_size=1, max_size=5)))
    every, chosen = motion.hulls(derivative, bisections=3), motion.hulls(derivative, bisections=3, pieces=some)
    for whole, part in zip(every, chosen, strict=True):
        np.testing.assert_allclose(part, whole[some], rtol=0, atol=ROUNDING * size_of(motion, derivative))


@pytest.mark.parametrize(("derivative", "extremes"), [(0, (0, 1)), (1, (0, 1.875)), (2, (-10 / 3**0.5, 10 / 3**0.5))])
def test_hulls_of_the_quintic_are_within_half_a_percent_of_its_extremes(derivative: int, extremes: tuple[float, float]) -> None:
    _, low, high = Motion([[0.0], [1.0]]).hulls(derivative)
    span = extremes[1] - extremes[0]
    assert extremes[0] - 0.005 * span <= low.min() <= extremes[0] + 1e-12
    assert extremes[1] - 1e-12 <= high.max() <= extremes[1] + 0.005 * span


@settings(max_examples=25)
@given(motions(), st.integers(0, 2))
def test_the_excess_of_the_hulls_falls_with_the_square_of_the_pieces_length(motion: Motion, derivative: int) -> None:
    """A polynomial's Bernstein coefficients are within c h^2 max |p''| of it: Nairn, Peters and Lutterkort, 1999."""
    s = np.linspace(0, 1, 20001)
    dense, bent = motion.sample(s, derivative), np.abs(motion.sample(s, derivative + 2)).max(axis=0)
    scale, degree = size_of(motion, derivative), 5 - derivative
    c = (degree // 2) * ((degree + 1) // 2) / (2 * degree) / (degree * (degree - 1))
    for bisections in (5, 8):
        _, low, high = motion.hulls(derivative, bisections=bisections)
        allowed = c * 1.1 * bent / (motion.pieces * 2**bisections) ** 2 + 1e-6 * scale
        assert (high.max(axis=0) <= dense.max(axis=0) + allowed).all()
        assert (low.min(axis=0) >= dense.min(axis=0) - allowed).all()


@given(motions())
def test_the_reversed_motion_runs_the_same_way_back(motion: Motion) -> None:
    back = Motion(motion.control_points[::-1])
    for derivative in range(4):
        np.testing.assert_allclose(
            back.sample(1 - DENSE[::20], derivative),
            (-1) ** derivative * motion.sample(DENSE[::20], derivative),
            rtol=0,
            atol=10 * ROUNDING * size_of(motion, derivative),
        )


@given(st.floats(-1e3, 1e3), INTERIORS, st.integers(1, 3))
def test_what_does_not_move_has_exactly_no_derivatives(value: float, interior: int, derivative: int) -> None:
    motion = Motion(np.full((interior + 2, 2), value))
    assert not motion.sample(DENSE, derivative).any()
    _, low, high = motion.hulls(derivative)
    assert not low.any()
    assert not high.any()


@pytest.mark.parametrize("shape", [(), (1,), (3, 2), (0,)])
def test_samples_keep_the_batchs_shape(shape: tuple[int, ...]) -> None:
    motion = Motion([[0.0, 1.0, 2.0], [1.0, 1.0, 1.0]])
    s = np.full(shape, 0.3)
    assert motion.sample(s).shape == (*shape, 3)
    np.testing.assert_array_equal(motion.sample(s), np.broadcast_to(motion.sample(0.3), (*shape, 3)))


@given(motions())
def test_the_length_is_the_integral_of_the_speed_and_no_less_than_the_way(motion: Motion) -> None:
    fine = scipy_spline(motion)(np.linspace(0, 1, 20001))
    polyline = np.linalg.norm(np.diff(fine, axis=0), axis=1).sum()
    assert motion.length() == pytest.approx(polyline, rel=1e-3, abs=1e-9)
    direct = np.linalg.norm(motion.control_points[-1] - motion.control_points[0])
    assert motion.length() >= direct * (1 - 1e-6)


def test_the_straight_motions_length_is_the_way() -> None:
    assert Motion([[0.0, 0.0], [3.0, 4.0]]).length() == pytest.approx(5, rel=1e-9)


@given(motions())
def test_a_motion_survives_pickle_read_only(motion: Motion) -> None:
    again = pickle.loads(pickle.dumps(motion))
    assert again == motion
    assert hash(again) == hash(motion)
    assert not again.control_points.flags.writeable
