"""Parts of a report on a swarm: its particles in space, its best arm over the iterations, and curves of its runs.

The clock of such a view counts iterations from 0: the first round, whose positions are drawn at random. F is the fitness.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spacearm.report.report_page import packed, plot, quantised, series
from spacearm.robot import Robot
from spacearm.robot.kinematics import forward_kinematics
from spacearm.swarm import SwarmResult
from spacearm.swarm.swarm_recording import SwarmRecording

Array = NDArray[np.float64]

ITERATION = "iteration"
_LEAST_VIOLATION = 1e-6


def swarm_cloud(recording: SwarmRecording, robot: Robot, *, most: int) -> tuple[dict[str, Any], str]:
    """Return the end effectors of a swarm's particles over the iterations, and a sentence on what was left out.

    Args:
        recording: of the run; its positions are configurations of the robot.
        robot: with its base at the origin.
        most: points; further ones are left out by whole iterations, never the first or the last one.
    """
    rounds, particles = recording.fitness.shape
    count = min(rounds, max(2, most // particles))
    at = np.unique(np.round(np.linspace(0, rounds - 1, count)).astype(np.int64))
    tips = forward_kinematics(robot, recording.positions[at])[..., :3, 3]
    points, low, high = quantised(tips)
    cloud = {
        "name": "particles",
        "low": low,
        "high": high,
        "points": points,
        "at": packed(at),
        "value": packed(_ranks(recording)[at], "u8"),
        "legend": "rank of the particle's position among all of this run, from the best to the worst; feasible ones first",
    }
    left = "" if len(at) == rounds else f"particles are drawn in {len(at)} of the {rounds} iterations, to keep this page small"
    return cloud, left


def _ranks(recording: SwarmRecording) -> NDArray[np.uint8]:
    """Return the rank of each position in all of the run, feasible first, as 0 (the best) to 255."""
    violation = np.maximum(np.nan_to_num(recording.violation.ravel(), nan=np.inf), 0.0)
    fitness = np.nan_to_num(recording.fitness.ravel(), nan=np.inf)
    ranks = np.empty(len(fitness))
    ranks[np.lexsort((fitness, violation))] = np.arange(len(fitness))
    return np.round(255 * ranks / max(len(ranks) - 1, 1)).astype(np.uint8).reshape(recording.fitness.shape)


def arm_over_iterations(run: SwarmResult, robot_index: int, *, name: str) -> dict[str, Any]:
    """Return the arm in the swarm's best configuration of each iteration, as an actor.

    Args:
        run: with the positions in its history.
        robot_index: of the page's robots.
        name: of the actor.
    """
    assert run.history.positions is not None
    q = run.history.positions
    knots = {
        "t": packed(np.arange(len(q)), "f64"),
        "q": packed(q),
        "dq": packed(np.zeros_like(q)),
        "baseAt": [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0],
    }
    return {"name": name, "robot": robot_index, "knots": knots, "tone": 0, "ghost": False}


def convergence_plot(
    runs: Sequence[SwarmResult], shown: SwarmResult, *, title: str, lines: Sequence[tuple[float, str]] = ()
) -> dict[str, Any]:
    """Return the plot of the fitness of the swarm's best over the iterations, of all runs and of the one that is shown.

    Args:
        runs: of one method; they may have stopped after different numbers of iterations.
        shown: one of them.
        title: of the plot.
        lines: (fitness, label): what they are compared with.
    """
    fitness, feasible = run_tables(runs)
    place = next(i for i, run in enumerate(runs) if run is shown)
    ranked = np.where(feasible, fitness, np.inf)
    curves = [
        series(f"run {run.trial}", np.where(feasible[i], fitness[i], np.nan), 1, steps=True, faint=True)
        for i, run in enumerate(runs)
        if i != place
    ]
    if len(runs) > 2:
        curves += [
            series("median", _finite(np.quantile(ranked, 0.5, axis=0, method="inverted_cdf")), 1, steps=True, dashed=True),
            series("mean", np.where(feasible.all(axis=0), fitness.mean(axis=0), np.nan), 3, steps=True),
        ]
    curves.append(series(f"run {shown.trial}, shown", np.where(feasible[place], fitness[place], np.nan), 0, steps=True))
    note = "a run begins where its best is feasible"
    if len(runs) > 2:
        note += "; the mean where all of them are; the median counts what is not feasible yet as the worst"
    x = np.arange(fitness.shape[1])
    return plot("fitness", title, "", x, curves, x_label=ITERATION, lines=lines, note=note)


def violation_plot(run: SwarmResult) -> dict[str, Any]:
    """Return the plot of by how much the swarm's best breaks the constraints, over the iterations."""
    violation = np.maximum(run.history.violation, 0.0)
    return plot(
        "violation",
        "violation of the constraints by the best",
        "m, rad",
        np.arange(len(violation)),
        [series("violation", violation, 0, steps=True)],
        x_label=ITERATION,
        log=True,
        floor=_LEAST_VIOLATION,
    )


