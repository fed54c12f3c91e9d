"""Whatever is wrong with a URDF or an SRDF: one sentence, never a traceback, a hang or a warning."""

from __future__ import annotations

import re
from pathlib import Path
from tempfile import TemporaryDirectory

from hypothesis import given, settings
from hypothesis import strategies as st

from spacearm.core.errors import SpacearmError
from spacearm.robot import load_robot
from support import srdf_text

URDF = srdf_text.two_arms_with_a_mass()
SRDF = srdf_text.two_arms_srdf().replace(
    "</robot>",
    '<link_sphere_approximation link="left_tool"><sphere center="0 0 0" radius="0.1"/></link_sphere_approximation>'
    '<disable_default_collisions link="base"/><enable_collisions link1="base" link2="left_hand"/></robot>',
)

VALUES = [
    "",
    " ",
    "nan",
    "inf",
    "-1",
    "0",
    "1e308",
    "-1e200",
    "1e13",
    "1e-308",
    "0 0 0",
    "1 2 3 4",
    "1e300 0 0",
    "x",
    "é",
    "${x}",
]
VALUES += ["left", "base", "left_grip", "torso", "fixed", "floating", "prismatic", "0x10", "1_000", "a&#10;b", "&amp;", "1,2,3"]
TAGS = ["link", "joint", "group", "robot", "mimic", "sphere", "box", "mesh", "inertial", "a:b", "é"]
CHUNKS = [
    "\0",
    "<!--",
    "]]>",
    "<link name='q'/>",
    "<!DOCTYPE a [<!ENTITY e 'x'>]>",
    "&e;",
    "<",
    ">",
    '"',
    "\n",
    "é",
    "<group/>",
]
OPTIONS: list[dict[str, object]] = [
    {"group": "left"},
    {"group": "both", "tip": "left_tool"},
    {"tip": "left_tool", "fixed": {"left_grip": 0.02, "right_follow": -0.02}},
    {"group": "left_gripper", "self_collision": "computed"},
    {"tip": "left_tool", "velocity_limit": 1.0, "capsules_per_shape": 1},
]


@st.composite
def broken(draw: st.DrawFn, text: str) -> str:
    """A text in which up to three things were changed, left out, doubled or put in."""
    for _ in range(draw(st.integers(0, 3))):
        kind = draw(st.sampled_from(["value", "drop", "double", "cut", "attribute", "insert", "tag"]))
        if kind == "cut":
            at = draw(st.integers(0, len(text)))
            text = text[:at] + text[at + draw(st.integers(0, 40)) :]
        elif kind == "insert":
            at = draw(st.integers(0, len(text)))
            text = text[:at] + draw(st.sampled_from(CHUNKS)) + text[at:]
        else:
            pattern = {"value": r'(?<=")[^"<>]*(?=")', "attribute": r' \w+="[^"]*"', "tag": r"(?<=<)\w+"}.get(
                kind, r"<\w+[^<>]*/>"
            )
            places = [match.span() for match in re.finditer(pattern, text)]
            if not places:
                continue
            start, end = draw(st.sampled_from(places))
            new = {"value": st.sampled_from(VALUES), "tag": st.sampled_from(TAGS), "double": st.just(2 * text[start:end])}
            text = text[:start] + draw(new.get(kind, st.just(""))) + text[end:]
    return text


@settings(max_examples=30)
@given(broken(URDF), broken(SRDF), st.sampled_from(OPTIONS))
def test_broken_files_give_a_robot_or_one_sentence(urdf: str, srdf: str, options: dict[str, object]) -> None:
    with TemporaryDirectory() as directory:
        path, other = Path(directory) / "arm.urdf", Path(directory) / "arm.srdf"
        path.write_text(urdf)
        other.write_text(srdf)
        try:
            said = load_robot(path, srdf=other, **options).notes  # type: ignore[arg-type]
        except SpacearmError as error:
            said = (str(error),)
    for sentence in said:
        assert "\n" not in sentence
        assert len(sentence) < 1000
