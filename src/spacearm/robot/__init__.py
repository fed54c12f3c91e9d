"""What moves: robots, as data; from URDF, from spacearm's own files, or built in."""

from spacearm.robot.envelope import LinkEnvelope
from spacearm.robot.kinematics import forward_kinematics, joint_centres, joint_frames
from spacearm.robot.link_visuals import LinkVisual
from spacearm.robot.load_robot import builtin_robots, envelope_report, load_robot
from spacearm.robot.model import Body, Frame, Joint, LinkCapsule, LinkShape, NamedConfiguration, Robot
from spacearm.robot.self_collision import LinkPair, SelfPairs, find_self_pairs
from spacearm.robot.unchecked_pairs import ApartPairs, UncheckedPair, unchecked_pairs
from spacearm.robot.urdf import load_urdf

__all__ = [
    "ApartPairs",
    "Body",
    "Frame",
    "Joint",
    "LinkCapsule",
    "LinkEnvelope",
    "LinkPair",
    "LinkShape",
    "LinkVisual",
    "NamedConfiguration",
    "Robot",
    "SelfPairs",
    "UncheckedPair",
    "builtin_robots",
    "envelope_report",
    "find_self_pairs",
    "forward_kinematics",
    "joint_centres",
    "joint_frames",
    "load_robot",
    "load_urdf",
    "unchecked_pairs",
]
