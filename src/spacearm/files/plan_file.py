"""Plans on disk: JSON with everything needed to run, check and repeat them; written, read back, and proven again.

Nothing in a file is believed: robot, scene and motion are read, proven anew (`recheck_plan`), and compared with what the file
says. The same goes for a trajectory that somebody else made (`recheck_trajectory`).

Keys: `spacearm-plan` (version), `status`, `message`, `problem` (robot, base, start, goal and obstacles in full, as plain
values; and a SHA-256 `hash` of them), `seed`, `settings`, `motion` (`control_points` of the clamped quintic spline,
`duration_s`, `time_law`, and of a base that is not fixed at the origin `base`, `base_start`, `momentum`), `base` (what the
motion does to a floating one), `fitness`, `searched` (`clearance_m` that the search asked for, and `near`: the pairs that
begin or end nearer than is required of them), `achievable` (where the clearance required was not met: with what `share` of it,
that is with what `clearance_m`, a motion is found and proven), `goals`, `goal_search`, `ends`, `history`, `certificate`, and
`proof` (that pairs of bodies keep apart, as `ProofTree.as_dict` has it: `recheck_plan` checks it, and looks for another one
only if it is wrong), and `visuals` (how the robot's links look, for pictures; mesh files by their paths, which need not be
there). What is infinite, as a clearance without obstacles, is null. Timings are left out: the same search gives the same bytes.

A problem without the key `clearance` is one of a file that was written before there was one: it was proven for 0.
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, field, fields, replace
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from spacearm.core.brief import Brief, Rows, counted, in_short
from spacearm.core.checks import as_transform, require_kind, shown
from spacearm.core.errors import FileFormatError, ProblemError
from spacearm.core.notebook_hook import InNotebooks
from spacearm.core.output import require_writable, write_new, write_out
from spacearm.core.reading import located, read_bytes, require_version
from spacearm.core.records import as_dict, record_as_dict, record_from_dict
from spacearm.dynamics import Momentum
from spacearm.geometry.scene import scene_as_list, scene_from_list
from spacearm.motion import AnyTrajectory, RecordedTrajectory, Trajectory
from spacearm.motion.recorded import for_robot
from spacearm.motion.trajectory_values import trajectory_as_dict, trajectory_from_dict
from spacearm.planner.goals import ConfigurationGoal, ConfigurationsGoal, goal_as_dict, goal_from_dict
from spacearm.planner.inverse_kinematics import Reach, reaches
from spacearm.planner.plan_result import BaseReport, Plan, report_base
from spacearm.planner.problem import SNAP_TOLERANCE, AttitudeGoal, BaseLimits, Problem
from spacearm.planner.searched_clearance import SearchedClearance
from spacearm.proof import Certificate, certify
from spacearm.proof.base_proofs import base_setup_of, require_same
from spacearm.proof.certificate import CERTIFICATE_KEY, CERTIFICATE_VERSION, canonical, digest, trajectory_digest
from spacearm.proof.proof_tree import ProofTree
from spacearm.proof.required_clearance import pair_clearance_as_dict
from spacearm.robot import LinkVisual, Robot
from spacearm.robot.model import robot_as_dict, robot_from_dict

Array = NDArray[np.float64]

KEY = "spacearm-plan"
VERSION = 1
_WHAT = "a plan file in JSON"
_OF_SEARCH = ("message", "seed", "settings", "fitness", "goals", "history", "evaluations", "proofs", "interrupted", "base")
_OTHER_MOTION = "the motion in the file is not the one that its certificate is about: its hash is another; it was edited"
_NO_CLEARANCE = (
    "the file states no clearance, for it was written before there was one; it is taken as 0, which it was proven for"
)
_SAME = 1e-9  # [rad or m] a start or goal missed by less is a file's last digit
_SAME_TIME = 0.01  # relative: of a duration, which the planner may exceed by what the limits' bounds take


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
            **({} if plan.searched is None else {"searched": _searched_as_dict(plan.searched)}),
            **_achievable_as_dict(plan),
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
            "proof": None if plan.certificate is None else proof_as_dict(plan.certificate),
            **_visuals_as_dict(plan.problem.robot),
        }
    )


def proof_as_dict(certificate: Certificate) -> dict[str, Any] | None:
    """Return the proof of a certificate as plain values; None if it has none."""
    return None if certificate.proof is None else certificate.proof.as_dict()


def _is_row_of_numbers(value: list[Any]) -> bool:
    """Whether all are finite numbers, told quickly: a long row of them is; others may be."""
    with suppress(TypeError, OverflowError):
        return bool(value) and isinstance(value[0], (int, float)) and math.isfinite(sum(value))
    return False


def _without_infinite(value: Any) -> Any:
    """Return plain values with null for what JSON has no number for."""
    if isinstance(value, dict):
        return {key: _without_infinite(entry) for key, entry in value.items()}
    if isinstance(value, list):
        return value if _is_row_of_numbers(value) else [_without_infinite(entry) for entry in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _searched_as_dict(searched: SearchedClearance) -> dict[str, Any]:
    near = [
        {
            "link": pair.link,
            "other": pair.other,
            "clearance_m": pair.clearance,
            "required_m": pair.required,
            "at_start_m": pair.at_start,
            "at_goals_m": list(pair.at_goals),
        }
        for pair in searched.near
    ]
    return {"clearance_m": searched.asked, "near": near}


def _visuals_as_dict(robot: Robot) -> dict[str, Any]:
    """Return how a robot looks, which is no part of its value, nor of a hash; nothing of one without visuals."""
    return {"visuals": [record_as_dict(visual) for visual in robot.visuals]} if robot.visuals else {}


def _achievable_as_dict(plan: Plan) -> dict[str, Any]:
    if plan.achievable is None:
        return {}
    return {"achievable": {"share": plan.achievable, "clearance_m": plan.achievable * plan.problem.clearance}}


def problem_as_dict(problem: Problem) -> dict[str, Any]:
    """Return a problem as plain values, from which it can be made again bit for bit.

    Keys of the base that have their defaults are not written.
    """
    return {
        "robot": robot_as_dict(problem.robot),
        "base": problem.base,
        **_base_as_dict(problem),
        "clearance": problem.clearance,
        **({"clearances": [pair_clearance_as_dict(pair) for pair in problem.clearances]} if problem.clearances else {}),
        **({"snap_tolerance": problem.snap_tolerance} if problem.snap_tolerance != SNAP_TOLERANCE else {}),
        **({"notes": list(problem.notes)} if problem.notes else {}),
        "start": problem.start.tolist(),
        "goal": goal_as_dict(problem.goal),
        "obstacles": scene_as_list(problem.scene),
    }


def _base_as_dict(problem: Problem) -> dict[str, Any]:
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
    """Return a problem as plain values, without notes, where its robot was read from, and what that says of its base.

    A clearance of 0 is left out: files that were written before there was a clearance have the same hashes.
    """
    values = problem_as_dict(problem)
    values.pop("notes", None)
    if not problem.clearance:
        del values["clearance"]
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
    write_out(path, plan_text(plan), overwrite=overwrite)


def plan_text(plan: Plan) -> str:
    """Return what a plan file of a plan holds."""
    return _text(plan_as_dict(plan))


def save_json(values: dict[str, Any], path: str | os.PathLike[str]) -> None:
    """Write plain values as JSON, a row of numbers to a line.

    Raises:
        OutputError: the file exists already, or cannot be written.
    """
    write_new(path, _text(values))


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


@dataclass(frozen=True, slots=True, kw_only=True)
class _PlanValues:
    """Those keys of a plan file that are read back."""

    status: str
    problem: dict[str, Any]
    motion: dict[str, Any] | None = None
    certificate: dict[str, Any] | None = None
    proof: dict[str, Any] | None = None
    visuals: tuple[LinkVisual, ...] = ()
    search: dict[str, Any]


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
    clearance: float = 0.0
    clearances: tuple[dict[str, Any], ...] = ()
    snap_tolerance: float = SNAP_TOLERANCE
    notes: tuple[str, ...] = ()
    start: Array
    goal: dict[str, Any]
    obstacles: list[Any]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class SavedPlan(Brief, InNotebooks):
    """What a plan file has.

    Attributes:
        problem: what was planned.
        trajectory: its motion; one that breaks the robot's limits comes as a RecordedTrajectory.
        status: how planning ended, says the file.
        problem_hash: of the problem, says the file; `problem_hash(problem)` is the true one.
        certificate: the file's, as plain values; None if it has none.
        proof: the file's; None if it has none.
        is_old: whether the file states no clearance, which is taken as 0: it was written before there was one.
        search: what the file says of the search, as plain values that nobody has checked: `seed`, `settings` and the like.
    """

    problem: Problem
    trajectory: AnyTrajectory
    status: str
    problem_hash: str
    certificate: dict[str, Any] | None
    proof: ProofTree | None = None
    is_old: bool = False
    search: dict[str, Any] = field(default_factory=dict[str, Any])

    @property
    def edits(self) -> list[str]:
        """What is not as it was when the plan was made, by the file's hashes; a sentence each."""
        said, notes = (self.certificate or {}).get("trajectory_hash"), []
        if self.problem_hash != problem_hash(self.problem):
            notes.append("the problem in the file is not the one that was planned: its hash is another; it was edited")
        if said not in (None, trajectory_digest(self.trajectory)):
            notes.append(_OTHER_MOTION)
        return notes

    def _in_short(self) -> tuple[str, Rows]:
        said = self.certificate or {}
        rows = [("outcome", f"{self.status}, says the file; certify(saved.problem, saved.trajectory) proves it anew")]
        rows.append(("certificate", f"{said.get('status')}: {said.get('message')}" if said else "none"))
        rows += [("motion", in_short(self.trajectory)[0].partition(": ")[2])]
        rows += [row for row in in_short(self.problem)[1] if row[0] in ("goal", "clearance", "base")]
        rows.append(("proof", "none" if self.proof is None else f"{counted(len(self.proof.steps), 'node')}"))
        return (
            f"SavedPlan: robot '{self.problem.robot.name[:40]}', {in_short(self.problem.scene)[0].removeprefix('Scene: ')}",
            rows,
        )


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
    return _saved(_read(path), path)


