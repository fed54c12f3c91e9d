"""The base models, fixed and floating: the robot's momentum, and how its base moves when the arm does."""

from spacearm.momentum.base_models import BASE_MODELS, BaseModel, BaseTrack, FixedBase, FloatingBase
from spacearm.momentum.base_motion import BaseMotion, JointPath
from spacearm.momentum.blocks import (
    Moments,
    base_at_mass_center,
    base_rate,
    center_of_mass,
    moments,
    momentum_map,
    system_mass,
)
from spacearm.momentum.convergence import Convergence, convergence
from spacearm.momentum.masses import require_masses
from spacearm.momentum.total import Momentum

__all__ = [
    "BASE_MODELS",
    "BaseModel",
    "BaseMotion",
    "BaseTrack",
    "Convergence",
    "FixedBase",
    "FloatingBase",
    "JointPath",
    "Moments",
    "Momentum",
    "base_at_mass_center",
    "base_rate",
    "center_of_mass",
    "convergence",
    "moments",
    "momentum_map",
    "require_masses",
    "system_mass",
]
