"""The seed's experiment (Zhang et al. 2022): its robot, scene, fitness, tables and figures."""

from spacearm.paper.experiment import Experiment, MethodRuns, run_experiment
from spacearm.paper.readings import READINGS, Reading
from spacearm.paper.scene import (
    GOAL_POSITION,
    OBSTACLE_CENTERS,
    START_POSITION,
    paper_robot,
    paper_scene,
    seed_objective,
    seed_terms,
)
from spacearm.paper.settings import NEAR, REPORTED, REPORTED_FOR, THRESHOLD, PaperSettings
from spacearm.paper.statistics import Summary, rank_sum, summarise

__all__ = [
    "GOAL_POSITION",
    "NEAR",
    "OBSTACLE_CENTERS",
    "READINGS",
    "REPORTED",
    "REPORTED_FOR",
    "START_POSITION",
    "THRESHOLD",
    "Experiment",
    "MethodRuns",
    "PaperSettings",
    "Reading",
    "Summary",
    "paper_robot",
    "paper_scene",
    "rank_sum",
    "run_experiment",
    "seed_objective",
    "seed_terms",
    "summarise",
]
