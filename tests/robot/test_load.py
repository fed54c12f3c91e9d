"""Robots by name and by file: limits, mimics, rotations, and what the robot files may say."""

from __future__ import annotations

import math
import pickle
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from spacearm.core.errors import FileFormatError, RobotError, SpacearmError
from spacearm.geometry import Box
from spacearm.robot import builtin_robots, load_robot, load_urdf
from spacearm.robot.build_robot import snapped, turned_onto_z
from support import urdf_text
from support.forward_kinematics import frame_transform
from support.messages import assert_refused
from support.urdf_text import chain, joint
from support.yaml_text import ARM, FLOATING


@pytest.mark.parametrize("name", builtin_robots())
def test_every_built_in_robot_loads_and_pickles(name: str) -> None:
    robot = load_robot(name)
    assert robot.name == robot.source == name
    assert pickle.loads(pickle.dumps(robot)) == robot
    assert (robot.lower < robot.upper).all()
    assert robot.notes


def test_the_papers_arm_has_the_papers_limits() -> None:
    robot = load_robot("zhang2022")
    np.testing.assert_allclose(np.degrees(robot.upper), (160, 20, 180, 170, 20, 20, 180))
    np.testing.assert_allclose(np.degrees(robot.lower), (-160, -20, -180, -150, -180, -46, -80))
    np.testing.assert_array_equal(robot.velocity, np.ones(7))
    np.testing.assert_array_equal(robot.acceleration, np.ones(7))
    lengths = [np.linalg.norm(capsule.b - capsule.a) for capsule in robot.capsules]
    np.testing.assert_allclose(lengths, (0.668, 0.4128, 0.2552))
    assert [capsule.radius for capsule in robot.capsules] == [0, 0, 0]


def test_options_hold_for_built_in_robots_too() -> None:
    robot = load_robot("zhang2022", tip="forearm", velocity_limit=0.5, acceleration_limit=2, collision="none")
    assert robot.tip == "forearm"
    assert robot.capsules == ()
    assert set(robot.velocity) == {0.5}
    assert set(robot.acceleration) == {1.0}  # a ceiling, and the paper's own limit is lower
    assert "velocity limits were set to at most 0.5" in robot.notes


def test_a_robot_file_is_read(tmp_path: Path) -> None:
    path = tmp_path / "arm.yaml"
    path.write_text(ARM)
    robot = load_robot(path)
    assert (robot.name, robot.source, robot.tip) == ("arm", str(path), "hand")
    assert robot.dof_names == ("shoulder", "lift")
    np.testing.assert_array_equal(robot.acceleration, (2, 3))
    # The lift slides along z of its own frame, which a quarter turn about x lays along -y.
    T = frame_transform(robot, np.array([0.0, 0.5]), "hand")
    np.testing.assert_allclose(T[:3, 3], (1, -1.5, 0), atol=1e-15)
    assert [(c.name, c.joint, c.radius) for c in robot.capsules] == [("upper", 0, 0.1), ("hand", 1, 0.2)]
    assert load_robot(str(path)) == robot


def test_boxes_masses_and_configurations_of_a_robot_file_are_read(tmp_path: Path) -> None:
    path = tmp_path / "arm.yaml"
    path.write_text(FLOATING)
    robot = load_robot(path)
    assert robot.base == "floating"
    assert load_robot(path, base="fixed").base == "fixed"
    base, hand = robot.bodies
    assert (base.name, base.joint, base.mass, hand.name, hand.joint, hand.mass) == ("base", -1, 100, "hand", 1, 2)
    np.testing.assert_array_equal(base.com, (0, 0, -1))
    np.testing.assert_array_equal(base.inertia, [[10, 1, 2], [1, 20, 3], [2, 3, 25]])
    # The fore's frame, which the hand's continues, is laid down by a quarter turn; its joint slides along its own z.
    np.testing.assert_allclose(hand.com, (0, 0, 1))
    np.testing.assert_array_equal(robot.configuration("home"), (0.5, 0.25))
    assert robot.self_pairs == (("base", "hand"),)
    (box,) = [part for part in robot.shapes if part.name == "base"]
    assert box.joint == -1
    assert isinstance(box.shape, Box)
    np.testing.assert_allclose(sorted(box.shape.size), (0.5, 1, 2))
    np.testing.assert_allclose(box.shape.pose[:3, 3], (0, 0, -1))
    assert any("boxes keep their shape, their number of capsules is not used: 'base'" in note for note in robot.notes)
    capsules = load_robot(path, capsules_per_shape=3).capsules
    of_base = [capsule for capsule in capsules if capsule.name == "base"]
    assert len(of_base) > 1
    for capsule in of_base:  # along the long edge, which was turned onto y
        along = capsule.b - capsule.a
        assert abs(along[1]) == pytest.approx(np.linalg.norm(along))
    assert load_robot(path, collision="none").shapes == ()
    assert load_robot(path, fixed={"lift": 0.5}).configuration("home") == pytest.approx(0.5)
    assert load_robot(path, fixed={"lift": 0.5}).bodies[1].joint == 0


