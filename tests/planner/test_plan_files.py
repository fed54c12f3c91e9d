"""Plans on disk: strict JSON that is the same for the same seed, read back for its own problem only, and CSV."""

from __future__ import annotations

import errno
import json
import math
import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from planner.test_plan import SMALL, enclosed, turn, turntable, walled
from proof.dense import planar
from snapshot import assert_refused
from spacearm.errors import FileFormatError, OutputError, ProblemError
from spacearm.motion import Trajectory
from spacearm.planner import Plan, PositionGoal, Problem, load_plan, plan, plan_as_dict, save_plan, save_trajectory
from spacearm.robot import forward_kinematics
from spacearm.scene import Scene, Sphere

PROBLEM = turn()


@pytest.fixture(scope="module")
def found() -> Plan:
    return plan(PROBLEM, SMALL, rng=0)


@pytest.fixture
def saved(found: Plan, tmp_path: Path) -> Path:
    save_plan(found, tmp_path / "plan.json")
    return tmp_path / "plan.json"


def strictly(text: str) -> Any:
    """JSON as the standard has it: no NaN, no Infinity."""

    def refuse(word: str) -> None:
        raise AssertionError(word)

    return json.loads(text, parse_constant=refuse)


def test_a_plan_is_read_back_bit_for_bit(found: Plan, saved: Path) -> None:
    assert load_plan(saved, PROBLEM) == found.trajectory
    assert load_plan(str(saved), PROBLEM).duration == found.fitness["duration"]


def test_the_file_is_the_plan_in_strict_json(found: Plan, saved: Path) -> None:
    content = strictly(saved.read_text())
    assert content == plan_as_dict(found)
    assert content["spacearm-plan"] == 1
    assert (content["status"], content["seed"]) == ("found", 0)
    assert content["motion"]["control_points"][0] == [0.0, 0.0]
    assert content["certificate"]["status"] == "holds"


def test_the_same_seed_gives_the_same_bytes(saved: Path, tmp_path: Path) -> None:
    save_plan(plan(PROBLEM, SMALL, rng=0), tmp_path / "again.json")
    assert (tmp_path / "again.json").read_bytes() == saved.read_bytes()


WITHOUT_NUMBERS: dict[str, Any] = {
    "free space": turn(scene=[]),
    "free space, joint without limits": Problem(turntable(), Scene([]), start=[0.0], goal=[1.0]),
    "no links": turn(robot=planar(capsules=())),
    "no motion": turn(scene=[], goal=(0.0, 0.0)),
    "goal not reached": enclosed(0.3),
    "no plan": walled(),
    "position": turn(scene=[], goal=PositionGoal((0.4, 1.1, 0.0))),
}


@pytest.mark.parametrize("case", WITHOUT_NUMBERS)
def test_every_outcome_is_strict_json(case: str, tmp_path: Path) -> None:
    made = plan(WITHOUT_NUMBERS[case], SMALL, rng=0)
    save_plan(made, tmp_path / "plan.json")
    assert strictly((tmp_path / "plan.json").read_text()) == plan_as_dict(made)
    if made.trajectory is not None:
        assert load_plan(tmp_path / "plan.json", made.problem) == made.trajectory


def test_settings_in_numpys_numbers_are_written(tmp_path: Path) -> None:
    save_plan(plan(turn(scene=[]), replace(SMALL, restarts=np.int64(1)), rng=0), tmp_path / "plan.json")


# ---- refused ---------------------------------------------------------------------------------------------------------


def edited(path: Path, change: Any) -> Path:
    content = json.loads(path.read_text())
    change(content)
    path.write_text(json.dumps(content))
    return path


BROKEN: dict[str, Any] = {
    "plan file: text": lambda path: path.write_text("not a plan"),
    "plan file: empty": lambda path: path.write_bytes(b""),
    "plan file: binary": lambda path: path.write_bytes(bytes(range(256))),
    "plan file: cut off": lambda path: path.write_bytes(path.read_bytes()[:-100]),
    "plan file: a list": lambda path: path.write_text("[1, 2]"),
    "plan file: nested too deeply": lambda path: path.write_text("[" * 100_000),
    "plan file: another version": lambda path: edited(path, lambda c: c.update({"spacearm-plan": 2})),
    "plan file: a problem": lambda path: path.write_text('{"spacearm": 1}'),
    "plan file: no motion in it": lambda path: edited(path, lambda c: c.update(motion=None, status="goal_not_reached")),
    "plan file: motion missing": lambda path: edited(path, lambda c: c.pop("motion")),
    "plan file: duration missing": lambda path: edited(path, lambda c: c["motion"].pop("duration_s")),
    "plan file: problem a text": lambda path: edited(path, lambda c: c.update(problem="mine")),
    "plan file: problem without hash": lambda path: edited(path, lambda c: c["problem"].pop("hash")),
    "plan file: missing": lambda path: path.unlink(),
}


