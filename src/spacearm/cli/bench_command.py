"""`spacearm bench`: how good the planner is, on problems of your own or of the field.

The benchmarks are imported by the functions that run them, after the options are read: help is printed without.
"""

from __future__ import annotations

import contextlib
import json
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from tyro.conf import arg

from spacearm.cli.arguments import parsed
from spacearm.cli.progress import progress_bar
from spacearm.cli.results_folder import recorded_in, results_folder
from spacearm.cli.terminal import show_table
from spacearm.core.checks import as_number, shown
from spacearm.core.errors import SettingsError, nearest
from spacearm.core.extras import require_extra
from spacearm.core.records import whole


@dataclass(frozen=True, kw_only=True)
class MbmOptions:
    """Measure the planner on the problems of MotionBenchMaker, on one core: the first motion, lengths over time, proofs, and
    what another checker finds in the motions afterwards.

    Times are stated for a reference core.

    Attributes:
        data: the problems: a folder for each family with scene*.yaml and request*.yaml, the files of the robot beside them.
        output: a new or empty folder for report.html, report.json and tables.md.
        urdf: the robot; none: the only URDF file in the folder of the data.
        srdf: its groups and the links that may touch; none: the only SRDF file there.
        group: the group whose joints move; none: the one that the requests name.
        families: measure only these families; none: all.
        problems: measure only this number of problems of each family; none: all.
        seeds: runs of each problem.
        search: duration of the search alone, on the reference core [ms].
        budget: duration of the search in plan() before the proof, on the reference core [ms].
        figures: also draw lengths and first motions over time with matplotlib, as PNG and PDF.
        json: print the content of report.json instead of the tables.
        records: a file that each run is written to as it ends; the same file again continues after a stop.
        jobs: runs measured at a time; none: one, since runs beside each other take longer.
    """

    data: Annotated[Path, arg(metavar="DIR", aliases=("-d",))]
    output: Annotated[Path | None, arg(metavar="FOLDER", aliases=("-o",))] = None
    urdf: Path | None = None
    srdf: Path | None = None
    group: str | None = None
    families: tuple[str, ...] | None = None
    problems: int | None = None
    seeds: int = 5
    search: float = 50.0
    budget: float = 50.0
    figures: bool = False
    json: bool = False
    records: Annotated[Path | None, arg(metavar="FILE")] = None
    jobs: int | None = None

    def __post_init__(self) -> None:
        whole("seeds", self.seeds, at_least=1, at_most=_OFTEN)
        if self.problems is not None:
            whole("problems", self.problems, at_least=1, at_most=_OFTEN)
        from spacearm.study.motionbenchmaker_runs import LIMIT

        for name in ("search", "budget"):
            as_number(name, getattr(self, name), SettingsError, above=0, unit="ms")
            if getattr(self, name) > 1e3 * LIMIT:
                raise SettingsError(f"{name} is {getattr(self, name):g} ms, expected at most {1e3 * LIMIT:g} ms; lower it")


@dataclass(frozen=True, kw_only=True)
class SpaceOptions:
    """Measure the planner on SpaceBench, problems for arms on spacecraft whose base floats, on one core: time to the first
    certified motion, how far the base turns, and how motions planned for a fixed base end; then on published problems.

    Times are stated for a reference core.

    Attributes:
        data: the frozen set: a folder with a file for each family, as truss.json.
        output: a new or empty folder for report.html, report.json and tables.md.
        family: measure only these families; none: all.
        problems: measure only this number of problems of each family; none: all.
        seeds: runs of each problem.
        published: seeds of each of the published problems; 0 leaves them out.
        limit: a problem that takes longer than this on the reference core is not solved [s].
        figures: also draw, with matplotlib, a problem of each family, how fixed-base motions end, and how far bases turn.
        json: print the content of report.json instead of the tables.
        records: a file that each run is written to as it ends; the same file again continues after a stop. Runs of the
            published problems go to a second file beside it.
        jobs: runs measured at a time; none: one, since runs beside each other take longer.
    """

    data: Annotated[Path, arg(metavar="DIR", aliases=("-d",))] = Path("benchmarks/spacebench")
    output: Annotated[Path | None, arg(metavar="FOLDER", aliases=("-o",))] = None
    family: tuple[str, ...] | None = None
    problems: int | None = None
    seeds: int = 1
    published: int = 20
    limit: float = 2.0
    figures: bool = False
    json: bool = False
    records: Annotated[Path | None, arg(metavar="FILE")] = None
    jobs: int | None = None

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
    options = parsed(MbmOptions, arguments, command="bench mbm")
    _require_figures(options.figures)
    from spacearm.study.motionbenchmaker import find_items, find_robot
    from spacearm.study.motionbenchmaker_report import notes, report_as_dict, save_report, tables
    from spacearm.study.motionbenchmaker_runs import Protocol, run_benchmark

    protocol = Protocol(seeds=options.seeds, search=options.search / 1e3, plan=options.budget / 1e3)
    items = find_items(options.data, families=options.families or (), most=options.problems)
    robot = find_robot(options.data, items, urdf=options.urdf, srdf=options.srdf, group=options.group)
    with (
        recorded_in(options.records),
        results_folder(options.output) if options.output else contextlib.nullcontext() as folder,
    ):
        with progress_bar("measuring") as bar:
            benchmark = run_benchmark(items, robot, protocol, records=options.records, jobs=options.jobs, progress=bar)
        with progress_bar("report") as bar:
            written = (
                save_report(benchmark, folder, items=items, figures=options.figures, progress=bar) if folder is not None else []
            )
    values = report_as_dict(benchmark) if options.json else None
    _tell(values, tables(benchmark), notes(benchmark), written, benchmark.seconds)
    return 0


def _space(arguments: Sequence[str]) -> int:
    options = parsed(SpaceOptions, arguments, command="bench space")
    _require_figures(options.figures)
    from spacearm.study.spacebench import find_problems
    from spacearm.study.spacebench_report import notes, report_as_dict, save_report, tables
    from spacearm.study.spacebench_runs import SpaceProtocol, run_spacebench

    protocol = SpaceProtocol(seeds=options.seeds, limit=options.limit)
    items = find_problems(options.data, families=options.family or (), most=options.problems)
    with (
        recorded_in(options.records),
        results_folder(options.output) if options.output else contextlib.nullcontext() as folder,
    ):
        with progress_bar("measuring") as bar:
            bench = run_spacebench(
                items,
                protocol,
                published=options.published,
                records=options.records,
                jobs=options.jobs,
                progress=bar,
            )
        with progress_bar("report") as bar:
            written = (
                save_report(bench, folder, items=items, figures=options.figures, progress=bar) if folder is not None else []
            )
    values = report_as_dict(bench) if options.json else None
    _tell(values, tables(bench), notes(bench), written, bench.seconds)
    return 0


def _require_figures(wanted: bool) -> None:
    if wanted:
        require_extra("matplotlib", "--figures", instead="leave it out: report.html needs no library")


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


Table = tuple[str, Sequence[str], Sequence[Sequence[str]]]
"""Title, header, rows."""

_OFTEN = 1_000_000
_SUITES = {
    "mbm": (_mbm, "MotionBenchMaker's problems, or others in MoveIt's scene and request files"),
    "space": (_space, "SpaceBench: arms on spacecraft whose base floats"),
}
"""The benchmarks: what runs them, and what they are."""
