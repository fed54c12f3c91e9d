"""The native search for motions: what it finds is free and gets better, repeatably, and it stops when it is told."""

from __future__ import annotations

import math
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kernel import objectives
from kernel.builds import BUILDS, Build, surround
from spacearm.core.native import available_levels
from spacearm.geometry import Sphere
from spacearm.robot import Frame, Joint, LinkCapsule, Robot
from support.dense_samples import planar
from support.kernel_cases import TERMS, fine_instants, looked_at
from support.kernel_variants import MOTIONS
from support.motion_searches import BUILD, EXACT, GOAL, START, crowded, islands, needle, quintic, thin_planar

RUN = objectives.run_motions


@pytest.fixture(scope="module", params=[build for build in BUILDS if build.level == available_levels()[0]], ids=str)
def build(request: pytest.FixtureRequest) -> Build:
    """The fastest level, in both scalars; tests/kernel holds the others to the same bits."""
    return request.param


def cluttered(build: Build = BUILD, **options: Any) -> Any:
    """A search for motions of the thick arm from one side of the clutter to the other."""
    return objectives.motion_search(build, objectives.thick_arm(), objectives.CLUTTER, START, GOAL, **options)


def found_by(search: Any) -> list[list[Any]]:
    """What a search found and when, without the clock."""
    return [[e.evaluations, e.fitness, e.by, e.goal, e.points.tolist()] for e in search.history]


def least_clearances(
    build: Build, robot: Robot, obstacles: Any, points: np.ndarray, start: Any, goal: Any, *, margin: float = 0.0
) -> np.ndarray:
    """The clearance (instants,) [m], less a margin, at all instants the search looks at: measured in double precision."""
    q = looked_at(build, points.reshape(1, -1), len(points), start, goal)[0]
    exact = surround(EXACT, robot, obstacles)
    moving = np.array([c.joint >= 0 for c in robot.capsules], dtype=bool)
    q = np.ascontiguousarray(q)
    clear = exact.native.obstacle_clearances(q)[:, moving].min(axis=(1, 2), initial=np.inf)
    return np.minimum(clear, exact.native.pair_clearances(q, exact.pairs).min(axis=1, initial=np.inf)) - margin


def assert_sound(build: Build, search: Any, robot: Robot, obstacles: Any, start: Any, goals: Any, *, margin: float) -> None:
    """What was found is free at the instants, within the limits, better each time, and of the fitness it is said to have."""
    goals = np.asarray(goals, dtype=np.float64).reshape(-1, robot.dof)
    fitness = [entry.fitness for entry in search.history]
    assert fitness == sorted(set(fitness), reverse=True)
    for name in ("seconds", "evaluations"):
        values = [getattr(entry, name) for entry in search.history]
        assert values == sorted(values)
    assert all(entry.evaluations <= search.evaluations for entry in search.history)
    assert {entry.by for entry in search.history} <= {"straight", "rrt_connect", "refine", "swarm"}
    eps = float(np.finfo(build.scalar).eps)
    room = eps * (1 + np.maximum(np.abs(robot.lower), np.abs(robot.upper)))
    for entry in search.history:
        value, goal, points = entry.fitness, entry.goal, entry.points
        assert (points >= robot.lower - room).all()
        assert (points <= robot.upper + room).all()
        if len(points):
            judged = search.judge(build.array(points.reshape(1, -1)), len(points), goal)
            assert (judged.fitness[0], judged.violation[0], judged.free[0]) == (value, 0.0, True)
        assert least_clearances(build, robot, obstacles, points, start, goals[goal], margin=margin).min(initial=np.inf) > -1e-4
    if search.history:
        best, last = search.best, search.history[-1]
        assert (best.fitness, best.goal) == (last.fitness, last.goal)
        np.testing.assert_array_equal(best.points, last.points)
    else:
        assert search.best is None
    assert search.configurations % build.lanes == 0


