"""What a report is about: a plan, a plan that was read from a file, or a certificate, told in the same words."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from spacearm.core.checks import shown
from spacearm.core.errors import ProblemError
from spacearm.core.records import as_dict
from spacearm.geometry import Scene
from spacearm.motion import AnyTrajectory
from spacearm.planner.goals import Goal
from spacearm.planner.plan_result import STATUSES, Improvement, Plan
from spacearm.planner.problem import BaseLimits, Problem
from spacearm.proof import Certificate, PairClearance
from spacearm.robot import Robot

Array = NDArray[np.float64]


_STANDS = {
    "goal_in_collision": "in the goal configuration, which collides",
    "goal_unreachable": "in the configuration that comes nearest to the goal",
}
"""Where the robot stands if there is no motion, by what is wrong with an end."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Subject:
    """A motion, or why there is none, with all that is said of it.

    Attributes:
        name: what the report calls it.
        robot, scene: what moves, and what is in the way.
        trajectory: None: there is no motion.
        base_start: T_w_b (4, 4) at the beginning [m].
        base: "fixed" or "floating".
        start, goal: of the problem; None where it is not known.
        stands: (n,) where the robot stands if there is no motion [rad or m]; None: at the start.
        stands_at: that in words.
        asked: the clearance that is asked for [m], and of some pairs.
        base_limits: that were asked for.
        status: a key of `STATUSES`, or the certificate's.
        good: whether all is proven.
        message: the outcome in a sentence.
        certificate: as plain values; None: there is none.
        from_file: whether the certificate is what a file says, and not proven here.
        seed, settings, fitness, goals, history, evaluations, proofs, searched: of the search, as far as they are known.
        ends: what is wrong with the start or the goal, a phrase each.
        notes: (what they are about, a sentence).
        command: that makes it again; "" where it is not known.
    """

    name: str
    robot: Robot
    scene: Scene
    trajectory: AnyTrajectory | None
    base_start: Array
    base: str
    stands: Array | None = None
    stands_at: str = "at the start"
    start: Array | None = None
    goal: Goal | None = None
    asked: float = 0.0
    asked_by_pair: tuple[PairClearance, ...] = ()
    base_limits: BaseLimits | None = None
    status: str
    good: bool
    message: str
    certificate: dict[str, Any] | None
    from_file: bool = False
    seed: int | None = None
    settings: dict[str, Any] = field(default_factory=dict[str, Any])
    fitness: dict[str, float] = field(default_factory=dict[str, float])
    goals: int | None = None
    history: tuple[Improvement, ...] = ()
    evaluations: int | None = None
    proofs: int | None = None
    interrupted: bool = False
    ends: tuple[str, ...] = ()
    achievable: float | None = None
    missed: tuple[str, ...] = ()
    notes: tuple[tuple[str, str], ...] = ()
    command: str = ""

    @property
    def proven(self) -> float | None:
        """The clearance that is proven for all t [m]; None if none is, or nothing is in the way."""
        given = None if self.certificate is None or not self.good else self.certificate.get("clearance_m")
        return float(given) if isinstance(given, (int, float)) else None

    @property
    def proof_holds(self) -> bool:
        """Whether there is a certificate that holds."""
        return self.certificate is not None and self.certificate.get("status") == "holds"


class ProvenAgain(Protocol):
    """What a second proof of a saved plan found, such as `files.Recheck`."""

    @property
    def certificate(self) -> Certificate:
        """The new one."""
        ...

    @property
    def notes(self) -> tuple[str, ...]:
        """What is odd about the file, a sentence each."""
        ...


def subject_of(given: Any, *, name: str = "", command: str = "", again: ProvenAgain | None = None) -> Subject:
    """Return what a report says of a plan, a saved plan, or a certificate.

    Args:
        given: one of these.
        name: what the report calls it; "": the robot's name.
        command: that makes it again; "": not known.
        again: what a new proof of a saved plan found; None: there is none.

    Raises:
        ProblemError: something else.
    """
    if isinstance(given, Plan):
        return _of_plan(given, name, command)
    if isinstance(given, Certificate):
        return _of_certificate(given, name, command)
    if isinstance(getattr(given, "problem", None), Problem) and hasattr(given, "trajectory"):
        said = _of_saved(given, name, command)
        return said if again is None or given.edits or given.status != "found" else _proven_again(said, again)
    raise ProblemError(
        f"plans holds {shown(given)}, expected a Plan, a SavedPlan or a Certificate; make one with plan(problem), "
        "load_saved_plan(path) or certify(problem, trajectory)"
    )


