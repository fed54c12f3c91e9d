"""Options made from dataclasses, so that each setting exists once: a field's annotation gives the option its type, its
line under `Attributes:` the help, and its default the default. A field's metadata may name the value ("name") and a short
flag beside the long one ("flag"); a field with neither default nor flag is given by its place.

What cannot be read is refused in one line: the option, the value, what was expected.
"""

from __future__ import annotations

import argparse
import dataclasses
import inspect
import re
import types
import typing
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Literal, NoReturn, TypeVar

from spacearm.checks import shown
from spacearm.errors import SettingsError, nearest

T = TypeVar("T")

_ATTRIBUTE = re.compile(r"^    (\w+): (.+(?:\n {8}.+)*)", re.MULTILINE)
_KINDS = {int: ("N", "a whole number"), float: ("X", "a number"), str: ("NAME", "a name"), Path: ("PATH", "a path")}
_NONE = object()  # a `none` that was written, to tell it from an option left out


def parsed(record: type[T], arguments: Sequence[str], *, command: str, description: str) -> T:
    """Read a command's options into a record; a field that is itself a record is a group of options.

    Raises:
        SettingsError: an option that does not exist, or a value that it does not take.
        SystemExit: help was asked for, and printed.
    """
    options = list(_options(record))
    see = f"see spacearm {command} --help"
    found, unknown = _parser(options, command, description).read(arguments)
    values = {key: value for key, value in vars(found).items() if value is not None}
    unknown = [word for word in unknown if word != "--"]
    if unknown:
        raise SettingsError(f"{_unknown(unknown, options)}; {see}")
    for option in options:
        if option.default is dataclasses.MISSING and option.key not in values:
            raise SettingsError(f"{option.usage} is missing, expected {option.help}; {see}")
    return _made(record, values)


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class _Option:
    """A field as an option: no flags if it is positional; `values` it takes, 0 for a switch and "+" for one or more."""

    group: str
    key: str
    flags: tuple[str, ...]
    name: str
    kind: Any
    values: int | Literal["+"]
    optional: bool
    default: Any
    help: str

    @property
    def usage(self) -> str:
        """How it is written, as in "-o FOLDER"."""
        values = [self.name, "..."] if self.values == "+" else [self.name] * self.values
        return " ".join([*self.flags[:1], *values])

    @property
    def help_with_default(self) -> str:
        if self.default is dataclasses.MISSING:
            return f"{self.help} (required)"
        if self.values == 0:
            return f"do not {self.help}" if self.default else self.help
        default = self.default if isinstance(self.default, tuple) else (self.default,)
        return f"{self.help} (default: {' '.join(map(_text, default)) or 'none'})"

    def read(self, text: str) -> Any:
        """Read one value. SettingsError passes through argparse, which catches only Python's own."""
        if self.optional and text.lower() == "none":
            return _NONE
        name = self.flags[-1] if self.flags else self.name
        if typing.get_origin(self.kind) is Literal:
            if text not in typing.get_args(self.kind):
                raise SettingsError(f"{name} is {shown(text)}; {nearest(text, typing.get_args(self.kind))}")
            return text
        try:
            return self.kind(text)
        except ValueError:
            expected = f"{_KINDS[self.kind][1]}{' or none' if self.optional else ''}"
            raise SettingsError(f"{name} is {shown(text)}, expected {expected}") from None


def _options(record: Any, group: str = "options") -> Iterator[_Option]:
    """Yield a record's options, those of its groups after its own."""
    hints, helps = typing.get_type_hints(record), _helps(record)
    fields = dataclasses.fields(record)
    for field in fields:
        if dataclasses.is_dataclass(hints[field.name]):
            continue
        kind, values, optional = _taken(hints[field.name])
        flag = field.metadata.get("flag")
        positional = field.default is dataclasses.MISSING and flag is None
        long = f"--{'no-' if field.default is True else ''}{field.name.replace('_', '-')}"
        yield _Option(
            group=group,
            key=field.name,
            flags=() if positional else (flag, long) if flag else (long,),
            name=field.metadata.get("name") or _name(kind),
            kind=kind,
            values=values,
            optional=optional,
            default=field.default,
            help=helps[field.name],
        )
    for field in fields:
        if dataclasses.is_dataclass(hints[field.name]):
            yield from _options(hints[field.name], helps[field.name])


