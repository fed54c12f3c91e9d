"""What is printed of a value: small ones as the call that makes them, large ones in eight lines."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
import pytest

import spacearm as sa
from spacearm.core.brief import COLUMNS, LINES, Brief, brief, counted, listed, numbers, words


@dataclass(frozen=True, kw_only=True, repr=False)
class Several(Brief):
    values: Any
    name: str = ""
    more: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True, repr=False)
class Stated(Brief):
    rows: list[tuple[str, str]]

    def _in_short(self) -> tuple[str, list[tuple[str, str]]]:
        return "Stated", self.rows


class Pair(NamedTuple):
    a: Any
    b: Any

    def __repr__(self) -> str:
        return brief(self)


ROTATED = sa.pose((0, 0, 1.0), (np.sqrt(0.5), np.sqrt(0.5), 0, 0))


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (sa.Sphere((0, 0, 0), 0.1), "Sphere((0, 0, 0), 0.1)"),
        (sa.Box((0.1, 0.2, 0.3), (1, 2, 3), name="box"), "Box((0.1, 0.2, 0.3), (1, 2, 3), name='box')"),
        (sa.Box((0.1, 0.2, 0.3)), "Box((0.1, 0.2, 0.3))"),
        (sa.Scene([sa.Sphere((0, 0, 0), 0.1)]), "Scene((Sphere((0, 0, 0), 0.1),))"),
        (sa.Scene(), "Scene()"),
        (sa.BaseLimits(peak=0.5), "BaseLimits(peak=0.5)"),
        (sa.ConfigurationGoal([0, 0.25]), "ConfigurationGoal((0, 0.25))"),
        (sa.PositionGoal((0.7, 0.3, 0), tolerance=0.01), "PositionGoal((0.7, 0.3, 0), tolerance=0.01)"),
        (sa.TimeLaw.uniform(), "TimeLaw((0, 1), ((0, 1),))"),
        (sa.FeasibleFirst(), "FeasibleFirst(forgiven=0.0, until=0.8, power=5)"),
        (Several(values=(), more={"a": 1.0}), "Several(values=(), more={'a': 1.0})"),
        (Pair(np.float64(1.0), np.int64(3)), "Pair(a=1.0, b=3)"),
    ],
)
def test_a_small_value_is_printed_as_the_call_that_makes_it(value: Any, text: str) -> None:
    assert repr(value) == text
    if not isinstance(value, (Several, Pair)):
        names = {name: getattr(sa, name) for name in ("Sphere", "Box", "Scene", "BaseLimits", "TimeLaw", "FeasibleFirst")}
        made = eval(text, names | {name: getattr(sa, name) for name in ("ConfigurationGoal", "PositionGoal")})
        assert made == value


@pytest.mark.parametrize(
    ("value", "part"),
    [
        (sa.Cylinder(0.1, 1.0, ROTATED), "<at (0, 0, 1), turned 90 deg about (1, 0, 0)>"),
        (sa.PoseGoal(sa.pose((1, 2, 3))), "<at (1, 2, 3), not turned>"),
        (sa.PoseGoal(np.diag([-1.0, -1.0, 1.0, 1.0])), "turned 180 deg about (0, 0, 1)"),
        (sa.Motion(np.full((2, 7), 1 / 3)), "about ((0.333333, 0.333333"),
        (sa.Motion(np.zeros((100, 7))), "<100 x 7: 0, 0, 0, 0, ...>"),
        (sa.SphereSet(np.zeros((2000, 3)), np.ones(2000)), "<2000 x 3: 0, 0, 0, 0, ...>, <2000: 1, 1, 1, 1, ...>"),
        (Several(values=(sa.Sphere((0, 0, 0), 1.0),) * 5000), "<5,000 members>"),
        (Several(values=(sa.Sphere((0, 0, 0), 1.0),) * 500), "<500 Sphere>"),
        (Several(values={i: i for i in range(50)}), "<50 entries: 0, 1, 2, 3, ...>"),
        (Several(values=2**100), "1.26765e+30"),
    ],
)
def test_what_is_long_is_shortened_and_says_how_long_it_is(value: Any, part: str) -> None:
    assert part in repr(value)


def fits(text: str) -> None:
    lines = text.split("\n")
    assert len(lines) <= LINES, text
    assert max(map(len, lines)) <= COLUMNS, text
    assert text.replace("\n", "").isprintable(), text


class Broken:
    def __repr__(self) -> str:
        return "\x1b[31m" + "x\n" * 10_000


HOSTILE = [
    Several(values=1.0, name="n" * 100_000),
    Several(values="\x1b[2J\n\r\t\0" * 1000, name="\ud800"),
    Several(values=Broken()),
    Several(values=[[[[[[0]]]]]] * 3),
    Several(values=tuple(Several(values=tuple(range(9)), name="m" * 30) for _ in range(12))),
    Several(values={"k" * 1000: "v" * 1000}, more={"m" * 500: float("nan")}),
    Several(values=np.array(["a" * 100] * 40)),
    Several(values=np.zeros((0, 3))),
    Several(values=np.full((3, 3), np.inf)),
    Several(values=np.array(1e300)),
    Several(values=np.zeros(30, dtype=bool)),
    Several(values=np.array([1e-300, -1e300] * 8)),
    Several(values={1, 2, 3}),
    Several(values=[sa.Sphere((0, 0, 0), 1.0, name="\n" * 100)]),
    Stated([]),
    Stated([("name", "text " * 1000)]),
    Stated([(f"name {i}", "text " * 100) for i in range(50)]),
    Stated([("n" * 500, "\x1b[2J" * 500)]),
    Pair(np.zeros((4000, 7)), np.zeros((4000, 7))),
]


@pytest.mark.parametrize("value", HOSTILE, ids=range(len(HOSTILE)))
def test_whatever_there_is_fits_eight_lines(value: Any) -> None:
    fits(repr(value))


def test_the_lines_that_are_left_are_given_to_long_rows() -> None:
    text = repr(Stated([("first", "word " * 60), ("second", "short")]))
    assert text.startswith("<Stated\n  first   word word")
    assert text.count("\n") == 4
    assert text.endswith("  second  short>")
    many = repr(Stated([(f"row {i}", f"{i}") for i in range(20)]))
    assert "also   row 6, row 7" in many


class Counting:
    """A member that counts how often one is printed."""

    printed = 0

    def __repr__(self) -> str:
        Counting.printed += 1
        return "a member"


def test_of_a_value_of_many_parts_few_are_looked_at() -> None:
    fits(repr(Several(values=tuple(Counting() for _ in range(10**5)), name="x" * 10**6)))
    assert Counting.printed == 0
    fits(repr(sa.Scene([sa.Sphere((i, 0, 0), 0.1, name=f"obstacle {i} " + "x" * 1000) for i in range(5000)])))


def test_words_of_a_name_are_one_line_and_cut() -> None:
    assert words("a\nb\tc") == "a b c"
    assert words("x" * 100, 10) == "xxxxxxx..."
    assert words("\x1b[31m") == "\\x1b[31m"
    assert listed([f"j{i}" for i in range(9)], 2) == "j0, j1, ... (9 in all)"
    assert counted(1, "pair") == "1 pair"
    assert counted(2000, "box", "boxes") == "2,000 boxes"
    assert numbers([1 / 3]) == "(0.3333,)"


def test_a_message_shows_a_value_on_one_line() -> None:
    with pytest.raises(sa.SpacearmError, match=r"obstacles is Sphere\(\(0, 0, 0\), 1.0\), expected a list"):
        sa.Scene(sa.Sphere((0, 0, 0), 1.0))  # type: ignore[arg-type]
    with pytest.raises(sa.SpacearmError, match=r"robot is PSO\(particles=300") as error:
        sa.Trajectory(sa.PSO(), sa.Motion([[0], [1]]))  # type: ignore[arg-type]
    assert "\n" not in str(error.value)
