"""Quality over time and over evaluations."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from cases import Case, Trace

from spacearm.show.figure_style import BLACK, BLUE, GREEN, ORANGE, PAGE, PURPLE, VERMILION, legend_below, look, new_figure, tidy

OURS = "spacearm, search alone"
COLOURS = {
    OURS: BLUE,
    "OMPL RRT-Connect, simplified": VERMILION,
    "OMPL AORRTC": ORANGE,
    "OMPL BITstar": PURPLE,
    "spacearm swarm, ask/tell": GREEN,
    "scipy DE": VERMILION,
    "scipy Nelder-Mead": PURPLE,
    "cma, restarts": ORANGE,
}


def draw(traces: list[Trace], cases: list[Case], path: Path) -> None:
    """Write the figure: the median excess over the best known length, what is not solved yet counted as the worst."""
    from compare import best_known

    known = best_known(traces)
    with look():
        figure = new_figure(PAGE, 4.0)
        left, right = figure.subplots(1, 2, sharey=True)
        for name in (OURS, "OMPL RRT-Connect, simplified", "OMPL AORRTC", "OMPL BITstar"):
            runs = [t for t in traces if t.method == name]
            longest = max((t.seconds for t in runs), default=1.0)
            _curve(left, name, runs, known, np.geomspace(3e-5, longest, 200), axis=0, scale=1e3)
        _vamp(left, traces, known)
        most = max((t.calls for t in traces if t.method == "scipy DE"), default=2)
        for name in (OURS, "spacearm swarm, ask/tell", "scipy DE", "cma, restarts", "scipy Nelder-Mead"):
            _curve(right, name, [t for t in traces if t.method == name], known, np.geomspace(1, most, 200), axis=1, scale=1)
        left.set(xscale="log", xlabel="time as measured [ms]", ylabel="excess over the best known length [%]")
        right.set(xscale="log", xlabel="motions evaluated")
        left.set_yscale("symlog", linthresh=1.0, linscale=0.6)
        left.set_ylim(-0.1, 150)
        for ax in (left, right):
            tidy(ax)
            ax.set_yticks([0, 1, 3, 10, 30, 100], ["0", "1", "3", "10", "30", "100"])
            _plain(ax)
            legend_below(ax, 1)
        figure.savefig(path, dpi=200, metadata={"Software": None, "Title": "planners side by side"})


def _curve(
    ax: Any, name: str, runs: list[Trace], known: dict[str, float], grid: np.ndarray, *, axis: int, scale: float
) -> None:
    table = np.full((len(runs), len(grid)), np.inf)
    for row, run in zip(table, runs, strict=True):
        for point in run.points:
            row[grid >= point[axis]] = 100 * (point[2] / known[run.case] - 1)
    median = np.median(table, axis=0) if len(runs) else np.full(len(grid), np.inf)
    shown = np.isfinite(median)
    label = name if shown.any() else f"{name}: under half solved"
    ax.plot(scale * grid[shown], median[shown], color=COLOURS[name], label=label)


def _vamp(ax: Any, traces: list[Trace], known: dict[str, float]) -> None:
    names = [name for name in dict.fromkeys(t.method for t in traces) if name.startswith("VAMP")]
    points = []
    for name in names:
        runs = [t for t in traces if t.method == name]
        excess = [100 * (t.points[-1][2] / known[t.case] - 1) if t.solved else np.inf for t in runs]
        points.append((1e3 * float(np.median([t.seconds for t in runs])), float(np.median(excess)), name))
    for x, y, name in points:
        if np.isfinite(y) and "RRT-Connect" in name:
            ax.plot(x, y, "*", color=BLACK, markersize=7, label=name)
    rest = [(x, y) for x, y, name in points if np.isfinite(y) and "AORRTC" in name]
    if rest:
        ax.plot(
            *zip(*rest, strict=True),
            "o-",
            color=BLACK,
            markersize=3,
            linewidth=0.8,
            label="VAMP AORRTC, 1,000 to 30,000 iterations",
        )


def _plain(ax: Any) -> None:
    from matplotlib.ticker import FuncFormatter

    ax.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:,g}"))
