"""Problem files: a planning problem as YAML.

Key by key::

    spacearm: 1                # format and version
    robot: zhang2022           # a built-in robot, or the path of a file, relative to this one
    robot:                     #   or with options:
      file: arm.urdf           #   the path, or `name:` for a built-in robot
      tip: hand                #   the link that is the end effector
      velocity_limit: 1.0      #   no joint is to be faster [rad/s or m/s]
      acceleration_limit: 1.0  #   likewise [rad/s^2 or m/s^2]
      collision: urdf          #   where the envelope is from: urdf or none
    scene:                     # the obstacles; leave it out for free space
      - sphere: {center: [0.5, 0.5, 0.0], radius: 0.1}     # [m]
    start: [0, 0, 0, 0, 0, 0, 0]       # joint positions [rad or m], in the robot's order
    start: {elbow: 1.2}                #   or by joint; those not named are 0
    start_deg: [0, 0, 0, 90, 0, 0, 0]  #   or in degrees, either way, instead of `start`
    goal: {configuration: [0, 0, 0, 1, 0, 0, 0]}           # written like start; or configuration_deg
    goal: {position: [0.7, 0.3, 0.0]}                      #   or a point for the end effector [m]
    goal: {position: [0.7, 0.3, 0.0], tolerance: 0.001, frame: hand}   # [m]; the tip is the default frame
    base: fixed                # optional: fixed
    planner: {restarts: 8}     # optional: any of PlannerSettings
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from spacearm.errors import ProblemError, nearest
from spacearm.planner.goals import ConfigurationGoal, Goal, PositionGoal
from spacearm.planner.problem import Problem, within_limits
from spacearm.planner.settings import PlannerSettings
from spacearm.reading import YamlFile, read_yaml
from spacearm.robot.load import builtin_robots, load_robot
from spacearm.robot.model import Robot
from spacearm.scene import Scene, Sphere
from spacearm.settings import require_settings

if TYPE_CHECKING:
    from spacearm.planner.problem_schema import GoalModel, ObstacleModel, ProblemModel, RobotModel


@dataclass(frozen=True, slots=True, kw_only=True)
class ProblemFile:
    """What a problem file holds.

    Attributes:
        problem: the problem.
        settings: of the planner.
    """

    problem: Problem
    settings: PlannerSettings


def load_problem(path: str | os.PathLike[str]) -> Problem:
    """Read a problem from a YAML file.

    Args:
        path: the file; the module's docstring has its format.

    Raises:
        FileFormatError: no such file, no YAML, or keys and values that are not those of the format.
        SpacearmError: a robot, scene or problem that cannot be; file and line are named.
    """
    return load_problem_file(path).problem


def load_problem_file(path: str | os.PathLike[str]) -> ProblemFile:
    """Read a problem and the planner's settings beside it from a YAML file.

    Args:
        path: the file; the module's docstring has its format.

    Raises:
        FileFormatError: no such file, no YAML, or keys and values that are not those of the format.
        SpacearmError: a robot, scene or problem that cannot be; file and line are named.
    """
    file = read_yaml(path, key="spacearm", what="a problem file")
    from spacearm.planner.problem_schema import ProblemModel

    model = file.parsed(ProblemModel)
    with file.at("robot"):
        robot = _robot(model.robot, Path(path).parent)
    obstacles = []
    for i, obstacle in enumerate(model.scene):
        with file.at("scene", i):
            obstacles.append(_obstacle(obstacle))
    start = _start(file, model, robot)
    with file.at("goal"):
        goal = _goal(model.goal, robot)
        Problem(robot, Scene(), start=start, goal=goal)  # so that a goal that does not fit is blamed on its line
    with file.at("base"):
        problem = Problem(robot, Scene(obstacles), start=start, goal=goal, base=model.base)  # type: ignore[arg-type]
    with file.at("planner"):
        return ProblemFile(problem=problem, settings=_settings(model.planner))


def _settings(given: dict[str, Any]) -> PlannerSettings:
    require_settings(PlannerSettings, given)
    return PlannerSettings(**given)


def _robot(robot: RobotModel, directory: Path) -> Robot:
    if (robot.name is None) == (robot.file is None):
        given = "neither name nor file" if robot.name is None else "both name and file"
        raise ProblemError(f"robot has {given}, expected one; built-in names: {', '.join(builtin_robots())}")
    # A name that is not built in but looks like a path is one: `robot: arm.urdf`.
    is_path = robot.file is not None or bool(Path(robot.name or "").suffix) or "/" in (robot.name or "")
    source = directory / Path(robot.file or robot.name or "").expanduser() if is_path else robot.name or ""
    return load_robot(
        source,
        tip=robot.tip,
        velocity_limit=robot.velocity_limit,
        acceleration_limit=robot.acceleration_limit,
        collision=robot.collision,
    )


def _obstacle(obstacle: ObstacleModel) -> Sphere:
    return Sphere(center=obstacle.sphere.center, radius=obstacle.sphere.radius)  # type: ignore[arg-type]


def _start(file: YamlFile, model: ProblemModel, robot: Robot) -> NDArray[np.float64]:
    with file.at("start" if model.start_deg is None else "start_deg"):
        if model.start is None and model.start_deg is None:
            raise ProblemError("start is missing; add start: [...] with one number per joint, or start_deg")
        q = _configuration(robot, model.start, model.start_deg, "start")
        return within_limits(robot, q, what="start")


def _goal(goal: GoalModel, robot: Robot) -> Goal:
    kinds = ("configuration", "configuration_deg", "position")
    given = [kind for kind in kinds if getattr(goal, kind) is not None]
    if len(given) != 1:
        raise ProblemError(f"goal has {' and '.join(given) or 'no target'}, expected one of {', '.join(kinds)}")
    if goal.position is None:
        if goal.tolerance is not None or goal.frame is not None:
            raise ProblemError("goal has tolerance or frame beside a configuration, expected them with a position; drop them")
        return ConfigurationGoal(_configuration(robot, goal.configuration, goal.configuration_deg, "configuration"))
    tolerance = {} if goal.tolerance is None else {"tolerance": goal.tolerance}
    return PositionGoal(goal.position, frame=goal.frame, **tolerance)  # type: ignore[arg-type]


def _configuration(
    robot: Robot,
    plain: list[float] | dict[str, float] | None,
    degrees: list[float] | dict[str, float] | None,
    key: str,
) -> NDArray[np.float64]:
    """Put together q (n,) [rad or m] from what the file gives: a list or a mapping, plain or in degrees."""
    if plain is not None and degrees is not None:
        raise ProblemError(f"both {key} and {key}_deg are given, expected one; remove the other")
    given = plain if degrees is None else degrees
    q = _by_name(robot, given, key) if isinstance(given, dict) else np.array(given, dtype=np.float64)
    if degrees is None:
        return q
    stated = degrees if isinstance(degrees, dict) else robot.dof_names
    slides = [name for i, name in enumerate(robot.dof_names) if robot.is_prismatic(i) and name in stated]
    if slides:
        raise ProblemError(f"{key}_deg gives degrees to joint '{slides[0]}', which is prismatic; use {key} [rad or m]")
    return np.radians(q)


def _by_name(robot: Robot, values: dict[str, float], key: str) -> NDArray[np.float64]:
    for name in values:
        if name not in robot.dof_names:
            known = nearest(name, robot.dof_names)
            raise ProblemError(f"{key} names joint '{name}', which robot '{robot.name}' does not have; {known}")
    for i, name in enumerate(robot.dof_names):
        if name not in values and not robot.lower[i] <= 0 <= robot.upper[i]:
            raise ProblemError(
                f"{key} does not name joint '{name}', and 0 is outside its limits {robot.lower[i]:.4g} to "
                f"{robot.upper[i]:.4g}; give it a value"
            )
    return np.array([values.get(name, 0.0) for name in robot.dof_names])
