"""The server: it listens where it was asked to, answers to its own page only, and publishes nothing."""

from __future__ import annotations

import contextlib
import socket
import sys
import urllib.error
import urllib.request
from collections.abc import Iterator
from pathlib import Path

import pytest

from house.source import REPOSITORY
from spacearm.core.errors import SettingsError
from spacearm.view.viser_server import is_loopback, is_own, require_free, require_viser, started_server

FIRST = REPOSITORY / "examples" / "01_first_plan.yaml"
HERE = "127.0.0.1:8484"


def test_without_viser_a_sentence_says_how_to_install_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "viser", None)
    with pytest.raises(SettingsError, match=r"needs viser.*pip install 'spacearm\[view\]'"):
        require_viser()


@pytest.mark.parametrize(
    ("host", "so"),
    [("127.0.0.1", True), ("localhost", True), ("LOCALHOST", True), ("::1", True), ("[::1]", True), ("127.9.9.9", True)]
    + [(host, False) for host in ("0.0.0.0", "::", "192.168.0.7", "example.org", "localhost.example.org", "")],
)
def test_which_addresses_are_of_this_machine_alone(host: str, so: bool) -> None:
    assert is_loopback(host) is so


class Headers(dict[str, str]):
    """Of a request; a name given twice cannot be got."""

    def get(self, name: str, default: object = None) -> object:  # type: ignore[override]
        if self.get_all(name) == "twice":
            raise LookupError(name)
        return super().get(name, default)  # type: ignore[arg-type]

    def get_all(self, name: str) -> str:
        return "twice" if super().get(name) == "twice" else ""


@pytest.mark.parametrize(
    ("host", "origin", "loopback", "anywhere"),
    [
        (HERE, None, True, True),  # no page, as a program
        (HERE, f"http://{HERE}", True, True),
        ("localhost:8484", "http://localhost:8484", True, True),
        ("[::1]:8484", "http://[::1]:8484", True, True),
        (HERE, "http://127.0.0.1:9999", False, False),  # another page of this machine
        (HERE, "https://example.org", False, False),
        (HERE, "null", False, False),  # a page in a sandbox, or from a file
        (HERE, "", False, False),
        ("example.org:8484", "http://example.org:8484", False, True),  # a name that was made to point here
        ("example.org:8484", None, False, True),
        ("192.168.0.7:8484", "http://192.168.0.7:8484", False, True),
        ("twice", None, False, False),
        (HERE, "twice", False, False),
        (None, None, False, False),
        ("[", "http://[", False, False),
    ],
)
def test_only_its_own_page_is_answered(host: str | None, origin: str | None, loopback: bool, anywhere: bool) -> None:
    headers = Headers({key: value for key, value in (("Host", host), ("Origin", origin)) if value is not None})
    assert is_own(headers, only_loopback=True) is loopback
    assert is_own(headers, only_loopback=False) is anywhere


@pytest.fixture
def taken() -> Iterator[int]:
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        one.listen(1)
        yield int(one.getsockname()[1])


def test_a_port_in_use_is_refused_in_a_sentence(taken: int) -> None:
    with pytest.raises(SettingsError, match=f"port {taken} of 127.0.0.1 is in use, expected a free one"):
        require_free("127.0.0.1", taken)


@pytest.mark.parametrize("host", ["192.0.2.1", "no.such.host.invalid", "not a host", "a" * 300])
def test_an_address_of_somebody_else_is_refused_in_a_sentence(host: str) -> None:
    with pytest.raises(SettingsError, match="which is no address of this machine"):
        require_free(host, 0)


# ---- With viser -------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def server() -> Iterator[object]:
    pytest.importorskip("viser", reason="viser is not installed: pip install 'spacearm[view]'")
    made = started_server("127.0.0.1", 0, label="test")
    yield made
    made.stop()


def answer(server: object, host: str = "", origin: str = "", path: str = "/") -> int:
    port = server.get_port()  # type: ignore[attr-defined]
    headers = {"Host": host.format(port)} if host else {}
    headers |= {"Origin": origin.format(port)} if origin else {}
    request = urllib.request.Request(f"http://127.0.0.1:{port}{path}", headers=headers)
    try:
        with urllib.request.urlopen(request, timeout=30) as found:
            return int(found.status)
    except urllib.error.HTTPError as error:
        return error.code


def test_the_page_is_served_to_itself_alone(server: object) -> None:
    assert answer(server) == 200
    assert answer(server, host="localhost:{}", origin="http://localhost:{}") == 200
    assert answer(server, host="example.org:{}") == 403
    assert answer(server, origin="https://example.org") == 403
    assert answer(server, origin="http://127.0.0.1:1") == 403
    assert answer(server, path="/../../../../../etc/passwd") == 404
    assert answer(server, path="/%2e%2e/%2e%2e/__init__.py") == 404


@pytest.mark.parametrize(("origin", "lets"), [("http://127.0.0.1:{}", True), ("https://example.org", False), (None, True)])
def test_a_socket_is_opened_by_its_own_page_alone(server: object, origin: str | None, lets: bool) -> None:
    import viser
    from websockets.exceptions import InvalidStatus
    from websockets.sync.client import connect
    from websockets.typing import Origin, Subprotocol

    port = server.get_port()  # type: ignore[attr-defined]
    asked = {"origin": Origin(origin.format(port)) if origin else None}
    protocols = [Subprotocol(f"viser-v{viser.__version__}")]
    refused = contextlib.nullcontext() if lets else pytest.raises(InvalidStatus, match="HTTP 403")
    with refused, connect(f"ws://127.0.0.1:{port}", subprotocols=protocols, max_size=None, **asked) as socket_of_page:
        assert socket_of_page.recv(timeout=30)


def test_a_page_cannot_have_it_published(server: object, monkeypatch: pytest.MonkeyPatch) -> None:
    def tunnel(*_: object) -> None:
        raise AssertionError("it was published")

    monkeypatch.setattr("viser._viser.ViserTunnel", tunnel)
    assert server.request_share_url() is None  # type: ignore[attr-defined]


def test_it_is_quiet(server: object, capsys: pytest.CaptureFixture[str]) -> None:
    another = started_server("127.0.0.1", 0, label="test")
    from spacearm.view.viser_server import quiet

    with quiet():
        another.stop()
    assert capsys.readouterr() == ("", "")


def test_a_viewer_on_a_port_in_use_is_refused(server: object, taken: int, tmp_path: Path) -> None:
    from spacearm.view.open_viewer import Viewer

    with pytest.raises(SettingsError, match="is in use"):
        Viewer(FIRST, tmp_path, host="127.0.0.1", port=taken)
