"""The version is written in pyproject.toml; what repeats it agrees."""

from __future__ import annotations

import re

from house.source import REPOSITORY


def first_match(pattern: str, file: str) -> str:
    found = re.search(pattern, (REPOSITORY / file).read_text(encoding="utf-8"), flags=re.MULTILINE)
    assert found, f"{file} has no line like {pattern}"
    return found[1]


def test_the_citation_and_the_changelog_know_the_version() -> None:
    version = first_match(r'^version = "(.+)"$', "pyproject.toml")
    assert first_match(r"^version: (.+)$", "CITATION.cff") == version
    assert f"## [{version}]" in (REPOSITORY / "CHANGELOG.md").read_text(encoding="utf-8")
