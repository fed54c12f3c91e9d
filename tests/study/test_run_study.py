"""A study runs each task once: over stops, in any number of processes, and with every record on disk as it comes."""

from __future__ import annotations

import dataclasses
import json
import math
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from house.source import REPOSITORY
from spacearm.core.errors import FileFormatError, OutputError, ProblemError, SettingsError
from spacearm.study.run_study import Lost, in_processes, run_study
from spacearm.study.study_records import appending, load_records
from study.small_study import DRAWING, Draw, Drawn, draw, tasks
from support.messages import assert_refused


def values(records: list[Drawn]) -> list[float]:
    return [record.value for record in records]


def test_records_are_the_same_with_1_or_3_processes_and_in_the_order_of_the_tasks() -> None:
    alone, together = (run_study(DRAWING, tasks(7), jobs=jobs) for jobs in (1, 3))
    assert [record.word for record in alone] == [f"number {i}" for i in range(7)]
    assert values(alone) == values(together)
    assert {record.threads for record in together} == {"1"}


def test_a_record_comes_back_from_disk_as_it_was(tmp_path: Path) -> None:
    path = tmp_path / "new" / "draws.jsonl"
    (made,) = run_study(DRAWING, tasks(1), records=path, jobs=1)
    lines = path.read_text().splitlines()
    assert len(lines) == 2
    assert all(json.loads(line, parse_constant=pytest.fail) for line in lines)  # strict JSON
    (read,) = load_records(path, Drawn, study="drawing").values()
    assert read.record == made
    assert read.definition == {"scale": 1.0}


def test_what_is_recorded_is_not_run_again(tmp_path: Path) -> None:
    path = tmp_path / "draws.jsonl"
    first = run_study(DRAWING, tasks(3), records=path, jobs=1)
    ran: list[int] = []

    def run(task: Draw) -> Drawn:
        ran.append(task.number)
        return draw(task)

    watched = dataclasses.replace(DRAWING, run=run)
    told: list[tuple[int, int, str]] = []
    again = run_study(watched, tasks(5), records=path, jobs=1, progress=lambda *entry: told.append(entry))
    assert ran == [3, 4]
    assert again[:3] == first
    assert told == [(3, 5, "draw 3"), (4, 5, "draw 4"), (5, 5, "draw 4")]
    assert run_study(watched, tasks(5)[::-1], records=path, jobs=1) == again[::-1]
    assert ran == [3, 4]


def test_a_line_that_was_not_finished_is_cut_off_and_its_task_done_again(tmp_path: Path) -> None:
    path = tmp_path / "draws.jsonl"
    expected = run_study(DRAWING, tasks(3), records=path, jobs=1)
    content = path.read_bytes()
    for left_over in range(1, len(content.splitlines(keepends=True)[-1])):
        path.write_bytes(content[:-left_over])
        assert len(load_records(path, Drawn, study="drawing")) == 2
    assert run_study(DRAWING, tasks(3), records=path, jobs=1) == expected
    assert path.read_bytes() == content
    path.write_bytes(content[:10])  # within the first line
    assert run_study(DRAWING, tasks(3), records=path, jobs=1) == expected


def test_an_error_of_a_task_is_told_and_what_came_before_is_kept(tmp_path: Path) -> None:
    path = tmp_path / "draws.jsonl"
    for jobs in (1, 2):
        with pytest.raises(ProblemError, match="the problem cannot be"):
            run_study(DRAWING, tasks(4, draw_3=Draw(number=3, does="wrong")), records=path, jobs=jobs)
        assert {"draw 0", "draw 1"} <= set(load_records(path, Drawn, study="drawing"))
    with pytest.raises(RuntimeError, match="nothing can be shared"):
        run_study(DRAWING, tasks(2, draw_1=Draw(number=1, does="raise")), jobs=2)


