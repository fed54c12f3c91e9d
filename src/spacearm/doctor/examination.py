"""The examination: every check, in turn, of one model and its SRDF."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any, Literal

from spacearm.core.checks import shown
from spacearm.core.errors import FileFormatError, SpacearmError
from spacearm.core.reading import located, read_bytes
from spacearm.doctor.contact_checks import look_at_touching
from spacearm.doctor.diagnosis import SEVERITIES, Chart, Choices, Diagnosis, suggestion
from spacearm.doctor.limit_checks import look_at_limits
from spacearm.doctor.mass_checks import look_at_balance, look_at_masses
from spacearm.doctor.shape_checks import look_at_geometry
from spacearm.doctor.structure_checks import look_at_numbers, look_at_structure
from spacearm.robot.robot_xml import Repair, xml_document, xml_root
from spacearm.robot.srdf import Srdf, load_srdf

_LINKS = {
    "disable_collisions": ("link1", "link2"),
    "enable_collisions": ("link1", "link2"),
    "disable_default_collisions": ("link",),
    "link_sphere_approximation": ("link",),
    "end_effector": ("parent_link",),
    "virtual_joint": ("child_link",),
    "group/chain": ("base_link", "tip_link"),
    "group/link": ("name",),
}
_JOINTS = {"passive_joint": ("name",), "group/joint": ("name",), "group_state/joint": ("name",)}
_GROUPS = {"group_state": ("group",), "end_effector": ("group",), "group/group": ("name",)}
_STOPS = ("chain", "link", "joint", "group")  # inside a group: that cannot be loaded
_DOUBTFUL = ("group_state", "end_effector", "virtual_joint")


def readable_srdf(chart: Chart, path: Any, root: Any) -> Srdf | None:
    """Read an SRDF; None if it cannot be, which is then written down.

    Args:
        chart: of the robot that it is about.
        path: of the file.
        root: of its XML.
    """
    try:
        srdf = load_srdf(path)
    except SpacearmError as error:
        sentence = str(error).removeprefix(f"{path}: ")
        chart.found(
            "error",
            "srdf-broken",
            root,
            sentence,
            place="the SRDF",
            file=path,
            advice="correct it; which links meet is looked at by the SRDF once it can be read",
        )
        return None
    return srdf


def look_at_srdf(chart: Chart, path: Any, root: Any) -> None:
    """Find names in an SRDF that the robot does not have, each told once."""
    links = [link.get("name") for link in chart.links]
    joints = [joint.get("name") for joint in chart.joints]
    joints += [joint.get("name") for joint in root.findall("virtual_joint")]
    groups = [element.get("name") for element in root.findall("group")]
    for what, table, known in (("link", _LINKS, links), ("joint", _JOINTS, joints), ("group", _GROUPS, groups)):
        unknown: dict[str, list[Any]] = {}
        for tag, attributes in table.items():
            for element in root.findall(tag):
                for name in {(element.get(attribute) or "").strip() for attribute in attributes} - {"", *known}:
                    unknown.setdefault(name, []).append(element)
        for name, elements in unknown.items():
            _unknown(chart, path, what, name, elements, known)


def _unknown(chart: Chart, path: Any, what: str, name: str, elements: list[Any], known: list[str]) -> None:
    inside = [element for element in elements if element.tag in _STOPS and element.getparent().tag == "group"]
    states = [element for element in elements if element.tag in _DOUBTFUL or element.getparent().tag == "group_state"]
    element = (inside or states or elements)[0]
    others = f", as do {len(elements) - 1} more lines" if len(elements) > 1 else ""
    chart.found(
        "error" if inside else "warning" if states else "note",
        "srdf-unknown-name",
        element,
        f"<{element.tag}> names a {what} that is not there{others}",
        place=f"{what} {shown(name)}",
        file=path,
        expected=f"a {what} of the {'SRDF' if what == 'group' else 'URDF'}",
        advice=suggestion(name, known) or "remove it, or correct the name",
    )


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
        base: "fixed" or "floating"; a mass that is missing is an error with a base that floats, and good to know with one
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