def contradicted(subject: Subject, measured: float) -> Subject:
    """Return a subject that is not shown as proven where a file states more than is measured for the page.

    Args:
        subject: what the page shows.
        measured: the least clearance of all pairs at the page's instants [m].
    """
    if not (subject.from_file and subject.good):
        return subject
    near = (subject.certificate or {}).get("near_pairs")  # they are held to less than the others
    stated = 0.0 if near or subject.proven is None else subject.proven
    if measured >= stated - _DISAGREEMENT:
        return subject
    why = f"the file states {stated * 1e3:.4g} mm, and {measured * 1e3:.4g} mm is measured for this page"
    return replace(subject, good=False, status="not_proven", message=f"{why}: it does not hold", certificate=None)


def _of_plan(plan: Plan, name: str, command: str) -> Subject:
    problem, certificate = plan.problem, plan.certificate
    return Subject(
        name=name or problem.robot.name,
        **_of_problem(problem),
        trajectory=plan.trajectory,
        status=plan.status,
        good=plan.found,
        message=plan.message,
        certificate=None if certificate is None else certificate.as_dict(),
        seed=plan.seed,
        settings=as_dict(plan.settings),
        fitness=dict(plan.fitness),
        goals=len(plan.goals),
        history=plan.history,
        evaluations=plan.evaluations,
        proofs=plan.proofs,
        interrupted=plan.interrupted,
        stands=plan.ends.q,
        stands_at=_STANDS.get(plan.ends.status, "at the start"),
        ends=tuple(one.message for one in (*plan.ends.contacts, *plan.ends.beyond)),
        achievable=plan.achievable,
        missed=() if plan.base is None else plan.base.missed,
        notes=_notes(problem, plan.trajectory),
        command=command,
    )


def _of_saved(saved: Any, name: str, command: str) -> Subject:
    problem: Problem = saved.problem
    certificate, *odd = _readable(saved.certificate)
    odd = [*filter(None, odd), *saved.edits]
    said = "" if certificate is None else str(certificate["message"])
    good = saved.status == "found" and not odd and certificate is not None and certificate["status"] == "holds"
    status = saved.status if saved.status in STATUSES else "not_proven"
    message = "; ".join(filter(None, (STATUSES[status], said)))
    if status == "found":
        why = odd[0] if odd else said or "it has no certificate"
        message = said if good else f"the file says that it is proven, which does not hold: {why}"
    return Subject(
        name=name or problem.robot.name,
        **_of_problem(problem),
        trajectory=saved.trajectory,
        status="not_proven" if status == "found" and not good else status,
        good=good,
        message=message,
        certificate=None if odd else certificate,  # it is not about what is shown
        from_file=True,
        **_searched(getattr(saved, "search", {})),
        notes=(*_notes(problem, saved.trajectory), *(("file", one) for one in odd)),
        command=command,
    )


def _proven_again(said: Subject, again: ProvenAgain) -> Subject:
    """Return a plan that its file calls found, with a certificate that was made anew in place of the file's own."""
    certificate = again.certificate
    notes = (*said.notes, *(("proven again", one) for one in again.notes if one not in dict(said.notes).values()))
    made = replace(said, good=certificate.holds, from_file=False, certificate=certificate.as_dict(), notes=notes)
    if certificate.holds:
        return replace(
            made, status="found", message=f"{STATUSES['found']}, and proven again for this page; {certificate.message}"
        )
    message = f"the file says that it is proven; proven again for this page, it does not hold: {certificate.message}"
    return replace(made, status="not_proven", message=message)


def _searched(said: dict[str, Any]) -> dict[str, Any]:
    """Return what a file says of its search, as far as it is of the kind that is expected."""
    kinds: dict[str, type] = {"seed": int, "settings": dict, "evaluations": int, "proofs": int, "interrupted": bool}
    out = {key: said[key] for key, kind in kinds.items() if _fits(said.get(key), kind)}
    fitness = said.get("fitness")
    if isinstance(fitness, dict) and all(_fits(value, _NUMBER) for value in fitness.values()):
        out["fitness"] = fitness
    if isinstance(said.get("goals"), list):
        out["goals"] = len(said["goals"])
    if _fits(said.get("history"), [_IMPROVEMENT]):
        out["history"] = tuple(Improvement(seconds=0.0, **{key: one[key] for key in _IMPROVEMENT}) for one in said["history"])
    base = said.get("base")
    if isinstance(base, dict) and _are_texts(base.get("missed")):
        out["missed"] = tuple(base["missed"])
    return out


