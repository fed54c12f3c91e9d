"""How a robot looks goes with its plan, outside of what is hashed."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import spacearm as sa
from spacearm.core.errors import SpacearmError
from spacearm.files.plan_file import load_saved_plan, problem_hash, recheck_plan
from spacearm.robot import LinkVisual

LOOK = (
    LinkVisual(
        name="link_1", joint=0, T_joint_visual=np.eye(4), kind="mesh", file="/gone/arm.dae", filename="package://arm.dae"
    ),
    LinkVisual(name="base", T_joint_visual=np.eye(4), kind="box", size=(1, 2, 3), color=(0.1, 0.2, 0.3, 1)),
    LinkVisual(name="link_2", joint=1, T_joint_visual=np.eye(4), kind="nothing", lack="its <box size> is missing"),
)


@pytest.fixture(scope="module")
def plan() -> sa.Plan:
    """A short motion of a robot that is drawn."""
    robot = replace(sa.load_robot("zhang2022"), visuals=LOOK)
    problem = sa.Problem(robot, [], start=np.zeros(7), goal=np.full(7, 0.1))
    return sa.plan(problem, sa.PlannerSettings(evaluations=30), rng=0)


def test_visuals_are_saved_and_read_back(plan: sa.Plan, tmp_path: Path) -> None:
    sa.save_plan(plan, tmp_path / "plan.json")
    saved = load_saved_plan(tmp_path / "plan.json")
    assert saved.problem.robot.visuals == LOOK
    assert saved.trajectory.robot.visuals == LOOK
    assert saved.problem_hash == problem_hash(saved.problem)
    assert recheck_plan(tmp_path / "plan.json").notes == ()


def test_visuals_change_no_hash(plan: sa.Plan) -> None:
    bare = replace(plan.problem, robot=replace(plan.problem.robot, visuals=()))
    assert problem_hash(bare) == problem_hash(plan.problem)


def test_a_robot_without_visuals_writes_none(plan: sa.Plan, tmp_path: Path) -> None:
    bare = replace(plan, problem=replace(plan.problem, robot=replace(plan.problem.robot, visuals=())))
    sa.save_plan(bare, tmp_path / "plan.json")
    assert "visuals" not in json.loads((tmp_path / "plan.json").read_text())
    assert load_saved_plan(tmp_path / "plan.json").problem.robot.visuals == ()


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ([{"name": "a"}], "visuals[0]"),
        (
            [{"name": "a", "joint": 99, "kind": "box", "size": [1, 1, 1], "T_joint_visual": np.eye(4).tolist()}],
            "rides on joint 99",
        ),
        ([{"name": "a", "joint": 0, "kind": "cone", "T_joint_visual": np.eye(4).tolist()}], "kind is 'cone'"),
        ("all", "visuals"),
    ],
)
def test_wrong_visuals_are_refused(plan: sa.Plan, tmp_path: Path, wrong: Any, words: str) -> None:
    sa.save_plan(plan, tmp_path / "plan.json")
    values = json.loads((tmp_path / "plan.json").read_text())
    (tmp_path / "edited.json").write_text(json.dumps(values | {"visuals": wrong}))
    with pytest.raises(SpacearmError) as refused:
        load_saved_plan(tmp_path / "edited.json")
    assert words in str(refused.value)
    assert "edited.json" in str(refused.value)


def test_a_picture_of_a_plan_whose_meshes_are_gone_says_so(plan: sa.Plan, tmp_path: Path) -> None:
    sa.save_plan(plan, tmp_path / "plan.json")
    from spacearm.report.report_plan import report_of_plans

    page = report_of_plans(load_saved_plan(tmp_path / "plan.json"))
    sections = [*page["sections"], *page["views"][0]["sections"]]
    notes = [note for section in sections for note in section.get("notes", ())]
    assert any("the mesh is not there, and the envelope is drawn: 'link_1: package://arm.dae'" in note for note in notes)
    assert any("its <box size> is missing: 'link_2'" in note for note in notes)
