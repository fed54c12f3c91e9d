"""Plans on disk: strict JSON that is the same for the same seed and holds all that is needed, and CSV."""

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
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from spacearm.core.errors import FileFormatError, OutputError, ProblemError, SpacearmError
from spacearm.core.records import record_as_dict
from spacearm.dynamics import Momentum, base_at_mass_center
from spacearm.files import load_plan, load_saved_plan, plan_as_dict, save_plan, save_trajectory
from spacearm.files.plan_file import problem_as_dict, problem_from_dict, problem_hash, recheck_plan
from spacearm.geometry import Box, Cylinder, HalfSpace, Scene, Sphere, pose
from spacearm.motion import RecordedTrajectory, TimeLaw, Trajectory
from spacearm.planner import BaseLimits, Plan, PlannerSettings, PoseGoal, PositionGoal, Problem, plan
from spacearm.proof import certify
from spacearm.robot import Joint, forward_kinematics, load_robot
from support import strategies
from support.dense_samples import arms, planar
from support.drawn_shapes import obstacles
from support.messages import assert_refused
from support.planar_problems import BALL, PROBLEM, SMALL, edited, turn, turntable


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
    assert load_plan(saved) == found.trajectory
    assert load_plan(str(saved), PROBLEM).duration == found.fitness["duration"]


def test_the_file_is_the_plan_in_strict_json(found: Plan, saved: Path) -> None:
    content = strictly(saved.read_text())
    assert content == plan_as_dict(found)
    assert content["spacearm-plan"] == 1
    assert (content["status"], content["seed"]) == ("found", 0)
    assert content["motion"]["control_points"][0] == [0.0, 0.0]
    assert content["certificate"]["status"] == "holds"
    assert "\n" in saved.read_text()
    assert '"start": [0.0, 0.0],\n' in saved.read_text()


def test_the_same_seed_gives_the_same_bytes(saved: Path, tmp_path: Path) -> None:
    save_plan(plan(PROBLEM, SMALL, rng=0), tmp_path / "again.json")
    assert (tmp_path / "again.json").read_bytes() == saved.read_bytes()


def test_the_file_alone_is_enough_to_prove_the_plan_again(found: Plan, saved: Path) -> None:
    content = load_saved_plan(saved)
    assert content.problem == PROBLEM
    assert content.trajectory == found.trajectory
    assert content.status == "found"
    assert content.problem_hash == problem_hash(PROBLEM)
    again = certify(content.problem, content.trajectory)
    assert again.holds
    assert again.as_dict() == content.certificate


OUTCOMES: dict[str, Any] = {
    "free space": turn(scene=[]),
    "free space, joint without limits": Problem(turntable(), Scene([]), start=[0.0], goal=[1.0]),
    "no links": turn(robot=planar(capsules=())),
    "no motion": turn(scene=[], goal=(0.0, 0.0)),
    "no way": turn(scene=[Box((0.01, 9, 9), pose((0, 0, 0))), BALL], robot=planar(capsules=planar().capsules[1:])),
    "start in collision": turn(scene=[Sphere((1.0, 0, 0), 0.3)]),
    "position": turn(scene=[], goal=PositionGoal((0.4, 1.1, 0.0))),
    "out of reach": turn(scene=[], goal=PositionGoal((4.0, 1.1, 0.0))),
    "pose": turn(scene=[], goal=PoseGoal(pose((0.4, 1.1, 0.0)), free_axis="z", orientation_tolerance=0.1)),
    "every shape": turn(scene=[Cylinder(0.1, 0.2, (0, 0, 3)), HalfSpace((0, 0, 1), (0, 0, -1)), BALL]),
    "time optimal": replace(SMALL, time_law="time_optimal"),
}


@pytest.mark.parametrize("case", OUTCOMES)
def test_every_outcome_is_strict_json_and_read_back(case: str, tmp_path: Path) -> None:
    given = OUTCOMES[case]
    problem, options = (turn(scene=[]), given) if isinstance(given, PlannerSettings) else (given, SMALL)
    made = plan(problem, options, rng=0)
    path = tmp_path / "plan.json"
    save_plan(made, path)
    assert strictly(path.read_text()) == plan_as_dict(made)
    if made.trajectory is None:
        with pytest.raises(FileFormatError, match="holds no motion"):
            load_saved_plan(path)
    else:
        assert load_plan(path, made.problem) == made.trajectory
        assert load_saved_plan(path).problem == made.problem


