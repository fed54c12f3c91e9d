"""Every page runs as a newcomer would run it: in a fresh folder, in the order of the page, with the files that it names.

A page starts where a newcomer does, in the root of the repository. Blocks are run by their language:

- python: all blocks of a page share their names. A comment `# -> text` is what the line prints; `...` stands for anything.
- sh: `spacearm` runs in this process; `cp`, `cd` and `python` run as in a shell; `make` is left out. A comment
  names an exit code other than 0, as in `# exit code 1`.
- yaml: a problem or robot file, saved under the name in its first line (else problem.yaml) and loaded. A block without the key
  `spacearm` replaces keys of the page's first problem.
- text: directly below a sh block it is what the last command prints; elsewhere it is only shown.
- {name}: a directive of the site, which only its build reads.

The comment `<!-- not run: reason -->` above a block leaves it out. Readers do not see it.
"""

from __future__ import annotations

import contextlib
import io
import os
import re
import shlex
import shutil
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, get_args, get_type_hints

import pytest
import yaml

from house.source import PACKAGE, REPOSITORY, repository_files, where
from spacearm.cli import main
from spacearm.doctor import Finding
from spacearm.errors import SpacearmError
from spacearm.files.problem_file import load_problem_file
from spacearm.planner.plan_result import STATUSES
from spacearm.proof import Certificate
from spacearm.robot import load_robot
from spacearm.swarm.ask_tell import MESSAGES

PAGES = [REPOSITORY / "README.md", REPOSITORY / "CONTRIBUTING.md", *sorted((REPOSITORY / "docs").rglob("*.md"))]
STARTED_WITH = ("examples", "benchmarks/spacebench")
"""What the pages need of the repository."""
MOST_BLOCKS_NOT_RUN = 9
BLOCK = re.compile(
    r"(?:^<!-- not run: (?P<reason>[^\n]+) -->\n)?^```(?P<language>[\w{}-]*)(?: [^\n]*)?\n(?P<text>.*?)^```$",
    flags=re.DOTALL | re.MULTILINE,
)


@dataclass(frozen=True)
class Block:
    """A block of a page.

    Attributes:
        language: after the fence; "" if none.
        text: of the block.
        reason: why it is not run; None if it is.
        follows: whether nothing stands between this block and the one before it.
    """

    language: str
    text: str
    reason: str | None
    follows: bool


def blocks_of(page: Path) -> list[Block]:
    """Return a page's blocks in order."""
    text = page.read_text(encoding="utf-8")
    found, end = [], 0
    for match in BLOCK.finditer(text):
        follows = bool(found) and not text[end : match.start()].strip()
        found.append(Block(match["language"], match["text"], match["reason"], follows))
        end = match.end()
    return found


def is_run(block: Block) -> bool:
    """Whether a block does anything when its page is run."""
    return block.reason is None and block.language in ("python", "sh", "yaml")


def name_of(page: Path) -> str:
    """Return what a test of a page is called: its path, without docs."""
    return page.relative_to(REPOSITORY).as_posix().removeprefix("docs/")


def commands_of(text: str) -> list[tuple[str, int]]:
    """Return the commands of a sh block, each with its exit code; lines that end in a backslash go on."""
    found = []
    for line in text.replace("\\\n", " ").splitlines():
        command, _, comment = line.partition("#")
        stated = re.search(r"exit code (\d+)", comment)
        found += [(part.strip(), int(stated[1]) if stated else 0) for part in command.split("&&") if part.strip()]
    return found


def matches(expected: str, printed: str) -> bool:
    """Whether a text is what was printed, up to white space; `...` stands for anything."""
    parts = [r"\s+".join(re.escape(word) for word in part.split()) for part in expected.split("...")]
    return re.search(r"[\s\S]*?".join(parts), printed) is not None


