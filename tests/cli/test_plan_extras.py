"""What `spacearm plan` writes when asked to: files for others, and what a gentler motion costs."""

from __future__ import annotations

import csv
import json
import re
from pathlib import Path

import pytest

from cli.conftest import PROBLEM, Refused, Told

FLOATING = """\
spacearm: 1
robot: srs7
base: floating
base_start: mass_center
start: [0, 0, 0, 0.4, 0, 0, 0]
goal: {configuration: [0.9, 0.3, 0.6, 1.5, -0.5, 0.4, 0.1]}
planner: {evaluations: 400}
"""


@pytest.fixture
def floating(tmp_path: Path) -> Path:
    """A problem of a small spacecraft."""
    path = tmp_path / "floating.yaml"
    path.write_text(FLOATING)
    return path


def test_exports_are_written_beside_the_plan(told: Told, floating: Path, tmp_path: Path) -> None:
    folder = tmp_path / "out"
    options = ["--export", "aem", "ros", "--epoch", "2026-03-01T12:00:00Z", "--seed", 0, "--no-report"]
    code, out, err = told(["plan", floating, "-o", folder, *options])
    assert (code, err) == (0, "")
    assert "trajectory.aem, trajectory.ros.json" in out
    aem = (folder / "trajectory.aem").read_text()
    assert aem.startswith("CCSDS_AEM_VERS = 2.0\n")
    assert "START_TIME = 2026-03-01T12:00:00\n" in aem
    messages = json.loads((folder / "trajectory.ros.json").read_text())
    assert list(messages) == ["joint_trajectory", "base_path", "base_twists"]


def test_the_clearance_may_be_given_on_the_command_line(told: Told, refused: Refused, tmp_path: Path) -> None:
    problem = tmp_path / "problem.yaml"
    problem.write_text(PROBLEM)
    code, out, _ = told(["plan", problem, "-o", tmp_path / "out", "--clearance", "0.02", "--seed", 0, "--no-report"])
    assert code == 0
    assert re.search(r"clearance +20 mm asked for, at least [0-9.]+ mm proven, closest measured [0-9.]+ mm", out)
    assert json.loads((tmp_path / "out" / "plan.json").read_text())["problem"]["clearance"] == 0.02
    refused(("--clearance is -1", "[m]"), "plan", problem, "-o", tmp_path / "other", "--clearance", "-1")


def test_a_clearance_that_cannot_be_met_exits_with_1_and_says_what_can(told: Told, tmp_path: Path) -> None:
    problem, output = tmp_path / "problem.yaml", tmp_path / "out"
    example = (Path(__file__).parents[2] / "examples" / "01_first_plan.yaml").read_text()
    problem.write_text(example.replace("evaluations: 20000", "evaluations: 2000"))
    code, out, err = told(["plan", problem, "-o", output, "--clearance", "0.15", "--seed", 0, "--no-report"])
    assert code == 1
    (said,) = re.findall(r"no motion with a clearance of 150 mm was found; with clearance ([0-9.]+) a motion is found", err)
    assert 0.1 < float(said) < 0.15
    assert f"found and proven with {1e3 * float(said):.4g}" in out
    saved = json.loads((output / "plan.json").read_text())
    assert saved["status"] == "not_found"
    assert saved["achievable"]["clearance_m"] == pytest.approx(float(said), abs=1e-4)
    assert not (output / "trajectory.csv").exists()
    assert told(["plan", problem, "-o", tmp_path / "less", "--clearance", said, "--seed", 0, "--no-report"])[0] == 0


def test_what_a_gentler_motion_costs_is_tabled(told: Told, floating: Path, tmp_path: Path) -> None:
    folder = tmp_path / "out"
    code, out, _ = told(["plan", floating, "-o", folder, "--pareto", 3, "--seed", 0, "--no-report"])
    assert code == 0
    rows = list(csv.DictReader((folder / "pareto.csv").read_text().splitlines()))
    assert rows
    assert "pareto.csv, pareto_01.json" in out
    for row in rows:
        plan = json.loads((folder / row["plan"]).read_text())
        assert plan["status"] == "found"
        assert plan["certificate"]["status"] == "holds"
        assert float(row["duration_s"]) == pytest.approx(plan["motion"]["duration_s"], rel=1e-8)
    assert told(["certify", folder / "pareto_01.json"])[0] == 0


def test_a_floating_base_has_figures_of_its_own(told: Told, floating: Path, tmp_path: Path) -> None:
    assert told(["plan", floating, "-o", tmp_path / "out", "--seed", 0, "--pareto", 2, "--figures"])[0] == 0
    there = {path.name for path in (tmp_path / "out").iterdir()}
    assert {"base_motion.png", "base_motion.pdf", "base_paths.png", "path_3d.png", "pareto.png", "pareto.pdf"} <= there


def test_extras_that_cannot_be_are_refused_before_planning(refused: Refused, floating: Path, tmp_path: Path) -> None:
    fixed = tmp_path / "fixed.yaml"
    fixed.write_text(PROBLEM)
    new = tmp_path / "new"
    refused(("--export is 'oem'", "did you mean 'aem'?"), "plan", floating, "-o", new, "--export", "oem")
    refused(("--epoch is 'noon'", "2026-03-01T12:00:00"), "plan", floating, "-o", new, "--export", "aem", "--epoch", "noon")
    refused("plan: epoch without aem", "plan", floating, "-o", new, "--epoch", "2026-03-01T12:00:00")
    refused(("pareto is 1", "from 2 to 1000"), "plan", floating, "-o", new, "--pareto", "1")
    refused(("<path>/fixed.yaml", "fixed", "floating"), "plan", fixed, "-o", new, "--pareto", "3")
