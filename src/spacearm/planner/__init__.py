"""Planning: problems, goals, the search, and what it found."""

from typing import TYPE_CHECKING

from spacearm.core.moved import moved_name as _moved_name
from spacearm.planner.clearance import clearance, clearances
from spacearm.planner.goals import (
    ConfigurationGoal,
    ConfigurationsGoal,
    Goal,
    PoseGoal,
    PositionGoal,
    goal_as_dict,
    goal_from_dict,
)
from spacearm.planner.motion_search import MotionSwarm
from spacearm.planner.pareto import ParetoFront, pareto_front
from spacearm.planner.plan_result import BaseReport, Improvement, Plan, report_base
from spacearm.planner.planner_settings import PlannerSettings, Weights
from spacearm.planner.planning import plan
from spacearm.planner.problem import AttitudeGoal, BaseLimits, Problem

__all__ = [
    "AttitudeGoal",
    "BaseLimits",
    "BaseReport",
    "ConfigurationGoal",
    "ConfigurationsGoal",
    "Goal",
    "Improvement",
    "MotionSwarm",
    "ParetoFront",
    "Plan",
    "PlannerSettings",
    "PoseGoal",
    "PositionGoal",
    "Problem",
    "Weights",
    "clearance",
    "clearances",
    "goal_as_dict",
    "goal_from_dict",
    "pareto_front",
    "plan",
    "report_base",
]

if not TYPE_CHECKING:

    def __getattr__(name: str) -> object:
        """Return what is in another room now."""
        return _moved_name(__name__, name)
