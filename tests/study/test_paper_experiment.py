"""The experiment and its report: the same bytes on any machine, and everything that was declared."""

from __future__ import annotations

import dataclasses
import json
import math
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from spacearm.core.errors import OutputError
from spacearm.core.native import available_levels
from spacearm.core.version import version
from spacearm.study.paper_experiment import Experiment, run_experiment
from spacearm.study.paper_problem import (
    BEST_KNOWN,
    GOAL_POSITION,
    NEAR,
    OBSTACLE_CENTERS,
    READINGS,
    REPORTED,
    START_POSITION,
    THRESHOLD,
    PaperSettings,
    paper_objective,
)
from spacearm.study.paper_report import HEADER, path_notes, report_as_dict, save_report, table_rows
from spacearm.swarm import FeasibleFirst, Penalty, named_settings
from support.messages import assert_refused

SMALL = PaperSettings(runs=3, methods=("pso", "ring-rising"), modes=("goal",), threads=1)


@pytest.fixture(scope="module")
def experiment() -> Experiment:
    return run_experiment(SMALL)


@pytest.fixture(scope="module")
def both_modes() -> Experiment:
    return run_experiment(PaperSettings(runs=2, methods=("ring", "ipso-m"), radii=(0.1, 0.5), threads=1))


def report_bytes(settings: PaperSettings, folder: Path) -> bytes:
    save_report(run_experiment(settings), folder)
    return (folder / "report.json").read_bytes() + (folder / "report.html").read_bytes()


def test_the_same_seed_gives_the_same_bytes_with_1_or_2_threads(experiment: Experiment, tmp_path: Path) -> None:
    save_report(experiment, tmp_path / "one")
    one = (tmp_path / "one" / "report.json").read_bytes() + (tmp_path / "one" / "report.html").read_bytes()
    assert report_bytes(dataclasses.replace(SMALL, threads=2), tmp_path / "two") == one
    assert report_bytes(dataclasses.replace(SMALL, seed=1), tmp_path / "other") != one


def test_every_kernel_level_gives_the_same_bytes(experiment: Experiment, tmp_path: Path) -> None:
    save_report(experiment, tmp_path / "here")
    words = ["--runs", "3", "--methods", *SMALL.methods, "--modes", "goal"]
    for level in available_levels():
        command = [sys.executable, "-m", "spacearm.cli", "paper", "-o", str(tmp_path / level), *words]
        done = subprocess.run(
            command, capture_output=True, text=True, check=False, env={**os.environ, "SPACEARM_KERNEL": level}
        )
        assert done.returncode == 0, done.stderr
        assert json.loads((tmp_path / level / "timings.json").read_text())["kernel"]["level"] == level
        for file in ("report.html", "report.json", "table3.md"):
            assert (tmp_path / level / file).read_bytes() == (tmp_path / "here" / file).read_bytes(), f"{file} on {level}"


def test_runs_of_a_method_do_not_depend_on_the_others(experiment: Experiment) -> None:
    alone = run_experiment(dataclasses.replace(SMALL, methods=("ring-rising",), runs=2))
    together = experiment.cell("ring-rising", "goal", 0.1).runs
    for a, b in zip(alone.cells[0].runs, together, strict=False):
        np.testing.assert_array_equal(a.x, b.x)
        np.testing.assert_array_equal(a.history.fitness, b.history.fitness)


