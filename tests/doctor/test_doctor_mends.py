"""The corrected copy: healthier, otherwise as it was, and never over something that is there."""

from __future__ import annotations

import difflib
import math
import random
from pathlib import Path

import numpy as np
import pytest

from spacearm.core.errors import FileFormatError, OutputError
from spacearm.doctor import Choices, diagnose, mend_urdf
from spacearm.robot import load_robot
from support.doctor_text import FAULTS, HEALTHY, changed, codes, written

# Those whose code is another one afterwards: what was 0 or missing is now said to be unknown.
_LEAVES = {"no effort": ["effort-zero"], "vast limits": ["continuous"]}
_MENDED = (
    *("blank after a moment", "blank after a limit", "decimal comma", "no robot name", "no limits", "no lower limit"),
    *(
        "exchanged",
        "degrees",
        "vast limits",
        "vast velocity",
        "no velocity",
        "velocity 0",
        "velocity below 0",
        "no effort",
        "no axis",
        "long axis",
    ),
    *("origin in degrees", "zero inertia", "triangle", "one moment 0", "kg mm^2", "t m^2", "axes mixed up"),
    *("products' signs", "no collision shape"),
)


def test_a_healthy_model_is_copied_to_the_byte(tmp_path: Path) -> None:
    path = written(tmp_path, HEALTHY)
    mended = mend_urdf(path, tmp_path / "copy.urdf")
    assert mended.changes == ()
    assert (tmp_path / "copy.urdf").read_text() == HEALTHY


@pytest.mark.parametrize("case", FAULTS)
def test_what_can_be_mended_is_and_the_rest_stays(case: str, tmp_path: Path) -> None:
    text = changed(*FAULTS[case][0])
    path = written(tmp_path, text)
    mended = mend_urdf(path, tmp_path / "copy.urdf")
    assert path.read_text() == text
    assert bool(mended.changes) == (case in _MENDED)
    assert bool(mended.before.mendable) == (case in _MENDED)
    assert codes(mended.after) == (_LEAVES.get(case, []) if case in _MENDED else codes(mended.before))
    assert diagnose(tmp_path / "copy.urdf") == mended.after
    copy = (tmp_path / "copy.urdf").read_text()
    assert "<!-- a servicer\n     with two links -->" in copy
    assert "<!-- drawn in 2024 -->" in copy
    if case in _MENDED:
        load_robot(tmp_path / "copy.urdf", tip="hand")
        touched = [line for line in difflib.ndiff(text.splitlines(), copy.splitlines()) if line[0] in "+-"]
        assert len(touched) <= 12


def test_each_change_says_its_line_and_what_was_chosen(tmp_path: Path) -> None:
    text = changed((' velocity="0.1"', ""))
    mended = mend_urdf(written(tmp_path, text), tmp_path / "copy.urdf", choices=Choices(velocity_limit=0.02))
    (change,) = mended.changes
    assert change.line == text.splitlines().index('  <joint name="shoulder" type="revolute">') + 1
    assert (change.place, change.code) == ("joint 'shoulder'", "velocity-missing")
    assert change.what == "<limit velocity>: was missing -> '0.02' (chosen: 0.02 rad/s)"
    assert load_robot(tmp_path / "copy.urdf").velocity[0] == 0.02


def test_an_inertia_is_that_of_the_shape_filled_with_the_mass(tmp_path: Path) -> None:
    path = written(tmp_path, changed(*FAULTS["triangle"][0]))
    mend_urdf(path, tmp_path / "copy.urdf")
    body = next(body for body in load_robot(tmp_path / "copy.urdf").bodies if body.name == "upper")
    m, r, h = 12.0, 0.07, 1.0
    across, along = m * (3 * r * r + h * h) / 12, m * r * r / 2
    np.testing.assert_allclose(np.sort(np.linalg.eigvalsh(body.inertia)), sorted([across, across, along]), rtol=1e-7)


def test_degrees_become_radians(tmp_path: Path) -> None:
    mend_urdf(written(tmp_path, changed(*FAULTS["degrees"][0])), tmp_path / "copy.urdf")
    robot = load_robot(tmp_path / "copy.urdf")
    np.testing.assert_allclose([robot.lower[0], robot.upper[0]], [-math.pi / 2, math.pi / 2], rtol=1e-7)


def test_links_without_a_mass_get_one_where_a_density_is_given(tmp_path: Path) -> None:
    path = written(tmp_path, changed(*FAULTS["no inertial"][0]))
    mended = mend_urdf(path, tmp_path / "copy.urdf", choices=Choices(density=1000))
    assert codes(mended.after) == []
    assert mended.after.mass == pytest.approx(606 + 1000 * math.pi * 0.07**2, rel=1e-6)
    bare = HEALTHY.replace("inertial>", "nothing>")
    mended = mend_urdf(written(tmp_path, bare, "bare.urdf"), tmp_path / "full.urdf", choices=Choices(density=100))
    assert mended.before.mass is None
    assert mended.after.mass == pytest.approx(100 * (1 + math.pi * (0.07**2 + 0.8 * 0.06**2)), rel=1e-6)


