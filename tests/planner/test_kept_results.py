"""What planning makes once for a robot, a scene or a process: it changes no result, and is there before the first plan."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from spacearm.geometry import Box, Scene, Sphere
from spacearm.planner import Problem
from spacearm.planner.clearance import ClearanceModel, clearance_model
from spacearm.robot import load_robot

ROBOT = load_robot("srs7")
SCENES = [Scene([Sphere((0.5, 0.2, 0.4), 0.1), Box((0.2, 0.1, 3.0))]), Scene([Sphere((0.0, 0.6, 0.5), 0.2)])]


@settings(max_examples=40)
@given(st.data())
def test_clearances_that_were_kept_are_those_of_a_model_made_anew(data: st.DataObject) -> None:
    """A copy of the robot shares nothing that was kept."""
    model = clearance_model(ROBOT, data.draw(st.sampled_from(SCENES)))
    drawn = np.random.default_rng(data.draw(st.integers(0, 99))).uniform(-1.5, 1.5, (5, ROBOT.dof))
    for _ in range(3):
        q = drawn[data.draw(st.lists(st.integers(0, 4), min_size=1, max_size=20))]
        anew = ClearanceModel(replace(ROBOT), model.scene)
        to_obstacles, between = model.measured(q)
        np.testing.assert_array_equal(to_obstacles, anew.to_kernel_obstacles(q))
        np.testing.assert_array_equal(between, anew.between_links(q))
        np.testing.assert_array_equal(model.least(q), np.minimum(to_obstacles.min(axis=(1, 2)), between.min(axis=1)))
        to_obstacles[:], between[:] = np.nan, np.nan  # the caller's own


def test_the_goal_of_a_floating_base_is_looked_at_in_the_same_free_space() -> None:
    q = np.zeros(7)
    problem = Problem(load_robot("servicer7"), SCENES[0], start=q, goal=q, base="floating", clearance=0.0)
    assert problem.at_goal is problem.at_goal
    assert problem.at_goal is not problem.at_start
    assert not problem.at_goal.scene.obstacles


def test_a_problem_imports_what_its_first_plan_needs_and_spacearm_alone_does_not() -> None:
    code = """
import sys
import spacearm as sa
robot = sa.load_robot("srs7")
before = [name in sys.modules for name in ("pinocchio", "coal", "scipy")]
sa.Problem(robot, sa.Scene([]), start=[0.5] * 7, goal=[0.6] * 7)
print(before, [name in sys.modules for name in ("pinocchio", "coal", "numpy.ma", "scipy")])
"""
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert ran.stdout.strip() == "[False, False, False] [True, True, True, False]"
