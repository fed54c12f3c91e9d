"""SpaceBench: the frozen set holds what it says, problems come from seeds, and what is measured is what happens."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from spacearm.cli import main
from spacearm.core.errors import FileFormatError
from spacearm.geometry import Box, Sphere
from spacearm.motion import Motion, Trajectory
from spacearm.planner import ConfigurationGoal, PositionGoal, Problem, clearance, report_base
from spacearm.proof import certify
from spacearm.robot import load_robot
from spacearm.study.reference_core import CoreSpeed
from spacearm.study.spacebench import SpaceProblem, find_problems, read_family, write_family
from spacearm.study.spacebench_families import FAMILIES
from spacearm.study.spacebench_generate import generate
from spacearm.study.spacebench_report import OUTCOMES, summary_of
from spacearm.study.spacebench_runs import SpaceProtocol, measure, released
from support.messages import assert_refused, assert_sentence

FROZEN = Path(__file__).resolve().parents[2] / "benchmarks" / "spacebench"
FOLDERS = {2: FROZEN, 1: FROZEN / "v1"}
CLEARANCE = {"truss": 0.01, "panel": 0.01, "module": 0.005, "grapple": 0.005, "arms": 0.01}


@pytest.fixture(scope="module")
def frozen() -> list[SpaceProblem]:
    return find_problems(FROZEN)


@pytest.fixture(scope="module")
def sets(frozen: list[SpaceProblem]) -> dict[int, list[SpaceProblem]]:
    return {2: frozen, 1: find_problems(FOLDERS[1])}


@pytest.mark.parametrize("number", FOLDERS)
def test_the_frozen_sets_have_fifty_problems_of_each_family(sets: dict[int, list[SpaceProblem]], number: int) -> None:
    frozen = sets[number]
    assert [item.name for item in frozen] == [f"{family}-{i:02d}" for family in FAMILIES for i in range(1, 51)]
    assert sum(path.stat().st_size for path in FOLDERS[number].glob("*.json")) < 4e6
    for family in FAMILIES:
        items = [item for item in frozen if item.family == family]
        kinds = {type(item.problem.goal) for item in items}
        assert ConfigurationGoal in kinds
        assert len(kinds) > 1
        assert any(item.problem.base_goal is not None for item in items)
        assert any(item.problem.base_limits.peak is not None for item in items)
        assert all(item.problem.floats and not np.array_equal(item.problem.base_start, np.eye(4)) for item in items)


def robots_with_a_box(items: list[SpaceProblem]) -> set[str]:
    robots = {item.problem.robot.name: item.problem.robot for item in items}
    return {name for name, robot in robots.items() if any(isinstance(part.shape, Box) for part in robot.shapes)}


def test_the_second_version_has_true_shapes_and_a_clearance_and_the_first_neither(
    sets: dict[int, list[SpaceProblem]],
) -> None:
    assert all(item.problem.clearance == CLEARANCE[item.family] for item in sets[2])
    assert all(item.problem.clearance == 0 for item in sets[1])
    boxed = {number: robots_with_a_box(items) for number, items in sets.items()}
    every_robot = {item.problem.robot.name for item in sets[2]}
    assert boxed == {1: set(), 2: every_robot - {"ssrms-14515kg"}}  # whose module is a capsule
    for path in FOLDERS[1].glob("*.json"):
        values = json.loads(path.read_text())
        assert values["spacearm-spacebench"] == 1
        assert all("clearance" not in problem for problem in values["problems"])


@pytest.mark.parametrize("number", FOLDERS)
@pytest.mark.parametrize("family", FAMILIES)
def test_known_solutions_hold_and_straight_motions_do_not(
    sets: dict[int, list[SpaceProblem]], number: int, family: str
) -> None:
    for item in [item for item in sets[number] if item.family == family][::10]:
        problem, solution = item.problem, item.solution
        np.testing.assert_array_equal(solution.motion.control_points[0], problem.start)
        certificate = certify(problem, solution)
        assert certificate.holds, item.name
        assert certificate.clearance is not None
        assert certificate.clearance >= problem.clearance, item.name
        assert not certificate.near_pairs, item.name
        assert not report_base(problem, solution).missed, item.name
        if isinstance(problem.goal, ConfigurationGoal):
            np.testing.assert_array_equal(solution.motion.control_points[-1], problem.goal.q)
            straight = Trajectory(
                problem.robot,
                Motion([problem.start, problem.goal.q]),
                base="floating",
                base_start=problem.base_start,
            )
            assert not (certify(problem, straight).holds and not report_base(problem, straight).missed), item.name


@pytest.mark.parametrize("family", FAMILIES)
def test_a_family_is_drawn_the_same_from_a_seed(family: str) -> None:
    one, other, third = (FAMILIES[family](np.random.default_rng([seed, 0])) for seed in (5, 5, 6))
    assert one.robot is other.robot
    assert one.obstacles == other.obstacles
    assert one.start == other.start
    assert one.goal == other.goal
    assert one.obstacles != third.obstacles


def test_problems_come_from_a_seed_bit_for_bit_and_back_from_a_file(tmp_path: Path) -> None:
    for name in ("one", "other"):
        drawn = generate("module", seed=3, number=1)
        write_family(tmp_path / f"{name}.json", "module", drawn.problems, seed=3, left_out=drawn.left_out)
    content = (tmp_path / "one.json").read_bytes()
    assert content == (tmp_path / "other.json").read_bytes()
    (back,) = read_family(tmp_path / "one.json")
    write_family(tmp_path / "again.json", "module", [back], seed=3, left_out=drawn.left_out)
    assert (tmp_path / "again.json").read_bytes() == content
    assert back.problem.clearance == CLEARANCE["module"]
    assert float(clearance(back.problem, back.problem.start)) > CLEARANCE["module"]


def arm_and_ball(base_mass: float) -> Problem:
    """A swing about the first axis, past a ball at the tip's height."""
    robot = load_robot("srs7")
    bodies = tuple(
        replace(body, mass=base_mass, inertia=base_mass * np.eye(3)) if body.joint < 0 else body for body in robot.bodies
    )
    q = np.array([0, 1.2, 0, 0.3, 0, 0, 0])
    goal = q + np.array([1.5, 0, 0, 0, 0, 0, 0])
    return Problem(replace(robot, bodies=bodies), [Sphere((0, 0, 2), 0.1)], start=q, goal=goal, base="floating")


