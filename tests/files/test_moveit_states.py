"""MoveIt's files: what they say of the robot besides the joints that it plans for, and of frames; nothing is passed over."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from spacearm import forward_kinematics, hold, load_moveit, load_moveit_scene, load_robot, plan
from spacearm.core.errors import FileFormatError, RobotError
from spacearm.geometry import Sphere, pose, support
from spacearm.planner import Problem
from spacearm.robot import Body, Robot
from spacearm.robot.unchecked_pairs import apart_pairs
from support import urdf_text

SCREW = {"position": [0.1, 0.2, 0.3], "orientation": [0, 0, 0.6, 0.8]}
T_SCREW = np.eye(4)
T_SCREW[:3, :3], T_SCREW[:3, 3] = Rotation.from_quat([0, 0, 0.6, 0.8]).as_matrix(), [0.1, 0.2, 0.3]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A lift outside the group, two joints in it, a finger, and a thumb that follows the finger."""
    path = tmp_path_factory.mktemp("robot")
    ball = urdf_text.collision('<sphere radius="0.04"/>')
    slide = 'lower="0" upper="1" velocity="1" effort="1"'
    grip = 'lower="0" upper="0.04" velocity="1" effort="1"'
    links = ["base", "column", "upper", "fore", "finger", "thumb", "stand"]
    joints = [
        urdf_text.joint("lift", "base", "column", kind="prismatic", limit=slide),
        urdf_text.joint("pan", "column", "upper", xyz="0 0 0.2"),
        urdf_text.joint("elbow", "upper", "fore", xyz="0.5 0 0"),
        urdf_text.joint("finger", "fore", "finger", kind="prismatic", axis="0 1 0", xyz="0.2 0 0", limit=grip),
        urdf_text.joint(
            *("thumb", "fore", "thumb"),
            **{"kind": "prismatic", "axis": "0 -1 0", "xyz": "0.2 0 0", "limit": grip},
            extra='<mimic joint="finger" multiplier="1"/>',
        ),
        urdf_text.joint("post", "base", "stand", kind="fixed", xyz="0 -1 0"),
    ]
    text = urdf_text.robot(*(urdf_text.link(name, ball) for name in links), *joints, name="lifted")
    (path / "arm.urdf").write_text(text)
    for kind in ("none", "fixed", "floating", "planar"):
        held = "" if kind == "none" else f'<virtual_joint name="vj" type="{kind}" parent_frame="odom" child_link="base"/>'
        group = '<group name="arm"><joint name="pan"/><joint name="elbow"/></group>'
        (path / f"{kind}.srdf").write_text(f'<robot name="lifted">{group}{held}</robot>')
    return path


def lifted(folder: Path, kind: str = "none", **options: Any) -> Robot:
    return load_robot(folder / "arm.urdf", srdf=folder / f"{kind}.srdf", group="arm", acceleration_limit=1.0, **options)


def state(joints: dict[str, float], **more: Any) -> dict[str, Any]:
    return {"joint_state": {"name": list(joints), "position": list(joints.values())}, **more}


START = {"lift": 0.5, "pan": 0.3, "elbow": -0.2, "finger": 0.03}


def item(name: str, frame: str | None = None, **more: Any) -> dict[str, Any]:
    header = {} if frame is None else {"header": {"frame_id": frame}}
    solid = {"primitives": [{"type": "sphere", "dimensions": [0.05]}], "primitive_poses": [SCREW]}
    return {"id": name, **header, **solid, **more}


def attached(thing: dict[str, Any], link: str = "fore", **more: Any) -> dict[str, Any]:
    return {"attached_collision_objects": [{"link_name": link, "object": thing, **more}]}


def joint_goal(**positions: float) -> dict[str, Any]:
    named = {"pan": -0.5, "elbow": 0.5, **positions}
    return {"joint_constraints": [{"joint_name": name, "position": at} for name, at in named.items()]}


Load = Callable[..., Problem]


