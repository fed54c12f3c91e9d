"""Intervals of a curve: they cover it, and it deviates from their lines no more than they say."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spacearm.motion import Motion, PiecewisePath
from spacearm.proof.path_intervals import PathIntervals
from support.bounded_paths import curves, parts
from support.dense_samples import planar


@settings(max_examples=40)
@given(st.data(), st.integers(0, 2**32 - 1))
def test_the_deviation_bounds_how_far_a_curve_is_from_its_lines(data: st.DataObject, seed: int) -> None:
    curve = data.draw(curves(planar()))
    path = PathIntervals(curve)
    intervals = parts(path)
    for _ in range(data.draw(st.integers(0, 5))):
        intervals = path.halved(intervals)
    lines = path.linear_bounds(intervals)
    share = np.concatenate([[0, 0.5, 1], np.random.default_rng(seed).uniform(0, 1, 12)])
    u = intervals.ends[:, :1] + share * np.diff(intervals.ends, axis=1)
    assert (np.abs(u - lines.u[:, None]) <= lines.half[:, None]).all()
    straight = lines.q[:, None] + lines.rate[:, None] * (u - lines.u[:, None])[..., None]
    assert (np.abs(curve.sample(u) - straight) <= lines.deviation[:, None] + 1e-13).all()


@given(st.data())
def test_intervals_cover_the_curve_however_often_they_are_halved(data: st.DataObject) -> None:
    curve = data.draw(curves(planar()))
    path = PathIntervals(curve)
    intervals = parts(path)
    for _ in range(6):
        order = np.argsort(intervals.ends[:, 0])
        ends = intervals.ends[order]
        assert (ends[0, 0], ends[-1, 1]) == curve.domain
        np.testing.assert_array_equal(ends[1:, 0], ends[:-1, 1])
        assert (ends[:, 1] > ends[:, 0]).all()
        assert intervals.share.sum() == pytest.approx(1)
        intervals = path.halved(intervals)


def test_a_run_of_many_pieces_is_bounded_by_few_intervals_and_in_the_end_each_piece_by_its_own() -> None:
    t = np.linspace(0, 1, 10_001)
    path = PathIntervals(PiecewisePath.from_linear(t, np.column_stack([np.sin(t), t])))
    intervals = parts(path, 5)
    assert path.linear_bounds(intervals).deviation.max() < 0.001
    for _ in range(9):
        intervals = path.halved(intervals)
    assert (intervals.last - intervals.first == 1).all()


def test_a_straight_piece_does_not_deviate_and_a_motion_at_rest_does_not_move() -> None:
    path = PathIntervals(PiecewisePath.from_linear([0, 1], [[0, 0], [1, 2]]))
    assert path.linear_bounds(parts(path)).deviation.max() < 1e-13
    still = PathIntervals(Motion([[0.3, -2.0]] * 4))
    lines = still.linear_bounds(parts(still))
    assert np.abs(lines.rate).max() == 0
    assert lines.deviation.max() < 1e-13


def test_samples_of_large_values_are_allowed_their_rounding() -> None:
    path = PathIntervals(PiecewisePath.from_linear([0, 1], [[1e6], [1e6]]))
    assert path.linear_bounds(parts(path)).deviation.min() > 1e-9


def test_a_piece_that_is_over_in_an_instant_is_bounded_though_it_has_no_middle() -> None:
    """Between two times that are neighbours among the numbers there is none: the rate at the middle is another piece's."""
    begin = 1.0
    end = float(np.nextafter(begin, 2.0))
    path = PathIntervals(PiecewisePath.from_linear([0.0, begin, end, 2.0], [[0.0], [0.0], [0.3], [0.3]]))
    intervals = parts(path)
    for _ in range(4):
        intervals = path.halved(intervals)
    lines = path.linear_bounds(intervals)
    for end_of in (0, 1):
        u = intervals.ends[:, end_of]
        deviated = np.abs(step_at(u) - lines.q - lines.rate * (u - lines.u)[:, None])
        assert (deviated <= lines.deviation + 1e-12).all()


def step_at(u: np.ndarray) -> np.ndarray:
    """That step, at its ends: either of the two positions is on it."""
    return np.where(u[:, None] <= 1.0, 0.0, 0.3)
