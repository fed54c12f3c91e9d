"""Length over time, and when the first motions came."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from spacearm.bench.mbm import Benchmark
from spacearm.bench.summary import BUDGETS, FULL_SET_STRAIGHT, LENGTH_TARGETS, lengths_over_time, summary_of
from spacearm.show.style import BLACK, BLUE, CYCLE, GREY, PAGE, SKY, VERMILION, look, new_figure, tidy

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def figure_benchmark(benchmark: Benchmark) -> Figure:
    """Draw the mean length over the time of search, and the distribution of the time to the first motion, by family."""
    with look():
        figure = new_figure(PAGE, 2.8)
        left, right = figure.subplots(1, 2)
        _draw_lengths(left, benchmark)
        _draw_firsts(right, benchmark)
        return figure


def _draw_lengths(ax: Axes, benchmark: Benchmark) -> None:
    longest = benchmark.protocol.search
    times = np.geomspace(3e-5, max(longest, 1e-4), 120)
    straight = summary_of(benchmark.runs).straight
    for seed in range(benchmark.protocol.seeds):
        length = lengths_over_time([run for run in benchmark.runs if run.seed == seed], times.tolist())
        ax.plot(1e3 * times, length, color=SKY, linewidth=0.6, alpha=0.7, label="one seed" if seed == 0 else None)
    ax.plot(1e3 * times, lengths_over_time(benchmark.runs, times.tolist()), color=BLUE, label="mean of all runs")
    reached = [(b, t * straight / FULL_SET_STRAIGHT) for b, t in zip(BUDGETS, LENGTH_TARGETS, strict=True) if b <= longest]
    if reached:
        ax.plot(*zip(*[(1e3 * b, t) for b, t in reached], strict=True), "v", color=VERMILION, markersize=4, label="targets")
    ax.axhline(straight, color=GREY, linestyle=(0, (4, 2)), linewidth=0.8, label="straight: none is shorter")
    ax.set(xscale="log", xlabel="time of search on the reference core [ms]", ylabel="joint path length [rad]")
    tidy(ax)
    ax.legend(loc="upper right")
    _plain_ticks(ax)


def _draw_firsts(ax: Axes, benchmark: Benchmark) -> None:
    groups: list[tuple[str, Any]] = [(name, CYCLE[i % 6]) for i, name in enumerate(benchmark.families)]
    for number, (name, color) in enumerate([*groups, ("all", BLACK)]):
        runs = [run for run in benchmark.valid if name in ("all", run.family)]
        firsts = np.sort([1e3 * run.first * run.scale for run in runs if run.first is not None])
        share = 100 * np.arange(1, len(firsts) + 1) / max(len(runs), 1)
        dashed = (0, (3, 1)) if number >= 6 and name != "all" else "-"
        width = 1.5 if name == "all" else 0.9
        ax.step(np.maximum(firsts, 1e-3), share, where="post", color=color, linewidth=width, linestyle=dashed, label=name)
    ax.plot([0.15, 1.0], [50, 95], "v", color=VERMILION, markersize=4, label="targets", linestyle="none")
    ax.set(xscale="log", ylim=(0, 101), xlabel="time to the first motion on the reference core [ms]", ylabel="solved [%]")
    tidy(ax)
    ax.legend(loc="lower right")
    _plain_ticks(ax)


def _plain_ticks(ax: Axes) -> None:
    from matplotlib.ticker import FuncFormatter

    ax.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
