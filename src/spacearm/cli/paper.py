"""`spacearm paper`: the paper's experiment, from its runs to its figures."""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from spacearm.cli.arguments import parsed
from spacearm.cli.folder import results_folder
from spacearm.cli.terminal import progress_bar, show_table
from spacearm.study.paper_experiment import run_experiment
from spacearm.study.paper_problem import PaperSettings
from spacearm.study.paper_report import LEGEND, path_notes, report_as_dict, save_report, table_rows


@dataclass(frozen=True, kw_only=True)
class Options:
    """What to run, and where the results go.

    Attributes:
        output: a new or empty folder for tables, figures and report.json.
        figures: draw Figures 4-9 and the comparison, which takes most of the time.
        json: print the report as JSON instead of the tables.
        settings: the experiment.
    """

    output: Path = field(metadata={"name": "FOLDER", "flag": "-o"})
    figures: bool = True
    json: bool = False
    settings: PaperSettings = field(default_factory=PaperSettings)


def run(arguments: Sequence[str]) -> int:
    """Run the command and return its exit code."""
    options = parsed(
        Options,
        arguments,
        command="paper",
        description="Run the experiment of Zhang et al. 2022: each method many times, Table 3 beside the paper's numbers, "
        "Figures 4-9, and report.json with every declared reading.",
    )
    with results_folder(options.output) as folder:
        with progress_bar("runs") as bar:
            experiment = run_experiment(options.settings, progress=bar)
        with progress_bar("figures" if options.figures else "report") as bar:
            written = save_report(experiment, folder, figures=options.figures, progress=bar)
    if options.json:
        print(json.dumps(report_as_dict(experiment), indent=2, allow_nan=False))
        return 0
    for title, header, rows in table_rows(experiment):
        show_table(title.replace("; ", "\n", 1), header, rows)
    for line in (*LEGEND, *path_notes(experiment)):
        print(line)
    print(f"\nreport: {folder / 'report.json'}")
    figures = [path for path in written if path.suffix == ".png"]
    if figures:
        print(f"figures: {len(figures)}, as PNG and PDF, in {figures[0].parent}")
    print(f"{experiment.seconds:.1f} s for the runs and their planned paths", file=sys.stderr)
    return 0
