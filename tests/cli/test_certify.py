"""`spacearm certify`: what it prints and writes, and its exit codes."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from cli.conftest import Refused, Told
from spacearm.robot import load_robot

URDF = """<robot name="arm"><link name="base"/><link name="a"/><joint name="j1" type="revolute"><parent link="base"/>
<child link="a"/><axis xyz="0 0 1"/><limit lower="-3" upper="3" velocity="2" effort="1"/></joint></robot>"""


@pytest.fixture
def planned(told: Told, problem: Path, tmp_path: Path) -> Path:
    """A plan of the paper's arm, found at once."""
    code, _, _ = told(["plan", problem, "-o", tmp_path / "out", "--seed", 0, "--no-report"])
    assert code == 0
    return tmp_path / "out"


def test_a_plan_holds_again(told: Told, planned: Path) -> None:
    code, out, err = told(["certify", planned / "plan.json"])
    assert (code, err) == (0, "")
    rows = dict(line.split("  ", 1) for line in out.splitlines())
    assert rows["status"].strip() == "holds"
    assert rows["file's certificate"].strip() == "says the same"
    assert "mm proven" in rows["clearance"]


def test_its_certificate_is_written_and_printed_as_json(told: Told, planned: Path, tmp_path: Path) -> None:
    code, out, _ = told(["certify", planned / "plan.json", "--json", "-o", tmp_path / "certificate.json"])
    assert code == 0
    printed, written = json.loads(out), json.loads((tmp_path / "certificate.json").read_text())
    assert written.pop("proof")["spacearm-proof"] == 1
    assert printed == written
    planned_values = json.loads((planned / "plan.json").read_text())
    assert {key: written[key] for key in planned_values["certificate"]} == planned_values["certificate"]
    assert (written["spacearm-certificate"], written["file"], written["notes"]) == (1, "plan.json", [])


def test_an_edited_plan_exits_with_1_and_says_why(told: Told, planned: Path) -> None:
    path = planned / "plan.json"
    content = json.loads(path.read_text())
    content["motion"]["duration_s"] /= 2
    path.write_text(json.dumps(content))
    code, out, err = told(["certify", path])
    assert code == 1
    assert "fails" in out
    assert "says otherwise" in out
    assert "may exceed its velocity limit" in out
    assert "it was edited" in err
    assert "the file's certificate says 'holds', the new one 'fails'" in err


def test_a_trajectory_in_csv_is_proven_for_a_problem(told: Told, planned: Path, problem: Path) -> None:
    code, out, err = told(["certify", planned / "trajectory.csv", "--problem", problem])
    assert code == 0
    assert "holds" in out
    assert "quintic between rows" in err
    code, out, _ = told(["certify", "--problem", problem, planned / "trajectory.csv", "--interpolation", "linear"])
    assert code == 1
    assert "no finite acceleration" in out
    straight = ["certify", "--problem", problem, planned / "trajectory.csv", "--interpolation", "linear"]
    assert told([*straight, "--limits", "position"])[0] == 0


def test_the_duration_is_told_and_years_are_doubted(told: Told, planned: Path, problem: Path, tmp_path: Path) -> None:
    assert "\nduration " in told(["certify", planned / "plan.json"])[1]
    names = ",".join(load_robot("zhang2022").dof_names)
    rows = "".join(f"{i * 10**9},{','.join([str(0.2 * i)] * 7)}\n" for i in range(3))
    (tmp_path / "ns.csv").write_text(f"time,{names}\n{rows}")
    words = ["certify", tmp_path / "ns.csv", "--problem", problem, "--limits", "velocity"]
    _, out, err = told(words)
    assert ["duration", "2e+09 s (63.4 years)"] in [line.split(maxsplit=1) for line in out.splitlines()]
    assert "Then give time_unit='ns' (--time-unit ns)" in err
    assert told([*words, "--time-unit", "ns"])[1].split("duration", 1)[1].lstrip().startswith("2.000 s\n")
    values = json.loads(told([*words, "--json"])[1])
    assert values["duration_s"] == 2e9


def test_a_message_of_ros_is_proven_for_a_problem(told: Told, problem: Path, tmp_path: Path) -> None:
    assert told(["plan", problem, "-o", tmp_path / "out", "--seed", 0, "--no-report", "--export", "ros"])[0] == 0
    code, _, err = told(["certify", tmp_path / "out" / "trajectory.ros.json", "--problem", problem])
    assert code == 0
    assert "quintic between rows" in err
    code, _, err = told(["certify", tmp_path / "out" / "trajectory.ros.json"])
    assert code == 2
    assert "is no plan in JSON, so it is taken for a trajectory; give --problem" in err


def test_a_file_that_contradicts_itself_fails(told: Told, planned: Path, problem: Path) -> None:
    path = planned / "trajectory.csv"
    lines = path.read_text().splitlines()
    cells = lines[100].split(",")
    cells[lines[0].split(",").index("tip_x_m")] = "7"
    lines[100] = ",".join(cells)
    path.write_text("\n".join(lines))
    code, out, _ = told(["certify", path, "--problem", problem])
    assert code == 1
    assert "\nfile contradicts  line 101: the end effector is " in out
    assert len(json.loads(told(["certify", path, "--problem", problem, "--json"])[1])["contradictions"]) == 1


