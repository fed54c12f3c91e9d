"""Texts made wrong: what a slip of the hand, a broken disk or somebody's malice does to a file."""

from __future__ import annotations

import re

import numpy as np

NUMBER = re.compile(rb"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
TOKEN = re.compile(rb"[A-Za-z_][\w.-]*|[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?|[^\s\w]")
NUMBERS = [
    b"nan", b"NaN", b".nan", b"inf", b"-inf", b".inf", b"Infinity", b"-Infinity", b"1e308", b"-1e308", b"1e309", b"1e-308",
    b"5e-324", b"-0", b"-0.0", b"0", b"-1", b"1", b"2", b"1e13", b"1e6", b"-1e150", b"1e-9", b"99999999999999999999999999",
    b"18446744073709551616", b"2147483648", b"-9223372036854775809", b"9" * 400, b"0x10", b"0b1", b"1_000", b"1:30", b"0777",
    b"1e", b"1.2.3", b"--1", b"1,5", b"+-2", b"\xef\xbc\x91", b"3.14159265358979", b"true",
]  # fmt: skip
VALUES = [
    b"", b" ", b"null", b"~", b"true", b"no", b"[]", b"{}", b"[[]]", b"[1, 2]", b"{a: 1}", b'"x"', b"''", b"x", b"\xc3\xa9",
    b"2020-01-01", b"!!python/object:os.system x", b"!!binary aGk=", b"!!set {a}", b"&a [*a]", b"*a", b"<<: {}", b"|\n x",
    b"%", b"\xff\xfe", b"\0", b"\x1b[31m", b"\xe2\x80\xa8", b"\xed\xa0\x80", b"../../../etc/passwd", b"/dev/zero", b"/", b".",
    b"a" * 5000, b"package://x/y.stl", b"&lt;", b"&#10;", b"&#0;", b"]]>", b"<!--", b"<?xml?>", b"fixed", b"floating",
    b"base", b"NaN NaN NaN",
]  # fmt: skip
DEEP = [b"[", b"{", b"{a: ", b'{"a":', b"- ", b"<link>", b"<a b='c'>", b"(", b"*"]


def mutated(data: bytes, rng: np.random.Generator, most: int = 4) -> bytes:
    """Change a text in one to so many places."""
    for _ in range(1 if rng.random() < 0.6 else int(rng.integers(2, most + 1))):
        data = _ONE[int(rng.integers(len(_ONE)))](data, rng)
    return data


def _flip(data: bytes, rng: np.random.Generator) -> bytes:
    """Change bits or whole bytes."""
    out = bytearray(data)
    for _ in range(int(rng.integers(1, 6)) if out else 0):
        at = int(rng.integers(len(out)))
        out[at] = out[at] ^ (1 << int(rng.integers(8))) if rng.random() < 0.5 else int(rng.integers(256))
    return bytes(out)


def _truncate(data: bytes, rng: np.random.Generator) -> bytes:
    at = int(rng.integers(len(data) + 1))
    return data[at:] if rng.random() < 0.2 else data[:at]


def _delete(data: bytes, rng: np.random.Generator) -> bytes:
    at = int(rng.integers(len(data) + 1))
    return data[:at] + data[at + int(rng.integers(1, 60)) :]


def _lines(data: bytes, rng: np.random.Generator) -> bytes:
    """Double, drop, swap or indent a line."""
    lines = data.splitlines(keepends=True)
    if not lines:
        return data
    i, k = (int(rng.integers(len(lines))) for _ in range(2))
    kind = int(rng.integers(5))
    if kind == 0:
        lines.insert(k, lines[i])
    elif kind == 1:
        del lines[i]
    elif kind == 2:
        lines[i], lines[k] = lines[k], lines[i]
    elif kind == 3:
        lines[i] = b" " * int(rng.integers(1, 5)) + lines[i]
    else:
        lines[i] = lines[i].lstrip()
    return b"".join(lines)


def _number(data: bytes, rng: np.random.Generator) -> bytes:
    return _replaced(data, NUMBER, NUMBERS, rng)


def _value(data: bytes, rng: np.random.Generator) -> bytes:
    return _replaced(data, TOKEN, VALUES, rng)


def _replaced(data: bytes, pattern: re.Pattern[bytes], choices: list[bytes], rng: np.random.Generator) -> bytes:
    places = [match.span() for match in pattern.finditer(data)]
    if not places:
        return data
    start, end = places[int(rng.integers(len(places)))]
    return data[:start] + choices[int(rng.integers(len(choices)))] + data[end:]


def _swap(data: bytes, rng: np.random.Generator) -> bytes:
    """Swap two tokens, or put one in the place of another."""
    places = [match.span() for match in TOKEN.finditer(data)]
    if len(places) < 2:
        return data
    first, second = sorted(int(i) for i in rng.integers(len(places), size=2))
    (a, b), (c, d) = places[first], places[second]
    if first == second:
        return data
    into = data[a:b] if rng.random() < 0.5 else data[c:d]
    return data[:a] + data[c:d] + data[b:c] + into + data[d:]


def _rename(data: bytes, rng: np.random.Generator) -> bytes:
    """Rename a word everywhere: names that agree and are wrong."""
    words = sorted(set(re.findall(rb"[A-Za-z_]\w*", data)))
    if len(words) < 2:
        return data
    old, new = (words[int(i)] for i in rng.integers(len(words), size=2))
    return re.sub(
        rb"\b" + old + rb"\b", new if rng.random() < 0.7 else VALUES[int(rng.integers(len(VALUES)))].replace(b"\\", b""), data
    )


def _nest(data: bytes, rng: np.random.Generator) -> bytes:
    at, times = int(rng.integers(len(data) + 1)), int(rng.choice([3, 60, 2000, 30_000]))
    return data[:at] + DEEP[int(rng.integers(len(DEEP)))] * times + data[at:]


def _repeat(data: bytes, rng: np.random.Generator) -> bytes:
    """A piece many times over."""
    a = int(rng.integers(len(data) + 1))
    b = min(len(data), a + int(rng.integers(1, 200)))
    return data[:b] + data[a:b] * int(rng.choice([1, 5, 300])) + data[b:]


_ONE = (
    _flip,
    _truncate,
    _delete,
    _lines,
    _lines,
    _number,
    _number,
    _number,
    _value,
    _value,
    _swap,
    _swap,
    _rename,
    _nest,
    _repeat,
)
