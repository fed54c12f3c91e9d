"""Plans on disk: JSON with everything needed to run, check and repeat them, and nothing else is needed.

Keys: `spacearm-plan` (version), `status`, `message`, `problem` (robot, base, start, goal and obstacles in full, as plain
values; and a SHA-256 `hash` of them), `seed`, `settings`, `motion` (`control_points` of the clamped quintic spline,
`duration_s`, `time_law`, and of a base that is not fixed at the origin `base`, `base_start`, `momentum`), `base` (what the
motion does to a floating one), `fitness`, `margins` (`asked_m`, and `lowered`: the pairs that begin or end too near for it,
with the margin that was asked of them instead), `goals`, `goal_search`, `ends`, `history`, `certificate`. What is infinite,
as a clearance without obstacles, is null. Timings are left out: the same search gives the same bytes.
"""

from __future__ import annotations

import csv
import io
import json
import math
import os
from collections.abc import Iterator
from dataclasses import dataclass, fields
from typing import Any, NoReturn

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spacearm.core.checks import as_transform, as_whole, require_kind, shown
from spacearm.core.errors import FileFormatError, ProblemError, SettingsError
from spacearm.core.output import require_writable, write_new, write_out
from spacearm.core.reading import located, read_bytes, require_version
from spacearm.core.records import as_dict, record_as_dict, record_from_dict
from spacearm.dynamics import Momentum
from spacearm.files.base_columns import BASE_COLUMNS, TIP_COLUMNS
from spacearm.files.written_rows import rows_at, rows_of
from spacearm.geometry.scene import scene_as_list, scene_from_list
from spacearm.motion import AnyTrajectory, Trajectory
from spacearm.motion.recorded import require_trajectory
from spacearm.motion.trajectory_values import trajectory_as_dict, trajectory_from_dict
from spacearm.planner.clearance import Margins
from spacearm.planner.goals import goal_as_dict, goal_from_dict
from spacearm.planner.plan_result import Plan
from spacearm.planner.problem import AttitudeGoal, BaseLimits, Problem
from spacearm.proof.certificate import CERTIFICATE_KEY, CERTIFICATE_VERSION, canonical, digest
from spacearm.robot import Robot
from spacearm.robot.model import robot_as_dict, robot_from_dict

KEY = "spacearm-plan"
VERSION = 1
_SAMPLES = 201


def plan_as_dict(plan: Plan) -> dict[str, Any]:
    """Return a plan as plain values; see the module for the keys."""
    search = plan.goal_search
    return _without_infinite(
        {
            KEY: VERSION,
            "status": plan.status,
            "message": plan.message,
            "problem": {"hash": problem_hash(plan.problem), **problem_as_dict(plan.problem)},
            "seed": plan.seed,
            "settings": as_dict(plan.settings),
            "motion": None if plan.trajectory is None else trajectory_as_dict(plan.trajectory),
            **({} if plan.base is None else {"base": record_as_dict(plan.base)}),
            "fitness": plan.fitness,
            **({} if plan.margins is None else {"margins": _margins_as_dict(plan.margins)}),
            "goals": plan.goals.tolist(),
            "goal_search": None
            if search is None
            else {"searches": search.searches, "reached": search.reached, "in_collision": search.in_collision},
            "ends": record_as_dict(plan.ends),
            "history": [
                {key: value for key, value in record_as_dict(improvement).items() if key != "seconds"}
                for improvement in plan.history
            ],
            "evaluations": plan.evaluations,
            "proofs": plan.proofs,
            "interrupted": plan.interrupted,
            "certificate": None if plan.certificate is None else plan.certificate.as_dict(),
        }
    )


