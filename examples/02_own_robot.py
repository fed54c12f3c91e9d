"""Your own robot: from a URDF and an SRDF to a proven motion among obstacles.

    python examples/02_own_robot.py

It writes 02_own_robot.html and 02_own_robot.csv into the current folder. Problem file: 02_own_robot.yaml.
"""

from pathlib import Path

import numpy as np

import spacearm as sa

HERE = Path(__file__).parent


def main() -> None:
    """Load the robot, build the scene, plan, write."""
    robot = sa.load_robot(HERE / "arm.urdf", srdf=HERE / "arm.srdf", acceleration_limit=2.0)
    print(*robot.notes, sep="\n")
    scene = sa.Scene(
        [
            sa.Box((0.05, 1.2, 0.5), sa.pose((0.45, 0.0, 0.25)), name="panel"),
            sa.Cylinder(0.03, 1.0, (0.2, 0.45, 0.5), name="strut"),
            sa.Capsule((-0.4, -0.5, 0.2), (0.4, -0.5, 0.2), 0.02, name="handrail"),
            sa.HalfSpace(normal=(0, 0, 1), point=(0, 0, -0.1), name="deck"),
        ]
    )
    goal = sa.PositionGoal((0.52, 0.2, 0.58), tolerance=0.002)
    problem = sa.Problem(robot, scene, start=robot.configuration("ready"), goal=goal, clearance=0.015)
    plan = sa.plan(problem, sa.PlannerSettings(evaluations=10_000), rng=0)
    print(plan.message)
    rows = sa.resampled(plan.trajectory, rate_hz=100)
    np.savetxt("02_own_robot.csv", np.column_stack([rows.t, rows.q]), delimiter=",", header=",".join(["t", *robot.dof_names]))
    sa.save_report(plan, "02_own_robot.html", overwrite=True)


if __name__ == "__main__":
    main()
