"""Fitness over the iterations (the paper's Figs. 4 and 7)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from spacearm.errors import SettingsError
from spacearm.show.style import (
    BLACK,
    BLUE,
    COLUMN,
    GREEN,
    GREY,
    SKY,
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


def figure_convergence(
    runs: Sequence[SwarmResult],
    *,
    title: str = "",
    reported: float | None = None,
    best_known: float | None = None,
    threshold: float | None = None,
    ax: Axes | None = None,
) -> Figure:
    """Draw the fitness of the swarm's best over the iterations, run by run.

    The swarm judges feasible first, so a curve may rise until it is feasible; until then it is pale and dotted. The
    median and the quartiles are those of all runs, with what is not feasible yet counted as the worst.

    Args:
        runs: of one method; they may have stopped after different numbers of iterations.
        title: above the axes.
        reported: the best fitness that the paper reports.
        best_known: the best known fitness.
        threshold: the fitness to be reached.
        ax: to draw in; a new figure unless given.

    Raises:
        SettingsError: no runs.
    """
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
    """Set the x axis to whole iterations, from the first to the last, with about so many ticks."""
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
