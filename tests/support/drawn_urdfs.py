"""Drawn robots as files: URDF, SRDF and joint_limits.yaml, with mimics of every kind, limits from every source, odd XML."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import Any

import numpy as np

NONE = ("1e16", "1.79769e+308", "-1e16", "10000")
"""Limits that mean none."""


@dataclass(slots=True)
class DrawnFiles:
    """What was drawn.

    Attributes:
        urdf: well-formed.
        odd: the same with XML that is not well-formed, or well-formed as well.
        read_by_all: whether urdfdom of today reads the odd one.
        srdf, limits: the other files; "" if there is none.
        options: of load_robot.
    """

    urdf: str
    odd: bytes
    read_by_all: bool
    srdf: str = ""
    limits: str = ""
    options: dict[str, Any] = field(default_factory=dict)


def drawn_files(seed: int, number: int) -> DrawnFiles:
    """Draw the files of one robot from (seed, number)."""
    rng = np.random.default_rng((seed, number))
    count = int(rng.integers(1, 9))
    scale = float(10 ** rng.uniform(-3, 3))
    links = [f"link_{i}" for i in range(count + 1)]
    joints, moving = [], []
    for i in range(count):
        parent = links[i] if rng.random() < 0.8 else links[int(rng.integers(0, i + 1))]
        kind = str(rng.choice(["revolute", "revolute", "revolute", "continuous", "prismatic", "fixed"]))
        mimic = ""
        if moving and kind != "fixed" and rng.random() < 0.45:
            m = rng.choice([1, -1, 0.5, 2.5, -7, 1e-3, 40, 0.0]) * (1 if rng.random() < 0.5 else rng.uniform(0.5, 2))
            offset = 0.0 if rng.random() < 0.5 else rng.uniform(-0.3, 0.3)
            mimic = f'<mimic joint="{rng.choice(moving)}" multiplier="{m:.6g}" offset="{offset:.6g}"/>'
        joints.append(_joint(rng, f"j{i}", kind, parent, links[i + 1], scale, mimic))
        if kind != "fixed":
            moving.append(f"j{i}")
    elements = [f'<link name="{name}"/>' for name in links] + joints
    order = rng.permutation(len(elements)) if rng.random() < 0.3 else np.arange(len(elements))
    urdf = '<?xml version="1.0"?>\n<robot name="drawn">\n' + "\n".join(elements[i] for i in order) + "\n</robot>\n"
    odd, read_by_all = _made_odd(rng, urdf)
    limits = _limits_file(rng, moving) if moving and rng.random() < 0.4 else ""
    srdf = _srdf(rng, links, moving) if moving and rng.random() < 0.4 else ""
    return DrawnFiles(urdf, odd, read_by_all, srdf, limits, _options(rng, moving, links, bool(srdf)))


def _vector(rng: np.random.Generator, size: float) -> str:
    return " ".join(f"{x:.9g}" for x in rng.uniform(-size, size, 3))


def _joint(rng: np.random.Generator, name: str, kind: str, parent: str, child: str, scale: float, mimic: str) -> str:
    axis = (
        rng.choice(["1 0 0", "0 -1 0", "0 0 1", "1 1 0"])
        if rng.random() < 0.7
        else _vector(rng, float(10 ** rng.uniform(-2, 2)))
    )
    rpy = rng.choice(["0 0 0", "1.5707963267949 0 0", "0 0 3.14159265358979"]) if rng.random() < 0.5 else _vector(rng, 3.0)
    low, high = -float(10 ** rng.uniform(-2, 3)), float(10 ** rng.uniform(-2, 3))
    low, high = (f"{low:.6g}", f"{high:.6g}") if rng.random() < 0.8 else ("0", f"{high:.6g}")
    if rng.random() < 0.15:
        low, high = "-" + str(rng.choice(NONE)).lstrip("-"), str(rng.choice(NONE)).lstrip("-") if rng.random() < 0.7 else high
    velocity = f"{10 ** rng.uniform(-3, 2):.6g}" if rng.random() < 0.8 else str(rng.choice(["0", "-1", *NONE]))
    soft = ""
    if rng.random() < 0.15:
        ends = f'soft_lower_limit="{-rng.uniform(0, 3):.6g}" soft_upper_limit="{rng.uniform(0, 3):.6g}"'
        soft = f'<safety_controller k_velocity="1" {ends}/>'
    limit = f'<limit lower="{low}" upper="{high}" velocity="{velocity}" effort="1"/>' if kind != "fixed" else ""
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{_vector(rng, scale)}" rpy="{rpy}"/><axis xyz="{axis}"/>{limit}{soft}{mimic}</joint>'
    )


def _limits_file(rng: np.random.Generator, moving: list[str]) -> str:
    lines = ["joint_limits:"]
    for name in [joint for joint in moving if rng.random() < 0.7] or moving[:1]:
        lines.append(f"  {name}:")
        for kind in ("velocity", "acceleration"):
            if rng.random() < 0.7:
                lines += [
                    f"    has_{kind}_limits: {str(rng.random() < 0.8).lower()}",
                    f"    max_{kind}: {10 ** rng.uniform(-2, 2):.6g}",
                ]
        if rng.random() < 0.3:
            lines += [f"    min_position: {-rng.uniform(0, 2):.6g}", f"    max_position: {rng.uniform(0, 2):.6g}"]
    return "\n".join(lines) + "\n"


def _srdf(rng: np.random.Generator, links: list[str], moving: list[str]) -> str:
    some = [name for name in moving if rng.random() < 0.6] or moving[:1]
    values = "".join(f'<joint name="{name}" value="{rng.uniform(-1, 1):.6g}"/>' for name in some)
    parts = [
        f'<group name="all">{"".join(f"""<joint name="{name}"/>""" for name in moving)}</group>',
        f'<group name="some">{"".join(f"""<joint name="{name}"/>""" for name in some)}</group>',
        f'<group_state name="ready" group="all">{values}</group_state>',
    ]
    if rng.random() < 0.7:
        kind = rng.choice(["floating", "planar", "fixed"])
        parts.append(f'<virtual_joint name="v" type="{kind}" parent_frame="world" child_link="{links[0]}"/>')
    return '<robot name="drawn">' + "\n".join(parts) + "</robot>\n"


def _options(rng: np.random.Generator, moving: list[str], links: list[str], with_srdf: bool) -> dict[str, Any]:
    options: dict[str, Any] = {"tip": links[-1], "self_collision": "none"}
    for key in ("velocity_limit", "acceleration_limit"):
        form = rng.choice(["none", "number", "mapping", "both"], p=[0.15, 0.45, 0.2, 0.2])
        if form == "number":
            options[key] = float(10 ** rng.uniform(-2, 2))
        elif form == "mapping":
            options[key] = {name: float(10 ** rng.uniform(-2, 2)) for name in moving if rng.random() < 0.6}
        elif form == "both":
            options[key] = dict.fromkeys(moving, float(10 ** rng.uniform(-2, 2)))
    if rng.random() < 0.3:
        options["position_limits"] = {name: (-rng.uniform(0, 3), rng.uniform(0, 3)) for name in moving if rng.random() < 0.5}
    if with_srdf and rng.random() < 0.5:
        options["group"] = str(rng.choice(["all", "some"]))
    return options


def _made_odd(rng: np.random.Generator, urdf: str) -> tuple[bytes, bool]:
    """Change the XML, and not its meaning; return it and whether urdfdom of today reads it."""
    encoding, read_by_all = "utf-8", True
    body = urdf.removeprefix('<?xml version="1.0"?>\n')
    for what in rng.choice(11, size=int(rng.integers(0, 4)), replace=False):
        end = "\n</robot>\n"
        if what == 0:
            body = body.replace(end, f'\n<gazebo><sensor:camera name="c"/></gazebo>{end}')
        elif what == 1:
            body = body.replace("<link", "<!-- a -- b --->\n<link", 1)
        elif what == 2:
            body = body.replace(end, f'\n<gazebo note="R&D &nbsp; a < b">1 & 2 ]]> 3</gazebo>{end}')
        elif what == 3:
            body, encoding = body.replace(end, f"\n<!-- für -->{end}"), "latin-1"
        elif what == 4:
            body = body.replace('" type="', '"type="')
        elif what == 5:
            body, read_by_all = re.sub(r' upper="([^"]*)"', r' upper="\1" upper="0.123"', body), False
        elif what == 6:
            body, read_by_all = body + "done.\n", False
        elif what == 7:
            body = body.replace(end, f"\n<gazebo>\x0b</gazebo>{end}")
        elif what == 8:
            body = body.replace(end, f'\n<gazebo xlink:href="x"/>{end}')
        elif what == 9:
            body = "<!DOCTYPE robot>\n" + body
        else:
            body = body.replace("\n", "\r\n")
    head = str(rng.choice(["", '<?xml version="1.0"?>\n', '\n \n<?xml version="1.0" encoding="utf-8"?>\n', "\n\n"]))
    mark = b"\xef\xbb\xbf" if encoding == "utf-8" and rng.random() < 0.2 else b""
    return mark + (head + body).encode(encoding), read_by_all
