"""One look for all figures: sizes of a paper's column, a palette for colour-blind readers, thin lines.

Figures are made with matplotlib's objects, not with pyplot: no display is needed and no global state is left behind.
"""

from __future__ import annotations

import io
import os
from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from spacearm.core.errors import OutputError
from spacearm.core.extras import require_extra
from spacearm.core.interrupts import unbroken
from spacearm.core.output import write_new

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array = NDArray[np.float64]

COLUMN, PAGE = 3.5, 7.0
"""Widths of one column and of the whole page [inch]."""

BLACK, GREY, LIGHT = "#000000", "#6E6E6E", "#D9D9D9"
ORANGE, SKY, GREEN, YELLOW = "#E69F00", "#56B4E9", "#009E73", "#F0E442"
BLUE, VERMILION, PURPLE = "#0072B2", "#D55E00", "#CC79A7"

CYCLE = (BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY, BLACK)
"""Colours of lines, of Okabe and Ito (2008); yellow is left out, it is too pale for a line."""

SMALL = 6.5  # font size of legends and labels in the drawing [pt]

_LOOK: dict[str, Any] = {
    "font.family": "DejaVu Sans",  # comes with matplotlib, so the files are the same everywhere
    "font.size": 7.5,
    "axes.titlesize": 8,
    "axes.labelsize": 7.5,
    "xtick.labelsize": 7,
    "ytick.labelsize": 7,
    "legend.fontsize": SMALL,
    "legend.frameon": False,
    "legend.handlelength": 2.2,
    "legend.columnspacing": 1.4,
    "axes.linewidth": 0.6,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.axisbelow": True,
    "axes.formatter.useoffset": False,
    "axes.unicode_minus": True,
    "lines.linewidth": 1.1,
    "lines.solid_capstyle": "round",
    "figure.dpi": 100,
    "figure.facecolor": "white",
    "savefig.facecolor": "white",
    "savefig.bbox": None,
    "path.simplify": True,
    "pdf.fonttype": 42,  # text stays text
    "pdf.compression": 6,
    "svg.hashsalt": "spacearm",
}


_GLOBAL = ("backend", "backend_fallback", "interactive", "toolbar", "timezone", "datapath")  # not a matter of looks
DPI = 300  # of the PNG, and of what is not drawn as lines in the PDF
_PDF_FIELDS = ("Title", "Author", "Subject")


def require_figures() -> None:
    """Refuse to draw, before any work is done, where matplotlib is not installed.

    Raises:
        SettingsError: it is not.
    """
    require_extra("matplotlib", "drawing figures")


def look() -> AbstractContextManager[None]:
    """Return the context in which figures are drawn and saved: matplotlib's defaults, and then ours.

    Raises:
        SettingsError: matplotlib is not installed.
    """
    require_figures()
    from matplotlib import rc_context, rcParamsDefault

    defaults = {key: value for key, value in rcParamsDefault.items() if key not in _GLOBAL}
    return rc_context({**defaults, **_LOOK})  # type: ignore[dict-item, arg-type]


def new_figure(width: float, height: float, *, layout: str | None = "constrained") -> Figure:
    """Return an empty figure of this size [inch] that needs no display.

    Raises:
        SettingsError: matplotlib is not installed.
    """
    require_figures()
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout=layout)  # type: ignore[arg-type]
    FigureCanvasAgg(figure)
    return figure


def figure_of(ax: Axes) -> Figure:
    """Return the figure that axes are drawn in, the outermost where there are subfigures."""
    return ax.get_figure(root=True) if _takes_root() else ax.figure  # type: ignore[return-value, call-arg]


def _takes_root() -> bool:
    from matplotlib import __version_info__

    return tuple(__version_info__[:2]) >= (3, 10)


def tidy(ax: Axes, *, grid: str = "both") -> None:
    """Give axes thin ticks and a light grid; also those that were made outside of the look."""
    ax.tick_params(labelsize=7, width=0.6, length=2.5, pad=2)
    for axis in (ax.xaxis, ax.yaxis):
        axis.label.set_fontsize(_LOOK["axes.labelsize"])
    ax.set_axisbelow(True)
    ax.grid(visible=True, axis=grid, color=LIGHT, linewidth=0.4)  # type: ignore[arg-type]
    for side in ("top", "right"):
        ax.spines[side].set_visible(False)


