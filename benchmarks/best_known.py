"""The best known values of the paper's problem, by gradient descent from many random starts: no swarm is involved.

SciPy's SLSQP minimises eq. (4) from configurations drawn within the joint limits, with the nine clearances and, in the
goal mode, the squared distance to the goal as smooth inequality constraints; gradients are central differences over the
kernel's float64 model. What it ends at is kept when the kernel finds a violation of at most 1e-9, then driven strictly
inside (violation exactly 0), so that the value is one that a feasible swarm can reach; it is recorded rounded down in
the ninth decimal, so that rounding alone beats it nowhere. The values are the best found, not proven optima.

    python benchmarks/best_known.py                    # 2,000 starts a case, as recorded in spacearm/study/paper_problem.py
    python benchmarks/best_known.py --starts 100 --cases "goal 0.10"
    python benchmarks/best_known.py --records best_known.jsonl    # the same file goes on after a stop
"""

from __future__ import annotations

import argparse
import math
from dataclasses import asdict, dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
from scipy.optimize import minimize

from instances import ARM, MODES, RADII, SETTINGS, Instance, paper_instance
from spacearm.study.run_study import Study, run_study

ALLOWED = 1e-9  # violation of a descent's end [m]
MARGINS = (1e-12, 1e-11, 1e-10, 1e-9)  # how far inside the last descent aims [m], the least that gives violation 0
STEP = 1e-5  # of the central differences [rad]: their error is near 1e-10
SAME_VALUE = 1e-6  # two ends are equally good
SAME_POSE = 1e-3  # and the same pose, when elbow, wrist and end effector are this close [m]


class Descent:
    """SLSQP on one instance. Values and gradients of a configuration come from one call of the kernel."""

    def __init__(self, instance: Instance) -> None:
        self.instance = instance
        self.goal = np.array(instance.goal) if instance.mode == "goal" else None
        self.around = np.vstack([np.zeros(7), STEP * np.eye(7), -STEP * np.eye(7)])  # (15, 7)
        self._at: bytes = b""
        self._values: np.ndarray = np.empty(0)

    def values(self, q: np.ndarray) -> np.ndarray:
        """Fitness, clearances [m] and, in the goal mode, the squared distance, at q and at its neighbours, (15, m)."""
        if q.tobytes() != self._at:
            rows = q + self.around
            native = self.instance.model.model64
            columns = [self.instance.objective.evaluate(rows)[0][:, None], native.clearances(rows).reshape(15, -1)]
            if self.goal is not None:
                left = native.points(rows)[:, self.instance.model.tip] - self.goal
                columns.append(np.sum(left * left, axis=1, keepdims=True))
            self._at, self._values = q.tobytes(), np.hstack(columns)
        return self._values

    def gradients(self, q: np.ndarray) -> np.ndarray:
        """Of all of them, (m, 7), rows contiguous: SciPy 1.17 reads a strided gradient as if it were."""
        v = self.values(q)
        return np.ascontiguousarray(((v[1:8] - v[8:15]) / (2 * STEP)).T)

    def run(self, q: np.ndarray, *, margin: float = 0.0, scale: float = 1.0) -> np.ndarray:
        """Descend from q (7,); constraints hold with this margin [m]; the goal's is multiplied by `scale`."""
        reach = (SETTINGS.tolerance - margin) ** 2

        def constraints(q: np.ndarray) -> np.ndarray:
            v = self.values(q)[0, 1:]
            return v - margin if self.goal is None else np.append(v[:-1] - margin, scale * (reach - v[-1]))

        def slopes(q: np.ndarray) -> np.ndarray:
            g = self.gradients(q)[1:].copy()
            if self.goal is not None:
                g[-1] *= -scale
            return g

        found = minimize(
            lambda q: self.values(q)[0, 0],
            q,
            jac=lambda q: self.gradients(q)[0],
            method="SLSQP",
            bounds=list(zip(ARM.lower, ARM.upper, strict=True)),
            constraints={"type": "ineq", "fun": constraints, "jac": slopes},
            options={"maxiter": 300, "ftol": 1e-13},
        )
        return np.clip(found.x, ARM.lower, ARM.upper)

    def judge(self, q: np.ndarray) -> tuple[float, float]:
        """The kernel's fitness and violation."""
        fitness, violation = self.instance.objective.evaluate(q[None, :])
        return float(fitness[0]), float(violation[0])

    def strictly_feasible(self, q: np.ndarray) -> tuple[float, np.ndarray] | None:
        """The best end near q whose violation is exactly 0; None if no margin gives one."""
        ends = [q, *(self.run(q, margin=margin, scale=1 / SETTINGS.tolerance) for margin in MARGINS)]
        judged = [(*self.judge(end), end) for end in ends]
        feasible = [(fitness, end) for fitness, violation, end in judged if violation == 0]
        return min(feasible, key=lambda pair: pair[0]) if feasible else None


