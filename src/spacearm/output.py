"""Files we write: whole or not at all, and never over something that is there."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

from spacearm.errors import OutputError


def write_atomically(path: str | os.PathLike[str], content: bytes | str) -> None:
    """Write a file so that it holds either all of the content or what it held before.

    Raises:
        OutputError: the folder is missing or not writable, or the disk is full.
    """
    target = Path(path)
    data = content.encode() if isinstance(content, str) else content
    temporary = ""
    try:
        handle, temporary = tempfile.mkstemp(prefix=f".{target.name}.", dir=target.parent)
        with os.fdopen(handle, "wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        os.chmod(temporary, 0o666 & ~_umask())
        os.replace(temporary, target)
    except BaseException as error:  # Ctrl-C too must leave nothing behind
        if temporary:
            Path(temporary).unlink(missing_ok=True)
        if isinstance(error, OSError):
            raise OutputError(_sentence(target, error)) from None
        raise


def make_new_folder(path: str | os.PathLike[str]) -> Path:
    """Make a folder for results, or take one that is empty.

    Raises:
        OutputError: it holds something already, is no folder, or cannot be made.
    """
    folder = Path(path)
    try:
        if folder.exists() and not folder.is_dir():
            raise OutputError(f"{folder} is a file, expected a folder for the results; choose another with -o")
        if folder.is_dir() and any(folder.iterdir()):
            raise OutputError(
                f"{folder} is not empty, expected a new or empty folder; choose another with -o or move its contents"
            )
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(_sentence(folder, error)) from None
    return folder


def _sentence(path: Path, error: OSError) -> str:
    reason = error.strerror or str(error)
    return f"{path} cannot be written ({reason}); free space there or choose another place"


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