def test_a_urdf_and_the_same_robot_file_give_the_same_robot(tmp_path: Path) -> None:
    text = chain(joint("elbow", "link_0", "link_1", xyz="1 2 3", rpy="0.1 0.2 0.3", axis="1 2 -1"))
    (tmp_path / "arm.urdf").write_text(text)
    (tmp_path / "arm.yaml").write_text(
        "spacearm-robot: 1\nname: arm\njoints:\n"
        "  - {name: elbow, kind: revolute, parent: link_0, child: link_1,\n"
        "     xyz: [1, 2, 3], rpy: [0.1, 0.2, 0.3],\n"
        "     axis: [1, 2, -1], lower: -1, upper: 1, velocity: 1}\n"
    )
    ours, theirs = load_robot(tmp_path / "arm.yaml"), load_urdf(tmp_path / "arm.urdf")
    np.testing.assert_allclose(ours.joints[0].T_parent_joint, theirs.joints[0].T_parent_joint, atol=1e-15)
    assert (ours.dof_names, ours.tip) == (theirs.dof_names, theirs.tip)


def test_q_has_the_files_order_as_far_as_parents_come_first() -> None:
    text = urdf_text.robot(
        *(urdf_text.link(name) for name in "abcd"),
        joint("wrist", "c", "d"),
        joint("shoulder", "a", "b"),
        joint("elbow", "b", "c"),
    )
    assert urdf_text.loaded(text).dof_names == ("shoulder", "elbow", "wrist")


def test_continuous_joints_have_no_limits_whatever_the_file_says() -> None:
    text = chain(joint("wheel", "link_0", "link_1", kind="continuous"))
    robot = urdf_text.loaded(text)
    assert (robot.lower[0], robot.upper[0]) == (-math.inf, math.inf)


def test_a_missing_velocity_limit_is_taken_from_the_option_and_others_are_capped() -> None:
    text = chain(
        joint("a", "link_0", "link_1", limit='lower="-1" upper="1" velocity="0"'),
        joint("b", "link_1", "link_2", limit='lower="-1" upper="1"'),
        joint("c", "link_2", "link_3", limit='lower="-1" upper="1" velocity="0.2"'),
        joint("d", "link_3", "link_4", limit='lower="-1" upper="1" velocity="7"'),
    )
    robot = urdf_text.loaded(text, velocity_limit=0.5)
    np.testing.assert_array_equal(robot.velocity, (0.5, 0.5, 0.2, 0.5))
    np.testing.assert_array_equal(robot.acceleration, robot.velocity)
    assert any("a, b, c, d" in note and "full speed in one second" in note for note in robot.notes)
    robot = urdf_text.loaded(text, velocity_limit=0.5, acceleration_limit=3)
    np.testing.assert_array_equal(robot.acceleration, (3, 3, 3, 3))


def test_a_mimic_of_a_mimic_follows_the_first() -> None:
    text = chain(
        joint("c", "link_0", "link_1", extra='<mimic joint="b" multiplier="-2" offset="0.5"/>', limit=None),
        joint("b", "link_1", "link_2", extra='<mimic joint="a" multiplier="0.5" offset="1"/>', limit=None),
        joint("a", "link_2", "link_3"),
    )
    robot = urdf_text.loaded(text)
    assert robot.dof_names == ("a",)
    assert [(j.multiplier, j.offset) for j in robot.joints] == [(-1.0, -1.5), (0.5, 1.0), (1.0, 0.0)]


