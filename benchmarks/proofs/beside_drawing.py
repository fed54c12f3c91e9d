"""The figure of the proof beside other methods: time, time where it is tight, and what is found."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from spacearm.show.figure_style import (
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PAGE,
    PURPLE,
    SKY,
    VERMILION,
    legend_below,
    look,
    new_figure,
    tidy,
)

if TYPE_CHECKING:
    from proofs_beside_others import Results

COLORS = (BLUE, GREEN, SKY, ORANGE, VERMILION, PURPLE)
MARKERS = ("o", "s", "^", "D", "v", "P")
OF_GUARANTEE = (  # what the methods' names begin with, in order, and what they look at
    ("spacearm", "every instant,\nchecked proof"),
    ("bisection", "every instant,\ndistances believed"),
    ("FCL", "other motions"),
    ("samples", "instants"),
)


def draw(results: Results, path: Path) -> None:
    """Write the figure."""
    with look():
        figure = new_figure(PAGE, 3.6)
        left, middle, right = figure.subplots(1, 3, width_ratios=(1.5, 1, 1))
        _times(left, results)
        _margins(middle, results)
        _found(right, results)
        figure.savefig(path, dpi=200, metadata={"Software": None, "Title": "proofs beside other methods"})


def _rows(results: Results) -> list[tuple[str, list[float]]]:
    """Return the lines of the figure of times: names, and seconds by motion."""
    out: list[tuple[str, list[float]]] = []
    for name, verdicts in results.verdicts.items():
        if not verdicts[0].parts:
            out.append((name, [one.seconds for one in verdicts]))
            continue
        out += [(f"spacearm, {part}", [one.parts[part] for one in verdicts]) for part in ("found", "checked")]
    return out


def _times(ax: Any, results: Results) -> None:
    rows, robots = _rows(results), list(dict.fromkeys(results.robots))
    for y, (_, seconds) in enumerate(rows):
        for k, robot in enumerate(robots):
            of = [1e3 * s for s, one in zip(seconds, results.robots, strict=True) if one == robot]
            middle, high = np.percentile(of, [50, 95])
            at = y + 0.17 * (k - (len(robots) - 1) / 2)
            ax.plot([middle, high], [at, at], color=COLORS[k], linewidth=1.0, solid_capstyle="butt")
            ax.plot(middle, at, MARKERS[k], color=COLORS[k], markersize=3.2, label=robot if y == 0 else None)
    ax.set(xscale="log", xlabel="processor time of a motion [ms]")
    ax.set_yticks(range(len(rows)), [name for name, _ in rows])
    ax.set_ylim(len(rows) - 0.4, -0.6)
    tidy(ax, grid="x")
    _guarantees(ax, [name for name, _ in rows])
    legend_below(ax, len(robots))


def _guarantees(ax: Any, names: Sequence[str]) -> None:
    """Divide the lines by what is guaranteed, and write it beside them."""
    begin = 0
    for prefix, words in OF_GUARANTEE:
        count = sum(name.startswith(prefix) for name in names)
        if not count:
            continue
        if begin:
            ax.axhline(begin - 0.5, color=GREY, linewidth=0.5)
        ax.annotate(
            words,
            (1.0, begin + (count - 1) / 2),
            xycoords=("axes fraction", "data"),
            xytext=(-2, 0),
            textcoords="offset points",
            ha="right",
            va="center",
            fontsize=6,
            color=GREY,
        )
        begin += count
    low, high = ax.get_xlim()
    ax.set_xlim(low, high * (high / low) ** 0.9)


def _margins(ax: Any, results: Results) -> None:
    margins = sorted(results.margins, reverse=True)
    lines = {
        "spacearm, found": (BLUE, "-", [[v.parts["found"] for v in results.margins[m][_proof(results)]] for m in margins]),
        "spacearm, checked": (BLUE, "--", [[v.parts["checked"] for v in results.margins[m][_proof(results)]] for m in margins]),
        "bisection, native": (VERMILION, "-", [[v.seconds for v in results.margins[m]["bisection, native"]] for m in margins]),
    }
    x = 1e3 * np.array(margins)
    for name, (color, style, seconds) in lines.items():
        middle = [1e3 * float(np.median(of)) for of in seconds]
        ax.plot(x, middle, style, color=color, marker="o", markersize=2.2, label=name)
        ax.fill_between(
            x, *(1e3 * np.array([np.percentile(of, q) for of in seconds]) for q in (25, 75)), color=color, alpha=0.13, lw=0
        )
    ax.set(xscale="log", yscale="log", xlabel="room [mm]", ylabel="processor time [ms]")
    ax.invert_xaxis()
    tidy(ax)
    legend_below(ax, 1)


def _proof(results: Results) -> str:
    return next(name for name in results.verdicts if name.startswith("spacearm"))


def _found(ax: Any, results: Results) -> None:
    for k, (name, by_depth) in enumerate(results.found.items()):
        depths = [depth for depth, found in by_depth.items() if found]
        share = [100 * float(np.mean(by_depth[depth])) for depth in depths]
        size = 5.5 - 0.7 * k  # lines lie upon each other
        ax.plot(
            1e3 * np.array(depths),
            share,
            MARKERS[k] + "-",
            color=COLORS[k],
            markersize=size,
            markerfacecolor="none",
            label=name,
        )
    ax.set(xscale="log", xlabel="depth [mm]", ylabel="collisions found [%]", ylim=(-4, 104))
    tidy(ax)
    legend_below(ax, 1)
