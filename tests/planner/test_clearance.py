"""Clearances as users get them: Coal's for every shape, sets of spheres as one, and the robot's own pairs."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kernel import drawn, objectives
from kernel.builds import Build, surround
from spacearm.core.errors import RobotError
from spacearm.core.native import available_levels
from spacearm.geometry import Obstacle, Scene, Sphere, SphereSet
from spacearm.planner import Problem, clearance, clearances
from spacearm.planner.clearance import ClearanceModel, self_clearances
from spacearm.planner.kernel_model import kernel_model, make_kernel_model, self_shape_pairs
from spacearm.planner.searched_clearance import SearchedClearance, searched_clearance
from spacearm.proof import PairClearance
from spacearm.robot import LinkCapsule, Robot
from support import strategies
from support.dense_samples import arms, planar
from support.oracles import coal_shapes, pinocchio_points, solids

BALL = Sphere((1.2, 1.2, 0.0), 0.3)


def problem_of(robot: Robot, obstacles: Any) -> Problem:
    middle = np.clip(np.zeros(robot.dof), robot.lower, robot.upper)
    return Problem(robot, Scene(obstacles), start=middle, goal=middle)


@st.composite
def sphere_sets(draw: st.DrawFn) -> SphereSet:
    count = draw(st.integers(1, 5))
    radii = [draw(st.floats(0.01, 0.5)) for _ in range(count)]
    return SphereSet(np.array([draw(strategies.points(2.0)) for _ in range(count)]), np.array(radii))


OBSTACLES: st.SearchStrategy[list[Obstacle]] = st.lists(st.one_of(drawn.obstacles(), sphere_sets()), max_size=5)


@settings(max_examples=30)
@given(st.data(), OBSTACLES)
def test_clearances_are_those_of_the_definition_and_coals(data: st.DataObject, obstacles: list[Obstacle]) -> None:
    robot = data.draw(arms(self_pairs=True))
    q = data.draw(strategies.configurations(robot, (3,)))
    problem = problem_of(robot, obstacles)
    found = clearances(problem, q)
    assert found.shape == (3, len(robot.capsules), len(obstacles))
    frames = pinocchio_points.joint_frames(robot, q)
    ends = pinocchio_points.points(frames, [(c.joint, end) for c in robot.capsules for end in (c.a, c.b)])
    size = 1 + max((solids.far(o) for o in obstacles), default=0.0)
    for i, link in enumerate(robot.capsules):
        for k, obstacle in enumerate(obstacles):
            distance = solids.link_distance(obstacle, ends[:, 2 * i], ends[:, 2 * i + 1]) - link.radius
            np.testing.assert_allclose(found[:, i, k], distance, rtol=0, atol=1e-6 * size)
    least = clearance(problem, q)
    by_coal = coal_shapes.least_distances(robot, problem.scene, frames)
    apart = by_coal > 1e-4 * size  # where they overlap Coal's depth is another thing
    np.testing.assert_allclose(least[apart], by_coal[apart], rtol=1e-5, atol=1e-5 * size)
    assert (least[~apart] < 2e-4 * size).all()
    np.testing.assert_array_equal(ClearanceModel(problem.robot, problem.scene).least(q), least)


@settings(max_examples=30)
@given(st.data())
def test_self_clearances_are_coals(data: st.DataObject) -> None:
    robot = data.draw(arms(self_pairs=True))
    q = data.draw(strategies.configurations(robot, (2,)))
    found, pairs = self_clearances(problem_of(robot, []), q), self_shape_pairs(robot)
    assert found.shape == (2, len(pairs))
    named = {(robot.capsules[i].name, robot.capsules[k].name) for i, k in pairs}
    assert named == set(robot.self_pairs)
    frames = pinocchio_points.joint_frames(robot, q)
    ends = pinocchio_points.points(frames, [(c.joint, end) for c in robot.capsules for end in (c.a, c.b)])
    a, b = ends[:, ::2], ends[:, 1::2]
    for p, (i, k) in enumerate(pairs):
        radii = robot.capsules[i].radius + robot.capsules[k].radius
        distance = solids.axes_distance(a[:, i], b[:, i], a[:, k], b[:, k])
        np.testing.assert_allclose(found[:, p], distance - radii, rtol=0, atol=1e-6)


@settings(max_examples=20)
@given(st.data(), OBSTACLES, st.sampled_from([0.0, 0.1]))
def test_the_products_own_model_sums_the_same_shortfalls(data: st.DataObject, obstacles: list[Obstacle], margin: float) -> None:
    """As the planner makes it, link by link, from robots whose capsules stand in any order."""
    robot = data.draw(arms(self_pairs=True))
    order = data.draw(st.permutations(range(len(robot.capsules))))
    robot = replace(robot, capsules=tuple(robot.capsules[i] for i in order))
    problem, q = problem_of(robot, obstacles), data.draw(strategies.configurations(robot, (3,)))
    single = problem_of(robot, [ball for o in obstacles for ball in parts(o)])
    moving = np.array([c.joint >= 0 for c in robot.capsules], dtype=bool)
    clear = np.hstack([clearances(single, q)[:, moving].reshape(3, -1), self_clearances(problem, q)])
    for precision, error in ((64, 1e-9), (32, 1e-3)):
        model = getattr(kernel_model(robot, problem.scene), f"model{precision}")
        found = model.shortfalls(q.astype(np.float64 if precision == 64 else np.float32), margin, False)
        size = 1 + max((solids.far(o) for o in obstacles), default=0.0)
        expected = np.maximum(margin - clear, 0).sum(axis=1)
        np.testing.assert_allclose(found, expected, rtol=0, atol=error * size * (1 + clear.shape[1]))


def parts(obstacle: Obstacle) -> list[Obstacle]:
    if not isinstance(obstacle, SphereSet):
        return [obstacle]
    return [Sphere(c, float(r)) for c, r in zip(obstacle.centers, obstacle.radii, strict=True)]


@pytest.mark.parametrize("shape", [(), (1,), (3, 2), (0,), (2, 0, 3)])
def test_clearances_keep_the_batchs_shape(shape: tuple[int, ...]) -> None:
    every = [BALL, SphereSet([[0, 0, 3], [0, 0, 4]], [0.1, 0.2]), Sphere((0, 0, -3), 0.1)]
    problem = problem_of(planar(self_pairs=(("upper", "fore"),)), every)
    q = np.zeros((*shape, 2))
    assert clearances(problem, q).shape == (*shape, 2, 3)
    assert self_clearances(problem, q).shape == (*shape, 1)
    assert np.shape(clearance(problem, q)) == shape
    # The stretched arm along x, and the ball's centre beside its middle.
    far = clearance(replace(problem, robot=planar()), q)
    np.testing.assert_allclose(far, 1.2 - 0.3 - 0.05, rtol=0, atol=1e-12)


def test_without_obstacles_or_links_the_clearance_is_infinite() -> None:
    assert clearance(problem_of(planar(), []), [0.0, 0.0]) == np.inf
    bare = problem_of(planar(capsules=()), [BALL])
    np.testing.assert_array_equal(clearance(bare, np.zeros((3, 2))), [np.inf] * 3)
    assert clearances(bare, [0.0, 0.0]).shape == (0, 1)


def test_what_is_kept_for_one_robot_and_scene_is_not_given_to_another() -> None:
    """Models are cached by identity: objects that come and go, and may stand where another stood, must not mix."""
    for radius in np.linspace(0.1, 0.5, 40):
        problem = problem_of(planar(), [Sphere((1.2, 1.2, 0.0), float(radius))])
        assert clearance(problem, [0.0, 0.0]) == pytest.approx(1.2 - radius - 0.05, abs=1e-12)


@pytest.mark.parametrize("q", [[0.0], [0.0, np.nan], [[0.0, 0.0, 0.0]], "home", 3.0, None, [0.0, 1j]])
def test_what_is_no_configuration_is_refused(q: Any) -> None:
    for measure in (clearance, clearances, self_clearances):
        with pytest.raises(RobotError):
            measure(problem_of(planar(), [BALL]), q)


# ---- what is asked for between ends that are near to something -----------------------------------------------------------


def kernel_pairs(searched: SearchedClearance) -> dict[str, np.ndarray]:
    """Pairs with a clearance of their own as the kernel's `PairMargins` takes them."""
    body, obstacle, other = (np.ascontiguousarray(column) for column in searched.rows.T)
    return {"body": body, "obstacle": obstacle, "other": other, "margin": searched.of_pairs}