def _without_infinite(value: Any) -> Any:
    """Return plain values with null for what JSON has no number for."""
    if isinstance(value, dict):
        return {key: _without_infinite(entry) for key, entry in value.items()}
    if isinstance(value, list):
        return [_without_infinite(entry) for entry in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _margins_as_dict(margins: Margins) -> dict[str, Any]:
    lowered = [
        {"link": near.link, "other": near.other, "clearance_m": near.clearance, "used_m": near.used} for near in margins.lowered
    ]
    return {"asked_m": margins.asked, "lowered": lowered}


def problem_as_dict(problem: Problem) -> dict[str, Any]:
    """Return a problem as plain values, from which it can be made again bit for bit.

    What is not asked of the base is left out, so that problems written before bases could float keep their hashes.
    """
    return {
        "robot": robot_as_dict(problem.robot),
        "base": problem.base,
        **_asked_of_the_base(problem),
        **({"notes": list(problem.notes)} if problem.notes else {}),
        "start": problem.start.tolist(),
        "goal": goal_as_dict(problem.goal),
        "obstacles": scene_as_list(problem.scene),
    }


def _asked_of_the_base(problem: Problem) -> dict[str, Any]:
    given: dict[str, Any] = {}
    if not np.array_equal(problem.base_start, np.eye(4)):
        given["base_start"] = problem.base_start.tolist()
    if not problem.momentum.is_zero:
        given["momentum"] = record_as_dict(problem.momentum)
    if problem.base_goal is not None:
        given["base_goal"] = record_as_dict(problem.base_goal)
    if problem.base_limits.any:
        given["base_limits"] = record_as_dict(problem.base_limits)
    if problem.duration is not None:
        given["duration"] = problem.duration
    return given


def problem_hash(problem: Problem) -> str:
    """Return the SHA-256 of a problem's values; where its robot was read from does not matter."""
    return digest(values_that_count(problem))


def values_that_count(problem: Problem) -> dict[str, Any]:
    """Return a problem as plain values, without notes, where its robot was read from, and how that has its base held."""
    values = problem_as_dict(problem)
    values.pop("notes", None)
    return {**values, **canonical(problem.robot, problem.scene)}


def save_plan(plan: Plan, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    """Write a plan as JSON.

    Args:
        plan: to be written, found or not.
        path: of the file, a new one.
        overwrite: replace a file that is there.

    Raises:
        OutputError: the file exists already, or cannot be written.
        ProblemError: it is no plan.
    """
    require_kind("plan", plan, Plan, ProblemError, advice="make one with plan(problem)")
    require_writable(path, overwrite=overwrite)
    write_out(path, _text(plan_as_dict(plan)), overwrite=overwrite)


def save_json(values: dict[str, Any], path: str | os.PathLike[str]) -> None:
    """Write plain values as JSON, a row of numbers to a line.

    Raises:
        OutputError: the file exists already, or cannot be written.
    """
    write_new(path, _text(values))


def save_trajectory(
    trajectory: AnyTrajectory,
    path: str | os.PathLike[str],
    *,
    samples: int | None = None,
    jerk_limit: ArrayLike | None = None,
    overwrite: bool = False,
) -> tuple[str, ...]:
    """Write a trajectory as CSV: time [s], then position, rate and acceleration of every joint, and the tip's position.

    If the base floats or does not begin at the origin, its position [m] and attitude wxyz follow, in the inertial frame as the
    tip's position is. `load_trajectory` reads from it the same motion, which keeps the limits that the trajectory keeps: rows
    stand where its polynomial pieces meet, every number is written in full, and where rounding would pass a limit the motion is
    written slower by so much, mostly a billionth.

    Args:
        trajectory: to be written.
        path: of the file, a new one.
        samples: so many rows at equal steps, which may be too few to keep the limits; None: about 200 or as many as it takes,
            at equal steps if the trajectory's pieces are equal.
        jerk_limit: to be kept by what is read, too.
        overwrite: replace a file that is there.

    Returns:
        What differs from the trajectory by more than the last digits, a sentence each; mostly nothing.

    Raises:
        OutputError: the file exists already, or cannot be written.
        SettingsError: samples that are none.
    """
    require_trajectory(trajectory)
    require_writable(path, overwrite=overwrite)
    if samples is None:
        rows = rows_of(trajectory, least=_SAMPLES, jerk_limit=jerk_limit)
    else:
        count = as_whole("samples", samples, SettingsError, at_least=1, at_most=1_000_000)
        rows = rows_at(trajectory, np.linspace(0.0, trajectory.duration, count))
    names = trajectory.robot.dof_names
    kinds = ("q", "dq", "ddq")[: len(rows.states)]
    header = ["t_s", *(f"{kind}_{name}" for kind in kinds for name in names), *TIP_COLUMNS]
    columns = [rows.t, *rows.states, rows.trajectory.tip(rows.t)[:, :3, 3]]
    if trajectory.base != "fixed" or not np.array_equal(trajectory.base_start, np.eye(4)):
        header += BASE_COLUMNS
        columns += rows.trajectory.base_pose(rows.t)
    lines = [",".join(map(repr, row)) for row in np.column_stack(columns).tolist()]
    names_line = io.StringIO()
    csv.writer(names_line, lineterminator="\n").writerow(header)  # a name may hold a comma
    write_out(path, names_line.getvalue() + "\n".join(lines) + "\n", overwrite=overwrite)
    return rows.notes


def _text(values: dict[str, Any]) -> str:
    return "".join(_json(values, "")) + "\n"


def _json(value: Any, indent: str) -> Iterator[str]:
    """Yield the parts of strict JSON, indented, but lists that hold no others on one line."""
    inner = indent + "  "
    if isinstance(value, dict) and value:
        yield "{\n"
        for i, (key, entry) in enumerate(value.items()):
            yield f"{inner}{json.dumps(key)}: "
            yield from _json(entry, inner)
            yield ",\n" if i < len(value) - 1 else f"\n{indent}}}"
    elif isinstance(value, list) and any(isinstance(entry, (list, dict)) for entry in value):
        yield "[\n"
        for i, entry in enumerate(value):
            yield inner
            yield from _json(entry, inner)
            yield ",\n" if i < len(value) - 1 else f"\n{indent}]"
    else:
        yield json.dumps(value, allow_nan=False)


# ---- Plans read back: the problem, the motion, and what the file says of them, none of which is believed -------------

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
