"""`spacearm bench`: how good the planner is, on problems of your own or of the field."""

from __future__ import annotations

import contextlib
import json
import sys
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from spacearm.checks import as_number, shown
from spacearm.cli.arguments import parsed
from spacearm.cli.folder import results_folder
from spacearm.cli.terminal import progress_bar, show_table
from spacearm.errors import SettingsError, nearest
from spacearm.settings import whole
from spacearm.study import motionbenchmaker_report as report
from spacearm.study import spacebench_report as space_report
from spacearm.study.motionbenchmaker import find_items, find_robot
from spacearm.study.motionbenchmaker_runs import LIMIT, Protocol, run_benchmark
from spacearm.study.spacebench import find_problems
from spacearm.study.spacebench_runs import SpaceProtocol, run_spacebench
from spacearm.study.study_tables import Table


@dataclass(frozen=True, kw_only=True)
class MbmOptions:
    """What to measure of MotionBenchMaker's problems, and where the results go.

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
        whole("seeds", self.seeds, at_least=1, at_most=_OFTEN)
        if self.problems is not None:
            whole("problems", self.problems, at_least=1, at_most=_OFTEN)
        for name in ("search", "budget"):
            as_number(name, getattr(self, name), SettingsError, above=0, unit="ms")
            if getattr(self, name) > 1e3 * LIMIT:
                raise SettingsError(f"{name} is {getattr(self, name):g} ms, expected at most {1e3 * LIMIT:g} ms; lower it")


@dataclass(frozen=True, kw_only=True)
class SpaceOptions:
    """What to measure of SpaceBench, and where the results go.

    Attributes:
        data: the frozen set: a folder with a file a family, as truss.json.
        output: a new or empty folder for report.json, tables.md and the figures.
        family: measure only these families; none: all.
        problems: of each family, only so many; none: all.
        seeds: runs of each problem.
        published: seeds of each of the published problems; 0 leaves them out.
        limit: a problem that takes longer is not solved, on the reference core [s].
        figure: draw a problem of each family, what becomes of fixed-base motions, and how far bases turn.
        json: print report.json's content instead of the tables.
    """

    data: Path = field(default=Path("benchmarks/spacebench"), metadata={"name": "DIR", "flag": "-d"})
    output: Path | None = field(default=None, metadata={"name": "FOLDER", "flag": "-o"})
    family: tuple[str, ...] | None = None
    problems: int | None = None
    seeds: int = 1
    published: int = 20
    limit: float = 2.0
    figure: bool = True
    json: bool = False

    def __post_init__(self) -> None:
        whole("seeds", self.seeds, at_least=1, at_most=_OFTEN)
        whole("published", self.published, at_least=0, at_most=_OFTEN)
        if self.problems is not None:
            whole("problems", self.problems, at_least=1, at_most=_OFTEN)
        as_number("limit", self.limit, SettingsError, above=0, at_most=1e6, unit="s")


def run(arguments: Sequence[str]) -> int:
    """Run the command and return its exit code."""
    suite, *rest = arguments or [""]
    if suite in ("-h", "--help"):
        print("usage: spacearm bench {" + ",".join(_SUITES) + "} [options]\n")
        for name, (_, what) in _SUITES.items():
            print(f"  {name:7}{what}")
        return 0
    if suite not in _SUITES:
        given = shown(suite) if suite else "no benchmark"
        raise SettingsError(
            f"{given} is given, expected the name of one, as in spacearm bench mbm -d DIR; {nearest(suite, _SUITES)}"
        )
    return _SUITES[suite][0](rest)


def _mbm(arguments: Sequence[str]) -> int:
    options = parsed(
        MbmOptions,
        arguments,
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
        written = [] if folder is None else report.save_report(benchmark, folder, figure=options.figure)
    values = report.report_as_dict(benchmark) if options.json else None
    _tell(values, report.tables(benchmark), report.notes(benchmark), written, benchmark.seconds)
    return 0


def _space(arguments: Sequence[str]) -> int:
    options = parsed(
        SpaceOptions,
        arguments,
        command="bench space",
        description="Measure the planner on SpaceBench, problems for arms on spacecraft whose base floats, on one core: time "
        "to the first certified motion, how far the base turns, what becomes of motions planned for a fixed base; then on "
        "published problems. Times are stated for a reference core.",
    )
    protocol = SpaceProtocol(seeds=options.seeds, limit=options.limit)
    items = find_problems(options.data, families=options.family or (), most=options.problems)
    with results_folder(options.output) if options.output else contextlib.nullcontext() as folder:
        with progress_bar("measuring") as bar:
            bench = run_spacebench(items, protocol, published=options.published, progress=bar)
        written = [] if folder is None else space_report.save_report(bench, folder, items=items, figure=options.figure)
    values = space_report.report_as_dict(bench) if options.json else None
    _tell(values, space_report.tables(bench), space_report.notes(bench), written, bench.seconds)
    return 0


def _tell(
    values: dict[str, Any] | None, tables: Sequence[Table], notes: Sequence[str], written: Sequence[Path], seconds: float
) -> None:
    if values is not None:
        print(json.dumps(values, indent=1, allow_nan=False))
        return
    for title, header, rows in tables:
        show_table(title, header, rows)
    for line in notes:
        print(line)
    if written:
        print(f"written: {', '.join(path.name for path in written)} in {written[0].parent}")
    print(f"{seconds:.1f} s", file=sys.stderr)


_OFTEN = 1_000_000
_SUITES = {
    "mbm": (_mbm, "MotionBenchMaker's problems, or others in MoveIt's scene and request files"),
    "space": (_space, "SpaceBench: arms on spacecraft whose base floats"),
}
"""The benchmarks: what runs them, and what they are."""
