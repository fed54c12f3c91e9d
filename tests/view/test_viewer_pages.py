"""The viewer in a browser: it opens without the network, plans on a click, and two pages show the same."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from house.source import REPOSITORY
from spacearm.core.rotations import matrix_of
from spacearm.files import load_problem, load_saved_plan
from spacearm.view.placements import as_handle
from support.browser import Visit, started_browser

pytest.importorskip("viser", reason="viser is not installed: pip install 'spacearm[view]'")

FIRST = REPOSITORY / "examples" / "01_first_plan.yaml"
LONG = 60_000.0  # [ms] a page may wait: Chromium draws with the processor here, beside other tests

SIZE = 760, 560  # pixels: the processor draws them


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with started_browser() as found:
        yield found


@pytest.fixture
def viewer(tmp_path: Path) -> Iterator[Any]:
    from spacearm.view.open_viewer import Viewer

    made = Viewer(FIRST, tmp_path, host="127.0.0.1", port=0)
    yield made
    made.close()


@pytest.fixture
def visit(browser: Any, viewer: Any) -> Iterator[Callable[[], Visit]]:
    visits: list[Visit] = []

    def open_page() -> Visit:
        made = Visit(browser, size=SIZE)
        visits.append(made)
        made.page.set_default_timeout(LONG)
        made.page.goto(viewer.url)
        made.page.get_by_role("button", name="Plan", exact=True).wait_for()
        made.page.get_by_text("configurations reach it").wait_for()
        return made

    yield open_page
    for one in visits:
        one.close()


def tab(page: Any, name: str) -> None:
    page.get_by_role("tab", name=name, exact=True).click()


def field(page: Any, label: str) -> Any:
    """Return the input behind a label: viser does not tie them together for all kinds."""
    return page.get_by_text(label, exact=True).locator("xpath=following::input[1]")


def test_a_page_opens_without_errors_and_without_the_network(visit: Callable[[], Visit], viewer: Any) -> None:
    opened = visit()
    assert opened.page.get_by_text("Not planned yet").is_visible()
    assert opened.page.get_by_text("link 'forearm' and obstacle 2").is_visible()
    assert not opened.errors
    foreign = [url for url in opened.requests if not url.startswith((viewer.url, "data:", "blob:"))]
    assert not foreign
    for name in ("Start", "Goal", "Obstacles", "Files", "View"):
        tab(opened.page, name)
    assert not opened.errors


def test_a_click_plans_and_plays_and_files_are_saved(visit: Callable[[], Visit], viewer: Any, tmp_path: Path) -> None:
    page = visit().page
    page.get_by_role("button", name="Plan", exact=True).click()
    page.get_by_text("Proven: at least").wait_for()
    page.get_by_role("button", name="Pause", exact=True).wait_for()
    page.get_by_text("Clearance over time").wait_for()
    page.get_by_role("button", name="Pause", exact=True).click()
    page.get_by_role("button", name="Play", exact=True).wait_for()
    assert viewer.session.motion.plan.found
    tab(page, "Files")
    for what, name in (("plan", "mine"), ("problem", "problem of mine")):
        field(page, f"{what.capitalize()} as").fill(name)
        page.get_by_role("button", name=f"Save {what}", exact=True).click()
        page.get_by_text(name).last.wait_for()
    viewer.app.settle(60)
    assert load_saved_plan(tmp_path / "mine.json").trajectory == viewer.session.motion.trajectory
    assert load_problem(tmp_path / "problem of mine.yaml") == viewer.session.edited.problem
    field(page, "Plan as").fill("../outside")
    page.get_by_role("button", name="Save plan", exact=True).click()
    page.get_by_text("the file's name is '../outside'").wait_for()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["mine.json", "problem of mine.yaml"]


def test_two_pages_show_the_same(visit: Callable[[], Visit], viewer: Any) -> None:
    one, other = visit(), visit()
    for opened in (one, other):
        tab(opened.page, "Start")
    one.page.get_by_text("elbow [deg]").wait_for()
    viewer.session.set_start_joint(3, np.radians(35.5))
    for opened in (one, other):
        opened.page.wait_for_function("[...document.querySelectorAll('input')].some((one) => one.value === '35.5')")
    tab(one.page, "Plan")
    field(one.page, "Clearance [mm]").fill("12.5")
    field(one.page, "Clearance [mm]").press("Enter")
    tab(other.page, "Plan")
    other.page.wait_for_function("[...document.querySelectorAll('input')].some((one) => one.value === '12.5')")
    viewer.app.settle(60)
    assert viewer.session.edited.problem.clearance == pytest.approx(0.0125)
    one.page.get_by_role("button", name="Plan", exact=True).click()
    for opened in (one, other):
        opened.page.get_by_text("Proven: at least").wait_for()
    assert one.errors == other.errors == []
    late = visit()
    late.page.get_by_text("Proven: at least").wait_for()


def test_a_plan_is_cancelled_on_a_click(visit: Callable[[], Visit], viewer: Any) -> None:
    page = visit().page
    viewer.session.set_budget(None, 600.0)
    page.get_by_role("button", name="Plan", exact=True).click()
    page.get_by_text("better and better ones").wait_for()
    page.get_by_role("button", name="Cancel", exact=True).click()
    page.get_by_text("it was interrupted").first.wait_for()
    assert viewer.session.job.wait(60)
    assert viewer.session.motion.plan.interrupted


def test_contact_and_what_cannot_be_are_told(visit: Callable[[], Visit], viewer: Any) -> None:
    page = visit().page
    viewer.session.move_obstacle(0, as_handle([0.0, 0.6, 0.0], [1, 0, 0, 0]))
    page.get_by_text("penetrate by").first.wait_for()
    page.get_by_role("button", name="Plan", exact=True).click()
    page.get_by_text("No motion").first.wait_for()
    viewer.session.set_goal_position([30.0, 0.0, 0.0])
    page.get_by_text("comes no nearer to the goal").wait_for()


def point_on_screen(viewer: Any, page: Any, point: Any) -> tuple[float, float]:
    """Return where a point of the scene is in the window [pixels], by the page's camera."""
    (client,) = viewer._server.get_clients().values()
    box = page.locator("canvas").first.bounding_box()
    camera = client.camera
    at = matrix_of(np.asarray(camera.wxyz)).T @ (np.asarray(point) - camera.position)
    half = np.tan(camera.fov / 2)
    x, y = at[0] / at[2] / half / (box["width"] / box["height"]), at[1] / at[2] / half
    return box["x"] + box["width"] * (1 + x) / 2, box["y"] + box["height"] * (1 + y) / 2


