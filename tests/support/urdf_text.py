"""URDF as text for tests: small writers, and a strategy that draws whole files."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from hypothesis import strategies as st

from spacearm.robot import Robot, load_urdf
from support.strategies import ANGLES, lengths

_KINDS = ("revolute", "revolute", "continuous", "prismatic", "fixed", "mimic")


def robot(*elements: str, name: str = "arm") -> str:
    """A <robot> of links and joints."""
    body = "\n".join(elements)
    return f'<?xml version="1.0"?>\n<robot name="{name}">\n{body}\n</robot>\n'


def link(name: str, *collisions: str) -> str:
    """A <link> with collision shapes."""
    return f'<link name="{name}">{"".join(collisions)}</link>'


def collision(shape: str, *, xyz: str = "0 0 0", rpy: str = "0 0 0") -> str:
    """A <collision> around a shape such as <sphere radius="1"/>."""
    return f'<collision><origin xyz="{xyz}" rpy="{rpy}"/><geometry>{shape}</geometry></collision>'


def joint(
    name: str,
    parent: str,
    child: str,
    *,
    kind: str = "revolute",
    xyz: str = "0 0 0",
    rpy: str = "0 0 0",
    axis: str | None = "0 0 1",
    limit: str | None = 'lower="-1" upper="1" velocity="1" effort="1"',
    extra: str = "",
) -> str:
    """A <joint> between two links."""
    parts = [f'<parent link="{parent}"/><child link="{child}"/><origin xyz="{xyz}" rpy="{rpy}"/>']
    if axis is not None and kind != "fixed":
        parts.append(f'<axis xyz="{axis}"/>')
    if limit is not None and kind != "fixed":
        parts.append(f"<limit {limit}/>")
    return f'<joint name="{name}" type="{kind}">{"".join(parts)}{extra}</joint>'


def chain(*joints: str, links: int | None = None, name: str = "arm") -> str:
    """A robot of links link_0, link_1, ... and the given joints."""
    count = len(joints) + 1 if links is None else links
    return robot(*(link(f"link_{i}") for i in range(count)), *joints, name=name)


def loaded(text: str, **options: Any) -> Robot:
    """What load_urdf makes of a text."""
    with TemporaryDirectory() as directory:
        path = Path(directory) / "arm.urdf"
        path.write_text(text)
        return load_urdf(path, **options)


def _numbers(values: tuple[float, ...]) -> str:
    return " ".join(repr(value) for value in values)


@st.composite
def urdfs(draw: st.DrawFn, min_joints: int = 2, max_joints: int = 12) -> str:
    """Trees with every kind of joint: fixed ones in between, any axis, mimics of mimics, elements shuffled.

    At least one joint moves. The last link is named "tip".
    """
    count = draw(st.integers(min_joints, max_joints))
    names = [f"link_{i}" for i in range(count)] + ["tip"]
    joints, moving = [], []
    for i in range(count):
        parent = draw(st.one_of(st.just(i), st.integers(0, i)))
        kind = draw(st.sampled_from(_KINDS if moving else _KINDS[:4]))
        extra, limit = "", 'lower="-2.5" upper="3.5" velocity="1.5" effort="1"'
        if kind == "mimic":
            kind = draw(st.sampled_from(["revolute", "prismatic"]))
            multiplier = draw(st.sampled_from([1.0, -1.0, 0.5, 2.0]))
            offset = draw(st.floats(-0.5, 0.5, allow_subnormal=False))
            leader = draw(st.sampled_from(moving))
            extra = f'<mimic joint="{leader}" multiplier="{multiplier}" offset="{offset}"/>'
            limit = 'lower="-1000" upper="1000" velocity="9" effort="1"'
        signs = st.sampled_from([-1.0, 0.0, 1.0])
        axis = draw(st.one_of(st.tuples(signs, signs, signs), st.tuples(lengths(), lengths(), lengths())))
        if max(map(abs, axis)) < 1e-3:
            axis = (0.0, 0.0, 1.0)
        name = f"joint_{i}"
        text = joint(
            name,
            names[parent],
            names[i + 1],
            kind=kind,
            xyz=_numbers(draw(st.tuples(lengths(), lengths(), lengths()))),
            rpy=_numbers(draw(st.tuples(ANGLES, ANGLES, ANGLES))),
            axis=_numbers(axis),
            limit=limit,
            extra=extra,
        )
        joints.append(text)
        if kind != "fixed":
            moving.append(name)
    elements = draw(st.permutations([*(link(name) for name in names), *joints]))
    return robot(*elements)