@pytest.fixture
def load(tmp_path: Path, folder: Path) -> Load:
    def load(robot: Robot | None = None, *, start: Any = None, goal: Any = None, scene: Any = None, **more: Any) -> Problem:
        options = {key: more.pop(key) for key in ("acm",) if key in more}
        scene = {"world": {"collision_objects": []}, **(scene or {})}
        start = state(START) if start is None else start
        request = {"start_state": start, "goal_constraints": [goal or joint_goal()], **more}
        for name, content in (("scene.yaml", scene), ("request.yaml", request)):
            (tmp_path / name).write_text(json.dumps(content, indent=1))
        robot = lifted(folder) if robot is None else robot
        return load_moveit(robot, tmp_path / "scene.yaml", tmp_path / "request.yaml", **options)

    return load


def at(problem: Problem, frame: str) -> np.ndarray:
    return problem.base_start @ forward_kinematics(problem.robot, problem.start, frame=frame)


def told(problem: Problem, *words: str) -> bool:
    return any(all(word in note for word in words) for note in problem.notes)


# Joints that the robot does not plan for.


def test_joints_outside_the_group_stand_where_the_start_has_them(load: Load, folder: Path) -> None:
    problem = load()
    assert problem.start.tolist() == [0.3, -0.2]
    assert at(problem, "column")[2, 3] == 0.5
    np.testing.assert_allclose(at(problem, "finger") @ pose((0, -0.03, 0)), at(problem, "fore") @ pose((0.2, 0, 0)), atol=1e-15)
    np.testing.assert_allclose(at(problem, "thumb") @ pose((0, 0.03, 0)), at(problem, "fore") @ pose((0.2, 0, 0)), atol=1e-15)
    assert told(problem, "locked where the start has them", "lift at 0.5", "finger at 0.03")
    assert problem.robot == replace(lifted(folder, fixed={"lift": 0.5, "finger": 0.03}), notes=problem.robot.notes)


def test_the_scenes_state_comes_before_the_starts(load: Load) -> None:
    problem = load(start=state({"pan": 0.1}), scene={"robot_state": state({**START, "pan": 0.9})})
    assert (problem.start.tolist(), at(problem, "column")[2, 3]) == ([0.1, -0.2], 0.5)
    problem = load(start=state({"lift": 0.2}), scene={"robot_state": state(START)})
    assert (problem.start.tolist(), at(problem, "column")[2, 3]) == ([0.3, -0.2], 0.2)


def test_what_is_held_may_stand_beyond_its_limits_and_that_is_said(load: Load) -> None:
    problem = load(start=state({**START, "finger": 0.065}))  # a public Panda's limit is 0.04, its requests have 0.065
    assert told(problem, "finger at 0.065 (beyond its limits 0 to 0.04)")
    assert at(problem, "finger")[1, 3] != at(problem, "fore")[1, 3]


def test_a_joint_that_follows_speaks_for_the_one_that_leads(load: Load) -> None:
    start = {name: value for name, value in START.items() if name != "finger"}
    problem = load(start=state({**start, "thumb": 0.02}))
    assert told(problem, "finger at 0.02")
    assert told(load(start=state({**START, "thumb": 0.01})), "'thumb' follows 'finger'", "0.03", "0.01")


def test_what_was_changed_since_loading_stays_changed(load: Load, folder: Path) -> None:
    robot = lifted(folder, fixed={"lift": 0.9})
    slower = replace(robot, velocity=robot.velocity / 2, name="slow", self_pairs=(), notes=(*robot.notes, "mine"))
    problem = load(slower)
    assert at(problem, "column")[2, 3] == 0.5
    assert (problem.robot.velocity == robot.velocity / 2).all()
    assert (problem.robot.name, problem.robot.self_pairs) == ("slow", ())
    assert "mine" in problem.robot.notes
    assert not any("0.9" in note for note in problem.robot.notes)
    assert (
        load(lifted(folder, fixed={"lift": 0.5, "finger": 0.03})).robot.notes
        == lifted(folder, fixed={"lift": 0.5, "finger": 0.03}).notes
    )
    with pytest.raises(RobotError, match=r"changed since it was loaded.*fixed=\{'lift': 0.5"):
        load(hold(robot, Sphere((0, 0, 0), 0.1)))


