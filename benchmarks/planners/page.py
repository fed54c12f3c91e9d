"""Puts measured lines into a page of the documentation, between `<!-- measured: NAME -->` and `<!-- end: NAME -->`.

    python benchmarks/inverse_kinematics.py | python benchmarks/planners/page.py docs/benchmarks.md "goal configurations"

The programs of this folder have `--page` for that.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path


def put_into(page: Path, name: str, lines: Sequence[str]) -> None:
    """Replace what stands between a name's two marks.

    Raises:
        ValueError: the page does not have both marks, in this order and once.
    """
    begin, end = f"<!-- measured: {name} -->\n", f"<!-- end: {name} -->"
    text = page.read_text(encoding="utf-8")
    if text.count(begin) != 1 or text.count(end) != 1 or text.index(begin) > text.index(end):
        raise ValueError(f"{page} has no place for '{name}', expected {begin.strip()} ... {end}")
    head, rest = text.split(begin)
    page.write_text(head + begin + "\n" + "\n".join(lines) + "\n\n" + end + rest.split(end, 1)[1], encoding="utf-8")


if __name__ == "__main__":
    put_into(Path(sys.argv[1]), sys.argv[2], sys.stdin.read().strip().splitlines())
