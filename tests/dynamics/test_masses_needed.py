"""No plan on a floating base rests on a mass that nobody knows: each way to lack one ends in a sentence that names the link."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from spacearm.core.errors import RobotError
from spacearm.dynamics import hold
from spacearm.files import load_problem
from spacearm.geometry import Box, Scene
from spacearm.planner import Problem, plan
from spacearm.robot import Body, Robot, load_robot
from support import urdf_text

BOX = urdf_text.collision('<box size="0.1 0.1 0.4"/>', xyz="0 0 0.3")
INERTIA = '<inertia ixx="0.1" iyy="0.1" izz="0.1"/>'


def inertial(mass: str, inertia: str = INERTIA) -> str:
    return f'<inertial><mass value="{mass}"/>{inertia}</inertial>'


def arm(*, base: str = inertial("100"), upper: str = inertial("5")) -> Robot:
    text = urdf_text.robot(
        urdf_text.link("bus", '<collision><geometry><box size="1 1 0.1"/></geometry></collision>', base),
        urdf_text.link("upper", BOX, upper),
        urdf_text.link("hand"),
        urdf_text.joint("shoulder", "bus", "upper", xyz="0 0 0.2", axis="0 1 0"),
        urdf_text.joint("mount", "upper", "hand", kind="fixed", xyz="0 0 0.6"),
    )
    return urdf_text.loaded(text, base="floating", self_collision="none")


def own_file(folder: Path) -> Robot:
    path = folder / "arm.yaml"
    path.write_text(
        "spacearm-robot: 1\nname: arm\nbase: floating\njoints:\n"
        "  - {name: turn, kind: revolute, parent: bus, child: upper, axis: [0, 1, 0], lower: -1, upper: 1, velocity: 1}\n"
        "boxes:\n  - {link: upper, size: [0.1, 0.1, 0.4], xyz: [0, 0, 0.5]}\n"
        "masses:\n  - {link: bus, mass: 100, inertia: [10, 10, 10, 0, 0, 0]}\n"
    )
    return load_robot(path)


def from_problem_file(folder: Path) -> Robot:
    path = folder / "problem.yaml"
    path.write_text(
        "spacearm: 1\nrobot:\n  name: servicer7\n  holding:\n    - {name: unit, box: {size: [0.1, 0.1, 0.1]}}\n"
        "start: home\ngoal: home\n"
    )
    return load_problem(path).robot


LACKING: dict[str, tuple[str, Callable[[Path], Robot]]] = {
    "no inertial": ("upper", lambda folder: arm(upper="")),
    "negative mass": ("upper", lambda folder: arm(upper=inertial("-5"))),
    "mass that is no number": ("upper", lambda folder: arm(upper=inertial("five"))),
    "mass of 0": ("upper", lambda folder: arm(upper=inertial("0", ""))),
    "mass without inertia": ("upper", lambda folder: arm(upper=inertial("5", ""))),
    "robot file without a link's mass": ("upper", own_file),
    "payload": ("held", lambda folder: hold(arm(), Box((0.1, 0.1, 0.1)))),
    "payload of a problem file": ("unit", from_problem_file),
}


@pytest.mark.parametrize("case", LACKING)
def test_a_link_of_unknown_mass_is_named_and_nothing_is_planned_or_proven(case: str, tmp_path: Path) -> None:
    link, make = LACKING[case]
    robot = make(tmp_path)
    start = np.zeros(robot.dof)
    problem = Problem(robot, Scene(), start=start, goal=start + 0.1, base="floating")
    with pytest.raises(RobotError, match="is not known") as refused:
        plan(problem)
    assert f"'{link}'" in str(refused.value)
    assert "\n" not in str(refused.value)
    plan(replace(problem, base="fixed"))  # nobody needs masses there


def test_a_base_without_mass_cannot_float() -> None:
    robot = arm(base="")
    assert any("its motion cannot be computed" in note for note in robot.notes)
    with pytest.raises(RobotError):
        plan(Problem(robot, Scene(), start=[0.0], goal=[0.1]))


def test_a_body_of_negative_mass_is_none() -> None:
    with pytest.raises(RobotError, match=r"mass is -1"):
        Body(name="bus", joint=-1, mass=-1, com=np.zeros(3), inertia=np.eye(3))


def test_all_masses_are_enough() -> None:
    robot = hold(arm(), Box((0.1, 0.1, 0.1)), frame="hand", pose=(0, 0, 0.1), density=1000)
    assert robot.bodies[-1].mass == pytest.approx(1.0)
    assert plan(Problem(robot, Scene(), start=[0.0], goal=[0.1])).found
