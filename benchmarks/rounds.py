"""Timing side by side: contestants take turns, round after round, and a ratio is taken within each round.

On a shared machine the clock and the neighbours change from second to second. Within a round they are nearly the same
for all, so the median of the rounds' ratios says more than the ratio of two medians. The least time of a contestant
says what the machine can do when nobody disturbs it.
"""

from __future__ import annotations

import os
import platform
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from spacearm.study.study_tables import Table, markdown


@dataclass(frozen=True)
class Rounds:
    """Seconds of every contestant in every round, (rounds,) each."""

    seconds: dict[str, np.ndarray]

    def least(self, name: str) -> float:
        return float(self.seconds[name].min())

    def median(self, name: str) -> float:
        return float(np.median(self.seconds[name]))

    def ratio(self, slow: str, fast: str) -> float:
        """How many times `slow` takes what `fast` takes, median over the rounds."""
        return float(np.median(self.seconds[slow] / self.seconds[fast]))


def take_turns(contestants: dict[str, Callable[[], object]], *, rounds: int, block: float = 2e-3) -> Rounds:
    """Time each contestant once a round, called as often as fills `block` seconds, after one call that is not timed.

    A contestant that returns a float tells its own seconds (it runs elsewhere, or not all of it counts).
    """
    calls = {}
    for name, call in contestants.items():
        call()
        calls[name] = max(1, round(block / _once(call)))
    seconds: dict[str, list[float]] = {name: [] for name in contestants}
    for _ in range(rounds):
        for name, call in contestants.items():
            call()  # wakes the core and fills the caches that the one before left cold
            seconds[name].append(_mean(call, calls[name]))
    return Rounds({name: np.array(values) for name, values in seconds.items()})


def print_table(title: str, head: str, rows: list[list[object]]) -> None:
    """Print a table as markdown; `head` names its columns, parted by bars."""
    header = tuple(column.strip() for column in head.split("|"))
    print("\n" + markdown([Table(title, header, [tuple(map(str, row)) for row in rows])], []), flush=True)


def machine(kernel: str) -> str:
    """The machine, the kernel's build and the versions, in a line."""
    model = platform.processor() or "unknown processor"
    cpuinfo = Path("/proc/cpuinfo")
    if cpuinfo.exists():
        names = [line.split(":", 1)[1].strip() for line in cpuinfo.read_text().splitlines() if line.startswith("model name")]
        model = names[0] if names else model
    return (
        f"{model}, {os.cpu_count()} cores, {platform.system()} {platform.machine()}; {kernel}; "
        f"Python {platform.python_version()}, NumPy {np.__version__}"
    )


def _once(call: Callable[[], object]) -> float:
    return min(_mean(call, 1) for _ in range(3))


def _mean(call: Callable[[], object], times: int) -> float:
    own, begun = 0.0, time.perf_counter()
    for _ in range(times):
        told = call()
        own += told if isinstance(told, float) else 0.0
    return (own or time.perf_counter() - begun) / times
