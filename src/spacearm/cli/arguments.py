"""Options made from dataclasses, so that each setting exists once; what cannot be read is refused in one line."""

from __future__ import annotations

import io
import re
from collections.abc import Sequence
from contextlib import redirect_stderr
from typing import TypeVar

from spacearm.errors import SettingsError

T = TypeVar("T")

_FRAME = re.compile(r"[╭╮╰╯│─┌┐└┘|]+")


def parsed(record: type[T], arguments: Sequence[str], *, command: str, description: str) -> T:
    """Read a command's options into a record.

    Raises:
        SettingsError: an option that does not exist, or a value that it does not take.
        SystemExit: help was asked for.
    """
    import tyro

    said = io.StringIO()
    try:
        with redirect_stderr(said):
            return tyro.cli(
                record,
                args=list(arguments),
                prog=f"spacearm {command}",
                description=description,
                config=(tyro.conf.OmitArgPrefixes, tyro.conf.FlagCreatePairsOff),
            )
    except SystemExit as stopped:
        if stopped.code in (0, None):
            raise
        raise SettingsError(f"{_one_line(said.getvalue())}; see spacearm {command} --help") from None


def _one_line(text: str) -> str:
    """Take the words out of the frame that tyro draws around them."""
    words = " ".join(_FRAME.sub(" ", text).split())
    words = re.sub(r"^(Parsing error|Unrecognized options|Required options|Invalid [a-z ]*)\s*", r"\1: ", words)
    words = re.sub(r"\s*For full helptext,.*$", "", words)
    return words.rstrip(" .:") or "the options cannot be read"
