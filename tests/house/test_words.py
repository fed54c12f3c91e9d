"""The words of the repository: those of the field, and none of the machine that it was written on."""

from __future__ import annotations

import re

from house.source import REPOSITORY, python_files, repository_files, where

# Written so that this file does not find itself.
OWN_WORDS = {
    "Stance": "base setup",
    "Riders": "relative bodies",
    "Recoil": "base motion bounds",
    "Gaps": "clearance bounds",
    "Middles": "interval midpoints",
    "unfold": "place capsules",
    "crown": "update the global best",
    "hunt": "search",
    "dice": "random sequence",
    "fly": "move",
    "flown": "moved",
    "probe": "RRT-Connect",
    "the seed's": "the paper's, or: of the random seed",
    "other people's": "the names of the libraries",
    "so many": "a number of",
}
"""Words that only their writer understands, and what the field says instead."""

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


def test_the_package_and_its_documents_use_the_words_of_the_field() -> None:
    words = re.compile(rf"(?<!\w)(?:{'|'.join(OWN_WORDS)})(?!\w)")
    found = []
    for path in [*python_files(), *sorted((REPOSITORY / "docs").rglob("*.md")), *REPOSITORY.glob("[!C]*.md")]:
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), start=1):
            found += [f"{where(path)}:{number}: '{word}'; write: {OWN_WORDS[word]}" for word in words.findall(line)]
    assert not found, "\n".join(found)