def test_joints_that_are_not_there_are_named(load: Load) -> None:
    problem = load(start=state({**START, "l_wheel": 0.1, "post": 0.2}))
    assert told(problem, "does not have", "l_wheel at 0.1")
    assert told(problem, "fixed in place", "post at 0.2")


def test_a_goal_for_a_held_joint_is_where_it_is_held_or_refused(load: Load) -> None:
    load(goal=joint_goal(lift=0.5))
    with pytest.raises(FileFormatError, match=r"wants joint 'lift' at 0\.2, which .* locked at 0\.5"):
        load(goal=joint_goal(lift=0.2))


def test_a_goal_a_little_beyond_a_limit_is_set_onto_it_and_said(load: Load) -> None:
    problem = load(start=state({**START, "pan": 1 + 2e-6}), goal=joint_goal(elbow=-1 - 9e-6))
    assert (problem.start[0], problem.goal.q[1]) == (1.0, -1.0)  # type: ignore[union-attr]
    assert told(problem, "start is a little beyond", "'pan' by 2e-06 rad")
    assert told(problem, "goal", "'elbow' by 9e-06 rad")


# What else a request asks.


@pytest.mark.parametrize(("factor", "scale"), [(0, 1), (0.1, 0.1), (1, 1), (1.5, 1), (-0.2, 1)])
def test_speed_is_scaled_as_moveit_does(factor: float, scale: float, load: Load, folder: Path) -> None:
    problem = load(max_velocity_scaling_factor=factor, max_acceleration_scaling_factor=0.5)
    np.testing.assert_allclose(problem.robot.velocity, lifted(folder).velocity * scale)
    np.testing.assert_allclose(problem.robot.acceleration, lifted(folder).acceleration * 0.5)
    assert told(problem, "max_velocity_scaling_factor") == (factor not in (0, 1))


def test_what_is_left_out_is_named(load: Load) -> None:
    start = state(START, is_diff=True)
    start["joint_state"] |= {"velocity": [0, 0.1, 0, 0], "effort": [math.nan, 1, 1, 1], "header": {"frame_id": "base"}}
    request = {"planner_id": "RRT", "num_planning_attempts": 1, "workspace_parameters": {"min_corner": [-1, -1, -1]}}
    scene = {"robot_model_name": "other", "is_diff": True, "object_colors": [{"id": "x", "color": {"r": 1}}]}
    problem = load(start=start, scene=scene, group_name="both", allowed_planning_time=0, colour="red", **request)
    for words in (
        ("the request states what is left out: colour, num_planning_attempts, planner_id, workspace_parameters",),
        ("the scene states what is left out: object_colors",),
        ("velocity", "starts at rest"),
        ("effort",),
        ("is_diff",),
        ("robot 'other'",),
        ("group 'both'",),
    ):
        assert told(problem, *words), (words, problem.notes)


def test_a_matrix_that_is_not_taken_is_told_of_where_it_wants_more(load: Load, folder: Path) -> None:
    names = ["base", "fore", "can"]
    values = [[False, False, False], [False, False, True], [False, True, False]]
    scene = {
        "allowed_collision_matrix": {"entry_names": names, "entry_values": values},
        "world": {"collision_objects": [item("can")]},
    }
    fewer = replace(lifted(folder), self_pairs=())
    assert told(load(fewer, scene=scene), "does not check: base and fore", "acm=True")
    problem = load(lifted(folder), scene=scene)
    assert not told(problem, "does not check")
    assert told(problem, "lets links touch 'can'", "left out")
    taken = load(fewer, scene=scene, acm=True)
    assert not told(taken, "does not check")
    assert len(taken.robot.notes) == len(set(taken.robot.notes))
    # Pairs that cannot meet within the limits are proven by the certificate, so nothing is amiss.
    apart = replace(fewer, apart=apart_pairs(fewer, [("base", "fore")]))
    assert not told(load(apart, scene=scene), "does not check")


# Frames.


