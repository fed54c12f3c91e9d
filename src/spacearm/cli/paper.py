"""`spacearm paper`: the paper's experiment, from its runs to its figures."""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import tyro

from spacearm.cli.arguments import parsed
from spacearm.cli.terminal import progress_bar, show_table
from spacearm.output import make_new_folder
from spacearm.paper import PaperSettings, run_experiment
from spacearm.paper.report import report_as_dict, save_report, table_rows


@dataclass(frozen=True, kw_only=True)
class Options:
    """What to run, and where the results go."""

    output: Annotated[Path, tyro.conf.arg(aliases=["-o"])]
    """New or empty folder for tables, figures and report.json."""
    settings: PaperSettings = field(default_factory=PaperSettings)
    """What of the experiment is run."""
    figures: bool = True
    """Draw Figures 4-9 and the comparison."""
    json: bool = False
    """Print the report as JSON instead of the table."""


def run(arguments: Sequence[str]) -> int:
    """Run the command and return its exit code."""
    options = parsed(
        Options,
        arguments,
        command="paper",
        description="Run the experiment of Zhang et al. 2022: each method many times, Table 3 beside the paper's numbers, "
        "Figures 4-9, and report.json with every declared reading.",
    )
    folder = make_new_folder(options.output)
    with progress_bar("runs") as bar:
        experiment = run_experiment(options.settings, progress=lambda done, total, what: bar(done, total, what))
    with progress_bar("figures and report") as bar:
        written = save_report(experiment, folder, figures=options.figures, progress=bar)
    if options.json:
        print(json.dumps(report_as_dict(experiment), indent=2))
        return 0
    for title, header, rows in table_rows(experiment):
        show_table(title, header, rows)
    print(f"{experiment.seconds:.1f} s for the runs and their planned paths", file=sys.stderr)
    print(f"report: {folder / 'report.json'}")
    figures = [path for path in written if path.suffix == ".png"]
    if figures:
        print(f"figures: {len(figures)} as PNG and PDF in {figures[0].parent}")
    return 0