def between_ends(clear: float, required: float) -> float:
    """What is asked for of a pair that has a clearance at an end: that required and 2 mm more, if there is room for it."""
    if clear <= 0:
        return 0.0
    held = clear - min(1e-4, clear / 2) if clear < required + 1e-6 else required
    held = min(held, required)
    return held + min(0.002, (clear - held) / 2)


@settings(max_examples=30)
@given(st.data(), OBSTACLES, st.sampled_from([0.0, 0.05, 0.5]), st.sampled_from([None, 0.0, 0.3]), st.sampled_from([32, 64]))
def test_every_pair_is_asked_for_what_is_required_and_2_mm_more_or_what_there_is_room_for(
    data: st.DataObject, obstacles: list[Obstacle], usual: float, of_link: float | None, precision: int
) -> None:
    """The search's shortfall is that of the definition: each pair by its own clearance, lower or higher than the others'."""
    robot = data.draw(arms(self_pairs=True))
    special = robot.capsules[0].name
    own = [] if of_link is None else [PairClearance(of_link, link=special)]
    problem = replace(problem_of(robot, obstacles), clearance=usual, clearances=own)
    ends = data.draw(strategies.configurations(robot, (2,)))
    asked = searched_clearance(problem, ends)
    model = make_kernel_model(robot, problem.scene, pair_margins=asked.kernel_pairs)
    searched = getattr(model, f"model{precision}")
    q = np.vstack([ends, data.draw(strategies.configurations(robot, (4,)))])
    exact = kernel_model(robot, problem.scene).model64
    to_scene, at_ends = exact.obstacle_clearances(q), exact.obstacle_clearances(ends)  # (rows, c, k)
    links = [capsule.name for capsule in robot.capsules]
    expected = np.zeros(len(q))
    close, touching = set(), False
    for i, capsule in enumerate(robot.capsules):
        if capsule.joint < 0:
            continue
        of = [k for k, name in enumerate(links) if name == links[i]]
        for k in range(to_scene.shape[2]):
            required = usual if of_link is None or links[i] != special else of_link
            near = float(at_ends[:, of, k].min())
            touching |= near <= 0
            whole = float(at_ends[:, of][:, :, model.obstacle_of == model.obstacle_of[k]].min())  # of a set of balls
            if 0 < whole < required:
                near = whole
                close.add((links[i], f"obstacle {model.obstacle_of[k]}"))
            expected += np.maximum(0.0, between_ends(near, required) - to_scene[:, i, k])
    pairs = self_shape_pairs(robot)
    between, before = self_clearances(problem, q), self_clearances(problem, ends)
    named = [(links[i], links[k]) for i, k in pairs.tolist()]
    for p, pair in enumerate(named):
        required = usual if of_link is None or special not in pair else of_link
        near = float(before[:, [other for other, same in enumerate(named) if same == pair]].min())
        expected += np.maximum(0.0, between_ends(near, required) - between[:, p])
        touching |= near <= 0
        if 0 < near < required:
            close.add((pair[0], f"link '{pair[1]}'"))
    found = searched.shortfalls(np.ascontiguousarray(q, dtype=f"f{precision // 8}"), asked.asked, False)
    size = 1 + np.abs(to_scene).max(initial=0.0)
    np.testing.assert_allclose(found, expected, rtol=1e-4, atol=(1e-4 if precision == 32 else 1e-9) * size)
    assert asked.asked == usual + 0.002
    assert {(near.link, near.other) for near in asked.near} == close
    assert [near.clearance for near in asked.near] == sorted(near.clearance for near in asked.near)
    assert asked.touching == touching