def test_what_was_assumed_of_a_robot_is_told(told: Told, tmp_path: Path) -> None:
    (tmp_path / "arm.urdf").write_text(URDF)
    text = "spacearm: 1\nrobot: {file: arm.urdf, collision: none}\nstart: [0]\ngoal: {configuration: [0.5]}\n"
    (tmp_path / "p.yaml").write_text(text)
    said = "spacearm: robot 'arm': no acceleration limit"
    assert said in told(["plan", tmp_path / "p.yaml", "-o", tmp_path / "out", "--no-report"])[2]
    assert said in told(["certify", tmp_path / "out" / "plan.json"])[2]


def test_more_clearance_than_there_is_fails(told: Told, problem: Path, tmp_path: Path) -> None:
    """More than the motion has among the balls, and less than it has at its ends: a pair that is nearer there is excused."""
    problem.write_text((Path(__file__).parents[2] / "examples" / "01_first_plan.yaml").read_text())
    assert told(["plan", problem, "-o", tmp_path / "out", "--seed", 0, "--no-report"])[0] == 0
    code, out, _ = told(["certify", tmp_path / "out" / "plan.json", "--clearance", "0.05"])
    assert code == 1
    assert "expected more than 50 mm" in out


def test_another_problem_is_told(told: Told, planned: Path, problem: Path) -> None:
    problem.write_text(problem.read_text().replace("radius: 0.1", "radius: 0.11"))
    code, _, err = told(["certify", planned / "plan.json", "--problem", problem])
    assert code == 0
    assert "differs in: obstacles" in err


def test_wrong_input_is_told_in_a_sentence(refused: Refused, planned: Path, problem: Path, tmp_path: Path) -> None:
    (tmp_path / "rows.csv").write_text("a,b\n1,2\n")
    (tmp_path / "note.json").write_text('{"a": 1}')
    (tmp_path / "there.json").write_text("mine")
    refused(("FILE is missing", "see spacearm certify --help"), "certify")
    refused(("<path>/no.json does not exist", "check the path"), "certify", tmp_path / "no.json")
    refused("certify: CSV without problem", "certify", tmp_path / "rows.csv")
    refused(("<path>/rows.csv", "1 row", "two or more"), "certify", tmp_path / "rows.csv", "--problem", problem)
    refused(("<path>/note.json", "expected a plan file"), "certify", tmp_path / "note.json")
    refused(
        ("<path>/note.json", "expected a problem file"), "certify", planned / "plan.json", "--problem", tmp_path / "note.json"
    )
    refused(("<path>/there.json exists", "-o"), "certify", planned / "plan.json", "-o", tmp_path / "there.json")
    refused(
        ("<path>/none/c.json", "No such file or directory"),
        "certify",
        planned / "plan.json",
        "-o",
        tmp_path / "none" / "c.json",
    )
    refused("certify: interpolation of a plan", "certify", planned / "plan.json", "--interpolation", "cubic")
    refused(("--limits is 'speed'", "position, velocity, acceleration"), "certify", planned / "plan.json", "--limits", "speed")
    refused(("clearance is -1", "[m]"), "certify", planned / "plan.json", "--clearance", "-1")
    refused(("'--problm'", "did you mean '--problem'?"), "certify", planned / "plan.json", "--problm", problem)


def test_the_clearance_asked_for_is_the_problems_or_the_options(told: Told, planned: Path) -> None:
    code, out, _ = told(["certify", planned / "plan.json"])
    assert code == 0
    row = dict(line.split("  ", 1) for line in out.splitlines())["clearance"].strip()
    assert row.startswith("10 mm asked for, ")
    proven, measured = (float(part.split()[0]) for part in row.split(", ")[1:])
    assert 10 < proven <= measured
    code, out, _ = told(["certify", planned / "plan.json", "--clearance", measured * 1e-3 + 0.001, "--json"])
    values = json.loads(out)
    assert values["required_clearance_m"] == measured * 1e-3 + 0.001
    (near,) = values["near_pairs"]  # at the goal, where it is closest
    assert near["clearance_m"] * 1e3 == pytest.approx(measured, rel=1e-3)
    assert told(["certify", planned / "plan.json", "--clearance", 0])[0] == 0


def test_pairs_near_at_an_end_have_a_row_each(told: Told, planned: Path) -> None:
    _, out, _ = told(["certify", planned / "plan.json", "--clearance", 5, "--json"])
    near = json.loads(out)["near_pairs"]
    assert near
    _, out, _ = told(["certify", planned / "plan.json", "--clearance", 5])
    assert len([line for line in out.splitlines() if line.startswith("near at an end")]) == len(near)
    pairs = len({(pair["link"], pair["other"]) for pair in near})
    row = dict(line.split("  ", 1) for line in out.splitlines())["clearance"]
    assert row.endswith(f", but {pairs} pair{'s' if pairs > 1 else ''} nearer at an end")
