"""`spacearm bench mbm`: from a folder of problems to a report."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from spacearm.cli import main
from study.tiny_collection import WIDE, box, request, scene, write_collection, write_problem, write_robot
from support import srdf_text, urdf_text
from support.messages import assert_sentence
from support.urdf_text import collision, joint, link

MBM = os.environ.get("SPACEARM_MBM")
NARROW = 'lower="-0.3" upper="0.3" velocity="1" effort="1"'
SHORT = ("--seeds", "2", "--search", "20", "--budget", "100")


@pytest.fixture
def told(capsys: pytest.CaptureFixture[str]) -> Callable[..., tuple[int, str, str]]:
    def run(*arguments: object) -> tuple[int, str, str]:
        code = main(["bench", *map(str, arguments)])
        captured = capsys.readouterr()
        return code, captured.out, captured.err

    return run


def test_a_collection_is_measured(tmp_path: Path, told: Callable) -> None:
    out = tmp_path / "out"
    code, text, _ = told("mbm", "-d", write_collection(tmp_path), "-o", out, *SHORT)
    assert code == 0
    assert {path.name for path in out.iterdir()} == {"report.html", "report.json", "tables.md"}
    report = json.loads((out / "report.json").read_text())
    runs = {(run["family"], run["name"], run["seed"]): run for run in report["runs"]}
    assert sorted(runs) == [(*what, seed) for what in (("easy", "0001"), ("hard", "0001"), ("hard", "0002")) for seed in (0, 1)]
    assert runs["easy", "0001", 0]["history"][0][1] == pytest.approx(2.0, rel=1e-6)  # straight
    assert all(run["status"] == "found" for run in report["runs"] if run["name"] == "0001")
    assert all(run["collisions"] == 0 and run["looked_at"] > 400 for run in report["runs"] if run["name"] == "0001")
    assert runs["hard", "0001", 1]["length"] > 2
    assert runs["hard", "0002", 0]["status"] == "start_in_collision"
    assert "not counted, an end is in collision: hard 0002" in text
    assert "found and certified within 1 s, the worst seed  >= 100 %" in text
    assert "group 'arm' of arm.srdf" in text


def test_what_is_called_deterministic_is(tmp_path: Path, told: Callable) -> None:
    write_collection(tmp_path)
    seen = []
    for _ in range(2):
        code, text, _ = told("mbm", "-d", tmp_path, "--families", "hard", "--problems", 1, "--json", *SHORT)
        assert code == 0
        seen.append([(r["straight"], r["first_evaluations"], r["history"][0][1]) for r in json.loads(text)["runs"]])
    assert seen[0] == seen[1]


def test_a_second_call_with_the_same_records_measures_nothing(tmp_path: Path, told: Callable) -> None:
    data, records = write_collection(tmp_path / "data"), tmp_path / "runs.jsonl"
    words = ("mbm", "-d", data, "--families", "easy", "--json", "--records", records, *SHORT)
    first, again = (json.loads(told(*words, "--jobs", jobs)[1])["runs"] for jobs in (2, 1))
    assert first == again
    assert len(records.read_text().splitlines()) == 1 + 2


def test_wrong_input_is_one_sentence(tmp_path: Path, told: Callable) -> None:
    def refused(case: str, *arguments: object) -> None:
        code, out, err = told(*arguments)
        assert (code, out) == (2, "")
        assert_sentence("study", case, err.removeprefix("spacearm: ").rstrip("\n").replace(str(tmp_path), "<path>"))

    refused("no suite")
    refused("suite that does not exist", "mbn")
    refused("no data", "mbm")
    refused("data is not there", "mbm", "-d", tmp_path / "missing")
    refused("data holds nothing", "mbm", "-d", tmp_path)
    write_problem(tmp_path / "one", 1, scene(), request([0, 0], [1, 1]))
    refused("no robot", "mbm", "-d", tmp_path)
    write_robot(tmp_path)
    refused("no such group", "mbm", "-d", tmp_path, "--group", "arms")
    refused("no such family", "mbm", "-d", tmp_path, "--families", "won")
    refused("no seeds", "mbm", "-d", tmp_path, "--seeds", 0)
    refused("budget too long", "mbm", "-d", tmp_path, "--budget", 2000)
    refused("budget of nothing", "mbm", "-d", tmp_path, "--search", 0)
    arm = ("mbm", "-d", tmp_path)
    write_problem(tmp_path / "one", 1, scene(), request([0, 0], [1, 1], group=""))
    refused("request without a group", *arm)
    write_problem(tmp_path / "one", 1, scene(), request([0, 0], [1, 1]))
    write_problem(tmp_path / "two", 1, scene(), request([0, 0], [1, 1], group="elbow"))
    refused("requests for two groups", *arm)
    shutil.rmtree(tmp_path / "two")
    (tmp_path / "one" / "request0002.yaml").write_text("x")
    (tmp_path / "one" / "scene0003.yaml").write_text("world:")
    refused("scene without its request", *arm)
    (tmp_path / "one" / "scene0003.yaml").unlink()
    write_problem(tmp_path / "one", 1, scene(box([1, 1, 1], [3, 0, 0], header={"frame_id": "table"})), request([0, 0], [1, 1]))
    refused("frame that nobody knows", *arm)
    write_problem(tmp_path / "one", 1, scene(), request([0, 0], [1, 9]))
    refused("goal out of the limits", *arm)
    (tmp_path / "one" / "scene0001.yaml").write_text("{")
    refused("no YAML", *arm)
    assert not (tmp_path / "out").exists()


def test_an_end_beyond_a_limit_by_rounding_is_told_and_planned(tmp_path: Path, told: Callable) -> None:
    write_robot(tmp_path)
    write_problem(tmp_path / "one", 1, scene(), request([0, 0], [2.9 + 3e-6, 0]))
    code, text, _ = told("mbm", "-d", tmp_path, *SHORT)
    assert code == 0
    assert "an end is beyond joint limits by rounding, and was set onto them, in 1: one 0001" in text
    assert "failures: none" in text


def test_a_group_of_two_arms_and_links_that_always_overlap(tmp_path: Path, told: Callable) -> None:
    """The upper arms' beads are in those of the forearms, whatever the joints do; the SRDF says nothing of it."""
    upper, fore = (collision('<sphere radius="0.05"/>', xyz=f"{x} 0 0") for x in (0.1, 0.02))
    sides = {"left": 0.5, "right": -0.5}
    parts = [link("base")]
    for side, y in sides.items():
        parts += [link(f"{side}_upper", upper), link(f"{side}_fore", fore)]
        parts.append(joint(f"{side}_shoulder", "base", f"{side}_upper", xyz=f"0 {y} 0", limit=WIDE))
        parts.append(joint(f"{side}_elbow", f"{side}_upper", f"{side}_fore", xyz="0.1 0 0", limit=NARROW))
    chains = [srdf_text.group(side, chain=("base", f"{side}_fore")) for side in sides]
    both = '<group name="both"><group name="left"/><group name="right"/></group>'
    (tmp_path / "arm.urdf").write_text(urdf_text.robot(*parts))
    (tmp_path / "arm.srdf").write_text(srdf_text.srdf(*chains, both))
    names = [f"{side}_{name}" for side in sides for name in ("shoulder", "elbow")]
    write_problem(
        tmp_path / "problems" / "one", 1, scene(), request([0, 0, 0, 0], [1, 0.1, -1, 0.1], group="both", names=names)
    )
    code, text, _ = told("mbm", "-d", tmp_path, *SHORT, "--json")
    assert code == 0
    report = json.loads(text)
    assert report["robot"]["group"] == "both"
    assert any("4 joints" in note and "_fore" in note for note in report["notes"])
    assert any("'left_fore' and 'left_upper'" in note for note in report["notes"])
    assert report["summaries"]["all"]["certified"] == 2
    assert report["summaries"]["all"]["collisions"] == 0


@pytest.mark.skipif(MBM is None, reason="SPACEARM_MBM does not name the MotionBenchMaker data")
def test_real_problems_are_solved_and_no_other_checker_objects(told: Callable) -> None:
    code, text, _ = told("mbm", "-d", MBM, "--problems", 1, "--seeds", 1, "--json")
    report = json.loads(text)
    assert code == 0
    assert report["summaries"]["all"]["certified"] == report["summaries"]["all"]["runs"] >= 7
    assert report["summaries"]["all"]["collisions"] == 0
