"""The command as a process: what it loads, its streams, and a kernel that cannot be."""

from __future__ import annotations

import contextlib
import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from house.source import HEAVY
from spacearm import cli
from spacearm.cli.terminal import show_table

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="pipes and terminals of POSIX")
SPACEARM = (sys.executable, "-m", "spacearm.cli")


def run(*words: str, program: tuple[str, ...] = SPACEARM, kernel: str = "") -> tuple[int, str, str]:
    environment = {**os.environ, "SPACEARM_KERNEL": kernel}
    done = subprocess.run([*program, *words], capture_output=True, text=True, check=False, env=environment)
    return done.returncode, done.stdout, done.stderr


def loaded_by(*words: str) -> set[str]:
    """Return the modules loaded once a command is done."""
    program = (
        "import contextlib, io, json, sys\n"
        "from spacearm.cli import main\n"
        "with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):\n"
        f"    main({list(words)!r})\n"
        "print(json.dumps(sorted(sys.modules)))"
    )
    code, out, err = run(program=(sys.executable, "-c", program))
    assert code == 0, err
    return {name.split(".")[0] for name in json.loads(out)}


@pytest.mark.parametrize("words", [("--help",), ("-h",), ()])
def test_help_loads_nothing_heavy(words: tuple[str, ...]) -> None:
    assert not loaded_by(*words) & (HEAVY | {"numpy"})


@pytest.mark.parametrize(
    "words", [("--version",), ("paper", "--help"), ("plan", "--help"), ("plna",), ("plan", "no.yaml", "-o", "x")]
)
def test_a_command_that_draws_nothing_loads_nothing_to_draw(words: tuple[str, ...]) -> None:
    assert not loaded_by(*words) & (HEAVY - {"tyro"})


@pytest.mark.parametrize("words", [("--version",), ("paper", "-o", "out"), ("plan", "problem.yaml", "-o", "out")])
@pytest.mark.parametrize("kernel", ["nonsense", "x86_64-v3", "-1", "x\ny"])
def test_a_kernel_that_is_none_is_refused_in_one_sentence(
    words: tuple[str, ...], kernel: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    code, out, err = run(*words, kernel=kernel)
    assert (code, out) == (2, "")
    assert err.startswith(f"spacearm: SPACEARM_KERNEL={kernel!r} is not a kernel level, expected one or none set; ")
    assert err.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_a_kernel_level_nearly_right_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    assert "did you mean 'generic'?" in run("--version", kernel="generik")[2]


def test_a_kernel_that_is_none_is_a_kernel_error_in_the_library() -> None:
    program = (
        "import spacearm\n"
        "try:\n    spacearm.plan\n"
        "except spacearm.SpacearmError as error:\n    print(type(error).__name__, error)"
    )
    code, out, err = run(program=(sys.executable, "-c", program), kernel="nonsense")
    assert (code, err) == (0, "")
    assert out.startswith("KernelError SPACEARM_KERNEL='nonsense' is not a kernel level")


def test_a_reader_that_has_gone_is_no_error() -> None:
    read, write = os.pipe()
    os.close(read)
    try:
        done = subprocess.run([*SPACEARM, "paper", "--help"], stdout=write, stderr=subprocess.PIPE, check=False)
    finally:
        os.close(write)
    assert (done.returncode, done.stderr) == (0, b"")


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="there is no /dev/full")
def test_output_onto_a_full_disk_is_told() -> None:
    with open("/dev/full", "w") as full:
        done = subprocess.run([*SPACEARM, "--help"], stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    assert done.returncode == 2
    assert done.stderr == (
        "spacearm: the output cannot be written (No space left on device); free space there or send it elsewhere\n"
    )


def test_our_own_error_is_told_from_no_plan(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(_: object) -> int:
        raise ZeroDivisionError

    monkeypatch.setattr(cli, "_run", broken)
    assert cli.main([]) == 3
    out, err = capsys.readouterr()
    assert out == ""
    assert err.splitlines()[-1].startswith("spacearm: this is an error of spacearm itself")


def in_a_terminal(command: list[str], columns: int) -> str:
    """Return what a terminal shows of a command, both streams, with the control sequences taken out."""
    import fcntl
    import pty
    import struct
    import termios

    master, slave = pty.openpty()
    fcntl.ioctl(slave, termios.TIOCSWINSZ, struct.pack("HHHH", 24, columns, 0, 0))
    environment = {key: value for key, value in os.environ.items() if key not in ("COLUMNS", "LINES", "NO_COLOR")}
    with subprocess.Popen(command, stdin=slave, stdout=slave, stderr=slave, env={**environment, "TERM": "xterm"}) as running:
        os.close(slave)
        seen = b""
        with contextlib.suppress(OSError):  # Linux's end of file
            while chunk := os.read(master, 65536):
                seen += chunk
    os.close(master)
    assert running.returncode == 0
    return re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", seen.decode())


AT_ONCE = "import sys; from spacearm.cli import main, progress; progress.QUIET = progress._EVERY = 0.01; sys.exit(main())"
"""A program that shows progress from the beginning, however quick the machine is."""


def test_a_terminal_shows_a_bar_and_tables_that_fit(tmp_path: Path) -> None:
    command = [sys.executable, "-c", AT_ONCE, "paper", "-o", str(tmp_path / "out"), "--methods", "pso", "ring-forgiving"]
    shown = in_a_terminal([*command, "--runs", "40", "--modes", "goal"], columns=80)
    bars = [line.rstrip() for line in re.split(r"[\r\n]+", shown) if line.startswith("runs ")]
    assert any("%" in bar for bar in bars)
    assert any("pso, goal, A_R 0.1 m" in bar for bar in bars)
    assert max(map(len, bars)) <= 80
    lines = shown.replace("\r", "").splitlines()
    rows = [line for line in lines if re.match(r"(pso|ring-forgiving|paper: I?PSO) ", line)]
    assert len(rows) == 4
    assert max(map(len, rows)) <= 80


def test_a_table_is_set_closer_where_the_terminal_is_narrow(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.stdout.isatty", lambda: True, raising=False)
    seen = []
    for columns in ("10", "80"):
        monkeypatch.setenv("COLUMNS", columns)
        show_table("title", ("name", "to 4"), [("ab", "12345"), ("abcd", "")])
        seen.append(re.sub(r"\x1b\[[0-9;]*m", "", capsys.readouterr().out))
    assert [line.rstrip() for line in seen[0].splitlines()] == [
        "title",
        "        to",
        "name     4",
        "-" * 10,
        "ab   12345",
        "abcd",
        "",
    ]
    assert [line.rstrip() for line in seen[1].splitlines()] == [
        "title",
        "         to",
        "name      4",
        "-" * 11,
        "ab    12345",
        "abcd",
        "",
    ]
