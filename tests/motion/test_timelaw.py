"""Time laws: the same path at another pace, composed exactly, and the limits of it for every instant."""

from __future__ import annotations

import json
import pickle
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import BSpline

from spacearm.core.errors import ProblemError
from spacearm.motion import Motion, TimeLaw, Trajectory, fastest_duration, fastest_durations, limit_margins
from spacearm.motion.limit_margins import fastest_duration_of_law, law_margins
from spacearm.motion.time_laws import over_time
from spacearm.motion.time_optimal_law import abscissae, cubic_basis, cubic_law, halved
from support import strategies
from support.drawn_motions import is_continuous, motions, motions_of, scipy_spline, size_of
from support.messages import assert_refused
from support.small_robots import two_link

FEWER = settings(max_examples=20)
SMOOTHSTEP = TimeLaw([0, 1], [[0, 0, 1, 1]])
BANG_BANG = TimeLaw([0, 0.5, 1], [[0, 0, 0.5], [0.5, 1, 1]])


@st.composite
def knots(draw: st.DrawFn) -> np.ndarray:
    steps = draw(st.lists(st.floats(0.05, 1.0), min_size=1, max_size=6))
    x = np.concatenate([[0.0], np.cumsum(steps)]) / sum(steps)
    x[-1] = 1.0
    return x


@st.composite
def rising_points(draw: st.DrawFn, count: int) -> np.ndarray:
    steps = np.array(draw(st.lists(st.one_of(st.just(0.0), st.floats(0.01, 1.0)), min_size=count - 1, max_size=count - 1)))
    points = np.concatenate([[0.0], np.cumsum(steps + 1e-3)])
    points /= points[-1]
    points[-1] = 1.0
    return points


@st.composite
def laws(draw: st.DrawFn) -> TimeLaw:
    """Laws with continuous acceleration, of a few pieces."""
    x = draw(knots())
    return cubic_law(x, draw(rising_points(len(x) + 2)))


def spline_of(x: np.ndarray, points: np.ndarray) -> BSpline:
    return BSpline(np.concatenate([np.zeros(3), x, np.ones(3)]), points, 3)


@given(st.data(), st.integers(0, 3))
def test_a_cubic_law_is_scipys_spline(data: st.DataObject, derivative: int) -> None:
    x = data.draw(knots())
    points = data.draw(rising_points(len(x) + 2))
    law, expected = cubic_law(x, points), spline_of(x, points)
    inside = (x[:-1, None] + np.linspace(0.01, 0.99, 17) * np.diff(x)[:, None]).ravel()
    scale = (6 / np.diff(x).min()) ** derivative
    np.testing.assert_allclose(law.sample(inside, derivative), expected(inside, nu=derivative), rtol=0, atol=1e-13 * scale)
    basis = cubic_basis(x, inside, derivative) @ points
    np.testing.assert_allclose(basis, expected(inside, nu=derivative), rtol=0, atol=1e-13 * scale)
    assert is_continuous(law.path, 2)


@given(st.data())
def test_a_law_of_halved_pieces_is_the_same(data: st.DataObject) -> None:
    x = data.draw(knots())
    points = data.draw(rising_points(len(x) + 2))
    finer, more = halved(x, points)
    share = np.linspace(0, 1, 101)
    np.testing.assert_allclose(spline_of(finer, more)(share), spline_of(x, points)(share), rtol=0, atol=1e-12)
    np.testing.assert_allclose(spline_of(x, abscissae(x))(share), share, rtol=0, atol=1e-13)


@given(laws(), st.lists(st.floats(0, 1), min_size=1, max_size=9))
def test_the_inverse_is_where_the_law_is(law: TimeLaw, s: list[float]) -> None:
    x = law.inverse(s)
    assert x.shape == (len(s),)
    assert ((x >= 0) & (x <= 1)).all()
    np.testing.assert_allclose(law.sample(x), s, rtol=0, atol=1e-12)
    np.testing.assert_array_equal(law.inverse([-1.0, 0.0, 1.0, 2.0]), [0, 0, 1, 1])
    assert law.inverse(0.5).shape == ()


@given(laws())
def test_a_law_never_turns_back(law: TimeLaw) -> None:
    s = law.sample(np.linspace(0, 1, 2001))
    assert (np.diff(s) >= -1e-14).all()
    assert (s[0], s[-1]) == (0, 1)
    np.testing.assert_array_equal(law.sample([-1, 2]), [0, 1])