def test_settings_in_numpys_numbers_are_written(tmp_path: Path) -> None:
    save_plan(plan(turn(scene=[]), replace(SMALL, islands=np.int64(1)), rng=0), tmp_path / "plan.json")


@settings(max_examples=25)
@given(st.data())
def test_a_problem_is_the_same_after_json_whatever_is_in_it(data: st.DataObject) -> None:
    robot = data.draw(arms(self_pairs=True))
    start, goal = data.draw(strategies.configurations(robot, (2,)))
    problem = Problem(robot, Scene(data.draw(st.lists(obstacles(), max_size=4))), start=start, goal=goal)
    again = problem_from_dict(strictly(json.dumps(problem_as_dict(problem))))
    assert again == problem
    assert problem_hash(again) == problem_hash(problem)


def test_where_a_robot_was_read_from_does_not_change_the_hash() -> None:
    moved = turn(robot=replace(planar(), source="elsewhere.urdf", notes=("assumed",)))
    assert problem_hash(moved) == problem_hash(PROBLEM)
    assert problem_hash(turn(robot=planar(velocity=(1.0, 2.0)))) != problem_hash(PROBLEM)


# ---- a base that floats ----------------------------------------------------------------------------------------------

CRAFT = load_robot("srs7")
ADRIFT: dict[str, Any] = {
    "fixed elsewhere": {"base": "fixed", "base_start": pose((1, 2, 3), (1, 0, 0, 1))},
    "floating": {},
    "at its mass center": {"base_start": base_at_mass_center(CRAFT, CRAFT.configuration("home"))},
    "as it was": {"base_goal": (1, 0, 0, 0)},
    "with limits": {"base_limits": BaseLimits(peak=0.5, rate=0.25)},
    "tumbling": {"momentum": Momentum(linear=(1, 0, 0), angular=(0, 0.1, 0.1)), "duration": 40.0},
}


def adrift(**asked: Any) -> Problem:
    home = CRAFT.configuration("home")
    return Problem(CRAFT, [], start=home, goal=home + np.array((0.3, 0.2, 0, -0.3, 0, 0.3, 0)), **asked)


@pytest.mark.parametrize("case", ADRIFT)
def test_a_plan_with_a_floating_base_is_read_back_bit_for_bit(case: str, tmp_path: Path) -> None:
    problem = adrift(**ADRIFT[case])
    made = plan(problem, SMALL, rng=0)
    path = tmp_path / "plan.json"
    save_plan(made, path)
    content = strictly(path.read_text())
    assert content == plan_as_dict(made)
    assert ("base" in content) == problem.floats
    if made.base is not None:
        assert content["base"] == record_as_dict(made.base)
    again = load_saved_plan(path)
    assert again.problem == problem
    assert problem_hash(again.problem) == again.problem_hash == problem_hash(problem)
    assert again.trajectory == made.trajectory == load_plan(path) == load_plan(path, problem)
    assert (again.trajectory.base, again.trajectory.momentum) == (problem.base, problem.momentum)
    np.testing.assert_array_equal(again.trajectory.base_start, problem.base_start)


def test_all_that_is_asked_of_a_base_counts_in_the_hash() -> None:
    hashes = [problem_hash(adrift(**asked)) for asked in ADRIFT.values()]
    hashes.append(problem_hash(adrift(momentum=ADRIFT["tumbling"]["momentum"], duration=41)))
    hashes.append(problem_hash(adrift(duration=40)))
    assert len(set(hashes)) == len(hashes)
    for asked in ADRIFT.values():
        again = problem_from_dict(strictly(json.dumps(problem_as_dict(adrift(**asked)))))
        assert problem_hash(again) == problem_hash(adrift(**asked))


def test_problems_from_before_bases_could_float_keep_their_hashes() -> None:
    """The number is that of a release whose problems had a fixed base at the origin, and no more."""
    written = replace(OUTCOMES["position"], clearance=0.0)
    assert problem_hash(written) == "9aec95a09786c618c70bc4b5cace164e924771227f643d2496db2c87b909d271"
    values = problem_as_dict(written)
    assert set(values) == {"robot", "base", "clearance", "start", "goal", "obstacles"}
    del values["clearance"]
    values["robot"].pop("base", None)  # as it was then
    assert problem_from_dict(values) == written
    assert "base" not in plan_as_dict(plan(turn(scene=[]), SMALL, rng=0))


