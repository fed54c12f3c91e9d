"""`minimize` for any function: where should a camera arm wait? Constraints, a checkpoint, and a plan to the result.

    python examples/10_minimize.py

The swarm looks for a configuration that sees a target from 0.3 m, as far as possible from all obstacles. The run is written to
10_minimize.checkpoint every ten iterations: stopped by Ctrl-C and started again, it goes on. It writes 10_minimize.html.
"""

from pathlib import Path

import numpy as np

import spacearm as sa

HERE = Path(__file__).parent
TARGET = np.array([0.2, 0.45, 0.6])  # a point on the strut [m]


def main() -> None:
    """Minimise, then plan to what was found."""
    problem = sa.load_problem(HERE / "02_own_robot.yaml")
    robot = problem.robot

    def f(q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return minus the clearance [m], and by how much distance and direction are missed, for q (particles, n)."""
        hand = sa.forward_kinematics(robot, q)
        to_target = TARGET - hand[:, :3, 3]
        distance = np.linalg.norm(to_target, axis=1)
        off = np.arccos(np.clip((hand[:, :3, 2] * to_target).sum(1) / distance, -1, 1))
        violation = np.maximum(abs(distance - 0.3) - 0.01, 0) + np.maximum(off - np.radians(2), 0)
        return -sa.clearance(problem, q), violation

    settings = sa.named_settings("ring-small")
    where = "10_minimize.checkpoint"
    best = sa.minimize(f, robot.lower, robot.upper, settings, rng=0, checkpoint=where, resume=True)
    print(best.message, f"{-1e3 * best.fitness:.0f} mm from everything, violation {best.violation:g}")
    there = sa.Problem(robot, problem.scene, start=problem.start, goal=best.x)
    plan = sa.plan(there, sa.PlannerSettings(evaluations=5000), rng=0)
    print(plan.message)
    sa.save_report(plan, "10_minimize.html", overwrite=True)


if __name__ == "__main__":
    main()
