"""What a message must tell, without holding its words: names, values, units, and a remedy.

`tests/snapshots/<room>.json` has an entry for each case of a room. An entry that is a text holds the sentence word for
word; there is one for each kind of message of each error. An entry that is an object holds what the sentence must
contain, so that a sentence may be reworded and must still be of use.

Run with UPDATE_SNAPSHOTS=1 to rewrite the entries, then read the difference. A new case gets an object; to hold a
sentence word for word, write an empty text as its entry first.
"""

from __future__ import annotations

import json
import os
import re
from collections.abc import Callable, Iterable
from pathlib import Path

import pytest

from spacearm.core.errors import SpacearmError

_DIRECTORY = Path(__file__).parents[1] / "snapshots"

_NUMBER = r"[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?"
_UNITS = ("kg m\\^2", "kg m/s", "N m s", "N m", "rad/s\\^2", "m/s\\^2", "rad/s\\^3", "m/s\\^3", "rad/s", "m/s", "deg/s")
_UNITS += ("rad", "deg", "mm", "cm", "kg", "m", "s", "%")
_BARE_UNIT = re.compile(rf"({_NUMBER}) ({'|'.join(_UNITS)})(?![\w/^])")
_IN_BRACKETS = re.compile(r"\[([a-z][^\],]{0,24})\]")
_QUOTED = re.compile(r"(?<!\w)'([^']*)'(?!\w)|`([^`]*)`")
_VALUE = re.compile(rf"(?<![\w.^'])(?:line )?(?:{_NUMBER}|nan|inf|None|True|False)(?![\w'])")
_WORD_OF_CODE = re.compile(r"(?<![\w'`<-])(?:--[a-z][\w-]*|[A-Za-z]\w*_\w+|[A-Za-z]\w*(?==)|[A-Za-z]\w*(?:\.[a-z]\w*)+)")
_SUBJECT = re.compile(r"^(?:<path>:? ?)?(?:line \d+: )?(?:[\w' ]{0,40} )?([A-Za-z][\w.\[\]]*) (?:is|has|sum|are|names|must) ")
_PLACE = re.compile(r"<path>(?:/[\w./-]*\w)?")
_FORMAT = re.compile(r"\b[A-Z]{3,5}\b")
_KNOWN = re.compile(r"\bknown: .*")
_OUR_MODULE = re.compile(r"^spacearm\.(?:\w+\.)+(?=[A-Z])")  # a class is named, wherever it lies
_HINT = re.compile(r"did you mean '([^']*)'\??")

_VERBS = (
    "add|allow|change|check|choose|convert|correct|cut|drop|exchange|expand|force|free|give|join|leave|list|look|lower|make|"
    "mend|move|name|narrow|pass|place|plan|print|put|read|remove|rename|repair|replace|resume|run|save|scale|see|set|sort|"
    "start|state|swap|take|tell|use|weigh|widen|write"
)
_ADVICE = re.compile(rf"(?:; |\. |: |, (?:or |and )?| (?:or|and|else) )(?:{_VERBS})\b|\?")


def says(
    message: object,
    *,
    name: str | Iterable[str] = (),
    value: str | Iterable[str] = (),
    unit: str | Iterable[str] = (),
    remedy: str | Iterable[str] = (),
) -> bool:
    """Tell whether a message contains each of the given facts as whole words, and the given kinds of remedy.

    Args:
        message: the error, or its text.
        name: what it must name: joints, files, keys, settings, without quotation marks.
        value: the numbers that it must state, as they are printed.
        unit: the units of the numbers.
        remedy: kinds of remedy, of 'expected' (what would have been right), 'known' (the names that would have been
            right), 'hint' (the nearest of them) and 'advice' (what to do).
    """
    return not missing(message, name=name, value=value, unit=unit, remedy=remedy)


