"""Two arms at once: each hand goes to a pose of its own, and all pairs of both arms are proven to keep clear.

    python examples/08_two_arms.py

It writes 08_two_arms.html into the current folder. 08_two_arms.yaml has the same robot with a floating base.
"""

from pathlib import Path

import numpy as np

import spacearm as sa

HERE = Path(__file__).parent
FORWARD = (np.sqrt(0.5), 0.0, np.sqrt(0.5), 0.0)  # wxyz: the tool's z axis along x
GRIPS = {"left": sa.pose((1.2, 0.25, 1.1), FORWARD), "right": sa.pose((1.2, -0.2, 1.1), FORWARD)}


def load(group: str) -> sa.Robot:
    """Load the robot; the joints of this group move."""
    tip = "left_tool" if group == "both" else f"{group}_tool"
    return sa.load_robot(HERE / "two_arms.urdf", srdf=HERE / "two_arms.srdf", group=group, tip=tip, acceleration_limit=0.2)


def grips(scene: sa.Scene, side: str) -> np.ndarray:
    """Return configurations (g, 6) of one arm in which its hand is at its pose."""
    arm = load(side)
    problem = sa.Problem(arm, scene, start=arm.configuration("folded"), goal=sa.PoseGoal(GRIPS[side]))
    return sa.plan(problem, sa.PlannerSettings(stop_at_first=True), rng=0).goals


def main() -> None:
    """Find the grips of each arm, then one motion of both to any pair of them."""
    scene = sa.Scene(
        [
            sa.Box((0.8, 0.8, 0.8), (1.75, 0.0, 1.0), name="client bus"),
            sa.Cylinder(0.03, 0.5, sa.pose((1.1, 0.05, 1.1), FORWARD), name="mast"),
        ]
    )
    pairs = [np.concatenate([left, right]) for left in grips(scene, "left") for right in grips(scene, "right")]
    robot = load("both")
    problem = sa.Problem(robot, scene, start=robot.configuration("folded"), goal=sa.ConfigurationsGoal(pairs))
    plan = sa.plan(problem, sa.PlannerSettings(evaluations=10_000), rng=0)
    print(plan.message)
    sa.save_report(plan, "08_two_arms.html", overwrite=True)


if __name__ == "__main__":
    main()