def test_a_root_that_the_base_floats_on_is_taken_out(tmp_path: Path) -> None:
    world = '  <link name="world"/>\n  <joint name="free" type="floating"><parent link="world"/><child link="base"/></joint>\n'
    path = written(tmp_path, changed(("</robot>", f"{world}</robot>")))
    mended = mend_urdf(path, tmp_path / "copy.urdf")
    assert mended.after.healthy
    assert load_robot(tmp_path / "copy.urdf").frame("base").joint == -1


def test_several_faults_at_once_leave_what_needs_a_drawing(tmp_path: Path) -> None:
    text = changed(('<limit lower="-1.5" upper="1.5" velocity="0.1" effort="50"/>', ""), *FAULTS["triangle"][0])
    text = changed(("</robot>", '<link name="stray"/></robot>'), text=text)
    mended = mend_urdf(written(tmp_path, text), tmp_path / "copy.urdf")
    assert codes(mended.after) == ["several-roots", "effort-zero"]
    assert len(mended.changes) == 4


def test_meshes_are_found_from_the_copys_directory(tmp_path: Path) -> None:
    import trimesh

    (tmp_path / "a" / "meshes").mkdir(parents=True)
    (tmp_path / "b" / "c").mkdir(parents=True)
    trimesh.creation.box((0.1, 0.1, 1)).export(tmp_path / "a" / "meshes" / "rod.stl")
    mesh = '<geometry><mesh filename="{}"/></geometry>'
    for name in ("meshes/rod.stl", "package://arm/meshes/rod.stl", "lost/rod.stl"):
        text = changed(('<geometry><cylinder radius="0.07" length="1"/></geometry>', mesh.format(name)))
        path = written(tmp_path / "a", text)
        mended = mend_urdf(path, tmp_path / "b" / "c" / "copy.urdf", overwrite=True)
        assert mended.after.healthy
        assert 'filename="../../a/meshes/rod.stl"' in (tmp_path / "b" / "c" / "copy.urdf").read_text()


def test_nothing_is_overwritten_unasked_and_the_input_never(tmp_path: Path) -> None:
    path = written(tmp_path, HEALTHY)
    other = written(tmp_path, "mine", "other.urdf")
    for target, overwrite, why in (
        (path, True, "the model itself"),
        (other, False, "exists"),
        (tmp_path, True, "is a directory"),
        (tmp_path / "no" / "copy.urdf", False, "cannot be written"),
    ):
        with pytest.raises(OutputError, match=why):
            mend_urdf(path, target, overwrite=overwrite)
    assert (path.read_text(), other.read_text()) == (HEALTHY, "mine")
    mend_urdf(path, other, overwrite=True)
    assert other.read_text() == HEALTHY


@pytest.mark.parametrize("encoding", ["iso-8859-1", "utf-16"])
def test_other_encodings_and_line_ends_are_kept_readable(encoding: str, tmp_path: Path) -> None:
    text = changed(('<?xml version="1.0"?>', f'<?xml version="1.0" encoding="{encoding}"?>'), ("drawn", "gezeichnet für"))
    path = tmp_path / "arm.urdf"
    path.write_bytes(changed((' velocity="0.1"', ""), text=text).encode(encoding))
    mended = mend_urdf(path, tmp_path / "copy.urdf")
    assert mended.after.healthy
    path.write_bytes(HEALTHY.replace("\n", "\r\n").encode())
    mend_urdf(path, tmp_path / "lines.urdf")
    assert (tmp_path / "lines.urdf").read_bytes() == HEALTHY.replace("\n", "\r\n").encode()


@pytest.mark.parametrize("seed", range(60))
def test_garbage_gives_a_diagnosis_or_one_sentence(seed: int, tmp_path: Path) -> None:
    rng = random.Random(seed)
    text = HEALTHY
    pieces = [
        '"',
        "<",
        ">",
        "0",
        "-1",
        "nan",
        "1e999",
        "",
        " ",
        "inf",
        "<joint/>",
        "<link/>",
        "&#10;",
        "é",
        "/>",
        'name="base"',
    ]
    words = [
        "fixed",
        "floating",
        "planar",
        "mesh",
        "box",
        "base",
        "hand",
        "upper",
        "1e300",
        "0",
        "x",
        "-5",
        "1,5",
        "--",
        "mimic",
    ]
    for _ in range(rng.randint(1, 6)):
        if rng.random() < 0.3:
            at = rng.randrange(len(text))
            text = text[:at] + rng.choice(pieces) + text[at + rng.randint(0, 3) :]
        else:
            inside = text.split('"')
            at = rng.randrange(1, len(inside), 2) if len(inside) > 2 else 0
            inside[at] = rng.choice(words)
            text = '"'.join(inside)
    path = written(tmp_path, text)
    try:
        mended = mend_urdf(path, tmp_path / "copy.urdf", choices=Choices(density=500))
    except FileFormatError:
        return
    assert len(mended.after.errors) <= len(mended.before.errors)
    assert not {finding.code for finding in mended.after.mendable if finding.severity == "error"}
    assert all("\n" not in finding.what + finding.value + finding.advice for finding in mended.before.findings)
