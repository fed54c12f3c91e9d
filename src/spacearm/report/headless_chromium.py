"""A Chromium without a window, driven through its DevTools pipe: two file descriptors, no library, no port.

The browser ends with this process: it stops when the pipe does, and it is stopped when the context ends, in whatever way.
"""

from __future__ import annotations

import json
import os
import selectors
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO, Any, cast

from spacearm.core.errors import OutputError

ENVIRONMENT_VARIABLE = "SPACEARM_CHROMIUM"
"""Names the browser's program, where it is not found by itself."""

_NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome", "microsoft-edge", "brave-browser")
_PLACES = (
    "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome",
    "/Applications/Chromium.app/Contents/MacOS/Chromium",
    "/snap/bin/chromium",
)
_OPTIONS = (
    "--headless=new",
    "--remote-debugging-pipe",
    "--disable-gpu",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-default-apps",
    "--disable-dev-shm-usage",
    "--disable-extensions",
    "--disable-quic",
    "--disable-sync",
    "--force-color-profile=srgb",
    "--hide-scrollbars",
    "--metrics-recording-only",
    "--mute-audio",
    "--no-default-browser-check",
    "--no-first-run",
    "--password-store=basic",
    "--use-mock-keychain",
)
# A pipe's ends come in as the standard ones; Chromium wants them as the third and the fourth.
_MOVED = 'exec "$@" 3<&0 4>&1 </dev/null >/dev/null'
_ANSWER = 60.0  # seconds that an answer may take
_START = 60.0  # the first one, on a busy machine
_LONGEST_FOLDER = 48
_GOING = 3.0  # that the browser may take to end


def find_chromium() -> str:
    """Return the path of Chromium, Chrome or Edge.

    Raises:
        OutputError: there is none.
    """
    named = os.environ.get(ENVIRONMENT_VARIABLE)
    if named:
        path = shutil.which(named)
        if path is None:
            raise OutputError(f"{ENVIRONMENT_VARIABLE} is '{named}', which is no program; name Chromium's, or unset it")
        return path
    if os.name != "posix":
        raise OutputError(f"videos are made on Linux and macOS, and this is {sys.platform}; record the report's page instead")
    found = next(filter(None, map(shutil.which, (*_NAMES, *_PLACES))), None)
    if found is None:
        raise OutputError(
            "a video needs Chromium or Chrome, which is not there; install it, as in: apt install chromium, or name it in "
            f"{ENVIRONMENT_VARIABLE}"
        )
    return found


@contextmanager
def chromium_page(program: str, width: int, height: int) -> Iterator[ChromiumPage]:
    """Start a browser and open an empty page while the context lasts.

    Args:
        program: as `find_chromium` returns it.
        width, height: of the page [pixels].

    Raises:
        OutputError: the browser does not start.
    """
    # Chromium has no sandbox for the user root, and refuses to start with one.
    sandbox = ("--no-sandbox",) if hasattr(os, "geteuid") and os.geteuid() == 0 else ()
    root = _short_folder()
    with (
        tempfile.TemporaryDirectory(prefix="spacearm-chromium-", dir=root, ignore_cleanup_errors=True) as folder,
        tempfile.TemporaryFile() as told,
    ):
        options = (*_OPTIONS, *sandbox, f"--user-data-dir={folder}", f"--window-size={width},{height}", "about:blank")
        process = subprocess.Popen(
            ["/bin/sh", "-c", _MOVED, "sh", program, *options],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=told,
            env={**os.environ, "TMPDIR": root},
            start_new_session=True,  # Ctrl-C is ours to handle
        )
        page = ChromiumPage(process, program, told)
        try:
            page.begin(width, height)
            yield page
        finally:
            page.end()


def _short_folder() -> str:
    """Return a folder for temporary files with a short path: Chromium makes sockets there, with names of 108 bytes at most."""
    folder = tempfile.gettempdir()
    return "/tmp" if len(folder) > _LONGEST_FOLDER and os.access("/tmp", os.W_OK | os.X_OK) else folder


