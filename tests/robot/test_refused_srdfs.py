"""SRDFs that are broken or about another robot, and groups and values that cannot be: one clear sentence each."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

from spacearm.core.errors import FileFormatError, RobotError, SpacearmError
from spacearm.robot import load_robot
from support import srdf_text
from support.messages import assert_refused
from support.srdf_text import disabled, group, srdf, state

FORMAT: dict[str, str] = {
    "empty": "",
    "not XML": "groups: [arm]\n",
    "broken XML": '<robot name="arm">\n<group name="a">\n</robot>\n',
    "xacro": '<robot xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:include filename="b"/></robot>',
    "another root": "<semantics/>",
    "a URDF": srdf_text.two_arms(),
    "group without name": srdf("\n<group/>"),
    "group twice": srdf(group("left", joints=("left_elbow",)), group("left", joints=("left_wrist",))),
    "chain without tip": srdf('<group name="a"><chain base_link="torso"/></group>'),
    "joint of a group without name": srdf('<group name="a"><joint/></group>'),
    "state twice": srdf(state("ready", "left"), state("ready", "left")),
    "joint of a state without value": srdf('<group_state name="r" group="left"><joint name="left_elbow"/></group_state>'),
    "value no number": srdf('<group_state name="r" group="left"><joint name="left_elbow" value="up"/></group_state>'),
    "value infinite": srdf('<group_state name="r" group="left"><joint name="left_elbow" value="inf"/></group_state>'),
    "joint twice in a state": srdf(
        '<group_state name="r" group="a"><joint name="b" value="1"/><joint name="b" value="2"/></group_state>'
    ),
    "pair of one link": srdf('<disable_collisions link1="torso"/>'),
    "enabled pair of one link": srdf('<enable_collisions link2="torso"/>'),
    "silent link without name": srdf("<disable_default_collisions/>"),
    "end effector without parent": srdf('<end_effector name="hand" group="left_gripper"/>'),
    "virtual joint of unknown type": srdf('<virtual_joint name="w" type="flaoting" parent_frame="w" child_link="base"/>'),
    "passive joint without name": srdf("<passive_joint/>"),
    "sphere without radius": srdf(
        '<link_sphere_approximation link="torso"><sphere center="0 0 0"/></link_sphere_approximation>'
    ),
    "sphere of two numbers": srdf(
        '<link_sphere_approximation link="torso"><sphere center="0 0" radius="1"/></link_sphere_approximation>'
    ),
    "sphere of negative radius": srdf(
        '<link_sphere_approximation link="torso">\n<sphere center="0 0 0" radius="-1"/></link_sphere_approximation>'
    ),
}

ROBOT: dict[str, tuple[str, dict[str, Any]]] = {
    "of another robot": (srdf(disabled("panda_link0", "panda_link1")), {}),
    "unknown group": ("", {"group": "lef"}),
    "group that is no name": ("", {"group": 3}),
    "group of an unknown joint": (group("a", joints=("left_elbo",)), {"group": "a"}),
    "group of an unknown link": (group("a", links=("left_hnd",)), {"group": "a"}),
    "group of an unknown chain": (group("a", chain=("torso", "left_tol")), {"group": "a"}),
    "group of an unknown group": (group("a", groups=("lef",)), {"group": "a"}),
    "groups in a circle": (group("a", groups=("b",)) + group("b", groups=("a",)), {"group": "a"}),
    "group that moves nothing": (group("a", links=("torso", "left_tool")), {"group": "a"}),
    "empty group": (group("a"), {"group": "a"}),
    "group of two chains": ("", {"group": "both"}),
    "group held altogether": ("", {"group": "left_gripper", "fixed": {"left_grip": 0.02}}),
    "tip of a group mistyped": ("", {"group": "left", "tip": "left_tol"}),
    "fixed joint mistyped": ("", {"group": "left", "fixed": {"right_elbo": 1}}),
    "fixed out of limits": ("", {"group": "left", "fixed": {"right_elbow": 3.5}}),
    "fixed mimic out of limits": ("", {"group": "left", "fixed": {"right_follow": 0.5}}),
    "fixed joints that contradict": ("", {"group": "left", "fixed": {"right_grip": 0.02, "right_follow": -0.03}}),
    "fixed no number": ("", {"group": "left", "fixed": {"right_elbow": "up"}}),
    "fixed NaN": ("", {"group": "left", "fixed": {"right_grip": float("nan")}}),
    "fixed no mapping": ("", {"group": "left", "fixed": ["right_elbow"]}),
    "self_collision mistyped": ("", {"group": "left", "self_collision": "compute"}),
}


def refuse(case: str, text: str, error: type[SpacearmError], directory: Path, options: Mapping[str, Any]) -> None:
    (directory / "arm.urdf").write_text(srdf_text.two_arms())
    (directory / "arm.srdf").write_text(text)
    load = lambda: load_robot(directory / "arm.urdf", srdf=directory / "arm.srdf", collision="none", **options)  # noqa: E731
    assert_refused("srdf", case, error, load, path=directory)


@pytest.mark.parametrize("case", FORMAT)
def test_a_file_that_is_no_good_srdf_is_refused(case: str, tmp_path: Path) -> None:
    refuse(case, FORMAT[case], FileFormatError, tmp_path, {"tip": "left_tool"})


@pytest.mark.parametrize("case", ROBOT)
def test_a_group_or_value_that_cannot_be_is_refused(case: str, tmp_path: Path) -> None:
    extra, options = ROBOT[case]
    text = extra if extra.startswith("<?xml") else srdf_text.two_arms_srdf().replace("</robot>", f"{extra}</robot>")
    refuse(case, text, RobotError, tmp_path, options)


@pytest.mark.parametrize(
    ("case", "options"),
    [
        ("group without SRDF", {"group": "left"}),
        ("SRDF's pairs without SRDF", {"self_collision": "srdf"}),
        ("fixed joint of a built-in robot mistyped", {"fixed": {"elbo": 1}}),
        ("every joint fixed", {"fixed": {f"{name}": 0 for name in load_robot("zhang2022").dof_names}}),
    ],
)
def test_options_that_do_not_go_together_are_refused(case: str, options: dict[str, Any]) -> None:
    assert_refused("srdf", case, RobotError, lambda: load_robot("zhang2022", **options))


def test_a_path_without_a_file_is_refused(tmp_path: Path) -> None:
    assert_refused("srdf", "missing", FileFormatError, lambda: load_robot("zhang2022", srdf=tmp_path / "a.srdf"), path=tmp_path)
    assert_refused("srdf", "directory", FileFormatError, lambda: load_robot("zhang2022", srdf=tmp_path), path=tmp_path)
    assert_refused("srdf", "no path", FileFormatError, lambda: load_robot("zhang2022", srdf=3))  # type: ignore[arg-type]
