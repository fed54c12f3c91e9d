"""Motions and trajectories: splines through joint space, and how fast they may be run."""

from typing import TYPE_CHECKING

from spacearm.core.moved import moved_name as _moved_name
from spacearm.motion.limit_margins import LimitMargins, fastest_duration, fastest_durations, limit_margins
from spacearm.motion.piecewise import Curve, PiecewisePath
from spacearm.motion.recorded import AnyTrajectory, RecordedTrajectory
from spacearm.motion.spline import Motion, basis
from spacearm.motion.time_laws import TimeLaw
from spacearm.motion.time_optimal_law import time_optimal
from spacearm.motion.trajectory import JointState, Trajectory
from spacearm.motion.trajectory_values import Samples, resampled

__all__ = [
    "AnyTrajectory",
    "Curve",
    "JointState",
    "LimitMargins",
    "Motion",
    "PiecewisePath",
    "RecordedTrajectory",
    "Samples",
    "TimeLaw",
    "Trajectory",
    "basis",
    "fastest_duration",
    "fastest_durations",
    "limit_margins",
    "resampled",
    "time_optimal",
]

if not TYPE_CHECKING:

    def __getattr__(name: str) -> object:
        """Return what is in another room now."""
        return _moved_name(__name__, name)