class ChromiumPage:
    """A page of a browser that was started."""

    def __init__(self, process: subprocess.Popen[bytes], program: str, told: IO[bytes]) -> None:
        self._process, self._program, self._stderr = process, program, told
        self._in, self._out = cast("IO[bytes]", process.stdin), cast("IO[bytes]", process.stdout)
        self._selector = selectors.DefaultSelector()
        self._selector.register(self._out, selectors.EVENT_READ)
        self._session: str | None = None
        self._number = 0
        self._left = b""
        self._told: list[str] = []

    def begin(self, width: int, height: int) -> None:
        """Open a page of a size [pixels]."""
        target = self.call("Target.createTarget", timeout=_START, url="about:blank")["targetId"]
        self._session = self.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        self.call("Page.enable")
        self.call("Runtime.enable")
        size = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
        self.call("Emulation.setDeviceMetricsOverride", **size)

    def call(self, method: str, *, timeout: float = _ANSWER, **parameters: Any) -> dict[str, Any]:
        """Call a method of the DevTools protocol and return its result.

        Raises:
            OutputError: it fails, the browser ends, or no answer comes in time.
        """
        self._number += 1
        message: dict[str, Any] = {"id": self._number, "method": method, "params": parameters}
        if self._session is not None:
            message["sessionId"] = self._session
        try:
            self._in.write(json.dumps(message).encode() + b"\0")
            self._in.flush()
        except OSError:
            raise self._gone() from None
        end = time.monotonic() + timeout
        while True:
            answer = self._next(end, method)
            if answer.get("id") == self._number:
                break
            self._listen(answer)
        if "error" in answer:
            raise OutputError(f"{self._program} cannot do {method}: {answer['error'].get('message', '')}; try another version")
        return answer.get("result", {})

    def open(self, path: Path) -> None:
        """Open a file."""
        failed = self.call("Page.navigate", url=path.absolute().as_uri()).get("errorText")
        if failed:
            raise OutputError(f"{self._program} cannot open {path}: {failed}")

    def value(self, expression: str, *, timeout: float = _ANSWER) -> Any:
        """Return what a JavaScript expression comes to, a promise's value included.

        Raises:
            OutputError: it throws, or takes too long.
        """
        given = {"expression": expression, "awaitPromise": True, "returnByValue": True}
        result = self.call("Runtime.evaluate", timeout=timeout, **given)
        if "exceptionDetails" in result:
            details = result["exceptionDetails"]
            said = details.get("exception", {}).get("description") or details.get("text", "")
            raise OutputError(f"the page cannot be recorded: {' '.join([said.splitlines()[0], *self._told[:1]])}")
        return result["result"].get("value")

    def wait_for(self, expression: str, *, timeout: float = _ANSWER) -> None:
        """Wait until a JavaScript expression is true.

        Raises:
            OutputError: it does not become so in time.
        """
        end = time.monotonic() + timeout
        while not self.value(expression):
            if time.monotonic() > end:
                said = f": {self._told[0]}" if self._told else ""
                raise OutputError(f"the page was not ready within {timeout:g} s{said}; try again on a machine with less to do")
            time.sleep(0.05)

    def _next(self, end: float, method: str) -> dict[str, Any]:
        while b"\0" not in self._left:
            if not self._selector.select(max(0.0, end - time.monotonic())):
                raise OutputError(f"{self._program} gave no answer to {method} in time; try again on a machine with less to do")
            content = os.read(self._out.fileno(), 1 << 20)
            if not content:
                raise self._gone()
            self._left += content
        message, _, self._left = self._left.partition(b"\0")
        return json.loads(message)

    def _listen(self, event: dict[str, Any]) -> None:
        """Keep what the page throws."""
        if event.get("method") == "Runtime.exceptionThrown":
            details = event["params"]["exceptionDetails"]
            self._told.append(details.get("exception", {}).get("description", details.get("text", "")).splitlines()[0])

    def _gone(self) -> OutputError:
        self._stderr.seek(0)
        lines = [line for line in self._stderr.read().decode(errors="replace").splitlines() if line.strip()]
        said = f" ({' '.join(lines[0].split())})" if lines else ""
        return OutputError(
            f"{self._program} ended by itself{said}; try it by hand: {self._program} --headless=new --dump-dom about:blank"
        )

    def end(self) -> None:
        """Stop the browser, and all that it has started."""
        self._selector.close()
        with suppress(OSError):
            self._in.close()  # which the browser takes for its end
        try:
            self._process.wait(_GOING)
        except subprocess.TimeoutExpired:
            pass
        finally:
            with suppress(OSError):
                os.killpg(self._process.pid, signal.SIGKILL)
            with suppress(subprocess.TimeoutExpired):
                self._process.wait(_GOING)
            self._out.close()
