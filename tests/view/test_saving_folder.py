"""The folder that a viewer writes to: plain names of new files, and no way out of it."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from spacearm.core.errors import OutputError
from spacearm.view.output_folder import OutputFolder

OUTSIDE = (
    "../x",
    "..",
    ".",
    "",
    " ",
    "/etc/passwd",
    "a/b",
    "a\\b",
    "..\\x",
    "C:x",
    ".hidden",
    "x\0y",
    "x\ny",
    "-rf",
    "con",
    "nul.yaml",
    "ä",
    "a" * 200,
    ".yaml",
    "...yaml",
    "~",
    "$HOME",
    "%2e%2e%2fx",
    "a:b",
    None,
    7,
    b"x",
)


@pytest.mark.parametrize("name", OUTSIDE, ids=repr)
def test_names_that_are_none_are_refused_and_nothing_is_written(name: object, tmp_path: Path) -> None:
    folder = OutputFolder(tmp_path)
    with pytest.raises(OutputError, match=r"the file's name is .*expected"):
        folder.write(name, ".yaml", "x")  # type: ignore[arg-type]
    assert not list(tmp_path.iterdir())


@given(st.text(max_size=12) | st.text("./\\ ab", max_size=12))
def test_whatever_the_name_nothing_is_written_elsewhere(name: str) -> None:
    import tempfile

    with tempfile.TemporaryDirectory() as parent:
        inside = Path(parent) / "inside"
        inside.mkdir()
        try:
            path = OutputFolder(inside).write(name, ".json", "content")
        except OutputError:
            assert not list(inside.iterdir())
        else:
            assert path.parent == inside.resolve()
            assert [one.name for one in inside.iterdir()] == [path.name]
            assert path.suffix == ".json"
        assert [one.name for one in Path(parent).iterdir()] == ["inside"]


def test_a_name_gets_its_ending_once(tmp_path: Path) -> None:
    folder = OutputFolder(tmp_path)
    assert folder.write("motion", ".json", "1").name == "motion.json"
    assert folder.write("Other motion.JSON", ".json", "1").name == "Other motion.json"
    assert folder.write("a.b", ".yaml", "1").name == "a.b.yaml"


def test_nothing_is_overwritten(tmp_path: Path) -> None:
    folder = OutputFolder(tmp_path)
    folder.write("a", ".yaml", "first")
    with pytest.raises(OutputError, match=r"a\.yaml exists, expected a new name"):
        folder.write("a.yaml", ".yaml", "second")
    assert (tmp_path / "a.yaml").read_text() == "first"


@pytest.mark.skipif(not hasattr(os, "symlink"), reason="no symbolic links here")
@pytest.mark.parametrize("there", [True, False])
def test_a_link_in_the_folder_is_not_followed(there: bool, tmp_path: Path) -> None:
    inside, outside = tmp_path / "inside", tmp_path / "outside.yaml"
    inside.mkdir()
    if there:
        outside.write_text("kept")
    (inside / "a.yaml").symlink_to(outside)
    with pytest.raises(OutputError, match="exists"):
        OutputFolder(inside).write("a", ".yaml", "x")
    assert outside.read_text() == "kept" if there else not outside.exists()


@pytest.mark.skipif(not hasattr(os, "symlink"), reason="no symbolic links here")
def test_a_folder_that_was_put_in_its_place_is_not_written_to(tmp_path: Path) -> None:
    inside, other = tmp_path / "inside", tmp_path / "other"
    inside.mkdir()
    other.mkdir()
    folder = OutputFolder(inside)
    inside.rmdir()
    inside.symlink_to(other)
    with pytest.raises(OutputError, match="no longer the folder"):
        folder.write("a", ".yaml", "x")
    assert not list(other.iterdir())


def test_a_folder_must_be_there(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="is no folder"):
        OutputFolder(tmp_path / "missing")
    (tmp_path / "file").write_text("x")
    with pytest.raises(OutputError, match="is no folder"):
        OutputFolder(tmp_path / "file")


def test_free_names_are_new_and_can_be_written(tmp_path: Path) -> None:
    folder = OutputFolder(tmp_path)
    seen = set()
    for _ in range(3):
        name = folder.free_name("a problem/..", ".yaml")
        seen.add(folder.write(name, ".yaml", "x").name)
    assert seen == {"a_problem.yaml", "a_problem_2.yaml", "a_problem_3.yaml"}