def test_a_process_that_dies_or_hangs_is_told_or_recorded() -> None:
    given = tasks(4, draw_1=Draw(number=1, does="die"), draw_2=Draw(number=2, does="sleep"))
    with pytest.raises(RuntimeError, match=r"task 'draw 1' of the study 'drawing' gave no record: .* exit code 7"):
        run_study(DRAWING, given[:2], jobs=2)
    found = dict(in_processes(draw, given, jobs=2, hang=1.5))
    assert isinstance(found[0], Drawn)
    assert isinstance(found[3], Drawn)
    assert found[1] == Lost(why="the process ended with exit code 7")
    assert found[2] == Lost(why="no answer within 1.5 s")
    lost = dataclasses.replace(
        DRAWING, lost=lambda task, why: Drawn(value=math.nan, parts=(), word=f"{task.number}: {why}", threads=None)
    )
    assert run_study(lost, given[:2], jobs=2)[1].word == "1: the process ended with exit code 7"


STUDY = """
import sys
sys.path[:0] = [{tests!r}]
from study.small_study import DRAWING, Draw
from spacearm.study.run_study import run_study
if __name__ == "__main__":
    given = [Draw(number=i, does="" if i < 4 else "sleep") for i in range(6)]
    run_study(DRAWING, given, records={path!r}, jobs={jobs})
"""


@pytest.mark.parametrize("jobs", [1, 2])
def test_ctrl_c_ends_a_study_that_goes_on_where_it_was(tmp_path: Path, jobs: int) -> None:
    path, program = tmp_path / "draws.jsonl", tmp_path / "program.py"
    program.write_text(STUDY.format(tests=str(REPOSITORY / "tests"), path=str(path), jobs=jobs))
    running = subprocess.Popen(
        [sys.executable, str(program)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True
    )
    until(lambda: path.exists() and path.read_bytes().count(b"\n") == 5)
    os.killpg(running.pid, signal.SIGINT)  # as a terminal does: all of its processes
    _, err = running.communicate(timeout=30)
    assert running.returncode == -signal.SIGINT
    assert err.count("Traceback") == 1  # that of the program; its processes are silent
    assert values(run_study(DRAWING, tasks(6), records=path, jobs=1))[:4] == values(run_study(DRAWING, tasks(4), jobs=1))


def until(holds: Callable[[], bool]) -> None:
    """Wait for something, a minute at most."""
    for _ in range(600):
        if holds():
            return
        time.sleep(0.1)
    pytest.fail("it did not come about within a minute")


def test_wrong_input_is_one_sentence(tmp_path: Path) -> None:
    path = tmp_path / "draws.jsonl"
    run_study(DRAWING, tasks(2), records=path, jobs=1)
    content = path.read_text()

    def refused(case: str, error: type, **changes: object) -> None:
        given = {"records": path, "jobs": 1, **changes}
        assert_refused(
            "study",
            case,
            error,
            lambda: run_study(given.pop("study", DRAWING), given.pop("tasks", tasks(2)), **given),
            path=tmp_path,
        )  # type: ignore[arg-type]

    refused("another definition", FileFormatError, tasks=[Draw(number=1, scale=2.0)])
    refused("another study", FileFormatError, study=dataclasses.replace(DRAWING, name="painting"))
    refused("two tasks of one name", SettingsError, tasks=[Draw(number=1), Draw(number=1)])
    refused("no jobs", SettingsError, jobs=0)
    refused("records in a folder", OutputError, records=tmp_path)
    with appending(path, study="drawing"):
        refused("records that another process writes", OutputError)
    for case, wrong in (
        ("records that are none", "first\nsecond\n"),
        ("a line that is none", content + "[]\n"),
        ("a record with a key too few", content.replace('"word"', '"world"')),
        ("a record with text for a number", content.replace('"value":', '"value":"much","parts":[],"valued":')),
    ):
        path.write_text(wrong)
        refused(case, FileFormatError)
    path.write_text(content.replace('"version":"', '"version":"0.0.'))
    with pytest.raises(FileFormatError, match="records of two versions are not put together; name another file"):
        run_study(DRAWING, tasks(2), records=path, jobs=1)
    path.write_text(content)
    assert len(run_study(DRAWING, tasks(2), records=path, jobs=1)) == 2