@dataclass
class PageRun:
    """A run of one page: what its blocks share.

    Attributes:
        page: the page.
        names: of its Python.
        problem: its first complete problem file.
        printed: by the last block or command.
    """

    page: Path
    names: dict[str, object] = field(default_factory=dict)
    problem: dict[str, Any] = field(default_factory=dict)
    printed: str = ""

    def run(self, block: Block) -> None:
        """Run a block by its language."""
        if block.language == "python":
            self._python(block.text)
        elif block.language == "sh":
            for command, code in commands_of(block.text):
                self._command(shlex.split(command), code)
        elif block.language == "yaml":
            self._file(block.text)
        elif block.language == "text" and block.follows:
            assert matches(block.text, self.printed), f"the page shows\n{block.text}\nprinted was\n{self.printed}"

    def _python(self, text: str) -> None:
        with contextlib.redirect_stdout(io.StringIO()) as out:
            exec(compile(text, self.page.name, "exec"), self.names)
        self.printed = out.getvalue()
        for stated in re.findall(r"# -> (.+)$", text, flags=re.MULTILINE):
            assert matches(stated, self.printed), f"the page says {stated!r}, printed was\n{self.printed}"

    def _command(self, words: list[str], code: int) -> None:
        if words[0] == "make":
            return
        if words[0] == "cd":
            os.chdir(words[1])
        elif words[0] == "spacearm":
            with contextlib.redirect_stdout(io.StringIO()) as out:
                assert main(words[1:]) == code, (words, out.getvalue())
            self.printed = out.getvalue()
        else:
            assert words[0] in ("python", "cp"), f"no test runs {words}"
            program = sys.executable if words[0] == "python" else words[0]
            assert subprocess.run([program, *words[1:]], check=False).returncode == code, words

    def _file(self, text: str) -> None:
        named = re.match(r"# (\S+\.yaml)\n", text)
        path = Path(named[1] if named else "problem.yaml")
        value = yaml.safe_load(text)
        if "spacearm-robot" in value:
            path.write_text(text, encoding="utf-8")
            load_robot(path)
            return
        if "spacearm" not in value:
            lacking = {key: kept for key, kept in self.problem.items() if key not in value and f"{key}_deg" not in value}
            text, path = text + yaml.safe_dump(lacking), Path("changed.yaml")
        elif not self.problem:
            self.problem = value
        path.write_text(text, encoding="utf-8")
        load_problem_file(path)