@dataclass(frozen=True, kw_only=True)
class Start:
    """A descent: on an instance, from the configuration that is drawn from a seed and a number."""

    instance: Instance
    seed: int
    number: int


@dataclass(frozen=True, kw_only=True)
class End:
    """Where a descent ended: the kernel's fitness and violation, and the configuration (7,) [rad]."""

    fitness: float
    violation: float
    q: tuple[float, ...]


@lru_cache(maxsize=8)
def descent_on(instance: Instance) -> Descent:
    """Return the descent on an instance, made once in a process."""
    return Descent(Instance(**asdict(instance)))


def descend(start: Start) -> End:
    """Descend."""
    descent = descent_on(start.instance)
    q = descent.run(np.random.default_rng((start.seed, start.number)).uniform(ARM.lower, ARM.upper))
    fitness, violation = descent.judge(q)
    return End(fitness=fitness, violation=violation, q=tuple(q.tolist()))


DESCENTS = Study(
    name="descents",
    run=descend,
    record=End,
    key=lambda start: f"{start.instance.name}, seed {start.seed}, start {start.number}",
    definition=lambda start: asdict(start.instance),
)
"""The study of the descents."""


@dataclass(frozen=True, kw_only=True)
class BestKnown:
    """What the descents of one instance found.

    Attributes:
        fitness: the least of a configuration with violation 0.
        q: (7,) that configuration [rad].
        starts: of descents.
        kept: those that ended feasible.
        reached: those whose end is as good as the best.
        poses: how many distinct poses (elbow, wrist, end effector) these are.
    """

    fitness: float
    q: np.ndarray
    starts: int
    kept: int
    reached: int
    poses: int


def starts_on(instance: Instance, *, starts: int, seed: int = 0) -> list[Start]:
    """Return the descents of an instance."""
    return [Start(instance=instance, seed=seed, number=number) for number in range(starts)]


def best_of(instance: Instance, ends: list[End]) -> BestKnown:
    """Return the best that descents of an instance found.

    Raises:
        RuntimeError: none ended strictly feasible.
    """
    descent = descent_on(instance)
    kept = sorted(((end.fitness, np.array(end.q)) for end in ends if end.violation <= ALLOWED), key=lambda pair: pair[0])
    polished = [end for _, q in kept[:20] if (end := descent.strictly_feasible(q))]
    if not polished:
        raise RuntimeError(f"no descent on {instance.name} ended strictly feasible; allow more starts")
    fitness, q = min(polished, key=lambda pair: pair[0])
    good = [q for f, q in kept if f <= fitness + SAME_VALUE]
    poses: list[np.ndarray] = []
    for points in descent.instance.model.model64.points(np.array([q, *good])):
        if all(np.abs(points - other).max() > SAME_POSE for other in poses):
            poses.append(points)
    return BestKnown(fitness=fitness, q=q, starts=len(ends), kept=len(kept), reached=len(good), poses=len(poses))


def main() -> None:
    """Descend, and print the best known value of each case."""
    cases = {f"{mode} {radius:.2f}": paper_instance(mode, radius) for mode in MODES for radius in RADII}
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--starts", type=int, default=2000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--cases", nargs="+", default=list(cases), choices=list(cases), metavar="CASE")
    parser.add_argument("--jobs", type=int, help="processes (default: one a processor core)")
    parser.add_argument("--records", type=Path, help="file of records; the same again goes on after a stop")
    args = parser.parse_args()
    for case in args.cases:
        tasks = starts_on(cases[case], starts=args.starts, seed=args.seed)
        best = best_of(cases[case], run_study(DESCENTS, tasks, records=args.records, jobs=args.jobs))
        recorded = math.floor(best.fitness * 1e9) / 1e9
        print(f"{case}: {best.fitness!r}, recorded as {recorded:.9f}")
        print(f"  {best.kept} of {best.starts} descents ended feasible, {best.reached} at this value, in {best.poses} poses")
        print(f"  q = {np.array2string(best.q, precision=9, separator=', ', max_line_width=200)}", flush=True)


if __name__ == "__main__":
    main()
