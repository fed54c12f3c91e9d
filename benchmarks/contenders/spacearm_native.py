"""spacearm with the objective in its own kernel: the same problem, no Python in the loop."""

from contenders.problems import PROBLEMS
from contenders.protocol import Task, serve
from contenders.spacearm_python import fitted
from instances import paper_instance
from spacearm.swarm import PSO, Penalty, SwarmSettings, named_settings, run_trials

INSTANCES = {name: paper_instance(mode, 0.10) for name, mode in (("paper", "goal"), ("paper-literal", "literal"))}


def _run(task: Task, settings: SwarmSettings) -> None:
    objective = INSTANCES[task.problem.name].objective
    settings = fitted(task, settings)
    (run,) = run_trials(objective, task.lower, task.upper, settings, seed=task.seed, threads=1)
    task.found(run.x, run.evaluations)


def pso_penalty(task: Task) -> None:
    _run(task, PSO(particles=task.particles, constraints=Penalty()))


def pso(task: Task) -> None:
    _run(task, PSO(particles=task.particles))


def ipso(task: Task) -> None:
    _run(task, named_settings("ipso-m"))


def ring(task: Task) -> None:
    _run(task, named_settings("ring-rising"))


if __name__ == "__main__":
    serve(
        "spacearm_native",
        {
            ("PSO", "penalty"): pso_penalty,
            ("PSO", "feasible first"): pso,
            ("IPSO-M", "feasible first"): ipso,
            ("ring-rising", "rising penalty"): ring,
        },
        distribution="spacearm",
        problems=[name for name in PROBLEMS if name in INSTANCES],
    )
