"""Where results go: nothing is overwritten, nothing is left half-written, and what remains is told."""

from __future__ import annotations

import errno
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NoReturn

import pytest

import spacearm.planner
from cli.conftest import Refused, Told
from spacearm.cli import paper_command
from spacearm.cli.results_folder import results_folder
from spacearm.core.errors import OutputError
from spacearm.study import paper_report as report

QUICK = ("--runs", 1, "--methods", "ring", "--modes", "goal")
WORK = {"paper": (paper_command, "run_experiment"), "plan": (spacearm.planner, "plan")}
"""The commands, and what does their work: the module and the name that it is taken from."""


@pytest.fixture(params=WORK)
def words(request: pytest.FixtureRequest, problem: Path) -> list[object]:
    """A command without its output folder and without figures."""
    if request.param == "plan":
        return ["plan", problem, "--seed", 0, "--no-report"]
    return ["paper", *QUICK]


def test_a_folder_that_is_not_empty_is_left_alone(words: list[object], refused: Refused, tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "report.json").write_text("mine")
    refused("output: not empty", *words, "-o", tmp_path / "out")


def test_a_folder_with_a_hidden_file_is_not_empty(refused: Refused, words: list[object], tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / ".keep").touch()
    refused("output: not empty", *words, "-o", tmp_path / "out")


def test_a_file_is_no_folder(words: list[object], refused: Refused, tmp_path: Path) -> None:
    (tmp_path / "out").write_text("mine")
    refused(("<path>/out is a file", "expected a folder", "-o"), *words, "-o", tmp_path / "out")
    refused(("<path>/out/here cannot be written", "Not a directory"), *words, "-o", tmp_path / "out" / "here")


def test_a_link_to_nowhere_is_refused(words: list[object], refused: Refused, tmp_path: Path) -> None:
    (tmp_path / "out").symlink_to(tmp_path / "nowhere")
    refused(("<path>/out cannot be written", "File exists"), *words, "-o", tmp_path / "out")


def test_an_empty_or_new_folder_is_taken_with_its_parents(words: list[object], told: Told, tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    for folder in (tmp_path / "empty", tmp_path / "a" / "b"):
        assert told([*words, "-o", folder])[0] == 0
        assert any(folder.iterdir())


def test_a_folder_that_cannot_be_made_is_refused(
    words: list[object], refused: Refused, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def denied(*_: object, **__: object) -> NoReturn:
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))

    monkeypatch.setattr(os, "mkdir", denied)
    refused(("<path>/out cannot be written", "Permission denied"), *words, "-o", tmp_path / "out")


