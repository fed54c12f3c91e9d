"""The page's program in the package is what its sources in web/ give, and it carries the licences of what it contains."""

from __future__ import annotations

import json
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path

import pytest

WEB = Path(__file__).parents[2] / "web"
COMMITTED = Path(__file__).parents[2] / "src" / "spacearm" / "report" / "page"
PARTS = ("report.js", "report.css", "LICENCES.txt")


def run(command: Sequence[str], folder: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=300, check=False)


def locked(package: str) -> str:
    """The version of a package in the lock file."""
    return json.loads((WEB / "package-lock.json").read_text(encoding="utf-8"))["packages"][f"node_modules/{package}"]["version"]


def installed(folder: Path) -> bool:
    """Whether the packages in a folder are those of the lock file."""
    files = {name: folder / "node_modules" / name / "package.json" for name in ("esbuild", "three", "uplot", "typescript")}
    return all(
        file.is_file() and json.loads(file.read_text("utf-8"))["version"] == locked(name) for name, file in files.items()
    )


@pytest.fixture(scope="module")
def web(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the sources with their packages; where they are not installed, a copy with them."""
    if not shutil.which("node") or not shutil.which("npm"):
        pytest.skip("no node or no npm: install Node.js to compare the page's program with its sources")
    if installed(WEB):
        return WEB
    copy = tmp_path_factory.mktemp("web") / "web"
    shutil.copytree(WEB, copy, ignore=shutil.ignore_patterns("node_modules"))
    done = run(["npm", "ci", "--ignore-scripts", "--no-audit", "--no-fund"], copy)
    if done.returncode:
        pytest.skip(f"npm ci cannot install the packages of web/: {done.stderr.strip()[-300:]}")
    return copy


def test_the_committed_program_is_what_its_sources_give(web: Path, tmp_path: Path) -> None:
    done = run(["node", "build.mjs", str(tmp_path)], web)
    assert done.returncode == 0, done.stderr
    for name in PARTS:
        same = (tmp_path / name).read_bytes() == (COMMITTED / name).read_bytes()
        assert same, (
            f"{name} differs from its sources in web/: run `npm ci --ignore-scripts && npm run build` there, and commit"
        )


def test_the_sources_have_the_types_that_they_say(web: Path) -> None:
    done = run([str(web / "node_modules" / ".bin" / "tsc"), "--noEmit"], web)
    assert done.returncode == 0, done.stdout


def test_the_program_comes_with_its_licences_and_asks_for_nothing_else() -> None:
    licences = (COMMITTED / "LICENCES.txt").read_text(encoding="utf-8")
    for package in ("three", "uplot"):
        assert f"{package} {locked(package)} (" in licences
    style = (COMMITTED / "report.css").read_text(encoding="utf-8")
    assert "url(" not in style
    assert "@import" not in style
    assert sum((COMMITTED / name).stat().st_size for name in PARTS) < 900_000
