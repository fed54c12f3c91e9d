"""How fast this core is just now, so that times can be stated for a reference core."""

from __future__ import annotations

import os
import platform
import time
from pathlib import Path
from typing import Any

import numpy as np

from spacearm._kernel import kernel_info
from spacearm.bench.numpy_reference import LOWER, UPPER, by_matrices
from spacearm.version import version

REFERENCE = 2.3e-6
"""What `by_matrices` takes for a configuration on the core that times are stated for [s]."""

_ROWS = 300  # the paper's swarm
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