@given(
    st.sampled_from([-3.0, -1.0, -0.5, 0.5, 1.0, 2.0]),
    st.floats(-0.4, 0.4),
    st.floats(0.0, 1.0),
    st.floats(0.1, 3.0),
)
def test_limits_of_a_dof_keep_its_mimics_within_theirs(multiplier: float, offset: float, share: float, speed: float) -> None:
    mimic = f'<mimic joint="a" multiplier="{multiplier}" offset="{offset}"/>'
    limit = f'lower="-0.8" upper="0.6" velocity="{speed}"'
    text = chain(joint("a", "link_0", "link_1"), joint("b", "link_1", "link_2", extra=mimic, limit=limit))
    robot = urdf_text.loaded(text)
    q = robot.lower[0] + share * (robot.upper[0] - robot.lower[0])
    assert -1 - 1e-12 <= q <= 1 + 1e-12
    assert -0.8 - 1e-12 <= multiplier * q + offset <= 0.6 + 1e-12
    assert robot.velocity[0] <= 1
    assert abs(multiplier) * robot.velocity[0] <= speed * (1 + 1e-12)
    # ... and no tighter than need be: at one end or the other, one of the joints is at its limit.
    ends = [(v, multiplier * v + offset) for v in (robot.lower[0], robot.upper[0])]
    assert any(abs(abs(a) - 1) < 1e-9 or abs(b + 0.8) < 1e-9 or abs(b - 0.6) < 1e-9 for a, b in ends)


@given(st.sampled_from([0, 1, 2]), st.sampled_from([1.0, -1.0]), st.floats(1e-300, 1e300))
def test_a_coordinate_axis_is_turned_onto_z_by_a_signed_permutation(k: int, sign: float, length: float) -> None:
    axis = np.zeros(3)
    axis[k] = sign * length
    R = turned_onto_z("a", axis)[:3, :3]
    np.testing.assert_array_equal(R[:, 2], np.sign(axis))
    np.testing.assert_array_equal(np.abs(R), np.abs(R).round())
    assert np.linalg.det(R) == 1.0


@given(st.tuples(*[st.floats(-1e3, 1e3)] * 3).filter(lambda axis: max(map(abs, axis)) > 1e-200))
def test_any_axis_is_turned_onto_z_by_a_rotation(axis: tuple[float, float, float]) -> None:
    R = turned_onto_z("a", axis)[:3, :3]
    np.testing.assert_allclose(R.T @ R, np.eye(3), atol=1e-14)
    assert np.linalg.det(R) > 0
    scaled = np.array(axis) / np.abs(axis).max()
    np.testing.assert_allclose(R[:, 2], scaled / np.linalg.norm(scaled), atol=2e-9)


def test_rotations_meant_as_quarter_turns_become_so_and_others_stay() -> None:
    for angle, exact in ((1.57079632679, True), (1.5707963, False)):
        text = chain(joint("a", "link_0", "link_1", rpy=f"{angle} 0 0"))
        R = urdf_text.loaded(text).joints[0].T_parent_joint[:3, :3]
        assert np.array_equal(R, R.round()) == exact
    T = np.eye(4)
    T[:2, :2] = [[math.cos(1e-5), -math.sin(1e-5)], [math.sin(1e-5), math.cos(1e-5)]]
    np.testing.assert_array_equal(snapped(T), T)


def test_broken_visuals_and_inertias_stop_nobody() -> None:
    text = chain(joint("a", "link_0", "link_1")).replace(
        '<link name="link_0"></link>',
        '<link name="link_0"><visual><geometry/></visual><inertial><mass value="heavy"/></inertial></link>'
        '<material name="red"><color rgba="?"/></material><gazebo><joint name="a"/></gazebo>',
    )
    assert urdf_text.loaded(text).dof == 1


