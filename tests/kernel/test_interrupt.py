"""A search releases Python's lock, and stops on Ctrl-C or when its caller says so; no input ends the process."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
import time
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from kernel import misuse, objectives
from kernel.builds import BUILDS, Build, place
from spacearm.core.native import available_levels
from spacearm.geometry import Sphere
from spacearm.robot import Frame, Joint, Robot
from support.kernel_variants import VARIANTS

ROBOT = objectives.paper_robot()
BOUNDS = np.array(ROBOT.lower), np.array(ROBOT.upper)
ENDLESS = {"particles": 300, "evaluations": 10**12}
AT_MOST = 30.0  # [s] a trial, should nothing stop it
BUILD = next(build for build in BUILDS if build.level in available_levels())


OBJECTIVE = objectives.paper_objective(BUILD, ROBOT)


def endless(**options: Any) -> list[dict[str, Any]]:
    """A search that only its caller, a signal or AT_MOST ends."""
    return objectives.searched(BUILD, OBJECTIVE, BOUNDS, ENDLESS, **{"seconds": AT_MOST, **options})


def run_alone(program: str) -> subprocess.CompletedProcess[str]:
    """Run a program in a process of its own, which it may end."""
    tests = Path(__file__).parents[1]
    command = [sys.executable, "-c", program]
    return subprocess.run(command, cwd=tests, capture_output=True, text=True, timeout=60, check=False)


POSIX = pytest.mark.skipif(not hasattr(os, "fork"), reason="signals and forked processes are POSIX's")

# ---- Ctrl-C ----------------------------------------------------------------------------------------------------------

INTERRUPTED = """
import os, signal, threading, time
from kernel.test_interrupt import endless

sent = []

def interrupt():
    sent.append(time.perf_counter())
    os.kill(os.getpid(), signal.SIGINT)

threading.Timer(0.3, interrupt).start()
try:
    endless(threads={threads}, trials={threads}, progress={progress})
except KeyboardInterrupt:
    print(time.perf_counter() - sent[0])
"""


@POSIX
@pytest.mark.parametrize("progress", ["None", "lambda done: None"])
@pytest.mark.parametrize("threads", [1, 2, 5])
def test_ctrl_c_ends_a_search(threads: int, progress: str) -> None:
    """Within a tenth of a second, and the length of a round; the measured time is printed (pytest -rP)."""
    done = run_alone(INTERRUPTED.format(threads=threads, progress=progress))
    assert done.returncode == 0, done.stderr
    latency = float(done.stdout)
    print(f"interrupted after {1e3 * latency:.0f} ms with {threads} threads")
    assert latency < 1


# Rounds of more than 40 ms, so that the calling thread waits for a helper after the search was stopped.
LONG_ROUNDS = """
import os, signal, threading
from kernel import objectives
from kernel.test_interrupt import BOUNDS, BUILD, ROBOT

from spacearm.geometry import Sphere

crowd = tuple(Sphere((0.01 * i, 0.5, 0.5), 0.1) for i in range(100))
objective = objectives.paper_objective(BUILD, ROBOT, crowd)

def search(progress):
    settings = {"particles": 100_000, "evaluations": 10**12}
    objectives.searched(BUILD, objective, BOUNDS, settings, trials=2, threads=2, seconds=20.0, progress=progress)
"""


@POSIX
def test_ctrl_c_in_a_search_on_threads_with_progress_does_not_end_the_process() -> None:
    """Once interrupted, the thread that waits for the others leaves progress alone."""
    program = """
