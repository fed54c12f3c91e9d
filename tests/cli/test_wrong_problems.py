"""Wrong problem and robot files: one sentence with file and line, exit code 2, and no folder made."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from cli.conftest import PROBLEM, Refused, Told

ROBOT = """\
spacearm-robot: 1
name: two_links
tip: hand
joints:
  - {name: shoulder, kind: revolute, parent: base, child: arm, axis: [0, 0, 1], lower: -2, upper: 2, velocity: 1}
  - {name: elbow, kind: revolute, parent: arm, child: hand, xyz: [1, 0, 0], axis: [0, 0, 1], lower: -2, upper: 2, velocity: 1}
capsules:
  - {link: arm, from: [0, 0, 0], to: [1, 0, 0], radius: 0.05}
"""

START = "start: [0, 0, 0, 0, 0, 0, 0]"
GOAL = "goal: {configuration: [1, 0, 0, 0, 0, 0, 0]}"
SPHERE = "sphere: {center: [0.5, 0.5, 0.0], radius: 0.1}"

CHANGES: dict[str, tuple[str, str, tuple[str, ...]]] = {
    "radius zero": ("radius: 0.1", "radius: 0", ("line 4", "radius is 0", "above 0", "[m]")),
    "radius negative": ("radius: 0.1", "radius: -0.1", ("line 4", "radius is -0.1", "above 0", "[m]")),
    "radius NaN": ("radius: 0.1", "radius: .nan", ("line 4", "radius is nan", "finite")),
    "radius infinite": ("radius: 0.1", "radius: .inf", ("line 4", "radius is inf", "finite")),
    "radius a word": ("radius: 0.1", "radius: ten", ("line 4", "radius is 'ten'", "a number")),
    "center NaN": ("center: [0.5, 0.5, 0.0]", "center: [0.5, .nan, 0.0]", ("line 4", "center[1] is nan", "finite")),
    "center in a plane": ("center: [0.5, 0.5, 0.0]", "center: [0.5, 0.5]", ("line 4", "center", "(2,)", "expected (3,)")),
    "start NaN": (START, "start: [0, .nan, 0, 0, 0, 0, 0]", ("line 5", "start[1] is nan", "finite")),
    "start too short": (START, "start: [0, 0, 0]", ("line 5", "(3,)", "expected (7,)", "shoulder_1")),
    "start above its limit": (START, "start: [0, 0, 0, 3.2, 0, 0, 0]", ("line 5", "'elbow'", "3.2 rad", "2.967", "`start`")),
    "start in degrees": (START, "start: [0, 0, 0, 90, 0, 0, 0]", ("line 5", "'elbow'", "90 rad", "degrees")),
    "start below its limit": (START, "start: {wrist_2: -1}", ("line 5", "'wrist_2'", "-1 rad", "-0.8029", "`start`")),
    "start in collision": (
        SPHERE,
        "sphere: {center: [0.0, 0.5, 0.0], radius: 0.1}",
        ("the start is in collision", "'upper_arm'", "100 mm", "`start`"),
    ),
    "start of an unknown joint": (START, "start: {elbo: 1}", ("line 5", "'elbo'", "did you mean 'elbow'?")),
    "goal NaN": (GOAL, "goal: {position: [0.7, .nan, 0]}", ("line 6", "goal.position[1] is nan", "finite")),
    "goal above its limit": (
        GOAL,
        "goal: {configuration: [0, 0, 0, 3.2, 0, 0, 0]}",
        ("line 6", "'elbow'", "3.2 rad", "2.967", "`goal`"),
    ),
    "goal in collision": (
        SPHERE,
        "sphere: {center: [-0.8, 0.5, 0.0], radius: 0.1}",
        ("the goal is in collision", "'forearm'", "mm", "`goal`"),
    ),
    "goal of an unknown frame": (
        GOAL,
        "goal: {position: [0.7, 0.3, 0], frame: hnad}",
        ("line 6", "'hnad'", "did you mean 'hand'?"),
    ),
    "goal tolerance zero": (
        GOAL,
        "goal: {position: [0.7, 0.3, 0], tolerance: 0}",
        ("line 6", "tolerance is 0", "above 0", "[m]"),
    ),
    "goal in no form": (GOAL, "goal: {}", ("line 6", "expected one of configuration", "pose")),
    "key mistyped": ("scene:", "scnee:", ("line 3", "'scnee'", "did you mean 'scene'?")),
    "key inside mistyped": ("radius: 0.1", "raduis: 0.1", ("line 4", "'raduis'", "did you mean 'radius'?")),
    "key missing": (GOAL, "", ("'goal' is missing",)),
    "robot unknown": ("zhang2022", "zhang2020", ("line 2", "'zhang2020'", "did you mean 'zhang2022'?")),
    "robot file missing": ("zhang2022", "arm.urdf", ("line 2", "<path>/arm.urdf does not exist", "check the path")),
    "setting unknown": (GOAL, GOAL + "\nplanner: {island: 4}", ("line 7", "'island'", "did you mean 'islands'?")),
    "setting out of range": (GOAL, GOAL + "\nplanner: {islands: 0}", ("line 7", "islands is 0", "from 1 to 256")),
    "setting NaN": (GOAL, GOAL + "\nplanner: {preferred_clearance: .nan}", ("line 7", "preferred_clearance is nan", "[m]")),
    "margin of before": (GOAL, GOAL + "\nplanner: {margin: 0.002}", ("line 7", "no setting 'margin' any more", "`clearance`")),
    "clearance of the planner": (GOAL, GOAL + "\nplanner: {clearance: 0.02}", ("line 7", "the problem", "beside start")),
    "comfort of before": (GOAL, GOAL + "\nplanner: {comfort: 0.1}", ("line 7", "'comfort'", "preferred_clearance")),
    "clearance negative": (GOAL, GOAL + "\nclearance: -0.01", ("line 7", "clearance is -0.01", "[m]")),
    "clearance of no obstacle": (
        GOAL,
        GOAL + "\nclearances:\n  - {obstacle: client, clearance: 0.05}",
        ("line 8", "'client'"),
    ),
    "base unknown": (GOAL, GOAL + "\nbase: swimming", ("line 7", "base is 'swimming'", "'fixed' or 'floating'")),
    "shape unknown": (SPHERE, "spere: {center: [0.5, 0.5, 0.0], radius: 0.1}", ("line 4", "'spere'", "did you mean 'sphere'?")),
}

URDF = """<robot name="arm">
  <link name="base"/><link name="hand"/>
  <joint name="turn" type="revolute">
    <parent link="base"/><child link="hand"/><axis xyz="0 0 1"/>
    <limit lower="-2" upper="2" velocity="1" effort="1"/>
  </joint>