# ---- what is found ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("how", MOTIONS)
@pytest.mark.parametrize("seed", range(3))
def test_motions_around_clutter_are_free_and_get_better(build: Build, how: str, seed: int) -> None:
    chosen, swarm = MOTIONS[how]
    search = RUN(cluttered(build, seed=seed, margin=0.01, settings=chosen, swarm=swarm), 1500)
    assert len(search.history) >= 2
    assert_sound(build, search, objectives.thick_arm(), objectives.CLUTTER, START, GOAL, margin=0.01)
    straight = math.dist(START, GOAL)
    assert straight < search.best.fitness < 2 * straight
    assert not search.optimal


@settings(max_examples=25)
@given(st.data(), st.integers(0, 2**64 - 1), st.sampled_from([(1,), (2, 3), (24,), (5, 1, 32)]))
def test_whatever_is_found_for_drawn_robots_is_sound(
    build: Build, data: st.DataObject, seed: int, interior: tuple[int, ...]
) -> None:
    """One joint to twelve, slides among them, links that must keep clear, two goals; any numbers of control points."""
    robot, obstacles, start, goals = data.draw(crowded(build))
    search = objectives.motion_search(
        build, robot, obstacles, start, goals, seed=seed, margin=0.01, settings={"interior": list(interior)}
    )
    RUN(search, 300)
    assert_sound(build, search, robot, obstacles, start, goals, margin=0.01)
    assert (search.best is None) == (len(search.history) == 0)
    if search.best is None:
        assert search.fallback is not None
    assert search.evaluations <= 300 + 16


def test_a_free_straight_motion_is_optimal_and_the_search_ends(build: Build) -> None:
    goals = [[1.0, 1.0], [-0.3, 0.4], [0.5, -0.5]]
    search = RUN(objectives.motion_search(build, planar(), [], [0.0, 0.0], goals), 10**9)
    assert search.optimal
    assert search.evaluations == 3
    assert search.best.goal == 1
    assert search.best.points.shape == (0, 2)
    # By quadrature at so many instants.
    assert search.best.fitness == pytest.approx(0.5, rel=1e-4 if build.bits == 64 else 1e-5)


def test_the_nearest_goal_is_not_optimal_when_its_straight_motion_is_blocked(build: Build) -> None:
    ball = Sphere((math.cos(0.4) * 1.5, math.sin(0.4) * 1.5, 0), 0.1)
    goals = [[0.8, 0.0], [-1.0, 0.0]]
    search = RUN(objectives.motion_search(build, planar(), [ball], [0.0, 0.0], goals), 1500)
    assert not search.optimal
    assert (search.history[0].by, search.history[0].goal) == ("straight", 1)
    assert_sound(build, search, planar(), [ball], [0.0, 0.0], goals, margin=0.002)
    assert search.best.fitness <= 1.0


def test_a_goal_that_is_the_start_takes_no_way(build: Build) -> None:
    search = RUN(cluttered_to(build, START), 100)
    assert search.optimal
    assert (search.best.fitness, search.evaluations) == (0.0, 1)


def cluttered_to(build: Build, *goals: Any, **options: Any) -> Any:
    return objectives.motion_search(build, objectives.thick_arm(), objectives.CLUTTER, START, goals, **options)


def test_goals_may_be_the_same(build: Build) -> None:
    one, three = (RUN(cluttered_to(build, *[GOAL] * count), 800) for count in (1, 3))
    assert {entry.goal for entry in three.history} <= {0, 1, 2}
    assert three.best.fitness == pytest.approx(one.best.fitness, rel=0.1)


def one_joint(kind: str) -> Robot:
    """A turning or sliding joint that carries a ball 1 m off its axis."""
    return Robot(
        name="one",
        joints=(Joint(name="joint", kind=kind, parent=-1, T_parent_joint=np.eye(4)),),
        capsules=(LinkCapsule(name="ball", joint=0, a=np.array([1.0, 0, 0]), b=np.array([1.0, 0, 0]), radius=0.1),),
        frames=(Frame(name="tip", joint=0, T_joint_frame=np.eye(4)),),
        tip="tip",
        lower=np.array([-3.0]),
        upper=np.array([3.0]),
        velocity=np.ones(1),
        acceleration=np.ones(1),
    )


