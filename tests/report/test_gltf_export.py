"""Animated scenes as glTF: read back by trimesh, and their motion compared with the trajectory's."""

import json
import re
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from house.source import REPOSITORY
from spacearm.core.rotations import matrix_of
from spacearm.dynamics import Momentum
from spacearm.geometry import Box, Capsule, Cylinder, HalfSpace, Polytope, Scene, Sphere, SphereSet
from spacearm.motion import AnyTrajectory, Motion, Trajectory
from spacearm.motion.trajectory import base_frames
from spacearm.report import gltf_export
from spacearm.report.gltf_export import glb_of_page
from spacearm.report.gltf_shapes import capsule, mesh_solid, unit_ball, unit_box, unit_cylinder
from spacearm.report.page_motion import PageMotion
from spacearm.report.report_knots import knots_of
from spacearm.report.report_meshes import Meshes
from spacearm.report.report_page import packed, quantised
from spacearm.report.report_scene import obstacles_data, robot_data
from spacearm.robot import forward_kinematics
from support.oracles.servicer import ROWS, servicer
from support.small_robots import slider

TO_Z = np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])  # from glTF's axes to ours
START = np.array([[0.0, -1.0, 0.0, 0.5], [1.0, 0.0, 0.0, -0.25], [0.0, 0.0, 1.0, 2.0], [0.0, 0.0, 0.0, 1.0]])
EMPTY = Scene([])


def floating() -> Trajectory:
    """A servicer that tumbles."""
    path = Motion([np.zeros(7), np.full(7, 0.6), ROWS[0][0]])
    momentum = Momentum(linear=(3.0, 1.0, -2.0), angular=(20.0, -30.0, 10.0))
    return Trajectory(servicer(), path, base_start=START, momentum=momentum)


def sliding() -> Trajectory:
    """A carriage that slides along x and z."""
    return Trajectory(slider(), Motion([[0.0, 0.0], [1.0, -0.5], [2.0, 1.0]]))


def page_of(trajectory: AnyTrajectory, scene: Scene = EMPTY, *, ghost: bool = False) -> dict[str, Any]:
    """A report's page with one view of a motion, without its curves."""
    meshes = Meshes()
    actor = {"name": "arm", "robot": 0, "knots": knots_of(trajectory, []), "tone": 0, "ghost": ghost}
    target = {"name": "goal", "kind": "position", "T": [1, 0, 0, 1, 0, 1, 0, 2, 0, 0, 1, 3], "radius": 0}
    view = {
        "name": "one",
        "clock": {"unit": "s", "duration": trajectory.duration},
        "actors": [actor],
        "obstacles": obstacles_data(scene, meshes),
        "targets": [target],
    }
    return {"title": "a motion", "robots": [robot_data(trajectory.robot, meshes)], "meshes": meshes.items, "views": [view]}


def parts_of(content: bytes) -> tuple[dict[str, Any], bytes]:
    """The JSON and the binary chunk of a GLB, whose lengths are checked."""
    magic, version, length = struct.unpack("<4sII", content[:12])
    assert (magic, version, length) == (b"glTF", 2, len(content))
    size, kind = struct.unpack("<I4s", content[12:20])
    assert kind == b"JSON"
    at = 20 + size
    binary_size, binary_kind = struct.unpack("<I4s", content[at : at + 8])
    assert binary_kind == b"BIN\0"
    assert at + 8 + binary_size == len(content)
    assert at % 4 == 0
    return json.loads(content[20:at]), content[at + 8 :]


def numbers(document: dict[str, Any], binary: bytes, place: int) -> np.ndarray:
    """The numbers of an accessor."""
    accessor = document["accessors"][place]
    view = document["bufferViews"][accessor["bufferView"]]
    assert view["byteOffset"] % 4 == 0
    kind, width = {5126: "<f4", 5123: "<u2", 5125: "<u4"}[accessor["componentType"]], {"SCALAR": 1, "VEC3": 3, "VEC4": 4}
    content = binary[view["byteOffset"] : view["byteOffset"] + view["byteLength"]]
    return np.frombuffer(content, kind).reshape(accessor["count"], width[accessor["type"]]).astype(float)


