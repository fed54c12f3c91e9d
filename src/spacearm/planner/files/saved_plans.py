"""Plans read back: the problem, the motion, and what the file says of them, none of which is believed."""

from __future__ import annotations

import json
import os
from dataclasses import dataclass, fields
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from spacearm.checks import as_transform, require_kind, shown
from spacearm.errors import FileFormatError, ProblemError
from spacearm.momentum import Momentum
from spacearm.motion import AnyTrajectory, Trajectory
from spacearm.motion.plain import trajectory_from_dict
from spacearm.planner.files.plans import KEY, VERSION, problem_hash
from spacearm.planner.floating import AttitudeGoal, BaseLimits
from spacearm.planner.goals import goal_from_dict
from spacearm.planner.problem import Problem
from spacearm.proof.certificate import CERTIFICATE_KEY, CERTIFICATE_VERSION
from spacearm.reading import located, read_bytes, require_version
from spacearm.records import record_from_dict
from spacearm.robot import Robot
from spacearm.robot.plain import robot_from_dict
from spacearm.scene.plain import scene_from_list

Array = NDArray[np.float64]

_WHAT = "a plan file in JSON"


@dataclass(frozen=True, slots=True, kw_only=True)
class _PlanValues:
    """Those keys of a plan file that are read back."""

    status: str
    problem: dict[str, Any]
    motion: dict[str, Any] | None = None
    certificate: dict[str, Any] | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class _ProblemValues:
    """The keys of a problem in a plan file."""

    hash: str = ""
    robot: dict[str, Any]
    base: str
    base_start: Array | None = None
    momentum: Momentum | None = None
    base_goal: AttitudeGoal | None = None
    base_limits: BaseLimits | None = None
    duration: float | None = None
    notes: tuple[str, ...] = ()
    start: Array
    goal: dict[str, Any]
    obstacles: list[Any]


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
    if problem is not None and saved.problem["hash"] != problem_hash(problem):
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
    return SavedPlan(
        problem=problem,
        trajectory=_motion(path, saved, problem.robot, within_limits=False),
        status=saved.status,
        problem_hash=saved.problem["hash"],
        certificate=saved.certificate,
    )


def _read(path: str | os.PathLike[str]) -> _PlanValues:
    content = read_bytes(path, what=_WHAT)
    try:
        given = json.loads(content, parse_constant=_no_number)
        json.dumps(given, ensure_ascii=False).encode()  # half a surrogate pair cannot be printed
    except (ValueError, RecursionError):
        raise FileFormatError(f"{path} is broken, expected {_WHAT}; plan again") from None
    if not isinstance(given, dict) or KEY not in given:
        raise FileFormatError(f"{path} has no '{KEY}: {VERSION}', expected {_WHAT}; it is something else")
    require_version(given[KEY], VERSION, path, key=KEY)
    known = {field.name for field in fields(_PlanValues)}
    with located(path):
        saved = record_from_dict(_PlanValues, {key: given[key] for key in known & given.keys()}, "", FileFormatError)
        if not isinstance(saved.problem.get("hash"), str):
            raise FileFormatError(f"problem.hash is {shown(saved.problem.get('hash'))}, expected text; plan again")
        if saved.certificate is not None:
            require_version(saved.certificate.get(CERTIFICATE_KEY, 1), CERTIFICATE_VERSION, "certificate", key=CERTIFICATE_KEY)
        if saved.motion is None:
            raise FileFormatError(f"the file holds no motion (status {saved.status!r}), expected a plan that was found")
    return saved


def _no_number(word: str) -> NoReturn:
    raise ValueError(word)


def problem_from_dict(values: dict[str, Any]) -> Problem:
    """Make a problem of plain values, the same bit for bit as the one that `problem_as_dict` was given.

    Raises:
        SpacearmError: a robot, scene or problem that cannot be; the place is named.
    """
    given = record_from_dict(_ProblemValues, values, "", FileFormatError)
    asked = {key: getattr(given, key) for key in ("base", "momentum", "base_goal", "base_limits", "duration", "notes")}
    return Problem(
        robot_from_dict(given.robot),
        scene_from_list(given.obstacles),
        start=given.start,
        goal=goal_from_dict(given.goal),
        base_start=None if given.base_start is None else as_transform("base_start", given.base_start, ProblemError),
        **{key: value for key, value in asked.items() if value is not None},
    )


def _problem(path: object, saved: _PlanValues) -> Problem:
    with located(f"{path}: problem"):
        return problem_from_dict(saved.problem)


def _motion(path: object, saved: _PlanValues, robot: Robot, *, within_limits: bool) -> AnyTrajectory:
    with located(f"{path}: motion"):
        return trajectory_from_dict(robot, saved.motion, within_limits=within_limits)
