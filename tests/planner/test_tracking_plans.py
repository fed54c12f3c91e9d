"""Plans with a tracking error: searched for with room for it, and proven with it."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from spacearm.core.errors import ProblemError, SettingsError
from spacearm.files import save_plan
from spacearm.files.plan_file import recheck_plan
from spacearm.geometry import Scene, Sphere
from spacearm.planner import PlannerSettings, PoseGoal, Problem, plan
from spacearm.robot import forward_kinematics
from support.dense_samples import planar
from support.floating_arms import lander
from support.oracles.coal_shapes import least_distances
from support.oracles.pinocchio_points import joint_frames
from support.planar_problems import CLUTTERED, SMALL, turn


def tracked(error: Any, settings: PlannerSettings = SMALL) -> PlannerSettings:
    return replace(settings, tracking=error)


@pytest.mark.parametrize("error", [0.002, 0.01, {"all": 0.005, "j1": 0.02}])
def test_a_plan_is_proven_with_its_tracking_error(error: Any) -> None:
    problem = turn()
    names = problem.robot.dof_names
    if isinstance(error, dict):
        error = {names[0] if joint == "j1" else joint: value for joint, value in error.items()}
    found = plan(problem, tracked(error), rng=0)
    assert found.found, found.message
    assert found.certificate is not None
    assert found.certificate.tracking is not None
    assert found.trajectory is not None
    off = found.certificate.tracking
    rng = np.random.default_rng(0)
    q = found.trajectory.motion.sample(rng.uniform(0, 1, 300)) + off * rng.choice([-1.0, 1.0], (300, len(off)))
    assert least_distances(problem.robot, problem.scene, joint_frames(problem.robot, q)).min() >= found.certificate.clearance
    assert "with a tracking error of" in found.message


def test_a_wider_tube_keeps_a_motion_further_away() -> None:
    exact, wide = (plan(CLUTTERED, tracked(error, PlannerSettings(evaluations=2000)), rng=0) for error in (0.0, 0.02))
    assert exact.found
    assert wide.found
    assert exact.certificate is not None
    assert exact.certificate.closest is not None
    assert wide.certificate is not None
    assert wide.certificate.closest is not None
    assert wide.certificate.closest.clearance > exact.certificate.closest.clearance + 0.005


def test_goals_in_space_leave_room_for_the_tube() -> None:
    problem = turn()
    T = forward_kinematics(problem.robot, problem.goal.q)
    found = plan(replace(problem, goal=PoseGoal(T, free_axis="z")), tracked(0.005), rng=0)
    assert found.found, found.message


def test_a_start_that_the_tube_touches_is_told_at_once() -> None:
    near = Sphere((1.0, 0.2, 0.0), 0.08, name="near")  # 20 mm from the stretched arm
    problem = turn(scene=(near,), goal=(-math.pi / 2, 0.0))
    assert plan(problem, SMALL, rng=0).found
    found = plan(problem, tracked(0.1), rng=0)
    assert found.status == "start_in_collision"
    assert "obstacle 'near' have" in found.message
    assert "a tracking error of 0.1 rad may take" in found.message
    share = float(found.message.split("less than ")[1].split(" times")[0])
    assert 0 < share < 1
    assert plan(problem, tracked(0.95 * share * 0.1), rng=0).found
    backwards = plan(replace(problem, start=problem.goal.q, goal=problem.start), tracked(0.1), rng=0)
    assert backwards.status == "goal_in_collision"
    assert "at the goal link" in backwards.message


def test_no_room_at_a_joints_limit_is_refused() -> None:
    problem = turn(robot=planar(lower=(-0.001, -2.0), upper=(3.0, 2.0)))
    with pytest.raises(ProblemError, match=r"the start of joint '\w+' is 0.001 rad from its limit, expected at least"):
        plan(problem, tracked(0.01), rng=0)
    inside = replace(problem, start=(0.02, 0.0))
    found = plan(inside, tracked(0.01), rng=0)
    assert found.found
    assert found.trajectory is not None
    assert found.trajectory.motion.control_points[:, 0].min() >= -0.001 + 0.01 - 1e-6


def test_a_plan_that_fails_advises_a_smaller_tracking_error() -> None:
    gap = [Sphere((1.2, y, 0.0), 0.3, name=name) for y, name in ((0.45, "left"), (-0.45, "right"))]
    problem = Problem(planar(), Scene(gap), start=(0.0, 0.0), goal=(3.0, 0.0))
    found = plan(problem, tracked(0.02), rng=0)
    assert not found.found
    assert "or a smaller tracking error" in found.message or "a tracking error of 0.02 rad may take" in found.message


def test_settings_hold_a_tracking_error_that_can_be_hashed() -> None:
    assert PlannerSettings(tracking={"all": 0.002}).tracking == (("all", 0.002),)
    assert hash(PlannerSettings(tracking={"all": 0.002})) == hash(PlannerSettings(tracking=(("all", 0.002),)))
    with pytest.raises(SettingsError, match="tracking is -1"):
        PlannerSettings(tracking=-1)
    with pytest.raises(SettingsError, match="which is no joint of robot"):
        plan(turn(), tracked({"nobody": 0.1}), rng=0)


def test_a_floating_base_takes_no_tracking_error() -> None:
    robot = lander()
    problem = Problem(robot, Scene(()), start=np.zeros(robot.dof), goal=np.full(robot.dof, 0.1))
    with pytest.raises(SettingsError, match="how far such an error turns the base is not bounded yet"):
        plan(problem, tracked(0.001), rng=0)


def test_a_plan_file_is_proven_again_with_its_tracking_error(tmp_path: Path) -> None:
    found = plan(turn(), tracked(0.01), rng=0)
    save_plan(found, tmp_path / "plan.json")
    again = recheck_plan(tmp_path / "plan.json")
    assert again.agrees
    assert again.certificate.tracking is not None
    np.testing.assert_array_equal(again.certificate.tracking, found.certificate.tracking)
    assert json.loads((tmp_path / "plan.json").read_text())["certificate"]["tracking"] == {"all": 0.01}
    assert recheck_plan(tmp_path / "plan.json", tracking=0.0).certificate.tracking is None