@given(motions(), laws(), st.floats(0.1, 10.0), st.integers(0, 3))
def test_the_composition_is_the_splines_by_the_chain_rule(
    motion: Motion, law: TimeLaw, duration: float, derivative: int
) -> None:
    path = over_time(motion, law, duration, derivative)
    assert path.domain == (0.0, duration)
    assert path.degree == 15 - derivative
    t = (path.breaks[:-1, None] + np.linspace(0.01, 0.99, 17) * np.diff(path.breaks)[:, None]).ravel()
    s, v, a, j = (law.sample(t / duration, k)[:, None] / duration**k for k in range(4))
    q = [scipy_spline(motion)(s[:, 0], nu=k) for k in range(4)]
    expected = [q[0], q[1] * v, q[2] * v**2 + q[1] * a, q[3] * v**3 + 3 * q[2] * v * a + q[1] * j][derivative]
    size = size_of(motion, derivative)
    pace = (6 / np.diff(law.breaks).min() / duration) ** derivative
    np.testing.assert_allclose(path.sample(t), expected, rtol=0, atol=1e-12 * size * pace)


@given(motions(), st.floats(0.1, 10.0))
def test_the_uniform_law_is_the_motion_itself(motion: Motion, duration: float) -> None:
    for law in (TimeLaw.uniform(), TimeLaw([0, 0.3, 1], [[0, 0.15, 0.3], [0.3, 0.65, 1]])):
        for derivative in range(4):
            path = over_time(motion, law, duration, derivative)
            t = np.linspace(0, duration, 101)
            expected = motion.sample(t / duration, derivative) / duration**derivative
            scale = size_of(motion, derivative) / duration**derivative
            np.testing.assert_allclose(path.sample(t), expected, rtol=0, atol=1e-12 * scale)


@st.composite
def timed(draw: st.DrawFn) -> Trajectory:
    robot = draw(strategies.robots(min_joints=1, max_joints=4))
    return Trajectory(robot, draw(motions_of(robot)), time_law=draw(laws()))


@FEWER
@given(timed(), st.integers(0, 2**32 - 1))
def test_no_limit_is_broken_at_any_instant_and_one_is_nearly_reached(trajectory: Trajectory, seed: int) -> None:
    robot = trajectory.robot
    assert trajectory.limits.holds
    t = np.random.default_rng(seed).uniform(0, trajectory.duration, 3_000)
    state = trajectory.sample(t)
    assert (np.abs(state.dq) <= robot.velocity * (1 + 1e-9)).all()
    assert (np.abs(state.ddq) <= robot.acceleration * (1 + 1e-9)).all()
    if trajectory.duration > 1e-6:
        fine = trajectory.sample(np.linspace(0, trajectory.duration, 10_001))
        used = max((np.abs(fine.dq) / robot.velocity).max(), (np.abs(fine.ddq) / robot.acceleration).max())
        assert used >= 0.97


@FEWER
@given(timed())
def test_a_timed_trajectory_is_its_path_over_time(trajectory: Trajectory) -> None:
    if trajectory.duration < 1e-3:
        return
    t = np.linspace(0, trajectory.duration, 301)
    state = trajectory.sample(t)
    for derivative, values in enumerate(state):
        limit = (np.full(trajectory.robot.dof, 10.0), trajectory.robot.velocity, trajectory.robot.acceleration)[derivative]
        np.testing.assert_allclose(trajectory.path.sample(t, derivative), values, rtol=0, atol=1e-7 * limit.max())
    np.testing.assert_array_equal(trajectory.sample([-1.0, 1e9]).q, trajectory.motion.control_points[[0, -1]])


@FEWER
@given(timed(), st.floats(0, 1))
def test_a_place_on_the_curve_is_passed_when_it_says(trajectory: Trajectory, s: float) -> None:
    when = trajectory.time_at(s)
    np.testing.assert_allclose(trajectory.sample(when).q, trajectory.curve.sample(s), rtol=0, atol=1e-9)
    uniform = Trajectory(trajectory.robot, trajectory.motion)
    assert uniform.time_at(s) == pytest.approx(s * uniform.duration)
    np.testing.assert_array_equal(trajectory.time_at([0, 1]), [0, trajectory.duration])


