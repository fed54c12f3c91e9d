"""Tests stand alone: what two of them need lies in tests/support, under a name of its own."""

from __future__ import annotations

import ast
from collections import Counter
from pathlib import Path

from house.source import REPOSITORY, where

TESTS = REPOSITORY / "tests"
FILES = sorted(TESTS.rglob("*.py"))


def imported(path: Path) -> list[str]:
    """The dotted names of a file's imports, with what is taken from each module."""
    names: list[str] = []
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            names += [f"{node.module or ''}.{alias.name}" for alias in node.names]
    return names


def test_no_test_module_is_imported() -> None:
    modules = {test.stem for test in FILES if test.stem.startswith("test_")}
    found = [f"{where(path)}: {name}" for path in FILES for name in imported(path) if modules & set(name.split("."))]
    assert not found, "move what is imported to tests/support:\n" + "\n".join(found)


def test_names_of_test_modules_are_unique() -> None:
    names = Counter(path.stem for path in FILES if path.stem not in ("__init__", "conftest"))
    twice = sorted(name for name, count in names.items() if count > 1)
    assert not twice, f"rename all but one of each: {twice}"
