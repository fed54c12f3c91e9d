"""Mesh files are read alike everywhere: their units, their nodes, their kinds, and what is wrong with them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh

import spacearm as sa
from spacearm.core.errors import SpacearmError
from spacearm.geometry import enclose_mesh
from spacearm.geometry.meshes import read_mesh, stl_of
from spacearm.robot import envelope_report, load_robot
from support import urdf_text

BOX = trimesh.creation.box((0.4, 0.2, 0.1))
LFS = b"version https://git-lfs.github.com/spec/v1\noid sha256:4d7a\nsize 12345\n"


def collada(*, asset: str = "", nodes: str = '<node id="n"><instance_geometry url="#g"/></node>', scale: float = 1.0) -> str:
    """A box of 0.4 x 0.2 x 0.1 m over a scale."""
    places = " ".join(f"{x / scale!r}" for x in BOX.vertices.reshape(-1).tolist())
    faces = " ".join(map(str, BOX.faces.reshape(-1).tolist()))
    return f"""<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><created>2026-01-01T00:00:00</created><modified>2026-01-01T00:00:00</modified>{asset}</asset>
<library_geometries><geometry id="g"><mesh>
<source id="p"><float_array id="pa" count="24">{places}</float_array><technique_common>
<accessor source="#pa" count="8" stride="3"><param name="X" type="float"/><param name="Y" type="float"/>
<param name="Z" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles count="12"><input semantic="VERTEX" source="#v" offset="0"/><p>{faces}</p></triangles></mesh></geometry>
</library_geometries>
<library_visual_scenes><visual_scene id="s">{nodes}</visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#s"/></scene></COLLADA>"""


def extent(path: Path) -> np.ndarray:
    return np.ptp(read_mesh(path).triangles.reshape(-1, 3), axis=0)


@pytest.mark.parametrize("unit", [0.01, 0.0254, 0.001, 10.0])
def test_colladas_unit_is_applied_wherever_a_mesh_is_read(unit: float, tmp_path: Path) -> None:
    (tmp_path / "part.dae").write_text(collada(asset=f'<unit name="u" meter="{unit}"/><up_axis>Z_UP</up_axis>', scale=unit))
    np.testing.assert_allclose(extent(tmp_path / "part.dae"), (0.4, 0.2, 0.1))
    assert any("unit" in note for note in read_mesh(tmp_path / "part.dae").notes)
    balls = enclose_mesh(tmp_path / "part.dae", excess=0.02)
    assert np.abs(balls.centers).max() < 0.25
    path = tmp_path / "arm.urdf"
    path.write_text(arm('<mesh filename="part.dae"/>', mass=4.0, inertia=(0.0167, 0.0567, 0.0667)))
    robot = load_robot(path)
    assert max(np.linalg.norm(end) + c.radius for c in robot.capsules for end in (c.a, c.b)) < 0.5
    assert any("unit" in note and "'arm'" in note for note in robot.notes)
    assert envelope_report(path)[0].excess < 0.2
    assert not [
        one.code for one in sa.diagnose(path, base="fixed").findings if one.code.startswith(("mass", "inertia", "mesh"))
    ]


def arm(shape: str, *, mass: float = 1.0, inertia: tuple[float, ...] = (0.01, 0.01, 0.01), tag: str = "collision") -> str:
    moments = " ".join(f'{name}="{value}"' for name, value in zip(("ixx", "iyy", "izz"), inertia, strict=True))
    inertial = f'<inertial><mass value="{mass}"/><inertia {moments} ixy="0" ixz="0" iyz="0"/></inertial>'
    return urdf_text.robot(
        urdf_text.link("base"),
        urdf_text.link("arm", f"{inertial}<{tag}><geometry>{shape}</geometry></{tag}>"),
        urdf_text.joint("elbow", "base", "arm"),
    )


