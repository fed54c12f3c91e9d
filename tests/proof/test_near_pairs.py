"""The clearance that is required, by pair, and pairs near at an end: what is proven of each pair is true by Coal."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spacearm.core.errors import ProblemError
from spacearm.geometry import Obstacle, Scene, Sphere, SphereSet
from spacearm.motion import AnyTrajectory, Motion, PiecewisePath, RecordedTrajectory, Trajectory
from spacearm.proof import Certificate, PairClearance, certify
from support.dense_samples import Setting, arms
from support.drawn_links import obstacles, shaped_arms
from support.drawn_motions import motions_of
from support.floating_arms import Adrift, lander
from support.gantry import FLOOR, POST
from support.gantry import GANTRY as ROBOT
from support.gantry import hand_path as path
from support.oracles.pinocchio_points import joint_frames
from support.pair_distances import distances, stated

ROUNDING = 1e-7  # [m] Coal's and Pinocchio's
INSTANTS = 400
MM = 1e-3


def proven(
    trajectory: AnyTrajectory, *obstacles: Obstacle, clearance: float = 10 * MM, by_pair: tuple[PairClearance, ...] = ()
) -> Certificate:
    certificate = certify(Setting(trajectory.robot, Scene(obstacles), clearance, by_pair), trajectory, limits=())
    if certificate.holds:
        require_true(certificate, trajectory)
    return certificate


def require_true(certificate: Certificate, trajectory: AnyTrajectory, u: np.ndarray | None = None) -> None:
    """Compare what a certificate states of every pair with Coal, at many instants."""
    u = np.linspace(*trajectory.curve.domain, INSTANTS) if u is None else u
    frames = joint_frames(trajectory.robot, trajectory.curve.sample(u))
    t = np.asarray(trajectory.time_at(u))
    for pair, measured in distances(certificate.robot, certificate.scene, frames):
        assert (measured >= stated(certificate, pair, t) - ROUNDING).all(), pair


def said(certificate: Certificate) -> list[tuple[str, str, str]]:
    return [(near.link, near.other, near.ends) for near in certificate.near_pairs]


# ---- by pair ---------------------------------------------------------------------------------------------------------


def test_every_pair_is_proven_to_its_own_clearance() -> None:
    lowest = path((0, 1), (1.5, 0.13), (1, 1))  # 30 mm above the floor, 0.4 m from the post
    assert proven(lowest, FLOOR, POST).holds
    for by_pair, holds in (
        ((PairClearance(0.029, obstacle="floor"),), True),
        ((PairClearance(0.031, obstacle="floor"),), False),
        ((PairClearance(0.031, obstacle="floor"), PairClearance(0.0, obstacle="floor", link="hand")), True),
        ((PairClearance(0.0, obstacle="floor", link="hand"), PairClearance(0.031, obstacle="floor")), True),
        ((PairClearance(0.0, obstacle="floor"), PairClearance(0.031, obstacle="floor")), False),
        ((PairClearance(0.31, obstacle="post"),), True),
        ((PairClearance(0.41, obstacle="post"),), False),
        ((PairClearance(0.31, link="hand"),), False),
        ((PairClearance(2.9, link="hand", other_link="bus"),), True),
        ((PairClearance(3.1, link="bus", other_link="hand"),), False),
    ):
        certificate = proven(lowest, FLOOR, POST, by_pair=by_pair)
        assert certificate.status == ("holds" if holds else "fails"), by_pair
        assert certificate.required_by_pair == by_pair
        if not holds:
            assert certificate.closest is not None
            assert certificate.closest.required == max(pair.clearance for pair in by_pair)


def test_the_problems_clearance_is_ten_millimetres_where_nobody_says_otherwise() -> None:
    class Plain:
        robot, scene = ROBOT, Scene([FLOOR])

    low, high = path((0, 1), (0, 0.1099), (0, 1)), path((0, 1), (0, 0.1101), (0, 1))
    assert certify(Plain(), low, limits=()).status == "fails"
    assert certify(Plain(), high, limits=()).holds
    assert certify(Plain(), low, limits=(), clearance=0.0).holds
    assert certify(Plain(), high, limits=(), clearance=0.02).status == "fails"


def test_a_former_setting_is_refused_with_what_to_do() -> None:
    with pytest.raises(ProblemError, match="no longer takes; give the problem its clearance"):
        certify(Setting(ROBOT, Scene()), path((0, 1), (1, 1)), minimum_clearance=0.1)  # type: ignore[arg-type]


def test_the_cells_of_many_balls_are_held_to_the_clearance_of_each_obstacle() -> None:
    rng = np.random.default_rng(0)
    near = SphereSet(rng.uniform((-2, -1, -1), (2, -0.13, 1), (300, 3)), np.full(300, 0.1), name="near")
    far = SphereSet(rng.uniform((-2, -1, -1), (2, -0.13, 1), (300, 3)) - (0, 0.5, 0), np.full(300, 0.1), name="far")
    sweep = path((-2, 0.2), (2, 0.2))
    assert proven(sweep, near, far, clearance=0.05).holds
    assert proven(sweep, near, far, by_pair=(PairClearance(0.4, obstacle="far"),)).holds
    assert proven(sweep, near, far, by_pair=(PairClearance(0.4, obstacle="near"),)).status == "fails"


# ---- near at an end --------------------------------------------------------------------------------------------------


def test_a_pair_near_at_the_start_is_held_to_what_it_has_until_it_is_out() -> None:
    certificate = proven(path((0, 0.105), (0, 1), (1.8, 1)), FLOOR)
    assert certificate.holds
    (near,) = certificate.near_pairs
    assert (near.link, near.other, near.ends, near.obstacle) == ("hand", "obstacle 'floor'", "start", 0)
    assert near.clearance == pytest.approx(5 * MM, abs=1e-9)
    assert near.held_to == pytest.approx(4.9 * MM, abs=1e-9)
    assert near.proven is not None
    assert near.held_to < near.proven < near.clearance
    assert near.begin == 0
    y = float(certificate.trajectory.sample(np.array([near.end])).q[0, 1])
    assert 10 * MM <= y - 0.1 <= 10.3 * MM  # it is out as soon as it has what is required
    assert certificate.clearance is not None
    assert certificate.clearance > 10 * MM
    assert "nearer at an end: link 'hand' and obstacle 'floor', 5 mm at the start: proven at least 4.9" in certificate.message


def test_a_pair_near_at_the_goal_is_held_to_what_it_has_there() -> None:
    certificate = proven(path((1, 1), (0, 0.105)), FLOOR, POST)
    assert certificate.holds
    (near,) = certificate.near_pairs
    assert (near.ends, near.end) == ("goal", certificate.trajectory.duration)
    assert 0.1 + 10 * MM <= certificate.trajectory.sample(np.array([near.begin])).q[0, 1] <= 0.1 + 10.3 * MM
    assert "mm at the goal" in certificate.message


def test_a_pair_near_at_both_ends_is_listed_for_each() -> None:
    certificate = proven(path((0, 0.108), (0, 1), (1, 0.102)), FLOOR)
    assert certificate.holds
    assert said(certificate) == [("hand", "obstacle 'floor'", "start"), ("hand", "obstacle 'floor'", "goal")]
    assert [near.clearance for near in certificate.near_pairs] == pytest.approx([8 * MM, 2 * MM], abs=1e-9)
    assert certificate.near_pairs[0].end < certificate.near_pairs[1].begin


def test_a_pair_that_never_gets_out_is_held_to_the_lesser_of_both_all_the_time() -> None:
    certificate = proven(path((0, 0.108), (0.5, 0.107), (1, 0.105)), FLOOR)
    assert certificate.holds
    (near,) = certificate.near_pairs
    assert (near.ends, near.begin, near.end) == ("both", 0, certificate.trajectory.duration)
    assert near.clearance == pytest.approx(5 * MM, abs=1e-9)
    assert proven(path((0, 0.108), (0.5, 0.104), (1, 0.105)), FLOOR).status == "fails"


def test_a_pair_that_is_out_and_comes_back_fails() -> None:
    certificate = proven(path((0, 0.105), (0, 0.12), (1, 0.108), (1, 1)), FLOOR)
    assert certificate.status == "fails"
    assert certificate.closest is not None
    assert certificate.closest.required == 10 * MM
    assert 8 * MM <= certificate.closest.clearance + 1e-9 < 10 * MM
    assert "come within 8" in certificate.message
    assert "expected more than 10 mm" in certificate.message


def test_a_pair_that_dips_below_what_it_had_fails_and_one_that_does_not_holds() -> None:
    for dip, status in ((0.1048, "fails"), (0.10495, "holds"), (0.106, "holds")):
        certificate = proven(path((0, 0.105), (0.5, dip), (1, 1)), FLOOR)
        assert certificate.status == status, dip
        if status == "fails":
            assert certificate.closest is not None
            assert certificate.closest.required == pytest.approx(4.9 * MM, abs=1e-9)


def test_another_pair_is_held_to_the_full_while_one_is_near() -> None:
    certificate = proven(path((1.795, 0.105), (0, 0.5)), FLOOR, POST, clearance=0.2)
    assert certificate.holds
    assert set(said(certificate)) == {("hand", f"obstacle '{name}'", "start") for name in ("floor", "post")}
    aside = Sphere((1.795, 0.305, 0), 0.05, name="aside")  # 50 mm from the hand at the start, 10 mm are asked of it
    by_pair = (PairClearance(0.01, obstacle="aside"),)
    assert proven(path((1.795, 0.105), (1.0, 0.5)), FLOOR, POST, aside, clearance=0.2, by_pair=by_pair).holds
    assert (
        proven(path((1.795, 0.105), (1.795, 0.15), (1, 0.5)), FLOOR, POST, aside, clearance=0.2, by_pair=by_pair).status
        == "fails"
    )


def test_two_links_may_be_near() -> None:
    by_pair = (PairClearance(0.2, link="hand", other_link="bus"),)
    certificate = proven(path((0, -2.8), (0, 0)), by_pair=by_pair)
    assert certificate.holds
    (near,) = certificate.near_pairs
    assert {near.link, near.other} in ({"hand", "link 'bus'"}, {"bus", "link 'hand'"})
    assert near.clearance == pytest.approx(0.1, abs=1e-9)
    assert near.obstacle is None
    assert proven(path((0, -2.8), (1, -2.85), (1, 0)), by_pair=by_pair).status == "fails"


def test_contact_at_an_end_fails_as_ever() -> None:
    for start in (0.1, 0.09):
        certificate = proven(path((0, start), (0, 1)), FLOOR)
        assert certificate.status == "fails"
        assert certificate.near_pairs == ()
    certificate = proven(path((0, 0.105), (0, 1), (0, 0.05)), FLOOR)
    assert certificate.status == "fails"
    assert "penetrate by 50 mm" in certificate.message


@pytest.mark.parametrize("above", [1e-4, 1.1e-6, 1e-7, 0.0, -1e-7, -1e-5])
def test_a_start_at_the_required_clearance_can_be_proven(above: float) -> None:
    certificate = proven(path((0, 0.11 + above), (0, 1)), FLOOR)
    assert certificate.holds
    assert len(certificate.near_pairs) == (above < 9e-7)


def test_a_hair_above_the_required_clearance_holds_and_a_hair_below_fails() -> None:
    assert proven(path((0, 1), (0, 0.1 + 10.001 * MM), (0, 1)), FLOOR).holds
    assert proven(path((0, 1), (0, 0.1 + 9.999 * MM), (0, 1)), FLOOR).status == "fails"


def test_a_tiny_clearance_at_an_end_is_held_to_half() -> None:
    certificate = proven(path((0, 0.1 + 2e-5), (0, 1)), FLOOR)
    assert certificate.holds
    (near,) = certificate.near_pairs
    assert near.held_to == pytest.approx(1e-5, abs=1e-9)


@pytest.mark.parametrize("gap", [5e-3, 1e-6])
def test_the_closest_approach_is_looked_for_where_a_near_pair_has_just_got_out(gap: float) -> None:
    certificate = proven(path((0, 0.1 + gap), (0, 1)), FLOOR, Sphere((0, 2, 0), 0.1))
    (near,) = certificate.near_pairs
    closest = certificate.closest
    assert closest is not None
    assert closest.other == "obstacle 'floor'"
    assert closest.time == pytest.approx(near.end, abs=1e-6)
    frames = joint_frames(ROBOT, certificate.trajectory.sample(np.array([closest.time])).q)
    measured = dict(distances(ROBOT, certificate.scene, frames))["hand", "obstacle 'floor'"][0]
    assert closest.clearance == pytest.approx(measured, abs=ROUNDING)
    assert certificate.clearance is not None
    assert closest.clearance < 10 * MM + 3e-4


@pytest.mark.parametrize("goal", [False, True])
def test_a_pair_that_all_but_touches_at_an_end_is_named(goal: bool) -> None:
    there, away = (0.0, 0.1 + 1e-12), (0.0, 1.0)
    certificate = proven(path(away, there) if goal else path(there, away), FLOOR, Sphere((0, 1.5, 0), 0.1))
    assert certificate.status == "undecided"
    closest = certificate.closest
    assert closest is not None
    assert (closest.other, closest.time) == ("obstacle 'floor'", float(goal))
    assert f"mm at the {'goal' if goal else 'start'}; 10 mm are asked for" in certificate.message


def test_without_a_required_clearance_no_pair_is_near() -> None:
    certificate = proven(path((0, 0.105), (0.5, 0.101), (1, 1)), FLOOR, clearance=0.0)
    assert certificate.holds
    assert certificate.near_pairs == ()
    assert certificate.clearance is not None
    assert 0 < certificate.clearance <= 1 * MM + 1e-9


def test_paths_with_corners_and_steep_paths_have_near_pairs_too() -> None:
    certificate = proven(path((0, 0.105), (0, 1), (0.5, 1), (0.5, 0.101), smooth=False), FLOOR, POST)
    assert certificate.holds
    assert len(certificate.near_pairs) == 2
    q = np.array([(0, 0.105), (0, 0.105), (0, 0.7), (1, 0.9)])
    steep = RecordedTrajectory(ROBOT, PiecewisePath.from_linear(np.array([0, 1000.0, 1000.01, 1001.0]), q))
    assert proven(steep, FLOOR).holds


def test_near_pairs_are_in_the_file() -> None:
    values = proven(path((0, 0.105), (0, 1)), FLOOR, by_pair=(PairClearance(0.02, obstacle="floor", link="hand"),)).as_dict()
    assert values["required_clearance_m"] == 10 * MM
    assert values["required_by_pair"] == [{"link": "hand", "obstacle": "floor", "clearance": 0.02}]
    (near,) = values["near_pairs"]  # type: ignore[misc]
    assert near["link"] == "hand"
    assert near["ends"] == "start"
    assert near["clearance_m"] == pytest.approx(0.005, abs=1e-9)
    assert near["held_to_m"] < near["proven_m"] <= near["clearance_m"]
    assert near["begin_s"] == 0 < near["end_s"] < 1


# ---- floating bases --------------------------------------------------------------------------------------------------


def test_pairs_are_near_where_a_floating_base_has_them() -> None:
    robot = lander()
    made = Trajectory(robot, Motion([[0.0, 0.0], [0.8, 0.5]]))
    ball = Sphere((1.5, -0.1 - 0.05 - 0.004, 0), 0.1, name="ball")  # 4 mm below the forearm
    certificate = certify(Adrift(robot, Scene([ball]), clearance=0.01), made, limits=())
    assert certificate.holds
    (near,) = certificate.near_pairs
    assert (near.link, near.ends) == ("fore", "start")
    assert near.clearance == pytest.approx(0.004, abs=1e-7)
    assert (
        certify(Adrift(robot, Scene([ball]), clearance=0.01), Trajectory(robot, Motion([[0, 0], [-0.8, 0]])), limits=()).status
        == "fails"
    )


# ---- drawn -----------------------------------------------------------------------------------------------------------


@settings(max_examples=40)
@given(st.data(), st.integers(0, 2**32 - 1))
def test_what_is_stated_of_every_pair_is_true(data: st.DataObject, seed: int) -> None:
    robot = data.draw(st.one_of(arms(self_pairs=True), shaped_arms()))
    scene = Scene([*data.draw(st.lists(obstacles(), max_size=3)), Sphere((0, 0, 9.0), 0.1, name="named")])
    by_pair = data.draw(st.sampled_from([(), (PairClearance(0.0, obstacle="named"),), (PairClearance(2.0, obstacle="named"),)]))
    setting = Setting(robot, scene, data.draw(st.sampled_from([0.01, 0.1, 0.5, 2.0])), by_pair)
    trajectory = Trajectory(robot, data.draw(motions_of(robot, most=2)))
    certificate = certify(setting, trajectory, limits=())
    if certificate.holds:
        require_true(certificate, trajectory, np.random.default_rng(seed).uniform(*trajectory.curve.domain, 60))
    elif certificate.status == "fails" and certificate.closest is not None:
        near = certificate.closest
        frames = joint_frames(robot, trajectory.curve.sample(np.array([near.u])))
        measured = {frozenset(pair): at[0] for pair, at in distances(robot, scene, frames)}
        pairs = [frozenset((near.link, near.other)), frozenset((near.other[6:-1], f"link '{near.link}'"))]
        found = [measured[pair] for pair in pairs if pair in measured]
        assert min(found) <= near.required + ROUNDING
