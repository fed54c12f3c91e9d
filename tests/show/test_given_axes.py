"""Figures in axes that the caller has made, of plans, saved plans and trajectories; and where matplotlib is not installed."""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import spacearm as sa
from house.source import REPOSITORY
from spacearm.cli import main
from spacearm.core import extras
from spacearm.core.errors import ProblemError, SettingsError
from spacearm.show import (
    ComparedMethod,
    figure_base_motion,
    figure_base_paths,
    figure_clearance,
    figure_comparison,
    figure_convergence,
    figure_joints,
    figure_joints_over_iterations,
    figure_path_2d,
    figure_path_3d,
)
from spacearm.show.figure_style import new_figure

ROBOT = sa.load_robot("srs7")
HOME = ROBOT.configuration("home")
BALL = sa.Sphere((0.5, 0.5, 0.0), 0.1, name="ball")
PLAN = sa.plan(sa.Problem(ROBOT, [BALL], start=HOME, goal=HOME + 0.2), sa.PlannerSettings(evaluations=30), rng=0)
RUN = sa.minimize(
    lambda x: (x**2).sum(axis=1), ROBOT.lower, ROBOT.upper, sa.PSO(particles=5, iterations=4), rng=0, history="positions"
)
OF_MOTIONS: dict[Callable[..., Any], tuple[int, int]] = {
    figure_path_2d: (1, 1),
    figure_path_3d: (1, 1),
    figure_joints: (7, 3),
    figure_clearance: (1, 1),
    figure_base_motion: (3, 1),
    figure_base_paths: (2, 3),
}


def saved(folder: Path) -> Any:
    sa.save_plan(PLAN, folder / "plan.json")
    return sa.load_saved_plan(folder / "plan.json")


@pytest.mark.parametrize("draw", OF_MOTIONS)
def test_a_figure_is_drawn_of_a_plan_a_saved_plan_and_a_trajectory(draw: Callable[..., Any], tmp_path: Path) -> None:
    assert PLAN.found
    of_plan, of_file = draw(PLAN), draw(saved(tmp_path), title="read")
    among = {"scene": PLAN.problem.scene} if draw in (figure_path_2d, figure_path_3d, figure_clearance) else {}
    of_motion = draw(PLAN.trajectory, **among)
    panels = [len([ax for ax in figure.axes if ax.get_visible()]) for figure in (of_plan, of_file, of_motion)]
    assert panels == [OF_MOTIONS[draw][0] * OF_MOTIONS[draw][1]] * 3
    for figure in (of_plan, of_file, of_motion):
        figure.canvas.draw()


@pytest.mark.parametrize("draw", OF_MOTIONS)
def test_a_figure_is_drawn_into_given_axes_and_leaves_the_others_alone(draw: Callable[..., Any]) -> None:
    rows, columns = OF_MOTIONS[draw]
    figure = new_figure(7, 8, layout=None)
    left, right = figure.subfigures(1, 2)
    kind = {"subplot_kw": {"projection": "3d"}} if draw is figure_path_3d else {}
    cells = left.subplots(rows, columns, squeeze=rows * columns == 1, **kind)
    other = right.subplots()
    assert draw(PLAN, cells, title="given") is figure
    given = [cells] if rows * columns == 1 else cells.ravel().tolist()
    assert all(ax.has_data() for ax in given)
    assert not other.has_data()
    assert "given" in given[0].get_title(loc="left")
    assert not figure.texts
    figure.canvas.draw()


def test_swarms_are_drawn_into_given_axes() -> None:
    figure = new_figure(7, 7, layout=None)
    cells = figure.subplots(3, 3)
    figure_convergence(RUN, cells[0, 0])
    figure_comparison([ComparedMethod(name="pso", runs=[RUN])], cells[0, 1])
    assert figure_joints_over_iterations(RUN, cells.ravel()[2:], robot=ROBOT, title="pso") is figure
    assert cells[0, 2].get_title(loc="left").startswith("pso\n")
    figure.canvas.draw()


