"""OMPL's planners on our kernel's checks, which they call through Python: once for a motion, with all its configurations.

A C++ planner would not pay for Python. So it is counted apart: what the checker takes beyond the kernel, and what one call
into Python costs at least (`empty_call`).
"""

from __future__ import annotations

import time

import numpy as np
from cases import PIECE, Case, Trace, along, length_of
from ompl import base, geometric, util

from spacearm.planner.kernel_model import kernel_model

util.noOutputHandler()
RANGE = 1.0  # of a step of the trees [rad]: what VAMP's authors chose for this arm; OMPL's own choice is slower here
PLANNERS = {"RRTConnect": geometric.RRTConnect, "AORRTC": geometric.AORRTC, "BITstar": geometric.BITstar}


class Checker(base.MotionValidator):
    """Looks at configurations, and at motions in pieces, by the kernel; counts."""

    def __init__(self, information: base.SpaceInformation, case: Case) -> None:
        super().__init__(information)
        self.dof = len(case.start)
        self.margin = case.margin
        self.kernel = kernel_model(case.problem.robot, case.problem.scene).model32
        self.calls = self.configurations = 0
        self.in_kernel = self.in_python = 0.0

    def free(self, rows: np.ndarray) -> bool:
        begun = time.perf_counter()
        short = self.kernel.shortfalls(rows, self.margin, True)
        self.in_kernel += time.perf_counter() - begun
        self.configurations += len(rows)
        self.calls += 1
        return not short.any()

    def isFree(self, state: base.State) -> bool:
        begun, kernel = time.perf_counter(), self.in_kernel
        free = self.free(np.array([[state[i] for i in range(self.dof)]], dtype=np.float32))
        self.in_python += time.perf_counter() - begun - (self.in_kernel - kernel)
        return free

    def checkMotion(self, a: base.State, b: base.State) -> bool:
        begun, kernel = time.perf_counter(), self.in_kernel
        ends = np.array([[state[i] for i in range(self.dof)] for state in (a, b)])
        free = self.free(along(ends, PIECE)[1:].astype(np.float32))
        self.in_python += time.perf_counter() - begun - (self.in_kernel - kernel)
        return free


def planned(name: str, case: Case, seed: int, seconds: float, *, simplify: bool = True, step: float | None = RANGE) -> Trace:
    """A planner's run; RRT-Connect ends with its first way and simplifies it, the others go on until the time is over.

    Args:
        name: of the planner.
        case: what to solve.
        seed: of OMPL's random numbers.
        seconds: limit.
        simplify: RRT-Connect's way.
        step: of the trees [rad]; None: OMPL's own choice.
    """
    util.RNG.setSeed(seed + 1)
    space = base.RealVectorStateSpace(len(case.start))
    bounds = base.RealVectorBounds(len(case.start))
    for i, (low, high) in enumerate(zip(case.problem.robot.lower, case.problem.robot.upper, strict=True)):
        bounds.setLow(i, float(low))
        bounds.setHigh(i, float(high))
    space.setBounds(bounds)
    setup = geometric.SimpleSetup(space)
    information = setup.getSpaceInformation()
    checker = Checker(information, case)
    setup.setStateValidityChecker(checker.isFree)
    information.setMotionValidator(checker)
    ends = [space.allocState() for _ in range(2)]
    for state, q in zip(ends, (case.start, case.goal), strict=True):
        for i, value in enumerate(q):
            state[i] = float(value)
    setup.setStartAndGoalStates(*ends)
    setup.setOptimizationObjective(base.PathLengthOptimizationObjective(information))
    planner = PLANNERS[name](information)
    if step is not None and hasattr(planner, "setRange"):
        planner.setRange(step)
    setup.setPlanner(planner)
    anytime = name != "RRTConnect"
    trace = Trace(f"OMPL {name}" if anytime else "OMPL RRT-Connect, simplified", case.name, seed)
    setup.setup()
    begun = time.perf_counter()

    def over() -> bool:
        now = time.perf_counter() - begun
        if anytime:
            cost = planner.bestCost().value()
            if np.isfinite(cost) and cost > 0:
                trace.note(now, checker.calls, cost)
        return now > seconds

    setup.solve(base.PlannerTerminationCondition(over))
    if setup.haveExactSolutionPath():
        if simplify and not anytime:
            setup.simplifySolution()
        corners = np.array([[state[i] for i in range(len(case.start))] for state in setup.getSolutionPath().getStates()])
        if len(corners) > 1 and np.allclose(corners[[0, -1]], [case.start, case.goal], atol=1e-4):  # AORRTC's once was empty
            trace.note(time.perf_counter() - begun, checker.calls, length_of(corners))
            trace.way = along(corners, 0.005)
    trace.seconds = time.perf_counter() - begun
    trace.calls, trace.configurations = checker.calls, checker.configurations
    trace.kernel, trace.python = checker.in_kernel, checker.in_python
    return trace


def empty_call(case: Case, *, times: int = 20_000) -> float:
    """What it costs OMPL to ask Python at all: a motion check that says yes [s]."""
    space = base.RealVectorStateSpace(len(case.start))
    information = base.SpaceInformation(space)

    class Yes(base.MotionValidator):
        def checkMotion(self, a: base.State, b: base.State) -> bool:
            return True

    yes = Yes(information)
    information.setMotionValidator(yes)
    state = space.allocState()
    ask = information.checkMotion
    begun = time.perf_counter()
    for _ in range(times):
        ask(state, state)  # into C++ and back into Python: two crossings, where a planner's call has one
    crossing = time.perf_counter() - begun
    begun = time.perf_counter()
    for _ in range(times):
        information.getStateDimension()  # into C++ alone
    return max(crossing - (time.perf_counter() - begun), 0.0) / times
