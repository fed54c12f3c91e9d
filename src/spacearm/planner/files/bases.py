"""How the base of a problem file is held: where it starts, and what is asked of it if it floats."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from spacearm.checks import as_number
from spacearm.errors import ProblemError
from spacearm.momentum import Momentum, base_at_mass_center
from spacearm.momentum.turning import quaternion_of
from spacearm.planner.files.scenes import placed
from spacearm.planner.floating import AttitudeGoal, BaseLimits
from spacearm.planner.problem import Problem
from spacearm.reading import YamlFile
from spacearm.scene import Scene

if TYPE_CHECKING:
    from spacearm.planner.files.schema import BaseGoalModel, BaseLimitsModel, BaseStartModel, ProblemModel

Array = NDArray[np.float64]

_ANGLES = {"final": "degrees", "peak": "degrees", "rate": "degrees/s"}


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
    Problem(problem.robot, Scene(), start=problem.start, goal=problem.goal, **given)
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
