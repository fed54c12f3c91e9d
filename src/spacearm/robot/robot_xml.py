"""XML from outside: the root of a URDF or an SRDF, read without fetching or expanding anything.

urdfdom, and so ROS and Pinocchio, reads files that are not well formed. It uses tinyxml2, which knows no namespaces, expands no
entities of its own, and takes for text what it does not know. What it takes is made well formed here with the same meaning,
piece by piece, and each repair is recorded with its line. What it refuses, such as tags that do not match, is left for the
strict parser to refuse. Line numbers stay.
"""

from __future__ import annotations

import codecs
import math
import re
from dataclasses import dataclass, field
from typing import Any

from spacearm.core.errors import FileFormatError

_NAME = r"[A-Za-z_:\u0080-\U0010ffff][-A-Za-z0-9_:.\u0080-\U0010ffff]*"
_TAG = re.compile(rf"<(/?)({_NAME})")
_ATTRIBUTE = re.compile(rf"(\s*)({_NAME})(\s*=\s*)([\"'])")
_TAG_END = re.compile(r"\s*(/?)>")
_AMPERSAND = re.compile(r"&(?!(?:amp|lt|gt|quot|apos);|#(?:x[0-9A-Fa-f]{1,6}|[0-9]{1,7});)")
_REFERENCE = re.compile(r"&#(?:x([0-9A-Fa-f]+)|([0-9]+));")
_BLANKS = " \t\r\n"
_CONTROL = re.compile("[\x01-\x08\x0b\x0c\x0e-\x1f\ufffe\uffff\ud800-\udfff]")
_DECLARED = re.compile(rb"<\?xml[^>]{0,200}?encoding\s*=\s*[\"']([A-Za-z0-9._-]+)[\"']")
_MARKS = (
    (codecs.BOM_UTF8, "utf-8"),
    (codecs.BOM_UTF32_LE, "utf-32"),
    (codecs.BOM_UTF32_BE, "utf-32"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Repair:
    """One thing that was put right.

    Attributes:
        code: what kind of thing, as in "xml-prefix".
        line: where it is in the file.
        what: what was there, without a full stop.
        done: what was done with it.
    """

    code: str
    line: int
    what: str
    done: str


def xml_root(content: bytes, *, what: str, root: str, comments: bool = False) -> Any:
    """Parse a file as `xml_document` does, and return its root alone."""
    return xml_document(content, what=what, root=root, comments=comments)[0]


def xml_document(content: bytes, *, what: str, root: str, comments: bool = False) -> tuple[Any, tuple[Repair, ...]]:
    """Parse a file; return its root, and the repairs that it needed (`Repair`).

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


@dataclass(slots=True)
class _Scan:
    """A text being read, and what was written of it so far."""

    text: str
    at: int = 0
    out: list[str] = field(default_factory=list)
    repairs: list[Repair] = field(default_factory=list)
    counted: tuple[int, int] = (0, 1)
    missing: dict[str, int] = field(default_factory=dict)
    scopes: list[set[str]] = field(default_factory=list)
    root_ends: int = -1

    def line(self, at: int) -> int:
        """Return the line of a place; places come in order."""
        before, line = self.counted
        line += self.text.count("\n", before, at) if at >= before else 0
        self.counted = (max(at, before), line)
        return line

    def mended(self, code: str, at: int, what: str, done: str) -> None:
        self.repairs.append(Repair(code=code, line=self.line(at), what=what, done=done))


def repaired(content: bytes) -> tuple[bytes, tuple[Repair, ...]] | None:
    """Return XML as well-formed UTF-8 without a declaration, and what was put right; None where that cannot be done.

    Args:
        content: the file.
    """
    repairs: list[Repair] = []
    text = _decoded(content, repairs)
    if text is None or "\0" in text:
        return None
    scan = _Scan(text.replace("\r\n", "\n").replace("\r", "\n"), repairs=repairs)
    if not _prologue(scan) or not _elements(scan):
        return None
    _epilogue(scan)
    body = "".join(scan.out)
    if scan.missing:
        body = _with_prefixes(scan, body)
    return body.encode("utf-8"), tuple(sorted(scan.repairs, key=lambda repair: repair.line))


def _decoded(content: bytes, repairs: list[Repair]) -> str | None:
    """Decode a file by its mark, else by what it declares, else as UTF-8, else as Latin-1, which takes every byte."""
    for mark, encoding in _MARKS:
        if content.startswith(mark):
            try:
                return content.decode(encoding).removeprefix("\ufeff")
            except UnicodeDecodeError:
                if encoding != "utf-8":
                    return None
                content = content[len(mark) :]
                break
    if content[:2] in (b"<\0", b"\0<"):
        return None
    declared = _DECLARED.search(content[:1000])
    named = "utf-8" if declared is None else declared[1].decode("ascii")
    try:
        encoding = codecs.lookup(named).name
        if not "<?xml".encode(encoding).startswith(b"<?xml"):  # it says UTF-16, and its own declaration is none
            raise LookupError
        return content.decode(encoding)
    except (LookupError, UnicodeError):
        pass
    try:
        text = content.decode("utf-8")
        repairs.append(Repair(code="xml-encoding", line=1, what=f"it declares the encoding {named!r}", done="read as UTF-8"))
    except UnicodeDecodeError as error:
        text = (
            content.decode("cp1252", "replace")
            if not re.search(rb"[\x81\x8d\x8f\x90\x9d]", content)
            else content.decode("latin-1")
        )
        line = content.count(b"\n", 0, error.start) + 1
        what = f"bytes that are not {'UTF-8' if declared is None else named}"
        repairs.append(Repair(code="xml-encoding", line=line, what=what, done="read as Latin-1"))
    return text


def _prologue(scan: _Scan) -> bool:
    """Keep what may stand before the root element, drop the rest; False where no element begins."""
    text, first = scan.text, True
    while scan.at < len(text):
        begin = text.find("<", scan.at)
        if begin < 0:
            return False
        between = text[scan.at : begin]
        if between.strip(_BLANKS):
            scan.mended("xml-text-outside", scan.at, "text before the first element", "left out")
            first = False
        elif between and text.startswith("<?xml", begin) and first:
            scan.mended("xml-declaration", begin, "something blank before <?xml", "the blank left out")
        scan.out.append("\n" * between.count("\n") if between.strip(_BLANKS) else between)
        scan.at = begin
        if _TAG.match(text, begin):
            return True
        if text.startswith("<?", begin):
            if not _declaration(scan, first):
                return False
        elif text.startswith("<!--", begin):
            if not _comment(scan):
                return False
        elif text.startswith("<!", begin):
            if not _doctype(scan):
                return False
        else:  # a "<" that begins nothing
            scan.at += 1
        first = False
    return False


def _declaration(scan: _Scan, first: bool) -> bool:
    end = scan.text.find("?>", scan.at)
    if end < 0:
        return False
    whole = scan.text[scan.at : end + 2]
    if re.match(r"<\?xml\s", whole, re.IGNORECASE) or whole == "<?xml?>":  # the text is written as UTF-8 from here on
        if not first:
            scan.mended("xml-declaration", scan.at, "<?xml ...?> that is not the first thing in the file", "left out")
        elif not re.match(r"<\?xml\s+version\s*=\s*([\"'])1\.[0-9]\1", whole):
            scan.mended("xml-declaration", scan.at, "<?xml ...?> without version 1.0", "left out")
        whole = "\n" * whole.count("\n")
    scan.out.append(whole)
    scan.at = end + 2
    return True


def _comment(scan: _Scan) -> bool:
    end = scan.text.find("-->", scan.at + 4)
    if end < 0:
        return False
    inner = scan.text[scan.at + 4 : end]
    if "--" in inner or inner.endswith("-"):
        scan.mended("xml-comment", scan.at, "a comment with -- in it", "- - written instead")
        inner = re.sub("-(?=-)", "- ", inner)
        inner += " " if inner.endswith("-") else ""
    scan.out.append(f"<!--{_without_controls(scan, inner, scan.at)}-->")
    scan.at = end + 3
    return True


def _doctype(scan: _Scan) -> bool:
    """Drop <!DOCTYPE ...>, its entities included, which nobody who reads URDFs expands."""
    depth, quote, at = 0, "", scan.at + 2
    while at < len(scan.text):
        c = scan.text[at]
        if quote:
            quote = "" if c == quote else quote
        elif c in "\"'":
            quote = c
        elif c == "[":
            depth += 1
        elif c == "]":
            depth -= 1
        elif c == ">" and depth <= 0:
            break
        at += 1
    else:
        return False
    scan.mended("xml-doctype", scan.at, "<!DOCTYPE ...>", "left out; nothing it declares is expanded")
    scan.out.append("\n" * scan.text.count("\n", scan.at, at))
    scan.at = at + 1
    return True


def _elements(scan: _Scan) -> bool:
    """Copy the root element; False where its end is not found."""
    text, depth = scan.text, 0
    while scan.at < len(text):
        begin = text.find("<", scan.at)
        if begin < 0:
            return False
        scan.out.append(_escaped(scan, text[scan.at : begin], scan.at, outside=True))
        scan.at = begin
        if text.startswith("<!--", begin):
            if not _comment(scan):
                return False
        elif text.startswith("<![CDATA[", begin) or text.startswith("<?", begin):
            end = text.find("?>" if text[begin + 1] == "?" else "]]>", begin)
            if end < 0:
                return False
            end += 2 if text[begin + 1] == "?" else 3
            if re.match(r"<\?xml\s", text[begin:end]):
                return False  # a second file inside the first
            scan.out.append(_without_controls(scan, text[begin:end], begin))
            scan.at = end
        elif text.startswith("<!", begin):
            if not _doctype(scan):
                return False
        else:
            step = _tag(scan)
            if step is None:
                return False
            depth += step
            if depth <= 0:
                scan.root_ends = len(scan.out)
                return depth == 0
    return False


def _tag(scan: _Scan) -> int | None:
    """Copy a tag; return how much deeper the next one is, None where it cannot be read."""
    begin = scan.at
    match = _TAG.match(scan.text, begin)
    if match is None:
        return None
    scan.at = match.end()
    tag = _qualified(scan, match[2], begin, element=True)
    parts, seen, prefixes, declared = [f"<{match[1]}{tag}"], set(), [tag], set()
    while not match[1]:
        attribute = _ATTRIBUTE.match(scan.text, scan.at)
        if attribute is None:
            break
        end = scan.text.find(attribute[4], attribute.end())
        if end < 0:
            return None
        name, value = _qualified(scan, attribute[2], attribute.start(2)), scan.text[attribute.end() : end]
        if name.startswith("xmlns:") and not value.strip():
            scan.mended("xml-prefix", attribute.start(2), f"{name} declares nothing", "left out")
        elif name in seen:
            scan.mended("xml-attribute-twice", attribute.start(2), f"attribute {name} is there twice", "the first one holds")
            parts.append("\n" * attribute[0].count("\n") + "\n" * value.count("\n"))
        else:
            blank = _without_controls(scan, attribute[1], attribute.start())
            if not blank:
                scan.mended("xml-blank", attribute.start(2), f"no blank before attribute {name}", "one put there")
                blank = " "
            value = _escaped(scan, value, attribute.end(), outside=False)
            equals = _without_controls(scan, attribute[3], attribute.start(3))
            parts.append(f"{blank}{name}{equals}{attribute[4]}{value}{attribute[4]}")
            if name.startswith("xmlns:"):
                declared.add(name[6:])
            else:
                prefixes.append(name)
        seen.add(name)
        scan.at = end + 1
    ending = _TAG_END.match(scan.text, scan.at)
    if ending is None or (match[1] and ending[1]):
        return None
    parts.append(_without_controls(scan, ending[0], scan.at))
    scan.at = ending.end()
    scan.out.append("".join(parts))
    if match[1]:
        if scan.scopes:
            scan.scopes.pop()
        return -1
    scan.scopes.append(declared)
    for name in prefixes:
        prefix = name.partition(":")[0] if ":" in name else ""
        if prefix and prefix not in ("xml", "xmlns") and not any(prefix in scope for scope in scan.scopes):
            scan.missing.setdefault(prefix, scan.line(begin))
    if ending[1]:
        scan.scopes.pop()
        return 0
    return 1


def _qualified(scan: _Scan, name: str, at: int, *, element: bool = False) -> str:
    """Return a name with no more than one colon in it, and none at an end; XML's namespaces know no other."""
    prefix, _, rest = name.partition(":")
    if ":" not in name or (
        prefix and rest and ":" not in rest and re.match(r"[^-.0-9]", rest) and not (element and prefix == "xmlns")
    ):
        return name
    scan.mended("xml-prefix", at, f"{name!r} is no name with a prefix", "its colons written as dots")
    return re.sub(r"^[-.0-9]", "_", name.replace(":", "."))


def _epilogue(scan: _Scan) -> None:
    """Keep comments after the root element, drop the rest."""
    text = scan.text
    while scan.at < len(text):
        begin = text.find("<!--", scan.at)
        between = text[scan.at :] if begin < 0 else text[scan.at : begin]
        if between.strip(_BLANKS):
            scan.mended(
                "xml-text-outside", scan.at + len(between) - len(between.lstrip()), "more after the root element", "left out"
            )
            return
        scan.out.append(between)
        scan.at = len(text) if begin < 0 else begin
        if begin >= 0 and not _comment(scan):
            return


def _with_prefixes(scan: _Scan, body: str) -> str:
    """Declare the prefixes that are not, at the root element."""
    for prefix, line in scan.missing.items():
        repair = Repair(code="xml-prefix", line=line, what=f"prefix {prefix!r} is not declared", done="declared at the root")
        scan.repairs.append(repair)
    start = next(match for match in re.finditer(rf"<!--.*?-->|<\?.*?\?>|<{_NAME}", body, re.DOTALL) if match[0][1] not in "!?")
    declared = "".join(f' xmlns:{prefix}="urn:{prefix}"' for prefix in scan.missing)
    return body[: start.end()] + declared + body[start.end() :]


def _escaped(scan: _Scan, text: str, at: int, *, outside: bool) -> str:
    """Escape what stands for itself in a text, or in an attribute's value."""
    text = _without_controls(scan, text, at)
    if "&" in text and (_AMPERSAND.search(text) or any(not _is_character(match) for match in _REFERENCE.finditer(text))):
        scan.mended("xml-ampersand", at, "an & that begins no entity of XML", "taken for itself")
        text = _AMPERSAND.sub("&amp;", text)
        text = _REFERENCE.sub(lambda match: match[0] if _is_character(match) else f"&amp;{match[0][1:]}", text)
    if outside and "]]>" in text:
        scan.mended("xml-less-than", at, "]]> in a text", "taken for itself")
        text = text.replace("]]>", "]]&gt;")
    if not outside and "<" in text:
        scan.mended("xml-less-than", at, "a < in an attribute", "taken for itself")
        text = text.replace("<", "&lt;")
    return text


def _is_character(reference: re.Match[str]) -> bool:
    number = int(reference[1], 16) if reference[1] else int(reference[2])
    return number in (9, 10, 13) or 32 <= number < 0xD800 or 0xE000 <= number < 0xFFFE or 0x10000 <= number < 0x110000


def _without_controls(scan: _Scan, text: str, at: int) -> str:
    if not _CONTROL.search(text):
        return text
    scan.mended("xml-control", at, "control characters", "left out")
    return _CONTROL.sub("", text)