def saved_plan_from_dict(values: object, what: str = "the plan") -> SavedPlan:
    """Read back a plan from plain values, as `plan_as_dict` gives them.

    Args:
        values: the plain values.
        what: they are, for messages.

    Raises:
        FileFormatError: they are no plan, or hold no motion.
        SpacearmError: as of `load_saved_plan`.
    """
    return _saved(_plan_values(values, what), what)


def _saved(saved: _PlanValues, path: str | os.PathLike[str]) -> SavedPlan:
    problem = _problem(path, saved)
    with located(path):
        proof = None if saved.proof is None else ProofTree.from_dict(saved.proof)
    return SavedPlan(
        problem=problem,
        trajectory=_motion(path, saved, problem.robot, within_limits=False),
        status=saved.status,
        problem_hash=saved.problem["hash"],
        certificate=saved.certificate,
        proof=proof,
        is_old="clearance" not in saved.problem,
        search=saved.search,
    )


def _read(path: str | os.PathLike[str]) -> _PlanValues:
    content = read_bytes(path, what=_WHAT)
    try:
        given = json.loads(content, parse_constant=_no_number)
        json.dumps(given, ensure_ascii=False).encode()  # half a surrogate pair cannot be printed
    except (ValueError, RecursionError):
        raise FileFormatError(f"{path} is broken, expected {_WHAT}; plan again") from None
    return _plan_values(given, path)


