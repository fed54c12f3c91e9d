"""The errors of spacearm, for `except`; they are defined in `spacearm.core.errors`."""

from spacearm.core.errors import (
    FileFormatError,
    KernelError,
    OutputError,
    ProblemError,
    RobotError,
    SceneError,
    SettingsError,
    SpacearmError,
    SwarmError,
)

__all__ = [
    "FileFormatError",
    "KernelError",
    "OutputError",
    "ProblemError",
    "RobotError",
    "SceneError",
    "SettingsError",
    "SpacearmError",
    "SwarmError",
]
