"""What is public is listed, exists, and says what it is."""

from __future__ import annotations

import ast
import dataclasses
import inspect
import itertools
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

import spacearm
from house.source import PACKAGE, parsed, python_files, where

ROOMS = [path for path in python_files() if path.name == "__init__.py"]
PUBLIC = sorted(getattr(spacearm, "__all__", ()))


def listed_names(tree: ast.Module) -> list[str] | None:
    """Return the names in `__all__`, or None where there is none."""
    for node in tree.body:
        target = node.targets[0] if isinstance(node, ast.Assign) else getattr(node, "target", None)
        if isinstance(target, ast.Name) and target.id == "__all__":
            value = getattr(node, "value", None)
            if isinstance(value, (ast.List, ast.Tuple)):
                return [ast.literal_eval(entry) for entry in value.elts]
            return [] if value is None else list(getattr(spacearm, "__all__", []))  # computed, as by a table
    return None


def bound_names(body: list[ast.stmt]) -> Iterator[str]:
    """Yield what statements bind, also inside `if` and `try`, the standard library's names left out."""
    for node in body:
        if isinstance(node, (ast.FunctionDef, ast.ClassDef)):
            yield node.name
        elif isinstance(node, (ast.Import, ast.ImportFrom)):
            for alias in node.names:
                origin = getattr(node, "module", None) or alias.name
                if origin.split(".")[0] not in sys.stdlib_module_names:  # the machinery of lazy names
                    yield (alias.asname or alias.name).split(".")[0]
        elif isinstance(node, ast.Assign):
            yield from (n.id for t in node.targets for n in ast.walk(t) if isinstance(n, ast.Name))
        elif isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
            yield node.target.id
        elif isinstance(node, (ast.If, ast.Try)):
            yield from bound_names([*node.body, *node.orelse])


def own_members(cls: type) -> Iterator[tuple[str, object]]:
    """Yield the public methods and properties of a class, those inherited from spacearm's bases included."""
    fields = {field.name for field in dataclasses.fields(cls)} if dataclasses.is_dataclass(cls) else set()
    for base in cls.__mro__:
        if not base.__module__.startswith("spacearm"):
            continue
        for name, member in vars(base).items():
            plain = member.__func__ if isinstance(member, (classmethod, staticmethod)) else member
            has_code = inspect.isfunction(plain) or isinstance(plain, property)
            if has_code and not name.startswith("_") and name not in fields:
                yield f"{base.__qualname__}.{name}", plain


def has_written_docstring(thing: object) -> bool:
    """Is there a docstring that a person wrote, rather than a dataclass's signature or a base's text?"""
    text = inspect.cleandoc(thing.__doc__ or "")
    if isinstance(thing, type):
        text = inspect.cleandoc(vars(thing).get("__doc__") or "")
        return bool(text) and not text.startswith(f"{thing.__name__}(")
    return bool(text)


def is_documented_alias(name: str) -> bool:
    """Is a name assigned at a module's top level, with a string right after that says what it is?"""
    for path in python_files():
        body = parsed(path).body
        for node, after in itertools.pairwise(body):
            if not isinstance(node, (ast.Assign, ast.AnnAssign)) or name not in bound_names([node]):
                continue
            if isinstance(after, ast.Expr) and isinstance(after.value, ast.Constant):
                return isinstance(after.value.value, str)
    return False


def test_the_package_lists_its_public_names() -> None:
    assert PUBLIC, "spacearm.__all__ is missing or empty"
    assert len(set(PUBLIC)) == len(PUBLIC)


@pytest.mark.parametrize("name", PUBLIC)
def test_every_public_name_exists_and_is_documented(name: str) -> None:
    thing = getattr(spacearm, name)
    if name.startswith("__"):
        return
    if inspect.ismodule(thing) or inspect.isroutine(thing) or isinstance(thing, type):
        assert has_written_docstring(thing), f"spacearm.{name} has no docstring"
    else:
        assert is_documented_alias(name), f"spacearm.{name} has no string after its assignment that explains it"
    if isinstance(thing, type):
        silent = [member for member, plain in own_members(thing) if not has_written_docstring(plain)]
        assert not silent, f"no docstring: {silent}"


@pytest.mark.parametrize("path", ROOMS, ids=where)
def test_an_init_binds_nothing_public_that_it_does_not_list(path: Path) -> None:
    names = listed_names(parsed(path))
    if names is None and path.parent.parent == PACKAGE:
        return  # a room without a list is no door: its modules are imported one by one
    unlisted = {name for name in bound_names(parsed(path).body) if not name.startswith("_")} - set(names or ())
    assert not unlisted, f"{where(path)} binds {sorted(unlisted)} without listing them in __all__"


def test_every_public_function_and_class_in_the_source_has_a_docstring() -> None:
    silent = []

    def look(path: Path, body: list[ast.stmt], prefix: str) -> None:
        for node in body:
            if not isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)):
                continue
            decorators = " ".join(ast.unparse(decorator) for decorator in node.decorator_list)
            if node.name.startswith("_") or "overload" in decorators or ".setter" in decorators:
                continue
            if not ast.get_docstring(node):
                silent.append(f"{where(path)}:{node.lineno}: {prefix}{node.name}")
            if isinstance(node, ast.ClassDef):
                look(path, node.body, f"{prefix}{node.name}.")

    for path in python_files():
        look(path, parsed(path).body, "")
    assert not silent, "no docstring:\n" + "\n".join(silent)
