"""Measured clearances: of all pairs at instants, pairs near at an end, and closest approaches; by hand, and by Coal."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

from spacearm.geometry import HalfSpace, Polytope, PolytopeSet, Scene, Sphere, SphereSet
from spacearm.motion import AnyTrajectory, Trajectory
from spacearm.proof import PairClearance
from spacearm.proof.claim import Claim
from spacearm.proof.measured import MeasuredApproaches, frames_at, least_clearances, measure_approaches
from spacearm.proof.near_pairs import find_near
from spacearm.proof.required_clearance import held_to, out_level
from spacearm.proof.witness import CoalBodies
from support.claims import claim_about
from support.dense_samples import Setting, arms
from support.drawn_links import obstacles, shaped_arms
from support.drawn_motions import motions_of
from support.floating_arms import Adrift, along, floating_arms, frames_of
from support.gantry import FLOOR, GANTRY, POST, hand_path
from support.oracles.pinocchio_points import joint_frames
from support.pair_distances import distances

MM = 1e-3
HAND, BUS = 0, 1  # links
AROUND = 0.25 * MM


class At(NamedTuple):
    """A pair of shapes at an instant."""

    first: int
    other: int
    u: float
    clearance: float


def about(trajectory: AnyTrajectory, *scene: Any, clearance: float = 10 * MM, by_pair: tuple[PairClearance, ...] = ()) -> Claim:
    """The claim about a motion of the gantry, with its near pairs."""
    problem = Setting(GANTRY, Scene(scene), clearance, by_pair)
    return claim_about(problem, trajectory, near=find_near(claim_about(problem, trajectory)))


def body(claim: Claim, owner: int, *, obstacle: bool) -> int:
    """The first shape of a link or an obstacle in a claim's table."""
    mine = (claim.bodies.owner == owner) & ((claim.bodies.frame == 0) == obstacle) & (claim.bodies.members == 0)
    return int(np.flatnonzero(mine)[0])


# ---- all pairs at instants -------------------------------------------------------------------------------------------


def test_clearances_are_known_by_hand_and_cut_a_quarter_of_a_millimetre_above_the_required() -> None:
    path = hand_path((0, 0.105), (1.795, 1.0))
    claim = about(path, FLOOR, POST, clearance=10 * MM)
    least, which = least_clearances(claim, np.array([0.0, 1.0]))
    assert least.shape == (2, 2, 4)
    assert least[0, HAND, [0, 1, 3]] == pytest.approx([5 * MM, 10 * MM + AROUND, 10 * MM + AROUND], abs=1e-15)
    assert which[0, HAND, 0].tolist() == [body(claim, HAND, obstacle=False), body(claim, 0, obstacle=True)]
    assert (which[0, HAND, 1:] == -1).all()


def test_limits_say_which_pairs_are_measured_and_up_to_where() -> None:
    claim = about(hand_path((0, 1), (1, 2)), FLOOR, POST, clearance=0.0)
    least, _ = least_clearances(claim, np.array([0.0, 1.0]))
    assert np.isinf(least).all()  # nothing more than 0 is asked for
    limit = np.full((2, 4), -np.inf)
    limit[HAND, 0] = limit[HAND, 3] = limit[BUS, 2] = 10.0
    least, _ = least_clearances(claim, np.array([0.0, 1.0]), limit)
    assert least[:, HAND, 0] == pytest.approx([0.9, 1.9], abs=1e-15)
    assert least[:, HAND, 3] == pytest.approx([3.9, 4.9], abs=1e-15)  # two links: in the row of the first
    assert np.isinf(least[:, HAND, 1]).all()
    assert np.isinf(least[:, BUS, 0]).all()


