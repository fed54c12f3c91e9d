"""What the kernel thinks of a motion, against formulas on SciPy's spline, Pinocchio's points and NumPy's distances."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kernel import accuracy, drawn, objectives
from kernel.builds import Build, surround
from spacearm.geometry import Capsule, HalfSpace, Obstacle, Sphere
from spacearm.robot import Robot, joint_centres
from support.kernel_cases import TERMS, by_scipy, instants, looked_at
from support.oracles import pinocchio_points
from support.oracles.solids import axes_distance, link_distance


@dataclass
class Setting:
    """A drawn robot among obstacles, with a search for motions from a start to two goals."""

    robot: Robot
    obstacles: list[Obstacle]
    start: np.ndarray
    goals: np.ndarray
    jerk: np.ndarray
    margin: float
    preferred_clearance: float
    weights: dict[str, float]
    search: Any


@st.composite
def drawn_settings(draw: st.DrawFn, build: Build) -> Setting:
    robot = draw(drawn.robots(max_joints=5))
    links = sorted({capsule.name for capsule in robot.capsules})
    robot = replace(robot, self_pairs=tuple(pairwise(links)))
    obstacles = draw(st.lists(drawn.obstacles(), max_size=3))
    start, *goals = draw(drawn.batches(robot, build, 3)).astype(np.float64)
    jerk = np.full(robot.dof, 3.0) if draw(st.booleans()) else np.zeros(0)
    margin, preferred = draw(st.sampled_from([0.0, 0.05])), draw(st.sampled_from([0.0, 0.2]))
    weights = {name: draw(st.sampled_from([0.0, 0.5, 2.0])) for name in TERMS}
    search = objectives.motion_search(
        build,
        robot,
        obstacles,
        start,
        goals,
        bounds=(np.full(robot.dof, -1e4), np.full(robot.dof, 1e4)),
        jerk=jerk,
        margin=margin,
        preferred_clearance=preferred,
        weights=weights,
    )
    return Setting(robot, obstacles, start, np.array(goals), jerk, margin, preferred, weights, search)


def axis_distances(setting: Setting, frames: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """How far the axes of links that move are from obstacles, and those of the robot's pairs from each other (rows, pairs) [m].

    And the radii (pairs,) to take off.
    """
    robot, distances, radii = setting.robot, [np.zeros((len(frames), 0))], []
    ends = pinocchio_points.points(frames, [(c.joint, end) for c in robot.capsules for end in (c.a, c.b)])
    a, b = ends[:, ::2], ends[:, 1::2]
    for i, one in enumerate(robot.capsules):
        if one.joint >= 0:
            distances += [link_distance(obstacle, a[:, i], b[:, i])[:, None] for obstacle in setting.obstacles]
            radii += [one.radius] * len(setting.obstacles)
        for k, other in enumerate(robot.capsules):
            if (one.name, other.name) in robot.self_pairs:
                distances.append(axes_distance(a[:, i], b[:, i], a[:, k], b[:, k])[:, None])
                radii.append(one.radius + other.radius)
    return np.hstack(distances), np.array(radii)


def shortfalls(setting: Setting, frames: np.ndarray, margin: float) -> np.ndarray:
    """By how much clearances fall short of a margin, summed over all pairs (rows,) [m]."""
    distances, radii = axis_distances(setting, frames)
    return np.maximum(0.0, margin + radii - distances).sum(axis=1)


def centre_of(obstacle: Obstacle) -> np.ndarray:
    """The obstacle's middle of the seed's eq. (5); of a half-space the point of its plane nearest to the origin."""
    if isinstance(obstacle, HalfSpace):
        return obstacle.normal * float(obstacle.normal @ obstacle.point)
    if isinstance(obstacle, Capsule):
        return (obstacle.a + obstacle.b) / 2
    return obstacle.center if isinstance(obstacle, Sphere) else obstacle.pose[:3, 3]  # type: ignore[union-attr]


def expected_terms(build: Build, setting: Setting, points: np.ndarray) -> dict[str, float]:
    """All terms, and the violation, of a motion through control points (K + 2, n)."""
    robot, K = setting.robot, len(points) - 2
    s = instants(build, 2)
    q, dq, ddq, dddq = (by_scipy(s, K, derivative) @ points for derivative in range(4))
    frames = pinocchio_points.joint_frames(robot, np.vstack([q, points[-1]]))
    tip_frame = robot.frame(robot.tip)
    tip = pinocchio_points.points(frames, [(tip_frame.joint, tip_frame.T_joint_frame[:3, 3])])[:, 0]
    way, end, frames = tip[:-1], tip[-1], frames[:-1]
    fastest = [np.abs(dq / robot.velocity).max(), np.sqrt(np.abs(ddq / robot.acceleration).max())]
    if setting.jerk.size:
        fastest.append(np.cbrt(np.abs(dddq / setting.jerk).max()))
    centres = pinocchio_points.points(frames, list(joint_centres(robot)))
    left = np.linalg.norm(way - end, axis=1)
    return {
        "length": float(np.linalg.norm(dq, axis=1).mean()),
        "duration": float(max(fastest)),
        "tip": float(np.linalg.norm(np.diff(tip, axis=0), axis=1).sum()),
        "clearance": float(shortfalls(setting, frames, setting.preferred_clearance).mean())
        if setting.preferred_clearance
        else 0.0,
        "smoothness": float((dddq**2).sum(axis=1).mean()),
        "f1": float(sum(np.linalg.norm(centres - centre_of(o), axis=-1).sum(axis=1).mean() for o in setting.obstacles)),
        "f2": float(np.sqrt(left**2 + 1).mean()),
        "f3": float(left.mean()),
        "violation": float(shortfalls(setting, frames, setting.margin).sum()),
    }


def allowed_errors(build: Build, setting: Setting, points: np.ndarray) -> dict[str, float]:
    """What each may be off by: rounding of the control points' sums, and of where these put the robot."""
    robot, K = setting.robot, len(points) - 2
    eps = float(np.finfo(build.scalar).eps)
    s = instants(build, 2)
    sums = [4 * eps * (K + 2) * float((np.abs(by_scipy(s, K, d)) @ np.abs(points)).max()) for d in range(4)]
    n = robot.dof
    q = by_scipy(s, K, 0) @ points
    mimic = max([abs(joint.multiplier) for joint in robot.joints], default=1.0)
    far = max(
        (float(np.linalg.norm(centre_of(o)) + np.linalg.norm(drawn.landmarks(o)[2])) for o in setting.obstacles), default=0
    )
    place = accuracy.placement_error(build, robot, q) + len(robot.joints) * mimic * sums[0] * accuracy.reach(robot, q)
    place += 20 * eps * (1 + far)
    # Of axes that all but meet the squares are rounded; in boxes and cylinders the search ends at a last stretch.
    distances, _ = axis_distances(setting, pinocchio_points.joint_frames(robot, q))
    pairs = distances.shape[1]
    meeting = (distances < 0.01).sum() * 2 * (eps**0.5 + (2.0**-12 if build.bits == 32 else 2.0**-28))
    expected = expected_terms(build, setting, points)
    limits = [1 / robot.velocity.min(), 1 / robot.acceleration.min(), 1 / 3.0]
    duration = max(sums[1] * limits[0], (sums[2] * limits[1]) ** 0.5, (sums[3] * limits[2]) ** (1 / 3))
    if expected["duration"] > 0:  # then the roots are not taken of rounding alone
        t = expected["duration"]
        duration = min(duration, sums[1] * limits[0] + sums[2] * limits[1] / t + sums[3] * limits[2] / t**2)
    count = len(s) * eps
    distances = len(setting.obstacles) * (n + 1)
    return {
        "length": n**0.5 * sums[1] + count * expected["length"],
        "duration": duration + 4 * eps * expected["duration"],
        "tip": 2 * len(s) * place + count * expected["tip"],
        "clearance": pairs * place + meeting / len(s) + count * (1 + expected["clearance"]),
        "smoothness": 2 * n * sums[3] * (expected["smoothness"] + sums[3] ** 2) ** 0.5
        + n * sums[3] ** 2
        + count * expected["smoothness"],
        "f1": distances * (place + count * (1 + expected["f1"])),
        "f2": place + count * (1 + expected["f2"]),
        "f3": place + count * (1 + expected["f3"]),
        "violation": len(s) * pairs * place + meeting + count * (1 + expected["violation"]),
    }


