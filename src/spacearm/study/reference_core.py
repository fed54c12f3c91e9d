"""How fast this core is just now, so that times can be stated for a reference core."""

from __future__ import annotations

import math
import os
import platform
import time
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from spacearm.core.native import kernel_info
from spacearm.core.version import version
from spacearm.study.numpy_reference import LOWER, UPPER, by_matrices

REFERENCE = 2.3e-6
"""What `by_matrices` takes for a configuration on the core that times are stated for [s]."""

_ROWS = 300  # configurations a call, as many as the paper's swarm has particles
_CALLS = 40


def seconds_per_configuration(calls: int = _CALLS) -> float:
    """Time the NumPy kernel now: `by_matrices`, 300 configurations in float64; the median of some calls [s]."""
    q = np.random.default_rng(0).uniform(LOWER, UPPER, (_ROWS, len(LOWER)))
    by_matrices(q)
    taken = []
    for _ in range(calls):
        begun = time.perf_counter()
        by_matrices(q)
        taken.append(time.perf_counter() - begun)
    return float(np.median(taken)) / _ROWS


def scale_now() -> float:
    """Return the seconds of the reference core for a second of this one, as it is just now."""
    return REFERENCE / seconds_per_configuration()


def load_now() -> float:
    """Return how many processes want a core, the last minute's mean; nan where the system does not tell."""
    try:
        return os.getloadavg()[0]
    except (AttributeError, OSError):
        return float("nan")


class CoreSpeed(NamedTuple):
    """How fast this core was when it was measured.

    Attributes:
        scale: seconds of the reference core for a second of this one.
        load: how many processes wanted a core.
    """

    scale: float
    load: float


@lru_cache(maxsize=1)
def speed_for(group: str) -> CoreSpeed:
    """Measure this core, once for a group of tasks that are done one after the other in this process.

    Args:
        group: name of the group; another one than before has the core measured anew.
    """
    return CoreSpeed(scale_now(), load_now())


def machine() -> dict[str, Any]:
    """Return what the times were taken on: processor, cores, system, kernel's build, versions."""
    kernel = kernel_info()
    return {
        "processor": _processor(),
        "cores": os.cpu_count(),
        "system": f"{platform.system()} {platform.machine()}",
        "kernel": f"{kernel.level}, {kernel.compiler}",
        "spacearm": version(),
        "python": platform.python_version(),
        "numpy": np.__version__,
    }


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor() or "unknown"


def speed_note(scales: Sequence[float]) -> str:
    """Return a sentence on the core that times are stated for, and on this one, from the scales of the runs."""
    least, most = (1e6 * REFERENCE / scale for scale in (max(scales), min(scales)))
    return (
        f"times are stated for a core on which the NumPy kernel takes {1e6 * REFERENCE:g} us a configuration; here it took "
        f"{least:.2f} to {most:.2f} us"
    )


def load_note(loads: Sequence[float]) -> str:
    """Return a sentence on the load of the machine; empty where it is not known."""
    known = [load for load in loads if not math.isnan(load)]
    return f"load: {min(known):.1f} to {max(known):.1f} processes" if known else ""


def machine_note() -> str:
    """Return `machine` in a line."""
    return "machine: " + ", ".join(f"{key} {value}" for key, value in machine().items())
