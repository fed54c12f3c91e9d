"""A second proof of what a file holds: a saved plan, also one that was edited, or a trajectory that somebody else made.

Nothing in the file is believed: robot, scene and motion are read, proven anew, and compared with what the file says.
"""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spacearm.core.errors import ProblemError
from spacearm.core.reading import located
from spacearm.files.plan_file import SavedPlan, load_saved_plan, problem_hash, values_that_count
from spacearm.motion import AnyTrajectory, RecordedTrajectory
from spacearm.motion.recorded import for_robot
from spacearm.planner.goals import ConfigurationGoal, ConfigurationsGoal
from spacearm.planner.inverse_kinematics import Reach, reaches
from spacearm.planner.plan_result import BaseReport, report_base
from spacearm.planner.problem import Problem
from spacearm.proof import Certificate
from spacearm.proof import certify as certify
from spacearm.proof.base_setup import base_setup_of, require_same
from spacearm.proof.certificate import trajectory_digest

Array = NDArray[np.float64]

_SAME = 1e-9  # [rad or m] a start or goal missed by less is a file's last digit
_SAME_TIME = 0.01  # relative: of a duration, which the planner may exceed by what the limits' bounds take


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Recheck:
    """What a second proof found.

    Attributes:
        certificate: the new one.
        notes: what is odd about the file, a sentence each: edited, of another problem, not from start to goal.
        agrees: whether the file's own certificate says the same; None if it has none.
        base: of a floating base: how the trajectory turns it; None for a fixed one.
    """

    certificate: Certificate
    notes: tuple[str, ...]
    agrees: bool | None
    base: BaseReport | None = None


def recheck_plan(path: str | os.PathLike[str], problem: Problem | None = None, **options: Any) -> Recheck:
    """Prove a saved plan again.

    Args:
        path: a plan.json.
        problem: to prove it for; None: the one in the file.
        options: of `certify`.

    Raises:
        SpacearmError: a file that cannot be read, or a plan of another robot.
    """
    saved = load_saved_plan(path)
    against = saved.problem if problem is None else problem
    with located(path):
        _require_same_base(against, saved.trajectory)
        trajectory, other = _of_robot(saved.trajectory, against)
    certificate = certify(against, trajectory, **options)
    said = None if saved.certificate is None else saved.certificate.get("status")
    base = _base(against, trajectory, certificate)
    notes = [*saved.trajectory.notes, *other, *_edited(saved)]
    notes += [*_other_problem(saved.problem, against), *_ends(against, trajectory, base)]
    agrees = None if said is None else said == certificate.status
    if agrees is False:
        notes.append(f"the file's certificate says '{said}', the new one '{certificate.status}'")
    return Recheck(certificate=certificate, notes=tuple(notes), agrees=agrees, base=base)


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


def _of_robot(trajectory: AnyTrajectory, problem: Problem) -> tuple[AnyTrajectory, tuple[str, ...]]:
    """Take a plan's motion for the robot of the problem that it is asked to be proven for, and say in what that differs."""
    ours, notes = for_robot(trajectory, problem.robot, same_joints=False)
    if not notes:
        return ours, ()
    try:
        return replace(ours, robot=problem.robot), notes
    except ProblemError:  # beyond that robot's limits
        if not trajectory.duration > 0:
            raise
        return RecordedTrajectory(problem.robot, ours.path, **_held(problem), notes=ours.notes), notes


def _require_same_base(problem: Problem, trajectory: AnyTrajectory) -> None:
    """Refuse a motion of a base that is held otherwise than its problem's, or starts elsewhere: what would be proven?"""
    asked, taken = (
        base_setup_of(holder, problem.robot, who=who) for holder, who in ((problem, "problem"), (trajectory, "trajectory"))
    )
    require_same(asked, taken)


def _base(problem: Problem, trajectory: AnyTrajectory, certificate: Certificate) -> BaseReport | None:
    """Report on a floating base, with the problem's masses, whatever those are that the file has."""
    if certificate.base_findings is None:  # it is fixed, or masses are not known, which the certificate says
        return None
    if trajectory.robot != problem.robot and trajectory.duration > 0:
        trajectory = RecordedTrajectory(problem.robot, trajectory.path, **_held(problem))
    return report_base(problem, trajectory)


def _held(problem: Problem) -> dict[str, Any]:
    return {name: getattr(problem, name) for name in ("base", "base_start", "momentum")}


def _edited(saved: SavedPlan) -> list[str]:
    """Compare the file's hashes with what it holds."""
    notes = []
    if saved.problem_hash != problem_hash(saved.problem):
        notes.append("the problem in the file is not the one that was planned: its hash is another; it was edited")
    said = None if saved.certificate is None else saved.certificate.get("trajectory_hash")
    if said is not None and said != trajectory_digest(saved.trajectory):
        notes.append("the motion in the file is not the one that its certificate is about: its hash is another; it was edited")
    return notes


def _other_problem(planned: Problem, against: Problem) -> list[str]:
    """Say in what the problem that is proven for differs from the one that was planned."""
    one, other = values_that_count(planned), values_that_count(against)
    names = ", ".join(key for key in one if one[key] != other[key])
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
