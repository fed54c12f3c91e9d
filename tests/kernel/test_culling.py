"""What is far apart is skipped, and nothing else: the shortfall of clearance is the sum over all pairs, one by one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kernel import accuracy, drawn, objectives
from kernel.builds import Build, Surrounded, surround
from spacearm.geometry import Box, Capsule, Cylinder, HalfSpace, Obstacle, Sphere
from spacearm.robot import LinkCapsule, Robot
from support.kernel_cases import enveloped, rounding
from support.oracles import coal_shapes, pinocchio_points

MARGINS = st.sampled_from([0.0, 1e-4, 0.02, 0.5])  # [m]


def any_shape(rng: np.random.Generator, center: np.ndarray, size: float) -> Obstacle:
    """A shape about a place, turned at random, often by right angles."""
    T = np.eye(4)
    T[:3, 3] = center
    if rng.random() < 0.7:
        T[:3, :3] = coal_shapes.frame_along(rng.normal(size=3))
    sizes = size * rng.uniform(0.05, 1, 3)
    kind = rng.integers(12)
    if kind == 0 and size < 1:  # a wall that is far away but for its corner of the world
        return HalfSpace(T[:3, 2], center - 3 * T[:3, 2])
    if kind < 4:
        return Box(sizes, T)
    if kind < 7:
        return Cylinder(sizes[0], sizes[1], T)
    if kind < 9:
        return Capsule(center, center + sizes[0] * T[:3, 2] * (kind - 7), sizes[1])
    return Sphere(center, sizes[0])


def touching(rng: np.random.Generator, robot: Robot, frames: np.ndarray, depth: float) -> list[Obstacle]:
    """Small shapes that reach into the capsules by so much, at their ends and sides: what encloses a link must reach there."""
    out: list[Obstacle] = []
    for link in robot.capsules:
        T = np.eye(4) if link.joint < 0 else frames[link.joint]
        way = rng.normal(size=3)
        axis = link.b - link.a
        if axis.any() and rng.random() < 0.5:
            way = axis / np.linalg.norm(axis)
        way = way / np.linalg.norm(way)
        size = rng.choice([0.001, 0.01])
        surface = (link.b if way @ axis >= 0 else link.a) + (link.radius - depth) * way
        center = T[:3, :3] @ (surface + size * way) + T[:3, 3]
        turned = np.eye(4)
        turned[:3, :3] = coal_shapes.frame_along(T[:3, :3] @ way)
        turned[:3, 3] = center
        out.append(
            [
                Sphere(center, size),
                Box(np.full(3, 2 * size), turned),
                Cylinder(size, 2 * size, turned),
                Capsule(center, center, size),
            ][rng.integers(4)]
        )
    return out


def one_by_one(model: Surrounded, robot: Robot, q: np.ndarray, margin: float) -> tuple[np.ndarray, np.ndarray]:
    """The shortfalls (rows,) [m] summed over all pairs, and how many pairs are about so near.

    Capsules on the base and obstacles never move, so they are left out.
    """
    moving = np.array([c.joint >= 0 for c in robot.capsules], dtype=bool)
    clear = model.native.obstacle_clearances(q)[:, moving].reshape(len(q), -1).astype(np.float64)
    clear = np.hstack([clear, model.native.pair_clearances(q, model.pairs)])
    return np.maximum(margin - clear, 0.0).sum(axis=1), (clear < margin + 1e-3).sum(axis=1)


def assert_nothing_is_missed(
    build: Build, robot: Robot, obstacles: Sequence[Obstacle], q: np.ndarray, margin: float
) -> np.ndarray:
    model = surround(build, robot, obstacles)
    expected, near = one_by_one(model, robot, q, margin)
    found = model.native.shortfalls(q, margin, False)
    assert found.shape == (len(q),)
    far = max((float(np.linalg.norm(drawn.landmarks(o)[0]) + drawn.landmarks(o)[2].max()) for o in obstacles), default=0.0)
    one = rounding(build, margin, accuracy.reach(robot, q), far)
    eps = float(np.finfo(build.scalar).eps)
    assert (np.abs(found - expected) <= (near + 1) * (one + eps * expected)).all(), (found, expected)
    assert (found >= 0).all()
    # A pack stops as soon as one of its lanes falls short.
    early = model.native.shortfalls(q, margin, True)
    assert (early <= found).all()
    for first in range(0, len(q), build.lanes):
        pack = slice(first, first + build.lanes)
        assert (early[pack] > 0).any() == (found[pack] > 0).any()
    alone = np.array([model.native.shortfalls(row[None], margin, True)[0] for row in q])
    np.testing.assert_array_equal(alone > 0, found > 0)
    # The trees ask which lanes keep the margin: those that are known not to are asked about nothing more.
    np.testing.assert_array_equal(model.native.free(q, margin), found == 0)
    return found


@settings(max_examples=15)
@given(st.data(), st.integers(0, 2**32 - 1), MARGINS)
def test_shortfalls_are_the_sum_over_all_pairs(build: Build, data: st.DataObject, seed: int, margin: float) -> None:
    """A draw's bulk comes from its seed; the robot's joints and the batch shrink."""
    rng = np.random.default_rng(seed)
    robot = enveloped(rng, data.draw(drawn.robots()), data.draw(st.sampled_from([1, 4, 12])))
    q = data.draw(drawn.batches(robot, build, data.draw(st.sampled_from([1, build.lanes + 1]))))
    frames = pinocchio_points.joint_frames(robot, q)[-1]
    obstacles = touching(rng, robot, frames, 1e-3) if data.draw(st.booleans()) else []
    count = data.draw(st.sampled_from([0, 1, 6, 7, 40]))
    obstacles += [any_shape(rng, rng.uniform(-3, 3, 3), rng.choice([0.02, 0.3, 2.0])) for _ in range(count)]
    obstacles = [obstacles[i] for i in rng.permutation(len(obstacles))]
    assert_nothing_is_missed(build, robot, obstacles, q, margin)


def crowd(count: int, shapes: str) -> tuple[Robot, list[Obstacle]]:
    """The paper's arm with a few dozen capsules, in so many obstacles."""
    rng = np.random.default_rng(count)
    robot = enveloped(rng, objectives.paper_robot(), 6)
    obstacles: list[Obstacle] = []
    for _ in range(count):
        center = rng.uniform(-1, 1, 3) * (1.6 if count < 500 else 3.0)
        size = rng.choice([0.01, 0.05, 0.2])
        obstacles.append(Sphere(center, size / 2) if shapes == "spheres" else any_shape(rng, center, size))
    return robot, obstacles


