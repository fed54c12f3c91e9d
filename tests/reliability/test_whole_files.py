"""Files appear whole or not at all, whatever ends the writing: an error, or a process that is killed."""

from __future__ import annotations

import errno
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NoReturn

import numpy as np
import pytest

from spacearm.cli import main
from spacearm.core.errors import OutputError
from spacearm.files import save_plan, save_trajectory
from spacearm.geometry import Scene, Sphere
from spacearm.planner import Plan, PlannerSettings, Problem, plan
from spacearm.planner.goals import ConfigurationGoal
from spacearm.robot import load_robot
from spacearm.swarm import PSO, Swarm

PROBLEM = """\
spacearm: 1
robot: zhang2022
scene:
  - sphere: {center: [-0.55, 1.0, 0.0], radius: 0.05}
start: [0, 0, 0, 0, 0, 0, 0]
goal: {configuration: [1, 0, 0, 0, 0, 0, 0]}
"""


@pytest.fixture(scope="module")
def found() -> Plan:
    problem = Problem(
        load_robot("zhang2022"),
        Scene([Sphere((0.6, 0.6, 0.3), 0.1)]),
        start=np.zeros(7),
        goal=ConfigurationGoal([0.5, 0, 0, 0.5, 0, 0, 0]),
    )
    return plan(problem, PlannerSettings(evaluations=200), rng=0)


def save_swarm(_: Plan, path: Path) -> None:
    Swarm([-1.0, -1.0], [1.0, 1.0], PSO(particles=3), rng=0).save(path)


def save_trajectory_csv(found: Plan, path: Path) -> None:
    assert found.trajectory is not None
    save_trajectory(found.trajectory, path)


def save_drawing(_: Plan, path: Path) -> None:
    from matplotlib.figure import Figure

    from spacearm.show.figure_style import save_figure

    figure = Figure(figsize=(1, 1))
    save_figure(figure, path.with_suffix(""), provenance={"seed": "0"})


def save_certificate(found: Plan, path: Path) -> None:
    """By the command, whose error is an exit code."""
    planned = path.with_name("planned.json")
    if not planned.exists():
        save_plan(found, planned)
    with pytest.MonkeyPatch.context() as patch:
        said: list[str] = []
        patch.setattr(sys.stderr, "write", said.append)
        if main(["certify", str(planned), "-o", str(path)]):
            raise OutputError("".join(said).removeprefix("spacearm: ").strip())


WRITERS: dict[str, Callable[[Plan, Path], None]] = {
    "plan.json": save_plan,
    "trajectory.csv": save_trajectory_csv,
    "swarm.npz": save_swarm,
    "figure.png": save_drawing,
    "certificate.json": save_certificate,
}


@pytest.fixture(params=WRITERS)
def name(request: pytest.FixtureRequest) -> str:
    return request.param


@pytest.mark.parametrize("call", ["open", "fsync", "put in place"])
def test_what_cannot_be_written_is_one_sentence_and_leaves_nothing(
    call: str, name: str, found: Plan, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if name == "certificate.json":
        save_plan(found, tmp_path / "planned.json")
    before = sorted(path.name for path in tmp_path.iterdir())

    def fails(*_: object, **__: object) -> NoReturn:
        raise OSError(errno.EIO, os.strerror(errno.EIO))

    for function in ("link", "replace") if call == "put in place" else (call,):
        monkeypatch.setattr(f"spacearm.core.output.os.{function}", fails)
    with pytest.raises(OutputError, match=r"cannot be written \(Input/output error\); free space there") as raised:
        WRITERS[name](found, tmp_path / name)
    assert len(str(raised.value).splitlines()) == 1
    assert sorted(path.name for path in tmp_path.iterdir()) == before


def test_what_is_there_is_not_written_over(name: str, found: Plan, tmp_path: Path) -> None:
    (tmp_path / name).write_bytes(b"mine")
    with pytest.raises(OutputError, match="exists"):
        WRITERS[name](found, tmp_path / name)
    assert (tmp_path / name).read_bytes() == b"mine"


# A process that dies in the middle of a write, as by a power cut: nothing of it runs any more.
DIES = """
import os, signal, sys
from pathlib import Path
from spacearm.core import output

def die(*_, **__):
    os.kill(os.getpid(), signal.SIGKILL)

path = Path(sys.argv[1])
output.write_atomically(path, b"first " * 20_000)
setattr(os, sys.argv[2], die)
output.write_atomically(path, b"second " * 20_000)
"""

POSIX = pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")


@POSIX
@pytest.mark.parametrize("call", ["fsync", "replace"])
def test_a_process_killed_while_it_writes_leaves_what_was_there(call: str, tmp_path: Path) -> None:
    path = tmp_path / "file"
    done = subprocess.run([sys.executable, "-c", DIES, str(path), call], check=False)
    assert done.returncode == -signal.SIGKILL
    assert path.read_bytes() == b"first " * 20_000
    assert [each.name for each in tmp_path.iterdir() if not each.name.startswith(".file.")] == ["file"]


# A shell may start us with Ctrl-C ignored, which children inherit. The command repeats a signal that has not ended it within a
# second, which a busy machine may need to prove and to write the motion.
PROGRAM = """
import signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)
from spacearm.cli import main, stopping
assert stopping._AGAIN
stopping._AGAIN = 600.0
sys.exit(main())
"""


@pytest.fixture
def started(tmp_path: Path) -> Iterator[Callable[..., subprocess.Popen[str]]]:
    """Begin `spacearm plan`; it is ended with the test."""
    running: list[subprocess.Popen[str]] = []

    def start(planner: str, *flags: str) -> subprocess.Popen[str]:
        (tmp_path / "problem.yaml").write_text(f"{PROBLEM}planner: {planner}\n")
        words = ["plan", str(tmp_path / "problem.yaml"), "-o", str(tmp_path / "out"), "--seed", "0", *flags]
        command = [sys.executable, "-c", PROGRAM, *words]
        running.append(subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True))
        return running[-1]

    yield start
    for process in running:
        process.kill()
        process.communicate()


