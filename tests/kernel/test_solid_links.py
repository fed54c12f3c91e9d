"""Robots of bodies of every shape among obstacles of every shape: Coal's distances, and nothing near is skipped."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import coal
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kernel import drawn, objectives
from kernel.builds import Build, Surrounded, single_shapes, surround
from spacearm.core.native import available_levels
from spacearm.geometry import Box, Capsule, Cylinder, HalfSpace, Obstacle, Polytope, Scene, Sphere, support
from spacearm.geometry.scene import moved_scene
from spacearm.planner.kernel_model import kernel_model, self_shape_pairs
from spacearm.robot import LinkShape, Robot
from spacearm.robot.link_shapes import as_capsule, bounding_capsule
from support import drawn_shapes
from support.drawn_bodies import drawn_shape_obstacle, with_bodies
from support.kernel_cases import enveloped, looked_at, rounding
from support.oracles import coal_shapes, pinocchio_points

MARGINS = st.sampled_from([0.0, 1e-3, 0.02, 0.3])  # [m]


def any_obstacle(rng: np.random.Generator, i: int) -> Obstacle:
    if rng.random() < 0.1:
        return HalfSpace(rng.normal(size=3), rng.normal(size=3) - [0, 0, 2])
    return drawn_shape_obstacle(rng, i)


@st.composite
def surroundings(draw: st.DrawFn) -> tuple[Robot, list[Obstacle], np.random.Generator]:
    """A robot with shapes of every kind, some links of several, and its obstacles; the bulk comes from a seed."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    robot = enveloped(rng, draw(drawn.robots()), draw(st.sampled_from([1, 3, 7])))
    if draw(st.integers(0, 3)):
        robot = with_bodies(rng, robot, base=draw(st.booleans()))
    links = sorted({part.name for part in robot.shapes})
    pairs = tuple((one, two) for i, one in enumerate(links) for two in links[i + 1 :] if rng.random() < 0.6)
    robot = replace(robot, self_pairs=pairs, collision="envelope" if links else "none")
    count = draw(st.sampled_from([0, 1, 5, 12]))
    return robot, [any_obstacle(rng, i) for i in range(count)], rng


def placed_bodies(robot: Robot, T: np.ndarray) -> list[coal_shapes.Placed]:
    """Coal's shapes of the links where the joints' frames (joints, 4, 4) are."""
    out = []
    for part in robot.shapes:
        made, T_joint_core = coal_shapes.geometry_of(part.shape)
        at = T_joint_core if part.joint < 0 else T[part.joint] @ T_joint_core
        out.append((made, coal.Transform3s(np.ascontiguousarray(at[:3, :3]), np.array(at[:3, 3]))))
    return out