def test_the_report_holds_all_that_was_declared(both_modes: Experiment) -> None:
    report = json.loads(json.dumps(report_as_dict(both_modes), allow_nan=False))
    assert report["version"] == version()
    settings = dataclasses.asdict(both_modes.settings)
    del settings["threads"]
    assert report["settings"] == json.loads(json.dumps(settings))
    assert report["readings"] == [dataclasses.asdict(reading) for reading in READINGS]
    assert report["reported"] == {name: dataclasses.asdict(row) for name, row in REPORTED.items()}
    assert (report["threshold"], report["near"]) == (THRESHOLD, NEAR)
    assert report["scene"]["obstacle_centers_m"] == [list(center) for center in OBSTACLE_CENTERS]
    assert report["scene"]["start_position_m"] == list(START_POSITION)
    assert report["scene"]["goal_position_m"] == list(GOAL_POSITION)
    assert "10.3390/sym14050938" in report["paper"]
    places = [(cell["radius_m"], cell["mode"], cell["method"]) for cell in report["cells"]]
    assert places == [(r, mode, name) for r in (0.1, 0.5) for mode in ("goal", "literal") for name in ("ring", "ipso-m")]
    for cell in report["cells"]:
        assert cell["stands_beside"] == {"ring": None, "ipso-m": "ipso"}[cell["method"]]
        assert cell["swarm"]["particles"] * cell["swarm"]["iterations"] == 30_000
        assert [run["trial"] for run in cell["runs"]] == [0, 1]
        assert {run["seed"] for run in cell["runs"]} == {0}
        for run in cell["runs"]:
            assert len(run["fitness_history"]) == len(run["violation_history"]) == run["iterations"]
            assert run["evaluations"] == 30_000


def test_the_report_holds_no_time_and_timings_are_apart(experiment: Experiment, tmp_path: Path) -> None:
    written = save_report(experiment, tmp_path / "out")
    names = ["report.html", "report.json", "table3.md", "timings.json"]
    assert [path.name for path in written] == sorted(path.name for path in (tmp_path / "out").iterdir()) == names

    def keys(value: Any) -> set[str]:
        if isinstance(value, dict):
            return set(value) | {key for inner in value.values() for key in keys(inner)}
        return {key for inner in value for key in keys(inner)} if isinstance(value, list) else set()

    report = json.loads((tmp_path / "out" / "report.json").read_text())
    assert {key for key in keys(report) if "second" in key or key.endswith("_s")} == {"duration_s", "time_s"}  # of the motion
    timings = json.loads((tmp_path / "out" / "timings.json").read_text())
    assert timings["seconds"] > 0
    assert [cell["method"] for cell in timings["cells"]] == list(SMALL.methods)
    assert all(cell["runs_seconds"] > 0 for cell in timings["cells"])


def test_each_run_is_what_the_objective_says_of_it(both_modes: Experiment) -> None:
    for cell in both_modes.cells:
        objective = paper_objective(both_modes.settings, cell.mode, cell.radius)
        fitness, violation = objective.evaluate(np.array([run.x for run in cell.runs]))
        np.testing.assert_array_equal(fitness, [run.fitness for run in cell.runs])
        np.testing.assert_array_equal(violation, [run.violation for run in cell.runs])
        assert cell.best_run in cell.runs


def test_a_planned_path_ends_in_the_best_configuration_and_is_proven(experiment: Experiment) -> None:
    for cell in experiment.cells:
        assert cell.path is not None
        assert cell.path.found
        assert cell.path.trajectory is not None
        points = cell.path.trajectory.motion.control_points
        np.testing.assert_array_equal(points[0], np.zeros(7))
        np.testing.assert_array_equal(points[-1], cell.best_run.x)
    assert path_notes(experiment) == []


def test_without_a_feasible_run_there_is_no_path_no_number_and_a_reason(both_modes: Experiment) -> None:
    assert both_modes.best_known["goal", 0.5][0] is None
    rows = [row for title, _, rows in table_rows(both_modes) if "goal mode, A_R = 0.5" in title for row in rows]
    assert rows[0] == ("ring", "-", "-", "-", "0%", "0%", "0%", "", "none")
    notes = path_notes(both_modes)
    assert "no proven path for ring (goal, A_R 0.5 m), ipso-m (goal, A_R 0.5 m): no run found a feasible configuration" in notes
    values = {(entry["mode"], entry["radius_m"]): entry["value"] for entry in report_as_dict(both_modes)["best_known"]}
    assert values["goal", 0.5] is None


