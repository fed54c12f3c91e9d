"""`spacearm plan`: from a problem.yaml to a proven motion."""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from spacearm.cli.arguments import parsed
from spacearm.cli.terminal import progress_bar, show_table
from spacearm.output import make_new_folder
from spacearm.planner import Plan, load_problem_file, plan, plan_as_dict, save_plan, save_trajectory
from spacearm.show import save_plan_figures


@dataclass(frozen=True, kw_only=True)
class Options:
    """What to plan, and where the results go."""

    problem: tyro.conf.Positional[Path]
    """The problem file, YAML."""
    output: Annotated[Path, tyro.conf.arg(aliases=["-o"])]
    """New or empty folder for plan.json, trajectory.csv and figures."""
    seed: int | None = None
    """Repeats a plan; drawn and recorded if not given."""
    figures: bool = True
    """Draw the path, the joints over time and the clearance."""
    json: bool = False
    """Print plan.json's content instead of the summary."""


def run(arguments: Sequence[str]) -> int:
    """Run the command and return its exit code."""
    options = parsed(
        Options,
        arguments,
        command="plan",
        description="Plan a collision-free motion within all limits, prove it, and write it down.",
    )
    file = load_problem_file(options.problem)
    folder = make_new_folder(options.output)
    with progress_bar("planning") as bar:
        found = plan(file.problem, file.settings, rng=options.seed, progress=lambda what: bar(0, 1, what))
    save_plan(found, folder / "plan.json")
    if found.trajectory is not None:
        save_trajectory(found.trajectory, folder / "trajectory.csv")
        if options.figures:
            with progress_bar("figures"):
                save_plan_figures(found, folder)
    if options.json:
        print(json.dumps(plan_as_dict(found), indent=2))
    else:
        _show(found, folder)
    if not found.found:
        print(f"spacearm: {found.message}", file=sys.stderr)
    return 0 if found.found else 1


def _show(found: Plan, folder: Path) -> None:
    rows = [("status", found.status), ("seed", str(found.seed)), ("goal configurations", str(len(found.goals)))]
    if found.trajectory is not None:
        rows += [
            ("joint path length", f"{found.fitness['length']:.4f}"),
            ("duration", f"{found.trajectory.duration:.3f} s"),
        ]
    if found.certificate is not None:
        rows.append(("certificate", f"{found.certificate.status}: {found.certificate.message}"))
    rows.append(("time", ", ".join(f"{name} {seconds * 1e3:.0f} ms" for name, seconds in found.timings.items())))
    rows.append(("written to", str(folder)))
    show_table("plan", ("", ""), rows)
