"""Problem files: what they say, in each of its forms, and the sentence for each that is no good."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from spacearm.core.errors import FileFormatError, ProblemError, RobotError, SceneError, SettingsError, SpacearmError
from spacearm.files.plan_file import problem_as_dict, problem_from_dict, problem_hash
from spacearm.files.problem_file import load_problem, load_problem_file
from spacearm.geometry import Box, Capsule, Cylinder, HalfSpace, Polytope, Scene, Sphere, moved_shape, pose
from spacearm.planner.goals import ConfigurationGoal, PositionGoal
from spacearm.planner.planner_settings import PlannerSettings
from spacearm.planner.problem import Problem
from spacearm.robot import load_robot
from support import urdf_text
from support.messages import assert_refused
from support.written_files import written

PROBLEM = """\
spacearm: 1
robot: zhang2022
scene:
  - sphere: {center: [0.5, 0.5, 0.0], radius: 0.1}
start: [0, 0, 0, 0, 0, 0, 0]
goal: {position: [0.7, 0.3, 0.0]}
"""


def changed(old: str, new: str) -> str:
    assert old in PROBLEM
    return PROBLEM.replace(old, new)


def start(text: str) -> str:
    return changed("start: [0, 0, 0, 0, 0, 0, 0]", text)


def goal(text: str) -> str:
    return changed("goal: {position: [0.7, 0.3, 0.0]}", text)


def test_polytopes_and_rounded_shapes_are_read(tmp_path: Path) -> None:
    scene = """\
scene:
  - box: {size: [1, 2, 3], rounding: 0.02}
  - cylinder: {radius: 0.1, length: 1, rounding: 0.03}
  - polytope: {vertices: [[0, 0, 0], [1, 0, 0], [0, 1, 0]], rounding: 0.04, position: [0, 0, 3], rpy_deg: [0, 0, 90]}