def test_tables_have_a_row_a_method_and_the_papers_in_the_goal_mode(both_modes: Experiment) -> None:
    tables = table_rows(both_modes)
    assert len(tables) == 4
    for title, header, rows in tables:
        assert header == HEADER
        assert all(len(row) == len(HEADER) for row in rows)
        papers = ["paper: PSO", "paper: IPSO"] if "goal mode" in title else []
        assert [row[0] for row in rows] == ["ring", "ipso-m", *papers]
        assert rows[0][7] == ""  # the first method is not tested against itself
        assert 0 < float(rows[1][7]) <= 1
        if papers:
            assert rows[2][1:5] == ("4.3341", "3.3818", "4.2378", "70%")
            assert rows[3][1:5] == ("4.3296", "3.3760", "3.7699", "100%")


def test_a_row_is_the_cells_summary(experiment: Experiment) -> None:
    ((title, _, rows),) = table_rows(experiment)
    assert title.startswith("Table 3, goal mode, A_R = 0.1 m, 3 runs of each method; best known 2.98")
    for cell, row in zip(experiment.cells, rows, strict=False):
        values = [run.fitness for run in cell.runs]
        assert row[:4] == (cell.method, f"{max(values):.4f}", f"{min(values):.4f}", f"{np.mean(values):.4f}")
        assert row[-1] == "proven"


def test_a_folder_that_is_not_empty_is_refused(experiment: Experiment, tmp_path: Path) -> None:
    (tmp_path / "report.json").write_text("mine")
    assert_refused("study", "report into a full folder", OutputError, lambda: save_report(experiment, tmp_path), path=tmp_path)
    assert (tmp_path / "report.json").read_text() == "mine"
    assert [path.name for path in tmp_path.iterdir()] == ["report.json"]


def test_the_penalty_goes_to_methods_that_set_no_constraints_of_their_own() -> None:
    settings = PaperSettings(runs=1, methods=("pso", "ring-rising"), modes=("goal",), constraints="penalty", threads=1)
    pso, ring = run_experiment(settings).cells
    assert named_settings("pso").constraints == FeasibleFirst()
    assert pso.settings == dataclasses.replace(named_settings("pso"), constraints=Penalty(weight=100.0))
    assert ring.settings == named_settings("ring-rising")


def test_the_best_known_value_is_the_recorded_one_for_the_default_problem_only(experiment: Experiment) -> None:
    assert experiment.best_known["goal", 0.1][0] == BEST_KNOWN["goal", 0.1]
    other = run_experiment(dataclasses.replace(SMALL, runs=1, methods=("ring",), weights=(0.4, 0.3, 0.3)))
    value, found_by = other.best_known["goal", 0.1]
    assert value == other.cells[0].runs[0].fitness
    assert "none is recorded" in found_by


def test_progress_rises_to_the_end() -> None:
    told: list[tuple[int, int, str]] = []
    run_experiment(dataclasses.replace(SMALL, runs=2), progress=lambda *entry: told.append(entry))
    done = [entry[0] for entry in told]
    assert done == sorted(done)
    assert len({entry[1] for entry in told}) == 1
    assert told[-1][0] == told[-1][1]
    assert list(dict.fromkeys(entry[2] for entry in told)) == [
        "pso, goal, A_R 0.1 m",
        "ring-rising, goal, A_R 0.1 m",
        "pso, goal, A_R 0.1 m: path",
        "ring-rising, goal, A_R 0.1 m: path",
        "done",
    ]


def test_our_setting_comes_near_the_best_known_value_in_every_one_of_20_runs() -> None:
    # Chance has no part in it, so there is no false alarm: seed 0 gives the same bits on every machine. Of seeds 0 to 99,
    # 90 come near in all 20 runs, and 1,988 of their 2,000 runs do.
    settings = PaperSettings(methods=("ring-rising",), modes=("goal",), seed=0)
    (cell,) = run_experiment(settings).cells
    best_known = BEST_KNOWN["goal", 0.1]
    assert len(cell.runs) == 20
    assert all(run.success for run in cell.runs)
    assert max(run.fitness for run in cell.runs) <= 1.01 * best_known
    assert cell.summary.near_share == 1
    assert all(run.evaluations == 30_000 for run in cell.runs)
    assert math.isclose(best_known, 2.984974500)
