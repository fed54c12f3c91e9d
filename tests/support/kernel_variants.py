"""Settings of swarms and of searches for motions, one of each variant."""

from __future__ import annotations

from typing import Any

IPSO = {"inertia_start": 0.9, "inertia_end": 0.4, "velocity_clamp": 0.2, "particles": 33, "evaluations": 33 * 12}
VARIANTS: dict[str, dict[str, Any]] = {
    "pso": {**IPSO, "variant": "pso", "tolerance_share": 0.4},
    "ring": {**IPSO, "variant": "pso", "ring": 2, "bounds": "reflect"},
    "symbiotic": {**IPSO, "variant": "symbiotic", "bounds": "periodic"},
    "cooperative": {**IPSO, "variant": "cooperative"},
    "evolving": {**IPSO, "variant": "evolving", "evolving_share": 1 / 3, "shrink_to": 4, "ring": 2},
    "all evolving": {**IPSO, "variant": "evolving", "evolving_share": 1.0, "constraints": "penalty", "penalty_start": 9.0},
}


MOTIONS: dict[str, tuple[dict[str, Any], dict[str, Any] | None]] = {
    "trees": ({}, None),
    "swarms": ({"patience": 0, "swarm_every": 1}, None),
    "symbiotic": ({"patience": 0}, {**VARIANTS["symbiotic"], "bounds": "absorb"}),
    "evolving": ({"patience": 0, "interior": [3, 1]}, VARIANTS["evolving"]),
}
"""Settings of the search for motions, and of its swarm."""
