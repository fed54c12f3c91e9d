"""Ctrl-C and SIGTERM wherever they come: exit code 130 or 143, one line, nothing half written."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import spacearm.cli.stopping
import spacearm.files
import spacearm.planner
from cli.conftest import Told
from spacearm import cli
from spacearm.cli.stopping import was_interrupted
from spacearm.core.output import CLAIM
from spacearm.planner import planning
from spacearm.planner.motion_search import Islands

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
LATEST = 30.0  # [s]
AGAIN = 0.1  # [s]


def stop(number: int = signal.SIGINT) -> None:
    os.kill(os.getpid(), number)


def wait() -> None:
    """Work that goes on until an exception comes."""
    until = time.monotonic() + LATEST
    while time.monotonic() < until:
        time.sleep(0.01)
    raise AssertionError("the interrupt was lost")


def passed_on() -> None:
    stop()
    wait()


def swallowed_by_a_finalizer() -> None:
    class Dying:
        def __del__(self) -> None:
            stop()

    thing: Any = Dying()
    del thing
    wait()


def swallowed_by_others() -> None:
    try:
        stop()
        wait()
    except:  # noqa: E722  as code of others does
        pass
    wait()


def tripped_over() -> None:
    try:
        stop()
        wait()
    finally:
        raise AttributeError("'Stream' object has no attribute 'pos'")


def raised_as_ours() -> None:
    from spacearm.core.errors import FileFormatError

    try:
        stop()
        wait()
    except KeyboardInterrupt:
        raise FileFormatError("it cannot be read") from None


def ended_all_the_same() -> None:
    try:
        stop()
        wait()
    except KeyboardInterrupt:
        pass


WAYS = (passed_on, swallowed_by_a_finalizer, swallowed_by_others, tripped_over, raised_as_ours, ended_all_the_same)


@pytest.mark.parametrize("way", WAYS, ids=lambda way: way.__name__)
def test_an_interrupt_ends_a_command_with_130(
    way: Callable[[], None], told: Told, tmp_path: Path, problem: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    real = spacearm.files.save_plan

    def save(*given: Any) -> None:
        real(*given)
        way()

    monkeypatch.setattr(spacearm.files, "save_plan", save)
    out = tmp_path / "out"
    code, shown, err = told(["plan", problem, "-o", out, "--no-report"])
    assert code == 130
    if way is ended_all_the_same:
        assert err == "spacearm: interrupted; the command had finished\n"
        assert sorted(path.name for path in out.iterdir()) == ["plan.json", "trajectory.csv"]
    else:
        assert (shown, err) == ("", f"spacearm: interrupted; {out} keeps what was finished: plan.json\n")
        assert [path.name for path in out.iterdir()] == ["plan.json"]
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    assert signal.getsignal(signal.SIGALRM) is signal.SIG_DFL
    assert not was_interrupted()


def test_sigterm_ends_a_command_with_143(told: Told, monkeypatch: pytest.MonkeyPatch) -> None:
    def work(_: object) -> int:
        stop(signal.SIGTERM)
        wait()
        return 0

    monkeypatch.setattr(cli, "_run", work)
    assert told([]) == (143, "", "spacearm: interrupted; nothing was written\n")
    assert signal.getsignal(signal.SIGTERM) is signal.SIG_DFL


def test_an_interrupt_while_a_figure_is_drawn_waits_for_it(
    told: Told, tmp_path: Path, problem: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from matplotlib.figure import Figure

    real = Figure.savefig
    drawn = []

    def savefig(self: Figure, *given: Any, **named: Any) -> None:
        stop()
        real(self, *given, **named)
        drawn.append(named["format"])

    monkeypatch.setattr(Figure, "savefig", savefig)
    out = tmp_path / "out"
    code, _, err = told(["plan", problem, "-o", out, "--figures"])
    assert code == 130
    assert err.startswith(f"spacearm: interrupted; {out} keeps what was finished: plan.json, report.html, trajectory.csv")
    assert drawn == ["png", "pdf"]
    assert not [path.name for path in out.iterdir() if path.name.startswith(".")]


def test_a_plan_that_was_interrupted_is_written_and_the_code_is_130(
    told: Told, tmp_path: Path, problem: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from dataclasses import replace

    real = spacearm.planner.plan
    monkeypatch.setattr(spacearm.planner, "plan", lambda *given, **named: replace(real(*given, **named), interrupted=True))
    out = tmp_path / "out"
    code, _, err = told(["plan", problem, "-o", out])
    assert (code, err) == (130, f"spacearm: interrupted; {out} keeps what was finished: plan.json, trajectory.csv\n")


def test_an_interrupt_that_plan_took_is_not_repeated_while_the_plan_is_saved(
    told: Told, tmp_path: Path, problem: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The search is interrupted; the proof and the saving then take longer than the time after which a signal is repeated."""
    search, proof, save = Islands.run, planning.certify, spacearm.files.save_plan

    def searched(*given: Any, **budget: Any) -> None:
        search(*given, **budget)
        stop()
        wait()

    def slow(work: Callable[..., Any]) -> Callable[..., Any]:
        def worked(*given: Any, **named: Any) -> Any:
            time.sleep(3 * AGAIN)
            return work(*given, **named)

        return worked

    monkeypatch.setattr(spacearm.cli.stopping, "_AGAIN", AGAIN)
    monkeypatch.setattr(Islands, "run", searched)
    monkeypatch.setattr(planning, "certify", slow(proof))
    monkeypatch.setattr(spacearm.files, "save_plan", slow(save))
    out = tmp_path / "out"
    code, _, err = told(["plan", problem, "-o", out])
    assert (code, err) == (130, f"spacearm: interrupted; {out} keeps what was finished: plan.json, trajectory.csv\n")
    assert json.loads((out / "plan.json").read_text())["status"] == "found"


def test_two_runs_into_one_folder_are_one(told: Told, tmp_path: Path, problem: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    real, second = spacearm.planner.plan, []
    words = ["plan", problem, "-o", tmp_path / "out", "--no-report"]

    def work(*given: Any, **named: Any) -> Any:
        if not second:
            second.append(0)
            second[0] = told(words)
        return real(*given, **named)

    monkeypatch.setattr(spacearm.planner, "plan", work)
    assert told(words)[0] == 0
    code, _, err = second[0]
    assert code == 2
    assert f"{tmp_path / 'out'} is being written by another run" in err
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == ["plan.json", "trajectory.csv"]
    assert not (tmp_path / "out" / CLAIM).exists()


# A process, since CPython ends some that were interrupted by the signal itself, whatever they return.
PROGRAM = """
import os, signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)
signal.signal(signal.SIGTERM, signal.SIG_DFL)
from spacearm import cli
def work(_):
    exec("import os; os.kill(os.getpid(), {number}); [None for _ in range(10**9)]")
cli._run = work
code = cli.main()
os.kill(os.getpid(), signal.SIGINT)  # too late: all is done
sys.exit(code)
"""


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_a_process_ends_with_the_code_and_in_one_line(number: int, code: int, tmp_path: Path) -> None:
    (tmp_path / "stopped.py").write_text(PROGRAM.format(number=int(number)))
    program = [sys.executable, "-m", "stopped"]
    done = subprocess.run(program, capture_output=True, text=True, check=False, cwd=tmp_path)
    assert (done.returncode, done.stdout, done.stderr) == (code, "", "spacearm: interrupted; nothing was written\n")
