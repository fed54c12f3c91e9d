"""The command line: thin, one module a command.

Exit codes: 0 done, 1 no plan found, no proof that holds or a model with faults, 2 wrong input, 3 an error of
spacearm itself, 130 interrupted (143 by SIGTERM).
Results go to stdout, everything else to stderr.
"""

from __future__ import annotations

import contextlib
import importlib
import os
import sys

TYPE_CHECKING = False  # as typing has it, which is slow to load: the less is loaded, the sooner Ctrl-C is looked after

if TYPE_CHECKING:
    from collections.abc import Sequence

    from spacearm.cli.stopping import Watch

COMMANDS = {
    "bench": "measure the planner on a collection of problems: spacearm bench mbm -d DIR",
    "certify": "prove a plan.json again, or a trajectory in CSV: free of collision and within the limits, at every instant",
    "doctor": "find the faults of a robot's URDF, and say how to correct them; --fix writes a corrected copy",
    "paper": "run the paper's experiment: Table 3, Figures 4-9, report.json",
    "plan": "plan a motion for a problem.yaml: plan.json, trajectory.csv, report.html",
    "report": "write a report of one plan.json, or of several beside each other, as a page for a browser",
    "robustness": "find how far the joints may be from a motion at any instant so that it is still proven",
    "view": "open a problem.yaml or a plan.json in the browser: change it by hand, plan, and save",
}
"""Each command, and what it does. The module `<command>_command` of this room runs it."""

_OPTIONS = ("-h", "--help", "--version")

_HELP = """usage: spacearm COMMAND [options]

Plans collision-free motions for robot arms on spacecraft, and proves each of them. The search is a hybrid of
RRT-Connect trees, local refinement and a particle swarm.

commands:
{commands}

options:
  -h, --help  show this help, or a command's: spacearm COMMAND --help
  --version   show the version and the kernel's build

exit codes: 0 done, 1 no plan found, no proof that holds or a model with faults, 2 wrong input,
            3 an error of spacearm itself, 130 interrupted
"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command and return its exit code.

    Args:
        arguments: without the program's name; None takes those of this process.
    """
    from spacearm.cli.stopping import watched

    if arguments is None:
        with contextlib.suppress(AttributeError):  # a stream that is none of Python's own
            sys.stdout.reconfigure(errors="replace")  # type: ignore[union-attr]
    with watched(to_the_end=arguments is None) as watch:
        try:
            code = _run_and_report(list(sys.argv[1:] if arguments is None else arguments), watch)
            return _interrupted("the command had finished", watch) if watch.number and code < 128 else code
        except KeyboardInterrupt as interrupt:
            return _interrupted(str(interrupt) or "nothing was written", watch)


def _run_and_report(given: list[str], watch: Watch) -> int:
    """Run a command, tell what went wrong, and return its exit code."""
    from spacearm.core.errors import SpacearmError

    try:
        code = _run(given)
        sys.stdout.flush()  # here, where a full disk or a closed pipe can still be told
    except SystemExit as stopped:  # help was asked for
        return int(stopped.code or 0)
    except SpacearmError as error:
        if watch.number:
            raise KeyboardInterrupt from None
        return _refused(str(error))
    except BrokenPipeError:  # whoever read our output has gone, as `head` does; nothing is wrong
        _drop_output()
        return 0
    except OSError as error:  # files' errors are told by those who write them, so this is the output's
        _drop_output()
        return _refused(f"the output cannot be written ({error.strerror or error}); free space there or send it elsewhere")
    except Exception:
        if watch.number:  # it tripped over the interrupt
            raise KeyboardInterrupt from None
        _print_error()
        return 3
    return code


def _run(given: list[str]) -> int:
    if not given or given[0] in ("-h", "--help"):
        width = max(map(len, COMMANDS))
        listed = "\n".join(f"  {name.ljust(width)}  {text}" for name, text in COMMANDS.items())
        print(_HELP.format(commands=listed), end="", file=sys.stdout if given else sys.stderr)
        return 0 if given else 2
    name = given[0]
    if name == "--version":
        return _version()
    from spacearm.core.checks import shown
    from spacearm.core.errors import SettingsError, nearest

    if name.startswith("-"):
        raise SettingsError(f"there is no option {shown(name)}; {nearest(name, _OPTIONS)}; a command's options follow its name")
    if name not in COMMANDS:
        raise SettingsError(f"there is no command {shown(name)}; {nearest(name, (*COMMANDS, *_OPTIONS))}")
    return importlib.import_module(f"spacearm.cli.{name}_command").run(given[1:])


def _version() -> int:
    from spacearm.core.native import kernel_info
    from spacearm.core.version import version

    kernel = kernel_info()
    print(f"spacearm {version()} (kernel {kernel.level}, {kernel.compiler})")
    return 0


def _interrupted(what: str, watch: Watch) -> int:
    print(f"spacearm: interrupted; {what}", file=sys.stderr)
    return watch.code if watch.number else 130


def _refused(sentence: str) -> int:
    print(f"spacearm: {' '.join(sentence.splitlines())}", file=sys.stderr)  # a path may hold a line break
    return 2


def _print_error() -> None:
    """Show the traceback, since only we can do something about it; Python's exit code for it would say "no plan"."""
    import traceback

    traceback.print_exc()
    print("spacearm: this is an error of spacearm itself; please report it with the lines above", file=sys.stderr)


def _drop_output() -> None:
    """Send what is still to be printed nowhere, or Python would fail once more as it exits."""
    with contextlib.suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
