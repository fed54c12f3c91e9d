"""URDFs that are broken, foreign, or ask for what spacearm does not do: one clear sentence each."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from spacearm.core.errors import FileFormatError, RobotError, SpacearmError
from spacearm.robot import load_urdf
from support.messages import assert_refused
from support.urdf_text import chain, collision, joint, link, robot

ONE = joint("elbow", "link_0", "link_1")
TWO = joint("wrist", "link_1", "link_2")


def with_joint(**changes: Any) -> str:
    return chain(joint("elbow", "link_0", "link_1", **changes))


def with_shape(shape: str, **pose: str) -> str:
    return robot(link("link_0"), link("link_1", collision(shape, **pose)), ONE)


def with_mimic(mimic: str, *, other: str = "", limit: str = 'lower="-1" upper="1" velocity="1"') -> str:
    return chain(
        joint("elbow", "link_0", "link_1", extra=other),
        joint("wrist", "link_1", "link_2", limit=limit, extra=mimic),
    )


FORMAT: dict[str, str] = {
    "empty": "",
    "blank": " \n\t\n",
    "not XML": "spacearm: 1\n",
    "binary": "\x00\x01\x02",
    "broken XML": '<robot name="arm">\n<link name="a">\n</robot>\n',
    "cut off": chain(ONE)[:120],
    "a root that ends at once": '<robot name="a"/><robot name="b"/>',
    "prefix without namespace": '<robot name="a"><xacro:include filename="b"/></robot>',
    "XML but no URDF": "<html><body/></html>",
    "SDF": '<sdf version="1.7"><model name="arm"/></sdf>',
    "MJCF": '<mujoco model="arm"/>',
    "xacro": '<robot xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:include filename="b"/></robot>',
    "xacro expression": with_joint(xyz="0 ${length} 0"),
    "SRDF": '<robot name="arm"><group name="all"><joint name="elbow"/></group></robot>',
    "robot without name": "<robot><link name='a'/></robot>",
    "link without name": '<robot name="arm">\n<link/>\n</robot>',
    "joint without name": '<robot name="arm">\n<link name="a"/>\n<joint type="fixed"/>\n</robot>',
    "joint without type": chain(ONE.replace(' type="revolute"', "")),
    "mistyped joint type": with_joint(kind="Revolut"),
    "joint without parent": chain(ONE.replace('<parent link="link_0"/>', "")),
    "joint without child": chain(ONE.replace('<child link="link_1"/>', "<child/>")),
    "NaN in an origin": with_joint(xyz="0 nan 0"),
    "infinite rpy": with_joint(rpy="0 inf 0"),
    "number too large": with_joint(xyz="0 1e999 0"),
    "two numbers in an origin": with_joint(xyz="0 1"),
    "comma in an origin": with_joint(xyz="0, 1, 0"),
    "words in an axis": with_joint(axis="up"),
    "NaN limit": with_joint(limit='lower="nan" upper="1" velocity="1"'),
    "limit with unit": with_joint(limit='lower="-90deg" upper="1" velocity="1"'),
    "mimic of nothing": with_mimic("<mimic/>"),
    "mimic multiplier no number": with_mimic('<mimic joint="elbow" multiplier="twice"/>'),
    "collision without geometry": robot(link("link_0", "<collision/>"), link("link_1"), ONE),
    "collision with empty geometry": with_shape(""),
    "collision with two shapes": with_shape('<sphere radius="1"/><sphere radius="2"/>'),
    "collision with a cone": with_shape('<cone radius="1" length="1"/>'),
    "capsule without length": with_shape('<capsule radius="1"/>'),
    "sphere without radius": with_shape("<sphere/>"),
    "negative radius": with_shape('<sphere radius="-1"/>'),
    "cylinder without length": with_shape('<cylinder radius="1"/>'),
    "box with two edges": with_shape('<box size="1 2"/>'),
    "mesh without file": with_shape("<mesh/>"),
    "NaN in a collision origin": with_shape('<sphere radius="1"/>', xyz="nan 0 0"),
}

ROBOT: dict[str, str] = {
    "one link, no joint": robot(link("a")),
    "only fixed joints": with_joint(kind="fixed"),
    "floating joint": chain(ONE, joint("wrist", "link_1", "link_2", kind="floating")),
    "planar joint": chain(ONE, joint("wrist", "link_1", "link_2", kind="planar")),
    "only a floating joint": with_joint(kind="floating"),
    "slide without an end": with_joint(kind="prismatic", limit='lower="0" upper="1e16" velocity="1"'),
    "limits beyond all": with_joint(limit='lower="1e16" upper="1e17" velocity="1"'),
    "infinite velocity limit": with_joint(limit='lower="-1" upper="1" velocity="inf"'),
    "zero axis": with_joint(axis="0 0 0"),
    "no limit": with_joint(limit=None),
    "prismatic without limit": with_joint(kind="prismatic", limit=None),
    "no lower limit": with_joint(limit='upper="1" velocity="1"'),
    "limits exchanged": with_joint(limit='lower="2" upper="1" velocity="1"'),
    "no velocity limit": with_joint(limit='lower="-1" upper="1" effort="1"'),
    "zero velocity limit": with_joint(limit='lower="-1" upper="1" velocity="0"'),
    "negative velocity limit": with_joint(limit='lower="-1" upper="1" velocity="-2"'),
    "continuous without velocity limit": with_joint(kind="continuous", limit=None),
    "unknown parent link": chain(joint("elbow", "link_00", "link_1")),
    "unknown child link": chain(joint("elbow", "link_0", "hand")),
    "link twice": robot(link("link_0"), link("link_1"), link("link_1"), ONE),
    "joint twice": chain(ONE, joint("elbow", "link_1", "link_2")),
    "two roots": chain(ONE, links=3),
    "kinematic loop": chain(ONE, TWO, joint("rod", "link_0", "link_2")),
    "circle without root": chain(ONE, joint("wrist", "link_1", "link_0"), links=2),
    "circle beside the root": chain(ONE, joint("a", "link_2", "link_3"), joint("b", "link_3", "link_2")),
    "joint onto itself": chain(ONE, joint("wrist", "link_2", "link_2")),
    "mimic of an unknown joint": with_mimic('<mimic joint="elbo"/>'),
    "mimic of a fixed joint": chain(
        joint("elbow", "link_0", "link_1", kind="fixed"),
        joint("wrist", "link_1", "link_2", extra='<mimic joint="elbow"/>'),
        joint("finger", "link_2", "link_3"),
    ),
    "mimic of itself": with_mimic('<mimic joint="wrist"/>'),
    "mimics in a circle": with_mimic('<mimic joint="elbow"/>', other='<mimic joint="wrist"/>'),
    "mimic limits exclude": with_mimic('<mimic joint="elbow"/>', limit='lower="2" upper="3" velocity="1"'),
    "mimic of multiplier zero": with_mimic('<mimic joint="elbow" multiplier="0" offset="5"/>'),
    "two chains without tip": chain(ONE, joint("wrist", "link_0", "link_2")),
    "missing mesh": with_shape('<mesh filename="package://arm/meshes/elbow.stl"/>'),
}


def refuse(case: str, text: str, error: type[SpacearmError], directory: Path, **options: Any) -> None:
    path = directory / "arm.urdf"
    path.write_bytes(text.encode())
    assert_refused("urdf", case, error, lambda: load_urdf(path, **options), path=path)


@pytest.mark.parametrize("case", FORMAT)
def test_a_file_that_is_no_good_urdf_is_refused(case: str, tmp_path: Path) -> None:
    refuse(case, FORMAT[case], FileFormatError, tmp_path)


@pytest.mark.parametrize("case", ROBOT)
def test_a_robot_that_cannot_be_is_refused(case: str, tmp_path: Path) -> None:
    refuse(case, ROBOT[case], RobotError, tmp_path)


@pytest.mark.parametrize(
    ("case", "options"),
    [
        ("unknown tip", {"tip": "link_2"}),
        ("unknown collision", {"collision": "convex"}),
        ("zero velocity_limit", {"velocity_limit": 0}),
        ("velocity_limit no number", {"velocity_limit": "fast"}),
        ("NaN acceleration_limit", {"acceleration_limit": float("nan")}),
    ],
)
def test_an_option_that_cannot_be_is_refused(case: str, options: dict[str, Any], tmp_path: Path) -> None:
    refuse(case, chain(ONE), RobotError, tmp_path, **options)


def test_a_path_without_a_file_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "arm.urdf"
    assert_refused("urdf", "missing file", FileFormatError, lambda: load_urdf(path), path=path)
    assert_refused("urdf", "directory", FileFormatError, lambda: load_urdf(tmp_path), path=tmp_path)
    assert_refused("urdf", "path is a number", FileFormatError, lambda: load_urdf(3))  # type: ignore[arg-type]
    assert_refused("urdf", "path with NUL", FileFormatError, lambda: load_urdf("a\0b"))


def test_a_mesh_that_is_none_is_refused(tmp_path: Path) -> None:
    (tmp_path / "elbow.stl").write_text("solid nothing\nendsolid nothing\n")
    refuse("mesh without triangles", with_shape('<mesh filename="elbow.stl"/>'), RobotError, tmp_path)
    (tmp_path / "elbow.xyz123").write_text("?")
    refuse("mesh of unknown format", with_shape('<mesh filename="elbow.xyz123"/>'), RobotError, tmp_path)
    (tmp_path / "elbow.dae").write_text("?")
    refuse("broken mesh", with_shape('<mesh filename="elbow.dae"/>'), RobotError, tmp_path)


@pytest.mark.parametrize("case", [case for case in FORMAT if "collision" in case or "mesh" in case])
def test_collision_shapes_do_not_matter_to_who_wants_none(case: str, tmp_path: Path) -> None:
    path = tmp_path / "arm.urdf"
    path.write_text(FORMAT[case])
    assert load_urdf(path, collision="none").shapes == ()
