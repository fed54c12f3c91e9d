"""The command line: thin, one module a command.

Exit codes: 0 done, 1 no plan found, 2 wrong input, 130 interrupted. Results go to stdout, everything else to stderr.
"""

from __future__ import annotations

import importlib
import sys
from collections.abc import Sequence

COMMANDS = {
    "paper": "run the paper's experiment: Table 3, Figures 4-9, report.json",
    "plan": "plan a motion for a problem.yaml: plan.json, trajectory.csv, figures",
}
"""Each command, a module of this room, and what it does."""

_HELP = """usage: spacearm COMMAND [options]

Plans collision-free, executable motions for robot arms on spacecraft, with a particle swarm, and proves each of them.

commands:
{commands}

options:
  -h, --help  show this help, or a command's: spacearm COMMAND --help
  --version   show the version and the kernel's build
"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command and return its exit code.

    Args:
        arguments: without the program's name; None takes those of this process.
    """
    given = list(sys.argv[1:] if arguments is None else arguments)
    if not given or given[0] in ("-h", "--help"):
        width = max(map(len, COMMANDS))
        listed = "\n".join(f"  {name.ljust(width)}  {text}" for name, text in COMMANDS.items())
        print(_HELP.format(commands=listed), end="")
        return 0 if given else 2
    if given[0] == "--version":
        return _version()
    from spacearm.errors import SpacearmError, nearest

    try:
        if given[0] not in COMMANDS:
            raise SpacearmError(f"there is no command '{given[0]}'; {nearest(given[0], COMMANDS)}")
        return importlib.import_module(f"spacearm.cli.{given[0]}").run(given[1:])
    except SpacearmError as error:
        print(f"spacearm: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("spacearm: interrupted; nothing was written", file=sys.stderr)
        return 130
    except BrokenPipeError:
        # Whoever read our output has gone, as `head` does; nothing is wrong, and nothing can be told.
        sys.stderr.close()
        return 0


def _version() -> int:
    from spacearm._kernel import kernel_info
    from spacearm.version import version

    kernel = kernel_info()
    print(f"spacearm {version()} (kernel {kernel.level}, {kernel.compiler})")
    return 0
