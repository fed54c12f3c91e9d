"""The clearance over time of the motion that is shown, with what is asked for and where it is now."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from spacearm.view.colors import BAD, PATH, css
from spacearm.view.nearest import Nearest
from spacearm.view.shown_motion import ShownMotion

if TYPE_CHECKING:
    from viser import GuiApi

Array = NDArray[np.float64]

_HEIGHT = 150  # pixels
_LATER = 1000.0  # [mm] more is not drawn: what is far away would press the curve flat

_SERIES: Any = (
    {"label": "t [s]"},
    {"label": "clearance [mm]", "stroke": css(PATH), "width": 2},
    {"label": "asked for [mm]", "stroke": css(BAD), "width": 1, "dash": [5, 4]},
    {"label": "now", "stroke": css(PATH), "points": {"show": True, "size": 9, "fill": css(PATH)}},
)


class ClearanceCurve:
    """The plot, in a folder of the panel.

    Args:
        gui: viser's.
        folder: that it is put into.
    """

    def __init__(self, gui: GuiApi, folder: Any) -> None:
        self._gui, self._folder = gui, folder
        self._plot: Any = None
        self._curve = np.zeros((3, 0))
        self._marked = -1

    def show(self, motion: ShownMotion, clearances: Array) -> None:
        """Show the clearances (k,) [m] of a motion at its `times`, measured."""
        values = np.where(np.isfinite(clearances), np.minimum(clearances * 1e3, _LATER), np.nan)
        asked = np.full(len(values), motion.edited.problem.clearance * 1e3)
        self._curve, self._marked = np.array([motion.times, values, asked]), -1
        known = values[np.isfinite(values)]
        low, high = (known.min(), max(known.max(), asked[0], 1.0)) if len(known) else (0.0, 1.0)
        if self._plot is not None:
            self._plot.remove()
        with self._folder:
            self._plot = self._gui.add_uplot(
                data=self._data(-1),
                series=_SERIES,
                scales={"x": {"time": False}, "y": {"range": (float(min(0.0, low)), float(1.08 * high))}},
                legend={"show": False},
                title="Clearance over time [mm], measured",
                height=_HEIGHT,
                order=0.5,
            )

    def mark(self, t: float | None, near: Nearest | None) -> None:
        """Mark a time [s]; None: none."""
        if self._plot is None or not self._curve.size:
            return
        place = -1 if t is None or near is None else int(np.argmin(np.abs(self._curve[0] - t)))
        if place != self._marked:
            self._marked = place
            self._plot.data = self._data(place)

    def _data(self, place: int) -> tuple[Array, ...]:
        now = np.full(self._curve.shape[1], np.nan)
        if place >= 0:
            now[place] = self._curve[1, place]
        return (*self._curve, now)
