"""A problem as the plain values of a problem file, for one that comes from a plan; and in what two problems differ."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spacearm.core.checks import shown
from spacearm.core.errors import OutputError
from spacearm.core.rotations import quaternion_of
from spacearm.files.plan_file import problem_as_dict
from spacearm.planner.goals import ConfigurationsGoal, PoseGoal, PositionGoal
from spacearm.planner.problem import Problem
from spacearm.robot import Robot
from spacearm.robot.load_robot import builtin_robots

Array = NDArray[np.float64]

_SAME = 1e-9  # [m or rad] a value that is read back may differ by so much: pieces of meshes are placed anew
_NAMED = {"momentum": ("linear", "angular"), "base_limits": ("final", "peak", "rate", "joint_momentum")}


def values_of_problem(problem: Problem, goal_wxyz: Array, budget: dict[str, Any]) -> dict[str, Any]:
    """Return a problem as the values of a problem file.

    Args:
        problem: as a plan has it.
        goal_wxyz: (4,) the orientation of a goal pose.
        budget: settings of the planner; empty: none.

    Raises:
        OutputError: a problem file cannot tell its robot or an obstacle.
    """
    values = problem_as_dict(problem)
    out: dict[str, Any] = {"spacearm": 1, "robot": _named_robot(problem.robot)}
    if values["obstacles"]:
        out["scene"] = [_obstacle(one) for one in values["obstacles"]]
    out |= {"start": values["start"], "goal": _goal(problem, goal_wxyz), "base": problem.base, "clearance": problem.clearance}
    if problem.clearances:
        out["clearances"] = values["clearances"]
    if "base_start" in values:
        out["base_start"] = _pose(problem.base_start)
    for key, names in _NAMED.items():
        if key in values:
            out[key] = {name: values[key][name] for name in names if values[key].get(name) is not None}
    if problem.base_goal is not None:
        goal = problem.base_goal
        out["base_goal"] = {"q_wxyz": goal.attitude_wxyz.tolist(), "tolerance": goal.tolerance}
    out |= {key: values[key] for key in ("duration", "snap_tolerance") if key in values}
    return out | ({"planner": budget} if budget else {})


def _named_robot(robot: Robot) -> str:
    if robot.source in builtin_robots():
        return robot.source
    raise OutputError(
        f"robot '{robot.name}' was read from {shown(robot.source)}, expected a built-in one: a problem file names its robot, "
        "and a plan does not say how that was read; open the problem file, or save the plan"
    )


def _goal(problem: Problem, wxyz: Array) -> dict[str, Any]:
    goal = problem.goal
    if isinstance(goal, PositionGoal):
        return {"position": goal.position.tolist(), "tolerance": goal.tolerance, "frame": goal.frame}
    if isinstance(goal, PoseGoal):
        near = {"position_tolerance": goal.position_tolerance, "orientation_tolerance": goal.orientation_tolerance}
        axis = {} if goal.free_axis is None else {"free_axis": goal.free_axis.tolist()}
        at = {"position": goal.position.tolist(), "q_wxyz": wxyz.tolist()}
        return {"pose": at, **near, **axis, "frame": goal.frame}
    key = "configurations" if isinstance(goal, ConfigurationsGoal) else "configuration"
    tolerance = goal.tolerance.tolist() if isinstance(goal.tolerance, np.ndarray) else goal.tolerance
    return {key: goal.q.tolist(), "tolerance": tolerance, **({"shortest": True} if goal.shortest else {})}


def _obstacle(item: dict[str, Any]) -> dict[str, Any]:
    ((kind, values),) = item.items()
    values = dict(values)
    name = values.pop("name", "")
    if kind in ("sphere_set", "polytope_set"):
        raise OutputError(
            f"obstacle {shown(name)} is made of pieces of a mesh or a point cloud, which a problem file names by their file; "
            "open the problem file, or save the plan"
        )
    if "pose" in values:
        values |= _pose(np.array(values.pop("pose")))
    return {**({"name": name} if name else {}), kind: values}


def _pose(T: Array) -> dict[str, Any]:
    return {"position": T[:3, 3].tolist(), "q_wxyz": quaternion_of(T[:3, :3]).tolist()}


def difference(found: Problem, wanted: Problem) -> str:
    """Return the first value, by its place, in which two problems differ by more than rounding; "" if there is none."""
    return _difference(_compared(found), _compared(wanted), "")


def _compared(problem: Problem) -> dict[str, Any]:
    values = problem_as_dict(problem)
    values.pop("notes", None)
    values["robot"] = {key: value for key, value in values["robot"].items() if key not in ("source", "notes")}
    for item in values["obstacles"]:
        for shape in item.values():
            shape.pop("notes", None)
    return values


def _difference(found: Any, wanted: Any, place: str) -> str:
    if isinstance(found, dict) and isinstance(wanted, dict) and found.keys() == wanted.keys():
        parts = [(f"{place}.{key}".lstrip("."), found[key], wanted[key]) for key in wanted]
    elif isinstance(found, (list, tuple)) and isinstance(wanted, (list, tuple)) and len(found) == len(wanted):
        parts = [(f"{place}[{i}]", *pair) for i, pair in enumerate(zip(found, wanted, strict=True))]
    else:
        return "" if _is_same(found, wanted) else place or "it"
    return next((where for name, one, other in parts if (where := _difference(one, other, name))), "")


def _is_same(found: object, wanted: object) -> bool:
    if isinstance(found, bool) or isinstance(wanted, bool):
        return found is wanted
    if isinstance(found, (int, float)) and isinstance(wanted, (int, float)):
        return math.isclose(found, wanted, rel_tol=_SAME, abs_tol=_SAME)
    return found == wanted
