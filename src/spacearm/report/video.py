"""A report's 3-D picture as a video: each frame is the page's own, taken by a browser without a window and joined by ffmpeg."""

from __future__ import annotations

import base64
import json
import math
import os
import shutil
import subprocess
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO, Any, NamedTuple, cast

from spacearm.core.errors import OutputError, SettingsError
from spacearm.core.output import require_writable, write_out
from spacearm.report.headless_chromium import ChromiumPage, chromium_page, find_chromium
from spacearm.report.report_page import page_html

Data = dict[str, Any]
Progress = Callable[[int, int], None]
"""Called with the frames that are done, and how many there will be."""

ENDINGS = (".mp4", ".gif")
"""What a video's file may end with."""

LONGEST = 60.0
"""[s] Videos of longer motions run faster, unless a speed is asked for."""

_SIZES = {".mp4": (1280, 720), ".gif": (800, 450)}
_RATES = {".mp4": 30.0, ".gif": 20.0}
_FASTEST, _SMALLEST, _LARGEST = 120.0, 64, 7680
_MOST_FRAMES = 100_000
_HOLD = 0.6  # [s] the last picture stays so long
_READY = 120.0  # [s] until the page is drawn
_ENCODERS = (("libx264", ("-crf", "18", "-preset", "medium")), ("libopenh264", ("-b:v", "8M")), ("mpeg4", ("-q:v", "3")))
_PALETTE = "split[a][b];[a]palettegen=stats_mode=diff[p];[b][p]paletteuse=dither=sierra2_4a"

_STAGE = """(() => {
  const canvas = window.spacearm.stage.canvas, box = canvas.parentElement;
  const style = document.createElement("style");
  style.textContent = `html, body { overflow: hidden !important; background: none; }
    .spacearm-filmed { position: fixed !important; inset: 0 !important; width: 100vw !important; height: 100vh !important;
      min-height: 0 !important; max-height: none !important; z-index: 2147483646 !important; margin: 0 !important; }
    .spacearm-time { position: fixed; right: 14px; top: 28px; z-index: 2147483647; text-align: right; color: inherit;
      font: 600 15px system-ui, sans-serif; font-variant-numeric: tabular-nums; }
    .spacearm-time small { display: block; font-weight: 400; font-size: 12px; opacity: 0.75; }`;
  const time = document.createElement("div");
  time.className = "spacearm-time";
  time.append(document.createElement("span"), document.createElement("small"));
  time.lastChild.textContent = window.spacearm.page.title;
  document.head.append(style);
  box.classList.add("spacearm-filmed");
  box.append(time);
  document.body.append(box);
  document.getElementById("app").style.display = "none";
  window.dispatchEvent(new Event("resize"));
  window.spacearm.stage.resize();
  window.spacearmFrame = (t, text) => {
    window.spacearm.seek(t);
    window.spacearm.stage.draw();  // at once, and not again for the seek
    time.firstChild.textContent = text;
    return true;
  };
  return [canvas.clientWidth, canvas.clientHeight];
})()"""


class Film(NamedTuple):
    """How a video is made.

    Attributes:
        fps: frames a second.
        size: (width, height) [pixels].
        speed: of the motion: 2 is twice as fast as it is.
        frames: how many there are.
    """

    fps: float
    size: tuple[int, int]
    speed: float
    frames: int


def save_video(
    plans: Any,
    path: str | os.PathLike[str],
    *,
    fps: float | None = None,
    size: tuple[int, int] | None = None,
    speed: float | None = None,
    overwrite: bool = False,
    progress: Progress | None = None,
) -> None:
    """Write a video of a motion, or of several beside each other, as the report's picture shows it.

    Needs Chromium (or Chrome) and ffmpeg.

    Args:
        plans: a Plan, a SavedPlan or a Certificate, or several of them.
        path: of the file, a new one that ends with .mp4 or .gif.
        fps: frames a second; by default 30, of a .gif 20.
        size: (width, height) [pixels]; by default 1280 x 720, of a .gif 800 x 450. Odd ones of an .mp4 get a pixel more.
        speed: of the motion; by default 1, the true one, but more for motions that take more than a minute.
        overwrite: replace a file that is there.
        progress: called with the frames done and those in all.

    Raises:
        OutputError: the file exists already, cannot be written or has another ending; Chromium or ffmpeg is missing or fails.
        SettingsError: a number out of its range.
        ProblemError: plans that are none.
    """
    require_tools(path, overwrite=overwrite)
    from spacearm.report.report_plan import report_of_plans

    record(report_of_plans(plans), path, fps=fps, size=size, speed=speed, overwrite=overwrite, progress=progress)


