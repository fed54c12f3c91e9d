"""What the doctor found, and what was mended: plain records."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any, Literal

Severity = Literal["error", "warning", "note"]
"""An error stops somebody who loads the model or makes its physics impossible; a warning is probably a mistake; a note
is good to know."""

SEVERITIES: tuple[Severity, ...] = ("error", "warning", "note")


@dataclass(frozen=True, slots=True, kw_only=True)
class Finding:
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


@dataclass(frozen=True, slots=True, kw_only=True)
class Diagnosis:
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

    @property
    def healthy(self) -> bool:
        """Whether there are no errors and no warnings."""
        return not (self.errors or self.warnings)

    @property
    def errors(self) -> tuple[Finding, ...]:
        """The findings that are errors."""
        return self._of("error")

    @property
    def warnings(self) -> tuple[Finding, ...]:
        """The findings that are warnings."""
        return self._of("warning")

    @property
    def notes(self) -> tuple[Finding, ...]:
        """The findings that are merely good to know."""
        return self._of("note")

    @property
    def mendable(self) -> tuple[Finding, ...]:
        """The findings that `mend_urdf` mends by itself."""
        return tuple(finding for finding in self.findings if finding.mendable)

    def as_dict(self) -> dict[str, Any]:
        """Return it as plain values for JSON."""
        return {**asdict(self), "findings": [asdict(finding) for finding in self.findings], "healthy": self.healthy}

    def _of(self, severity: Severity) -> tuple[Finding, ...]:
        return tuple(finding for finding in self.findings if finding.severity == severity)


@dataclass(frozen=True, slots=True, kw_only=True)
class Change:
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


@dataclass(frozen=True, slots=True, kw_only=True)
class Mended:
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
