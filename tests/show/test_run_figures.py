"""Figures of runs: fitness over the iterations, joints over the iterations, methods beside each other."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from spacearm.core.errors import RobotError, SettingsError
from spacearm.robot import load_robot
from spacearm.show import ComparedMethod, figure_comparison, figure_convergence, figure_joints_over_iterations
from spacearm.show.figure_style import moved_apart, new_figure
from support.drawn_runs import levels, run, texts, two_joints
from support.messages import assert_refused

NAN = math.nan


def drawn(figure: object) -> object:
    """Draw a figure, which warns of what does not fit."""
    figure.canvas.draw()  # type: ignore[attr-defined]
    return figure


def feasible_and_not(ax: object) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Return the curves of the runs, solid and dashed, as rows of values."""
    lines = [line for line in ax.get_lines() if len(line.get_xdata()) > 2 or line.get_drawstyle() == "steps-post"]  # type: ignore[attr-defined]
    solid = [np.asarray(line.get_ydata()) for line in lines if line.get_linestyle() == "-"]
    dashed = [np.asarray(line.get_ydata()) for line in lines if line.get_linestyle() != "-"]
    return solid, dashed


def test_what_is_not_feasible_is_dashed_and_what_is_feasible_solid() -> None:
    figure = drawn(figure_convergence([run([2.0, 1.0, 3.0, 2.5], [0.4, 0.2, 0.0, 0.0])]))
    solid, dashed = feasible_and_not(figure.axes[0])  # type: ignore[attr-defined]
    np.testing.assert_array_equal(solid, [[NAN, NAN, 3.0, 2.5]])
    np.testing.assert_array_equal(dashed, [[2.0, 1.0, 3.0, NAN]])  # goes on to the first feasible value, without a gap


def test_the_median_counts_what_is_not_feasible_as_the_worst() -> None:
    runs = [run([0.1, 5.0], [1.0, 0.0]), run([3.0, 3.0]), run([4.0, 2.0])]
    figure = figure_convergence(runs)
    solid, _ = feasible_and_not(figure.axes[0])
    assert any(np.array_equal(curve, [4.0, 3.0]) for curve in solid)


@pytest.mark.parametrize(
    "runs",
    [
        [run([2.0])],
        [run([2.0], [0.3])],
        [run([2.0, 2.0, 2.0], [0.3, 0.3, 0.3])] * 4,
        [run([NAN, math.inf, 1.0]), run([NAN, NAN, NAN], [math.inf] * 3)],
        [run([NAN], [math.inf])],
        [run([3.0, 1.0]), run([3.0, 2.0, 1.0, 0.5]), run([1.0])],
        [run([-1e-3, -2e-3])] * 20,
    ],
    ids=["one iteration", "one, infeasible", "all infeasible", "failed", "only failed", "lengths differ", "negative"],
)
def test_any_runs_can_be_drawn(runs: list) -> None:
    ax = drawn(figure_convergence(runs, best_known=0.4, reported=0.41, threshold=0.42)).axes[0]  # type: ignore[attr-defined]
    assert ax.get_xlabel() == "iteration"
    assert "fitness" in ax.get_ylabel()
    assert set(levels(ax)) >= {0.4, 0.41, 0.42}
    for name in ("best known", "reported best", "threshold"):
        assert name in texts(ax)
    assert ("not feasible yet" in texts(ax)) == any((run.history.violation > 0).any() or np.isnan(run.fitness) for run in runs)
    drawn(figure_comparison([ComparedMethod(name="pso", runs=runs, reported=(1.0, 2.0, 3.0))], threshold=2.0))


def test_figures_are_drawn_into_given_axes() -> None:
    figure = new_figure(7.0, 3.0)
    left, right = figure.subplots(1, 2)
    assert figure_convergence([run([2.0, 1.0])], ax=left) is figure
    assert figure_comparison([ComparedMethod(name="pso", runs=[run([2.0, 1.0])])], ax=right) is figure
    drawn(figure)


