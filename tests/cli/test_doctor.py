"""`spacearm doctor`: what it prints and writes, and its exit codes."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from cli.conftest import Refused, Told
from support.doctor_text import FAULTS, HEALTHY, changed, written
from support.srdf_text import disabled, srdf

_SLOW = changed((' velocity="0.1"', ""))


def test_a_healthy_model_exits_with_0(told: Told, tmp_path: Path) -> None:
    code, out, err = told(["doctor", written(tmp_path, HEALTHY)])
    assert (code, err) == (0, "")
    lines = out.splitlines()
    assert lines[0].endswith("4 links; 3 joints, 2 of them moving; 618 kg, the base 600 kg")
    assert lines[-1] == "1 note: healthy"


def test_a_fault_exits_with_1_and_is_shown_with_its_line_and_its_remedy(told: Told, tmp_path: Path) -> None:
    code, out, err = told(["doctor", written(tmp_path, _SLOW)])
    assert (code, err) == (1, "")
    assert "error: velocity-missing\n  line 38  joint 'shoulder': states no velocity limit\n" in out
    assert "      expected  more than 0 [rad/s]\n      mend      state it in <limit velocity" in out
    assert "      --fix     does it\n" in out
    assert out.endswith("1 error, 1 note; --fix OUT.urdf mends 1 of them\n")


def test_faults_of_one_kind_stand_together(told: Told, tmp_path: Path) -> None:
    _, out, _ = told(["doctor", written(tmp_path, HEALTHY.replace(' velocity="0.1"', ""))])
    assert (
        "error: velocity-missing (2)\n  states no velocity limit\n  line 38  joint 'shoulder'\n  line 45  joint 'elbow'\n"
        in out
    )
    assert out.count("expected  more than 0") == 1


def test_an_srdf_is_looked_at_too(told: Told, tmp_path: Path) -> None:
    text = srdf(disabled("base", "upper"), disabled("fore", "upper"), disabled("base", "fore"))
    path = written(tmp_path, HEALTHY.replace('lower="-2.5" upper="2.5"', 'lower="-2.9" upper="2.9"'))
    code, out, _ = told(["doctor", path, "--srdf", written(tmp_path, text, "arm.srdf")])
    assert code == 1
    assert "  arm.srdf line 5  'base' and 'fore': switched off, but they meet in " in out


def test_findings_as_json(told: Told, tmp_path: Path) -> None:
    code, out, _ = told(["doctor", written(tmp_path, _SLOW), "--json"])
    values = json.loads(out)
    assert code == 1
    assert (values["spacearm-diagnosis"], values["healthy"], values["mass"]) == (1, False, 618)
    assert [finding["code"] for finding in values["findings"]] == ["velocity-missing", "acceleration-unstated"]


def test_a_corrected_copy_is_written_and_every_change_told(told: Told, tmp_path: Path) -> None:
    path = written(tmp_path, _SLOW)
    code, out, err = told(["doctor", path, "--fix", tmp_path / "new.urdf", "--velocity-limit", 0.02])
    assert (code, err) == (0, "")
    assert "  line 38  joint 'shoulder': <limit velocity>: was missing -> '0.02' (chosen: 0.02 rad/s)\n" in out
    assert "before: 1 error, 1 note\nafter:  1 note: healthy\n" in out
    assert told(["doctor", tmp_path / "new.urdf"])[0] == 0
    code, out, _ = told(["doctor", path, "--fix", tmp_path / "new.urdf", "--force", "--json"])
    values = json.loads(out)
    assert (code, values["after"]["healthy"], values["changes"][0]["line"]) == (0, True, 38)


def test_what_cannot_be_mended_is_told_and_exits_with_1(told: Told, tmp_path: Path) -> None:
    path = written(tmp_path, changed(*FAULTS["two roots"][0]))
    code, out, _ = told(["doctor", path, "--fix", tmp_path / "new.urdf"])
    assert code == 1
    assert "nothing could be mended" in out
    assert "left, by the lines of" in out
    assert "error: several-roots" in out


def test_wrong_input_is_refused_in_one_sentence(refused: Refused, tmp_path: Path) -> None:
    model = written(tmp_path, HEALTHY)
    other = written(tmp_path, "mine", "other.urdf")
    refused(("MODEL.URDF is missing", "see spacearm doctor --help"), "doctor")
    refused(("<path>/none.urdf does not exist", "check the path"), "doctor", tmp_path / "none.urdf")
    refused(("<path>/other.urdf: line 1", "expected a URDF"), "doctor", other)
    refused(("<path>/arm.srdf", "SRDF"), "doctor", written(tmp_path, srdf(), "arm.srdf"))
    refused(("<path>/arm.urdf", "expected an SRDF"), "doctor", model, "--srdf", model)
    refused(("<path>/none.srdf does not exist", "check the path"), "doctor", model, "--srdf", tmp_path / "none.srdf")
    refused(("<path>/other.urdf exists", "another name"), "doctor", model, "--fix", other)
    refused(("<path>/arm.urdf is the model itself", "another name"), "doctor", model, "--fix", model, "--force")
    refused(("<path>/no/arm.urdf", "No such file or directory"), "doctor", model, "--fix", tmp_path / "no" / "arm.urdf")
    refused("doctor: force nothing", "doctor", model, "--force")
    refused(("--base is 'swimming'", "fixed, floating"), "doctor", model, "--base", "swimming")
    refused(("velocity_limit is -1", "above 0"), "doctor", model, "--fix", tmp_path / "new.urdf", "--velocity-limit", -1)


@pytest.mark.parametrize("case", FAULTS)
def test_no_fault_ends_in_a_traceback(case: str, told: Told, tmp_path: Path) -> None:
    code, out, err = told(["doctor", written(tmp_path, changed(*FAULTS[case][0]))])
    assert (code, err) == (0 if FAULTS[case][2] == "note" else 1, "")
    assert FAULTS[case][1] in out
    assert all(len(line) <= 128 for line in out.splitlines()[1:])
