"""Trajectories as rows for a controller."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from spacearm.checks import as_number
from spacearm.errors import SettingsError
from spacearm.motion.recorded import AnyTrajectory, require_trajectory

Array = NDArray[np.float64]

_MOST = 10_000_000
_LONGEST = 1e9  # [s]
_ROUNDING = 1e-9  # of a step: a last one this short is none


class Samples(NamedTuple):
    """A trajectory at equal steps: t (m,) [s], and q, dq, ddq, each (m, n)."""

    t: Array
    q: Array
    dq: Array
    ddq: Array


def resampled(trajectory: AnyTrajectory, *, rate_hz: float | None = None, dt: float | None = None) -> Samples:
    """Sample a trajectory at equal steps from 0, the last at its end or less than a step after, where the arm rests.

    Args:
        trajectory: ours or recorded.
        rate_hz: samples per second, or
        dt: the step [s].

    Raises:
        SettingsError: both or neither is given, it is no positive number, or gives more than ten million samples.
    """
    require_trajectory(trajectory)
    if (rate_hz is None) == (dt is None):
        raise SettingsError(f"rate_hz is {rate_hz} and dt is {dt}, expected one of them: samples per second, or the step [s]")
    if rate_hz is not None:
        step = 1 / as_number("rate_hz", rate_hz, SettingsError, above=0, unit="Hz")
    else:
        step = as_number("dt", dt, SettingsError, above=0, unit="s")
    step = min(step, _LONGEST)
    steps = trajectory.duration / step
    if steps > _MOST:
        raise SettingsError(f"a step of {step:.4g} s gives {steps:.4g} samples, expected at most {_MOST:,}; take a longer step")
    count = max(math.ceil(steps - _ROUNDING), int(trajectory.duration > 0))
    t = np.arange(count + 1, dtype=np.float64) * step
    return Samples(t, *trajectory.sample(t))
