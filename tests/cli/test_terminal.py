"""What a terminal shows: progress with the time left, colours, widths; and that pipes get neither."""

from __future__ import annotations

import io
import itertools
import os
import re
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

from house.source import REPOSITORY
from spacearm.cli import progress
from spacearm.cli.progress import line_of, progress_bar
from spacearm.cli.terminal import painted, show_list, show_table, tone_of
from spacearm.core.long_work import LongWork, TimeLeft, duration_in_words, on_progress


class Terminal(io.StringIO):
    encoding = "utf-8"

    def isatty(self) -> bool:
        return True


def terminal_as_stderr(monkeypatch: pytest.MonkeyPatch) -> Terminal:
    """Return a terminal that is stderr from now on; as a fixture it would be pytest's own again when the test begins."""
    shown = Terminal()
    monkeypatch.setattr(sys, "stderr", shown)
    monkeypatch.setenv("TERM", "xterm-256color")
    monkeypatch.delenv("NO_COLOR", raising=False)
    return shown


# ---- The time left ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("seconds", "words"),
    [(0.2, "0 s"), (59.4, "59 s"), (60, "1 min"), (130, "2 min 10 s"), (3600, "1 h"), (11100, "3 h 5 min"), (90000, "1 d 1 h")],
)
def test_a_time_has_two_units_at_most(seconds: float, words: str) -> None:
    assert duration_in_words(seconds) == words


def test_the_time_left_follows_from_the_pace_since_the_first_look() -> None:
    left = TimeLeft()
    left.see(40, 100, 10.0)  # 40 were done by an earlier run
    assert left.words(10.0) == ""
    left.see(50, 100, 20.0)
    assert left.words(20.0) == "about 50 s left"
    assert left.words(45.0) == "about 25 s left"
    assert left.words(1000.0) == "about 1 s left"
    left.see(0, 10, 1001.0)  # other work begins
    assert left.words(1001.0) == ""
    left.see(5, 0, 1002.0)
    assert left.words(1002.0) == ""


def test_long_work_tells_the_time_left(monkeypatch: pytest.MonkeyPatch) -> None:
    now = [0.0]
    monkeypatch.setattr(time, "monotonic", lambda: now[0])
    told: list[str] = []
    with on_progress(told.append):
        work = LongWork()
        for done in range(5):
            work.say(f"part {done}", done=done, total=5)
            now[0] += 2.0
        work.say("no end in sight")
    assert told == [*(f"part {done}, about {10 - 2 * done} s left" for done in range(1, 5)), "no end in sight"]


# ---- The line --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("columns", [20, 60, 80, 120, 200])
@pytest.mark.parametrize("share", [None, 0.0, 0.423, 1.0])
def test_a_line_is_narrower_than_the_terminal(columns: int, share: float | None) -> None:
    for what in ("", "goal mode, PSO, runs 1 to 20", "word " * 80):
        text = line_of("measuring", columns=columns, took=83.0, share=share, left="about 2 min 10 s left", what=what)
        assert len(text) < columns
    if share is not None and columns >= 60:
        assert f"{share:.0%}" in text
        assert "about 2 min" in text
    assert line_of("a", columns=80, took=1, share=0.5, plain=True).isascii()


def test_quick_work_shows_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    terminal = terminal_as_stderr(monkeypatch)
    with progress_bar("quick") as bar:
        bar(1, 2, "half")
    assert terminal.getvalue() == ""


def test_long_work_shows_a_line_and_takes_it_away(monkeypatch: pytest.MonkeyPatch) -> None:
    terminal = terminal_as_stderr(monkeypatch)
    monkeypatch.setattr(progress, "QUIET", 0.01)
    monkeypatch.setattr(progress, "_EVERY", 0.01)
    with progress_bar("long") as bar:
        bar(0, 4, "first")
        time.sleep(0.05)
        bar(1, 4, "second\nline")
        time.sleep(0.2)
    lines = terminal.getvalue().split("\r\x1b[K")
    assert lines[0] == ""
    assert lines[-1] == ""
    assert any(line.startswith("long  ") and "25%" in line and "left  second line" in line for line in lines)
    assert all(line != other for line, other in itertools.pairwise(lines)), "the same line is not written twice"
    assert "\n" not in terminal.getvalue()


def test_an_error_takes_the_line_away(monkeypatch: pytest.MonkeyPatch) -> None:
    terminal = terminal_as_stderr(monkeypatch)
    monkeypatch.setattr(progress, "QUIET", 0.0)

    def interrupted() -> None:
        with progress_bar("long"):
            time.sleep(0.1)
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert terminal.getvalue().endswith("\r\x1b[K")


@pytest.mark.parametrize("kind", ["pipe", "dumb"])
def test_where_no_line_can_be_taken_back_nothing_is_shown(kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    shown = io.StringIO() if kind == "pipe" else Terminal()
    monkeypatch.setattr(sys, "stderr", shown)
    monkeypatch.setattr(progress, "QUIET", 0.0)
    monkeypatch.setenv("TERM", "dumb" if kind == "dumb" else "xterm")
    with progress_bar("long") as bar:
        bar(1, 2, "half")
        time.sleep(0.05)
    assert shown.getvalue() == ""


# ---- Colours ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("header", "cell", "tone"),
    [
        ("solved", "50/50", "good"),
        ("solved", "100 (100 %)", "good"),
        ("reach 4.33", "95 %", None),
        ("reach 4.33", "70 %", "middling"),
        ("within 1 % of best known", "0 %", "bad"),
        ("certified", "249 (99.6 %)", None),
        ("certified", "-", None),
        ("to 4.33", "89%", "middling"),
        ("planned path", "proven", "good"),
        ("collisions after", "0", "good"),
        ("collisions after", "3", "bad"),
        ("mean", "95 %", None),
        ("family", "solved 3/4", None),
    ],
)
def test_what_succeeds_has_a_tone(header: str, cell: str, tone: str | None) -> None:
    assert tone_of(header, cell) == tone


