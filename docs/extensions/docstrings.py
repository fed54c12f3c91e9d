"""The reference as the source writes it: types by their short names, the settings of a class, and |x| for an absolute value."""

from __future__ import annotations

import dataclasses
import inspect
import re
from typing import Any

from sphinx.application import Sphinx
from sphinx.domains.python import PyObject

LONGEST_DEFAULT = 32
"""Characters; a longer default is shown as `...`, because the text below says what it is."""


class Source(str):
    """A default that a signature shows as the source has it."""

    __slots__ = ()
    __repr__ = str.__str__


def shown_default(value: Any) -> Source:
    """Return a default for a signature."""
    text = repr(value)
    if dataclasses.is_dataclass(value):
        text = f"{type(value).__name__}(...)" if len(text) > LONGEST_DEFAULT else text
    return Source(text if len(text) <= LONGEST_DEFAULT and "<" not in text else "...")


def fields_of(cls: type) -> inspect.Signature:
    """Return the signature of a class of values: what may be given, without types, which the list below it has."""
    kept = []
    for field in dataclasses.fields(cls):
        if not field.init:
            continue
        default: Any = inspect.Parameter.empty
        if field.default is not dataclasses.MISSING:
            default = shown_default(field.default)
        elif field.default_factory is not dataclasses.MISSING:
            default = Source("...")
        kind = inspect.Parameter.KEYWORD_ONLY if field.kw_only else inspect.Parameter.POSITIONAL_OR_KEYWORD
        kept.append(inspect.Parameter(field.name, kind, default=default))
    positional = [each for each in kept if each.kind is inspect.Parameter.POSITIONAL_OR_KEYWORD]
    named = [each for each in kept if each.kind is inspect.Parameter.KEYWORD_ONLY]
    return inspect.Signature([*positional, *named])


def as_written(function: Any, *, bound: bool) -> inspect.Signature:
    """Return the signature of a function with its annotations as they are written."""
    found = inspect.signature(function)
    kept = [
        each if each.default is inspect.Parameter.empty else each.replace(default=shown_default(each.default))
        for each in found.parameters.values()
    ]
    written = [each.replace(annotation=annotation(each.annotation)) for each in (kept[1:] if bound else kept)]
    return found.replace(parameters=written, return_annotation=annotation(found.return_annotation))


def annotation(written: Any) -> Any:
    """Return an annotation that a signature prints without quotes."""
    return Source(written.replace("np.bool_", "bool")) if isinstance(written, str) else written


def signature(
    app: Sphinx, kind: str, name: str, of: Any, options: object, given: str | None, returns: str | None
) -> tuple[str | None, str | None]:
    """Return a signature and what is returned, as text."""
    if kind == "class" and dataclasses.is_dataclass(of):
        found = fields_of(of)
    elif kind == "class" and inspect.isfunction(of.__init__):
        found = as_written(of.__init__, bound=True).replace(return_annotation=inspect.Signature.empty)
    elif kind in ("function", "method") and (inspect.isfunction(of) or inspect.ismethod(of)):
        owner_gives_first = (
            kind == "method" and inspect.isfunction(of) and next(iter(inspect.signature(of).parameters), "") == "self"
        )
        found = as_written(of, bound=owner_gives_first)
    else:
        return given, returns
    arguments, _, returned = str(found).partition(" -> ")
    return arguments, returned or None


def escape(app: Sphinx, kind: str, name: str, of: object, options: object, lines: list[str]) -> None:
    """Escape what reStructuredText would take for markup, outside of code."""
    if kind in ("property", "attribute"):
        lines.insert(0, "")  # or napoleon takes what is before a colon for its type
    lines[:] = [re.sub(r"(`[^`]*`)|\|", lambda found: found[1] or r"\|", line) for line in lines]


def types_as_written(app: Sphinx, kind: str, name: str, of: Any, options: object, lines: list[str]) -> None:
    """Give the attributes of a class the types that the source has."""
    if kind != "class":
        return
    written = {key: value for each in reversed(of.__mro__) for key, value in vars(each).get("__annotations__", {}).items()}
    for i, line in enumerate(lines):
        found = re.match(r":vartype (\w+): ", line)
        if found and isinstance(written.get(found[1]), str):
            lines[i] = f":vartype {found[1]}: {annotation(written[found[1]])}"


def setup(app: Sphinx) -> dict[str, Any]:
    """Mend signatures, docstrings before napoleon reads them, and types after it."""
    app.connect("autodoc-process-signature", signature)
    app.connect("autodoc-process-docstring", escape, priority=400)
    app.connect("autodoc-process-docstring", types_as_written, priority=600)
    for field in PyObject.doc_field_types:
        if field.name == "variable":
            field.label = "Attributes"
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}
