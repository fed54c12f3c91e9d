"""SRDF, groups and held joints: which joints move, which links may touch, and what the notes say of it."""

from __future__ import annotations

import itertools
import os
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spacearm.robot import Robot, load_robot
from spacearm.robot.srdf import load_srdf
from support import srdf_text, strategies, urdf_text
from support.forward_kinematics import frame_transform
from support.oracles.pinocchio_model import full_q, pinocchio_model
from support.srdf_text import disabled, group, srdf, state

MBM = os.environ.get("SPACEARM_MBM")
WITH_MBM = pytest.mark.skipif(MBM is None, reason="SPACEARM_MBM does not name the MotionBenchMaker data")
ROUNDING = 1e-12

LEFT = ("left_shoulder", "left_elbow", "left_wrist")
RIGHT = ("right_shoulder", "right_elbow", "right_wrist")
BALL = urdf_text.collision('<sphere radius="0.1"/>')


def two_arms(extra: str = "", **options: object) -> Robot:
    text = srdf_text.two_arms_srdf().replace("</robot>", f"{extra}</robot>")
    return srdf_text.loaded(srdf_text.two_arms(), text, **options)


def noted(robot: Robot, *words: str) -> bool:
    return any(all(word in note for word in words) for note in robot.notes)


def chain_of(count: int, *, collisions: bool = True) -> str:
    """A chain of links link_0, link_1, ... with a ball on each, half a metre apart."""
    balls = (BALL,) if collisions else ()
    return urdf_text.robot(
        *(urdf_text.link(f"link_{i}", *balls) for i in range(count + 1)),
        *(urdf_text.joint(f"joint_{i}", f"link_{i}", f"link_{i + 1}", xyz="0 0 0.5", axis="1 0 0") for i in range(count)),
    )


def test_a_groups_chain_moves_and_the_rest_is_held_and_told() -> None:
    robot = two_arms(group="left", fixed={"right_elbow": 0.5})
    assert robot.dof_names == LEFT
    assert robot.tip == "left_tool"
    assert noted(robot, "locked: right_elbow at 0.5")
    assert noted(robot, "not in group 'left'", "right_shoulder at 0", "left_grip at 0.01")  # the nearest to 0 it may be
    free = srdf_text.loaded(srdf_text.two_arms(), tip="left_tool")
    q = np.zeros(free.dof)
    q[[free.dof_index(name) for name in ("right_elbow", "left_grip", "right_grip")]] = 0.5, 0.01, 0.01
    for name in ("right_tool", "left_thumb", "left_finger", "left_tool"):
        np.testing.assert_allclose(
            frame_transform(robot, np.zeros(3), name), frame_transform(free, q, name), rtol=0, atol=ROUNDING
        )


def test_groups_of_groups_joints_and_links_are_resolved() -> None:
    extra = "".join(
        [
            group("by_links", links=("left_upper", "left_hand")),
            group("by_joints", joints=("right_shoulder", "right_elbow")),
            group("of_both", groups=("by_links", "by_joints")),
            group("across", chain=("left_hand", "right_hand")),
            group("torso_and_arm", groups=("trunk", "left")),
            group("trunk", chain=("base", "left_upper")),
            group("with_virtual", joints=("world", "left_elbow")),
        ]
    )
    assert two_arms(extra, group="by_links", tip="base").dof_names == ("left_shoulder", "left_wrist")
    assert two_arms(extra, group="by_joints").tip == "right_fore"
    assert two_arms(extra, group="of_both", tip="base").dof == 4
    across = two_arms(extra, group="across")
    assert set(across.dof_names) == {*LEFT, *RIGHT}
    assert across.tip == "right_hand"
    assert two_arms(extra, group="torso_and_arm").tip == "left_tool"
    assert two_arms(extra, group="with_virtual").dof_names == ("left_elbow",)
    assert set(two_arms(group="both", tip="right_tool").dof_names) == {*LEFT, *RIGHT}


def test_a_mimic_outside_the_group_follows_its_leader_inside_and_the_other_way_round() -> None:
    robot = two_arms(group="left_gripper")
    assert robot.dof_names == ("left_grip",)
    assert [joint.name for joint in robot.joints] == ["left_grip", "left_follow"]
    assert robot.tip == "left_thumb"
    follower = two_arms(group("odd", joints=("left_follow", "left_elbow")), group="odd", tip="left_hand")
    assert follower.dof_names == ("left_elbow",)


