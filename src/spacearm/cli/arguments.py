"""Options made from dataclasses by tyro, so that each setting exists once.

A field's annotation gives the option its type, its line under `Attributes:` the help, its default the default.
`tyro.conf.arg` in the annotation names the value and a short flag. The class's own docstring describes the command.

tyro reports a wrong option in a box of several lines. Here every one becomes a `SettingsError` of one sentence: the option,
the value, what was expected.
"""

from __future__ import annotations

import contextlib
import dataclasses
import io
import os
import shutil
import sys
import textwrap
import types
import typing
from collections.abc import Iterator, Sequence
from typing import Any, TypeVar

import tyro
from tyro.constructors import ConstructorRegistry, PrimitiveConstructorSpec, PrimitiveTypeInfo

from spacearm.core.checks import shown
from spacearm.core.errors import SettingsError, nearest

T = TypeVar("T")

_NUMBERS = {int: "a whole number", float: "a number"}
_NARROWEST = 40  # [characters]
_FRAME = " \t\n─│╭╮╰╯•-"  # what tyro draws its boxes with


def parsed(record: type[T], arguments: Sequence[str], *, command: str) -> T:
    """Read a command's options into a record; a field that is itself a record is a group of options.

    Raises:
        SettingsError: an option that does not exist, or a value that it does not take.
        SystemExit: help was asked for, and printed.
    """
    switches = {flag for flag, hint in _flags(record) if hint is bool}
    for word in arguments[: arguments.index("--") if "--" in arguments else None]:
        name, equals, _ = word.partition("=")
        if equals and name in switches:  # tyro would take the value for the next word
            raise SettingsError(f"{name} takes no value, expected it alone; leave the value out")
        if name.replace("_", "-").startswith("--tyro-"):  # tyro's own, to write completions for a program of one command
            raise SettingsError(_unknown([name], record, command))
    said, page = io.StringIO(), _Page()
    with _wide_enough():
        try:
            with contextlib.redirect_stderr(said), contextlib.redirect_stdout(page), _refusing(record, arguments, command):
                return tyro.cli(
                    record,
                    prog=f"spacearm {command}",
                    args=arguments,
                    config=(tyro.conf.FlagCreatePairsOff, tyro.conf.HelptextFromCommentsOff),
                    registry=_registry(),
                )
        except SystemExit as stopped:
            if stopped.code:
                raise SettingsError(_in_one_line(said.getvalue())) from None
            print(page.text, flush=True)
            raise


def tracking_of_words(words: Sequence[str]) -> float | dict[str, float]:
    """Return the tracking error that words mean: one number for all joints, or NAME=NUMBER for each of some, or of `all`.

    Raises:
        SettingsError: another word, or a joint twice.
    """
    out: dict[str, float] = {}
    for word in words:
        name, equals, text = word.rpartition("=")
        try:
            number = float(text)
        except ValueError:
            wanted = "a number, or NAME=NUMBER for a joint, as in --tracking all=0.002 shoulder=0.001"
            raise SettingsError(f"--tracking is {shown(word)}, expected {wanted}") from None
        if not equals and len(words) == 1:
            return number
        name = name if equals else "all"
        if name in out:
            raise SettingsError(f"--tracking gives {shown(name)} twice, expected each joint once")
        out[name] = number
    return out


class _Page(io.StringIO):
    """The help as tyro prints it: with colours if stdout is a terminal, and never with boxes, for it states no encoding."""

    def __init__(self) -> None:
        super().__init__()
        self.coloured = sys.stdout.isatty() and not os.environ.get("NO_COLOR")

    def isatty(self) -> bool:
        """Whether tyro may colour it."""
        return self.coloured

    @property
    def text(self) -> str:
        """What was printed, the description wrapped, which tyro does not."""
        width = shutil.get_terminal_size().columns
        lines = (line if "\x1b" in line else textwrap.fill(line, width) for line in self.getvalue().splitlines())
        return "\n".join(map(str.rstrip, lines)).rstrip()


@contextlib.contextmanager
def _wide_enough() -> Iterator[None]:
    """Pretend that a very narrow terminal is wider: in one of less than about 25 columns tyro never ends."""
    before = os.environ.get("COLUMNS")
    os.environ["COLUMNS"] = str(max(shutil.get_terminal_size().columns, _NARROWEST))
    try:
        yield
    finally:
        if before is None:
            del os.environ["COLUMNS"]
        else:
            os.environ["COLUMNS"] = before


def _registry() -> ConstructorRegistry:
    """Return how values are read where tyro's own way is not ours."""
    registry = ConstructorRegistry()
    for rule in (_number, _or_none, _several):
        registry.primitive_rule(rule)
    return registry


def _number(info: PrimitiveTypeInfo) -> PrimitiveConstructorSpec[Any] | None:
    """A number, refused by its value and what was expected."""
    kind: Any = info.type
    if kind not in _NUMBERS:
        return None

    def read(words: list[str]) -> Any:
        try:
            return kind(words[0])
        except ValueError:
            raise ValueError(f"is {shown(words[0])}, expected {_NUMBERS[kind]}") from None

    return PrimitiveConstructorSpec(
        nargs=1,
        metavar=kind.__name__.upper(),
        instance_from_str=read,
        is_instance=lambda value: isinstance(value, kind),
        str_from_instance=lambda value: [f"{value:g}" if kind is float else str(value)],
    )


