"""A report's words: the verdict, the title block, and the tables below the picture."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from spacearm.core.native import native
from spacearm.core.records import as_dict
from spacearm.core.version import version
from spacearm.planner.plan_result import STATUSES, Improvement
from spacearm.planner.planner_settings import PlannerSettings
from spacearm.report.report_curves import Sampled, joint_path_length, path_length
from spacearm.report.report_page import plot, section, series
from spacearm.report.report_subject import Subject
from spacearm.robot.unchecked_pairs import REMEDY

Row = tuple[str, str]
Section = dict[str, Any]

_HEADLINES = {
    "found": "Proven for every instant",
    "holds": "Proven for every instant",
    "fails": "Not proven: a collision or a broken limit",
    "undecided": "Undecided: too close to be told",
}


def mm(value: float) -> str:
    """Return a length in millimetres [mm]."""
    return f"{value * 1e3:.4g} mm"


def verdict_of(subject: Subject) -> dict[str, str]:
    """Return the verdict: a headline and the outcome in words."""
    plain = STATUSES.get(subject.status, subject.status)
    headline = _HEADLINES.get(subject.status) or f"{plain[0].upper()}{plain[1:]}"
    if subject.from_file and subject.good:
        headline = "Proven for every instant, says the file"
    text = f"{subject.message[:1].upper()}{subject.message[1:]}."
    if subject.from_file:
        text += " The file was not proven again for this page: `spacearm certify` does that."
    if not subject.good and subject.trajectory is not None and subject.status in STATUSES:
        text += " Shown is the best motion that was seen: it is not for execution."
    if subject.trajectory is None:
        text += f" There is no motion: the robot stands {subject.stands_at}."
    return {"tone": "good" if subject.good else "bad", "headline": headline, "text": text}


def block_of(subjects: Sequence[Subject]) -> list[list[str]]:
    """Return the cells of the title block."""
    first = subjects[0]
    rows: list[Row] = [("Robot", _joined(one.robot.name for one in subjects))]
    if len(subjects) > 1:
        rows.append(("Motions", f"{len(subjects)}: {_joined(one.name for one in subjects)}"))
    else:
        rows.append(("Status", first.status.replace("_", " ")))
    rows.append(("Base", _joined(one.base for one in subjects)))
    if len(subjects) == 1:
        rows.append(("Duration", "-" if first.trajectory is None else f"{first.trajectory.duration:.4g} s"))
        rows.append(("Clearance asked", mm(first.asked) if first.asked else "no contact"))
        rows.append(
            (
                "Clearance proven",
                "none" if not first.good else "nothing in the way" if first.proven is None else mm(first.proven),
            )
        )
        rows.append(("Seed", "-" if first.seed is None else str(first.seed)))
    certificate = first.certificate or {}
    if len(subjects) == 1 and certificate:
        rows.append(("Problem", _short(certificate.get("problem_hash"))))
        rows.append(("Trajectory", _short(certificate.get("trajectory_hash"))))
    rows.append(("Made by", f"spacearm {version()}"))
    return [list(row) for row in rows]


def _joined(names: Any) -> str:
    return ", ".join(dict.fromkeys(names))


def _short(digest: Any) -> str:
    return f"sha256 {str(digest)[:12]}" if digest else "-"


def sections_of(subject: Subject, at: Sampled | None, *, drawn: Sequence[str], closest: str) -> list[Section]:
    """Return the sections of one motion.

    Args:
        subject: the motion.
        at: it at instants; None: there is no motion.
        drawn: notes on how the page draws it.
        closest: the closest approach that was measured for the page, in words.
    """
    made = [_clearance(subject, closest), _motion(subject, at), _limits(subject, at), _base(subject)]
    made += [_unchecked(subject), _bare(subject), _notes(subject, drawn), _search(subject), _settings(subject), _again(subject)]
    made.append(_provenance(subject))
    return [one for one in made if one is not None]


def _clearance(subject: Subject, closest: str) -> Section:
    certificate = subject.certificate or {}
    pairs = "every pair without a value of its own" if subject.asked_by_pair else "every pair"
    rows: list[Row] = [("asked for", f"{mm(subject.asked)} of {pairs}" if subject.asked else f"no contact of {pairs}")]
    rows += [("asked for", f"{mm(pair.clearance)} of {pair.names}") for pair in subject.asked_by_pair]
    if subject.proof_holds:
        given = certificate.get("clearance_m")
        rows.append(("proven", "nothing is in the way" if given is None else f"at least {mm(float(given))} at every instant"))
    else:
        rows.append(("proven", "nothing"))
    near = certificate.get("closest")
    if isinstance(near, dict):
        rows.append(
            ("closest", f"{mm(near['clearance_m'])}: link '{near['link']}' and {near['other']} at t = {near['time_s']:.4g} s")
        )
    rows += [("in the way", text) for text in subject.ends]
    if closest:
        rows.append(("measured for this page", closest))
    rows += [("near at an end", _near_in_words(pair)) for pair in certificate.get("near_pairs", [])]
    tracking = certificate.get("tracking")
    if tracking:
        rows.append(("tracking error", _plain(tracking)))
    if certificate:
        rows.append(("limits checked", ", ".join(certificate.get("limits", {}).get("checked", [])) or "none"))
    return section("Clearance", rows=rows, opened=True)


def _near_in_words(pair: dict[str, Any]) -> str:
    kept = "nothing" if pair["proven_m"] is None else f"at least {mm(pair['proven_m'])}"
    return (
        f"link '{pair['link']}' and {pair['other']}: {mm(pair['clearance_m'])} at {pair['ends']}, of {mm(pair['required_m'])} "
        f"asked for; proven {kept} from t = {pair['begin_s']:.4g} s to {pair['end_s']:.4g} s"
    )


def _motion(subject: Subject, at: Sampled | None) -> Section | None:
    if at is None or subject.trajectory is None:
        return None
    return section("Motion", rows=figures_of(subject, at), opened=True)


def figures_of(subject: Subject, at: Sampled) -> list[Row]:
    """Return figures of a motion by name, the same ones for every motion."""
    trajectory = subject.trajectory
    assert trajectory is not None
    robot = subject.robot
    speed, rate = np.linalg.norm(at.velocity, axis=1), np.linalg.norm(at.omega, axis=1)
    unit = "m" if all(robot.is_prismatic(i) for i in range(robot.dof)) else "rad"
    unit = "rad and m" if unit == "rad" and any(robot.is_prismatic(i) for i in range(robot.dof)) else unit
    law = getattr(trajectory, "time_law", None)
    kind = "recorded" if not hasattr(trajectory, "motion") else "uniform" if law is None else "of its own"
    return [
        ("duration", f"{trajectory.duration:.5g} s"),
        ("time law", kind),
        ("joint path length", f"{joint_path_length(trajectory, at.q):.4f} {unit}"),
        ("path length of the end effector", f"{path_length(at.T[:, :3, 3]):.4f} m"),
        ("greatest speed of the end effector", f"{speed.max() * 1e3:.4g} mm/s"),
        ("greatest angular speed of the end effector", f"{math.degrees(rate.max()):.4g} deg/s"),
        *((f"fitness: {name}", f"{value:.6g}") for name, value in subject.fitness.items() if name != "length"),
    ]


def _limits(subject: Subject, at: Sampled | None) -> Section | None:
    trajectory = subject.trajectory
    if trajectory is None or at is None:
        return None
    robot, margins = subject.robot, trajectory.margins(subject.robot)
    sliding = [robot.is_prismatic(i) for i in range(robot.dof)]
    alike = len(set(sliding)) == 1  # then a note has the unit
    rows: list[list[str]] = []
    for i, name in enumerate(robot.dof_names):
        factor, unit = (1e3, "mm") if sliding[i] else (math.degrees(1), "deg")
        low, high, margin = robot.lower[i] * factor, robot.upper[i] * factor, margins.position[i] * factor
        after = "" if alike else f"\u00a0{unit}"
        rows.append(
            [
                name,
                f"{at.q[:, i].min() * factor:.3g}\u00a0to\u00a0{at.q[:, i].max() * factor:.3g}{after}",
                f"{low:.3g}\u00a0to\u00a0{high:.3g}{after}" if np.isfinite([low, high]).any() else "none",
                f"{margin:.3g}{after}" if np.isfinite(margin) else "-",
                f"{np.abs(at.dq[:, i]).max() * factor:.3g}" + (f"{after}/s" if after else ""),
                _share(margins.velocity[i]),
                f"{np.abs(at.ddq[:, i]).max() * factor:.3g}" + (f"{after}/s²" if after else ""),
                _share(margins.acceleration[i]),
            ]
        )
    unit = "mm" if sliding[0] else "deg"
    header = ["joint", "moves", "limits", "margin", "rate", "share", "accel.", "share"]
    notes = ["Margins, and shares of the limits of rate and acceleration, are bounds for every instant."]
    notes += [f"Angles and ways in {unit}, rates in {unit}/s, accelerations in {unit}/s²."] if alike else []
    return section("Joint limits", table=(header, rows), notes=notes)


def _share(value: float) -> str:
    return "unbounded" if not math.isfinite(value) else f"{value:.1%}"


def _base(subject: Subject) -> Section | None:
    base = (subject.certificate or {}).get("base")
    if not isinstance(base, dict):
        return None
    deg, limits = math.degrees, subject.base_limits
    asked = {name: getattr(limits, name, None) for name in ("final", "peak", "rate", "joint_momentum")}

    def row(name: str, value: float, unit: str, limit: float | None) -> Row:
        return name, f"{value:.4g} {unit}" + ("" if limit is None else f" (limit {limit:.4g} {unit})")

    def turned(name: str) -> float | None:
        limit = asked[name]
        return None if limit is None else deg(limit)

    rows = [
        row("turned at the end", deg(base["rotation_final_rad"]), "deg", turned("final")),
        row("turned at most", deg(base["rotation_peak_at_most_rad"]), "deg", turned("peak")),
        row("rate at most", deg(base["rate_at_most_rad_s"]), "deg/s", turned("rate")),
        row("joint momentum at most", base["joint_momentum_at_most_n_m_s"], "N m s", asked["joint_momentum"]),
        ("residual momentum", f"{base['residual_momentum']:.1g} of the greatest momentum of a link"),
        ("error of the attitude", f"{base['attitude_error_at_most_rad']:.1g} rad at most, which the proof allows for"),
    ]
    rows += [("not kept", text) for text in base.get("limits_broken", [])]
    rows += [("not as asked", text) for text in subject.missed]
    return section("Floating base", rows=rows, opened=True)


def _unchecked(subject: Subject) -> Section | None:
    listed = (subject.certificate or {}).get("not_checked", {}).get("pairs", [])
    by_reason: dict[str, list[str]] = {}
    for one in listed:
        by_reason.setdefault(one["reason"], []).append(" - ".join(one["links"]))
    if not by_reason:
        return None
    rows = [[reason, str(len(pairs)), ", ".join(pairs)] for reason, pairs in by_reason.items()]
    notes = ["Nothing is claimed of these pairs of links."]
    if any("overlap" in reason or "always" in reason for reason in by_reason):
        notes.append(f"Links that overlap in every configuration are a fault of the model: {REMEDY}.")
    return section("Pairs of links not checked", table=(["reason", "pairs", "links"], rows), notes=notes)


def _bare(subject: Subject) -> Section | None:
    bare = (subject.certificate or {}).get("not_checked", {}).get("links_without_envelope", [])
    notes = [f"Kept clear of nothing, for want of a collision shape: {', '.join(bare)}."]
    return section("Links without an envelope", notes=notes) if bare else None


def _notes(subject: Subject, drawn: Sequence[str]) -> Section | None:
    notes = [f"{about}: {note}" for about, note in subject.notes]
    notes += [f"proof: {note}" for note in (subject.certificate or {}).get("remarks", [])]
    notes += [f"page: {note}" for note in drawn]
    return section("Notes", notes=notes) if notes else None


def _search(subject: Subject) -> Section | None:
    if subject.evaluations is None:
        return None
    rows: list[Row] = [] if subject.goals is None else [("goal configurations", str(subject.goals))]
    rows.append(("motions looked at", f"{subject.evaluations:,}"))
    if subject.proofs is not None:
        rows.append(("motions proven or refuted", str(subject.proofs)))
    if subject.interrupted:
        rows.append(("interrupted", "yes: ended from outside"))
    if subject.achievable is not None:
        rows.append(("found and proven with", mm(subject.achievable * subject.asked)))
    if subject.history:
        first, last = subject.history[0], subject.history[-1]
        rows.append(("first motion", _improvement(first)))
        rows.append((f"the best of {len(subject.history)}", _improvement(last)))
    return section("Search", rows=rows, plots=_fitness(subject))


def _improvement(one: Improvement) -> str:
    island = f" on island {one.island}" if one.island else ""
    return f"fitness {one.fitness:.6g} after {one.evaluations:,} motions{island}, by {one.by.replace('_', ' ')}"


def _fitness(subject: Subject) -> list[dict[str, Any]]:
    """Return a plot of the best fitness over the motions looked at; none of a search without improvements."""
    history = sorted(subject.history, key=lambda one: one.evaluations)
    if len(history) < 3:
        return []
    x = np.array([one.evaluations for one in history] + [max(history[-1].evaluations, subject.evaluations or 0)])
    best = np.minimum.accumulate([one.fitness for one in history])
    curve = series("best so far", np.append(best, best[-1]), 0, steps=True)
    return [plot("fitness", "Fitness of the best motion", "", x, [curve], x_label="motions looked at", clock=False)]


def _settings(subject: Subject) -> Section | None:
    if not subject.settings:
        return None
    plain = as_dict(PlannerSettings())
    rows = [
        (name, _plain(value) + ("" if plain.get(name) == value else "  (not the default)"))
        for name, value in subject.settings.items()
    ]
    return section("Settings", rows=rows)


def _plain(value: Any) -> str:
    """Return a setting in words."""
    if isinstance(value, dict):
        kind = value.get("kind")
        given = [f"{key} {_plain(entry)}" for key, entry in value.items() if key != "kind" and entry not in (0, None, False)]
        return f"{kind}: {', '.join(given)}" if kind and kind != "Weights" else ", ".join(given)
    if isinstance(value, list):
        return ", ".join(map(_plain, value))
    if isinstance(value, bool):
        return "yes" if value else "no"
    return "none" if value is None else f"{value:g}" if isinstance(value, float) else str(value)


def _again(subject: Subject) -> Section | None:
    command = subject.command
    if not command and subject.seed is not None:
        given = _python_settings(subject.settings)
        command = (
            "import spacearm as sa\n\n"
            'problem = sa.load_saved_plan("plan.json").problem\n'
            f"plan = sa.plan(problem, sa.PlannerSettings({given}), rng={subject.seed})"
        )
    if not command:
        return None
    notes = []
    if subject.settings.get("time_budget") is not None:
        notes.append("With a time budget, what is found depends on the processor.")
    return section("Make it again", code=command, notes=notes)


_SETTINGS = ("FeasibleFirst", "IPSO", "PSO", "Penalty", "Weights")  # kinds that settings of the planner hold


def _python_settings(settings: dict[str, Any]) -> str:
    """Return the settings that are not the defaults as arguments of a call."""
    plain = as_dict(PlannerSettings())
    given: list[str] = []
    for name, value in settings.items():
        if plain.get(name) == value or name not in plain:  # a file may hold anything, and readers copy what they see
            continue
        if isinstance(value, dict) and "kind" in value:
            if value["kind"] not in _SETTINGS or not all(key.isidentifier() for key in value):
                continue
            usual: dict[str, Any] = plain[name] if isinstance(plain.get(name), dict) else {}
            inner = ", ".join(f"{key}={entry!r}" for key, entry in value.items() if key != "kind" and usual.get(key) != entry)
            given.append(f"{name}=sa.{value['kind']}({inner})")
        else:
            given.append(f"{name}={tuple(value) if isinstance(value, list) else value!r}")
    return ", ".join(given)


def _provenance(subject: Subject) -> Section:
    certificate = subject.certificate or {}
    rows: list[Row] = [
        ("spacearm", version()),
        ("kernel", f"compiled by {native.compiler}"),  # not its level: reports are the same on every processor
        ("numpy", np.__version__),
        ("witness", str(certificate.get("witness", "none"))),
    ]
    if certificate:
        rows.append(
            ("proof", f"{certificate.get('evaluations')} stretches, down to {certificate.get('resolution'):.3g} of the curve")
        )
        rows.append(("hash of the problem", f"sha256 {certificate.get('problem_hash')}"))
        rows.append(("hash of the trajectory", f"sha256 {certificate.get('trajectory_hash')}"))
    source = subject.robot.source
    if source:
        rows.append(("robot from", json.dumps(source).strip('"')))
    return section("Provenance", rows=rows)
