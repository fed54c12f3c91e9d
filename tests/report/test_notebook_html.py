"""What notebooks show: rows and tables, the report in a frame, in a real kernel and in a browser."""

from __future__ import annotations

import html
import importlib.util
import json
import re
import shutil
import subprocess
import sys
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pytest

import spacearm as sa
from house.source import REPOSITORY
from spacearm.core import notebook_hook
from spacearm.report.notebook_html import HEIGHT, html_of

ROBOT = sa.load_robot("srs7")
HOME = ROBOT.configuration("home")
SCENE = sa.Scene([sa.Sphere((0.5, 0.5, 0.0), 0.1, name="<ball> & co"), sa.Box((0.1, 0.1, 0.1), (3, 3, 3))])
PROBLEM = sa.Problem(ROBOT, SCENE, start=HOME, goal=HOME + 0.2)
PLAN = sa.plan(PROBLEM, sa.PlannerSettings(evaluations=30), rng=0)


class Tags(HTMLParser):
    """Counts tags, and sees whether each is closed."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.seen: list[str] = []
        self.frames: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.open.append(tag)
        self.seen.append(tag)
        if tag == "iframe":
            self.frames.append(dict(attrs)["srcdoc"] or "")

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


def parsed(text: str) -> Tags:
    tags = Tags()
    tags.feed(text)
    assert not tags.open, f"never closed: {tags.open}"
    assert not re.search(r"https?://", re.sub(r'srcdoc="[^"]*"', "", text)), "something would be fetched"
    return tags


def saved(folder: Path) -> Any:
    sa.save_plan(PLAN, folder / "plan.json")
    return sa.load_saved_plan(folder / "plan.json")


def test_a_plan_shows_its_verdict_and_the_report(tmp_path: Path) -> None:
    for value in (PLAN, saved(tmp_path)):
        text = value._repr_html_()
        tags = parsed(text)
        assert len(tags.frames) == 1
        assert tags.frames[0].startswith("<!doctype html>")
        assert 'id="data"' in tags.frames[0]
        assert f'height="{HEIGHT}"' in text
        assert re.search(r"part of this output, \d\.\d\d MB, and needs no network", text)
        assert "joint path" in text or "says the file" in text
    assert html.escape(PLAN.message) in PLAN._repr_html_()


def test_a_plan_without_a_motion_is_shown_too() -> None:
    stuck = sa.plan(sa.Problem(ROBOT, [sa.Sphere((0, 0, 0.5), 0.4)], start=HOME, goal=HOME + 0.1), rng=0)
    text = stuck._repr_html_()
    parsed(text)
    assert "the start is in collision" in text


@pytest.mark.parametrize(
    ("value", "parts"),
    [
        (PLAN.certificate, ["Certificate holds", "at least", "proven for all t"]),
        (ROBOT, ["joint_4", "speed, per s", "Limits", "<iframe"]),
        (SCENE, ["&lt;ball&gt; &amp; co", "Sphere", "Obstacles"]),
        (PROBLEM, ["10 mm asked for", "the configuration", "Box"]),
        (sa.Scene(), ["free space"]),
        (sa.diagnose(REPOSITORY / "examples" / "faulty_arm.urdf"), ["Findings", "error", "severity"]),
        (sa.minimize(lambda x: (x**2).sum(axis=1), [-1], [1], sa.PSO(particles=5, iterations=3), rng=0), ["feasible", "x"]),
        (
            sa.robustness(replace(PROBLEM, base="fixed"), sa.Trajectory(ROBOT, PLAN.trajectory.motion, base="fixed")),
            ["Tracking errors that are proven", "joint_7"],
        ),
        (sa.pareto_front(PROBLEM, sa.PlannerSettings(evaluations=30), points=2, rng=0), ["on the front", "duration"]),
    ],
    ids=lambda value: type(value).__name__ if not isinstance(value, list) else "",
)
def test_other_values_are_shown_as_small_tables(value: Any, parts: list[str]) -> None:
    text = value._repr_html_()
    parsed(text)
    for part in parts:
        assert part in text
    assert "<ball>" not in text
    if "<iframe" not in text:
        assert len(text) < 40_000


def test_of_many_obstacles_the_first_are_listed() -> None:
    many = sa.Scene([sa.Sphere((i, 0, 0), 0.1) for i in range(3000)])
    text = many._repr_html_()
    assert text.count("<tr") < 30
    assert "and 2,980 more rows, left out here" in text


def test_small_values_have_no_html() -> None:
    for value in (SCENE.obstacles[0], PLAN.trajectory.motion, sa.PSO(), HOME):
        assert not hasattr(value, "_repr_html_")


def test_without_a_maker_the_text_is_shown(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(notebook_hook, "_makers", [])
    assert PLAN._repr_html_() is None


def test_nothing_of_it_is_loaded_before_a_notebook_asks() -> None:
    program = "import sys, spacearm as sa; r = sa.load_robot('srs7'); repr(r); print('spacearm.show' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"


CELLS = (
    "import spacearm as sa\n"
    "robot = sa.load_robot('srs7')\n"
    "home = robot.configuration('home')\n"
    "problem = sa.Problem(robot, [sa.Sphere((0.5, 0.5, 0.0), 0.1, name='ball')], start=home, goal=home + 0.2)\n"
    "robot",
    "plan = sa.plan(problem, sa.PlannerSettings(evaluations=30), rng=0)\nplan",
    "plan.certificate",
    "[plan, plan]",
)


RUN_CELLS = """
import json, sys
import nbformat
from jupyter_client.manager import AsyncKernelManager
from nbclient import NotebookClient

