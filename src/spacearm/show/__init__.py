"""Figures: the paper's and our own, as matplotlib's `Figure`, and how they are saved."""

from spacearm.show.base import figure_base_motion
from spacearm.show.base_paths import figure_base_paths
from spacearm.show.clearance import figure_clearance
from spacearm.show.convergence import figure_convergence
from spacearm.show.joints import figure_joints, figure_joints_over_iterations
from spacearm.show.overview import ComparedMethod, figure_comparison
from spacearm.show.pareto import figure_pareto
from spacearm.show.path import figure_path_2d
from spacearm.show.path_space import figure_path_3d
from spacearm.show.plan_figures import save_plan_figures
from spacearm.show.save import save_figure

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
