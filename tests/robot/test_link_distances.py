"""The distances of links of any shapes are those that Coal finds, and what is said of a whole range holds in all of it."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from spacearm.geometry import Box, Capsule, Cylinder, Polytope, Sphere, moved_shape
from spacearm.robot import Frame, Joint, LinkShape, Robot
from spacearm.robot.kinematics import base_and_joint_frames
from spacearm.robot.link_distances import body_of, distances, least_distance, placed
from spacearm.robot.whole_range import always_overlap, finite_range, joints_between, never_meet
from support import strategies
from support.drawn_shapes import convex_shapes
from support.oracles.coal_shapes import distance, placed_shape

CLOSE = 1e-6  # [m] between Coal and us where shapes are apart
DEEP = 2e-3  # [m] the same where they overlap: Coal's depth is not exact there


@st.composite
def robots_of_shapes(draw: st.DrawFn, max_joints: int = 4) -> Robot:
    """A tree of joints with two links, of one to three shapes of any kind each."""
    robot = draw(strategies.robots(max_joints=max_joints))
    shapes = []
    for name in ("one", "two"):
        joint = draw(st.integers(-1, len(robot.joints) - 1))
        for shape in draw(st.lists(convex_shapes(), min_size=1, max_size=3)):
            shapes.append(LinkShape(name=name, joint=joint, shape=shape))
    return replace(robot, shapes=tuple(shapes), self_pairs=(), collision="envelope")


def configurations(robot: Robot, count: int, seed: int = 0) -> np.ndarray:
    """Random configurations (count, n) within the limits, some at their ends."""
    lower, upper = finite_range(robot)
    shares = np.random.default_rng(seed).random((count, robot.dof))
    shares[: count // 4] = np.round(shares[: count // 4])
    return lower + shares * (upper - lower)


def coal_distances(robot: Robot, frames: np.ndarray, one: str = "one", two: str = "two") -> np.ndarray:
    """Signed distances (m,) of two links [m], by Coal."""
    out = []
    for T in frames:
        parts = {
            name: [placed_shape(moved_shape(p.shape, T[p.joint + 1])) for p in robot.shapes if p.name == name]
            for name in (one, two)
        }
        out.append(min(distance(a, b) for a, b in itertools.product(parts[one], parts[two])))
    return np.array(out)


def bodies_of(robot: Robot) -> list:
    return [body_of([part for part in robot.shapes if part.name == name]) for name in ("one", "two")]


@settings(max_examples=40)
@given(robots_of_shapes(), st.floats(-0.2, 2.0))
def test_distances_of_links_are_those_of_coal(robot: Robot, enough: float) -> None:
    frames = base_and_joint_frames(robot, configurations(robot, 12))
    first, second = (placed(body, frames) for body in bodies_of(robot))
    found, expected = distances(first, second), coal_distances(robot, frames)
    known = np.abs(expected) < 1e3  # Coal fails where a flat shape passes through another's middle
    first, second = (placed(body, frames[known]) for body in bodies_of(robot))
    found, expected = found[known], expected[known]
    apart = expected > 0
    assert np.abs(found - expected)[apart].max(initial=0) < CLOSE
    assert (found[~apart] < CLOSE).all()
    assert (found > expected - DEEP - 0.02 * np.abs(expected)).all()
    bounded = distances(first, second, enough=enough)
    assert (bounded[found < enough - 1e-9] == found[found < enough - 1e-9]).all()
    assert (bounded[found >= enough] >= enough - 1e-12).all()
    assert (bounded <= found + 1e-9).all()
    least, share = least_distance(first, second)
    assert least == found.min()
    assert share == (found < 1e-9).mean()


def test_distances_of_many_balls_take_no_more_than_a_part_of_them_at_once() -> None:
    rng = np.random.default_rng(3)
    robot = two_links(
        [Sphere(c, 0.01) for c in rng.normal(size=(300, 3))], [Sphere(c, 0.01) for c in rng.normal(size=(200, 3)) + 5]
    )
    frames = base_and_joint_frames(robot, configurations(robot, 40))
    first, second = (placed(body, frames) for body in bodies_of(robot))
    for i, gap in enumerate(distances(first, second)[:3]):
        exact = np.linalg.norm(first.center[i][:, None] - second.center[i], axis=2).min() - 0.02
        assert gap == exact


@settings(max_examples=40)
@given(robots_of_shapes())
def test_links_of_any_shape_that_are_proven_never_to_meet_are_apart_by_coal(robot: Robot) -> None:
    first, second = bodies_of(robot)
    between = joints_between(robot, first, second)
    proven = never_meet(robot, first, second, between)
    if proven:
        assert coal_distances(robot, base_and_joint_frames(robot, configurations(robot, 60))).min() > 0


@settings(max_examples=40)
@given(robots_of_shapes(max_joints=3), st.floats(1.0, 4.0))
def test_links_of_any_shape_that_are_proven_always_to_overlap_do_so_by_coal(robot: Robot, grown: float) -> None:
    big = Box(np.full(3, grown), (0.2, 0.1, 0.0))
    robot = replace(robot, shapes=(*robot.shapes, LinkShape(name="one", joint=-1, shape=big)))
    first, second = bodies_of(robot)
    between = joints_between(robot, first, second)
    q = configurations(robot, 60)
    seen = -distances(*(placed(body, base_and_joint_frames(robot, q)) for body in (first, second))).max()
    proven = always_overlap(robot, first, second, between, seen=max(float(seen), 0.0))
    if proven is False or proven is None:
        return
    assert 0 < proven <= seen
    again = configurations(robot, 60, seed=1)
    assert (coal_distances(robot, base_and_joint_frames(robot, again)) < -proven + DEEP).all()


def two_links(one: list, two: list, *, lower: float = -3.0, upper: float = 3.0, at: float = 0.0) -> Robot:
    """The link "one" on the base, and "two" on a hinge about z that is at x = `at`."""
    T = np.eye(4)
    T[0, 3] = at
    shapes = [LinkShape(name="one", joint=-1, shape=shape) for shape in one]
    shapes += [LinkShape(name="two", joint=0, shape=shape) for shape in two]
    return Robot(
        name="hinge",
        joints=(Joint(name="a", kind="revolute", parent=-1, T_parent_joint=T),),
        shapes=tuple(shapes),
        frames=(Frame(name="tip", joint=0, T_joint_frame=np.eye(4)),),
        tip="tip",
        lower=np.array([lower]),
        upper=np.array([upper]),
        velocity=np.ones(1),
        acceleration=np.ones(1),
    )


def test_the_proven_depth_is_near_the_least_one() -> None:
    # A cube of 0.2 m turns about its middle inside a rod that is flush with the middle of its side when it is not turned.
    robot = two_links([Cylinder(0.05, 1.0, (0.13, 0, 0))], [Box((0.2, 0.2, 0.2))])
    first, second = bodies_of(robot)
    proven = always_overlap(robot, first, second, [0], seen=0.02)
    assert isinstance(proven, float)
    assert 0.018 - 1e-5 <= proven <= 0.02


def test_a_sliver_of_free_configurations_is_found() -> None:
    # A thin rod turns in a block with a slit, in which it is free at the angle 1, by 0.5 mm to both sides.
    angle = 1.0
    along, up = np.array([np.cos(angle), np.sin(angle), 0.0]), np.array([0, 0, 1.0])
    across = np.cross(up, along)
    side = [x * along + y * across + z * up for x in (0.4, 1.4) for y in (0.001, 3.0) for z in (-0.5, 0.5)]
    other = [corner - 2 * (corner @ across) * across for corner in side]
    rod = Capsule((0.5, 0, 0), (1.0, 0, 0), 0.0005)
    robot = two_links([Polytope(side), Polytope(other)], [rod], lower=0.2, upper=1.8)
    first, second = bodies_of(robot)
    frames = base_and_joint_frames(robot, np.array([[angle], [0.5], [1.5]]))
    assert (distances(placed(first, frames), placed(second, frames)) > 0).tolist() == [True, False, False]
    assert always_overlap(robot, first, second, [0], seen=0.01) is False
    assert never_meet(robot, first, second, [0]) is False
