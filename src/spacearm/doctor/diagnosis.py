"""What the doctor found and mended, as plain records; and the chart of the model that is examined.

The chart is a URDF read as far as it can be, with the findings so far, each with its remedy. Nothing here raises for what is
wrong in the file: a number that cannot be read is None, and `look_at_numbers` has reported it.
"""

from __future__ import annotations

import difflib
from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Literal

from spacearm.core.brief import Brief, Rows, counted, named, words
from spacearm.core.checks import Frozen, as_number, keep, shown
from spacearm.core.errors import SettingsError
from spacearm.core.notebook_hook import InNotebooks
from spacearm.robot.model import require_base
from spacearm.robot.robot_xml import numbers_in

Severity = Literal["error", "warning", "note"]
"""An error stops somebody who loads the model or makes its physics impossible; a warning is probably a mistake; a note
is good to know."""

SEVERITIES: tuple[Severity, ...] = ("error", "warning", "note")


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Finding(Brief):
    """One thing that is wrong at one place.

    Attributes:
        severity: "error", "warning" or "note".
        code: what kind of thing, as in "velocity-missing".
        place: as in "joint 'elbow'".
        file: the file that the line is in.
        line: where that begins; None for the whole file.
        what: what is wrong, a sentence without a full stop.
        value: what the file says; "" where it says nothing.
        expected: what should be there.
        advice: how to mend it.
        mendable: whether `mend_urdf` does so by itself.
    """

    severity: Severity
    code: str
    place: str
    file: str
    line: int | None
    what: str
    value: str = ""
    expected: str = ""
    advice: str = ""
    mendable: bool = False


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Diagnosis(Brief, InNotebooks):
    """All that was found about a model.

    Attributes:
        source: path of the URDF.
        srdf: path of the SRDF, or None.
        name: the robot's; "" if it has none.
        links, joints, moving: how many there are, and how many of the joints move.
        mass: of all links [kg]; None if none is stated.
        base_mass: of the base and what is fixed to it [kg]; None if none is stated.
        findings: errors first, then in the order of the file.
    """

    source: str
    srdf: str | None
    name: str
    links: int
    joints: int
    moving: int
    mass: float | None
    base_mass: float | None
    findings: tuple[Finding, ...]

    def _in_short(self) -> tuple[str, Rows]:
        counts = (len(self.errors), "error"), (len(self.warnings), "warning"), (len(self.notes), "note")
        found = ", ".join(counted(number, noun) for number, noun in counts if number) or "nothing to remark"
        mass = "no masses" if self.mass is None else f"{self.mass:.4g} kg"
        model = f"{counted(self.links, 'link')}, {counted(self.joints, 'joint')} ({self.moving} moving), {mass}"
        rows = [("model", f"{model}; {words(self.source)}")]
        kinds = Counter((finding.severity, finding.code) for finding in self.findings)
        firsts = {(finding.severity, finding.code): finding for finding in reversed(self.findings)}
        for kind, number in kinds.items():
            more = f" ({number} of this kind)" if number > 1 else ""
            rows.append((words(kind[0]), f"{kind[1]}{more}: {firsts[kind].place} {firsts[kind].what}"))
        healthy = ", healthy" if self.healthy else ""
        return f"Diagnosis of {named(self.name) if self.name else 'a robot without a name'}: {found}{healthy}", rows

    @property
    def healthy(self) -> bool:
        """Whether there are no errors and no warnings."""
        return not (self.errors or self.warnings)

    @property
    def errors(self) -> tuple[Finding, ...]:
        """The findings that are errors."""
        return self._with_severity("error")

    @property
    def warnings(self) -> tuple[Finding, ...]:
        """The findings that are warnings."""
        return self._with_severity("warning")

    @property
    def notes(self) -> tuple[Finding, ...]:
        """The findings that are merely good to know."""
        return self._with_severity("note")

    @property
    def mendable(self) -> tuple[Finding, ...]:
        """The findings that `mend_urdf` mends by itself."""
        return tuple(finding for finding in self.findings if finding.mendable)

    def as_dict(self) -> dict[str, Any]:
        """Return it as plain values for JSON."""
        return {**asdict(self), "findings": [asdict(finding) for finding in self.findings], "healthy": self.healthy}

    def _with_severity(self, severity: Severity) -> tuple[Finding, ...]:
        return tuple(finding for finding in self.findings if finding.severity == severity)


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Change(Brief):
    """One thing that was mended.

    Attributes:
        line: of the file that was given; None for the whole of it.
        place: as in "joint 'elbow'".
        code: of the finding.
        what: what was there and what is there now.
    """

    line: int | None
    place: str
    code: str
    what: str


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Mended(Brief):
    """A corrected copy of a model.

    Attributes:
        output: its path.
        changes: what was done, in the order of the file.
        before: the diagnosis of the file that was given.
        after: that of the copy: what could not be mended is still in it.
    """

    output: str
    changes: tuple[Change, ...]
    before: Diagnosis
    after: Diagnosis

    def as_dict(self) -> dict[str, Any]:
        """Return it as plain values for JSON."""
        changes = [asdict(change) for change in self.changes]
        return {"output": self.output, "changes": changes, "before": self.before.as_dict(), "after": self.after.as_dict()}


