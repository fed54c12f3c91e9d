"""What the panel says: short pieces of HTML, in which nothing that comes from a file is believed to be text without markup."""

from __future__ import annotations

import html
import math
from collections.abc import Sequence

from spacearm.planner.problem import Problem
from spacearm.view.colors import TONES, css
from spacearm.view.nearest import Nearest, Tone
from spacearm.view.plan_job import PlanJob
from spacearm.view.reach import Reachable
from spacearm.view.session import Session

_STYLE = "font-size:0.8125em;line-height:1.35;padding:0.15em 0.75em;overflow-wrap:anywhere"
_MOST = 900  # characters of a sentence


def block(rows: Sequence[str]) -> str:
    """Return rows of HTML as one block."""
    return f'<div style="{_STYLE}">{"".join(rows)}</div>'


def row(title: str, text: str, tone: Tone = "plain") -> str:
    """Return a title, and a text behind it, with a mark whose colour and shape say how it is."""
    mark = {"good": "●", "near": "▲", "bad": "■", "plain": ""}[tone]
    shown = text if len(text) <= _MOST else f"{text[: _MOST - 4]} ..."
    sign = f'<span style="color:{css(TONES[tone])}">{mark}</span> ' if mark else ""
    name = f'<span style="opacity:0.6">{html.escape(title)}</span><br>' if title else ""
    return f'<div style="margin:0.1em 0 0.45em">{name}{sign}{html.escape(shown)}</div>'


def headline(text: str, tone: Tone) -> str:
    """Return a verdict."""
    color = css(TONES[tone])
    return (
        f'<div style="border-left:3px solid {color};padding:0.1em 0 0.1em 0.6em;margin:0.1em 0 0.5em;font-weight:600">'
        f"{html.escape(text)}</div>"
    )


def status_html(session: Session, near: Nearest | None, reach: Reachable | None, *, moving: bool) -> str:
    """Return the block that is always seen: the verdict, the nearest pair, the goal."""
    rows = []
    motion, job = session.motion, session.job
    if job is not None and job.running:
        rows.append(headline("Ends with what it has ..." if job.ending else f"Plans: {job.stage}", "plain"))
    elif job is not None and job.state in ("cancelled", "failed"):
        rows.append(
            headline("Cancelled" if job.state == "cancelled" else "Failed", "plain" if job.state == "cancelled" else "bad")
        )
    elif job is not None and job.plan is not None and job.plan.trajectory is None:
        rows.append(headline("No motion", "bad"))
    elif motion is not None:
        rows.append(headline("The problem was changed: plan again" if session.outdated else motion.headline, _tone(session)))
    else:
        rows.append(headline("Not planned yet", "plain"))
    where = "Clearance now" if moving else "Clearance at the start"
    rows.append(_nearest(where, near))
    if reach is not None:
        rows.append(row("Goal", reach.message, reach.tone))
    return block(rows)


def _nearest(where: str, near: Nearest | None) -> str:
    """Return the distance of the nearest pair, large, and the pair."""
    if near is None:
        return row(where, "nothing is in the way", "good")
    number = f'<span style="font-size:1.5em;font-weight:600;color:{css(TONES[near.tone])}">{near.clearance * 1e3:.4g} mm</span>'
    return f'<div style="margin-top:0.1em"><span style="opacity:0.6">{where}</span><br>{number}</div>' + row(
        "", near.pair, near.tone
    )


def _tone(session: Session) -> Tone:
    motion = session.motion
    return "near" if motion is None or session.outdated else motion.tone


def verdict_html(session: Session) -> str:
    """Return the verdict on the motion in full: the certificate's words, the base, what is not as asked."""
    motion, job = session.motion, session.job
    rows = []
    if job is not None and not job.running and job.message and (motion is None or motion.plan is not job.plan):
        tone: Tone = "plain" if job.state == "cancelled" else "bad"
        rows.append(row("Last plan", job.message, tone))
    if motion is not None:
        rows.append(row("Verdict", motion.message, motion.tone))
        if session.outdated:
            rows.append(
                row("", "Nothing is proven of this motion among what is shown now: the problem was changed since.", "near")
            )
        rows += _facts(session)
    return block(rows) if rows else ""


def _facts(session: Session) -> list[str]:
    motion = session.motion
    if motion is None:
        return []
    rows = [row("Duration", f"{motion.duration:.4g} s")]
    plan = motion.plan
    if plan is None:
        return rows
    if plan.base is not None:
        final, peak, rate = (math.degrees(value) for value in (plan.base.final, plan.base.peak, plan.base.rate))
        rows.append(row("Base", f"turned by {final:.3g} deg at the end, {peak:.3g} deg at most; {rate:.3g} deg/s at most"))
    if plan.history:
        first, last = plan.history[0], plan.history[-1]
        rows.append(
            row(
                "Search",
                f"first motion after {first.seconds * 1e3:.3g} ms, the best after {last.seconds * 1e3:.3g} ms ({last.by}); "
                f"{plan.evaluations} looked at, {plan.proofs} given to the proof; seed {plan.seed}",
            )
        )
    return rows


def job_html(job: PlanJob | None) -> str:
    """Return what the plan that is being made has found so far."""
    if job is None or not job.running:
        return ""
    count = len(job.candidates)
    best = f"; the best has {job.candidates[-1].fitness:.4g}" if count else ""
    limit = job.edited.settings.time_budget
    time = f"{job.seconds:.1f} s" + (f" of {limit:g} s" if limit else "")
    return block([row("", f"{time}, {job.evaluations} motions looked at, {count} better and better ones{best}")])


def limits_words(problem: Problem, dof: int) -> str:
    """Return the limits of a joint in words."""
    robot = problem.robot
    low, high, rate = robot.lower[dof], robot.upper[dof], robot.velocity[dof]
    if robot.is_prismatic(dof):
        ends = f"{low:.4g} to {high:.4g} m"
        return f"{ends}; {rate:.3g} m/s at most"
    ends = "without end" if math.isinf(low) and math.isinf(high) else f"{math.degrees(low):.4g} to {math.degrees(high):.4g} deg"
    return f"{ends}; {math.degrees(rate):.3g} deg/s at most"