@pytest.mark.parametrize("kind", ["revolute", "prismatic"])
def test_one_joint_goes_straight_or_not_at_all(build: Build, kind: str) -> None:
    robot = one_joint(kind)
    free = RUN(objectives.motion_search(build, robot, [Sphere((0, 0, 5), 0.1)], [-1.0], [[1.0]]), 100)
    assert free.optimal
    wall = Sphere((1.0, 0, 0), 0.2)
    blocked = RUN(objectives.motion_search(build, robot, [wall], [-1.0], [[1.0]]), 700)
    assert blocked.best is None
    assert blocked.history == []
    assert blocked.fallback.violation > 0


@pytest.mark.parametrize("interior", [[1], [24], [12], [1, 24, 2], [3, 3]])
def test_the_swarm_flies_with_the_numbers_of_control_points_asked_for(build: Build, interior: list[int]) -> None:
    search = RUN(cluttered(build, settings={"interior": interior, "patience": 0, "swarm_every": 1}), 12000)
    counts = {len(entry.points) for entry in search.history if entry.by == "swarm"}
    assert counts
    assert counts <= set(interior)
    assert_sound(build, search, objectives.thick_arm(), objectives.CLUTTER, START, GOAL, margin=0.002)


def test_a_joint_that_may_not_move_does_not(build: Build) -> None:
    """Bounds as narrow as can be for some joints, and tight ones for the others."""
    robot, goal = objectives.thick_arm(), np.array(GOAL)
    goal[1] = goal[5] = 0.1
    start = np.where([i in (1, 5) for i in range(7)], 0.1, START)
    lower, upper = np.minimum(start, goal) - 0.2, np.maximum(start, goal) + 0.2
    lower[[1, 5]] = upper[[1, 5]] = 0.1
    search = RUN(objectives.motion_search(build, robot, objectives.CLUTTER, start, goal, bounds=(lower, upper)), 1500)
    for entry in search.history:
        assert (entry.points[:, [1, 5]] == build.scalar(0.1)).all()
        assert (entry.points >= build.array(lower)).all()
        assert (entry.points <= build.array(upper)).all()


# ---- what cannot be found --------------------------------------------------------------------------------------------


def caged() -> tuple[Robot, list[Sphere], np.ndarray, np.ndarray]:
    """The planar arm, all but straight, on one side of a ball that it cannot get around, and a goal on the other."""
    ball = Sphere((1.2, 0.0, 0.0), 0.4)
    return planar(lower=(-1.7, -0.1), upper=(1.7, 0.1)), [ball], np.array([-1.5, 0.0]), np.array([1.5, 0.0])


def test_a_goal_behind_a_wall_keeps_the_least_bad_motion(build: Build) -> None:
    robot, ball, start, goal = caged()
    search = objectives.motion_search(build, robot, ball, start, goal)
    least = []
    for _ in range(3):
        RUN(search, 400)
        assert search.best is None
        points = search.fallback.points
        judged = search.judge(build.array(points.reshape(1, -1)), len(points), search.fallback.goal)
        assert judged.violation[0] == search.fallback.violation > 0
        least.append(search.fallback.violation)
    assert least == sorted(least, reverse=True)
    assert search.history == []
    assert not search.optimal


def test_an_end_in_collision_is_never_left_or_reached(build: Build) -> None:
    robot = planar()
    for ball in (Sphere((1.5, 0, 0), 0.2), Sphere((0, 1.5, 0), 0.2)):
        search = RUN(objectives.motion_search(build, robot, [ball], [0.0, 0.0], [math.pi / 2, 0.0]), 400)
        if ball.center[0] > 0:  # the start is an instant that is looked at
            assert search.best is None