def poses(document: dict[str, Any], binary: bytes, name: str, t: np.ndarray) -> np.ndarray:
    """Where the node of a name is, in our axes, as a player of glTF would have it: keys joined by straight lines and arcs."""
    nodes = document["nodes"]
    above = {child: i for i, node in enumerate(nodes) for child in node.get("children", ())}
    channels: dict[tuple[int, str], tuple[np.ndarray, np.ndarray]] = {}
    for channel in document["animations"][0]["channels"]:
        sampler = document["animations"][0]["samplers"][channel["sampler"]]
        assert sampler["interpolation"] == "LINEAR"
        keys = numbers(document, binary, sampler["input"])[:, 0], numbers(document, binary, sampler["output"])
        channels[channel["target"]["node"], channel["target"]["path"]] = keys
    at = next(i for i, node in enumerate(nodes) if node["name"] == name)
    T = np.tile(np.eye(4), (len(t), 1, 1))
    while True:
        own = np.tile(np.eye(4), (len(t), 1, 1))
        own[:, :3, 3] = nodes[at].get("translation", [0, 0, 0])
        turned = np.tile(nodes[at].get("rotation", [0, 0, 0, 1.0]), (len(t), 1))
        for path, into in (("translation", own[:, :3, 3]), ("rotation", turned)):
            if (at, path) in channels:
                times, values = channels[at, path]
                into[:] = np.stack([np.interp(t, times, column) for column in values.T], axis=1)
        turned /= np.linalg.norm(turned, axis=1, keepdims=True)
        own[:, :3, :3] = matrix_of(np.roll(turned, 1, axis=1))
        T = own @ T
        if at not in above:
            return TO_Z @ T
        at = above[at]


@pytest.mark.parametrize("made", [floating, sliding])
def test_the_end_effector_moves_as_in_the_trajectory(made: Any) -> None:
    trajectory = made()
    document, binary = parts_of(glb_of_page(page_of(trajectory)))
    t = np.linspace(0, trajectory.duration, 57)
    q = np.array([trajectory.sample(at).q for at in t])
    meant = base_frames(trajectory, t) @ forward_kinematics(trajectory.robot, q)
    assert np.abs(poses(document, binary, trajectory.robot.tip, t) - meant).max() < 1e-3
    keys = numbers(document, binary, document["animations"][0]["samplers"][0]["input"])
    assert keys[0, 0] == 0
    assert keys[-1, 0] == pytest.approx(trajectory.duration, rel=1e-6)


def test_the_pages_motion_is_the_trajectorys() -> None:
    trajectory = floating()
    page = page_of(trajectory)
    motion = PageMotion(page["views"][0]["actors"][0], page["robots"])
    t = np.linspace(0, trajectory.duration, 23)
    q = np.array([trajectory.sample(at).q for at in t])
    np.testing.assert_allclose(motion.tips(t), base_frames(trajectory, t) @ forward_kinematics(trajectory.robot, q), atol=2e-5)


def test_nodes_have_the_names_of_joints_links_and_obstacles() -> None:
    trajectory = floating()
    scene = Scene([Box((1, 1, 1), name="mast"), Sphere((3, 0, 0), 0.5, name="tank")])
    document, _ = parts_of(glb_of_page(page_of(trajectory, scene)))
    names = [node["name"] for node in document["nodes"]]
    robot = trajectory.robot
    meant = {joint.name for joint in robot.joints} | {part.name for part in robot.shapes} | {robot.tip, "mast", "tank", "goal"}
    assert meant <= set(names)
    assert document["scenes"][0]["nodes"] == [names.index("z up")]


