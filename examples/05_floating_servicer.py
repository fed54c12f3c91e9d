"""A floating base: one goal planned twice, for a base that is held and for one that floats, side by side in one report.

    python examples/05_floating_servicer.py

It writes 05_floating_servicer.html into the current folder. 05_floating_servicer.yaml is a harder problem of this kind.
"""

from dataclasses import replace

import numpy as np

import spacearm as sa


def main() -> None:
    """Plan for both, and show what the first motion does when the base floats."""
    robot = sa.load_robot("srs7")
    scene = sa.Scene(
        [
            sa.Capsule((0.82, 0.15, -0.6), (0.82, 0.15, 1.2), 0.04, name="strut A"),
            sa.Capsule((0.67, -0.12, -0.6), (0.67, -0.12, 1.2), 0.04, name="strut B"),
        ]
    )
    start = np.radians([-25, 63, 0, 41, 0, 0, 0])
    goal = sa.PositionGoal((0.58, 0.36, 0.39))
    settings = sa.PlannerSettings(evaluations=4000)
    held = sa.plan(sa.Problem(robot, scene, start=start, goal=goal, base="fixed"), settings, rng=0)
    free = sa.Problem(robot, scene, start=start, goal=goal, base="floating")
    print("held:   ", held.message)
    print("adrift: ", sa.certify(free, replace(held.trajectory, base="floating")).message)
    planned = sa.plan(free, settings, rng=0)
    print("planned:", planned.message)
    sa.save_report([planned, held], "05_floating_servicer.html", overwrite=True)


if __name__ == "__main__":
    main()
