"""spacearm: collision-free motions for robot arms on spacecraft, found by trees, refinement and a swarm, and proven.

The public names are listed in `__init__.pyi`, which type checkers read. Each is loaded when it is first used.
"""

from __future__ import annotations

import ast
import importlib
from pathlib import Path
from typing import Any

from spacearm.core.moved import find_moved_modules as _find_moved_modules

_find_moved_modules()

_STUB = ast.parse(Path(__file__).with_suffix(".pyi").read_text(encoding="utf-8"))
_MODULES = {name.name: str(node.module) for node in _STUB.body if isinstance(node, ast.ImportFrom) for name in node.names}

__all__ = sorted(_MODULES)  # pyright: ignore[reportUnsupportedDunderAll]


def __getattr__(name: str) -> Any:
    if name == "__version__":
        return importlib.import_module("spacearm.core.version").version()
    if name not in _MODULES:
        raise AttributeError(f"module 'spacearm' has no attribute {name!r}")
    value = getattr(importlib.import_module(_MODULES[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return [*__all__, "__version__"]
