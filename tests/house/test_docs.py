"""What the pages show runs, in order; and the files and the sections that they name exist."""

from __future__ import annotations

import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from house.source import REPOSITORY
from spacearm.cli import main

PAGES = sorted((REPOSITORY / "docs").glob("*.md"))

EXAMPLES = REPOSITORY / "examples"


def arm() -> tuple[str, str]:
    """Return the URDF and SRDF of the pages' arm, of six joints."""
    return (EXAMPLES / "arm.urdf").read_text(encoding="utf-8"), (EXAMPLES / "arm.srdf").read_text(encoding="utf-8")


def blocks(page: Path) -> list[str]:
    """Return a page's Python."""
    return re.findall(r"```python\n(.*?)```", page.read_text(encoding="utf-8"), flags=re.DOTALL)


@pytest.fixture
def newcomer(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A fresh folder with a copy of the examples in it, and as it; where a newcomer runs a page."""
    shutil.copytree(EXAMPLES, tmp_path, dirs_exist_ok=True)
    shutil.copytree(EXAMPLES, tmp_path / "examples")
    monkeypatch.chdir(tmp_path)
    return tmp_path


NOT_RUN = {
    "README.md: make demo": "builds an environment",
    "README.md: make test": "builds an environment",
    "README.md: spacearm plan examples/floating.yaml -o out/floating": "some seconds; tests/planner plans all examples",
    "spacebench.md: spacearm bench space -d benchmarks/spacebench -o results": "a minute and a half",
    "spacebench.md: python -m spacearm.study.spacebench_generate FOLDER": "two minutes and a half",
    "spacebench.md: python -m spacearm.study.spacebench_generate FOLDER --seed 7 --problems 200 --families truss": "minutes",
}
"""Commands of the pages that no test runs, and why. Those of docs/benchmarks.md take minutes to hours."""
CODES = {"spacearm doctor": {0, 1}}
"""What else than 0 a command may end with: the doctor finds something."""


def lines_of(page: Path) -> list[tuple[str, str]]:
    """Return a page's Python blocks and commands, in order: ("python", a block) or ("shell", a line)."""
    text = page.read_text(encoding="utf-8")
    found = re.finditer(r"^```(\w*)\n(.*?)^```|^((?:    [^\n]*\n)+)", text, flags=re.DOTALL | re.MULTILINE)
    items = []
    for match in found:
        language, block, indented = match.groups()
        if language == "python":
            items.append(("python", block))
        elif language in ("sh", "") or indented:
            for line in (indented or block).splitlines():
                command = line.split("  #")[0].split(" # ")[0].strip()
                if re.match(r"(spacearm|python|make) ", command):
                    items.append(("shell", command))
    return items


def run_command(command: str, name: str) -> None:
    """Run a command of a page, unless a reason not to is known."""
    if f"{name}: {command}" in NOT_RUN:
        return
    words = shlex.split(command)
    if words[0] == "python":
        assert subprocess.run([sys.executable, *words[1:]], check=False).returncode == 0, command
        return
    allowed = next((codes for start, codes in CODES.items() if command.startswith(start)), {0})
    quick = ["--no-figures"] if words[1] == "plan" else []
    assert main([*words[1:], *quick]) in allowed, command


@pytest.mark.parametrize(
    "page", ["README.md", "planning.md", "robots.md", "doctor.md", "problem_file.md", "certificate.md", "study.md"]
)
def test_a_page_runs_as_a_newcomer_would_twice(page: str, newcomer: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = REPOSITORY / page if page == "README.md" else REPOSITORY / "docs" / page
    for attempt in range(2):
        names: dict[str, object] = {}
        for kind, text in lines_of(path):
            if kind == "python":
                exec(compile(text, page, "exec"), names)
            elif attempt == 0:  # a second run needs another -o, and is told so
                run_command(text, page)
    printed = capsys.readouterr().out
    if page in ("README.md", "planning.md"):
        assert "a motion was found and proven" in printed
        assert (newcomer / "plan.json").exists()
    if page == "planning.md":
        assert "holds" in printed
        assert printed.rstrip().splitlines()[-1].startswith("clearance is at least")  # of the swarm by hand


def test_what_is_not_run_is_on_a_page() -> None:
    pages = {page.name: {text for _, text in lines_of(page)} for page in (*PAGES, REPOSITORY / "README.md")}
    assert not [key for key in NOT_RUN if key.partition(": ")[2] not in pages[key.partition(": ")[0]]]


def test_the_floating_base_page_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {}
    for block in blocks(REPOSITORY / "docs" / "floating_base.md"):
        exec(compile(block, "floating_base.md", "exec"), names)
    printed = capsys.readouterr().out
    assert "15.1 degrees" in printed
    assert "fails | link 'link_7' and obstacle 'strut B'" in printed  # what was proven with the base held
    assert "penetrate by 591 mm" in printed  # the published motion
    found = [names[name] for name in ("first", "second", "reached", "slow", "caught")]
    assert [plan.status for plan in found] == ["found"] * 5
    assert all(plan.certificate.holds for plan in found)
    # What is left of a goal: the plan's own report against the trajectory, and both against the page's words.
    second, reached, slow = names["second"], names["reached"], names["slow"]
    tip = second.trajectory.tip(second.trajectory.duration)[:3, 3]
    assert abs(tip - names["goal"].position).max() < 1e-6
    assert reached.base.goal_distance < 1e-6
    assert reached.base.base_angle < 1e-6
    assert slow.base.rate <= names["gentle"].base_limits.rate * (1 + 1e-6)
    assert {path.name for path in Path().iterdir()} == {"plan.json", "base.aem", "arm.json"}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_the_files_a_page_names_exist(page: Path) -> None:
    named = re.findall(r"\]\(([^)#]+)(?:#[^)]*)?\)", page.read_text(encoding="utf-8"))
    missing = [name for name in named if not name.startswith("http") and not (page.parent / name).exists()]
    assert not missing


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_the_sections_a_page_names_exist(page: Path) -> None:
    named = re.findall(r"\]\(([^):]*)#([^)]+)\)", page.read_text(encoding="utf-8"))
    missing = [f"{name}#{anchor}" for name, anchor in named if anchor not in anchors((page.parent / name) if name else page)]
    assert not missing


def anchors(page: Path) -> set[str]:
    """Return the anchors of a page's headings, as GitHub makes them."""
    headings = re.findall(r"^#+ (.*)$", page.read_text(encoding="utf-8"), flags=re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}