def _helps(record: Any) -> dict[str, str]:
    """Return what the docstring says of each field, without the full stop."""
    attributes = (inspect.getdoc(record) or "").partition("Attributes:\n")[2]
    said = {key: " ".join(text.split()).rstrip(".") for key, text in _ATTRIBUTE.findall(attributes)}
    return {field.name: said.get(field.name, "") for field in dataclasses.fields(record)}


def _taken(hint: Any) -> tuple[Any, int | Literal["+"], bool]:
    """Return the type of an option's values, how many it takes, and whether it may be none."""
    forms = typing.get_args(hint)
    if typing.get_origin(hint) in (typing.Union, types.UnionType):
        kind, values, _ = _taken(next(form for form in forms if form is not type(None)))
        return kind, values, True
    if typing.get_origin(hint) is tuple:
        return forms[0], "+" if forms[-1] is Ellipsis else len(forms), False
    return hint, 0 if hint is bool else 1, False


def _text(default: Any) -> str:
    return "none" if default is None else f"{default:g}" if isinstance(default, float) else str(default)


def _name(kind: Any) -> str:
    if typing.get_origin(kind) is Literal:
        return "{" + ",".join(typing.get_args(kind)) + "}"
    return _KINDS[kind][0] if kind in _KINDS else ""


class _Parser(argparse.ArgumentParser):
    """Raises one line where argparse would print the usage and leave."""

    options: Mapping[str, _Option]

    def read(self, arguments: Sequence[str]) -> tuple[argparse.Namespace, list[str]]:
        """Return what the options were given, and the words that belong to none."""
        try:
            return self.parse_known_args(list(arguments))
        except argparse.ArgumentError as error:
            option = self.options.get((error.argument_name or "").split("/")[0])
            if option is None:
                self.error(str(error))
            if option.values == 0:
                raise SettingsError(f"{option.usage} takes no value, expected it alone; leave the value out") from None
            raise SettingsError(f"{option.flags[-1]} has too few values, expected {option.usage}") from None

    def error(self, message: str) -> NoReturn:
        raise SettingsError(message)


def _parser(options: Sequence[_Option], command: str, description: str) -> _Parser:
    needed = [option.usage for option in options if option.default is dataclasses.MISSING]
    parser = _Parser(
        usage=" ".join([f"spacearm {command}", *needed, "[options]"]),
        description=description,
        add_help=False,
        allow_abbrev=False,
        exit_on_error=False,
        formatter_class=lambda prog: argparse.HelpFormatter(prog, max_help_position=26),
    )
    parser.options = {option.flags[0]: option for option in options if option.flags}
    groups = {title: parser.add_argument_group(title) for title in dict.fromkeys(option.group for option in options)}
    for option in options:
        details: dict[str, Any] = {"help": option.help_with_default.replace("%", "%%")}
        if option.values == 0:
            details |= {"action": "store_false" if option.default else "store_true", "default": None}
        else:
            details |= {"type": option.read, "metavar": option.name}
            details["nargs"] = option.values if option.values != 1 else None if option.flags else "?"
        if option.flags:
            details["dest"] = option.key
        groups[option.group].add_argument(*(option.flags or (option.key,)), **details)
    groups["options"].add_argument("-h", "--help", action="help", help="show this help")
    return parser


def _unknown(words: Sequence[str], options: Sequence[_Option]) -> str:
    wrong = next((word for word in words if word.startswith("-")), None)
    if wrong is None:
        return f"{shown(words[0])} is one argument too many, expected {_places(options)}"
    name = wrong.partition("=")[0]
    return f"there is no option {shown(name)}; {nearest(name, (flag for option in options for flag in option.flags[-1:]))}"


def _places(options: Sequence[_Option]) -> str:
    names = [option.name for option in options if not option.flags]
    return f"{' '.join(names)} and options" if names else "options only"


def _made(record: Any, values: Mapping[str, Any]) -> Any:
    hints, given = typing.get_type_hints(record), {}
    for field in dataclasses.fields(record):
        if dataclasses.is_dataclass(hints[field.name]):
            given[field.name] = _made(hints[field.name], values)
        elif field.name in values:
            value = values[field.name]
            given[field.name] = None if value is _NONE else tuple(value) if isinstance(value, list) else value
    return record(**given)
