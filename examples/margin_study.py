"""A study: how the margin that the planner keeps changes the length of the motion and its proven clearance.

    python examples/margin_study.py

The records go into margin_study.jsonl as they come. Run again, the program goes on where it was stopped.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from spacearm import PlannerSettings, load_problem, plan
from spacearm.study.run_study import Study, run_study
from spacearm.study.statistics import mean, share_interval
from spacearm.study.study_records import file_digest
from spacearm.study.study_tables import Table, markdown, number, percent

PROBLEM = Path(__file__).parent / "problem.yaml"
MARGINS = (0.002, 0.01, 0.02)  # [m]
EVALUATIONS = 2000  # of each plan


@dataclass(frozen=True, kw_only=True)
class Task:
    """A plan with a margin [m] and a seed."""

    margin: float
    seed: int


@dataclass(frozen=True, kw_only=True)
class Record:
    """What became of it: the status, the length [rad] and the proven clearance [m] of the motion; None without one."""

    margin: float
    status: str
    length: float | None
    clearance: float | None


def run(task: Task) -> Record:
    """Plan."""
    settings = PlannerSettings(margin=task.margin, evaluations=EVALUATIONS, threads=1)
    found = plan(load_problem(PROBLEM), settings, rng=task.seed)
    proven = found.found and found.trajectory is not None and found.certificate is not None
    return Record(
        margin=task.margin,
        status=found.status,
        length=found.trajectory.motion.length() if proven else None,
        clearance=found.certificate.clearance if proven else None,
    )


STUDY = Study(
    name="margins",
    run=run,
    record=Record,
    key=lambda task: f"margin {1e3 * task.margin:g} mm, seed {task.seed}",
    definition=lambda task: {"problem": file_digest(PROBLEM), "evaluations": EVALUATIONS},
)


def main() -> None:
    """Run the study and print its table."""
    tasks = [Task(margin=margin, seed=seed) for margin in MARGINS for seed in range(4)]
    records = run_study(STUDY, tasks, records="margin_study.jsonl", jobs=2)
    rows = []
    for margin in MARGINS:
        these = [record for record in records if record.margin == margin]
        found = sum(record.status == "found" for record in these)
        low, high = share_interval(found, len(these))
        rows.append(
            (
                f"{1e3 * margin:g} mm",
                f"{found} of {len(these)}",
                f"{percent(low)} to {percent(high)}",
                number(mean([record.length for record in these if record.length is not None]), 2),
                number(1e3 * mean([record.clearance for record in these if record.clearance is not None]), 1),
            )
        )
    header = ("margin", "found", "interval", "length [rad]", "clearance [mm]")
    notes = (
        "interval: the share of motions found lies in it with 95 % confidence",
        "length and clearance: means of the motions found",
    )
    print(markdown([Table("How the margin matters", header, rows)], notes))


if __name__ == "__main__":
    main()
