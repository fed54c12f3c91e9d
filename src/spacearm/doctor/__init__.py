"""What is wrong with the model of a robot, and a corrected copy."""

from spacearm.doctor.diagnosis import Change, Choices, Diagnosis, Finding, Mended
from spacearm.doctor.examination import diagnose
from spacearm.doctor.mend import mend_urdf

__all__ = [
    "Change",
    "Choices",
    "Diagnosis",
    "Finding",
    "Mended",
    "diagnose",
    "mend_urdf",
]