@pytest.mark.parametrize("kind", ["none", "fixed", "floating", "planar"])
def test_the_planning_frame_is_as_the_srdf_holds_the_root(kind: str, load: Load, folder: Path) -> None:
    planning = "odom" if kind in ("floating", "planar") else "base"
    table = {"translation": [2, 0, 0], "rotation": [0, 0, 1, 0]}
    fixed = [
        {"header": {"frame_id": planning}, "child_frame_id": planning, "transform": {}},
        {"header": {"frame_id": "/table"}, "child_frame_id": planning, "transform": table},
    ]
    frames = [None, "", planning, f"/{planning}", "base", "table", "stand"] + (["odom"] if kind == "fixed" else [])
    items = [item(f"{i}", frame) for i, frame in enumerate(frames)]
    scene = {"fixed_frame_transforms": fixed, "world": {"collision_objects": items}}
    problem = load(lifted(folder, kind), scene=scene)
    for obstacle, frame in zip(problem.scene.obstacles, frames, strict=True):
        T = {"table": pose((2, 0, 0), (0, 0, 0, 1)), "stand": pose((0, -1, 0))}.get(frame or "", np.eye(4))
        np.testing.assert_allclose(obstacle.center, (T @ T_SCREW)[:3, 3], atol=1e-15)  # type: ignore[union-attr]
    moved = {"joint_names": ["vj"], "transforms": [{"translation": [0, 0, 1], "rotation": [0, 0, 0.6, 0.8]}]}
    start = state(START, multi_dof_joint_state=moved)
    if kind == "fixed":
        with pytest.raises(FileFormatError, match="the SRDF fixes by joint 'vj'"):
            load(lifted(folder, kind), start=start, scene=scene)
        return
    problem = load(lifted(folder, kind), start=start, scene=scene)
    T = pose((0, 0, 1), (0.8, 0, 0, 0.6))
    np.testing.assert_allclose(problem.base_start, T, atol=1e-15)
    assert told(problem, "base at (0, 0, 1) m")
    np.testing.assert_allclose(problem.scene.obstacles[6].center, (T @ pose((0, -1, 0)) @ T_SCREW)[:3, 3], atol=1e-15)  # type: ignore[union-attr]


def test_world_is_the_planning_frame_where_nothing_places_it(load: Load) -> None:
    problem = load(scene={"world": {"collision_objects": [item("can", "world")]}})
    assert problem.scene.obstacles[0].center.tolist() == [0.1, 0.2, 0.3]  # type: ignore[union-attr]
    assert told(problem, "frame 'world' is not placed", "planning frame 'base'")


def test_a_link_is_where_the_state_has_it(load: Load) -> None:
    def placed(link: str, x: float) -> dict[str, Any]:
        T = {"translation": [x, 0, 0], "rotation": [0, 0, 0, 1]}
        return {"fixed_frame_transforms": [{"header": {"frame_id": link}, "child_frame_id": "base", "transform": T}]}

    with pytest.raises(FileFormatError, match="places link 'stand' elsewhere"):
        load(scene=placed("stand", 1.0))
    assert told(load(scene=placed("fore", 1.0)), "link 'fore' is where the scene's state has it")


def test_objects_stand_in_links_and_in_each_other(load: Load) -> None:
    newer = item("shelf", "fore", pose=SCREW, subframe_names=["hook"], subframe_poses=[SCREW])
    scene = {
        "robot_state": state({**START, "pan": 0.7}),
        "world": {"collision_objects": [newer, item("one"), item("a", "shelf"), item("b", "shelf/hook"), item("c", "one")]},
    }
    problem = load(scene=scene)
    in_scene = forward_kinematics(problem.robot, [0.7, -0.2], frame="fore")  # objects stand where the scene's state has links
    T = {"shelf": in_scene @ T_SCREW @ T_SCREW, "one": T_SCREW, "a": in_scene @ T_SCREW @ T_SCREW, "c": T_SCREW @ T_SCREW}
    T["b"] = in_scene @ T_SCREW @ T_SCREW @ T_SCREW
    for obstacle in problem.scene.obstacles:
        np.testing.assert_allclose(obstacle.center, T[obstacle.name][:3, 3], atol=1e-15)  # type: ignore[union-attr]
    assert told(problem, "frame 'fore'", "scene's state")


