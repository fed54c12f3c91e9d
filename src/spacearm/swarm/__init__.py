"""Particle swarms: PSO, the paper's IPSO and our own, by hand, over Python functions, and inside the kernel."""

from spacearm.swarm.engine import Swarm
from spacearm.swarm.minimizer import minimize
from spacearm.swarm.named import NAMED_SETTINGS, named_settings
from spacearm.swarm.native_run import run_trials
from spacearm.swarm.result import SwarmHistory, SwarmResult
from spacearm.swarm.seed import Rng, seed_of
from spacearm.swarm.settings import IPSO, PSO, FeasibleFirst, Penalty, SwarmSettings

__all__ = [
    "IPSO",
    "NAMED_SETTINGS",
    "PSO",
    "FeasibleFirst",
    "Penalty",
    "Rng",
    "Swarm",
    "SwarmHistory",
    "SwarmResult",
    "SwarmSettings",
    "minimize",
    "named_settings",
    "run_trials",
    "seed_of",
]
