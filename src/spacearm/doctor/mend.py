"""A corrected copy of a URDF: what can be mended is, comments and order stay as they were."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Any

from spacearm.core.checks import shown
from spacearm.core.errors import OutputError
from spacearm.core.output import require_path, write_atomically, write_new
from spacearm.core.reading import read_bytes
from spacearm.doctor.diagnosis import Change, Choices, Mended, line_of, place_of
from spacearm.doctor.examination import Base, examined, urdf_root
from spacearm.doctor.shape_checks import mesh_path
from spacearm.geometry.meshes import is_binary_stl, read_mesh, stl_of
from spacearm.robot.robot_xml import repaired

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

    A mesh that becomes a collision shape is written anew as binary STL beside the copy, unless it is STL or OBJ there already:
    MuJoCo reads no others, and looks for them nowhere else.

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
    (root, repairs), choices = urdf_root(content, path), choices or Choices()
    chart, before = examined(root, source, srdf, base, choices, repairs=repairs)
    changes: list[Change] = []
    done: set[tuple[Any, str]] = set()  # a remedy that does not help is not given again
    for _ in range(_ROUNDS):
        able = [case for case in chart.cases if case.remedy is not None and _is_inside(case.element, root)]
        able = [case for case in able if (case.element, case.finding.code) not in done]
        done.update((case.element, case.finding.code) for case in able)
        for case in able:
            assert case.remedy is not None
            line, place = case.finding.line, case.finding.place
            changes.append(Change(line=line, place=place, code=case.finding.code, what=case.remedy()))
        if not able:
            break
        chart, _ = examined(root, source, srdf, base, choices, touching=False)
    changes += _written_meshes(root, changes, source.parent, target, overwrite=overwrite)
    if target.resolve().parent != source.resolve().parent:
        changes += _moved_meshes(root, source.parent, target)
    xml = _as_before(_start_of_repaired(content) if repairs else content, root, crlf=b"\r\n" in content)
    write = write_atomically if overwrite else write_new
    write(target, xml)
    _, after = examined(urdf_root(xml, target)[0], target, srdf, base, choices)
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


def _start_of_repaired(content: bytes) -> bytes:
    """Return a file whose XML had to be put right as it is now, with a declaration of its own."""
    again = repaired(content)
    assert again is not None
    body = again[0].lstrip(b"\n")
    return (b'<?xml version="1.0" encoding="utf-8"?>\n' if b"<?xml" in content[:1000] else b"") + body


def _is_inside(element: Any, root: Any) -> bool:
    """Whether an element is still in the tree: another remedy may have taken it out."""
    while element is not None and element is not root:
        element = element.getparent()
    return element is not None


def _written_meshes(root: Any, changes: list[Change], directory: Path, target: Path, *, overwrite: bool) -> list[Change]:
    """Write the meshes of collision shapes that were copied from visual ones where, and as what, every reader takes them."""
    made = {change.place for change in changes if change.code == "collision-missing"}
    written = []
    for mesh in root.iterfind("link/collision/geometry/mesh"):
        path = mesh_path(mesh, directory) if place_of(mesh) in made else None
        if path is None or _as_others_read(path, target):
            continue
        link = mesh.getparent().getparent().getparent()
        number = link.findall("collision").index(mesh.getparent().getparent())
        name = re.sub(r"[^\w.-]", "_", f"{target.stem}_{link.get('name')}{f'_{number}' if number else ''}")
        file = _written_mesh(target.parent, name, stl_of(read_mesh(path).triangles), overwrite=overwrite)
        what = f"<mesh filename>: {mesh.get('filename')!r} -> {file!r}, written in metres as STL, which MuJoCo reads too"
        mesh.set("filename", file)
        written.append(Change(line=line_of(mesh), place=place_of(mesh), code="mesh-written", what=what))
    return written


def _as_others_read(path: Path, target: Path) -> bool:
    """Whether MuJoCo, too, finds and reads a mesh: it takes OBJ and binary STL, and looks for them beside the model."""
    if path.resolve().parent != target.resolve().parent:
        return False
    return path.suffix.lower() == ".obj" or (path.suffix.lower() == ".stl" and is_binary_stl(path.read_bytes()))


def _written_mesh(folder: Path, name: str, content: bytes, *, overwrite: bool) -> str:
    """Write a mesh under a name that is free, or where the same is already; return the file's name."""
    for i in range(1, 1000):
        file = folder / f"{name}{f'-{i}' if i > 1 else ''}.stl"
        if file.exists() and not overwrite and file.read_bytes() != content:
            continue
        write_atomically(file, content)
        return file.name
    raise OutputError(f"{folder / name}.stl and 998 like it exist, expected a name that is free; remove them")


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


def _as_before(content: bytes, root: Any, *, crlf: bool) -> bytes:
    """Write the tree, and before it what stood there, byte by byte: its comments and the line of its version."""
    from lxml import etree  # pyright: ignore[reportAttributeAccessIssue] (compiled, no stubs)

    start = _BEFORE_ROOT.match(content)
    after = b"".join(b"\n" + etree.tostring(node, encoding="utf-8", with_tail=False) for node in root.itersiblings())
    if start is None or not content[start.end() :].startswith(b"<robot") or _OTHER_ENCODING.search(start.group()):
        declared = content.lstrip(b"\xef\xbb\xbf \t\r\n").startswith(b"<?xml")
        return etree.tostring(root.getroottree(), encoding="utf-8", xml_declaration=declared) + b"\n"
    body = etree.tostring(root, encoding="utf-8", with_tail=False)
    end = b"\r\n" if crlf else b"\n"  # XML knows only the second
    return start.group().replace(b"\r\n", b"\n").replace(b"\n", end) + (body + after + b"\n").replace(b"\n", end)