def test_another_reader_finds_the_obstacles_where_they_are(tmp_path: Path) -> None:
    pose = np.eye(4)
    pose[:3, 3] = (5.0, -2.0, 1.0)
    hull = Polytope([(0, 0, 8), (1, 0, 8), (0, 1, 8), (0, 0, 9)], name="hull")
    scene = Scene(
        [
            Box((1, 2, 3), pose=pose, name="box"),
            Cylinder(0.5, 2.0, pose=pose, name="drum"),
            Capsule((0, 4, 0), (0, 6, 0), 0.5, name="rod"),
            Sphere((-3, 0, 0), 0.5, name="ball"),
            hull,
        ]
    )
    (tmp_path / "scene.glb").write_bytes(glb_of_page(page_of(sliding(), scene)))
    read = trimesh.load_scene(tmp_path / "scene.glb")
    for name, low, high in (
        ("box", (4.5, -3, -0.5), (5.5, -1, 2.5)),
        ("drum", (4.5, -2.5, 0), (5.5, -1.5, 2)),
        ("rod", (-0.5, 3.5, -0.5), (0.5, 6.5, 0.5)),
        ("ball", (-3.5, -0.5, -0.5), (-2.5, 0.5, 0.5)),
        ("hull", (0, 0, 8), (1, 1, 9)),
    ):
        T, geometry = read.graph[name]
        part = read.geometry[geometry].copy()
        part.apply_transform(TO_Z @ T)
        np.testing.assert_allclose(part.bounds, [low, high], atol=0.01)
        assert part.volume > 0  # triangles face outwards


def test_few_spheres_share_a_mesh_and_many_are_one() -> None:
    centers = np.random.default_rng(0).uniform(-2, 2, (5000, 3))
    few = Scene([SphereSet(centers[:20], np.full(20, 0.1), name="rubble")])
    many = Scene([SphereSet(centers, np.full(5000, 0.05), name="cloud")])
    document, _ = parts_of(glb_of_page(page_of(sliding(), few)))
    own = [node for node in document["nodes"] if node["name"].startswith("rubble ")]
    assert len(own) == 20
    assert len({node["mesh"] for node in own}) == 1
    content = glb_of_page(page_of(sliding(), many))
    document, binary = parts_of(content)
    (cloud,) = [node for node in document["nodes"] if node["name"] == "cloud spheres"]
    (primitive,) = document["meshes"][cloud["mesh"]]["primitives"]
    assert len(content) < 12e6
    points = numbers(document, binary, primitive["attributes"]["POSITION"])
    np.testing.assert_allclose(points.reshape(5000, -1, 3).mean(axis=1), centers, atol=1e-5)


def test_a_half_space_is_a_square_on_its_boundary(tmp_path: Path) -> None:
    scene = Scene([HalfSpace(point=(0, 0, -0.5), normal=(0, 0, 1), name="floor")])
    (tmp_path / "scene.glb").write_bytes(glb_of_page(page_of(sliding(), scene)))
    read = trimesh.load_scene(tmp_path / "scene.glb")
    T, geometry = read.graph["boundary of floor"]
    part = read.geometry[geometry].copy()
    part.apply_transform(TO_Z @ T)
    np.testing.assert_allclose(part.bounds[:, 2], -0.5, atol=1e-6)
    assert (part.face_normals[:, 2] > 0.99).all()


def test_ghosts_are_seen_through() -> None:
    document, _ = parts_of(glb_of_page(page_of(sliding(), ghost=True)))
    blended = [material for material in document["materials"] if material.get("alphaMode") == "BLEND"]
    assert blended[0]["pbrMetallicRoughness"]["baseColorFactor"][3] < 1


