"""Records on disk: a file of JSON lines to which each record is appended as soon as its task is done.

The first line names the format, the study and the version of spacearm. Each further line holds the name of a task, its
definition (all that its record depends on), and its record. A line is written whole; if the process or the machine stopped
within one, the rest of that line is cut off when the file is opened again. Infinite numbers and NaN, which JSON has not, are
written as the texts "Infinity", "-Infinity" and "NaN".
"""

from __future__ import annotations

import contextlib
import dataclasses
import hashlib
import json
import math
import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, Generic, TypeVar

from spacearm.core.checks import shown
from spacearm.core.errors import FileFormatError, OutputError
from spacearm.core.reading import read_bytes
from spacearm.core.version import version

R = TypeVar("R")

KEY = "spacearm-study"
VERSION = 1
_SHOWN = 3  # differences of a definition that a message names


@dataclass(frozen=True, kw_only=True)
class Recorded(Generic[R]):
    """A line of the file.

    Attributes:
        definition: of the task, as plain values.
        record: what came of the task.
    """

    definition: dict[str, Any]
    record: R


Append = Callable[[str, Mapping[str, Any], Any], None]
"""Appends a record: called with the name of the task, its definition, and its record."""


def load_records(path: str | os.PathLike[str], record: type[R], *, study: str) -> dict[str, Recorded[R]]:
    """Read a file of records.

    Args:
        path: the file.
        record: class of the records, a dataclass.
        study: name of the study that the file must be of.

    Returns:
        What is recorded, by the name of the task, in the order in which it was written. A last line that was not finished is
        left out.

    Raises:
        FileFormatError: the file is missing, is broken, or holds another study.
    """
    header, *lines = _whole_lines(read_bytes(path, what="a file of records")) or [b""]
    _require_header(path, _parsed(header, path, 1), study)
    found: dict[str, Recorded[R]] = {}
    for number, line in enumerate(lines, start=2):
        values = _parsed(line, path, number)
        if KEY in values:  # two files were put together
            _require_header(path, values, study)
            continue
        try:
            name, definition = str(values["task"]), dict(values["definition"])
            found[name] = Recorded(definition=definition, record=_validated(record, values["record"]))
        except (KeyError, TypeError, ValueError) as error:
            raise FileFormatError(
                f"{path}: line {number} is no record of the study '{study}' ({_reason(error)}); take the line away, or begin a "
                "new file"
            ) from None
    return found


@contextmanager
def appending(path: str | os.PathLike[str], *, study: str) -> Iterator[Append]:
    """Open a file of records to append to it; begin it if it is not there.

    While it is open no other process can open it. A last line that was not finished is cut off first.

    Raises:
        OutputError: it cannot be written, or another process is writing to it.
    """
    target = Path(path)
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        descriptor = os.open(target, os.O_RDWR | os.O_CREAT | os.O_APPEND, 0o644)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise OutputError(f"{target} cannot be written ({reason}), expected a file for records; name another file") from None
    try:
        _lock(descriptor, target)
        content = target.read_bytes()
        whole = content.rfind(b"\n") + 1
        if whole < len(content):
            os.ftruncate(descriptor, whole)
        if not whole:
            _write(descriptor, target, {KEY: VERSION, "study": study, "version": version()})

        def append(task: str, definition: Mapping[str, Any], record: Any) -> None:
            _write(descriptor, target, {"task": task, "definition": definition, "record": dataclasses.asdict(record)})

        yield append
    finally:
        with contextlib.suppress(OSError):
            os.fsync(descriptor)
        os.close(descriptor)


def require_same_definition(
    path: str | os.PathLike[str], task: str, recorded: Mapping[str, Any], now: Mapping[str, Any]
) -> None:
    """Refuse a record of a task that is defined otherwise now.

    Raises:
        FileFormatError: the definitions differ; the message tells where.
    """
    before, after = json.loads(_text(recorded)), json.loads(_text(now))
    changed = [name for name in dict.fromkeys((*before, *after)) if before.get(name) != after.get(name)]
    if changed:
        told = ", ".join(f"{name} {shown(before.get(name))} then, {shown(after.get(name))} now" for name in changed[:_SHOWN])
        raise FileFormatError(
            f"{path} holds a record of task '{task}' with another definition ({told}), expected the same one; name another "
            "file for the changed study, or give the old settings"
        )


def file_digest(path: str | os.PathLike[str], *, what: str = "a file") -> str:
    """Return the beginning of the SHA-256 of a file, for the definitions of tasks that depend on it.

    Args:
        path: the file.
        what: what it should hold, for messages.

    Raises:
        FileFormatError: it is missing, empty or cannot be read.
    """
    return hashlib.sha256(read_bytes(path, what=what)).hexdigest()[:16]


def _require_header(path: str | os.PathLike[str], header: Any, study: str) -> None:
    if header.get(KEY) != VERSION:
        raise FileFormatError(f"{path} has no '{KEY}: {VERSION}', expected a file of records; name another file")
    if header.get("study") != study:
        raise FileFormatError(
            f"{path} holds records of the study {shown(header.get('study'))}, expected '{study}'; name another file"
        )
    if header.get("version") != version():
        raise FileFormatError(
            f"{path} was written by spacearm {shown(header.get('version'))}, expected {version()}: records of two versions are "
            "not put together; name another file"
        )


def _whole_lines(content: bytes) -> list[bytes]:
    return content[: content.rfind(b"\n") + 1].splitlines()


def _parsed(line: bytes, path: str | os.PathLike[str], number: int) -> dict[str, Any]:
    try:
        values = json.loads(line)
    except (ValueError, RecursionError):
        values = None
    if not isinstance(values, dict):
        raise FileFormatError(f"{path}: line {number} is no mapping in JSON, expected a file of records; name another file")
    return values


@cache
def _adapter(record: type) -> Any:
    from pydantic import TypeAdapter

    return TypeAdapter(record)


def _reason(error: Exception) -> str:
    """Say what is wrong with a line: the first that pydantic found, or a key that is missing."""
    from pydantic import ValidationError

    if isinstance(error, ValidationError):
        first = error.errors(include_url=False)[0]
        if first["type"] == "missing":
            return f"{'.'.join(map(str, first['loc']))} is missing"
        return f"{'.'.join(map(str, first['loc']))} is {shown(first['input'])}: {first['msg']}"
    return f"{type(error).__name__} {error}"


def _validated(record: type[R], values: Any) -> R:
    return _adapter(record).validate_python(values)


def _write(descriptor: int, path: Path, values: Mapping[str, Any]) -> None:
    line = (_text(values) + "\n").encode()
    try:
        written = os.write(descriptor, line)
        if written < len(line):  # the disk is full
            os.write(descriptor, line[written:])
    except OSError as error:
        raise OutputError(f"{path} cannot be written ({error.strerror}), expected room for records; make room") from None


def _text(values: Any) -> str:
    return json.dumps(_finite(values), allow_nan=False, separators=(",", ":"))


def _finite(value: Any) -> Any:
    """Return plain values with texts for the numbers that JSON has not."""
    if isinstance(value, float) and not math.isfinite(value):
        return "NaN" if math.isnan(value) else "Infinity" if value > 0 else "-Infinity"
    if isinstance(value, Mapping):
        return {key: _finite(entry) for key, entry in value.items()}
    return [_finite(entry) for entry in value] if isinstance(value, (list, tuple)) else value


def _lock(descriptor: int, path: Path) -> None:
    try:
        import fcntl
    except ImportError:  # where there is no such lock
        return
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        raise OutputError(f"{path} is being written by another process, expected no other; wait for it, or end it") from None