Remedy = Callable[[], str]
"""Changes the XML and says how: what was there and what is there now."""

_NEAR = 0.75  # how alike two names must be, of 1
_LONGEST = 100  # characters of a name that are compared

KINDS = ("revolute", "continuous", "prismatic", "fixed", "floating", "planar")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class Choices(Frozen):
    """What cannot be known is chosen: careful values for what a file leaves out.

    Attributes:
        velocity_limit: for a joint that states none [rad/s or m/s]; the default is slow, as arms in space are.
        range_limit: a revolute joint that states no limits gets this to both sides [rad].
        density: a link that states no mass gets its shape's volume times this [kg/m^3]; None: it stays without.
    """

    velocity_limit: float = 0.05
    range_limit: float = 3.1
    density: float | None = None

    def __post_init__(self) -> None:
        for name in ("velocity_limit", "range_limit", "density"):
            value = getattr(self, name)
            if not (name == "density" and value is None):
                keep(self, **{name: as_number(name, value, SettingsError, above=0)})


@dataclass(slots=True)
class Case:
    """A finding, what it is about, and how it can be mended here."""

    finding: Finding
    element: Any
    remedy: Remedy | None


@dataclass(slots=True, eq=False)
class Chart:
    """A URDF under examination.

    Attributes:
        root: <robot>, an lxml element with its comments.
        path: of the file, for messages; meshes are searched from its directory.
        base: "fixed" or "floating", if anybody says so.
        choices: for remedies.
        cases: what was found.
    """

    root: Any
    path: Path
    base: Literal["fixed", "floating"] | None
    choices: Choices
    cases: list[Case] = field(default_factory=list)

    def __post_init__(self) -> None:
        if self.base is not None:
            require_base(self.base)

    @property
    def links(self) -> list[Any]:
        """Return the <link> elements that have a name, the first of each name."""
        return _named(self.root.findall("link"))

    @property
    def joints(self) -> list[Any]:
        """Return the <joint> elements, the first of each name, and those that have none."""
        elements = self.root.findall("joint")
        named = {id(element) for element in _named(elements)}
        return [element for element in elements if id(element) in named or not element.get("name")]

    @property
    def if_masses_matter(self) -> Severity:
        """How bad it is that a mass is missing."""
        return "error" if self.base == "floating" else "note" if self.base == "fixed" else "warning"

    def found(
        self,
        severity: Severity,
        code: str,
        element: Any,
        what: str,
        *,
        value: str = "",
        expected: str = "",
        advice: str = "",
        remedy: Remedy | None = None,
        place: str = "",
        file: object = None,
        line: int | None = None,
    ) -> None:
        """Write a finding down.

        Args:
            severity, code, what, value, expected, advice: as in `Finding`.
            element: the XML that it is about.
            remedy: how it can be mended.
            place: where the element's own name and that of the link or joint around it will not do.
            file: where it is not the URDF.
            line: where it is not that of the element.
        """
        finding = Finding(
            severity=severity,
            code=code,
            place=place or place_of(element),
            file=str(self.path if file is None else file),
            line=line_of(element) if line is None else line,
            what=printable(what),
            value=printable(value),
            expected=expected,
            advice=printable(advice),
            mendable=remedy is not None,
        )
        self.cases.append(Case(finding, element, remedy))