def test_objects_are_appended_moved_and_removed(load: Load) -> None:
    away = {"position": [5, 0, 0], "orientation": [0, 0, 0, 1]}
    items = [
        *(item("a"), item("b"), item("c"), item("d")),
        {"id": "b", "operation": 1},
        {"id": "c", "pose": away, "operation": 3},
        item("d", operation=2, pose=away),
        item("e", operation="\0"),
        {"id": "gone", "operation": 1},
    ]
    problem = load(scene={"world": {"collision_objects": items}})
    assert told(problem, "'gone'", "not there")
    names = {o.name: o.center for o in problem.scene.obstacles}  # type: ignore[union-attr]
    assert sorted(names) == ["a", "c", "d 1", "d 2", "e"]
    assert names["c"].tolist() == [5, 0, 0]  # an object of one shape has that one's pose
    np.testing.assert_allclose(names["d 2"], [5.1, 0.2, 0.3], atol=1e-12)


def test_a_goal_may_be_for_a_point_beside_a_link_and_in_any_frame_that_stands(load: Load) -> None:
    region = {"primitives": [{"type": "sphere", "dimensions": [0.01]}], "primitive_poses": [SCREW]}
    turned = {"link_name": "fore", "orientation": [0, 0, 0.6, 0.8], "header": {"frame_id": "can"}}
    turned |= {f"absolute_{axis}_axis_tolerance": 0.1 for axis in "xyz"}
    position = {
        "link_name": "fore",
        "constraint_region": region,
        "header": {"frame_id": "can"},
        "target_point_offset": [0, 0, 0.1],
    }
    scene = {"world": {"collision_objects": [item("can", "column")]}, "robot_state": state(START)}
    problem = load(scene=scene, goal={"position_constraints": [position], "orientation_constraints": [turned]})
    T = pose((0, 0, 0.5)) @ T_SCREW @ T_SCREW  # the lift is up, and stays so
    np.testing.assert_allclose(problem.goal.pose, T, atol=1e-12)  # type: ignore[union-attr]
    np.testing.assert_allclose(at(problem, problem.goal.frame), at(problem, "fore") @ pose((0, 0, 0.1)), atol=1e-15)  # type: ignore[union-attr]
    position["header"]["frame_id"] = "finger"
    with pytest.raises(FileFormatError, match="frame 'finger' is moved by the robot's joints"):
        load(goal={"position_constraints": [position]})


@pytest.mark.parametrize("free", [*"xyz", ""])
@pytest.mark.parametrize("by_vector", [0, 1])
def test_a_goal_in_orientation_is_never_wider_than_moveits(free: str, by_vector: int, load: Load) -> None:
    region = {"primitives": [{"type": "sphere", "dimensions": [0.01]}], "primitive_poses": [SCREW]}
    turned = {"link_name": "fore", "orientation": [0, 0, 0.6, 0.8], "parameterization": by_vector}
    turned |= {f"absolute_{axis}_axis_tolerance": 7 if axis == free else 0.3 for axis in "xyz"}
    position = {"link_name": "fore", "constraint_region": region}
    goal: Any = load(goal={"position_constraints": [position], "orientation_constraints": [turned]}).goal
    R, rng = T_SCREW[:3, :3], np.random.default_rng(0)
    axis = goal.free_axis
    assert (axis is None) == (free == "" or (free == "y" and not by_vector))  # Euler angles about y stop at a quarter turn
    for _ in range(200):
        n = rng.normal(size=3)
        n = n if axis is None else n - (n @ axis) * axis
        tilt = Rotation.from_rotvec(n / np.linalg.norm(n) * goal.orientation_tolerance * rng.random())
        diff = tilt if axis is None else tilt * Rotation.from_rotvec(rng.uniform(-3, 3) * axis)
        told_by = np.abs(R @ diff.as_rotvec() if by_vector else diff.as_euler("XYZ"))
        assert all(angle <= 0.3 + 1e-9 for angle, name in zip(told_by, "xyz", strict=True) if name != free)


