"""Figures: the paper's and our own, as matplotlib's `Figure`, and how they are saved."""

from spacearm.show.base_figures import figure_base_motion, figure_base_paths
from spacearm.show.figure_style import save_figure
from spacearm.show.path_figures import figure_path_2d, figure_path_3d
from spacearm.show.plan_figures import save_plan_figures
from spacearm.show.swarm_figures import ComparedMethod, figure_comparison, figure_convergence, figure_pareto
from spacearm.show.trajectory_figures import figure_clearance, figure_joints, figure_joints_over_iterations

__all__ = [
    "ComparedMethod",
    "figure_base_motion",
    "figure_base_paths",
    "figure_clearance",
    "figure_comparison",
    "figure_convergence",
    "figure_joints",
    "figure_joints_over_iterations",
    "figure_pareto",
    "figure_path_2d",
    "figure_path_3d",
    "save_figure",
    "save_plan_figures",
]
