"""Planning: problems, goals, the search, and what it found."""

from spacearm.planner.base_report import BaseReport, report_base
from spacearm.planner.clearance import clearance, clearances
from spacearm.planner.files.plans import plan_as_dict, save_plan, save_trajectory
from spacearm.planner.files.problems import ProblemFile, load_problem, load_problem_file
from spacearm.planner.files.saved_plans import SavedPlan, load_plan, load_saved_plan
from spacearm.planner.floating import AttitudeGoal, BaseLimits
from spacearm.planner.goals import (
    ConfigurationGoal,
    ConfigurationsGoal,
    Goal,
    PoseGoal,
    PositionGoal,
    goal_as_dict,
    goal_from_dict,
)
from spacearm.planner.held import hold
from spacearm.planner.motion_swarm import MotionSwarm
from spacearm.planner.moveit.read import load_moveit, load_moveit_scene
from spacearm.planner.pareto import ParetoFront, pareto_front
from spacearm.planner.problem import Problem
from spacearm.planner.result import Improvement, Plan
from spacearm.planner.search import plan
from spacearm.planner.settings import PlannerSettings, Weights

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
    "ProblemFile",
    "SavedPlan",
    "Weights",
    "clearance",
    "clearances",
    "goal_as_dict",
    "goal_from_dict",
    "hold",
    "load_moveit",
    "load_moveit_scene",
    "load_plan",
    "load_problem",
    "load_problem_file",
    "load_saved_plan",
    "pareto_front",
    "plan",
    "plan_as_dict",
    "report_base",
    "save_plan",
    "save_trajectory",
]