class Here(AsyncKernelManager):  # starts this Python, whether a kernel of it is registered or not
    def format_kernel_cmd(self, extra_arguments=None):
        return [sys.executable, "-m", "ipykernel_launcher", "-f", self.connection_file, *(extra_arguments or [])]

book = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(text) for text in json.load(sys.stdin)])
NotebookClient(book, km=Here(kernel_name="python3"), timeout=120, resources={}).execute()
json.dump([cell.outputs[-1].data for cell in book.cells], sys.stdout)
"""


@pytest.fixture(scope="module")
def outputs() -> list[Any]:
    """Run the cells in a kernel, in a process of its own, and return the data of each one's result."""
    for name in ("nbclient", "nbformat", "ipykernel"):
        if importlib.util.find_spec(name) is None:
            pytest.skip(f"{name} is not installed: nothing here runs a notebook")
    command = [sys.executable, "-c", RUN_CELLS]
    done = subprocess.run(command, input=json.dumps(CELLS), capture_output=True, text=True, check=False, timeout=300)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_a_kernel_shows_html_and_keeps_the_text(outputs: list[Any]) -> None:
    robot, plan, certificate, listed = outputs
    assert plan["text/html"].count("<iframe") == 1
    assert plan["text/plain"].startswith("<Plan found: robot 'srs7', 1 obstacle, floating base\n")
    assert len(plan["text/plain"].split("\n")) <= 8
    assert "joint_7" in robot["text/html"]
    assert certificate["text/plain"].startswith("<Certificate holds")
    assert "text/html" not in listed
    assert len(listed["text/plain"].split("\n")) <= 16


def test_a_browser_shows_the_report_in_the_output(outputs: list[Any], tmp_path: Path) -> None:
    chromium = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if chromium is None:
        pytest.skip("there is no Chromium here to look at the output with")
    playwright = pytest.importorskip("playwright.sync_api", reason="playwright drives the browser")
    page_file = tmp_path / "notebook.html"
    page_file.write_text("<!doctype html><meta charset=utf-8><body>" + outputs[1]["text/html"], encoding="utf-8")
    switches = "--no-sandbox --disable-gpu --use-angle=swiftshader --enable-unsafe-swiftshader --disable-quic"
    quiet = "--no-first-run --disable-background-networking --disable-component-update --disable-sync"
    faults: list[str] = []
    requests: list[str] = []
    with playwright.sync_playwright() as library:
        browser = library.chromium.launch(executable_path=chromium, args=[*switches.split(), *quiet.split()])
        page = browser.new_page(viewport={"width": 1000, "height": 900})
        page.on("console", lambda said: faults.append(said.text) if said.type == "error" else None)
        page.on("pageerror", lambda error: faults.append(str(error)))
        page.on("request", lambda one: requests.append(one.url))
        page.goto(page_file.as_uri())
        frame = page.frames[-1]
        frame.wait_for_function("window.spacearm !== undefined", timeout=60_000)
        frame.evaluate("window.spacearm.ready")
        text = frame.inner_text("body")
        browser.close()
    assert "srs7" in text
    assert not faults
    assert requests == [page_file.as_uri()]


def test_the_maker_is_the_one_that_the_package_registers() -> None:
    assert PLAN.certificate._repr_html_() == html_of(PLAN.certificate)