def _plan_values(given: object, path: str | os.PathLike[str]) -> _PlanValues:
    if not isinstance(given, dict) or KEY not in given:
        raise FileFormatError(f"{path} has no '{KEY}: {VERSION}', expected {_WHAT}; it is something else")
    require_version(given[KEY], VERSION, path, key=KEY)
    known = {key.name for key in fields(_PlanValues)} & given.keys()
    with located(path):
        values = {key: given[key] for key in known} | {"search": {key: given[key] for key in _OF_SEARCH if key in given}}
        saved = record_from_dict(_PlanValues, values, "", FileFormatError)
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
    names = ("base", "momentum", "base_goal", "base_limits", "duration", "clearance", "clearances", "snap_tolerance", "notes")
    asked = {key: getattr(given, key) for key in names}
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
        problem = problem_from_dict(saved.problem)
    if not saved.visuals:
        return problem
    with located(f"{path}: visuals"):
        return replace(problem, robot=replace(problem.robot, visuals=saved.visuals))


def _motion(path: object, saved: _PlanValues, robot: Robot, *, within_limits: bool) -> AnyTrajectory:
    with located(f"{path}: motion"):
        return trajectory_from_dict(robot, saved.motion, within_limits=within_limits)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class Recheck(Brief):
    """What a second proof found.

    Attributes:
        certificate: the new one.
        notes: what is odd about the file, a sentence each: edited, of another problem, not from start to goal.
        agrees: whether the file's own certificate says the same; None if it has none.
        proof_checked: whether the certificate rests on the file's own proof; None if it has none.
        base: of a floating base: how the trajectory turns it; None for a fixed one.
    """

    certificate: Certificate
    notes: tuple[str, ...]
    agrees: bool | None
    proof_checked: bool | None = None
    base: BaseReport | None = None


