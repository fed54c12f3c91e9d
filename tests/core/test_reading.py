"""YAML is read quickly in C where nothing is wrong with it, and must then mean what the slow way says."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest
import yaml
from hypothesis import example, given
from hypothesis import strategies as st

from spacearm.core.errors import FileFormatError
from spacearm.core.reading import _composed, _composed_in_c, _loader_class, yaml_documents, yaml_of_others

pytestmark = pytest.mark.skipif(not yaml.__with_libyaml__, reason="this PyYAML has no libyaml")

WORDS = (
    "1 -0 010 1e-3 1. .5 .inf -.inf 0x1f 1_000 12:30 yes no on true ~ null 2001-01-01 "
    "'a' \"b\\n\" | é << = &a *a ? - [ {} #c !!int"
)
SCALARS = st.sampled_from(["", "a b", "!!str 1", "!!int x", "&a 1", *WORDS.split()])
LINES = st.tuples(
    st.integers(0, 3),
    st.sampled_from(["a: ", "b: ", "- ", "", "c: [", "d: {e: ", "<<: "]),
    SCALARS,
    st.sampled_from(["", "]", "}", ","]),
)


def in_python(text: str) -> Any:
    loader = _loader_class()(text)
    try:
        root = loader.get_single_node()
        return None if root is None else loader.construct_document(root)
    finally:
        loader.dispose()


def same(a: Any, b: Any) -> bool:
    if isinstance(a, float) and isinstance(b, float):
        return a == b or (math.isnan(a) and math.isnan(b))
    return repr(a) == repr(b)


@given(st.lists(LINES, max_size=8).map(lambda lines: "\n".join(" " * n + a + b + c for n, a, b, c in lines)))
@example("a: 1\nb: [1e-3, yes, 010]\n")
@example("- &x {a: 1}\n- *x\n- <<: *x\n  b: 2")
@example("a: 1\na: 2")
def test_the_quick_way_says_what_the_slow_way_says(text: str) -> None:
    found = _composed_in_c(text)
    if found is not None:
        try:
            slowly = in_python(text)
        except Exception:  # libyaml is more lenient about layout, never about values
            return
        assert same(found[0], slowly)


@pytest.mark.parametrize("text", ["a: 1\na: 2", "a: {b: 1, b: 2}", "a: !!python/name:os.system", "a: [", "- &a [*a", "a: *b"])
def test_what_is_refused_slowly_is_refused_quickly(text: str) -> None:
    assert _composed_in_c(text) is None
    with pytest.raises(FileFormatError, match=r"^file: line \d+: "):
        _composed(text, "file", "a robot file")


@pytest.mark.parametrize("text", ["[" * 50_000, "{a: " * 50_000, "- " * 50_000, "a: " + "[" * 101 + "]" * 101])
def test_what_is_nested_deeply_is_left_to_the_slow_way(text: str) -> None:
    assert _composed_in_c(text) is None


def test_lines_are_known_either_way() -> None:
    file = yaml_of_others("a:\n  - 1\n  - b: 2\n", Path("file"), key="a", what="a file")
    assert file.where(("a", 1, "b")) == "file: line 3"
    assert file.value == {"a": [1, {"b": 2}]}


WORDS_OF_YAML: dict[str, Any] = {
    "yes": "yes",
    "no": "no",
    "on": "on",
    "true": True,
    "FALSE": False,
    "010": 10.0,
    "0o10": "0o10",
    "0x1f": "0x1f",
    "1_000": "1_000",
    "12:30": "12:30",
    "1e-3": 0.001,
    "1.": 1.0,
    ".5": 0.5,
    "-.inf": -math.inf,
    "~": None,
    "null": None,
    "2001-01-01": "2001-01-01",
    "'1'": "1",
    "!!str 1": "1",
    "=": "=",
}


@pytest.mark.parametrize("word", WORDS_OF_YAML)
def test_a_word_means_what_the_core_schema_of_yaml_1_2_says(word: str) -> None:
    assert same(_composed(f"a: {word}", "file", "a file")[0]["a"], WORDS_OF_YAML[word])


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("%YAML 1.1\n---\na: yes\n", {"a": "yes"}),
        ("%YAML 1.2\n---\na: 010\n", {"a": 10}),
        ("a: &x [1, 2]\nb: *x\n", {"a": [1, 2], "b": [1, 2]}),
        ("a: &x {c: 1}\nb: {<<: *x, d: 2}\n", {"a": {"c": 1}, "b": {"c": 1, "d": 2}}),
        ("a: 1 # yes\n", {"a": 1}),
        ("a:\n- 1\n- 2\n", {"a": [1, 2]}),
    ],
)
def test_what_a_text_means(text: str, expected: Any) -> None:
    assert _composed(text, "file", "a file")[0] == expected


REFUSED_YAML = {
    "a tab": ("a:\n\tb: 1", "line 2"),
    "twice": ("a: 1\na: 2", "key 'a' is given twice"),
    "twice deep": ("a:\n  - {b: 1, b: 2}", "line 2: key 'b' is given twice"),
    "two documents": ("a: 1\n---\na: 2", "document"),
    "an object": ("a: !!python/object:os.system x", "line 1"),
    "open": ("a: [1, 2", "line 1"),
}


@pytest.mark.parametrize("case", REFUSED_YAML)
def test_what_is_no_yaml_is_refused_with_its_line(case: str) -> None:
    text, words = REFUSED_YAML[case]
    with pytest.raises(FileFormatError, match=words):
        _composed(text, "file", "a file")


def test_documents_are_parted_by_dashes(tmp_path: Path) -> None:
    (tmp_path / "a.yaml").write_text("---\na: 1\n---\n---\nb: yes\n")
    assert yaml_documents(tmp_path / "a.yaml", what="messages") == [{"a": 1}, {"b": "yes"}]