</robot>
"""

TEXTS: dict[str, tuple[str | bytes, tuple[str, ...]]] = {
    "empty": ("", ("is empty", "expected a problem file")),
    "only comments": ("# to do\n", ("expected a problem file",)),
    "broken": (PROBLEM.replace("[0.5, 0.5, 0.0]", "[0.5, 0.5, 0.0"), ("line 4", "expected a problem file in YAML")),
    "a list": ("- 1\n- 2\n", ("[1, 2]", "expected a problem file")),
    "a robot file": (ROBOT, ("robot", "expected a problem file")),
    "a MoveIt scene": (
        "name: scene\nworld: {collision_objects: []}\nrobot_model_name: panda\n",
        ("MoveIt", "expected a problem file"),
    ),
    "a URDF": (URDF, ("XML", "expected a problem file")),
    "an image": (b"\x89PNG\r\n\x1a\n\x00\x00", ("not text", "expected a problem file")),
    "JSON of a plan": (json.dumps({"spacearm-plan": 1, "status": "found"}), ("'spacearm'", "expected a problem file")),
    "of another version": (PROBLEM.replace("spacearm: 1", "spacearm: 7"), ("spacearm: 7", "expected at most 1")),
}

ROBOTS: dict[str, tuple[str, str, tuple[str, ...]]] = {
    "robot with lower above upper": (
        "arm.yaml",
        ROBOT.replace("lower: -2, upper: 2", "lower: 2, upper: -2", 1),
        ("'shoulder'", "lower limit 2", "upper limit -2"),
    ),
    "robot with a limit NaN": ("arm.yaml", ROBOT.replace("lower: -2", "lower: .nan", 1), ("line 5", "lower is nan", "finite")),
    "robot with a radius NaN": (
        "arm.yaml",
        ROBOT.replace("radius: 0.05", "radius: .nan"),
        ("line 8", "radius is nan", "finite"),
    ),
    "robot with a radius negative": (
        "arm.yaml",
        ROBOT.replace("radius: 0.05", "radius: -0.05"),
        ("line 8", "'arm'", "radius is -0.05", "[m]"),
    ),
    "robot key mistyped": (
        "arm.yaml",
        ROBOT.replace("velocity: 1", "velocty: 1", 1),
        ("line 5", "'velocty'", "did you mean 'velocity'?"),
    ),
    "robot file empty": ("arm.yaml", "", ("is empty", "expected a robot")),
    "robot file broken": ("arm.yaml", ROBOT.replace("[0, 0, 1]", "[0, 0, 1", 1), ("line 5", "expected a robot file in YAML")),
    "robot file a problem": ("arm.yaml", PROBLEM, ("problem", "expected a robot file")),
    "URDF with lower above upper": (
        "arm.urdf",
        URDF.replace('lower="-2" upper="2"', 'lower="2" upper="-2"'),
        ("'turn'", "lower limit 2", "upper limit -2"),
    ),
    "URDF with a limit NaN": ("arm.urdf", URDF.replace('upper="2"', 'upper="nan"'), ("line 3", "'turn'", "'nan'")),
    "URDF without limits": (
        "arm.urdf",
        URDF.replace('<limit lower="-2" upper="2" velocity="1" effort="1"/>', ""),
        ("'turn'", "limit", "continuous"),
    ),
    "URDF empty": ("arm.urdf", "", ("is empty", "expected a robot")),
    "URDF broken": ("arm.urdf", URDF.replace("</joint>", ""), ("line 7", "XML", "expected a URDF")),
    "URDF without joints": ("arm.urdf", '<robot name="arm"><link name="base"/></robot>', ("'arm'", "no moving joint")),
    "URDF of something else": ("arm.urdf", "<sdf version='1.7'><model name='arm'/></sdf>", ("<sdf>", "expected a URDF")),
    "URDF that is YAML": ("arm.urdf", ROBOT, ("no XML", "expected a URDF")),
}


@pytest.mark.parametrize("case", CHANGES)
def test_a_problem_that_cannot_be_is_refused(case: str, refused: Refused, problem: Path, tmp_path: Path) -> None:
    old, new, parts = CHANGES[case]
    assert old in PROBLEM
    problem.write_text(PROBLEM.replace(old, new))
    refused(("<path>/problem.yaml", *parts), "plan", problem, "-o", tmp_path / "new")


@pytest.mark.parametrize("case", TEXTS)
def test_what_is_no_problem_file_is_refused(case: str, refused: Refused, problem: Path, tmp_path: Path) -> None:
    text, parts = TEXTS[case]
    problem.write_bytes(text if isinstance(text, bytes) else text.encode())
    refused(("<path>/problem.yaml", *parts), "plan", problem, "-o", tmp_path / "new")


@pytest.mark.parametrize("case", ROBOTS)
def test_a_robot_that_cannot_be_is_refused(case: str, refused: Refused, problem: Path, tmp_path: Path) -> None:
    name, text, parts = ROBOTS[case]
    (tmp_path / name).write_text(text)
    problem.write_text(f"spacearm: 1\nrobot: {name}\nstart: [0, 0]\ngoal: {{configuration: [1, 0]}}\n")
    refused(("<path>/problem.yaml: line 2", f"<path>/{name}", *parts), "plan", problem, "-o", tmp_path / "new")


def test_the_robots_are_good_before_they_are_spoilt(told: Told, problem: Path, tmp_path: Path) -> None:
    for name, text, zeros in (("arm.yaml", ROBOT, "[0, 0]"), ("arm.urdf", URDF, "[0]")):
        (tmp_path / name).write_text(text)
        goal = zeros.replace("0", "1")
        robot = f"{{file: {name}, collision: none}}"
        problem.write_text(f"spacearm: 1\nrobot: {robot}\nstart: {zeros}\ngoal: {{configuration: {goal}}}\n")
        code, _, err = told(["plan", problem, "-o", tmp_path / name.replace(".", "-"), "--no-report", "--seed", 0])
        assert code == 0
        assert all(line.startswith("spacearm: robot '") for line in err.splitlines())  # what was assumed of it


def test_a_problem_file_that_is_missing_is_refused(refused: Refused, tmp_path: Path) -> None:
    refused("problem file: missing", "plan", tmp_path / "problm.yaml", "-o", tmp_path / "new")


def test_a_folder_in_the_place_of_a_problem_file_is_refused(refused: Refused, tmp_path: Path) -> None:
    (tmp_path / "problem").mkdir()
    refused(("<path>/problem is a directory", "expected a problem file"), "plan", tmp_path / "problem", "-o", tmp_path / "new")