def recheck_plan(path: str | os.PathLike[str], problem: Problem | None = None, **options: Any) -> Recheck:
    """Prove a saved plan again.

    Args:
        path: a plan.json.
        problem: to prove it for; None: the one in the file.
        options: of `certify`; without `tracking`, the tracking error is that of the file's certificate.

    Raises:
        SpacearmError: a file that cannot be read, or a plan of another robot.
    """
    saved = load_saved_plan(path)
    against = saved.problem if problem is None else problem
    with located(path):
        _require_same_base(against, saved.trajectory)
        trajectory, other = _for_problem_robot(saved.trajectory, against)
    proof = saved.proof if trajectory is saved.trajectory else None
    certificate = certify(against, trajectory, proof=proof, **{**_claimed(saved), **options})
    said = None if saved.certificate is None else saved.certificate.get("status")
    base = _base(against, trajectory, certificate)
    notes = [*saved.trajectory.notes, *other, *saved.edits, *([_NO_CLEARANCE] if problem is None and saved.is_old else [])]
    notes += [*_other_problem(saved.problem, against), *_ends(against, trajectory, base)]
    agrees = None if said is None else said == certificate.status
    if agrees is False:
        notes.append(f"the file's certificate says '{said}', the new one '{certificate.status}'")
    checked = None if saved.proof is None else certificate.proof is saved.proof
    return Recheck(certificate=certificate, notes=tuple(notes), agrees=agrees, proof_checked=checked, base=base)


def _claimed(saved: SavedPlan) -> dict[str, Any]:
    """Return the tracking error that the file's own certificate includes, as an option of `certify`."""
    tracking = None if saved.certificate is None else saved.certificate.get("tracking")
    return {} if tracking is None else {"tracking": tracking}


