"""What is wrong with a robot's model, all of it at once, and how to mend it."""

from spacearm.robot.doctor.chart import Choices
from spacearm.robot.doctor.diagnosis import Change, Diagnosis, Finding, Mended
from spacearm.robot.doctor.examine import diagnose
from spacearm.robot.doctor.mend import mend_urdf

__all__ = ["Change", "Choices", "Diagnosis", "Finding", "Mended", "diagnose", "mend_urdf"]
