"""Reports of motions: what a page shows of one plan, and of several beside each other."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from spacearm.core.errors import SpacearmError
from spacearm.core.output import require_writable, write_out
from spacearm.robot import Robot
from spacearm.show.report_clearance import INSTANTS, ClosestPairs, MeasuredMotion, PairClearances
from spacearm.show.report_curves import Sampled, base_plots, clearance_plot, instants_of, joint_plots, sampled, tool_plots
from spacearm.show.report_knots import knots_of, resting_knots
from spacearm.show.report_meshes import Meshes
from spacearm.show.report_page import page_html
from spacearm.show.report_scene import obstacles_data, robot_data, targets_data
from spacearm.show.report_sections import block_of, mm, sections_of, verdict_of
from spacearm.show.report_subject import Subject, subject_of
from spacearm.show.report_visuals import visual_parts

Data = dict[str, Any]


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


class _Measured(NamedTuple):
    """A motion with what was computed of it."""

    subject: Subject
    at: Sampled | None
    clearances: PairClearances | None
    closest: ClosestPairs | None
    notes: tuple[str, ...]


def report_of_plans(plans: Any, *, title: str = "", names: Sequence[str] = (), commands: Sequence[str] = ()) -> Data:
    """Return the page of a report of one motion, or of several beside each other.

    Args:
        plans: a Plan, a SavedPlan or a Certificate, or several of them.
        title: of the page; "": by the robots' names.
        names: what the report calls them; by default the robots' names.
        commands: that make them again; by default those in Python.

    Returns:
        The page as `web/src/data.ts` describes it, without its version: for `page_html` and `write_report`.

    Raises:
        ProblemError: something that is none of these.
    """
    given = list(plans) if isinstance(plans, (list, tuple)) else [plans]
    subjects = [
        subject_of(one, name=name, command=command)
        for one, name, command in zip(given, _padded(names, len(given)), _padded(commands, len(given)), strict=True)
    ]
    parts = _Parts(Meshes(), [], {})
    measured = [_measure(subject) for subject in subjects]
    views = [_view(one, parts) for one in measured]
    name = subjects[0].robot.name
    return {
        "title": title or f"{name}: motion plan",
        "block": block_of(subjects),
        "robots": parts.robots,
        "meshes": parts.meshes.items,
        "views": views,
        "sections": [],
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


def _measure(subject: Subject) -> _Measured:
    """Compute what a page shows of a motion over time."""
    trajectory = subject.trajectory
    if trajectory is None:
        return _Measured(subject, None, None, None, ())
    t = instants_of(trajectory)
    at = sampled(trajectory, t)
    try:
        motion = MeasuredMotion(subject.scene, trajectory)
        if motion.is_free:
            return _Measured(subject, at, None, None, ("nothing is in the way: there are no clearances to show",))
        found = motion.over(t)
        some = np.linspace(0.0, trajectory.duration, INSTANTS if trajectory.duration > 0 else 1)
        closest = motion.closest(some)
    except SpacearmError as error:
        return _Measured(subject, at, None, None, (f"clearances were not measured: {error}",))
    return _Measured(subject, at, found, closest, ())


def _view(one: _Measured, parts: _Parts) -> Data:
    """Return a view of one motion."""
    subject, at, trajectory = one.subject, one.at, one.subject.trajectory
    notes = list(one.notes)
    robot = parts.robot(subject.robot)
    obstacles = obstacles_data(subject.scene, parts.meshes)
    knots = _knots(subject, notes)
    plots: list[Data] = []
    if one.clearances is not None:
        plots.append(clearance_plot(one.clearances, asked=subject.asked, proven=subject.proven))
    if at is not None and trajectory is not None:
        plots += [*joint_plots(trajectory, at), *tool_plots(trajectory, at), *base_plots(trajectory, at, subject.base_limits)]
    notes += parts.meshes.said()
    view: Data = {
        "name": subject.name,
        "verdict": verdict_of(subject),
        "clock": {"unit": "s", "duration": 0.0 if trajectory is None else float(trajectory.duration)},
        "actors": [{"name": subject.name, "robot": robot, "knots": knots, "tone": 0, "ghost": False}],
        "obstacles": obstacles,
        "targets": targets_data(subject.robot, subject.start, subject.goal, subject.base_start, trajectory),
        "plots": plots,
        "sections": sections_of(subject, at, drawn=notes, closest=_closest_in_words(one)),
    }
    return view if one.closest is None else view | {"closest": one.closest.data()}


def _knots(subject: Subject, notes: list[str]) -> Data:
    if subject.trajectory is not None:
        return knots_of(subject.trajectory, notes)
    q = np.zeros(subject.robot.dof) if subject.start is None else subject.start
    return resting_knots(q, subject.base_start)


def _closest_in_words(one: _Measured) -> str:
    found = one.closest
    if found is None:
        return ""
    i = int(np.argmin(found.distance))
    return f"{mm(float(found.distance[i]))} at t = {found.t[i]:.4g} s, {found.names[int(found.pair[i])]}, at {len(found.t)} instants"