@FEWER
@given(timed())
def test_a_timed_trajectory_survives_pickle_and_json(trajectory: Trajectory) -> None:
    again = pickle.loads(pickle.dumps(trajectory))
    assert again == trajectory
    law = trajectory.time_law
    assert law is not None
    text = json.dumps([law.breaks.tolist(), law.coefficients.tolist()])
    assert TimeLaw(*json.loads(text)) == law
    assert hash(TimeLaw(*json.loads(text))) == hash(law)


@FEWER
@given(motions(), st.data())
def test_durations_of_many_are_those_of_each(motion: Motion, data: st.DataObject) -> None:
    robot = data.draw(strategies.robots(min_joints=motion.dof, max_joints=motion.dof))
    scales = np.array(data.draw(st.lists(st.floats(-2, 2), min_size=0, max_size=40)))
    many = motion.control_points * scales[:, None, None]
    for jerk_limit in (None, 3.0):
        durations = fastest_durations(robot, many, jerk_limit=jerk_limit)
        assert durations.shape == (len(many),)
        each = [fastest_duration(robot, Motion(points), jerk_limit=jerk_limit) for points in many]
        np.testing.assert_allclose(durations, each, rtol=1e-12, atol=0)


@FEWER
@given(st.data())
def test_a_jerk_limit_is_kept_and_reached(data: st.DataObject) -> None:
    robot = data.draw(strategies.robots(min_joints=1, max_joints=3))
    motion = data.draw(motions_of(robot))
    jerk_limit = np.array([data.draw(st.floats(0.1, 10.0)) for _ in range(robot.dof)])
    duration = fastest_duration(robot, motion, jerk_limit=jerk_limit)
    if duration < 1e-6:
        return
    jerk = np.abs(motion.sample(np.linspace(0, 1, 5_001), 3)) / duration**3 / jerk_limit
    assert jerk.max() <= 1 + 1e-9
    margins = limit_margins(robot, motion, duration, jerk_limit=jerk_limit)
    assert margins.holds
    assert margins.jerk is not None
    np.testing.assert_allclose(margins.jerk, jerk.max(axis=0), rtol=6e-3, atol=1e-6)
    free = fastest_duration(robot, motion)
    assert duration >= free
    if duration > free * (1 + 1e-9):
        assert jerk.max() >= 0.985


def test_a_single_joint_has_the_textbooks_duration_under_a_jerk_limit() -> None:
    """The quintic's greatest jerk is 60, at its ends."""
    robot = two_link(velocity=(1e9, 1e9), acceleration=(1e9, 1e9))
    assert fastest_duration(robot, Motion([[0, 0], [0, 1]]), jerk_limit=7.5) == pytest.approx(2.0, rel=1e-9)


def test_the_smoothstep_law_has_its_textbook_duration() -> None:
    """q(s(x)), s = 3 x^2 - 2 x^3, q the quintic: by dense sampling of the closed form."""
    robot = two_link(velocity=(1e9, 1e9), acceleration=(4.0, 4.0))
    x = np.linspace(0, 1, 200_001)
    s, v, a = 3 * x**2 - 2 * x**3, 6 * x - 6 * x**2, 6 - 12 * x
    second = (60 * s - 180 * s**2 + 120 * s**3) * v**2 + (30 * s**2 - 60 * s**3 + 30 * s**4) * a
    expected = (np.abs(second).max() / 4) ** 0.5
    assert Trajectory(robot, Motion([[0, 0], [0, 1]]), time_law=SMOOTHSTEP).duration == pytest.approx(expected, rel=1e-4)


def test_where_a_laws_acceleration_jumps_the_jerk_is_infinite() -> None:
    robot, motion = two_link(), Motion([[0, 0], [0, 0.5]])
    margins = law_margins(robot, motion, BANG_BANG, 10.0, jerk_limit=1e6)
    assert margins.jerk is not None
    assert margins.jerk[1] == np.inf
    assert margins.jerk[0] == 0  # it does not move
    assert not margins.holds
    assert np.isinf(fastest_duration_of_law(robot, motion, BANG_BANG, jerk_limit=1e6))
    smooth = law_margins(robot, motion, SMOOTHSTEP, 10.0, jerk_limit=1e6)
    assert smooth.holds
    assert Trajectory(robot, motion, time_law=BANG_BANG).limits.jerk is None


