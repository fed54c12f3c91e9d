"""pymoo: PSO with Table 1's settings and DE with its defaults; both know constraints (feasible first)."""

from pymoo.algorithms.soo.nonconvex.de import DE
from pymoo.algorithms.soo.nonconvex.pso import PSO
from pymoo.core.algorithm import Algorithm
from pymoo.core.problem import Problem
from pymoo.optimize import minimize

from contenders.protocol import Task, serve


class _Problem(Problem):
    def __init__(self, task: Task) -> None:
        self.task = task
        constraints = 1 if task.handling == "feasible first" and task.problem.constrained else 0
        super().__init__(n_var=len(task.lower), n_obj=1, n_ieq_constr=constraints, xl=task.lower, xu=task.upper)

    def _evaluate(self, x, out, *args, **kwargs):
        if self.n_ieq_constr:
            fitness, violation = self.task.evaluate(x)
            out["F"], out["G"] = fitness[:, None], violation[:, None]
        else:
            out["F"] = self.task.penalised(x)[:, None]


def _solve(task: Task, algorithm: Algorithm, generations: int) -> None:
    minimize(_Problem(task), algorithm, ("n_gen", generations), seed=task.seed, verbose=False)


def pso_table1(task: Task) -> None:
    algorithm = PSO(
        pop_size=task.particles,
        w=0.5,
        c1=2.0,
        c2=2.0,
        adaptive=False,
        pertube_best=False,
        max_velocity_rate=1.0,
    )
    _solve(task, algorithm, task.iterations)


def pso_default(task: Task) -> None:
    _solve(task, PSO(pop_size=task.particles), task.iterations)


def de(task: Task) -> None:
    _solve(task, DE(), task.budget // 100)  # its default population is 100


if __name__ == "__main__":
    serve(
        "pymoo",
        {
            ("PSO", "penalty"): pso_table1,
            ("PSO", "feasible first"): pso_table1,
            ("PSO, its defaults", "feasible first"): pso_default,
            ("DE", "penalty"): de,
            ("DE", "feasible first"): de,
        },
    )
