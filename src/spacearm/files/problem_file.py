"""Problem files: a planning problem as YAML. docs/problem_file.md explains every key.

The keys::

    spacearm: 1                # format and version
    robot: zhang2022           # a built-in robot, or the path of a file, relative to this one; or with options:
    robot: {file: arm.urdf, srdf: arm.srdf, group: arm, tip: hand, velocity_limit: 1.0, acceleration_limit: 1.0}
    scene:                     # the obstacles, inertial frame [m]; leave it out for free space
      - {name: client, sphere: {center: [0.5, 0.5, 0.0], radius: 0.1}}
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
    base: floating             # fixed, or floating; by default as the robot says
    base_start: mass_center    # where the base is at the start: with the centre of mass at the inertial origin
    base_start: {position: [0, 0, 1], rpy_deg: [0, 0, 90]}                  #   or there [m]; by default 0, unturned
    base_goal: as_it_was       # of a floating base: how it is to stand at the end
    base_goal: {rpy_deg: [0, 0, 90], tolerance_deg: 0.05}
    base_limits: {peak_deg: 2, rate_deg: 0.5, joint_momentum: 40}           # how little the arm may disturb it
    momentum: {angular: [0, 0, 0.5]}                                        # what base and arm have, and keep
    duration: 60               # of the motion [s]; by default the least
    clearance: 0.02            # that is kept during the whole motion, and proven [m]; by default 0.01
    clearances:                # others, for some pairs
      - {obstacle: client, clearance: 0.05}
      - {link: hand, obstacle: client, clearance: 0.0}
      - {link: forearm, clearance: 0.03}   # or of two links: {links: [upper_arm, hand], clearance: 0.03}
    snap_tolerance: 1.0e-5     # a start or goal so little beyond a limit is set onto it [rad or m]
    planner: {islands: 2}      # any of PlannerSettings
"""

from __future__ import annotations

import math
import os
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from spacearm.core.brief import Brief
from spacearm.core.checks import as_number, shown
from spacearm.core.errors import ProblemError, SettingsError, nearest
from spacearm.core.reading import YamlFile, read_yaml
from spacearm.core.records import one_of, require_settings
from spacearm.core.rotations import quaternion_of
from spacearm.dynamics import Momentum, base_at_mass_center
from spacearm.dynamics.payload import hold
from spacearm.files.scene_file import beside, placed, read_obstacles, read_solid
from spacearm.geometry import Scene
from spacearm.planner.goals import ConfigurationGoal, ConfigurationsGoal, Goal, PoseGoal, PositionGoal
from spacearm.planner.planner_settings import PlannerSettings, require_not_moved
from spacearm.planner.planning import require_timing
from spacearm.planner.problem import AttitudeGoal, BaseLimits, Problem, within_limits
from spacearm.robot.load_robot import builtin_robots, load_robot
from spacearm.robot.model import Robot
from spacearm.swarm import FeasibleFirst, Penalty

if TYPE_CHECKING:
    from spacearm.files.problem_schema import (
        BaseGoalModel,
        BaseLimitsModel,
        BaseStartModel,
        GoalModel,
        PayloadModel,
        ProblemModel,
        RobotModel,
    )


Array = NDArray[np.float64]

_ANGLES = {"final": "degrees", "peak": "degrees", "rate": "degrees/s"}

Given = list[float] | dict[str, float] | str
"""A configuration as a file has it: one number a joint, numbers by joint, or a name."""

_TARGETS: dict[str, tuple[str, ...]] = {
    "configuration": ("tolerance", "tolerance_deg", "shortest"),
    "configuration_deg": ("tolerance", "tolerance_deg", "shortest"),
    "configurations": ("tolerance", "tolerance_deg", "shortest"),
    "configurations_deg": ("tolerance", "tolerance_deg", "shortest"),
    "position": ("tolerance", "frame"),
    "pose": ("position_tolerance", "orientation_tolerance", "orientation_tolerance_deg", "free_axis", "frame"),
}
"""What a goal may aim at, and the keys that may stand beside it."""


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class ProblemFile(Brief):
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
    return problem_of(read_yaml(path, key="spacearm", what="a problem file"))


