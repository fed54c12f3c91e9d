"""Robots and scenes of a report: shapes as they are, hulls of what they stand for, and large scenes in small pages."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import spacearm as sa
from spacearm.geometry import support
from spacearm.report.report_meshes import MOST_VERTICES, Meshes, geometries_of, geometry_of, sphere_points
from spacearm.report.report_page import page_html
from spacearm.report.report_plan import report_of_plans
from spacearm.report.report_scene import obstacles_data, reach_of, reaches, robot_data, targets_data
from spacearm.robot import LinkShape, joint_frames
from support.report_pages import unpacked

Array = np.ndarray

ROBOT = sa.load_robot("srs7")
START, GOAL = np.radians([-25, 63, 0, 41, 0, 0, 0]), np.radians([60, 40, 10, 60, 10, 20, 0])
TURNED = sa.pose([0.3, -0.2, 0.5], [0.7, 0.1, -0.5, 0.4])


def triangles(geometry: dict[str, Any], meshes: Meshes) -> Array:
    """The triangles (m, 3, 3) of a mesh, as the page places them."""
    mesh, T = meshes.items[geometry["mesh"]], np.array(geometry["T"]).reshape(3, 4)
    low, high = np.array(mesh["low"]), np.array(mesh["high"])
    points = low + (high - low) * unpacked(mesh["positions"], -1, 3) / 65535
    return (points @ T[:, :3].T + T[:, 3])[unpacked(mesh["indices"], -1, 3).astype(int)]


def volume(faces: Array) -> float:
    return float(np.einsum("mi,mi->", faces[:, 0], np.cross(faces[:, 1], faces[:, 2]))) / 6


RNG = np.random.default_rng(0)
CLOUD = RNG.normal(size=(40, 3)) * [0.3, 0.2, 0.1]
MESHED = {
    "polytope": sa.Polytope(CLOUD),
    "rounded polytope": sa.Polytope(CLOUD, rounding=0.05),
    "rounded box": sa.Box([0.4, 0.3, 0.2], TURNED, rounding=0.04),
    "rounded cylinder": sa.Cylinder(0.2, 0.5, TURNED, rounding=0.06),
}


@pytest.mark.parametrize("name", MESHED)
def test_what_becomes_triangles_is_the_shape_and_closed(name: str) -> None:
    shape, meshes = MESHED[name], Meshes()
    geometry = geometry_of(shape, meshes, owner=name, line=0.01)
    assert geometry is not None
    assert geometry["kind"] == "mesh"
    faces = triangles(geometry, meshes)
    n = sphere_points(200)
    drawn, true = (faces.reshape(-1, 3) @ n.T).max(axis=0), support(shape, n)
    assert (drawn <= true + 1e-4).all()  # 16 bits round
    assert (drawn >= true - 0.02).all()  # steps of rounded edges
    assert volume(faces) > 0
    edges = {
        tuple(edge)
        for face in unpacked(meshes.items[0]["indices"], -1, 3)
        for edge in zip(face, np.roll(face, -1), strict=True)
    }
    assert {edge[::-1] for edge in edges} == edges  # each edge is there both ways: closed, and seen from outside


def test_shapes_that_the_page_knows_are_told_as_they_are() -> None:
    meshes = Meshes()
    made = [
        geometry_of(shape, meshes, owner="x", line=0.01)
        for shape in (
            sa.Sphere([1, 2, 3], 0.5),
            sa.Capsule([0, 0, 0], [0, 0, 1], 0.1),
            sa.Box([1, 2, 3], TURNED),
            sa.Cylinder(0.5, 2, TURNED),
            sa.Polytope([[0, 0, 0], [0, 0, 1]]),
            sa.Polytope([[1, 1, 1]]),
        )
    ]
    assert [one["kind"] for one in made if one] == ["sphere", "capsule", "box", "cylinder", "capsule", "sphere"]
    assert made[2] == {"kind": "box", "size": [1, 2, 3], "T": TURNED[:3].ravel().tolist()}
    assert made[4] == {"kind": "capsule", "radius": 0.01, "a": [0, 0, 0], "b": [0, 0, 1]}
    assert meshes.items == []
    plane = geometries_of(sa.HalfSpace([0, 0, 2], [0, 0, 0.3]), meshes, owner="floor", line=0.01)
    assert plane == [{"kind": "halfspace", "normal": [0, 0, 1], "offset": 0.3}]


@pytest.mark.parametrize("points", [np.diag([1.0, 2.0, 0.0]), RNG.normal(size=(9, 2)) @ np.eye(2, 3), CLOUD * [1, 1, 1e-14]])
def test_flat_hulls_have_two_sides(points: Array) -> None:
    meshes = Meshes()
    geometry = geometry_of(sa.Polytope(points), meshes, owner="x", line=0.01)
    assert geometry is not None
    faces = triangles(geometry, meshes)
    normals = np.cross(faces[:, 1] - faces[:, 0], faces[:, 2] - faces[:, 0])
    np.testing.assert_allclose(normals.sum(axis=0), 0, atol=1e-4)
    assert np.abs(normals[:, 2]).sum() > 0.01


@pytest.mark.parametrize(("points", "kind"), [(np.ones((3, 3)), "sphere"), (np.eye(3)[[0, 0, 1]], "capsule")])
def test_hulls_without_area_are_drawn_as_lines_and_points(points: Array, kind: str) -> None:
    geometry = geometry_of(sa.Polytope(points), Meshes(), owner="x", line=0.01)
    assert geometry is not None
    assert (geometry["kind"], geometry["radius"]) == (kind, 0.01)


def test_equal_meshes_are_stored_once() -> None:
    meshes = Meshes()
    first, second = (geometry_of(sa.Polytope(CLOUD), meshes, owner="x", line=0.01) for _ in range(2))
    assert first == second
    assert len(meshes.items) == 1


def test_a_hull_of_many_points_is_drawn_by_fewer_and_says_so() -> None:
    meshes = Meshes()
    ball = sa.Polytope(sphere_points(5000))
    geometry = geometry_of(ball, meshes, owner="obstacle 'ball'", line=0.01)
    assert geometry is not None
    assert len(triangles(geometry, meshes)) <= 2 * MOST_VERTICES
    assert volume(triangles(geometry, meshes)) > 0.95 * 4 / 3 * np.pi
    assert "obstacle 'ball' (up to 5,000 vertices)" in meshes.said()[0]


# ---- Robots ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", sa.builtin_robots())
def test_a_robot_is_told_as_the_page_computes_it(name: str) -> None:
    """Its joints' frames from the page's numbers are Python's."""
    robot = sa.load_robot(name)
    data = robot_data(robot, Meshes())
    q = np.random.default_rng(1).uniform(-1, 1, robot.dof)
    frames: list[Array] = []
    for joint in data["joints"]:
        value, turn = joint["multiplier"] * q[joint["dof"]] + joint["offset"], np.eye(4)
        if joint["kind"] == "prismatic":
            turn[2, 3] = value
        else:
            turn[:2, :2] = [[np.cos(value), -np.sin(value)], [np.sin(value), np.cos(value)]]
        own = np.vstack([np.array(joint["T"]).reshape(3, 4), [0, 0, 0, 1]]) @ turn
        frames.append(own if joint["parent"] < 0 else frames[joint["parent"]] @ own)
    np.testing.assert_allclose(frames, joint_frames(robot, q), atol=1e-12)
    tip = data["tip"]
    T = np.vstack([np.array(tip["T"]).reshape(3, 4), [0, 0, 0, 1]])
    T = frames[tip["joint"]] @ T if tip["joint"] >= 0 else T
    np.testing.assert_allclose(T, sa.forward_kinematics(robot, q), atol=1e-12)
    assert np.linalg.norm(T[:3, 3]) <= reach_of(robot) + 1e-9
    assert (reaches(robot) >= 0).all()