@pytest.mark.parametrize("case", BROKEN)
def test_a_file_that_is_no_plan_is_refused(case: str, saved: Path) -> None:
    BROKEN[case](saved)
    assert_refused("plan", case, FileFormatError, lambda: load_plan(saved, PROBLEM), path=saved)


OTHERS: dict[str, Any] = {
    "another start": lambda: turn(start=(0.1, 0.0)),
    "another goal": lambda: turn(goal=(1.5, 0.0)),
    "another obstacle": lambda: turn(scene=[Sphere((1.2, 1.2, 0.0), 0.31)]),
    "no obstacle": lambda: turn(scene=[]),
    "another robot": lambda: turn(robot=replace(planar(), name="other")),
}


@pytest.mark.parametrize("case", OTHERS)
def test_a_plan_of_another_problem_is_refused(case: str, saved: Path) -> None:
    assert_refused("plan", "plan of another problem", FileFormatError, lambda: load_plan(saved, OTHERS[case]()), path=saved)


@pytest.mark.parametrize(
    "change",
    [
        lambda motion: motion.update(duration_s=0.1),
        lambda motion: motion.update(duration_s=math.nan),
        lambda motion: motion.update(duration_s="long"),
        lambda motion: motion["control_points"].__setitem__(1, [9.0, 9.0]),
        lambda motion: motion["control_points"].__setitem__(1, [0.0]),
        lambda motion: motion["control_points"].__setitem__(1, [math.nan, 0.0]),
        lambda motion: motion.update(control_points=[[0.0], [1.0]]),
        lambda motion: motion.update(control_points="none"),
    ],
)
def test_a_motion_that_breaks_the_limits_is_refused(change: Any, saved: Path) -> None:
    edited(saved, lambda content: change(content["motion"]))
    with pytest.raises(ProblemError):
        load_plan(saved, PROBLEM)


def test_nothing_is_overwritten(found: Plan, saved: Path) -> None:
    before = saved.read_bytes()
    assert_refused("plan", "plan file: exists", OutputError, lambda: save_plan(found, saved), path=saved)
    assert found.trajectory is not None
    trajectory = found.trajectory
    assert_refused("plan", "CSV: exists", OutputError, lambda: save_trajectory(trajectory, saved), path=saved)
    assert saved.read_bytes() == before


def test_a_folder_that_is_missing_is_named(found: Plan, tmp_path: Path) -> None:
    path = tmp_path / "missing" / "plan.json"
    assert_refused("plan", "plan file: no such folder", OutputError, lambda: save_plan(found, path), path=path)


def test_a_full_disk_leaves_no_half_a_plan(found: Plan, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: Any) -> Any:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "fsync", full)
    path = tmp_path / "plan.json"
    assert_refused("plan", "plan file: disk full", OutputError, lambda: save_plan(found, path), path=path)
    assert os.listdir(tmp_path) == []


# ---- CSV -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("samples", [1, 2, 201])
def test_a_trajectory_as_csv_has_time_joints_and_tip(found: Plan, samples: int, tmp_path: Path) -> None:
    trajectory = found.trajectory
    assert isinstance(trajectory, Trajectory)
    path = tmp_path / "trajectory.csv"
    save_trajectory(trajectory, path, samples=samples)
    header, *lines = path.read_text().splitlines()
    assert header == ("t_s,q_shoulder,q_elbow,dq_shoulder,dq_elbow,ddq_shoulder,ddq_elbow,tip_x_m,tip_y_m,tip_z_m")
    rows = np.array([[float(entry) for entry in line.split(",")] for line in lines])
    assert rows.shape == (samples, 10)
    t = np.linspace(0, trajectory.duration, samples)
    state = trajectory.sample(t)
    tips = forward_kinematics(trajectory.robot, state.q)[:, :3, 3]
    np.testing.assert_allclose(rows, np.column_stack([t, *state, tips]), rtol=1e-11, atol=1e-300)


def test_the_csv_of_the_same_trajectory_is_the_same_bytes(found: Plan, tmp_path: Path) -> None:
    assert found.trajectory is not None
    for name in ("a.csv", "b.csv"):
        save_trajectory(found.trajectory, tmp_path / name)
    assert (tmp_path / "a.csv").read_bytes() == (tmp_path / "b.csv").read_bytes()
    assert len((tmp_path / "a.csv").read_text().splitlines()) == 202
