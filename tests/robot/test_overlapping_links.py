"""What is found about pairs of links of any shape, by Coal; and links that always overlap are told, never hidden."""

from __future__ import annotations

import hashlib
import itertools
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spacearm.geometry import Box, moved_shape
from spacearm.planner import PlannerSettings, Problem, plan
from spacearm.robot import LinkShape, Robot, UncheckedPair, find_self_pairs
from spacearm.robot.kinematics import base_and_joint_frames
from spacearm.robot.model import robot_as_dict, robot_from_dict
from spacearm.robot.self_collision import LinkPair, _samples
from spacearm.robot.unchecked_pairs import fingerprint, rows_on_unchecked, words_on_unchecked
from support import srdf_text, strategies, urdf_text
from support.drawn_shapes import convex_shapes
from support.oracles.coal_shapes import distance, placed_shape

NEAR = 1e-6  # [m] nearer to contact Coal and we may differ


@st.composite
def robots_of_shapes(draw: st.DrawFn) -> Robot:
    """A tree of joints with shapes of every kind on some of them."""
    robot = draw(strategies.robots(max_joints=4))
    shapes = []
    for joint in range(-1, len(robot.joints)):
        parts = draw(st.lists(convex_shapes(), max_size=2))
        shapes += [LinkShape(name=f"link_{joint}", joint=joint, shape=shape) for shape in parts]
    return replace(robot, shapes=tuple(shapes), self_pairs=(), collision="envelope" if shapes else "none")


def coal_distances(robot: Robot, q: np.ndarray, links: tuple[str, str]) -> np.ndarray:
    """Signed distances (m,) of two links [m], by Coal."""
    out = []
    for T in base_and_joint_frames(robot, q):
        one, two = (
            [placed_shape(moved_shape(part.shape, T[part.joint + 1])) for part in robot.shapes if part.name == name]
            for name in links
        )
        out.append(min(distance(a, b) for a, b in itertools.product(one, two)))
    return np.array(out)


def require_right(robot: Robot, one: LinkPair, seen: np.ndarray, further: np.ndarray) -> None:
    """Compare what was found with Coal's distances in the same samples and in further ones."""
    if one.reason == "rigid":
        return
    assert (seen < -NEAR).mean() <= one.met <= (seen < NEAR).mean()
    if one.reason == "cannot meet":
        assert min(seen.min(), further.min()) > 0
    elif one.reason == "always":
        assert one.proven  # of so few samples nothing else is believed
        assert further.max() < NEAR
        assert one.depth <= -seen.max() + 2e-3
    elif one.reason == "checked" and not one.met:
        assert seen.min() > -NEAR


@settings(max_examples=30)
@given(robots_of_shapes())
def test_what_is_found_about_pairs_is_what_coal_finds(robot: Robot) -> None:
    found = find_self_pairs(robot, samples=30)
    assert [one.links for one in found.found] == list(itertools.combinations(sorted({p.name for p in robot.shapes}), 2))
    q, more = _samples(robot, 30, 0), _samples(robot, 40, 7)
    for one in found.found:
        require_right(robot, one, coal_distances(robot, q, one.links), coal_distances(robot, more, one.links))


@settings(max_examples=20)
@given(robots_of_shapes())
def test_what_comes_from_the_cache_is_what_was_computed(robot: Robot) -> None:
    first = find_self_pairs(robot, samples=20)
    with pytest.MonkeyPatch.context() as patch:
        again = find_self_pairs(robot, samples=20)
        patch.setenv("SPACEARM_CACHE", "off")
        computed = find_self_pairs(robot, samples=20)
    assert first == again == computed
    assert first.notes == computed.notes


