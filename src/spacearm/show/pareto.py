"""What a gentler motion costs: duration against how much the base is disturbed."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from spacearm.errors import ProblemError
from spacearm.planner.pareto import ParetoFront
from spacearm.show.style import BLUE, COLUMN, GREY, figure_of, legend_below, look, new_figure, tidy

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_SAYS = {
    "peak": "greatest angle of the base [deg]",
    "final": "angle of the base at the end [deg]",
    "rate": "greatest rate of the base [deg/s]",
}


def figure_pareto(front: ParetoFront, *, title: str = "", ax: Axes | None = None) -> Figure:
    """Draw the disturbance of the base over the duration of proven plans, and the front that they form.

    Args:
        front: with one or more plans.
        title: above the axes.
        ax: to draw in; a new figure unless given.

    Raises:
        ProblemError: no plan was found.
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
