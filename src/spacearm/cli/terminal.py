"""What a command shows: tables, lists, and notes on stderr. In colour in a terminal, plain where the stream is none.

Colours follow NO_COLOR (https://no-color.org), and say nothing that the words do not say.
"""

from __future__ import annotations

import math
import os
import re
import sys
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Literal

from spacearm.cli.progress import moves, progress_bar

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    from spacearm.planner import BaseReport
    from spacearm.proof import Certificate
    from spacearm.robot import Robot

_LONGEST = 200  # characters of a note on a robot that are printed; the list of joints of a large robot is longer
_NAMES_AND_NUMBERS = re.compile(r"'[^']*'|[-+]?\d[\d.e+-]*")
_NEAR_PAIRS = 10  # pairs near at an end that a list names
_ENDLESS = 100_000  # [characters] the width of a file or a pipe, where nothing is wrapped


Tone = Literal["good", "middling", "bad", "quiet"]

_COLORS: dict[Tone, int] = {"good": 36, "middling": 172, "bad": 166, "quiet": 244}
"""Of 256: bluish green, orange, vermilion, grey; for the colour-blind, on dark and light."""

_SUCCESS = frozenset({"solved", "certified", "reach", "to", "within", "feasible", "proven", "found", "hold"})
"""Words of the headers of columns that tell how often something succeeds."""

_HARM = frozenset({"collisions", "unsound"})
"""Words of the headers of columns that count what must not be."""

_GOOD_CELLS = frozenset({"proven", "holds"})
_SHARE = re.compile(r"(\d+(?:\.\d+)?) ?%|(\d+)/(\d+)")
_GOOD_WORDS, _BAD_WORDS = (
    ("found", "holds", "says the same"),
    ("fails", "undecided", "not_", "no_", "goal_", "start_", "says otherwise"),
)


def painted(text: str, tone: Tone) -> str:
    """Return a text in a colour where stdout is a terminal, else as it is."""
    if not moves(sys.stdout) or os.environ.get("NO_COLOR"):
        return text
    return f"\x1b[38;5;{_COLORS[tone]}m{text}\x1b[0m"


def tone_of(header: str, cell: str) -> Tone | None:
    """Return the tone of a cell that tells how often something succeeds; None of other cells."""
    words = set(header.lower().split())
    if words & _HARM and cell.strip().isdigit():
        return "good" if int(cell) == 0 else "bad"
    if cell.strip() in _GOOD_CELLS:
        return "good"
    found = _SHARE.search(cell) if words & _SUCCESS else None
    if found is None:
        return None
    percent, part, whole = found.groups()
    share = float(percent) / 100 if percent else int(part) / max(int(whole), 1)
    if share >= 0.9995:
        return "good"
    return None if share >= 0.9 else "middling" if share >= 0.5 else "bad"


def show_table(title: str, header: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Print a table on stdout, numbers to the right, no cell cut; each word of a header has a line of its own."""
    from rich.box import Box
    from rich.table import Table

    lines = Box("    \n    \n -- \n    \n    \n    \n    \n    \n", ascii=True)  # a line of hyphens below the header
    table = Table(box=lines, show_edge=False, pad_edge=False, padding=(0, 1, 0, 0))
    for i, name in enumerate(header):
        justify = "right" if i else "left"
        table.add_column("\n".join(name.split()), justify=justify, vertical="bottom", overflow="fold", header_style="bold")
    for row in rows:
        table.add_row(*(_text((cell, tone_of(name, cell))) for name, cell in zip(header, row, strict=True)))
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
    for name, said in rows:
        first = said.partition(":")[0]
        good, bad = first in _GOOD_WORDS, first.startswith(_BAD_WORDS)
        judged = name in ("status", "certificate", "file's certificate") and (good or bad)
        tone: Tone | None = ("good" if good else "bad") if judged else None
        table.add_row(_text((name, None)), _text((first, tone), (said[len(first) :], None)))
    _show(table, _console())


def _harmless(words: str) -> str:
    """Return words without codes that a terminal would obey, as names of files may hold them."""
    return "".join(c if c.isprintable() or (c.isspace() and c not in "\r\v\f") else repr(c)[1:-1] for c in words)


def _text(*parts: tuple[str, Tone | None]) -> Text:
    from rich.text import Text

    text = Text()
    for words, tone in parts:
        text.append(_harmless(words), style="" if tone is None else f"color({_COLORS[tone]})")
    return text


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
def loading(title: str = "loading") -> Iterator[None]:
    """Show on stderr what takes long in loading a robot while the context lasts; nothing where stderr is no terminal."""
    with progress_bar(title):
        yield


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
