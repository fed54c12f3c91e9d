"""`spacearm bench`: how good the planner is, on problems of your own or of the field."""

from __future__ import annotations

import contextlib
import json
import sys
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from spacearm.bench.collection import find_items, find_robot
from spacearm.bench.mbm import run_benchmark
from spacearm.bench.measure import LIMIT, Protocol
from spacearm.bench.report import notes, report_as_dict, save_report, tables
from spacearm.checks import as_number, shown
from spacearm.cli.arguments import parsed
from spacearm.cli.folder import results_folder
from spacearm.cli.terminal import progress_bar, show_table
from spacearm.errors import SettingsError, nearest
from spacearm.settings import whole

_SUITES = {"mbm": "MotionBenchMaker's problems, or others in MoveIt's scene and request files"}


@dataclass(frozen=True, kw_only=True)
class Options:
    """What to measure, and where the results go.

    Attributes:
        data: the problems: folders with scene*.yaml and request*.yaml, one a family, the robot's files beside them.
        output: a new or empty folder for report.json, tables.md and the figure.
        urdf: the robot; none: the only URDF file in the data's folder.
        srdf: its groups and the links that may touch; none: the only SRDF file there.
        group: whose joints move.
        families: measure only these; none: all.
        problems: of each family, only so many; none: all.
        seeds: runs of each problem.
        search: how long the bare search goes on, on the reference core [ms].
        budget: how long the search of plan() goes on before the proof, on the reference core [ms].
        figure: draw lengths and first motions over time.
        json: print report.json's content instead of the tables.
    """

    data: Path = field(metadata={"name": "DIR", "flag": "-d"})
    output: Path | None = field(default=None, metadata={"name": "FOLDER", "flag": "-o"})
    urdf: Path | None = None
    srdf: Path | None = None
    group: str = "panda_arm"
    families: tuple[str, ...] | None = None
    problems: int | None = None
    seeds: int = 5
    search: float = 50.0
    budget: float = 50.0
    figure: bool = True
    json: bool = False

    def __post_init__(self) -> None:
        whole("seeds", self.seeds, at_least=1)
        if self.problems is not None:
            whole("problems", self.problems, at_least=1)
        for name in ("search", "budget"):
            as_number(name, getattr(self, name), SettingsError, above=0, unit="ms")
            if getattr(self, name) > 1e3 * LIMIT:
                raise SettingsError(f"{name} is {getattr(self, name):g} ms, expected at most {1e3 * LIMIT:g} ms; lower it")


def run(arguments: Sequence[str]) -> int:
    """Run the command and return its exit code."""
    suite, *rest = arguments or [""]
    if suite not in _SUITES and suite not in ("-h", "--help"):
        given = shown(suite) if suite else "no benchmark"
        raise SettingsError(
            f"{given} is given, expected the name of one, as in spacearm bench mbm -d DIR; {nearest(suite, _SUITES)}"
        )
    options = parsed(
        Options,
        rest if suite in _SUITES else ["--help"],
        command="bench mbm",
        description="Measure the planner on MotionBenchMaker's problems, on one core: the first motion, lengths over time, "
        "proofs, and what another checker says of the motions afterwards. Times are stated for a reference core.",
    )
    protocol = Protocol(seeds=options.seeds, search=options.search / 1e3, plan=options.budget / 1e3)
    items = find_items(options.data, families=options.families or (), most=options.problems)
    robot = find_robot(options.data, urdf=options.urdf, srdf=options.srdf, group=options.group)
    with results_folder(options.output) if options.output else contextlib.nullcontext() as folder:
        with progress_bar("measuring") as bar:
            benchmark = run_benchmark(items, robot, protocol, progress=bar)
        written = [] if folder is None else save_report(benchmark, folder, figure=options.figure)
    if options.json:
        print(json.dumps(report_as_dict(benchmark), indent=1, allow_nan=False))
        return 0
    for title, header, rows in tables(benchmark):
        show_table(title, header, rows)
    for line in notes(benchmark):
        print(line)
    if written:
        print(f"written: {', '.join(path.name for path in written)} in {folder}")
    print(f"{benchmark.seconds:.1f} s", file=sys.stderr)
    return 0
