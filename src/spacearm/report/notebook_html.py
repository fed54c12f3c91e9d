"""What notebooks show of our values: a few rows, tables, and of what moves the 3-D report, all in the output itself.

The package root registers `html_of` (`core.notebook_hook`); nothing of it is loaded before a notebook asks. Styles are inline,
and colours those of the notebook, so that light and dark themes stay as they are; nothing is fetched. Jupyter keeps the printed
text beside the HTML, for exports that leave HTML out.
"""

from __future__ import annotations

import html
import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from spacearm.core.brief import Rows, counted, in_short, words
from spacearm.core.errors import SpacearmError
from spacearm.doctor import Diagnosis
from spacearm.geometry import Scene
from spacearm.planner import ParetoFront, Plan, Problem
from spacearm.proof import Certificate, Robustness
from spacearm.robot import Robot

HEIGHT = 640
"""[px] of a report in a notebook; it is as wide as the output."""

_LISTED = 20  # rows of a table
_LINE = "1px solid rgba(128,128,128,.35)"
_CELL = f"text-align:left;vertical-align:top;padding:2px 14px 2px 0;border:0;border-bottom:{_LINE};background:none"
_GRID = "border-collapse:collapse;border:0;margin:6px 0"
_TONES = {True: "#009E73", False: "#D55E00", None: "inherit"}  # of Okabe and Ito (2008); what they say is said in words too


def html_of(value: Any) -> str:
    """Return the HTML of a value that has rows (`in_short`)."""
    headline, rows = in_short(value)
    parts = [_head(headline, good=_is_good(value))]
    if isinstance(value, (Plan, Robot)) or hasattr(value, "trajectory"):
        parts += [_verdict(value), _report(value)]
    said_above = value.message if isinstance(value, Plan) else ""
    parts.append(_rows([row for row in rows if row[1] != said_above]))
    parts += [_table(*table) for table in _tables(value)]
    return f'<div class="spacearm" style="font-size:13px;line-height:1.45">{"".join(parts)}</div>'


def _is_good(value: Any) -> bool | None:
    if isinstance(value, Plan):
        return value.found
    if isinstance(value, Certificate):
        return value.holds
    return value.healthy if isinstance(value, Diagnosis) else None


def _head(headline: str, *, good: bool | None) -> str:
    mark = f"border-left:4px solid {_TONES[good]};padding-left:8px" if good is not None else ""
    return f'<div style="font-weight:600;margin:4px 0;{mark}">{html.escape(headline)}</div>'


def _rows(rows: Rows) -> str:
    cells = "".join(
        f'<tr style="background:none"><th style="{_CELL};font-weight:600;white-space:nowrap">{html.escape(name)}</th>'
        f'<td style="{_CELL}">{html.escape(words(text, 1000))}</td></tr>'
        for name, text in rows
    )
    return f'<table style="{_GRID}">{cells}</table>'


def _table(title: str, header: Sequence[str], rows: Sequence[Sequence[str]], more: int) -> str:
    top = "".join(f'<th style="{_CELL};font-weight:600">{html.escape(name)}</th>' for name in header)
    lines = "".join(
        '<tr style="background:none">' + "".join(f'<td style="{_CELL}">{html.escape(cell)}</td>' for cell in row) + "</tr>"
        for row in rows
    )
    rest = f"<div>and {counted(more, 'more row')}, left out here</div>" if more > 0 else ""
    return (
        f'<details open><summary style="cursor:pointer;font-weight:600;margin:4px 0">{html.escape(title)}</summary>'
        f'<div style="overflow-x:auto"><table style="{_GRID}"><thead><tr>{top}</tr></thead>'
        f"<tbody>{lines}</tbody></table></div>{rest}</details>"
    )


# ---- The report ------------------------------------------------------------------------------------------------------


def _verdict(value: Any) -> str:
    said = value.message if isinstance(value, Plan) else ""
    return f'<div style="margin:2px 0 6px;max-width:110ch">{html.escape(said)}</div>' if said else ""


def _report(value: Any) -> str:
    """Return the 3-D report in a frame of its own, and how large it is; a sentence where there is none."""
    if isinstance(value, Certificate):
        return ""  # its plan shows it
    try:
        page = _page(value)
    except SpacearmError as error:
        return f"<div>There is no 3-D picture of it: {html.escape(str(error))}</div>"
    content = html.escape(page, quote=True)
    keep = "" if isinstance(value, Robot) else "; spacearm.save_report(plan, 'report.html') keeps it as a file"
    return (
        f'<iframe srcdoc="{content}" width="100%" height="{HEIGHT}" title="3-D report" '
        f'style="border:{_LINE};border-radius:4px;display:block;width:100%;height:{HEIGHT}px"></iframe>'
        f'<div style="opacity:.75;margin:2px 0 6px">The 3-D report is part of this output, {len(content) / 1e6:.2f} MB, '
        f"and needs no network{html.escape(keep)}.</div>"
    )


