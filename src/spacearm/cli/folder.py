"""The folder that a command's results go into."""

from __future__ import annotations

import contextlib
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from spacearm.errors import OutputError, SpacearmError
from spacearm.output import make_new_folder


@contextmanager
def results_folder(path: Path) -> Iterator[Path]:
    """Make the folder, and take it away again if the command ends early with nothing written into it.

    Raises:
        OutputError: it holds something already, is no folder, or cannot be written; before any work is done.
        SpacearmError: whatever was raised inside, with what remains in the folder.
        KeyboardInterrupt: likewise, told in its argument.
    """
    absent = [folder for folder in (path, *path.parents) if not os.path.lexists(folder)]
    make_new_folder(path)
    try:
        _require_writable(path)
        yield path
    except SpacearmError as error:
        left = _tidied(path, absent)
        raise type(error)(f"{error}; {left}" if left else str(error)) from None
    except KeyboardInterrupt:
        raise KeyboardInterrupt(_tidied(path, absent) or "nothing was written") from None
    except BaseException:
        _tidied(path, absent)
        raise


def _require_writable(folder: Path) -> None:
    """Find out now, rather than after minutes of work."""
    try:
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise OutputError(f"{folder} cannot be written ({error.strerror}); choose another with -o") from None


def _tidied(folder: Path, made: list[Path]) -> str:
    """Remove the folders that are empty and ours; return what remains, in words."""
    found = [file.relative_to(folder) for file in folder.rglob("*") if not file.is_dir()]
    files = [str(file) for file in sorted(found, key=lambda file: (len(file.parts), file))]
    inside = sorted((inner for inner in folder.rglob("*") if inner.is_dir()), reverse=True)
    for empty in (*inside, *made):
        with contextlib.suppress(OSError):
            empty.rmdir()
    more = f" and {len(files) - 3} more" if len(files) > 3 else ""
    return f"{folder} keeps what was finished: {', '.join(files[:3])}{more}" if files else ""
