"""`spacearm paper`: the paper's experiment, from its runs to its report."""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

from tyro.conf import OmitArgPrefixes, arg

from spacearm.cli.arguments import parsed
from spacearm.cli.progress import progress_bar
from spacearm.cli.results_folder import recorded_in, results_folder
from spacearm.cli.terminal import show_table
from spacearm.core.extras import require_extra
from spacearm.study.paper_experiment import run_experiment
from spacearm.study.paper_problem import PaperSettings
from spacearm.study.paper_report import LEGEND, path_notes, report_as_dict, save_report, table_rows


@dataclass(frozen=True, kw_only=True)
class Options:
    """Run the experiment of Zhang et al. 2022: each method many times, Table 3 beside the numbers of the paper, and
    report.html with the swarms and the planned paths in space, the curves, and every declared reading.

    Attributes:
        output: a new or empty folder for report.html, the table and report.json.
        figures: also draw Figures 4-9 and the comparison with matplotlib, which takes most of the time then.
        json: print the report as JSON instead of the tables.
        records: a file that runs are written to as they end; the same file again continues after a stop. The planned paths go
            to a second file beside it.
        jobs: processes; the numbers do not depend on it. One process uses as many threads as `threads` says, each of several
            one.
        experiment: the runs and the problem.
    """

    output: Annotated[Path, arg(metavar="FOLDER", aliases=("-o",))]
    figures: bool = False
    json: bool = False
    records: Annotated[Path | None, arg(metavar="FILE")] = None
    jobs: int = 1
    experiment: Annotated[PaperSettings, OmitArgPrefixes] = field(default_factory=PaperSettings)


def run(arguments: Sequence[str]) -> int:
    """Run the command and return its exit code."""
    options = parsed(Options, arguments, command="paper")
    if options.figures:
        require_extra("matplotlib", "--figures", instead="leave it out: report.html needs no library")
    with recorded_in(options.records), results_folder(options.output) as folder:
        with progress_bar("runs") as bar:
            experiment = run_experiment(options.experiment, records=options.records, jobs=options.jobs, progress=bar)
        with progress_bar("figures" if options.figures else "report") as bar:
            written = save_report(experiment, folder, figures=options.figures, progress=bar)
    if options.json:
        print(json.dumps(report_as_dict(experiment), indent=2, allow_nan=False))
        return 0
    for title, header, rows in table_rows(experiment):
        show_table(title.replace("; ", "\n", 1), header, rows)
    for line in (*LEGEND, *path_notes(experiment)):
        print(line)
    print(f"\nreport: {folder / 'report.html'}; its numbers: report.json")
    figures = [path for path in written if path.suffix == ".png"]
    if figures:
        print(f"figures: {len(figures)}, as PNG and PDF, in {figures[0].parent}")
    print(f"{experiment.seconds:.1f} s for the runs and their planned paths", file=sys.stderr)
    return 0
