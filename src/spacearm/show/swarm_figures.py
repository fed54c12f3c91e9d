"""Fitness over the iterations (the paper's Figs. 4 and 7)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from spacearm.core.errors import ProblemError, SettingsError
from spacearm.planner.pareto import ParetoFront
from spacearm.show.figure_style import (
    BLACK,
    BLUE,
    COLUMN,
    GREEN,
    GREY,
    ORANGE,
    SKY,
    SMALL,
    VERMILION,
    figure_of,
    label_right,
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

DASHED = (0, (1.2, 1.6))  # of what is not feasible yet


_GOLDEN = 0.6180339887498949  # multiples of it, modulo 1, fill an interval evenly
_SAYS = {
    "peak": "greatest angle of the base [deg]",
    "final": "angle of the base at the end [deg]",
    "rate": "greatest rate of the base [deg/s]",
}


def figure_convergence(
    result: SwarmResult | Sequence[SwarmResult],
    ax: Axes | None = None,
    *,
    title: str = "",
    reported: float | None = None,
    best_known: float | None = None,
    threshold: float | None = None,
) -> Figure:
    """Draw the fitness of the swarm's best over the iterations, run by run.

    The swarm judges feasible first, so a curve may rise until it is feasible; until then it is pale and dotted. The
    median and the quartiles are those of all runs, with what is not feasible yet counted as the worst.

    Args:
        result: a run, or several of one method; they may have stopped after different numbers of iterations.
        ax: to draw in; a new figure unless given.
        title: above the axes.
        reported: the best fitness that the paper reports.
        best_known: the best known fitness.
        threshold: the fitness to be reached.

    Raises:
        SettingsError: no runs, or matplotlib is not installed.
    """
    runs = [result] if isinstance(result, SwarmResult) else list(result)
    if not runs:
        raise SettingsError("runs is empty, expected the results of one or more runs")
    with look():
        ax = new_figure(COLUMN, 2.9).add_subplot() if ax is None else ax
        fitness, feasible = _tables(runs)
        x = np.arange(1, fitness.shape[1] + 1)
        best = min(range(len(runs)), key=lambda i: (runs[i].violation, runs[i].fitness))
        for row in range(len(runs)):
            if row != best:
                _curve(ax, x, fitness[row], feasible[row], GREY, 0.5, alpha=0.6, label="a run")
        if len(runs) > 2:
            _quartiles(ax, x, np.where(feasible, fitness, np.inf))
        _curve(ax, x, fitness[best], feasible[best], BLUE, 1.6, label="best run")
        tidy(ax)
        _limits(ax, x, fitness, feasible, [reported, best_known, threshold])
        _references(ax, reported=reported, best_known=best_known, threshold=threshold)
        ax.set_xlabel("iteration")
        ax.set_ylabel("fitness $F$ of the swarm's best")
        ax.set_title(title, loc="left")
        _legend(ax, infeasible=not feasible.all())
        return figure_of(ax)


def iteration_axis(ax: Axes, iterations: int, *, ticks: int) -> None:
    """Set the x axis to whole iterations, from the first to the last, with about this number of ticks."""
    from matplotlib.ticker import MaxNLocator

    ax.set_xlim((0.5, 1.5) if iterations == 1 else (1, iterations))
    ax.xaxis.set_major_locator(MaxNLocator(ticks, integer=True, steps=[1, 2, 2.5, 5, 10]))


def carried_on(values: Array, length: int) -> Array:
    """Return a history (T,) as (length,): a run that stopped keeps its last value."""
    return np.concatenate([values, np.repeat(values[-1:], length - len(values))])


def infeasible_part(values: Array, feasible: NDArray[np.bool_]) -> Array:
    """Return the values where they are not feasible and right after, so that the curve has no gap; NaN elsewhere."""
    shown = ~feasible
    shown[1:] |= ~feasible[:-1]
    return np.where(shown, values, np.nan)


def _tables(runs: Sequence[SwarmResult]) -> tuple[Array, NDArray[np.bool_]]:
    """Return fitness and feasibility, (runs, T) each; a fitness that is not finite is NaN."""
    length = max(len(run.history.fitness) for run in runs)
    fitness = np.array([carried_on(run.history.fitness, length) for run in runs])
    violation = np.array([carried_on(run.history.violation, length) for run in runs])
    finite = np.isfinite(fitness)
    return np.where(finite, fitness, np.nan), (violation <= 0) & finite


def _curve(
    ax: Axes,
    x: NDArray[np.int64],
    y: Array,
    feasible: NDArray[np.bool_],
    color: str,
    width: float,
    *,
    label: str,
    alpha: float = 1.0,
) -> None:
    marker = "o" if len(x) == 1 else ""
    common: dict[str, Any] = {"drawstyle": "steps-post", "color": color, "marker": marker, "markersize": 3}
    pale = {"linestyle": DASHED, "alpha": alpha * 0.6 if alpha < 1 else 0.8, "linewidth": min(width, 1.0), "label": "_"}
    ax.plot(x, infeasible_part(y, feasible), **common, **pale)
    ax.plot(x, np.where(feasible, y, np.nan), alpha=alpha, linewidth=width, label=label, **common)


def _quartiles(ax: Axes, x: NDArray[np.int64], ranked: Array) -> None:
    low, middle, high = np.quantile(ranked, [0.25, 0.5, 0.75], axis=0, method="inverted_cdf")
    band = np.isfinite(high)
    ax.fill_between(x, low, np.where(band, high, low), where=band, step="post", color=SKY, alpha=0.3, lw=0, label="quartiles")
    ax.plot(x, np.where(np.isfinite(middle), middle, np.nan), drawstyle="steps-post", color=BLACK, lw=1.0, label="median")


def _limits(
    ax: Axes,
    x: NDArray[np.int64],
    fitness: Array,
    feasible: NDArray[np.bool_],
    references: Sequence[float | None],
) -> None:
    iteration_axis(ax, len(x), ticks=6)
    begun = fitness[~feasible & np.isfinite(fitness)]  # the first iterations leap; they need not all be in the picture
    ends = np.quantile(begun, [0.02, 0.98]) if begun.size else []
    shown = np.concatenate([fitness[feasible], ends, [value for value in references if value is not None]])
    if shown.size:
        low, high = float(shown.min()), float(shown.max())
        pad = 0.06 * (high - low) or 0.05 * abs(high) or 1.0
        ax.set_ylim(low - pad, high + pad)


def _references(ax: Axes, *, reported: float | None, best_known: float | None, threshold: float | None) -> None:
    labels = []
    for value, text, color in (
        (threshold, "threshold", VERMILION),
        (reported, "reported best", GREY),
        (best_known, "best known", GREEN),
    ):
        if value is not None:
            ax.axhline(value, color=color, linewidth=0.9, linestyle=(0, (5, 2)), zorder=1.5)
            labels.append((value, f"{text}\n{value:.4g}", color))
    label_right(ax, labels)


def _legend(ax: Axes, *, infeasible: bool) -> None:
    from matplotlib.lines import Line2D

    handles, names = ax.get_legend_handles_labels()
    unique = dict(reversed(list(zip(names, handles, strict=True))))
    shown = [unique[name] for name in ("best run", "a run", "median", "quartiles") if name in unique]
    if infeasible:
        shown.append(Line2D([], [], color=GREY, linestyle=DASHED, linewidth=0.9, label="not feasible yet"))
    legend_below(ax, 3, handles=shown)


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
    ax: Axes | None = None,
    *,
    title: str = "",
    best_known: float | None = None,
    threshold: float | None = None,
) -> Figure:
    """Draw the fitness of every feasible run by method, with quartiles, and what the paper reports.

    Args:
        rows: the methods, from the top down.
        ax: to draw in; a new figure unless given.
        title: above the axes.
        best_known: the best known fitness.
        threshold: the fitness to be reached.

    Raises:
        SettingsError: no methods, or matplotlib is not installed.
    """
    if not rows:
        raise SettingsError("rows is empty, expected one or more methods")
    with look():
        ax = new_figure(COLUMN * 1.4, 1.0 + 0.46 * len(rows)).add_subplot() if ax is None else ax
        for y, row in enumerate(rows):
            _row(ax, y, row)
        _references_of_methods(ax, best_known, threshold)
        tidy(ax, grid="x")
        ax.set_ylim(len(rows) - 0.5, -0.5)
        ax.set_yticks(range(len(rows)), [row.name for row in rows])
        ax.tick_params(axis="y", length=0)
        ax.margins(x=0.06)
        ax.set_xlabel("fitness $F$ of the best found (less is better)")
        ax.set_title(title, loc="left", pad=12)
        _legend_of_methods(ax, reported=any(row.reported is not None for row in rows))
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


def _references_of_methods(ax: Axes, best_known: float | None, threshold: float | None) -> None:
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


def _legend_of_methods(ax: Axes, *, reported: bool) -> None:
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


def figure_pareto(front: ParetoFront, ax: Axes | None = None, *, title: str = "") -> Figure:
    """Draw the disturbance of the base over the duration of proven plans, and the front that they form.

    Args:
        front: with one or more plans.
        ax: to draw in; a new figure unless given.
        title: above the axes.

    Raises:
        ProblemError: no plan was found.
        SettingsError: matplotlib is not installed.
    """
    if not front.plans:
        raise ProblemError("the front has no plans, expected one or more: no motion was found; give the planner more time")
    with look():
        ax = new_figure(COLUMN, 2.7).add_subplot() if ax is None else ax
        x, y = front.durations, np.degrees(front.disturbances)
        low, high = _range(float(x.min()), float(x.max())), _range(float(y.min()), float(y.max()))
        # Nothing better than a plan is known: the front is a stair, on from its quickest and its gentlest plan.
        stair_x = np.concatenate([[x[front.best][0]], x[front.best], [low[1]]])
        stair_y = np.concatenate([[high[1]], y[front.best], [y[front.best][-1]]])
        ax.step(stair_x, stair_y, where="post", color=BLUE, linewidth=1.0, zorder=2, label="front: nothing quicker is known")
        ax.plot(x[front.best], y[front.best], "o", color=BLUE, markersize=4.5, zorder=3, label="proven plan on the front")
        if not front.best.all():
            ax.plot(x[~front.best], y[~front.best], "o", color=GREY, markersize=3.5, label="proven plan, beaten by another")
        tidy(ax)
        ax.set_xlim(*low)
        ax.set_ylim(*high)
        ax.set_xlabel("duration [s]")
        ax.set_ylabel(_SAYS[front.measure])
        ax.set_title(title, loc="left")
        legend_below(ax, 1)
        return figure_of(ax)


def _range(least: float, most: float) -> tuple[float, float]:
    """Return the ends of an axis: a little beyond the values, and 0 if they are near it."""
    pad = 0.08 * (most - least) or 0.1 * abs(most) or 1.0
    low = least - pad
    return (0.0 if 0 <= least < 0.3 * most else low, most + (pad if math.isfinite(pad) else 0.0))
