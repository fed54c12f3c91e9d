"""A healthy model of a small space robot as text, and what was found in one."""

from __future__ import annotations

from pathlib import Path

from spacearm.doctor import Choices, Diagnosis, diagnose

HEALTHY = """\
<?xml version="1.0"?>
<!-- a servicer
     with two links -->
<robot name="servicer">
  <link name="base">
    <inertial>
      <mass value="600"/>
      <inertia ixx="100" ixy="0" ixz="0" iyy="100" iyz="0" izz="100"/>
    </inertial>
    <collision>
      <geometry><box size="1 1 1"/></geometry>
    </collision>
  </link>
  <link name="upper">
    <inertial>
      <origin xyz="0 0 0.5"/>
      <mass value="12"/>
      <inertia ixx="1.015" ixy="0" ixz="0" iyy="1.015" iyz="0" izz="0.03"/>
    </inertial>
    <collision>
      <origin xyz="0 0 0.5"/>
      <geometry><cylinder radius="0.07" length="1"/></geometry>
    </collision>
  </link>
  <link name="fore">
    <inertial>
      <origin xyz="0 0 0.4"/>
      <mass value="6"/>
      <inertia ixx="0.33" ixy="0" ixz="0" iyy="0.33" iyz="0" izz="0.012"/>
    </inertial>
    <collision>
      <origin xyz="0 0 0.4"/> <!-- drawn in 2024 -->
      <geometry><cylinder radius="0.06" length="0.8"/></geometry>
    </collision>
  </link>
  <link name="hand"/>

  <joint name="shoulder" type="revolute">
    <parent link="base"/>
    <child link="upper"/>
    <origin xyz="0 0 0.6"/>
    <axis xyz="0 1 0"/>
    <limit lower="-1.5" upper="1.5" velocity="0.1" effort="50"/>
  </joint>
  <joint name="elbow" type="revolute">
    <parent link="upper"/>
    <child link="fore"/>
    <origin xyz="0 0 1.1"/>
    <axis xyz="0 1 0"/>
    <limit lower="-2.5" upper="2.5" velocity="0.1" effort="50"/>
  </joint>
  <joint name="flange" type="fixed">
    <parent link="fore"/>
    <child link="hand"/>
    <origin xyz="0 0 0.85"/>
  </joint>
</robot>
"""

UPPER = 'ixx="1.015" ixy="0" ixz="0" iyy="1.015" iyz="0" izz="0.03"'
FORE = 'ixx="0.33" ixy="0" ixz="0" iyy="0.33" iyz="0" izz="0.012"'
BASE = 'ixx="100" ixy="0" ixz="0" iyy="100" iyz="0" izz="100"'
_LIMIT = 'lower="-1.5" upper="1.5" velocity="0.1" effort="50"'
COLLISION = """<collision>
      <origin xyz="0 0 0.5"/>
      <geometry><cylinder radius="0.07" length="1"/></geometry>
    </collision>"""
INERTIAL = """<inertial>
      <origin xyz="0 0 0.5"/>
      <mass value="12"/>
      <inertia ixx="1.015" ixy="0" ixz="0" iyy="1.015" iyz="0" izz="0.03"/>
    </inertial>"""
BASE_INERTIAL = f"""<inertial>
      <mass value="600"/>
      <inertia {BASE}/>
    </inertial>"""
_TILTED = """<collision><origin xyz="0 0.5 0.5" rpy="-0.7854 0 0"/>
      <geometry><cylinder radius="0.07" length="1.4"/></geometry></collision>"""

