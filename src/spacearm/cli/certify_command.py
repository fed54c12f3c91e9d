"""`spacearm certify`: prove a saved plan again, or a trajectory that somebody else made.

The proof and the files are imported by the functions that use them, after the options are read: help is printed without.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from tyro.conf import Positional, arg

from spacearm.cli.arguments import parsed, tracking_of_words
from spacearm.cli.progress import progress_bar
from spacearm.cli.terminal import base_rows, loading, rows_on_near_pairs, rows_on_tracking, show_list, tell_notes, tell_robot
from spacearm.core.errors import SettingsError
from spacearm.core.output import require_new
from spacearm.core.reading import located, read_bytes
from spacearm.core.version import version

if TYPE_CHECKING:
    from spacearm.files.plan_file import Recheck
    from spacearm.planner import Problem
    from spacearm.proof import Certificate


@dataclass(frozen=True, kw_only=True)
class Options:
    """Prove that a saved plan, or a trajectory in CSV or of ROS, is free of collision and within the joint limits at every
    instant.

    What the file states about itself is not believed, but compared. If the proof does not hold, the exit code is 1.

    Attributes:
        file: a plan.json, or a trajectory: CSV with a column for the time [s] and one for each joint, or a JointTrajectory of
            ROS in YAML or JSON.
        problem: a problem file (YAML) to prove the motion for; none: the problem in the plan.
        output: write the certificate to this new file, as JSON.
        interpolation: how a trajectory moves between its rows; none: by what the file gives, straight lines if that is
            positions only.
        degrees: the angles of the trajectory are in degrees.
        unwrap: the angles of the trajectory change by less than half a turn from row to row.
        time_unit: unit of the times in the trajectory; none: as the file says, else seconds.
        limits: the joint limits that must be kept; a path with corners has no acceleration, so leave that out for one.
        jerk_limit: jerk limit of every joint [rad/s^3 or m/s^3]; none: jerk is not limited.
        clearance: that every pair of bodies without a clearance of its own has to keep [m]; none: the problem's.
        tracking: how far each joint may be from the motion at any instant [rad or m], a number for all joints, or NAME=NUMBER
            for each of some (all=NUMBER for the others); none: as the plan's certificate says.
        resolution: an interval shorter than this share of the motion is not halved again.
        json: print the certificate as JSON instead of the summary.
    """

    file: Annotated[Positional[Path], arg(metavar="FILE")]
    problem: Annotated[Path | None, arg(metavar="PROBLEM.YAML")] = None
    output: Annotated[Path | None, arg(metavar="CERTIFICATE.JSON", aliases=("-o",))] = None
    interpolation: Literal["linear", "cubic", "quintic"] | None = None
    degrees: bool = False
    unwrap: bool = False
    time_unit: Literal["s", "ms", "us", "ns"] | None = None
    limits: tuple[Literal["position", "velocity", "acceleration"], ...] = ("position", "velocity", "acceleration")
    jerk_limit: float | None = None
    clearance: float | None = None
    tracking: Annotated[tuple[str, ...], arg(metavar="NUMBER|NAME=NUMBER")] = ()
    resolution: float = 1e-7
    json: bool = False

    @property
    def of_proof(self) -> dict[str, Any]:
        """Those that `certify` takes."""
        names = ("limits", "jerk_limit", "clearance", "resolution")
        given = {name: getattr(self, name) for name in names}
        return {**given, "tracking": tracking_of_words(self.tracking)} if self.tracking else given


def run(arguments: Sequence[str]) -> int:
    """Run the command and return its exit code."""
    options = parsed(Options, arguments, command="certify")
    from spacearm.files import load_problem
    from spacearm.files.plan_file import proof_as_dict, save_json

    if options.output is not None:
        require_new(options.output, advice="choose another name with -o")
    with loading():
        problem = None if options.problem is None else load_problem(options.problem)
    with progress_bar("proving"):
        found = _found(options, problem)
    from spacearm.proof.certificate import CERTIFICATE_KEY, CERTIFICATE_VERSION

    values = {
        CERTIFICATE_KEY: CERTIFICATE_VERSION,
        "version": version(),
        "file": options.file.name,
        "notes": list(found.notes),
        "contradictions": list(found.certificate.contradictions),
        "duration_s": found.certificate.trajectory.duration,
        **found.certificate.as_dict(),
    }
    if options.output is not None:
        save_json({**values, "proof": proof_as_dict(found.certificate)}, options.output)
    if options.json:
        print(json.dumps(values, indent=2, allow_nan=False))
    else:
        show_list(_summary(found))
    tell_robot(found.certificate.robot, more="robot.notes in Python")
    tell_notes(options.file, found.notes)
    return 0 if found.certificate.holds else 1


def _found(options: Options, problem: Problem | None) -> Recheck:
    from spacearm.files import load_trajectory
    from spacearm.files.plan_file import recheck_plan, recheck_trajectory

    if is_plan(read_bytes(options.file, what="a plan or a trajectory")):
        with located(options.file):
            _refuse_for_plans(options)
        return recheck_plan(options.file, problem, **options.of_proof)
    if problem is None:
        raise SettingsError(
            f"{options.file} is no plan in JSON, so it is taken for a trajectory; give --problem PROBLEM.YAML to prove it for"
        )
    trajectory = load_trajectory(
        problem.robot,
        options.file,
        interpolation=options.interpolation,
        degrees=options.degrees,
        unwrap=options.unwrap,
        time_unit=options.time_unit,
        base=problem.base,
        base_start=problem.base_start,
        momentum=problem.momentum,
    )
    return recheck_trajectory(problem, trajectory, **options.of_proof)


def is_plan(content: bytes) -> bool:
    """Whether it is JSON, and no trajectory of ROS."""
    if not content.lstrip().startswith((b"{", b"[")):
        return False
    return b"spacearm-plan" in content or b"joint_names" not in content


def _refuse_for_plans(options: Options) -> None:
    for name in ("interpolation", "degrees", "unwrap", "time_unit"):
        if getattr(options, name):
            raise SettingsError(
                f"--{name.replace('_', '-')} is for trajectories in CSV or of ROS, and this is a plan; leave it out"
            )


def _summary(found: Recheck) -> list[tuple[str, str]]:
    from spacearm.files.stated_columns import as_duration
    from spacearm.robot.unchecked_pairs import rows_on_unchecked

    certificate = found.certificate
    rows = [("status", certificate.status), ("finding", certificate.message)]
    rows.append(("clearance", _clearance(certificate)))
    rows += rows_on_tracking(certificate)
    rows += rows_on_near_pairs(certificate)
    rows += [("file contradicts", text) for text in certificate.contradictions]
    rows += [("limits", text) for text in certificate.broken_limits] or [("limits", _kept(certificate.checked))]
    base = certificate.base_findings
    if base is not None and base.checked and not base.broken_limits:
        rows.append(("base's limits", _kept([name.replace("_", " ") for name in base.checked])))
    rows += rows_on_unchecked(certificate.unchecked, certificate.bare)
    rows.append(("duration", as_duration(certificate.trajectory.duration)))
    if found.base is not None:
        rows += base_rows(found.base)
    if found.agrees is not None:
        rows.append(("file's certificate", "says the same" if found.agrees else "says otherwise"))
    rows.append(("proof", _proof(found)))
    rows += [
        ("problem", f"SHA-256 {certificate.problem_hash}"),
        ("trajectory", f"SHA-256 {certificate.trajectory_hash}"),
        ("looked at", f"{certificate.evaluations} configurations, {certificate.seconds * 1e3:.0f} ms, {certificate.witness}"),
    ]
    return rows


def _proof(found: Recheck) -> str:
    """Say whose proof it is, and how large."""
    proof = found.certificate.proof
    if proof is None:
        return "none"
    whose = "the file's, checked" if found.proof_checked else "found and checked"
    return f"{whose}: {len(proof.steps)} nodes, {len(proof.directions)} planes"


def _clearance(certificate: Certificate) -> str:
    """Say what is asked for, what is proven, and what was measured."""
    said = [f"{certificate.required * 1e3:.4g} mm asked for"]
    said += [f"{pair.clearance * 1e3:.4g} mm of {pair.names}" for pair in certificate.required_by_pair]
    if certificate.closest is not None:
        if certificate.clearance is not None:
            said.append(f"{certificate.clearance * 1e3:.4g} mm proven")
        said.append(f"{certificate.closest.clearance * 1e3:.4g} mm measured closest")
    if certificate.nearer:
        said.append(f"but {certificate.nearer}")
    return ", ".join(said)


def _kept(checked: Sequence[str]) -> str:
    return f"kept for all t: {', '.join(checked)}" if checked else "not looked at"