def joints_plot(run: SwarmResult, robot: Robot) -> dict[str, Any]:
    """Return the plot of the joints of the swarm's best over the iterations, with their limits."""
    assert run.history.positions is not None
    scale = np.array([1.0 if robot.is_prismatic(dof) else math.degrees(1.0) for dof in range(robot.dof)])
    unit = " / ".join(sorted({"m" if robot.is_prismatic(dof) else "deg" for dof in range(robot.dof)}))
    q = run.history.positions * scale
    curves = [series(name, q[:, dof], dof, steps=True) for dof, name in enumerate(robot.dof_names)]
    limits = [(dof, robot.lower[dof] * scale[dof], robot.upper[dof] * scale[dof]) for dof in range(robot.dof)]
    return plot("joints", "joints of the best", unit, np.arange(len(q)), curves, x_label=ITERATION, limits=limits)


def spread_plot(recording: SwarmRecording, run: SwarmResult, robot: Robot) -> dict[str, Any]:
    """Return the plot of how far the particles' end effectors are from that of the swarm's best, over the iterations."""
    assert run.history.positions is not None
    tips = forward_kinematics(robot, recording.positions)[..., :3, 3]
    best = forward_kinematics(robot, run.history.positions)[:, None, :3, 3]
    distance = np.linalg.norm(tips - best, axis=-1)
    distance[np.arange(distance.shape[1]) >= recording.active[:, None]] = np.nan
    nine, half = np.nanquantile(distance, 0.9, axis=1), np.nanquantile(distance, 0.5, axis=1)
    curves = [series("90 in 100 are nearer", nine, 1), series("half are nearer", half, 0)]
    return plot(
        "spread",
        "distance of the particles' end effectors from the best's",
        "m",
        np.arange(len(half)),
        curves,
        x_label=ITERATION,
        log=True,
        floor=1e-6,
    )


def methods_plot(name: str, title: str, methods: Mapping[str, Sequence[SwarmResult]]) -> dict[str, Any]:
    """Return the plot of the median fitness over the evaluations, a curve for each method."""
    ends = sorted({int(n) for runs in methods.values() for run in runs for n in run.history.evaluations})
    x = np.array(ends)
    curves = []
    for tone, (method, runs) in enumerate(methods.items()):
        fitness, feasible = run_tables(runs)
        middle = np.quantile(np.where(feasible, fitness, np.inf), 0.5, axis=0, method="inverted_cdf")
        spent = max((run.history.evaluations for run in runs), key=len)
        place = np.searchsorted(spent, x, side="right") - 1
        curves.append(series(method, np.where(place >= 0, _finite(middle)[place], np.nan), tone, steps=True))
    note = "the median of all runs, what is not feasible yet counted as the worst; a curve begins where it is feasible"
    return plot(name, title, "", x, curves, x_label="evaluations", clock=False, note=note)


def reached_plot(name: str, title: str, methods: Mapping[str, Sequence[SwarmResult]]) -> dict[str, Any]:
    """Return the plot of the share of the runs that reach a fitness or better, a curve for each method."""
    ends = sorted({run.fitness for runs in methods.values() for run in runs if run.success})
    if not ends:
        return plot(name, title, "%", [0.0], [series(method, [0.0], i) for i, method in enumerate(methods)], clock=False)
    pad = 0.02 * (ends[-1] - ends[0]) or 0.01 * abs(ends[0]) or 1.0
    x = np.array([ends[0] - pad, *ends, ends[-1] + pad])
    curves = []
    for tone, (method, runs) in enumerate(methods.items()):
        reached = np.sort([run.fitness for run in runs if run.success])
        share = 100 * np.searchsorted(reached, x, side="right") / len(runs)
        curves.append(series(method, share, tone, steps=True))
    note = "further left is better; runs that are not feasible are missing at the right"
    return plot(name, title, "%", x, curves, x_label="F of the best found, or less", clock=False, note=note)


def run_tables(runs: Sequence[SwarmResult]) -> tuple[Array, NDArray[np.bool_]]:
    """Return fitness and feasibility over the iterations, (runs, T) each; a run that stopped keeps its last value."""
    length = max(len(run.history.fitness) for run in runs)

    def carried_on(values: Array) -> Array:
        return np.concatenate([values, np.repeat(values[-1:], length - len(values))])

    fitness = np.array([carried_on(run.history.fitness) for run in runs])
    violation = np.array([carried_on(run.history.violation) for run in runs])
    finite = np.isfinite(fitness)
    return np.where(finite, fitness, np.nan), (violation <= 0) & finite


def _finite(values: Array) -> Array:
    return np.where(np.isfinite(values), values, np.nan)
