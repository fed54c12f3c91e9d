"""A share of benchmarks/soak_robots.py: robots as files have them, proven motions, and a checker that knows only the draft."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from spacearm.motion import Motion, Trajectory
from spacearm.planner import Problem
from spacearm.proof import Certificate, certify
from spacearm.robot.unchecked_pairs import bare_links, unchecked_pairs
from support.drawn_robots import Draft, complaints, drawn_robot, loaded, look_at, placed_capsules


@pytest.mark.parametrize("number", range(6))
def test_what_is_proven_of_a_drawn_robot_is_true(number: int) -> None:
    wrong, became = look_at(1, number, instants=30)
    assert not wrong
    assert became


def settled(seed: int) -> tuple[Draft, Certificate, Trajectory]:
    """A drawn robot that stays where it is, proven."""
    for number in range(40):
        draft = drawn_robot(np.random.default_rng((seed, number)))
        robot = loaded(draft)
        q = (np.maximum(robot.lower, -1) + np.minimum(robot.upper, 1)) / 2
        trajectory = Trajectory(robot, Motion([q, q]), duration=1.0)
        certificate = certify(Problem(robot, [], start=q, goal=q), trajectory)
        if certificate.holds and len(draft.capsules) > 1 and draft.drawn:
            return draft, certificate, trajectory
    raise AssertionError


def test_the_checker_sees_what_is_wrong() -> None:
    draft, certificate, trajectory = settled(2)
    assert complaints(draft, certificate, trajectory, 3) == []
    assert any("not named" in said for said in complaints(draft, replace(certificate, bare=()), trajectory, 3))
    q = dict(zip(trajectory.robot.dof_names, trajectory.sample(0.0).q.tolist(), strict=True))
    one = next(iter(placed_capsules(draft, q).values()))[0]
    draft.balls.append((one[0], one[0], one[2]))
    assert any("an obstacle" in said for said in complaints(draft, certificate, trajectory, 3))
    draft.balls.pop()
    draft.grown = 2 * draft.size
    if len(unchecked_pairs(trajectory.robot)) < len(draft.capsules) * (len(draft.capsules) - 1) // 2:
        assert any("penetrate" in said for said in complaints(draft, certificate, trajectory, 3))


def test_links_with_a_drawn_shape_only_are_those_without_an_envelope() -> None:
    for number in range(20):
        draft = drawn_robot(np.random.default_rng((3, number)))
        assert set(bare_links(loaded(draft))) == draft.drawn
