"""What is worth knowing about a problem and a plan, in a few rows."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from spacearm.core.brief import Rows, counted, in_short, listed, numbers
from spacearm.planner.goals import ConfigurationGoal, ConfigurationsGoal, Goal, PositionGoal

if TYPE_CHECKING:
    from spacearm.planner.pareto import ParetoFront
    from spacearm.planner.plan_result import BaseReport, Plan
    from spacearm.planner.problem import Problem


def problem_in_short(problem: Problem) -> tuple[str, Rows]:
    """Return a headline and rows on a problem."""
    robot = in_short(problem.robot)[0]
    rows = [("start", f"{numbers(problem.start)} {_unit(problem)}"), ("goal", _goal(problem.goal, problem))]
    rows.append(("scene", in_short(problem.scene)[0].removeprefix("Scene: ") + _named(problem)))
    pairs = f", others for {counted(len(problem.clearances), 'pair or group', 'pairs or groups')}" if problem.clearances else ""
    rows.append(("clearance", f"{_mm(problem.clearance)} asked for{pairs}"))
    rows.append(("base", _base(problem)))
    rows += [("duration", f"{problem.duration:.4g} s")] if problem.duration is not None else []
    rows += [("notes", "; ".join(problem.notes))] if problem.notes else []
    return f"Problem: {robot}", rows


def plan_in_short(plan: Plan) -> tuple[str, Rows]:
    """Return a headline and rows on a plan."""
    problem = plan.problem
    rows = [("outcome", plan.message)]
    if plan.trajectory is not None:
        length = plan.fitness.get("length")
        path = "" if length is None else f", joint path {length:.4g} {_unit(problem)}"
        points = counted(plan.trajectory.motion.interior, "control point")
        rows.append(("motion", f"{plan.trajectory.duration:.4g} s{path}, {points} between the ends"))
    rows.append(("clearance", clearance_in_words(plan)))
    if plan.base is not None:
        rows.append(("base", base_in_words(plan.base)))
    if plan.history:
        first, last = plan.history[0], plan.history[-1]
        rows.append(
            (
                "search",
                f"first motion after {first.seconds * 1e3:.3g} ms ({first.by}), the best after {last.seconds * 1e3:.3g} ms "
                f"({last.by}); {counted(plan.evaluations, 'motion')} looked at, {plan.proofs:,} proven or refuted",
            )
        )
    total = plan.timings.get("total")
    took = "" if total is None else f", {total:.3g} s in all"
    rows.append(("made with", f"seed {plan.seed}{took}; {counted(len(plan.goals), 'goal configuration')}"))
    held = "floating" if problem.base_model.follows_arm else problem.base
    headline = f"Plan {plan.status}: robot '{problem.robot.name[:40]}', {counted(len(problem.scene.obstacles), 'obstacle')}"
    return f"{headline}, {held} base", rows


def front_in_short(front: ParetoFront) -> tuple[str, Rows]:
    """Return a headline and rows on plans between quick and gentle."""
    found = f"{counted(len(front.plans), 'proven plan')}, {int(front.best.sum())} on the front"
    rows = [("searches", f"{front.failed} of {len(front.plans) + front.failed} found none")]
    if front.plans:
        unit = "deg/s" if front.measure == "rate" else "deg"
        turns = [math.degrees(value) for value in front.disturbances.tolist()]
        rows.append(("durations", f"{front.durations.min():.4g} s up to {front.durations.max():.4g} s"))
        rows.append((f"base, {front.measure}", f"{min(turns):.4g} {unit} up to {max(turns):.4g} {unit}"))
    return f"ParetoFront: {found}", rows


def clearance_in_words(plan: Plan) -> str:
    """Say what was asked for, what is proven, and what was measured."""
    certificate, said = plan.certificate, [f"{_mm(plan.problem.clearance)} asked for"]
    if certificate is not None and certificate.holds and certificate.clearance is not None:
        proven = certificate.clearance
        said.append("nothing is in the way" if math.isinf(proven) else f"at least {_mm(proven)} proven for all t")
    if certificate is not None and certificate.closest is not None:
        said.append(f"measured closest {_mm(certificate.closest.clearance)}")
    return ", ".join(said)


def base_in_words(base: BaseReport) -> str:
    """Say how a floating base turns, and what is not as asked."""
    final, peak, rate = (math.degrees(value) for value in (base.final, base.peak, base.rate))
    missed = f"; not as asked: {'; '.join(base.missed)}" if base.missed else ""
    return f"turned by {final:.3g} deg at the end, {peak:.3g} deg at most, by {rate:.3g} deg/s at most{missed}"


def _goal(goal: Goal, problem: Problem) -> str:
    if isinstance(goal, ConfigurationGoal):
        return f"the configuration {numbers(goal.q)} {_unit(problem)}"
    if isinstance(goal, ConfigurationsGoal):
        return f"one of {counted(len(goal.q), 'configuration')}, the first {numbers(goal.q[0])} {_unit(problem)}"
    what = "position" if isinstance(goal, PositionGoal) else "pose"
    at = "at" if isinstance(goal, PositionGoal) else "with its origin at"
    return f"a {what} of frame '{goal.frame}' {at} {numbers(goal.position)} m, to {_mm(goal.tolerances[0])}"


def _base(problem: Problem) -> str:
    if not problem.base_model.follows_arm:
        return problem.base
    said = [problem.base]
    if not problem.momentum.is_zero:
        said.append(f"momentum {numbers(problem.momentum.linear)} N s, {numbers(problem.momentum.angular)} N m s")
    if problem.base_goal is not None:
        said.append(f"to end in attitude {numbers(problem.base_goal.attitude_wxyz)} (wxyz)")
    if problem.base_limits.any:
        said.append(f"limits of {', '.join(problem.base_limits.asked)}")
    return "; ".join(said)


def _named(problem: Problem) -> str:
    names = [obstacle.name for obstacle in problem.scene.obstacles if obstacle.name]
    return f" ({listed(names)})" if names else ""


def _unit(problem: Problem) -> str:
    slides = [problem.robot.is_prismatic(i) for i in range(problem.robot.dof)]
    return "m" if all(slides) else "rad and m" if any(slides) else "rad"


def _mm(value: float) -> str:
    return f"{value * 1e3:.4g} mm"
