"""The second proof of a file: it believes nothing, and says what is odd."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from spacearm.core.errors import FileFormatError, ProblemError
from spacearm.files import load_trajectory, save_plan, save_trajectory
from spacearm.files.plan_file import load_saved_plan, problem_hash, recheck_plan, recheck_trajectory
from spacearm.geometry import Sphere, SphereSet, pose
from spacearm.motion import PiecewisePath, RecordedTrajectory
from spacearm.planner import BaseLimits, Plan, PlannerSettings, PositionGoal, Problem, plan, report_base
from spacearm.proof import certify
from spacearm.robot import load_robot
from support.dense_samples import planar
from support.planar_problems import BALL, PROBLEM, SMALL, edited, turn


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


def with_proof(saved: Path, proof: object) -> Path:
    """Write the plan with another proof."""
    content = json.loads(saved.read_text())
    content["proof"] = proof
    out = saved.with_name("other.json")
    out.write_text(json.dumps(content))
    return out


def test_the_proof_in_the_file_is_the_one_that_is_checked(found: Plan, saved: Path) -> None:
    assert found.certificate is not None
    assert found.certificate.proof is not None
    proof = load_saved_plan(saved).proof
    assert proof is not None
    np.testing.assert_array_equal(proof.steps, found.certificate.proof.steps)
    np.testing.assert_array_equal(proof.directions, found.certificate.proof.directions)
    assert recheck_plan(saved).proof_checked is True


def test_a_proof_that_shows_nothing_is_replaced_and_that_is_said(found: Plan, saved: Path) -> None:
    assert found.certificate is not None
    assert found.certificate.proof is not None
    proof = found.certificate.proof
    turned = replace(proof, directions=-proof.directions)
    short = replace(proof, steps=proof.steps[:-1])
    for wrong in (turned, short):
        again = recheck_plan(with_proof(saved, wrong.as_dict()))
        assert again.certificate.holds
        assert again.proof_checked is False
        assert "the proof given does not show it" in again.certificate.message


def test_a_file_without_a_proof_is_proven_anew(saved: Path) -> None:
    again = recheck_plan(with_proof(saved, None))
    assert again.certificate.holds
    assert again.proof_checked is None


@pytest.mark.parametrize(
    "proof", [{}, {"spacearm-proof": 9}, {"spacearm-proof": 1}, {"spacearm-proof": 1, "nodes": 1, "planes": 1, "steps": "?"}]
)
def test_what_is_no_proof_is_refused(proof: dict[str, Any], saved: Path) -> None:
    with pytest.raises(FileFormatError, match=r"other\.json.*proof"):
        recheck_plan(with_proof(saved, proof))


def test_notes_on_a_mesh_are_in_the_file_and_no_part_of_a_hash(tmp_path: Path) -> None:
    balls = SphereSet([[5, 5, 5]], [0.1], notes=("it is open",))
    problem = replace(PROBLEM, scene=[*PROBLEM.scene.obstacles, balls])
    without = replace(PROBLEM, scene=[*PROBLEM.scene.obstacles, replace(balls, notes=())])
    assert problem_hash(problem) == problem_hash(without)
    found = plan(problem, SMALL, rng=0)
    assert found.certificate is not None
    assert found.certificate.problem_hash == certify(without, found.trajectory).problem_hash
    save_plan(found, tmp_path / "plan.json")
    content = json.loads((tmp_path / "plan.json").read_text())
    assert content["problem"]["obstacles"][-1]["sphere_set"].pop("notes") == ["it is open"]
    (tmp_path / "older.json").write_text(json.dumps(content))  # written when balls had no notes
    assert recheck_plan(tmp_path / "older.json").notes == ()


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
    assert not recheck_plan(saved, clearance=1.0).certificate.holds
    with pytest.raises(ProblemError):
        recheck_plan(saved, limits=("speed",))


def test_a_plan_of_another_robot_is_refused(saved: Path) -> None:
    from support.planar_problems import turntable

    other = Problem(turntable(), [], start=[0.0], goal=[1.0])
    with pytest.raises(ProblemError, match=r"moves joint.*expected the joints"):
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


# ---- a base that floats ----------------------------------------------------------------------------------------------

CRAFT = load_robot("srs7")
ADRIFT = Problem(
    CRAFT,
    [],
    start=CRAFT.configuration("home"),
    goal=PositionGoal((0.3, 0.3, 0.7)),
    base_start=pose((0, 0, 0.1)),
    base_limits=BaseLimits(peak=0.5),
)


@pytest.fixture(scope="module")
def drifted() -> Plan:
    made = plan(ADRIFT, PlannerSettings(evaluations=1500), rng=0)
    assert made.found, made.message
    return made


@pytest.fixture
def floating(drifted: Plan, tmp_path: Path) -> Path:
    save_plan(drifted, tmp_path / "plan.json")
    return tmp_path / "plan.json"


def test_an_untouched_plan_with_a_floating_base_holds_again(drifted: Plan, floating: Path) -> None:
    again = recheck_plan(floating)
    assert (again.certificate.holds, again.agrees, again.notes) == (True, True, ())
    assert again.base == drifted.base == report_base(ADRIFT, drifted.trajectory)
    assert again.base.goal_distance < 1e-3
    end = drifted.trajectory.tip(drifted.trajectory.duration)[:3, 3]
    np.testing.assert_allclose(end, (0.3, 0.3, 0.7), atol=1e-3)
    assert recheck_plan(floating, ADRIFT).notes == ()


def both(content: dict[str, Any], **base: Any) -> None:
    content["problem"].update(base)
    content["motion"].update(base)


def heavier(content: dict[str, Any]) -> None:
    base = next(body for body in content["problem"]["robot"]["bodies"] if body["joint"] == -1)
    base["mass"] *= 2


_PROBLEM, _MOTION = "problem in the file is not the one that was planned", "motion in the file is not the one"
_MISSED = "end effector misses its goal by"
TAMPERED: dict[str, Any] = {
    "a base elsewhere": (lambda c: both(c, base_start=pose((0.1, 0, 0.1)).tolist()), [_PROBLEM, _MOTION, _MISSED]),
    "a base that is held": (
        lambda c: (both(c, base="fixed"), c["problem"].pop("base_limits")),
        [_PROBLEM, _MOTION, "does not end at the problem's goal"],
    ),
    "a momentum": (
        lambda c: (both(c, momentum={"angular": [0, 0, 1]}), c["problem"].update(duration=c["motion"]["duration_s"])),
        [_PROBLEM, _MOTION, _MISSED],
    ),
    "masses": (heavier, [_PROBLEM, _MISSED]),
    "a goal": (lambda c: c["problem"]["goal"].update(position=[0.3, 0.3, 0.6]), [_PROBLEM, _MISSED]),
    "a limit": (lambda c: c["problem"]["base_limits"].update(peak=0.01), [_PROBLEM, "the base turns by"]),
    "an attitude": (
        lambda c: c["problem"].update(base_goal={"attitude_wxyz": [1, 0, 0, 0]}),
        [_PROBLEM, "the base misses its goal attitude by"],
    ),
    "a duration": (lambda c: c["problem"].update(duration=1.0), [_PROBLEM, "and the problem asks for 1 s"]),
    "what it says of itself": (lambda c: c["base"].update(peak=0.0, goal_distance=0.0), []),
}


@pytest.mark.parametrize("case", TAMPERED)
def test_a_floating_base_that_was_tampered_with_is_told(case: str, floating: Path) -> None:
    change, expected = TAMPERED[case]
    again = recheck_plan(edited(floating, change))
    told = [note for note in again.notes if "certificate says" not in note]
    for words in expected:
        assert any(words in note for note in told), again.notes
    assert case == "a momentum" or len(told) == len(expected), again.notes


SPLIT: dict[str, Any] = {
    "base_start of the problem alone": lambda c: c["problem"].update(base_start=pose((0.1, 0, 0.1)).tolist()),
    "base_start of the motion alone": lambda c: c["motion"].pop("base_start"),
    "base of the motion alone": lambda c: c["motion"].pop("base"),
    "momentum of the motion alone": lambda c: c["motion"].update(momentum={"linear": [0, 0, 1]}),
}


@pytest.mark.parametrize("case", SPLIT)
def test_a_motion_of_another_base_than_its_problems_is_refused(case: str, floating: Path) -> None:
    path = edited(floating, SPLIT[case])
    with pytest.raises(ProblemError) as caught:
        recheck_plan(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert "problem's" in str(caught.value)


def test_a_plan_for_a_floating_base_is_none_for_a_fixed_one(floating: Path) -> None:
    with pytest.raises(ProblemError, match="the trajectory is of a floating base"):
        recheck_plan(floating, replace(ADRIFT, base="fixed", base_limits=None))


def test_the_base_is_that_of_the_problem_it_is_proven_for(drifted: Plan, floating: Path) -> None:
    """With a base twice as heavy the arm turns it less, and ends elsewhere."""
    bodies = tuple(replace(b, mass=2 * b.mass, inertia=2 * b.inertia) if b.joint == -1 else b for b in CRAFT.bodies)
    again = recheck_plan(floating, replace(ADRIFT, robot=replace(CRAFT, bodies=bodies)))
    assert again.base.peak < 0.7 * drifted.base.peak
    assert any("differs in: robot" in note for note in again.notes)
    assert any("misses its goal" in note for note in again.notes)


def test_our_own_csv_of_a_floating_base_holds_again(drifted: Plan, tmp_path: Path) -> None:
    save_trajectory(drifted.trajectory, tmp_path / "trajectory.csv")
    read = load_trajectory(CRAFT, tmp_path / "trajectory.csv", base="floating", base_start=ADRIFT.base_start)
    again = recheck_trajectory(ADRIFT, read, limits=("position",))
    assert again.certificate.holds
    assert again.base.goal_distance < 1e-3
    assert not any("misses" in note or "problem's" in note for note in again.notes)
    astray = replace(ADRIFT, goal=PositionGoal((0.3, 0.3, 0.6)))
    assert any("misses its goal by 100" in note for note in recheck_trajectory(astray, read, limits=()).notes)


def test_a_goal_in_space_is_where_it_is_also_for_a_fixed_base_elsewhere() -> None:
    tip = (2 * np.cos(0.7), 2 * np.sin(0.7), 0)
    path = PiecewisePath.from_linear([0, 1], [[0.5, 0.0], [0.7, 0.0]])
    for start, notes in ((pose((0, 0, 1)), 0), (np.eye(4), 1)):
        asked = Problem(planar(), [], start=(0.5, 0.0), goal=PositionGoal(np.add(tip, (0, 0, 1))), base_start=start)
        again = recheck_trajectory(asked, RecordedTrajectory(planar(), path, base_start=start), limits=())
        assert len(again.notes) == notes


def test_a_duration_that_is_not_as_was_asked_is_told(saved: Path) -> None:
    asked = replace(PROBLEM, duration=99.0)
    assert any("and the problem asks for 99 s" in note for note in recheck_plan(saved, asked).notes)
