"""Trajectories in the formats of others: flight dynamics' attitude ephemeris, and messages of ROS."""

from spacearm.motion.exports.aem import write_aem
from spacearm.motion.exports.ros import write_ros_trajectory

__all__ = ["write_aem", "write_ros_trajectory"]