# What is in the hand.


def test_what_is_attached_is_held(load: Load) -> None:
    thing = item("can", "fore", pose=SCREW, subframe_names=["lid"], subframe_poses=[SCREW])
    problem = load(start=state(START, **attached(thing, touch_links=["finger", "gone"])))
    (can,) = (capsule for capsule in problem.robot.capsules if capsule.name == "can")
    np.testing.assert_allclose(at(problem, "can"), at(problem, "fore") @ T_SCREW, atol=1e-15)
    np.testing.assert_allclose(at(problem, "can/lid"), at(problem, "fore") @ T_SCREW @ T_SCREW, atol=1e-15)
    centre = problem.robot.frame("fore").T_joint_frame @ T_SCREW @ T_SCREW
    np.testing.assert_allclose(can.a, centre[:3, 3], atol=1e-12)
    assert can.radius == 0.05
    pairs = {pair for pair in problem.robot.self_pairs if "can" in pair}
    assert pairs == {("base", "can"), ("can", "column"), ("can", "stand"), ("can", "upper")}
    assert told(problem, "may touch gone")


def test_what_is_attached_in_another_frame_is_where_the_state_has_that(load: Load) -> None:
    for frame, T_w_frame in (("base", np.eye(4)), ("column", pose((0, 0, 0.5))), (None, np.eye(4))):
        problem = load(start=state(START, **attached(item("can", frame))))
        np.testing.assert_allclose(at(problem, "can"), T_w_frame @ T_SCREW, atol=1e-12)
        assert told(problem, "has no frame") == (frame is None)


def test_what_is_attached_to_a_floating_robot_needs_a_mass(load: Load, folder: Path) -> None:
    without = load(start=state(START, **attached(item("can", "fore"))))
    assert "can" in dict(without.robot.unweighed)
    base = Body(name="stand", joint=-1, mass=9.0, com=np.zeros(3), inertia=np.eye(3))
    with pytest.raises(RobotError, match="is not known"):
        plan(replace(without, robot=replace(without.robot, bodies=(base,)), base="floating"))
    with pytest.raises(RobotError, match="states no masses"):
        load(lifted(folder, base="floating"))
    weighed = load(start=state(START, **attached(item("can", "fore"), weight=2.0)))
    (body,) = (body for body in weighed.robot.bodies if body.name == "can")
    assert body.mass == 2.0
    assert told(weighed, "fills its shape evenly")


def test_the_weight_of_several_shapes_is_spread_by_their_volumes(load: Load) -> None:
    two = item("can", "fore")
    two["primitives"] = [{"type": "box", "dimensions": [0.1, 0.1, 0.2]}, {"type": "sphere", "dimensions": [0.05]}]
    two["primitive_poses"] = [SCREW, SCREW]
    problem = load(start=state(START, **attached(two, weight=3.0)))
    volumes = np.array([0.1 * 0.1 * 0.2, 4 / 3 * np.pi * 0.05**3])
    masses = [body.mass for body in problem.robot.bodies if body.name.startswith("can")]
    np.testing.assert_allclose(masses, 3.0 * volumes / volumes.sum())
    assert told(problem, "3 kg", "fills its 2 shapes evenly")


def test_an_object_of_the_world_is_taken_up(load: Load) -> None:
    items = [item("can", subframe_names=["lid"], subframe_poses=[SCREW]), item("box")]
    for thing in ({"id": "can"}, item("can", "fore")):
        problem = load(start=state(START, **attached(thing)), scene={"world": {"collision_objects": items}})
        assert [obstacle.name for obstacle in problem.scene.obstacles] == ["box"]
        wanted = T_SCREW if "primitives" not in thing else at(problem, "fore") @ T_SCREW
        np.testing.assert_allclose(at(problem, "can"), wanted, atol=1e-12)
        assert told(problem, "'can' is attached to 'fore'", "left out")


