"""`spacearm report`: a page of one saved plan, or of several beside each other; their video, their scene for other programs.

The files and the report are imported by the function that uses them, after the options are read: help is printed without.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from tyro.conf import Positional, arg

from spacearm.cli.arguments import parsed
from spacearm.cli.progress import Bar, progress_bar
from spacearm.cli.terminal import show_list
from spacearm.core.checks import shown
from spacearm.core.errors import OutputError, SettingsError, SpacearmError
from spacearm.core.interrupts import unbroken
from spacearm.core.output import require_new

if TYPE_CHECKING:
    from spacearm.files.plan_file import Recheck


@dataclass(frozen=True, kw_only=True)
class Options:
    """Write a report of saved plans: the robot in 3-D over time, its curves, and what is proven; one page for a browser.

    Or a video of its picture, or the moving scene for other programs. Several plans are drawn beside each other, the first one
    solid and the others pale, with their figures in a table. What the files call proven is proven again for the page.

    Attributes:
        plan: a plan.json.
        others: further ones, to be shown beside it.
        output: the page, a new file.
        title: of the page; none: by the robot's name.
        glb: the moving scene as binary glTF, a new file for Blender and others.
        video: a new file, .mp4 or .gif; needs Chromium and ffmpeg.
        fps: frames a second; none: 30, of a .gif 20.
        size: of the video in pixels; none: 1280x720, of a .gif 800x450.
        speed: of the motion in the video; none: the true one, more if it takes over a minute.
    """

    plan: Annotated[Positional[Path], arg(metavar="PLAN.JSON")]
    others: Annotated[Positional[tuple[Path, ...]], arg(metavar="PLAN.JSON")] = ()
    output: Annotated[Path | None, arg(metavar="REPORT.HTML", aliases=("-o",))] = None
    title: Annotated[str | None, arg(metavar="TEXT")] = None
    glb: Annotated[Path | None, arg(metavar="SCENE.GLB")] = None
    video: Annotated[Path | None, arg(metavar="VIDEO.MP4")] = None
    fps: float | None = None
    size: Annotated[str | None, arg(metavar="WIDTHxHEIGHT")] = None
    speed: float | None = None


def run(arguments: Sequence[str]) -> int:
    """Run the command and return its exit code."""
    options = parsed(Options, arguments, command="report")
    paths = (options.plan, *options.others)
    size = _required(options)
    with unbroken():
        from spacearm.files.plan_file import load_saved_plan
        from spacearm.report.report_plan import report_of_plans
    with progress_bar("report") as bar:
        saved, again = [], []
        for i, path in enumerate(paths):
            bar(i, len(paths), str(path))
            saved.append(load_saved_plan(path))
            again.append(_proven_again(path))
        bar(0, 0, "clearances, curves and scene")
        page = report_of_plans(saved, title=options.title or "", names=names_of(paths), again=again)
        written = _write(options, page, size, bar)
    views = [(view["name"], view["verdict"]["headline"]) for view in page["views"]]
    show_list([*views, *(("written", f"{path} ({path.stat().st_size / 1e6:.2f} MB){said}") for path, said in written)])
    return 0


def _proven_again(path: Path) -> Recheck | None:
    """Return what a new proof of a saved plan finds; None for a plan that cannot be proven at all, which the page tells."""
    from spacearm.files.plan_file import recheck_plan

    try:
        return recheck_plan(path)
    except SpacearmError:
        return None


def _required(options: Options) -> tuple[int, int] | None:
    """Refuse what cannot be written, before the work; return the size of the video that is asked for.

    Raises:
        SettingsError: nothing is to be written, options of a video without one, or a size that is none.
        OutputError: a file that is there, or a program that is not.
    """
    if options.output is None and options.glb is None and options.video is None:
        raise SettingsError("report has nothing to write, expected -o, --glb or --video; add -o report.html for the page")
    if options.output is not None:
        require_new(options.output, advice="choose another name with -o")
    if options.glb is not None:
        if options.glb.suffix.lower() != ".glb":
            raise OutputError(f"--glb is {options.glb}, expected a name that ends with .glb")
        require_new(options.glb, advice="choose another name with --glb")
    if options.video is not None:
        from spacearm.report.video import require_tools

        require_new(options.video, advice="choose another name with --video")
        require_tools(options.video)
    asked = {"--fps": options.fps, "--size": options.size, "--speed": options.speed}
    given = [name for name, value in asked.items() if value is not None]
    if given and options.video is None:
        raise SettingsError(f"{given[0]} is that of a video, and none is asked for; add --video FILE.mp4, or leave it out")
    return None if options.size is None else _size(options.size)


def _size(text: str) -> tuple[int, int]:
    found = re.fullmatch(r"(\d{1,6})[xX×](\d{1,6})", text.strip(), re.ASCII)
    if found is None:
        raise SettingsError(f"--size is {shown(text)}, expected width and height in pixels, as in 1280x720")
    return int(found[1]), int(found[2])


def _write(options: Options, page: dict[str, Any], size: tuple[int, int] | None, bar: Bar) -> list[tuple[Path, str]]:
    """Write what is asked for; return each file with what can be done with it."""
    written: list[tuple[Path, str]] = []
    if options.output is not None:
        from spacearm.report.report_page import write_report

        write_report(page, options.output)
        written.append((options.output, "; open it in a browser"))
    if options.glb is not None:
        from spacearm.core.output import write_new
        from spacearm.report.gltf_export import glb_of_page

        write_new(options.glb, glb_of_page(page))
        written.append((options.glb, "; open it in Blender, or another program that reads glTF"))
    if options.video is not None:
        from spacearm.report.video import record

        def frames(done: int, total: int) -> None:
            bar(done, total, f"frame {done} of {total}")

        bar(0, 0, "browser")
        film = record(page, options.video, fps=options.fps, size=size, speed=options.speed, progress=frames)
        fast = "" if film.speed == 1 else f", {film.speed:.3g} times as fast as the motion"
        written.append((options.video, f"; {film.frames} frames at {film.fps:g} a second{fast}"))
    return written


def names_of(paths: Sequence[Path]) -> list[str]:
    """Return short names of files that differ: the files' own, or with as many of their folders as it takes.

    Of files with the same name in different folders, as `a/plan.json` and `b/plan.json`, it is the folders' names.
    """
    parts = [(*path.absolute().parts[:-1], path.stem) for path in paths]
    if len(parts) > 1 and len({part[-1] for part in parts}) == 1:
        parts = [part[:-1] for part in parts]
    names = [part[-1] for part in parts]
    for count in range(1, max(map(len, parts)) + 1):
        names = ["/".join(part[-count:]) for part in parts]
        if len(set(names)) == len(names):
            return names
    return [f"{name} ({i})" for i, name in enumerate(names, start=1)]  # the same file twice
