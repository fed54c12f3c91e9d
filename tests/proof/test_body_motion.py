"""How far bodies get on a stretch of the path: the bounds are true, and none is much larger than it has to be.

In cases with a closed form the true displacement is known. A bound that lost a part of itself, or half of it, would be below.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spacearm.dynamics import Momentum
from spacearm.motion import Curve, Motion, PiecewisePath
from spacearm.proof.convex_bodies import FIRST_JOINT, WORLD
from spacearm.proof.path_intervals import PathIntervals
from spacearm.robot import Joint, LinkCapsule, Robot
from support.bounded_paths import BodyMotion, claim_along, curves, line, parabola, parts, stretches
from support.dense_samples import arms, planar
from support.drawn_links import shaped_arms
from support.drawn_shapes import directions
from support.floating_arms import body, floating_arms, lander, wheel
from support.oracles.servicer import ROWS, servicer

# ---- the bounds are true ---------------------------------------------------------------------------------------------


@settings(max_examples=60)
@given(st.data(), directions())
def test_no_point_of_a_core_gets_further_than_its_two_bounds_allow(data: st.DataObject, n: np.ndarray) -> None:
    robot = data.draw(arms(self_pairs=True) | shaped_arms())
    curve = data.draw(curves(robot))
    stretch = data.draw(stretches(PathIntervals(curve)))
    BodyMotion(claim_along(robot, curve), stretch).require_bounded(n / np.linalg.norm(n))


PUSHES = [None, Momentum(linear=(0.5, -1, 0.2)), Momentum(linear=(0, 0, 0.3), angular=(0.2, -0.5, 0.3))]


@settings(max_examples=40)
@given(st.data(), directions(), st.sampled_from(PUSHES), st.sampled_from([0.1, 5.0]))
def test_nor_does_one_of_a_drifting_robot(data: st.DataObject, n: np.ndarray, pushed: Momentum | None, duration: float) -> None:
    robot = data.draw(floating_arms())
    curve = data.draw(curves(robot))
    stretch = data.draw(stretches(PathIntervals(curve), 11))
    claim = claim_along(robot, curve, duration=duration, momentum=pushed)
    BodyMotion(claim, stretch).require_bounded(n / np.linalg.norm(n))


# ---- closed forms: a bound is at most this much above the truth ------------------------------------------------------


def on_first_part(robot: Robot, curve: Curve) -> BodyMotion:
    """The bodies on all of a path of lines, or on the first sixteenth of a parabola."""
    claim = claim_along(robot, curve)
    lines = isinstance(curve, PiecewisePath) and curve.degree == 1
    return BodyMotion(claim, claim.path.whole() if lines else parts(claim.path).select(np.array([0])))


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


# The shapes of `planar` are 0, the upper arm, and 1, the forearm; that of `slide` is the rod.
DISPLACEMENTS: dict[str, tuple[Robot, Curve, int, float]] = {
    "a turn moves by the distance from its axis": (planar(), line((-0.01, 0), (0.01, 0)), 0, 0.01),
    "distances add up along the arm": (planar(), line((-0.01, 0), (0.01, 0)), 1, 0.02),
    "both joints": (planar(), line((-0.01, -0.01), (0.01, 0.01)), 1, 0.03),
    "a prismatic joint moves by its displacement": (slide(), line((0, -0.3), (0, 0.3)), 0, 0.3),
    "a turn carries the slide": (slide(), line((-0.01, 0.5), (0.01, 0.5)), 0, 0.02),
    "a mimic joint counts by its multiplier": (slide(dof=0, multiplier=3.0, offset=0.2), line((-0.001,), (0.001,)), 0, 0.005),
    "a parabola with no speed at the middle": (planar(), parabola(0.01), 1, 0.02),
    "a parabola that a mimic joint follows": (slide(dof=0, multiplier=3.0), parabola(0.01, joints=1), 0, 0.05),
    "a corner at the middle": (planar(), line((-0.005, 0), (0.005, 0), (-0.005, 0)), 1, 0.02),
}


@pytest.mark.parametrize("case", DISPLACEMENTS)
def test_the_displacement_bound_is_no_more_than_it_has_to_be(case: str) -> None:
    """At most so much above the truth that half of it would be below."""
    robot, curve, shape, expected = DISPLACEMENTS[case]
    moving = on_first_part(robot, curve)
    link, ends = moving.shape(shape), np.array([[0.0, 0, 0], [1.0, 0, 0]])
    bound = moving.bounds(link, WORLD, ends).first
    true = np.linalg.norm(moving.moved(moving.stretch.ends[0], link, WORLD, ends), axis=2).max()
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
    "a turn falls towards its axis": (planar(), line((-0.1, 0), (0.1, 0)), 0, (1, 0, 0)),
    "so does what it carries": (planar(), line((-0.1, 0), (0.1, 0)), 1, (1, 0, 0)),
    "one turn on another adds up": (planar(), line((-0.1, -0.1), (0.1, 0.1)), 1, (1, 0, 0)),
    "a slide that is turned": (reach_out(), line((-0.1, -0.1), (0.1, 0.1)), 0, (0, 1, 0)),
    "a parabola with no speed at the middle": (planar(), parabola(0.01), 1, (0, 1, 0)),
    "a corner at the middle": (planar(), line((-0.005, 0), (0.005, 0), (-0.005, 0)), 1, (0, 1, 0)),
}


@pytest.mark.parametrize("case", SECOND_ORDERS)
def test_the_second_order_bound_is_needed(case: str) -> None:
    """At most so much above the truth that half of it would be below."""
    robot, curve, shape, n = SECOND_ORDERS[case]
    moving = on_first_part(robot, curve)
    link, part = moving.shape(shape), robot.capsules[shape]
    ends = np.stack([part.a, part.b])
    bound = moving.bounds(link, WORLD, ends)
    beyond = np.abs(moving.moved(moving.stretch.ends[0], link, WORLD, ends) @ n) - np.abs(bound.along @ n)
    assert 0.55 * bound.second < beyond.max() <= bound.second


def test_only_the_joints_between_move_one_link_from_another() -> None:
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
    moving = on_first_part(three, line((-0.5, 0, 0), (0.5, 0, 0)))
    hand, ends = moving.shape(2), np.array([[0.0, 0, 0], [0.5, 0, 0]])
    bound = moving.bounds(hand, FIRST_JOINT, ends)
    assert bound.first < 1e-12
    assert np.abs(bound.along).max() < 1e-12
    assert moving.bounds(hand, WORLD, ends).first > 0.5


def test_two_arms_move_relative_to_each_other_through_their_common_root() -> None:
    """The frame of the other body moves, too: its joint counts with the other sign."""
    side = np.eye(4)
    side[1, 3] = 1.0
    joints = (
        Joint(name="left", kind="revolute", parent=-1, T_parent_joint=np.eye(4)),
        Joint(name="right", kind="revolute", parent=-1, T_parent_joint=side),
    )
    moving = on_first_part(planar(joints=joints, self_pairs=(("upper", "fore"),)), line((-0.2, -0.2), (0.2, 0.2)))
    fore, ends = moving.shape(1), np.array([[0.0, 0, 0], [1.0, 0, 0]])
    bound, moved = moving.bounds(fore, FIRST_JOINT, ends), moving.moved(moving.stretch.ends[0], fore, FIRST_JOINT, ends)
    assert np.linalg.norm(moved, axis=2).max() <= bound.first
    np.testing.assert_allclose(
        bound.along[0], bound.along[1], atol=1e-12
    )  # both turn alike, so neither turns in the other's frame
    assert np.linalg.norm(bound.along[0]) == pytest.approx(0.2)


# ---- a floating base -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("share", [0.2, 1.0])
def test_a_panel_that_turns_falls_towards_the_centre_and_the_bound_is_just_above(share: float) -> None:
    """A flywheel at a constant rate: the panel, 1 m out, falls by 1 - cos of the angle, and goes sideways by its sine."""
    claim = claim_along(wheel(), PiecewisePath.from_linear([0, 1], [[0.0], [share]]))
    moving = BodyMotion(claim, parts(claim.path).select(np.array([3])))
    bound = moving.bounds(moving.shape(0), WORLD, np.array([[1.0, 0, 0]]))
    half = float(moving.midpoints.half[0])
    angle = share * half / 4
    assert 1 - np.cos(angle) <= bound.second <= 1.2 * (1 - np.cos(angle)) + 1e-9
    assert 2 * np.sin(angle / 2) <= bound.first <= 1.01 * angle + 1e-9
    assert np.linalg.norm(bound.along[0]) / half == pytest.approx(share / 4, rel=1e-12)


def skewed() -> Robot:
    """The lander with its shoulder off the middle and turned: how much the base gives way depends on the shoulder's angle."""
    at = np.eye(4)
    at[:2, :2], at[0, 3] = [[0.6, -0.8], [0.8, 0.6]], 0.7
    return lander(moment=100.0, joints=(replace(lander().joints[0], T_parent_joint=at), lander().joints[1]))


