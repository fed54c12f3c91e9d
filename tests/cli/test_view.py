"""`spacearm view`: what it refuses, what it says, and how it ends."""

from __future__ import annotations

import os
import re
import signal
import socket
import subprocess
import sys
import urllib.request
from pathlib import Path

import pytest

from cli.conftest import Refused


def test_without_viser_it_says_how_to_install_it(refused: Refused, problem: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "viser", None)
    refused(("needs viser", "pip install 'spacearm[view]'"), "view", problem)


def test_wrong_input_is_refused_in_a_sentence(refused: Refused, problem: Path, tmp_path: Path) -> None:
    pytest.importorskip("viser", reason="viser is not installed: pip install 'spacearm[view]'")
    refused(("--port is 70000", "from 0 to 65535"), "view", problem, "--port", "70000")
    refused(("--seed is -1",), "view", problem, "--seed", "-1")
    refused(("is no folder", "--folder"), "view", problem, "--folder", tmp_path / "missing", "--port", "0")
    refused(("does not exist",), "view", tmp_path / "missing.yaml", "--port", "0")
    refused(("does not exist",), "view", tmp_path / "missing.json", "--port", "0")
    refused(("--host is '192.0.2.1'", "no address of this machine"), "view", problem, "--host", "192.0.2.1")
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen(1)
        port = taken.getsockname()[1]
        refused((f"port {port} of 127.0.0.1 is in use", "--port 0"), "view", problem, "--port", port)


@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
@pytest.mark.parametrize(("host", "warns"), [("127.0.0.1", False), ("0.0.0.0", True)])
def test_it_says_where_it_listens_and_ends_cleanly(host: str, warns: bool, problem: Path, tmp_path: Path) -> None:
    pytest.importorskip("viser", reason="viser is not installed: pip install 'spacearm[view]'")
    command = [sys.executable, "-m", "spacearm.cli", "view", str(problem), "--no-open", "--port", "0", "--host", host]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=tmp_path) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        said = process.stdout.readline()
        found = re.fullmatch(r"(http://127\.0\.0\.1:\d+) shows .+; files are saved in .+; Ctrl-C ends it\n", said)
        assert found, said or process.stderr.read()
        with urllib.request.urlopen(found[1], timeout=60) as page:
            assert page.status == 200
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=60)
    assert (process.returncode, out) == (130, "")
    lines = err.splitlines()
    assert lines[-1] == "spacearm: interrupted; the viewer is closed; nothing was saved"
    assert [line for line in lines[:-1] if "listens on" in line] == lines[:-1]
    assert len(lines) == 1 + warns
    assert os.listdir(tmp_path) == ["problem.yaml"]
