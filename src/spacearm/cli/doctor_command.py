"""`spacearm doctor`: what is wrong with a robot's model, and a corrected copy."""

from __future__ import annotations

import json
import shutil
import sys
import textwrap
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

from tyro.conf import Positional, arg

from spacearm.cli.arguments import parsed
from spacearm.cli.terminal import Tone, loading, painted
from spacearm.core.errors import SettingsError
from spacearm.core.version import version
from spacearm.doctor import Choices, Diagnosis, Finding, Mended, diagnose, mend_urdf

_TONES: dict[str, Tone] = {"error": "bad", "warning": "middling", "note": "quiet"}
_LISTED = 12  # places of one kind of finding
_CHOSEN = Choices()


@dataclass(frozen=True, kw_only=True)
class Options:
    """Find the faults of a robot's model, and say how to correct each.

    With --fix, a corrected copy is written, and the findings are those that are left in the copy. If there are errors or
    warnings, the exit code is 1.

    Attributes:
        model: a URDF file.
        srdf: an SRDF file about the same robot.
        base: the base of the robot; with floating a missing mass is an error, with fixed it is not; none: as the SRDF states.
        fix: write a corrected copy to this new file.
        force: replace the file that --fix names if it exists; never the model itself.
        velocity_limit: the limit that --fix gives a joint without a velocity limit [rad/s or m/s].
        range_limit: the limit that --fix gives a revolute joint without limits, to both sides [rad].
        density: the density that --fix uses for a link without a mass [kg/m^3]; none: the mass stays missing.
        json: print the findings as JSON instead of the list.
    """

    model: Annotated[Positional[Path], arg(metavar="MODEL.URDF")]
    srdf: Annotated[Path | None, arg(metavar="MODEL.SRDF")] = None
    base: Literal["fixed", "floating"] | None = None
    fix: Annotated[Path | None, arg(metavar="OUT.URDF")] = None
    force: bool = False
    velocity_limit: float = _CHOSEN.velocity_limit
    range_limit: float = _CHOSEN.range_limit
    density: float | None = None
    json: bool = False


def run(arguments: Sequence[str]) -> int:
    """Run the command and return its exit code."""
    options = parsed(Options, arguments, command="doctor")
    choices = Choices(
        velocity_limit=options.velocity_limit,
        range_limit=options.range_limit,
        density=options.density,
    )
    if options.fix is None:
        if options.force:
            raise SettingsError("--force is for --fix, and there is nothing to write; leave it out, or give --fix OUT.URDF")
        with loading("examining"):
            found = diagnose(options.model, options.srdf, base=options.base, choices=choices)
        print(_as_json(found.as_dict()) if options.json else "\n".join(_report_lines(found)))
        return 0 if found.healthy else 1
    with loading("mending"):
        mended = mend_urdf(
            options.model,
            options.fix,
            srdf=options.srdf,
            base=options.base,
            choices=choices,
            overwrite=options.force,
        )
    print(_as_json(mended.as_dict()) if options.json else "\n".join(_copy_lines(mended)))
    return 0 if mended.after.healthy else 1


def _as_json(values: dict[str, object]) -> str:
    return json.dumps({"spacearm-diagnosis": 1, "version": version(), **values}, indent=2, allow_nan=False)


def _report_lines(found: Diagnosis) -> Iterator[str]:
    yield _headline(found)
    yield ""
    yield from _findings(found)
    mendable = len(found.mendable)
    advice = f"; --fix OUT.urdf mends {'it' if mendable == len(found.findings) == 1 else f'{mendable} of them'}"
    yield f"{_counted(found)}{advice if mendable else ''}"