def recheck_trajectory(problem: Problem, trajectory: AnyTrajectory, **options: Any) -> Recheck:
    """Prove a trajectory that somebody else made.

    Args:
        problem: to prove it for.
        trajectory: of the problem's robot.
        options: of `certify`.

    Raises:
        ProblemError: a trajectory of another robot, or an option out of its range.
    """
    certificate = certify(problem, trajectory, **options)
    ours = certificate.trajectory  # its joints in the problem's order
    base = _base(problem, ours, certificate)
    notes = (*trajectory.notes, *certificate.notes, *_ends(problem, ours, base))
    return Recheck(certificate=certificate, notes=notes, agrees=None, base=base)


def _for_problem_robot(trajectory: AnyTrajectory, problem: Problem) -> tuple[AnyTrajectory, tuple[str, ...]]:
    """Take a plan's motion for the robot of the problem that it is asked to be proven for, and say in what that differs."""
    ours, notes = for_robot(trajectory, problem.robot, same_joints=False)
    if not notes:
        return ours, ()
    try:
        return replace(ours, robot=problem.robot), notes
    except ProblemError:  # beyond that robot's limits
        if not trajectory.duration > 0:
            raise
        return RecordedTrajectory(problem.robot, ours.path, **_base_of(problem), notes=ours.notes), notes


def _require_same_base(problem: Problem, trajectory: AnyTrajectory) -> None:
    """Refuse a motion of another kind of base than its problem's, or starts elsewhere: what would be proven?"""
    asked, taken = (
        base_setup_of(holder, problem.robot, who=who) for holder, who in ((problem, "problem"), (trajectory, "trajectory"))
    )
    require_same(asked, taken)


def _base(problem: Problem, trajectory: AnyTrajectory, certificate: Certificate) -> BaseReport | None:
    """Report on a floating base, with the problem's masses, whatever those are that the file has."""
    if certificate.base_findings is None:  # it is fixed, or masses are not known, which the certificate says
        return None
    if trajectory.robot != problem.robot and trajectory.duration > 0:
        trajectory = RecordedTrajectory(problem.robot, trajectory.path, **_base_of(problem))
    return report_base(problem, trajectory)


def _base_of(problem: Problem) -> dict[str, Any]:
    return {name: getattr(problem, name) for name in ("base", "base_start", "momentum")}


def _other_problem(planned: Problem, against: Problem) -> list[str]:
    """Say in what the problem that is proven for differs from the one that was planned."""
    one, other = values_that_count(planned), values_that_count(against)
    names = ", ".join(key for key in dict.fromkeys([*one, *other]) if one.get(key) != other.get(key))
    return [f"the plan was made for another problem, which differs in: {names}"] if names else []


def _ends(problem: Problem, trajectory: AnyTrajectory, base: BaseReport | None) -> list[str]:
    """Say where the trajectory is not as was asked: its start, its goal, its duration, and what is asked of a floating base."""
    begin, end = trajectory.curve.sample(np.array(trajectory.curve.domain))
    notes = []
    off = np.abs(begin - problem.start)
    if off.max() > _SAME:
        joint = int(np.argmax(off))
        notes.append(f"it begins {off[joint]:.4g} away from the problem's start, at joint '{problem.robot.dof_names[joint]}'")
    if _missed(problem, end):
        notes.append("it does not end at the problem's goal")
    asked, taken = problem.duration, trajectory.duration
    if asked is not None and abs(taken - asked) > _SAME_TIME * asked:
        notes.append(f"it takes {taken:.4g} s, and the problem asks for {asked:.4g} s")
    return notes if base is None else [*notes, *base.missed]


def _missed(problem: Problem, end: Array) -> bool:
    """Whether a trajectory ends elsewhere; where a floating base takes the end effector is the base report's to say."""
    goal = problem.local.goal
    if isinstance(goal, (ConfigurationGoal, ConfigurationsGoal)):
        return bool((np.abs(np.atleast_2d(goal.q) - end) - goal.tolerance).max(axis=1).min() > _SAME)
    return not problem.base_model.follows_arm and not bool(reaches(Reach(robot=problem.robot, goal=goal), end[None])[0])
