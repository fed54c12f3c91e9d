"""A corrected copy of a URDF: what can be mended is, comments and order stay as they were."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Any

from spacearm.checks import shown
from spacearm.errors import OutputError
from spacearm.output import require_path, write_atomically, write_new
from spacearm.reading import read_bytes
from spacearm.robot.doctor.chart import Choices, line_of, place_of
from spacearm.robot.doctor.diagnosis import Change, Mended
from spacearm.robot.doctor.examine import Base, examined, urdf_root
from spacearm.robot.doctor.shapes import mesh_path

_BEFORE_ROOT = re.compile(rb"(?:\xef\xbb\xbf)?(?:\s+|<\?.*?\?>|<!--.*?-->)*", re.DOTALL)
_OTHER_ENCODING = re.compile(rb"<\?xml[^>]*encoding\s*=\s*[\"'](?!utf-?8|us-ascii)", re.IGNORECASE)
_ROUNDS = 5  # one remedy may bring to light what another one mends


def mend_urdf(
    path: str | os.PathLike[str],
    output: str | os.PathLike[str],
    *,
    srdf: str | os.PathLike[str] | None = None,
    base: Base | None = None,
    choices: Choices | None = None,
    overwrite: bool = False,
) -> Mended:
    """Write a corrected copy of a URDF, and say what was changed and what is left.

    Names, numbers and units that are plainly meant otherwise are put right; what cannot be known is chosen with care
    (`Choices`), which each change says. Paths of meshes are rewritten where the copy lies in another directory.

    Args:
        path, srdf, base: as in `diagnose`.
        output: the copy.
        choices: what to write where nothing is stated.
        overwrite: replace a file that is there; never the input.

    Raises:
        FileFormatError: as in `diagnose`.
        OutputError: the copy cannot be written there, or is there already.
    """
    content = read_bytes(path, what="a URDF")
    require_path(output)
    source, target = Path(path), Path(output)
    require_new(source, target, overwrite=overwrite)
    root, choices = urdf_root(content, path), choices or Choices()
    chart, before = examined(root, source, srdf, base, choices)
    changes: list[Change] = []
    for _ in range(_ROUNDS):
        able = [case for case in chart.cases if case.remedy is not None and _is_inside(case.element, root)]
        for case in able:
            line, place = line_of(case.element), place_of(case.element)
            assert case.remedy is not None
            changes.append(Change(line=line, place=place, code=case.finding.code, what=case.remedy()))
        if not able:
            break
        chart, _ = examined(root, source, srdf, base, choices, touching=False)
    if target.resolve().parent != source.resolve().parent:
        changes += _moved_meshes(root, source.parent, target)
    xml = _as_before(content, root)
    write = write_atomically if overwrite else write_new
    write(target, xml)
    _, after = examined(urdf_root(xml, target), target, srdf, base, choices)
    changes.sort(key=lambda change: change.line or 0)
    return Mended(output=str(target), changes=tuple(changes), before=before, after=after)


def require_new(source: Path, target: Path, *, overwrite: bool) -> None:
    """Refuse to write over what is there.

    Raises:
        OutputError: the copy would replace the input, or a file, without being told to.
    """
    try:
        if target.exists() and target.samefile(source):
            raise OutputError(f"{target} is the model itself, which is never written over; choose another name")
        if target.is_dir():
            raise OutputError(f"{target} is a directory, expected a new file; name one inside it")
        if target.exists() and not overwrite:
            raise OutputError(f"{target} exists, expected a new file; choose another name, or force it to be replaced")
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise OutputError(f"{shown(str(target))} cannot be written ({reason}); choose another place") from None


def _is_inside(element: Any, root: Any) -> bool:
    """Whether an element is still in the tree: another remedy may have taken it out."""
    while element is not None and element is not root:
        element = element.getparent()
    return element is not None


def _moved_meshes(root: Any, directory: Path, target: Path) -> list[Change]:
    changes = []
    for mesh in root.iter("mesh"):
        name = mesh.get("filename")
        old = mesh_path(mesh, directory) if name else None
        if old is None:
            continue
        new = mesh_path(mesh, target.parent)
        if new is not None and new.resolve() == old.resolve():
            continue
        relative = Path(os.path.relpath(old.resolve(), target.resolve().parent)).as_posix()
        mesh.set("filename", relative)
        what = f"<mesh filename>: {name!r} -> {relative!r} (seen from the copy's directory)"
        changes.append(Change(line=line_of(mesh), place=place_of(mesh), code="mesh-moved", what=what))
    return changes


def _as_before(content: bytes, root: Any) -> bytes:
    """Write the tree, and before it what stood there, byte by byte: its comments and the line of its version."""
    from lxml import etree  # pyright: ignore[reportAttributeAccessIssue] (compiled, no stubs)

    start = _BEFORE_ROOT.match(content)
    after = b"".join(b"\n" + etree.tostring(node, encoding="utf-8", with_tail=False) for node in root.itersiblings())
    if start is None or not content[start.end() :].startswith(b"<robot") or _OTHER_ENCODING.search(start.group()):
        declared = content.lstrip(b"\xef\xbb\xbf \t\r\n").startswith(b"<?xml")
        return etree.tostring(root.getroottree(), encoding="utf-8", xml_declaration=declared) + b"\n"
    body = etree.tostring(root, encoding="utf-8", with_tail=False)
    end = b"\r\n" if b"\r\n" in content else b"\n"  # XML knows only the second
    return start.group() + (body + after + b"\n").replace(b"\n", end)
