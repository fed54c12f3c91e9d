"""OPEN KERNEL BUGS: laws that the kernel does not keep yet. Each fails until it does, and then belongs elsewhere."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from kernel import accuracy, misuse
from kernel.builds import Build
from kernel.test_kinematics import angles
from kernel.test_swarm_laws import BOX_3, chosen, told_rounds
from kernel.test_swarm_steps import rows

TESTS = Path(__file__).parents[1]
POSIX = pytest.mark.skipif(not hasattr(os, "fork"), reason="signals and forked processes are POSIX's")


@pytest.fixture
def build() -> Build:
    """One build shows a bug as well as eight."""
    return misuse.BUILD


def run(program: str) -> subprocess.CompletedProcess[str]:
    """Run a program that may end its process."""
    command = [sys.executable, "-c", program]
    return subprocess.run(command, cwd=TESTS, capture_output=True, text=True, timeout=60, check=False)


# ---- trig.hpp; then to test_kinematics.py -----------------------------------------------------------------------------


@pytest.mark.parametrize("turns", ["near", "far"])
def test_sine_and_cosine_are_within_their_bound(build: Build, turns: str) -> None:
    """In double the sine is 1.9e-14 off near odd multiples of pi: trig_constants<double>::cos is badly fitted."""
    bounds = accuracy.SINCOS_ERROR if turns == "near" else accuracy.SINCOS_ERROR_FAR
    x = angles(build, 1e4 if turns == "near" else 1e5)
    sine, cosine = build.named("sincos")(x)
    exact = x.astype(np.longdouble)
    assert float(np.abs(sine - np.sin(exact)).max()) <= bounds[build.bits]
    assert float(np.abs(cosine - np.cos(exact)).max()) <= bounds[build.bits]


# ---- search.hpp; then to test_interrupt.py ----------------------------------------------------------------------------

# Rounds of more than 40 ms, so that the calling thread waits for a helper after the search was stopped.
LONG_ROUNDS = """
import os, signal, threading
import numpy as np
from kernel import objectives
from kernel.test_interrupt import BOUNDS, BUILD, ROBOT

objective = objectives.motion_objective(BUILD, ROBOT)
bounds = tuple(np.tile(bound, 2) for bound in BOUNDS)

def search(progress):
    settings = {"particles": 200_000, "evaluations": 10**12}
    objectives.searched(BUILD, objective, bounds, settings, trials=2, threads=2, seconds=20.0, progress=progress)
"""


@POSIX
def test_ctrl_c_in_a_search_on_threads_with_progress_does_not_end_the_process() -> None:
    """The waiting thread calls progress with KeyboardInterrupt already set, which throws past joinable threads."""
    program = """
