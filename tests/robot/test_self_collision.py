"""Which links must keep clear of each other: nothing that can meet is left out without a reason that holds."""

from __future__ import annotations

import itertools
import math
import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import lsq_linear

from spacearm.core.errors import FileFormatError, RobotError
from spacearm.robot import Frame, Joint, LinkCapsule, Robot, find_self_pairs, load_robot
from spacearm.robot.link_distances import body_of
from spacearm.robot.self_collision import NEARLY_ALWAYS
from spacearm.robot.whole_range import finite_range, joints_between, never_meet
from support import srdf_text, strategies, urdf_text
from support.forward_kinematics import joint_transforms
from support.messages import assert_refused
from support.segments import segment_distance

MBM = os.environ.get("SPACEARM_MBM")
WITH_MBM = pytest.mark.skipif(MBM is None, reason="SPACEARM_MBM does not name the MotionBenchMaker data")


def exact_distance(a1: np.ndarray, b1: np.ndarray, a2: np.ndarray, b2: np.ndarray) -> float:
    """Distance of two segments, as a least-squares problem with bounds."""
    A = np.column_stack([b1 - a1, a2 - b2])
    found = lsq_linear(A, a2 - a1, bounds=(0, 1), tol=1e-14)
    ends = [np.linalg.norm(p - q) for p in (a1, b1) for q in (a2, b2)]
    return float(min(np.linalg.norm(A @ found.x - (a2 - a1)), *ends))


def link_clearance(robot: Robot, q: np.ndarray, first: str, second: str) -> float:
    """Signed distance [m] of two links' capsules at q (n,)."""
    placed = [np.eye(4), *joint_transforms(robot, q)]
    ends = {}
    for name in (first, second):
        own = [c for c in robot.capsules if c.name == name]
        T = [placed[c.joint + 1] for c in own]
        ends[name] = [(M[:3, :3] @ c.a + M[:3, 3], M[:3, :3] @ c.b + M[:3, 3], c.radius) for M, c in zip(T, own, strict=True)]
    return min(float(segment_distance(a1, b1, a2, b2)) - r1 - r2 for a1, b1, r1 in ends[first] for a2, b2, r2 in ends[second])


nearby = st.one_of(strategies.points(1.0), st.sampled_from([np.zeros(3), np.array([1.0, 0, 0]), np.array([0, 1e-9, 0])]))


@settings(max_examples=40)
@given(nearby, nearby, nearby, nearby, st.sampled_from(["free", "parallel", "crossing", "same"]))
def test_the_distance_of_segments_is_that_of_their_nearest_points(
    a1: np.ndarray, b1: np.ndarray, a2: np.ndarray, b2: np.ndarray, how: str
) -> None:
    if how == "parallel":
        b2 = a2 + 0.7 * (b1 - a1)
    elif how == "crossing":
        b2 = a1 + 0.3 * (b1 - a1) + (a1 + 0.3 * (b1 - a1) - a2)
    elif how == "same":
        a2, b2 = b1, a1
    assert float(segment_distance(a1, b1, a2, b2)) == pytest.approx(exact_distance(a1, b1, a2, b2), abs=1e-7)
    assert float(segment_distance(a2, b2, a1, b1)) == pytest.approx(float(segment_distance(a1, b1, a2, b2)), abs=1e-12)


def test_the_distance_of_segments_takes_batches() -> None:
    ends = np.random.default_rng(1).normal(size=(4, 5, 3))
    grid = segment_distance(ends[0][:, None], ends[1][:, None], ends[2], ends[3])
    assert grid.shape == (5, 5)
    for i, k in itertools.product(range(5), repeat=2):
        assert grid[i, k] == pytest.approx(exact_distance(ends[0][i], ends[1][i], ends[2][k], ends[3][k]), abs=1e-9)


@settings(max_examples=30)
@given(st.data())
def test_links_proven_never_to_meet_do_not_meet_in_any_sample(data: st.DataObject) -> None:
    robot = data.draw(strategies.robots(max_joints=5))
    names = sorted({capsule.name for capsule in robot.capsules})
    for first, second in itertools.combinations(names, 2):
        axes = [body_of([c for c in robot.shapes if c.name == name]) for name in (first, second)]
        proven = never_meet(robot, *axes, joints_between(robot, *axes))
        if proven:
            lower, upper = finite_range(robot)
            shares = np.random.default_rng(0).random((40, robot.dof))
            for share in (*shares, np.zeros(robot.dof), np.ones(robot.dof), *np.round(shares[:10])):
                assert link_clearance(robot, lower + share * (upper - lower), first, second) > 0