# ---- repeatable ------------------------------------------------------------------------------------------------------


def test_a_seed_and_an_island_make_a_search_and_others_make_another(build: Build) -> None:
    searches = {key: RUN(cluttered(build, seed=key[0], island=key[1]), 600) for key in ((0, 0), (1, 0), (0, 1), (2**63, 0))}
    again = RUN(cluttered(build), 600)
    assert found_by(again) == found_by(searches[0, 0])
    assert again.configurations == searches[0, 0].configurations
    paths = [str(found_by(search)) for search in searches.values()]
    assert len(set(paths)) == len(paths)
    # From the first draw on: each finds its first motion in its own time.
    first = [RUN(cluttered(build, island=island), until_first=True).evaluations for island in range(6)]
    assert len(set(first)) > 2


def test_progress_and_a_time_limit_that_is_not_met_do_not_change_a_bit(build: Build) -> None:
    told: list[int] = []
    watched = RUN(cluttered(build), 3000, seconds=1000.0, progress=told.append)
    assert found_by(watched) == found_by(RUN(cluttered(build), 3000))


def test_what_is_stopped_early_has_found_the_beginning_of_what_goes_on(build: Build) -> None:
    whole = found_by(RUN(cluttered(build), 4000))
    for evaluations in (1, 50, 333, 2000):
        part = found_by(RUN(cluttered(build), evaluations))
        assert part == whole[: len(part)]
        later = [entry for entry in whole if entry[0] <= evaluations]
        assert len(part) >= len(later)
    stopped = found_by(RUN(cluttered(build), 10**9, progress=lambda done: False))
    assert stopped == whole[: len(stopped)] or whole == stopped[: len(whole)]


def test_a_search_goes_on_where_it_stopped(build: Build) -> None:
    """In pieces it need not find the same as in one, but repeatably, and nothing is lost."""

    def in_pieces() -> Any:
        search = cluttered(build)
        for piece in (1, 20, 200, 300, 500):
            before = search.evaluations
            RUN(search, piece)
            assert piece <= search.evaluations - before <= piece + 16
        return search

    one, other = in_pieces(), in_pieces()
    assert found_by(one) == found_by(other)
    assert_sound(build, one, objectives.thick_arm(), objectives.CLUTTER, START, GOAL, margin=0.002)
    assert one.best.fitness < 1.2 * RUN(cluttered(build), 1021).best.fitness


def test_islands_find_the_same_on_any_number_of_threads() -> None:
    one = islands(1)
    clockless = [replace(entry, seconds=0.0) for entry in one.history()]
    assert one.best is not None
    for threads in (2, 5):
        other = islands(threads)
        assert other.best == one.best
        assert other.evaluations == one.evaluations
        assert [replace(entry, seconds=0.0) for entry in other.history()] == clockless
        assert other.motions() == one.motions()


def test_more_islands_are_never_worse_and_each_is_one_of_its_own() -> None:
    lengths = [islands(2, count).best.length() for count in (1, 2, 4)]  # type: ignore[union-attr]
    assert lengths == sorted(lengths, reverse=True)
    four = islands(1, 4)
    assert {entry.island for entry in four.history()} <= set(range(4))
    fitness = [entry.fitness for entry in four.history()]
    assert fitness == sorted(set(fitness), reverse=True)
    assert four.terms(four.best)["length"] == pytest.approx(fitness[-1], rel=1e-6)  # type: ignore[arg-type]


# ---- when to stop ----------------------------------------------------------------------------------------------------


def test_the_first_motion_ends_a_search_that_is_content_with_it(build: Build) -> None:
    for seed in range(5):
        first = RUN(cluttered(build, seed=seed), until_first=True)
        assert len(first.history) == 1
        assert found_by(first) == found_by(RUN(cluttered(build, seed=seed), 2000))[:1]


