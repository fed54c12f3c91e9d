"""The same bits from every instruction level, on any number of threads, and asked for one by one or searched natively."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kernel import drawn, objectives
from kernel.builds import LEVELS, Build, place, surround
from spacearm.core.native import available_levels
from spacearm.geometry import Scene
from spacearm.robot import forward_kinematics
from support import strategies
from support.kernel_variants import MOTIONS, VARIANTS

ROBOT = objectives.paper_robot()
BOUNDS = np.array(ROBOT.lower), np.array(ROBOT.upper)
EVERY_TERM = dict.fromkeys(("length", "duration", "tip", "clearance", "smoothness", "f1", "f2", "f3"), 0.5)


@pytest.fixture(params=[64, 32])
def bits(request: pytest.FixtureRequest) -> int:
    return request.param


def levels(bits: int) -> list[Build]:
    """The builds that run here, at least two of them on any x86-64 machine."""
    return [Build(level, bits) for level in LEVELS if level in available_levels()]


NUMBERS = ("fitness", "violation", "rounds", "evaluations", "first_feasible_round", "position")
HISTORIES = ("fitness_history", "violation_history", "evaluation_history", "position_history")


def assert_same_runs(found: list[Any], expected: list[Any]) -> None:
    """Results of trials that are the same to the last bit."""
    assert len(found) == len(expected)
    for one, other in zip(found, expected, strict=True):
        for name in (*NUMBERS, *HISTORIES):
            np.testing.assert_array_equal(getattr(one, name), getattr(other, name), err_msg=name)


# ---- levels ----------------------------------------------------------------------------------------------------------


def goals_found(build: Build, *batches: int) -> list[np.ndarray]:
    """What guesses lead to on the way to a pose among obstacles, looked for in batches."""
    robot = objectives.thick_arm()
    pose = forward_kinematics(robot, objectives.AROUND[1])
    search = objectives.goal_search(build, robot, objectives.CLUTTER, pose, objectives.AROUND[0])
    for guesses in batches:
        search.look(guesses)
    some = search.differing(8)
    assert len(some) > 1
    pulled = search.pulled(some, 8, pull=True, at_centre=True)
    counted = np.array([search.begun, search.reached, search.in_collision])
    return [some, pulled, search.with_turns(pulled, 64), search.lacking(20), search.missed(20), counted]


def test_guesses_lead_to_the_same_goal_configurations_on_every_level_and_in_batches_of_any_size() -> None:
    first, *others = levels(64)
    expected = goals_found(first, 150)
    for build, batches in [(build, (150,)) for build in others] + [(first, (1, 2, 47, 100))]:
        for a, b in zip(goals_found(build, *batches), expected, strict=True):
            np.testing.assert_array_equal(a, b, err_msg=f"{build} {batches}")


@settings(max_examples=25)
@given(strategies.scenes(), st.data())
@pytest.mark.parametrize("bits", [64, 32])
def test_every_level_computes_the_same_bits(bits: int, scene: Scene, data: st.DataObject) -> None:
    robot = data.draw(drawn.robots())
    links = sorted({capsule.name for capsule in robot.capsules})
    robot = replace(robot, self_pairs=tuple(pairwise(links)))
    q = data.draw(drawn.batches(robot, Build("generic", bits), 33))
    shapes = data.draw(st.lists(drawn.obstacles(), max_size=3))

    def computed(build: Build) -> list[np.ndarray]:
        model = place(build, robot, spheres=scene.obstacles).native
        out = [model.joint_frames(q), model.points(q), model.clearances(q)]
        for make in (objectives.paper_objective, objectives.reach_objective):
            out += make(build, robot, scene.obstacles).evaluate(q)
        out.append(objectives.paper_objective(build, robot, scene.obstacles).terms(q))
        around = surround(build, robot, [*scene.obstacles, *shapes])
        out += [around.native.obstacle_clearances(q), around.native.pair_clearances(q, around.pairs)]
        out += [around.native.shortfalls(q, 0.1, early) for early in (False, True)]
        motions = objectives.motion_search(build, robot, [*scene.obstacles, *shapes], q[0], q[1:3], weights=EVERY_TERM)
        judged = motions.judge(q[3:33].reshape(10, -1), 3, 1)
        return [*out, *(getattr(judged, name) for name in ("fitness", "violation", "terms", "free"))]

    first, *others = levels(bits)
    expected = computed(first)
    for other in others:
        for a, b in zip(computed(other), expected, strict=True):
            np.testing.assert_array_equal(a, b, err_msg=str(other))


def test_every_level_draws_and_turns_alike(bits: int) -> None:
    first, *others = levels(bits)
    x = first.array(np.random.default_rng(0).uniform(-1e5, 1e5, 5000))
    for other in others:
        for at in ((0, 0, 0, 0, 0, 0), (2**64 - 1, 3, 2, 99, 2**32 - 2, 0x10000)):
            np.testing.assert_array_equal(other.named("uniforms")(*at), first.named("uniforms")(*at))
        for a, b in zip(other.named("sincos")(x), first.named("sincos")(x), strict=True):
            np.testing.assert_array_equal(a, b)


@pytest.mark.parametrize("variant", VARIANTS)
def test_every_level_searches_alike(bits: int, variant: str) -> None:
    def runs(build: Build) -> list[Any]:
        objective = objectives.paper_objective(build, ROBOT)
        return objectives.searched(build, objective, BOUNDS, VARIANTS[variant], trials=3, keep_positions=True)

    first, *others = levels(bits)
    for other in others:
        assert_same_runs(runs(other), runs(first))


@pytest.mark.parametrize("how", MOTIONS)
def test_every_level_finds_the_same_motions(bits: int, how: str) -> None:
    """To the last bit of all that was found, and of when."""
    chosen, swarm = MOTIONS[how]

    def found(build: Build) -> list[Any]:
        start, goal = objectives.AROUND
        search = objectives.motion_search(
            build, objectives.thick_arm(), objectives.CLUTTER, start, [goal, np.full(7, 0.1)], swarm=swarm, settings=chosen
        )
        objectives.run_motions(search, 1500)
        assert {entry.by for entry in search.history} >= ({"rrt_connect", "refine"} if how == "trees" else {"swarm", "refine"})
        return [
            search.evaluations,
            search.configurations,
            *([entry.evaluations, entry.fitness, entry.by, entry.goal] for entry in search.history),
            search.best.points,
        ]

    first, *others = levels(bits)
    expected = found(first)
    for other in others:
        for a, b in zip(found(other), expected, strict=True):
            assert np.array_equal(a, b), (other, a, b)


# ---- threads and trials ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("variant", VARIANTS)
def test_any_number_of_threads_gives_the_same_bits(bits: int, variant: str) -> None:
    build = levels(bits)[0]
    objective = objectives.paper_objective(build, ROBOT)

    def runs(threads: int) -> list[Any]:
        settings_ = {"trials": 20, "threads": threads, "keep_positions": True}
        return objectives.searched(build, objective, BOUNDS, VARIANTS[variant], **settings_)

    alone = runs(1)
    assert len({run.fitness for run in alone}) == 20
    for threads in (2, 5, 50):
        assert_same_runs(runs(threads), alone)


@pytest.mark.parametrize("variant", ["pso", "all evolving"])
def test_a_trial_does_not_depend_on_those_before_it(bits: int, variant: str) -> None:
    build = levels(bits)[0]
    objective = objectives.paper_objective(build, ROBOT)
    together = objectives.searched(build, objective, BOUNDS, VARIANTS[variant], trials=20, threads=2)
    for trial in (0, 1, 19):
        alone = objectives.searched(build, objective, BOUNDS, VARIANTS[variant], first_trial=trial)
        assert_same_runs(alone, together[trial : trial + 1])


# ---- by hand ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("problem", ["paper", "reach"])
@pytest.mark.parametrize("variant", VARIANTS)
def test_a_native_search_is_ask_and_tell(build: Build, variant: str, problem: str) -> None:
    objective = getattr(objectives, f"{problem}_objective")(build, ROBOT)
    chosen = VARIANTS[variant]
    known = build.array(np.random.default_rng(0).uniform(*BOUNDS, (2, 7)))
    options = {"seed": 2**40 + 1, "first_trial": 3, "keep_positions": True, "initial": known}
    (run,) = objectives.searched(build, objective, BOUNDS, chosen, **options)
    swarm = build.swarm(chosen, *BOUNDS, seed=2**40 + 1, trial=3)
    history = []
    while not swarm.spent:
        swarm.ask()
        if not history:
            swarm.place_first(known)
        swarm.tell(*objective.evaluate(swarm.positions()))
        history.append((swarm.best_fitness, swarm.best_violation, swarm.evaluations, *swarm.best_position))
    f, c, spent, *x = np.array(history).T
    np.testing.assert_array_equal(run.fitness_history, f)
    np.testing.assert_array_equal(run.violation_history, c)
    np.testing.assert_array_equal(run.evaluation_history, spent)
    np.testing.assert_array_equal(run.position_history, np.transpose(x))
    np.testing.assert_array_equal(run.position, swarm.best_position)
    assert (run.fitness, run.violation) == (swarm.best_fitness, swarm.best_violation)
    assert (run.rounds, run.evaluations) == (swarm.round, swarm.evaluations)
    feasible = np.flatnonzero(c <= 0)
    assert run.first_feasible_round == (feasible[0] if len(feasible) else -1)


def test_stopping_when_feasible_ends_at_the_first_such_round(build: Build) -> None:
    objective = objectives.paper_objective(build, ROBOT)
    chosen = {**VARIANTS["ring"], "evaluations": 33 * 300}
    whole, stopped = (
        objectives.searched(build, objective, BOUNDS, chosen, trials=4, stop_when_feasible=stop) for stop in (False, True)
    )
    assert any(run.first_feasible_round >= 0 for run in whole)
    for long, short in zip(whole, stopped, strict=True):
        rounds = long.first_feasible_round + 1 or long.rounds
        assert short.rounds == rounds
        np.testing.assert_array_equal(short.fitness_history, long.fitness_history[:rounds])
        assert short.violation == long.violation_history[rounds - 1]
