"""New files and folders: of several who write at once, one does; nothing is half written."""

from __future__ import annotations

import errno
import os
import signal
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
import pytest

from spacearm.core.errors import OutputError
from spacearm.core.interrupts import unbroken
from spacearm.core.output import CLAIM, claim_new_folder, make_new_folder, release_folder, write_atomically, write_new
from spacearm.files import save_plan, write_aem, write_ros_trajectory
from spacearm.files.trajectory_file import save_trajectory
from spacearm.motion import Motion, Trajectory
from spacearm.planner import Problem, plan
from spacearm.planner.planner_settings import PlannerSettings
from spacearm.robot import load_robot

ARM = load_robot("zhang2022")
TRAJECTORY = Trajectory(ARM, Motion(np.linspace(0, 0.1, 2)[:, None] * np.ones(7)))


def save_figure_of_nothing(path: Path) -> None:
    from matplotlib.figure import Figure

    from spacearm.show import save_figure

    save_figure(Figure(figsize=(1, 1)), path.with_suffix(""), provenance={})


SAVERS: dict[str, tuple[str, Callable[[Path], Any]]] = {
    "any file": ("file", lambda path: write_new(path, "content")),
    "CSV": ("t.csv", lambda path: save_trajectory(TRAJECTORY, path)),
    "AEM": ("t.aem", lambda path: write_aem(TRAJECTORY, path)),
    "ROS": ("t.json", lambda path: write_ros_trajectory(TRAJECTORY, path)),
    "figure": ("figure.png", save_figure_of_nothing),
}


def at_once(work: Callable[[], Any], count: int = 6) -> tuple[int, list[Exception]]:
    """Run work in threads that begin together; return how many succeeded, and what the others raised."""
    gate, raised, done = threading.Barrier(count), [], []

    def run() -> None:
        gate.wait()
        try:
            work()
            done.append(1)
        except Exception as error:
            raised.append(error)

    threads = [threading.Thread(target=run) for _ in range(count)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    return len(done), raised


@pytest.mark.parametrize("saver", SAVERS)
def test_of_several_who_look_before_anyone_has_written_one_writes(
    saver: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    name, save = SAVERS[saver]
    save(tmp_path / name)
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    monkeypatch.setattr(os.path, "lexists", lambda path: False)  # all of them looked when there was nothing
    monkeypatch.setattr(Path, "exists", lambda self: False)
    with pytest.raises(OutputError, match=r"exists, expected a new file; choose another name"):
        save(tmp_path / name)
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before


def test_six_plans_to_one_path_are_one_plan(tmp_path: Path) -> None:
    found = plan(Problem(ARM, [], start=np.zeros(7), goal=np.full(7, 0.1)), PlannerSettings(evaluations=50), rng=0)
    for i in range(5):
        path = tmp_path / f"plan{i}.json"
        written, raised = at_once(lambda path=path: save_plan(found, path))
        assert written == 1
        assert all(isinstance(error, OutputError) for error in raised)
    assert len(list(tmp_path.iterdir())) == 5


def test_where_there_are_no_hard_links_it_is_new_too(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def none(*_: object, **__: object) -> NoReturn:
        raise OSError(errno.EPERM, os.strerror(errno.EPERM))

    monkeypatch.setattr(os, "link", none)
    written, raised = at_once(lambda: write_new(tmp_path / "file", "content"))
    assert (written, len(raised)) == (1, 5)
    assert [(path.name, path.read_text()) for path in tmp_path.iterdir()] == [("file", "content")]


def test_a_file_has_the_mode_that_the_umask_leaves(tmp_path: Path) -> None:
    before = os.umask(0o027)
    try:
        at_once(lambda: write_atomically(tmp_path / "file", "content"))
        assert (tmp_path / "file").stat().st_mode & 0o777 == 0o640
        assert os.umask(0o027) == 0o027
    finally:
        os.umask(before)


@pytest.mark.parametrize("path", [None, "", 3, "a\0b", b"bytes", object()])
def test_a_path_that_is_none_is_refused(path: Any) -> None:
    with pytest.raises(OutputError, match=r"^path is .*, expected the path of a file"):
        write_new(path, "content")


def test_a_folder_is_claimed_by_one(tmp_path: Path) -> None:
    written, raised = at_once(lambda: claim_new_folder(tmp_path / "a" / "out"))
    assert written == 1
    assert all("is being written by another run, expected a new or empty folder" in str(error) for error in raised)
    with pytest.raises(OutputError, match=f"or remove .*{CLAIM} if that run is dead"):
        claim_new_folder(tmp_path / "a" / "out")
    make_new_folder(tmp_path / "a" / "out")  # which the run that has claimed it may do
    release_folder(tmp_path / "a" / "out")
    assert not list((tmp_path / "a" / "out").iterdir())


def test_who_comes_after_another_has_finished_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    out = tmp_path / "out"

    def finished_meanwhile(path: Any) -> Path:
        folder = make_new_folder(path)
        (folder / "plan.json").touch()
        return folder

    monkeypatch.setattr("spacearm.core.output.make_new_folder", finished_meanwhile)
    with pytest.raises(OutputError, match="is not empty"):
        claim_new_folder(out)
    assert [path.name for path in out.iterdir()] == ["plan.json"]


def interrupt() -> None:
    os.kill(os.getpid(), signal.SIGINT)


@pytest.mark.parametrize("step", ["open", "fsync", "link", "unlink"])
def test_ctrl_c_while_a_file_is_written_comes_when_it_is_whole(
    step: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    real = getattr(os, step)

    def interrupted(*given: Any, **named: Any) -> Any:
        interrupt()
        return real(*given, **named)

    with monkeypatch.context() as patch:
        patch.setattr(os, step, interrupted)
        with pytest.raises(KeyboardInterrupt):
            write_new(tmp_path / "file", "content")
    assert [(path.name, path.read_text()) for path in tmp_path.iterdir()] == [("file", "content")]


def test_ctrl_c_is_put_off_and_comes_even_after_an_error() -> None:
    done = []

    def work(error: bool) -> None:
        with unbroken():
            interrupt()
            with unbroken():
                interrupt()
            done.append("the rest")
            if error:
                raise ValueError

    for error in (False, True):
        with pytest.raises(KeyboardInterrupt):
            work(error)
    assert done == ["the rest"] * 2
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_other_threads_have_nothing_to_put_off() -> None:
    def work() -> None:
        with unbroken():
            pass

    assert at_once(work) == (6, [])


@pytest.mark.parametrize("saver", ["CSV", "AEM", "ROS", "plan"])
def test_a_second_run_replaces_what_it_is_told_to(saver: str, tmp_path: Path) -> None:
    path = tmp_path / "file"

    def save(**given: Any) -> None:
        if saver == "plan":
            save_plan(plan(Problem(ARM, [], start=np.zeros(7), goal=np.full(7, 0.1)), rng=0), path, **given)
        else:
            {"CSV": save_trajectory, "AEM": write_aem, "ROS": write_ros_trajectory}[saver](TRAJECTORY, path, **given)

    path.write_text("mine")
    with pytest.raises(OutputError, match="exists, expected a new file; choose another name, or give overwrite=True"):
        save()
    assert path.read_text() == "mine"
    save(overwrite=True)
    first = path.read_text()
    save(overwrite=True)
    assert first != "mine"
    assert saver == "AEM" or path.read_text() == first  # which has its date in it
