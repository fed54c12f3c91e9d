"""How far bodies get on an interval: each part of the bounds is needed, and none is larger than it has to be.

Every case has an arm whose true displacement is known. A bound that lost the part, or half of it, would be below.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spacearm.motion import Curve, PiecewisePath
from spacearm.proof.bodies import bodies_of
from spacearm.proof.path_intervals import Intervals, PathIntervals
from spacearm.robot import Joint, LinkCapsule, Robot
from support.bounded_paths import bounded, curves, line, parabola
from support.dense_samples import arms, moving_frames, planar


def relative_ends(robot: Robot, q: np.ndarray) -> np.ndarray:
    """Where the ends of every relative body's axis are in the frame of the other body, (rows, bodies, ends, 3)."""
    bodies, relative_bodies = bodies_of(robot)
    frames = np.concatenate([moving_frames(robot, q), np.tile(np.eye(4), (len(q), 1, 1, 1))], axis=1)
    seen_from = {int(motion): -1 for motion in relative_bodies.motion[relative_bodies.scene_relative]}
    for relative, body in zip(relative_bodies.self_relative, relative_bodies.self_body, strict=True):
        seen_from[int(relative_bodies.motion[relative])] = int(bodies.joint[body])
    out = np.empty((len(q), len(relative_bodies.body), bodies.groups[0].points.shape[1], 3))
    for i, (body, motion) in enumerate(zip(relative_bodies.body, relative_bodies.motion, strict=True)):
        T = np.linalg.inv(frames[:, seen_from[int(motion)]]) @ frames[:, bodies.joint[body]]
        out[:, i] = bodies.groups[0].points[body] @ np.swapaxes(T[:, :3, :3], 1, 2) + T[:, None, :3, 3]
    return out


def directions(robot: Robot, q: np.ndarray, n: np.ndarray) -> np.ndarray:
    """A direction of the base frame (3,) at q (1, n) in the frame of each relative body's other body, (m, 3)."""
    bodies, relative_bodies = bodies_of(robot)
    frames = np.concatenate([moving_frames(robot, q), np.tile(np.eye(4), (1, 1, 1, 1))], axis=1)[0]
    out = np.tile(n, (len(relative_bodies.body), 1))
    for relative, body in zip(relative_bodies.self_relative, relative_bodies.self_body, strict=True):
        same = relative_bodies.motion == relative_bodies.motion[relative]
        out[same] = n @ frames[bodies.joint[body], :3, :3]
    return out


@settings(max_examples=30)
@given(st.data())
def test_no_end_gets_further_than_its_two_bounds_allow(data: st.DataObject) -> None:
    robot = data.draw(arms(self_pairs=True))
    curve = data.draw(curves(robot))
    path = PathIntervals(curve)
    intervals = path.first()
    for _ in range(data.draw(st.integers(0, 6))):
        half = path.halved(intervals.select(np.array([data.draw(st.integers(0, len(intervals) - 1))])))
        intervals = half.select(np.array([data.draw(st.integers(0, 1))]))
    intervals = intervals.select(np.array([data.draw(st.integers(0, len(intervals) - 1))]))
    midpoints, _ = bounded(robot, curve, intervals)
    n = np.array(data.draw(st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda v: np.linalg.norm(v) > 0.1)))
    n /= np.linalg.norm(n)
    u = np.concatenate([intervals.ends[0], np.random.default_rng(0).uniform(*intervals.ends[0], 30)])
    q = curve.sample(np.concatenate([midpoints.u, u]))
    ends = relative_ends(robot, q)
    moved = ends[1:] - ends[:1]
    assert (np.linalg.norm(moved, axis=-1) <= midpoints.groups[0].displacement_bound[0] + 1e-9).all()
    along = np.abs(np.einsum("umec,mc->ume", moved, directions(robot, q[:1], n)))
    speed = np.abs(midpoints.groups[0].velocity[0] @ n) * midpoints.half[0]
    assert (along <= speed + midpoints.groups[0].second_order_bound[0] + 1e-9).all()


# ---- closed forms: the bound is at most this much above the truth ----------------------------------------------------


def displacement_of(robot: Robot, curve: Curve, relative: int) -> tuple[float, float]:
    """The displacement bound of the furthest end, and the true displacement at the interval's ends."""
    midpoints, intervals = bounded(robot, curve, first_part(curve))
    ends = relative_ends(robot, curve.sample(np.concatenate([midpoints.u, intervals.ends[0]])))
    moved = np.linalg.norm(ends[1:] - ends[:1], axis=-1).max(axis=0)[relative]
    end = int(np.argmax(midpoints.groups[0].displacement_bound[0, relative]))
    return float(midpoints.groups[0].displacement_bound[0, relative, end]), float(moved[end])