def legend_below(ax: Axes, columns: int, *, offset: float = 30.0, handles: Sequence[Any] | None = None) -> None:
    """Put the legend under the axes, where it covers nothing; the offset is for the axis' label [pt]."""
    from matplotlib.transforms import ScaledTranslation

    down = ScaledTranslation(0, -offset / 72, figure_of(ax).dpi_scale_trans)
    ax.legend(
        **({} if handles is None else {"handles": list(handles)}),
        loc="upper center",
        bbox_to_anchor=(0.5, 0.0),
        bbox_transform=ax.transAxes + down,
        ncols=columns,
        borderaxespad=0.0,
    )


def label_right(ax: Axes, labels: Sequence[tuple[float, str, str]]) -> None:
    """Write labels (value, text, colour) beside the axes at their values, moved apart where they would overlap.

    Call it when the limits of the y axis are final.
    """
    low, high = ax.get_ylim()
    lines = 1 + max((text.count("\n") for _, text, _ in labels), default=0)
    height = 0.8 * ax.get_position().height * figure_of(ax).get_figheight()  # [inch], about what the layout will leave
    gap = (high - low) * (lines * SMALL * 1.25 / 72) / height
    inside = [label for label in labels if low <= label[0] <= high]
    for at, (_, text, color) in zip(moved_apart([y for y, _, _ in inside], gap), inside, strict=True):
        ax.annotate(
            text,
            (1.0, at),
            xycoords=("axes fraction", "data"),
            xytext=(3, 0),
            textcoords="offset points",
            color=color,
            fontsize=SMALL,
            va="center",
            annotation_clip=False,
        )


def moved_apart(values: Sequence[float], gap: float) -> Array:
    """Return values at least a gap apart, in the same order, each group about its own middle."""
    order = np.argsort(np.asarray(values, dtype=np.float64), kind="stable")
    groups: list[tuple[float, int]] = []  # middle, members
    for value in np.asarray(values, dtype=np.float64)[order]:
        groups.append((float(value), 1))
        while len(groups) > 1 and groups[-1][0] - groups[-2][0] < gap * (groups[-1][1] + groups[-2][1]) / 2:
            (first, n), (second, m) = groups[-2:]
            groups[-2:] = [((first * n + second * m) / (n + m), n + m)]
    out = np.empty(len(values))
    out[order] = [middle + gap * (i - (n - 1) / 2) for middle, n in groups for i in range(n)]
    return out


def save_figure(figure: Figure, path_stem: str | os.PathLike[str], *, provenance: Mapping[str, str]) -> tuple[Path, Path]:
    """Write a figure as PNG and PDF. The figure's layout is settled by it and stays so.

    Args:
        figure: to be written.
        path_stem: of the files, without ".png" and ".pdf".
        provenance: what the figure was made from, as the seed, the version and the command; kept in both files.

    Returns:
        The paths of the PNG and the PDF.

    Raises:
        OutputError: one of the files exists, or cannot be written.
    """
    stem = Path(path_stem)
    png, pdf = stem.with_name(f"{stem.name}.png"), stem.with_name(f"{stem.name}.pdf")
    for path in (png, pdf):
        if os.path.lexists(path):
            raise OutputError(f"{path} exists, expected a new file for the figure; choose another name or move it away")
    with unbroken():  # what draws would swallow Ctrl-C now and then, or trip over it
        _settle(figure)
        contents = _png(figure, provenance), _pdf(figure, provenance)
    with unbroken():
        write_new(png, contents[0])
        try:
            write_new(pdf, contents[1])
        except OutputError:
            png.unlink(missing_ok=True)
            raise
    return png, pdf


def _settle(figure: Figure) -> None:
    """Lay the figure out once, so that both files show the same layout, however often they are written.

    Only the layout is computed, and no engine is left: while there is one, and be it one that does nothing, every saving draws
    the whole figure twice.
    """
    engine = figure.get_layout_engine()
    if engine is not None:
        with look():
            engine.execute(figure)
            figure.set_layout_engine(None)


def _png(figure: Figure, provenance: Mapping[str, str]) -> bytes:
    buffer = io.BytesIO()
    with look():
        figure.savefig(buffer, format="png", dpi=DPI, metadata={"Software": None, **provenance})
    return buffer.getvalue()


def _pdf(figure: Figure, provenance: Mapping[str, str]) -> bytes:
    """Write the PDF, whose metadata has fixed fields: what of the provenance has none is in its keywords."""
    buffer = io.BytesIO()
    fields = {key: value for key, value in provenance.items() if key in _PDF_FIELDS}
    keywords = "; ".join(f"{key}: {value}" for key, value in provenance.items() if key not in _PDF_FIELDS)
    metadata = {"Creator": "spacearm", "Producer": None, "CreationDate": None, "Keywords": keywords or None, **fields}
    with look():
        figure.savefig(buffer, format="pdf", dpi=DPI, metadata=metadata)
    return buffer.getvalue()
