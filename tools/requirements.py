"""Print what pyproject.toml asks for, one requirement a line, so that each is written down once.

python tools/requirements.py build       # to build without isolation
python tools/requirements.py run test    # what spacearm needs, and its extra `test`
"""

from __future__ import annotations

import sys
from pathlib import Path

if sys.version_info >= (3, 11):
    import tomllib
else:
    from pip._vendor import tomli as tomllib

# The build backend fetches these only for an isolated build.
BUILD_PROGRAMS = ["cmake>=3.20", "ninja>=1.5"]


def requirements(project: dict, part: str) -> list[str]:
    """Return the requirements of one part: `build`, `run`, or the name of an extra."""
    if part == "build":
        return [*project["build-system"]["requires"], *BUILD_PROGRAMS]
    if part == "run":
        return project["project"]["dependencies"]
    return project["project"]["optional-dependencies"][part]


def main() -> None:
    """Print the parts named on the command line."""
    pyproject = Path(__file__).resolve().parent.parent / "pyproject.toml"
    project = tomllib.loads(pyproject.read_text(encoding="utf-8"))
    for part in sys.argv[1:]:
        print("\n".join(requirements(project, part)))


if __name__ == "__main__":
    main()
