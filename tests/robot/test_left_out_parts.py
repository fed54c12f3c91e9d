"""What is not checked is named, with the reason; and nothing that was found for a robot outlives a change of it."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from spacearm.core.errors import RobotError
from spacearm.dynamics import hold
from spacearm.geometry import Box, Sphere, pose
from spacearm.robot import Frame, Joint, LinkCapsule, Robot, builtin_robots, find_self_pairs, load_robot
from spacearm.robot.model import robot_as_dict, robot_from_dict
from spacearm.robot.unchecked_pairs import ApartPairs, UncheckedPair, bare_links, unchecked_pairs, without_mass
from support import srdf_text, urdf_text

ROD = urdf_text.collision('<cylinder radius="0.05" length="0.8"/>', xyz="0.5 0 0", rpy="0 1.5707963267948966 0")
BALL = urdf_text.collision('<sphere radius="0.06"/>')
DRAWN = '<visual><geometry><sphere radius="0.05"/></geometry></visual>'


def inertial(mass: str = "2", moment: str = "0.1") -> str:
    return f'<inertial><mass value="{mass}"/><inertia ixx="{moment}" iyy="{moment}" izz="{moment}"/></inertial>'


def folding(limit: float = 0.3) -> Robot:
    """Four rods in a row that cannot be folded onto each other within their limits."""
    limits = f'lower="{-limit}" upper="{limit}" velocity="1" effort="1"'
    joints = [urdf_text.joint(f"j{i}", f"l{i}", f"l{i + 1}", xyz="1 0 0", limit=limits) for i in range(3)]
    return urdf_text.loaded(urdf_text.robot(*(urdf_text.link(f"l{i}", ROD) for i in range(4)), *joints))


def reasons(robot: Robot) -> dict[tuple[str, str], str]:
    return {one.links: one.reason for one in unchecked_pairs(robot)}


NOT_NEXT = (("l0", "l2"), ("l0", "l3"), ("l1", "l3"))


def test_pairs_that_cannot_meet_are_left_to_the_certificate_and_not_left_out() -> None:
    robot = folding()
    assert robot.self_pairs == ()
    assert robot.apart is not None
    assert set(robot.apart.pairs) >= set(NOT_NEXT)
    assert not set(reasons(robot)) & set(NOT_NEXT)


@pytest.mark.parametrize(
    "change",
    [
        lambda r: {"lower": [-3] * 3, "upper": [3] * 3},
        lambda r: {"shapes": tuple(replace(c, shape=replace(c.shape, radius=0.06)) for c in r.shapes)},
        lambda r: {"joints": (r.joints[0], replace(r.joints[1], offset=0.5), r.joints[2])},
        lambda r: {"joints": (r.joints[0], replace(r.joints[1], multiplier=2.0), r.joints[2])},
    ],
    ids=["limits", "shapes", "offset", "multiplier"],
)
def test_pairs_that_could_not_meet_are_checked_once_the_robot_is_another(change: Any) -> None:
    robot = folding()
    changed = replace(robot, **change(robot))
    assert changed.apart is None
    assert set(changed.self_pairs) >= set(NOT_NEXT)


def test_a_change_that_moves_nothing_keeps_the_pairs_apart() -> None:
    robot = folding()
    narrower = {"lower": [-0.1] * 3, "upper": [0.3, 0.2, 0]}
    for change in ({"velocity": [9] * 3}, {"tip": "l2"}, {"name": "other"}, narrower):
        assert replace(robot, **change).apart == robot.apart
    assert hold(robot, Sphere((0, 0, 0), 0.1)).apart == robot.apart
    assert robot_from_dict(robot_as_dict(robot)) == robot


def test_joints_that_turn_without_end_have_pairs_apart_too() -> None:
    joints = [urdf_text.joint(f"j{i}", f"l{i}", f"l{i + 1}", kind="continuous", xyz="0 0 1", limit=None) for i in range(2)]
    links = [urdf_text.link(f"l{i}", BALL) for i in range(3)]
    robot = urdf_text.loaded(urdf_text.robot(*links, *joints), velocity_limit=1.0)
    assert robot.apart is not None
    assert ("l0", "l2") in robot.apart.pairs
    assert robot.apart.upper == (None, None)
    assert robot_from_dict(json.loads(json.dumps(robot_as_dict(robot)))) == robot
    assert replace(robot, upper=[1, 1], lower=[0, 0]).apart == robot.apart


def test_pairs_whose_links_lose_their_envelope_go_with_it() -> None:
    robot = folding()
    without = replace(robot, shapes=tuple(c for c in robot.shapes if c.name != "l3"))
    assert ("l0", "l2") in without.self_pairs
    assert not any("l3" in pair for pair in without.self_pairs)
    assert bare_links(without) == ("l3",)


def test_links_behind_a_locked_joint_are_checked_once_it_moves() -> None:
    locked = folding(0.0)
    assert locked.apart is not None
    assert ("l0", "l2") in locked.apart.pairs
    free = replace(locked, lower=[-3] * 3, upper=[3] * 3)
    assert set(free.self_pairs) >= set(NOT_NEXT)


def always_meeting(apart: float = 0.06, **options: Any) -> Robot:
    """Balls at the ends of two joints that turn about one point meet whatever these do; their file allows the neighbours."""
    joints = [
        urdf_text.joint("j1", "base", "a", xyz="0 0 0.1", axis="0 1 0"),
        urdf_text.joint("j2", "a", "b", xyz=f"0 0 {apart}"),
        urdf_text.joint("j3", "b", "c"),
    ]
    text = urdf_text.robot(urdf_text.link("base"), *(urdf_text.link(name, BALL) for name in "abc"), *joints)
    allowed = [srdf_text.disabled("a", "b"), srdf_text.disabled("b", "c")]
    return srdf_text.loaded(text, srdf_text.srdf(*allowed), **options)


def test_a_pair_that_an_srdf_forgets_but_that_always_meets_is_left_out_and_told() -> None:
    robot = always_meeting()
    assert robot.self_pairs == ()
    assert reasons(robot) == {("a", "b"): "allowed", ("a", "c"): "always", ("b", "c"): "allowed"}
    (note,) = [note for note in robot.notes if "every configuration" in note]
    assert "'a' and 'c'" in note
    assert "not checked" in note


def test_a_pair_that_touches_in_every_configuration_always_meets() -> None:
    assert reasons(always_meeting(apart=0.12))["a", "c"] == "always"  # balls of 0.06 m
    assert ("a", "c") in always_meeting(apart=0.13).self_pairs


def test_a_pair_that_meets_at_times_stays_with_the_srdf() -> None:
    far = urdf_text.collision('<sphere radius="0.06"/>', xyz="0.11 0 0")
    joints = [urdf_text.joint("j1", "a", "b", kind="continuous"), urdf_text.joint("j2", "b", "c", kind="continuous")]
    links = [urdf_text.link("a", far), urdf_text.link("b"), urdf_text.link("c", far)]
    robot = srdf_text.loaded(urdf_text.robot(*links, *joints), srdf_text.srdf())
    assert robot.self_pairs == (("a", "c"),)


def test_what_always_met_is_said_to_be_of_another_robot_once_that_changes() -> None:
    robot = always_meeting()
    wider = replace(robot, lower=[-3] * 3, upper=[3] * 3)
    assert reasons(wider)["a", "c"] == "changed"
    assert reasons(replace(robot, velocity=[2] * 3))["a", "c"] == "always"


def test_every_pair_of_links_is_checked_or_named() -> None:
    text = srdf_text.two_arms()
    for robot in (
        srdf_text.loaded(text, tip="left_tool"),
        srdf_text.loaded(text, tip="left_tool", self_collision="none"),
        srdf_text.loaded(text, srdf_text.srdf(srdf_text.disabled("torso", "left_fore")), tip="left_tool"),
    ):
        links = sorted({part.name for part in robot.shapes})
        checked = {*robot.self_pairs, *(() if robot.apart is None else robot.apart.pairs)}
        assert checked.isdisjoint(reasons(robot))
        assert len(checked) + len(reasons(robot)) == len(links) * (len(links) - 1) // 2
    assert reasons(robot)["left_fore", "torso"] == "allowed"


def test_an_added_link_is_not_asked_for() -> None:
    robot = folding()
    more = (*robot.capsules, LinkCapsule(name="extra", joint=2, a=(0, 0, 0), b=(0, 0, 0), radius=0.1))
    assert reasons(replace(robot, capsules=more))["extra", "l0"] == "not asked for"
    assert reasons(replace(robot, capsules=more))["extra", "l3"] == "rigid"


def test_what_a_hand_holds_may_touch_what_is_named_and_that_is_told() -> None:
    held = hold(folding(), Sphere((0, 0, 0), 0.1), touching=["l1"])
    assert reasons(held)["held", "l1"] == "touching"
    assert reasons(held)["held", "l3"] == "rigid"
    assert ("held", "l0") in held.self_pairs


def test_links_without_an_envelope_are_named_and_frames_are_not() -> None:
    links = [urdf_text.link("base", BALL), urdf_text.link("arm", DRAWN), urdf_text.link("weight", inertial())]
    joints = [
        urdf_text.joint("j1", "base", "arm"),
        urdf_text.joint("j2", "arm", "weight"),
        urdf_text.joint("j3", "weight", "hand"),
    ]
    frames = [urdf_text.link("hand", BALL), urdf_text.link("tool0"), urdf_text.joint("tip", "hand", "tool0", kind="fixed")]
    robot = urdf_text.loaded(urdf_text.robot(*links, *frames, *joints))
    assert bare_links(robot) == ("arm", "weight")
    (note,) = [note for note in robot.notes if "no envelope" in note]
    assert "arm, weight" in note
    assert "tool0" not in note
    assert bare_links(replace(robot, collision="none")) == ()
    assert bare_links(replace(robot, capsules=robot.capsules[:1])) == ("arm", "weight", "hand")


def test_links_of_a_robot_file_with_a_mass_of_some_length_and_no_envelope_are_named(tmp_path: Path) -> None:
    text = """spacearm-robot: 1
