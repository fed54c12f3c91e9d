"""Videos of the report's picture: what is asked before the work, what is made, and that nothing is left running."""

import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from spacearm.core.errors import OutputError, SettingsError
from spacearm.geometry import Scene, Sphere
from spacearm.motion import Motion, Trajectory
from spacearm.planner import Problem
from spacearm.proof import certify
from spacearm.report import video
from spacearm.report.headless_chromium import chromium_page, find_chromium
from spacearm.report.report_plan import report_of_plans
from spacearm.report.video import Film, film_of, record, require_tools, save_video
from support.small_robots import slider

PAGE: dict[str, Any] = {"views": [{"name": "one", "clock": {"unit": "s", "duration": 10.0}}]}


def _missing() -> str:
    try:
        require_tools("a.mp4")
    except OutputError as error:
        return str(error)
    return ""


records = pytest.mark.skipif(bool(_missing()), reason=_missing())


def test_a_film_has_as_many_frames_as_it_takes() -> None:
    film = film_of(PAGE, Path("a.mp4"), None, None, None)
    assert (film.fps, film.size, film.speed) == (30, (1280, 720), 1)
    assert film.frames == 301 + 18  # the last picture stays for a moment
    assert film_of(PAGE, Path("a.GIF"), None, None, None).size == (800, 450)
    assert film_of(PAGE, Path("a.mp4"), 10, (640, 360), 2.0).frames == 51 + 6
    assert film_of(PAGE, Path("a.mp4"), None, (641, 361), None).size == (642, 362)
    assert film_of(PAGE, Path("a.gif"), None, (641, 361), None).size == (641, 361)


def test_a_long_motion_runs_faster_unless_asked_otherwise() -> None:
    page = {"views": [{"clock": {"unit": "s", "duration": 600.0}}]}
    assert film_of(page, Path("a.mp4"), None, None, None).speed == 10
    assert film_of(page, Path("a.mp4"), None, None, 1.0).speed == 1
    with pytest.raises(SettingsError, match=r"600,0\d\d frames, expected 100,000 at most; give a higher speed"):
        film_of(page, Path("a.mp4"), 100.0, None, 0.1)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"fps": 0.5}, "fps is 0.5, expected 1 to 120"),
        ({"fps": True}, "fps is True"),
        ({"size": (10, 500)}, "the width of size is 10, expected 64 to 7680 pixels"),
        ({"size": (500, 9000)}, "the height of size is 9000"),
        ({"speed": 0.0}, "speed is 0.0"),
        ({"speed": float("nan")}, "speed is nan"),
    ],
)
def test_wrong_numbers_are_refused(given: dict[str, Any], words: str) -> None:
    with pytest.raises(SettingsError, match=re.escape(words)):
        film_of(PAGE, Path("a.mp4"), **{"fps": None, "size": None, "speed": None, **given})


def test_another_ending_is_refused(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match=r"a name that ends with \.mp4 or \.gif"):
        save_video(None, tmp_path / "a.avi")


def test_what_is_there_is_not_overwritten(tmp_path: Path) -> None:
    (tmp_path / "a.mp4").write_text("mine")
    with pytest.raises(OutputError, match="exists"):
        save_video(None, tmp_path / "a.mp4")