def test_a_folder_that_cannot_be_written_is_refused_before_any_work(
    words: list[object], refused: Refused, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    real = os.open

    def read_only(path: Any, *rest: Any, **named: Any) -> int:
        if str(path).startswith(str(tmp_path / "out")):
            raise OSError(errno.EROFS, os.strerror(errno.EROFS))
        return real(path, *rest, **named)

    def worked(*_: object, **__: object) -> NoReturn:
        raise AssertionError("the work was begun")

    monkeypatch.setattr(os, "open", read_only)
    monkeypatch.setattr(*WORK[str(words[0])], worked)
    (tmp_path / "out").mkdir()
    refused(("<path>/out cannot be written", "Read-only file system", "-o"), *words, "-o", tmp_path / "out")


def full_from(call: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the disk be full from the n-th file on."""
    calls = 0
    real = os.fsync

    def fsync(handle: int) -> None:
        nonlocal calls
        calls += 1
        if calls >= call:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        real(handle)

    monkeypatch.setattr(os, "fsync", fsync)


def test_a_full_disk_leaves_nothing(
    words: list[object], refused: Refused, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    full_from(1, monkeypatch)
    refused(
        ("<path>/a/out/", "cannot be written (No space left on device)", "another place"), *words, "-o", tmp_path / "a" / "out"
    )


def test_a_disk_that_fills_up_later_leaves_whole_files_and_says_which(
    words: list[object], told: Told, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    full_from(2, monkeypatch)
    code, out, err = told([*words, "-o", tmp_path / "out"])
    whole, failed = {"paper": ("report.json", "table3.md"), "plan": ("plan.json", "trajectory.csv")}[str(words[0])]
    folder = tmp_path / "out"
    assert (code, out) == (2, "")
    assert err == (
        f"spacearm: {folder / failed} cannot be written (No space left on device); free space there or choose another place; "
        f"{folder} keeps what was finished: {whole}\n"
    )
    assert [path.name for path in folder.iterdir()] == [whole]
    json.loads((folder / whole).read_text())


def test_a_disk_that_fills_up_during_the_figures_leaves_the_report(
    told: Told, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    full_from(5, monkeypatch)
    folder = tmp_path / "out"
    code, out, err = told(["paper", *QUICK, "--figures", "-o", folder])
    assert (code, out) == (2, "")
    assert err == (
        f"spacearm: {folder / 'figures' / 'figure4_ring.png'} cannot be written (No space left on device); free space there "
        f"or choose another place; {folder} keeps what was finished: report.html, report.json, table3.md and 1 more\n"
    )
    assert sorted(path.name for path in folder.rglob("*")) == ["report.html", "report.json", "table3.md", "timings.json"]


@pytest.fixture
def mounted(tmp_path: Path) -> Iterator[Path]:
    """A file system of 64 kB, where we may mount one."""
    place = tmp_path / "small"
    place.mkdir()
    command = ["mount", "-t", "tmpfs", "-o", "size=64k", "none", str(place)]
    try:
        done = subprocess.run(command, capture_output=True, check=False)
    except FileNotFoundError:
        pytest.skip("there is no mount")
    if done.returncode:
        pytest.skip("mounting is not permitted")
    try:
        yield place
    finally:
        subprocess.run(["umount", str(place)], check=True)


def test_a_real_disk_that_is_full_leaves_no_half_file(told: Told, mounted: Path) -> None:
    (mounted / "filler").write_bytes(b"x" * 56 * 1024)
    code, out, err = told(["paper", *QUICK, "-o", mounted / "out"])
    assert (code, out) == (2, "")
    assert err.startswith(f"spacearm: {mounted}/out/report.json cannot be written (No space left on device)")
    assert sorted(path.name for path in mounted.rglob("*")) == ["filler"]


def test_a_real_disk_that_is_read_only_is_refused(told: Told, mounted: Path, problem: Path) -> None:
    subprocess.run(["mount", "-o", "remount,ro", str(mounted)], check=True)
    code, out, err = told(["plan", problem, "-o", mounted])
    assert (code, out) == (2, "")
    assert err == f"spacearm: {mounted} cannot be written (Read-only file system); choose another with -o\n"


def interrupted(*_: object, **__: object) -> NoReturn:
    raise KeyboardInterrupt


def test_ctrl_c_during_the_work_leaves_nothing(
    words: list[object], told: Told, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(*WORK[str(words[0])], interrupted)
    before = list(tmp_path.iterdir())
    found = told([*words, "-o", tmp_path / "a" / "out"])
    assert found == (130, "", "spacearm: interrupted; nothing was written\n")
    assert list(tmp_path.iterdir()) == before


def test_ctrl_c_during_the_figures_leaves_the_report(told: Told, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(report, "save_figures", interrupted)
    folder = tmp_path / "out"
    code, out, err = told(["paper", *QUICK, "--figures", "-o", folder])
    kept = "report.html, report.json, table3.md and 1 more"
    assert (code, out, err) == (130, "", f"spacearm: interrupted; {folder} keeps what was finished: {kept}\n")


def test_a_folder_that_was_there_stays_when_nothing_is_written(tmp_path: Path) -> None:
    with pytest.raises(OutputError), results_folder(tmp_path):
        raise OutputError("no")
    assert tmp_path.is_dir()


def test_what_another_put_there_meanwhile_stays(tmp_path: Path) -> None:
    def work() -> None:
        with results_folder(tmp_path / "out") as folder:
            (folder / "theirs").touch()
            (folder / "empty").mkdir()
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        work()
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["theirs"]


# A shell may start us with Ctrl-C ignored, which children inherit.
PROGRAM = """
import signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)
from spacearm.cli import main
sys.exit(main())
"""


@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
def test_sigint_ends_a_long_run_in_one_line(tmp_path: Path) -> None:
    folder = tmp_path / "out"
    command = [sys.executable, "-c", PROGRAM, "paper", "--runs", "100000", "--threads", "1", "-o", str(folder)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as running:
        try:
            while not folder.exists() and running.poll() is None:
                time.sleep(0.05)
            time.sleep(0.5)  # into the search, which would take many minutes
            running.send_signal(signal.SIGINT)
            out, err = running.communicate(timeout=60)
        finally:
            running.kill()
    assert (running.returncode, out, err) == (130, "", "spacearm: interrupted; nothing was written\n")
    assert not folder.exists()
