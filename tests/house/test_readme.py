"""What the README shows runs."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from house.source import REPOSITORY

BLOCKS = re.findall(r"```python\n(.*?)```", (REPOSITORY / "README.md").read_text(encoding="utf-8"), flags=re.DOTALL)


def test_the_python_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {}
    for block in BLOCKS:
        exec(compile(block, "README.md", "exec"), names)
    printed = capsys.readouterr().out
    assert "a motion was found and proven" in printed
    assert "clearance is at least" in printed
    assert (tmp_path / "plan.json").exists()


def test_the_files_it_names_exist() -> None:
    text = (REPOSITORY / "README.md").read_text(encoding="utf-8")
    named = [name for name in re.findall(r"\]\(([^)#]+)\)", text) if not name.startswith("http")]
    assert named
    missing = [name for name in named if not (REPOSITORY / name).exists()]
    assert not missing
