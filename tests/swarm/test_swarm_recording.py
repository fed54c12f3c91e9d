"""A run that is recorded again: the same bits as inside the kernel, and every position."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from spacearm.core.errors import SwarmError
from spacearm.study.paper_problem import PaperSettings, paper_objective, paper_robot
from spacearm.swarm import NAMED_SETTINGS, SwarmResult, named_settings, run_trials
from spacearm.swarm.swarm_recording import record_again

SETTINGS = PaperSettings()
ROBOT = paper_robot()
OBJECTIVE = paper_objective(SETTINGS, "goal", 0.1)


def run(method: str, *, trial: int = 3, iterations: int = 25) -> SwarmResult:
    settings = replace(named_settings(method), iterations=iterations)
    (found,) = run_trials(
        OBJECTIVE, ROBOT.lower, ROBOT.upper, settings, seed=5, trials=1, first_trial=trial, threads=1, keep_positions=True
    )
    return found


@pytest.mark.parametrize("method", NAMED_SETTINGS)
def test_a_recording_has_the_same_bits_and_every_evaluation(method: str) -> None:
    found = run(method)
    recording = record_again(found, OBJECTIVE, ROBOT.lower, ROBOT.upper)
    assert recording.positions.shape == (found.iterations, named_settings(method).particles, 7)
    assert recording.active.sum() == found.evaluations
    best = (np.inf, np.inf)
    assert found.history.positions is not None
    for i, count in enumerate(recording.active):
        fitness, violation = OBJECTIVE.evaluate(recording.positions[i])
        np.testing.assert_array_equal(fitness, recording.fitness[i])
        np.testing.assert_array_equal(violation, recording.violation[i])
        now = min(zip(np.maximum(violation[:count], 0), fitness[:count], strict=True))
        best = min(best, now)
        assert (max(found.history.violation[i], 0.0), found.history.fitness[i]) == best
        rows = recording.positions[: i + 1].reshape(-1, 7)
        assert (rows == found.history.positions[i]).all(axis=1).any()


def test_a_swarm_that_shrinks_is_filled_up_with_its_first_position() -> None:
    found = run("ipso-e", iterations=60)
    recording = record_again(found, OBJECTIVE, ROBOT.lower, ROBOT.upper)
    assert recording.active[-1] < recording.active[0]
    np.testing.assert_array_equal(recording.positions[-1, recording.active[-1] :] - recording.positions[-1, :1], 0)


def test_another_objective_is_refused() -> None:
    other = paper_objective(SETTINGS, "literal", 0.1)
    with pytest.raises(SwarmError, match="with the objective and the bounds that it was made with"):
        record_again(run("pso"), other, ROBOT.lower, ROBOT.upper)
