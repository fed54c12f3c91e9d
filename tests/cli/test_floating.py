"""What `spacearm plan` and `spacearm certify` say of a base that floats."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from cli.conftest import Refused, Told

FLOATING = """\
spacearm: 1
robot: srs7
start: home
base_start: mass_center
base_limits: {peak_deg: 40}
goal: {position: [0.3, 0.3, 0.6]}
planner: {evaluations: 1500}
"""


@pytest.fixture
def problem(tmp_path: Path) -> Path:
    path = tmp_path / "floating.yaml"
    path.write_text(FLOATING)
    return path


@pytest.fixture
def planned(told: Told, problem: Path, tmp_path: Path) -> Path:
    code, out, err = told(["plan", problem, "-o", tmp_path / "out", "--seed", 0, "--no-report"])
    assert (code, err) == (0, "")
    rows = {line[:20].strip(): line[20:].strip() for line in out.splitlines()}
    assert rows["goal configurations"].endswith("to begin with, which would reach the goal if the base stayed")
    base = json.loads((tmp_path / "out" / "plan.json").read_text())["base"]
    assert rows["base"].startswith(f"turned by {base['final'] * 57.29577951:.3g} deg at the end, ")
    assert rows["base"].endswith("N m s at most")
    assert rows["ends with"].startswith("end effector ")
    return tmp_path / "out" / "plan.json"


def test_a_plan_and_its_second_proof_say_the_same_of_the_base(told: Told, planned: Path, problem: Path) -> None:
    for arguments in ([planned], ["--problem", problem, planned], ["--problem", problem, planned.parent / "trajectory.csv"]):
        code, out, err = told(["certify", *arguments])
        assert "turned by" in out
        assert "misses" not in err
        if arguments[-1] == planned:
            assert (code, err) == (0, "")


def test_masses_that_were_changed_are_told(told: Told, planned: Path) -> None:
    content = json.loads(planned.read_text())
    content["problem"]["robot"]["bodies"][0]["mass"] *= 3
    planned.write_text(json.dumps(content))
    _, out, err = told(["certify", planned])
    assert "the end effector misses its goal by" in err
    assert "not as asked" in out


def test_what_is_not_met_is_told(told: Told, problem: Path, tmp_path: Path) -> None:
    problem.write_text(FLOATING.replace("peak_deg: 40", "peak_deg: 0.01").replace("1500", "200"))
    code, out, err = told(["plan", problem, "-o", tmp_path / "out", "--seed", 0, "--no-report"])
    assert code == 1
    assert "not as asked" in out
    assert "more than 0.01" in err


WRONG: dict[str, tuple[str, str, tuple[str, ...]]] = {
    "held": ("base_limits", "base: fixed\nbase_limits", ("line 6", "base is 'fixed'", "base_limits", "base='floating'")),
    "weightless": ("robot: srs7", "robot: {name: srs7, tip: nowhere}", ("line 2", "'nowhere'", "known: base")),
    "nowhere": ("mass_center", "somewhere", ("line 4", "base_start is 'somewhere'", "mass_center")),
    "far": ("mass_center", "{position: [1e300, 0, 0]}", ("line 4", "base_start", "1e+300 m", "1e+06 m")),
    "hasty": ("goal:", "duration: 1e-300\ngoal:", ("line 6", "duration is 1e-300 s", "1e-06 to 1e+09 s")),
    "spun": (
        "goal:",
        "duration: 10\nmomentum: {angular: [0, 0, 1e300]}\ngoal:",
        ("line 7", "momentum.angular", "1e+300", "units"),
    ),
    "thrown": (
        "goal:",
        "duration: 10\nmomentum: {linear: [0, 0, 1e300]}\ngoal:",
        ("line 7", "momentum.linear", "10 s", "units"),
    ),
    "still": ("peak_deg: 40", "rate_deg: 1e-300", ("line 5", "rate is 1.74533e-302", "[rad/s]")),
}


@pytest.mark.parametrize("case", WRONG)
def test_wrong_input_is_told_in_a_sentence(case: str, refused: Refused, problem: Path, tmp_path: Path) -> None:
    old, new, parts = WRONG[case]
    problem.write_text(FLOATING.replace(old, new))
    refused(("<path>/floating.yaml", *parts), "plan", problem, "-o", tmp_path / "out")