@settings(max_examples=6)
@given(st.data(), st.sampled_from([0, 1, 3, 8, 24]), st.integers(0, 1), st.integers(0, 2**32 - 1))
def test_terms_and_violation_are_the_formulas(build: Build, data: st.DataObject, K: int, goal: int, seed: int) -> None:
    setting = data.draw(drawn_settings(build))
    n, rows = setting.robot.dof, 3
    near = np.linspace(setting.start, setting.goals[goal], K + 2)[1:-1]
    spread = np.random.default_rng(seed).normal(size=(rows, K, n)) * [[[0.0]], [[0.3]], [[2.0]]]
    x = build.array((near + spread).reshape(rows, K * n))
    assert_judged_by_the_formulas(build, setting, x, K, goal)


def assert_judged_by_the_formulas(build: Build, setting: Setting, x: np.ndarray, K: int, goal: int) -> None:
    found = setting.search.judge(x, K, goal)
    for row in range(len(x)):
        inner = x[row].astype(np.float64).reshape(K, setting.robot.dof)
        points = np.vstack([setting.start, inner, setting.goals[goal]])
        expected, error = expected_terms(build, setting, points), allowed_errors(build, setting, points)
        for i, name in enumerate(TERMS):
            assert found.terms[row, i] == pytest.approx(expected[name], rel=0, abs=error[name]), name
        assert found.violation[row] == pytest.approx(expected["violation"], rel=0, abs=error["violation"])
        total = sum(setting.weights[name] * expected[name] for name in TERMS)
        off = sum(setting.weights[name] * error[name] for name in TERMS) + 10 * float(np.finfo(build.scalar).eps) * total
        assert found.fitness[row] == pytest.approx(total, rel=0, abs=off)


