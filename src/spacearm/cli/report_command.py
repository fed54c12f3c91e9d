"""`spacearm report`: a page of one saved plan, or of several beside each other.

The files and the report are imported by the function that uses them, after the options are read: help is printed without.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from tyro.conf import Positional, arg

from spacearm.cli.arguments import parsed
from spacearm.cli.progress import progress_bar
from spacearm.cli.terminal import show_list
from spacearm.core.interrupts import unbroken
from spacearm.core.output import require_new


@dataclass(frozen=True, kw_only=True)
class Options:
    """Write a report of saved plans: the robot in 3-D over time, its curves, and what is proven; one page for a browser.

    Several plans are drawn beside each other, the first one solid and the others pale, with their figures in a table. What the
    files say of themselves is shown, and not proven again.

    Attributes:
        plan: a plan.json.
        others: further ones, to be shown beside it.
        output: the page, a new file.
        title: of the page; none: by the robot's name.
    """

    plan: Annotated[Positional[Path], arg(metavar="PLAN.JSON")]
    others: Annotated[Positional[tuple[Path, ...]], arg(metavar="PLAN.JSON")] = ()
    output: Annotated[Path, arg(metavar="REPORT.HTML", aliases=("-o",))]
    title: Annotated[str | None, arg(metavar="TEXT")] = None


def run(arguments: Sequence[str]) -> int:
    """Run the command and return its exit code."""
    options = parsed(Options, arguments, command="report")
    paths = (options.plan, *options.others)
    require_new(options.output, advice="choose another name with -o")
    with unbroken():
        from spacearm.files import load_saved_plan
        from spacearm.show.report_page import write_report
        from spacearm.show.report_plan import report_of_plans
    with progress_bar("report") as bar:
        saved = []
        for i, path in enumerate(paths):
            bar(i, len(paths), str(path))
            saved.append(load_saved_plan(path))
        bar(0, 0, "clearances, curves and scene")
        page = report_of_plans(saved, title=options.title or "", names=names_of(paths))
        write_report(page, options.output)
    size = f"{options.output.stat().st_size / 1e6:.2f} MB"
    views = [(view["name"], view["verdict"]["headline"]) for view in page["views"]]
    show_list([*views, ("written", f"{options.output} ({size}); open it in a browser")])
    return 0


def names_of(paths: Sequence[Path]) -> list[str]:
    """Return short names of files that differ: the files' own, or with as many of their folders as it takes.

    Of files with the same name in different folders, as `a/plan.json` and `b/plan.json`, it is the folders' names.
    """
    parts = [(*path.absolute().parts[:-1], path.stem) for path in paths]
    if len(parts) > 1 and len({part[-1] for part in parts}) == 1:
        parts = [part[:-1] for part in parts]
    names = [part[-1] for part in parts]
    for count in range(1, max(map(len, parts)) + 1):
        names = ["/".join(part[-count:]) for part in parts]
        if len(set(names)) == len(names):
            return names
    return [f"{name} ({i})" for i, name in enumerate(names, start=1)]  # the same file twice
