"""MotionBenchMaker's problems, or others in MoveIt's files: every problem, every seed, one core."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Any

from spacearm.bench.collection import Item, RobotFiles, read_item
from spacearm.bench.measure import Protocol, Run, measure
from spacearm.bench.recheck import OtherChecker
from spacearm.bench.yardstick import load_now, scale_now


@dataclass(frozen=True, slots=True, kw_only=True)
class Benchmark:
    """All runs, and how they were made.

    Attributes:
        protocol: what was measured.
        robot: its files.
        runs: by seed, family and problem.
        loads: how many processes wanted a core, each time the NumPy kernel was measured.
        seconds: that it took.
    """

    protocol: Protocol
    robot: RobotFiles
    runs: tuple[Run, ...]
    loads: tuple[float, ...]
    seconds: float

    @property
    def families(self) -> tuple[str, ...]:
        """The families, in order."""
        return tuple(dict.fromkeys(run.family for run in self.runs))

    @property
    def valid(self) -> tuple[Run, ...]:
        """The runs of problems that can be solved."""
        return tuple(run for run in self.runs if not run.ends_collide)


def run_benchmark(
    items: Sequence[Item],
    robot: RobotFiles,
    protocol: Protocol | None = None,
    *,
    progress: Callable[[int, int, str], Any] | None = None,
) -> Benchmark:
    """Measure all problems with all seeds; before each family the NumPy kernel is measured anew.

    Args:
        items: the problems' files, a family's together.
        robot: its files.
        protocol: what is measured.
        progress: called with the runs done, the runs in all, and what is next.

    Raises:
        SpacearmError: a file that is missing, broken or of another format, before anything is measured.
        KeyboardInterrupt: Ctrl-C.
    """
    protocol = Protocol() if protocol is None else protocol
    tell = progress or (lambda done, total, what: None)
    begun, total = time.perf_counter(), protocol.seeds * len(items)
    tell(0, total, "reading")
    arm = robot.load()
    problems = {item: read_item(item, arm) for item in items}
    other = OtherChecker(robot, arm.dof_names)
    for item in items:
        other.read(item)
    for item in items[:1]:
        measure(item, problems[item], 0, protocol, scale_now(), other)  # what is imported on the way is not timed
    runs, loads = [], []
    for seed in range(protocol.seeds):
        for family, members in groupby(items, key=lambda item: item.family):
            scale = scale_now()
            loads.append(load_now())
            for item in members:
                tell(len(runs), total, f"{family} {item.name}, seed {seed}")
                runs.append(measure(item, problems[item], seed, protocol, scale, other))
    return Benchmark(protocol=protocol, robot=robot, runs=tuple(runs), loads=tuple(loads), seconds=time.perf_counter() - begun)
