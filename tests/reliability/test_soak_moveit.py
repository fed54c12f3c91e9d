"""A share of benchmarks/soak_moveit.py: drawn files of MoveIt are read by us and by others; what is wrong can be seen."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from support.drawn_moveit import Files, drawn_files
from support.moveit_checker import complaints
from support.moveit_reader import OtherReader


def drawn(number: int, folder: Path) -> tuple[Files, np.random.Generator]:
    rng = np.random.default_rng((7, number))
    return drawn_files(rng, folder), rng


@pytest.mark.parametrize("number", range(12))
def test_both_readers_place_everything_alike(number: int, tmp_path: Path) -> None:
    assert complaints(*drawn(number, tmp_path)) == []


def test_a_reader_with_frames_of_its_own_is_found_out(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    right = OtherReader.frame
    shift = np.eye(4)
    shift[2, 3] = 1e-6
    monkeypatch.setattr(OtherReader, "frame", lambda self, message: right(self, message) @ shift)
    found = []
    for number in range(4):
        (tmp_path / str(number)).mkdir()
        found += complaints(*drawn(number, tmp_path / str(number)))
    assert any("differs by" in sentence for sentence in found)
