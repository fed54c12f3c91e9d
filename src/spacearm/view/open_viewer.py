"""Opens a viewer for a file, says where it listens, and goes on until it is interrupted."""

from __future__ import annotations

import os
import sys
import threading
import webbrowser
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from spacearm.view.edited_problem import read_source
from spacearm.view.output_folder import OutputFolder
from spacearm.view.session import Session
from spacearm.view.viser_app import ViewerApp
from spacearm.view.viser_server import is_loopback, quiet, require_free, require_viser, started_server

_WAIT = 0.2  # [s] between looks whether it was interrupted


class Viewer:
    """A viewer that listens.

    Args:
        path: a problem file or a plan file.
        folder: that files are saved in.
        host, port: to listen on; port 0: any that is free.
        seed: random seed of plans.

    Raises:
        SettingsError: viser is missing, or host and port cannot be listened on.
        SpacearmError: a file that cannot be read.
    """

    def __init__(self, path: Path, folder: Path, *, host: str, port: int, seed: int = 0) -> None:
        require_viser()
        require_free(host, port)
        out = OutputFolder(folder)
        self.session = Session(read_source(path), out, seed=seed)
        self._server = started_server(host, port, label=f"spacearm: {path.name}")
        self.app = ViewerApp(self.session, self._server)
        self.host, self.port = host, int(self._server.get_port())

    @property
    def url(self) -> str:
        """The address of its page."""
        anywhere = self.host in ("0.0.0.0", "::", "")
        name = "127.0.0.1" if anywhere else f"[{self.host}]" if ":" in self.host else self.host
        return f"http://{name}:{self.port}"

    @property
    def is_private(self) -> bool:
        """Whether only programs of this machine can connect."""
        return is_loopback(self.host)

    def close(self) -> None:
        """End it; browsers lose their connection."""
        self.app.close()
        with quiet(), suppress(Exception):
            self._server.stop()


def opened(viewer: Viewer) -> bool:
    """Open the page in a browser, where there is a display, and return whether that was done."""
    if sys.platform.startswith("linux") and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        return False  # else a browser of text would take the terminal
    with suppress(Exception):
        return webbrowser.open(viewer.url)
    return False


def wait_until_interrupted(until: Callable[[], bool] = lambda: False) -> None:
    """Wait, so that Ctrl-C is heard.

    Args:
        until: ends the waiting by returning True.

    Raises:
        KeyboardInterrupt: Ctrl-C.
    """
    nothing = threading.Event()
    while not until():
        nothing.wait(_WAIT)