@pytest.fixture
def newcomer(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a fresh folder with the files of the repository that pages need, and work in it."""
    for name in STARTED_WITH:
        shutil.copytree(REPOSITORY / name, tmp_path / name)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("page", [page for page in PAGES if any(is_run(block) for block in blocks_of(page))], ids=name_of)
def test_a_page_runs_as_a_newcomer_would(page: Path, newcomer: Path) -> None:
    run = PageRun(page)
    for block in blocks_of(page):
        if block.reason is None:
            run.run(block)


def test_python_of_a_page_runs_again_in_the_same_folder(newcomer: Path) -> None:
    shutil.copytree(newcomer / "examples", newcomer, dirs_exist_ok=True)
    run = PageRun(REPOSITORY / "docs" / "planning.md")
    for _ in range(2):
        for block in blocks_of(run.page):
            if block.language == "python":
                run.run(block)


def test_few_blocks_are_not_run() -> None:
    left_out = [(page.name, block.reason) for page in PAGES for block in blocks_of(page) if block.reason]
    assert len(left_out) <= MOST_BLOCKS_NOT_RUN, left_out


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_no_command_hides_in_an_indented_block(page: Path) -> None:
    text = BLOCK.sub("", page.read_text(encoding="utf-8"))
    assert not re.findall(r"^    (?:spacearm|python|\$) .*$", text, flags=re.MULTILINE)


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_the_files_a_page_names_exist(page: Path) -> None:
    named = re.findall(r"\]\(([^)#]+)(?:#[^)]*)?\)", page.read_text(encoding="utf-8"))
    missing = [name for name in named if not name.startswith("http") and not (page.parent / name).exists()]
    assert not missing


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_the_sections_a_page_names_exist(page: Path) -> None:
    named = re.findall(r"\]\(([^):]*)#([^)]+)\)", page.read_text(encoding="utf-8"))
    missing = [f"{name}#{anchor}" for name, anchor in named if anchor not in anchors((page.parent / name) if name else page)]
    assert not missing


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_the_source_files_a_page_names_exist(page: Path) -> None:
    text = BLOCK.sub("", page.read_text(encoding="utf-8"))
    named = {name for name in re.findall(r"`([\w/]+\.(?:py|hpp|cpp))`", text) if name != "utils.py"}
    known = [f"/{where(path)}" for path in repository_files()]
    missing = sorted(name for name in named if not any(path.endswith(f"/{name.removeprefix('spacearm/')}") for path in known))
    assert not missing


@pytest.mark.parametrize("command", ["plan", "certify", "robustness", "doctor", "paper", "bench"])
def test_the_command_line_page_has_every_option_once(command: str) -> None:
    text = (REPOSITORY / "docs" / "command_line.md").read_text(encoding="utf-8")
    section = text.split(f"\n## {command}\n")[1].split("\n## ")[0]
    listed = [option for row in re.findall(r"^\| (`-.*?) \|", section, re.MULTILINE) for option in re.findall(r"--[\w-]+", row)]
    stated: set[str] = set()
    for which in (["mbm"], ["space"]) if command == "bench" else ([],):
        with contextlib.redirect_stdout(io.StringIO()) as out:
            assert main([command, *which, "--help"]) == 0
        stated |= set(re.findall(r"^ +(?:-\w(?: \S+)?, )?(--\w[\w-]*)", out.getvalue(), re.MULTILINE)) - {"--help"}
    assert sorted(listed) == sorted(stated)


STOP = re.compile(r"^\d+\. `([\w/]+\.(?:py|hpp))`: ((?:`\w+`(?:, )?)+)", flags=re.MULTILINE)


def walks() -> dict[str, list[tuple[str, list[str]]]]:
    """Return the walks of the guided tour: of each stop the file and the names to read there."""
    tour = (REPOSITORY / "CONTRIBUTING.md").read_text(encoding="utf-8").split("## A guided tour")[1].split("\n## ")[0]
    parts = dict(part.split("\n", 1) for part in tour.split("\n### ")[1:])
    return {name: [(path, re.findall(r"`(\w+)`", names)) for path, names in STOP.findall(text)] for name, text in parts.items()}


def test_the_stops_of_the_guided_tour_are_there() -> None:
    for stops in walks().values():
        for path, names in stops:
            text = ((REPOSITORY if path.startswith("kernel/") else PACKAGE) / path).read_text(encoding="utf-8")
            missing = [name for name in names if not re.search(rf"\b(?:def|class|struct|void) {name}\b", text)]
            assert not missing, path


def test_a_walk_of_the_guided_tour_has_at_most_20_stops_in_8_rooms() -> None:
    assert len(walks()) == 2
    for stops in walks().values():
        assert 10 <= len(stops) <= 20
        assert len({path.split("/")[0] for path, _ in stops}) <= 8


def anchors(page: Path) -> set[str]:
    """Return the anchors of a page's headings, as GitHub makes them."""
    text = BLOCK.sub("", page.read_text(encoding="utf-8"))
    headings = re.findall(r"^#+ (.*)$", text, flags=re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


def test_why_did_it_fail_explains_every_status() -> None:
    text = (REPOSITORY / "docs" / "faq.md").read_text(encoding="utf-8")
    headings = set(re.findall(r"^### (\w+)$", text, flags=re.MULTILINE))
    certificates = get_args(get_type_hints(Certificate)["status"])
    assert sorted([*STATUSES, *certificates]) == sorted(headings)
    rows = set(re.findall(r"^\| `?(\w+)`? \|", text, flags=re.MULTILINE))
    rows |= {code for row in re.findall(r"^\| (\d[\d, ]*) \|", text, flags=re.MULTILINE) for code in row.split(", ")}
    assert {*MESSAGES, "0", "1", "2", "3", "130", "143", *(leaf.__name__ for leaf in SpacearmError.__subclasses__())} <= rows
    for severity in get_args(get_type_hints(Finding)["severity"]):
        assert f"*{severity}*" in text


def test_the_reference_has_every_public_name_once() -> None:
    stub = (PACKAGE / "__init__.pyi").read_text(encoding="utf-8")
    public = [*re.findall(r"^from \S+ import \w+ as (\w+)$", stub, flags=re.MULTILINE), "__version__"]
    pages = [page.read_text(encoding="utf-8") for page in sorted((REPOSITORY / "docs" / "reference").glob("*.md"))]
    listed = [
        name
        for text in pages
        for name in re.findall(r"^\.\. (?:auto|py:)\w+:: (?:spacearm\.)?(\w+)$", text, flags=re.MULTILINE)
    ]
    assert sorted(listed) == sorted(public), "a new public name belongs on a page of docs/reference"
