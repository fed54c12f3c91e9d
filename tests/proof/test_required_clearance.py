"""The required clearance by pair, and the rule for pairs near at an end, by their definitions."""

from __future__ import annotations

import pickle
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import spacearm as sa
from spacearm.core.errors import ProblemError
from spacearm.geometry import Scene, Sphere
from spacearm.proof import DEFAULT_CLEARANCE, PairClearance
from spacearm.proof.required_clearance import (
    HELD_BACK,
    held_to,
    out_level,
    pair_clearance_as_dict,
    required_clearance,
)
from spacearm.robot import LinkCapsule
from support.dense_samples import planar


def robot_of(*links: str) -> sa.Robot:
    capsules = [LinkCapsule(name=name, joint=i - 1, a=np.zeros(3), b=np.ones(3), radius=0.1) for i, name in enumerate(links)]
    return planar(capsules=tuple(capsules), self_pairs=(("base", "hand"),))


ROBOT = robot_of("base", "arm", "hand")
SCENE = Scene([Sphere((5, 0, 0), 1, name="client"), Sphere((6, 0, 0), 1), Sphere((7, 0, 0), 1, name="deck")])


def table(*by_pair: PairClearance) -> tuple[list[list[float]], list[list[float]]]:
    found = required_clearance(ROBOT, SCENE, 1.0, by_pair)
    assert found.links == ("base", "arm", "hand")
    return found.to_obstacles.tolist(), found.between_links.tolist()


def test_the_more_specific_value_counts_then_the_later_one() -> None:
    by_obstacle, by_link = PairClearance(2, obstacle="client"), PairClearance(3, link="hand")
    both, links = PairClearance(4, link="hand", obstacle="client"), PairClearance(5, link="hand", other_link="base")
    ones = [[1.0] * 3] * 3
    assert table() == (ones, ones)
    assert table(by_obstacle) == ([[2, 1, 1]] * 3, ones)
    assert table(by_link) == ([[1, 1, 1], [1, 1, 1], [3, 3, 3]], [[1, 1, 3], [1, 1, 3], [3, 3, 3]])
    assert table(by_obstacle, by_link)[0] == [[2, 1, 1], [2, 1, 1], [3, 3, 3]]
    assert table(by_link, by_obstacle)[0] == [[2, 1, 1], [2, 1, 1], [2, 3, 3]]
    for order in ((both, by_link, by_obstacle), (by_obstacle, both, by_link)):
        assert table(*order)[0][2][0] == 4
    for order in ((links, by_link), (by_link, links)):
        assert table(*order)[1] == [[1, 1, 5], [1, 1, 3], [5, 3, 3]]


def test_names_that_are_none_are_refused_with_the_nearest_one() -> None:
    for pair, said in (
        (PairClearance(1, obstacle="clint"), "obstacle 'clint', which is none; did you mean 'client'\\? known: client, deck"),
        (PairClearance(1, link="hnd"), "link 'hnd', which has no shape or is none; did you mean 'hand'"),
        (PairClearance(1, link="hand", other_link="bse"), "did you mean 'base'"),
        (PairClearance(1, link="arm", other_link="hand"), "'arm' and 'hand', which are not kept apart"),
    ):
        with pytest.raises(ProblemError, match=said):
            table(pair)
    with pytest.raises(ProblemError, match="none is known"):
        required_clearance(ROBOT, Scene([Sphere((5, 0, 0), 1)]), 1.0, [PairClearance(1, obstacle="client")])


@pytest.mark.parametrize(
    ("made", "said"),
    [
        (lambda: PairClearance(-0.1, link="a"), "a pair's clearance is -0.1"),
        (lambda: PairClearance(np.nan, link="a"), "a pair's clearance is nan"),
        (lambda: PairClearance(0.1), "names nothing, expected obstacle, link, or two links"),
        (lambda: PairClearance(0.1, other_link="a"), "expected two links, or a link and an obstacle"),
        (lambda: PairClearance(0.1, link="b", other_link="a", obstacle="c"), "expected two links, or a link and an obstacle"),
        (lambda: PairClearance(0.1, link="a", other_link="a"), "are both 'a', expected two links"),
        (lambda: PairClearance(0.1, link=3), "a pair's link"),  # type: ignore[arg-type]
        (lambda: PairClearance(0.1, obstcle="a"), "did you mean 'obstacle'"),  # type: ignore[call-arg]
        (lambda: required_clearance(ROBOT, SCENE, -1.0), "clearance is -1"),
        (lambda: required_clearance(ROBOT, SCENE, 1.0, PairClearance(1, link="hand")), "expected a row of PairClearance"),  # type: ignore[arg-type]
        (lambda: required_clearance(ROBOT, SCENE, 1.0, [0.1]), r"clearances\[0\] is 0.1"),  # type: ignore[list-item]
    ],
)
def test_what_cannot_be_is_refused(made: Any, said: str) -> None:
    with pytest.raises(ProblemError, match=said):
        made()


def test_a_pairs_clearance_is_a_value() -> None:
    one = sa.PairClearance(0.05, link="hand", obstacle="client")
    assert pickle.loads(pickle.dumps(one)) == one == PairClearance(0.05, obstacle="client", link="hand")
    assert one != PairClearance(0.05, obstacle="client")
    assert one.names == "link 'hand' and obstacle 'client'"
    assert pair_clearance_as_dict(one) == {"link": "hand", "obstacle": "client", "clearance": 0.05}
    assert pair_clearance_as_dict(PairClearance(0, obstacle="a")) == {"obstacle": "a", "clearance": 0.0}
    two = PairClearance(0.02, link="a", other_link="b")
    assert pair_clearance_as_dict(two) == {"links": ["a", "b"], "clearance": 0.02}
    assert required_clearance(ROBOT, SCENE).to_obstacles.min() == DEFAULT_CLEARANCE == 0.01


# ---- near at an end --------------------------------------------------------------------------------------------------

lengths = st.floats(-0.02, 0.03)


@given(lengths, st.sampled_from([0.0, 1e-3, 0.01]))
def test_what_a_pair_is_held_to_is_a_little_less_than_it_has_or_what_is_required(has: float, r: float) -> None:
    held = float(held_to(has, r))
    assert 0 <= held <= r
    if has <= 0 or has >= r + 1e-6:
        assert held == r
    elif held < r:
        assert held < has
        assert has - held <= HELD_BACK + 1e-15
        assert held >= has / 2


def test_a_pair_is_out_where_there_is_room_for_a_proof() -> None:
    assert float(out_level(1.0, 0.01)) == pytest.approx(0.0101)
    assert float(out_level(0.0101, 0.01)) == pytest.approx(0.01005)
    assert float(out_level(0.010015, 0.01)) == np.inf