def test_many_balls_and_parts_are_measured_each() -> None:
    rng = np.random.default_rng(0)
    centers = rng.uniform((-2, -2, -1), (2, -0.5, 1), (500, 3))
    balls = SphereSet(centers, np.full(500, 0.1))
    parts = PolytopeSet([Polytope(rng.normal(size=(12, 3)) * 0.1 + (x, 2, 0)) for x in (-1, 0, 1)])
    path = hand_path((-1, 0.2), (1.5, 0.4), smooth=False)
    claim = about(path, balls, parts, HalfSpace((0, 1, 0), (0, -1, 0)), clearance=5.0)
    u = np.linspace(0, 1, 7)
    least, which = least_clearances(claim, u)
    hand = np.column_stack([path.curve.sample(u), np.zeros(7)])
    expected = np.linalg.norm(hand[:, None] - centers, axis=-1).min(axis=1) - 0.2
    assert least[:, HAND, 0] == pytest.approx(expected, abs=1e-15)
    assert least[:, HAND, 2] == pytest.approx(hand[:, 1] + 0.9, abs=1e-15)
    of_parts = [row[1] for row in distances(GANTRY, claim.scene, joint_frames(GANTRY, path.curve.sample(u)))]
    assert least[:, HAND, 1] == pytest.approx(of_parts[1], abs=1e-8)
    shapes = which[:, HAND, 0, 1]
    assert (claim.bodies.members[shapes] == 0).all()
    assert claim.bodies.vertices[claim.bodies.first_point[shapes]] == pytest.approx(
        centers[np.linalg.norm(hand[:, None] - centers, axis=-1).argmin(axis=1)]
    )


def require_coals(claim: Claim, frames: np.ndarray, u: np.ndarray, off: float) -> None:
    """Compare all pairs with Coal's distances; frames (r, j, 4, 4) are T_w_joint there."""
    links, obstacles = list(dict.fromkeys(part.name for part in claim.robot.shapes)), len(claim.scene.obstacles)
    cells = [(row, column) for row in range(len(links)) for column in range(obstacles)]
    pairs = [sorted((links.index(one), links.index(other))) for one, other in claim.robot.self_pairs]
    cells += [(one, obstacles + other) for one, other in pairs]
    least, _ = least_clearances(claim, u)
    limit = float(claim.held.required.max()) + AROUND
    for (row, column), (_, measured) in zip(cells, distances(claim.robot, claim.scene, frames), strict=True):
        found, expected = least[:, row, column], np.minimum(measured, limit)
        assert found[expected > off] == pytest.approx(expected[expected > off], abs=off)
        assert (found[expected <= off] <= 2 * off).all()


@settings(max_examples=60, phases=[Phase.reuse, Phase.generate])
@given(st.data())
def test_clearances_of_drawn_robots_are_coals(data: st.DataObject) -> None:
    robot = data.draw(st.one_of(arms(self_pairs=True), shaped_arms()))
    scene = Scene(data.draw(st.lists(obstacles(), max_size=4)))
    trajectory = Trajectory(robot, data.draw(motions_of(robot, most=2)))
    u = np.linspace(*trajectory.curve.domain, 5)
    claim = claim_about(Setting(robot, scene, 2.0), trajectory)
    require_coals(claim, joint_frames(robot, trajectory.curve.sample(u)), u, 2e-5)


@settings(max_examples=15)
@given(st.data())
def test_frames_are_where_a_floating_base_takes_them(data: st.DataObject) -> None:
    robot = data.draw(floating_arms())
    trajectory = Trajectory(robot, data.draw(motions_of(robot, most=2)))
    problem = Adrift(robot, Scene([Sphere((0.3, 0.2, 0.1), 0.05)]), clearance=1.0)
    claim = claim_about(problem, trajectory)
    way = along(problem, trajectory)
    u = way.u[::100]
    expected = frames_of(robot, way.q[::100], way.T_w_b[::100])
    frames = frames_at(claim, u)
    assert frames[:, 0] == pytest.approx(np.broadcast_to(np.eye(4)[:3], (len(u), 3, 4)))
    assert frames[:, 1] == pytest.approx(way.T_w_b[::100, :3], abs=1e-5)
    assert frames[:, 2:] == pytest.approx(expected[:, : len(robot.joints), :3], abs=1e-5)
    require_coals(claim, expected, u, 1e-4)


# ---- pairs near at an end --------------------------------------------------------------------------------------------


def test_near_pairs_are_held_to_what_they_have_until_they_are_out() -> None:
    claim = about(hand_path((0, 0.105), (0, 1), (1.893, 0.4)), FLOOR, POST)
    floor, post = claim.held.pairs if claim.held.pairs[0].other == 0 else claim.held.pairs[::-1]
    assert (floor.link, floor.other, post.link, post.other) == (HAND, 0, HAND, 1)
    assert (floor.at_start, floor.at_goal) == pytest.approx((5 * MM, 10 * MM + AROUND), abs=1e-12)
    assert (post.at_start, post.at_goal) == pytest.approx((10 * MM + AROUND, 7 * MM), abs=1e-12)
    y = claim.base.curve.sample(np.array([floor.until]))[0, 1]
    assert 10.1 * MM <= y - 0.1 <= 10.3 * MM
    assert floor.since == np.inf