def second_order_of(robot: Robot, curve: Curve, relative: int, n: tuple[float, float, float]) -> tuple[float, float]:
    """The bound of what an end loses along a direction beyond its speed, and the true loss at the interval's ends."""
    midpoints, intervals = bounded(robot, curve, first_part(curve))
    q = curve.sample(np.concatenate([midpoints.u, intervals.ends[0]]))
    direction = np.asarray(n) / np.linalg.norm(n)
    ends = relative_ends(robot, q)
    along = np.abs(np.einsum("umec,mc->ume", ends[1:] - ends[:1], directions(robot, q[:1], direction)))
    beyond = (along - np.abs(midpoints.groups[0].velocity[0] @ direction) * midpoints.half[0])[:, relative].max(axis=0)
    end = int(np.argmax(midpoints.groups[0].second_order_bound[0, relative]))
    return float(midpoints.groups[0].second_order_bound[0, relative, end]), float(beyond[end])


def first_part(curve: Curve) -> Intervals | None:
    """The first interval of a parabola; None, for all of a path of lines."""
    return (
        None if isinstance(curve, PiecewisePath) and curve.degree == 1 else PathIntervals(curve).first().select(np.array([0]))
    )


def slide(**changes: Any) -> Robot:
    """A carriage along z that a joint turned about z carries 1 m out, with a rod of 1 m across."""
    out = np.eye(4)
    out[0, 3] = 1.0
    joints = (
        Joint(name="turn", kind="revolute", parent=-1, T_parent_joint=np.eye(4)),
        Joint(name="slide", kind="prismatic", parent=0, T_parent_joint=out, **changes),
    )
    rod = LinkCapsule(name="rod", joint=1, a=np.zeros(3), b=np.array([1.0, 0, 0]), radius=0.01)
    post = LinkCapsule(name="post", joint=-1, a=np.array([0, 0, -2.0]), b=np.array([0, 0, -1.0]), radius=0.01)
    dofs = 1 if changes.get("dof") == 0 else 2
    limits = dict.fromkeys(("upper", "velocity", "acceleration"), (1.0,) * dofs) | {"lower": (-1.0,) * dofs}
    return planar(joints=joints, capsules=(rod, post), self_pairs=(("post", "rod"),), **limits)


# The capsules of `planar` are relative bodies 1 (upper, of family 0) and 3 (fore).
DISPLACEMENTS: dict[str, tuple[Robot, Curve, int, float]] = {
    "a turn moves by the distance from its axis": (planar(), line((-0.01, 0), (0.01, 0)), 1, 0.01),
    "distances add up along the arm": (planar(), line((-0.01, 0), (0.01, 0)), 3, 0.02),
    "both joints": (planar(), line((-0.01, -0.01), (0.01, 0.01)), 3, 0.03),
    "a prismatic joint moves by its displacement": (slide(), line((0, -0.3), (0, 0.3)), 1, 0.3),
    "a turn carries the slide": (slide(), line((-0.01, 0.5), (0.01, 0.5)), 1, 0.02),
    "a mimic joint counts by its multiplier": (slide(dof=0, multiplier=3.0, offset=0.2), line((-0.001,), (0.001,)), 1, 0.005),
    "a parabola with no speed at the middle": (planar(), parabola(0.01), 3, 0.02),
    "a parabola that a mimic joint follows": (slide(dof=0, multiplier=3.0), parabola(0.01, joints=1), 1, 0.05),
    "a corner at the middle": (planar(), line((-0.005, 0), (0.005, 0), (-0.005, 0)), 3, 0.02),
}


@pytest.mark.parametrize("case", DISPLACEMENTS)
def test_the_displacement_bound_is_no_more_than_it_has_to_be(case: str) -> None:
    """At most so much above the truth that half of it would be below."""
    robot, curve, relative, expected = DISPLACEMENTS[case]
    bound, true = displacement_of(robot, curve, relative)
    assert 0.55 * bound < true <= bound
    assert bound == pytest.approx(expected, rel=1e-3)


def reach_out() -> Robot:
    """A joint that turns about z, and a slide along x that it carries: a point on it moves by both at once."""
    along_x = np.eye(4)
    along_x[:3, :3] = [[0, 0, 1], [0, 1, 0], [-1, 0, 0]]
    joints = (
        Joint(name="turn", kind="revolute", parent=-1, T_parent_joint=np.eye(4)),
        Joint(name="slide", kind="prismatic", parent=0, T_parent_joint=along_x),
    )
    tip = LinkCapsule(name="tip", joint=1, a=np.zeros(3), b=np.zeros(3), radius=0.01)
    return planar(joints=joints, capsules=(tip,))


