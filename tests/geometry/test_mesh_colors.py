"""Colours of meshes from files: materials, textures and colours of corners."""

from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image

from spacearm.geometry.mesh_colors import light_of_screen, screen_of_light
from spacearm.geometry.meshes import read_mesh, stl_of

SQUARE = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
TURNS = np.array([[0, 1, 2], [0, 2, 3]])

COLLADA = """<?xml version="1.0"?><COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit meter="1"/><up_axis>Z_UP</up_axis></asset>
<library_images><image id="skin"><init_from>skin.png</init_from></image></library_images>
<library_effects>
<effect id="red"><profile_COMMON><technique sid="c"><lambert><diffuse><color>0.8 0.1 0.2 1</color></diffuse></lambert>
</technique></profile_COMMON></effect>
<effect id="painted"><profile_COMMON>
<newparam sid="s"><surface type="2D"><init_from>skin</init_from></surface></newparam>
<newparam sid="m"><sampler2D><source>s</source></sampler2D></newparam>
<technique sid="c"><lambert><diffuse><texture texture="m" texcoord="UV"/></diffuse></lambert></technique>
</profile_COMMON></effect>
</library_effects>
<library_materials><material id="r"><instance_effect url="#red"/></material>
<material id="p"><instance_effect url="#painted"/></material></library_materials>
<library_geometries><geometry id="g"><mesh>
<source id="x"><float_array id="xa" count="12">0 0 0 1 0 0 1 1 0 0 1 0</float_array><technique_common>
<accessor source="#xa" count="4" stride="3"><param name="X" type="float"/><param name="Y" type="float"/>
<param name="Z" type="float"/></accessor></technique_common></source>
<source id="uv"><float_array id="ua" count="8">0 0 1 0 1 1 0 1</float_array><technique_common>
<accessor source="#ua" count="4" stride="2"><param name="S" type="float"/><param name="T" type="float"/></accessor>
</technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#x"/></vertices>
<triangles count="1" material="one"><input semantic="VERTEX" source="#v" offset="0"/><p>0 1 2</p></triangles>
<triangles count="2" material="two"><input semantic="VERTEX" source="#v" offset="0"/>
<input semantic="TEXCOORD" source="#uv" offset="1" set="0"/><p>0 0 1 1 2 2 0 0 2 2 3 3</p></triangles>
<triangles count="1"><input semantic="VERTEX" source="#v" offset="0"/><p>0 2 3</p></triangles>
</mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="vs"><node><instance_geometry url="#g"><bind_material><technique_common>
<instance_material symbol="one" target="#r"/><instance_material symbol="two" target="#p"/>
</technique_common></bind_material></instance_geometry></node></visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#vs"/></scene></COLLADA>"""


def halves(path: Path) -> None:
    """An image whose lower right half is green, and the other one blue: one for each triangle of the square."""
    rows, columns = np.mgrid[:64, :64]
    green = columns > 63 - rows
    Image.fromarray(np.where(green[..., None], [0, 255, 0], [0, 0, 255]).astype(np.uint8)).save(path)


def test_collada_materials_and_textures(tmp_path: Path) -> None:
    (tmp_path / "part.dae").write_text(COLLADA)
    halves(tmp_path / "skin.png")
    mesh = read_mesh(tmp_path / "part.dae", with_colors=True)
    assert mesh.colors is not None
    np.testing.assert_allclose(mesh.colors[:3], [[0.8, 0.1, 0.2, 1], [0, 1, 0, 1], [0, 0, 1, 1]], atol=1e-12)
    assert np.isnan(mesh.colors[3]).all()
    assert mesh.notes == ()
    plain = read_mesh(tmp_path / "part.dae")
    assert plain.colors is None
    np.testing.assert_array_equal(plain.triangles, mesh.triangles)


def test_a_missing_texture_is_said(tmp_path: Path) -> None:
    (tmp_path / "part.dae").write_text(COLLADA)
    mesh = read_mesh(tmp_path / "part.dae", with_colors=True)
    assert mesh.colors is not None
    assert np.isnan(mesh.colors[1:3]).all()
    assert mesh.notes == ("a texture is left out: 'skin.png' is not there",)


def test_a_broken_texture_is_said(tmp_path: Path) -> None:
    (tmp_path / "part.dae").write_text(COLLADA)
    (tmp_path / "skin.png").write_text("no image")
    (note,) = read_mesh(tmp_path / "part.dae", with_colors=True).notes
    assert note.startswith("a texture is left out: ")


def test_wavefront_materials(tmp_path: Path) -> None:
    (tmp_path / "part.mtl").write_text("newmtl one\nKd 1 0 0\nnewmtl two\nKd 0 0.5 1\n")
    faces = "usemtl one\nf 1 2 3\nusemtl two\nf 1 3 4\n"
    (tmp_path / "part.obj").write_text("mtllib part.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n" + faces)
    colors = read_mesh(tmp_path / "part.obj", with_colors=True).colors
    assert colors is not None
    np.testing.assert_allclose(np.sort(colors, axis=0), np.sort([[1, 0, 0, 1], [0, 0.5, 1, 1]], axis=0), atol=0.01)


@pytest.mark.parametrize("first", ["", "mtllib gone.mtl\n"])
def test_wavefront_without_materials(tmp_path: Path, first: str) -> None:
    (tmp_path / "part.obj").write_text(f"{first}v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\n")
    colors = read_mesh(tmp_path / "part.obj", with_colors=True).colors
    assert colors is None or np.isnan(colors).all()


def test_gltf_states_light(tmp_path: Path) -> None:
    material = trimesh.visual.material.PBRMaterial(baseColorFactor=[128, 0, 255, 255])
    part = trimesh.Trimesh(SQUARE, TURNS, visual=trimesh.visual.TextureVisuals(uv=np.zeros((4, 2)), material=material))
    part.export(tmp_path / "part.glb")
    colors = read_mesh(tmp_path / "part.glb", with_colors=True).colors
    assert colors is not None
    np.testing.assert_allclose(colors[0], [screen_of_light(np.array(128 / 255)), 0, 1, 1], atol=0.005)


def test_colours_of_corners_are_averaged(tmp_path: Path) -> None:
    part = trimesh.Trimesh(SQUARE, TURNS, vertex_colors=[[255, 0, 0, 255], [0, 255, 0, 255], [0, 0, 255, 255], [0, 0, 0, 255]])
    part.export(tmp_path / "part.ply")
    colors = read_mesh(tmp_path / "part.ply", with_colors=True).colors
    assert colors is not None
    np.testing.assert_allclose(colors[0], [1 / 3, 1 / 3, 1 / 3, 1], atol=0.01)


def test_stl_has_none(tmp_path: Path) -> None:
    (tmp_path / "part.stl").write_bytes(stl_of(SQUARE[TURNS]))
    assert read_mesh(tmp_path / "part.stl", with_colors=True).colors is None


def test_light_and_screen_are_inverse() -> None:
    some = np.linspace(0, 1, 101)
    np.testing.assert_allclose(screen_of_light(light_of_screen(some)), some, atol=1e-6)
