"""At which instants a trajectory is written down, as whole ticks of the format's clock."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from spacearm.checks import as_number
from spacearm.errors import SettingsError
from spacearm.motion.recorded import AnyTrajectory

_INTERVALS = 200
_MOST = 1_000_000  # instants of a file


def instants(trajectory: AnyTrajectory, step: float | None, *, ticks: int) -> NDArray[np.int64]:
    """Return the instants (m,) in ticks: 0, each step after it, and the last tick that is not beyond the end.

    Args:
        trajectory: to be written.
        step: between them [s]; None: a 200th of the duration.
        ticks: of the clock in a second.

    Raises:
        SettingsError: a step that is none, shorter than a tick, or gives more than a million instants.
    """
    last = int(np.floor(trajectory.duration * ticks * (1 + 1e-15)))
    if step is None:
        return np.unique(np.linspace(0, last, _INTERVALS + 1).astype(np.int64))
    step = as_number("step", step, SettingsError, at_least=1 / ticks, unit="s")
    if last / ticks / step > _MOST:
        raise SettingsError(
            f"step is {step:.6g} s, and a trajectory of {trajectory.duration:.6g} s has more than {_MOST} of them, expected "
            "fewer; give a longer step"
        )
    at = np.round(np.arange(0.0, last / ticks, step) * ticks).astype(np.int64)
    return np.unique(np.append(at, last))