def shown_in(stream: Any, monkeypatch: pytest.MonkeyPatch) -> str:
    monkeypatch.setattr(sys, "stdout", stream)
    show_table("title", ("family", "solved"), [("truss", "50/50"), ("panels", "1/50")])
    show_list([("status", "not_found"), ("certificate", "holds: it does"), ("seed", "1")])
    return stream.getvalue()


def test_a_terminal_has_colours_and_a_pipe_the_same_text_without(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TERM", "xterm-256color")
    monkeypatch.delenv("NO_COLOR", raising=False)
    monkeypatch.setenv("COLUMNS", "100")
    piped, colored = shown_in(io.StringIO(), monkeypatch), shown_in(Terminal(), monkeypatch)
    monkeypatch.setenv("NO_COLOR", "1")
    without = shown_in(Terminal(), monkeypatch)
    assert "\x1b" not in piped
    assert "38;5;36" in colored
    assert "38;5;166" in colored
    assert not re.search(r"\x1b\[[0-9;]*3[0-9;]*m", without), "NO_COLOR is respected"
    plain = [re.sub(r"\x1b\[[0-9;]*m", "", text) for text in (colored, without)]
    assert [[line.rstrip() for line in text.splitlines()] for text in plain] == [piped.splitlines()] * 2


def test_words_are_painted_in_a_terminal_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    assert painted("error", "bad") == "error"
    monkeypatch.setattr(sys, "stdout", Terminal())
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.delenv("NO_COLOR", raising=False)
    assert painted("error", "bad") == "\x1b[38;5;166merror\x1b[0m"
    monkeypatch.setenv("NO_COLOR", "1")
    assert painted("error", "bad") == "error"


# ---- In a terminal ---------------------------------------------------------------------------------------------------


def in_terminal(columns: int, *words: object, **environment: str) -> tuple[str, int]:
    """Run a command in a pseudo-terminal of a width; return what it shows and its exit code."""
    pty, fcntl, termios = (pytest.importorskip(name, reason="terminals of POSIX") for name in ("pty", "fcntl", "termios"))
    master, slave = pty.openpty()
    fcntl.ioctl(slave, termios.TIOCSWINSZ, (40).to_bytes(2, sys.byteorder) + columns.to_bytes(2, sys.byteorder) + bytes(4))
    settings = {name: value for name, value in os.environ.items() if name not in ("COLUMNS", "LINES", "NO_COLOR")}
    command = [sys.executable, "-m", "spacearm.cli", *map(str, words)]
    settings |= {"TERM": "xterm-256color", "PYTHONIOENCODING": "utf-8", **environment}
    started = subprocess.Popen(command, stdin=slave, stdout=slave, stderr=slave, env=settings, cwd=REPOSITORY)
    os.close(slave)
    shown = b""
    while True:
        try:
            part = os.read(master, 65536)
        except OSError:  # it has ended
            break
        if not part:
            break
        shown += part
    os.close(master)
    return shown.decode("utf-8", "replace"), started.wait(timeout=60)


def screen(text: str) -> list[str]:
    """Return the lines that are on the screen in the end, without colours; lines that were taken back are gone."""
    lines = []
    for line in text.replace("\r\n", "\n").split("\n"):
        left = line.split("\r\x1b[K")[-1]
        lines.append(re.sub(r"\x1b\[[0-9;]*[mK]", "", left))
    return lines


@pytest.mark.parametrize("columns", [60, 100, 200])
def test_a_command_fits_the_terminal(columns: int, tmp_path: Path) -> None:
    text, code = in_terminal(columns, "plan", "examples/01_first_plan.yaml", "-o", tmp_path / "out", "--seed", 0)
    assert code == 0, text
    lines = screen(text)
    assert max(map(len, lines)) <= columns, lines
    assert any(line.startswith("status") and "found" in line for line in lines)
    assert "\x1b[38;5;36mfound" in text
    written = [part for line in text.split("\n") for part in line.split("\r\x1b[K")]
    assert all(len(re.sub(r"\x1b\[[0-9;]*m", "", part).rstrip("\r")) <= columns for part in written), "a line would wrap"


def test_a_command_in_a_terminal_without_colour(tmp_path: Path) -> None:
    text, code = in_terminal(90, "doctor", "examples/faulty_arm.urdf", NO_COLOR="1")
    assert code == 1
    assert "\x1b[38" not in text
    assert "\x1b[38;5;166merror" in in_terminal(90, "doctor", "examples/faulty_arm.urdf")[0]


def test_codes_in_names_do_not_reach_the_terminal(capsys: pytest.CaptureFixture[str]) -> None:
    show_list([("a\x1b[31m[red]b\u202e", "said\x1b]0;title\x07\rgone")])
    out = capsys.readouterr().out
    assert not set(out) & set("\x1b\x07\r\u202e")
    assert "\\x1b[31m[red]b" in out
