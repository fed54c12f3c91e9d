"""The folder that a command's results go into."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from spacearm.cli.stopping import was_interrupted
from spacearm.core.errors import SpacearmError
from spacearm.core.interrupts import unbroken
from spacearm.core.output import claim_new_folder, release_folder


@contextmanager
def results_folder(path: Path) -> Iterator[Path]:
    """Make the folder, and take it away again if the command ends early with nothing written into it.

    Raises:
        OutputError: it holds something already, is no folder, or cannot be written; before any work is done.
        SpacearmError: whatever was raised inside, with what remains in the folder.
        KeyboardInterrupt: likewise, told in its argument.
    """
    absent = [folder for folder in (path, *path.parents) if not os.path.lexists(folder)]
    ours = False
    try:
        with unbroken():
            claim_new_folder(path)
            ours = True
        yield path
    except BaseException as error:
        left = _tidied(path, absent, ours=ours)
        if isinstance(error, KeyboardInterrupt):
            raise type(error)(left or "nothing was written") from None
        if was_interrupted():  # it tripped over the interrupt
            raise KeyboardInterrupt(left or "nothing was written") from None
        if isinstance(error, SpacearmError) and left:
            raise type(error)(f"{error}; {left}") from None
        raise
    else:
        release_folder(path)


@contextmanager
def recorded_in(records: Path | None) -> Iterator[None]:
    """Tell of a study that is interrupted that its records are kept.

    Raises:
        KeyboardInterrupt: what was raised inside, with the records in its argument if there are any.
    """
    try:
        yield
    except KeyboardInterrupt as interrupt:
        if records is None or not records.exists():
            raise
        kept = f"{records} keeps the runs that ended; the same command goes on from them"
        told = str(interrupt)
        raise type(interrupt)(f"{told}; {kept}" if told not in ("", "nothing was written") else kept) from None


def _tidied(folder: Path, made: list[Path], *, ours: bool) -> str:
    """Remove the claim and the folders that are empty and ours; return what remains, in words."""
    with unbroken():
        inside: list[Path] = []
        files: list[str] = []
        if ours:
            release_folder(folder)
            found = [file.relative_to(folder) for file in folder.rglob("*") if not file.is_dir()]
            files = [str(file) for file in sorted(found, key=lambda file: (len(file.parts), file))]
            inside = sorted((inner for inner in folder.rglob("*") if inner.is_dir()), reverse=True)
        for empty in (*inside, *made):
            with contextlib.suppress(OSError):
                empty.rmdir()
    more = f" and {len(files) - 3} more" if len(files) > 3 else ""
    return f"{folder} keeps what was finished: {', '.join(files[:3])}{more}" if files else ""
