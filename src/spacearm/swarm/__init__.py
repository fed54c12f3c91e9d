"""Particle swarms: PSO, the paper's IPSO and our own, by ask and tell, over Python functions, and inside the kernel."""

from spacearm.core.random_seed import Rng, seed_of
from spacearm.swarm.ask_tell import Swarm, SwarmHistory, SwarmResult
from spacearm.swarm.minimizer import minimize, run_trials
from spacearm.swarm.swarm_settings import IPSO, NAMED_SETTINGS, PSO, FeasibleFirst, Penalty, SwarmSettings, named_settings

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