name: two
joints:
  - {name: j1, kind: revolute, parent: base, child: elbow, axis: [0, 0, 1], lower: -1, upper: 1, velocity: 1}
  - {name: j2, kind: revolute, parent: elbow, child: fore, axis: [1, 0, 0], lower: -1, upper: 1, velocity: 1}
  - {name: j3, kind: revolute, parent: fore, child: hand, xyz: [0, 0, 1], axis: [1, 0, 0], lower: -1, upper: 1, velocity: 1}
capsules: [{link: hand, from: [0, 0, 0], to: [0, 0, 0.1], radius: 0.05}]
masses:
  - {link: elbow, mass: 1, inertia: [1, 1, 1, 0, 0, 0]}
  - {link: fore, mass: 1, com: [0, 0, 0.5], inertia: [1, 1, 1, 0, 0, 0]}
"""
    (tmp_path / "two.yaml").write_text(text)
    assert bare_links(load_robot(tmp_path / "two.yaml")) == ("fore",)
    assert all(bare_links(load_robot(name)) == () for name in builtin_robots())


def test_what_a_joint_moves_without_an_envelope_is_named_of_a_robot_made_by_hand() -> None:
    joints = [Joint(name=f"j{i}", kind="revolute", parent=i - 1, T_parent_joint=pose((0, 0, 0.5 * (i != 2)))) for i in range(4)]
    limits: Any = {"lower": [-1] * 4, "upper": [1] * 4, "velocity": [1] * 4, "acceleration": [1] * 4}
    frames = [
        Frame(name="wrist", joint=2, T_joint_frame=np.eye(4)),
        Frame(name="tip", joint=3, T_joint_frame=pose((0, 0, 0.2))),
    ]
    ball = LinkCapsule(name="ball", joint=0, a=(0, 0, 0), b=(0, 0, 0), radius=0.1)
    robot = Robot(name="hand-made", joints=joints, capsules=[ball], frames=frames, tip="tip", **limits)
    assert bare_links(robot) == ("wrist", "j3")
    assert bare_links(replace(robot, tip="wrist")) == ("wrist",)
    assert bare_links(replace(robot, collision="none")) == ()


def floating(*parts: str, **options: Any) -> Robot:
    """A base of 2 kg and an arm of 2 kg, with further elements; the base floats."""
    base, arm = urdf_text.link("base", BALL, inertial()), urdf_text.link("arm", BALL, inertial())
    text = urdf_text.robot(base, arm, urdf_text.joint("turn", "base", "arm", xyz="1 0 0"), *parts)
    return urdf_text.loaded(text, base="floating", **options)


def on_the_arm(*inside: str, kind: str = "fixed") -> tuple[str, str]:
    return urdf_text.link("tool", *inside), urdf_text.joint("flange", "arm", "tool", kind=kind, xyz="1 0 0")


@pytest.mark.parametrize(
    ("inside", "why"),
    [
        ((BALL,), "the file states none"),
        ((DRAWN,), "the file states none"),
        ((BALL, inertial("-1")), "below 0"),
        ((BALL, inertial("nan")), "nan"),
        ((inertial("-1"),), "below 0"),  # without a shape, but it does have a mass
        ((BALL, inertial("0", "0.1")), "0, but <inertia> is not"),
        ((BALL, inertial("many")), "many"),
        ((BALL, '<inertial><mass value="2"/></inertial>'), "<inertia> is missing"),
        ((BALL, '<inertial><inertia ixx="1" iyy="1" izz="1"/></inertial>'), "missing"),
    ],
)
def test_masses_that_are_not_known_are_named(inside: tuple[str, ...], why: str) -> None:
    for kind in ("fixed", "revolute"):
        ((link, said),) = without_mass(floating(*on_the_arm(*inside, kind=kind)))
        assert link == "tool"
        assert why in said


def test_a_mass_of_0_is_believed_of_a_part_of_another_link_only() -> None:
    nothing = (BALL, inertial("0", "0"))
    assert without_mass(floating(*on_the_arm(*nothing))) == ()
    assert without_mass(floating(*on_the_arm(*nothing, kind="revolute"))) == (("tool", "the file states 0 kg"),)


def test_frames_have_no_mass_and_need_none() -> None:
    assert without_mass(floating(*on_the_arm(kind="revolute"))) == ()


def test_a_mass_that_is_not_known_is_told_when_the_base_floats() -> None:
    assert any("'tool'" in note and "cannot float" in note for note in floating(*on_the_arm(BALL)).notes)
    assert not any("float" in note for note in replace(floating(), notes=()).notes)


def test_a_robot_made_by_hand_lacks_the_mass_of_what_has_an_envelope_on_a_joint_without_any() -> None:
    robot = floating()
    assert without_mass(replace(robot, bodies=robot.bodies[:1])) == (("arm", "none is stated"),)


def test_a_body_of_the_same_name_makes_the_mass_known() -> None:
    held = hold(floating(), Box((0.1, 0.1, 0.1)))
    assert [link for link, _ in without_mass(held)] == ["held"]
    body = replace(held.bodies[1], name="held")
    assert without_mass(replace(held, bodies=(*held.bodies, body))) == ()


@pytest.mark.parametrize(
    "change",
    [
        {"collision": "urdf"},
        {"collision": 3},
        {"apart": [("l0", "l1")]},
        {"unchecked": [("l0", "l1")]},
        {"solid": [1]},
        {"unweighed": ["l1"]},
        {"unweighed": [("l1", 3)]},
    ],
)
def test_fields_that_cannot_be_are_refused(change: dict[str, Any]) -> None:
    with pytest.raises(RobotError):
        replace(folding(), **change)


def test_pairs_that_are_none_are_refused() -> None:
    with pytest.raises(RobotError, match="reason"):
        UncheckedPair(links=("a", "b"), reason="bored")
    for links in (("a", "a"), ("a",), 3, ("a", 1)):
        with pytest.raises(RobotError, match="pair"):
            UncheckedPair(links=links, reason="always")  # type: ignore[arg-type]
        with pytest.raises(RobotError, match="pair"):
            ApartPairs(pairs=(links,), made_for="", lower=(), upper=())  # type: ignore[arg-type]


def test_pairs_found_anew_fit_the_robot_that_was_changed() -> None:
    wide = replace(folding(), lower=[-3] * 3, upper=[3] * 3)
    again = find_self_pairs(wide).applied_to(wide)
    assert set(again.self_pairs) == set(NOT_NEXT)
    assert np.array_equal(again.upper, wide.upper)
