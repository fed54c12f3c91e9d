"""What was assumed about a robot is printed, a line a kind; what is long is cut, and said where it is in full."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest

from spacearm.cli.terminal import tell_robot
from spacearm.dynamics import hold
from spacearm.geometry import Sphere
from spacearm.robot import load_robot
from support.urdf_text import collision, joint, link, robot

Told = Callable[[Sequence[object]], tuple[int, str, str]]
COUNT = 40


def test_notes_are_printed_by_plan_and_certify_and_folded(told: Told, tmp_path: Path) -> None:
    limit = 'lower="-1e16" upper="1e16" velocity="0"'
    links = [link(f"link_{i}", collision('<sphere radius="0.01"/>') if i == 0 else "") for i in range(COUNT + 1)]
    joints = [joint(f"joint_{i}", f"link_{i}", f"link_{i + 1}", xyz="0 0 0.5", limit=limit) for i in range(COUNT)]
    (tmp_path / "arm.urdf").write_text(robot(*links, *joints))
    problem = tmp_path / "problem.yaml"
    zeros = [0] * COUNT
    problem.write_text(
        f"spacearm: 1\nrobot: {{file: arm.urdf, velocity_limit: 1, acceleration_limit: 1}}\nstart: {zeros}\n"
        f"goal: {{configuration: {[0.1] * COUNT}}}\n"
    )
    code, _, err = told(["plan", problem, "-o", tmp_path / "out", "--no-report", "--seed", 0])
    begins = "spacearm: robot 'arm': "
    lines = [line for line in err.splitlines() if line.startswith(begins)]
    assert code == 0
    assert len(lines) == len(set(lines)) < 8
    assert all(len(line) < 280 for line in lines)
    assert any("without end turn joint_0, joint_1" in line and line.endswith(" more)") for line in lines)
    assert "plan.json" in err.splitlines()[-1]
    saved = json.loads((tmp_path / "out" / "plan.json").read_text())
    (full,) = (note for note in saved["problem"]["robot"]["notes"] if "without end turn" in note)
    assert full.endswith(f"joint_{COUNT - 1}")
    for more in ([], ["--problem", problem]):
        code, _, err = told(["certify", tmp_path / "out" / "plan.json", *more])
        assert code == 0
        assert [line for line in err.splitlines() if line.startswith(begins)] == lines


def test_notes_of_one_kind_are_folded_and_those_of_built_in_robots_are_known(capsys: pytest.CaptureFixture[str]) -> None:
    arm = load_robot("servicer7")
    tell_robot(arm, more="here")
    assert capsys.readouterr().err == ""
    for name in ("unit", "lid", "cup"):
        arm = hold(arm, Sphere((0, 0, 0.1), 0.01), name=name)
    tell_robot(arm, more="plan.json")
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 3
    assert "'unit' is held, and nothing says its mass" in lines[0]
    assert all(line.endswith(" (and 2 more of this kind)") for line in lines[:2])
    assert lines[2] == "spacearm: plan.json has the notes in full"