def walked(clearances: list[float], required: float) -> list[float]:
    """What a pair is held to, instant by instant, by the rule in words."""
    level = float(out_level(max(clearances), required))
    at_start, at_goal = (float(held_to(clearances[end], required)) for end in (0, -1))
    held = []
    for k in range(len(clearances)):
        been_out = any(c >= level for c in clearances[: k + 1])
        will_be_out = any(c >= level for c in clearances[k:])
        held.append(min(required if been_out else at_start, required if will_be_out else at_goal))
    return held


HEIGHTS = st.floats(-0.02, 0.03).map(lambda height: round(height, 6) + 3e-7)


@settings(max_examples=60)
@given(st.sampled_from([2, 3, 5, 9]).flatmap(lambda count: st.lists(HEIGHTS, min_size=count, max_size=count)))
def test_a_pair_is_held_to_less_until_it_is_first_out_and_from_when_it_is_last_out(heights: list[float]) -> None:
    trajectory = hand_path(*[(0.0, 0.1 + height) for height in heights], smooth=False)
    claim = about(trajectory, FLOOR)
    u = np.linspace(*claim.base.curve.domain, 129)
    clearances = claim.base.curve.sample(u)[:, 1] - 0.1
    (floor,) = np.flatnonzero((claim.bodies.frame == 0) & (claim.bodies.members == 0))
    held, _ = claim.held.on(np.full(129, HAND), np.full(129, floor), u, u)
    sure = np.abs(clearances - float(out_level(clearances.max(), 10 * MM))) > 1e-9
    np.testing.assert_allclose(held[sure], np.array(walked(clearances.tolist(), 10 * MM))[sure], rtol=0, atol=1e-9)


def test_what_touches_at_an_end_is_not_near() -> None:
    for start in (0.1, 0.1 + 1e-16, 0.09):
        assert find_near(about(hand_path((0, start), (0, 1)), FLOOR)) == ()
    assert len(find_near(about(hand_path((0, 0.1 + 1e-12), (0, 1)), FLOOR))) == 1


def test_nothing_is_near_where_nothing_is_required() -> None:
    assert find_near(about(hand_path((0, 0.1001), (0, 1)), FLOOR, clearance=0.0)) == ()


# ---- the closest approach --------------------------------------------------------------------------------------------


def measured(claim: Claim, *known: At, worst: At | None = None, finest: float = 0.1) -> MeasuredApproaches:
    closest = [*known, *[None] * (claim.held.phases - len(known))]
    return measure_approaches(claim, closest, worst, finest=finest)


def test_the_closest_approach_is_looked_for_around_an_instant() -> None:
    claim = about(hand_path((0, 1), (1, 0.2), (0, 1)), FLOOR, POST)  # 0.1 m above the floor at u = 1
    hand, floor = body(claim, HAND, obstacle=False), body(claim, 0, obstacle=True)
    found = measured(claim, At(hand, floor, 1.1, 0.5))
    near = found.nearest([0])
    assert near is not None
    assert near.u == pytest.approx(1.0, abs=0.02)
    assert near.clearance == pytest.approx(0.1, abs=1e-3)
    y = claim.base.curve.sample(np.array([near.u]))[0, 1]
    assert near.clearance == pytest.approx(y - 0.1, abs=1e-9)
    assert (near.shape, near.obstacle, near.other, near.required) == (0, 0, -1, 10 * MM)
    x = claim.base.curve.sample(np.array([near.u]))[0, 0]
    assert near.points == pytest.approx(np.array([(x, y - 0.1, 0), (x, 0, 0)]), abs=1e-9)
    assert not found.fails
    assert found.worst is near


def test_two_links_are_named_by_their_shapes() -> None:
    claim = about(hand_path((0, -1), (0, -2.5), (0, -1)), clearance=10 * MM)
    hand, bus = body(claim, HAND, obstacle=False), body(claim, BUS, obstacle=False)
    near = measured(claim, At(hand, bus, 0.95, 1.0)).nearest([0])
    assert near is not None
    assert (near.shape, near.obstacle, near.other) == (0, None, 1)
    assert near.clearance == pytest.approx(0.4, abs=2e-3)