def test_a_urdf_in_a_default_namespace_with_byte_order_mark_is_read(tmp_path: Path) -> None:
    text = chain(joint("a", "link_0", "link_1")).replace("<robot ", '<robot xmlns="http://www.ros.org" ')
    path = tmp_path / "arm.urdf"
    path.write_bytes(b"\xef\xbb\xbf" + text.encode())
    assert load_robot(path).dof_names == ("a",)


def test_importing_robots_imports_no_heavy_library() -> None:
    heavy = ("yaml", "pydantic", "trimesh", "lxml", "matplotlib", "scipy")
    code = f"import sys, spacearm.robot, spacearm.files.problem_file; print([m for m in {heavy} if m in sys.modules])"
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert ran.stdout.strip() == "[]"


FILES: dict[str, tuple[type[SpacearmError], str]] = {
    "empty": (FileFormatError, ""),
    "only a comment": (FileFormatError, "# nothing\n"),
    "a list": (FileFormatError, "- 1\n- 2\n"),
    "a problem": (FileFormatError, "spacearm: 1\nrobot: zhang2022\n"),
    "another version": (FileFormatError, ARM.replace("spacearm-robot: 1", "spacearm-robot: 2")),
    "version true": (FileFormatError, ARM.replace("spacearm-robot: 1", "spacearm-robot: true")),
    "no name": (FileFormatError, ARM.replace("name: arm\n", "")),
    "no joints": (FileFormatError, "spacearm-robot: 1\nname: arm\n"),
    "joints empty": (RobotError, "spacearm-robot: 1\nname: arm\njoints: []\n"),
    "unknown key": (FileFormatError, ARM.replace("link_radius", "link_radus")),
    "unknown key of a joint": (FileFormatError, ARM.replace("lower: -1", "lowr: -1")),
    "unknown kind": (FileFormatError, ARM.replace("kind: prismatic", "kind: linear")),
    "text for a number": (FileFormatError, ARM.replace("upper: 1,", "upper: one,")),
    "not a number": (FileFormatError, ARM.replace("upper: 1,", "upper: .nan,")),
    "text in a vector": (FileFormatError, ARM.replace("xyz: [1, 0, 0]", "xyz: [1, x, 0]")),
    "vector of two": (RobotError, ARM.replace("xyz: [1, 0, 0]", "xyz: [1, 0]")),
    "both units": (RobotError, ARM.replace("lower: -1", "lower: -1, lower_deg: -57")),
    "metres in degrees": (RobotError, ARM.replace("lower: 0", "lower_deg: 0")),
    "no axis": (RobotError, ARM.replace("rpy_deg: [90, 0, 0], axis: [0, 0, 1]", "rpy_deg: [90, 0, 0]")),
    "no limits": (RobotError, ARM.replace("lower: -1, upper: 1, ", "")),
    "acceleration zero": (RobotError, ARM.replace("acceleration: 3", "acceleration: 0")),
    "capsule of an unknown link": (RobotError, ARM.replace("link: hand", "link: hnd")),
    "capsule without radius": (RobotError, ARM.replace("link_radius: 0.1\n", "")),
    "capsule of negative radius": (RobotError, ARM.replace("radius: 0.2", "radius: -0.2")),
    "loop": (RobotError, ARM.split("capsules")[0].replace("child: hand", "child: upper")),
    "broken YAML": (FileFormatError, ARM + "  - [\n"),
    "base mistyped": (FileFormatError, FLOATING.replace("base: floating", "base: flaoting")),
    "box of an unknown link": (RobotError, FLOATING.replace("link: base, size", "link: bas, size")),
    "box of two edges": (RobotError, FLOATING.replace("[2, 1, 0.5]", "[2, 1]")),
    "box without thickness": (RobotError, FLOATING.replace("[2, 1, 0.5]", "[2, 1, 0]")),
    "box in millimetres": (RobotError, FLOATING.replace("[2, 1, 0.5]", "[2.0e+6, 1, 0.5]")),
    "box turned in both units": (
        RobotError,
        FLOATING.replace("rpy_deg: [0, 0, 90], capsules", "rpy_deg: [0, 0, 90], rpy: [0, 0, 1], capsules"),
    ),
    "box in no capsules": (RobotError, FLOATING.replace("capsules: 4", "capsules: 0")),
    "box in a million capsules": (RobotError, FLOATING.replace("capsules: 4", "capsules: 1000000")),
    "box in half a capsule": (FileFormatError, FLOATING.replace("capsules: 4", "capsules: 4.5")),
    "box without size": (FileFormatError, FLOATING.replace("size: [0.1, 0.1, 0.1]", "xyz: [0, 0, 0]")),
    "mass of an unknown link": (RobotError, FLOATING.replace("link: hand, mass", "link: hnd, mass")),
    "mass twice": (RobotError, FLOATING.replace("link: hand, mass", "link: base, mass")),
    "mass negative": (RobotError, FLOATING.replace("mass: 2", "mass: -2")),
    "mass zero": (RobotError, FLOATING.replace("mass: 2", "mass: 0")),
    "mass without inertia": (FileFormatError, FLOATING.replace(", inertia: [0.1, 0.1, 0.1, 0, 0, 0]", "")),
    "inertia of three": (RobotError, FLOATING.replace("[0.1, 0.1, 0.1, 0, 0, 0]", "[0.1, 0.1, 0.1]")),
    "inertia of no body": (RobotError, FLOATING.replace("[0.1, 0.1, 0.1, 0, 0, 0]", "[0.1, 0.1, 0.3, 0, 0, 0]")),
    "inertia negative": (RobotError, FLOATING.replace("[0.1, 0.1, 0.1, 0, 0, 0]", "[0.1, 0.1, 0.1, 0.2, 0, 0]")),
    "centre of mass of two": (RobotError, FLOATING.replace("com: [0, 0, -1]", "com: [0, 0]")),
    "configuration too short": (RobotError, FLOATING.replace("[0.5, 0.25]", "[0.5]")),
    "configuration without values": (RobotError, FLOATING.replace("name: home, q: [0.5, 0.25]", "name: home")),
    "configuration of lengths in degrees": (RobotError, FLOATING.replace("q: [0.5", "q_deg: [0.5")),
    "configuration in both units": (RobotError, FLOATING.replace("0.25]}", "0.25], q_deg: [0, 0]}")),
    "configuration twice": (RobotError, FLOATING.replace("self_coll", "  - {name: home, q: [0, 0]}\nself_coll")),
}