def problem_of(file: YamlFile) -> ProblemFile:
    """Return the problem and the settings that a file's content means.

    Raises:
        FileFormatError: keys and values that are not those of the format.
        SpacearmError: a robot, scene or problem that cannot be; file and line are named.
    """
    from spacearm.files.problem_schema import ProblemModel

    model = file.parsed(ProblemModel)
    robot = read_robot(file, model.robot)
    obstacles = read_obstacles(file, model.scene)
    start = read_start(file, model, robot)
    goal = read_goal(file, model.goal, robot)
    snap: dict[str, Any] = {"snap_tolerance": model.snap_tolerance}
    with file.at("goal"):  # alone, so that a goal that does not fit is blamed on its line
        bare = Problem(robot, Scene(), start=start, goal=goal, base="fixed", **snap)
    scene, asked = Scene(obstacles), {**with_base(file, model, bare), **snap}
    problem = Problem(robot, scene, start=start, goal=goal, **asked, **_with_clearance(file, model, bare, scene))
    settings = _settings(file, model.planner)
    with file.at("planner", "time_law"):
        require_timing(problem.duration, settings)
    return ProblemFile(problem=problem, settings=settings)


def _with_clearance(file: YamlFile, model: ProblemModel, bare: Problem, scene: Scene) -> dict[str, Any]:
    """Return the clearances as `Problem` takes them; what cannot be is blamed on its line."""
    with file.at("clearance"):
        replace(bare, clearance=model.clearance)
    pairs: list[dict[str, Any]] = []
    for i, entry in enumerate(model.clearances):
        pair = {name: value for name, value in entry if value is not None}
        with file.at("clearances", i):
            replace(bare, scene=scene, clearances=[pair])
        pairs.append(pair)
    return {"clearance": model.clearance, "clearances": pairs}


def read_robot(file: YamlFile, model: RobotModel) -> Robot:
    """Load the robot that a problem file names, and attach its payloads.

    Raises:
        SpacearmError: a robot that cannot be, or something that cannot be a payload; file and line are named.
    """
    with file.at("robot"):
        robot = _loaded(model, file.path.parent)
    for i, payload in enumerate(model.holding or ()):
        with file.at("robot", "holding", i):
            robot = _with_payload(robot, payload, i, file.path.parent)
    return robot


def _loaded(model: RobotModel, directory: Path) -> Robot:
    if (model.name is None) == (model.file is None):
        given = "neither name nor file" if model.name is None else "both name and file"
        raise ProblemError(f"robot has {given}, expected one; built-in names: {', '.join(builtin_robots())}")
    # A name that is not built in but looks like a path is one: `robot: arm.urdf`.
    is_path = model.file is not None or bool(Path(model.name or "").suffix) or "/" in (model.name or "")
    return load_robot(
        beside(directory, model.file or model.name or "") if is_path else model.name or "",
        srdf=None if model.srdf is None else beside(directory, model.srdf),
        joint_limits=None if model.joint_limits is None else beside(directory, model.joint_limits),
        **model.model_dump(exclude={"name", "file", "srdf", "joint_limits", "holding"}),  # the others are called as there
    )


def _with_payload(robot: Robot, payload: PayloadModel, index: int, directory: Path) -> Robot:
    name = payload.name if payload.name is not None else "held" if index == 0 else f"held_{index + 1}"
    return hold(
        robot,
        read_solid(payload, directory, name=""),
        frame=payload.frame,
        pose=placed(payload),
        touching=payload.touching or (),
        name=name,
        mass=payload.mass,
        com=payload.com,
        inertia=payload.inertia,
        density=payload.density,
    )