def _or_none(info: PrimitiveTypeInfo) -> PrimitiveConstructorSpec[Any] | None:
    """A value or the word none, which tyro spells None."""
    forms = typing.get_args(info.type)
    if info.type_origin not in (typing.Union, types.UnionType) or len(forms) != 2 or forms[1] is not types.NoneType:
        return None
    value = _spec(forms[0], info)

    def read(words: list[str]) -> Any:
        try:
            return None if [word.lower() for word in words] == ["none"] else value.instance_from_str(words)
        except ValueError as error:
            raise ValueError(f"{error} or none") from None

    return dataclasses.replace(
        value,
        instance_from_str=read,
        is_instance=lambda given: given is None or value.is_instance(given),
        str_from_instance=lambda given: ["none"] if given is None else value.str_from_instance(given),
        choices=value.choices and (*value.choices, "none"),
    )


def _several(info: PrimitiveTypeInfo) -> PrimitiveConstructorSpec[Any] | None:
    """Several values of a kind: a fixed number, or one or more, where tyro would take none at all."""
    forms = typing.get_args(info.type)
    if info.type_origin is not tuple or len(set(forms) - {Ellipsis}) != 1:
        return None
    one, open_ended = _spec(forms[0], info), Ellipsis in forms

    def read(words: list[str]) -> Any:
        if not words:
            raise ValueError("has too few values, expected one or more")
        return tuple(one.instance_from_str([word]) for word in words)

    return dataclasses.replace(
        one,
        nargs="*" if open_ended else len(forms),
        metavar=f"{one.metavar} [{one.metavar} ...]" if open_ended else " ".join([one.metavar] * len(forms)),
        instance_from_str=read,
        is_instance=lambda values: isinstance(values, tuple) and all(map(one.is_instance, values)),
        str_from_instance=lambda values: [text for value in values for text in one.str_from_instance(value)] or ["none"],
    )


def _spec(kind: Any, info: PrimitiveTypeInfo) -> PrimitiveConstructorSpec[Any]:
    spec = ConstructorRegistry.get_primitive_spec(PrimitiveTypeInfo.make(kind, info.markers))
    assert isinstance(spec, PrimitiveConstructorSpec)
    return spec


@contextlib.contextmanager
def _refusing(record: Any, arguments: Sequence[str], command: str) -> Iterator[None]:
    """Raise our own sentence for what tyro refuses.

    tyro tells what was wrong in parts only to a hook that it calls private. With a tyro that has it no more, or another one,
    its own words remain, and `parsed` makes one line of them.
    """
    try:
        from tyro._errors import on_parse_error
    except ImportError:
        yield
        return

    def refuse(event: Any) -> None:
        with contextlib.suppress(AttributeError):
            sentence = _sentence(event, record, arguments, command)
            if sentence:
                raise SettingsError(sentence)

    with on_parse_error(refuse):
        yield


def _sentence(event: Any, record: Any, arguments: Sequence[str], command: str) -> str:
    """Say what tyro found wrong; "" for what it did not find when this was written."""
    kind = type(event).__name__
    if kind == "UnrecognizedArgs":
        return _unknown(event.tokens, record, command)
    if kind == "MissingArgs":
        if event.unrecognized_tokens:
            return _unknown(event.unrecognized_tokens, record, command)
        missing = event.missing_arguments[0].arg
        text = str(missing.field.helptext() if callable(missing.field.helptext) else missing.field.helptext)
        return f"{_usage(missing)} is missing, expected {text.rstrip('.')}; see spacearm {command} --help"
    name = event.argument.lowered.name_or_flags[-1]
    if kind == "BadValue":
        if event.argument.is_positional():  # a file is missing before an option that does not exist
            return _unknown(_not_known(arguments, record), record, command)
        return f"{name} has too few values, expected {_usage(event.argument)}"
    if kind == "InvalidChoice":
        return f"{name} is {shown(event.value)}; {nearest(event.value, event.choices)}"
    return f"{name} {event.message}" if kind == "InstantiationFailure" else ""


def _usage(argument: Any) -> str:
    """Return how an option is written, as in "-o FOLDER"."""
    text = argument.get_invocation_text()[0].as_str_no_ansi()
    return text[1:-1] if text.startswith("[") else text


def _unknown(words: Sequence[str], record: Any, command: str) -> str:
    wrong = next((word for word in words if word.startswith("-")), None)
    if wrong is None:
        return f"{shown(words[0])} is one argument too many; leave it out, or see spacearm {command} --help"
    name = wrong.partition("=")[0]
    known = [*(flag for flag, _ in _flags(record)), "--help"]
    return f"there is no option {shown(name)}; {nearest(name, known)}; see spacearm {command} --help"


def _flags(record: Any) -> Iterator[tuple[str, Any]]:
    """Yield a record's options, as they are written, with their types; those of its groups after its own."""
    plain, annotated = typing.get_type_hints(record), typing.get_type_hints(record, include_extras=True)
    groups = [hint for hint in plain.values() if dataclasses.is_dataclass(hint)]
    for field in dataclasses.fields(record):
        hint = plain[field.name]
        if hint not in groups and tyro.conf.Positional not in getattr(annotated[field.name], "__metadata__", ()):
            yield f"--{field.name.replace('_', '-')}", hint
    for group in groups:
        yield from _flags(group)


def _not_known(arguments: Sequence[str], record: Any) -> list[str]:
    """Return the words that look like options and are none."""
    notes = [note for hint in typing.get_type_hints(record, include_extras=True).values() for note in typing.get_args(hint)[1:]]
    short = {alias for note in notes for alias in getattr(note, "aliases", None) or ()}
    known = {flag for flag, _ in _flags(record)} | short
    return [word for word in arguments if word.startswith("-") and word.partition("=")[0] not in known]


def _in_one_line(text: str) -> str:
    return " ".join(line for line in (line.strip(_FRAME) for line in text.splitlines()) if line)
