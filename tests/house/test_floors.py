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
    imports_of,
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


def test_imports_go_down_only() -> None:
    wrong = []
    for path in FILES:
        here = room(path)
        if here not in LEVEL:
            continue  # the roof may import every room; a room without a floor fails above
        for line, name in imports_of(path):
            there = [*name.split("."), ""][1] if name.startswith("spacearm") else here
            if there == here or (here, there) in ALLOWED_UPWARD or there == "__version__":
                continue
            if there not in LEVEL:
                wrong.append(f"{where(path)}:{line}: {name} comes from the roof; import it from its room")
            elif LEVEL[there] >= LEVEL[here]:
                wrong.append(f"{where(path)}:{line}: {here} imports {name}, which is not on a lower floor")
    assert not wrong, "\n".join(wrong)


def test_comparison_libraries_are_never_imported() -> None:
    named = [(path, line, name) for path in FILES for line, name in imports_of(path)]
    found = [f"{where(path)}:{line}: {name}" for path, line, name in named if name.split(".")[0] in COMPARISON_ONLY]
    assert not found, "these are for comparison only:\n" + "\n".join(found)


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