@pytest.mark.parametrize("case", FILES)
def test_a_robot_file_that_is_no_good_is_refused(case: str, tmp_path: Path) -> None:
    error, text = FILES[case]
    path = tmp_path / "arm.yaml"
    path.write_text(text)
    assert_refused("robot_file", case, error, lambda: load_robot(path), path=path)


@pytest.mark.parametrize(
    ("case", "source", "options"),
    [
        ("name mistyped", "zhang2020", {}),
        ("name unknown", "panda", {}),
        ("name empty", "", {}),
        ("URDF missing", "arm.urdf", {}),
        ("path missing", "robots/arm", {}),
        ("no path at all", None, {}),
        ("tip of a built-in robot mistyped", "zhang2022", {"tip": "end_efector"}),
        ("tip that is no name", "zhang2022", {"tip": ["hand"]}),
        ("collision mistyped", "zhang2022", {"collision": "None"}),
        ("velocity_limit negative", "zhang2022", {"velocity_limit": -1}),
        ("base of no kind", "zhang2022", {"base": "planar"}),
        ("base true", "zhang2022", {"base": True}),
    ],
)
def test_a_source_that_is_none_is_refused(case: str, source: Any, options: dict[str, Any]) -> None:
    error = FileFormatError if "URDF" in case or "path" in case else RobotError
    assert_refused("robot_file", case, error, lambda: load_robot(source, **options))


def test_a_urdf_without_xml_is_refused_by_its_name(tmp_path: Path) -> None:
    path = tmp_path / "arm.urdf"
    path.write_text(ARM)
    assert_refused("robot_file", "YAML called URDF", FileFormatError, lambda: load_robot(path), path=path)


def test_the_formats_description_names_every_key() -> None:
    from spacearm.robot import robot_yaml

    for model in robot_yaml.StrictModel.__subclasses__():
        if model.__module__ != robot_yaml.__name__:
            continue
        for name, field in model.model_fields.items():
            assert f"{field.alias or name}:" in (robot_yaml.__doc__ or "")