def test_the_axis_that_points_up_is_not_applied_and_that_is_said(tmp_path: Path) -> None:
    (tmp_path / "part.dae").write_text(collada(asset="<up_axis>Y_UP</up_axis>"))
    np.testing.assert_allclose(extent(tmp_path / "part.dae"), (0.4, 0.2, 0.1))
    assert any("Y_UP" in note for note in enclose_mesh(tmp_path / "part.dae", spheres=3).notes)
    BOX.export(tmp_path / "part.glb")
    np.testing.assert_allclose(extent(tmp_path / "part.glb"), (0.4, 0.2, 0.1), rtol=1e-6)
    assert any("glTF" in note for note in read_mesh(tmp_path / "part.glb").notes)


def test_colladas_nodes_place_and_scale_and_repeat(tmp_path: Path) -> None:
    inner = '<node><translate>0 0 5</translate><instance_geometry url="#g"/></node>'
    nodes = f'<node><scale>2 2 2</scale>{inner}</node><node><instance_geometry url="#g"/></node>'
    (tmp_path / "part.dae").write_text(collada(asset='<unit meter="0.5"/>', nodes=nodes))
    triangles = read_mesh(tmp_path / "part.dae").triangles
    assert len(triangles) == 24
    np.testing.assert_allclose(triangles.reshape(-1, 3).max(axis=0), (0.2, 0.1, 5.05))


@pytest.mark.parametrize("name", ["part.STL", "part.Obj", "solid.stl", "text.stl", "wrong.obj", "part.ply", "part.off"])
def test_a_file_is_known_by_what_it_holds(name: str, tmp_path: Path) -> None:
    binary = stl_of(np.array(BOX.triangles))
    made = {
        "part.STL": binary,
        "solid.stl": b"solid" + binary[5:],
        "wrong.obj": binary,
        "text.stl": str(BOX.export(file_type="stl_ascii")).encode(),
    }
    content = made.get(name) or BOX.export(file_type=name.rpartition(".")[2].lower())
    (tmp_path / name).write_bytes(content.encode() if isinstance(content, str) else content)
    assert len(read_mesh(tmp_path / name).triangles) == 12
    np.testing.assert_allclose(extent(tmp_path / name), (0.4, 0.2, 0.1), rtol=1e-6)


def test_an_obj_may_count_vertices_backwards(tmp_path: Path) -> None:
    part = "v 0 0 {0}\nv 1 0 {0}\nv 1 1 {0}\nv 0 1 {0}\nf -4//-1 -3//-1 -2//-1 -1//-1\n"
    (tmp_path / "part.obj").write_text(part.format(0) + part.format(5))
    triangles = read_mesh(tmp_path / "part.obj").triangles
    assert sorted(triangles[:, :, 2].mean(axis=1).tolist()) == [0, 0, 5, 5]


WRONG = {
    "cut.stl": (stl_of(np.array(BOX.triangles))[:200], "cut off"),
    "empty.stl": (b"", "empty"),
    "page.stl": (b"<html>not found</html>", "no STL"),
    "nan.stl": (stl_of(np.array(BOX.triangles) * np.nan), "not finite"),
    "none.obj": (b"v 0 0 0\nv 1 0 0\n", ""),
    "unit.dae": (collada(asset='<unit meter="0"/>').encode(), "unit"),
    "broken.dae": (collada().replace('source="#p"/></vertices>', 'source="#no"/></vertices>').encode(), "cannot be read"),
    "skin.dae": (collada(nodes='<node><instance_controller url="#c"/></node>').encode(), ""),
    "pointer.stl": (LFS, "git lfs pull"),
    "pointer.dae": (LFS, "git lfs pull"),
}


@pytest.mark.parametrize("name", WRONG)
def test_a_mesh_that_cannot_be_used_is_refused_in_a_sentence(name: str, tmp_path: Path) -> None:
    content, word = WRONG[name]
    (tmp_path / name).write_bytes(content)
    (tmp_path / "arm.urdf").write_text(arm(f'<mesh filename="{name}"/>'))
    for read in (lambda: enclose_mesh(tmp_path / name), lambda: load_robot(tmp_path / "arm.urdf")):
        with pytest.raises(SpacearmError) as caught:
            read()
        assert word in str(caught.value)
        assert "\n" not in str(caught.value)
    assert "mesh-unreadable" in [one.code for one in sa.diagnose(tmp_path / "arm.urdf").errors]


