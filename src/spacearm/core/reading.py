"""Files from outside: read whole, checked against a model, and refused in one sentence that names file and
line.

YAML is read by the core schema of YAML 1.2: `1e-3` is a number, `yes` is a word and `010` is ten, each of
which PyYAML's default takes differently. A key given twice is refused.

The parser is PyYAML's with libyaml, under a table of our own that says what a plain word means. ruamel.yaml reads YAML 1.2 and
knows lines, but its parser that does is written in Python: on 60 scenes of MotionBenchMaker (0.84 MB) it took 4.3 s where this
takes 0.57 s, on a mesh of 0.56 MB 2.2 s and 0.22 s; with libyaml, which then tells no lines, 0.93 s and 0.64 s.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from spacearm.core.checks import shown
from spacearm.core.errors import FileFormatError, SpacearmError, nearest

if TYPE_CHECKING:
    from pydantic import BaseModel, ValidationError
    from pydantic_core import ErrorDetails

    Model = TypeVar("Model", bound=BaseModel)

Place = tuple[str | int, ...]
"""Where in a file: keys and list positions from the root."""

_VERSION = 1
_DEEPEST = 100  # levels of nesting
_LFS = b"version https://git-lfs.github.com/spec/"
LFS_ADVICE = "run `git lfs pull` in its repository"
"""What to do about a file that is a Git LFS pointer."""
_MOST = 100_000  # values, written out, of a file that mostly repeats itself by aliases

_FOREIGN = (
    (
        "a MoveIt planning scene",
        {"world", "fixed_frame_transforms", "allowed_collision_matrix", "robot_model_name"},
    ),
    ("a MoveIt planning request", {"goal_constraints", "start_state", "workspace_parameters", "group_name"}),
    ("a spacearm robot", {"spacearm-robot"}),
    ("a spacearm problem", {"spacearm"}),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class YamlFile:
    """A YAML mapping, and where in its file each part of it stands."""

    path: Path
    value: dict[str, Any]
    root: Any

    def where(self, place: Place) -> str:
        """Name a place for a message: the path, and the line of the deepest part of the place that exists."""
        import yaml

        node, line = self.root, None
        for part in place:
            if isinstance(node, yaml.MappingNode):
                pairs = [(key, value) for key, value in node.value if key.value == str(part)]
                if not pairs:
                    break
                line, node = pairs[0][0].start_mark.line + 1, pairs[0][1]
            elif isinstance(node, yaml.SequenceNode) and isinstance(part, int) and part < len(node.value):
                node = node.value[part]
                line = node.start_mark.line + 1
            else:
                break
        return f"{self.path}" if line is None else f"{self.path}: line {line}"

    @contextmanager
    def at(self, *place: str | int) -> Iterator[None]:
        """Put the file and line before the message of whatever is raised inside."""
        with located(self.where(place)):
            yield

    def parsed(self, model: type[Model]) -> Model:
        """Check the mapping against a pydantic model.

        Raises:
            FileFormatError: it does not fit; the first place that does not is named.
        """
        from pydantic import ValidationError

        try:
            return model.model_validate(self.value)
        except ValidationError as error:
            place, sentence = complaint(error)
            raise FileFormatError(f"{self.where(place)}: {sentence}") from None


@contextmanager
def located(place: object) -> Iterator[None]:
    """Put a place, as in a path, before the message of whatever is raised inside."""
    try:
        yield
    except SpacearmError as error:
        raise type(error)(f"{place}: {error}") from None


def read_bytes(path: str | os.PathLike[str], *, what: str) -> bytes:
    """Read a file that must not be empty.

    Args:
        path: the file.
        what: what it should hold, for messages, as in "a problem file".

    Raises:
        FileFormatError: it is missing, a directory, unreadable or empty.
    """
    if not isinstance(path, (str, os.PathLike)):
        raise FileFormatError(f"path is {shown(path)}, expected the path of {what} (a str or a Path)")
    try:
        content = Path(path).read_bytes()
    except FileNotFoundError:
        raise FileFormatError(f"{path} does not exist, expected {what}; check the path") from None
    except IsADirectoryError:
        raise FileFormatError(f"{path} is a directory, expected {what}; name the file inside it") from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise FileFormatError(f"{shown(str(path))} cannot be read ({reason}), expected {what}; check the path") from None
    if not content.strip():
        raise FileFormatError(f"{path} is empty, expected {what}")
    if is_lfs_pointer(content):
        raise FileFormatError(f"{path} is a Git LFS pointer, not the file itself, expected {what}; {LFS_ADVICE}")
    return content


def is_lfs_pointer(content: bytes) -> bool:
    """Whether a file is what Git leaves in the place of one that is kept by LFS and was not fetched."""
    return content.lstrip(b"\xef\xbb\xbf \t\r\n").startswith(_LFS)


def read_yaml(path: str | os.PathLike[str], *, key: str, what: str) -> YamlFile:
    """Read a YAML mapping that names its format, as in ``spacearm: 1``.

    Args:
        path: the file.
        key: the key that names the format; its value is the version.
        what: what the file should hold, for messages.

    Raises:
        FileFormatError: no such file, no YAML, not a mapping, another format or another version.
    """
    value, root = _composed(read_text(path, what=what), path, what)
    if not isinstance(value, dict):
        raise FileFormatError(f"{path} holds {shown(value)}, expected {what}: a mapping that begins with '{key}: {_VERSION}'")
    _require_format(value, path, key, what)
    return YamlFile(path=Path(path), value=value, root=root)


def read_text(path: str | os.PathLike[str], *, what: str) -> str:
    """Read a file of UTF-8 text that is not XML.

    Raises:
        FileFormatError: no such file, or another kind of file.
    """
    content = read_bytes(path, what=what)
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise FileFormatError(
            f"{path} is not text (byte {error.start} is no UTF-8), expected {what} in YAML; check the path"
        ) from None
    if "\0" in text:
        raise FileFormatError(f"{path} is binary, expected {what} in YAML; check the path")
    if text.lstrip().startswith("<"):
        raise FileFormatError(f"{path} is XML (a URDF?), expected {what} in YAML; check the path")
    return text


def yaml_documents(path: str | os.PathLike[str], *, what: str) -> list[Any]:
    """Read a YAML file that may hold several documents, parted by lines of ---; those without content are left out.

    Raises:
        FileFormatError: no such file, or no YAML.
    """
    parts, lines = [""], read_text(path, what=what).splitlines()
    for line in lines:
        if re.match(r"---(\s|$)", line):
            parts.append(line[3:] + "\n")
        else:
            parts[-1] += line + "\n"
    values = [_composed(part, path, what)[0] for part in parts if part.strip()]
    return [value for value in values if value is not None]


def yaml_of_others(text: str, path: str | os.PathLike[str], *, key: str, what: str) -> YamlFile:
    """Read a YAML mapping in a format of others, which is known by a key that it must have.

    Args:
        text: the file's text.
        path: the file.
        key: what the format is known by.
        what: what the file should hold, for messages.

    Raises:
        FileFormatError: no YAML, not a mapping, or no such key.
    """
    value, root = _composed(text, path, what)
    if not isinstance(value, dict):
        raise FileFormatError(f"{path} holds {shown(value)}, expected {what}: a mapping with the key '{key}'")
    if key not in value:
        foreign = _foreign(value)
        looks = f" looks like {foreign}" if foreign not in (None, what) else f" has no key '{key}'"
        raise FileFormatError(f"{path}{looks}, expected {what}, which has the key '{key}'")
    return YamlFile(path=Path(path), value=value, root=root)


def require_known_keys(given: Any, known: list[str]) -> None:
    """Refuse a mapping with a key that is not known, inside a pydantic validator.

    Raises:
        PydanticCustomError: the key, and the nearest known one.
    """
    from pydantic_core import PydanticCustomError

    if isinstance(given, Mapping):
        for key in given:
            if key not in known:
                # The sentence goes as a value, since a brace in a key would be taken for a placeholder.
                sentence = f"key {shown(key)} is not known; {nearest(str(key), known)}"
                raise PydanticCustomError("unknown_key", "{sentence}", {"sentence": sentence, "key": str(key)})


def _composed(text: str, path: Any, what: str) -> tuple[Any, Any]:
    import yaml

    quickly = _composed_in_c(text)
    if quickly is not None:
        return quickly
    loader = None
    try:
        loader = _loader_class()(text)
        root = loader.get_single_node()
        if _is_bomb(root):
            raise yaml.YAMLError(f"its aliases (*) stand for more than {_MOST:,} values")
        return (None, None) if root is None else (loader.construct_document(root), root)
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        place = f"{path}: line {mark.line + 1}" if mark else f"{path}"
        problem = getattr(error, "problem", None) or str(error).splitlines()[0]
        if problem.startswith("but "):
            problem = f"{getattr(error, 'context', '')}, {problem}"
        raise FileFormatError(f"{place}: {' '.join(problem.split())}, expected {what} in YAML; correct the file") from None
    except RecursionError:
        raise FileFormatError(f"{path} is nested too deeply, expected {what} in YAML") from None
    except Exception:  # whatever else PyYAML's constructors let through, as the KeyError of "!!bool maybe"
        raise FileFormatError(
            f"{path} holds a value that cannot be read, expected {what} in YAML; "
            "look for tags (!!) and for numbers of thousands of digits"
        ) from None
    finally:
        if loader is not None:
            loader.dispose()


def _composed_in_c(text: str) -> tuple[Any, Any] | None:
    """Read quickly what has nothing wrong with it; None where the slow way is to say what is, or where there is no libyaml."""
    import yaml

    if not yaml.__with_libyaml__:
        return None
    try:
        # Composing is recursive in C, where too deep a nesting ends the process; the events are not.
        depth, aliases = 0, False
        for event in yaml.parse(text, Loader=_loader_class(quick=True)):
            if isinstance(event, yaml.CollectionStartEvent):
                depth += 1
                if depth > _DEEPEST:
                    return None
            elif isinstance(event, yaml.CollectionEndEvent):
                depth -= 1
            aliases = aliases or isinstance(event, yaml.AliasEvent)
        loader = _loader_class(quick=True)(text)
        root = loader.get_single_node()
        if aliases and _is_bomb(root):
            return None
        return (None, None) if root is None else (loader.construct_document(root), root)
    except Exception:  # whatever it is, the slow way has the sentence
        return None


def _is_bomb(root: Any) -> bool:
    """Whether the aliases of a small file stand for more values than anyone could have meant."""
    known: dict[int, int] = {}
    return _written_out(root, known) > max(_MOST, 10 * len(known))


def _written_out(node: Any, known: dict[int, int]) -> int:
    """Count the values below a node as if every alias were written out; what contains itself counts once there."""
    if id(node) in known:
        return known[id(node)]
    known[id(node)] = 1
    inner = getattr(node, "value", None)
    if isinstance(inner, list):
        parts = [part for item in inner for part in (item if isinstance(item, tuple) else (item,))]
        known[id(node)] += sum(_written_out(part, known) for part in parts)
    return known[id(node)]


@cache
def _loader_class(*, quick: bool = False) -> Any:
    import yaml

    base: Any = yaml.CSafeLoader if quick else yaml.SafeLoader

    class Loader(base):
        """Reads the core schema of YAML 1.2 and refuses a key given twice."""

        def construct_mapping(self, node: Any, deep: bool = False) -> Any:
            seen = set()
            for key, _ in node.value if isinstance(node, yaml.MappingNode) else ():
                if isinstance(key, yaml.ScalarNode) and key.tag != "tag:yaml.org,2002:merge":
                    if (key.tag, key.value) in seen:
                        raise yaml.constructor.ConstructorError(None, None, f"key '{key.value}' is given twice", key.start_mark)
                    seen.add((key.tag, key.value))
            return super().construct_mapping(node, deep)

    Loader.yaml_implicit_resolvers = {}
    tag = "tag:yaml.org,2002:"
    for name, pattern, first in (
        ("bool", r"true|True|TRUE|false|False|FALSE", "tTfF"),
        ("int", r"[-+]?(?:0|[1-9][0-9]*)", "-+0123456789"),
        ("float", r"[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?", "-+.0123456789"),
        ("float", r"[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN)", "-+."),
        ("null", r"~|null|Null|NULL|", ["~", "n", "N", ""]),
        ("merge", r"<<", "<"),
    ):
        Loader.add_implicit_resolver(tag + name, re.compile(rf"^(?:{pattern})$"), list(first))
    return Loader


def require_version(given: Any, known: int, path: object, *, key: str) -> None:
    """Refuse a format's version that this release does not read.

    Args:
        given: what the file states.
        known: the newest version that is read.
        path: of the file, for the message.
        key: under which the version stands.

    Raises:
        FileFormatError: no whole number from 1 to the known one.
    """
    if isinstance(given, bool) or not isinstance(given, int) or given < 1:
        raise FileFormatError(f"{path} has {key}: {shown(given)}, expected the format's version, {known}; correct it")
    if given > known:
        raise FileFormatError(
            f"{path} has {key}: {given}, expected at most {known}: a newer release of spacearm wrote it; update spacearm"
        )


def _require_format(value: dict[Any, Any], path: Any, key: str, what: str) -> None:
    if key not in value:
        foreign = _foreign(value)
        looks = f" looks like {foreign}" if foreign else f" has no key '{key}'"
        raise FileFormatError(f"{path}{looks}, expected {what}, which begins with '{key}: {_VERSION}'")
    require_version(value[key], _VERSION, path, key=key)


def _foreign(value: dict[Any, Any]) -> str | None:
    return next((name for name, keys in _FOREIGN if keys & value.keys()), None)


_EXPECTED = {
    "float_type": "a number",
    "finite_number": "a finite number",
    "int_type": "a whole number",
    "bool_type": "true or false",
    "string_type": "text",
    "list_type": "a list",
    "tuple_type": "a list",
    "dict_type": "a mapping (key: value)",
    "model_type": "a mapping (key: value)",
    "model_attributes_type": "a mapping (key: value)",
    "recursion_loop": "a value that does not contain itself",
}


def complaint(error: ValidationError, within: str = "") -> tuple[Place, str]:
    """Say in our words what pydantic found wrong first.

    Args:
        error: what it raised.
        within: what a message calls the value that was checked; "": it has no name.

    Returns:
        The place in the file, and a sentence.
    """
    found = error.errors(include_url=False)
    # Where a value may have several forms, the form that was meant is the one whose error lies deepest.
    detail = max(found, key=lambda detail: len(detail["loc"]))
    # pydantic's place also names the form of a union that was tried, which is no place in the file.
    place = tuple(part for part in detail["loc"] if not str(part).startswith(("list[", "dict[")))
    key = detail.get("ctx", {}).get("key")
    return place if key is None else (*place, key), _sentence(detail, place, within)


def _sentence(detail: ErrorDetails, place: Place, within: str) -> str:
    kind, called, given = detail["type"], _called(place, within), shown(detail["input"])
    if kind == "missing":
        inside = _called(place[:-1], within)
        return f"key '{place[-1]}' is missing{f' in {inside}' if inside else ''}; add it"
    if kind == "sentence":
        return detail["msg"]
    if kind == "form":
        return f"{called} is {given}, expected {detail['msg']}"
    if kind in ("too_short", "too_long"):
        context = detail.get("ctx", {})
        wanted = context.get("min_length", context.get("max_length"))
        return f"{called} has {context.get('actual_length')} entries, expected {wanted}"
    if kind in _EXPECTED:
        return f"{called or 'it'} is {given}, expected {_EXPECTED[kind]}"
    if kind == "literal_error":
        return f"{called} is {given}, expected {detail.get('ctx', {}).get('expected')}"
    return f"{called}: {detail['msg']}" if called else detail["msg"]


def _called(place: Place, within: str) -> str:
    return within + "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in place).lstrip(
        "" if within else "."
    )
