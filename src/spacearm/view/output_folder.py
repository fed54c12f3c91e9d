"""The one folder that a viewer writes to: new files with plain names, and nothing else."""

from __future__ import annotations

import os
import re
import stat
from pathlib import Path

from spacearm.core.checks import shown
from spacearm.core.errors import OutputError
from spacearm.core.output import write_new

_PLAIN = re.compile(r"[A-Za-z0-9_][A-Za-z0-9 ._-]*")
_LONGEST = 100  # characters of a name
_OF_WINDOWS = frozenset({"con", "prn", "aux", "nul", *(f"{port}{i}" for port in ("com", "lpt") for i in range(1, 10))})


class OutputFolder:
    """A folder that new files are written into. Names come from a browser, so nothing about them is believed.

    Args:
        path: of a folder that exists.

    Raises:
        OutputError: there is none.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        given = Path(path)
        if not given.is_dir():
            raise OutputError(
                f"{given} is no folder, expected one that exists, for the files to be saved; give it with --folder"
            )
        self.path = given.resolve()
        self._is = self._identity()

    def new_file(self, name: str, ending: str) -> Path:
        """Return the path of a new file in the folder.

        Args:
            name: letters, digits, space, dot, dash and underscore; the ending may be left out.
            ending: with its dot.

        Raises:
            OutputError: a name that is none, or a file that is there.
        """
        words = f"expected a name of letters, digits, space, '.', '-' and '_', as in motion{ending}"
        if not isinstance(name, str) or not _PLAIN.fullmatch(name.strip()):
            raise OutputError(f"the file's name is {shown(name)}, {words}; folders cannot be given")
        plain = name.strip()
        plain = plain if plain.lower().endswith(ending) else plain + ending
        stem = plain[: -len(ending)].rstrip(". ")
        if not stem or len(plain) > _LONGEST or stem.split(".")[0].lower() in _OF_WINDOWS:
            raise OutputError(f"the file's name is {shown(name)}, {words}, of {_LONGEST} characters at most")
        target = self.path / (stem + ending)
        if self._identity() != self._is:
            raise OutputError(f"{self.path} is no longer the folder that it was, expected the same; start the viewer again")
        if os.path.lexists(target):
            raise OutputError(f"{target.name} exists, expected a new name; nothing is overwritten")
        return target

    def write(self, name: str, ending: str, content: str) -> Path:
        """Write a new file, whole or not at all, and return its path.

        Raises:
            OutputError: a name that is none, a file that is there, or it cannot be written.
        """
        target = self.new_file(name, ending)
        write_new(target, content)
        return target

    def free_name(self, stem: str, ending: str) -> str:
        """Return a name that no file has yet: the stem, or with a number behind it."""
        plain = re.sub(r"[^A-Za-z0-9_-]+", "_", stem).strip("_")[:60] or "problem"
        for number in range(1, 10_000):
            name = f"{plain}{'' if number == 1 else f'_{number}'}{ending}"
            if not os.path.lexists(self.path / name):
                return name
        return f"{plain}{ending}"

    def _identity(self) -> tuple[int, int, bool]:
        try:
            found = os.lstat(self.path)
        except OSError:
            return (-1, -1, False)
        return found.st_dev, found.st_ino, stat.S_ISDIR(found.st_mode)