def post_and_boom(distance: float, *, lower: float = -3.0, upper: float = 3.0) -> Robot:
    """A ball of 0.1 m at some distance along x from a hinge about z, and on it a second one with a rod of 1 m: radius 0.1."""
    base, elbow = np.eye(4), np.eye(4)
    elbow[0, 3] = 0.5
    return Robot(
        name="boom",
        joints=(
            Joint(name="a", kind="revolute", parent=-1, T_parent_joint=base),
            Joint(name="b", kind="revolute", parent=0, T_parent_joint=elbow),
        ),
        capsules=(
            LinkCapsule(name="post", joint=-1, a=(distance, 0, 0), b=(distance, 0, 0), radius=0.1),
            LinkCapsule(name="stub", joint=0, a=(0, 0, 0), b=(0.3, 0, 0), radius=0.05),
            LinkCapsule(name="rod", joint=1, a=(0, 0, 0), b=(1, 0, 0), radius=0.1),
        ),
        frames=(Frame(name="tip", joint=1, T_joint_frame=np.eye(4)),),
        tip="tip",
        lower=np.array([lower, -3]),
        upper=np.array([upper, 3]),
        velocity=np.ones(2),
        acceleration=np.ones(2),
    )


@pytest.mark.parametrize(
    ("distance", "limits", "reason"),
    [
        (1.6, {}, "checked"),  # within the reach of 1.5 + 0.2
        (1.69, {}, "checked"),  # only just, and not in a thousand samples
        (1.74, {}, "checked"),  # out of reach, and nearer than 50 mm at times
        (1.76, {}, "cannot meet"),
        (9.0, {}, "cannot meet"),
        (1.6, {"lower": 2.0, "upper": 2.2}, "cannot meet"),  # turned away from it
    ],
)
def test_what_the_reach_decides_is_decided(distance: float, limits: dict[str, float], reason: str) -> None:
    found = {pair.links: pair for pair in find_self_pairs(post_and_boom(distance, **limits)).found}
    assert found["post", "rod"].reason == reason


def test_a_pair_that_is_never_seen_to_meet_but_can_stays_in() -> None:
    # The post is met only where the boom is stretched and turned by 1 rad, within about 0.1 either way.
    robot = post_and_boom(1.69)
    post, *others = robot.capsules
    turned = replace(post, a=1.69 * np.array([math.cos(1), math.sin(1), 0]), b=1.69 * np.array([math.cos(1), math.sin(1), 0]))
    robot = replace(robot, capsules=(turned, *others))
    pair = {pair.links: pair for pair in find_self_pairs(robot, samples=200).found}["post", "rod"]
    assert pair.met == 0
    assert pair.reason == "checked"
    assert link_clearance(robot, np.array([1.0, 0.0]), "post", "rod") < 0


def test_a_joint_that_cannot_move_ties_links_rigidly() -> None:
    robot = post_and_boom(1.0)
    still = replace(robot, lower=np.array([1.0, -3]), upper=np.array([1.0, 3]))
    assert {pair.links: pair.reason for pair in find_self_pairs(still).found}["post", "stub"] == "rigid"
    assert {pair.links: pair.reason for pair in find_self_pairs(robot).found}["post", "stub"] != "rigid"


