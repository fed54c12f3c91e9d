"""Where the motion of a problem file begins and ends."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from spacearm.checks import as_number
from spacearm.errors import ProblemError, nearest
from spacearm.planner.files.scenes import placed
from spacearm.planner.goals import ConfigurationGoal, ConfigurationsGoal, Goal, PoseGoal, PositionGoal
from spacearm.planner.problem import within_limits
from spacearm.reading import YamlFile
from spacearm.robot.model import Robot

if TYPE_CHECKING:
    from spacearm.planner.files.schema import GoalModel, ProblemModel

Array = NDArray[np.float64]
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
        within_limits(robot, q, what="start")
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
    _in_radians(beside, "orientation_tolerance")
    return PoseGoal(placed(model.pose), **beside)


def _configuration_goal(
    model: GoalModel, target: str, beside: dict[str, Any], robot: Robot
) -> ConfigurationGoal | ConfigurationsGoal:
    degrees = target.endswith("_deg")
    if "tolerance_deg" in beside:
        stated = robot.dof_names if isinstance(beside["tolerance_deg"], list) else ()
        _require_turning(robot, stated, "tolerance_deg")
    _in_radians(beside, "tolerance")
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


def _in_radians(beside: dict[str, Any], key: str) -> None:
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