def test_links_without_thickness_are_drawn_and_noted() -> None:
    bare, meshes = replace(ROBOT, shapes=(), self_pairs=(), apart=None, unchecked=(), collision="none"), Meshes()
    assert {part["geometry"]["kind"] for part in robot_data(bare, meshes)["shapes"]} == {"capsule"}
    assert "thin rods" in meshes.said()[0]
    lines = tuple(
        LinkShape(name=part.name, joint=part.joint, shape=sa.Polytope([[0, 0, 0], [0, 0, 0.2]])) for part in ROBOT.shapes
    )
    thin = replace(bare, shapes=lines[:1], collision="envelope")
    (part,) = robot_data(thin, Meshes())["shapes"]
    assert part["geometry"]["radius"] > 0


def test_goals_of_every_kind_are_marked() -> None:
    T = sa.forward_kinematics(ROBOT, GOAL)
    trajectory = sa.Trajectory(ROBOT, sa.Motion([START, GOAL]), base="fixed")
    kinds = {
        "position": sa.PositionGoal(T[:3, 3], tolerance=0.02),
        "pose": sa.PoseGoal(T, position_tolerance=0.03),
        "configuration": sa.ConfigurationGoal(GOAL),
    }
    for kind, goal in kinds.items():
        start, target = targets_data(ROBOT, START, goal, np.eye(4), trajectory)
        assert (start["name"], target["name"], target["kind"]) == ("start", "goal", kind)
        np.testing.assert_allclose(np.array(target["T"]).reshape(3, 4)[:, 3], T[:3, 3], atol=1e-12)
        assert target["radius"] == {"position": 0.02, "pose": 0.03, "configuration": 0.0}[kind]
    several = sa.ConfigurationsGoal([START + 0.1, GOAL, *np.tile(START, (8, 1))])
    found = targets_data(ROBOT, START, several, np.eye(4), trajectory)
    assert len(found) == 7
    np.testing.assert_allclose(np.array(found[1]["T"]).reshape(3, 4)[:, 3], T[:3, 3], atol=1e-12)


