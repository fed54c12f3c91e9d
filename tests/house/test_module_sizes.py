"""A module has one idea: it is short, and its name says which."""

from __future__ import annotations

from pathlib import Path

import pytest

from house.source import REPOSITORY, python_files, repository_files, where

MOST_LINES = 500
EXEMPT = {"kernel/bindings.cpp": 600}  # translation of every kernel function, no idea to split at
NO_IDEA = {"utils", "util", "helpers", "misc", "common"}

SOURCES = [*python_files(), *sorted(path for path in (REPOSITORY / "kernel").iterdir() if path.is_file())]


@pytest.mark.parametrize("path", SOURCES, ids=where)
def test_a_module_is_short(path: Path) -> None:
    lines = len(path.read_text(encoding="utf-8").splitlines())
    most = EXEMPT.get(path.relative_to(REPOSITORY).as_posix(), MOST_LINES)
    assert lines <= most, f"{where(path)} has {lines} lines, more than {most}: split it by ideas"


def test_no_module_is_named_after_nothing() -> None:
    found = [where(path) for path in repository_files() if path.stem in NO_IDEA]
    assert not found, f"name the idea: {found}"
