"""The text of a problem file with some values changed: comments, order and all other values stay as they are.

An edit sets keys of one mapping. It replaces the text of a value in place. Where that does not lead to the values that are
meant, as with aliases, the whole file is written anew from its values, without comments.
"""

from __future__ import annotations

import itertools
import json
import math
import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from spacearm.core.errors import OutputError
from spacearm.core.reading import Place, YamlFile


@dataclass(frozen=True, slots=True, kw_only=True)
class Edit:
    """New values in a mapping of a file.

    Attributes:
        place: of the mapping: keys and positions from the root.
        values: by key.
        drops: keys that the new ones replace.
    """

    place: Place
    values: dict[str, Any]
    drops: tuple[str, ...] = ()


def spliced(file: YamlFile, text: str, edits: Sequence[Edit]) -> str | None:
    """Return the text with the edits in it; None where a place is not a mapping, or is written twice by an alias."""
    changes: list[tuple[int, int, str]] = []
    for edit in edits:
        node = _node_at(file.root, edit.place)
        if node is None or not hasattr(node, "flow_style") or not isinstance(node.value, list):
            return None
        changes += _changes(node, text, edit)
    changes.sort()
    if any(end > begin for (_, end, _), (begin, _, _) in itertools.pairwise(changes)):
        return None
    for begin, end, words in reversed(changes):
        text = text[:begin] + words + text[end:]
    return text


def written(value: dict[str, Any], edits: Sequence[Edit]) -> str:
    """Return a file with the edited values, written anew.

    Raises:
        OutputError: a place that is no mapping.
    """
    edited = _apart(value)
    for edit in edits:
        inner: Any = edited
        for part in edit.place:
            inner = inner[part]
        if not isinstance(inner, dict):
            raise OutputError(f"the problem file has no mapping at {'.'.join(map(str, edit.place))}, expected one; write it so")
        for key in edit.drops:
            inner.pop(key, None)
        inner.update(edit.values)
    return dumped(edited)


def _apart(value: Any) -> Any:
    """Return a copy in which no two places are the same object, as those of an alias are."""
    if isinstance(value, dict):
        return {key: _apart(entry) for key, entry in value.items()}
    return [_apart(entry) for entry in value] if isinstance(value, list) else value


def dumped(value: dict[str, Any]) -> str:
    """Return plain values as YAML: one key of the file a line, lists and mappings below on one line each."""
    lines: list[str] = []
    for key, entry in value.items():
        if isinstance(entry, list) and entry and all(isinstance(one, dict) for one in entry):
            lines += [f"{_key(key)}:", *(f"  - {flow(one)}" for one in entry)]
        else:
            lines.append(f"{_key(key)}: {flow(entry)}")
    return "\n".join(lines) + "\n"


