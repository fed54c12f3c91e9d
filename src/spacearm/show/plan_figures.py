"""The figures of a plan: its path, its joints over time, its clearance, and how a floating base moves."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from spacearm.core.interrupts import unbroken
from spacearm.core.version import version
from spacearm.motion import Trajectory
from spacearm.planner import Plan, PoseGoal, PositionGoal
from spacearm.planner.goals import ConfigurationsGoal, Goal
from spacearm.robot import Robot, forward_kinematics
from spacearm.show.base_figures import figure_base_motion, figure_base_paths
from spacearm.show.drawing import base_frames
from spacearm.show.figure_style import save_figure
from spacearm.show.path_figures import figure_path_2d, figure_path_3d
from spacearm.show.trajectory_figures import figure_clearance, figure_joints

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def save_plan_figures(plan: Plan, folder: Path) -> list[Path]:
    """Draw a plan's trajectory, proven or not, into a folder, as PNG and PDF; return the files.

    Raises:
        OutputError: a file exists, or cannot be written.
    """
    trajectory = plan.trajectory
    if trajectory is None:
        return []
    problem = plan.problem
    robot, scene, goal = problem.robot, problem.scene, problem.goal
    start = problem.start
    target = _target(goal, robot, trajectory)
    title = robot.name if plan.found else f"{robot.name}: not proven"
    drawings: dict[str, Callable[[], Figure]] = {
        "path_2d": lambda: figure_path_2d(trajectory, robot, scene, start=start, goal=target, title=title),
        "path_3d": lambda: figure_path_3d(trajectory, robot, scene, start=start, goal=target, title=title),
        "joints": lambda: figure_joints(trajectory, title=title),
    }
    if robot.shapes and (scene.obstacles or robot.self_pairs):
        drawings["clearance"] = lambda: figure_clearance(trajectory, scene, plan.certificate, title=title)
    if trajectory.base_model.follows_arm:
        drawings["base_motion"] = lambda: figure_base_motion(trajectory, limits=problem.base_limits, title=title)
        drawings["base_paths"] = lambda: figure_base_paths(trajectory, title=title)
    provenance = {"Title": "spacearm plan", "Author": f"spacearm {version()}", "Subject": f"seed {plan.seed}"}
    written: list[Path] = []
    for name, draw in drawings.items():
        with unbroken():
            figure = draw()
        written += save_figure(figure, folder / name, provenance=provenance)
    return written


def _target(goal: Goal, robot: Robot, trajectory: Trajectory) -> NDArray[np.float64]:
    """Return the point (3,) that is drawn as the target [m]; of several configurations, the one nearest to the end.

    A configuration's is where it has the end effector as the base stands at the end.
    """
    if isinstance(goal, (PositionGoal, PoseGoal)):
        return goal.position
    q = goal.q
    if isinstance(goal, ConfigurationsGoal):
        end = trajectory.sample(trajectory.duration).q
        q = goal.q[int(np.argmin(np.linalg.norm(goal.q - end, axis=1)))]
    return (base_frames(trajectory, trajectory.duration) @ forward_kinematics(robot, q))[:3, 3]
