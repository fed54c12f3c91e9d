"""XML from outside, read without fetching or expanding anything: the root of a URDF or an SRDF."""

from __future__ import annotations

import math
from typing import Any

from spacearm.errors import FileFormatError


def xml_root(content: bytes, *, what: str, root: str, comments: bool = False) -> Any:
    """Parse a file and return its root, an lxml element without a default namespace, and without comments unless wanted.

    Args:
        content: the file.
        what: what it should hold, for messages, as in "a URDF".
        root: the tag that its root should have.
        comments: whether they are to be kept, as for a file that is to be written again.

    Raises:
        FileFormatError: no XML, a xacro, or another root.
    """
    from lxml import etree  # pyright: ignore[reportAttributeAccessIssue] (compiled, no stubs)

    try:
        parser = etree.XMLParser(remove_comments=not comments, remove_pis=not comments, resolve_entities=False, no_network=True)
        element = etree.fromstring(content, parser)
    except etree.XMLSyntaxError as error:
        reason = " ".join(error.msg.split(", line")[0].split())
        raise FileFormatError(
            f"line {error.lineno or 1}: this is no XML ({reason}), expected {what}; correct the file"
        ) from None
    if any("xacro" in child.nsmap.get(child.prefix, "") for child in element.iter(etree.Element)):
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
    return element


def numbers_in(text: str) -> list[float]:
    """Return the numbers of an attribute, parted by blanks; none if one of them is no finite number."""
    try:
        numbers = [float(word) for word in text.split()]
    except ValueError:
        return []
    return numbers if all(map(math.isfinite, numbers)) else []