@settings(max_examples=25)
@given(st.data())
def test_holding_joints_is_fixing_them_in_q(data: st.DataObject) -> None:
    text = data.draw(urdf_text.urdfs())
    free = urdf_text.loaded(text, tip="tip")
    q = data.draw(strategies.configurations(free))
    held = data.draw(st.lists(st.sampled_from(free.dof_names), unique=True, max_size=free.dof - 1))
    fixed = {name: float(q[free.dof_index(name)]) for name in held}
    robot = urdf_text.loaded(text, tip="tip", fixed=fixed)
    left = [i for i, name in enumerate(free.dof_names) if name not in held]
    assert robot.dof_names == tuple(free.dof_names[i] for i in left)
    for frame in free.frames:
        there, here = frame_transform(free, q, frame.name), frame_transform(robot, q[left], frame.name)
        np.testing.assert_allclose(here, there, rtol=0, atol=1e-7)  # rotations are snapped within 1e-9
    for limit in ("lower", "upper", "velocity", "acceleration"):
        np.testing.assert_array_equal(getattr(robot, limit), getattr(free, limit)[left])


def test_a_follower_that_is_held_holds_its_leader() -> None:
    text = srdf_text.two_arms()
    by_leader = srdf_text.loaded(text, tip="left_tool", fixed={"left_grip": 0.02})
    by_follower = srdf_text.loaded(text, tip="left_tool", fixed={"left_follow": -0.02})
    by_both = srdf_text.loaded(text, tip="left_tool", fixed={"left_follow": -0.02, "left_grip": 0.02})
    np.testing.assert_array_equal(by_leader.frame("left_finger").T_joint_frame, by_follower.frame("left_finger").T_joint_frame)
    assert by_both.frames == by_leader.frames
    assert "left_grip" not in by_leader.dof_names


def test_a_fixed_joint_of_the_file_may_be_named_and_stays_where_it_is() -> None:
    robot = srdf_text.loaded(srdf_text.two_arms(), tip="left_tool", fixed={"mount": 0.3})
    assert noted(robot, "fixed= names mount", "which the file itself has fixed")
    np.testing.assert_array_equal(robot.frame("torso").T_joint_frame, np.eye(4))


def test_held_values_hold_for_robot_files_too() -> None:
    robot = load_robot("zhang2022", fixed={"elbow": 1.0, "wrist_1": -1.0})
    assert robot.dof == 5
    full = load_robot("zhang2022")
    np.testing.assert_allclose(
        frame_transform(robot, np.zeros(5), robot.tip),
        frame_transform(full, np.array([0, 0, 0, 1, -1, 0, 0.0]), full.tip),
        atol=1e-12,
    )


def test_joints_that_float_are_held_where_they_are_not_in_the_group() -> None:
    text = chain_of(2).replace('name="joint_1" type="revolute"', 'name="joint_1" type="floating"')
    robot = srdf_text.loaded(text, srdf(group("arm", joints=("joint_0",))), group="arm")
    assert robot.dof_names == ("joint_0",)
    assert noted(robot, "joint_1 can float")


def test_passive_joints_are_held() -> None:
    robot = srdf_text.loaded(chain_of(3), srdf('<passive_joint name="joint_1"/>'))
    assert robot.dof_names == ("joint_0", "joint_2")
    assert noted(robot, "passive in the SRDF", "joint_1 at 0")
    assert srdf_text.loaded(chain_of(3), srdf('<passive_joint name="joint_1"/>'), fixed={"joint_1": 0.5}).dof == 2


def test_named_configurations_have_a_value_for_every_joint() -> None:
    extra = state("home", "left", left_shoulder=0.1, left_elbow=0.2)
    robot = two_arms(extra, group="left")
    assert [configuration.name for configuration in robot.configurations] == ["ready", "home"]
    np.testing.assert_array_equal(robot.configuration("ready"), (0.5, -0.5, 1))
    np.testing.assert_array_equal(robot.configuration("home"), (0.1, 0.2, 0))
    assert noted(robot, "do not name every joint", "'home' leaves out left_wrist (at 0)")
    assert two_arms(group="right").configuration("ready").tolist() == [0.25, -0.25, 2]
    assert two_arms(group="left_gripper").configuration("open").tolist() == [0.05]
    everything = state("rest", "both", **dict.fromkeys((*LEFT, *RIGHT), 0.5))
    assert two_arms(everything, group="both", tip="left_tool").configuration("rest").tolist() == [0.5] * 6
    assert two_arms(everything, group="left").configuration("rest").tolist() == [0.5] * 3


def test_joints_that_a_state_leaves_out_are_where_moveit_has_them() -> None:
    text = state("closed", "left_gripper", left_follow=-0.02)  # a joint that follows, and none else
    robot = two_arms(text, tip="left_tool")
    q = dict(zip(robot.dof_names, robot.configuration("closed"), strict=True))
    assert q["left_grip"] == 0.02
    assert q["right_grip"] == pytest.approx(0.03)  # its range, 0.01 to 0.05, leaves out 0
    assert q["left_elbow"] == 0
    assert noted(robot, "'closed' leaves out 7 joints (at 0, but for right_grip (at 0.03))")
    assert noted(robot, "left out: 'ready' of group 'right'")  # two groups have a state of that name


