"""Files: problems, plans, MoveIt, tables, ROS and CCSDS. Readers and writers."""

from spacearm.files.ccsds_attitude import write_aem
from spacearm.files.moveit import load_moveit, load_moveit_scene
from spacearm.files.plan_file import SavedPlan, load_plan, load_saved_plan, plan_as_dict, save_plan
from spacearm.files.problem_file import ProblemFile, load_problem, load_problem_file
from spacearm.files.ros_messages import write_ros_trajectory
from spacearm.files.trajectory_file import load_trajectory, save_trajectory

__all__ = [
    "ProblemFile",
    "SavedPlan",
    "load_moveit",
    "load_moveit_scene",
    "load_plan",
    "load_problem",
    "load_problem_file",
    "load_saved_plan",
    "load_trajectory",
    "plan_as_dict",
    "save_plan",
    "save_trajectory",
    "write_aem",
    "write_ros_trajectory",
]
