"""Nothing in the repository knows the machine it was written on."""

from __future__ import annotations

import re

from house.source import repository_files, where

# Written so that this file does not find itself.
DEVELOPERS_PATH = re.compile(r"(?<![\w.])/(?:wor[k]|roo[t]|hom[e])/")


def test_no_file_holds_an_absolute_path_of_a_developers_machine() -> None:
    found = []
    for path in repository_files():
        content = path.read_bytes()
        if b"\0" in content:
            continue  # not text
        for number, line in enumerate(content.decode("utf-8", errors="replace").splitlines(), start=1):
            if DEVELOPERS_PATH.search(line):
                found.append(f"{where(path)}:{number}")
    assert not found, f"absolute paths of a developer's machine: {found}"