def _copy_lines(mended: Mended) -> Iterator[str]:
    yield _headline(mended.before)
    yield ""
    if mended.changes:
        yield f"mended, by the lines of {mended.before.source}:"
        moved = [change for change in mended.changes if change.code == "mesh-moved"]
        for change in mended.changes:
            if change not in moved[1:]:
                yield from _wrapped(f"{_line(change.line)}{change.place}: {change.what}", "  ", "      ")
        if len(moved) > 1:
            yield f"  and so {_many(len(moved) - 1, 'other mesh', 'other meshes')}"
    else:
        yield "nothing could be mended"
    yield ""
    if mended.after.findings:
        yield f"left, by the lines of {mended.output}:"
        yield ""
        yield from _findings(mended.after)
    yield f"before: {_counted(mended.before)}"
    yield f"after:  {_counted(mended.after)}"
    yield f"written: {mended.output}"


def _headline(found: Diagnosis) -> str:
    parts = [f"{_many(found.links, 'link')}", f"{_many(found.joints, 'joint')}, {found.moving} of them moving"]
    if found.mass is None:
        parts.append("no masses")
    else:
        base = f", the base {found.base_mass:.4g} kg" if found.base_mass is not None else ""
        parts.append(f"{found.mass:.4g} kg{base}")
    return f"{found.name or 'a robot without a name'} ({found.source}): {'; '.join(parts)}"


def _findings(found: Diagnosis) -> Iterator[str]:
    """Tell what was found, those of one kind together."""
    kinds: dict[tuple[str, str], list[Finding]] = {}
    for finding in found.findings:
        kinds.setdefault((finding.severity, finding.code), []).append(finding)
    for (severity, code), same in kinds.items():
        yield f"{painted(severity, _TONES[severity])}: {code}" + (f" ({len(same)})" if len(same) > 1 else "")
        shared = {name: _shared(same, name) for name in ("what", "value", "expected", "advice")}
        if shared["what"] and len(same) > 1:
            yield from _wrapped(shared["what"], "  ", "  ")
        for finding in same[:_LISTED]:
            said = f"{_line(finding.line, finding.file if finding.file != found.source else '')}{finding.place}"
            if not (shared["what"] and len(same) > 1):
                said += f": {finding.what}" if finding.place else finding.what
            yield from _wrapped(said, "  ", "      ")
            for name, title in (("value", "is"), ("expected", "expected"), ("advice", "mend")):
                if getattr(finding, name) and not (shared[name] and len(same) > 1):
                    yield from _wrapped(getattr(finding, name), f"      {title.ljust(10)}", " " * 16)
        if len(same) > _LISTED:
            yield f"  ... and {len(same) - _LISTED} more; --json lists them all"
        for name, title in (("value", "is"), ("expected", "expected"), ("advice", "mend")):
            if shared[name] and len(same) > 1:
                yield from _wrapped(shared[name], f"      {title.ljust(10)}", " " * 16)
        mendable = sum(finding.mendable for finding in same)
        if mendable:
            share = "" if mendable == len(same) else f" for {mendable} of them"
            yield f"      --fix     does it{share}"
        yield ""


def _shared(same: Sequence[Finding], name: str) -> str:
    values = {getattr(finding, name) for finding in same}
    return values.pop() if len(values) == 1 else ""


def _line(line: int | None, file: str = "") -> str:
    where = f"{Path(file).name} " if file else ""
    return f"{where}line {line}  " if line is not None else f"{where} " if where else ""


def _wrapped(text: str, first: str, others: str) -> list[str]:
    width = max(shutil.get_terminal_size().columns, 60) if sys.stdout.isatty() else 120
    return textwrap.wrap(
        text, width, initial_indent=first, subsequent_indent=others, break_long_words=False, break_on_hyphens=False
    )


def _counted(found: Diagnosis) -> str:
    counts = ((len(found.errors), "error"), (len(found.warnings), "warning"), (len(found.notes), "note"))
    text = ", ".join(_many(count, name) for count, name in counts if count) or "nothing to remark"
    return f"{text}: healthy" if found.healthy else text


def _many(count: int, name: str, several: str = "") -> str:
    return f"{count} {name if count == 1 else several or name + 's'}"