def test_a_missing_program_is_named_with_what_to_do(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("SPACEARM_CHROMIUM", raising=False)
    monkeypatch.setattr("spacearm.report.headless_chromium._PLACES", ())
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(OutputError, match="needs ffmpeg, which is not there; install it"):
        save_video(None, tmp_path / "a.mp4")
    (tmp_path / "ffmpeg").write_text("#!/bin/sh\n")
    (tmp_path / "ffmpeg").chmod(0o755)
    with pytest.raises(OutputError, match="needs Chromium or Chrome, which is not there; install it"):
        save_video(None, tmp_path / "a.mp4")
    monkeypatch.setenv("SPACEARM_CHROMIUM", "/gone/chrome")
    with pytest.raises(OutputError, match="SPACEARM_CHROMIUM is '/gone/chrome', which is no program"):
        save_video(None, tmp_path / "a.mp4")


def test_a_browser_that_ends_by_itself_is_told(tmp_path: Path) -> None:
    program = tmp_path / "chromium"
    program.write_text("#!/bin/sh\nexit 3\n")
    program.chmod(0o755)
    with pytest.raises(OutputError, match="ended by itself"), chromium_page(str(program), 320, 200):
        pass


def test_a_browser_that_says_nothing_is_given_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    program = tmp_path / "chromium"
    program.write_text("#!/bin/sh\nexec sleep 600\n")
    program.chmod(0o755)
    monkeypatch.setattr("spacearm.report.headless_chromium._START", 0.2)
    monkeypatch.setattr("spacearm.report.headless_chromium._GOING", 0.2)
    with pytest.raises(OutputError, match="gave no answer"), chromium_page(str(program), 320, 200):
        pass
    assert not _running(str(program))


def test_a_broken_ffmpeg_is_told(tmp_path: Path) -> None:
    program = tmp_path / "ffmpeg"
    program.write_text('#!/bin/sh\ncase "$*" in *-encoders*) echo libx264;; *) echo no room >&2; exit 1;; esac\n')
    program.chmod(0o755)
    film = film_of(PAGE, Path("a.mp4"), None, None, None)
    with pytest.raises(OutputError, match="ffmpeg cannot write mp4: no room"):
        _written(str(program), tmp_path / "a.mp4", film)


def _written(program: str, path: Path, film: Film) -> None:
    with video._encoder(program, path, film) as write:
        for _ in range(200):
            write(b"\xff" * 10_000)


def _running(words: str) -> list[str]:
    """The command lines of processes that have some words in them."""
    found = []
    for entry in Path("/proc").glob("[0-9]*/cmdline"):
        try:
            line = entry.read_bytes().replace(b"\0", b" ").decode(errors="replace")
        except OSError:
            continue
        if words in line:
            found.append(line)
    return found


@pytest.fixture
def temporary(monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A folder for temporary files, with a short name, as a browser wants it; nothing in it, nothing of it is left running."""
    with tempfile.TemporaryDirectory(prefix="film-", dir="/tmp") as folder:
        monkeypatch.setenv("TMPDIR", folder)
        monkeypatch.setattr("tempfile.tempdir", None)
        yield Path(folder)
        assert os.listdir(folder) == []
        assert not _running(folder)


def _motion() -> Any:
    """A short motion past a ball, proven."""
    problem = Problem(slider(), Scene([Sphere((1.0, 0, 2.0), 0.5, name="ball")]), start=[0, 0], goal=[1, 0])
    return certify(problem, Trajectory(problem.robot, Motion([[0.0, 0.0], [0.3, 0.0], [1.0, 0.0]])))


def _frames(path: Path, size: tuple[int, int]) -> np.ndarray:
    """The frames of a video, as ffmpeg decodes them."""
    raw = subprocess.run(
        [str(shutil.which("ffmpeg")), "-v", "error", "-i", str(path), "-f", "rawvideo", "-pix_fmt", "rgb24", "-"],
        capture_output=True,
        check=True,
    ).stdout
    return np.frombuffer(raw, np.uint8).reshape(-1, size[1], size[0], 3)


@records
@pytest.mark.usefixtures("temporary")
@pytest.mark.parametrize("ending", ["mp4", "gif"])
def test_a_video_shows_the_motion(tmp_path: Path, ending: str) -> None:
    path, said, motion = tmp_path / f"motion.{ending}", [], _motion()
    save_video(motion, path, fps=5, size=(320, 180), speed=2.0, progress=lambda done, total: said.append((done, total)))
    frames = _frames(path, (320, 180)).astype(int)
    assert said == [(i, len(said)) for i in range(1, len(said) + 1)]
    assert len(frames) == len(said) == film_of(report_of_plans(motion), path, 5, None, 2.0).frames
    first, last = frames[0], frames[-1]
    assert first.std() > 5  # a picture, and not one colour
    assert (np.abs(first - last).max(axis=2) > 40).sum() > 50  # in which something has moved
    assert os.listdir(tmp_path) == [path.name]


@records
@pytest.mark.usefixtures("temporary")
def test_an_interrupted_video_leaves_nothing(tmp_path: Path) -> None:
    def stop(done: int, _: int) -> None:
        if done == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        record(report_of_plans(_motion()), tmp_path / "motion.mp4", fps=5, size=(320, 180), progress=stop)
    assert os.listdir(tmp_path) == []


@records
def test_a_killed_process_takes_its_browser_along(tmp_path: Path) -> None:
    script = (
        "import sys, time\nfrom spacearm.report.headless_chromium import chromium_page, find_chromium\n"
        "with chromium_page(find_chromium(), 320, 200) as page:\n    print('begun', flush=True)\n    time.sleep(60)\n"
    )
    with tempfile.TemporaryDirectory(prefix="film-", dir="/tmp", ignore_cleanup_errors=True) as folder:
        environment = {**os.environ, "TMPDIR": folder}
        with subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, env=environment) as process:
            try:
                assert process.stdout is not None
                assert process.stdout.readline() == b"begun\n"
                assert _running(folder)
            finally:
                process.kill()
        end = time.monotonic() + 30
        while _running(folder) and time.monotonic() < end:
            time.sleep(0.1)
        assert not _running(folder)


@records
def test_a_page_that_throws_is_told(tmp_path: Path) -> None:
    (tmp_path / "page.html").write_text("<script>throw new Error('no such mesh')</script>")
    with chromium_page(find_chromium(), 320, 200) as page:
        page.open(tmp_path / "page.html")
        assert page.value("1 + 1") == 2
        with pytest.raises(OutputError, match="no such mesh"):
            page.wait_for("Boolean(window.spacearm)", timeout=0.3)
        with pytest.raises(OutputError, match="the page cannot be recorded: TypeError"):
            page.value("window.spacearm.ready")
