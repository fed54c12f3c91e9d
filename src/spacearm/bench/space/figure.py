"""What becomes of a fixed-base planner's motions when the base is let go, and how far bases turn."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from spacearm.bench.space.measure import LetGo
from spacearm.bench.space.run import SpaceBench
from spacearm.bench.space.summary import summary_of
from spacearm.show.style import BLACK, BLUE, GREEN, GREY, LIGHT, ORANGE, PAGE, VERMILION, look, new_figure, tidy

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_COLORS: dict[LetGo, str] = {
    "collides": VERMILION,
    "misses its goal": ORANGE,
    "disturbs the base": LIGHT,
    "holds": GREEN,
}


def figure_spacebench(bench: SpaceBench) -> Figure:
    """Draw the fate of the motions planned for a fixed base, by family, and the greatest angles of the base."""
    with look():
        figure = new_figure(PAGE, 2.8)
        left, right = figure.subplots(1, 2)
        _draw_let_go(left, bench)
        _draw_peaks(right, bench)
        return figure


def _draw_let_go(ax: Axes, bench: SpaceBench) -> None:
    groups = [*bench.families, "all"]
    summaries = [
        summary_of([run for run in bench.runs if name in ("all", run.family)], bench.protocol.limit) for name in groups
    ]
    below = np.zeros(len(groups))
    for what, color in _COLORS.items():
        share = np.array([100 * np.nan_to_num(s.let_go[what]) for s in summaries])
        ax.bar(groups, share, bottom=below, color=color, width=0.7, label=what)
        for i, (height, base) in enumerate(zip(share, below, strict=True)):
            if height >= 6:
                pale = what in ("disturbs the base", "misses its goal")
                ax.text(i, base + height / 2, f"{height:.0f}", ha="center", va="center", color=BLACK if pale else "white")
        below += share
    ax.set(ylim=(0, 100), ylabel="motions planned for a fixed base [%]", title="when the base is let go, the motion")
    tidy(ax)
    ax.legend(ncols=2, loc="upper center", bbox_to_anchor=(0.5, -0.12))


def _draw_peaks(ax: Axes, bench: SpaceBench) -> None:
    rng = np.random.default_rng(0)  # spreads the points sideways, so that they can be told apart
    for i, name in enumerate(bench.families):
        peaks = [math.degrees(run.peak) for run in bench.runs if run.family == name and run.peak is not None]
        if not peaks:
            continue
        ax.plot(i + rng.uniform(-0.25, 0.25, len(peaks)), peaks, "o", color=BLUE, markersize=2.2, alpha=0.6)
        ax.hlines(float(np.median(peaks)), i - 0.33, i + 0.33, color=BLACK, linewidth=1.2)
    ax.set_xticks(range(len(bench.families)), bench.families)
    ax.axhline(0, color=GREY, linewidth=0.6)
    ax.set(ylim=(0, None), ylabel="greatest angle of the base [deg]", title="motions planned with the base free")
    tidy(ax)
