"""spacearm: collision-free motions for robot arms on spacecraft, found by trees, refinement and a swarm, and proven.

The public names, each loaded when it is first used.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from spacearm.core.errors import SpacearmError
    from spacearm.core.native import KernelInfo, kernel_info
    from spacearm.doctor import Diagnosis, Finding, diagnose, mend_urdf
    from spacearm.dynamics import (
        BaseMotion,
        Momentum,
        base_at_mass_center,
        base_rate,
        center_of_mass,
        hold,
        momentum_map,
        system_mass,
    )
    from spacearm.files import (
        SavedPlan,
        load_moveit,
        load_moveit_scene,
        load_plan,
        load_problem,
        load_saved_plan,
        load_trajectory,
        save_plan,
        write_aem,
        write_ros_trajectory,
    )
    from spacearm.geometry import (
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
    from spacearm.motion import Motion, PiecewisePath, RecordedTrajectory, TimeLaw, Trajectory, time_optimal
    from spacearm.motion import recorded as resampled
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
        Weights,
        clearance,
        pareto_front,
        plan,
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
    from spacearm.swarm import IPSO, PSO, FeasibleFirst, Penalty, Swarm, SwarmResult, minimize, named_settings

_ROOM_OF = {
    "core.errors": ("SpacearmError",),
    "core.native": (
        "KernelInfo",
        "kernel_info",
    ),
    "doctor": (
        "Diagnosis",
        "Finding",
        "diagnose",
        "mend_urdf",
    ),
    "dynamics": (
        "BaseMotion",
        "Momentum",
        "base_at_mass_center",
        "base_rate",
        "center_of_mass",
        "hold",
        "momentum_map",
        "system_mass",
    ),
    "files": (
        "SavedPlan",
        "load_moveit",
        "load_moveit_scene",
        "load_plan",
        "load_problem",
        "load_saved_plan",
        "load_trajectory",
        "save_plan",
        "write_aem",
        "write_ros_trajectory",
    ),
    "geometry": (
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
    "motion": (
        "Motion",
        "PiecewisePath",
        "RecordedTrajectory",
        "TimeLaw",
        "Trajectory",
        "resampled",
        "time_optimal",
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
        "Weights",
        "clearance",
        "pareto_front",
        "plan",
    ),
    "proof": (
        "Certificate",
        "certify",
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
    "swarm": (
        "FeasibleFirst",
        "IPSO",
        "PSO",
        "Penalty",
        "Swarm",
        "SwarmResult",
        "minimize",
        "named_settings",
    ),
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
        return importlib.import_module("spacearm.core.version").version()
    if name not in _ROOMS:
        raise AttributeError(f"module 'spacearm' has no attribute {name!r}")
    value = getattr(importlib.import_module(f"spacearm.{_ROOMS[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return [*__all__, "__version__"]