def test_a_git_lfs_pointer_is_told_wherever_a_file_is_read(tmp_path: Path) -> None:
    path = tmp_path / "a.urdf"
    path.write_bytes(LFS)
    robot = load_robot("zhang2022")
    for read in (load_robot, sa.load_problem, sa.diagnose, lambda file: sa.load_trajectory(robot, file)):
        with pytest.raises(SpacearmError, match="git lfs pull"):
            read(path)


@pytest.mark.parametrize("scale", ["0 0 0", "1 0 1", "0", "1e-300 1e-300 1e-300"])
def test_a_mesh_that_is_scaled_to_nothing_is_refused(scale: str, tmp_path: Path) -> None:
    BOX.export(tmp_path / "part.stl")
    path = tmp_path / "arm.urdf"
    path.write_text(arm(f'<mesh filename="part.stl" scale="{scale}"/>'))
    with pytest.raises(SpacearmError, match=r"scale"):
        load_robot(path)
    assert "mesh-without-size" in [one.code for one in sa.diagnose(path).errors]


def test_a_mirrored_or_flat_mesh_is_enclosed(tmp_path: Path) -> None:
    BOX.export(tmp_path / "part.stl")
    path = tmp_path / "arm.urdf"
    path.write_text(arm('<mesh filename="part.stl" scale="-1 1 2"/>'))
    assert len(load_robot(path).capsules) > 0
    (tmp_path / "part.stl").write_bytes(stl_of(np.array(BOX.triangles) * (1, 1, 0)))
    assert any("flat" in note for note in load_robot(path).notes)


def test_a_mesh_in_millimetres_is_doubted(tmp_path: Path) -> None:
    (tmp_path / "part.stl").write_bytes(stl_of(np.array(BOX.triangles) * 100))  # 40 m long, on joints that reach 0.3 m
    path = tmp_path / "arm.urdf"
    path.write_text(arm('<mesh filename="part.stl"/>').replace('xyz="0 0 0"', 'xyz="0 0 0.3"'))
    notes = load_robot(path).notes
    assert any("millimetres" in note and "0.001 0.001 0.001" in note for note in notes), notes
    assert "mesh-in-millimetres" in [one.code for one in sa.diagnose(path).warnings]
    (tmp_path / "vast.stl").write_bytes(stl_of(np.array(BOX.triangles) * 1000))
    assert any("0.001" in note for note in enclose_mesh(tmp_path / "vast.stl", spheres=2).notes)


@pytest.mark.parametrize("name", ["part.dae", "sub/part.dae", "part.GLB", "part.ply", "sub/part.stl", "text.stl", "part.stl"])
def test_a_collision_mesh_that_the_doctor_gives_is_one_that_mujoco_reads(name: str, tmp_path: Path) -> None:
    mujoco = pytest.importorskip("mujoco")
    file = tmp_path / name
    file.parent.mkdir(exist_ok=True)
    kind = file.suffix[1:].lower()
    made = BOX.export(file_type="stl_ascii" if name == "text.stl" else kind)
    file.write_bytes(made.encode() if isinstance(made, str) else made)
    (tmp_path / "arm.urdf").write_text(arm(f'<mesh filename="{name}" scale="1 1 2"/>', tag="visual"))
    mended = sa.mend_urdf(tmp_path / "arm.urdf", tmp_path / "mended.urdf")
    assert "collision-missing" in [change.code for change in mended.changes]
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "mended.urdf"))
    assert model.ngeom == 1
    robot = load_robot(tmp_path / "mended.urdf")
    assert max(np.linalg.norm(end) + c.radius for c in robot.capsules for end in (c.a, c.b)) < 0.5