SECOND_ORDERS: dict[str, tuple[Robot, Curve, int, tuple[float, float, float]]] = {
    "a turn falls towards its axis": (planar(), line((-0.1, 0), (0.1, 0)), 1, (1, 0, 0)),
    "so does what it carries": (planar(), line((-0.1, 0), (0.1, 0)), 3, (1, 0, 0)),
    "one turn on another adds up": (planar(), line((-0.1, -0.1), (0.1, 0.1)), 3, (1, 0, 0)),
    "a slide that is turned": (reach_out(), line((-0.1, -0.1), (0.1, 0.1)), 1, (0, 1, 0)),
    "a parabola with no speed at the middle": (planar(), parabola(0.01), 3, (0, 1, 0)),
    "a corner at the middle": (planar(), line((-0.005, 0), (0.005, 0), (-0.005, 0)), 3, (0, 1, 0)),
}


@pytest.mark.parametrize("case", SECOND_ORDERS)
def test_the_second_order_bound_is_needed(case: str) -> None:
    """At most so much above the truth that half of it would be below."""
    robot, curve, relative, n = SECOND_ORDERS[case]
    bound, true = second_order_of(robot, curve, relative, n)
    assert true <= bound
    assert true > 0.55 * bound


def test_only_the_joints_between_move_one_link_from_another() -> None:
    robot = slide()
    bodies, relative_bodies = bodies_of(robot)
    assert (
        relative_bodies.sign[relative_bodies.motion[relative_bodies.self_relative[0]]] == [1, 1]
    ).all()  # the post is on the base
    three = planar(
        joints=(*planar().joints, Joint(name="wrist", kind="revolute", parent=1, T_parent_joint=np.eye(4))),
        capsules=tuple(
            LinkCapsule(name=name, joint=joint, a=np.zeros(3), b=np.array([0.5, 0, 0]), radius=0.05)
            for joint, name in enumerate(("upper", "fore", "hand"))
        ),
        self_pairs=(("upper", "hand"),),
        **dict.fromkeys(("upper", "velocity", "acceleration"), (1.0, 1.0, 1.0)),
        lower=(-1.0, -1.0, -1.0),
    )
    bodies, relative_bodies = bodies_of(three)
    relative = relative_bodies.self_relative[0]
    assert (relative_bodies.sign[relative_bodies.motion[relative]] == [0, 1, 1]).all()
    midpoints, _ = bounded(three, line((-0.5, 0, 0), (0.5, 0, 0)))
    assert midpoints.groups[0].displacement_bound[0, relative].max() < 1e-12
    assert bodies.joint[relative_bodies.self_body[0]] == 0


def test_two_arms_move_relative_to_each_other_through_their_common_root() -> None:
    """The frame of the other body moves, too: its joint counts with the other sign."""
    side = np.eye(4)
    side[1, 3] = 1.0
    joints = (
        Joint(name="left", kind="revolute", parent=-1, T_parent_joint=np.eye(4)),
        Joint(name="right", kind="revolute", parent=-1, T_parent_joint=side),
    )
    robot = planar(joints=joints, self_pairs=(("upper", "fore"),))
    relative_bodies = bodies_of(robot)[1]
    assert sorted(relative_bodies.sign[relative_bodies.motion[relative_bodies.self_relative[0]]]) == [-1, 1]
    turning_together = line((-0.2, -0.2), (0.2, 0.2))
    midpoints, intervals = bounded(robot, turning_together)
    ends = relative_ends(robot, turning_together.sample(np.concatenate([midpoints.u, intervals.ends[0]])))
    relative = relative_bodies.self_relative[0] + 1
    assert (
        np.linalg.norm(ends[1:, relative] - ends[:1, relative], axis=-1) <= midpoints.groups[0].displacement_bound[0, relative]
    ).all()


def test_links_are_inside_of_their_balls() -> None:
    robot = planar(
        capsules=(
            LinkCapsule(name="a", joint=0, a=np.zeros(3), b=np.array([1.0, 0, 0]), radius=0.05),
            LinkCapsule(name="a", joint=0, a=np.array([0.5, 0.5, 0]), b=np.array([0.5, 0.5, 0.3]), radius=0.2),
            LinkCapsule(name="b", joint=1, a=np.ones(3), b=np.ones(3), radius=0.0),
        )
    )
    bodies, _ = bodies_of(robot)
    assert bodies.shapes == 3
    for ball, inside in ((3, (0, 1)), (4, (2,))):
        assert tuple(bodies.members[bodies.first[ball] :][: bodies.count[ball]]) == inside
        for i in inside:
            far = np.linalg.norm(bodies.groups[0].points[i] - bodies.groups[0].points[ball], axis=1) + bodies.radius[i]
            assert (far <= bodies.radius[ball]).all()