def by_coal(robot: Robot, obstacles: Sequence[Obstacle], q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Distances (rows, shapes, obstacles) and of the robot's pairs (rows, pairs) [m]."""
    solids = [placed for obstacle in obstacles for placed in coal_shapes.placed_obstacle(obstacle)]
    frames = pinocchio_points.joint_frames(robot, q)
    to_scene, between = [], []
    for T in frames:
        links = placed_bodies(robot, T)
        to_scene.append([[coal_shapes.distance(link, solid) for solid in solids] for link in links])
        between.append([coal_shapes.distance(links[i], links[k]) for i, k in coal_shapes.shape_pairs(robot)])
    shape = len(q), len(robot.shapes), len(solids)
    return np.array(to_scene).reshape(shape), np.array(between).reshape(len(q), -1)


def assert_near(found: np.ndarray, expected: np.ndarray, error: float) -> None:
    """Where bodies are apart the distances are the same; where they overlap both are below 0."""
    apart = expected > error
    np.testing.assert_allclose(found[apart], expected[apart], rtol=error, atol=error)
    assert (found[~apart] < 2 * error).all()
    assert (found[expected < -error] < error).all()


@settings(max_examples=12)
@given(st.data())
def test_clearances_of_bodies_are_coals(build: Build, data: st.DataObject) -> None:
    robot, obstacles, _ = data.draw(surroundings())
    q = data.draw(drawn.batches(robot, build, data.draw(st.sampled_from([1, build.lanes + 1]))))[:3]
    model = surround(build, robot, obstacles)
    to_scene, between = by_coal(robot, obstacles, q.astype(np.float64))
    size = 5.0 + float(np.abs(to_scene).max(initial=0.0)) + float(np.abs(between).max(initial=0.0))
    error = size * (1e-6 if build.bits == 64 else 4e-4)
    assert_near(model.native.obstacle_clearances(q), to_scene, error)
    assert_near(model.native.pair_clearances(q, model.pairs), between, error)


@settings(max_examples=25)
@given(st.data(), MARGINS)
def test_what_is_near_is_never_skipped(build: Build, data: st.DataObject, margin: float) -> None:
    """The shortfall is the sum over all pairs; where cores overlap, at least that."""
    robot, obstacles, _ = data.draw(surroundings())
    q = data.draw(drawn.batches(robot, build, data.draw(st.sampled_from([1, build.lanes + 1]))))
    assert_the_sum(build, robot, obstacles, q, margin)


def assert_the_sum(build: Build, robot: Robot, obstacles: Sequence[Obstacle], q: np.ndarray, margin: float) -> np.ndarray:
    model = surround(build, robot, obstacles)
    clear = all_clearances(model, robot, q)
    expected = np.maximum(margin - clear, 0).sum(axis=1)
    found = model.native.shortfalls(q, margin, False)
    size = 10.0 + np.abs(clear).max(initial=0.0)
    # Distances of polytopes are known to a share of themselves, and where axes graze to a share of their length.
    error = ((clear < margin + 1e-3).sum(axis=1) + 1) * (rounding(build, size) + (1e-4 if build.bits == 32 else 1e-9) * size)
    apart = (clear > 0).all(axis=1)
    assert (found >= expected - error).all()
    assert (found <= expected + error)[apart].all()
    early = model.native.shortfalls(q, margin, True)
    for first in range(0, len(q), build.lanes):
        pack = slice(first, first + build.lanes)
        assert (early[pack] > 0).any() == (found[pack] > 0).any()
    return found


def all_clearances(model: Surrounded, robot: Robot, q: np.ndarray) -> np.ndarray:
    moving = np.array([part.joint >= 0 for part in robot.shapes], dtype=bool)
    clear = model.native.obstacle_clearances(q)[:, moving].reshape(len(q), -1)
    return np.hstack([clear, model.native.pair_clearances(q, model.pairs)]).astype(np.float64)


CORNERS = np.array([(x, y, z) for x in (-0.2, 0.2) for y in (-0.2, 0.2) for z in (-0.1, 0.1)])


@pytest.mark.parametrize("kind", ["sphere", "capsule", "box", "cylinder", "polytope", "half space"])
def test_a_plate_meets_what_touches_its_corner(build: Build, kind: str) -> None:
    """A thin plate, whose bounding sphere is large, and an obstacle that reaches a hair into one of its corners."""
    T = np.eye(4)
    T[:3, :3] = coal_shapes.frame_along(np.array([0.3, -0.5, 0.8]))
    T[:3, 3] = [0.1, 0.2, 0.3]
    plate = Box((1.0, 2.0, 0.02), T)
    robot = replace(objectives.paper_robot(), shapes=(LinkShape(name="plate", joint=0, shape=plate),), self_pairs=())
    q = build.array(np.zeros((1, 7)))
    T_base_joint = pinocchio_points.joint_frames(robot, q)[0, 0]
    corner = (T_base_joint @ T @ [0.5, 1.0, 0.01, 1.0])[:3]
    out = (T_base_joint @ T)[:3, :3] @ [1.0, 1.0, 1.0] / np.sqrt(3)
    along = np.eye(4)
    along[:3, :3], depth = coal_shapes.frame_along(out), 1e-3
    along[:3, 3] = corner + (0.1 - depth) * out
    obstacle: Obstacle = {
        "sphere": Sphere(along[:3, 3], 0.1),
        "capsule": Capsule(along[:3, 3], along[:3, 3] + out, 0.1),
        "box": Box((0.2, 0.2, 0.2), along),
        "cylinder": Cylinder(0.2, 0.2, along),
        "polytope": Polytope(along[:3, 3] + CORNERS @ along[:3, :3].T),
        "half space": HalfSpace(-out, corner - depth * out),
    }[kind]
    for margin in (0.0, 0.01):
        found = surround(build, robot, [obstacle]).native.shortfalls(q, margin, False)
        assert found[0] == pytest.approx(margin + depth, rel=0.05)
    gone = surround(build, robot, [moved(obstacle, 2e-3 * out)]).native.shortfalls(q, 0.0, False)
    assert gone[0] == 0


def moved(obstacle: Obstacle, by: np.ndarray) -> Obstacle:
    T = np.eye(4)
    T[:3, 3] = by
    return moved_scene(Scene([obstacle]), T).obstacles[0]


def test_a_crowd_around_an_arm_of_solids_is_no_different(build: Build) -> None:
    rng = np.random.default_rng(8)
    robot = with_bodies(rng, enveloped(rng, objectives.paper_robot(), 4), base=True)
    links = sorted({part.name for part in robot.shapes})
    robot = replace(robot, self_pairs=tuple(zip(links, links[2:], strict=False)))
    obstacles = [moved(any_obstacle(rng, i), rng.uniform(-1.5, 1.5, 3)) for i in range(150)]
    q = build.array(rng.uniform(robot.lower, robot.upper, (3 * build.lanes, 7)))
    found = assert_the_sum(build, robot, obstacles, q, 0.01)
    assert (found > 0).any()


def test_a_motion_of_solids_is_free_where_every_instant_is(build: Build) -> None:
    """At all 8 packs of instants, each with a clearance of the margin, as Coal measures them."""
    rng = np.random.default_rng(3)
    robot, (start, goal) = objectives.thick_arm(), objectives.AROUND
    robot = with_bodies(rng, robot, base=False)
    obstacles = [*objectives.CLUTTER, Polytope(rng.normal(size=(9, 3)) * 0.1 + [0.9, 0.9, 0.9], rounding=0.05)]
    K, margin = 2, 0.01
    search = objectives.motion_search(build, robot, obstacles, start, goal, margin=margin)
    near = np.linspace(start, goal, K + 2)[1:-1].ravel()
    rows = build.array(near + rng.choice([0.0, 0.1, 0.3, 0.6], (120, 1)) * rng.normal(size=(120, len(near))))
    free = np.array(search.judge(rows, K, 0).free)
    q = looked_at(build, rows, K, start, goal)
    alone = replace(robot, self_pairs=())
    least = [
        coal_shapes.least_distances(alone, Scene(obstacles), pinocchio_points.joint_frames(robot, each)).min() for each in q
    ]
    least = np.array(least) - margin
    assert least[free].min(initial=1.0) > -2e-4
    assert least[~free].max(initial=-1.0) < 2e-4
    assert 0 < free.sum() < len(free)


# ---- as the planner translates them ---------------------------------------------------------------------------------


@settings(max_examples=20)
@given(st.data())
def test_the_planner_translates_every_shape(data: st.DataObject) -> None:
    robot, obstacles, rng = data.draw(surroundings())
    q = rng.uniform(-2, 2, (2, robot.dof))
    made = kernel_model(robot, Scene(obstacles))
    to_scene, between = by_coal(robot, obstacles, q)
    size = 5.0 + float(np.abs(to_scene).max(initial=0.0)) + float(np.abs(between).max(initial=0.0))
    assert_near(made.model64.obstacle_clearances(q), to_scene, 1e-6 * size)
    pairs = self_shape_pairs(robot)
    assert pairs.tolist() == [list(pair) for pair in coal_shapes.shape_pairs(robot)]
    assert_near(made.model64.pair_clearances(q, pairs), between, 1e-6 * size)
    assert len(made.obstacle_of) == len(single_shapes(obstacles))
    assert made.bodies == tuple(part.name for part in robot.shapes)


@settings(max_examples=50)
@given(drawn_shapes.convex_shapes(), st.integers(0, 99))
def test_a_bounding_capsule_holds_its_shape(shape: Any, seed: int) -> None:
    part = LinkShape(name="link", joint=-1, shape=shape)
    capsule = as_capsule(part) or bounding_capsule(part)
    n = np.random.default_rng(seed).normal(size=(50, 3))
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    reach = np.maximum(n @ capsule.a, n @ capsule.b) + capsule.radius
    assert (support(shape, n) <= reach + 1e-9).all()


@pytest.mark.parametrize("bits", [32, 64])
def test_bodies_are_the_same_bits_on_every_level(bits: int) -> None:
    rng = np.random.default_rng(8)
    robot = with_bodies(rng, enveloped(rng, objectives.paper_robot(), 4), base=True)
    links = sorted({part.name for part in robot.shapes})
    robot = replace(robot, self_pairs=tuple(zip(links, links[2:], strict=False)))
    obstacles = [any_obstacle(rng, i) for i in range(20)]
    q = rng.uniform(robot.lower, robot.upper, (60, 7))
    found = []
    for level in available_levels():
        build = Build(level, bits)
        model, rows = surround(build, robot, obstacles), build.array(q)
        found.append([model.native.obstacle_clearances(rows), model.native.pair_clearances(rows, model.pairs)])
        found[-1] += [model.native.shortfalls(rows, 0.02, early) for early in (False, True)]
    for other in found[1:]:
        for one, two in zip(found[0], other, strict=True):
            np.testing.assert_array_equal(one, two)
