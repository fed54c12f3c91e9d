"""A message is of use when it tells the name, the value, the unit and the remedy: the checker of that tells when not."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from support.messages import assert_sentence, facts_of, missing, says

LIMIT = "joint 'elbow' starts at 3.2 rad, above its limit 2.967; change `start` or the limit"
RANGE = "<path>: line 4: radius is -0.5, expected a finite number above 0 [m]"
NAME = "robot 'two_link' has no frame 'hnd'; did you mean 'hand'? known: base, hand"


def test_the_facts_of_a_message_are_its_names_values_units_and_remedies() -> None:
    assert facts_of(LIMIT) == {"name": ["elbow", "start"], "value": ["3.2", "2.967"], "unit": ["rad"], "remedy": ["advice"]}
    assert facts_of(RANGE) == {
        "name": ["<path>", "radius"],
        "value": ["line 4", "-0.5", "0"],
        "unit": ["m"],
        "remedy": ["expected"],
    }
    assert facts_of(NAME) == {"name": ["two_link", "hnd", "hand"], "remedy": ["hint", "known"]}


def test_other_words_tell_the_same() -> None:
    assert says("the start of elbow, 3.2 rad, exceeds 2.967; lower `start`, or raise the limit", **facts_of(LIMIT))
    assert says("<path>: line 4: the radius [m] must be above 0 and is -0.5", **facts_of(RANGE))
    assert says("'hnd' is no frame of two_link; did you mean 'hand'? known: base, hand", **facts_of(NAME))


@pytest.mark.parametrize(
    ("worse", "lost"),
    [
        (LIMIT.replace("3.2 ", ""), ["value 3.2"]),
        (LIMIT.replace("3.2", "13.2"), ["value 3.2"]),
        (LIMIT.replace("3.2", "3.25"), ["value 3.2"]),
        (LIMIT.replace(" rad", ""), ["unit rad"]),
        (LIMIT.replace("'elbow'", "'elbow_2'"), ["name elbow"]),
        (LIMIT[: LIMIT.index(";")], ["name start", "remedy advice"]),
        (RANGE[: RANGE.index(",")], ["value 0", "unit m", "remedy expected"]),
        (RANGE.replace("-0.5", "0.5"), ["value -0.5"]),
        (RANGE.replace("line 4: ", ""), ["value line 4"]),
        (NAME.replace("did you mean 'hand'? ", ""), ["remedy hint"]),
        (NAME[: NAME.index("known")], ["remedy known"]),
    ],
)
def test_a_message_that_lost_something_is_told(worse: str, lost: list[str]) -> None:
    whole = next(text for text in (LIMIT, RANGE, NAME) if text[:3] == worse[:3])
    assert missing(worse, **facts_of(whole)) == lost


def test_a_fact_that_is_asked_for_must_be_there() -> None:
    assert says(LIMIT, name="elbow", value=("3.2", "2.967"), unit="rad", remedy="advice")
    assert not says(LIMIT, name="wrist")
    assert not says(LIMIT, remedy="expected")


def test_a_table_holds_a_text_word_for_word_and_an_object_by_its_facts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("support.messages._DIRECTORY", tmp_path)
    monkeypatch.delenv("UPDATE_SNAPSHOTS", raising=False)
    (tmp_path / "room.json").write_text(json.dumps({"whole": LIMIT, "facts": facts_of(LIMIT)}), encoding="utf-8")
    reworded = LIMIT.replace("starts at", "begins at")
    assert_sentence("room", "whole", LIMIT)
    assert_sentence("room", "facts", reworded)
    for case, sentence in [("whole", reworded), ("facts", LIMIT.replace("3.2", "3")), ("other", LIMIT)]:
        with pytest.raises(AssertionError, match=case):
            assert_sentence("room", case, sentence)


def test_a_table_that_is_updated_keeps_its_kind_of_entry(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("support.messages._DIRECTORY", tmp_path)
    monkeypatch.setenv("UPDATE_SNAPSHOTS", "1")
    (tmp_path / "room.json").write_text('{"whole": "other words"}', encoding="utf-8")
    assert_sentence("room", "whole", RANGE)
    assert_sentence("room", "new", RANGE)
    assert json.loads((tmp_path / "room.json").read_text(encoding="utf-8")) == {"whole": RANGE, "new": facts_of(RANGE)}
