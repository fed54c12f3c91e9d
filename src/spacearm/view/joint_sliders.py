"""A slider for each joint, in degrees or millimetres, between its limits."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from spacearm.planner.problem import Problem
from spacearm.view.panel_words import limits_words

if TYPE_CHECKING:
    from viser import GuiApi

Array = NDArray[np.float64]

_DEGREES, _MILLIMETRES = 180 / math.pi, 1e3
_WIDEST = 360.0  # degrees to both sides, of a joint without end
_WIDEST_SLIDE = 10_000.0  # [mm]


class JointSliders:
    """The sliders of a configuration.

    Args:
        gui: viser's.
        problem: the robot.
        q: (n,) where they are at first [rad or m].
        changed: called with a joint's place and its new value [rad or m], by viser's threads, when a person moves a slider.
    """

    def __init__(self, gui: GuiApi, problem: Problem, q: Array, changed: Callable[[int, float], object]) -> None:
        robot = problem.robot
        self._factor = [_MILLIMETRES if robot.is_prismatic(i) else _DEGREES for i in range(robot.dof)]
        self.handles: list[Any] = []
        for i, name in enumerate(robot.dof_names):
            unit, most = ("mm", _WIDEST_SLIDE) if robot.is_prismatic(i) else ("deg", _WIDEST)
            low, high = (
                round(
                    float(
                        np.clip(limit * self._factor[i], min(-most, q[i] * self._factor[i]), max(most, q[i] * self._factor[i]))
                    ),
                    3,
                )
                for limit in (robot.lower[i], robot.upper[i])
            )
            high = high if high > low else low + 1e-3
            slider = gui.add_slider(
                f"{name} [{unit}]",
                min=low,
                max=high,
                step=0.1 if high - low > 1 else 0.001,
                initial_value=float(np.clip(round(q[i] * self._factor[i], 3), low, high)),
                hint=limits_words(problem, i),
            )
            self.handles.append(slider)
            self._bind(slider, i, changed)

    def _bind(self, slider: Any, dof: int, changed: Callable[[int, float], object]) -> None:
        @slider.on_update
        def _(event: Any) -> None:
            if event.client_id is not None:  # else the session itself put it there
                changed(dof, float(slider.value) / self._factor[dof])

    def put(self, q: Array) -> None:
        """Put the sliders at q (n,) [rad or m]."""
        for slider, value, factor in zip(self.handles, q, self._factor, strict=True):
            shown = float(np.clip(round(float(value) * factor, 3), slider.min, slider.max))
            if slider.value != shown:
                slider.value = shown
