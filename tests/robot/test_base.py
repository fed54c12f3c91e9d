"""How the base is held: fixed, unless the user or spacearm's own robot file lets it float; an SRDF's is told in a note."""

from __future__ import annotations

from typing import Any, Literal

import pytest

from spacearm.robot import Robot, load_robot
from support import srdf_text
from support.srdf_text import group, srdf

GOOD = '<inertial><mass value="2"/><inertia ixx="1" iyy="1" izz="1"/></inertial>'


def with_virtual_joint(kind: str, *parts: str, child: str = "base", heavy: bool = True, **options: Any) -> Robot:
    """Two arms whose root is held by a virtual joint called "world_joint"."""
    urdf = srdf_text.two_arms()
    if heavy:
        assert '<link name="torso">' in urdf  # which is fixed to the root
        urdf = urdf.replace('<link name="torso">', f'<link name="torso">{GOOD}')
    virtual = f'<virtual_joint name="world_joint" type="{kind}" parent_frame="world" child_link="{child}"/>'
    options = {"self_collision": "none", "tip": "left_tool"} | options
    return srdf_text.loaded(urdf, srdf(virtual, *parts), **options)


def noted(robot: Robot, *words: str) -> bool:
    return any(all(word in note for word in words) for note in robot.notes)


@pytest.mark.parametrize("kind", ["fixed", "floating", "planar"])
def test_a_virtual_joint_frees_no_base_and_is_told(kind: str) -> None:
    robot = with_virtual_joint(kind)
    assert robot.base == "fixed"
    assert noted(robot, "'world_joint'", kind, "the base is fixed") == (kind != "fixed")
    assert noted(robot, "base='floating'") == (kind == "floating")


def test_a_virtual_joint_of_another_link_says_nothing_about_the_base() -> None:
    assert with_virtual_joint("floating", child="left_upper").base == "fixed"


def test_no_group_frees_the_base() -> None:
    arm = group("left", chain=("torso", "left_tool"))
    whole = group("whole", joints=("world_joint",), groups=("left",))
    for name in ("left", "whole"):
        robot = with_virtual_joint("floating", arm, whole, group=name)
        assert robot.base == "fixed"
        assert noted(robot, "'world_joint'", "base='floating'")


@pytest.mark.parametrize("kind", ["fixed", "floating", "planar"])
@pytest.mark.parametrize("choice", ["fixed", "floating"])
def test_the_user_has_the_last_word(kind: str, choice: Literal["fixed", "floating"]) -> None:
    arm = group("left", chain=("torso", "left_tool"))
    assert with_virtual_joint(kind, base=choice).base == choice
    robot = with_virtual_joint(kind, arm, group="left", base=choice)
    assert robot.base == choice
    assert not noted(robot, "world_joint")


def test_a_floating_base_without_a_mass_is_told_and_stops_nobody() -> None:
    assert not noted(with_virtual_joint("fixed", base="floating"), "has a mass")
    robot = with_virtual_joint("fixed", base="floating", heavy=False)
    assert noted(robot, "the base floats", "'base'", "has a mass", "base='fixed'")
    assert not noted(with_virtual_joint("fixed", heavy=False), "has a mass")


def test_an_srdf_that_fixes_the_root_outweighs_a_robot_file_that_lets_it_float(tmp_path: Any) -> None:
    path = tmp_path / "servicer.srdf"
    for kind in ("fixed", "floating"):
        path.write_text(srdf(f'<virtual_joint name="world" type="{kind}" parent_frame="world" child_link="base"/>'))
        robot = load_robot("servicer7", srdf=path)
        assert robot.base == kind
        assert noted(robot, "the base is fixed", "the robot file would let it float") == (kind == "fixed")
    assert load_robot("zhang2022", srdf=path).base == "fixed"