def printable(text: str) -> str:
    """Make a text of one line, of a length that is read."""
    text = "".join(c if c.isprintable() else " " if c.isspace() else repr(c)[1:-1] for c in text)
    return text if len(text) <= 600 else text[:597] + "..."


def suggestion(name: str, known: Iterable[str]) -> str:
    """Tell what a mistyped name was meant to be; "" where no known one is very near."""
    close = difflib.get_close_matches(name[:_LONGEST], [entry for entry in known if len(entry) <= _LONGEST], n=1, cutoff=_NEAR)
    return f"did you mean {close[0]!r}?" if close else ""


def _named(elements: list[Any]) -> list[Any]:
    first: dict[str, Any] = {}
    for element in elements:
        if element.get("name"):
            first.setdefault(element.get("name"), element)
    return list(first.values())


def line_of(element: Any) -> int | None:
    """Return the line on which an element begins, or the nearest one around it that was in the file."""
    while element is not None and element.sourceline is None:
        element = element.getparent()
    return None if element is None else int(element.sourceline)


def place_of(element: Any) -> str:
    """Name the link or joint that an element belongs to, as in "joint 'elbow'"."""
    while element is not None and element.tag not in ("link", "joint", "robot"):
        element = element.getparent()
    if element is None or element.tag == "robot":
        return "the robot"
    name = element.get("name")
    return f"{element.tag} {shown(name)}" if name else f"a {element.tag} without a name"


def numbers_of(element: Any, attribute: str, count: int, default: tuple[float, ...] | None = None) -> tuple[float, ...] | None:
    """Read an attribute's numbers; the default where there is no element or attribute, None if it cannot be read."""
    text = None if element is None else element.get(attribute)
    if text is None:
        return default
    numbers = tuple(numbers_in(text.replace(",", " ") if attribute in ("size", "scale") else text))
    return numbers if len(numbers) == count else None


def number_of(element: Any, attribute: str) -> float | None:
    """Read an attribute's one number; None if it is not there or cannot be read."""
    numbers = numbers_of(element, attribute, 1)
    return numbers[0] if numbers else None


def link_of(joint: Any, role: Literal["parent", "child"]) -> str:
    """Return the name of a joint's parent or child link; "" if it has none."""
    element = joint.find(role)
    return "" if element is None else element.get("link") or ""


def unit_of(joint: Any) -> str:
    """Return the unit of a joint's value."""
    return "m" if joint.get("type") == "prismatic" else "rad"


def child_of(parent: Any, tag: str) -> Any:
    """Return a child element, made and indented like its neighbours where there is none."""
    from lxml import etree  # pyright: ignore[reportAttributeAccessIssue] (compiled, no stubs)

    found = parent.find(tag)
    if found is not None:
        return found
    made = etree.SubElement(parent, tag)
    before = made.getprevious()
    if before is not None:
        made.tail, before.tail = before.tail, parent.text
    return made


def written(number: float) -> str:
    """Write a number as short as its eight digits allow."""
    return f"{number + 0.0:.8g}"


def setting(element: Any, attribute: str, value: str) -> Remedy:
    """Return a remedy that sets an attribute."""

    def remedy() -> str:
        before = element.get(attribute)
        element.set(attribute, value)
        said = "was missing" if before is None else f"{shown(before)}"
        return f"<{element.tag} {attribute}>: {said} -> {shown(value)}"

    return remedy
