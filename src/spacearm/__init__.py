"""spacearm: collision-free, executable motions for robot arms on spacecraft, planned by a particle swarm.

The public names, each loaded when it is first used.
"""

from __future__ import annotations

import importlib

TYPE_CHECKING = False  # as typing has it, which is slow to load

if TYPE_CHECKING:
    from typing import Any

    from spacearm._kernel import KernelInfo, kernel_info
    from spacearm.errors import SpacearmError
    from spacearm.momentum import (
        BaseMotion,
        Momentum,
        base_at_mass_center,
        base_rate,
        center_of_mass,
        momentum_map,
        system_mass,
    )
    from spacearm.motion import (
        Motion,
        PiecewisePath,
        RecordedTrajectory,
        TimeLaw,
        Trajectory,
        load_trajectory,
        resampled,
        time_optimal,
        write_aem,
        write_ros_trajectory,
    )
    from spacearm.planner import (
        AttitudeGoal,
        BaseLimits,
        BaseReport,
        ConfigurationGoal,
        ConfigurationsGoal,
        MotionSwarm,
        ParetoFront,
        Plan,
        PlannerSettings,
        PoseGoal,
        PositionGoal,
        Problem,
        SavedPlan,
        Weights,
        clearance,
        hold,
        load_moveit,
        load_moveit_scene,
        load_plan,
        load_problem,
        load_saved_plan,
        pareto_front,
        plan,
        save_plan,
    )
    from spacearm.proof import Certificate, certify
    from spacearm.robot import (
        Body,
        Frame,
        Joint,
        LinkCapsule,
        LinkEnvelope,
        NamedConfiguration,
        Robot,
        SelfPairs,
        builtin_robots,
        envelope_report,
        find_self_pairs,
        forward_kinematics,
        load_robot,
    )
    from spacearm.robot.doctor import Diagnosis, Finding, diagnose, mend_urdf
    from spacearm.scene import (
        Box,
        Capsule,
        Cylinder,
        HalfSpace,
        Scene,
        Sphere,
        SphereSet,
        enclose_mesh,
        enclose_points,
        pose,
    )
    from spacearm.swarm import IPSO, PSO, FeasibleFirst, Penalty, Swarm, SwarmResult, minimize, named_settings

_ROOM_OF = {
    "_kernel": ("KernelInfo", "kernel_info"),
    "proof": ("Certificate", "certify"),
    "errors": ("SpacearmError",),
    "momentum": ("BaseMotion", "Momentum", "base_at_mass_center", "base_rate", "center_of_mass", "momentum_map", "system_mass"),
    "motion": (
        "Motion",
        "PiecewisePath",
        "RecordedTrajectory",
        "TimeLaw",
        "Trajectory",
        "load_trajectory",
        "resampled",
        "time_optimal",
        "write_aem",
        "write_ros_trajectory",
    ),
    "planner": (
        "AttitudeGoal",
        "BaseLimits",
        "BaseReport",
        "ConfigurationGoal",
        "ConfigurationsGoal",
        "MotionSwarm",
        "ParetoFront",
        "Plan",
        "PlannerSettings",
        "PoseGoal",
        "PositionGoal",
        "Problem",
        "SavedPlan",
        "Weights",
        "clearance",
        "hold",
        "load_moveit",
        "load_moveit_scene",
        "load_plan",
        "load_problem",
        "load_saved_plan",
        "pareto_front",
        "plan",
        "save_plan",
    ),
    "robot": (
        "Body",
        "Frame",
        "Joint",
        "LinkCapsule",
        "LinkEnvelope",
        "NamedConfiguration",
        "Robot",
        "SelfPairs",
        "builtin_robots",
        "envelope_report",
        "find_self_pairs",
        "forward_kinematics",
        "load_robot",
    ),
    "robot.doctor": ("Diagnosis", "Finding", "diagnose", "mend_urdf"),
    "scene": (
        "Box",
        "Capsule",
        "Cylinder",
        "HalfSpace",
        "Scene",
        "Sphere",
        "SphereSet",
        "enclose_mesh",
        "enclose_points",
        "pose",
    ),
    "swarm": ("IPSO", "PSO", "FeasibleFirst", "Penalty", "Swarm", "SwarmResult", "minimize", "named_settings"),
}
_ROOMS = {name: room for room, names in _ROOM_OF.items() for name in names}

__all__ = [  # a plain list for type checkers, in the order of ruff
    "IPSO",
    "PSO",
    "AttitudeGoal",
    "BaseLimits",
    "BaseMotion",
    "BaseReport",
    "Body",
    "Box",
    "Capsule",
    "Certificate",
    "ConfigurationGoal",
    "ConfigurationsGoal",
    "Cylinder",
    "Diagnosis",
    "FeasibleFirst",
    "Finding",
    "Frame",
    "HalfSpace",
    "Joint",
    "KernelInfo",
    "LinkCapsule",
    "LinkEnvelope",
    "Momentum",
    "Motion",
    "MotionSwarm",
    "NamedConfiguration",
    "ParetoFront",
    "Penalty",
    "PiecewisePath",
    "Plan",
    "PlannerSettings",
    "PoseGoal",
    "PositionGoal",
    "Problem",
    "RecordedTrajectory",
    "Robot",
    "SavedPlan",
    "Scene",
    "SelfPairs",
    "SpacearmError",
    "Sphere",
    "SphereSet",
    "Swarm",
    "SwarmResult",
    "TimeLaw",
    "Trajectory",
    "Weights",
    "base_at_mass_center",
    "base_rate",
    "builtin_robots",
    "center_of_mass",
    "certify",
    "clearance",
    "diagnose",
    "enclose_mesh",
    "enclose_points",
    "envelope_report",
    "find_self_pairs",
    "forward_kinematics",
    "hold",
    "kernel_info",
    "load_moveit",
    "load_moveit_scene",
    "load_plan",
    "load_problem",
    "load_robot",
    "load_saved_plan",
    "load_trajectory",
    "mend_urdf",
    "minimize",
    "momentum_map",
    "named_settings",
    "pareto_front",
    "plan",
    "pose",
    "resampled",
    "save_plan",
    "system_mass",
    "time_optimal",
    "write_aem",
    "write_ros_trajectory",
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
