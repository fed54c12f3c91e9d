"""A share of benchmarks/fuzz.py: broken files of every kind give a result or one sentence, and soon."""

from __future__ import annotations

import signal
from pathlib import Path

import pytest

from support.file_readers import Reader, beside, readers
from support.wrong_files import finding, wrong_file

pytestmark = pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="timers of POSIX")


@pytest.fixture(scope="module")
def all_readers() -> dict[str, Reader]:
    return readers()


def test_the_texts_to_begin_with_are_read(all_readers: dict[str, Reader], tmp_path: Path) -> None:
    for name, reader in all_readers.items():
        folder = tmp_path / name
        folder.mkdir()
        beside(folder)
        for text in reader.texts:
            assert finding(reader, folder / f"case.{reader.suffix}", text) == ("read", ""), name


def test_a_broken_file_gives_a_result_or_one_sentence(all_readers: dict[str, Reader], tmp_path: Path) -> None:
    for place, (name, reader) in enumerate(all_readers.items()):
        folder = tmp_path / name
        folder.mkdir()
        beside(folder)
        for number in range(40):
            data = wrong_file(reader, (1, place, number))
            kind, details = finding(reader, folder / f"case.{reader.suffix}", data)
            assert kind in ("read", "refused"), (name, number, details)