def flow(value: Any) -> str:
    """Return a plain value on one line, as YAML 1.2 and JSON have it; numbers with all their digits."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{_key(key)}: {flow(entry)}" for key, entry in value.items()) + "}"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(map(flow, value)) + "]"
    if isinstance(value, float) and not math.isfinite(value):
        return ".nan" if math.isnan(value) else ".inf" if value > 0 else "-.inf"
    return _quoted(value) if isinstance(value, str) else json.dumps(value)


def _quoted(text: str) -> str:
    """Return text in double quotes, whatever is in it."""
    out: list[str] = []
    for c in text:
        code = ord(c)
        plain = c.isprintable() and c not in '"\\'
        out.append(c if plain else f"\\x{code:02x}" if code < 256 else f"\\u{code:04x}" if code < 65536 else f"\\U{code:08x}")
    return f'"{"".join(out)}"'


def _key(key: Any) -> str:
    return key if isinstance(key, str) and key.isidentifier() and key.lower() not in ("true", "false", "null") else flow(key)


def _node_at(root: Any, place: Place) -> Any:
    node = root
    for part in place:
        inner = getattr(node, "value", None)
        if not isinstance(inner, list):
            return None
        if isinstance(part, int):
            node = inner[part] if part < len(inner) and not isinstance(inner[part], tuple) else None
        else:
            node = next((value for key, value in _pairs(node) if key.value == part), None)
        if node is None:
            return None
    return node


def _pairs(node: Any) -> Iterator[tuple[Any, Any]]:
    yield from (pair for pair in node.value if isinstance(pair, tuple))


def _changes(node: Any, text: str, edit: Edit) -> Iterator[tuple[int, int, str]]:
    """Yield what to put into the text, and in place of what: (begin, end, words)."""
    known = {key.value: (key, value) for key, value in _pairs(node)}
    dropped = [known[key] for key in edit.drops if key in known]
    added: list[str] = []
    for name, entry in edit.values.items():
        if name in known:
            value = known[name][1]
            yield value.start_mark.index, _end(value), flow(entry)
        elif dropped:
            key, value = dropped.pop(0)
            yield key.start_mark.index, _end(value), f"{name}: {flow(entry)}"
        else:
            added.append(f"{name}: {flow(entry)}")
    if added:
        yield _room_behind(node, text, added)


def _room_behind(node: Any, text: str, added: list[str]) -> tuple[int, int, str]:
    """Return where further pairs go: behind the last one."""
    pairs = list(_pairs(node))
    if not pairs:
        return node.start_mark.index, node.end_mark.index, "{" + ", ".join(added) + "}"
    at = _end(pairs[-1][1])
    if node.flow_style:
        return at, at, "".join(f", {words}" for words in added)
    line = text.find("\n", at)
    at = len(text) if line < 0 else line  # behind a comment on the same line
    indent = " " * pairs[0][0].start_mark.column
    return at, at, "".join(f"\n{indent}{words}" for words in added)


def _end(node: Any) -> int:
    """Return where a node ends in its text; the end that a block has for the parser is that of the blank lines behind it."""
    inner = node.value
    if isinstance(inner, list) and inner and not node.flow_style:
        last = inner[-1]
        return _end(last[1] if isinstance(last, tuple) else last)
    return node.end_mark.index


# ---- Files that a problem file names, relative to itself ----------------------------------------------------------------


def moved_paths(value: dict[str, Any], before: Path, after: Path) -> list[Edit]:
    """Return the edits that make a problem file in another folder name the same files.

    Args:
        value: what the file holds.
        before: the folder of the file.
        after: the folder that it is written to.
    """
    if before.resolve() == after.resolve():
        return []
    edits: list[Edit] = []

    def moved(place: Place, holder: Any, key: str) -> None:
        name = holder.get(key) if isinstance(holder, dict) else None
        if isinstance(name, str) and not Path(name).is_absolute() and not name.startswith("~"):
            edits.append(Edit(place=place, values={key: relative_to(before / name, after)}))

    robot = value.get("robot")
    if isinstance(robot, str):
        moved((), value, "robot") if _looks_like_a_path(robot) else None
    elif isinstance(robot, dict):
        for key in ("file", "srdf", "joint_limits"):
            moved(("robot",), robot, key)
        if _looks_like_a_path(robot.get("name")):
            moved(("robot",), robot, "name")
        for i, held in enumerate(robot.get("holding") or ()):
            for kind in ("mesh", "points"):
                moved(("robot", "holding", i, kind), held.get(kind), "file")
    for i, item in enumerate(value.get("scene") or ()):
        for kind in ("mesh", "points", "moveit"):
            if isinstance(item.get(kind), str):
                moved(("scene", i), item, kind)
            else:
                moved(("scene", i, kind), item.get(kind), "file")
    return edits


def relative_to(path: Path, folder: Path) -> str:
    """Return the path of a file as one relative to a folder."""
    try:
        return Path(os.path.relpath(path.resolve(), folder.resolve())).as_posix()
    except ValueError:  # another drive of Windows
        return path.resolve().as_posix()


def _looks_like_a_path(name: Any) -> bool:
    return isinstance(name, str) and (bool(Path(name).suffix) or "/" in name)
