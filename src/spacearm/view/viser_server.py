"""viser's server, started where it was asked for and nowhere else, and closed to other web pages.

viser itself takes the next port where one is in use, listens on all interfaces by default, lets any web page that a browser has
open connect to it, and can publish itself on the internet at the request of a browser. None of that here.
"""

from __future__ import annotations

import contextlib
import errno
import ipaddress
import socket
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any
from urllib.parse import urlsplit

from spacearm.core.checks import shown
from spacearm.core.errors import SettingsError
from spacearm.core.extras import require_extra

if TYPE_CHECKING:
    from viser import ViserServer

LOOPBACK = "127.0.0.1"
MOST_PORT = 65535


def require_viser() -> None:
    """Refuse to go on without viser.

    Raises:
        SettingsError: it is not installed.
    """
    require_extra("viser", "the viewer")


def is_loopback(host: str) -> bool:
    """Whether only programs of this machine can connect to a host's address."""
    if host.lower() == "localhost":
        return True
    try:
        return ipaddress.ip_address(host.strip("[]")).is_loopback
    except ValueError:
        return False


def started_server(host: str, port: int, *, label: str) -> ViserServer:
    """Start a server.

    Args:
        host: address or name of this machine.
        port: 0: any that is free.
        label: above the controls.

    Raises:
        SettingsError: viser is missing or does not let itself be guarded, or host and port cannot be listened on.
    """
    require_viser()
    require_free(host, port)
    with contextlib.ExitStack() as while_it_starts:
        guarded = while_it_starts.enter_context(_guarding(host))
        while_it_starts.enter_context(quiet())
        from viser import ViserServer

        server = ViserServer(host=host, port=port, label=label, verbose=False)
    if not guarded():
        server.stop()
        raise SettingsError(
            "this version of viser starts otherwise than those that are known, expected viser 1; it could not be closed to "
            "other web pages, so it was not started: install viser 1.1"
        )
    if port and server.get_port() != port:  # somebody was quicker
        server.stop()
        raise SettingsError(_in_use(host, port))
    server.request_share_url = _not_shared  # type: ignore[method-assign]  # any browser could ask for it
    return server


def _not_shared(verbose: bool = True) -> None:
    """Publish nothing."""


def require_free(host: str, port: int) -> None:
    """Refuse a host and port that cannot be listened on.

    Raises:
        SettingsError: they cannot.
    """
    try:
        family, kind, protocol, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)[0]
        with socket.socket(family, kind, protocol) as tried:
            tried.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            tried.bind(address)
            tried.listen(1)
    except (OSError, UnicodeError) as error:
        number = getattr(error, "errno", None)
        if number == errno.EADDRINUSE:
            raise SettingsError(_in_use(host, port)) from None
        if number in (errno.EACCES, errno.EPERM):
            raise SettingsError(
                f"port {port} may not be listened on by this user, expected one from 1024 on; give another with --port"
            ) from None
        raise SettingsError(
            f"--host is {shown(host)}, which is no address of this machine, expected one, such as {LOOPBACK}; leave --host out"
        ) from None


def _in_use(host: str, port: int) -> str:
    return f"port {port} of {host} is in use, expected a free one; give another with --port, or --port 0 for any that is free"


@contextlib.contextmanager
def quiet() -> Iterator[None]:
    """Let viser print nothing: the command says where it listens."""
    import rich

    console = rich.get_console()
    before, console.quiet = console.quiet, True
    try:
        yield
    finally:
        console.quiet = before


@contextlib.contextmanager
def _guarding(host: str) -> Iterator[Callable[[], bool]]:
    """Let servers that are started meanwhile answer only to their own pages; yields whether one was."""
    from websockets.asyncio import server as websockets_server

    plain: Any = websockets_server.serve
    started = False

    def serve(*given: Any, **named: Any) -> Any:
        nonlocal started
        started = True
        inner = named.get("process_request")

        def process_request(connection: Any, request: Any) -> Any:
            if not is_own(request.headers, only_loopback=is_loopback(host)):
                return connection.respond(403, "This viewer answers to its own page only.\n")
            return None if inner is None else inner(connection, request)

        return plain(*given, **{**named, "process_request": process_request})

    websockets_server.serve = serve  # type: ignore[misc,assignment]
    try:
        yield lambda: started
    finally:
        websockets_server.serve = plain  # type: ignore[misc]


def is_own(headers: Any, *, only_loopback: bool) -> bool:
    """Whether a request comes from the viewer's own page, or from no page at all.

    A page of another site may not connect, nor one whose name was made to point to this machine.

    Args:
        headers: of the request.
        only_loopback: the server listens on the loopback interface, so its page has a name of that.
    """
    try:
        host, origin = headers.get("Host"), headers.get("Origin")
    except LookupError:  # given twice
        return False
    if not host:
        return False
    try:
        name = urlsplit(f"//{host}").hostname or ""
        own = origin is None or urlsplit(origin).netloc.lower() == host.lower()
    except ValueError:
        return False
    return own and (not only_loopback or is_loopback(name))
