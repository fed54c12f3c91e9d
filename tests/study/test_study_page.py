"""The page of a study of one's own: curves of what was varied, all records, and the plans that they hold."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from spacearm.core.errors import OutputError, SettingsError
from spacearm.files import plan_as_dict
from spacearm.planner import ConfigurationGoal, PlannerSettings, Problem, plan
from spacearm.robot import load_robot
from spacearm.study.study_page import MOST_PLANS, MOST_ROWS, save_study_report, study_page
from spacearm.study.study_tables import Table
from support.messages import assert_refused
from support.page_reader import page_in, texts_in, unpacked, values_of


@dataclass(frozen=True, kw_only=True)
class Found:
    asked: float
    length: float | None = None
    good: bool = True
    word: str = "found"
    motion: dict[str, Any] | None = None


RECORDS = {
    "a": Found(asked=0.0, length=1.0),
    "b": Found(asked=0.0, length=3.0),
    "c": Found(asked=0.02, length=math.nan),
    "d": Found(asked=0.01, length=5.0),
    "e": Found(asked=0.02, length=None, good=False, word="not_found"),
}


def test_curves_are_least_mean_and_greatest_at_each_value() -> None:
    units = {"asked": (1e3, "mm")}
    (plot,) = study_page(RECORDS, title="t", by="asked", units=units)["views"][0]["plots"]
    assert (plot["id"], plot["xLabel"]) == ("length", "asked [mm]")
    assert unpacked(plot["x"]).tolist() == [0, 10, 20]
    assert values_of(plot, "mean")[:2].tolist() == [2, 5]
    assert values_of(plot, "least")[:2].tolist() == [1, 5]
    assert values_of(plot, "greatest")[:2].tolist() == [3, 5]
    assert np.isnan(values_of(plot, "mean")[2])
    assert plot["note"] == "of 0 to 2 records at each value"


def test_without_a_varied_field_there_are_tables_alone() -> None:
    table = Table("How", ("what", "much"), [("a", "1")])
    page = study_page(RECORDS, title="t", tables=[table], notes=["a note"], command="python study.py")
    (view,) = page["views"]
    assert view["plots"] == []
    assert [section["title"] for section in view["sections"]] == ["How", "What is to be known", "Records", "Make it again"]


def test_records_are_listed_and_it_is_said_how_many_are_not() -> None:
    many = {f"task {i}": Found(asked=float(i)) for i in range(MOST_ROWS + 7)}
    (section,) = [one for one in study_page(many, title="t")["views"][0]["sections"] if one["title"] == "Records"]
    assert len(section["table"]["rows"]) == MOST_ROWS
    assert section["table"]["rows"][3] == ["task 3", "3", "-", "True", "found", "-"]
    assert section["notes"] == ["7 more are in the file of records"]


def test_plans_in_records_are_views(tmp_path: Path) -> None:
    robot = load_robot("zhang2022")
    problem = Problem(robot, [], start=np.zeros(7), goal=ConfigurationGoal([1, 0, 0, 0, 0, 0, 0]), clearance=0.0)
    values = plan_as_dict(plan(problem, PlannerSettings(evaluations=50), rng=0))
    records = {f"seed {i}": Found(asked=0.0, motion=values if i else None) for i in range(MOST_PLANS + 3)}
    save_study_report(tmp_path / "study.html", records, title="t")
    page = page_in(tmp_path / "study.html")
    assert [view["name"] for view in page["views"]] == ["Overview", *(f"seed {i}" for i in range(1, MOST_PLANS + 1))]
    assert len(page["robots"]) == 1
    said = " ".join(texts_in(page["views"][0]))
    assert f"{MOST_PLANS + 2} of the {MOST_PLANS + 3} records hold a plan; the first {MOST_PLANS} are shown" in said
    (section,) = [one for one in page["views"][0]["sections"] if one["title"] == "Records"]
    assert "motion" not in section["table"]["header"]


def test_a_file_that_is_there_is_replaced_only_if_asked_for(tmp_path: Path) -> None:
    path = tmp_path / "study.html"
    path.write_text("mine")
    assert_refused("study", "page over a file", OutputError, lambda: save_study_report(path, RECORDS, title="t"), path=tmp_path)
    assert path.read_text() == "mine"
    save_study_report(path, RECORDS, title="t", overwrite=True)
    assert page_in(path)["title"] == "t"


@pytest.mark.parametrize(
    ("case", "records", "by"),
    [
        ("page without records", {}, ""),
        ("page by no field", RECORDS, "askd"),
        ("page of no records", {"a": 3.0}, ""),
    ],
)
def test_wrong_records_are_one_sentence(case: str, records: dict[str, Any], by: str) -> None:
    assert_refused("study", case, SettingsError, lambda: study_page(records, title="t", by=by))
