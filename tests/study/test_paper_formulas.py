"""Equations (1)-(7) and (10), (11) of the paper, by hand, and against the formulas in NumPy."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from spacearm.robot import forward_kinematics
from spacearm.study.paper_problem import (
    GOAL_POSITION,
    OBSTACLE_CENTERS,
    START_POSITION,
    PaperSettings,
    paper_objective,
    paper_robot,
    paper_terms,
)

Array = NDArray[np.float64]

CENTERS, GOAL = np.array(OBSTACLE_CENTERS), np.array(GOAL_POSITION)
UPPER_ARM, FOREARM, HAND = 0.668, 0.4128, 0.2552
ROUNDING = 1e-12  # [m] of a few additions and square roots in float64


def values(objective: Any, q: Array) -> tuple[Array, Array]:
    """Return fitness and violation of configurations (k, 7)."""
    fitness, violation = objective.evaluate(np.ascontiguousarray(q))
    return np.asarray(fitness, dtype=np.float64), np.asarray(violation, dtype=np.float64)


def planar(shoulder: float, elbow: float, wrist: float) -> tuple[Array, Array]:
    """Return a configuration (7,) that moves in the plane z = 0, and its joint centres (4, 3) by trigonometry."""
    points = [np.zeros(3)]
    angle = math.pi / 2
    for turn, length in ((shoulder, UPPER_ARM), (elbow, FOREARM), (wrist, HAND)):
        angle += turn
        points.append(points[-1] + length * np.array([math.cos(angle), math.sin(angle), 0]))
    return np.array([shoulder, 0, 0, elbow, 0, 0, wrist]), np.array(points)


def terms_of(points: Array) -> Array:
    """Equations (5), (6), (7) for joint centres (4, 3)."""
    f1 = sum(math.dist(p, center) for p in points for center in CENTERS)
    f3 = math.dist(points[-1], GOAL)
    return np.array([f1, math.sqrt(f3**2 + 1), f3])


def shortfall(points: Array, radius: float) -> float:
    """By how much the links come closer to an obstacle's centre than A_R, summed over links and obstacles, eqs. (1)-(3)."""
    total = 0.0
    for a, b in itertools.pairwise(points):
        for center in CENTERS:
            along = float((center - a) @ (b - a) / ((b - a) @ (b - a)))
            total += max(0.0, radius - math.dist(a + min(1, max(0, along)) * (b - a), center))
    return total


def test_the_stretched_arm_by_hand() -> None:
    points = np.array([(0, 0, 0), (0, 0.668, 0), (0, 1.0808, 0), (0, 1.336, 0)])
    from_shoulder = math.sqrt(0.5) + math.sqrt(0.65) + math.sqrt(0.68)
    from_elbow = math.hypot(0.5, 0.168) + math.hypot(0.4, 0.032) + math.hypot(0.2, 0.132)
    from_wrist = math.hypot(0.5, 0.5808) + math.hypot(0.4, 0.3808) + math.hypot(0.2, 0.2808)
    from_tip = math.hypot(0.5, 0.836) + math.hypot(0.4, 0.636) + math.hypot(0.2, 0.536)
    to_goal = math.hypot(0.7, 1.036)
    expected = (from_shoulder + from_elbow + from_wrist + from_tip, math.sqrt(0.7**2 + 1.036**2 + 1), to_goal)
    np.testing.assert_allclose(paper_terms(np.zeros(7)), expected, rtol=0, atol=ROUNDING)
    np.testing.assert_allclose(terms_of(points), expected, rtol=0, atol=ROUNDING)
    assert tuple(points[-1]) == START_POSITION


turns = st.tuples(st.floats(-2.7, 2.7), st.floats(-2.6, 2.9), st.floats(-1.3, 3.1))


@given(turns, st.sampled_from([0.06, 0.1, 0.15]), st.sampled_from(["goal", "literal"]))
def test_planar_configurations_follow_the_formulas(turn: tuple[float, float, float], radius: float, mode: str) -> None:
    q, points = planar(*turn)
    settings = PaperSettings()
    terms = terms_of(points)
    np.testing.assert_allclose(paper_terms(q, radius=radius), terms, rtol=0, atol=ROUNDING)
    fitness, violation = values(paper_objective(settings, mode, radius), q[None])
    np.testing.assert_allclose(fitness, [terms @ settings.weights], rtol=0, atol=ROUNDING)
    beyond = max(0.0, terms[2] - settings.tolerance) if mode == "goal" else 0.0
    np.testing.assert_allclose(violation, [shortfall(points, radius) + beyond], rtol=0, atol=ROUNDING)


@given(st.data())
def test_any_configuration_follows_the_formulas_on_its_joint_centres(data: st.DataObject) -> None:
    robot = paper_robot()
    q = np.array([data.draw(st.floats(float(low), float(high))) for low, high in zip(robot.lower, robot.upper, strict=True)])
    frames = ("upper_arm", "forearm", "link_6", "end_effector")
    points = np.array([forward_kinematics(robot, q, frame=frame)[:3, 3] for frame in frames])
    np.testing.assert_allclose(paper_terms(q), terms_of(points), rtol=0, atol=1e-10)
    _, violation = values(paper_objective(PaperSettings(), "literal", 0.1), q[None])
    np.testing.assert_allclose(violation, [shortfall(points, 0.1)], rtol=0, atol=1e-10)
