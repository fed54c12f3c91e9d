"""Records as plain values: bit for bit there and back, and nothing is taken for granted on the way back."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from spacearm.core.checks import Frozen, as_readonly
from spacearm.core.errors import RobotError
from spacearm.core.records import plain, record_as_dict, record_from_dict


@dataclass(frozen=True, slots=True, eq=False)
class Inner(Frozen):
    """Some numbers."""

    values: NDArray[np.float64]

    def __post_init__(self) -> None:
        object.__setattr__(self, "values", as_readonly("values", self.values, (None,), RobotError, finite=False))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Outer(Frozen):
    """One field of each kind."""

    name: str
    count: int = 0
    share: float = 0.5
    sure: bool = False
    kind: Literal["a", "b"] = "a"
    length: float | None = None
    inner: Inner | None = None
    several: tuple[Inner, ...] = ()
    pairs: tuple[tuple[str, str], ...] = ()


NUMBERS = st.lists(st.floats(allow_nan=False, allow_infinity=False), min_size=1).map(np.array)
OUTER = st.builds(
    Outer,
    name=st.text(),
    count=st.integers(),
    share=st.floats(allow_nan=False, allow_infinity=False),
    sure=st.booleans(),
    kind=st.sampled_from(["a", "b"]),
    length=st.none() | st.floats(allow_nan=False, allow_infinity=False),
    inner=st.none() | NUMBERS.map(Inner),
    several=st.lists(NUMBERS.map(Inner)).map(tuple),
    pairs=st.lists(st.tuples(st.text(), st.text())).map(tuple),
)


@given(OUTER)
def test_a_record_is_the_same_after_json(record: Outer) -> None:
    again = record_from_dict(Outer, json.loads(json.dumps(record_as_dict(record), allow_nan=False)), "outer", RobotError)
    assert again == record
    assert hash(again) == hash(record)


def test_null_stands_for_the_infinity_that_a_field_names() -> None:
    values = record_as_dict(Inner(np.array([1.0, np.inf, np.inf])))
    assert values == {"values": [1.0, None, None]}
    assert record_from_dict(Inner, values, "inner", RobotError, infinite={"values": np.inf}).values.tolist() == [
        1,
        np.inf,
        np.inf,
    ]
    with pytest.raises(RobotError):
        record_from_dict(Inner, values, "inner", RobotError)


WRONG: dict[str, Any] = {
    "outer is None, expected a mapping": None,
    "key 'name' is missing in outer; add it": {},
    "outer: key 'nam' is not known; did you mean 'name'?": {"nam": "x"},
    "outer.name is 3, expected text": {"name": 3},
    "outer.count is True, expected a whole number": {"name": "", "count": True},
    "outer.count is 1.0, expected a whole number": {"name": "", "count": 1.0},
    "outer.share is '1', expected a number": {"name": "", "share": "1"},
    "outer.sure is 1, expected true or false": {"name": "", "sure": 1},
    "outer.kind is ['a'], expected 'a' or 'b'": {"name": "", "kind": ["a"]},
    "outer.inner is [], expected a mapping": {"name": "", "inner": []},
    "outer.inner.values is 3, expected a list": {"name": "", "inner": {"values": 3}},
    "outer.several is {}, expected a list": {"name": "", "several": {}},
    "outer.several[1] is 2, expected a mapping": {"name": "", "several": [{"values": []}, 2]},
    "outer.pairs[0] is ['x'], expected a list of 2": {"name": "", "pairs": [["x"]]},
    "outer.pairs[0][1] is None, expected text": {"name": "", "pairs": [["x", None]]},
}


@pytest.mark.parametrize("sentence", WRONG)
def test_what_does_not_fit_is_named(sentence: str) -> None:
    with pytest.raises(RobotError) as caught:
        record_from_dict(Outer, WRONG[sentence], "outer", RobotError)
    assert str(caught.value).startswith(sentence)


def test_what_no_record_holds_has_no_plain_value() -> None:
    with pytest.raises(TypeError):
        plain(object())
    assert plain((np.float64(1.5), np.arange(2), np.bool_(True))) == [1.5, [0, 1], True]