def test_a_failing_pair_is_measured_where_it_lacks_most() -> None:
    claim = about(hand_path((0, 1), (1, 0.105), (0, 1)), FLOOR)
    hand, floor = body(claim, HAND, obstacle=False), body(claim, 0, obstacle=True)
    found = measured(claim, worst=At(hand, floor, 1.02, 9 * MM))
    assert found.fails
    assert found.worst is not None
    assert found.worst.clearance == pytest.approx(5 * MM, abs=1e-4)
    deep = about(hand_path((0, 1), (1, 0.05), (0, 1)), FLOOR)
    found = measured(deep, worst=At(hand, floor, 1.04, 0.0))
    assert found.fails
    assert found.worst is not None
    assert found.worst.clearance == pytest.approx(-50 * MM, abs=2e-4)


def test_cores_that_meet_are_measured_where_they_penetrate_deepest() -> None:
    claim = about(hand_path((0, 1), (0, -0.2), (0, 1)), FLOOR)
    hand, floor = body(claim, HAND, obstacle=False), body(claim, 0, obstacle=True)
    found = measured(claim, worst=At(hand, floor, 0.9, 0.0))
    assert found.worst is not None
    assert found.worst.u == pytest.approx(1.0, abs=0.02)
    assert found.worst.clearance == pytest.approx(-0.3, abs=2e-3)


def test_phases_are_kept_apart_and_near_pairs_looked_at_where_they_get_out() -> None:
    claim = about(hand_path((0, 0.105), (0, 1)), FLOOR, Sphere((0, 2, 0), 0.1))
    hand, ball = body(claim, HAND, obstacle=False), body(claim, 1, obstacle=True)
    found = measured(claim, At(hand, ball, 1.0, 0.8))
    from_start, out = found.closest[1], found.closest[3]
    assert from_start is not None
    assert (from_start.u, from_start.required) == (0.0, pytest.approx(4.9 * MM, abs=1e-12))
    assert from_start.clearance == pytest.approx(5 * MM, abs=1e-9)
    assert out is not None
    assert out.u == pytest.approx(claim.held.pairs[0].until, abs=1e-6)
    assert out.required == 10 * MM
    assert 10 * MM < out.clearance < 10.3 * MM
    assert found.nearest(claim.held.full_phases) is out
    assert found.nearest([2]) is None


def test_a_measurement_below_what_is_proven_contradicts_it() -> None:
    claim = about(hand_path((0, 1), (1, 0.2), (0, 1)), FLOOR)
    found = measured(claim, At(body(claim, HAND, obstacle=False), body(claim, 0, obstacle=True), 1.0, 0.1))
    proven = np.full(claim.held.phases, np.inf)
    for bound, contradicts in ((0.1 - 1e-9, False), (0.1 + 0.9e-6, False), (0.1 + 1.1e-6, True)):
        proven[0] = bound
        assert found.contradict(proven) == contradicts


def test_where_coal_has_no_answer_the_native_measurement_counts(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(CoalBodies, "_between", lambda *_: (-1e308, np.full((2, 3), np.nan)))
    claim = about(hand_path((0, 1), (1, 0.2), (0, 1)), FLOOR)
    found = measured(claim, At(body(claim, HAND, obstacle=False), body(claim, 0, obstacle=True), 1.0, 0.1))
    near = found.nearest([0])
    assert near is not None
    assert near.clearance == pytest.approx(0.1, abs=1e-12)


@settings(max_examples=30)
@given(st.data())
def test_coals_bodies_are_those_of_the_table(data: st.DataObject) -> None:
    robot = data.draw(st.one_of(arms(self_pairs=True), shaped_arms()))
    scene = Scene(data.draw(st.lists(obstacles(), min_size=1, max_size=4)))
    trajectory = Trajectory(robot, data.draw(motions_of(robot, most=2)))
    claim = claim_about(Setting(robot, scene, 1e6), trajectory)
    u = np.linspace(*trajectory.curve.domain, 3)
    least, which = least_clearances(claim, u)
    coal = CoalBodies(robot, scene, claim.bodies)
    for i, frames in enumerate(frames_at(claim, u)):
        for row, column in np.argwhere(which[i, :, :, 0] >= 0):
            first, other = which[i, row, column].tolist()
            clearance, points = coal.distance(frames, first, other)
            if least[i, row, column] > 1e-4:
                assert clearance == pytest.approx(least[i, row, column], abs=2e-5)
                apart = np.linalg.norm(points[0] - points[1])
                assert apart == pytest.approx(clearance, abs=2e-5)
