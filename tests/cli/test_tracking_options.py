"""`spacearm robustness`, and `--tracking` of other commands."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from cli.conftest import Refused, Told


@pytest.fixture
def planned(told: Told, problem: Path, tmp_path: Path) -> Path:
    """A plan of the paper's arm with a tracking error."""
    options = ["--seed", 0, "--no-report", "--tracking", "0.002"]
    code, out, _ = told(["plan", problem, "-o", tmp_path / "out", *options])
    assert code == 0
    assert "tracking error" in out
    return tmp_path / "out" / "plan.json"


def test_the_widest_tube_is_printed_and_written(told: Told, planned: Path, tmp_path: Path) -> None:
    code, out, err = told(["robustness", planned, "--resolution", "0.2", "-o", tmp_path / "tube.json"])
    assert (code, err) == (0, "")
    assert "proven for every trajectory within" in out
    assert "one joint alone, all others exact" in out
    values = json.loads((tmp_path / "tube.json").read_text())
    assert values["together"]["tracking"] >= 0.002
    assert len(values["singly"]) == 7
    assert values["certificate"]["status"] == "holds"


def test_some_joints_alone(told: Told, planned: Path) -> None:
    name = json.loads(planned.read_text())["problem"]["robot"]["joints"][1]["name"]
    code, out, _ = told(["robustness", planned, "--joints", name, "--resolution", "0.5", "--json"])
    assert code == 0
    assert json.loads(out)["together"]["joints"] == [name]


def test_a_trajectory_is_taken_with_its_problem(told: Told, planned: Path, problem: Path, refused: Refused) -> None:
    trajectory = planned.with_name("trajectory.csv")
    code, _, _ = told(["robustness", trajectory, "--problem", problem, "--resolution", "0.5"])
    assert code == 0
    refused(("is no plan in JSON", "--problem"), "robustness", trajectory)


def test_a_motion_that_is_not_proven_exits_with_1(told: Told, planned: Path) -> None:
    content = json.loads(planned.read_text())
    content["motion"]["duration_s"] /= 2
    planned.write_text(json.dumps(content))
    code, out, _ = told(["robustness", planned])
    assert code == 1
    assert "not proven even without a tracking error" in out


def test_certify_takes_the_plans_tracking_error_or_another_one(told: Told, planned: Path) -> None:
    def error(*options: object) -> object:
        return json.loads(told(["certify", planned, "--json", *options])[1]).get("tracking")

    name = json.loads(planned.read_text())["problem"]["robot"]["joints"][0]["name"]
    assert error() == {"all": 0.002}
    assert error("--tracking", "0") is None
    stated = error("--tracking", "all=0.001", f"{name}=0.002")
    assert isinstance(stated, dict)
    assert sorted(set(stated.values())) == [0.001, 0.002]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["x"], "--tracking is 'x', expected a number, or NAME=NUMBER"),
        (["0.1", "0.2"], "--tracking gives 'all' twice"),
        (["-0.1"], "--tracking is -0.1"),
    ],
)
def test_wrong_tracking_errors_are_refused(words: list[str], said: str, problem: Path, refused: Refused) -> None:
    given = [f"--tracking={words[0]}"] if len(words) == 1 else ["--tracking", *words]
    refused((said,), "plan", problem, "-o", "nowhere", *given)