def wait_for(there: Callable[[], bool], process: subprocess.Popen[str]) -> None:
    """Wait for as long as the program runs."""
    while not there() and process.poll() is None:
        time.sleep(0.01)


def whole(path: Path) -> bool:
    content = path.read_bytes()
    if path.suffix == ".json":
        return bool(json.loads(content))
    if path.suffix == ".csv":
        rows = content.decode().split("\n")
        return rows[-1] == "" and len({row.count(",") for row in rows[:-1]}) == 1
    return content.endswith({".png": b"IEND\xaeB`\x82", ".pdf": b"%%EOF\n", ".html": b"</html>\n"}[path.suffix])


@POSIX
@pytest.mark.parametrize("moment", ["plan.json", "trajectory.csv", "report.html", "figures"])
def test_a_plan_killed_while_it_is_written_has_whole_files(
    moment: str, started: Callable[..., subprocess.Popen[str]], tmp_path: Path
) -> None:
    folder = tmp_path / "out"
    process = started("{evaluations: 100}", *(["--figures"] if moment == "figures" else []))
    pattern = {"figures": "*.png"}.get(moment, moment)
    wait_for(lambda: any(folder.glob(pattern)), process)
    process.kill()
    process.communicate()
    files = [path for path in folder.iterdir() if not path.name.startswith(".")]
    assert files
    assert all(whole(path) for path in files), files


def interrupted(process: subprocess.Popen[str], folder: Path, seconds: float) -> str:
    """Send Ctrl-C so long after the folder is there; return what the plan says of itself, '' without one."""
    wait_for(folder.exists, process)
    time.sleep(seconds)
    process.send_signal(signal.SIGINT)
    out, err = process.communicate()
    assert (process.returncode, out) == (130, "")
    if not folder.exists():
        assert err == "spacearm: interrupted; nothing was written\n"
        return ""
    files = ["plan.json", "trajectory.csv"]
    written = [name for name in files if (folder / name).exists()]
    assert err == f"spacearm: interrupted; {folder} keeps what was finished: {', '.join(written)}\n"
    assert all(whole(path) for path in folder.iterdir())
    saved = json.loads((folder / "plan.json").read_text())
    assert saved["interrupted"]
    assert written == (files if saved["status"] == "found" else files[:1])
    return f"{saved['status']}, {(saved['certificate'] or {}).get('status')}"


@POSIX
def test_ctrl_c_writes_the_best_motion_so_far(started: Callable[..., subprocess.Popen[str]], tmp_path: Path) -> None:
    """It is proven like any other; a machine that is busy is given longer to find one."""
    for attempt in range(6):
        folder = tmp_path / "out"
        process = started("{time_budget: 6000, evaluations: null}", "--no-report")
        if interrupted(process, folder, 2.0**attempt) == "found, holds":
            return
        shutil.rmtree(folder, ignore_errors=True)
    raise AssertionError("no motion was found in half a minute")


@POSIX
@pytest.mark.parametrize("seconds", [0.0, 0.2])
def test_ctrl_c_at_any_moment_ends_in_a_line_or_in_a_plan(
    seconds: float, started: Callable[..., subprocess.Popen[str]], tmp_path: Path
) -> None:
    interrupted(started("{time_budget: 6000, evaluations: null}", "--no-report"), tmp_path / "out", seconds)
