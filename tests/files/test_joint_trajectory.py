"""ROS's joint trajectories, in every layout that ROS prints them in."""

from __future__ import annotations

import contextlib
import json
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from spacearm.core.errors import FileFormatError, SpacearmError
from spacearm.files import load_trajectory, write_ros_trajectory
from spacearm.motion import Motion, PiecewisePath, RecordedTrajectory, Trajectory
from spacearm.robot import load_robot
from support.messages import assert_refused
from support.small_robots import two_link

ROBOT = two_link()
LINES = PiecewisePath.from_linear([0, 0.5, 2], [[0, 0], [0.2, 0.1], [0.3, 0.5]])
POINTS = [(0.0, [0.0, 0.0]), (0.5, [0.2, 0.1]), (2.0, [0.3, 0.5])]


def stamp(t: float, whole: str = "sec", rest: str = "nanosec") -> dict[str, int]:
    return {whole: int(t), rest: round(t % 1 * 1e9)}


def message(**changes: Any) -> dict[str, Any]:
    points = [
        {"positions": q, "velocities": [], "accelerations": [], "effort": [], "time_from_start": stamp(t)} for t, q in POINTS
    ]
    header = {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": ""}
    return {"header": header, "joint_names": ["shoulder", "elbow"], "points": points, **changes}


def timed(make: Any) -> list[dict[str, Any]]:
    return [{"positions": q, "time_from_start": make(t)} for t, q in POINTS]


ROS2_ECHO = """\
header:
  stamp:
    sec: 0
    nanosec: 0
  frame_id: ''
joint_names:
- shoulder
- elbow
points:
- positions:
  - 0.0
  - 0.0
  velocities: []
  accelerations: []
  effort: []
  time_from_start:
    sec: 0
    nanosec: 0
- positions:
  - 0.2
  - 0.1
  velocities: []
  accelerations: []
  effort: []
  time_from_start:
    sec: 0
    nanosec: 500000000
- positions:
  - 0.3
  - 0.5
  velocities: []
  accelerations: []
  effort: []
  time_from_start:
    sec: 2
    nanosec: 0
---
"""
ROS1_ECHO = """\
header:
  seq: 1
  stamp:
    secs: 0
    nsecs:         0
  frame_id: ""
joint_names: [shoulder, elbow]
points:
  -
    positions: [0.0, 0.0]
    velocities: []
    accelerations: []
    effort: []
    time_from_start:
      secs: 0
      nsecs:         0
  -
    positions: [0.2, 0.1]
    velocities: []
    accelerations: []
    effort: []
    time_from_start:
      secs: 0
      nsecs: 500000000
  -
    positions: [0.3, 0.5]
    velocities: []
    accelerations: []
    effort: []
    time_from_start:
      secs: 2
      nsecs:         0
---
"""
MOVED = {"joint_names": [], "points": []}
LAYOUTS: dict[str, str] = {
    "ros2 topic echo": ROS2_ECHO,
    "rostopic echo": ROS1_ECHO,
    "the same message twice": ROS2_ECHO + ROS2_ECHO,
    "a document mark before it": "---\n" + ROS2_ECHO,
    "comments before it": "# recorded\n\n" + ROS2_ECHO,
    "Windows": "\ufeff" + ROS2_ECHO.replace("\n", "\r\n"),
    "JSON": json.dumps(message()),
    "JSON, indented": json.dumps(message(), indent=2),
    "YAML on one line": yaml.safe_dump(message(), default_flow_style=True, width=10**6),
    "times as numbers": yaml.safe_dump(message(points=timed(float))),
    "times as secs and nsecs": json.dumps(message(points=timed(lambda t: stamp(t, "secs", "nsecs")))),
    "times of seconds alone": json.dumps(message(points=timed(lambda t: {"sec": t}))),
    "without a header": yaml.safe_dump({"joint_names": ["shoulder", "elbow"], "points": timed(float)}),
    "RobotTrajectory": yaml.safe_dump({"joint_trajectory": message(), "multi_dof_joint_trajectory": MOVED}),
    "DisplayTrajectory": yaml.safe_dump({"model_id": ROBOT.name, "trajectory": [{"joint_trajectory": message()}]}),
    "a goal of FollowJointTrajectory": yaml.safe_dump({"goal": {"trajectory": message(), "goal_tolerance": []}}),
    "planned by MoveIt": yaml.safe_dump({"planned_trajectory": {"joint_trajectory": message()}, "planning_time": 0.1}),
    "joints in another order": json.dumps(
        message(
            joint_names=["elbow", "shoulder"], points=[{**p, "positions": p["positions"][::-1]} for p in message()["points"]]
        )
    ),
    "another joint that stands still": json.dumps(
        message(
            joint_names=["finger", "shoulder", "elbow"],
            points=[{**p, "positions": [0.04, *p["positions"]]} for p in message()["points"]],
        )
    ),
}


def written(folder: Path, content: str) -> Path:
    path = folder / "message"
    path.write_text(content, encoding="utf-8", newline="")
    return path


@pytest.mark.parametrize("layout", LAYOUTS)
def test_a_message_is_read_in_any_layout(layout: str, tmp_path: Path) -> None:
    read = load_trajectory(ROBOT, written(tmp_path, LAYOUTS[layout]))
    assert read.path == LINES
    assert read.contradictions == ()


def test_what_was_made_of_it_is_told(tmp_path: Path) -> None:
    def notes(layout: str) -> tuple[str, ...]:
        return load_trajectory(ROBOT, written(tmp_path, LAYOUTS[layout])).notes

    assert "the file has the joints in another order; they are taken by their names" in notes("joints in another order")
    assert notes("another joint that stands still")[0] == (
        "joints left alone, for they do not move and are none of the robot's: 'finger' at 0.04"
    )
    assert notes("planned by MoveIt")[0] == "left alone: planning_time"
    framed = message(header={"frame_id": "base_link"}, points=[{**p, "effort": [1.0, 1.0]} for p in message()["points"]])
    read = load_trajectory(ROBOT, written(tmp_path, json.dumps(framed)))
    assert read.notes[0] == "left alone: header.frame_id 'base_link', effort"


def test_rates_and_accelerations_make_cubics_and_quintics(tmp_path: Path) -> None:
    points = [{**p, "velocities": [0.0, 0.0]} for p in message()["points"]]
    assert load_trajectory(ROBOT, written(tmp_path, json.dumps(message(points=points)))).path.degree == 3
    points = [{**p, "accelerations": [0.0, 0.0]} for p in points]
    assert load_trajectory(ROBOT, written(tmp_path, json.dumps(message(points=points)))).path.degree == 5
    del points[0]["velocities"]
    assert load_trajectory(ROBOT, written(tmp_path, json.dumps(message(points=points))), interpolation="linear").path == LINES


def floating_file(path: Path) -> tuple[RecordedTrajectory, dict[str, Any]]:
    robot = load_robot("srs7")
    motion = Motion([np.full(7, 0.1), np.array([0.3, 0.2, -0.3, 0.2, -0.3, 0.1, 0.2])])
    write_ros_trajectory(Trajectory(robot, motion, base="floating"), path)
    return load_trajectory(robot, path), json.loads(path.read_text())


def test_our_own_message_comes_back_with_its_base(tmp_path: Path) -> None:
    read, _ = floating_file(tmp_path / "ours.json")
    assert read.contradictions == ()
    assert read.limits.holds
    assert any("the base moves by conservation of momentum" in note for note in read.notes)


@pytest.mark.parametrize("part", ["position", "orientation", "linear", "angular"])
def test_a_base_that_is_elsewhere_in_the_message_fails(part: str, tmp_path: Path) -> None:
    path = tmp_path / "ours.json"
    _, values = floating_file(path)
    if part in ("position", "orientation"):
        values["base_path"]["poses"][100]["pose"][part]["x"] += 1e-5
    else:
        values["base_twists"][100]["twist"][part]["x"] += 1e-3
    path.write_text(json.dumps(values))
    assert len(load_trajectory(load_robot("srs7"), path).contradictions) == 1


def test_a_fixed_base_that_a_virtual_joint_moves_is_refused(tmp_path: Path) -> None:
    at = {"translation": {"x": 0, "y": 0, "z": 0}, "rotation": {"x": 0, "y": 0, "z": 0, "w": 1}}
    away = {**at, "translation": {"x": 0.5, "y": 0, "z": 0}}

    def read(second: dict[str, Any]) -> RecordedTrajectory:
        points = [{"transforms": [at], "time_from_start": stamp(0)}, {"transforms": [second], "time_from_start": stamp(2)}]
        several = {"joint_names": ["virtual_joint"], "points": points}
        whole = {"joint_trajectory": message(), "multi_dof_joint_trajectory": several}
        return load_trajectory(ROBOT, written(tmp_path, json.dumps(whole)))

    assert read(at).contradictions == ()
    with pytest.raises(FileFormatError, match="from where a fixed base stays"):
        read(away)


def test_another_robot_or_beginning_than_stated_fails(tmp_path: Path) -> None:
    start = {"joint_state": {"name": ["shoulder", "elbow"], "position": [0.0, 0.4]}}
    whole = {"model_id": "panda", "trajectory_start": start, "trajectory": [{"joint_trajectory": message()}]}
    assert load_trajectory(ROBOT, written(tmp_path, json.dumps(whole))).contradictions == (
        "the file is of robot 'panda', and this is 'two_link'",
        "the file has joint 'elbow' at 0.4 before the motion, which begins at 0",
    )


def points_with(i: int, **changes: Any) -> dict[str, Any]:
    points = message()["points"]
    points[i] = {key: value for key, value in {**points[i], **changes}.items() if value is not None}
    return message(points=points)


BROKEN: dict[str, Any] = {
    "no names": {"points": timed(float)},
    "no points": message(points=[]),
    "one point": message(points=timed(float)[:1]),
    "joint twice": message(joint_names=["elbow", "elbow"]),
    "joint missing": message(joint_names=["shoulder", "ellbow"]),
    "another joint that moves": message(
        joint_names=["torso", "shoulder", "elbow"],
        points=[{**p, "positions": [0.1 * i, *p["positions"]]} for i, p in enumerate(message()["points"])],
    ),
    "too few positions": points_with(1, positions=[0.2]),
    "no positions": points_with(1, positions=[]),
    "positions missing": points_with(1, positions=None),
    "time missing": points_with(1, time_from_start=None),
    "time of words": points_with(1, time_from_start="soon"),
    "time of other parts": points_with(1, time_from_start={"sec": 1, "minutes": 2}),
    "times fall": points_with(2, time_from_start=stamp(0.25)),
    "a word among positions": points_with(1, positions=[0.1, "0.2"]),
    "cut short by echo": points_with(1, positions=[0.1, "..."]),
    "rates of some points": points_with(1, velocities=[0.1, 0.1]),
    "a key mistyped": points_with(1, velocites=[0.1, 0.1]),
    "two trajectories": [message(), message(points=timed(lambda t: 2 * t))],
    "another message": {"header": {}, "name": ["shoulder"], "position": [0.0]},
}  # fmt: skip


@pytest.mark.parametrize("case", BROKEN)
def test_broken_messages_are_refused(case: str, tmp_path: Path) -> None:
    for dump in (json.dumps, partial(yaml.safe_dump, sort_keys=False)):
        path = written(tmp_path, dump(BROKEN[case]))
        assert_refused("motion", f"message: {case}", FileFormatError, lambda p=path: load_trajectory(ROBOT, p), path=path)


WHOLE = json.loads(
    json.dumps(
        {
            "model_id": ROBOT.name,
            "trajectory_start": {"joint_state": {"name": ["shoulder"], "position": [0.0]}},
            "trajectory": [
                {
                    "joint_trajectory": message(),
                    "base_path": {"poses": [{"header": {"stamp": stamp(0)}, "pose": {
                        "position": {"x": 0, "y": 0, "z": 0}, "orientation": {"x": 0, "y": 0, "z": 0, "w": 1}}}]},
                    "base_twists": [{"header": {"stamp": stamp(0)}, "twist": {
                        "linear": {"x": 0, "y": 0, "z": 0}, "angular": {"x": 0, "y": 0, "z": 0}}}],
                }
            ],
        }
    )
)  # fmt: skip
JUNK = st.sampled_from(
    [None, True, -1, 1e400, float("nan"), 10**400, "", "word", [], {}, [[]], [None], {"x": 1}, {1: [2]}, "\ud800"]
)


def places(value: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    inside = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    return [path, *(place for key, inner in inside for place in places(inner, (*path, key)))]


@settings(max_examples=40)
@given(st.sampled_from(places(WHOLE)[1:]), JUNK, st.booleans())
def test_whatever_a_message_holds_it_is_read_or_refused_in_a_sentence(place: tuple[Any, ...], junk: Any, as_json: bool) -> None:
    whole = json.loads(json.dumps(WHOLE))
    inner = whole
    for key in place[:-1]:
        inner = inner[key]
    inner[place[-1]] = junk
    try:
        text = json.dumps(whole) if as_json else yaml.safe_dump(whole)
    except (TypeError, ValueError, yaml.YAMLError):
        return
    with TemporaryDirectory() as folder:
        path = Path(folder) / "message"
        path.write_bytes(text.encode("utf-8", errors="replace"))
        with contextlib.suppress(SpacearmError):
            load_trajectory(ROBOT, path)
