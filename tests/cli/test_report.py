"""`spacearm report`: a page of one saved plan or of several, and the page that `spacearm plan` writes."""

from __future__ import annotations

import json
import re
import sys
from pathlib import Path

import pytest

from cli.conftest import PROBLEM, Refused, Told
from spacearm.cli.report_command import names_of
from spacearm.files import plan_file
from support.report_pages import content


@pytest.fixture
def planned(told: Told, problem: Path, tmp_path: Path) -> list[Path]:
    out = [tmp_path / name / "plan.json" for name in ("one", "two")]
    for seed, path in enumerate(out):
        assert told(["plan", problem, "-o", path.parent, "--seed", seed, "--no-report"])[0] == 0
        assert not (path.parent / "report.html").exists()
    return out


def test_a_plan_writes_a_report_with_the_command_that_makes_it_again(told: Told, problem: Path, tmp_path: Path) -> None:
    folder = tmp_path / "out"
    assert told(["plan", problem, "-o", folder, "--clearance", "0.012"])[0] == 0
    view = content((folder / "report.html").read_text())["views"][0]
    seed = json.loads((folder / "plan.json").read_text())["seed"]
    (again,) = [one["code"] for one in view["sections"] if one["title"] == "Make it again"]
    assert again == f"spacearm plan {problem} -o out --seed {seed} --clearance 0.012"
    assert told([*again.replace("-o out", f"-o {tmp_path / 'again'}").split()[1:]])[0] == 0
    for file in ("plan.json", "report.html"):
        assert (folder / file).read_bytes() == (tmp_path / "again" / file).read_bytes()


def test_matplotlib_is_not_loaded_for_a_report(
    told: Told, problem: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in [name for name in sys.modules if name.split(".")[0] == "matplotlib"]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    assert told(["plan", problem, "-o", tmp_path / "out", "--seed", 0])[0] == 0
    assert (tmp_path / "out" / "report.html").exists()


def test_a_plan_that_is_not_found_has_a_report_too(told: Told, tmp_path: Path) -> None:
    path = tmp_path / "far.yaml"
    path.write_text(PROBLEM.replace("goal: {configuration: [1, 0, 0, 0, 0, 0, 0]}", "goal: {position: [2, 1, 0]}"))
    code, out, _ = told(["plan", path, "-o", tmp_path / "out", "--seed", 0])
    assert code == 1
    assert "report.html" in out
    assert (tmp_path / "out" / "report.html").read_text().startswith("<!doctype html>")


def test_one_plan_is_told_in_a_page(told: Told, planned: list[Path], tmp_path: Path) -> None:
    page = tmp_path / "page.html"
    code, out, err = told(["report", planned[0], "-o", page, "--title", "Mine"])
    assert (code, err) == (0, "")
    assert re.search(rf"^plan +Proven for every instant\nwritten +{page} \(\d\.\d\d MB\); ", out, re.MULTILINE)
    assert content(page.read_text())["title"] == "Mine"


def test_a_plan_is_proven_again_and_not_believed(told: Told, planned: list[Path], tmp_path: Path) -> None:
    values = json.loads(planned[0].read_text())
    stated, values["certificate"]["clearance_m"] = values["certificate"]["clearance_m"], 3.0
    values["certificate"]["message"] = "as far as the Moon"
    (tmp_path / "forged.json").write_text(json.dumps(values))
    assert told(["report", tmp_path / "forged.json", "-o", tmp_path / "page.html"])[0] == 0
    page = content((tmp_path / "page.html").read_text())
    assert "proven again for this page" in page["views"][0]["verdict"]["text"]
    assert "Moon" not in json.dumps(page)
    assert dict(page["block"])["Clearance proven"] == f"{stated * 1e3:.4g} mm"


def test_a_plan_whose_new_proof_fails_is_not_shown_as_proven(
    told: Told, planned: list[Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    real = plan_file.certify
    monkeypatch.setattr(plan_file, "certify", lambda *given, **options: real(*given, **options, jerk_limit=1e-9))
    assert told(["report", planned[0], "-o", tmp_path / "page.html"])[0] == 0
    verdict = content((tmp_path / "page.html").read_text())["views"][0]["verdict"]
    assert verdict["tone"] == "bad"
    assert "Proven" not in verdict["headline"]
    assert "proven again for this page, it does not hold" in verdict["text"]


def test_several_plans_are_compared_by_the_names_of_their_folders(told: Told, planned: list[Path], tmp_path: Path) -> None:
    code, out, _ = told(["report", *planned, "-o", tmp_path / "both.html"])
    assert code == 0
    assert out.startswith("Side by side")
    views = content((tmp_path / "both.html").read_text())["views"]
    assert [view["name"] for view in views] == ["Side by side", "one", "two"]
    assert [actor["ghost"] for actor in views[0]["actors"]] == [False, True]


def test_names_are_as_short_as_they_can_be() -> None:
    assert names_of([Path("a/plan.json")]) == ["plan"]
    assert names_of([Path("a/x.json"), Path("a/y.json")]) == ["x", "y"]
    assert names_of([Path("a/plan.json"), Path("b/plan.json")]) == ["a", "b"]
    assert names_of([Path("a/c/plan.json"), Path("b/c/plan.json")]) == ["a/c", "b/c"]
    assert names_of([Path("a/plan.json"), Path("a/plan.json")])[0].endswith(" (1)")


def test_what_cannot_be_shown_is_refused(refused: Refused, planned: list[Path], problem: Path, tmp_path: Path) -> None:
    page = tmp_path / "page.html"
    refused(("nothing.json does not exist",), "report", tmp_path / "nothing.json", "-o", page)
    refused(("is broken", "plan again"), "report", problem, "-o", page)
    refused(("PLAN.JSON is missing",), "report", "-o", page)
    page.write_text("mine")
    refused(("exists, expected a new file", "-o"), "report", planned[0], "-o", page)
    assert page.read_text() == "mine"
