"""Motions and trajectories: splines through joint space, and how fast they may be run."""

from spacearm.motion.spline import Motion, basis
from spacearm.motion.timelaw import LimitMargins, fastest_duration, limit_margins
from spacearm.motion.trajectory import JointState, Trajectory

__all__ = ["JointState", "LimitMargins", "Motion", "Trajectory", "basis", "fastest_duration", "limit_margins"]