def _page(value: Any) -> str:
    from spacearm.report.report_page import page_html

    if isinstance(value, Robot):
        return page_html(_standing(value))
    from spacearm.report.report_plan import report_of_plans

    page = report_of_plans(value)
    return page_html({**page, "block": []})  # the rows below the frame tell it, and the player has its room


def _standing(robot: Robot) -> dict[str, Any]:
    """Return the page of a robot that stands in its first named configuration, or amid its limits."""
    from spacearm.report.report_knots import resting_knots
    from spacearm.report.report_meshes import Meshes
    from spacearm.report.report_scene import robot_data
    from spacearm.report.report_visuals import visual_parts

    headline = in_short(robot)[0]
    if robot.configurations:
        q, how = robot.configurations[0].q, f"in its configuration '{robot.configurations[0].name}'"
    else:
        limits = np.clip(np.stack([robot.lower, robot.upper]), -math.pi, math.pi)
        q, how = np.clip(np.zeros(robot.dof), *limits), "with its joints at 0, or at the limit nearest to 0"
    meshes = Meshes()
    actor = {"name": robot.name, "robot": 0, "knots": resting_knots(q, np.eye(4)), "tone": 0, "ghost": False}
    view = {
        "name": robot.name,
        "verdict": {"tone": "plain", "headline": headline, "text": f"It stands {how}."},
        "clock": {"unit": "s", "duration": 0.0},
        "actors": [actor],
        "obstacles": [],
        "targets": [],
        "plots": [],
        "sections": [],
    }
    robots = [robot_data(robot, meshes, visual_parts(robot, meshes))]
    return {
        "title": robot.name,
        "block": [],
        "robots": robots,
        "meshes": meshes.items,
        "views": [view],
        "sections": [],
    }


# ---- Tables ----------------------------------------------------------------------------------------------------------

Table = tuple[str, Sequence[str], list[list[str]], int]
"""Title, header, rows, and how many rows are left out."""


def _tables(value: Any) -> list[Table]:
    if isinstance(value, Robot):
        return [_of_joints(value)]
    if isinstance(value, Scene):
        return [_of_obstacles(value)] if value.obstacles else []
    if isinstance(value, Problem):
        return [_of_obstacles(value.scene)] if value.scene.obstacles else []
    if isinstance(value, Diagnosis):
        return [_of_findings(value)] if value.findings else []
    if isinstance(value, Robustness):
        return [_of_tubes(value)] if value.singly else []
    return [_of_plans(value)] if isinstance(value, ParetoFront) and value.plans else []


def _of_joints(robot: Robot) -> Table:
    rows = []
    for i, name in enumerate(robot.dof_names[:_LISTED]):
        scale, unit = (1.0, "m") if robot.is_prismatic(i) else (math.degrees(1.0), "deg")
        limits = (robot.lower[i], robot.upper[i], robot.velocity[i], robot.acceleration[i])
        rows.append([words(name, 40), unit, *(f"{value * scale:.5g}" for value in limits)])
    header = ["joint", "unit", "from", "to", "speed, per s", "acceleration, per s²"]
    return "Limits", header, rows, robot.dof - len(rows)


def _of_obstacles(scene: Scene) -> Table:
    rows = [
        [scene.called(i), type(item).__name__, words(repr(item).partition("(")[2].removesuffix(")"), 90)]
        for i, item in enumerate(scene.obstacles[:_LISTED])
    ]
    return "Obstacles", ["obstacle", "shape", "measures [m]"], rows, len(scene.obstacles) - len(rows)


def _of_findings(found: Diagnosis) -> Table:
    rows = [
        [one.severity, one.code, words(one.place, 40), words(one.what, 200), words(one.advice, 200)]
        for one in found.findings[:_LISTED]
    ]
    return "Findings", ["severity", "kind", "place", "what", "advice"], rows, len(found.findings) - len(rows)


def _of_tubes(found: Robustness) -> Table:
    tubes = [found.together, *found.singly][: _LISTED + 1]
    rows = [
        ["all together" if i == 0 else words(tube.joints[0], 40), f"{tube.tracking:.4g}", words(tube.limited_by, 200)]
        for i, tube in enumerate(tubes)
    ]
    left = 1 + len(found.singly) - len(rows)
    return "Tracking errors that are proven", ["joint", "within [rad or m]", "a wider one is limited by"], rows, left


def _of_plans(front: ParetoFront) -> Table:
    unit = "deg/s" if front.measure == "rate" else "deg"
    turns = np.degrees(front.disturbances)
    rows = [
        [f"{i}", f"{front.durations[i]:.4g}", f"{turns[i]:.4g}", "yes" if front.best[i] else ""]
        for i in range(min(len(front.plans), _LISTED))
    ]
    return (
        "Plans",
        ["plan", "duration [s]", f"base, {front.measure} [{unit}]", "on the front"],
        rows,
        len(front.plans) - len(rows),
    )