def test_a_change_of_a_shape_a_joint_or_a_limit_is_another_robot() -> None:
    robot = servicer()
    names = [part.name for part in robot.shapes]
    box = robot.shapes[0]
    assert isinstance(box.shape, Box)
    others = [
        replace(robot, shapes=(replace(box, shape=replace(box.shape, rounding=0.01)), *robot.shapes[1:])),
        replace(robot, shapes=(replace(box, shape=replace(box.shape, size=(1.2, 1.2, 1.4))), *robot.shapes[1:])),
        replace(robot, lower=robot.lower + 0.1),
        replace(robot, joints=(replace(robot.joints[0], offset=0.1), *robot.joints[1:])),
    ]
    prints = [fingerprint(one, names) for one in (robot, *others)]
    assert len(set(prints)) == len(prints)
    assert fingerprint(replace(robot, velocity=robot.velocity * 2), names) == prints[0]


def servicer(**options: str) -> Robot:
    """A bus of 1.2 m, and on its deck an arm whose upper link can be folded into it."""
    rod = urdf_text.collision('<cylinder radius="0.055" length="0.75"/>', xyz="0 0 0.375")
    limits = 'lower="-2" upper="2" velocity="1" effort="1"'
    text = urdf_text.robot(
        urdf_text.link("bus", urdf_text.collision('<box size="1.2 1.2 1.5"/>')),
        urdf_text.link("shoulder", urdf_text.collision('<cylinder radius="0.055" length="0.1"/>', xyz="0 0 0.05")),
        urdf_text.link("upper", rod),
        urdf_text.joint("yaw", "bus", "shoulder", xyz="0.45 0.45 0.75", axis="0 0 1", limit=limits),
        urdf_text.joint("pitch", "shoulder", "upper", xyz="0 0 0.1", axis="0 1 0", limit=limits),
    )
    return urdf_text.loaded(text, **options)


def test_a_bus_that_is_a_box_does_not_swallow_the_shoulder() -> None:
    robot = servicer()
    assert ("bus", "upper") in robot.self_pairs
    stowed = Problem(robot, [], start=[0.0, np.pi / 2], goal=[0.3, 0.0], clearance=0.01)  # 45 mm over the deck
    assert plan(stowed, PlannerSettings(evaluations=500), rng=0).found
    inside = plan(replace(stowed, start=[-2.0, 1.8]), rng=0)  # folded inwards
    assert inside.status == "start_in_collision"
    assert "'bus'" in inside.message
    assert "'upper'" in inside.message


BALL = urdf_text.collision('<sphere radius="0.06"/>')


def with_an_overlap(srdf: str | None) -> Robot:
    """Three balls in a row, the last of which is in the first whatever the joints do."""
    joints = [
        urdf_text.joint("j1", "base", "a", xyz="0 0 0.1", axis="0 1 0"),
        urdf_text.joint("j2", "a", "b", xyz="0 0 0.06"),
        urdf_text.joint("j3", "b", "c", xyz="0 0 0.03"),
    ]
    text = urdf_text.robot(urdf_text.link("base"), *(urdf_text.link(name, BALL) for name in "abc"), *joints)
    return srdf_text.loaded(text, srdf) if srdf else srdf_text.loaded(text)


@pytest.mark.parametrize(
    "srdf", [None, srdf_text.srdf(srdf_text.disabled("a", "b"), srdf_text.disabled("b", "c"))], ids=["computed", "by an SRDF"]
)
def test_links_that_overlap_in_every_configuration_are_named_with_depth_and_remedy_everywhere(srdf: str | None) -> None:
    robot = with_an_overlap(srdf)
    (one,) = [one for one in robot.unchecked if one.reason == "always"]
    assert (one.links, one.proven) == (("a", "c"), True)
    assert 0.025 < one.depth <= 0.03  # the balls' middles are 0.09 m apart
    found = plan(Problem(robot, [], start=np.zeros(3), goal=[0.5, 0, 0]), PlannerSettings(evaluations=200), rng=0)
    assert found.found
    assert found.certificate is not None
    notes = " ".join(robot.notes)
    for said in (notes, found.message, found.certificate.message, str(rows_on_unchecked(robot.unchecked, ()))):
        assert all(name in said for name in ("a", "c"))
        assert " mm or more in every configuration" in said
        assert "a fault of the model" in said
        assert "correct the shapes, or allow the pair in the SRDF" in said
    assert robot_from_dict(robot_as_dict(robot)).unchecked == robot.unchecked


