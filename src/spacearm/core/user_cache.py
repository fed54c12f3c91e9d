"""Results of long computations, kept between runs in a folder of the user: each under the hash of all that it depends on.

The folder is `$SPACEARM_CACHE`, else the platform's: `$XDG_CACHE_HOME/spacearm` or `~/.cache/spacearm` (Linux),
`~/Library/Caches/spacearm` (macOS), `%LOCALAPPDATA%\\spacearm\\Cache` (Windows). `SPACEARM_CACHE=off` turns it off.

A cache is never the cause of an error. An entry that is missing, cut off, changed or of another version is computed again. What
cannot be written is not kept. Files are written whole or not at all, so that several processes may share the folder. Beyond
500 MB the entries that were not used for longest are removed.
"""

from __future__ import annotations

import hashlib
import io
import json
import os
import re
import struct
import sys
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spacearm.core.errors import OutputError
from spacearm.core.output import write_atomically

ENVIRONMENT_VARIABLE = "SPACEARM_CACHE"
"""Names the folder, or is `off`."""

_FORMAT = 1  # of the files and of the keys; older entries are not found any more
_MARK = b"spacearm-cache"
_NAME = re.compile(r"[a-z][a-z0-9-]*-[0-9a-f]{40}\.cache")  # of an entry: nothing else in the folder is ever removed
_LEFT_OVER = re.compile(r"\.[a-z][a-z0-9-]*-[0-9a-f]{40}\.cache\.[0-9a-f]{16}")  # of a process that was killed in writing
_LARGEST = 500_000_000  # bytes in all
_KEPT = 0.8  # of them: so much stays when entries are removed, so that this is not done at each writing
_STALE = 3600.0  # seconds, after which a file that was left over is removed

Arrays = Mapping[str, NDArray[Any]]
"""Arrays by name: numbers, booleans or text, no objects."""


def cached_arrays(kind: str, version: int, key: Any, make: Callable[[], Arrays]) -> dict[str, NDArray[Any]]:
    """Return arrays from the cache, or make and keep them.

    Args:
        kind: what is computed: small letters, digits and hyphens.
        version: of the algorithm. Raise it when other arrays come from the same input.
        key: all that the arrays depend on: None, booleans, numbers, text, bytes, NumPy arrays, and lists, tuples and mappings
            of these.
        make: computes them.

    Returns:
        The arrays by name, the same bit for bit as those that were made; to be read only.
    """

    def packed(arrays: Arrays) -> bytes:
        buffer = io.BytesIO()
        named: dict[str, Any] = {name: np.asarray(value) for name, value in arrays.items()}
        np.savez(buffer, **named)
        return buffer.getvalue()

    def unpacked(content: bytes) -> dict[str, NDArray[Any]]:
        with np.load(io.BytesIO(content), allow_pickle=False) as arrays:
            return {name: arrays[name] for name in arrays.files}

    return _cached(kind, version, key, lambda: dict(make()), packed, unpacked)


def cached_json(kind: str, version: int, key: Any, make: Callable[[], Any]) -> Any:
    """Return plain values from the cache, or make and keep them; arguments as for `cached_arrays`.

    What is made is what JSON holds: None, booleans, numbers, text, lists, and mappings with text as keys.
    """

    def packed(value: Any) -> bytes:
        return json.dumps(value, separators=(",", ":")).encode()

    return _cached(kind, version, key, make, packed, json.loads)


def content_hash(value: Any) -> str:
    """Return the SHA-256 of plain values and arrays, in hexadecimal; values that differ in type or order differ."""
    digest = hashlib.sha256()
    _feed(digest.update, value)
    return digest.hexdigest()


def cache_folder() -> Path | None:
    """Return the folder of the cache, which may not be there yet; None if it is turned off or there is no place for it."""
    given = os.environ.get(ENVIRONMENT_VARIABLE, "").strip()
    if given.lower() == "off":
        return None
    try:
        return Path(given).expanduser() if given else _platform_folder()
    except (RuntimeError, ValueError):  # nobody's home
        return None