FAULTS: dict[str, tuple[tuple[tuple[str, str], ...], str, str, str]] = {
    "blank after a moment": (((' ixx="1.015"', ' ixx="1.015 "'),), "number-with-blank", "error", "upper"),
    "blank after a limit": ((('lower="-1.5"', 'lower="-1.5 "'),), "number-with-blank", "warning", "shoulder"),
    "word for a number": ((('lower="-1.5"', 'lower="low"'),), "not-a-number", "error", "shoulder"),
    "decimal comma": ((('lower="-1.5"', 'lower="-1,5"'),), "not-a-number", "error", "shoulder"),
    "infinite limit": ((('upper="1.5"', 'upper="inf"'),), "limits-none", "warning", "shoulder"),
    "vast limits": ((('lower="-1.5" upper="1.5"', 'lower="-1e16" upper="1e16"'),), "limits-none", "warning", "shoulder"),
    "many turns": ((('lower="-1.5" upper="1.5"', 'lower="-3600" upper="3600"'),), "limits-in-doubt", "warning", "shoulder"),
    "vast velocity": (((' velocity="0.1"', ' velocity="1e16"'),), "velocity-none", "error", "shoulder"),
    "effort below 0": (((' effort="50"', ' effort="-1"'),), "effort-negative", "warning", "shoulder"),
    "no radius": (((' radius="0.07"', ""),), "number-missing", "error", "upper"),
    "box below 0": ((('size="1 1 1"', 'size="1 -1 1"'),), "size-not-positive", "error", "base"),
    "no robot name": (((' name="servicer"', ""),), "name-missing", "error", "robot"),
    "joint without a name": (((' name="flange"', ""),), "name-missing", "error", "joint"),
    "joint type": ((('name="flange" type="fixed"', 'name="flange" type="ball"'),), "joint-type-unknown", "error", "flange"),
    "planar": ((('name="flange" type="fixed"', 'name="flange" type="planar"'),), "joint-not-supported", "error", "flange"),
    "unknown link": ((('<child link="hand"/>', '<child link="hnad"/>'),), "link-unknown", "error", "flange"),
    "two parents": (
        (("</robot>", '<joint name="extra" type="fixed"><parent link="base"/><child link="hand"/></joint></robot>'),),
        "two-parents",
        "error",
        "extra",
    ),
    "two roots": ((('<link name="hand"/>', '<link name="hand"/><link name="stray"/>'),), "several-roots", "error", "robot"),
    "no limits": (((f"<limit {_LIMIT}/>", '<limit velocity="1" effort="1"/>'),), "limit-missing", "error", "shoulder"),
    "no lower limit": (((' lower="-1.5"', ""),), "limit-missing", "error", "shoulder"),
    "exchanged": ((('lower="-1.5" upper="1.5"', 'lower="1.5" upper="-1.5"'),), "limits-exchanged", "error", "shoulder"),
    "equal": ((('lower="-1.5" upper="1.5"', 'lower="0" upper="0"'),), "limits-equal", "warning", "shoulder"),
    "degrees": ((('lower="-1.5" upper="1.5"', 'lower="-90" upper="90"'),), "limits-in-degrees", "warning", "shoulder"),
    "no velocity": (((' velocity="0.1"', ""),), "velocity-missing", "error", "shoulder"),
    "velocity 0": (((' velocity="0.1"', ' velocity="0"'),), "velocity-zero", "error", "shoulder"),
    "velocity below 0": (((' velocity="0.1"', ' velocity="-1"'),), "velocity-negative", "error", "shoulder"),
    "velocity in degrees": (((' velocity="0.1"', ' velocity="57"'),), "velocity-in-doubt", "warning", "shoulder"),
    "no effort": (((' effort="50"', ""),), "effort-missing", "warning", "shoulder"),
    "effort 0": (((' effort="50"', ' effort="0"'),), "effort-zero", "note", "shoulder"),
    "no axis": ((('<axis xyz="0 1 0"/>', ""),), "axis-missing", "note", "shoulder"),
    "axis 0": ((('<axis xyz="0 1 0"/>', '<axis xyz="0 0 0"/>'),), "axis-zero", "error", "shoulder"),
    "long axis": ((('<axis xyz="0 1 0"/>', '<axis xyz="0 2 0"/>'),), "axis-not-unit", "note", "shoulder"),
    "origin in mm": ((('xyz="0 0 0.6"', 'xyz="0 0 600"'),), "origin-in-millimetres", "warning", "shoulder"),
    "origin in degrees": ((('xyz="0 0 0.6"', 'xyz="0 0 0.6" rpy="0 0 90"'),), "origin-in-degrees", "warning", "shoulder"),
    "mimic of nothing": (
        ((f"<limit {_LIMIT}/>", f'<limit {_LIMIT}/><mimic joint="x"/>'),),
        "mimic-of-nothing",
        "error",
        "shoulder",
    ),
    "mimic of itself": (
        ((f"<limit {_LIMIT}/>", f'<limit {_LIMIT}/><mimic joint="shoulder"/>'),),
        "mimic-circle",
        "error",
        "shoulder",
    ),
    "zero inertia": (((UPPER, 'ixx="0" iyy="0" izz="0"'),), "inertia-zero", "error", "upper"),
    "triangle": (
        ((UPPER, 'ixx="0.4" ixy="0" ixz="0" iyy="1.015" iyz="0" izz="0.03"'),),
        "inertia-not-physical",
        "error",
        "upper",
    ),
    "one moment 0": (((UPPER, 'ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="0"'),), "inertia-not-physical", "error", "upper"),
    "kg mm^2": (
        ((FORE, 'ixx="330000" ixy="0" ixz="0" iyy="330000" iyz="0" izz="12000"'),),
        "inertia-too-large",
        "warning",
        "fore",
    ),
    "t m^2": (
        ((FORE, 'ixx="33e-5" ixy="0" ixz="0" iyy="33e-5" iyz="0" izz="12e-6"'),),
        "inertia-too-small",
        "warning",
        "fore",
    ),
    "axes mixed up": (
        ((FORE, 'ixx="0.33" ixy="0" ixz="0" iyy="0.012" iyz="0" izz="0.33"'),),
        "inertia-too-large",
        "warning",
        "fore",
    ),
    "mass below 0": ((('<mass value="600"/>', '<mass value="-600"/>'),), "mass-negative", "error", "base"),
    "no mass in it": ((('<mass value="600"/>', ""),), "mass-missing", "error", "base"),
    "no inertial": (((INERTIAL, ""),), "mass-missing", "warning", "upper"),
    "base without mass": (((BASE_INERTIAL, ""),), "base-without-mass", "warning", "base"),
    "mass in tonnes": (
        (
            ('<mass value="6"/>', '<mass value="0.006"/>'),
            (FORE, 'ixx="33e-5" ixy="0" ixz="0" iyy="33e-5" iyz="0" izz="12e-6"'),
        ),
        "mass-too-small",
        "warning",
        "fore",
    ),
    "com in mm": (
        (('<origin xyz="0 0 0.4"/>\n      <mass', '<origin xyz="0 0 400"/>\n      <mass'),),
        "mass-outside",
        "warning",
        "fore",
    ),
    "light base": (
        (('value="600"', 'value="6"'), (BASE, 'ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"')),
        "arm-heavier-than-base",
        "note",
        "base",
    ),
    "products' signs": (
        (
            (COLLISION, _TILTED),
            (UPPER, 'ixx="1.9" ixy="0" ixz="0" iyy="1" iyz="0.9" izz="1"'),
            ('<origin xyz="0 0 0.5"/>', '<origin xyz="0 0.5 0.5"/>'),
            ('<origin xyz="0 0 1.1"/>', '<origin xyz="0 1.15 1.15"/>'),
        ),
        "inertia-sign",
        "warning",
        "upper",
    ),
    "dead mesh": (
        ((COLLISION, '<collision><geometry><mesh filename="no.stl"/></geometry></collision>'),),
        "mesh-missing",
        "error",
        "upper",
    ),
    "dead package": (
        ((COLLISION, f'<visual><geometry><mesh filename="package://a/b.dae"/></geometry></visual>{COLLISION}'),),
        "mesh-missing",
        "warning",
        "upper",
    ),
    "unknown shape": (
        ((COLLISION, '<collision><geometry><ellipsoid radii="1 1 1"/></geometry></collision>'),),
        "shape-unknown",
        "error",
        "upper",
    ),
    "a capsule": (
        ((COLLISION, COLLISION.replace("cylinder", "capsule")),),
        "capsule-uncommon",
        "note",
        "upper",
    ),
    "no collision shape": (
        ((COLLISION, COLLISION.replace("collision", "visual")),),
        "collision-missing",
        "warning",
        "upper",
    ),
    "no shape": (((COLLISION, ""),), "shape-missing", "warning", "upper"),
    "always meet": (
        (('xyz="0 0 0.6"', 'xyz="0 0 0.3"'), ('xyz="0 0 1.1"', 'xyz="0 0.2 -0.1"')),
        "pair-always-meets",
        "error",
        "base",
    ),
    "two tips": (
        (
            (
                "</robot>",
                '<link name="palm"/><joint name="e" type="fixed"><parent link="fore"/><child link="palm"/></joint></robot>',
            ),
            ('<link name="hand"/>', '<link name="paw"/>'),
            ('<child link="hand"/>', '<child link="paw"/>'),
        ),
        "tip-ambiguous",
        "note",
        "robot",
    ),
}
"""Cases: what is changed in the healthy model, and the code, the severity and a word of the place of what is then found."""

ALWAYS = {"acceleration-unstated", "not-examined"}
"""Notes that every model with a moving joint gets, and that a model gets whose links are nowhere."""


def changed(*pairs: tuple[str, str], text: str = HEALTHY) -> str:
    """The healthy model with pieces replaced, each of which must be there."""
    for old, new in pairs:
        assert old in text, old
        text = text.replace(old, new, 1)
    return text


def written(folder: Path, text: str, name: str = "arm.urdf") -> Path:
    """Put a text into a file."""
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def codes(found: Diagnosis) -> list[str]:
    """The codes found, in order, each once, without those that every model gets."""
    return list(dict.fromkeys(finding.code for finding in found.findings if finding.code not in ALWAYS))


def found_in(folder: Path, text: str, srdf: str | None = None, *, choices: Choices | None = None) -> Diagnosis:
    """Diagnose a text."""
    path = written(folder, text)
    return diagnose(path, None if srdf is None else written(folder, srdf, "arm.srdf"), choices=choices)