def read_start(file: YamlFile, model: ProblemModel, robot: Robot) -> Array:
    """Return the start (n,) [rad or m].

    Raises:
        SpacearmError: none is given, or one that the robot does not have; file and line are named.
    """
    with file.at("start" if model.start_deg is None else "start_deg"):
        if model.start is not None and model.start_deg is not None:
            raise ProblemError("both start and start_deg are given, expected one; remove the other")
        if model.start_deg is not None:
            q = _configuration(robot, model.start_deg, "start_deg", degrees=True)
        elif model.start is not None:
            q = _configuration(robot, model.start, "start")
        else:
            raise ProblemError("start is missing; add start: [...] with one number per joint, or start_deg")
        within_limits(robot, q, what="start", tolerance=model.snap_tolerance)
        return q  # as it is given: Problem says what it sets onto a limit


def read_goal(file: YamlFile, model: GoalModel, robot: Robot) -> Goal:
    """Return the goal.

    Raises:
        SpacearmError: no target or several, or one that the robot does not have; file and line are named.
    """
    given = [kind for kind in _TARGETS if getattr(model, kind) is not None]
    with file.at("goal"):
        if len(given) != 1:
            raise ProblemError(f"goal has {' and '.join(given) or 'no target'}, expected one of {', '.join(_TARGETS)}")
    target = given[0]
    beside = {name: value for name, value in model if value is not None and name != target}
    for key in beside:
        if key not in _TARGETS[target]:
            takers = [name for name, keys in _TARGETS.items() if key in keys]
            with file.at("goal", key):
                takes = ", ".join(_TARGETS[target])
                raise ProblemError(
                    f"goal has {key} beside {target}, expected it with {', '.join(takers)}; {target} takes {takes}"
                )
    with file.at("goal", target):
        if target == "pose":
            return _pose_goal(model, beside)
        if target == "position":
            return PositionGoal(model.position, **beside)  # type: ignore[arg-type]
        return _configuration_goal(model, target, beside, robot)


def _pose_goal(model: GoalModel, beside: dict[str, Any]) -> PoseGoal:
    assert model.pose is not None
    if model.pose.q_wxyz is None and model.pose.rpy_deg is None:
        raise ProblemError("pose has no orientation, expected q_wxyz or rpy_deg; for a position alone write position: [...]")
    _tolerance_in_radians(beside, "orientation_tolerance")
    return PoseGoal(placed(model.pose), **beside)


def _configuration_goal(
    model: GoalModel, target: str, beside: dict[str, Any], robot: Robot
) -> ConfigurationGoal | ConfigurationsGoal:
    degrees = target.endswith("_deg")
    if "tolerance_deg" in beside:
        stated = robot.dof_names if isinstance(beside["tolerance_deg"], list) else ()
        _require_turning(robot, stated, "tolerance_deg")
    _tolerance_in_radians(beside, "tolerance")
    value = getattr(model, target)
    if target.startswith("configurations"):
        rows = [_configuration(robot, row, f"{target}[{i}]", degrees=degrees) for i, row in enumerate(value)]
        lengths = {len(row) for row in rows}
        if len(lengths) > 1:
            raise ProblemError(
                f"{target} has rows of {min(lengths)} and of {max(lengths)} numbers, expected {robot.dof} in each"
            )
        return ConfigurationsGoal(np.reshape(rows, (len(rows), -1) if rows else (0, robot.dof)), **beside)
    return ConfigurationGoal(_configuration(robot, value, target, degrees=degrees), **beside)


def _tolerance_in_radians(beside: dict[str, Any], key: str) -> None:
    """Put a tolerance in degrees in the place of the one in radians."""
    if f"{key}_deg" in beside:
        if key in beside:
            raise ProblemError(f"both {key} and {key}_deg are given, expected one; remove the other")
        given = beside.pop(f"{key}_deg")
        if not isinstance(given, list):
            as_number(f"{key}_deg", given, ProblemError, at_least=0, unit="degrees")
        beside[key] = np.radians(given)


def _configuration(robot: Robot, given: Given, key: str, *, degrees: bool = False) -> Array:
    """Put together q (n,) [rad or m] from what the file gives."""
    if isinstance(given, str):
        return robot.configuration(given)
    q = _by_name(robot, given, key) if isinstance(given, dict) else np.array(given, dtype=np.float64)
    if not degrees:
        return q
    _require_turning(robot, given if isinstance(given, dict) else robot.dof_names, key)
    return np.radians(q)