@pytest.mark.parametrize("stall", [1, 50, 400])
def test_a_search_without_progress_ends(build: Build, stall: int) -> None:
    """So many motions after the last that was better by 0.1 %, or after the beginning."""
    for seed in range(4):
        search = RUN(cluttered(build, seed=seed), stall=stall)
        gains, least = [0], math.inf
        for entry in search.history:
            if entry.fitness < 0.999 * least:
                gains.append(entry.evaluations)
                least = entry.fitness
        assert max(np.diff([*gains, search.evaluations])) <= stall + 16
        assert search.evaluations - gains[-1] >= stall


def test_a_search_without_a_motion_ends_as_well(build: Build) -> None:
    robot, ball, start, goal = caged()
    search = RUN(objectives.motion_search(build, robot, ball, start, goal), stall=200)
    assert search.best is None
    assert 200 <= search.evaluations <= 216


def test_a_time_limit_ends_the_search(build: Build) -> None:
    """Also where a motion takes long to look at, and where there is no time at all."""
    crowd = [*objectives.CLUTTER, *(Sphere((0.01 * i, 3.0, 0.0), 0.01) for i in range(3000))]
    for obstacles, seconds in ((objectives.CLUTTER, 0.05), (crowd, 0.05), (objectives.CLUTTER, 1e-9)):
        search = objectives.motion_search(build, objectives.thick_arm(), obstacles, START, GOAL)
        RUN(search, seconds=seconds)
        assert search.seconds >= seconds
        assert not search.optimal


def test_progress_ends_a_search_with_false_and_its_errors_reach_the_caller(build: Build) -> None:
    told: list[int] = []

    def stop(done: int) -> bool:
        told.append(done)
        return len(told) < 3

    search = RUN(cluttered(build), progress=stop)
    assert len(told) == 3
    assert told == sorted(told)
    assert told[-1] <= search.evaluations

    def fail(done: int) -> None:
        raise ZeroDivisionError(done)

    with pytest.raises(ZeroDivisionError):
        RUN(search, progress=fail)
    RUN(search, 10)  # as good as new
    assert search.best is not None


SEARCHES = {
    "one search": """
search = objectives.motion_search(BUILD, objectives.thick_arm(), objectives.CLUTTER, *objectives.AROUND)
run = lambda: search.run(evaluations=0, seconds=600.0, until_first=False, stall=0, progress=None)
""",
    "islands on threads": """
search = islands(2)
run = lambda: search.run(evaluations=0, seconds=600.0, until_first=False, stall=0)
""",
    "islands on one thread": """
search = islands(1)
run = lambda: search.run(evaluations=0, seconds=600.0, until_first=False, stall=0)
""",
}


