"""The parts of a report on a swarm: where its particles are, and that no run is left out of a curve."""

from __future__ import annotations

import numpy as np
import pytest

from spacearm.report.report_swarm import (
    arm_over_iterations,
    convergence_plot,
    joints_plot,
    methods_plot,
    reached_plot,
    spread_plot,
    swarm_cloud,
)
from spacearm.robot import forward_kinematics
from spacearm.study.paper_problem import PaperSettings, paper_objective, paper_robot
from spacearm.swarm import SwarmResult, named_settings, run_trials
from spacearm.swarm.swarm_recording import SwarmRecording, record_again
from support.page_reader import unpacked, values_of

ROBOT = paper_robot()
OBJECTIVE = paper_objective(PaperSettings(), "goal", 0.1)


@pytest.fixture(scope="module")
def runs() -> list[SwarmResult]:
    limits = ROBOT.lower, ROBOT.upper
    return run_trials(OBJECTIVE, *limits, named_settings("pso"), seed=0, trials=4, threads=1, keep_positions=True)


@pytest.fixture(scope="module")
def recording(runs: list[SwarmResult]) -> SwarmRecording:
    return record_again(runs[1], OBJECTIVE, ROBOT.lower, ROBOT.upper)


@pytest.mark.parametrize(("most", "sets"), [(10**6, 100), (9000, 30), (10, 2)])
def test_particles_are_the_end_effectors_of_the_swarm(recording: SwarmRecording, most: int, sets: int) -> None:
    cloud, left_out = swarm_cloud(recording, ROBOT, most=most)
    at = unpacked(cloud["at"]).astype(int)
    assert (len(at), at[0], at[-1]) == (sets, 0, 99)
    assert (left_out == "") == (sets == 100)
    assert sets == 100 or f"in {sets} of the 100 iterations" in left_out
    low, high = np.array(cloud["low"]), np.array(cloud["high"])
    points = low + (high - low) * unpacked(cloud["points"]).reshape(sets, 300, 3) / 65535
    tips = forward_kinematics(ROBOT, recording.positions[at])[..., :3, 3]
    np.testing.assert_allclose(points, tips, atol=(high - low).max() / 65535)


def test_colours_are_ranks_feasible_first(recording: SwarmRecording) -> None:
    value = unpacked(swarm_cloud(recording, ROBOT, most=10**6)[0]["value"]).reshape(100, 300).astype(int)
    feasible = recording.violation <= 0
    assert 0 < np.count_nonzero(feasible) < feasible.size
    assert value[feasible].max() <= value[~feasible].min()
    best = np.where(feasible, recording.fitness, np.inf).argmin()
    assert value.ravel()[best] == 0
    assert value.max() == 255


def test_the_arm_is_the_best_of_each_iteration(runs: list[SwarmResult]) -> None:
    knots = arm_over_iterations(runs[1], 0, name="best")["knots"]
    np.testing.assert_array_equal(unpacked(knots["t"]), np.arange(100))
    np.testing.assert_array_equal(unpacked(knots["q"]).reshape(100, 7), np.float32(runs[1].history.positions))
    assert not unpacked(knots["dq"]).any()


def test_every_run_has_a_curve_from_where_it_is_feasible(runs: list[SwarmResult]) -> None:
    plot = convergence_plot(runs, runs[1], title="F")
    assert [one["label"] for one in plot["series"]] == ["run 0", "run 2", "run 3", "median", "mean", "run 1, shown"]
    for run, label in zip(runs, ("run 0", "run 1", "run 2", "run 3"), strict=True):
        curve, feasible = values_of(plot, label), run.history.violation <= 0
        np.testing.assert_array_equal(np.isnan(curve), ~feasible)
        np.testing.assert_array_equal(curve[feasible], np.float32(run.history.fitness[feasible]))
    mean = values_of(plot, "mean")
    assert mean[-1] == pytest.approx(np.mean([run.fitness for run in runs]), rel=1e-6)
    one = convergence_plot(runs[:1], runs[0], title="F")
    assert [curve["label"] for curve in one["series"]] == ["run 0, shown"]


def test_runs_that_are_never_feasible_count_as_the_worst(runs: list[SwarmResult]) -> None:
    blocked = paper_objective(PaperSettings(), "goal", 0.5)
    limits = ROBOT.lower, ROBOT.upper
    never = run_trials(blocked, *limits, named_settings("pso"), seed=0, trials=2, threads=1, keep_positions=True)
    assert not any(run.success for run in never)
    reached = reached_plot("r", "r", {"half": [*runs[:2], *never], "all": runs, "none": never})
    assert [values_of(reached, name).max() for name in ("half", "all", "none")] == [50, 100, 0]
    assert np.isnan(values_of(methods_plot("m", "m", {"none": never, "all": runs}), "none")).all()
    assert not np.isnan(values_of(methods_plot("m", "m", {"none": never, "all": runs}), "all")[-1])
    nothing = reached_plot("r", "r", {"none": never})
    assert values_of(nothing, "none").tolist() == [0]


def test_methods_are_compared_over_evaluations(runs: list[SwarmResult]) -> None:
    limits = ROBOT.lower, ROBOT.upper
    small = run_trials(OBJECTIVE, *limits, named_settings("ring-rising"), seed=0, trials=4, threads=1, keep_positions=True)
    plot = methods_plot("m", "m", {"pso": runs, "ring-rising": small})
    x = unpacked(plot["x"])
    assert (x[0], x[-1]) == (100, 30_000)
    assert np.isnan(values_of(plot, "pso")[0])
    for name, those in (("pso", runs), ("ring-rising", small)):
        middle = np.quantile([run.fitness for run in those], 0.5, method="inverted_cdf")
        assert values_of(plot, name)[-1] == np.float32(middle)


def test_joints_are_in_degrees_with_limits_and_the_spread_falls(recording: SwarmRecording, runs: list[SwarmResult]) -> None:
    plot = joints_plot(runs[1], ROBOT)
    assert plot["unit"] == "deg"
    assert [limit["upper"] for limit in plot["limits"]] == pytest.approx(np.degrees(ROBOT.upper))
    spread = spread_plot(recording, runs[1], ROBOT)
    half = values_of(spread, "half")
    assert half[0] > 10 * half[-1] > 0
