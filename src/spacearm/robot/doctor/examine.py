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
from spacearm.robot.xml_repair import Repair
from spacearm.robot.xml_root import xml_document, xml_root

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
            that is fixed. By default it is one with an SRDF's fixed virtual joint, else a warning.
        choices: what the remedies would choose where nothing is stated.

    Raises:
        FileFormatError: a file that is missing, or holds no XML, no URDF, no SRDF; with other mistakes it is a finding.
        RobotError: a base of another kind.
    """
    root, repairs = urdf_root(read_bytes(path, what="a URDF"), path)
    return examined(root, Path(path), srdf, base, choices or Choices(), repairs=repairs)[1]


def urdf_root(content: bytes, path: str | os.PathLike[str]) -> tuple[Any, tuple[Repair, ...]]:
    """Parse a URDF, with its comments; also what had to be put right in its XML.

    Raises:
        FileFormatError: no XML, or another file.
    """
    with located(path):
        root, repairs = xml_document(content, what="a URDF", root="robot", comments=True)
        if root.find("link") is None:
            raise FileFormatError("<robot> has no <link>, expected links and joints; is this an SRDF rather than a URDF?")
    return root, repairs


def examined(
    root: Any,
    path: Path,
    srdf: str | os.PathLike[str] | None,
    base: Base | None,
    choices: Choices,
    *,
    touching: bool = True,
    repairs: tuple[Repair, ...] = (),
) -> tuple[Chart, Diagnosis]:
    """Examine a model; return its chart, in which the remedies are, and the diagnosis.

    Args:
        root: of the URDF, with comments.
        path, srdf, base, choices: as in `diagnose`.
        touching: also look at which links meet, which takes longest and has no remedies.
        repairs: what had to be put right in the URDF's XML; a copy of it is well formed.

    Raises:
        FileFormatError: an SRDF that is missing or none.
    """
    srdf_root, srdf_repairs = None, ()
    if srdf is not None:
        content = read_bytes(srdf, what="an SRDF")
        with located(srdf):
            srdf_root, srdf_repairs = xml_document(content, what="an SRDF", root="robot")
            if srdf_root.find("link") is not None:
                raise FileFormatError("this holds <link> elements, expected an SRDF; is it the URDF?")
    chart = Chart(root, path, _base_of(srdf_root) if base is None else base, choices)
    _look_at_repairs(chart, repairs)
    _look_at_repairs(chart, srdf_repairs, file=srdf)
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


def _look_at_repairs(chart: Chart, repairs: tuple[Repair, ...], *, file: object = None) -> None:
    """Report XML that is not well formed, though urdfdom reads it; a copy of the URDF is put right with it, an SRDF is not."""
    for repair in repairs:
        chart.found(
            "warning",
            repair.code,
            chart.root,
            f"the XML is not well formed: {repair.what}; urdfdom reads it, stricter readers refuse it",
            expected="well-formed XML",
            advice=f"mend the line; until then: {repair.done}" if file else repair.done,
            remedy=None if file else (lambda repair=repair: f"{repair.what}: {repair.done}"),
            place="the SRDF" if file else "the file",
            file=file,
            line=repair.line,
        )


def _copied(root: Any) -> Any:
    from lxml import etree  # pyright: ignore[reportAttributeAccessIssue] (compiled, no stubs)

    return xml_root(etree.tostring(root, encoding="utf-8"), what="a URDF", root="robot")


def _base_of(srdf_root: Any) -> Base | None:
    """Return how an SRDF's virtual joint holds the base; one that floats frees nothing unless the user asks for it."""
    if srdf_root is None:
        return None
    kinds = {joint.get("type") for joint in srdf_root.findall("virtual_joint")}
    return "fixed" if kinds == {"fixed"} else None
