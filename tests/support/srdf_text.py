"""SRDF as text for tests, and a robot with two arms, grippers and all, to go with it."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from spacearm.robot import Robot, load_robot
from support import urdf_text
from support.urdf_text import collision, joint, link


def srdf(*elements: str, name: str = "arm") -> str:
    """An SRDF's <robot>."""
    body = "\n".join(elements)
    return f'<?xml version="1.0"?>\n<robot name="{name}">\n{body}\n</robot>\n'


def disabled(first: str, second: str) -> str:
    """A pair that may touch."""
    return f'<disable_collisions link1="{first}" link2="{second}" reason="Adjacent"/>'


def group(name: str, *, chain: tuple[str, str] | None = None, **names: tuple[str, ...]) -> str:
    """A <group>: chain=(base, tip), joints=(...), links=(...), groups=(...)."""
    parts = [] if chain is None else [f'<chain base_link="{chain[0]}" tip_link="{chain[1]}"/>']
    for tag, members in names.items():
        parts += [f'<{tag.removesuffix("s")} name="{member}"/>' for member in members]
    return f'<group name="{name}">{"".join(parts)}</group>'


def state(name: str, group: str, **values: float) -> str:
    """A <group_state>."""
    joints = "".join(f'<joint name="{joint}" value="{value}"/>' for joint, value in values.items())
    return f'<group_state name="{name}" group="{group}">{joints}</group_state>'


def two_arms() -> str:
    """A URDF: a torso, and on each side an arm of three joints with a hand of two fingers, the second a mimic."""
    rod = collision('<cylinder radius="0.05" length="0.5"/>', xyz="0 0 0.25")
    ball = collision('<sphere radius="0.06"/>')
    parts = [link("base"), link("torso", collision('<box size="0.2 0.3 0.6"/>', xyz="0 0 0.3"))]
    parts.append(joint("mount", "base", "torso", kind="fixed"))
    finger = 'lower="0.01" upper="0.05" velocity="1"'
    for side, y in (("left", 0.25), ("right", -0.25)):
        parts += [link(f"{side}_{name}", rod) for name in ("upper", "fore")]
        parts += [link(f"{side}_hand", ball), link(f"{side}_tool")]
        parts += [link(f"{side}_{name}", collision('<box size="0.01 0.02 0.06"/>')) for name in ("thumb", "finger")]
        wide = 'lower="-3" upper="3" velocity="1"'
        parts += [
            joint(f"{side}_shoulder", "torso", f"{side}_upper", xyz=f"0 {y} 0.5", axis="0 1 0", limit=wide),
            joint(f"{side}_elbow", f"{side}_upper", f"{side}_fore", xyz="0 0 0.5", axis="1 0 0", limit=wide),
            joint(f"{side}_wrist", f"{side}_fore", f"{side}_hand", xyz="0 0 0.5", axis="0 0 1", kind="continuous"),
            joint(f"{side}_flange", f"{side}_hand", f"{side}_tool", xyz="0 0 0.1", kind="fixed"),
            joint(f"{side}_grip", f"{side}_hand", f"{side}_thumb", kind="prismatic", xyz="0 0 0.1", axis="1 0 0", limit=finger),
            joint(
                f"{side}_follow",
                f"{side}_hand",
                f"{side}_finger",
                kind="prismatic",
                xyz="0 0 0.1",
                axis="1 0 0",
                limit='lower="-0.05" upper="-0.01" velocity="1"',
                extra=f'<mimic joint="{side}_grip" multiplier="-1"/>',
            ),
        ]
    return urdf_text.robot(*parts, name="two_arms")


def two_arms_with_a_mass() -> str:
    """The same, its torso with an <inertial>."""
    mass = '<inertial><origin xyz="0 0 1" rpy="0 0 1"/><mass value="2"/><inertia ixx="1" iyy="1" izz="1"/></inertial>'
    return two_arms().replace('<link name="torso">', f'<link name="torso">{mass}')


def two_arms_srdf() -> str:
    """The SRDF of the same."""
    parts = [group(side, chain=("torso", f"{side}_tool")) for side in ("left", "right")]
    parts += [group("both", groups=("left", "right"))]
    parts += [group(f"{side}_gripper", joints=(f"{side}_grip",)) for side in ("left", "right")]
    parts += [
        state("ready", "left", left_shoulder=0.5, left_elbow=-0.5, left_wrist=1),
        state("ready", "right", right_shoulder=0.25, right_elbow=-0.25, right_wrist=2),
        state("open", "left_gripper", left_grip=0.05),
        '<virtual_joint name="world" type="fixed" parent_frame="world" child_link="base"/>',
    ]
    for side in ("left", "right"):
        parts += [
            disabled("torso", f"{side}_upper"),
            disabled(f"{side}_upper", f"{side}_fore"),
            disabled(f"{side}_fore", f"{side}_hand"),
            disabled(f"{side}_hand", f"{side}_thumb"),
            disabled(f"{side}_hand", f"{side}_finger"),
            disabled(f"{side}_thumb", f"{side}_finger"),
            f'<end_effector name="{side}_gripper" group="{side}_gripper" parent_link="{side}_tool" parent_group="{side}"/>',
        ]
    return srdf(*parts, name="two_arms")


def loaded(urdf: str, srdf: str | None = None, **options: Any) -> Robot:
    """What load_robot makes of two texts."""
    with TemporaryDirectory() as directory:
        path = Path(directory) / "arm.urdf"
        path.write_text(urdf)
        if srdf is not None:
            (Path(directory) / "arm.srdf").write_text(srdf)
            options["srdf"] = Path(directory) / "arm.srdf"
        return load_robot(path, **options)
