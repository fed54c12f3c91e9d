"""A module is found by its name alone: no two modules of the package have the same."""

from __future__ import annotations

from collections import defaultdict

from house.source import python_files, where

OF_PYTHON = {"__init__", "__main__"}


def test_names_of_modules_are_unique() -> None:
    places = defaultdict(list)
    for path in python_files():
        if path.stem not in OF_PYTHON:
            places[path.stem].append(where(path))
    repeated = {name: found for name, found in sorted(places.items()) if len(found) > 1}
    assert not repeated, "rename all but one of each: " + "; ".join(
        f"{name} ({', '.join(found)})" for name, found in repeated.items()
    )
