"""A fitness of your own: the camera in the hand looks at a target during the motion, as far as the obstacles let it.

    python examples/09_own_fitness.py

It writes 09_own_fitness.html with two motions: the shortest one, and the one that looks.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np

import spacearm as sa

HERE = Path(__file__).parent
TARGET = np.array([0.45, 0.0, 0.25])  # the middle of the panel [m]
AT = np.linspace(0, 1, 33)  # the instants that are looked at


def looks_away(robot: sa.Robot, motions: np.ndarray) -> np.ndarray:
    """Return the mean angle between the hand's z axis and the direction to the target [rad], for each of (m, K + 2, n)."""
    shares = sa.Motion(np.eye(motions.shape[1])).sample(AT)  # (33, K + 2): what each control point adds at each instant
    hand = sa.forward_kinematics(robot, shares @ motions)  # (m, 33, 4, 4)
    to_target = TARGET - hand[..., :3, 3]
    cosine = (hand[..., :3, 2] * to_target).sum(-1) / np.linalg.norm(to_target, axis=-1)
    return np.arccos(np.clip(cosine, -1, 1)).mean(-1)


def main() -> None:
    """Plan the shortest motion, then search again with the own term, and prove what is found."""
    problem = sa.load_problem(HERE / "02_own_robot.yaml")
    shortest = sa.plan(problem, sa.PlannerSettings(evaluations=5000), rng=0)
    settings = sa.PlannerSettings(interior_points=(4,), swarm=sa.PSO(particles=40, iterations=150, inertia=0.6, neighbours=3))
    swarm = sa.MotionSwarm(problem, settings, goal=shortest.goals[0], rng=0)
    while not swarm.done:
        motions = swarm.ask()
        judged = swarm.judge(motions)
        swarm.tell(judged.fitness + 3.0 * looks_away(problem.robot, motions), judged.violation)
    looking = sa.Trajectory(problem.robot, swarm.best)
    for name, trajectory in (("shortest", shortest.trajectory), ("looking", looking)):
        away = np.degrees(looks_away(problem.robot, trajectory.motion.control_points[None])[0])
        certificate = sa.certify(problem, trajectory)
        print(f"{name}: {away:.0f} degrees from the target; {certificate.status}, {trajectory.motion.length():.2f} rad long")
    watched = replace(shortest, trajectory=looking, certificate=certificate)
    sa.save_report([watched, shortest], "09_own_fitness.html", overwrite=True)


if __name__ == "__main__":
    main()