def test_colours_of_meshes_become_materials_or_colours_of_points() -> None:
    page = page_of(sliding())
    ball = trimesh.creation.icosphere(2)
    positions, low, high = quantised(ball.vertices)
    for count, painted in ((2, False), (200, True)):
        colors = np.arange(320)[:, None] % count * [1, 0, 0]
        mesh = {
            "low": low,
            "high": high,
            "positions": positions,
            "indices": packed(ball.faces, "u16"),
            "colors": packed(colors, "u8"),
        }
        page["meshes"] = [mesh]
        page["robots"][0]["visuals"] = [
            {"name": "carriage", "joint": 1, "geometry": {"kind": "mesh", "mesh": 0, "T": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0]}}
        ]
        document, _ = parts_of(glb_of_page(page))
        node = next(node for node in document["nodes"] if node["name"] == "carriage")
        primitives = document["meshes"][node["mesh"]]["primitives"]
        assert len(primitives) == (1 if painted else count)
        assert ("COLOR_0" in primitives[0]["attributes"]) == painted


def test_a_motion_that_stands_has_no_animation() -> None:
    page = page_of(sliding())
    knots = page["views"][0]["actors"][0]["knots"]
    page["views"][0]["actors"][0]["knots"] = knots | {
        "t": packed([0.0], "f64"),
        "q": packed([[0.5, 0.25]]),
        "dq": packed([[0.0, 0.0]]),
    }
    document, _ = parts_of(glb_of_page(page))
    assert "animations" not in document


@pytest.mark.parametrize("made", [unit_box, unit_ball, unit_cylinder, lambda: capsule(0.3, 1.0)])
def test_shapes_are_closed_and_face_outwards(made: Any) -> None:
    solid = made()
    mesh = trimesh.Trimesh(solid.points, solid.faces)
    assert mesh.is_watertight
    assert mesh.volume > 0
    faces = trimesh.Trimesh(solid.points, solid.faces, process=False).face_normals
    assert (faces * solid.normals[solid.faces[:, 0]]).sum(axis=1).min() > 0.9
    np.testing.assert_allclose(np.linalg.norm(solid.normals, axis=1), 1, atol=1e-12)


def test_normals_are_smooth_on_a_ball_and_sharp_on_a_box() -> None:
    for mesh, corners in ((trimesh.creation.icosphere(3), 642), (trimesh.creation.box(), 24)):
        positions, low, high = quantised(mesh.vertices)
        solid = mesh_solid({"low": low, "high": high, "positions": positions, "indices": packed(mesh.faces, "u16")})
        assert len(solid.points) == corners
    assert np.abs(solid.normals).max(axis=1).min() > 0.999


def test_colours_and_rules_of_names_are_those_of_the_page() -> None:
    palette, figures = (
        (REPOSITORY / "web" / "src" / name).read_text(encoding="utf-8") for name in ("palette.ts", "figures.ts")
    )
    tones, scene = (palette.partition(begin)[2].partition(end)[0] for begin, end in (("light: [", "]"), ("SCENE", "dark:")))
    assert tuple(re.findall("#[0-9a-f]{6}", tones)) == gltf_export._TONES
    colors = dict(re.findall('(\\w+): "(#[0-9a-f]{6})"', scene))
    panel, tool, payload = colors["panel"], colors["tool"], colors["payload"]
    assert (colors["base"], colors["obstacle"]) == (gltf_export._BASE, gltf_export._OBSTACLE)
    assert tuple(re.findall("#[0-9a-f]{6}", scene.partition("links:")[2])[:2]) == gltf_export._LINKS
    rules = dict(re.findall("const (PANEL|TOOL|PAYLOAD) = /(.*)/i;", figures))
    expected = [(rules["PANEL"], panel), (rules["TOOL"], tool), (rules["PAYLOAD"], payload)]
    assert [(pattern.pattern, color) for pattern, color in gltf_export._BY_NAME] == expected


def test_a_motion_that_takes_no_time_is_one_key() -> None:
    page = page_of(Trajectory(slider(), Motion([[0.0, 0.0], [0.0, 0.0]])))
    motion = PageMotion(page["views"][0]["actors"][0], page["robots"])
    assert len(gltf_export.keys_of(motion)) == 1
    assert glb_of_page(page)
