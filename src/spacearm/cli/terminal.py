"""What a command shows: progress bars, tables, lists, and notes on stderr. Plain where the stream is no terminal."""

from __future__ import annotations

import math
import re
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

    from spacearm.planner import BaseReport
    from spacearm.proof import Certificate
    from spacearm.robot import Robot

Bar = Callable[[int, int, str], None]
"""Called with the work done, the work in all (0 where it is not known), and what is being done."""

_LONGEST = 200  # characters of a note on a robot that are printed; the list of joints of a large robot is longer
_NAMES_AND_NUMBERS = re.compile(r"'[^']*'|[-+]?\d[\d.e+-]*")
_NEAR_PAIRS = 10  # pairs near at an end that a list names
_ENDLESS = 100_000  # [characters] the width of a file or a pipe, where nothing is wrapped


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
    """Print a table on stdout, numbers to the right, no cell cut; each word of a header has a line of its own."""
    from rich.box import Box
    from rich.table import Table

    lines = Box("    \n    \n -- \n    \n    \n    \n    \n    \n", ascii=True)  # a line of hyphens below the header
    table = Table(box=lines, show_edge=False, pad_edge=False, padding=(0, 1, 0, 0))
    for i, name in enumerate(header):
        table.add_column("\n".join(name.split()), justify="right" if i else "left", vertical="bottom", overflow="fold")
    for row in rows:
        table.add_row(*row)
    console = _console()
    wanted = console.measure(table, options=console.options.update(width=_ENDLESS)).maximum
    if wanted > console.width:
        table.padding = 0
    print(title)
    _show(table, console)
    print()


def show_list(rows: Sequence[tuple[str, str]]) -> None:
    """Print names and what is said of them, in two columns on stdout."""
    from rich.table import Table

    table = Table.grid(padding=(0, 2, 0, 0))
    table.add_column(no_wrap=True, style="bold")
    table.add_column(overflow="fold")
    for row in rows:
        table.add_row(*row)
    _show(table, _console())


def _console() -> Console:
    from rich.console import Console

    width = None if sys.stdout.isatty() else _ENDLESS
    return Console(width=width, markup=False, highlight=False, emoji=False)


def _show(table: Table, console: Console) -> None:
    with console.capture() as shown:
        console.print(table)
    print("\n".join(line.rstrip() for line in shown.get().removesuffix("\n").split("\n")))


def tell_notes(about: object, notes: Iterable[str]) -> None:
    """Print notes about a file or a robot on stderr; the same one once."""
    for note in dict.fromkeys(notes):
        print(f"spacearm: {about}: {note}", file=sys.stderr)


def tell_robot(robot: Robot, *, more: str) -> None:
    """Print on stderr what was assumed of a robot, a line a kind.

    Args:
        robot: with notes. Of a note with a long list the beginning is printed. What belongs to a robot that comes with spacearm
            is left out: the documentation tells it.
        more: where the notes are in full.
    """
    from spacearm.robot import builtin_robots, load_robot

    known = set(load_robot(robot.source).notes) if robot.source in builtin_robots() else set[str]()
    notes = [note for note in robot.notes if note not in known]
    told = [_shortened(note) for note in _folded(notes)]
    tell_notes(f"robot '{robot.name}'", told)
    if told != notes:
        print(f"spacearm: {more} has the notes in full", file=sys.stderr)


def _folded(notes: Sequence[str]) -> list[str]:
    """Return the first note of each kind, with the number of the others: those that differ in names and numbers alone."""
    kinds: dict[str, list[str]] = {}
    for note in dict.fromkeys(notes):
        kinds.setdefault(_NAMES_AND_NUMBERS.sub("", note), []).append(note)
    return [same[0] + (f" (and {len(same) - 1} more of this kind)" if len(same) > 1 else "") for same in kinds.values()]


@contextmanager
def loading() -> Iterator[None]:
    """Show on stderr what takes long in loading a robot while the context lasts; nothing where stderr is no terminal."""
    if not sys.stderr.isatty():
        yield
        return
    from spacearm.core.long_work import on_progress

    width = 0

    def say(words: str) -> None:
        nonlocal width
        width = max(width, len(words))
        print(f"\r{words.ljust(width)}", end="", file=sys.stderr, flush=True)

    try:
        with on_progress(say):
            yield
    finally:
        if width:
            print(f"\r{' ' * width}\r", end="", file=sys.stderr, flush=True)


def _shortened(note: str) -> str:
    if len(note) <= _LONGEST:
        return note
    shown = note[:_LONGEST].rpartition(", ")[0] or note[:_LONGEST]
    left = note[len(shown) :].count(", ")
    return f"{shown}, ..." + (f" ({left} more)" if left > 1 else "")


def base_rows(base: BaseReport) -> list[tuple[str, str]]:
    """Return rows for `show_list`: how a floating base turns, its joint momentum, and by how much the goals are missed."""
    final, peak, rate = (_small(math.degrees(value)) for value in (base.final, base.peak, base.rate))
    rows = [
        (
            "base",
            f"turned by {final} deg at the end, {peak} deg at most; turns at {rate} deg/s at most; "
            f"joint momentum {_small(base.joint_momentum)} N m s at most",
        )
    ]
    ends = []
    if base.goal_distance is not None:
        off = f" and {_small(math.degrees(base.goal_angle))} deg" if base.goal_angle else ""
        ends.append(f"end effector {_small(base.goal_distance * 1e3)} mm{off} from its goal")
    if base.base_angle is not None:
        ends.append(f"base {_small(math.degrees(base.base_angle))} deg from its goal attitude")
    if ends:
        rows.append(("ends with", ", ".join(ends)))
    return rows + [("not as asked", text) for text in base.missed]


def _small(value: float) -> str:
    return f"{value:.3g}" if value >= 1e-3 or value == 0 else "< 0.001"


def rows_on_tracking(certificate: Certificate) -> list[tuple[str, str]]:
    """Return a row with the tracking error that a proof includes; none without one."""
    if certificate.tracking is None:
        return []
    from spacearm.proof.tracking import tracking_in_words

    return [("tracking error", f"{tracking_in_words(certificate.robot, certificate.tracking)} at any instant")]


def rows_on_near_pairs(certificate: Certificate) -> list[tuple[str, str]]:
    """Return rows of a list on the pairs that are near at the start or the goal, the first few; `plan.json` has all."""
    rows = [("near at an end", pair.text) for pair in certificate.near_pairs]
    more = len(rows) - _NEAR_PAIRS
    return rows if more <= 1 else [*rows[:_NEAR_PAIRS], ("near at an end", f"and {more} more pairs, listed in the certificate")]