@pytest.mark.parametrize(
    ("count", "shapes"), [(0, "all"), (1, "all"), (5, "all"), (60, "all"), (300, "all"), (3000, "spheres")]
)
def test_a_crowd_of_obstacles_is_no_different(build: Build, count: int, shapes: str) -> None:
    robot, obstacles = crowd(count, shapes)
    q = build.array(np.random.default_rng(1).uniform(robot.lower, robot.upper, (build.lanes, 7)))
    found = assert_nothing_is_missed(build, robot, obstacles, q, 0.01)
    if count >= 300:
        assert (found > 0).any()


def test_a_cylinder_that_hardly_leans_is_met_at_its_rim(build: Build) -> None:
    """The box around it must hold the rim, which in float is easily lost: 1 - cos^2 is 0 there."""
    robot = objectives.paper_robot()
    for lean in (1e-5, 1e-4, 2e-4, 5e-4, 1e-3):
        T = np.eye(4)
        T[0, 0] = T[2, 2] = np.cos(lean)
        T[0, 2], T[2, 0] = np.sin(lean), -np.sin(lean)
        rim = Cylinder(20.0, 0.1, T)
        # The rim's highest point is sin(lean) * 20 above the middle of the lid: a ball beside it, on the first joint's axis.
        at = T[:3, :3] @ [-20.0 + 1e-6, 0, 0.05]
        ball = LinkCapsule(name="ball", joint=0, a=np.zeros(3), b=np.zeros(3), radius=0.05)
        T_parent_joint = robot.joints[0].T_parent_joint.copy()
        T_parent_joint[:3, 3] = at + np.array([0, 0, 0.05 - 0.5 * 20 * lean])
        joints = (replace(robot.joints[0], T_parent_joint=T_parent_joint), *robot.joints[1:])
        bare = replace(robot, joints=joints, capsules=(ball,))
        found = assert_nothing_is_missed(build, bare, [rim], build.array(np.zeros((1, 7))), 0.0)
        assert found[0] > 0


