"""How links look: read from a URDF, carried by joints, kept beside the robot's value."""

import pickle
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from spacearm.core.errors import RobotError
from spacearm.geometry.meshes import stl_of
from spacearm.robot import LinkVisual, Robot, joint_frames, load_robot, load_urdf
from spacearm.robot.assembly import locked_elsewhere
from spacearm.robot.model import robot_as_dict
from support import urdf_text as text

TRIANGLE = stl_of(np.array([[[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]]))


def visual(shape: str, *more: str, xyz: str = "0 0 0", rpy: str = "0 0 0") -> str:
    """A <visual>; further elements, as a material, go after the shape."""
    return f'<visual><origin xyz="{xyz}" rpy="{rpy}"/><geometry>{shape}</geometry>{"".join(more)}</visual>'


def arm(*visuals: str, more: str = "", lower: str = "") -> str:
    """An arm of three joints, the last two fixed and turning; visuals are on the second link."""
    return text.robot(
        more,
        text.link("base", visual('<box size="0.4 0.4 0.1"/>')),
        text.link("upper", *visuals),
        text.link("bracket", visual('<sphere radius="0.05"/>', xyz="0 0 0.1")),
        text.link("hand", lower),
        text.joint("j1", "base", "upper", axis="0 1 0", xyz="0 0 0.5"),
        text.joint("j2", "upper", "bracket", kind="fixed", xyz="0.3 0 0", rpy="0 0.5 0"),
        text.joint("j3", "bracket", "hand", axis="1 0 0", xyz="0 0 0.2"),
    )


def of_link(robot: Robot, name: str) -> list[LinkVisual]:
    """The visuals of a link."""
    return [one for one in robot.visuals if one.name == name]


def loaded(tmp_path: Path, content: str, **options: object) -> Robot:
    """A robot of a text, with a mesh beside it."""
    (tmp_path / "meshes").mkdir(exist_ok=True)
    (tmp_path / "meshes" / "part.stl").write_bytes(TRIANGLE)
    (tmp_path / "arm.urdf").write_text(content)
    return load_urdf(tmp_path / "arm.urdf", collision="none", **options)


def test_primitives_with_sizes_and_places(tmp_path: Path) -> None:
    shapes = ('<box size="1 2 3"/>', '<cylinder radius="0.1" length="2"/>', '<capsule radius="0.2" length="1"/>')
    robot = loaded(tmp_path, arm(*(visual(shape, xyz="0 0 0.25", rpy="0.1 0.2 0.3") for shape in shapes)))
    assert [(one.kind, one.size) for one in of_link(robot, "upper")] == [
        ("box", (1, 2, 3)),
        ("cylinder", (0.1, 2)),
        ("capsule", (0.2, 1)),
    ]
    assert not any(one.lack for one in robot.visuals)


def test_fixed_links_ride_on_the_joint_before_them(tmp_path: Path) -> None:
    robot = loaded(tmp_path, arm(), tip="hand")
    (ball,) = of_link(robot, "bracket")
    frame = robot.frame("bracket")
    assert ball.joint == frame.joint == 0
    np.testing.assert_allclose(ball.T_joint_visual @ [0, 0, 0, 1], frame.T_joint_frame @ [0, 0, 0.1, 1], atol=1e-15)
    (box,) = of_link(robot, "base")
    assert box.joint == -1


def test_locked_joints_carry_visuals_to_where_they_are_locked(tmp_path: Path) -> None:
    content = arm(lower=visual('<box size="0.1 0.1 0.1"/>', xyz="0 0.2 0"))
    free = loaded(tmp_path, content, tip="hand")
    locked = loaded(tmp_path, content, tip="hand", fixed={"j3": 0.4})
    moved = locked_elsewhere(locked, {"j3": -0.3})
    for robot, q3 in ((locked, 0.4), (moved, -0.3)):
        (drawn,), (meant,) = of_link(robot, "hand"), of_link(free, "hand")
        assert drawn.joint == 0
        here = joint_frames(robot, [0.7])[drawn.joint] @ drawn.T_joint_visual
        np.testing.assert_allclose(here, joint_frames(free, [0.7, q3])[meant.joint] @ meant.T_joint_visual, atol=1e-14)


def test_meshes_are_found_and_not_read(tmp_path: Path) -> None:
    (tmp_path / "meshes").mkdir()
    (tmp_path / "meshes" / "broken.dae").write_text("this is no mesh")
    one, other = '<mesh filename="package://arm/meshes/part.stl" scale="1 -1 2"/>', '<mesh filename="meshes/broken.dae"/>'
    robot = loaded(tmp_path, arm(visual(one), visual(other), visual('<mesh filename="gone.stl"/>')))
    found, broken, gone = of_link(robot, "upper")
    assert Path(found.file) == tmp_path / "meshes" / "part.stl"
    assert found.scale == (1, -1, 2)
    assert broken.file
    assert not broken.lack
    assert (gone.file, gone.filename, gone.found(robot.source)) == ("", "gone.stl", None)
    (tmp_path / "gone.stl").write_bytes(TRIANGLE)
    assert gone.found(robot.source) == tmp_path / "gone.stl"


def test_materials_by_name_and_in_place(tmp_path: Path) -> None:
    blue = '<material name="blue"><color rgba="0 0 1 1"/></material>'
    own = '<material name="own"><color rgba="0.2 0.4 0.6 0.5"/></material>'
    again = '<material name="blue"><color rgba="1 0 0 1"/></material>'
    unnamed = '<material name=""><color rgba="0.1 0.1 2"/></material>'
    box = '<box size="1 1 1"/>'
    given = (blue.replace("0 0 1 1", "9"), '<material name="blue"/>', own, again, unnamed, '<material name="lost"/>', "")
    robot = loaded(tmp_path, arm(*(visual(box, one) for one in given[1:]), more=blue))
    colors = [(one.color, one.lack) for one in of_link(robot, "upper")]
    assert colors == [
        ((0, 0, 1, 1), ""),
        ((0.2, 0.4, 0.6, 0.5), ""),
        ((0, 0, 1, 1), ""),  # as in urdfdom: the first of a name holds
        ((0.1, 0.1, 1, 1), ""),
        (None, "its material 'lost' is not defined"),
        (None, ""),
    ]


def test_a_texture_is_said(tmp_path: Path) -> None:
    painted = '<material name="skin"><texture filename="package://arm/skin.png"/></material>'
    (one,) = of_link(loaded(tmp_path, arm(visual('<sphere radius="1"/>', painted))), "upper")
    assert one.color is None
    assert one.lack == "its texture 'package://arm/skin.png' is not drawn"


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ('<box size="1 2"/>', "its <box size> is '1 2'"),
        ('<box size="1 2 -3"/>', "a length below 0"),
        ('<sphere radius="${r}"/>', "its <sphere radius> is '${r}'"),
        ('<sphere radius="1e9"/>', "1e9"),
        ('<cylinder radius="1"/>', "its <cylinder length> is missing"),
        ('<cone radius="1"/>', "it has <cone>"),
        ('<mesh filename=""/>', "names no file"),
        ('<mesh filename="a.stl" scale="0 1 1"/>', "a scale of 0"),
        ("", "it has no shape"),
    ],
)
def test_what_is_wrong_stops_nobody_and_is_kept(tmp_path: Path, wrong: str, words: str) -> None:
    (one,) = of_link(loaded(tmp_path, arm(visual(wrong))), "upper")
    assert one.kind == "nothing"
    assert words in one.lack


