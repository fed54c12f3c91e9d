"""A study: how the clearance that is asked for changes the length of the motion and its proven clearance.

    python examples/11_clearance_study.py

The records go into clearance_study.jsonl as they come, the report into 11_clearance_study.html in the end. Run again, the
program goes on where it was stopped.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from spacearm import PlannerSettings, load_problem, plan
from spacearm.files import plan_as_dict
from spacearm.study.run_study import Study, run_study
from spacearm.study.statistics import mean, share_interval
from spacearm.study.study_page import save_study_report
from spacearm.study.study_records import file_digest
from spacearm.study.study_tables import Table, markdown, number, percent

PROBLEM = Path(__file__).parent / "01_first_plan.yaml"
CLEARANCES = (0.0, 0.01, 0.02)  # [m]
EVALUATIONS = 2000  # of each plan
REPORT = "11_clearance_study.html"


@dataclass(frozen=True, kw_only=True)
class Task:
    """A plan with a clearance [m] and a seed."""

    clearance: float
    seed: int


@dataclass(frozen=True, kw_only=True)
class Record:
    """What became of it: the status, the length [rad] and the proven clearance [m] of the motion; None without one.

    The first plan of each clearance is kept, so that the report shows it.
    """

    asked: float
    status: str
    length: float | None
    proven: float | None
    plan: dict[str, Any] | None


def run(task: Task) -> Record:
    """Plan."""
    settings = PlannerSettings(evaluations=EVALUATIONS, threads=1)
    found = plan(replace(load_problem(PROBLEM), clearance=task.clearance), settings, rng=task.seed)
    proven = found.found and found.trajectory is not None and found.certificate is not None
    return Record(
        asked=task.clearance,
        status=found.status,
        length=found.trajectory.motion.length() if proven else None,
        proven=found.certificate.clearance if proven else None,
        plan=plan_as_dict(found) if proven and task.seed == 0 else None,
    )


STUDY = Study(
    name="clearances",
    run=run,
    record=Record,
    key=lambda task: f"clearance {1e3 * task.clearance:g} mm, seed {task.seed}",
    definition=lambda task: {"problem": file_digest(PROBLEM), "evaluations": EVALUATIONS},
)


def main() -> None:
    """Run the study, print its table, and write its report."""
    tasks = [Task(clearance=clearance, seed=seed) for clearance in CLEARANCES for seed in range(4)]
    records = run_study(STUDY, tasks, records="clearance_study.jsonl", jobs=2)
    rows = []
    for asked in CLEARANCES:
        these = [record for record in records if record.asked == asked]
        found = sum(record.status == "found" for record in these)
        low, high = share_interval(found, len(these))
        rows.append(
            (
                f"{1e3 * asked:g} mm",
                f"{found} of {len(these)}",
                f"{percent(low)} to {percent(high)}",
                number(mean([record.length for record in these if record.length is not None]), 2),
                number(1e3 * mean([record.proven for record in these if record.proven is not None]), 1),
            )
        )
    header = ("asked for", "found", "interval", "length [rad]", "proven [mm]")
    notes = (
        "interval: the share of motions found lies in it with 95 % confidence",
        "length and proven clearance: means of the motions found",
    )
    table = Table("How the clearance matters", header, rows)
    print(markdown([table], notes))
    save_study_report(
        REPORT,
        {STUDY.key(task): record for task, record in zip(tasks, records, strict=True)},
        title="How the clearance matters",
        by="asked",
        units={"asked": (1e3, "mm"), "proven": (1e3, "mm"), "length": (1.0, "rad")},
        tables=[table],
        notes=notes,
        command="python examples/11_clearance_study.py",
        overwrite=True,
    )
    print(f"report: {REPORT}")


if __name__ == "__main__":
    main()