threading.Timer(0.5, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
try:
    search(lambda done: None)
except KeyboardInterrupt:
    print("interrupted")
"""
    done = run(LONG_ROUNDS + program)
    assert (done.returncode, done.stdout) == (0, "interrupted\n"), done.stderr


def test_progress_that_raises_while_helpers_finish_does_not_end_the_process() -> None:
    """The calling thread is through and waits; what its progress raises there passes joinable threads."""
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
    done = run(program)
    assert (done.returncode, done.stdout) == (0, "mine\n"), done.stderr


# ---- bindings.cpp; then to REFUSED in misuse.py ------------------------------------------------------------------------


@POSIX
@pytest.mark.parametrize("case", misuse.OPEN)
def test_wrong_arguments_are_refused(case: str) -> None:
    assert misuse.outcomes()[case] in misuse.REFUSALS


# ---- swarm.hpp and evolution.hpp; then to test_swarm_laws.py -----------------------------------------------------------


@POSIX
@pytest.mark.parametrize("particles", [1, 2])
def test_the_cooperative_variant_lives_with_less_than_three_particles(particles: int) -> None:
    """Populations 1 and 2 are empty, and `% size` divides by 0."""
    assert misuse.tried(lambda: misuse.ask_told(misuse.swarm(variant="cooperative", particles=particles))) == "accepted"


@POSIX
@pytest.mark.parametrize("variant", ["symbiotic", "cooperative"])
def test_a_swarm_of_empty_populations_goes_on_after_a_restore(variant: str) -> None:
    """restore_counters leaves -1 for the leader of an empty population, which is then read."""
    one = misuse.swarm(variant=variant, particles=3)
    small = misuse.swarm(rounds=0, variant=variant, particles=2)
    assert one.active == 3

    def restored() -> None:
        small.ask()
        small.tell(np.ones(2), np.zeros(2))
        whole = misuse.BUILD.swarm({**misuse.SETTINGS, "variant": variant, "particles": 2}, *misuse.BOX)
        whole.restore(small.state())
        for swarm in (small, whole):
            swarm.ask()
        np.testing.assert_array_equal(whole.positions(), small.positions())

    assert misuse.tried(restored) == "accepted"


@POSIX
def test_a_swarm_restored_between_ask_and_tell_can_be_told() -> None:
    """The evolving variant forgets the candidates it proposed and writes their gains beyond an empty array."""

    def restored() -> None:
        asked = misuse.swarm(variant="evolving")
        asked.ask()
        other = misuse.swarm(0, variant="evolving")
        other.restore(asked.state())
        for swarm in (asked, other):
            swarm.tell(np.zeros(20), np.zeros(20))
            swarm.ask()
        np.testing.assert_array_equal(other.positions(), asked.positions())

    assert misuse.tried(restored) == "accepted"


@pytest.mark.parametrize("variant", ["pso", "evolving"])
def test_a_failed_first_evaluation_does_not_make_the_origin_a_personal_best(build: Build, variant: str) -> None:
    """Such a particle is drawn to 0, which the box need not hold; the evolving variant even asks for it."""
    lower, upper = np.full(3, 10.0), np.full(3, 11.0)
    swarm = build.swarm(chosen(variant, evolving_share=1.0), lower, upper)
    swarm.ask()
    first = swarm.positions()
    fitness = build.array(np.arange(30.0))
    fitness[::2] = np.nan
    swarm.tell(fitness, np.zeros(30, build.scalar))
    np.testing.assert_array_equal(rows(swarm.state(), "personal_best", 3, swarm.active), first[: swarm.active])
    swarm.ask()
    assert swarm.positions().min() >= 10


def test_the_best_position_lies_in_the_box_even_if_every_evaluation_failed(build: Build) -> None:
    swarm = build.swarm({"particles": 5}, [1.0], [2.0])
    swarm.ask()
    swarm.tell(np.full(5, np.nan, build.scalar), np.zeros(5, build.scalar))
    assert 1 <= swarm.best_position[0] <= 2


def test_huge_improvements_do_not_spoil_the_success_history(build: Build) -> None:
    """The sum of their gains overflows, F becomes no number, and so do the positions."""
    swarm = build.swarm(chosen("evolving", evolving_share=1.0, memory=2), *BOX_3)
    swarm.ask()
    # What an objective may well return for a candidate it cannot judge.
    swarm.tell(np.full(30, np.finfo(build.scalar).max), np.zeros(30, build.scalar))
    told_rounds(build, swarm, 3)
    assert np.isfinite(swarm.state()["factor_memory"]).all()
    assert np.isfinite(swarm.positions()).all()


@pytest.mark.parametrize("variant", ["pso", "symbiotic", "cooperative"])
def test_only_the_evolving_population_shrinks(build: Build, variant: str) -> None:
    """A flying one would have its personal bests dealt out to other particles; IPSO(shrink_to=...) asks for it."""
    swarm = build.swarm({**chosen(variant), "shrink_to": 4, "evaluations": 100}, *BOX_3)
    told_rounds(build, swarm, 3)
    assert swarm.active == 30