def test_what_the_scene_attaches_stays_attached_until_it_is_taken_off(load: Load) -> None:
    scene = {"robot_state": state(START, **attached(item("can", "fore")))}
    problem = load(scene=scene)
    assert any(part.name == "can" for part in problem.robot.shapes)
    assert told(problem, "attaches can", "is_diff")
    assert not told(load(scene=scene, start=state(START, is_diff=True)), "MoveIt would let go")
    off = {"attached_collision_objects": [{"link_name": "fore", "object": {"id": "can", "operation": 1}}]}
    problem = load(scene=scene, start=state(START, is_diff=True, **off))
    assert not any(part.name == "can" for part in problem.robot.shapes)


def test_several_shapes_are_held_as_one(load: Load) -> None:
    two = item("tool", "fore")
    two["primitives"] *= 2
    two["primitive_poses"] = [SCREW, {"position": [0, 0, 0]}]
    problem = load(start=state(START, **attached(two)))
    assert {part.name for part in problem.robot.shapes} >= {"tool 1", "tool 2"}
    np.testing.assert_allclose(at(problem, "tool"), at(problem, "fore"), atol=1e-15)
    more = attached(item("tool", "fore", operation=2))["attached_collision_objects"]
    start = state(START, attached_collision_objects=[*attached(item("tool", "fore"))["attached_collision_objects"], *more])
    assert {part.name for part in load(start=start).robot.shapes} >= {"tool 1", "tool 2"}


def test_a_goal_may_be_for_what_is_held(load: Load) -> None:
    region = {"primitives": [{"type": "sphere", "dimensions": [0.01]}], "primitive_poses": [SCREW]}
    thing = item("can", "fore", subframe_names=["lid"], subframe_poses=[SCREW])
    goal = {"position_constraints": [{"link_name": "can/lid", "constraint_region": region}]}
    assert load(start=state(START, **attached(thing)), goal=goal).goal.frame == "can/lid"  # type: ignore[union-attr]


@pytest.mark.parametrize("name", ["part.stl", "package://parts/part.stl", "file://{}/part.stl"])
def test_meshes_are_read_from_files_and_scaled(name: str, tmp_path: Path) -> None:
    faces = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
    facets = "".join(
        "facet normal 0 0 0\nouter loop\n"
        + "".join("vertex {} {} {}\n".format(*corners[k]) for k in face)
        + "endloop\nendfacet\n"
        for face in faces
    )
    (tmp_path / "part.stl").write_text(f"solid s\n{facets}endsolid s\n")
    part = {"resource": name.format(tmp_path), "dimensions": [0.1, 0.2, 0.3]}
    scene = {"world": {"collision_objects": [{"id": "part", "meshes": [part], "mesh_poses": [SCREW]}]}}
    (tmp_path / "scene.yaml").write_text(json.dumps(scene))
    (made,) = load_moveit_scene(tmp_path / "scene.yaml", mesh_excess=0.02).obstacles
    points = (corners * [0.1, 0.2, 0.3]) @ T_SCREW[:3, :3].T + T_SCREW[:3, 3]
    n = np.random.default_rng(0).normal(size=(50, 3))
    reach = np.max([support(piece, n) for piece in made.pieces], axis=0)  # type: ignore[union-attr]
    assert (reach >= (n @ points.T).max(axis=1) - 1e-9).all()
    assert (reach <= (n @ points.T).max(axis=1) + 0.02 * np.linalg.norm(n, axis=1)).all()


def test_a_scene_alone_says_what_only_a_robot_can_take_into_account(tmp_path: Path) -> None:
    moved = {"joint_names": ["vj"], "transforms": [{"translation": [0, 0, 1], "rotation": [0, 0, 0, 1]}]}
    for robot_state, said in (
        (state(START, **attached(item("can", "fore"))), "attaches an object"),
        (state(START, multi_dof_joint_state=moved), "base elsewhere"),
    ):
        path = tmp_path / "scene.yaml"
        path.write_text(json.dumps({"robot_state": robot_state, "world": {"collision_objects": []}}))
        with pytest.raises(FileFormatError, match=said):
            load_moveit_scene(path)