def test_a_state_without_a_group_and_a_line_twice_are_read() -> None:
    line = '<joint name="left_elbow" value="0.25"/>'
    robot = two_arms(f'<group_state name="bent">{2 * line}</group_state>', group="left")
    np.testing.assert_array_equal(robot.configuration("bent"), (0, 0.25, 0))
    assert noted(robot, "name no group", "bent")


def test_all_pairs_but_those_that_may_touch_must_keep_clear() -> None:
    pairs = [("link_0", "link_1"), ("link_2", "link_1"), ("link_3", "link_0")]
    robot = srdf_text.loaded(chain_of(3), srdf(*(disabled(*pair) for pair in pairs)))
    left = {tuple(pair) for pair in itertools.combinations([f"link_{i}" for i in range(4)], 2)}
    assert set(robot.self_pairs) == left - {("link_0", "link_1"), ("link_1", "link_2"), ("link_0", "link_3")}


@pytest.mark.parametrize(
    ("elements", "touching"),
    [
        ('<disable_default_collisions link="link_1"/>', {(0, 1), (1, 2), (1, 3)}),
        ('<disable_default_collisions link="link_1"/><enable_collisions link1="link_3" link2="link_1"/>', {(0, 1), (1, 2)}),
        # A pair that is disabled outweighs one that is enabled, as in MoveIt.
        (disabled("link_1", "link_3") + '<enable_collisions link1="link_3" link2="link_1"/>', {(1, 3)}),
        ('<enable_collisions link1="link_3" link2="link_1"/>', set()),
    ],
)
def test_links_may_be_silent_by_default(elements: str, touching: set[tuple[int, int]]) -> None:
    robot = srdf_text.loaded(chain_of(3), srdf(elements))
    wanted = {pair for pair in itertools.combinations(range(4), 2) if pair not in touching}
    assert set(robot.self_pairs) == {(f"link_{i}", f"link_{k}") for i, k in wanted}


def test_rigid_pairs_are_left_out_and_told_where_they_meet() -> None:
    text = chain_of(3).replace('name="joint_0" type="revolute"', 'name="joint_0" type="fixed"').replace("0 0 0.5", "0 0 0.15")
    robot = srdf_text.loaded(text, srdf())
    assert ("link_0", "link_1") not in robot.self_pairs
    assert noted(robot, "'link_0' and 'link_1' overlap and no joint moves them apart")


def test_pairs_that_overlap_in_every_configuration_are_told_in_one_note_a_kind() -> None:
    robot = srdf_text.loaded(chain_of(4).replace("0 0 0.5", "0 0 0.05"), srdf())
    told = [note for note in robot.notes if "in every configuration" in note]
    reasons = [one.reason for one in robot.unchecked]
    assert (reasons.count("adjacent"), reasons.count("always")) == (4, 6)
    assert [note.partition(" overlap")[0] for note in told] == ["4 pairs of neighbours", "6 pairs of links"]


def test_the_srdf_decides_unless_asked_otherwise() -> None:
    urdf, text = chain_of(3).replace('lower="-1" upper="1"', 'lower="-3" upper="3"'), srdf(disabled("link_0", "link_3"))
    assert ("link_0", "link_3") not in srdf_text.loaded(urdf, text).self_pairs
    assert ("link_0", "link_3") in srdf_text.loaded(urdf, text, self_collision="computed").self_pairs
    assert srdf_text.loaded(urdf, text, self_collision="none").self_pairs == ()


def test_spheres_of_the_srdf_stand_in_for_an_envelope_that_is_missing() -> None:
    spheres = '<sphere center="0 0 0.1" radius="0.05"/><sphere center="0 0 0" radius="0"/>'
    text = srdf(*(f'<link_sphere_approximation link="link_{i}">{spheres}</link_sphere_approximation>' for i in (0, 2)))
    robot = srdf_text.loaded(chain_of(2, collisions=False), text)
    assert [capsule.name for capsule in robot.capsules] == ["link_0", "link_2"]
    assert {capsule.radius for capsule in robot.capsules} == {0.05}
    assert robot.self_pairs == (("link_0", "link_2"),)
    assert noted(robot, "link_0, link_2", "sphere approximation")
    assert srdf_text.loaded(chain_of(2), text).capsules == srdf_text.loaded(chain_of(2)).capsules
    assert srdf_text.loaded(chain_of(2, collisions=False), text, collision="none").capsules == ()


