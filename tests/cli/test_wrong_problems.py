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

CHANGES = {
    "radius zero": ("radius: 0.1", "radius: 0"),
    "radius negative": ("radius: 0.1", "radius: -0.1"),
    "radius NaN": ("radius: 0.1", "radius: .nan"),
    "radius infinite": ("radius: 0.1", "radius: .inf"),
    "radius a word": ("radius: 0.1", "radius: ten"),
    "center NaN": ("center: [0.5, 0.5, 0.0]", "center: [0.5, .nan, 0.0]"),
    "center in a plane": ("center: [0.5, 0.5, 0.0]", "center: [0.5, 0.5]"),
    "start NaN": (START, "start: [0, .nan, 0, 0, 0, 0, 0]"),
    "start too short": (START, "start: [0, 0, 0]"),
    "start above its limit": (START, "start: [0, 0, 0, 3.2, 0, 0, 0]"),
    "start in degrees": (START, "start: [0, 0, 0, 90, 0, 0, 0]"),
    "start below its limit": (START, "start: {wrist_2: -1}"),
    "start in collision": (SPHERE, "sphere: {center: [0.0, 0.5, 0.0], radius: 0.1}"),
    "start of an unknown joint": (START, "start: {elbo: 1}"),
    "goal NaN": (GOAL, "goal: {position: [0.7, .nan, 0]}"),
    "goal above its limit": (GOAL, "goal: {configuration: [0, 0, 0, 3.2, 0, 0, 0]}"),
    "goal in collision": (SPHERE, "sphere: {center: [-0.8, 0.5, 0.0], radius: 0.1}"),
    "goal of an unknown frame": (GOAL, "goal: {position: [0.7, 0.3, 0], frame: hnad}"),
    "goal tolerance zero": (GOAL, "goal: {position: [0.7, 0.3, 0], tolerance: 0}"),
    "goal in no form": (GOAL, "goal: {}"),
    "key mistyped": ("scene:", "scnee:"),
    "key inside mistyped": ("radius: 0.1", "raduis: 0.1"),
    "key missing": (GOAL, ""),
    "robot unknown": ("zhang2022", "zhang2020"),
    "robot file missing": ("zhang2022", "arm.urdf"),
    "setting unknown": (GOAL, GOAL + "\nplanner: {island: 4}"),
    "setting out of range": (GOAL, GOAL + "\nplanner: {islands: 0}"),
    "setting NaN": (GOAL, GOAL + "\nplanner: {margin: .nan}"),
    "base unknown": (GOAL, GOAL + "\nbase: swimming"),
    "shape unknown": (SPHERE, "spere: {center: [0.5, 0.5, 0.0], radius: 0.1}"),
}

URDF = """<robot name="arm">
  <link name="base"/><link name="hand"/>
  <joint name="turn" type="revolute">
    <parent link="base"/><child link="hand"/><axis xyz="0 0 1"/>
    <limit lower="-2" upper="2" velocity="1" effort="1"/>
  </joint>
</robot>
"""

TEXTS: dict[str, str | bytes] = {
    "empty": "",
    "only comments": "# to do\n",
    "broken": PROBLEM.replace("[0.5, 0.5, 0.0]", "[0.5, 0.5, 0.0"),
    "a list": "- 1\n- 2\n",
    "a robot file": ROBOT,
    "a MoveIt scene": "name: scene\nworld: {collision_objects: []}\nrobot_model_name: panda\n",
    "a URDF": URDF,
    "an image": b"\x89PNG\r\n\x1a\n\x00\x00",
    "JSON of a plan": json.dumps({"spacearm-plan": 1, "status": "found"}),
    "of another version": PROBLEM.replace("spacearm: 1", "spacearm: 7"),
}

