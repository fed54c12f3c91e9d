"""What a robot is drawn with: shapes and meshes of its file, and what is said of those that are missing."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import trimesh

from spacearm.geometry.meshes import stl_of
from spacearm.report.page_motion import matrix
from spacearm.report.report_meshes import Meshes
from spacearm.report.report_page import unpacked
from spacearm.report.report_scene import robot_data
from spacearm.report.report_visuals import visual_parts
from spacearm.robot import Robot, load_urdf
from support import urdf_text as text

BOX = trimesh.creation.box((0.2, 0.1, 0.4))


def arm(tmp_path: Path, *visuals: str) -> Robot:
    """An arm of one joint whose hand has these visuals, and a ball to be kept clear."""
    (tmp_path / "box.stl").write_bytes(stl_of(np.asarray(BOX.triangles)))
    content = text.robot(
        text.link(
            "base", "<visual><geometry><box size='1 1 0.1'/></geometry></visual>", text.collision('<box size="1 1 0.1"/>')
        ),
        text.link("hand", *visuals, text.collision('<sphere radius="0.3"/>')),
        text.joint("j1", "base", "hand", xyz="0 0 1"),
    )
    (tmp_path / "arm.urdf").write_text(content)
    return load_urdf(tmp_path / "arm.urdf", self_collision="none")


def visual(shape: str, color: str = "", xyz: str = "0 0 0") -> str:
    """A <visual> with a colour of its own."""
    paint = f"<material name=''><color rgba='{color}'/></material>" if color else ""
    return f"<visual><origin xyz='{xyz}' rpy='0 0 0'/><geometry>{shape}</geometry>{paint}</visual>"


def drawn(robot: Robot, most: int = 100_000) -> tuple[list[dict], Meshes]:
    """The parts, and the meshes with their notes."""
    meshes = Meshes()
    return visual_parts(robot, meshes, most), meshes


def test_shapes_and_their_colours(tmp_path: Path) -> None:
    shapes = ('<sphere radius="0.2"/>', '<cylinder radius="0.1" length="0.5"/>', '<capsule radius="0.1" length="0.4"/>')
    robot = arm(tmp_path, *(visual(shape, "1 0.5 0 1", "0 0 0.2") for shape in shapes))
    (_, ball, cylinder, capsule), meshes = drawn(robot)
    assert ball == {
        "name": "hand",
        "joint": 0,
        "color": "#ff8000",
        "geometry": {"kind": "sphere", "radius": 0.2, "center": [0, 0, 0.2]},
    }
    assert (cylinder["geometry"]["radius"], cylinder["geometry"]["length"]) == (0.1, 0.5)
    np.testing.assert_allclose(matrix(cylinder["geometry"]["T"])[:3, 3], [0, 0, 0.2])
    np.testing.assert_allclose([capsule["geometry"]["a"], capsule["geometry"]["b"]], [[0, 0, 0], [0, 0, 0.4]], atol=1e-15)
    assert meshes.notes == []


def test_a_mesh_is_scaled_and_stored_once(tmp_path: Path) -> None:
    mesh = '<mesh filename="box.stl" scale="2 2 2"/>'
    parts, meshes = drawn(arm(tmp_path, visual(mesh, "0 0 1 1"), visual(mesh, "1 0 0 1", "0 0 1")))
    assert [part["geometry"].get("mesh") for part in parts] == [None, 0, 0]
    assert [part.get("color") for part in parts] == [None, "#0000ff", "#ff0000"]
    (stored,) = meshes.items
    np.testing.assert_allclose([stored["low"], stored["high"]], [[-0.2, -0.1, -0.4], [0.2, 0.1, 0.4]])
    assert len(unpacked(stored["indices"])) == 3 * 12


def test_a_mirrored_mesh_keeps_its_outside_out(tmp_path: Path) -> None:
    _, meshes = drawn(arm(tmp_path, visual('<mesh filename="box.stl" scale="-1 1 1"/>')))
    (stored,) = meshes.items
    low, high = np.array(stored["low"]), np.array(stored["high"])
    points = low + (high - low) * unpacked(stored["positions"]).reshape(-1, 3) / 65535
    made = trimesh.Trimesh(points, unpacked(stored["indices"]).reshape(-1, 3), process=False)
    assert made.volume > 0.0079


def test_own_colours_go_before_the_urdfs(tmp_path: Path) -> None:
    robot = arm(tmp_path, visual('<mesh filename="one.ply"/>', "1 1 0 1"), visual('<mesh filename="two.ply"/>', "1 1 0 1"))
    one, two = BOX.copy(), BOX.copy()
    one.visual.face_colors = [0, 128, 0, 255]
    two.visual.face_colors = np.where(np.arange(12)[:, None] < 6, [255, 0, 0, 255], [0, 0, 255, 255])
    one.export(tmp_path / "one.ply")
    two.export(tmp_path / "two.ply")
    robot = arm(tmp_path, visual('<mesh filename="one.ply"/>', "1 1 0 1"), visual('<mesh filename="two.ply"/>', "1 1 0 1"))
    (_, green, mixed), meshes = drawn(robot)
    assert green["color"] == "#008000"
    assert "color" not in mixed
    assert "colors" not in meshes.items[0]
    colors = unpacked(meshes.items[1]["colors"]).reshape(-1, 3)
    assert {tuple(color) for color in colors.tolist()} == {(255, 0, 0), (0, 0, 255)}


def test_what_is_missing_or_broken_is_said_and_the_envelope_drawn(tmp_path: Path) -> None:
    (tmp_path / "broken.dae").write_text("this is none")
    for shape, words in (
        ('<mesh filename="gone.stl"/>', "the mesh is not there, and the envelope is drawn: 'hand: gone.stl'"),
        ('<mesh filename="broken.dae"/>', "the mesh cannot be read"),
        ('<box size="1 2"/>', "its <box size> is '1 2': 'hand'"),
    ):
        robot = arm(tmp_path, visual(shape))
        parts, meshes = drawn(robot)
        assert [part["name"] for part in parts] == ["base"]
        (note,) = meshes.notes
        assert words in note
        assert not any("mesh" in note for note in robot.notes)
        data = robot_data(robot, meshes, parts)
        assert [part["name"] for part in data["visuals"]] == ["base", "hand"]
        assert data["visuals"][1]["geometry"] == {"kind": "sphere", "radius": 0.3, "center": [0, 0, 0]}


def test_many_triangles_become_few_which_is_said(tmp_path: Path) -> None:
    robot = arm(tmp_path, visual('<mesh filename="ball.stl"/>'))
    trimesh.creation.icosphere(5).export(tmp_path / "ball.stl")
    robot = arm(tmp_path, visual('<mesh filename="ball.stl"/>'))
    _, meshes = drawn(robot, most=4000)
    count = len(unpacked(meshes.items[0]["indices"])) // 3
    assert count <= 4000
    (note,) = meshes.notes
    assert f"{count:,} triangles are drawn of the 20,480" in note


def test_opacity_and_textures_are_said(tmp_path: Path) -> None:
    glass = visual('<sphere radius="0.1"/>', "0 0 1 0.3")
    skin = "<visual><geometry><sphere radius='1'/></geometry><material name='m'><texture filename='a.png'/></material></visual>"
    parts, meshes = drawn(arm(tmp_path, glass, skin))
    assert len(parts) == 3
    assert [note.split(": ", 1)[1] for note in meshes.notes] == [
        "it is drawn opaque, which its file does not ask for: 'hand'",
        "its texture 'a.png' is not drawn: 'hand'",
    ]


def test_without_visuals_nothing_is_drawn(tmp_path: Path) -> None:
    robot = replace(arm(tmp_path), visuals=())
    parts, meshes = drawn(robot)
    assert (parts, meshes.items, meshes.notes) == ([], [], [])
    assert robot_data(robot, meshes)["visuals"] == []


def test_visuals_without_an_envelope_need_no_rods(tmp_path: Path) -> None:
    robot = replace(arm(tmp_path, visual('<sphere radius="0.1"/>')), shapes=(), collision="none")
    parts, meshes = drawn(robot)
    data = robot_data(robot, meshes, parts)
    assert (len(data["visuals"]), data["shapes"], meshes.notes) == (2, [], [])
    bare = robot_data(replace(robot, visuals=()), meshes)
    assert "rod" in bare["shapes"][0]["name"]


def test_a_mesh_that_was_moved_is_found_beside_the_file(tmp_path: Path) -> None:
    robot = arm(tmp_path, visual('<mesh filename="box.stl"/>'))
    away = replace(robot, visuals=tuple(replace(one, file="/gone/box.stl" if one.file else "") for one in robot.visuals))
    parts, meshes = drawn(away)
    assert len(parts) == 2
    assert meshes.notes == []