OLD = Path(__file__).parent / "data" / "plan_before_certificate_version.json"


def test_a_plan_that_an_older_release_saved_is_still_read(found: Plan) -> None:
    assert "spacearm-certificate" not in json.loads(OLD.read_text())["certificate"]
    old = load_saved_plan(OLD)
    assert old.problem_hash == problem_hash(old.problem)
    (note,) = recheck_plan(OLD).notes
    assert note.startswith("the file states no clearance")
    assert (old.is_old, old.problem.clearance) == (True, 0.0)
    before = replace(PROBLEM, clearance=0.0)
    trajectory = load_plan(OLD, before)
    assert trajectory.motion.control_points.tolist() == json.loads(OLD.read_text())["motion"]["control_points"]
    assert certify(before, trajectory).holds


# ---- refused ---------------------------------------------------------------------------------------------------------


BROKEN: dict[str, Any] = {
    "text": lambda path: path.write_text("not a plan"),
    "empty": lambda path: path.write_bytes(b""),
    "binary": lambda path: path.write_bytes(bytes(range(256))),
    "cut off": lambda path: path.write_bytes(path.read_bytes()[:-100]),
    "a list": lambda path: path.write_text("[1, 2]"),
    "nested too deeply": lambda path: path.write_text("[" * 100_000),
    "another version": lambda path: edited(path, lambda c: c.update({"spacearm-plan": 2})),
    "version a text": lambda path: edited(path, lambda c: c.update({"spacearm-plan": "1"})),
    "certificate of a newer version": lambda path: edited(path, lambda c: c["certificate"].update({"spacearm-certificate": 2})),
    "a problem": lambda path: path.write_text('{"spacearm": 1}'),
    "no motion in it": lambda path: edited(path, lambda c: c.update(motion=None, status="not_found")),
    "motion missing": lambda path: edited(path, lambda c: c.pop("motion")),
    "not a number in it": lambda path: edited(path, lambda c: c["motion"].update(duration_s=math.nan)),
    "half a character": lambda path: edited(path, lambda c: c.update(status="\ud800")),
    "problem a text": lambda path: edited(path, lambda c: c.update(problem="mine")),
    "problem without hash": lambda path: edited(path, lambda c: c["problem"].pop("hash")),
    "problem without goal": lambda path: edited(path, lambda c: c["problem"].pop("goal")),
    "certificate a text": lambda path: edited(path, lambda c: c.update(certificate="holds")),
    "missing": lambda path: path.unlink(),
}


@pytest.mark.parametrize("case", BROKEN)
def test_a_file_that_is_no_plan_is_refused(case: str, saved: Path) -> None:
    BROKEN[case](saved)
    assert_refused("plan_file", case, FileFormatError, lambda: load_saved_plan(saved), path=saved)


