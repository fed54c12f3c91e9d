"""What the house's tests read: the floors, the source files, and their imports."""

from __future__ import annotations

import ast
import subprocess
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).resolve().parents[2]
PACKAGE = REPOSITORY / "src" / "spacearm"

FLOORS: tuple[tuple[str, ...], ...] = (
    ("cli",),
    ("view",),
    ("study",),
    ("files",),
    ("report",),
    ("show",),
    ("planner",),
    ("proof",),
    ("motion",),
    ("swarm", "dynamics"),
    ("doctor",),
    ("robot",),
    ("geometry",),
    ("errors",),
    ("core",),
    ("_kernel",),
)
"""Rooms of `src/spacearm`, from the roof down."""

ALLOWED_UPWARD: frozenset[tuple[str, str]] = frozenset([("_kernel", "core")])  # its former names, when they are asked for
"""Exceptions, as (importing room, imported room), each with its reason beside it."""

HEAVY = frozenset(
    {"coal", "dask", "lxml", "matplotlib", "pinocchio", "pydantic", "rich", "scipy", "toppra", "trimesh", "tyro"}
    | {"viser", "yaml"}
)
"""Slow to import: only inside the leaf that needs them, so that `import spacearm` stays quick."""

COMPARISON_ONLY = frozenset(["cma", "mealpy", "ompl", "pygmo", "pymoo", "pyswarms"])
"""Beside us in benchmarks, oracles in tests, never part of the product."""


def python_files() -> list[Path]:
    """Return every Python file of the package."""
    return sorted(PACKAGE.rglob("*.py"))


@cache
def parsed(path: Path) -> ast.Module:
    """Return a file's syntax tree."""
    return ast.parse(path.read_text(encoding="utf-8"), filename=str(path))


def where(path: Path) -> str:
    """Return a file's path for a message."""
    return str(path.relative_to(REPOSITORY))


def imports(path: Path) -> Iterator[tuple[int, str]]:
    """Yield (line, dotted name) for every import in a file, also inside functions and TYPE_CHECKING blocks.

    `from a import b` gives `a.b`, since b may be a module; relative imports are made absolute.
    """
    package = ["spacearm", *path.relative_to(PACKAGE).parts[:-1]]
    for node in ast.walk(parsed(path)):
        if isinstance(node, ast.Import):
            yield from ((node.lineno, alias.name) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1] if node.level else []
            start = ".".join([*base, *([node.module] if node.module else [])])
            yield from ((node.lineno, f"{start}.{alias.name}") for alias in node.names)
        elif isinstance(node, ast.Call) and node.args:
            function = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
            first = node.args[0]
            if function in ("import_module", "__import__") and isinstance(first, ast.Constant):
                yield node.lineno, str(first.value)


@cache
def imports_of(path: Path) -> tuple[tuple[int, str], ...]:
    """Return what `imports` yields, read once."""
    return tuple(imports(path))


def room(path: Path) -> str:
    """Return the room, or the single module, that a file of the package belongs to; '' for the roof."""
    first = path.relative_to(PACKAGE).parts[0]
    return "" if first == "__init__.py" else first.removesuffix(".py")


def repository_files() -> list[Path]:
    """Return the files that git tracks or would add."""
    command = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    try:
        listed = subprocess.run(command, cwd=REPOSITORY, capture_output=True, check=True).stdout
    except (OSError, subprocess.CalledProcessError):
        pytest.skip("not a git working tree: nothing tells which files are the repository's")
    paths = (REPOSITORY / name.decode() for name in listed.split(b"\0") if name)
    return [path for path in paths if path.is_file()]