def test_the_goal_is_dragged_by_its_handle(visit: Callable[[], Visit], viewer: Any) -> None:
    page = visit().page
    page.wait_for_timeout(2000)
    before = np.array(viewer.session.edited.problem.goal.position)
    arrow = before + np.array([0.0, 0.0, 0.6 * 0.22 * viewer.app.scene.reach])
    end = arrow + np.array([0.0, 0.0, 0.2])
    page.mouse.move(*point_on_screen(viewer, page, arrow))
    page.wait_for_timeout(500)
    page.mouse.down()
    page.mouse.move(*point_on_screen(viewer, page, end), steps=6)
    page.wait_for_timeout(500)
    page.mouse.up()
    for _ in range(int(LONG / 100)):  # the page tells the viewer of it when it gets to it
        if viewer.session.edited.problem.goal.position[2] - before[2] > 0.05:
            break
        page.wait_for_timeout(100)
    viewer.app.settle(60)
    after = np.array(viewer.session.edited.problem.goal.position)
    np.testing.assert_allclose(after[:2], before[:2], atol=1e-6)
    assert 0.05 < after[2] - before[2] < 0.4
    assert viewer.session.outdated is False


def test_a_plan_file_plays_at_once(browser: Any, tmp_path: Path) -> None:
    import spacearm as sa
    from spacearm.view.open_viewer import Viewer

    problem = load_problem(FIRST)
    sa.save_plan(sa.plan(problem, sa.PlannerSettings(stop_at_first=True), rng=0), tmp_path / "plan.json")
    viewer = Viewer(tmp_path / "plan.json", tmp_path, host="127.0.0.1", port=0)
    opened = Visit(browser, size=SIZE)
    try:
        opened.page.set_default_timeout(LONG)
        opened.page.goto(viewer.url)
        opened.page.get_by_text("From a file, which says that it is proven").wait_for()
        opened.page.get_by_role("button", name="Pause", exact=True).wait_for()
        assert not opened.errors
    finally:
        opened.close()
        viewer.close()


def test_a_thousand_balls_are_one_batch(browser: Any, tmp_path: Path) -> None:
    from spacearm.view.open_viewer import Viewer

    rng = np.random.default_rng(0)
    centers = rng.uniform(-1, 1, (1000, 3)) * [3, 3, 1] + [0, 0, 2]
    rows = "\n".join(f"  - sphere: {{center: {row.round(3).tolist()}, radius: 0.05}}" for row in centers)
    text = f"spacearm: 1\nrobot: zhang2022\nscene:\n{rows}\nstart: [0, 0, 0, 0, 0, 0, 0]\ngoal: {{position: [0.7, 0.3, 0]}}\n"
    (tmp_path / "many.yaml").write_text(text)
    viewer = Viewer(tmp_path / "many.yaml", tmp_path, host="127.0.0.1", port=0)
    opened = Visit(browser, size=SIZE)
    try:
        opened.page.set_default_timeout(LONG)
        opened.page.goto(viewer.url)
        opened.page.get_by_role("button", name="Plan", exact=True).wait_for()
        viewer.session.move_obstacle(500, as_handle([0.0, 0.6, 0.0], [1, 0, 0, 0]))
        opened.page.get_by_text("obstacle 500").first.wait_for()
        assert not opened.errors
    finally:
        opened.close()
        viewer.close()