def test_what_an_srdf_says_of_other_robots_is_left_out_and_told() -> None:
    extra = disabled("torso", "left_hnd") + state("odd", "left", left_elbw=1) + '<passive_joint name="wheel"/>'
    robot = two_arms(extra, group="left")
    assert noted(robot, "links that the robot does not have", "'left_hnd'", "did you mean 'left_hand'?")
    assert noted(robot, "joints that the robot does not have", "'left_elbw', 'wheel'", "did you mean 'left_elbow'?")
    assert robot.self_pairs == two_arms(group="left").self_pairs


def test_the_mount_of_the_only_end_effector_is_the_tip_of_several_chains() -> None:
    more = urdf_text.link("palm") + urdf_text.joint("c", "link_2", "palm", kind="fixed")
    more += urdf_text.link("eye") + urdf_text.joint("e", "link_2", "eye", kind="fixed")
    text = chain_of(2).replace("</robot>", more + "</robot>")
    effector = '<end_effector name="hand" group="hand" parent_link="link_2"/>'
    robot = srdf_text.loaded(text, srdf(effector))
    assert robot.tip == "link_2"
    assert noted(robot, "the tip is 'link_2'")
    assert srdf_text.loaded(text, srdf(effector), tip="eye").tip == "eye"


def test_an_srdf_is_read_whole(tmp_path: Path) -> None:
    path = tmp_path / "arm.srdf"
    path.write_bytes(b"\xef\xbb\xbf" + srdf_text.two_arms_srdf().replace("<robot ", '<robot xmlns="http://ros.org" ').encode())
    found = load_srdf(path)
    assert [entry.name for entry in found.groups] == ["left", "right", "both", "left_gripper", "right_gripper"]
    assert [(entry.group, entry.name) for entry in found.states] == [
        ("left", "ready"),
        ("right", "ready"),
        ("left_gripper", "open"),
    ]
    assert found.mounts == ("left_tool", "right_tool")
    assert [(joint.name, joint.kind) for joint in found.virtual_joints] == [("world", "fixed")]
    assert len(found.disabled) == 12


def test_both_arms_move_as_pinocchio_moves_them() -> None:
    robot = two_arms(group="both", tip="right_tool")
    model, frame_ids = pinocchio_model(robot)
    placements = model.createData()
    generator = np.random.default_rng(5)
    for _ in range(20):
        q = generator.uniform(-3, 3, robot.dof)
        pin.framesForwardKinematics(model, placements, full_q(robot, q))
        for side in ("left", "right"):
            T = placements.oMf[frame_ids[f"{side}_tool"]].homogeneous
            np.testing.assert_allclose(frame_transform(robot, q, f"{side}_tool"), T, rtol=0, atol=ROUNDING)
    left_only = np.array([*generator.uniform(-1, 1, 3), 0, 0, 0])
    T = frame_transform(robot, left_only, "right_tool")
    np.testing.assert_allclose(T, frame_transform(robot, np.zeros(6), "right_tool"), atol=ROUNDING)


@WITH_MBM
def test_the_panda_of_the_benchmark_is_read_as_pinocchio_and_its_srdf_have_it() -> None:
    data = Path(str(MBM))
    fingers = {"panda_finger_joint1": 0.065, "panda_finger_joint2": 0.065}
    robot = load_robot(data / "panda_spherized.urdf", srdf=data / "panda.srdf", group="panda_arm", fixed=fingers)
    assert (robot.dof, len(robot.capsules), robot.tip) == (7, 59, "panda_link8")
    assert all((capsule.a == capsule.b).all() for capsule in robot.capsules)
    np.testing.assert_allclose(robot.configuration("ready"), (0, -0.785, 0, -2.356, 0, 1.571, 0.785))
    model = pin.buildModelFromUrdf(str(data / "panda_spherized.urdf"))
    geometry = pin.buildGeomFromUrdf(model, str(data / "panda_spherized.urdf"), pin.GeometryType.COLLISION)
    placements = model.createData()
    q = robot.configuration("ready")
    pin.framesForwardKinematics(model, placements, q)
    for frame in robot.frames:
        T = placements.oMf[model.getFrameId(frame.name, pin.FrameType.BODY)].homogeneous
        np.testing.assert_allclose(frame_transform(robot, q, frame.name), T, rtol=0, atol=1e-9)
    # Pinocchio reads the SRDF as well: it drops the disabled pairs, and those that no joint moves.
    geometry.addAllCollisionPairs()
    pin.removeCollisionPairs(model, geometry, str(data / "panda.srdf"), False)
    names = ["_".join(shape.name.split("_")[:-1]) for shape in geometry.geometryObjects]
    theirs = {tuple(sorted((names[pair.first], names[pair.second]))) for pair in geometry.collisionPairs}
    assert set(robot.self_pairs) == {pair for pair in theirs if pair[0] != pair[1]}
