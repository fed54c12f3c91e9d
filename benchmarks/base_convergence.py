"""How quickly the floating base's attitude becomes right as steps become short, method by method: a figure.

    python benchmarks/base_convergence.py --figure docs/figures/base_convergence.png
    python benchmarks/base_convergence.py --json base_convergence.json

The servicer arm (built-in "servicer7") runs the quintic from q = 0 to the second known final joint vector. Errors of the final
attitude are against an adaptive integration to 1e-13 rad.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from math import sqrt
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from spacearm.core.rotations import angle, conjugate, cross, exponential, multiplied, running_products
from spacearm.dynamics import BaseMotion, JointPath, moments
from spacearm.dynamics.base_motion import NODES as SIXTH_ORDER
from spacearm.dynamics.base_motion import step_turn
from spacearm.dynamics.momentum import free_rate
from spacearm.motion import Motion
from spacearm.robot import Robot, load_robot

FINAL = (1.11508, 0.304819, -0.678856, 3.23913, 1.23781, -2.07818, -2.15025)  # rad
STEPS = tuple(2**k for k in range(1, 13))
NEEDED = {"search": 1e-5, "certificate": 1e-8}  # rad
NODES = {2: np.array([1 / 2]), 4: np.array([1 / 2 - sqrt(3) / 6, 1 / 2 + sqrt(3) / 6]), 6: SIXTH_ORDER}
NAMES = {2: "midpoint", 4: "Magnus 4", 6: "Magnus 6"}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--figure", type=Path, help="draw it")
    parser.add_argument("--json", type=Path, help="write the errors")
    given = parser.parse_args()
    robot, motion = load_robot("servicer7"), Motion([np.zeros(7), FINAL])
    found = convergence(robot, motion, steps=STEPS)
    adaptive = {tolerance: BaseMotion(robot, motion, tolerance=tolerance).steps for tolerance in NEEDED.values()}
    print("| steps | " + " | ".join(NAMES[order] for order in found.errors) + " |\n|---" + "|---" * len(found.errors) + "|")
    for i, count in enumerate(found.steps):
        print(f"| {count} | " + " | ".join(f"{errors[i]:.1e}" for errors in found.errors.values()) + " |")
    for name, tolerance in NEEDED.items():
        fewest = {NAMES[order]: needed(found, order, tolerance) for order in found.errors}
        print(f"{name}, {tolerance:g} rad: evaluations {fewest}; adaptive Magnus 6 takes {adaptive[tolerance]} steps")
    if given.json:
        values = {"steps": found.steps.tolist(), "errors_rad": {NAMES[k]: v.tolist() for k, v in found.errors.items()}}
        given.json.write_text(json.dumps(values, indent=2) + "\n")
    if given.figure:
        draw(found, given.figure)


class Convergence(NamedTuple):
    """Errors of the final attitude.

    Attributes:
        steps: (k,) numbers of equal steps over the whole path.
        errors: by the method's order, (k,) [rad] each.
        evaluations: by the method's order, (k,) evaluations of the momentum map.
    """

    steps: NDArray[np.int64]
    errors: dict[int, NDArray[np.float64]]
    evaluations: dict[int, NDArray[np.int64]]


def convergence(robot: Robot, curve: JointPath, *, steps: Sequence[int]) -> Convergence:
    """Measure methods of order 2 (midpoint), 4 and 6 against an adaptive integration; the base has no momentum.

    Multiples of the number of the path's pieces show the orders best.
    """
    begin, end = curve.domain
    right = BaseMotion(robot, curve, tolerance=1e-13).pose(end)[1]
    counts = np.array(steps, dtype=np.int64)
    errors = {order: np.zeros(len(counts)) for order in NODES}
    for i, count in enumerate(counts):
        ends = np.linspace(begin, end, count + 1)
        for order, nodes in NODES.items():
            length = np.diff(ends)
            at = ends[:-1, None] + length[:, None] * nodes
            rates = free_rate(moments(robot, curve.sample(at)), curve.sample(at, 1))
            final = running_products(exponential(turn(rates, length, order)))[-1]
            errors[order][i] = angle(multiplied(conjugate(right), final))
    return Convergence(counts, errors, {order: counts * len(nodes) for order, nodes in NODES.items()})


def turn(rates: NDArray[np.float64], length: NDArray[np.float64], order: int) -> NDArray[np.float64]:
    """The rotation vectors (..., 3) of steps by a method of this order, of rates at its nodes (..., nodes, 3)."""
    if order == 6:
        return step_turn(rates, length)
    turns = rates * length[..., None, None]
    if order == 2:
        return turns[..., 0, :]
    first, last = turns[..., 0, :], turns[..., 1, :]
    return (first + last) / 2 + sqrt(3) / 12 * cross(first, last)


def needed(found: Convergence, order: int, tolerance: float) -> int | None:
    """The fewest evaluations of the momentum map, of those tried, from which on the error stays within the tolerance."""
    beyond = np.flatnonzero(found.errors[order] > tolerance)
    first = int(beyond[-1]) + 1 if len(beyond) else 0
    return int(found.evaluations[order][first]) if first < len(found.steps) else None


def draw(found: Convergence, path: Path) -> None:
    """Errors against evaluations, with the slopes that the orders ask for, and what the search and the certificate need."""
    from spacearm.show.figure_style import BLUE, COLUMN, GREEN, GREY, SMALL, VERMILION, look, new_figure, tidy

    colors = {2: VERMILION, 4: GREEN, 6: BLUE}
    with look():
        figure = new_figure(COLUMN, 2.9)
        ax = figure.subplots()
        ax.set_xscale("log", base=2)
        ax.set_yscale("log")
        for order, errors in found.errors.items():
            at = found.evaluations[order]
            ax.plot(at, np.maximum(errors, 1e-15), "o-", color=colors[order], markersize=2.6, label=NAMES[order])
            falling = np.flatnonzero((errors > 2e-12) & (errors < 1e-5))  # where neither start nor rounding is in the way
            middle = falling[len(falling) // 2]
            line = 0.2 * errors[middle] * (at[falling] / at[middle]) ** -float(order)
            ax.plot(at[falling], line, "--", color=GREY, linewidth=0.7)
            ax.annotate(
                f"order {order}",
                (at[falling[-1]], line[-1]),
                xytext=(-3, -3),
                ha="right",
                textcoords="offset points",
                color=GREY,
                fontsize=SMALL,
            )
        most = max(at[-1] for at in found.evaluations.values())
        for name, tolerance in NEEDED.items():
            ax.axhline(tolerance, color=GREY, linewidth=0.7, linestyle=":")
            ax.annotate(
                f"{name} {tolerance:g} rad",
                (most, tolerance),
                xytext=(0, 2),
                textcoords="offset points",
                ha="right",
                color=GREY,
                fontsize=SMALL,
            )
        ax.set_xlim(1.5, 1.3 * most)
        ax.set_ylim(1e-16, 1)
        ax.set_xlabel("evaluations of the momentum map")
        ax.set_ylabel("error of the base's final attitude [rad]")
        tidy(ax)
        figure.legend(*ax.get_legend_handles_labels(), loc="outside lower center", ncols=3)
        path.unlink(missing_ok=True)
        figure.savefig(path, dpi=200, metadata={"Software": None, "Title": "convergence of the base's attitude"})


if __name__ == "__main__":
    main()
