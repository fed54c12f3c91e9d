"""Plans read back: the problem, the motion, and what the file says of them, none of which is believed."""

from __future__ import annotations

import json
import os
from dataclasses import dataclass
from typing import Any, NoReturn

from spacearm.checks import as_transform, require_kind, shown
from spacearm.errors import FileFormatError, ProblemError
from spacearm.momentum import Momentum
from spacearm.motion import AnyTrajectory, Trajectory
from spacearm.motion.plain import trajectory_from_dict
from spacearm.planner.files.plans import KEY, VERSION, problem_hash
from spacearm.planner.floating import AttitudeGoal, BaseLimits
from spacearm.planner.goals import goal_from_dict
from spacearm.planner.problem import Problem
from spacearm.reading import located, read_bytes
from spacearm.records import record_from_dict
from spacearm.robot import Robot
from spacearm.robot.plain import robot_from_dict
from spacearm.scene.plain import scene_from_list

_PROBLEM_KEYS = ("robot", "base", "start", "goal", "obstacles")
_RECORDS: dict[str, type] = {"momentum": Momentum, "base_goal": AttitudeGoal, "base_limits": BaseLimits}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SavedPlan:
    """What a plan file holds.

    Attributes:
        problem: what was planned.
        trajectory: its motion; one that breaks the robot's limits comes as a RecordedTrajectory.
        status: how planning ended, says the file.
        problem_hash: of the problem, says the file; `problem_hash(problem)` is the true one.
        certificate: the file's, as plain values; None if it has none.
    """

    problem: Problem
    trajectory: AnyTrajectory
    status: str
    problem_hash: str
    certificate: dict[str, Any] | None


def load_plan(path: str | os.PathLike[str], problem: Problem | None = None) -> Trajectory:
    """Read back the trajectory of a saved plan. Certify it again before it moves anything.

    Args:
        path: a plan.json.
        problem: what was planned, to be sure that the plan is of this; None: the problem in the file.

    Raises:
        FileFormatError: the file is missing, broken or no plan, holds no motion, or is of another problem.
        ProblemError: its motion breaks the robot's limits.
    """
    if problem is not None:
        require_kind("problem", problem, Problem, ProblemError)
    saved = _read(path)
    robot = _problem(path, saved).robot if problem is None else problem.robot
    if problem is not None and saved["problem"]["hash"] != problem_hash(problem):
        raise FileFormatError(f"{path} is a plan of another problem, expected one of this; give the problem it was made for")
    trajectory = _motion(path, saved, robot, within_limits=True)
    if not isinstance(trajectory, Trajectory):
        raise FileFormatError(f"{path} holds a recorded trajectory, expected a motion; `load_saved_plan` reads both")
    return trajectory


def load_saved_plan(path: str | os.PathLike[str]) -> SavedPlan:
    """Read back a plan with its problem, to certify it again: `certify(saved.problem, saved.trajectory)`.

    Raises:
        FileFormatError: the file is missing, broken or no plan, or holds no motion.
        SpacearmError: a robot, scene, problem or motion that cannot be; the place is named.
    """
    saved = _read(path)
    problem = _problem(path, saved)
    certificate = saved.get("certificate")
    if certificate is not None and not isinstance(certificate, dict):
        raise FileFormatError(f"{path}: certificate is {shown(certificate)}, expected a mapping or null; plan again")
    return SavedPlan(
        problem=problem,
        trajectory=_motion(path, saved, problem.robot, within_limits=False),
        status=saved["status"],
        problem_hash=saved["problem"]["hash"],
        certificate=certificate,
    )


def _read(path: str | os.PathLike[str]) -> dict[str, Any]:
    content = read_bytes(path, what="a plan file")
    try:
        saved = json.loads(content, parse_constant=_no_number)
        json.dumps(saved, ensure_ascii=False).encode()  # half a surrogate pair cannot be printed
    except (ValueError, RecursionError):
        raise FileFormatError(f"{path} is broken, expected a plan file in JSON; plan again") from None
    if not isinstance(saved, dict) or saved.get(KEY) != VERSION or isinstance(saved[KEY], bool):
        raise FileFormatError(f"{path} has no '{KEY}: {VERSION}', expected a plan file; it is something else")
    for key, kind in (("status", str), ("problem", dict)):
        if not isinstance(saved.get(key), kind):
            raise FileFormatError(f"{path} has {key} {shown(saved.get(key))}, expected a plan file in JSON; plan again")
    if not isinstance(saved["problem"].get("hash"), str):
        raise FileFormatError(f"{path} has no hash of its problem, expected a plan file in JSON; plan again")
    if saved.get("motion") is None:
        raise FileFormatError(f"{path} holds no motion (status {saved['status']!r}), expected a plan that was found")
    return saved


def _no_number(word: str) -> NoReturn:
    raise ValueError(word)


def problem_from_dict(values: dict[str, Any]) -> Problem:
    """Make a problem of plain values, the same bit for bit as the one that `problem_as_dict` was given.

    Raises:
        SpacearmError: a robot, scene or problem that cannot be; the place is named.
    """
    for key in _PROBLEM_KEYS:
        if key not in values:
            raise FileFormatError(f"it has no key '{key}', expected {', '.join(_PROBLEM_KEYS)}; plan again")
    if isinstance(values["start"], (dict, str)):
        raise ProblemError(f"start is {shown(values['start'])}, expected a list of numbers")
    return Problem(
        robot_from_dict(values["robot"]),
        scene_from_list(values["obstacles"]),
        start=values["start"],
        goal=goal_from_dict(values["goal"]),
        base=values["base"],
        duration=values.get("duration"),
        notes=values.get("notes", ()),
        **_asked_of_the_base(values),
    )


def _asked_of_the_base(values: dict[str, Any]) -> dict[str, Any]:
    given: dict[str, Any] = {}
    if "base_start" in values:
        given["base_start"] = as_transform("base_start", values["base_start"], ProblemError)
    for key, record in _RECORDS.items():
        if key in values:
            given[key] = record_from_dict(record, values[key], key, ProblemError)
    return given


def _problem(path: object, saved: dict[str, Any]) -> Problem:
    with located(f"{path}: problem"):
        return problem_from_dict(saved["problem"])


def _motion(path: object, saved: dict[str, Any], robot: Robot, *, within_limits: bool) -> AnyTrajectory:
    with located(f"{path}: motion"):
        return trajectory_from_dict(robot, saved["motion"], within_limits=within_limits)
