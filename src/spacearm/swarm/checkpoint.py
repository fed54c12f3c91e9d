"""Checkpoints of a swarm: one .npz file of plain arrays and a JSON header, nothing pickled."""

from __future__ import annotations

import io
import json
import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias, cast

import numpy as np
from numpy.typing import NDArray

from spacearm.core.checks import shown
from spacearm.core.errors import FileFormatError, OutputError, SpacearmError
from spacearm.core.output import require_path, write_atomically
from spacearm.core.reading import read_bytes, require_version
from spacearm.core.records import as_dict
from spacearm.swarm.swarm_settings import IPSO, PSO, FeasibleFirst, Penalty, SwarmSettings

Array = NDArray[np.float64]
State: TypeAlias = dict[str, NDArray[np.float64 | np.float32 | np.int64]]
"""The kernel's arrays of a swarm, by name."""

_FORMAT = "spacearm swarm checkpoint"
_VERSION = 1
_Record: TypeAlias = PSO | IPSO | FeasibleFirst | Penalty
_KINDS: dict[str, Callable[..., _Record]] = {kind.__name__: kind for kind in (PSO, IPSO, FeasibleFirst, Penalty)}
_WHAT = "a swarm's checkpoint"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Checkpoint:
    """What a swarm needs to go on."""

    settings: SwarmSettings
    seed: int
    lower: Array
    upper: Array
    state: State
    rows: Array
    positions: Array | None
    initial: Array | None
    infinite: tuple[int, int] = (0, 0)
    """Evaluations that gave minus infinity, and infinity."""


def write_checkpoint(
    path: str | os.PathLike[str],
    *,
    settings: SwarmSettings,
    seed: int,
    lower: Array,
    upper: Array,
    state: State,
    rows: Array,
    positions: Array | None,
    initial: Array | None,
    infinite: tuple[int, int],
) -> None:
    """Write a checkpoint in place of an older one of ours; see `Swarm.save`."""
    require_path(path)
    if Path(path).exists():
        try:
            read_checkpoint(path)
        except SpacearmError:
            raise OutputError(f"{path} exists and is not {_WHAT}, expected a new file; choose another name") from None
    header: dict[str, object] = {"format": _FORMAT, "version": _VERSION, "seed": seed, "infinite": list(infinite)}
    header["settings"] = {"kind": type(settings).__name__, **as_dict(settings)}
    arrays: dict[str, Any] = {"lower": lower, "upper": upper, "rows": rows}
    arrays |= {f"state_{name}": value for name, value in state.items()}
    if positions is not None:
        arrays["positions"] = positions
    if initial is not None:
        arrays["initial"] = initial
    buffer = io.BytesIO()
    np.savez(buffer, header=np.frombuffer(json.dumps(header).encode(), dtype=np.uint8), **arrays)
    write_atomically(path, buffer.getvalue())


def read_checkpoint(path: str | os.PathLike[str]) -> Checkpoint:
    """Read a checkpoint; see `Swarm.load`."""
    content = read_bytes(path, what=_WHAT)
    try:
        with np.load(io.BytesIO(content), allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files}
        header = json.loads(arrays.pop("header").tobytes())
        if header["format"] != _FORMAT:
            raise FileFormatError(f"{path} is of format {shown(header['format'])}, expected {_WHAT}; check the path")
        require_version(header["version"], _VERSION, path, key="version")
        settings = _record(header["settings"])
        if not isinstance(settings, (PSO, IPSO)):
            raise broken_checkpoint(path)
        minus, plus = header.get("infinite", (0, 0))  # files of version 0.1 do not tell
        return Checkpoint(
            settings=settings,
            seed=int(header["seed"]),
            lower=arrays.pop("lower"),
            upper=arrays.pop("upper"),
            rows=arrays.pop("rows"),
            positions=arrays.pop("positions", None),
            initial=arrays.pop("initial", None),
            state={name.removeprefix("state_"): value for name, value in arrays.items()},
            infinite=(int(minus), int(plus)),
        )
    except FileFormatError:
        raise
    except Exception:  # zipfile, NumPy's and our own readers have many for what is broken
        raise broken_checkpoint(path) from None


def broken_checkpoint(path: str | os.PathLike[str]) -> FileFormatError:
    """Return the error for a file that cannot be used."""
    return FileFormatError(f"{path} cannot be read, expected {_WHAT}; it is broken or something else")


def _record(saved: dict[str, object]) -> _Record:
    given = {name: _value(value) for name, value in saved.items()}
    return _KINDS[str(given.pop("kind"))](**given)


def _value(saved: object) -> object:
    if isinstance(saved, dict):
        return _record(cast("dict[str, object]", saved))
    return tuple(cast("list[object]", saved)) if isinstance(saved, list) else saved  # JSON has no tuples
