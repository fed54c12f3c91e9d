"""Imports go down only."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from house.source import (
    ALLOWED_UPWARD,
    COMPARISON_ONLY,
    FLOORS,
    HEAVY,
    imports,
    parsed,
    python_files,
    room,
    where,
)

LEVEL = {name: height for height, floor in enumerate(reversed(FLOORS)) for name in floor}
FILES = python_files()


def test_every_room_has_a_floor() -> None:
    homeless = sorted({room(path) for path in FILES} - {"", *LEVEL})
    assert not homeless, f"give each a floor in tests/house/source.py: {homeless}"


@pytest.mark.parametrize("path", FILES, ids=where)
def test_imports_go_down_only(path: Path) -> None:
    here = room(path)
    if here not in LEVEL:
        return  # the roof may import every room; a room without a floor fails above
    wrong = []
    for line, name in imports(path):
        parts = name.split(".")
        if parts[0] != "spacearm":
            continue
        there = parts[1] if len(parts) > 1 else ""
        if there == here or (here, there) in ALLOWED_UPWARD or there == "__version__":
            continue
        if there not in LEVEL:
            wrong.append(f"line {line}: {name} comes from the roof; import it from its room")
        elif LEVEL[there] >= LEVEL[here]:
            wrong.append(f"line {line}: {here} imports {name}, which is not on a lower floor")
    assert not wrong, f"{where(path)}: " + "; ".join(wrong)


@pytest.mark.parametrize("path", FILES, ids=where)
def test_comparison_libraries_are_never_imported(path: Path) -> None:
    found = [f"line {line}: {name}" for line, name in imports(path) if name.split(".")[0] in COMPARISON_ONLY]
    assert not found, f"{where(path)} imports what is for comparison only: {found}"


def test_importing_spacearm_imports_nothing_heavy() -> None:
    program = "import json, sys, spacearm; print(json.dumps(sorted(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    loaded = {name.split(".")[0] for name in json.loads(done.stdout)}
    assert "spacearm" in loaded
    assert not loaded & HEAVY, f"import spacearm also imports {sorted(loaded & HEAVY)}"


def test_the_reader_of_imports_sees_every_form(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("house.source.PACKAGE", tmp_path)
    path = tmp_path / "robot" / "deep" / "leaf.py"
    path.parent.mkdir(parents=True)
    path.write_text(
        "import a.b as c\n"
        "from spacearm.planner import x, y\n"
        "from . import sibling\n"
        "from ..model import Robot\n"
        "from ... import cli\n"
        "def f():\n    import inside\n    importlib.import_module('by.name')\n"
        "if TYPE_CHECKING:\n    from typed import T\n"
    )
    parsed.cache_clear()
    assert {name for _, name in imports(path)} == {
        "a.b",
        "spacearm.planner.x",
        "spacearm.planner.y",
        "spacearm.robot.deep.sibling",
        "spacearm.robot.model.Robot",
        "spacearm.cli",
        "inside",
        "by.name",
        "typed.T",
    }
    assert room(path) == "robot"