def _platform_folder() -> Path:
    if sys.platform == "win32":
        local = os.environ.get("LOCALAPPDATA")
        return (Path(local) if local else Path.home() / "AppData" / "Local") / "spacearm" / "Cache"
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Caches" / "spacearm"
    given = os.environ.get("XDG_CACHE_HOME", "")
    return (Path(given) if os.path.isabs(given) else Path.home() / ".cache") / "spacearm"


def _cached(
    kind: str,
    version: int,
    key: Any,
    make: Callable[[], Any],
    packed: Callable[[Any], bytes],
    unpacked: Callable[[bytes], Any],
) -> Any:
    folder = cache_folder()
    if folder is None:
        return make()
    name = f"{kind}-{content_hash([_FORMAT, kind, version, key])[:40]}.cache"
    assert _NAME.fullmatch(name), f"kind is {kind!r}, expected small letters, digits and hyphens"
    content = _read(folder / name)
    if content is not None:
        with suppress(Exception):  # the hash is right, so this is a file that somebody made
            return unpacked(content)
    value = make()
    _write(folder / name, packed(value))
    return value


def _read(path: Path) -> bytes | None:
    """Return an entry's content, and mark it as used; None if there is none or it is damaged."""
    try:
        head, _, content = path.read_bytes().partition(b"\n")
        if head != _head(content):
            return None
        with suppress(OSError):
            os.utime(path)
    except (OSError, ValueError):  # ValueError: a folder whose name holds a null character
        return None
    return content


def _write(path: Path, content: bytes) -> None:
    with suppress(OSError, OutputError, ValueError):
        path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        write_atomically(path, _head(content) + b"\n" + content)
        _tidy(path.parent)


def _head(content: bytes) -> bytes:
    return b"%s %d %s" % (_MARK, _FORMAT, hashlib.sha256(content).hexdigest().encode())


def _tidy(folder: Path) -> None:
    """Remove the entries that were not used for longest, if all together are too large, and what killed processes left."""
    entries: list[tuple[float, int, str]] = []
    with os.scandir(folder) as found:
        for entry in found:
            with suppress(OSError):  # another process may have removed it
                known = entry.stat(follow_symlinks=False)
                if _NAME.fullmatch(entry.name):
                    entries.append((known.st_mtime, known.st_size, entry.path))
                elif _LEFT_OVER.fullmatch(entry.name):
                    _remove_if_stale(entry.path, known.st_mtime)
    total = sum(size for _, size, _ in entries)
    if total <= _LARGEST:
        return
    for _, size, path in sorted(entries):
        with suppress(OSError):
            os.unlink(path)
        total -= size
        if total <= _KEPT * _LARGEST:
            break


def _remove_if_stale(path: str, written: float) -> None:
    if time.time() - written > _STALE:
        os.unlink(path)


def _feed(update: Callable[[bytes], None], value: Any) -> None:
    """Give a hash a value: its type, its length and its bytes, so that no two values give the same."""
    if isinstance(value, np.ndarray):
        assert not value.dtype.hasobject, "an array of objects has no bytes of its own"
        update(f"array {value.dtype.str} {value.shape}\n".encode())
        update(np.ascontiguousarray(value).tobytes())
    elif isinstance(value, (bool, np.bool_)) or value is None:
        update(f"{value}\n".encode())
    elif isinstance(value, (int, np.integer)):
        update(f"int {int(value)}\n".encode())
    elif isinstance(value, (float, np.floating)):
        update(b"float " + struct.pack("<d", float(value)))
    elif isinstance(value, (str, bytes)):
        content = value if isinstance(value, bytes) else value.encode("utf-8", errors="surrogatepass")
        update(f"{type(value).__name__} {len(content)}\n".encode())
        update(content)
    elif isinstance(value, Mapping):
        update(f"mapping {len(value)}\n".encode())
        for entry in sorted(value):
            _feed(update, entry)
            _feed(update, value[entry])
    elif isinstance(value, (list, tuple)):
        update(f"row {len(value)}\n".encode())
        for entry in value:
            _feed(update, entry)
    else:
        raise AssertionError(f"{value!r} cannot be a part of a key: give plain values or arrays")
