"""The page of the paper's experiment: a view for each swarm and each proven path, all that was declared, and no time."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from spacearm.cli.arguments import parsed
from spacearm.cli.paper_command import Options
from spacearm.study.paper_experiment import Experiment, run_experiment
from spacearm.study.paper_page import command_of, paper_page
from spacearm.study.paper_problem import READINGS, PaperSettings
from spacearm.study.paper_report import LEGEND, path_notes, save_report, table_rows
from spacearm.swarm import NAMED_SETTINGS
from support.page_reader import page_in, texts_in, unpacked

SMALL = PaperSettings(runs=3, methods=("pso", "ipso-e"), radii=(0.1, 0.5), threads=1)


@pytest.fixture(scope="module")
def experiment() -> Experiment:
    return run_experiment(SMALL)


@pytest.fixture(scope="module")
def page(experiment: Experiment, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    folder = tmp_path_factory.mktemp("paper") / "out"
    save_report(experiment, folder)
    return page_in(folder / "report.html")


def test_each_cell_has_a_view_of_its_swarm_and_of_its_path(experiment: Experiment, page: dict[str, Any]) -> None:
    names = ["All methods, Table 3"]
    for cell in experiment.cells:
        name = f"{cell.method}, {cell.mode}, A_R {cell.radius:g} m"
        names.append(f"{name}: swarm")
        if cell.path is not None:
            names.append(f"{name}: planned path")
    assert [view["name"] for view in page["views"]] == names
    assert any(name.endswith("path") for name in names)
    assert page["views"][page["open"]]["name"].endswith(": swarm")
    assert len({robot["name"] for robot in page["robots"]}) == 1
    assert len(page["robots"]) == 2  # thicker among the particles than on its path


def test_a_swarms_view_is_of_the_best_run_and_says_so(experiment: Experiment, page: dict[str, Any]) -> None:
    for cell in experiment.cells:
        name = f"{cell.method}, {cell.mode}, A_R {cell.radius:g} m: swarm"
        (view,) = [view for view in page["views"] if view["name"] == name]
        best = cell.best_run
        assert view["clock"] == {"unit": "iteration", "duration": best.iterations - 1, "step": 1}
        assert view["verdict"]["tone"] == ("good" if best.success else "bad")
        said = " ".join(texts_in(view["sections"]))
        assert f"shown: run {best.trial} of seed 0, the best of the 3" in said
        assert ("the swarm shrinks to" in said) == (cell.method == "ipso-e")
        at = unpacked(view["cloud"]["at"])
        assert at[-1] == best.iterations - 1
        assert f"particles are drawn in {len(at)} of the {best.iterations} iterations" in said
        q = unpacked(view["actors"][0]["knots"]["q"]).reshape(-1, 7)
        np.testing.assert_array_equal(q[-1], np.float32(best.x))
        assert len(view["obstacles"]) == 3


def test_the_first_view_has_the_tables_the_readings_and_the_settings(experiment: Experiment, page: dict[str, Any]) -> None:
    overview = page["views"][0]
    tables = {section["title"]: section["table"] for section in overview["sections"] if "table" in section}
    for title, header, rows in table_rows(experiment):
        shown = tables[title.partition("; ")[0]]
        assert shown == {"header": list(header), "rows": [list(row) for row in rows]}
    said = texts_in(overview)
    assert all(line in said for line in (*LEGEND, *path_notes(experiment)))
    assert all(reading.reading in said for reading in READINGS)
    assert len(overview["plots"]) == 2 * 4  # of each mode and radius


def test_the_page_has_no_time_and_no_date(page: dict[str, Any]) -> None:
    said = " ".join(texts_in({**page, "meshes": []}))
    assert not re.search(r"\b20[2-9]\d-\d\d-\d\d\b|\d ms\b", said)
    assert "seconds" not in said


def test_the_standard_page_is_small(tmp_path: Path) -> None:
    settings = PaperSettings(threads=1)  # all five methods, both modes
    save_report(run_experiment(settings), tmp_path / "out")
    assert (tmp_path / "out" / "report.html").stat().st_size < 3_000_000


def test_many_runs_are_not_all_drawn_and_the_page_says_so() -> None:
    settings = PaperSettings(runs=120, methods=("ring",), modes=("literal",), threads=2)
    experiment = run_experiment(settings)
    view = paper_page(experiment, table_rows(experiment), [])["views"][1]
    faint = [curve for curve in view["plots"][0]["series"] if curve.get("faint")]
    assert len(faint) == 99
    assert "the curves of 100 of the 120 runs are drawn" in " ".join(texts_in(view["sections"]))


def test_of_many_methods_and_radii_the_first_have_views_and_the_page_says_so() -> None:
    settings = PaperSettings(runs=1, methods=("ring", "pso"), radii=(0.08, 0.09, 0.1, 0.11), threads=2)
    experiment = run_experiment(settings)
    page = paper_page(experiment, table_rows(experiment), [])
    assert len([view for view in page["views"] if view["name"].endswith("swarm")]) == 12
    assert "12 of the 16 have them" in page["views"][0]["verdict"]["text"]


@given(
    st.builds(
        PaperSettings,
        runs=st.integers(1, 50),
        methods=st.lists(st.sampled_from(list(NAMED_SETTINGS)), min_size=1, unique=True).map(tuple),
        radii=st.lists(st.floats(0.01, 1), min_size=1, max_size=3, unique=True).map(tuple),
        weights=st.sampled_from([(0.5, 0.25, 0.25), (0.2, 0.3, 0.5)]),
        constraints=st.sampled_from(["feasible-first", "penalty"]),
        seed=st.integers(0, 10),
    )
)
def test_the_command_in_the_page_has_the_same_settings(settings: PaperSettings) -> None:
    words = command_of(settings).split()
    assert words[:2] == ["spacearm", "paper"]
    assert parsed(Options, words[2:], command="paper").experiment == settings
