"""Several motions beside each other: the first one solid, the others pale, their curves together, their figures in a table."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from spacearm.geometry.scene import scene_as_list
from spacearm.report.report_clearance import ClosestPairs, PairClearances
from spacearm.report.report_curves import Sampled, floor_of, turned_since_start
from spacearm.report.report_page import plot, section, series
from spacearm.report.report_sections import figures_of, mm, verdict_of
from spacearm.report.report_subject import Subject

Array = NDArray[np.float64]
Data = dict[str, Any]

INSTANTS = 601
_MOST_JOINTS = 16  # that have a plot of their own
_DEGREE = math.degrees(1.0)


class MeasuredSubject(NamedTuple):
    """A motion with what was computed of it.

    Attributes:
        subject: the motion.
        at: it at instants; None: there is no motion.
        clearances, closest: what was measured; None: there are no pairs, or it could not be.
        notes: why not.
        knots: as the page reads them.
        robot: the place of its robot on the page.
    """

    subject: Subject
    at: Sampled | None
    clearances: PairClearances | None
    closest: ClosestPairs | None
    notes: tuple[str, ...]
    knots: Data
    robot: int

    @property
    def duration(self) -> float:
        """[s]; 0 if there is no motion."""
        return 0.0 if self.subject.trajectory is None else float(self.subject.trajectory.duration)


def comparison(motions: Sequence[MeasuredSubject], *, obstacles: list[Data], targets: list[Data]) -> Data:
    """Return the view of several motions beside each other; obstacles and targets are those of the first one."""
    first = motions[0]
    view: Data = {
        "name": "Side by side",
        "verdict": _verdict(motions),
        "clock": {"unit": "s", "duration": max(one.duration for one in motions)},
        "actors": [
            {"name": one.subject.name, "robot": one.robot, "knots": one.knots, "tone": i, "ghost": i > 0}
            for i, one in enumerate(motions)
        ],
        "obstacles": obstacles,
        "targets": targets,
        "plots": _plots(motions),
        "sections": [_table(motions), *_differences(motions)],
    }
    return view if first.closest is None else view | {"closest": first.closest.data()}


def _verdict(motions: Sequence[MeasuredSubject]) -> dict[str, str]:
    good = sum(one.subject.good for one in motions)
    count = len(motions)
    said = "; ".join(f"{one.subject.name}: {verdict_of(one.subject)['headline'].lower()}" for one in motions)
    files = " That is what the files say; they were not proven again." if any(one.subject.from_file for one in motions) else ""
    notes = _different(motions)
    few = len(notes) <= 2
    differ = (
        "".join(f" {note}" for note in notes) if few else f" The problems of {len(notes)} motions differ from the first one's."
    )
    headline = (
        f"{good} of {count} motions {'is' if good == 1 else 'are'} proven" if good else f"None of {count} motions is proven"
    )
    if good == count:
        headline = "Both motions are proven" if count == 2 else f"All {count} motions are proven"
    tone = "good" if good == count else "plain" if good else "bad"
    return {"tone": tone, "headline": headline, "text": f"{said}.{files}{differ}"}


def _differences(motions: Sequence[MeasuredSubject]) -> list[Data]:
    """Return the section that says in what the problems differ, if they do."""
    notes = _different(motions)
    return [section("Differences between the problems", notes=notes, opened=True)] if notes else []


def _different(motions: Sequence[MeasuredSubject]) -> list[str]:
    """Say in what the problems differ, for what the picture shows is the first one's."""
    first, notes = motions[0].subject, list[str]()
    scene = scene_as_list(first.scene)
    for one in motions[1:]:
        subject, differs = one.subject, list[str]()
        if subject.scene is not first.scene and scene_as_list(subject.scene) != scene:
            differs.append("other obstacles")
        if subject.robot.dof_names != first.robot.dof_names:
            differs.append("another robot")
        if first.start is not None and subject.start is not None and not np.array_equal(subject.start, first.start):
            differs.append("another start")
        if subject.asked != first.asked:
            differs.append(f"another clearance ({mm(subject.asked)}, not {mm(first.asked)})")
        if differs:
            notes.append(
                f"'{subject.name}' has {', '.join(differs)} than '{first.name}'; this view shows those of '{first.name}'."
            )
    return notes


def _table(motions: Sequence[MeasuredSubject]) -> Data:
    """Return the figures of all motions in a table."""
    columns = [_figures(one) for one in motions]
    names = list(dict.fromkeys(name for column in columns for name in column))
    rows = [[name, *(column.get(name, "-") for column in columns)] for name in names]
    return section("Side by side", table=(["", *(one.subject.name for one in motions)], rows), opened=True)