@pytest.mark.skipif(not hasattr(os, "fork"), reason="signals are POSIX's")
@pytest.mark.parametrize("what", SEARCHES)
def test_ctrl_c_ends_a_search_which_keeps_what_it_has(what: str) -> None:
    """A search that would go on for ten minutes ends, again and again, and keeps its best motion."""
    program = f"""
import os, signal, sys, threading
from kernel import objectives
from support.motion_searches import BUILD, islands
{SEARCHES[what]}
for _ in range(3):
    threading.Timer(0.1, os.kill, (os.getpid(), signal.SIGINT)).start()
    try:
        run()
        sys.exit("not interrupted")
    except KeyboardInterrupt:
        assert search.best is not None
"""
    tests = Path(__file__).parents[1]
    done = subprocess.run([sys.executable, "-c", program], cwd=tests, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stderr


# ---- instants that a proof stumbled over -----------------------------------------------------------------------------


def test_an_instant_between_the_samples_is_looked_at_once_it_is_named(build: Build) -> None:
    """The thin arm steps over a needle; once told where, it has to go around."""
    robot, goal = thin_planar(), [math.pi / 2, 0.0]
    s = (np.floor(0.5 * 8 * build.lanes) + 0.5) / (8 * build.lanes)  # half way between two instants, where it is quickest
    thorn = needle(quintic(s) * math.pi / 2, 1.9)
    search = RUN(objectives.motion_search(build, robot, [thorn], [0.0, 0.0], goal, margin=0.0), 300)
    assert search.optimal
    search.add_instant(s, 0.004)
    assert (search.best, search.optimal, search.history) == (None, False, [])
    RUN(search, 1500)
    assert search.history
    assert "straight" not in {entry.by for entry in search.history}
    exact = surround(EXACT, robot, [thorn]).native
    for entry in search.history:
        points = np.vstack([[0.0, 0.0], entry.points, goal])
        q = BUILD.module.spline_values(np.array([s]), len(points) - 2, 0) @ points
        assert exact.obstacle_clearances(np.ascontiguousarray(q)).min() > -1e-5


def test_a_proof_that_fails_makes_all_instants_denser(build: Build) -> None:
    """What stays in the history is free at twice as many instants, too; what was dropped is not."""
    robot, margin = objectives.thick_arm(), 0.002
    search = RUN(cluttered(build), 800)
    known = search.history
    search.add_instant(0.0, 1e-4)  # where all motions are the same
    left = [entry.evaluations for entry in search.history]
    assert left
    exact = surround(EXACT, robot, objectives.CLUTTER)
    for entry in known:
        points = np.vstack([START, entry.points, GOAL])
        now = fine_instants(build, points, doubled=True)
        q = np.ascontiguousarray(BUILD.module.spline_values(now, len(points) - 2, 0) @ points)
        moving = np.array([c.joint >= 0 for c in robot.capsules], dtype=bool)
        least = exact.native.obstacle_clearances(q)[:, moving].min()
        least = min(least, exact.native.pair_clearances(q, exact.pairs).min(initial=np.inf)) - margin
        assert least > -1e-4 if entry.evaluations in left else least < 1e-4
    assert search.best.fitness == min(entry.fitness for entry in search.history)
    best = search.best.fitness
    RUN(search, 500)
    assert search.best.fitness <= best


# ---- what counts -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", TERMS)
def test_what_weighs_more_becomes_less(name: str) -> None:
    """Each term as the only one, against the length alone: over several seeds the found motion has less of it."""

    def of_best(weights: dict[str, float], seed: int) -> float:
        search = RUN(cluttered(BUILD, weights=weights, preferred_clearance=0.2, jerk=np.ones(7), seed=seed), 1200)
        points = search.best.points
        judged = search.judge(BUILD.array(points.reshape(1, -1)), len(points), 0)
        return float(judged.terms[0, TERMS.index(name)])

    alone = np.array([of_best({name: 1.0}, seed) for seed in range(4)])
    by_length = np.array([of_best({"length": 1.0}, seed) for seed in range(4)])
    if name == "length":
        np.testing.assert_array_equal(alone, by_length)
    else:
        assert np.median(alone) < np.median(by_length)
        assert alone.min() < by_length.min()


def test_a_longer_search_is_no_worse_and_more_margin_is_kept(build: Build) -> None:
    values = [RUN(cluttered(build), evaluations).best.fitness for evaluations in (300, 1000, 4000)]
    assert values == sorted(values, reverse=True)
    robot = objectives.thick_arm()
    for margin in (0.0, 0.01, 0.03):
        points = RUN(cluttered(build, margin=margin), 800).best.points
        assert least_clearances(build, robot, objectives.CLUTTER, points, START, GOAL, margin=margin).min() > -1e-4


def test_a_motion_that_outlives_an_instant_is_not_taken_for_the_shortest(build: Build) -> None:
    """The straight motion, which is looked at again, collides; what is known of other motions says nothing of its length."""
    search = RUN(cluttered(build), 300)
    search.add_instant(0.0, 1e-4)
    before, looked = search.best, search.evaluations
    assert before is not None
    RUN(search, 300)
    assert not search.optimal
    assert search.evaluations >= looked + 300
    assert search.best.fitness <= before.fitness
