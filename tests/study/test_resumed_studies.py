"""MotionBenchMaker, SpaceBench and the paper are studies: what they have recorded is not measured again."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import pytest

from house.source import REPOSITORY
from spacearm.core.errors import FileFormatError
from spacearm.study.motionbenchmaker import find_items, find_robot
from spacearm.study.motionbenchmaker_runs import Protocol, run_benchmark
from spacearm.study.paper_experiment import run_experiment
from spacearm.study.paper_problem import PaperSettings
from spacearm.study.paper_report import report_as_dict
from spacearm.study.spacebench import find_problems
from spacearm.study.spacebench_runs import SpaceProtocol, run_spacebench
from study.tiny_collection import request, scene, write_collection, write_problem


def test_motionbenchmaker_goes_on_and_measures_a_changed_problem_not_twice(tmp_path: Path) -> None:
    data, records = write_collection(tmp_path / "data"), tmp_path / "runs.jsonl"
    items = find_items(data)
    robot = find_robot(data, items, group="arm")
    protocol = Protocol(seeds=1, search=0.02, plan=0.1)
    first = run_benchmark(items[:2], robot, protocol, records=records)
    assert [run.name for run in first.runs] == ["0001", "0001"]
    again = run_benchmark(items, robot, dataclasses.replace(protocol, seeds=2), records=records, jobs=2)
    assert again.runs[:2] == first.runs  # also their times
    assert len(again.runs) == 6
    assert again.jobs == 2
    write_problem(data / "easy", 1, scene(), request([-1.0, 0.2], [1.0, 0.1]))
    with pytest.raises(FileFormatError, match=r"task 'easy 0001 seed 0' with another definition \(request '"):
        run_benchmark(items, robot, protocol, records=records)


def test_spacebench_goes_on(tmp_path: Path) -> None:
    records = tmp_path / "space.jsonl"
    items = find_problems(REPOSITORY / "benchmarks" / "spacebench", families=("module",), most=2)
    first = run_spacebench(items[:1], SpaceProtocol(limit=9.0), records=records)
    again = run_spacebench(items, SpaceProtocol(limit=9.0), published=1, records=records, jobs=2)
    assert again.runs[0] == first.runs[0]
    assert [run.name for run in again.runs] == ["module-01", "module-02"]
    assert [run.what for run in again.published] == ["servicer", "the paper's scene", "servicer, least peak"]
    assert sorted(path.name for path in tmp_path.iterdir()) == ["space-published.jsonl", "space.jsonl"]
    with pytest.raises(FileFormatError, match=r"\(limit_s 9.0 then, 8.0 now\)"):
        run_spacebench(items, SpaceProtocol(limit=8.0), records=records)


def test_the_papers_report_is_the_same_from_records_and_from_two_processes(tmp_path: Path) -> None:
    settings = PaperSettings(runs=23, methods=("pso", "ring"), modes=("goal",), threads=1)
    fresh = report_as_dict(run_experiment(settings))
    for jobs in (2, 1):
        assert report_as_dict(run_experiment(settings, records=tmp_path / "paper.jsonl", jobs=jobs)) == fresh
    lines = (tmp_path / "paper.jsonl").read_bytes().splitlines(keepends=True)
    assert len(lines) == 1 + 2 * 2  # blocks of 20 and of 3 runs
    (tmp_path / "paper.jsonl").write_bytes(b"".join(lines[:3]) + lines[3][:100])
    assert report_as_dict(run_experiment(settings, records=tmp_path / "paper.jsonl")) == fresh
