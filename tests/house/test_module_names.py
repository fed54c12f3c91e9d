"""A module is found by its name alone: no two modules of the package have the same."""

from __future__ import annotations

from collections import defaultdict

import pytest

from house.source import python_files, where

IN_FORCE = True
"""Set once the rooms have been laid out anew; until then the names of some modules repeat."""

OF_PYTHON = {"__init__", "__main__"}


@pytest.mark.skipif(not IN_FORCE, reason="in force with the new layout")
def test_names_of_modules_are_unique() -> None:
    places = defaultdict(list)
    for path in python_files():
        if path.stem not in OF_PYTHON:
            places[path.stem].append(where(path))
    repeated = {name: found for name, found in sorted(places.items()) if len(found) > 1}
    assert not repeated, "rename all but one of each: " + "; ".join(
        f"{name} ({', '.join(found)})" for name, found in repeated.items()
    )
