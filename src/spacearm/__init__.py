"""spacearm: collision-free motions for robot arms on spacecraft, found by trees, refinement and a swarm, and proven.

The public names are listed in `__init__.pyi`, which type checkers read. Each is loaded when it is first used.
"""

from __future__ import annotations

from spacearm.core.moved import find_moved_modules as _find_moved_modules
from spacearm.core.notebook_hook import show_by as _show_by

_find_moved_modules()  # little else is loaded here: the sooner the command line looks after Ctrl-C


def _html_of(value: object) -> str:
    import importlib

    return importlib.import_module("spacearm.report.notebook_html").html_of(value)


_show_by(_html_of)  # here, for `report` is above the rooms whose values notebooks show


def __getattr__(name: str) -> object:
    import importlib

    if name == "__version__":
        return importlib.import_module("spacearm.core.version").version()
    if name not in ("_MODULES", "__all__") and name.startswith("__"):
        raise AttributeError(f"module 'spacearm' has no attribute {name!r}")
    if "_MODULES" not in globals():
        globals().update(_MODULES=_modules(), __all__=sorted(_modules()))
    if name in globals():
        return globals()[name]
    if name not in globals()["_MODULES"]:
        raise AttributeError(f"module 'spacearm' has no attribute {name!r}")
    value = getattr(importlib.import_module(globals()["_MODULES"][name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return [*sorted(_modules()), "__version__"]


def _modules() -> dict[str, str]:
    """Return the module that defines each public name."""
    import ast
    from pathlib import Path

    stub = ast.parse(Path(__file__).with_suffix(".pyi").read_text(encoding="utf-8"))
    return {name.name: str(node.module) for node in stub.body if isinstance(node, ast.ImportFrom) for name in node.names}