def _are_texts(given: Any) -> bool:
    return isinstance(given, list) and all(isinstance(one, str) for one in given)


_NUMBER = (int, float)
_OPTIONAL = (int, float, type(None))
_PAIR: dict[str, Any] = {"link": str, "other": str, "clearance_m": _NUMBER, "required_m": _NUMBER}
_IMPROVEMENT = {"evaluations": int, "fitness": _NUMBER, "by": str, "goal": int, "interior_points": int, "island": int}
_DISAGREEMENT = 1e-6  # [m] by which a measurement may be below what is proven
_LARGEST = 2**53  # of counts; of other numbers 1e300
_CERTIFICATE: dict[str, Any] = {
    "status": str,
    "message": str,
    "clearance_m": _OPTIONAL,
    "closest": [{**_PAIR, "time_s": _NUMBER}],
    "near_pairs": [{**_PAIR, "ends": str, "proven_m": _OPTIONAL, "begin_s": _NUMBER, "end_s": _NUMBER}],
    "limits": {"checked": [str]},
    "not_checked": {"pairs": [{"links": [str], "reason": str}], "links_without_envelope": [str]},
    "remarks": [str],
    "resolution": _NUMBER,
    "evaluations": _NUMBER,
    "witness": str,
    "problem_hash": str,
    "trajectory_hash": str,
}
_BASE = {
    "residual_momentum": _NUMBER,
    "attitude_error_at_most_rad": _NUMBER,
    "rotation_final_rad": _NUMBER,
    "rotation_peak_at_most_rad": _NUMBER,
    "rate_at_most_rad_s": _NUMBER,
    "joint_momentum_at_most_n_m_s": _NUMBER,
    "limits_broken": [str],
}
"""The keys of a certificate that a report shows, with the kinds of their values."""


def _readable(given: Any) -> tuple[dict[str, Any] | None, str]:
    """Return a file's certificate if it has all that a report shows, and what is wrong with it."""
    if given is None:
        return None, ""
    wanted = {**_CERTIFICATE, **({"base": _BASE} if "base" in given else {})}
    said = {**given, "closest": [] if given.get("closest") is None else [given["closest"]]}
    for key, kind in wanted.items():
        if key not in said or not _fits(said[key], kind):
            return None, f"its certificate has no {key} that can be shown, so it is left out; prove the plan again"
    return given, ""


def _fits(value: Any, kind: Any) -> bool:
    if isinstance(kind, dict):
        return isinstance(value, dict) and all(key in value and _fits(value[key], one) for key, one in kind.items())
    if isinstance(kind, list):
        return isinstance(value, list) and all(_fits(one, kind[0]) for one in value)
    if isinstance(value, (bool, int, float)) and kind is not bool:
        most = _LARGEST if kind is int else 1e300
        return not isinstance(value, bool) and isinstance(value, kind) and -most <= value <= most
    return isinstance(value, kind)


def _of_certificate(certificate: Certificate, name: str, command: str) -> Subject:
    trajectory = certificate.trajectory
    notes = [("robot", note) for note in certificate.robot.notes]
    notes += [("trajectory", note) for note in trajectory.notes]
    return Subject(
        name=name or certificate.robot.name,
        robot=certificate.robot,
        scene=certificate.scene,
        trajectory=trajectory,
        base_start=certificate.base_setup.start,
        base=certificate.base,
        asked=certificate.required,
        asked_by_pair=certificate.required_by_pair,
        status=certificate.status,
        good=certificate.holds,
        message=certificate.message,
        certificate=certificate.as_dict(),
        notes=tuple(dict.fromkeys(notes)),
        command=command,
    )


def _of_problem(problem: Problem) -> dict[str, Any]:
    return {
        "robot": problem.robot,
        "scene": problem.scene,
        "base_start": problem.base_start,
        "base": str(problem.base),
        "start": problem.start,
        "goal": problem.goal,
        "asked": problem.clearance,
        "asked_by_pair": problem.clearances,
        "base_limits": problem.base_limits,
    }


def _notes(problem: Problem, trajectory: AnyTrajectory | None) -> tuple[tuple[str, str], ...]:
    notes = [("robot", note) for note in problem.robot.notes]
    notes += [("scene", note) for note in problem.scene.notes]
    notes += [("problem", note) for note in problem.notes]
    notes += [] if trajectory is None else [("motion", note) for note in trajectory.notes]
    return tuple(dict.fromkeys(notes))
