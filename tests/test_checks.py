"""The checks that every room shares."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from spacearm import errors
from spacearm.checks import as_number, as_readonly, shown
from spacearm.errors import SettingsError, SpacearmError, nearest


def test_every_error_is_a_spacearm_error_and_there_are_under_ten() -> None:
    leaves = [e for e in vars(errors).values() if isinstance(e, type) and issubclass(e, SpacearmError)]
    leaves.remove(SpacearmError)
    assert 0 < len(leaves) < 10
    assert all(leaf.__bases__ == (SpacearmError,) and leaf.__doc__ for leaf in leaves)


@given(hnp.arrays(st.sampled_from([float, np.float32, int]), hnp.array_shapes(), elements=st.integers(-9, 9)))
def test_numbers_come_back_equal_read_only_and_of_their_own(value: np.ndarray) -> None:
    kept = as_readonly("x", value, value.shape, SettingsError)
    np.testing.assert_array_equal(kept, value)
    assert kept.dtype == np.float64
    assert not kept.flags.writeable
    assert not np.shares_memory(kept, value)


def test_any_length_is_taken_where_none_is_asked_for() -> None:
    assert as_readonly("x", [], (None,), SettingsError).shape == (0,)
    assert as_readonly("x", [[1, 2]], (None, 2), SettingsError).shape == (1, 2)


def test_infinity_is_taken_only_where_asked_for_and_nan_never() -> None:
    assert as_readonly("x", [np.inf], (1,), SettingsError, finite=False)[0] == np.inf
    with pytest.raises(SettingsError, match=r"x\[1\] is inf, expected a finite number"):
        as_readonly("x", [0, np.inf], (2,), SettingsError)
    with pytest.raises(SettingsError, match=r"x\[0\] is nan, expected a number"):
        as_readonly("x", [np.nan], (1,), SettingsError, finite=False)


@pytest.mark.parametrize("value", [3, 3.0, np.int8(3), np.float32(3), np.array(3.0)])
def test_a_number_may_be_of_any_numeric_type(value: object) -> None:
    assert as_number("x", value, SettingsError) == 3.0


@pytest.mark.parametrize("value", ["3", b"3", True, None, [3], 3j, 10**400, object()])
def test_what_is_no_number_is_refused(value: object) -> None:
    with pytest.raises(SettingsError, match="expected a finite number"):
        as_number("x", value, SettingsError)


def test_bounds_are_open_above_and_closed_at_least() -> None:
    assert as_number("x", 0, SettingsError, at_least=0) == 0
    with pytest.raises(SettingsError, match="above 0"):
        as_number("x", 0, SettingsError, above=0)
    with pytest.raises(SettingsError, match="1 or more"):
        as_number("x", 0.99, SettingsError, at_least=1)


def test_the_nearest_name_is_told_with_the_known_ones() -> None:
    assert nearest("elbw", ["elbow", "wrist"]) == "did you mean 'elbow'? known: elbow, wrist"
    assert nearest("ELBOW", ["elbow"]) == "did you mean 'elbow'? known: elbow"
    assert nearest("xyz", ["elbow", "wrist"]) == "known: elbow, wrist"
    assert nearest("xyz", []) == "none is known"
    assert nearest("xyz", map(str, range(30))).endswith("9, 10, 11, ... (30 in all)")


@given(st.one_of(st.text(), st.lists(st.floats()), st.dictionaries(st.text(), st.text())))
def test_a_wrong_value_is_shown_on_one_short_line(value: object) -> None:
    assert len(shown(value).splitlines()) == 1
    assert len(shown(value)) <= 60
