"""Sentences held word for word: one JSON table a room, from a case's name to what the user reads.

Run with UPDATE_SNAPSHOTS=1 to rewrite the tables, then read the difference.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from pathlib import Path

import pytest

from spacearm.errors import SpacearmError

_DIRECTORY = Path(__file__).parent / "snapshots"


def assert_refused(
    room: str, case: str, error: type[SpacearmError], call: Callable[[], object], *, path: object = None
) -> None:
    """Call what must fail, and compare its one-line sentence with the room's table; a path reads <path>."""
    with pytest.raises(error) as caught:
        call()
    assert type(caught.value) is error
    sentence = str(caught.value)
    if path is not None:
        sentence = sentence.replace(str(path), "<path>")
    assert_sentence(room, case, sentence)


def assert_sentence(room: str, case: str, sentence: str) -> None:
    """Compare a one-line sentence with the room's table."""
    assert "\n" not in sentence
    file = _DIRECTORY / f"{room}.json"
    table = json.loads(file.read_text()) if file.exists() else {}
    if os.environ.get("UPDATE_SNAPSHOTS"):
        table[case] = sentence
        file.write_text(json.dumps(dict(sorted(table.items())), indent=2, ensure_ascii=False) + "\n")
    assert sentence == table.get(case), f"case '{case}' of {file.name}; UPDATE_SNAPSHOTS=1 rewrites the table"
