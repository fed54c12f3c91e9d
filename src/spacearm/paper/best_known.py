"""The best known values of the seed's problem, and how they were found.

Gradient descent from many random starts, not a swarm: SciPy's SLSQP with the obstacles' clearances and the goal's
distance as smooth constraints, 2,000 starts a case, kept when the kernel finds no violation
(`python benchmarks/best_known.py`). They are the best found, not proven optima.
"""

from __future__ import annotations

from collections.abc import Sequence

from spacearm.paper.settings import PaperSettings

_FOUND_BY = "SLSQP from 2,000 random starts (benchmarks/best_known.py)"

BEST_KNOWN = {
    ("goal", 0.06): 2.936628358,
    ("goal", 0.10): 2.984974500,
    ("goal", 0.15): 3.068618424,
    ("literal", 0.06): 2.499680820,
    ("literal", 0.10): 2.561027421,
    ("literal", 0.15): 2.663172747,
}
"""By mode and obstacle radius [m], for the default weights, tolerance and link radius."""


def best_known_value(settings: PaperSettings, mode: str, radius: float, feasible: Sequence[float]) -> tuple[float | None, str]:
    """Return the best known value and how it was found; the runs' own best where it is better or none is known.

    Args:
        settings: of the experiment.
        mode: "goal" or "literal".
        radius: of the obstacles A_R [m].
        feasible: the fitness of each feasible run.

    Returns:
        The value, None if no run was feasible and none is recorded, and the sentence.
    """
    default = PaperSettings()
    as_recorded = (settings.weights, settings.tolerance, settings.link_radius) == (
        default.weights,
        default.tolerance,
        default.link_radius,
    )
    recorded = BEST_KNOWN.get((mode, radius)) if as_recorded else None
    if recorded is None and not feasible:
        return None, "no run was feasible, and none is recorded for these settings"
    if recorded is None:
        return min(feasible), "the best of these runs; none is recorded for these settings"
    if feasible and min(feasible) < recorded:
        return min(feasible), "the best of these runs, better than the recorded one"
    return recorded, _FOUND_BY