def test_a_law_of_the_other_robots_limits_is_judged_by_them() -> None:
    robot = two_link()
    trajectory = Trajectory(robot, Motion([[0, 0], [0, 0.5]]), time_law=SMOOTHSTEP)
    assert trajectory.margins().holds
    weaker = two_link(velocity=(1e-3, 1e-3))
    assert not trajectory.margins(weaker).holds


def test_what_does_not_move_takes_no_time_by_any_law() -> None:
    trajectory = Trajectory(two_link(), Motion([[0.1, 0.2], [0.1, 0.2]]), time_law=SMOOTHSTEP)
    assert trajectory.duration == 0
    assert trajectory.limits.holds
    np.testing.assert_array_equal(trajectory.sample(3.0).q, [0.1, 0.2])
    np.testing.assert_array_equal(trajectory.time_at([0.0, 0.5]), [0, 0])


def moved(**changes: Any) -> Any:
    return lambda: Trajectory(two_link(), Motion([[0, 0], [0, 0.5]]), **changes)


REFUSED: dict[str, Any] = {
    "time law flat": lambda: TimeLaw([0, 1], [0, 1]),
    "time law not from 0": lambda: TimeLaw([0.5, 1], [[0, 1]]),
    "time law not to the end": lambda: TimeLaw([0, 1], [[0, 0.9]]),
    "time law that turns back": lambda: TimeLaw([0, 1], [[0, 0.5, 0.4, 1]]),
    "time law that jumps": lambda: TimeLaw([0, 0.5, 1], [[0, 0.4], [0.6, 1]]),
    "time law with a corner": lambda: TimeLaw([0, 0.5, 1], [[0, 0.2], [0.2, 1]]),
    "time law with a corner hidden in a sliver": lambda: TimeLaw([0, 0.5, 0.5 + 1e-15, 1], [[0, 0.2], [0.2, 0.2], [0.2, 1]]),
    "time law that is none": moved(time_law="fast"),
    "time law, duration too short": moved(time_law=SMOOTHSTEP, duration=0.1),
    "path of no time": lambda: Trajectory(two_link(), Motion([[0, 0], [0, 0]])).path,
    "jerk limit zero": lambda: fastest_duration(two_link(), Motion([[0, 0], [0, 0.5]]), jerk_limit=0),
    "jerk limit of one joint too many": lambda: fastest_duration(two_link(), Motion([[0, 0], [0, 0.5]]), jerk_limit=[1, 2, 3]),
    "jerk limit text": lambda: moved()().margins(jerk_limit="smooth"),
    "jerk limit infinite": lambda: moved(time_law=SMOOTHSTEP)().margins(jerk_limit=np.inf),
}


@pytest.mark.parametrize("case", REFUSED)
def test_time_laws_that_cannot_be_are_refused(case: str) -> None:
    assert_refused("motion", case, ProblemError, REFUSED[case])


def steep(share: float, to: float = 0.99) -> TimeLaw:
    """At rest nearly all the time, and nearly all of the way in so small a share of it."""
    x, a = 0.51, 1 - to
    return TimeLaw([0, x, x + share, 1], [[0, a / 2, a, a], [a, a, to, to], [to, to, 1 - a / 2, 1]])


DWELL = TimeLaw([0, 0.3, 0.7, 1], [[0, 0, 0.5, 0.5], [0.5, 0.5, 0.5, 0.5], [0.5, 0.5, 1, 1]])
OUT_AND_BACK = Motion([[0, 0], *[[0, 0.5]] * 10, [0, 0]])


@pytest.mark.parametrize("share", [1e-2, 1e-5, 1e-6, 1e-7, 4e-8])
@pytest.mark.parametrize("interior", [1, 4, 20])
def test_a_steep_law_is_cut_at_every_knot_that_it_passes(share: float, interior: int) -> None:
    motion, law = Motion([[0.0], *[[0.5]] * interior, [0.0]]), steep(share)
    inside = 0.51 + share * np.linspace(1e-3, 1 - 1e-3, 997)
    s = law.sample(inside)[:, None]
    rates = [law.sample(inside, k)[:, None] for k in range(3)]
    first, second = (motion.sample(s[:, 0], k) for k in (1, 2))
    expected = [motion.sample(s[:, 0]), first * rates[1], second * rates[1] ** 2 + first * rates[2]]
    for derivative, values in enumerate(expected):
        path = over_time(motion, law, 1.0, derivative)
        np.testing.assert_allclose(path.sample(inside), values, rtol=0, atol=1e-6 * np.abs(values).max())
    margins = law_margins(two_link(), OUT_AND_BACK, law, 30.0)
    assert margins.velocity[1] > 0.1 / share / 30.0


