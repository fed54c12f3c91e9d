"""Motions and trajectories: splines through joint space, and how fast they may be run."""

from spacearm.motion.curve import Curve
from spacearm.motion.exports import write_aem, write_ros_trajectory
from spacearm.motion.margins import LimitMargins, fastest_duration, fastest_durations, limit_margins
from spacearm.motion.optimal import time_optimal
from spacearm.motion.piecewise import PiecewisePath
from spacearm.motion.recorded import AnyTrajectory, RecordedTrajectory
from spacearm.motion.resampled import Samples, resampled
from spacearm.motion.spline import Motion, basis
from spacearm.motion.timelaw import TimeLaw
from spacearm.motion.trajectory import JointState, Trajectory
from spacearm.motion.trajectory_files import load_trajectory

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
    "load_trajectory",
    "resampled",
    "time_optimal",
    "write_aem",
    "write_ros_trajectory",
]
