"""What moves: robots, as data; from URDF, from spacearm's own files, or built in."""

from spacearm.robot.centres import joint_centres
from spacearm.robot.kinematics import forward_kinematics, joint_frames
from spacearm.robot.load import builtin_robots, load_robot
from spacearm.robot.model import Frame, Joint, LinkCapsule, Robot
from spacearm.robot.urdf import load_urdf

__all__ = [
    "Frame",
    "Joint",
    "LinkCapsule",
    "Robot",
    "builtin_robots",
    "forward_kinematics",
    "joint_centres",
    "joint_frames",
    "load_robot",
    "load_urdf",
]