def test_a_wrong_place_or_colour_is_kept(tmp_path: Path) -> None:
    box = '<box size="1 1 1"/>'
    placed, painted = visual(box, xyz="0 a 0"), visual(box, '<material name="x"><color rgba="1"/></material>')
    one, other = of_link(loaded(tmp_path, arm(placed, painted)), "upper")
    assert one.kind == "nothing"
    assert "<origin xyz>" in one.lack
    assert other.kind == "box"
    assert other.color is None
    assert "<color rgba>" in other.lack


def test_visuals_are_no_part_of_the_robots_value(tmp_path: Path) -> None:
    robot = loaded(tmp_path, arm(visual('<mesh filename="meshes/part.stl"/>')))
    bare = replace(robot, visuals=())
    assert robot == bare
    assert hash(robot) == hash(bare)
    assert "visuals" not in robot_as_dict(robot)
    again = pickle.loads(pickle.dumps(robot))
    assert again.visuals == robot.visuals
    assert len(again.visuals) == 3
    assert replace(robot, name="other").visuals == robot.visuals


def test_a_visual_beyond_the_joints_is_refused(tmp_path: Path) -> None:
    robot = loaded(tmp_path, arm())
    with pytest.raises(RobotError, match="visual 'base' rides on joint 7"):
        replace(robot, visuals=(replace(robot.visuals[0], joint=7),))


def test_a_floating_joint_above_the_base_takes_its_links_visuals_away(tmp_path: Path) -> None:
    content = text.robot(
        text.link("world", visual('<box size="1 1 1"/>')),
        text.link("base", visual('<sphere radius="0.3"/>')),
        text.link("hand"),
        text.joint("free", "world", "base", kind="floating", axis=None, limit=None),
        text.joint("j1", "base", "hand"),
    )
    assert [one.name for one in loaded(tmp_path, content, base="floating").visuals] == ["base"]


def test_built_in_robots_draw_nothing() -> None:
    assert load_robot("ssrms").visuals == ()


@pytest.mark.parametrize("wrong", [{"kind": "cone"}, {"size": (1.0,)}, {"color": (1, 2)}, {"scale": (1, 1)}, {"joint": -2}])
def test_a_visual_that_cannot_be_is_refused(wrong: dict[str, object]) -> None:
    given = {"name": "hand", "T_joint_visual": np.eye(4), "kind": "box", "size": (1, 1, 1)}
    with pytest.raises(RobotError):
        LinkVisual(**(given | wrong))