def test_a_break_of_the_law_that_is_nearly_at_a_knot_costs_nothing() -> None:
    """By place: at the knot, a little before it, and a rest upon it."""
    motion = Motion([[0.0], [0.5], [0.0]])  # one knot, at 1/2
    for middle in (0.5, 0.5 - 1e-9, 0.5 + 1e-9, 0.4999):
        law = TimeLaw([0, 0.3, 0.7, 1], [[0, 0, middle, middle], [middle] * 4, [middle, middle, 1, 1]])
        x = np.linspace(0, 1, 1001)
        for derivative in range(4):
            path = over_time(motion, law, 1.0, derivative)
            assert path.pieces <= 4
            if derivative == 0:
                np.testing.assert_allclose(path.sample(x), motion.sample(law.sample(x)), rtol=0, atol=1e-14)
            if derivative == 1:
                expected = motion.sample(law.sample(x), 1) * law.sample(x, 1)[:, None]
                np.testing.assert_allclose(path.sample(x), expected, rtol=0, atol=1e-12)


def test_a_law_that_dwells_is_within_its_limits_and_rests() -> None:
    robot = two_link()
    for motion in (OUT_AND_BACK, Motion([[0, 0], [0.3, 0.5], [0, 0]])):
        made = Trajectory(robot, motion, time_law=DWELL)
        assert made.limits.holds
        t = np.linspace(0.31, 0.69, 50) * made.duration
        np.testing.assert_array_equal(made.sample(t).dq, np.zeros((50, 2)))
        np.testing.assert_allclose(made.sample(made.time_at(0.5)).q, motion.sample(0.5), atol=1e-12)
        assert made.path.sample(t) == pytest.approx(made.sample(t).q, abs=1e-14)


def test_a_law_whose_acceleration_jumps_where_the_arm_rests_has_a_finite_jerk() -> None:
    margins = law_margins(two_link(), OUT_AND_BACK, DWELL, 1000.0, jerk_limit=1.0)  # it dwells at the goal, where q' = 0
    assert margins.jerk is not None
    assert margins.holds


def test_corners_of_a_law_that_pass_for_rounding_count_as_what_they_add_up_to() -> None:
    count, length = 200, 1e-7
    rates = 1 + 4e-7 * np.arange(count)  # each corner is 4e-7 of the pace
    breaks = 0.5 + length * np.arange(count + 1)
    inside = 0.5 + np.concatenate([[0.0], np.cumsum(rates * length)])
    rest = (1 - inside[-1]) / (1 - breaks[-1])
    last, third = rates[-1] * (1 - breaks[-1]) / 3, (1 - breaks[-1]) / 3
    pieces = [np.linspace(0, 0.5, 4)] + [np.linspace(a, b, 4) for a, b in pairwise(inside)]
    pieces.append(np.array([inside[-1], inside[-1] + last, 1 - rest * third, 1.0]))
    law = TimeLaw([0, *breaks, 1], pieces)
    middle = Motion([[0, 0], [0, 0.5]])
    change = middle.sample(0.5, 1)[1] * (rates[-1] - rates[0]) / (length * count)
    assert law_margins(two_link(), middle, law, 1.0).acceleration[1] * two_link().acceleration[1] >= 0.99 * change


STEEP: dict[str, Any] = {
    "time law of degree 60": lambda: TimeLaw([0, 1], [np.linspace(0, 1, 61)]),
    "time law too steep": lambda: TimeLaw([0, 0.5, 0.5 + 1e-8, 1], [[0] * 4, [0, 0, 1, 1], [1] * 4]),
}


@pytest.mark.parametrize("case", STEEP)
def test_laws_that_numbers_cannot_follow_are_refused(case: str) -> None:
    assert_refused("motion", case, ProblemError, STEEP[case])
