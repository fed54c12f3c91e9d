"""spacearm: collision-free, executable motions for robot arms on spacecraft, planned by a particle swarm.

The public names, each loaded when it is first used.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from spacearm._kernel import KernelInfo, kernel_info
    from spacearm.errors import SpacearmError
    from spacearm.motion import Motion, Trajectory
    from spacearm.planner import (
        ConfigurationGoal,
        Plan,
        PlannerSettings,
        PositionGoal,
        Problem,
        clearance,
        load_plan,
        load_problem,
        plan,
        save_plan,
    )
    from spacearm.proof import Certificate, certify
    from spacearm.robot import Frame, Joint, LinkCapsule, Robot, builtin_robots, forward_kinematics, load_robot
    from spacearm.scene import Box, Capsule, Cylinder, HalfSpace, Scene, Sphere, SphereSet, pose
    from spacearm.swarm import IPSO, PSO, FeasibleFirst, Penalty, Swarm, SwarmResult, minimize, named_settings

_ROOM_OF = {
    "_kernel": ("KernelInfo", "kernel_info"),
    "proof": ("Certificate", "certify"),
    "errors": ("SpacearmError",),
    "motion": ("Motion", "Trajectory"),
    "planner": (
        "ConfigurationGoal",
        "Plan",
        "PlannerSettings",
        "PositionGoal",
        "Problem",
        "clearance",
        "load_plan",
        "load_problem",
        "plan",
        "save_plan",
    ),
    "robot": ("LinkCapsule", "Frame", "Joint", "Robot", "builtin_robots", "forward_kinematics", "load_robot"),
    "scene": ("Box", "Capsule", "Cylinder", "HalfSpace", "Scene", "Sphere", "SphereSet", "pose"),
    "swarm": ("IPSO", "PSO", "FeasibleFirst", "Penalty", "Swarm", "SwarmResult", "minimize", "named_settings"),
}
_ROOMS = {name: room for room, names in _ROOM_OF.items() for name in names}

__all__ = [  # a plain list for type checkers, in the order of ruff
    "IPSO",
    "PSO",
    "Box",
    "Capsule",
    "Certificate",
    "ConfigurationGoal",
    "Cylinder",
    "FeasibleFirst",
    "Frame",
    "HalfSpace",
    "Joint",
    "KernelInfo",
    "LinkCapsule",
    "Motion",
    "Penalty",
    "Plan",
    "PlannerSettings",
    "PositionGoal",
    "Problem",
    "Robot",
    "Scene",
    "SpacearmError",
    "Sphere",
    "SphereSet",
    "Swarm",
    "SwarmResult",
    "Trajectory",
    "builtin_robots",
    "certify",
    "clearance",
    "forward_kinematics",
    "kernel_info",
    "load_plan",
    "load_problem",
    "load_robot",
    "minimize",
    "named_settings",
    "plan",
    "pose",
    "save_plan",
]


def __getattr__(name: str) -> Any:
    if name == "__version__":
        return importlib.import_module("spacearm.version").version()
    if name not in _ROOMS:
        raise AttributeError(f"module 'spacearm' has no attribute {name!r}")
    value = getattr(importlib.import_module(f"spacearm.{_ROOMS[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return [*__all__, "__version__"]
