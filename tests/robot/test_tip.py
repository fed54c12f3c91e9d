"""The end effector that nobody names: only links that joints move are ends, and a plain name decides between them."""

from __future__ import annotations

from pathlib import Path

import pytest

from spacearm.core.errors import RobotError
from spacearm.doctor import diagnose
from spacearm.robot import Robot, load_robot
from support import srdf_text, urdf_text
from support.srdf_text import group, srdf
from support.urdf_text import joint, link


def arm(*fixed: tuple[str, str], moving: tuple[tuple[str, str], ...] = ()) -> str:
    """base, one, two with a joint before each of the last two; then frames fixed to links, and links on more joints."""
    parts = [link("base"), link("one"), link("two"), joint("j1", "base", "one"), joint("j2", "one", "two", xyz="0.4 0 0")]
    for parent, name in fixed:
        parts += [link(name), joint(f"to_{name}", parent, name, kind="fixed", xyz="0.1 0 0")]
    for parent, name in moving:
        parts += [link(name), joint(f"move_{name}", parent, name)]
    return urdf_text.robot(*parts)


def noted(robot: Robot, *words: str) -> bool:
    return any(all(word in note for word in words) for note in robot.notes)


FINGERS = (("two", "left"), ("two", "right"))

CHOSEN = {
    "controller's frame": (arm(("base", "controller"), ("two", "end")), "end"),
    "frames on the way": (arm(("base", "a"), ("one", "camera"), ("one", "tool_changer"), ("two", "end")), "end"),
    "nothing behind": (arm(("base", "a"), ("one", "camera")), "two"),
    "a name among frames": (arm(("two", "tool0"), ("two", "ft_frame"), ("two", "camera"), ("two", "flange")), "tool0"),
    "a flange among frames": (arm(("two", "wrist_flange"), ("two", "ft_frame"), ("two", "camera")), "wrist_flange"),
    "a name in other words": (arm(("two", "arm_EndEffector"), ("two", "tool_camera")), "arm_EndEffector"),
    "the only one that is no sensor": (arm(("two", "link8"), ("two", "two_sc"), ("two", "camera_link")), "link8"),
    "fingers that do not move": (
        arm(("two", "gripper"), ("gripper", "left_finger"), ("gripper", "right_finger"), ("two", "camera")),
        "gripper",
    ),
    "a name beside fingers": (arm(("two", "hand_tcp"), moving=FINGERS), "hand_tcp"),
    "a chain of frames": (arm(("two", "flange"), ("flange", "tool0"), ("tool0", "grasp_point")), "grasp_point"),
}


ALONE = ("controller's frame", "frames on the way", "nothing behind", "a chain of frames")
"""Cases in which no name is needed."""


@pytest.mark.parametrize("case", CHOSEN)
def test_a_tip_that_everybody_means_needs_no_name(case: str, tmp_path: Path) -> None:
    text, tip = CHOSEN[case]
    robot = urdf_text.loaded(text)
    assert robot.tip == tip
    assert noted(robot, f"the tip is '{tip}', by its name", "give tip=") == (case not in ALONE)
    path = tmp_path / "arm.urdf"
    path.write_text(text)
    assert "tip-ambiguous" not in [one.code for one in diagnose(path).findings]


ASKED = {
    "two frames": (
        arm(("two", "left"), ("two", "right"), ("base", "a")),
        ("has 2 links at the end", "'left' (0.1 m after 'j2')"),
    ),
    "two names": (arm(("two", "tool0"), ("two", "tcp")), ("'tool0'", "'tcp'", "tip='tcp'")),
    "a torso with arms": (arm(moving=(*FINGERS, ("left", "l2"), ("l2", "l3"), ("l3", "l4"))), ("fork at 'two'", "tip='l4'")),
    "fingers": (arm(("one", "eye"), moving=FINGERS), ("2 chains, which fork at 'two'", "tip='two'")),
    "two arms": (arm(("two", "tool0"), moving=(("base", "other"),)), ("has 2 chains, with 2 ends", "'other'", "'tool0'")),
}