def test_welded_links_may_overlap_and_are_one_body() -> None:
    text = urdf_text.robot(
        *(urdf_text.link(name, BALL) for name in ("base", "bracket", "arm")),
        urdf_text.joint("weld", "base", "bracket", kind="fixed"),
        urdf_text.joint("j1", "bracket", "arm", xyz="0 0 0.5"),
    )
    robot = urdf_text.loaded(text)
    reasons = {one.links: one for one in find_self_pairs(robot).found}
    assert reasons["base", "bracket"].reason == "rigid"
    assert not any("fault" in note for note in robot.notes)


@pytest.mark.parametrize(("limit", "reason"), [(1.4, "always"), (1.5, "checked")])
def test_a_pair_that_is_free_in_few_configurations_is_checked(limit: float, reason: str) -> None:
    # Balls of 0.2 m, 0.3 m from the hinge, are apart beyond 2 asin(2 / 3) = 1.46 rad.
    text = urdf_text.robot(
        urdf_text.link("base", urdf_text.collision('<sphere radius="0.2"/>', xyz="0.3 0 0")),
        urdf_text.link("middle"),
        urdf_text.link("arm", urdf_text.collision('<sphere radius="0.2"/>', xyz="0.1 0 0")),
        urdf_text.joint("j1", "base", "middle", axis="0 0 1", limit=f'lower="{-limit}" upper="{limit}" velocity="1"'),
        urdf_text.joint("j2", "middle", "arm", xyz="0.2 0 0", axis="1 0 0", limit='lower="-0.1" upper="0.1" velocity="1"'),
    )
    robot = urdf_text.loaded(text)
    (one,) = find_self_pairs(robot).found
    assert (one.reason, one.met > 0.95) == (reason, True)
    assert any("leave hardly a motion" in note for note in robot.notes) == (reason == "checked")


def test_words_fold_pairs_by_reason_and_name_those_that_nobody_allowed(tmp_path: Path) -> None:
    pairs = [UncheckedPair(links=(f"a{i}", f"b{i}"), reason="rigid") for i in range(3)]
    pairs += [UncheckedPair(links=("c", "d"), reason="adjacent")]
    assert words_on_unchecked(pairs, ()) == "4 pairs of links not checked: 3 rigid to each other, 1 neighbours"
    pairs += [UncheckedPair(links=("e", f"f{i}"), reason="always", depth=0.0123, proven=i == 0) for i in range(5)]
    said = words_on_unchecked(pairs, ("camera",))
    assert "5 always in contact ('e' and 'f0' overlap by 12.3 mm or more in every configuration, 'e' and 'f1'" in said
    assert "in every configuration that was drawn" in said
    assert "and 2 more)" in said
    assert said.endswith("for want of an envelope: 'camera'")
    assert words_on_unchecked((), ()) == ""


def test_robots_of_capsules_keep_their_fingerprints() -> None:
    robot = with_an_overlap(None)
    expected = hashlib.sha256()
    for joint in robot.joints:
        expected.update(f"{joint.kind} {joint.parent} {joint.dof} {joint.multiplier!r} {joint.offset!r};".encode())
        expected.update(joint.T_parent_joint.tobytes())
    expected.update(robot.lower.tobytes() + robot.upper.tobytes())
    for one in robot.capsules:
        expected.update(f"{one.name!r} {one.joint} {one.radius!r};".encode() + one.a.tobytes() + one.b.tobytes())
    assert fingerprint(robot, "abc") == expected.hexdigest()