WRONG: dict[str, Any] = {
    "robot: no joints": lambda c: c["problem"]["robot"].update(joints=[]),
    "robot: a key mistyped": lambda c: c["problem"]["robot"].update(jonts=[]),
    "robot: a key missing": lambda c: c["problem"]["robot"].pop("tip"),
    "robot: name a number": lambda c: c["problem"]["robot"].update(name=3),
    "robot: a joint of no kind": lambda c: c["problem"]["robot"]["joints"][0].update(kind=["revolute"]),
    "robot: a joint a list": lambda c: c["problem"]["robot"]["joints"].__setitem__(0, []),
    "robot: a transform that is none": lambda c: c["problem"]["robot"]["joints"][0]["T_parent_joint"][0].__setitem__(0, 2),
    "robot: limits that are text": lambda c: c["problem"]["robot"].update(lower="low"),
    "robot: a pair of three": lambda c: c["problem"]["robot"].update(self_pairs=[["a", "b", "c"]]),
    "scene: no such shape": lambda c: c["problem"]["obstacles"].append({"spere": {}}),
    "scene: two shapes": lambda c: c["problem"]["obstacles"].append({"sphere": {}, "box": {}}),
    "scene: no radius": lambda c: c["problem"]["obstacles"][0]["sphere"].pop("radius"),
    "scene: radius below 0": lambda c: c["problem"]["obstacles"][0]["sphere"].update(radius=-1),
    "scene: a mapping": lambda c: c["problem"].update(obstacles={}),
    "start: too short": lambda c: c["problem"].update(start=[0.0]),
    "start: a mapping": lambda c: c["problem"].update(start={}),
    "goal: of no kind": lambda c: c["problem"].update(goal={}),
    "base: afloat": lambda c: c["problem"].update(base="floating"),
    "base: mistyped": lambda c: c["problem"].update(base="float"),
    "base: start a point": lambda c: c["problem"].update(base_start=[0, 0, 1]),
    "base: start not rigid": lambda c: c["problem"].update(base_start=np.diag([1.0, 1, 2, 1]).tolist()),
    "base: momentum a list": lambda c: c["problem"].update(momentum=[0, 0, 1]),
    "base: momentum of a fixed base": lambda c: c["problem"].update(momentum={"linear": [0, 0, 1]}),
    "base: goal mistyped": lambda c: c["problem"].update(base_goal={"atitude": [1, 0, 0, 0]}),
    "base: goal of a fixed base": lambda c: c["problem"].update(base_goal={"attitude_wxyz": [1, 0, 0, 0]}),
    "base: limits a number": lambda c: c["problem"].update(base_limits=3),
    "base: limit text": lambda c: c["problem"].update(base_limits={"peak": "small"}),
    "base: duration zero": lambda c: c["problem"].update(duration=0),
    "motion: base mistyped": lambda c: c["motion"].update(base="float"),
    "motion: base without masses": lambda c: c["motion"].update(base="floating"),
    "motion: base_start a word": lambda c: c["motion"].update(base_start="origin"),
    "motion: a text": lambda c: c.update(motion="fast"),
    "motion: a key mistyped": lambda c: c["motion"].update(duration=3),
    "motion: no control points": lambda c: c["motion"].pop("control_points"),
    "motion: no duration": lambda c: c["motion"].pop("duration_s"),
    "motion: duration null": lambda c: c["motion"].update(duration_s=None),
    "motion: another number of joints": lambda c: c["motion"].update(control_points=[[0.0], [1.0]]),
    "motion: rows of different lengths": lambda c: c["motion"]["control_points"].__setitem__(0, [0.0]),
    "motion: time law a number": lambda c: c["motion"].update(time_law=1),
    "motion: time law that falls": lambda c: c["motion"].update(
        time_law={"breaks": [0, 1], "coefficients": [[0.0, 1.5, 0.5, 1.0]]}
    ),
    "motion: notes a text": lambda c: c["motion"].update(notes="slow"),
}


@pytest.mark.parametrize("case", WRONG)
def test_what_cannot_be_is_named(case: str, saved: Path) -> None:
    edited(saved, WRONG[case])
    error = type(_raised(lambda: load_saved_plan(saved)))
    assert_refused("plan_file", case, error, lambda: load_saved_plan(saved), path=saved)


def _raised(call: Any) -> SpacearmError:
    with pytest.raises(SpacearmError) as caught:
        call()
    return caught.value


OTHERS: dict[str, Any] = {
    "another start": lambda: turn(start=(0.1, 0.0)),
    "another goal": lambda: turn(goal=(1.5, 0.0)),
    "another obstacle": lambda: turn(scene=[Sphere((1.2, 1.2, 0.0), 0.31)]),
    "no obstacle": lambda: turn(scene=[]),
    "another robot": lambda: turn(robot=replace(planar(), name="other")),
}


@pytest.mark.parametrize("case", OTHERS)
def test_a_plan_of_another_problem_is_refused(case: str, saved: Path) -> None:
    assert_refused("plan_file", "another problem", FileFormatError, lambda: load_plan(saved, OTHERS[case]()), path=saved)


BREAKING: dict[str, Any] = {
    "too fast": lambda motion: motion.update(duration_s=0.1),
    "beyond a position limit": lambda motion: motion["control_points"].__setitem__(1, [9.0, 9.0]),
}


@pytest.mark.parametrize("case", BREAKING)
def test_a_motion_that_breaks_the_limits_is_no_trajectory_but_can_be_judged(case: str, saved: Path) -> None:
    edited(saved, lambda content: BREAKING[case](content["motion"]))
    with pytest.raises(ProblemError):
        load_plan(saved, PROBLEM)
    content = load_saved_plan(saved)
    assert isinstance(content.trajectory, RecordedTrajectory)
    certificate = certify(content.problem, content.trajectory)
    assert certificate.status == "fails"
    assert certificate.broken_limits


# ---- files that were damaged at random -------------------------------------------------------------------------------

