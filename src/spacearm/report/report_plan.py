"""Reports of motions: what a page shows of one plan, and of several beside each other."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from spacearm.core.errors import ProblemError, SpacearmError
from spacearm.core.output import require_writable, write_out
from spacearm.motion import Motion, Trajectory
from spacearm.report.report_clearance import INSTANTS, ClosestPairs, MeasuredMotion
from spacearm.report.report_compare import MeasuredSubject, comparison
from spacearm.report.report_curves import base_plots, clearance_plot, instants_of, joint_plots, sampled, tool_plots
from spacearm.report.report_knots import knots_of, resting_knots
from spacearm.report.report_meshes import Meshes
from spacearm.report.report_page import page_html, section
from spacearm.report.report_scene import obstacles_data, pieces_of, robot_data, targets_data
from spacearm.report.report_sections import block_of, mm, sections_of, verdict_of
from spacearm.report.report_subject import ProvenAgain, Subject, contradicted, subject_of
from spacearm.report.report_visuals import visual_parts
from spacearm.robot import Robot

Data = dict[str, Any]

MOST_VIEWS = 12
"""Motions of a report that have a view of their own; further ones are shown beside the others only."""


class _Parts(NamedTuple):
    """What several motions of a page share: robots and meshes, each once."""

    meshes: Meshes
    robots: list[Data]
    places: dict[int, int]

    def robot(self, robot: Robot) -> int:
        """Return the place of a robot among those of the page."""
        if id(robot) not in self.places:
            made = robot_data(robot, self.meshes, visual_parts(robot, self.meshes))
            if made not in self.robots:
                self.robots.append(made)
            self.places[id(robot)] = self.robots.index(made)
        return self.places[id(robot)]


def report_of_plans(
    plans: Any,
    *,
    title: str = "",
    names: Sequence[str] = (),
    commands: Sequence[str] = (),
    again: Sequence[ProvenAgain | None] = (),
) -> Data:
    """Return the page of a report of one motion, or of several beside each other.

    Args:
        plans: a Plan, a SavedPlan or a Certificate, or several of them.
        title: of the page; "": by the robots' names.
        names: what the report calls them; by default the robots' names.
        commands: that make them again; by default those in Python.
        again: what new proofs of saved plans found; None: what the file says is shown as that.

    Returns:
        The page as `web/src/data.ts` describes it, without its version: for `page_html` and `write_report`.

    Raises:
        ProblemError: something that is none of these.
    """
    given = list(plans) if isinstance(plans, (list, tuple)) else [plans]
    called = _names([_robot_name(one) for one in given], names)
    made = [*again, *[None] * (len(given) - len(again))]
    subjects = [
        subject_of(one, name=name, command=command, again=recheck)
        for one, name, command, recheck in zip(given, called, _padded(commands, len(given)), made, strict=True)
    ]
    if not subjects:
        raise ProblemError("plans is empty, expected a Plan, a SavedPlan or a Certificate, or several of them")
    parts = _Parts(Meshes(), [], {})
    parts.meshes.expect(sum(pieces_of(one.robot, one.scene) for one in subjects))
    measured = [_measure(subject, parts) for subject in subjects]
    subjects = [one.subject for one in measured]
    views = [_view(one, parts) for one in measured[:MOST_VIEWS]]
    if len(measured) > MOST_VIEWS:
        parts.meshes.notes.append(f"the first {MOST_VIEWS} of {len(measured)} motions have a view of their own")
    if len(measured) > 1:
        first = views[0]
        views.insert(0, comparison(measured, obstacles=first["obstacles"], targets=first["targets"]))
    drawn = parts.meshes.said()
    kind = "motion plan" if len(measured) == 1 else f"{len(measured)} motions"
    return {
        "title": title or f"{subjects[0].robot.name}: {kind}",
        "block": block_of(subjects),
        "robots": parts.robots,
        "meshes": parts.meshes.items,
        "views": views,
        "sections": [section("How it is drawn", notes=drawn)] if drawn else [],
    }


def save_report(plans: Any, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    """Write a report of one motion, or of several beside each other: one HTML file that needs nothing else.

    Args:
        plans: a Plan, a SavedPlan or a Certificate, or several of them.
        path: of the file, a new one.
        overwrite: replace a file that is there.

    Raises:
        OutputError: the file exists already, or cannot be written.
        ProblemError: something that is none of these.
    """
    require_writable(path, overwrite=overwrite)
    write_out(path, page_html(report_of_plans(plans)), overwrite=overwrite)


def _padded(given: Sequence[str], count: int) -> list[str]:
    return [*given, *[""] * (count - len(given))][:count]


def _robot_name(given: Any) -> str:
    """Return the name of the robot of whatever is given; "" if it has none."""
    robot = getattr(getattr(given, "problem", given), "robot", None)
    return robot.name if isinstance(robot, Robot) else ""


def _names(robots: Sequence[str], given: Sequence[str]) -> list[str]:
    """Return a name for each motion: the one given, or the robot's, with a number where several would have the same."""
    names = [one or robot for one, robot in zip(_padded(given, len(robots)), robots, strict=True)]
    if len(set(names)) == len(names):
        return names
    return [f"{name} ({i})" for i, name in enumerate(names, start=1)]


