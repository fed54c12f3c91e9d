"""XML from outside, read without fetching or expanding anything: the root of a URDF or an SRDF."""

from __future__ import annotations

import math
from typing import Any

from spacearm.errors import FileFormatError
from spacearm.robot.xml_repair import Repair, repaired


def xml_root(content: bytes, *, what: str, root: str, comments: bool = False) -> Any:
    """Parse a file as `xml_document` does, and return its root alone."""
    return xml_document(content, what=what, root=root, comments=comments)[0]


def xml_document(content: bytes, *, what: str, root: str, comments: bool = False) -> tuple[Any, tuple[Repair, ...]]:
    """Parse a file; return its root, and what had to be put right in it (`xml_repair`).

    The root is an lxml element without a default namespace, and without comments unless wanted. No entities are expanded, and
    a <!DOCTYPE> is dropped.

    Args:
        content: the file.
        what: what it should hold, for messages, as in "a URDF".
        root: the tag that its root should have.
        comments: whether they are to be kept, as for a file that is to be written again.

    Raises:
        FileFormatError: no XML, a xacro, or another root.
    """
    from lxml import etree  # pyright: ignore[reportAttributeAccessIssue] (compiled, no stubs)

    options = {"remove_comments": not comments, "remove_pis": not comments, "resolve_entities": False, "no_network": True}
    element, error, repairs = None, None, ()
    try:
        element = etree.fromstring(content, etree.XMLParser(**options))
    except etree.XMLSyntaxError as caught:
        error = caught
    if element is None or element.getroottree().docinfo.doctype:
        again = repaired(content)
        try:
            if again is not None:
                element, repairs = etree.fromstring(again[0], etree.XMLParser(**options)), again[1]
        except etree.XMLSyntaxError as caught:
            error = error or caught
    if element is None:
        reason, line = "it is cut off, or tags do not match", 1
        if error is not None:
            reason, line = " ".join(error.msg.split(", line")[0].split()), error.lineno or 1
        raise FileFormatError(f"line {line}: this is no XML ({reason}), expected {what}; correct the file")
    if any("xacro" in child.nsmap.get(child.prefix, "") and _matters(child) for child in element.iter(etree.Element)):
        made = what.split()[-1].lower()
        raise FileFormatError(f"this is a xacro, expected {what}; expand it first, as in: xacro arm.xacro > arm.{made}")
    name = etree.QName(element)
    if name.localname != root:
        raise FileFormatError(f"this is <{name.localname}>, expected {what}: <{root} name=...>; convert it first")
    if name.namespace:  # a default namespace is in every tag, where no reader looks for it
        for child in list(element.iter(f"{{{name.namespace}}}*")):
            child.tag = etree.QName(child).localname
        etree.cleanup_namespaces(element)  # or the tags would be in it again once written
    for child in element.iter(etree.Element):
        for key, value in child.attrib.items():
            if not value.isprintable():  # a name that breaks lines would break the messages about it
                child.set(key, " ".join("".join(c if c.isprintable() else " " for c in value).split()))
    return element, repairs


def _matters(element: Any) -> bool:
    """Whether an element is part of what is read, and not of how a robot looks or is simulated."""
    tags = {element.tag, *(above.tag for above in element.iterancestors())}
    return tags.isdisjoint(("visual", "material", "gazebo", "transmission", "ros2_control"))


def note_on_repairs(repairs: tuple[Repair, ...], what: str) -> tuple[str, ...]:
    """Say in one note what was put right in a file's XML, a kind once."""
    if not repairs:
        return ()
    kinds: dict[str, list[Repair]] = {}
    for repair in repairs:
        kinds.setdefault(repair.code, []).append(repair)
    said = []
    for same in kinds.values():
        others = f" and {len(same) - 1} more" if len(same) > 1 else ""
        said.append(f"{same[0].what} (line {same[0].line}{others}; {same[0].done})")
    return (f"{what} is no well-formed XML, and was read as urdfdom reads it: {', '.join(said)}",)


def xacro_left_in(text: str) -> bool:
    """Whether an attribute holds an expression that xacro would have replaced, as in "${length / 2}" or "$(find arm)"."""
    return "${" in text or "$(" in text


def numbers_in(text: str, *, finite: bool = True) -> list[float]:
    """Return the numbers of an attribute, parted by blanks; none if one is no number, or not finite where it must be."""
    words = text.split()
    if any("_" in word for word in words):  # Python reads 1_000, nobody else does
        return []
    try:
        numbers = [float(word) for word in words]
    except ValueError:
        return []
    return numbers if not any(map(math.isnan, numbers)) and (not finite or all(map(math.isfinite, numbers))) else []