def test_terms_in_clutter_are_the_formulas(build: Build) -> None:
    """An obstacle of every shape, a preferred clearance far beyond the margin, links that must keep clear."""
    robot, (start, goal) = objectives.thick_arm(), objectives.AROUND
    robot = replace(robot, self_pairs=(("upper_arm", "hand"),))
    weights = dict.fromkeys(TERMS, 0.5)
    options: dict[str, Any] = {"jerk": np.full(7, 3.0), "margin": 0.01, "preferred_clearance": 0.3, "weights": weights}
    search = objectives.motion_search(build, robot, objectives.CLUTTER, start, goal, **options)
    setting = Setting(
        robot=robot, obstacles=[*objectives.CLUTTER], start=np.array(start), goals=np.array([goal]), search=search, **options
    )
    x = build.array(np.random.default_rng(2).uniform(-2, 2, (3, 14)))
    assert_judged_by_the_formulas(build, setting, x, 2, 0)
    clearance = search.judge(x, 2, 0).terms[:, TERMS.index("clearance")]
    assert clearance.min() > 0.05


@pytest.mark.parametrize("name", TERMS)
def test_the_fitness_is_the_weighted_term_alone(build: Build, name: str) -> None:
    start, goal = objectives.AROUND
    search = objectives.motion_search(
        build, objectives.thick_arm(), objectives.CLUTTER, start, goal, weights={name: 0.5}, jerk=np.ones(7)
    )
    x = build.array(np.random.default_rng(0).uniform(-1, 1, (4, 14)))
    found = search.judge(x, 2, 0)
    np.testing.assert_array_equal(found.fitness, build.scalar(0.5) * found.terms[:, TERMS.index(name)])


def test_a_motion_is_free_where_every_instant_is(build: Build) -> None:
    """At all 8 packs of instants, each with a clearance of the margin, as a double precision model measures them."""
    robot, (start, goal) = objectives.thick_arm(), objectives.AROUND
    rng = np.random.default_rng(3)
    K, margin = 2, 0.01
    of_the_swarm = {"interior": [K], "patience": 0}  # so that all have K control points
    search = objectives.motion_search(build, robot, objectives.CLUTTER, start, goal, margin=margin, settings=of_the_swarm)
    free_one = objectives.run_motions(search, 600)
    x = [entry.points.ravel() for entry in free_one.history if len(entry.points) == K]
    near = np.array(x)[rng.integers(len(x), size=300)]
    rows = build.array(near + rng.choice([0.0, 0.03, 0.3], (300, 1)) * rng.normal(size=near.shape))
    found = free_one.judge(rows, K, 0)
    exact = surround(Build("generic", 64), robot, objectives.CLUTTER).native
    q = looked_at(build, rows, K, start, goal)
    least = exact.obstacle_clearances(q.reshape(-1, 7)).reshape(*q.shape[:2], -1).min(axis=(1, 2)) - margin
    free = np.array(found.free)
    assert least[free].min() > -1e-4
    assert least[~free].max() < 1e-4
    assert 0.1 < free.mean() < 0.9
    # The violation is of the coarse instants only: some motions have none and are not free.
    clean = found.violation <= 0
    assert clean[free].all()
    assert (clean & ~free).any()