def missing(message: object, **facts: str | Iterable[str]) -> list[str]:
    """Return the facts that a message does not tell; `says` has the arguments."""
    text = str(message)
    found = remedies(text)
    lost = []
    for kind, wanted in facts.items():
        for fact in [wanted] if isinstance(wanted, str) else wanted:
            if not (fact in found if kind == "remedy" else _has(text, fact)):
                lost.append(f"{kind} {fact}")
    return lost


def facts_of(sentence: str) -> dict[str, list[str]]:
    """Return what a sentence tells: the names, the values, the units and the kinds of remedy."""
    hints = _HINT.findall(sentence)
    told = _KNOWN.sub("", sentence)
    quoted = [first or second for first, second in _QUOTED.findall(told)]
    bare = _QUOTED.sub("''", told)
    names = [*_PLACE.findall(bare), *_SUBJECT.findall(bare), *quoted, *hints]
    words = [*_WORD_OF_CODE.findall(bare), *_FORMAT.findall(bare)]
    names += [word for word in words if not any(_has(name, word) for name in names)]
    names = [_OUR_MODULE.sub("", name) for name in names]
    units = [*(unit for _, unit in _BARE_UNIT.findall(bare)), *_IN_BRACKETS.findall(bare)]
    facts = {
        "name": _once(names),
        "value": _once(_VALUE.findall(bare)),
        "unit": _once(units),
        "remedy": sorted(remedies(sentence)),
    }
    return {kind: entries for kind, entries in facts.items() if entries}


def remedies(text: str) -> set[str]:
    """Return the kinds of remedy that a message has."""
    found = {"expected"} if re.search(r"\bexpected\b|\bmust\b", text) else set()
    found |= {"known"} if re.search(r"\bknown: |\bnone is known\b", text) else set()
    found |= {"hint"} if _HINT.search(text) else set()
    return found | ({"advice"} if _ADVICE.search(_KNOWN.sub("", _HINT.sub("", text))) else set())


def assert_refused(
    room: str, case: str, error: type[SpacearmError], call: Callable[[], object], *, path: object = None
) -> None:
    """Call what must fail, and compare its one-line message with the room's table; a path reads <path>."""
    with pytest.raises(error) as caught:
        call()
    assert type(caught.value) is error
    sentence = str(caught.value)
    if path is not None:
        sentence = sentence.replace(str(path), "<path>")
    assert_sentence(room, case, sentence)


def assert_sentence(room: str, case: str, sentence: str) -> None:
    """Compare a one-line message with the entry of the room's table."""
    assert "\n" not in sentence
    file = _DIRECTORY / f"{room}.json"
    table = json.loads(file.read_text(encoding="utf-8")) if file.exists() else {}
    if os.environ.get("UPDATE_SNAPSHOTS"):
        table[case] = sentence if isinstance(table.get(case), str) else facts_of(sentence)
        lines = [f"  {_json(name)}: {_json(entry)}" for name, entry in sorted(table.items())]
        file.write_text("{\n" + ",\n".join(lines) + "\n}\n", encoding="utf-8")
    where = f"case '{case}' of {file.name}; UPDATE_SNAPSHOTS=1 rewrites the entry"
    held = table.get(case)
    assert held, f"no {where}"
    if isinstance(held, str):
        assert sentence == held, where
    else:
        lost = missing(sentence, **held)
        assert not lost, f"{sentence!r} does not tell {lost}: {where}"


def _has(text: str, fact: str) -> bool:
    """Tell whether a fact stands in a text, and not as a part of a longer word or number."""
    before = r"(?<![\w.])" if fact[0].isdigit() else r"(?<!\w)" if fact[0].isalpha() else ""
    after = r"(?!\w|\.\d)" if re.search(r"\w$", fact) else ""
    return re.search(before + re.escape(fact) + after, text) is not None


def _json(entry: object) -> str:
    return json.dumps(entry, ensure_ascii=False)


def _once(entries: Iterable[str]) -> list[str]:
    return list(dict.fromkeys(entry for entry in entries if entry))
