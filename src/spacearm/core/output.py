"""Files we write: whole or not at all, and never over something that is there."""

from __future__ import annotations

import os
import secrets
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from spacearm.core.checks import shown
from spacearm.core.errors import OutputError, SettingsError
from spacearm.core.interrupts import unbroken

CLAIM = ".spacearm-is-writing"
"""A file that stands in a folder for results while a run writes there, so that no other run does."""

_NEW = os.O_CREAT | os.O_EXCL | os.O_WRONLY | getattr(os, "O_BINARY", 0)


def write_atomically(path: str | os.PathLike[str], content: bytes | str) -> None:
    """Write a file so that it has either all of the content or what it had before.

    Raises:
        OutputError: the folder is missing or not writable, or the disk is full.
    """
    require_path(path)
    target = Path(path)
    with unbroken(), _written_beside(target, content) as temporary:
        os.replace(temporary, target)


def write_new(path: str | os.PathLike[str], content: bytes | str) -> None:
    """Write a new file, whole or not at all; of several who write the same one at once, one does.

    Raises:
        OutputError: the file exists already, the folder is missing or not writable, or the disk is full.
    """
    require_new(path)
    target = Path(path)
    with unbroken(), _written_beside(target, content) as temporary:
        try:
            _linked(temporary, target)
        except FileExistsError:
            raise OutputError(_exists(target)) from None


def write_out(path: str | os.PathLike[str], content: bytes | str, *, overwrite: bool) -> None:
    """Write a file: a new one, or in place of what is there if that was asked for.

    Raises:
        OutputError: the file exists already and was not to be replaced, or it cannot be written.
    """
    if overwrite:
        write_atomically(path, content)
    else:
        write_new(path, content)


def require_writable(path: str | os.PathLike[str], *, overwrite: bool) -> None:
    """Refuse, before the work is done, what `write_out` would refuse after it.

    Raises:
        OutputError: the file exists already and is not to be replaced, or its name is none.
        SettingsError: overwrite is neither true nor false.
    """
    if not isinstance(overwrite, bool):
        raise SettingsError(f"overwrite is {shown(overwrite)}, expected True or False")
    if overwrite:
        require_path(path)
    else:
        require_new(path, advice="choose another name, or give overwrite=True")


def require_new(path: str | os.PathLike[str], *, advice: str = "choose another name") -> None:
    """Refuse to write over something, before the work is done that it would hold.

    Args:
        path: where something will be written.
        advice: what to do if something is there.

    Raises:
        OutputError: the file exists already, or its name is none.
    """
    require_path(path)
    if os.path.lexists(path):
        raise OutputError(_exists(path, advice))


def require_path(path: Any) -> None:
    """Refuse what cannot be the path of a file.

    Raises:
        OutputError: such a one.
    """
    try:
        fine = isinstance(path, (str, os.PathLike)) and os.fsencode(path).strip() and b"\0" not in os.fsencode(path)
    except (TypeError, ValueError):
        fine = False
    if not fine or isinstance(path, bytes):
        raise OutputError(f"path is {shown(path)}, expected the path of a file (a str or a Path)")


def make_new_folder(path: str | os.PathLike[str]) -> Path:
    """Make a folder for results, or take one that is empty.

    Raises:
        OutputError: it holds something already, is no folder, or cannot be made.
    """
    folder = Path(path)
    try:
        if folder.exists() and not folder.is_dir():
            raise OutputError(f"{folder} is a file, expected a folder for the results; choose another with -o")
        if folder.is_dir():
            _require_empty(folder)
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(_sentence(folder, error)) from None
    return folder


def claim_new_folder(path: str | os.PathLike[str]) -> Path:
    """Make a folder for results, or take an empty one, and keep other runs out of it until `release_folder`.

    Raises:
        OutputError: it holds something already, another run is writing there, it is no folder, or cannot be written.
    """
    folder = make_new_folder(path)
    try:
        _touch_new(folder / CLAIM)
    except FileExistsError:
        raise OutputError(
            f"{folder} is being written by another run, expected a new or empty folder; choose another with -o, or remove "
            f"{folder / CLAIM} if that run is dead"
        ) from None
    except FileNotFoundError:  # another run that ended early has taken it away as its own
        return claim_new_folder(path)
    except OSError as error:
        raise OutputError(f"{folder} cannot be written ({error.strerror}); choose another with -o") from None
    try:
        _require_empty(folder)  # once more: whoever was here before may have finished since
    except OutputError:
        release_folder(folder)
        raise
    return folder


def release_folder(folder: Path) -> None:
    """Take the claim away."""
    with suppress(OSError):
        (folder / CLAIM).unlink()


def _require_empty(folder: Path) -> None:
    if any(inside.name != CLAIM for inside in folder.iterdir()):
        raise OutputError(f"{folder} is not empty, expected a new or empty folder; choose another with -o or move its contents")


@contextmanager
def _written_beside(target: Path, content: bytes | str) -> Iterator[str]:
    """Write a temporary file next to the target, and take it away in the end if it is still there."""
    data = content.encode() if isinstance(content, str) else content
    temporary = ""
    try:
        temporary = os.path.join(target.parent, f".{target.name[:100]}.{secrets.token_hex(8)}")
        with os.fdopen(os.open(temporary, _NEW, 0o666), "wb") as file:  # the mode as the umask has it
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        yield temporary
    except OSError as error:
        raise OutputError(_sentence(target, error)) from None
    finally:
        if temporary:
            Path(temporary).unlink(missing_ok=True)


def _linked(temporary: str, target: Path) -> None:
    """Give the file its name, unless something has it; where there are no hard links, by reserving the name first.

    Raises:
        FileExistsError: something has that name.
    """
    try:
        os.link(temporary, target)
        return
    except FileExistsError:
        raise
    except (OSError, AttributeError, NotImplementedError):  # FAT, some network file systems
        pass
    _touch_new(target)
    try:
        os.replace(temporary, target)
    except BaseException:
        target.unlink(missing_ok=True)
        raise


def _touch_new(path: Path) -> None:
    os.close(os.open(path, _NEW, 0o666))


def _exists(path: str | os.PathLike[str], advice: str = "choose another name") -> str:
    return f"{path} exists, expected a new file; {advice}"


def _sentence(path: Path, error: OSError) -> str:
    reason = error.strerror or str(error)
    return f"{path} cannot be written ({reason}); free space there or choose another place"