def _require_turning(robot: Robot, stated: Any, key: str) -> None:
    slides = [name for i, name in enumerate(robot.dof_names) if robot.is_prismatic(i) and name in stated]
    if slides:
        plain = key.replace("_deg", "")
        raise ProblemError(f"{key} gives degrees to joint '{slides[0]}', which is prismatic; use {plain} [rad or m]")


def _by_name(robot: Robot, values: dict[str, float], key: str) -> Array:
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


def with_base(file: YamlFile, model: ProblemModel, problem: Problem) -> dict[str, Any]:
    """Return what a problem file says of the base and of the time, as `Problem` takes it.

    Args:
        file: the file.
        model: what it holds.
        problem: its robot, start and goal, with the base fixed at the origin.

    Raises:
        SpacearmError: what cannot be; file and line are named.
    """
    base = problem.robot.base if model.base is None else model.base
    with file.at("robot" if model.base is None else "base"):
        given = _checked(problem, {"base": base})
    # One after the other, so that each is blamed on its own line: with a duration first, which momentum needs.
    if model.base_start is not None:
        with file.at("base_start"):
            given = _checked(problem, {**given, "base_start": _base_start(model.base_start, problem)})
    if model.duration is not None:
        with file.at("duration"):
            given = _checked(problem, {**given, "duration": model.duration})
    if model.momentum is not None:
        stated = {key: value for key, value in model.momentum if value is not None}
        with file.at("momentum"):
            given = _checked(problem, {**given, "momentum": Momentum(**stated)})
    if model.base_goal is not None:
        with file.at("base_goal"):
            given = _checked(problem, {**given, "base_goal": _base_goal(model.base_goal, given)})
    if model.base_limits is not None:
        with file.at("base_limits"):
            given = _checked(problem, {**given, "base_limits": _base_limits(model.base_limits)})
    return given


def _checked(problem: Problem, given: dict[str, Any]) -> dict[str, Any]:
    replace(problem, **given)
    return given


def _base_start(model: BaseStartModel, problem: Problem) -> Array:
    T = placed(model)
    if not model.mass_center:
        return T
    if model.position is not None:
        raise ProblemError("both position and mass_center are given, expected one; remove the other")
    return base_at_mass_center(problem.robot, problem.start, quaternion_of(T[:3, :3]))


def _base_goal(model: BaseGoalModel, given: dict[str, Any]) -> AttitudeGoal:
    attitudes = [key for key in ("q_wxyz", "rpy_deg", "as_it_was") if getattr(model, key) not in (None, False)]
    if len(attitudes) != 1:
        said = " and ".join(attitudes) or "no attitude"
        raise ProblemError(f"base_goal has {said}, expected one of q_wxyz, rpy_deg, as_it_was")
    if model.as_it_was:
        attitude = quaternion_of(given.get("base_start", np.eye(4))[:3, :3])
    else:
        attitude = model.q_wxyz if model.q_wxyz is not None else quaternion_of(placed(model)[:3, :3])
    tolerance = _in_radians(model, "tolerance")
    return AttitudeGoal(attitude) if tolerance is None else AttitudeGoal(attitude, tolerance)


def _base_limits(model: BaseLimitsModel) -> BaseLimits:
    angles = {name: _in_radians(model, name, unit) for name, unit in _ANGLES.items()}
    return BaseLimits(**angles, joint_momentum=model.joint_momentum)


def _in_radians(model: Any, key: str, unit: str = "degrees") -> float | None:
    """Return an angle that may be given in degrees instead."""
    plain, degrees = getattr(model, key), getattr(model, f"{key}_deg")
    if plain is not None and degrees is not None:
        raise ProblemError(f"both {key} and {key}_deg are given, expected one; remove the other")
    if degrees is None:
        return plain
    return math.radians(as_number(f"{key}_deg", degrees, ProblemError, above=0, unit=unit))


def _settings(file: YamlFile, given: dict[str, Any]) -> PlannerSettings:
    values = {}
    for key, value in given.items():
        with file.at("planner", key):
            require_not_moved(key)
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