# ---- Large scenes ----------------------------------------------------------------------------------------------------


def far(count: int) -> Array:
    away = RNG.normal(size=(count, 3))
    return away / np.linalg.norm(away, axis=1)[:, None] * RNG.uniform(1.6, 4, count)[:, None]


LARGE: dict[str, Any] = {
    "spheres": lambda: [sa.Sphere(at, 0.02, name=f"ball {i}") for i, at in enumerate(far(10_000))],
    "set": lambda: [sa.SphereSet(far(30_000), np.full(30_000, 0.01), name="cloud")],
    "hull": lambda: [sa.Polytope(0.3 * sphere_points(100_000) + [3, 0, 0], name="tank")],
    "pieces": lambda: [sa.PolytopeSet([sa.Polytope(at + 0.05 * RNG.normal(size=(60, 3))) for at in far(1000)], name="client")],
}


@pytest.mark.parametrize("name", LARGE)
def test_a_large_scene_is_a_small_page_that_says_what_it_leaves_out(name: str) -> None:
    trajectory = sa.Trajectory(ROBOT, sa.Motion([START, GOAL]), base="fixed")
    problem = sa.Problem(ROBOT, LARGE[name](), start=START, goal=GOAL, base="fixed", clearance=0.0)
    saved = sa.SavedPlan(problem=problem, trajectory=trajectory, status="found", problem_hash="", certificate=None)
    page = report_of_plans(saved)
    assert len(page_html(page)) < 2e6
    assert page["sections"][0]["notes"]
    assert "closest" in page["views"][0]


def test_spheres_that_are_few_stay_obstacles_of_their_own() -> None:
    balls = [sa.Sphere(at, 0.02) for at in far(20)]
    meshes = Meshes()
    assert [one["name"] for one in obstacles_data(sa.Scene(balls), meshes)] == [f"obstacle {i}" for i in range(20)]
    assert meshes.said() == []
