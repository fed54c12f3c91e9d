"""Where the page has a robot is where Python has it, and the slider moves it there."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest

import spacearm as sa
from spacearm.files.problem_file import load_problem_file
from spacearm.report.report_plan import save_report
from support.browser import Visit

EXAMPLES = Path(__file__).parents[2] / "examples"
EXACT = 1e-5  # [m] and [-]: of a pose in the page, of Python's
SHOWN = ("01_first_plan.yaml", "07_box_servicer.yaml")  # a fixed base, a floating one


class Reported(NamedTuple):
    """A motion, and the window that shows its report."""

    trajectory: Any
    window: Visit


@pytest.fixture(scope="module", params=SHOWN)
def reported(request: pytest.FixtureRequest, browser: Any, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Reported]:
    given = load_problem_file(EXAMPLES / request.param)
    plan = sa.plan(given.problem, given.settings, rng=7)
    assert plan.trajectory is not None, plan.message
    path = tmp_path_factory.mktemp("plan") / "report.html"
    save_report(plan, path)
    window = Visit(browser).open(path)
    yield Reported(plan.trajectory, window)
    window.close()


def tips(window: Visit, t: np.ndarray) -> np.ndarray:
    """Where the page has the end effector, (m, 4, 4)."""
    rows = window.page.evaluate("(t) => t.map((at) => spacearm.tip(0, at))", t.tolist())
    return np.array(rows).reshape(-1, 4, 4).transpose(0, 2, 1)


def test_the_page_has_the_end_effector_where_the_trajectory_has_it(reported: Reported) -> None:
    t = np.concatenate(
        [[0.0, reported.trajectory.duration], np.random.default_rng(3).uniform(0, reported.trajectory.duration, 200)]
    )
    assert np.abs(tips(reported.window, t) - reported.trajectory.tip(t)).max() < EXACT


def test_it_loads_from_a_file_without_errors_and_without_requests(reported: Reported) -> None:
    window = reported.window
    assert window.errors == []
    assert [address[:8] for address in window.requests] == ["file:///"]
    assert window.page.title()


def test_the_slider_moves_the_robot_in_the_picture(reported: Reported) -> None:
    window = reported.window
    slider = window.page.locator(".player input[type=range]")
    box = window.rect(".player input[type=range]")
    before = window.picture()
    window.page.mouse.move(box["x"] + 8, box["y"] + box["height"] / 2)
    window.page.mouse.down()
    window.page.mouse.move(box["x"] + box["width"] * 0.6, box["y"] + box["height"] / 2, steps=3)
    window.page.mouse.up()
    assert window.picture() != before
    assert window.time() == pytest.approx(0.6 * reported.trajectory.duration, rel=0.05)
    assert slider.get_attribute("aria-valuetext")
    window.page.evaluate("spacearm.seek(0)")
    assert window.picture() == before


def test_values_beside_the_labels_are_those_of_the_trajectory(reported: Reported) -> None:
    window, trajectory = reported.window, reported.trajectory
    at = float(np.float32(0.37 * trajectory.duration))
    window.page.evaluate(f"spacearm.seek({at})")
    shown = window.values("joint-positions")
    q = trajectory.sample(at).q
    for i, name in enumerate(trajectory.robot.dof_names):
        value = q[i] * (1 if trajectory.robot.is_prismatic(i) else 180 / np.pi)
        assert float(shown[name].replace("\u2212", "-")) == pytest.approx(value, abs=0.06), name


@pytest.mark.parametrize("size", [(1280, 800), (1920, 1080), (390, 844)])
def test_nothing_stands_out_or_lies_over_another(
    reported: Reported, size: tuple[int, int], visit: Callable[..., Visit]
) -> None:
    window = reported.window
    window.page.set_viewport_size({"width": size[0], "height": size[1]})
    window.frame()
    assert window.page.evaluate("document.documentElement.scrollWidth") <= size[0]
    rects = window.page.evaluate(
        """[...document.querySelectorAll('.panel, .section, .picture, .player, .bar, .block, .top > .title')]
            .filter((one) => one.checkVisibility()).map((one) => {
              const {x, y, right, bottom} = one.getBoundingClientRect();
              return [one.className, x, y, right, bottom, getComputedStyle(one).position]; })"""
    )
    laid = [one for one in rects if one[5] not in ("fixed", "sticky")]
    for name, x, _, right, _, _ in rects:
        assert min(x, size[0] - right) >= -0.5, f"{name} stands out of the window"
    for i, (name, x, y, right, bottom, _) in enumerate(laid):
        for other, x2, y2, right2, bottom2, _ in laid[:i]:
            apart = x >= right2 - 1 or x2 >= right - 1 or y >= bottom2 - 1 or y2 >= bottom - 1
            assert apart, f"{name} lies over {other}"
    player = window.rect(".player")
    assert player["y"] + player["height"] <= size[1] + 0.5, "the player is below the window"
    window.page.set_viewport_size({"width": 1280, "height": 800})