VALUES = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(-3, 10),
    st.sampled_from([10**400, -(2**63), 1e300, -1e300, 1e-300, 0.5, "", "x", "\x00", [], {}, [[]], [1, [2]], {"a": 1}]),
    st.text(max_size=3),
)


def _places(value: Any, place: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    inside = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    return [place, *(deeper for key, entry in inside for deeper in _places(entry, (*place, key)))]


@settings(max_examples=30, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_a_damaged_file_is_refused_in_a_sentence_or_judged(data: st.DataObject, found: Plan, tmp_path: Path) -> None:
    content = json.loads(json.dumps(plan_as_dict(found)))
    del content["certificate"], content["history"], content["settings"], content["ends"]  # nothing there is read
    for _ in range(data.draw(st.integers(1, 3))):
        *path, last = data.draw(st.sampled_from(_places(content)[1:]))
        at = content
        for key in path:
            at = at[key]
        action = data.draw(st.sampled_from(["replace", "remove", "double"]))
        if action == "replace":
            at[last] = data.draw(VALUES)
        elif action == "remove" or isinstance(at, dict):
            del at[last]
        else:
            at.insert(last, at[last])
    file = tmp_path / "damaged.json"
    file.write_text(json.dumps(content))
    sentence = _told(lambda: certify(load_saved_plan(file).problem, load_saved_plan(file).trajectory))
    assert "\n" not in sentence
    assert len(sentence) < 1000


@settings(max_examples=30, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(at=st.floats(0, 1), cut=st.integers(0, 40), junk=st.binary(max_size=5))
def test_damaged_bytes_are_refused_in_a_sentence(at: float, cut: int, junk: bytes, saved: Path, tmp_path: Path) -> None:
    content = saved.read_bytes()
    place = int(at * len(content))
    (tmp_path / "bytes.json").write_bytes(content[:place] + junk + content[place + cut :])
    assert "\n" not in _told(lambda: load_saved_plan(tmp_path / "bytes.json"))


def _told(call: Any) -> str:
    """What a call is refused with, if it is; any other error passes."""
    try:
        call()
    except SpacearmError as error:
        return str(error)
    return ""


# ---- where files go --------------------------------------------------------------------------------------------------


def test_nothing_is_overwritten(found: Plan, saved: Path) -> None:
    before = saved.read_bytes()
    assert_refused("plan_file", "exists", OutputError, lambda: save_plan(found, saved), path=saved)
    assert found.trajectory is not None
    trajectory = found.trajectory
    assert_refused("plan_file", "CSV: exists", OutputError, lambda: save_trajectory(trajectory, saved), path=saved)
    assert saved.read_bytes() == before


def test_a_folder_that_is_missing_is_named(found: Plan, tmp_path: Path) -> None:
    path = tmp_path / "missing" / "plan.json"
    assert_refused("plan_file", "no such folder", OutputError, lambda: save_plan(found, path), path=path)


def test_a_full_disk_leaves_no_half_a_plan(found: Plan, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: Any) -> Any:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "fsync", full)
    path = tmp_path / "plan.json"
    assert_refused("plan_file", "disk full", OutputError, lambda: save_plan(found, path), path=path)
    assert os.listdir(tmp_path) == []


# ---- motions with a time law, mimics, slides -------------------------------------------------------------------------


def test_a_time_law_is_kept(found: Plan, tmp_path: Path) -> None:
    assert found.trajectory is not None
    law = TimeLaw([0.0, 0.5, 1.0], [[0.0, 0.1, 0.3], [0.3, 0.5, 1.0]])
    slower = Trajectory(PROBLEM.robot, found.trajectory.motion, duration=99.0, time_law=law, notes=("by hand",))
    save_plan(replace(found, trajectory=slower), tmp_path / "plan.json")
    assert load_plan(tmp_path / "plan.json") == slower


def test_mimics_and_slides_are_kept(tmp_path: Path) -> None:
    follower = Joint(name="f", kind="prismatic", parent=1, T_parent_joint=np.eye(4), dof=0, multiplier=-0.5, offset=0.1)
    robot = planar(joints=(*planar().joints, follower))
    save_plan(plan(turn(robot=robot), SMALL, rng=0), tmp_path / "plan.json")
    assert load_saved_plan(tmp_path / "plan.json").problem.robot == robot


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
    assert len((tmp_path / "a.csv").read_text().splitlines()) >= 202