def _figures(one: MeasuredSubject) -> dict[str, str]:
    subject = one.subject
    certificate = subject.certificate or {}
    out = {"result": verdict_of(subject)["headline"], "base": subject.base, "clearance asked for": mm(subject.asked)}
    out["clearance proven"] = (
        "none" if not subject.good else "nothing in the way" if subject.proven is None else mm(subject.proven)
    )
    if one.clearances is not None:
        out["closest measured"] = mm(float(one.clearances.least.min()))
    if one.at is not None and subject.trajectory is not None:
        out |= dict(figures_of(subject, one.at))
        margins = subject.trajectory.margins(subject.robot)
        out["greatest rate, of its limit"] = f"{float(margins.velocity.max()):.1%}"
        share = float(margins.acceleration.max())
        out["greatest acceleration, of its limit"] = f"{share:.1%}" if math.isfinite(share) else "unbounded"
    base = certificate.get("base")
    if isinstance(base, dict):
        out["base turned at the end"] = f"{math.degrees(base['rotation_final_rad']):.4g} deg"
        out["base turned at most"] = f"{math.degrees(base['rotation_peak_at_most_rad']):.4g} deg"
        out["base rate at most"] = f"{math.degrees(base['rate_at_most_rad_s']):.4g} deg/s"
        out["joint momentum at most"] = f"{base['joint_momentum_at_most_n_m_s']:.4g} N m s"
    if subject.seed is not None:
        out["seed"] = str(subject.seed)
    if subject.evaluations is not None:
        out["motions looked at"] = f"{subject.evaluations:,}"
    return out


# ---- Curves ----------------------------------------------------------------------------------------------------------


def _plots(motions: Sequence[MeasuredSubject]) -> list[Data]:
    moving = [(i, one) for i, one in enumerate(motions) if one.at is not None]
    if not moving:
        return []
    t = np.linspace(0.0, max(one.duration for _, one in moving), INSTANTS)
    return [*_clearance(t, moving), *_tool(t, moving), *_base(t, moving), *_joints(t, moving)]


def _over(t: Array, one: MeasuredSubject, own: Array, values: Array) -> Array:
    """Return values at other instants; nan after the motion's end."""
    return np.where(t <= one.duration * (1 + 1e-12), np.interp(t, own, values), np.nan)


def _curves(t: Array, moving: Sequence[tuple[int, MeasuredSubject]], value: Any) -> list[Data]:
    """Return a curve of each motion; value: gives the values (m,) of one at the instants of its `at`."""
    out: list[Data] = []
    for i, one in moving:
        assert one.at is not None
        out.append(series(one.subject.name, _over(t, one, one.at.t, value(one)), i))
    return out


def _clearance(t: Array, moving: Sequence[tuple[int, MeasuredSubject]]) -> list[Data]:
    measured = [(i, one, one.clearances) for i, one in moving if one.clearances is not None]
    if not measured:
        return []
    curves = [series(one.subject.name, _over(t, one, found.t, found.least * 1e3), i) for i, one, found in measured]
    asked = sorted({one.subject.asked for _, one, _ in measured} - {0.0})
    lines = [(value * 1e3, f"asked for: {mm(value)}") for value in asked]
    floor = floor_of(np.concatenate([found.least * 1e3 for _, _, found in measured]))
    return [plot("clearance", "Closest of all pairs", "mm", t, curves, log=True, floor=floor, lines=lines)]


def _tool(t: Array, moving: Sequence[tuple[int, MeasuredSubject]]) -> list[Data]:
    speed = _curves(t, moving, lambda one: np.linalg.norm(one.at.velocity, axis=1) * 1e3)
    rate = _curves(t, moving, lambda one: np.linalg.norm(one.at.omega, axis=1) * _DEGREE)
    return [
        plot("tool-speed", "Speed of the end effector", "mm/s", t, speed),
        plot("tool-rate", "Angular speed of the end effector", "deg/s", t, rate),
    ]


def _base(t: Array, moving: Sequence[tuple[int, MeasuredSubject]]) -> list[Data]:
    floating = [(i, one) for i, one in moving if one.subject.trajectory and one.subject.trajectory.base_model.follows_arm]
    if not floating:
        return []

    def angle(one: MeasuredSubject) -> Array:
        assert one.at is not None
        return np.linalg.norm(turned_since_start(one.at.base_R), axis=1) * _DEGREE

    return [plot("base-angle", "Base: angle from the start", "deg", t, _curves(t, floating, angle))]


def _joints(t: Array, moving: Sequence[tuple[int, MeasuredSubject]]) -> list[Data]:
    """Return a plot for each joint that all motions have."""
    robot = moving[0][1].subject.robot
    if any(one.subject.robot.dof_names != robot.dof_names for _, one in moving):
        return []
    out: list[Data] = []
    for i, name in enumerate(robot.dof_names[:_MOST_JOINTS]):
        factor, unit = (1e3, "mm") if robot.is_prismatic(i) else (_DEGREE, "deg")
        curves = _curves(t, moving, lambda one, i=i, factor=factor: one.at.q[:, i] * factor)
        limits = [(k, float(robot.lower[i]) * factor, float(robot.upper[i]) * factor) for k in range(len(curves))]
        out.append(plot(f"joint-{i}", f"Joint {name}", unit, t, curves, limits=limits))
    return out
