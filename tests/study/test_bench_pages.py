"""The pages of the benchmarks: shares of all problems over time, and which plans are shown."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from spacearm.study.bench_pages import FIRST, SLOWEST, UNSOLVED, chosen, share_plot
from spacearm.study.motionbenchmaker import find_items, find_robot
from spacearm.study.motionbenchmaker_report import save_report as save_mbm
from spacearm.study.motionbenchmaker_runs import Protocol, Run, run_benchmark
from spacearm.study.spacebench import find_problems
from spacearm.study.spacebench_report import save_report as save_space
from spacearm.study.spacebench_runs import SpaceProtocol, run_spacebench
from study.tiny_collection import write_collection
from support.measured_runs import run
from support.page_reader import page_in, texts_in, unpacked, values_of

FROZEN = Path(__file__).parents[2] / "benchmarks" / "spacebench"


def test_a_share_is_of_all_records_also_of_those_without_a_value() -> None:
    plot = share_plot("s", "s", {"a": ([1.0, 4.0], 4), "b": ([2.0], 1), "c": ([], 3)}, x_label="t", log_x=True)
    x = unpacked(plot["x"])
    a = values_of(plot, "a (2 of 4)")
    assert x[0] < 1 < 4 < x[-1]
    assert sorted(set(a.tolist())) == [0, 25, 50]
    assert a[np.searchsorted(x, 1.1)] == 25
    assert values_of(plot, "b")[-1] == 100
    assert not values_of(plot, "c").any()
    assert plot["logX"]
    assert plot["clock"] is False


def test_without_any_value_there_is_an_empty_axis() -> None:
    plot = share_plot("s", "s", {"a": ([], 2)}, x_label="t", log_x=True)
    assert np.isfinite(unpacked(plot["x"])).all()
    assert not values_of(plot, "a").any()


def took(one: Run) -> float | None:
    return one.seconds if one.status == "found" else None


def many(families: int, each: int) -> list[Run]:
    return [
        run(family=f"f{family}", name=f"{i:04}", seconds=0.01 * (1 + i) + 0.001 * family)
        for family in range(families)
        for i in range(each)
    ]


def test_firsts_are_shown_and_the_slowest_of_all_families() -> None:
    runs = many(3, 4)
    shown = [(one.run.family, one.run.name, one.why) for one in chosen(runs, took)]
    assert shown[:3] == [("f0", "0000", FIRST), ("f1", "0000", FIRST), ("f2", "0000", FIRST)]
    assert shown[3:] == [("f2", "0003", SLOWEST), ("f1", "0003", SLOWEST), ("f0", "0003", SLOWEST)]


def test_what_is_not_solved_is_shown_before_what_is_slow() -> None:
    runs = many(7, 2)
    runs[11] = replace(runs[11], status="not_found", seconds=0.0)
    shown = chosen(runs, took)
    assert len(shown) == 6
    assert [one.why for one in shown] == [FIRST] * 4 + [UNSOLVED, SLOWEST]
    assert shown[4].run is runs[11]


def test_a_single_problem_is_shown_once() -> None:
    assert [one.why for one in chosen(many(1, 1), took)] == [FIRST]


def test_the_page_of_a_collection_has_its_curves_tables_and_plans(tmp_path: Path) -> None:
    items = find_items(write_collection(tmp_path))
    robot = find_robot(tmp_path, items)
    benchmark = run_benchmark(items, robot, Protocol(seeds=2, search=0.02, plan=0.1))
    (tmp_path / "out").mkdir()
    save_mbm(benchmark, tmp_path / "out", items=items)
    page = page_in(tmp_path / "out" / "report.html")
    overview, *plans = page["views"]
    assert [plot["id"] for plot in overview["plots"]] == ["first", "certified", "lengths"]
    assert [view["name"] for view in plans] == ["easy 0001", "hard 0001"]  # an end of hard 0002 collides
    assert all("planned once more for this page" in " ".join(texts_in(view["sections"])) for view in plans)
    certified = overview["plots"][1]
    assert values_of(certified, "all (4 of 4)")[-1] == 100
    titles = [section["title"] for section in overview["sections"]]
    assert len(titles) == 7
    assert all(len(title) < 80 for title in titles)


@pytest.fixture(scope="module")
def space(tmp_path_factory: pytest.TempPathFactory) -> tuple[Any, dict[str, Any]]:
    items = find_problems(FROZEN, families=("module", "grapple"), most=2)
    bench = run_spacebench(items, SpaceProtocol(limit=5))
    folder = tmp_path_factory.mktemp("space")
    save_space(bench, folder, items=items)
    return bench, page_in(folder / "report.html")


def test_the_page_of_spacebench_shows_the_motions_that_were_measured(space: tuple[Any, dict[str, Any]]) -> None:
    bench, page = space
    overview, *plans = page["views"]
    assert overview["verdict"]["headline"] == "4 of 4 runs solved within 5 s"
    assert [view["name"] for view in plans][:2] == ["module-01", "grapple-01"]
    assert {view["name"].partition(",")[0] for view in plans} <= {run.name for run in bench.runs}
    for view in plans:
        said = " ".join(texts_in(view["sections"]))
        assert "the same seed: the motion that was measured" in said
        assert "a motion planned and proven for a fixed base, let go; it " in said
        assert [actor["ghost"] for actor in view["actors"]] == [False, True]
        assert view["verdict"]["tone"] == "good"


def test_peaks_and_misses_are_those_of_the_runs(space: tuple[Any, dict[str, Any]]) -> None:
    bench, page = space
    plots = {plot["id"]: plot for plot in page["views"][0]["plots"]}
    x, share = unpacked(plots["peaks"]["x"]), values_of(plots["peaks"], "all")
    for one in bench.runs:
        below = [other for other in bench.runs if other.peak <= one.peak]
        at = np.searchsorted(x, math.degrees(one.peak) + 1e-4)
        assert share[at] >= 100 * len(below) / len(bench.runs) - 1e-4
