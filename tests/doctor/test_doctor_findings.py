"""The doctor names the one fault that a model has, where it is, and nothing else; and it goes on after the first."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from spacearm.core.errors import FileFormatError, RobotError, SpacearmError
from spacearm.doctor import Choices, diagnose
from spacearm.robot import load_robot
from support.doctor_text import (
    BASE,
    BASE_INERTIAL,
    COLLISION,
    FAULTS,
    FORE,
    HEALTHY,
    INERTIAL,
    UPPER,
    changed,
    codes,
    found_in,
    written,
)


def test_a_healthy_model_is_healthy(tmp_path: Path) -> None:
    found = found_in(tmp_path, HEALTHY)
    assert codes(found) == []
    assert found.healthy
    assert (found.name, found.links, found.joints, found.moving) == ("servicer", 4, 3, 2)
    assert (found.mass, found.base_mass) == (618, 600)
    load_robot(tmp_path / "arm.urdf")


@pytest.mark.parametrize("case", FAULTS)
def test_the_one_fault_is_named_and_no_other(case: str, tmp_path: Path) -> None:
    changes, code, severity, place = FAULTS[case]
    found = found_in(tmp_path, changed(*changes))
    assert codes(found) == [code]
    (finding,) = (one for one in found.findings if one.code == code)
    assert (finding.severity, place in finding.place) == (severity, True), finding
    assert finding.what
    assert finding.line is not None
    assert found.healthy == (severity == "note")


@pytest.mark.parametrize("case", [case for case, fault in FAULTS.items() if fault[2] != "error"])
def test_what_is_no_error_can_be_loaded(case: str, tmp_path: Path) -> None:
    load_robot(written(tmp_path, changed(*FAULTS[case][0])), tip="fore")


def test_the_line_is_that_of_the_fault(tmp_path: Path) -> None:
    text = changed((FORE, 'ixx="0.33 " ixy="0" ixz="0" iyy="0.33" iyz="0" izz="0.012"'))
    (finding,) = found_in(tmp_path, text).errors
    assert finding.line is not None
    assert 'ixx="0.33 "' in text.splitlines()[finding.line - 1]
    assert finding.value == "'0.33 '"
    assert finding.expected == "'0.33'"


@pytest.mark.parametrize(("text", "moment"), [("1.015", 1.015), ("1.015 ", 0.0)])
def test_pinocchio_drops_a_mass_whose_moment_ends_in_a_blank(
    text: str, moment: float, capfd: pytest.CaptureFixture[str]
) -> None:
    import pinocchio as pin  # pyright: ignore[reportMissingImports]

    model = pin.buildModelFromXML(changed(('ixx="1.015"', f'ixx="{text}"')))
    assert model.inertias[1].inertia[0, 0] == pytest.approx(moment)


def test_all_faults_are_found_at_once(tmp_path: Path) -> None:
    chosen = ["no velocity", "no mass in it", "two roots", "kg mm^2", "joint type", "no robot name"]
    text = changed(*(pair for case in chosen for pair in FAULTS[case][0]))
    assert {FAULTS[case][1] for case in chosen} <= set(codes(found_in(tmp_path, text)))


def test_a_loop_is_found_though_nothing_hangs_on_it(tmp_path: Path) -> None:
    ring = '<link name="a"/><link name="b"/>' + "".join(
        f'<joint name="{a}{b}" type="fixed"><parent link="{a}"/><child link="{b}"/></joint>' for a, b in ("ab", "ba")
    )
    found = found_in(tmp_path, changed(("</robot>", f"{ring}</robot>")))
    assert [finding.code for finding in found.errors] == ["loop"]


def test_a_root_that_the_base_floats_on_is_seen_through(tmp_path: Path) -> None:
    world = '<link name="world"/><joint name="free" type="floating"><parent link="world"/><child link="base"/></joint>'
    found = found_in(tmp_path, changed(("</robot>", f"{world}</robot>")))
    assert codes(found) == ["joint-holds-the-base"]
    assert found.base_mass == 600


def test_a_missing_mass_is_as_bad_as_the_base_makes_it(tmp_path: Path) -> None:
    path = written(tmp_path, changed((BASE_INERTIAL, "")))
    severities = [diagnose(path, base=base).findings[0].severity for base in ("floating", None, "fixed")]
    assert severities == ["error", "warning", "note"]
    for kind, severity in (("floating", "warning"), ("fixed", "note")):  # a floating one frees nothing unless asked to
        text = f'<robot name="a"><virtual_joint name="v" type="{kind}" parent_frame="w" child_link="base"/></robot>'
        found = diagnose(path, written(tmp_path, text, "a.srdf"))
        assert [one.severity for one in found.findings if one.code == "base-without-mass"] == [severity]


def test_a_model_without_any_mass_is_told_so_once(tmp_path: Path) -> None:
    text = changed(
        (BASE_INERTIAL, ""), (INERTIAL, ""), (HEALTHY.split('<link name="fore">')[1].split("<collision>")[0].strip(), "")
    )
    found = found_in(tmp_path, text)
    assert [(one.code, one.place) for one in found.warnings] == [("mass-missing", "the robot")]
    assert found.mass is None


def test_toys_and_placeholders_are_doubted(tmp_path: Path) -> None:
    toy = HEALTHY
    for old in ("600", "12", "6"):
        toy = changed((f'<mass value="{old}"/>', f'<mass value="{float(old) / 1e3}"/>'), text=toy)
    assert "mass-toy" in codes(found_in(tmp_path, toy))
    alike = HEALTHY
    for old in (BASE, UPPER, FORE):
        alike = changed((old, 'ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"'), text=alike)
    for old in ("600", "12", "6"):
        alike = changed((f'<mass value="{old}"/>', '<mass value="20"/>'), text=alike)
    assert "inertia-too-large" in codes(found_in(tmp_path, alike))
    small = alike.replace('izz="1"', 'izz="0.5"').replace('ixx="1"', 'ixx="0.3"').replace('iyy="1"', 'iyy="0.3"')
    small = small.replace('radius="0.07"', 'radius="0.2"').replace('radius="0.06"', 'radius="0.2"')
    assert "inertia-placeholder" in codes(found_in(tmp_path, small))


@pytest.mark.parametrize(("scale", "code"), [("1", []), ("1000", ["mesh-in-millimetres"])])
def test_a_mesh_in_millimetres_is_known_by_its_size(scale: str, code: list[str], tmp_path: Path) -> None:
    import trimesh

    mesh = trimesh.creation.cylinder(radius=0.07, height=1.0, sections=24)
    mesh.apply_translation((0, 0, 0.5))
    mesh.apply_scale(float(scale))
    mesh.export(tmp_path / "upper.stl")
    text = changed((COLLISION, '<collision><geometry><mesh filename="package://arm/upper.stl"/></geometry></collision>'))
    found = found_in(tmp_path, text)
    assert [one.code for one in found.warnings if one.code.startswith("mesh")] == code
    if not code:
        assert found.healthy


def test_a_mesh_that_is_none_is_told(tmp_path: Path) -> None:
    (tmp_path / "upper.stl").write_text("solid nothing")
    text = changed((COLLISION, '<collision><geometry><mesh filename="upper.stl"/></geometry></collision>'))
    assert codes(found_in(tmp_path, text)) == ["mesh-unreadable"]


def test_the_solid_of_a_mesh_is_that_of_its_shape(tmp_path: Path) -> None:
    import trimesh
    from lxml import etree  # pyright: ignore[reportAttributeAccessIssue]

    from spacearm.doctor.shape_checks import link_solid

    mesh = trimesh.creation.icosphere(subdivisions=2, radius=0.3)
    mesh.apply_scale((1, 2, 0.5))
    mesh.apply_translation((0.1, -0.4, 0.2))
    mesh.export(tmp_path / "body.stl")
    link = etree.fromstring(
        '<link><collision><geometry><mesh filename="body.stl" scale="2 1 1"/></geometry></collision></link>'
    )
    solid = link_solid(link, tmp_path)
    mesh.apply_scale((2, 1, 1))
    assert solid is not None
    assert solid.volume == pytest.approx(mesh.volume, rel=1e-6)
    np.testing.assert_allclose(solid.center, mesh.center_mass, rtol=1e-6)
    np.testing.assert_allclose(solid.moments, mesh.moment_inertia, rtol=1e-5, atol=1e-9)
    np.testing.assert_allclose([solid.low, solid.high], mesh.bounds, rtol=1e-6)


def test_the_solid_of_turned_shapes_is_that_of_their_meshes(tmp_path: Path) -> None:
    import trimesh
    from lxml import etree  # pyright: ignore[reportAttributeAccessIssue]

    from spacearm.doctor.shape_checks import link_solid

    link = etree.fromstring(
        '<link><collision><origin xyz="0.3 0 0" rpy="0.4 -0.3 1.1"/><geometry><cylinder radius="0.1" length="0.7"/></geometry>'
        '</collision><collision><origin xyz="-1 0.2 0" rpy="0 0.5 0"/><geometry><box size="0.2 0.3 0.4"/></geometry>'
        '</collision><collision><origin xyz="0 2 0"/><geometry><sphere radius="0.2"/></geometry></collision></link>'
    )
    solid = link_solid(link, tmp_path)
    parts = []
    for shape, xyz, rpy in (
        (trimesh.creation.cylinder(radius=0.1, height=0.7, sections=400), (0.3, 0, 0), (0.4, -0.3, 1.1)),
        (trimesh.creation.box((0.2, 0.3, 0.4)), (-1, 0.2, 0), (0, 0.5, 0)),
        (trimesh.creation.icosphere(subdivisions=5, radius=0.2), (0, 2, 0), (0, 0, 0)),
    ):
        T = trimesh.transformations.euler_matrix(*rpy, axes="sxyz")
        T[:3, 3] = xyz
        shape.apply_transform(T)
        parts.append(shape)
    whole: Any = trimesh.util.concatenate(parts)
    assert solid is not None
    assert solid.volume == pytest.approx(whole.volume, rel=1e-3)
    np.testing.assert_allclose(solid.center, whole.center_mass, atol=1e-3)
    np.testing.assert_allclose(solid.moments, whole.moment_inertia, rtol=2e-3, atol=1e-5)
    np.testing.assert_allclose([solid.low, solid.high], whole.bounds, atol=1e-3)


@pytest.mark.parametrize(
    ("text", "error"),
    [("", FileFormatError), ("robot: 1", FileFormatError), ("<robot/>", FileFormatError), ("<mujoco/>", FileFormatError)],
)
def test_what_is_no_urdf_is_refused(text: str, error: type[SpacearmError], tmp_path: Path) -> None:
    with pytest.raises(error, match=r"arm\.urdf"):
        diagnose(written(tmp_path, text))


def test_choices_and_bases_that_cannot_be_are_refused(tmp_path: Path) -> None:
    path = written(tmp_path, HEALTHY)
    with pytest.raises(RobotError, match="base is 'swims'"):
        diagnose(path, base="swims")  # pyright: ignore[reportArgumentType]
    with pytest.raises(SpacearmError, match="velocity_limit is 0"):
        Choices(velocity_limit=0)


def test_a_diagnosis_as_a_dict_is_plain(tmp_path: Path) -> None:
    import json

    found = found_in(tmp_path, changed(*FAULTS["no velocity"][0]))
    values = json.loads(json.dumps(found.as_dict()))
    assert values["healthy"] is False
    assert values["findings"][0]["code"] == "velocity-missing"
    assert values["findings"][0]["mendable"] is True
