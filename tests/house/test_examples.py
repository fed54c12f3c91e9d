"""The examples: numbered, each script runs as it stands and writes a report, and each file is on the page about them."""

from __future__ import annotations

import re
import runpy
import shutil
from pathlib import Path

import pytest

from house.source import REPOSITORY

EXAMPLES = REPOSITORY / "examples"
SCRIPTS = sorted(EXAMPLES.glob("*.py"))
RUN_HERE = [path for path in SCRIPTS if "run_study" not in path.read_text(encoding="utf-8")]
"""docs/study.md runs the others."""


@pytest.mark.parametrize("script", RUN_HERE, ids=lambda path: path.stem)
def test_a_script_runs_and_writes_a_report_of_its_name(
    script: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    shutil.copytree(EXAMPLES, tmp_path / "examples")
    monkeypatch.chdir(tmp_path)
    runpy.run_path(str(Path("examples") / script.name), run_name="__main__")
    assert (tmp_path / f"{script.stem}.html").stat().st_size > 10_000
    assert "proven" in capsys.readouterr().out or script.stem == "09_own_fitness"


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda path: path.stem)
def test_a_script_says_how_it_is_run_and_what_it_writes(script: Path) -> None:
    text = script.read_text(encoding="utf-8")
    assert f"    python examples/{script.name}\n" in text
    assert re.search(r"\w+\.html", text.split('"""')[1])


def test_scripts_and_problem_files_are_numbered() -> None:
    names = [path.name for path in EXAMPLES.iterdir() if path.suffix in (".py", ".yaml")]
    assert [name for name in names if not re.match(r"\d\d_[a-z_]+\.", name)] == []
    topics = {name.split(".")[0] for name in names}
    assert len({topic[:2] for topic in topics}) == len(topics), "two topics share a number"


def test_the_page_of_the_examples_has_each_of_them_once() -> None:
    page = (REPOSITORY / "docs" / "examples.md").read_text(encoding="utf-8")
    listed = re.findall(r"^\| `([\w./]+)` \|", page, flags=re.MULTILINE)
    there = [path.name for path in EXAMPLES.iterdir() if path.is_file()]
    there += [path.name + "/" for path in EXAMPLES.iterdir() if path.is_dir() and path.name != "__pycache__"]
    assert sorted(listed) == sorted(there)
