"""What an SRDF says about a robot that it does not have."""

from __future__ import annotations

from typing import Any

from spacearm.checks import shown
from spacearm.errors import SpacearmError
from spacearm.robot.doctor.chart import Chart, suggestion
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