def outermost(obstacle: Obstacle, way: np.ndarray) -> np.ndarray:
    """The point (3,) of a finite shape that goes furthest in a direction."""
    if isinstance(obstacle, Sphere):
        return obstacle.center + obstacle.radius * way
    if isinstance(obstacle, Capsule):
        return max((obstacle.a, obstacle.b), key=lambda end: float(end @ way)) + obstacle.radius * way
    assert isinstance(obstacle, (Box, Cylinder))
    center, R, half = drawn.landmarks(obstacle)
    local = R.T @ way
    if isinstance(obstacle, Box):
        return center + R @ (half * np.sign(local))
    across = np.array([local[0], local[1], 0.0])
    across /= max(float(np.linalg.norm(across)), 1e-12)
    return center + R @ (obstacle.radius * across + [0, 0, half[2] * np.sign(local[2])])


def moved(obstacle: Obstacle, by: np.ndarray) -> Obstacle:
    if isinstance(obstacle, Sphere):
        return replace(obstacle, center=obstacle.center + by)
    if isinstance(obstacle, Capsule):
        return replace(obstacle, a=obstacle.a + by, b=obstacle.b + by)
    assert isinstance(obstacle, (Box, Cylinder))
    T = obstacle.pose.copy()
    T[:3, 3] += by
    return replace(obstacle, pose=T)


@pytest.mark.parametrize("together", [1, 6, 90])
def test_an_obstacle_is_met_at_its_outermost_points(build: Build, together: int) -> None:
    """A small ball touches shapes where they touch the boxes around them, along x, y and z, so many at a time."""
    rng = np.random.default_rng(together)
    link = LinkCapsule(name="ball", joint=0, a=np.zeros(3), b=np.zeros(3), radius=0.01)
    robot = replace(objectives.paper_robot(), capsules=(link,))
    q = build.array(np.zeros((1, 7)))
    at = pinocchio_points.joint_frames(robot, q)[0, 0, :3, 3]
    obstacles = []
    for shape in (any_shape(rng, np.zeros(3), rng.choice([0.3, 1.0])) for _ in range(30)):
        if not isinstance(shape, HalfSpace):
            for way in np.vstack([np.eye(3), -np.eye(3)]):
                obstacles.append(moved(shape, at - (link.radius - 1e-3) * way - outermost(shape, way)))
    for first in range(0, len(obstacles), together):
        few = obstacles[first : first + together]
        found = assert_nothing_is_missed(build, robot, few, q, 0.0)
        assert found[0] == pytest.approx(1e-3 * len(few), rel=0.05)


def test_a_link_is_met_wherever_it_ends(build: Build) -> None:
    """Needles that touch each of a link's many capsules just so, one at a time."""
    rng = np.random.default_rng(5)
    robot = enveloped(rng, objectives.paper_robot(), 8)
    robot = replace(robot, self_pairs=())
    q = build.array(rng.uniform(robot.lower, robot.upper, (1, 7)))
    frames = pinocchio_points.joint_frames(robot, q)[0]
    for i, needle in enumerate(touching(rng, robot, frames, 2e-5)):
        moves = robot.capsules[i].joint >= 0
        found = assert_nothing_is_missed(build, robot, [needle], q, 0.0)
        assert (found[0] > 0) >= moves
