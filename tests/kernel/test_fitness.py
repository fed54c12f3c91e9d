"""The kernel's objectives against the paper's formulas, written out here in loops, on points from Pinocchio."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise, product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kernel import accuracy, drawn
from kernel.builds import Build, Placed, Point, place, surround
from spacearm.core.native import native
from spacearm.geometry import Scene, Sphere
from spacearm.planner.kernel_model import make_kernel_model
from spacearm.robot import Robot, joint_centres, load_robot
from support import strategies
from support.oracles import coal_shapes, pinocchio_points

SHARES = st.floats(0.0, 1.0)
TOLERANCES = st.sampled_from([0.0, 1e-3, 0.5])
TARGETS = st.lists(st.tuples(strategies.points(), TOLERANCES), min_size=1, max_size=3)


@dataclass
class Case:
    """A drawn robot among obstacles, as the kernel has it and as Pinocchio places it."""

    robot: Robot
    balls: Sequence[Sphere]
    model: Placed
    centres: list[Point]
    tip: Point
    q: np.ndarray
    frames: np.ndarray

    @property
    def centre_indices(self) -> np.ndarray:
        return np.arange(len(self.centres), dtype=np.int32)

    @property
    def tip_index(self) -> int:
        return len(self.centres)

    def error(self, build: Build) -> float:
        """What one distance may be off by [m]."""
        far = max((float(np.linalg.norm(ball.center)) for ball in self.balls), default=0.0)
        eps = float(np.finfo(build.scalar).eps)
        return accuracy.placement_error(build, self.robot, self.q) + 10 * eps * (1 + far)


@st.composite
def cases(draw: st.DrawFn, build: Build) -> Case:
    robot = draw(drawn.robots())
    q = draw(drawn.batches(robot, build, draw(st.sampled_from([1, build.lanes + 1]))))
    frames = pinocchio_points.joint_frames(robot, q)
    balls = draw(drawn.balls_near(robot, frames[0]))  # which other rows keep clear of
    last = len(robot.joints) - 1
    centres = draw(st.lists(st.tuples(st.integers(-1, last), drawn.points()), max_size=5))
    tip = (last, draw(drawn.points()))
    model = place(build, robot, points=[*centres, tip], spheres=balls)
    return Case(robot, balls, model, centres, tip, q, frames)


def segment_distance(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> float:
    """Least distance from c to the points a + t (b - a), 0 <= t <= 1 [m]."""
    if np.array_equal(a, b):
        return float(np.linalg.norm(c - a))
    t = min(max(float((c - a) @ (b - a)) / float((b - a) @ (b - a)), 0.0), 1.0)
    return float(np.linalg.norm(c - (a + t * (b - a))))


def at(frames: np.ndarray, rider: Point) -> np.ndarray:
    return pinocchio_points.points(frames[np.newaxis], [rider])[0, 0]


def shortfall(robot: Robot, frames: np.ndarray, balls: Sequence[Sphere], margin: float = 0.0) -> float:
    """Eqs. (1) to (3), (10), (11): by how much links are too near obstacles, summed [m]."""
    total = 0.0
    for link in robot.capsules:
        a, b = at(frames, (link.joint, link.a)), at(frames, (link.joint, link.b))
        for ball in balls:
            distance = segment_distance(a, b, np.array(ball.center))
            total += max(0.0, link.radius + ball.radius + margin - distance)
    return total


def paper_terms(case: Case, frames: np.ndarray, goal: np.ndarray) -> tuple[float, float, float]:
    f1 = 0.0
    for centre in case.centres:
        for ball in case.balls:
            f1 += float(np.linalg.norm(at(frames, centre) - ball.center))  # eq. (5)
    x, y, z = at(frames, case.tip)
    xg, yg, zg = goal
    f2 = ((x - xg) ** 2 + (y - yg) ** 2 + (z - zg) ** 2 + 1) ** 0.5  # eq. (6), z joined
    f3 = float(np.linalg.norm([x - xg, y - yg, z - zg]))  # eq. (7)
    return f1, f2, f3


@settings(max_examples=8)
@given(st.data(), strategies.points(), st.tuples(SHARES, SHARES, SHARES), TOLERANCES)
@pytest.mark.parametrize("mode", ["literal", "goal"])
def test_fitness_terms_and_violation_are_the_papers(
    build: Build, mode: str, data: st.DataObject, goal: np.ndarray, weights: tuple[float, ...], tolerance: float
) -> None:
    case = data.draw(cases(build))
    must_reach = mode == "goal"
    objective = build.named("PaperObjective")(
        scene=case.model.native,
        centers=case.centre_indices,
        tip=case.tip_index,
        goal=np.array(goal, dtype=np.float64),
        weights=np.array(weights),
        must_reach=must_reach,
        tolerance=tolerance,
    )
    fitness, violation = objective.evaluate(case.q)
    terms = objective.terms(case.q)
    assert fitness.shape == violation.shape == (len(case.q),)
    assert terms.shape == (len(case.q), 3)
    one = case.error(build)
    distances = len(case.centres) * len(case.balls)
    for row, frames in enumerate(case.frames):
        f1, f2, f3 = paper_terms(case, frames, goal)
        F = weights[0] * f1 + weights[1] * f2 + weights[2] * f3  # eq. (4)
        broken = shortfall(case.robot, frames, case.balls)
        if must_reach:
            broken += max(0.0, f3 - tolerance)
        # Each distance may be off by `one`, and a sum of k numbers rounds k times.
        eps = float(np.finfo(build.scalar).eps)
        near = (distances + 2) * (one + eps * (1 + f1))
        assert terms[row] == pytest.approx([f1, f2, f3], rel=0, abs=near)
        assert fitness[row] == pytest.approx(F, rel=0, abs=2 * near)
        pairs = len(case.robot.capsules) * len(case.balls) + 1
        assert violation[row] == pytest.approx(broken, rel=0, abs=pairs * (one + eps * (1 + broken)))
        assert violation[row] >= 0


@pytest.mark.parametrize("precision", [64, 32])
@pytest.mark.parametrize("radius", [0.0, 0.05])
def test_the_papers_arm_has_the_papers_fitness(precision: int, radius: float) -> None:
    """Through make_kernel_model, as the product calls it, with link radii and without."""
    build = Build("default", precision)
    robot = load_robot("zhang2022")
    robot = replace(robot, capsules=tuple(replace(capsule, radius=radius) for capsule in robot.capsules))
    balls = [Sphere((0.5, 0.5, 0.0), 0.1), Sphere((0.4, 0.7, 0.0), 0.1), Sphere((0.2, 0.8, 0.0), 0.1)]
    model = make_kernel_model(robot, Scene(balls))
    goal, weights = np.array([0.7, 0.3, 0.0]), np.array([0.5, 0.25, 0.25])
    made, scene = (native.PaperObjective64, model.model64) if precision == 64 else (native.PaperObjective32, model.model32)
    objective = made(
        scene=scene,
        centers=np.array(model.centres, dtype=np.int32),
        tip=model.tip,
        goal=goal,
        weights=weights,
        must_reach=True,
        tolerance=1e-3,
    )
    q = build.array(np.random.default_rng(0).uniform(robot.lower, robot.upper, (50, robot.dof)))
    centres = list(joint_centres(robot))
    case = Case(robot, balls, Placed(None, ()), centres, centres[-1], q, pinocchio_points.joint_frames(robot, q))
    fitness, violation = objective.evaluate(q)
    error = 20 * case.error(build)
    for row, frames in enumerate(case.frames):
        f1, f2, f3 = paper_terms(case, frames, goal)
        assert fitness[row] == pytest.approx(0.5 * f1 + 0.25 * f2 + 0.25 * f3, rel=0, abs=error)
        broken = shortfall(robot, frames, balls) + max(0.0, f3 - 1e-3)
        assert violation[row] == pytest.approx(broken, rel=0, abs=error)


def test_the_stretched_arm_has_the_fitness_that_a_ruler_gives(build: Build) -> None:
    """q = 0: centres at y = 0, 0.668, 1.0808, 1.336, one obstacle beside each of two of them."""
    robot = load_robot("zhang2022")
    centres = list(joint_centres(robot))
    balls = [Sphere((1.0, 0.0, 0.0), 0.1), Sphere((0.0, 1.336, 0.0), 0.25)]
    model = place(build, robot, points=centres, spheres=balls)
    goal = np.array([0.0, 0.336, 0.0])
    objective = build.named("PaperObjective")(
        scene=model.native,
        centers=np.arange(4, dtype=np.int32),
        tip=3,
        goal=goal,
        weights=np.array([0.5, 0.25, 0.25]),
        must_reach=True,
        tolerance=0.25,
    )
    heights = np.array([0.0, 0.668, 1.0808, 1.336])
    f1 = np.sum(np.hypot(1.0, heights)) + np.sum(1.336 - heights)
    fitness, violation = objective.evaluate(build.array(np.zeros((1, 7))))
    eps = 50 * float(np.finfo(build.scalar).eps)
    np.testing.assert_allclose(objective.terms(build.array(np.zeros((1, 7)))), [[f1, 2**0.5, 1.0]], rtol=eps)
    assert fitness[0] == pytest.approx(0.5 * f1 + 0.25 * 2**0.5 + 0.25, rel=eps)
    # The ball at the hand is entered by every link without thickness that comes within 0.25 of it.
    nearest = [0.668, 1.336 - 1.0808, 0.0]
    broken = sum(max(0.0, 0.25 - d) for d in nearest) + 0.75
    assert violation[0] == pytest.approx(broken, rel=eps)


@settings(max_examples=8)
@given(
    st.data(), st.lists(st.tuples(strategies.points(), TOLERANCES), min_size=1, max_size=3), st.sampled_from([0.0, 0.05, 1.0])
)
def test_reaching_points_costs_the_way_from_home(
    build: Build, data: st.DataObject, targets: list[tuple[np.ndarray, float]], margin: float
) -> None:
    """Each point is to come within its tolerance of its place, clear of obstacles and of the robot itself by the margin."""
    robot = data.draw(drawn.robots())
    links = sorted({capsule.name for capsule in robot.capsules})
    robot = replace(robot, self_pairs=tuple(pairwise(links)))
    q = data.draw(drawn.batches(robot, build, data.draw(st.sampled_from([1, build.lanes + 1]))))
    frames = pinocchio_points.joint_frames(robot, q)
    balls = [*data.draw(drawn.balls_near(robot, frames[0]))]
    riders = [(data.draw(st.integers(-1, len(robot.joints) - 1)), data.draw(drawn.points())) for _ in targets]
    home = np.asarray(data.draw(drawn.batches(robot, build, 1))[0], dtype=np.float64)
    model = surround(build, robot, balls, points=riders)
    objective = build.named("ReachObjective")(
        scene=model.native,
        points=np.arange(len(riders), dtype=np.int32),
        targets=np.array([place for place, _ in targets], dtype=np.float64),
        tolerances=np.array([tolerance for _, tolerance in targets], dtype=np.float64),
        margin=margin,
        home=home,
    )
    fitness, violation = objective.evaluate(q)
    eps = float(np.finfo(build.scalar).eps)
    moving = replace(robot, capsules=tuple(capsule for capsule in robot.capsules if capsule.joint >= 0), self_pairs=())
    far = max((float(np.linalg.norm(ball.center)) for ball in balls), default=0.0)
    one = accuracy.placement_error(build, robot, q) + 10 * eps * (1 + far)
    pairs = len(robot.capsules) * (len(balls) + len(robot.capsules)) + len(targets)
    for row, T in enumerate(frames):
        way = float(np.linalg.norm(q[row].astype(np.float64) - home))
        broken = shortfall(moving, T, balls, margin) + self_shortfall(robot, T, margin)
        for rider, (goal, tolerance) in zip(riders, targets, strict=True):
            broken += max(0.0, float(np.linalg.norm(at(T, rider) - goal)) - tolerance)
        assert fitness[row] == pytest.approx(way, rel=10 * eps, abs=1e-30)
        # Axes that meet are off by the root of a rounding.
        meeting = len(robot.self_pairs) * len(robot.capsules) * 2 * eps**0.5 * accuracy.reach(robot, q)
        assert violation[row] == pytest.approx(broken, rel=0, abs=pairs * (one + eps * (1 + broken)) + meeting)


def self_shortfall(robot: Robot, frames: np.ndarray, margin: float) -> float:
    """By how much links that must keep clear of each other are too near, summed over their capsules [m]."""
    total = 0.0
    for one, other in product(robot.capsules, repeat=2):
        if (one.name, other.name) in robot.self_pairs:
            ends = [[at(frames, (link.joint, end)) for end in (link.a, link.b)] for link in (one, other)]
            placed = [coal_shapes.placed_capsule(a, b, link.radius) for (a, b), link in zip(ends, (one, other), strict=True)]
            total += max(0.0, margin - coal_shapes.distance(*placed))
    return total