def swing(problem: Problem) -> Trajectory:
    goal = problem.goal
    assert isinstance(goal, ConfigurationGoal)
    return Trajectory(problem.robot, Motion([problem.start, goal.q]), base="fixed", base_start=problem.base_start)


def test_a_motion_for_a_fixed_base_is_judged_as_the_free_base_moves() -> None:
    for mass, outcome in ((1e9, "holds"), (30.0, "misses its goal")):
        problem = arm_and_ball(mass)
        motion = swing(problem)
        tip = motion.tip(motion.duration)[:3, 3]
        in_space = replace(problem, goal=PositionGoal(tip))
        assert released(problem, motion)[0] == "holds"  # a goal of the joints is always reached
        what, deepest, missed = released(in_space, motion)
        free = replace(motion, base="floating")
        by_hand = float(np.linalg.norm(free.tip(free.duration)[:3, 3] - tip))
        assert (what, deepest) == (outcome, None)
        assert missed == pytest.approx(by_hand, abs=1e-6)
        touched = replace(in_space, scene=[Sphere(free.tip(free.duration / 2)[:3, 3], 0.01)])
        what, deepest, _ = released(touched, motion)
        assert what == "collides"
        assert deepest is not None
        assert 0 < deepest <= 0.05 + 1e-6
        assert released(replace(in_space, clearance=0.5), motion)[0] == "comes too near"  # of the ball that it passes
    assert by_hand > 0.05


