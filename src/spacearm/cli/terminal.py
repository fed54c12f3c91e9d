"""What is seen while waiting, and tables."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from itertools import zip_longest

Bar = Callable[[int, int, str], None]
"""Called with the work done, the work in all (0 where it is not known), and what is being done."""


@contextmanager
def progress_bar(title: str) -> Iterator[Bar]:
    """Show a progress bar on stderr while the context lasts; nothing where stderr is no terminal."""
    if not sys.stderr.isatty():
        yield lambda done, total, what: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (TextColumn("{task.description}"), BarColumn(24), TextColumn("{task.fields[share]}"), TimeElapsedColumn())
    with Progress(*columns, TextColumn("{task.fields[what]}"), console=Console(stderr=True), transient=True) as progress:
        task = progress.add_task(title, total=None, share="    ", what="")

        def bar(done: int, total: int, what: str) -> None:
            share = f"{done / total:4.0%}" if total else "    "
            progress.update(task, completed=done, total=total or None, share=share, what=what)

        yield bar


def show_table(title: str, header: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Print a table on stdout, numbers to the right, never cut; a header of several words is stacked."""
    stacked = [name.split() for name in header]
    height = max(map(len, stacked))
    above = list(zip_longest(*([""] * (height - len(words)) + words for words in stacked)))
    widths = [max(len(line[i]) for line in (*above, *rows)) for i in range(len(header))]
    wide = sum(widths) + 2 * (len(widths) - 1)
    gap = "  " if wide <= shutil.get_terminal_size().columns or not sys.stdout.isatty() else " "
    print(title)
    for line in (*above, ["-" * width for width in widths], *rows):
        cells = [
            cell.rjust(width) if i else cell.ljust(width) for i, (cell, width) in enumerate(zip(line, widths, strict=True))
        ]
        print(gap.join(cells).rstrip())
    print()


def show_list(rows: Sequence[tuple[str, str]]) -> None:
    """Print names and what is said of them, in two columns on stdout."""
    width = max(len(name) for name, _ in rows)
    for name, text in rows:
        print(f"{name.ljust(width)}  {text}")
