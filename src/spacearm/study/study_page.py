"""The report page of a study of your own: its tables, a curve of each value over the one that is varied, records, and plans.

A field of the records that holds a plan as `plan_as_dict` gives it is shown in space.
"""

from __future__ import annotations

import dataclasses
import math
import os
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spacearm.core.checks import shown
from spacearm.core.errors import SettingsError, nearest
from spacearm.core.output import require_writable, write_out
from spacearm.core.version import version
from spacearm.files.plan_file import KEY as PLAN_KEY
from spacearm.files.plan_file import saved_plan_from_dict
from spacearm.report.report_page import page_html, plot, section, series
from spacearm.report.report_plan import report_of_plans
from spacearm.report.report_views import flat_view, take_views, verdict
from spacearm.study.study_tables import Table

Data = dict[str, Any]
Array = NDArray[np.float64]

MOST_ROWS = 500
"""Records that the page lists; all of them are in the file of records."""

MOST_PLANS = 8
"""Plans that it shows in space."""


def save_study_report(
    path: str | os.PathLike[str],
    records: Mapping[str, Any],
    *,
    title: str,
    by: str = "",
    units: Mapping[str, tuple[float, str]] | None = None,
    tables: Sequence[Table] = (),
    notes: Sequence[str] = (),
    command: str = "",
    overwrite: bool = False,
) -> None:
    """Write the report page of a study: one HTML file that needs nothing else.

    Args:
        path: of the page, as study.html.
        records: each by the name of its task: dataclasses of one class.
        title: of the page.
        by: the field that was varied: its number is the x of the curves; "": no curves.
        units: of fields with a unit, a factor and the unit to show them in, as {"clearance": (1e3, "mm")}.
        tables: that stand first.
        notes: what is to be known beside them.
        command: that makes the page again.
        overwrite: replace a file that is there.

    Raises:
        SettingsError: no records, or no such field.
        OutputError: the file exists already, or cannot be written.
    """
    require_writable(path, overwrite=overwrite)
    page = study_page(records, title=title, by=by, units=units, tables=tables, notes=notes, command=command)
    write_out(path, page_html(page), overwrite=overwrite)


def study_page(
    records: Mapping[str, Any],
    *,
    title: str,
    by: str = "",
    units: Mapping[str, tuple[float, str]] | None = None,
    tables: Sequence[Table] = (),
    notes: Sequence[str] = (),
    command: str = "",
) -> Data:
    """Return the page of a study, as `web/src/data.ts` describes it; see `save_study_report`."""
    if not records:
        raise SettingsError("records is empty, expected the records of a study by the names of its tasks; run the study first")
    units = units or {}
    names = _fields(next(iter(records.values())))
    if by and by not in names:
        raise SettingsError(f"by is {shown(by)}, expected a field of the records; {nearest(by, names)}")
    plans = {task: found for task, record in records.items() if (found := _plan_of(record)) is not None}
    plain = [name for name in names if not any(_is_plan(getattr(record, name)) for record in records.values())]
    overview = flat_view(
        "Overview",
        verdict("plain", f"{len(records)} tasks", _about(records, plans)),
        plots=_curves(list(records.values()), by, plain, units) if by else [],
        sections=[
            *(section(table.title, table=(table.header, table.rows), opened=True) for table in tables),
            *([section("What is to be known", notes=list(notes), opened=True)] if notes else []),
            _records_section(records, plain, units),
            *([section("Make it again", code=command, opened=True)] if command else []),
        ],
    )
    block = [["records", str(len(records))], ["varied", by or "-"], ["made with", f"spacearm {version()}"]]
    page: Data = {"title": title, "block": block, "robots": [], "meshes": [], "views": [overview], "sections": []}
    for task, values in list(plans.items())[:MOST_PLANS]:
        page["views"] += take_views(page, report_of_plans(saved_plan_from_dict(values, task), names=[task]))
    return page


def _about(records: Mapping[str, Any], plans: Mapping[str, Data]) -> str:
    if not plans:
        return "The records hold no plans, so nothing is shown in space."
    if len(plans) > MOST_PLANS:
        return f"{len(plans)} of the {len(records)} records hold a plan; the first {MOST_PLANS} are shown in space."
    return f"{len(plans)} of the {len(records)} records hold a plan, which a view of its own shows in space."


def _fields(record: Any) -> list[str]:
    if not dataclasses.is_dataclass(record):
        raise SettingsError(f"a record is {shown(record)}, expected a dataclass, as a study's records are")
    return [field.name for field in dataclasses.fields(record)]


def _is_plan(value: Any) -> bool:
    return isinstance(value, dict) and PLAN_KEY in value


def _plan_of(record: Any) -> Data | None:
    """Return the first plan with a motion that a record holds."""
    values = (getattr(record, name) for name in _fields(record))
    return next((value for value in values if _is_plan(value) and value.get("motion") is not None), None)


# ---- curves ------------------------------------------------------------------------------------------------------------


def _curves(records: Sequence[Any], by: str, names: Sequence[str], units: Mapping[str, tuple[float, str]]) -> list[Data]:
    """Return a plot of each field of numbers over the varied one: least, mean and greatest at each of its values."""
    x = np.array([_number(getattr(record, by)) for record in records])
    at = np.unique(x[np.isfinite(x)])
    if not len(at):
        return []
    scale, x_unit = units.get(by, (1.0, ""))
    plots: list[Data] = []
    for name in names:
        factor, unit = units.get(name, (1.0, ""))
        y = factor * np.array([_number(getattr(record, name)) for record in records])
        if name == by or not np.isfinite(y).any():
            continue
        low, middle, high = _spread(x, y, at)
        curves = [series("greatest", high, 1, dashed=True), series("mean", middle, 0), series("least", low, 1, dashed=True)]
        label = f"{by} [{x_unit}]" if x_unit else by
        counts = [int(np.count_nonzero((x == value) & np.isfinite(y))) for value in at]
        note = f"of {min(counts)} to {max(counts)} records at each value" if min(counts) < max(counts) else ""
        note = note or f"of {counts[0]} record{'s' if counts[0] > 1 else ''} at each value"
        plots.append(plot(name, name.replace("_", " "), unit, scale * at, curves, x_label=label, clock=False, note=note))
    return plots


def _spread(x: Array, y: Array, at: Array) -> tuple[Array, Array, Array]:
    """Return the least, the mean and the greatest of y at each x; nan where there is none."""
    out = np.full((3, len(at)), math.nan)
    for i, value in enumerate(at):
        there = y[(x == value) & np.isfinite(y)]
        if len(there):
            out[:, i] = there.min(), there.mean(), there.max()
    return out[0], out[1], out[2]


def _number(value: Any) -> float:
    return float(value) if isinstance(value, (int, float)) and not isinstance(value, bool) else math.nan


# ---- records -----------------------------------------------------------------------------------------------------------


def _records_section(records: Mapping[str, Any], names: Sequence[str], units: Mapping[str, tuple[float, str]]) -> Data:
    header = ["task", *(f"{name} [{units[name][1]}]" if name in units else name for name in names)]
    rows = [
        [task, *(_cell(getattr(record, name), units.get(name, (1.0, ""))[0]) for name in names)]
        for task, record in list(records.items())[:MOST_ROWS]
    ]
    left = len(records) - len(rows)
    return section("Records", table=(header, rows), notes=[f"{left} more are in the file of records"] if left else [])


def _cell(value: Any, factor: float) -> str:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return "-" if value is None else str(value) if len(str(value)) <= 60 else f"{str(value)[:57]}..."
    scaled = factor * value
    return str(scaled) if isinstance(scaled, int) else f"{scaled:.5g}"