def require_tools(path: str | os.PathLike[str], *, overwrite: bool = False) -> tuple[str, str]:
    """Check before the work that a video can be made; return the programs of Chromium and of ffmpeg.

    Raises:
        OutputError: one of them is missing, or the file exists already or has another ending.
    """
    require_writable(path, overwrite=overwrite)
    if Path(path).suffix.lower() not in ENDINGS:
        raise OutputError(f"{path} is to be a video, expected a name that ends with {' or '.join(ENDINGS)}")
    ffmpeg = shutil.which("ffmpeg")
    if ffmpeg is None:
        raise OutputError("a video needs ffmpeg, which is not there; install it, as in: apt install ffmpeg")
    return find_chromium(), ffmpeg


def film_of(page: Data, path: Path, fps: float | None, size: tuple[int, int] | None, speed: float | None) -> Film:
    """Return how a video of a page's first view is made.

    Raises:
        SettingsError: a number out of its range.
    """
    ending, duration = path.suffix.lower(), float(page["views"][0]["clock"]["duration"])
    fps = _RATES[ending] if fps is None else _within("fps", fps, 1.0, _FASTEST, "frames a second")
    width, height = _SIZES[ending] if size is None else size
    for name, value in (("width", width), ("height", height)):
        _within(f"the {name} of size", value, _SMALLEST, _LARGEST, "pixels")
    if ending == ".mp4":  # whose colours are those of 2 x 2 pixels
        width, height = (math.ceil(value / 2) * 2 for value in (width, height))
    speed = max(1.0, duration / LONGEST) if speed is None else _within("speed", speed, 1e-4, 1e6, "times as fast")
    frames = math.ceil(duration / speed * fps) + 1 + round(_HOLD * fps)
    if frames > _MOST_FRAMES:
        raise SettingsError(
            f"a motion of {duration:g} s at speed {speed:g} and {fps:g} frames a second has {frames:,} frames, expected "
            f"{_MOST_FRAMES:,} at most; give a higher speed"
        )
    return Film(fps=fps, size=(int(width), int(height)), speed=speed, frames=frames)


def _within(name: str, value: Any, least: float, most: float, unit: str) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not least <= value <= most:
        raise SettingsError(f"{name} is {value!r}, expected {least:g} to {most:g} {unit}")
    return float(value)


def record(
    page: Data,
    path: str | os.PathLike[str],
    *,
    fps: float | None = None,
    size: tuple[int, int] | None = None,
    speed: float | None = None,
    overwrite: bool = False,
    progress: Progress | None = None,
) -> Film:
    """Write a video of a report's page; arguments and errors as those of `save_video`.

    Args:
        page: as `web/src/data.ts` describes it.
    """
    path = Path(path)
    chromium, ffmpeg = require_tools(path, overwrite=overwrite)
    film = film_of(page, path, fps, size, speed)
    with tempfile.TemporaryDirectory(prefix="spacearm-video-") as folder:
        html = Path(folder) / "report.html"
        html.write_text(page_html(page), encoding="utf-8")
        # The part is beside the video: a folder that cannot be written is found before the work is done.
        part = path.with_name(f".{path.stem[:100]}.{os.urandom(4).hex()}{path.suffix}")
        try:
            with chromium_page(chromium, *film.size) as browser, _encoder(ffmpeg, part, film) as write:
                _begin(browser, html)
                for i, picture in enumerate(_pictures(browser, page, film), start=1):
                    write(picture)
                    if progress is not None:
                        progress(i, film.frames)
            write_out(path, part.read_bytes(), overwrite=overwrite)  # of two at once, one gets the name
        finally:
            with suppress(OSError):
                part.unlink()
    return film