def _measure(subject: Subject, parts: _Parts) -> MeasuredSubject:
    """Compute what a page shows of a motion over time, or of the robot as it stands if there is none."""
    trajectory, notes, robot = subject.trajectory, list[str](), parts.robot(subject.robot)
    if trajectory is None:
        knots, closest = _standing(subject, notes)
        return MeasuredSubject(subject, None, None, closest, tuple(notes), knots, robot)
    knots = knots_of(trajectory, notes)
    also = _stated_closest(subject)
    at = sampled(trajectory, instants_of(trajectory, also))
    found = closest = None
    try:
        motion = MeasuredMotion(subject.scene, trajectory)
        if motion.is_free:
            notes.append("nothing is in the way: there are no clearances to show (links that cannot meet are left out)")
        else:
            found = motion.over(at.t)
            even = range(0, len(at.t), max(1, len(at.t) // INSTANTS))
            which = {*even, len(at.t) - 1, int(np.argmin(found.least)), *np.searchsorted(at.t, also).tolist()}
            some = np.array(sorted(which))
            closest = motion.closest(at.t[some], found.least[some])
            subject = contradicted(subject, float(found.least.min()))
    except SpacearmError as error:
        notes.append(f"clearances were not measured: {error}")
    return MeasuredSubject(subject, at, found, closest, tuple(notes), knots, robot)


def _standing(subject: Subject, notes: list[str]) -> tuple[Data, ClosestPairs | None]:
    """Return the only knot of a robot that stands, and its closest pair there."""
    q = np.zeros(subject.robot.dof)
    for given in (subject.start, subject.stands):
        q = q if given is None else given
    closest = None
    try:
        motion = MeasuredMotion(
            subject.scene, Trajectory(subject.robot, Motion([q, q]), base="fixed", base_start=subject.base_start)
        )
        closest = None if motion.is_free else motion.closest(np.zeros(1))
    except SpacearmError as error:
        notes.append(f"clearances were not measured: {error}")
    return resting_knots(q, subject.base_start), closest


def _stated_closest(subject: Subject) -> list[float]:
    """Return the instant of the closest approach that the certificate states, if there is one."""
    near, trajectory = (subject.certificate or {}).get("closest"), subject.trajectory
    if not isinstance(near, dict) or trajectory is None or not 0 <= near["time_s"] <= trajectory.duration:
        return []
    return [float(near["time_s"])]


def _view(one: MeasuredSubject, parts: _Parts) -> Data:
    """Return a view of one motion."""
    subject, at, trajectory = one.subject, one.at, one.subject.trajectory
    obstacles = obstacles_data(subject.scene, parts.meshes)
    plots: list[Data] = []
    if one.clearances is not None:
        plots.append(clearance_plot(one.clearances, asked=subject.asked, proven=subject.proven))
    if at is not None and trajectory is not None:
        plots += [*joint_plots(trajectory, at), *tool_plots(trajectory, at), *base_plots(trajectory, at, subject.base_limits)]
    view: Data = {
        "name": subject.name,
        "verdict": verdict_of(subject),
        "clock": {"unit": "s", "duration": one.duration},
        "actors": [{"name": subject.name, "robot": one.robot, "knots": one.knots, "tone": 0, "ghost": False}],
        "obstacles": obstacles,
        "targets": targets_data(subject.robot, subject.start, subject.goal, subject.base_start, trajectory),
        "plots": plots,
        "sections": sections_of(subject, at, drawn=one.notes, closest=_closest_in_words(one)),
    }
    return view if one.closest is None else view | {"closest": one.closest.data()}


def _closest_in_words(one: MeasuredSubject) -> str:
    found = one.closest
    if found is None:
        return ""
    i = int(np.argmin(found.distance))
    pair = found.names[int(found.pair[i])]
    distance = mm(float(found.distance[i]))
    return f"{distance}, {pair}" + (f", at t = {found.t[i]:.4g} s, of {len(found.t)} instants" if len(found.t) > 1 else "")
