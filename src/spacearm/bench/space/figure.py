"""SpaceBench in pictures: what becomes of motions planned for a fixed base, how far bases turn, and the families."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from spacearm.bench.space.collection import FAMILIES, SpaceProblem
from spacearm.bench.space.run import SpaceBench
from spacearm.bench.space.summary import OUTCOMES, summary_of
from spacearm.show.style import BLACK, BLUE, GREEN, GREY, LIGHT, ORANGE, PAGE, VERMILION, look, new_figure, tidy

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_COLORS = dict(zip(OUTCOMES, (VERMILION, ORANGE, LIGHT, GREEN), strict=True))


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


def figure_families(items: Sequence[SpaceProblem]) -> Figure:
    """Draw a problem of each family with its known solution: the first in the list."""
    from spacearm.planner import PoseGoal, PositionGoal
    from spacearm.show.path_space import figure_path_3d

    firsts = {item.family: item for item in reversed(items)}
    shown = sorted(firsts.values(), key=lambda item: FAMILIES.index(item.family))
    with look():
        figure = new_figure(PAGE, 1.9, layout=None)
        for i, item in enumerate(shown):
            left, width = i / len(shown) - 0.03, 1 / len(shown) + 0.06  # the drawing leaves room around it
            ax = figure.add_axes((left, -0.13, width, 1.13), projection="3d", computed_zorder=False)
            problem, goal = item.problem, item.problem.goal
            place = goal.position if isinstance(goal, (PositionGoal, PoseGoal)) else None
            figure_path_3d(
                item.solution, problem.robot, problem.scene, start=problem.start, goal=place, ax=ax, view=_from_beside(item)
            )
            ax.set_axis_off()
            ax.patch.set_visible(False)  # what reaches over from the neighbour is not painted over
            legend = ax.get_legend()
            if legend is not None:
                legend.remove()
            figure.text((i + 0.5) / len(shown), 0.94, item.name, ha="center", fontsize=8)
        return figure


def _from_beside(item: SpaceProblem) -> tuple[float, float]:
    """Return elevation and azimuth [deg] of an eye that looks at arm and obstacles from the side."""
    tip = item.solution.tip(item.solution.duration)[:3, 3]
    away = tip - item.problem.base_start[:3, 3]
    return 25.0, math.degrees(math.atan2(away[1], away[0])) - 110.0