def _begin(browser: ChromiumPage, html: Path) -> None:
    """Open the page and let its picture fill it."""
    browser.open(html)
    browser.wait_for("Boolean(window.spacearm && window.spacearm.ready)", timeout=_READY)
    browser.value("window.spacearm.ready.then(() => true)", timeout=_READY)
    browser.wait_for("Boolean(window.spacearm.page)", timeout=_READY)
    if not browser.value("Boolean(window.spacearm.stage)"):
        raise OutputError("the browser draws no 3-D picture (WebGL 2), which a video is made of; try another Chromium")
    browser.value(_STAGE)


def _pictures(browser: ChromiumPage, page: Data, film: Film) -> Iterator[bytes]:
    """Yield the frames as JPEG; the last one stays for a moment."""
    clock = page["views"][0]["clock"]
    duration, unit = float(clock["duration"]), clock["unit"]
    fast = "" if film.speed == 1 else f"  ({film.speed:.3g}x)"
    last, picture = None, b""
    for i in range(film.frames):
        t = min(i / film.fps * film.speed, duration)
        if t != last:
            text = f"{t:.2f} {unit}{fast}".strip()
            browser.value(f"window.spacearmFrame({t!r}, {json.dumps(text)})")
            shot = browser.call("Page.captureScreenshot", format="jpeg", quality=95, optimizeForSpeed=True)
            last, picture = t, base64.b64decode(shot["data"])
        yield picture


@contextmanager
def _encoder(ffmpeg: str, path: Path, film: Film) -> Iterator[Callable[[bytes], None]]:
    """Start ffmpeg; the function given writes a frame. At the context's end the file is complete.

    Raises:
        OutputError: ffmpeg fails.
    """
    given = ["-f", "image2pipe", "-c:v", "mjpeg", "-framerate", f"{film.fps:g}", "-i", "-", "-an"]
    with tempfile.TemporaryFile() as told:
        process = subprocess.Popen(
            [
                ffmpeg,
                "-hide_banner",
                "-loglevel",
                "error",
                "-nostdin",
                "-y",
                *given,
                *_encoding(ffmpeg, path),
                f"file:{path}",
            ],  # a name is no protocol or option
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=told,
            start_new_session=True,  # Ctrl-C is ours to handle
        )
        pipe = cast("IO[bytes]", process.stdin)

        def failed() -> OutputError:
            told.seek(0)
            said = " ".join(told.read().decode(errors="replace").split()[-40:])
            return OutputError(f"ffmpeg cannot write {path.suffix[1:]}: {said or 'it ended by itself'}; check its version")

        def write(picture: bytes) -> None:
            try:
                pipe.write(picture)
            except OSError:
                process.wait()
                raise failed() from None

        try:
            yield write
            with suppress(OSError):
                pipe.close()
            if process.wait() != 0:
                raise failed()
        finally:
            if process.poll() is None:
                process.kill()
            with suppress(OSError):
                pipe.close()
            process.wait()


def _encoding(ffmpeg: str, path: Path) -> list[str]:
    """Return ffmpeg's options for a file's ending."""
    if path.suffix.lower() == ".gif":
        return ["-filter_complex", f"[0:v]{_PALETTE}", "-loop", "0"]
    listed = subprocess.run([ffmpeg, "-hide_banner", "-encoders"], capture_output=True, text=True, check=False, timeout=60)
    known = set(listed.stdout.split())
    for name, options in _ENCODERS:
        if name in known:
            return ["-c:v", name, *options, "-pix_fmt", "yuv420p", "-movflags", "+faststart"]
    raise OutputError(f"{ffmpeg} knows none of {', '.join(name for name, _ in _ENCODERS)}, expected one for .mp4; write a .gif")
