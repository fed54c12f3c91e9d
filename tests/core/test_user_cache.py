"""What is kept between runs: it comes back bit for bit, and nothing that happens to its folder is an error."""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from spacearm.core import user_cache
from spacearm.core.user_cache import cache_folder, cached_arrays, cached_json, content_hash


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("SPACEARM_CACHE", str(tmp_path / "kept"))
    return tmp_path / "kept"


class Made:
    """Counts how often something is made."""

    def __init__(self, value: Any) -> None:
        self.value, self.times = value, 0

    def __call__(self) -> Any:
        self.times += 1
        return self.value


ARRAYS = {
    "real": np.array([[1.0, -0.0, np.inf, 5e-324]]),
    "whole": np.arange(3),
    "words": np.array(["a", "βγ"]),
    "none": np.zeros(0),
}


def test_arrays_come_back_bit_for_bit(folder: Path) -> None:
    make = Made(ARRAYS)
    for _ in range(3):
        found = cached_arrays("test", 1, "key", make)
        assert found.keys() == ARRAYS.keys()
        for name, value in ARRAYS.items():
            assert found[name].dtype == value.dtype
            assert found[name].tobytes() == value.tobytes()
    assert make.times == 1
    assert len(list(folder.iterdir())) == 1


def test_plain_values_come_back(folder: Path) -> None:
    value = {"pairs": [["a", "b"], []], "depth": 0.1 + 0.2, "none": None, "no": False}
    make = Made(value)
    assert [cached_json("test", 1, "key", make) for _ in range(3)] == [value] * 3
    assert make.times == 1


def test_another_kind_version_or_key_is_another_entry(folder: Path) -> None:
    asked = [("a", 1, "key"), ("b", 1, "key"), ("a", 2, "key"), ("a", 1, "yek"), ("a", 1, ["key"])]
    for i, (kind, version, key) in enumerate(asked):
        assert cached_json(kind, version, key, lambda i=i: i) == i
    for i, (kind, version, key) in enumerate(asked):
        assert cached_json(kind, version, key, Made(None)) == i


PLAIN = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text() | st.binary(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(), inner, max_size=3),
    max_leaves=6,
)


@given(PLAIN, PLAIN)
def test_values_have_the_same_hash_if_they_are_the_same(one: Any, other: Any) -> None:
    assert content_hash(one) == content_hash(one)
    assert (content_hash(one) == content_hash(other)) == (repr(_sorted(one)) == repr(_sorted(other)))


def _sorted(value: Any) -> Any:
    """Mappings with the same entries are the same, whatever their order is."""
    if isinstance(value, dict):
        return {key: _sorted(value[key]) for key in sorted(value)}
    return [_sorted(entry) for entry in value] if isinstance(value, list) else value


def test_the_hash_of_an_array_is_that_of_its_type_shape_and_values() -> None:
    array = np.arange(12.0)
    others = [array.astype(np.float32), array.reshape(3, 4), array + 1e-15, array[::-1], array.tolist(), array.tobytes()]
    assert len({content_hash(one) for one in (array, *others)}) == 7
    assert content_hash(array[::2]) == content_hash(array[::2].copy())


SPOILT: dict[str, Callable[[bytes], bytes]] = {
    "empty": lambda content: b"",
    "cut off": lambda content: content[:-3],
    "a bit changed": lambda content: content[:-3] + bytes([content[-3] ^ 4]) + content[-2:],
    "of another format": lambda content: content.replace(b" 1 ", b" 2 ", 1),
    "foreign": lambda content: b"PK\x03\x04" * 50,
    "without an end of line": lambda content: content.replace(b"\n", b" "),
}


@pytest.mark.parametrize("how", SPOILT)
@pytest.mark.parametrize("cached", [cached_arrays, cached_json])
def test_a_spoilt_entry_is_made_again(folder: Path, how: str, cached: Any) -> None:
    value = {"a": np.arange(5)} if cached is cached_arrays else {"a": 1}
    make = Made(value)
    cached("test", 1, "key", make)
    (path,) = folder.iterdir()
    path.write_bytes(SPOILT[how](path.read_bytes()))
    for times in (2, 2):
        assert cached("test", 1, "key", make).keys() == value.keys()
        assert make.times == times