@pytest.mark.parametrize("case", ASKED)
def test_ends_that_might_all_be_meant_are_asked_for_and_none_that_no_joint_moves(case: str, tmp_path: Path) -> None:
    text, words = ASKED[case]
    with pytest.raises(RobotError) as caught:
        urdf_text.loaded(text)
    assert all(word in str(caught.value) for word in words), caught.value
    assert "'a'" not in str(caught.value)
    path = tmp_path / "arm.urdf"
    path.write_text(text)
    (found,) = (one for one in diagnose(path).findings if one.code == "tip-ambiguous")
    advised = found.advice.split("'")[1]
    assert f"tip='{advised}'" in str(caught.value)
    robot = load_robot(path, tip=advised)
    assert robot.frame(advised).joint >= 0


def test_what_is_held_is_no_end() -> None:
    robot = urdf_text.loaded(arm(("two", "tool0"), moving=(("base", "other"), *FINGERS)), fixed={"move_other": 0.1})
    assert robot.tip == "tool0"
    robot = urdf_text.loaded(arm(("two", "tool0"), moving=FINGERS), fixed={"move_left": 0.1, "move_right": 0.1})
    assert robot.tip == "tool0"


def test_a_tip_that_no_joint_moves_is_noted() -> None:
    assert noted(urdf_text.loaded(arm(), tip="base"), "no joint moves the tip 'base'")
    assert not noted(urdf_text.loaded(arm()), "no joint moves the tip")


def test_a_mount_that_no_joint_moves_is_no_tip() -> None:
    text = arm(("two", "left"), ("two", "right"), ("base", "stand"))
    effectors = '<end_effector name="{}" group="g" parent_link="{}"/>'
    both = srdf(effectors.format("a", "stand"), effectors.format("b", "left"), group("g", joints=("j1",)))
    assert srdf_text.loaded(text, both).tip == "left"


WORLD = '<link name="world"/><joint name="free" type="{}"><parent link="world"/><child link="base"/><origin xyz="{}"/></joint>'
MASS = '<link name="base"><inertial><mass value="9"/><inertia ixx="1" iyy="1" izz="1"/></inertial></link>'


def rooted(kind: str = "floating", xyz: str = "0 0 0", more: str = "") -> str:
    text = arm().replace('<link name="base"></link>', MASS)
    return text.replace("</robot>", f"{WORLD.format(kind, xyz)}{more}</robot>")


def test_a_floating_joint_of_the_root_frees_the_base_that_is_to_float() -> None:
    robot = urdf_text.loaded(rooted(xyz="0 0 2"), base="floating")
    assert (robot.base, robot.dof, robot.frame("base").parent) == ("floating", 2, "")
    assert [frame.name for frame in robot.frames] == ["base", "one", "two"]
    assert noted(robot, "the base is 'base'", "'free' frees", "[0.0, 0.0, 2.0] left out")
    assert [body.joint for body in robot.bodies] == [-1]
    between = '<joint name="pin" type="fixed"><parent link="root"/><child link="world"/></joint><link name="root"/>'
    assert urdf_text.loaded(rooted(more=between), base="floating").frames[0].name == "base"


@pytest.mark.parametrize("kind", ["floating", "planar"])
def test_a_joint_of_the_root_that_is_not_to_move_is_held_and_told(kind: str) -> None:
    for base in (None, "fixed"):
        robot = urdf_text.loaded(rooted(kind, "0 0 2"), base=base)
        assert (robot.base, robot.dof) == ("fixed", 2)
        assert robot.frame("base").T_joint_frame[2, 3] == 2
        assert noted(robot, f"joint 'free' between the root and 'base' is {kind}", "locked at its origin")


@pytest.mark.parametrize(
    ("text", "why"),
    [
        (rooted("planar"), "is planar"),
        (rooted(more='<link name="x"/>' + joint("k", "world", "x")), "other joints"),
        (rooted().replace('<link name="world"/>', MASS.replace("base", "world")), "carries shapes, masses"),
    ],
)
def test_a_base_that_cannot_be_freed_is_refused(text: str, why: str) -> None:
    with pytest.raises(RobotError, match=f"joint 'free' above 'base' .*{why}"):
        urdf_text.loaded(text, base="floating", tip="two")


def test_a_groups_end_that_its_joints_do_not_move_is_no_tip() -> None:
    chains = '<group name="g"><chain base_link="base" tip_link="stand"/><chain base_link="base" tip_link="two"/></group>'
    assert srdf_text.loaded(arm(("base", "stand")), srdf(chains), group="g").tip == "two"
