"""The page of the paper's experiment in a browser: the swarm moves with the iterations, the arm is where Python has it."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from spacearm.robot import forward_kinematics
from spacearm.study.paper_experiment import Experiment, run_experiment
from spacearm.study.paper_problem import PaperSettings, paper_robot
from spacearm.study.paper_report import save_report
from support.browser import Visit


@pytest.fixture(scope="module")
def experiment() -> Experiment:
    return run_experiment(PaperSettings(runs=2, methods=("ring",), modes=("goal",), threads=1))


@pytest.fixture(scope="module")
def window(experiment: Experiment, browser: Any, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Visit]:
    folder: Path = tmp_path_factory.mktemp("paper") / "out"
    save_report(experiment, folder)
    opened = Visit(browser).open(folder / "report.html")
    yield opened
    opened.close()


def seek(window: Visit, iteration: int) -> None:
    window.page.evaluate(f"spacearm.seek({iteration})")
    window.frame()


def test_it_opens_at_the_swarm_without_complaints(window: Visit) -> None:
    assert "ring: F = " in window.page.locator(".verdict").inner_text()
    assert window.page.evaluate("spacearm.stage.has('cloud')")
    assert window.errors == []
    assert [address[:8] for address in window.requests] == ["file:///"]


def test_the_arm_is_the_best_of_each_iteration(window: Visit, experiment: Experiment) -> None:
    q = experiment.cells[0].best_run.history.positions
    assert q is not None
    expected = forward_kinematics(paper_robot(), q)
    rows = window.page.evaluate("(n) => Array.from({length: n}, (_, i) => spacearm.tip(0, i))", len(q))
    assert np.abs(np.array(rows).reshape(-1, 4, 4).transpose(0, 2, 1) - expected).max() < 1e-5


def test_particles_move_with_the_iterations_and_can_be_left_out(window: Visit) -> None:
    seek(window, 0)
    first = window.picture()
    seek(window, 60)
    assert window.time() == 60
    later = window.picture()
    assert later != first
    window.page.evaluate("spacearm.stage.set('cloud', false)")
    assert window.picture() != later
    window.page.evaluate("spacearm.stage.set('cloud', true)")
    assert window.picture() == later


def test_the_table_and_the_path_are_views(window: Visit) -> None:
    names = window.page.evaluate("spacearm.page.views.map((view) => view.name)")
    assert names == ["All methods, Table 3", "ring: swarm", "ring: planned path"]
    window.page.evaluate("spacearm.view(0)")
    window.frame()
    assert "ring" in window.page.locator("table").first.inner_text()
    assert not window.page.locator(".player").first.is_visible()
    window.page.evaluate("spacearm.view(2)")
    window.frame()
    assert window.page.locator(".player").first.is_visible()
    assert window.errors == []