def test_an_entry_that_is_right_but_holds_no_arrays_is_made_again(folder: Path) -> None:
    cached_arrays("test", 1, "key", Made({"a": np.arange(5)}))
    (path,) = folder.iterdir()
    content = b"no arrays"
    path.write_bytes(user_cache._head(content) + b"\n" + content)
    assert cached_arrays("test", 1, "key", Made({"a": np.arange(6)}))["a"].size == 6


def _a_file(path: Path) -> None:
    path.write_text("in the way")


def _read_only(path: Path) -> None:
    path.mkdir()
    path.chmod(0o500)


def _entries_are_folders(path: Path) -> None:
    cached_json("test", 1, "key", Made(1))
    (entry,) = path.iterdir()
    entry.unlink()
    entry.mkdir()


@pytest.mark.parametrize("hinder", [_a_file, _read_only, _entries_are_folders])
def test_a_folder_that_cannot_be_used_is_no_error(folder: Path, hinder: Callable[[Path], None]) -> None:
    hinder(folder)
    assert [cached_json("test", 1, "key", Made(i)) for i in (1, 1)] == [1, 1]


@pytest.mark.parametrize("named", ["/dev/null/x", "a\0b", "~nobody-has-this-name/x"])
def test_a_folder_that_cannot_be_is_no_error(monkeypatch: pytest.MonkeyPatch, named: str) -> None:
    monkeypatch.setattr(os, "environ", {**os.environ, "SPACEARM_CACHE": named})
    assert cached_json("test", 1, "key", Made(1)) == 1


def test_off_keeps_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    make = Made(1)
    for word in ("off", "OFF", " off "):
        monkeypatch.setenv("SPACEARM_CACHE", word)
        assert cache_folder() is None
        cached_json("test", 1, "key", make)
    assert make.times == 3


@pytest.mark.skipif(os.name == "nt" or os.uname().sysname == "Darwin", reason="XDG is for Linux")
def test_without_the_variable_the_folder_is_that_of_the_platform(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.delenv("SPACEARM_CACHE", raising=False)
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "xdg"))
    assert cache_folder() == tmp_path / "xdg" / "spacearm"
    monkeypatch.setenv("XDG_CACHE_HOME", "relative")  # the standard: relative ones are ignored
    assert cache_folder() == tmp_path / ".cache" / "spacearm"


def test_the_entries_that_were_not_used_for_longest_go_first(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(user_cache, "_LARGEST", 5_000)
    (folder / "..").resolve().mkdir(exist_ok=True)
    for i in range(4):
        cached_json("test", 1, i, lambda: "x" * 1000)
    mine = folder / "my-notes.txt"
    mine.write_text("y" * 10_000)
    for i, path in enumerate(sorted(folder.glob("*.cache"), key=lambda path: path.stat().st_mtime_ns)):
        os.utime(path, (1000 + i, 1000 + i))
    cached_json("test", 1, 0, Made("used again"))
    cached_json("test", 1, 4, lambda: "x" * 1000)
    assert mine.exists()
    assert sum(path.stat().st_size for path in folder.glob("*.cache")) <= 5_000
    assert cached_json("test", 1, 0, Made("made again")) == "x" * 1000
    assert cached_json("test", 1, 1, Made("made again")) == "made again"


def test_what_a_killed_process_left_is_removed_later(folder: Path) -> None:
    cached_json("test", 1, "key", Made(1))
    (entry,) = folder.iterdir()
    old, new = folder / f".{entry.name}.{16 * 'a'}", folder / f".{entry.name}.{16 * 'b'}"
    for left_over in (old, new):
        left_over.write_bytes(b"half")
    os.utime(old, (1000, 1000))
    cached_json("test", 1, "other", Made(1))
    assert not old.exists()
    assert new.exists()


def _use(number: int) -> bool:
    value = {"a": np.arange(20_000)}
    return all(cached_arrays("test", 1, i % 3, lambda: value)["a"].size == 20_000 for i in range(number, number + 30))


def test_processes_share_the_folder(folder: Path) -> None:
    with multiprocessing.get_context("spawn").Pool(3) as pool:
        assert all(pool.map(_use, range(3)))
    assert len(list(folder.iterdir())) == 3
