"""All methods beside each other: the fitness of every run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from spacearm.errors import SettingsError
from spacearm.show.style import (
    BLACK,
    BLUE,
    COLUMN,
    GREEN,
    GREY,
    ORANGE,
    SMALL,
    VERMILION,
    figure_of,
    legend_below,
    look,
    new_figure,
    tidy,
)
from spacearm.swarm import SwarmResult

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array = NDArray[np.float64]

_GOLDEN = 0.6180339887498949  # multiples of it, modulo 1, fill an interval evenly


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ComparedMethod:
    """A method's runs, and what the paper reports for it.

    Attributes:
        name: of the method.
        runs: its results.
        reported: the paper's best, mean and worst fitness; None where it reports none.
    """

    name: str
    runs: Sequence[SwarmResult]
    reported: tuple[float, float, float] | None = None


def figure_comparison(
    rows: Sequence[ComparedMethod],
    *,
    title: str = "",
    best_known: float | None = None,
    threshold: float | None = None,
    ax: Axes | None = None,
) -> Figure:
    """Draw the fitness of every feasible run by method, with quartiles, and what the paper reports.

    Args:
        rows: the methods, from the top down.
        title: above the axes.
        best_known: the best known fitness.
        threshold: the fitness to be reached.
        ax: to draw in; a new figure unless given.

    Raises:
        SettingsError: no methods.
    """
    if not rows:
        raise SettingsError("rows is empty, expected one or more methods")
    with look():
        ax = new_figure(COLUMN * 1.4, 1.0 + 0.46 * len(rows)).add_subplot() if ax is None else ax
        for y, row in enumerate(rows):
            _row(ax, y, row)
        _references(ax, best_known, threshold)
        tidy(ax, grid="x")
        ax.set_ylim(len(rows) - 0.5, -0.5)
        ax.set_yticks(range(len(rows)), [row.name for row in rows])
        ax.tick_params(axis="y", length=0)
        ax.margins(x=0.06)
        ax.set_xlabel("fitness $F$ of the best found (less is better)")
        ax.set_title(title, loc="left", pad=12)
        _legend(ax, reported=any(row.reported is not None for row in rows))
        return figure_of(ax)


def _row(ax: Axes, y: int, row: ComparedMethod) -> None:
    values = np.sort([run.fitness for run in row.runs if run.success])
    if values.size:
        low, middle, high = np.quantile(values, [0.25, 0.5, 0.75])
        ax.barh(y - 0.06, high - low, left=low, height=0.4, color=BLUE, alpha=0.15, linewidth=0)
        ax.plot([middle, middle], [y - 0.26, y + 0.14], color=BLACK, linewidth=1.4, solid_capstyle="butt", zorder=3)
        spread = (np.arange(len(values)) * _GOLDEN) % 1.0 - 0.5
        ax.scatter(values, y - 0.06 + 0.3 * spread, s=9, color=BLUE, alpha=0.65, linewidths=0, zorder=2.5)
    infeasible = len(row.runs) - values.size
    if infeasible:
        ax.annotate(
            f"{infeasible} of {len(row.runs)}\nnot feasible",
            (1.0, y),
            xycoords=("axes fraction", "data"),
            xytext=(4, 0),
            textcoords="offset points",
            va="center",
            fontsize=SMALL,
            color=GREY,
        )
    if row.reported is not None:
        best, mean, worst = row.reported
        at = y + 0.31
        ax.plot([best, worst], [at, at], color=ORANGE, linewidth=1.2, marker="|", markersize=5, zorder=2.2)
        ax.plot(mean, at, "D", color=ORANGE, markersize=3.6, zorder=2.3)


def _references(ax: Axes, best_known: float | None, threshold: float | None) -> None:
    """Draw the lines with their labels above; the lesser's to the left, the greater's to the right, so that both fit."""
    given = [(value, name) for value, name in ((best_known, "best known"), (threshold, "threshold")) if value is not None]
    sides = ["center"] if len(given) == 1 else ["right", "left"]
    for (value, name), side in zip(sorted(given), sides, strict=False):
        color = GREEN if name == "best known" else VERMILION
        ax.axvline(value, color=color, linewidth=0.9, linestyle=(0, (5, 2)), zorder=1.5)
        ax.annotate(
            f"{name} {value:.4g}",
            (value, 1.0),
            xycoords=("data", "axes fraction"),
            xytext=({"right": 12, "center": 0, "left": -12}[side], 2),
            textcoords="offset points",
            color=color,
            fontsize=SMALL,
            ha=side,
            va="bottom",
        )


def _legend(ax: Axes, *, reported: bool) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    handles: list[Line2D | Patch] = [
        Line2D([], [], color=BLUE, marker="o", markersize=3, linestyle="", label="a run"),
        Patch(facecolor=BLUE, alpha=0.15, label="quartiles"),
        Line2D([], [], color=BLACK, linewidth=1.4, label="median"),
    ]
    if reported:
        label = "reported: best, mean, worst"
        handles.append(Line2D([], [], color=ORANGE, marker="D", markersize=3.6, linewidth=1.2, label=label))
    legend_below(ax, len(handles), handles=handles)
