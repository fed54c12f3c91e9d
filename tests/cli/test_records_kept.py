"""A study that is interrupted tells where its records are."""

from __future__ import annotations

from pathlib import Path

import pytest

from spacearm.cli.results_folder import recorded_in, results_folder


@pytest.mark.parametrize("kept", [False, True])
def test_records_that_are_kept_are_told(tmp_path: Path, *, kept: bool) -> None:
    records = tmp_path / "runs.jsonl"
    if kept:
        records.write_text("{}\n", encoding="utf-8")
    with pytest.raises(KeyboardInterrupt) as told, recorded_in(records), results_folder(tmp_path / "out"):
        raise KeyboardInterrupt
    assert ("nothing was written" in str(told.value)) is not kept
    assert (str(records) in str(told.value)) is kept