threading.Timer(0.5, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
try:
    search(lambda done: None)
except KeyboardInterrupt:
    print("interrupted")
"""
    done = run_alone(LONG_ROUNDS + program)
    assert (done.returncode, done.stdout) == (0, "interrupted\n"), done.stderr


def test_progress_that_raises_while_helpers_finish_does_not_end_the_process() -> None:
    """The calling thread is through and waits; what its progress raises there must wait for the others too."""
    program = """
import time
from kernel.test_interrupt import Mine, endless

begun, slept = time.perf_counter(), []

def progress(done):
    if not slept:
        slept.append(time.sleep(0.7))  # meanwhile the helper, through with its first trial, takes the third
    elif time.perf_counter() > begun + 0.85:
        raise Mine("mine")

try:
    endless(trials=3, threads=2, seconds=0.5, progress=progress)
except Mine as error:
    print(error)
"""
    done = run_alone(program)
    assert (done.returncode, done.stdout) == (0, "mine\n"), done.stderr


# ---- other threads ---------------------------------------------------------------------------------------------------


class Counter(threading.Thread):
    """Counts for as long as it is let."""

    def __init__(self) -> None:
        super().__init__(daemon=True)
        self.count, self.go_on = 0, True

    def run(self) -> None:
        while self.go_on:
            self.count += 1


@pytest.mark.parametrize("what", ["search", "evaluate", "joint_frames", "points", "clearances"])
def test_another_python_thread_goes_on_meanwhile(what: str) -> None:
    """A thread that waits for the interpreter's lock counts to next to nothing."""
    q = np.random.default_rng(0).uniform(*BOUNDS, (50_000, 7))
    same = np.broadcast_to(q[0], (2_000_000, 7))
    model = place(BUILD, ROBOT, points=[(6, (0, 0, 0))], spheres=objectives.OBSTACLES).native
    # Each has to outlast Python's switch interval of 5 ms by far.
    calls = {
        "search": lambda: endless(seconds=0.2),
        "evaluate": lambda: OBJECTIVE.evaluate(same),
        "joint_frames": lambda: model.joint_frames(q),
        "points": lambda: model.points(same[:400_000]),
        "clearances": lambda: model.clearances(same[:400_000]),
    }
    counter = Counter()
    counter.start()
    while counter.count == 0:
        time.sleep(1e-3)
    try:
        before = counter.count
        calls[what]()
        counted = counter.count - before
    finally:
        counter.go_on = False
        counter.join()
    assert counted > 1000


# ---- progress --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("threads", [1, 2])
def test_progress_is_told_the_rounds_done_and_ends_the_search_with_false(threads: int) -> None:
    told: list[int] = []

    def progress(done: int) -> bool:
        told.append(done)
        return len(told) < 3

    runs = endless(trials=threads, threads=threads, progress=progress)
    assert len(told) >= 3
    assert all(isinstance(done, int) for done in told)
    assert told == sorted(told)
    assert told[0] > 0
    assert len(runs) == threads
    assert told[0] <= sum(run.rounds for run in runs) < 10**12 / 300
    for run in runs:
        assert run.rounds == len(run.fitness_history)
        assert run.evaluations == 300 * run.rounds


def test_trials_not_begun_when_a_search_is_stopped_have_no_rounds() -> None:
    runs = endless(trials=5, progress=lambda done: False)
    assert [run.rounds > 0 for run in runs] == [True, False, False, False, False]
    assert all(len(run.position) == (7 if run.rounds else 0) for run in runs)


def test_progress_that_answers_nothing_lets_the_search_go_on() -> None:
    told: list[int] = []
    endless(seconds=0.3, progress=told.append)
    assert len(told) >= 2


def test_progress_does_not_change_a_bit() -> None:
    chosen = {"particles": 300, "evaluations": 300 * 3000}
    silent, told = (
        objectives.searched(BUILD, OBJECTIVE, BOUNDS, chosen, progress=progress) for progress in (None, lambda done: None)
    )
    np.testing.assert_array_equal(silent[0].fitness_history, told[0].fitness_history)


class Mine(Exception):
    """What only this test raises."""


@pytest.mark.parametrize("threads", [1, 2])
def test_what_progress_raises_reaches_the_caller(threads: int) -> None:
    def progress(done: int) -> None:
        raise Mine(done)

    with pytest.raises(Mine) as raised:
        endless(trials=threads, threads=threads, progress=progress)
    assert raised.value.args[0] > 0
    # And the kernel is as good as new.
    assert endless(seconds=0.01)[0].rounds > 0


def test_a_time_limit_ends_each_trial() -> None:
    runs = endless(trials=3, seconds=0.05)
    assert all(run.rounds > 0 for run in runs)


def test_a_budget_below_one_round_finds_nothing_and_says_so(build: Build) -> None:
    objective = objectives.paper_objective(build, ROBOT)
    (run,) = objectives.searched(build, objective, BOUNDS, {"particles": 300, "evaluations": 299})
    assert (run.rounds, run.evaluations, run.first_feasible_round) == (0, 0, -1)
    assert (run.fitness, run.violation) == (np.inf, np.inf)
    assert len(run.position) == 0


# ---- the least and the odd -------------------------------------------------------------------------------------------


def chain(joints: int) -> Robot:
    """Links of 0.3 m, without capsules."""
    T = np.eye(4)
    T[:3, 3] = 0.3, 0.0, 0.0
    return Robot(
        name="chain",
        joints=tuple(Joint(name=f"joint_{i}", kind="revolute", parent=i - 1, T_parent_joint=T) for i in range(joints)),
        frames=(Frame(name="tip", joint=joints - 1, T_joint_frame=T),),
        tip="tip",
        lower=np.full(joints, -2.0),
        upper=np.full(joints, 2.0),
        velocity=np.ones(joints),
        acceleration=np.ones(joints),
    )


@pytest.mark.parametrize("variant", VARIANTS)
@pytest.mark.parametrize("joints", [1, 2, 13])
def test_the_smallest_problems_are_searched(build: Build, joints: int, variant: str) -> None:
    robot = chain(joints)
    bounds = np.array(robot.lower), np.array(robot.upper)
    for obstacles, particles in product([(), (Sphere((0.1, 0.1, 0.1), 0.2),)], [1, 2, 3, 17]):
        objective = objectives.paper_objective(build, robot, obstacles)
        chosen = {**VARIANTS[variant], "particles": particles, "evaluations": 5 * particles, "shrink_to": 0}
        (run,) = objectives.searched(build, objective, bounds, chosen)
        assert run.rounds == 5
        assert np.isfinite(run.fitness)
        f, c = objective.evaluate(run.position[np.newaxis])
        assert (f[0], c[0]) == (run.fitness, run.violation)


def test_no_trials_have_no_results(build: Build) -> None:
    objective = objectives.paper_objective(build, ROBOT)
    assert objectives.searched(build, objective, BOUNDS, {"particles": 3, "evaluations": 9}, trials=0) == []


def test_more_known_positions_than_particles_are_no_harm(build: Build) -> None:
    objective = objectives.paper_objective(build, ROBOT)
    known = build.array(np.zeros((9, 7)))
    chosen = {"particles": 3, "evaluations": 3}
    (run,) = objectives.searched(build, objective, BOUNDS, chosen, initial=known, keep_positions=True)
    np.testing.assert_array_equal(run.position_history, np.zeros((1, 7)))


@POSIX
@pytest.mark.parametrize("case", misuse.REFUSED)
def test_wrong_arguments_are_refused(case: str) -> None:
    assert misuse.outcomes()[case] in misuse.REFUSALS