ROBOTS = {
    "robot with lower above upper": ("arm.yaml", ROBOT.replace("lower: -2, upper: 2", "lower: 2, upper: -2", 1)),
    "robot with a limit NaN": ("arm.yaml", ROBOT.replace("lower: -2", "lower: .nan", 1)),
    "robot with a radius NaN": ("arm.yaml", ROBOT.replace("radius: 0.05", "radius: .nan")),
    "robot with a radius negative": ("arm.yaml", ROBOT.replace("radius: 0.05", "radius: -0.05")),
    "robot key mistyped": ("arm.yaml", ROBOT.replace("velocity: 1", "velocty: 1", 1)),
    "robot file empty": ("arm.yaml", ""),
    "robot file broken": ("arm.yaml", ROBOT.replace("[0, 0, 1]", "[0, 0, 1", 1)),
    "robot file a problem": ("arm.yaml", PROBLEM),
    "URDF with lower above upper": ("arm.urdf", URDF.replace('lower="-2" upper="2"', 'lower="2" upper="-2"')),
    "URDF with a limit NaN": ("arm.urdf", URDF.replace('upper="2"', 'upper="nan"')),
    "URDF without limits": ("arm.urdf", URDF.replace('<limit lower="-2" upper="2" velocity="1" effort="1"/>', "")),
    "URDF empty": ("arm.urdf", ""),
    "URDF broken": ("arm.urdf", URDF.replace("</joint>", "")),
    "URDF without joints": ("arm.urdf", '<robot name="arm"><link name="base"/></robot>'),
    "URDF of something else": ("arm.urdf", "<sdf version='1.7'><model name='arm'/></sdf>"),
    "URDF that is YAML": ("arm.urdf", ROBOT),
}


@pytest.mark.parametrize("case", CHANGES)
def test_a_problem_that_cannot_be_is_refused(case: str, refused: Refused, problem: Path, tmp_path: Path) -> None:
    old, new = CHANGES[case]
    assert old in PROBLEM
    problem.write_text(PROBLEM.replace(old, new))
    refused(f"problem: {case}", "plan", problem, "-o", tmp_path / "new")


@pytest.mark.parametrize("case", TEXTS)
def test_what_is_no_problem_file_is_refused(case: str, refused: Refused, problem: Path, tmp_path: Path) -> None:
    text = TEXTS[case]
    problem.write_bytes(text if isinstance(text, bytes) else text.encode())
    refused(f"problem file: {case}", "plan", problem, "-o", tmp_path / "new")


@pytest.mark.parametrize("case", ROBOTS)
def test_a_robot_that_cannot_be_is_refused(case: str, refused: Refused, problem: Path, tmp_path: Path) -> None:
    name, text = ROBOTS[case]
    (tmp_path / name).write_text(text)
    problem.write_text(f"spacearm: 1\nrobot: {name}\nstart: [0, 0]\ngoal: {{configuration: [1, 0]}}\n")
    refused(case, "plan", problem, "-o", tmp_path / "new")


def test_the_robots_are_good_before_they_are_spoilt(told: Told, problem: Path, tmp_path: Path) -> None:
    for name, text, zeros in (("arm.yaml", ROBOT, "[0, 0]"), ("arm.urdf", URDF, "[0]")):
        (tmp_path / name).write_text(text)
        goal = zeros.replace("0", "1")
        robot = f"{{file: {name}, collision: none}}"
        problem.write_text(f"spacearm: 1\nrobot: {robot}\nstart: {zeros}\ngoal: {{configuration: {goal}}}\n")
        code, _, err = told(["plan", problem, "-o", tmp_path / name.replace(".", "-"), "--no-figures", "--seed", 0])
        assert code == 0
        assert all(line.startswith("spacearm: robot '") for line in err.splitlines())  # what was assumed of it


def test_a_problem_file_that_is_missing_is_refused(refused: Refused, tmp_path: Path) -> None:
    refused("problem file: missing", "plan", tmp_path / "problm.yaml", "-o", tmp_path / "new")


def test_a_folder_in_the_place_of_a_problem_file_is_refused(refused: Refused, tmp_path: Path) -> None:
    (tmp_path / "problem").mkdir()
    refused("problem file: a folder", "plan", tmp_path / "problem", "-o", tmp_path / "new")
