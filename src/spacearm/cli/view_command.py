"""`spacearm view`: a problem or a plan in the browser."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tyro.conf import Positional, arg

from spacearm.cli.arguments import parsed
from spacearm.cli.terminal import loading, tell_notes, tell_robot
from spacearm.core.records import whole

if TYPE_CHECKING:
    from spacearm.view.open_viewer import Viewer


@dataclass(frozen=True, kw_only=True)
class Options:
    """Open a problem or a plan in the browser: look at it, change it by hand, plan, and save.

    It goes on until Ctrl-C. It needs viser: pip install 'spacearm[view]'.

    Attributes:
        file: a problem file (YAML), or a plan.json, whose motion is shown at once.
        folder: where files are saved, and nowhere else; they are always new ones.
        host: the address to listen on: by default only programs on this machine can connect.
        port: to listen on; 0: any that is free.
        seed: the random seed of plans at first.
        no_open: do not open a browser.
    """

    file: Annotated[Positional[Path], arg(metavar="PROBLEM.YAML|PLAN.JSON")]
    folder: Annotated[Path, arg(metavar="FOLDER")] = Path(".")
    host: Annotated[str, arg(metavar="ADDRESS")] = "127.0.0.1"
    port: int = 8484
    seed: int = 0
    no_open: bool = False

    def __post_init__(self) -> None:
        whole("--port", self.port, at_least=0, at_most=65535)
        whole("--seed", self.seed, at_least=0, at_most=2**63 - 1)


def run(arguments: Sequence[str]) -> int:
    """Run the command and return its exit code.

    Raises:
        KeyboardInterrupt: Ctrl-C, which is how it ends.
    """
    options = parsed(Options, arguments, command="view")
    from spacearm.view.viser_server import require_viser

    require_viser()
    from spacearm.view.open_viewer import Viewer, opened, wait_until_interrupted

    with loading():
        viewer = Viewer(options.file, options.folder, host=options.host, port=options.port, seed=options.seed)
    try:
        _tell(viewer, options)
        if not options.no_open:
            opened(viewer)
        wait_until_interrupted()
    except KeyboardInterrupt as interrupt:
        raise type(interrupt)("the viewer is closed" + _saved(viewer)) from None
    finally:
        viewer.close()
    return 0


def _tell(viewer: Viewer, options: Options) -> None:
    problem = viewer.session.edited.problem
    tell_robot(problem.robot, more="the tab View")
    tell_notes(options.file, (*problem.notes, *problem.scene.notes))
    if not viewer.is_private:
        print(
            f"spacearm: it listens on {viewer.host}: whoever can reach this machine there can change the problem, plan, and "
            f"save new files in {viewer.session.folder.path}, without a password and without encryption",
            file=sys.stderr,
        )
    # Last: whoever waits for this line may go on, and end the viewer, as soon as it is there.
    print(f"{viewer.url} shows {options.file}; files are saved in {viewer.session.folder.path}; Ctrl-C ends it", flush=True)


def _saved(viewer: Viewer) -> str:
    saved = viewer.session.saved
    return f"; it saved {', '.join(saved)}" if saved else "; nothing was saved"