def test_another_number_of_axes_is_refused() -> None:
    cells = new_figure(7, 7).subplots(2, 2)
    with pytest.raises(SettingsError, match=r"ax is 4 axes, expected the 21 of this figure.*figure.subplots\(7, 3\)"):
        figure_joints(PLAN, cells)
    with pytest.raises(SettingsError, match="ax is 1 axes, expected the 3 of"):
        figure_base_motion(PLAN, cells[0, 0])
    with pytest.raises(SettingsError, match="ax is 6 axes, expected the 6 of"):
        figure_base_paths(PLAN, [1, 2, 3, 4, 5, 6])


def test_what_has_no_motion_is_refused() -> None:
    stuck = sa.Problem(ROBOT, [sa.Sphere((0, 0, 0.5), 0.4)], start=HOME, goal=HOME + 0.1)
    with pytest.raises(ProblemError, match="a plan without a motion, expected one with a trajectory; the start is in coll"):
        figure_joints(sa.plan(stuck, rng=0))
    with pytest.raises(ProblemError, match="is given 3, expected a Plan, a SavedPlan or a Trajectory"):
        figure_clearance(3)
    with pytest.raises(ProblemError, match="expected a scene with it; give scene="):
        figure_clearance(PLAN.trajectory)
    with pytest.raises(ProblemError, match="without robot, expected both"):
        figure_path_2d(None)


# ---- Without matplotlib ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("draw", [*OF_MOTIONS, figure_convergence])
def test_without_matplotlib_a_figure_says_what_to_install(draw: Callable[..., Any], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(extras, "find_spec", lambda _: None)
    with pytest.raises(
        SettingsError, match=re.escape("needs matplotlib, which is not installed; pip install 'spacearm[figures]'")
    ):
        draw(RUN if draw is figure_convergence else PLAN)


def test_nothing_but_figures_imports_matplotlib() -> None:
    program = (
        "import sys; sys.modules['matplotlib'] = None\n"  # an import of it fails
        "import spacearm as sa, spacearm.show, spacearm.files, spacearm.study.paper_report, spacearm.study.spacebench_report\n"
        "import spacearm.study.motionbenchmaker_report, spacearm.cli.plan_command, spacearm.cli.bench_command\n"
        "robot = sa.load_robot('srs7'); home = robot.configuration('home')\n"
        "problem = sa.Problem(robot, [sa.Sphere((0.5, 0.5, 0.0), 0.1)], start=home, goal=home + 0.2)\n"
        "plan = sa.plan(problem, sa.PlannerSettings(evaluations=30), rng=0)\n"
        "html = [one._repr_html_() for one in (plan, plan.certificate, robot, problem, problem.scene)]\n"
        "sa.certify(problem, plan.trajectory); sa.robustness(sa.plan(sa.Problem(robot, [], start=home, goal=home + 0.2,"
        " base='fixed'), sa.PlannerSettings(evaluations=30), rng=0), singly=False, resolution=0.5)\n"
        "print(len(html), plan.status)\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.split() == ["5", "found"]


@pytest.mark.parametrize(
    "command",
    [
        ["plan", "examples/01_first_plan.yaml", "-o", "OUT", "--figures"],
        ["paper", "-o", "OUT", "--figures"],
        ["bench", "space", "-o", "OUT", "--figures"],
        ["bench", "mbm", "-d", "examples/moveit", "-o", "OUT", "--figures"],
    ],
    ids=lambda words: " ".join(words[:2]),
)
def test_a_command_refuses_figures_before_it_works(
    command: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(REPOSITORY)
    monkeypatch.setattr(extras, "find_spec", lambda _: None)
    assert main([word.replace("OUT", str(tmp_path / "out")) for word in command]) == 2
    said = capsys.readouterr().err
    assert "pip install 'spacearm[figures]'" in said
    assert said.count("\n") == 1
    assert not (tmp_path / "out").exists()
