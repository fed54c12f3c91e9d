"""The examination: every look, in turn, at one model."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any, Literal

from spacearm.errors import FileFormatError
from spacearm.reading import located, read_bytes
from spacearm.robot.doctor.balance import look_at_balance
from spacearm.robot.doctor.chart import Chart, Choices
from spacearm.robot.doctor.diagnosis import SEVERITIES, Diagnosis
from spacearm.robot.doctor.geometry import look_at_geometry
from spacearm.robot.doctor.limits import look_at_limits
from spacearm.robot.doctor.masses import look_at_masses
from spacearm.robot.doctor.numbers import look_at_numbers
from spacearm.robot.doctor.srdf_check import look_at_srdf, readable_srdf
from spacearm.robot.doctor.structure import look_at_structure
from spacearm.robot.doctor.touching import look_at_touching
from spacearm.robot.xml_root import xml_root

Base = Literal["fixed", "floating"]


def diagnose(
    path: str | os.PathLike[str],
    srdf: str | os.PathLike[str] | None = None,
    *,
    base: Base | None = None,
    choices: Choices | None = None,
) -> Diagnosis:
    """Say all that is wrong with a robot's model, and how to mend it.

    Other readers stop at the first error; this one goes on and lists what it can.

    Args:
        path: a URDF.
        srdf: an SRDF about the same robot.
        base: how it is to be held; a mass that is missing is an error with a base that floats, and good to know with one
            that is fixed. By default the SRDF's virtual joint decides, and where there is none it is a warning.
        choices: what the remedies would choose where nothing is stated.

    Raises:
        FileFormatError: a file that is missing, or holds no XML, no URDF, no SRDF; with other mistakes it is a finding.
        RobotError: a base of another kind.
    """
    content = read_bytes(path, what="a URDF")
    return examined(urdf_root(content, path), Path(path), srdf, base, choices or Choices())[1]


def urdf_root(content: bytes, path: str | os.PathLike[str]) -> Any:
    """Parse a URDF, with its comments.

    Raises:
        FileFormatError: no XML, or another file.
    """
    with located(path):
        root = xml_root(content, what="a URDF", root="robot", comments=True)
        if root.find("link") is None:
            raise FileFormatError("<robot> has no <link>, expected links and joints; is this an SRDF rather than a URDF?")
    return root


def examined(
    root: Any,
    path: Path,
    srdf: str | os.PathLike[str] | None,
    base: Base | None,
    choices: Choices,
    *,
    touching: bool = True,
) -> tuple[Chart, Diagnosis]:
    """Examine a model; return its chart, in which the remedies are, and the diagnosis.

    Args:
        root: of the URDF, with comments.
        path, srdf, base, choices: as in `diagnose`.
        touching: also look at which links meet, which takes longest and has no remedies.

    Raises:
        FileFormatError: an SRDF that is missing or none.
    """
    srdf_root = None
    if srdf is not None:
        content = read_bytes(srdf, what="an SRDF")
        with located(srdf):
            srdf_root = xml_root(content, what="an SRDF", root="robot")
            if srdf_root.find("link") is not None:
                raise FileFormatError("this holds <link> elements, expected an SRDF; is it the URDF?")
    chart = Chart(root, path, _base_of(srdf_root) if base is None else base, choices)
    mass, base_mass = _look(chart)
    read = None
    if srdf is not None:
        look_at_srdf(chart, srdf, srdf_root)
        read = readable_srdf(chart, srdf, srdf_root)
    if touching:
        copy = Chart(_copied(root), path, chart.base, choices)
        _look(copy)
        look_at_touching(chart, copy.cases, copy.root, read, srdf_root)
    findings = [case.finding for case in chart.cases]
    findings.sort(key=lambda finding: (SEVERITIES.index(finding.severity), finding.file != str(path), finding.line or 0))
    moving = sum(joint.get("type") in ("revolute", "continuous", "prismatic") for joint in root.findall("joint"))
    diagnosis = Diagnosis(
        source=str(path),
        srdf=None if srdf is None else str(srdf),
        name=root.get("name") or "",
        links=len(root.findall("link")),
        joints=len(root.findall("joint")),
        moving=moving,
        mass=mass,
        base_mass=base_mass,
        findings=tuple(dict.fromkeys(findings)),
    )
    return chart, diagnosis


def _look(chart: Chart) -> tuple[float | None, float | None]:
    look_at_numbers(chart)
    look_at_structure(chart)
    look_at_limits(chart)
    look_at_geometry(chart)
    return look_at_balance(chart, look_at_masses(chart))


def _copied(root: Any) -> Any:
    from lxml import etree  # pyright: ignore[reportAttributeAccessIssue] (compiled, no stubs)

    return xml_root(etree.tostring(root, encoding="utf-8"), what="a URDF", root="robot")


def _base_of(srdf_root: Any) -> Base | None:
    """Return how an SRDF's virtual joint holds the base."""
    if srdf_root is None:
        return None
    kinds = {joint.get("type") for joint in srdf_root.findall("virtual_joint")}
    return "floating" if "floating" in kinds else "fixed" if "fixed" in kinds else None
