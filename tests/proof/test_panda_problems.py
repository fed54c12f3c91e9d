"""MotionBenchMaker's Panda among shelves, tables and cages; SPACEARM_MBM names the folder that holds them."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from spacearm.files import load_moveit
from spacearm.motion import AnyTrajectory, Motion, PiecewisePath, RecordedTrajectory, Trajectory
from spacearm.planner import ConfigurationGoal, PlannerSettings, Problem, plan
from spacearm.proof import certify
from spacearm.robot import load_robot
from support.oracles.coal_shapes import least_distances
from support.oracles.pinocchio_points import joint_frames

FOLDER = os.environ.get("SPACEARM_MBM", "")
FAMILIES = ("bookshelf_small", "bookshelf_tall", "bookshelf_thin", "box", "cage", "table_pick", "table_under_pick")
INSTANTS = 60

pytestmark = pytest.mark.skipif(not FOLDER, reason="SPACEARM_MBM does not name the folder of MotionBenchMaker's problems")


def problem_of(family: str) -> Problem:
    folder = Path(FOLDER)
    fixed = {f"panda_finger_joint{i}": 0.065 for i in (1, 2)}
    robot = load_robot(folder / "panda_spherized.urdf", srdf=folder / "panda.srdf", group="panda_arm", fixed=fixed)
    problem = load_moveit(robot, folder / family / "scene0001.yaml", folder / family / "request0001.yaml")
    return replace(problem, clearance=0.0)  # the cage leaves no 10 mm


def measured(problem: Problem, trajectory: AnyTrajectory) -> float:
    """The least clearance at random instants, by Pinocchio and Coal."""
    u = np.random.default_rng(0).uniform(*trajectory.curve.domain, INSTANTS)
    return float(least_distances(problem.robot, problem.scene, joint_frames(problem.robot, trajectory.curve.sample(u))).min())


@pytest.mark.parametrize("family", FAMILIES)
def test_planned_motions_hold_and_coal_finds_nothing(family: str) -> None:
    problem = problem_of(family)
    found = plan(problem, PlannerSettings(evaluations=3000), rng=0)
    assert found.trajectory is not None
    certificate = certify(problem, found.trajectory)
    assert certificate.holds
    assert certificate.clearance is not None
    assert certificate.evaluations < 500
    assert measured(problem, found.trajectory) >= certificate.clearance


@pytest.mark.parametrize("family", FAMILIES)
def test_straight_lines_through_the_furniture_fail(family: str) -> None:
    problem = problem_of(family)
    assert isinstance(problem.goal, ConfigurationGoal)
    ends = [problem.start, problem.goal.q]
    straight = RecordedTrajectory(problem.robot, PiecewisePath.from_linear([0, 9], ends))
    for trajectory in (Trajectory(problem.robot, Motion(ends)), straight):
        certificate = certify(problem, trajectory, limits=())
        least = measured(problem, trajectory)
        assert certificate.holds == (least > 0)
        assert (certificate.status == "fails") == (least <= 0)
