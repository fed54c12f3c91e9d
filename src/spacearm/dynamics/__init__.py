"""Momentum, and how a spacecraft's base moves when the arm does."""

from spacearm.dynamics.base_models import BASE_MODELS, BaseModel, BaseTrack, FixedBase, FloatingBase
from spacearm.dynamics.base_motion import BaseMotion, JointPath
from spacearm.dynamics.momentum import (
    Moments,
    Momentum,
    base_at_mass_center,
    base_rate,
    center_of_mass,
    moments,
    momentum_map,
    require_masses,
    system_mass,
)
from spacearm.dynamics.payload import hold

__all__ = [
    "BASE_MODELS",
    "BaseModel",
    "BaseMotion",
    "BaseTrack",
    "FixedBase",
    "FloatingBase",
    "JointPath",
    "Moments",
    "Momentum",
    "base_at_mass_center",
    "base_rate",
    "center_of_mass",
    "hold",
    "moments",
    "momentum_map",
    "require_masses",
    "system_mass",
]
