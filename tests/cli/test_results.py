"""What a command prints and writes when its input is right."""

from __future__ import annotations

import csv
import json
import re
from pathlib import Path

import pytest

from cli.conftest import PROBLEM, Told
from spacearm.study.paper_report import LEGEND

REACHED_BUT_BLOCKED = PROBLEM.replace("radius: 0.1", "radius: 0.3").replace(
    "goal: {configuration: [1, 0, 0, 0, 0, 0, 0]}",
    "goal: {configuration: [-2, 0, 0, 0, 0, 0, 0]}\nplanner: {evaluations: 30}",
)
WITHIN_THE_SPHERE_OF_REACH_ONLY = PROBLEM.replace(
    "goal: {configuration: [1, 0, 0, 0, 0, 0, 0]}", "goal: {position: [0, 0, 1.3]}\nplanner: {goal_candidates: 1}"
)

OUT_OF_REACH = PROBLEM.replace("goal: {configuration: [1, 0, 0, 0, 0, 0, 0]}", "goal: {position: [2, 1, 0]}")


def test_a_plan_is_told_in_two_columns_and_written(told: Told, problem: Path, tmp_path: Path) -> None:
    folder = tmp_path / "out"
    code, out, err = told(["plan", problem, "-o", folder, "--seed", 0])
    assert (code, err) == (0, "")
    lines = out.splitlines()
    names = [re.split(r" {2,}", line)[0] for line in lines]
    assert names == [
        "status",
        "seed",
        "goal configurations",
        "search",
        "joint path length",
        "duration",
        "clearance",
        "certificate",
        "not checked",
        "time",
        "written",
    ]
    column = max(map(len, names)) + 2
    assert all(line[column - 1] == " " and line[column] != " " for line in lines)
    assert all(line == line.rstrip() for line in lines)
    assert lines[0].split() == ["status", "found"]
    assert lines[4].endswith(" rad")
    assert lines[-1].endswith(f"plan.json, trajectory.csv, report.html in {folder}")
    saved = json.loads((folder / "plan.json").read_text())
    assert (saved["status"], saved["seed"]) == ("found", 0)
    rows = list(csv.reader((folder / "trajectory.csv").read_text().splitlines()))
    assert rows[0][:2] == ["t_s", "q_shoulder_1"]
    assert len({len(row) for row in rows}) == 1


def test_the_same_seed_writes_the_same_bytes(told: Told, problem: Path, tmp_path: Path) -> None:
    for name in ("a", "b"):
        assert told(["plan", problem, "-o", tmp_path / name, "--seed", 5])[0] == 0
    for file in ("plan.json", "trajectory.csv", "report.html"):
        assert (tmp_path / "a" / file).read_bytes() == (tmp_path / "b" / file).read_bytes()


def test_a_seed_that_is_drawn_is_told_and_repeats_the_plan(told: Told, problem: Path, tmp_path: Path) -> None:
    _, out, _ = told(["plan", problem, "-o", tmp_path / "a", "--no-report"])
    seed = re.search(r"^seed +(\d+)$", out, re.MULTILINE)
    assert seed
    told(["plan", problem, "-o", tmp_path / "b", "--no-report", "--seed", seed[1]])
    assert (tmp_path / "a" / "plan.json").read_bytes() == (tmp_path / "b" / "plan.json").read_bytes()


def test_json_is_the_file_and_nothing_else(told: Told, problem: Path, tmp_path: Path) -> None:
    code, out, err = told(["plan", problem, "-o", tmp_path / "plan", "--json", "--no-report"])
    assert (code, err) == (0, "")
    assert json.loads(out) == json.loads((tmp_path / "plan" / "plan.json").read_text())
    words = ("--json", "--runs", 1, "--methods", "ring", "--modes", "goal")
    code, out, err = told(["paper", "-o", tmp_path / "paper", *words])
    assert (code, err) == (0, "")
    assert json.loads(out) == json.loads((tmp_path / "paper" / "report.json").read_text())


@pytest.mark.parametrize(
    ("text", "status", "said"),
    [
        (
            REACHED_BUT_BLOCKED,
            "not_found",
            "no motion with a clearance of 10 mm was found; none was found with clearance 0 either",
        ),
        (WITHIN_THE_SPHERE_OF_REACH_ONLY, "goal_unreachable", "would have to be at"),
        (OUT_OF_REACH, "goal_unreachable", "gets at most 1.336 m far"),
    ],
)
def test_no_plan_is_exit_code_1_a_sentence_and_no_trajectory(
    text: str, status: str, said: str, told: Told, problem: Path, tmp_path: Path
) -> None:
    problem.write_text(text)
    code, out, err = told(["plan", problem, "-o", tmp_path / "out", "--seed", 0, "--no-report"])
    assert code == 1
    assert err.startswith("spacearm: ")
    assert said in err
    assert err.count("\n") == 1
    assert out.splitlines()[0].split() == ["status", status]
    assert json.loads((tmp_path / "out" / "plan.json").read_text())["status"] == status
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["plan.json"]


def test_a_plans_figures_are_drawn(told: Told, problem: Path, tmp_path: Path) -> None:
    code, out, _ = told(["plan", problem, "-o", tmp_path / "out", "--seed", 0, "--figures"])
    assert code == 0
    drawn = sorted(path.name for path in (tmp_path / "out").glob("*.png"))
    assert drawn
    assert all(name in out for name in drawn)
    assert sorted(path.stem for path in (tmp_path / "out").glob("*.pdf")) == [Path(name).stem for name in drawn]


def test_the_paper_prints_its_tables_uncut(told: Told, tmp_path: Path) -> None:
    methods = ("pso", "evolving-rising")
    words = ("--runs", 2, "--methods", *methods, "--radii", 0.1, 0.5, "--modes", "goal")
    code, out, err = told(["paper", "-o", tmp_path / "out", *words])
    assert code == 0
    assert re.fullmatch(r"\d+\.\d s for the runs and their planned paths\n", err)
    assert "…" not in out
    lines = out.splitlines()
    titles = [line for line in lines if line.startswith("Table 3")]
    assert titles == [f"Table 3, goal mode, A_R = {radius} m, 2 runs of each method" for radius in ("0.1", "0.5")]
    for method in methods:
        assert sum(line.split()[:1] == [method] for line in lines) == 2
    assert sum(line.startswith("paper: ") for line in lines) == 4
    assert all(line in lines for line in LEGEND)
    assert "nan" not in out
    assert any(
        line.startswith("no proven path for ") and line.endswith("no run found a feasible configuration") for line in lines
    )
    assert f"report: {tmp_path / 'out' / 'report.html'}; its numbers: report.json" in lines


def test_an_experiment_goes_on_from_its_records(told: Told, tmp_path: Path) -> None:
    words = [
        "paper",
        "--runs",
        1,
        "--methods",
        "ring",
        "--modes",
        "goal",
        "--json",
        "--records",
        tmp_path / "r",
    ]
    code, report, _ = told([*words, "-o", tmp_path / "a"])
    assert code == 0
    records = (tmp_path / "r").read_bytes()
    assert told([*words, "-o", tmp_path / "b"])[:2] == (0, report)
    assert (tmp_path / "r").read_bytes() == records
