"""A first plan: the arm of the paper among its three obstacles, proven, and a report to look at.

    python examples/01_first_plan.py

It writes 01_first_plan.html and 01_first_plan.json into the current folder. Problem file: 01_first_plan.yaml.
"""

import spacearm as sa


def main() -> None:
    """Plan, say what is proven, write."""
    robot = sa.load_robot("zhang2022")
    scene = sa.Scene([sa.Sphere((0.5, 0.5, 0.0), 0.1), sa.Sphere((0.4, 0.7, 0.0), 0.1), sa.Sphere((0.2, 0.8, 0.0), 0.1)])
    problem = sa.Problem(robot, scene, start=[0] * 7, goal=sa.PositionGoal((0.7, 0.3, 0.0)))
    plan = sa.plan(problem, sa.PlannerSettings(evaluations=10_000), rng=0)
    print(plan.message)
    sa.save_plan(plan, "01_first_plan.json", overwrite=True)
    sa.save_report(plan, "01_first_plan.html", overwrite=True)
    print("open 01_first_plan.html in a browser")


if __name__ == "__main__":
    main()