def test_a_pairs_own_margin_is_the_same_bits_on_every_level() -> None:
    robot = objectives.thick_arm()
    start, goal = objectives.AROUND
    problem = Problem(robot, Scene(objectives.CLUTTER), start=start, goal=goal, clearance=0.8)
    searched = searched_clearance(problem, np.stack(objectives.AROUND))
    assert len(searched.of_pairs)
    q = np.random.default_rng(0).uniform(robot.lower, robot.upper, (50, robot.dof))
    for precision in (32, 64):
        rows = q.astype(f"f{precision // 8}")
        found = [
            surround(Build(level, precision), robot, objectives.CLUTTER, pair_margins=kernel_pairs(searched)).native.shortfalls(
                rows, 0.802, False
            )
            for level in available_levels()
        ]
        for other in found[1:]:
            np.testing.assert_array_equal(found[0], other)


def test_what_a_bolted_base_is_near_to_lowers_nothing() -> None:
    robot = planar(capsules=(*planar().capsules, LinkCapsule(name="foot", joint=-1, a=np.zeros(3), b=np.zeros(3), radius=0.1)))
    problem = problem_of(robot, [Sphere((0, -0.4, 0), 0.299)])
    assert searched_clearance(replace(problem, clearance=0.01), np.zeros((1, 2))).near == ()
    (near,) = searched_clearance(replace(problem, clearance=0.06), np.zeros((1, 2))).near  # the upper arm is 51 mm away
    assert near.link == "upper"