def test_no_runs_are_refused() -> None:
    assert_refused("show", "convergence of no runs", SettingsError, lambda: figure_convergence([]))
    assert_refused("show", "comparison of no methods", SettingsError, lambda: figure_comparison([]))


def test_the_joints_are_drawn_in_print_units_within_their_limits() -> None:
    robot = two_joints(prismatic=True)
    positions = np.array([[0.0, 0.2], [0.5, 0.3], [1.0, 0.4]])
    figure = drawn(figure_joints_over_iterations(run([3.0, 2.0, 1.0], [1, 0, 0], positions=positions), robot=robot))
    turn, slide = figure.axes  # type: ignore[attr-defined]
    assert turn.get_title(loc="left") == "turn"
    assert "[deg]" in turn.get_ylabel()
    assert "[m]" in slide.get_ylabel()
    np.testing.assert_allclose(levels(turn), np.degrees([-2.0, 2.0]))
    np.testing.assert_allclose(levels(slide), [-0.5, 1.0])
    solid, _ = feasible_and_not(turn)
    np.testing.assert_allclose(solid[0], np.degrees([NAN, 0.5, 1.0]))


def test_joints_without_limits_or_with_one_iteration_can_be_drawn() -> None:
    robot = two_joints(endless=True)
    figure = drawn(figure_joints_over_iterations(run([3.0], positions=np.zeros((1, 2))), robot=robot))
    assert levels(figure.axes[0]) == []  # type: ignore[attr-defined]


def test_seven_joints_have_a_panel_each_and_every_column_ends_with_the_iterations() -> None:
    arm = load_robot("zhang2022")
    figure = drawn(figure_joints_over_iterations(run([3.0, 2.0], positions=np.zeros((2, 7))), robot=arm, title="pso"))
    shown = [ax for ax in figure.axes if ax.get_visible()]  # type: ignore[attr-defined]
    assert [ax.get_title(loc="left") for ax in shown] == list(arm.dof_names)
    assert [ax.get_xlabel() for ax in shown] == [""] * 3 + ["iteration"] * 4


def test_runs_that_are_not_of_the_robot_are_refused() -> None:
    arm = two_joints()
    assert_refused("show", "no positions", SettingsError, lambda: figure_joints_over_iterations(run([1.0]), robot=arm))
    wrong = run([1.0], positions=np.zeros((1, 3)))
    assert_refused("show", "other robot", RobotError, lambda: figure_joints_over_iterations(wrong, robot=arm))


def test_the_comparison_names_methods_and_counts_runs_that_are_not_feasible() -> None:
    rows = [
        ComparedMethod(name="pso", runs=[run([3.0]), run([2.0]), run([1.0], [0.5])], reported=(2.1, 2.5, 3.5)),
        ComparedMethod(name="ours", runs=[run([1.5])]),
    ]
    ax = drawn(figure_comparison(rows, best_known=1.4, threshold=1.45)).axes[0]  # type: ignore[attr-defined]
    assert "fitness" in ax.get_xlabel()
    assert [label.get_text() for label in ax.get_yticklabels()] == ["pso", "ours"]
    assert "1 of 3\nnot feasible" in texts(ax)
    shown = np.concatenate([dots.get_offsets()[:, 0] for dots in ax.collections])
    np.testing.assert_array_equal(np.sort(shown), [1.5, 2.0, 3.0])


@given(st.lists(st.floats(-10, 10), max_size=8), st.floats(0.01, 3.0))
def test_labels_are_moved_apart_and_keep_their_order(values: list[float], gap: float) -> None:
    moved = moved_apart(values, gap)
    order = np.argsort(values, kind="stable")
    assert (np.diff(moved[order]) >= gap * (1 - 1e-9)).all()
    if values:
        assert np.isclose(moved.mean(), np.mean(values))
