"""Margins of pairs, lower and higher; and pairs that are near at an end, held by the order of a motion's instants."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from kernel import objectives
from kernel.builds import Build, surround
from spacearm.geometry import Box, Obstacle, Sphere
from spacearm.robot import LinkShape
from support.kernel_cases import TERMS, coarsely_looked_at, instants, looked_at
from support.oracles import coal_shapes, pinocchio_points
from support.small_robots import CARRIAGE_RADIUS as RADIUS
from support.small_robots import slider

BALLS = [Sphere((0.0, 0.0, 0.0), 0.2), Sphere((0.25, 0.0, 0.0), 0.1), Sphere((0.5, 0.0, -0.8), 0.1)]
"""A cradle of two balls, and something else."""
REQUIRED, MARGIN = 0.1, 0.02  # of the pair in question, and of all others [m]


def ints(*values: int) -> np.ndarray:
    return np.array(values, dtype=np.int32)


def cradle(at_start: float, *at_goal: float) -> dict[str, dict[str, np.ndarray]]:
    """The carriage and both balls of the cradle as one near pair."""
    least = min(at_start, *at_goal)
    rows = {"body": ints(0, 0), "obstacle": ints(0, 1), "other": ints(-1, -1)}
    return {
        "pair_margins": {**rows, "margin": np.full(2, least)},
        "near_pairs": {
            "pair": ints(0, 0),
            **rows,
            "required": np.array([REQUIRED]),
            "at_start": np.array([at_start]),
            "at_goal": np.array([at_goal]),
        },
    }


def held(clearance: np.ndarray, at_start: float, at_goal: float) -> np.ndarray:
    """What a pair with these clearances (instants,) in order has to keep at each: the rule, by its words."""
    out_at = np.flatnonzero(clearance >= REQUIRED)
    if not len(out_at):
        return np.full(len(clearance), min(at_start, at_goal))
    index = np.arange(len(clearance))
    return np.where(index < out_at[0], at_start, np.where(index > out_at[-1], at_goal, REQUIRED))


def to_ball(q: np.ndarray, ball: Sphere) -> np.ndarray:
    return np.linalg.norm(q - ball.center[[0, 2]], axis=-1) - ball.radius - RADIUS


START, GOALS = np.array([0.0, 0.34]), np.array([[0.4, 0.16], [0.9, 0.9]])  # 40 mm, 19 mm and far from the cradle
CASES = {"near at the start": (0.0399, 0.1, 1), "near at both": (0.0399, 0.015, 0), "near at the goal": (0.1, 0.015, 0)}


@pytest.mark.parametrize("case", CASES)
def test_a_near_pair_is_held_by_the_order_of_the_motion(build: Build, case: str) -> None:
    at_start, at_goal, goal = CASES[case]
    start = START if at_start < REQUIRED else np.array([-0.5, 0.6])
    others = [at_goal if k == goal else REQUIRED for k in range(2)]
    search = objectives.motion_search(build, slider(), BALLS, start, GOALS, margin=MARGIN, **cradle(at_start, *others))
    rng = np.random.default_rng(len(case))
    K = 3
    along = np.linspace(start, GOALS[goal], K + 2)[1:-1].ravel()
    rows = build.array(along + rng.choice([0.02, 0.1, 0.4], (300, 1)) * rng.normal(size=(300, 2 * K)) + np.tile([0, 0.15], K))
    judged = search.judge(rows, K, goal)
    found, free = np.array(judged.violation), np.array(judged.free)
    fine = looked_at(build, rows, K, start, GOALS[goal])
    coarse = coarsely_looked_at(build, rows, K, start, GOALS[goal])
    expected, broken = np.zeros(len(rows)), np.zeros(len(rows), dtype=bool)
    kinds = set()
    for i in range(len(rows)):
        for q, packs in ((coarse[i], 2), (fine[i], 8)):
            clearance = np.minimum(to_ball(q, BALLS[0]), to_ball(q, BALLS[1]))
            asked = held(clearance, at_start, at_goal)
            # Both balls fall short of what is asked for everywhere; of what is asked for beyond, the pair does.
            least = min(at_start, at_goal)
            short = sum(np.maximum(least - to_ball(q, ball), 0).sum() for ball in BALLS[:2])
            short += np.maximum(asked - np.maximum(clearance, least), 0).sum()
            short += np.maximum(MARGIN - to_ball(q, BALLS[2]), 0).sum()
            if packs == 2:
                expected[i] = short
            broken[i] |= bool(short > 1e-5)
        kinds.add((bool((clearance >= REQUIRED).any()), bool(broken[i])))
    np.testing.assert_allclose(found, expected, rtol=1e-3, atol=1e-4)
    unclear = np.array([0 < value < 1e-4 for value in expected])  # what float rounds away
    assert (free == ~broken)[~unclear].mean() > 0.99
    assert len(kinds) >= 2
    assert 5 < free.sum() < 290
    np.testing.assert_array_equal(instants(build, 8)[::4], instants(build, 2))


def judged_one(build: Build, points: Any, at_start: float, at_goal: float, start: Any, goal: Any) -> tuple[float, bool]:
    search = objectives.motion_search(
        build, slider(), BALLS[:2], np.array(start), np.array([goal]), margin=0.0, **cradle(at_start, at_goal)
    )
    judged = search.judge(build.array(np.array(points).reshape(1, -1)), len(points), 0)
    return float(judged.violation[0]), bool(judged.free[0])


def test_an_arm_that_leaves_its_cradle_must_not_come_back(build: Build) -> None:
    straight_up = [[0.0, 0.4], [0.0, 0.6], [0.0, 0.8]]
    assert judged_one(build, straight_up, 0.04, REQUIRED, START, (0.0, 1.0)) == (0.0, True)
    nearer_first = [[0.0, 0.30], [0.0, 0.30], [0.0, 0.8]]
    violation, free = judged_one(build, nearer_first, 0.04, REQUIRED, START, (0.0, 1.0))
    assert violation > 0
    assert not free
    back_again = [[0.0, 0.9], [0.0, 0.9], [0.0, 0.05], [0.0, 0.05], [0.0, 0.9]]  # to where it may be before it is out
    violation, free = judged_one(build, back_again, 0.04, REQUIRED, START, (0.0, 1.0))
    assert violation > 0
    assert not free


def test_a_pair_that_never_gets_out_is_held_to_the_lesser(build: Build) -> None:
    start, goal = (0.0, 0.34), (0.05, 0.33)
    least = float(min(to_ball(np.array(q), ball) for q in (start, goal) for ball in BALLS[:2]))
    along = np.linspace(start, goal, 5)[1:-1].tolist()
    assert judged_one(build, along, 0.038, least - 1e-4, start, goal)[1]
    dip = (np.array(along) - [0, 0.02]).tolist()
    assert not judged_one(build, dip, 0.038, least - 1e-4, start, goal)[1]


def test_trees_know_no_order_and_find_a_way_out(build: Build) -> None:
    search = objectives.motion_search(build, slider(), BALLS, START, GOALS[1:], margin=MARGIN, **cradle(0.04, REQUIRED))
    found = objectives.run_motions(search, 400)
    assert found.best is not None
    assert np.array(found.judge(build.array(found.best.points.reshape(1, -1)), len(found.best.points), 0).free).all()


def test_links_are_near_pairs_too(build: Build) -> None:
    """The carriage and a plate on the base."""
    plate = LinkShape(name="plate", joint=-1, shape=Box((2.0, 2.0, 0.1)))
    carriage = LinkShape(name="carriage", joint=1, shape=Box((0.1, 0.1, 0.1)))
    robot = slider(plate, carriage, pairs=(("carriage", "plate"),))
    rows = {"body": ints(1), "obstacle": ints(-1), "other": ints(0)}
    given = {
        "pair_margins": {**rows, "margin": np.array([0.0299])},
        "near_pairs": {
            "pair": ints(0),
            **rows,
            "required": np.array([0.2]),
            "at_start": np.array([0.0299]),
            "at_goal": np.array([[0.2]]),
        },
    }
    start, goal = np.array([0.0, 0.13]), np.array([[0.0, 0.9]])  # 30 mm and 800 mm
    search = objectives.motion_search(build, robot, [], start, goal, margin=0.2, **given)
    for z, free in (([0.3, 0.5, 0.7], True), ([0.125, 0.125, 0.7], False), ([0.9, 0.9, 0.05, 0.05, 0.9], False)):
        points = build.array([[0.0, value] for value in z]).reshape(1, -1)
        assert bool(search.judge(points, len(z), 0).free[0]) == free


# ---- margins of pairs ------------------------------------------------------------------------------------------------


def test_a_pairs_margin_may_be_higher_than_all_others(build: Build) -> None:
    """What is far for the others, and would be passed over, is near for that pair: each pair by its own margin."""
    rng = np.random.default_rng(0)
    robot, obstacles = objectives.thick_arm(), [*objectives.CLUTTER]
    q = build.array(rng.uniform(robot.lower, robot.upper, (3 * build.lanes, robot.dof)))
    count, number = len(robot.shapes), len(obstacles)
    own = rng.choice([0.0, 0.001, 0.05, 0.6], (count, number))
    links = [part.name for part in robot.shapes]
    own = np.array([own[links.index(name)] for name in links])  # of each link one
    body, obstacle = (index.ravel().astype(np.int32) for index in np.indices((count, number)))
    for chosen in (np.arange(count * number), rng.permutation(count * number)[:5], np.zeros(0, dtype=int)):
        some = np.isin(
            np.array([f"{links[i]} {k}" for i, k in zip(body, obstacle, strict=True)]),
            [f"{links[body[j]]} {obstacle[j]}" for j in chosen],
        )
        given = {
            "body": body[some],
            "obstacle": obstacle[some],
            "other": np.full(some.sum(), -1, dtype=np.int32),
            "margin": own.ravel()[some],
        }
        model = surround(build, robot, obstacles, pair_margins=given)
        margin = np.where(some.reshape(count, number), own, 0.01)
        clear = model.native.obstacle_clearances(q).astype(np.float64)
        moving = np.array([part.joint >= 0 for part in robot.shapes])
        expected = np.maximum(margin - clear, 0)[:, moving].sum(axis=(1, 2))
        expected += np.maximum(0.01 - model.native.pair_clearances(q, model.pairs), 0).sum(axis=1)
        found = model.native.shortfalls(q, 0.01, False)
        np.testing.assert_allclose(found, expected, rtol=1e-4, atol=1e-4 if build.bits == 32 else 1e-9)


def test_no_more_is_preferred_of_a_pair_than_its_own_lower_margin(build: Build) -> None:
    """The term `clearance` on either side of the margin that is required: one rule for pairs of any margin."""
    start, goal, preferred, K = np.array([-0.6, 0.45]), np.array([0.6, 0.45]), 0.3, 1
    rows = build.array([[0.0, 0.45]])
    q = coarsely_looked_at(build, rows, K, start, goal)[0]
    for own in (0.005, 0.15, 0.5):
        given = {"body": ints(0), "obstacle": ints(0), "other": ints(-1), "margin": np.array([own])}
        search = objectives.motion_search(
            build,
            slider(),
            BALLS,
            start,
            goal,
            margin=MARGIN,
            preferred_clearance=preferred,
            weights={"clearance": 1.0},
            pair_margins=given,
        )
        asked = [own if own < MARGIN else preferred, preferred, preferred]
        lacks = sum(np.maximum(level - to_ball(q, ball), 0) for level, ball in zip(asked, BALLS, strict=True))
        found = search.judge(rows, K, 0).terms[0, TERMS.index("clearance")]
        assert found == pytest.approx(np.mean(lacks), rel=1e-3)


def test_of_one_pair_the_last_margin_counts(build: Build) -> None:
    q = build.array([[0.0, 0.5]])
    for margins in ([0.3, 0.0], [0.0, 0.3]):
        given = {"body": ints(0, 0), "obstacle": ints(0, 0), "other": ints(-1, -1), "margin": np.array(margins)}
        found = surround(build, slider(), BALLS[:1], pair_margins=given).native.shortfalls(q, 0.1, False)
        assert found[0] == pytest.approx(max(0.0, margins[-1] - 0.2), abs=1e-6)


def test_the_sliders_place_is_what_it_says() -> None:
    q = np.array([[0.3, 0.7], [-1.0, 0.2]])
    frames = pinocchio_points.joint_frames(slider(), q)
    np.testing.assert_allclose(frames[:, 1, :3, 3], np.column_stack([q[:, 0], [0, 0], q[:, 1]]), atol=1e-15)
    ball: Obstacle = BALLS[0]
    (placed,) = coal_shapes.placed_obstacle(ball)
    sphere = coal_shapes.placed_capsule(frames[0, 1, :3, 3], frames[0, 1, :3, 3], RADIUS)
    assert coal_shapes.distance(sphere, placed) == pytest.approx(to_ball(q[0], BALLS[0]))