def test_a_run_tells_both_plans(frozen: list[SpaceProblem]) -> None:
    items = [item for item in frozen if item.name in ("truss-01", "module-01")]
    runs = [measure(item, 0, SpaceProtocol(limit=5.0), CoreSpeed(1.0, 0.0)) for item in items]
    s = summary_of(runs, 5.0)
    assert s.runs == s.solved == 2
    assert s.fixed == sum(run.fixed == "found" for run in runs)
    assert set(s.let_go) == set(OUTCOMES)
    assert sum(s.let_go.values()) == pytest.approx(1)
    for run in runs:
        assert run.length is not None
        assert run.straight is not None
        assert run.length >= run.straight - 1e-9
        assert run.peak is not None
        assert run.final is not None
        assert run.peak >= run.final - 1e-9 > -1e-8


@pytest.fixture
def told(capsys: pytest.CaptureFixture[str]) -> Callable[..., tuple[int, str, str]]:
    def run(*arguments: object) -> tuple[int, str, str]:
        code = main(["bench", "space", *map(str, arguments)])
        captured = capsys.readouterr()
        return code, captured.out, captured.err

    return run


def test_the_command_measures_and_reports(tmp_path: Path, told: Callable) -> None:
    out = tmp_path / "out"
    code, text, _ = told("-d", FROZEN, "-o", out, "--family", "module", "--problems", 2, "--published", 1, "--limit", 5)
    assert code == 0
    names = {"report.html", "report.json", "tables.md"}
    assert {path.name for path in out.iterdir()} == names
    report = json.loads((out / "report.json").read_text())
    assert [(run["name"], run["status"]) for run in report["runs"]] == [("module-01", "found"), ("module-02", "found")]
    *ended, least_peak = [run["status"] for run in report["published"]]
    assert ended == ["found"] * 2
    assert least_peak in ("found", "not_proven")  # the time is up for it, and with clearance 0 it is driven to contact
    met = {target["what"]: target["met"] for target in report["targets"]}
    assert met["servicer: end effector misses its goal by, at most"]
    assert met["servicer: base turned at the end by, at most"]
    assert "clearance asked for: 5 mm; 0 in the published problems" in text
    assert "planned and proven for a fixed base, then certified for a floating base" in text


def test_wrong_input_is_one_sentence(tmp_path: Path, told: Callable) -> None:
    def refused(case: str, *arguments: object) -> None:
        code, out, err = told(*arguments)
        assert (code, out) == (2, "")
        assert_sentence(
            "study",
            case,
            err.removeprefix("spacearm: ").rstrip("\n").replace(str(tmp_path), "<path>").replace(str(FROZEN), "<set>"),
        )

    refused("space: no data", "-d", tmp_path)
    refused("space: no such family", "-d", FROZEN, "--family", "trus")
    refused("space: no seeds", "-d", FROZEN, "--seeds", 0)
    refused("space: no time", "-d", FROZEN, "--limit", 0)
    (tmp_path / "truss.json").write_text("{}")
    refused("space: no family's file", "-d", tmp_path)
    values = json.loads((FROZEN / "truss.json").read_text())
    values["problems"] = values["problems"][:1]

    def broken(case: str, **changes: object) -> None:
        path = tmp_path / "truss.json"
        path.write_text(json.dumps(values | {"problems": [values["problems"][0] | changes]}))
        assert_refused("study", case, FileFormatError, lambda: read_family(path), path=tmp_path)

    broken("space: robot that is not there", robot="srs8")
    broken("space: goal of another kind", goal={"place": [0, 0, 0]})
    broken("space: solution of another arm", solution={"control_points": [[0, 0], [1, 1]], "duration_s": 1.0})
    broken("space: obstacles that are none", obstacles=[{"cone": {}}])
    del values["problems"][0]["clearance"]
    broken("space: no clearance")
    (tmp_path / "truss.json").write_text(json.dumps(values | {"spacearm-spacebench": 1}))
    (older,) = read_family(tmp_path / "truss.json")
    assert older.problem.clearance == 0
    assert not (tmp_path / "out").exists()
