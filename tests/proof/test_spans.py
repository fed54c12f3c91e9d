"""Stretches of a curve: they cover it, and it strays from their lines no more than they say."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from proof.test_bounds import curves
from spacearm.motion import Motion, PiecewisePath
from spacearm.proof.displacement import Spans
from support.dense_samples import planar


@settings(max_examples=40)
@given(st.data(), st.integers(0, 2**32 - 1))
def test_the_drift_bounds_how_far_a_curve_strays(data: st.DataObject, seed: int) -> None:
    curve = data.draw(curves(planar()))
    spans = Spans(curve)
    stretches = spans.first()
    for _ in range(data.draw(st.integers(0, 5))):
        stretches = spans.halved(stretches)
    lines = spans.lines(stretches)
    share = np.concatenate([[0, 0.5, 1], np.random.default_rng(seed).uniform(0, 1, 12)])
    u = stretches.ends[:, :1] + share * np.diff(stretches.ends, axis=1)
    assert (np.abs(u - lines.u[:, None]) <= lines.h[:, None]).all()
    straight = lines.q[:, None] + lines.rate[:, None] * (u - lines.u[:, None])[..., None]
    assert (np.abs(curve.sample(u) - straight) <= lines.drift[:, None] + 1e-13).all()


@given(st.data())
def test_stretches_cover_the_curve_however_often_they_are_halved(data: st.DataObject) -> None:
    curve = data.draw(curves(planar()))
    spans = Spans(curve)
    stretches = spans.first()
    for _ in range(6):
        order = np.argsort(stretches.ends[:, 0])
        ends = stretches.ends[order]
        assert (ends[0, 0], ends[-1, 1]) == curve.domain
        np.testing.assert_array_equal(ends[1:, 0], ends[:-1, 1])
        assert (ends[:, 1] > ends[:, 0]).all()
        assert stretches.share.sum() == pytest.approx(1)
        stretches = spans.halved(stretches)


def test_a_run_of_many_pieces_begins_as_few_stretches() -> None:
    t = np.linspace(0, 1, 10_001)
    spans = Spans(PiecewisePath.from_linear(t, np.column_stack([np.sin(t), t])))
    stretches = spans.first()
    assert len(stretches) <= 32
    assert spans.lines(stretches).drift.max() < 0.001
    for _ in range(12):
        stretches = spans.halved(stretches)
    assert (stretches.last - stretches.first == 1).all()


def test_a_straight_piece_does_not_drift_and_a_motion_at_rest_does_not_move() -> None:
    spans = Spans(PiecewisePath.from_linear([0, 1], [[0, 0], [1, 2]]))
    assert spans.lines(spans.first()).drift.max() < 1e-13
    still = Spans(Motion([[0.3, -2.0]] * 4))
    lines = still.lines(still.first())
    assert np.abs(lines.rate).max() == 0
    assert lines.drift.max() < 1e-13


def test_samples_of_large_values_are_allowed_their_rounding() -> None:
    spans = Spans(PiecewisePath.from_linear([0, 1], [[1e6], [1e6]]))
    assert spans.lines(spans.first()).drift.min() > 1e-9


def test_a_piece_that_is_over_in_an_instant_is_bounded_though_it_has_no_middle() -> None:
    """Between two times that are neighbours among the numbers there is none: the rate at the middle is another piece's."""
    begin = 1.0
    end = float(np.nextafter(begin, 2.0))
    spans = Spans(PiecewisePath.from_linear([0.0, begin, end, 2.0], [[0.0], [0.0], [0.3], [0.3]]))
    stretches = spans.first()
    for _ in range(4):
        stretches = spans.halved(stretches)
    lines = spans.lines(stretches)
    for end_of in (0, 1):
        u = stretches.ends[:, end_of]
        strayed = np.abs(spans_curve_at(u) - lines.q - lines.rate * (u - lines.u)[:, None])
        assert (strayed <= lines.drift + 1e-12).all()


def spans_curve_at(u: np.ndarray) -> np.ndarray:
    """That step, at its ends: either of the two positions is on it."""
    return np.where(u[:, None] <= 1.0, 0.0, 0.3)
