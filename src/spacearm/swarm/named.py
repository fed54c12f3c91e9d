"""Named settings: the paper's, those between, and ours; what each adds is measured in docs/benchmarks.md.

The numbers of the rising penalty are for an objective like the seed's, whose fitness changes by about one per metre
of violation: it begins where violating still pays a little, so that the swarm crosses obstacles and walks along the
goal, and ends where it never does.
"""

from __future__ import annotations

from typing import Any

from spacearm.checks import shown
from spacearm.errors import SettingsError, nearest
from spacearm.swarm.settings import IPSO, PSO, FeasibleFirst, Penalty, SwarmSettings

_CONSTRICTION: dict[str, Any] = {"inertia": 0.7298, "cognitive": 1.49618, "social": 1.49618}  # Clerc and Kennedy 2002
_KEPT_INSIDE: dict[str, Any] = {"velocity_clamp": 0.2, "bounds": "reflect"}
_RISING = Penalty(weight=1.5, final_weight=100.0, rise_from=0.5)

NAMED_SETTINGS: dict[str, SwarmSettings] = {
    "pso": PSO(),
    "ipso-m": IPSO(variant="symbiotic"),
    "ipso-s": IPSO(variant="cooperative"),
    "constriction": PSO(**_CONSTRICTION),
    "ring": PSO(**_CONSTRICTION, neighbours=3),
    "ring-small": PSO(**_CONSTRICTION, neighbours=3, particles=100, iterations=300),
    "ring-forgiving": PSO(
        **_CONSTRICTION, neighbours=3, particles=100, iterations=300, constraints=FeasibleFirst(forgiven=0.1)
    ),
    "ring-unclamped": PSO(**_CONSTRICTION, neighbours=3, particles=100, iterations=300, constraints=_RISING),
    "ring-rising": PSO(**_CONSTRICTION, **_KEPT_INSIDE, neighbours=3, particles=100, iterations=300, constraints=_RISING),
    "evolving-rising": IPSO(
        variant="evolving",
        evolving_share=1.0,
        shrink_to=4,
        particles=100,
        iterations=300,
        constraints=_RISING,
    ),
    "ipso-e": IPSO(
        variant="evolving",
        **_CONSTRICTION,
        **_KEPT_INSIDE,
        neighbours=3,
        shrink_to=4,
        particles=100,
        iterations=300,
        constraints=_RISING,
    ),
}


def named_settings(name: str) -> SwarmSettings:
    """Return the settings of that name.

    Raises:
        SettingsError: none has it; the nearest and the known names are listed.
    """
    if not isinstance(name, str) or name not in NAMED_SETTINGS:
        raise SettingsError(f"there are no swarm settings named {shown(name)}; {nearest(str(name), NAMED_SETTINGS)}")
    return NAMED_SETTINGS[name]
