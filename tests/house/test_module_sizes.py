"""A module has one idea: it is short, and its name says which."""

from __future__ import annotations

from pathlib import Path

import pytest

from house.source import REPOSITORY, python_files, repository_files, where

MOST_LINES = 600
MOST_KERNEL_LINES = 600  # of 120 columns, as clang-format sets them
NO_IDEA = {"utils", "util", "helpers", "misc", "common"}

KERNEL = sorted(path for path in (REPOSITORY / "kernel").rglob("*") if path.is_file())


@pytest.mark.parametrize(("files", "most"), [(python_files(), MOST_LINES), (KERNEL, MOST_KERNEL_LINES)], ids=["Python", "C++"])
def test_a_module_is_short(files: list[Path], most: int) -> None:
    lines = {where(path): len(path.read_text(encoding="utf-8").splitlines()) for path in files}
    long = {name: count for name, count in lines.items() if count > most}
    assert not long, f"more than {most} lines, split each by ideas: {long}"


def test_no_module_is_named_after_nothing() -> None:
    found = [where(path) for path in repository_files() if path.stem in NO_IDEA]
    assert not found, f"name the idea: {found}"
