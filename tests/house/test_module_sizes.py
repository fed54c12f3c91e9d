"""A module has one idea: it is short, and its name says which."""

from __future__ import annotations

from pathlib import Path

import pytest

from house.source import REPOSITORY, python_files, repository_files, where

MOST_LINES = 620
MOST_KERNEL_LINES = 600  # of 120 columns, as clang-format sets them
NO_IDEA = {"utils", "util", "helpers", "misc", "common"}

KERNEL = sorted(path for path in (REPOSITORY / "kernel").rglob("*") if path.is_file())
SOURCES = [*python_files(), *KERNEL]


@pytest.mark.parametrize("path", SOURCES, ids=where)
def test_a_module_is_short(path: Path) -> None:
    lines = len(path.read_text(encoding="utf-8").splitlines())
    most = MOST_KERNEL_LINES if path in KERNEL else MOST_LINES
    assert lines <= most, f"{where(path)} has {lines} lines, more than {most}: split it by ideas"


def test_no_module_is_named_after_nothing() -> None:
    found = [where(path) for path in repository_files() if path.stem in NO_IDEA]
    assert not found, f"name the idea: {found}"
