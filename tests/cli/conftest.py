"""Commands run in this process: what they print, and how wrong input is held to one sentence."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import pytest

from spacearm.cli import main
from support.messages import assert_sentence

PROBLEM = """\
spacearm: 1
robot: zhang2022
scene:
  - sphere: {center: [0.5, 0.5, 0.0], radius: 0.1}
start: [0, 0, 0, 0, 0, 0, 0]
goal: {configuration: [1, 0, 0, 0, 0, 0, 0]}
"""

Told = Callable[[Sequence[object]], tuple[int, str, str]]
Refused = Callable[..., None]


@pytest.fixture(autouse=True)
def few_dots(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the figures of commands in this process have few dots: tests/show looks at the figures."""
    monkeypatch.setattr("spacearm.show.figure_style.DPI", 40)


@pytest.fixture
def told(capsys: pytest.CaptureFixture[str]) -> Told:
    """Run a command; return its exit code, stdout and stderr."""

    def run(arguments: Sequence[object]) -> tuple[int, str, str]:
        code = main([str(argument) for argument in arguments])
        captured = capsys.readouterr()
        return code, captured.out, captured.err

    return run


@pytest.fixture
def refused(told: Told, tmp_path: Path) -> Refused:
    """Hold a command to: exit code 2, one sentence on stderr, nothing on stdout or on disk.

    Given a case's name, the sentence is the one of the table, word for word; given parts, the sentence holds each of them.
    """

    def check(wanted: str | tuple[str, ...], *arguments: object) -> None:
        before = _contents(tmp_path)
        code, out, err = told(arguments)
        assert (code, out) == (2, ""), err
        assert err.startswith("spacearm: ")
        assert err.endswith("\n")
        assert err.count("\n") == 1
        sentence = err.removeprefix("spacearm: ").removesuffix("\n").replace(str(tmp_path), "<path>")
        if isinstance(wanted, str):
            assert_sentence("cli", wanted, sentence)
        else:
            assert not [part for part in wanted if part not in sentence], sentence
        assert _contents(tmp_path) == before

    return check


@pytest.fixture
def problem(tmp_path: Path) -> Path:
    """Return a problem file that is solved at once."""
    path = tmp_path / "problem.yaml"
    path.write_text(PROBLEM)
    return path


def _contents(folder: Path) -> dict[str, bytes | None]:
    """Return all files with their bytes, and folders with None."""
    return {str(path.relative_to(folder)): path.read_bytes() if path.is_file() else None for path in folder.rglob("*")}
