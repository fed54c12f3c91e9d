"""In files: masses of what is held, robots without an envelope, and plans whose robot was edited."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from spacearm.core.errors import ProblemError, RobotError
from spacearm.dynamics import hold
from spacearm.files import load_problem, load_saved_plan, save_plan
from spacearm.files.plan_file import recheck_plan, recheck_trajectory
from spacearm.geometry import Box, Sphere
from spacearm.motion.recorded import robot_in_order
from spacearm.planner import MotionSwarm, Plan, PlannerSettings, Problem, plan
from spacearm.planner.goals import ConfigurationGoal, goal_as_dict
from spacearm.robot import Robot, load_robot
from spacearm.robot.model import robot_as_dict
from support import urdf_text

QUICK = PlannerSettings(evaluations=200)
ROD = urdf_text.collision('<cylinder radius="0.05" length="0.8"/>', xyz="0.5 0 0", rpy="0 1.5707963267948966 0")
DRAWN = '<visual><geometry><sphere radius="0.05"/></geometry></visual>'


def rods(shape: str = ROD, limit: float = 0.3, **options: Any) -> Robot:
    return urdf_text.loaded(rods_text(shape, limit), **options)


def rods_text(shape: str = ROD, limit: float = 0.3) -> str:
    limits = f'lower="{-limit}" upper="{limit}" velocity="1" effort="1"'
    joints = [urdf_text.joint(f"j{i}", f"l{i}", f"l{i + 1}", xyz="1 0 0", limit=limits) for i in range(3)]
    return urdf_text.robot(*(urdf_text.link(f"l{i}", shape) for i in range(4)), *joints)


def problem_file(folder: Path, robot: str, more: str = "") -> Path:
    path = folder / "problem.yaml"
    path.write_text(f"spacearm: 1\nrobot:\n{robot}\nstart: home\ngoal: {{configuration: home}}\n{more}", encoding="utf-8")
    return path


def test_the_mass_of_what_is_held_stands_in_the_problem_file(tmp_path: Path) -> None:
    text = (
        "  name: servicer7\n  holding:\n    - box: {size: [0.4, 0.5, 0.6], rpy_deg: [0, 0, 90]}\n      position: [0, 0, 0.35]\n"
    )
    given = "      mass: 500\n      com: [0.1, 0, 0]\n      inertia: [10, 11, 12, 0.1, 0.2, 0.3]\n"
    path = problem_file(tmp_path, text + given)
    servicer = load_robot("servicer7")
    box = Box((0.4, 0.5, 0.6), np.array([[0, -1, 0, 0], [1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1.0]]))
    held = hold(servicer, box, pose=(0, 0, 0.35), mass=500, com=(0.1, 0, 0), inertia=(10, 11, 12, 0.1, 0.2, 0.3))
    body, wanted = load_problem(path).robot.bodies[-1], held.bodies[-1]
    assert (body.name, body.joint, body.mass) == ("held", wanted.joint, 500.0)
    assert np.allclose(body.com, wanted.com)
    assert np.allclose(body.inertia, wanted.inertia)
    with pytest.raises(RobotError, match=r"'held'.*`mass` beside the shape"):
        plan(load_problem(problem_file(tmp_path, text)), QUICK)
    assert load_problem(problem_file(tmp_path, text, "base: fixed\n")).base == "fixed"
    with pytest.raises(RobotError, match=r"line 5.*mass"):
        load_problem(problem_file(tmp_path, text + "      mass: -2\n"))


def test_a_robot_without_an_envelope_is_not_planned_with_unless_none_is_meant(tmp_path: Path) -> None:
    robot = rods(DRAWN)
    assert any("has no envelope" in note for note in robot.notes)
    problem = Problem(robot, [Box((9, 9, 9))], start=np.zeros(3), goal=[0.1, 0, 0])
    found = plan(problem, QUICK, rng=0)
    assert found.status == "no_envelope"
    assert found.trajectory is None
    assert "collision='none'" in found.message
    save_plan(found, tmp_path / "plan.json")
    with pytest.raises(RobotError, match="no envelope"):
        MotionSwarm(problem, rng=0)
    meant = rods(DRAWN, collision="none")
    found = plan(replace(problem, robot=meant), QUICK, rng=0)
    assert found.found
    assert found.certificate is not None
    assert "meant to have no envelope" in found.certificate.message
    (tmp_path / "arm.urdf").write_text(rods_text(DRAWN), encoding="utf-8")
    text = "spacearm: 1\nrobot: {file: arm.urdf, collision: none}\nstart: [0, 0, 0]\ngoal: {configuration: [0.1, 0, 0]}\n"
    (tmp_path / "meant.yaml").write_text(text, encoding="utf-8")
    assert load_problem(tmp_path / "meant.yaml").robot.collision == "none"


@pytest.fixture(scope="module")
def found() -> Plan:
    robot = replace(rods(), solid=("l0", "l1", "l2", "l3", "camera"))
    out = plan(Problem(robot, [Sphere((0, 3, 0), 0.1)], start=np.zeros(3), goal=[0.1, 0.2, 0.3]), QUICK, rng=0)
    assert out.found
    return out


def test_what_is_not_checked_is_in_the_file_and_in_the_message(found: Plan, tmp_path: Path) -> None:
    assert "'camera'" in found.message
    save_plan(found, tmp_path / "plan.json")
    saved = json.loads((tmp_path / "plan.json").read_text())
    assert saved["certificate"]["not_checked"] == {"pairs": [], "links_without_envelope": ["camera"]}
    assert load_saved_plan(tmp_path / "plan.json").problem.robot == found.problem.robot


def edited(found: Plan, path: Path, **changes: Any) -> Path:
    save_plan(found, path)
    saved = json.loads(path.read_text())
    saved["problem"].update(changes)
    path.write_text(json.dumps(saved))
    return path


def test_wider_limits_in_a_file_bring_back_the_pairs_that_could_not_meet(found: Plan, tmp_path: Path) -> None:
    robot = robot_as_dict(found.problem.robot) | {"lower": [-3.0] * 3, "upper": [3.0] * 3}
    assert found.problem.robot.self_pairs == ()
    again = load_saved_plan(edited(found, tmp_path / "plan.json", robot=robot))
    assert ("l0", "l2") in again.problem.robot.self_pairs


def test_a_motion_goes_by_the_names_of_its_joints_when_the_robot_in_its_file_is_edited(found: Plan, tmp_path: Path) -> None:
    order = [2, 0, 1]
    robot = robot_as_dict(robot_in_order(found.problem.robot, order))
    assert found.trajectory is not None
    goal = goal_as_dict(ConfigurationGoal(np.array([0.1, 0.2, 0.3])[order]))
    path = edited(found, tmp_path / "plan.json", robot=robot, goal=goal)
    again = load_saved_plan(path)
    end = again.trajectory.sample(again.trajectory.duration).q
    assert np.allclose(end, np.array([0.1, 0.2, 0.3])[order], atol=1e-9)
    assert any("another order" in note for note in again.trajectory.notes)
    assert any("another order" in note for note in recheck_plan(path).notes)


def test_a_plan_is_proven_for_another_problems_robot_by_its_joints_names(found: Plan, tmp_path: Path) -> None:
    save_plan(found, tmp_path / "plan.json")
    order = [2, 0, 1]
    q = np.array([0.1, 0.2, 0.3])[order]
    robot = robot_in_order(found.problem.robot, order)
    again = recheck_plan(tmp_path / "plan.json", Problem(robot, found.problem.scene, start=np.zeros(3), goal=q))
    assert again.certificate.holds
    assert any("another order" in note for note in again.notes)
    assert not any("goal" in note or "begins" in note for note in again.notes if "differs" not in note)
    renamed = replace(robot, dof_names=("a", "b", "c"))
    with pytest.raises(ProblemError, match="'j0'"):
        recheck_plan(tmp_path / "plan.json", Problem(renamed, found.problem.scene, start=np.zeros(3), goal=q))
    longer = replace(robot, joints=(robot.joints[0], replace(robot.joints[1], offset=0.1), robot.joints[2]))
    other = recheck_plan(tmp_path / "plan.json", Problem(longer, found.problem.scene, start=np.zeros(3), goal=q))
    assert any("made for another robot" in note and "offset" in note for note in other.notes)
    assert found.trajectory is not None
    with pytest.raises(ProblemError, match="offset"):
        recheck_trajectory(Problem(longer, found.problem.scene, start=np.zeros(3), goal=q), found.trajectory)
