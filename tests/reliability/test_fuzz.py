"""A share of benchmarks/fuzz.py: broken files of every kind give a result or one sentence, and soon."""

from __future__ import annotations

import signal
from pathlib import Path

import pytest

from support.file_readers import beside, readers
from support.wrong_files import finding, wrong_file

pytestmark = pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="timers of POSIX")
READERS = readers()


@pytest.mark.parametrize("name", READERS)
def test_the_texts_to_begin_with_are_read(name: str, tmp_path: Path) -> None:
    beside(tmp_path)
    reader = READERS[name]
    for text in reader.texts:
        assert finding(reader, tmp_path / f"case.{reader.suffix}", text) == ("read", "")


@pytest.mark.parametrize("name", READERS)
def test_a_broken_file_gives_a_result_or_one_sentence(name: str, tmp_path: Path) -> None:
    beside(tmp_path)
    reader = READERS[name]
    for number in range(40):
        data = wrong_file(reader, (1, list(READERS).index(name), number))
        kind, details = finding(reader, tmp_path / f"case.{reader.suffix}", data)
        assert kind in ("read", "refused"), (number, details)