"""
    read = load_problem(written(tmp_path, PROBLEM[: PROBLEM.index("scene:")] + scene + PROBLEM[PROBLEM.index("start:") :]))
    box, cylinder, hull = read.scene.obstacles
    assert box == Box((1, 2, 3), rounding=0.02)
    assert cylinder == Cylinder(0.1, 1.0, rounding=0.03)
    turned = moved_shape(
        Polytope([(0, 0, 0), (1, 0, 0), (0, 1, 0)], rounding=0.04), pose((0, 0, 3), (0.5**0.5, 0, 0, 0.5**0.5))
    )
    assert isinstance(hull, Polytope)
    assert np.allclose(hull.vertices, turned.vertices)
    assert hull.rounding == 0.04


def test_a_file_gives_the_same_problem_as_the_library(tmp_path: Path) -> None:
    expected = Problem(
        load_robot("zhang2022"),
        Scene((Sphere((0.5, 0.5, 0.0), 0.1),)),
        start=np.zeros(7),
        goal=PositionGoal((0.7, 0.3, 0.0)),
    )
    assert load_problem(written(tmp_path, PROBLEM)) == expected
    assert load_problem(str(tmp_path / "problem.yaml")) == expected


def test_what_is_a_little_beyond_a_limit_is_set_onto_it_and_said(tmp_path: Path) -> None:
    upper = float(load_robot("zhang2022").upper[3])
    text = start(f"start: [0, 0, 0, {upper + 3e-6!r}, 0, 0, 0]")
    made = load_problem(
        written(tmp_path, text.replace("{position: [0.7, 0.3, 0.0]}", f"{{configuration: {{elbow: {upper + 5e-6!r}}}}}"))
    )
    assert made.start[3] == upper
    assert made.goal.q[3] == upper  # type: ignore[union-attr]
    assert [("3e-06" in note, "5e-06" in note) for note in made.notes] == [(True, False), (False, True)]
    assert problem_from_dict(problem_as_dict(made)).notes == made.notes
    assert problem_hash(made) == problem_hash(replace(made, notes=()))


def test_the_formats_own_description_is_a_problem(tmp_path: Path) -> None:
    # Each line of the docstring's example is tried, with the first alternative of every key that has several.
    import spacearm.files.problem_file as files
    from spacearm.files.problem_schema import ProblemModel

    text = (files.__doc__ or "").split("::\n")[1]
    lines = [line.split("#")[0].strip() for line in text.splitlines()]
    kept, seen = [], set()
    for line in lines:
        key = line.split(":")[0]
        if line.startswith("- "):
            kept.append("  " + line)
        elif key in ProblemModel.model_fields or key == "spacearm":
            if key in seen or key == "start_deg":  # of a key with several forms, the first
                continue
            seen.add(key)
            kept.append(line)
    file = load_problem_file(written(tmp_path, "\n".join(kept)))
    assert seen == {"spacearm", *ProblemModel.model_fields} - {"version", "start_deg", "editor_schema"}
    assert file.problem.robot.name == "zhang2022"
    kinds = [type(obstacle) for obstacle in file.problem.scene.obstacles]
    assert kinds == [Sphere, Capsule, Box, Cylinder, HalfSpace]
    assert isinstance(file.problem.goal, ConfigurationGoal)
    assert file.settings.islands == 2


@pytest.mark.parametrize(
    "text",
    [
        "start: {elbow: 1.5}",
        "start: {elbow: 15e-1, wrist_3: 0}",
        "start: [0, 0, 0, 1.5, 0, 0, 0]",
        f"start_deg: {{elbow: {math.degrees(1.5)!r}}}",
        f"start_deg: [0, 0, 0, {math.degrees(1.5)!r}, 0, 0, 0]",
    ],
)
def test_a_start_may_be_written_in_several_ways(text: str, tmp_path: Path) -> None:
    q = load_problem(written(tmp_path, start(text))).start
    np.testing.assert_allclose(q, (0, 0, 0, 1.5, 0, 0, 0), atol=1e-15)


@pytest.mark.parametrize(
    "text",
    [
        "goal: {configuration: [0, 0, 0, 1.5, 0, 0, 0]}",
        "goal: {configuration: {elbow: 1.5}}",
        f"goal: {{configuration_deg: {{elbow: {math.degrees(1.5)!r}}}}}",
        f"goal: {{configuration_deg: [0, 0, 0, {math.degrees(1.5)!r}, 0, 0, 0]}}",
    ],
)
def test_a_configuration_goal_may_be_written_in_several_ways(text: str, tmp_path: Path) -> None:
    found = load_problem(written(tmp_path, goal(text))).goal
    assert isinstance(found, ConfigurationGoal)
    np.testing.assert_allclose(found.q, (0, 0, 0, 1.5, 0, 0, 0), atol=1e-15)


def test_a_limit_in_degrees_is_reached_in_degrees(tmp_path: Path) -> None:
    problem = load_problem(written(tmp_path, start("start_deg: {elbow: 170, wrist_2: -46}")))
    assert problem.start[3] == problem.robot.upper[3]


def test_a_position_goal_may_state_tolerance_and_frame(tmp_path: Path) -> None:
    text = goal("goal: {position: [0, 0.6, 0], tolerance: 1e-2, frame: forearm}")
    assert load_problem(written(tmp_path, text)).goal == PositionGoal((0, 0.6, 0), tolerance=0.01, frame="forearm")


@pytest.mark.parametrize("scene", ["", "scene: []\n", "scene:\n"])
def test_a_scene_may_be_left_out(scene: str, tmp_path: Path) -> None:
    text = changed("scene:\n  - sphere: {center: [0.5, 0.5, 0.0], radius: 0.1}\n", scene)
    assert load_problem(written(tmp_path, text)).scene == Scene()


def test_the_planners_settings_are_read(tmp_path: Path) -> None:
    text = PROBLEM + "planner: {islands: 4, preferred_clearance: 1e-1}\nbase: fixed\n"
    assert load_problem_file(written(tmp_path, text)).settings == PlannerSettings(islands=4, preferred_clearance=0.1)
    assert load_problem_file(written(tmp_path, PROBLEM)).settings == PlannerSettings()


@pytest.mark.parametrize(
    "robot",
    [
        "robot: robots/arm.urdf",
        "robot: {file: robots/arm.urdf}",
        "robot: {file: robots/arm.urdf, tip: link_2, velocity_limit: 0.5, collision: none}",
    ],
)
def test_a_robots_file_is_relative_to_the_problems(robot: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "robots").mkdir()
    joints = (urdf_text.joint("a", "link_0", "link_1"), urdf_text.joint("b", "link_1", "link_2"))
    written(tmp_path / "robots", urdf_text.chain(*joints), "arm.urdf")
    path = written(tmp_path, f"spacearm: 1\n{robot}\nstart: [0, 0]\ngoal: {{configuration: [1, 1]}}\n")
    monkeypatch.chdir(tmp_path / "robots")
    assert load_problem(path).robot.dof_names == ("a", "b")


def test_a_built_in_robot_takes_options(tmp_path: Path) -> None:
    text = changed("robot: zhang2022", "robot: {name: zhang2022, tip: hand, velocity_limit: 0.5}")
    robot = load_problem(written(tmp_path, text)).robot
    assert (robot.tip, robot.velocity[0]) == ("hand", 0.5)


def test_json_and_anchors_and_merges_are_yaml_too(tmp_path: Path) -> None:
    json = '{"spacearm": 1, "robot": "zhang2022", "start": [0,0,0,0,0,0,0], "goal": {"position": [0.7, 0.3, 0]}}'
    assert load_problem(written(tmp_path, json)).scene == Scene()
    text = changed(
        "  - sphere: {center: [0.5, 0.5, 0.0], radius: 0.1}\n",
        "  - sphere: &ball {center: [0.5, 0.5, 0.0], radius: 0.1}\n  - sphere: {<<: *ball, radius: 0.2}\n",
    )
    assert [ball.radius for ball in load_problem(written(tmp_path, text)).scene.obstacles] == [0.1, 0.2]


def test_a_file_may_begin_with_a_byte_order_mark_and_end_lines_as_windows_does(tmp_path: Path) -> None:
    text = b"\xef\xbb\xbf" + PROBLEM.replace("\n", "\r\n").encode()
    assert load_problem(written(tmp_path, text)).robot.name == "zhang2022"


FORMAT: dict[str, str | bytes] = {
    "empty": "",
    "only comments": "# a problem\n\n",
    "only a document mark": "---\n",
    "binary": bytes(range(256)),
    "NUL": "spacearm: 1\0",
    "Latin-1": "spacearm: 1\nname: Zürich\n".encode("latin-1"),
    "UTF-16": PROBLEM.encode("utf-16"),
    "control character": "spacearm: 1\nname: \x07\n",
    "text": "plan me a motion",
    "list": "- spacearm: 1\n",
    "URDF": urdf_text.chain(urdf_text.joint("a", "link_0", "link_1")),
    "robot file": "spacearm-robot: 1\nname: arm\n",
    "MoveIt scene": "name: (noname)+\nrobot_model_name: panda\nworld:\n  collision_objects: []\n",
    "MoveIt request": "workspace_parameters: {}\nstart_state: {}\ngoal_constraints: []\n",
    "another YAML": "services:\n  web: {image: nginx}\n",
    "another version": changed("spacearm: 1", "spacearm: 2"),
    "version as text": changed("spacearm: 1", "spacearm: '1'"),
    "version missing a value": changed("spacearm: 1", "spacearm:"),
    "broken indentation": changed("  - sphere", " - box: 1\n  - sphere"),
    "bracket not closed": changed("0, 0]", "0, 0"),
    "tab": changed("  - sphere", "\t- sphere"),
    "two documents": PROBLEM + "---\n" + PROBLEM,
    "unknown alias": changed("zhang2022", "*arm"),
    "Python object": changed("zhang2022", "!!python/object/apply:os.system ['true']"),
    "key twice": PROBLEM + "robot: zhang2022\n",
    "key twice inside": changed("radius: 0.1", "radius: 0.1, radius: 0.2"),
    "key is a list": PROBLEM + "? [a]\n: b\n",
    "nested deeply": "[" * 5000,
    "integer of thousands of digits": changed("radius: 0.1", "radius: " + "9" * 5000),
    "integer of hundreds of digits": changed("radius: 0.1", "radius: " + "9" * 400),
    "contains itself": start("start: &a [*a]"),
    "key mistyped": changed("scene:", "scen:"),
    "key of another tool": PROBLEM + "obstacles: []\n",
    "key is a number": PROBLEM + "7: up\n",
    "key with braces": PROBLEM + "'{x}': 1\n",
    "robot missing": changed("robot: zhang2022\n", ""),
    "robot empty": changed("robot: zhang2022", "robot:"),
    "robot a list": changed("zhang2022", "[zhang2022]"),
    "robot option mistyped": changed("zhang2022", "{file: arm.urdf, veloctiy_limit: 1}"),
    "robot collision mistyped": changed("zhang2022", "{name: zhang2022, collision: mesh}"),
    "robot limit text": changed("zhang2022", "{name: zhang2022, velocity_limit: fast}"),
    "scene a mapping": changed("  - sphere", "    sphere"),
    "obstacle of unknown shape": changed("sphere: {", "sfere: {"),
    "obstacle of two shapes": changed("radius: 0.1}", "radius: 0.1}\n    box: {size: 1}"),
    "obstacle a word": changed("sphere: {center: [0.5, 0.5, 0.0], radius: 0.1}", "sphere"),
    "sphere key mistyped": changed("radius", "raduis"),
    "sphere key missing": changed(", radius: 0.1", ""),
    "sphere radius text": changed("radius: 0.1", "radius: 10cm"),
    "sphere radius in quotes": changed("radius: 0.1", "radius: '0.1'"),
    "sphere radius true": changed("radius: 0.1", "radius: true"),
    "sphere radius NaN": changed("radius: 0.1", "radius: .nan"),
    "sphere radius infinite": changed("radius: 0.1", "radius: 1e999"),
    "sphere center a word": changed("[0.5, 0.5, 0.0]", "origin"),
    "sphere center NaN": changed("[0.5, 0.5, 0.0]", "[0.5, .NaN, 0.0]"),
    "start a number": start("start: 0"),
    "start with a word": start("start: [0, 0, 0, up, 0, 0, 0]"),
    "start with nothing": start("start: [0, 0, 0, , 0, 0, 0]"),
    "start with null": start("start: [0, 0, 0, null, 0, 0, 0]"),
    "start by name with a word": start("start: {elbow: up}"),
    "start infinite": start("start: {elbow: .inf}"),
    "goal missing": goal(""),
    "goal a list": goal("goal: [0, 0, 0, 0, 0, 0, 0]"),
    "goal key mistyped": goal("goal: {positon: [0.7, 0.3, 0.0]}"),
    "goal position a mapping": goal("goal: {position: {x: 1, y: 2, z: 3}}"),
    "goal tolerance text": goal("goal: {position: [0, 1, 0], tolerance: 1 mm}"),
    "base a number": PROBLEM + "base: 1\n",
    "base mistyped": PROBLEM + "base: fix\n",
    "planner a list": PROBLEM + "planner: [fast]\n",
}

MEANING: dict[str, tuple[type[SpacearmError], str]] = {
    "robot unknown": (RobotError, changed("zhang2022", "zhang2020")),
    "robot without name or file": (ProblemError, changed("zhang2022", "{tip: hand}")),
    "robot with name and file": (ProblemError, changed("zhang2022", "{name: zhang2022, file: arm.urdf}")),
    "robot file missing": (FileFormatError, changed("zhang2022", "{file: arm.urdf}")),
    "robot tip unknown": (RobotError, changed("zhang2022", "{name: zhang2022, tip: tool}")),
    "robot limit zero": (RobotError, changed("zhang2022", "{name: zhang2022, velocity_limit: 0}")),
    "sphere radius zero": (SceneError, changed("radius: 0.1", "radius: 0")),
    "sphere radius negative": (SceneError, changed("radius: 0.1", "radius: -0.1")),
    "sphere center in a plane": (SceneError, changed("[0.5, 0.5, 0.0]", "[0.5, 0.5]")),
    "start missing": (ProblemError, start("")),
    "start empty": (ProblemError, start("start:")),
    "start too short": (ProblemError, start("start: [0, 0]")),
    "start in both units": (ProblemError, start("start: [0, 0, 0, 0, 0, 0, 0]\nstart_deg: {elbow: 1}")),
    "start joint mistyped": (ProblemError, start("start: {elbo: 1}")),
    "start above its limit": (ProblemError, start("start: {elbow: 3.2}")),
    "start degrees as radians": (ProblemError, start("start: {elbow: 90}")),
    "start above its limit in degrees": (ProblemError, start("start_deg: {elbow: 200}")),
    "goal without target": (ProblemError, goal("goal: {tolerance: 0.1}")),
    "goal of two kinds": (ProblemError, goal("goal: {position: [0, 1, 0], configuration: {elbow: 1}}")),
    "goal in both units": (
        ProblemError,
        goal("goal: {configuration: {elbow: 1}, configuration_deg: {elbow: 1}}"),
    ),
    "goal tolerance beside a configuration": (
        ProblemError,
        goal("goal: {configuration: {elbow: 1}, position_tolerance: 1}"),
    ),
    "goal joint mistyped": (ProblemError, goal("goal: {configuration: {elbo: 1}}")),
    "goal above its limit": (ProblemError, goal("goal: {configuration: {elbow: 3.2}}")),
    "goal tolerance negative": (ProblemError, goal("goal: {position: [0, 1, 0], tolerance: -1}")),
    "goal position in a plane": (ProblemError, goal("goal: {position: [0, 1]}")),
    "goal frame mistyped": (ProblemError, goal("goal: {position: [0, 1, 0], frame: han}")),
    "planner setting unknown": (SettingsError, PROBLEM + "planner: {island: 3}\n"),
    "planner setting out of range": (SettingsError, PROBLEM + "planner:\n  islands: 0\n"),
}


@pytest.mark.parametrize("case", FORMAT)
def test_a_file_that_is_no_problem_file_is_refused(case: str, tmp_path: Path) -> None:
    path = written(tmp_path, FORMAT[case])
    assert_refused("problem_file", case, FileFormatError, lambda: load_problem(path), path=path)


@pytest.mark.parametrize("case", MEANING)
def test_a_file_whose_problem_cannot_be_is_refused_with_its_line(case: str, tmp_path: Path) -> None:
    error, text = MEANING[case]
    path = written(tmp_path, text)

    def call() -> object:
        try:
            return load_problem(path)
        except SpacearmError as refusal:
            raise type(refusal)(str(refusal).replace(str(tmp_path / "arm.urdf"), "<robot's path>")) from None

    assert_refused("problem_file", case, error, call, path=path)


def test_a_path_that_is_no_file_is_refused(tmp_path: Path) -> None:
    missing = tmp_path / "problem.yaml"
    assert_refused("problem_file", "missing", FileFormatError, lambda: load_problem(missing), path=missing)
    assert_refused("problem_file", "directory", FileFormatError, lambda: load_problem(tmp_path), path=tmp_path)
    too_long: Any = "x" * 5000
    assert_refused("problem_file", "name too long", FileFormatError, lambda: load_problem(too_long))
    no_path: Any = {"spacearm": 1}
    assert_refused("problem_file", "no path", FileFormatError, lambda: load_problem(no_path))


def test_degrees_are_refused_for_what_slides(tmp_path: Path) -> None:
    limit = 'lower="0.1" upper="1" velocity="1"'
    joints = (
        urdf_text.joint("turn", "link_0", "link_1"),
        urdf_text.joint("slide", "link_1", "link_2", kind="prismatic", limit=limit),
    )
    written(tmp_path, urdf_text.chain(*joints), "arm.urdf")
    for case, text in {
        "degrees for a slide": "start_deg: [10, 20]",
        "degrees for a slide by name": "start_deg: {slide: 20}",
        "slide not named": "start: {turn: 0.5}",
    }.items():
        path = written(tmp_path, f"spacearm: 1\nrobot: arm.urdf\n{text}\ngoal: {{configuration: [0, 0.5]}}\n")
        assert_refused("problem_file", case, ProblemError, lambda path=path: load_problem(path), path=path)


@given(st.text(st.sampled_from("spacerm:1 \n\t-[]{}'\"&*!|>%@#,?~.0eE<=robot")))
def test_any_text_is_read_or_refused_in_one_line(text: str) -> None:
    with TemporaryDirectory() as directory:
        for content in (text, f"spacearm: 1\n{text}", PROBLEM + text):
            path = written(Path(directory), content)
            try:
                load_problem(path)
                said = ""
            except SpacearmError as error:
                said = str(error)
            assert "\n" not in said


@pytest.mark.parametrize("tag", ["int", "float", "bool", "timestamp", "set", "omap", "pairs", "null", "seq"])
def test_a_tag_that_its_value_does_not_fit_is_refused(tag: str, tmp_path: Path) -> None:
    path = written(tmp_path, changed("radius: 0.1", f"radius: !!{tag} x"))
    assert_refused("problem_file", f"tag {tag}", FileFormatError, lambda: load_problem(path), path=path)
