"""The second proof of a file: it believes nothing, and says what is odd."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from planner.test_plan_files import BALL, PROBLEM, SMALL, edited, turn
from proof.dense import planar
from spacearm.errors import FileFormatError, ProblemError
from spacearm.motion import PiecewisePath, RecordedTrajectory, load_trajectory
from spacearm.planner import Plan, PositionGoal, plan, save_plan, save_trajectory
from spacearm.planner.files.recheck import recheck_plan, recheck_trajectory
from spacearm.scene import Sphere


@pytest.fixture(scope="module")
def found() -> Plan:
    return plan(PROBLEM, SMALL, rng=0)


@pytest.fixture
def saved(found: Plan, tmp_path: Path) -> Path:
    save_plan(found, tmp_path / "plan.json")
    return tmp_path / "plan.json"


def test_an_untouched_plan_holds_again_and_nothing_is_odd(found: Plan, saved: Path) -> None:
    again = recheck_plan(saved)
    assert found.certificate is not None
    assert again.certificate.holds
    assert again.certificate.as_dict() == found.certificate.as_dict()
    assert (again.agrees, again.notes) == (True, ())
    assert recheck_plan(saved, PROBLEM).notes == ()


def in_the_way(content: dict[str, Any]) -> None:
    """Straight through the ball."""
    ends = content["motion"]["control_points"]
    content["motion"].update(control_points=[ends[0], ends[-1]], duration_s=99.0)


EDITS: dict[str, Any] = {
    "a motion into the ball": (
        in_the_way,
        "fails",
        ["motion in the file is not the one", "says 'holds', the new one 'fails'"],
    ),
    "a slower one": (lambda c: c["motion"].update(duration_s=99.0), "holds", ["motion in the file is not the one"]),
    "one that is too fast": (
        lambda c: c["motion"].update(duration_s=0.5),
        "fails",
        ["motion in the file is not the one", "says 'holds', the new one 'fails'"],
    ),
    "a ball that grew": (
        lambda c: c["problem"]["obstacles"][0]["sphere"].update(radius=0.8),
        "fails",
        ["problem in the file is not the one that was planned", "says 'holds', the new one 'fails'"],
    ),
    "a ball that is gone": (lambda c: c["problem"]["obstacles"].clear(), "holds", ["problem in the file is not the one"]),
    "a certificate that was forged": (
        lambda c: (in_the_way(c), c.update(certificate=None, status="found")),
        "fails",
        [],
    ),
    "another goal": (lambda c: c["problem"]["goal"].update(configuration=[1.0, 0.0]), "holds", ["not the one", "not end at"]),
    "another start": (
        lambda c: c["problem"].update(start=[0.0, 0.25]),
        "holds",
        ["not the one", "begins 0.25 away from the problem's start, at joint 'elbow'"],
    ),
}


@pytest.mark.parametrize("case", EDITS)
def test_what_was_edited_is_told_and_judged_for_what_it_is(case: str, saved: Path) -> None:
    change, status, notes = EDITS[case]
    again = recheck_plan(edited(saved, change))
    assert again.certificate.status == status
    assert len(again.notes) == len(notes)
    for note, expected in zip(again.notes, notes, strict=True):
        assert expected in note


def test_a_plan_can_be_proven_for_another_problem(saved: Path) -> None:
    beside = turn(scene=[BALL, Sphere((-1.0, 0.5, 0), 0.2)])
    again = recheck_plan(saved, beside)
    assert again.certificate.holds
    assert again.notes == ("the plan was made for another problem, which differs in: obstacles",)
    in_it = recheck_plan(saved, turn(scene=[BALL, Sphere((1.0, 0.1, 0), 0.2)]))
    assert in_it.certificate.status == "fails"
    assert in_it.agrees is False
    slower = turn(robot=planar(velocity=(0.1, 0.1)))
    assert recheck_plan(saved, slower).certificate.status == "fails"


def test_options_are_the_proofs(saved: Path) -> None:
    assert not recheck_plan(saved, minimum_clearance=1.0).certificate.holds
    with pytest.raises(ProblemError):
        recheck_plan(saved, limits=("speed",))


def test_a_plan_of_another_robot_is_refused(saved: Path) -> None:
    from planner.test_plan_files import turntable
    from spacearm.planner import Problem

    other = Problem(turntable(), [], start=[0.0], goal=[1.0])
    with pytest.raises(ProblemError, match="moves 2 joints, expected the 1"):
        recheck_plan(saved, other)


def test_our_own_csv_holds_again(found: Plan, tmp_path: Path) -> None:
    assert found.trajectory is not None
    save_trajectory(found.trajectory, tmp_path / "trajectory.csv")
    for interpolation in (None, "cubic", "linear"):
        trajectory = load_trajectory(PROBLEM.robot, tmp_path / "trajectory.csv", interpolation=interpolation)  # type: ignore[arg-type]
        again = recheck_trajectory(PROBLEM, trajectory, limits=("position",))
        assert again.certificate.holds
        assert again.agrees is None
        assert not any("problem's" in note for note in again.notes)


def test_a_trajectory_of_another_problem_is_told() -> None:
    path = PiecewisePath.from_linear([0, 1], [[0.5, 0.0], [0.7, 0.0]])
    again = recheck_trajectory(PROBLEM, RecordedTrajectory(PROBLEM.robot, path), limits=())
    assert len(again.notes) == 2
    reached = turn(scene=[], start=(0.5, 0.0), goal=PositionGoal((2 * np.cos(0.7), 2 * np.sin(0.7), 0)))
    assert recheck_trajectory(reached, RecordedTrajectory(reached.robot, path), limits=()).notes == ()


def test_what_is_no_plan_is_refused(tmp_path: Path) -> None:
    (tmp_path / "plan.json").write_text(json.dumps({"spacearm": 1}))
    with pytest.raises(FileFormatError):
        recheck_plan(tmp_path / "plan.json")