STRAIGHT = [PiecewisePath.from_linear([0, 1], [[0, 0], [way, 0]]) for way in (-0.3, 0.3)]


@pytest.mark.parametrize("curve", [*STRAIGHT, parabola(-0.03), parabola(0.03)])
def test_the_second_order_bound_of_the_rotation_is_needed_and_just_above_it(curve: PiecewisePath) -> None:
    """In the plane the turn is one integral: it differs from the middle's rate by no more than the bound, nor much less."""
    claim = claim_along(skewed(), curve)
    base: Any = claim.base
    moving = BodyMotion(claim, parts(claim.path).select(np.array([0])))
    bounds = moving.midpoints._base
    assert bounds is not None
    middle, beyond = moving.stretch.ends.mean(), []
    for end in moving.stretch.ends[0]:
        R = base.attitude.at(np.array([middle, end]))
        turn = R[0].T @ R[1]
        beyond.append(abs(np.arctan2(turn[1, 0], turn[0, 0]) - bounds.omega[0, 2] * (end - middle)))
    assert 0.7 * bounds.rotation_second_order[0] < max(beyond) <= bounds.rotation_second_order[0]


def test_the_rate_of_a_tumbling_base_changes_no_more_than_its_bound() -> None:
    """An arm at rest on a long body: nothing moves but by momentum, and yet the rate in base axes does not stay."""
    moments, tumbling = np.array([1.0, 3.0, 3.5]), Momentum(angular=(1.0, 1.0, 0.2))
    robot, curve = wheel(bodies=(body("base", -1, 5.0, (0, 0, 0), moments),)), Motion([[0.0], [0.0]])
    claim = claim_along(robot, curve, duration=6.0, momentum=tumbling)
    base: Any = claim.base
    moving = BodyMotion(claim, parts(claim.path, 5))
    bounds = moving.midpoints._base
    assert bounds is not None
    shares = []
    for i, (begin, end) in enumerate(moving.stretch.ends):
        middle = (begin + end) / 2
        u = np.linspace(middle, end, 201)
        local = np.swapaxes(base.attitude.at(u), 1, 2) @ tumbling.angular * 6.0 / moments  # omega, base axes
        turned = (local[1:] + local[:-1]).sum(axis=0) / 2 * (u[1] - u[0])
        beyond = np.linalg.norm(turned - local[0] * (end - middle))
        assert np.linalg.norm(bounds.omega[i]) == pytest.approx(np.linalg.norm(local[0]))
        shares.append(beyond / bounds.rotation_second_order[i])
    assert 0.03 < max(shares) < 1


def test_the_bounds_are_close_to_the_truth_on_short_stretches() -> None:
    """What is lost beside the speed goes with the square of a stretch; its bound is no more than 8 times the worst of it."""
    robot = servicer()
    robot = Robot(**{**{n: getattr(robot, n) for n in robot.__dataclass_fields__}, "capsules": lander().capsules[:1]})
    claim = claim_along(replace(robot, base="floating"), Motion([np.zeros(7), ROWS[0][0]]))
    every, shares = parts(claim.path, 8), []
    for i in range(0, len(every), 5):
        moving = BodyMotion(claim, every.select(np.array([i])))
        part = robot.capsules[0]
        ends = np.stack([part.a, part.b])
        bound = moving.bounds(moving.shape(0), WORLD, ends)
        moved = moving.moved(moving.stretch.ends[0], moving.shape(0), WORLD, ends)
        beyond = np.linalg.norm(moved - bound.along * np.array([-1.0, 1.0])[:, None, None], axis=2)
        shares.append(beyond.max() / bound.second)
    assert 1 / 8 < max(shares) < 1