def test_reasons_and_pairs_of_an_arm_with_a_tool() -> None:
    rod = urdf_text.collision('<cylinder radius="0.05" length="0.4"/>', xyz="0 0 0.2")
    side = urdf_text.collision('<sphere radius="0.05"/>', xyz="0.3 0 -0.1")
    text = urdf_text.robot(
        urdf_text.link("base", urdf_text.collision('<sphere radius="0.1"/>')),
        *(urdf_text.link(name, rod) for name in ("upper", "fore")),
        urdf_text.link("flange"),
        urdf_text.link("tool", side),
        urdf_text.joint("shoulder", "base", "upper", axis="1 0 0"),
        urdf_text.joint("elbow", "upper", "fore", xyz="0 0 0.5", axis="1 0 0"),
        urdf_text.joint("wrist", "fore", "flange", xyz="0 0 0.5", axis="0 0 1"),
        urdf_text.joint("screw", "flange", "tool", kind="fixed"),
    )
    robot = urdf_text.loaded(text)
    reasons = {pair.links: pair.reason for pair in find_self_pairs(robot).found}
    assert reasons == {
        ("base", "upper"): "adjacent",
        ("base", "fore"): "cannot meet",
        ("base", "tool"): "cannot meet",
        ("fore", "upper"): "cannot meet",  # neighbours with a gap
        ("fore", "tool"): "cannot meet",  # the tool turns about the forearm, 0.25 m off
        ("tool", "upper"): "cannot meet",
    }
    assert robot.self_pairs == ()
    assert any("0 pairs" in note for note in robot.notes)


def test_neighbours_that_meet_at_times_are_told_in_a_note() -> None:
    rod = urdf_text.collision('<cylinder radius="0.02" length="0.4"/>', xyz="0 0 0.25")
    text = urdf_text.robot(
        *(urdf_text.link(name, rod) for name in ("base", "upper")),
        urdf_text.joint(
            "shoulder", "base", "upper", xyz="0 0 0.5", axis="1 0 0", limit='lower="-3.1" upper="3.1" velocity="1"'
        ),
    )
    robot = urdf_text.loaded(text)
    (pair,) = find_self_pairs(robot).found
    assert pair.reason == "adjacent"
    assert 0 < pair.met < NEARLY_ALWAYS
    assert any("'base' and 'upper' are neighbours" in note for note in robot.notes)


def test_links_that_always_meet_are_told_in_a_note() -> None:
    ball = urdf_text.collision('<sphere radius="0.5"/>')
    text = urdf_text.robot(
        *(urdf_text.link(name, ball) for name in ("base", "upper", "fore")),
        urdf_text.joint("a", "base", "upper", xyz="0 0 0.2", axis="1 0 0"),
        urdf_text.joint("b", "upper", "fore", xyz="0 0 0.2", axis="1 0 0"),
    )
    robot = urdf_text.loaded(text)
    assert {pair.links: pair.reason for pair in find_self_pairs(robot).found}["base", "fore"] == "always"
    (note,) = [note for note in robot.notes if note.startswith("'base' and 'fore': overlap by ")]
    assert "a fault of the model; that pair is not checked; correct the shapes, or allow the pair in the SRDF" in note


def test_many_pairs_that_always_meet_are_told_in_one_note() -> None:
    ball, names = urdf_text.collision('<sphere radius="0.5"/>'), [f"link_{i}" for i in range(6)]
    joints = [urdf_text.joint(f"j{i}", names[i], names[i + 1], xyz="0 0 0.1", axis="1 0 0") for i in range(5)]
    robot = urdf_text.loaded(urdf_text.robot(*(urdf_text.link(name, ball) for name in names), *joints))
    always = [pair for pair in robot.unchecked if pair.reason == "always"]
    told = [note for note in robot.notes if "in every configuration" in note]
    assert len(always) > 6
    assert len(told) == 1
    assert told[0].startswith(f"{len(always)} pairs of links overlap in every configuration")
    assert f"({len(always) - 6} more)" in told[0]


def test_the_same_seed_gives_the_same_answer_and_no_sample_is_enough_for_the_proofs() -> None:
    robot = srdf_text.loaded(srdf_text.two_arms(), tip="left_tool")
    assert find_self_pairs(robot, seed=3) == find_self_pairs(robot, seed=3)
    assert find_self_pairs(robot, seed=3).found != find_self_pairs(robot, seed=4).found
    assert find_self_pairs(robot, samples=0).samples == 1  # the one nearest to 0
    assert set(find_self_pairs(robot, samples=3000).pairs) == set(robot.self_pairs)


def test_two_arms_keep_clear_of_each_other() -> None:
    robot = srdf_text.loaded(srdf_text.two_arms(), tip="left_tool")
    for left, right in itertools.product(("left_fore", "left_hand"), ("right_fore", "right_hand")):
        assert (left, right) in robot.self_pairs
    assert not any(first.startswith("right") and second.startswith("left") for first, second in robot.self_pairs)


