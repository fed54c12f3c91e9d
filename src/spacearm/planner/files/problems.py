"""Problem files: a planning problem as YAML. docs/problem_file.md explains every key.

The keys::

    spacearm: 1                # format and version
    robot: zhang2022           # a built-in robot, or the path of a file, relative to this one; or with options:
    robot: {file: arm.urdf, srdf: arm.srdf, group: arm, tip: hand, velocity_limit: 1.0, acceleration_limit: 1.0}
    scene:                     # the obstacles, inertial frame [m]; leave it out for free space
      - sphere: {center: [0.5, 0.5, 0.0], radius: 0.1}
      - capsule: {a: [0, 0.9, -0.5], b: [0, 0.9, -0.3], radius: 0.02}
      - box: {size: [0.1, 0.1, 0.1], position: [-0.5, 0.5, 0.5], rpy_deg: [0, 0, 45]}
      - cylinder: {radius: 0.1, length: 0.3, position: [-0.5, 0.5, -0.5]}
      - half_space: {normal: [0, 0, 1], point: [0, 0, -1]}
    start: [0, 0, 0, 0, 0, 0, 0]       # joint positions [rad or m], in the robot's order
    start: {elbow: 1.2}                #   or by joint; those not named are 0
    start: ready                       #   or the name of one of the robot's configurations
    start_deg: [0, 0, 0, 90, 0, 0, 0]  #   or in degrees, instead of `start`
    goal: {configuration: [0, 0, 0, 1, 0, 0, 0]}           # written like start; or configuration_deg
    goal: {configurations: [[0, 0, 0, 1, 0, 0, 0], {elbow: 2}]}         #   any of several
    goal: {position: [0.7, 0.3, 0.0], tolerance: 0.001}    #   or a point for the end effector [m]
    goal: {pose: {position: [0.7, 0.3, 0.0], rpy_deg: [0, 0, 0]}, orientation_tolerance_deg: 1}     #   or a pose
    base: floating             # how the base is held: fixed, or floating; by default as the robot says
    base_start: mass_center    # where the base is at the start: with the centre of mass at the inertial origin
    base_start: {position: [0, 0, 1], rpy_deg: [0, 0, 90]}                  #   or there [m]; by default 0, unturned
    base_goal: as_it_was       # of a floating base: how it is to stand at the end
    base_goal: {rpy_deg: [0, 0, 90], tolerance_deg: 0.05}
    base_limits: {peak_deg: 2, rate_deg: 0.5, joint_momentum: 40}           # how little the arm may disturb it
    momentum: {angular: [0, 0, 0.5]}                                        # what base and arm have, and keep
    duration: 60               # of the motion [s]; by default the least
    planner: {islands: 2}      # any of PlannerSettings
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import Any

from spacearm.checks import shown
from spacearm.errors import SettingsError
from spacearm.planner.files.bases import with_base
from spacearm.planner.files.goals import read_goal, read_start
from spacearm.planner.files.robots import read_robot
from spacearm.planner.files.scenes import read_obstacles
from spacearm.planner.problem import Problem
from spacearm.planner.search import require_timing
from spacearm.planner.settings import PlannerSettings
from spacearm.reading import YamlFile, read_yaml
from spacearm.scene import Scene
from spacearm.settings import one_of, require_settings
from spacearm.swarm import FeasibleFirst, Penalty


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
    from spacearm.planner.files.schema import ProblemModel

    model = file.parsed(ProblemModel)
    robot = read_robot(file, model.robot)
    obstacles = read_obstacles(file, model.scene)
    start = read_start(file, model, robot)
    goal = read_goal(file, model.goal, robot)
    with file.at("goal"):  # alone, so that a goal that does not fit is blamed on its line
        bare = Problem(robot, Scene(), start=start, goal=goal, base="fixed")
    problem = Problem(robot, Scene(obstacles), start=start, goal=goal, **with_base(file, model, bare))
    settings = _settings(file, model.planner)
    with file.at("planner", "time_law"):
        require_timing(problem, settings)
    return ProblemFile(problem=problem, settings=settings)


def _settings(file: YamlFile, given: dict[str, Any]) -> PlannerSettings:
    values = {}
    for key, value in given.items():
        with file.at("planner", key):
            require_settings(PlannerSettings, {key: value})
            if key in ("weights", "swarm") and not isinstance(value, dict):
                raise SettingsError(f"{key} is {shown(value)}, expected a mapping (key: value)")
            values[key] = _as_settings_take(value)
    with file.at("planner", *_at_fault(values)):
        return PlannerSettings(**values)


def _at_fault(values: dict[str, Any]) -> tuple[str, ...]:
    """Return the key that is refused on its own, for the line in the message."""
    for key, value in values.items():
        try:
            PlannerSettings(**{"evaluations": 1, key: value} if value is None else {key: value})
        except SettingsError:
            return (key,)
    return ()


def _as_settings_take(value: Any, depth: int = 0) -> Any:
    """Make tuples of lists, and a record of what weighs constraints; the rest the settings themselves take or refuse."""
    if depth > 2:  # nothing in the settings is as deep
        return value
    if isinstance(value, list):
        return tuple(value)
    if not isinstance(value, dict):
        return value
    values = {key: _as_settings_take(inner, depth + 1) for key, inner in value.items()}
    if isinstance(values.get("constraints"), dict):
        values["constraints"] = _constraints(values["constraints"])
    return values


def _constraints(given: dict[str, Any]) -> Any:
    values = dict(given)
    kinds = {kind.__name__: kind for kind in (FeasibleFirst, Penalty)}
    kind = one_of("constraints: kind", values.pop("kind", "FeasibleFirst"), tuple(kinds))
    require_settings(kinds[kind], values)
    return kinds[kind](**values)