def test_robots_without_an_envelope_or_a_word_about_it_have_no_pairs() -> None:
    assert load_robot("zhang2022").self_pairs == ()
    text = srdf_text.two_arms()
    assert srdf_text.loaded(text, tip="left_tool", collision="none").self_pairs == ()
    assert srdf_text.loaded(text, tip="left_tool", self_collision="none").self_pairs == ()
    assert (
        load_robot("zhang2022", self_collision="computed").notes[-1].startswith("self-collision was computed: 1 pair of links")
    )
    assert find_self_pairs(load_robot("zhang2022", collision="none")).found == ()


@pytest.mark.parametrize(("case", "options"), [("samples below 0", {"samples": -1}), ("seed that is no number", {"seed": "x"})])
def test_numbers_that_are_none_are_refused(case: str, options: dict[str, int]) -> None:
    assert_refused("robot", case, RobotError, lambda: find_self_pairs(load_robot("zhang2022"), **options))


YAML = """\
spacearm-robot: 1
name: arm
link_radius: 0.1
joints:
  - {name: a, kind: revolute, parent: base, child: upper, axis: [1, 0, 0], lower: -1, upper: 1, velocity: 2}
  - {name: b, kind: revolute, parent: upper, child: fore, xyz: [0, 0, 1], axis: [1, 0, 0], lower: -3, upper: 3, velocity: 1}
  - {name: c, kind: revolute, parent: fore, child: hand, xyz: [0, 0, 1], axis: [1, 0, 0], lower: -3, upper: 3, velocity: 1}
capsules:
  - {link: base, from: [0, 0, 0], to: [0, 0, 0]}
  - {link: upper, from: [0, 0, 0], to: [0, 0, 1]}
  - {link: hand, from: [0, 0, 0], to: [0, 0, 1]}
"""


def test_a_robot_file_may_say_which_links_must_keep_clear(tmp_path: Path) -> None:
    def pairs(line: str, **options: str) -> tuple[tuple[str, str], ...]:
        path = tmp_path / "arm.yaml"
        path.write_text(YAML + line)
        return load_robot(path, **options).self_pairs  # type: ignore[arg-type]

    assert pairs("") == pairs("self_collision: none\n") == ()
    assert pairs("self_collision: computed\n") == pairs("", self_collision="computed") == (("base", "hand"), ("hand", "upper"))
    assert pairs("self_collision: [[hand, base]]\n") == (("base", "hand"),)
    assert pairs("self_collision: [[hand, base]]\n", self_collision="none") == ()
    assert pairs("self_collision: [[hand, base]]\n", collision="none") == ()
    for case, error, line in [
        ("self pair of three", RobotError, "[[hand, base, upper]]"),
        ("self pair of one link", RobotError, "[[hand, hand]]"),
        ("self pair of an unknown link", RobotError, "[[hnd, base]]"),
        ("self pair of a link without capsules", RobotError, "[[fore, base]]"),
        ("self_collision mistyped", FileFormatError, "compute"),
    ]:
        assert_refused("robot_file", case, error, lambda line=line: pairs(f"self_collision: {line}\n"), path=tmp_path)


@WITH_MBM
def test_the_pairs_that_pandas_srdf_disables_are_found_but_for_one_that_can_meet() -> None:
    data = Path(str(MBM))
    options = {"srdf": data / "panda.srdf", "group": "panda_arm"}
    by_srdf = load_robot(data / "panda_spherized.urdf", **options)  # type: ignore[arg-type]
    found = find_self_pairs(by_srdf)
    assert set(by_srdf.self_pairs) <= set(found.pairs)
    reasons = {pair.links: pair.reason for pair in found.found}
    adjacent = [(f"panda_link{i}", f"panda_link{i + 1}") for i in range(7)]
    assert all(reasons[pair] == "adjacent" for pair in adjacent)
    # Disabled there as one that never meets, and it does.
    meets = {pair.links: pair.met for pair in found.found}["panda_link2", "panda_link6"]
    assert meets > 0
    assert math.isclose(meets, 0.004, abs_tol=0.004)
