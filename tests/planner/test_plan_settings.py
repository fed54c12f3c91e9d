"""Settings of the planner: what is taken, what is kept, and a sentence for each that cannot be."""

from __future__ import annotations

import copy
import json
import pickle
from collections.abc import Callable
from dataclasses import FrozenInstanceError
from typing import Any

import numpy as np
import pytest

from spacearm.core.errors import SettingsError, SpacearmError
from spacearm.core.records import as_dict
from spacearm.planner import PlannerSettings, Weights
from spacearm.planner.planner_settings import SWARM
from spacearm.swarm import IPSO, PSO
from support.messages import assert_refused


def given(**values: Any) -> Callable[[], object]:
    return lambda: PlannerSettings(**values)


REFUSED: dict[str, Callable[[], object]] = {
    "mistyped": given(restart=3),
    "mistyped, near a known one": given(time_budgets=3),
    "by position": lambda: PlannerSettings(3),  # type: ignore[call-arg]
    "evaluations zero": given(evaluations=0),
    "evaluations half": given(evaluations=0.5),
    "evaluations True": given(evaluations=True),
    "evaluations text": given(evaluations="many"),
    "evaluations not a number": given(evaluations=float("nan")),
    "evaluations beyond counting": given(evaluations=2**63),
    "convergence beyond counting": given(evaluations=None, convergence=2**63),
    "time_budget zero": given(time_budget=0.0),
    "time_budget negative": given(time_budget=-1),
    "time_budget infinite": given(time_budget=float("inf")),
    "time_budget text": given(time_budget="50 ms"),
    "convergence zero": given(convergence=0),
    "convergence half": given(convergence=1.5),
    "stop_at_first one": given(stop_at_first=1),
    "weights a number": given(weights=3.0),
    "weights a list": given(weights=[1, 0]),
    "weights mistyped": given(weights={"lenght": 1.0}),
    "weights of a swarm": given(weights=PSO()),
    "weight negative": lambda: Weights(length=-1.0),
    "weight infinite": lambda: Weights(tip=float("inf")),
    "weight text": lambda: Weights(f1="a little"),  # type: ignore[arg-type]
    "weights none": lambda: Weights(length=0.0),
    "weights none, as a mapping": given(weights={"length": 0}),
    "weights by position": lambda: Weights(1.0),  # type: ignore[call-arg]
    "margin, which is a problem's clearance now": given(margin=0.01),
    "comfort, which is preferred_clearance now": given(comfort=0.1),
    "preferred_clearance negative": given(preferred_clearance=-1e-9),
    "preferred_clearance not a number": given(preferred_clearance=float("nan")),
    "interior_points zero": given(interior_points=0),
    "interior_points too many": given(interior_points=25),
    "interior_points half": given(interior_points=2.5),
    "interior_points empty": given(interior_points=()),
    "interior_points text": given(interior_points="2, 3"),
    "interior_points one of them zero": given(interior_points=(2, 0)),
    "interior_points nested": given(interior_points=((2, 3),)),
    "interior_points None": given(interior_points=None),
    "interior_points True": given(interior_points=True),
    "swarm a class": given(swarm=PSO),
    "swarm a name": given(swarm="IPSO"),
    "swarm of an unknown kind": given(swarm={"kind": "PS0"}),
    "swarm mistyped": given(swarm={"kind": "PSO", "partickles": 3}),
    "swarm without particles": given(swarm={"particles": 0}),
    "goal_candidates zero": given(goal_candidates=0),
    "islands zero": given(islands=0),
    "islands beyond what a machine has": given(islands=257),
    "threads zero": given(threads=0),
    "threads half": given(threads=1.5),
    "time_law mistyped": given(time_law="time-optimal"),
    "time_law None": given(time_law=None),
    "jerk_limit zero": given(jerk_limit=0.0),
    "jerk_limit negative": given(jerk_limit=-2.0),
    "proofs zero": given(proofs=0),
}


@pytest.mark.parametrize("case", REFUSED)
def test_settings_that_cannot_be_are_refused(case: str) -> None:
    assert_refused("plan_settings", case, SettingsError, REFUSED[case])


def test_one_error_class_catches_every_refusal() -> None:
    for call in REFUSED.values():
        with pytest.raises(SpacearmError):
            call()


def test_without_settings_the_length_is_searched_for_a_stated_number_of_motions() -> None:
    plain = PlannerSettings()
    assert plain.evaluations is None
    assert plain.most_evaluations == 20_000
    assert plain.time_budget is None
    assert plain.weights == Weights(length=1.0)
    assert plain.swarm == SWARM
    assert not plain.stop_at_first


@pytest.mark.parametrize(
    ("points", "kept"),
    [(3, (3,)), ([2, 3], (2, 3)), ((24,), (24,)), (np.array([1, 24]), (1, 24)), (np.int64(5), (5,)), (range(2, 4), (2, 3))],
)
def test_numbers_of_control_points_are_one_or_several(points: Any, kept: tuple[int, ...]) -> None:
    assert PlannerSettings(interior_points=points).interior_points == kept


def test_nested_settings_are_records_or_the_mappings_that_files_hold() -> None:
    weights = {"length": 0.5, "tip": 2}
    swarm = {"kind": "IPSO", "particles": 12, "iterations": 7}
    made = PlannerSettings(weights=weights, swarm=swarm)  # type: ignore[arg-type]
    assert made.weights == Weights(length=0.5, tip=2)
    assert made.swarm == IPSO(particles=12, iterations=7)
    assert PlannerSettings(swarm={"particles": 12}).swarm == PSO(particles=12)  # type: ignore[arg-type]
    assert (weights, swarm) == ({"length": 0.5, "tip": 2}, {"kind": "IPSO", "particles": 12, "iterations": 7})


@pytest.mark.parametrize(
    "made",
    [
        PlannerSettings(),
        PlannerSettings(evaluations=None, time_budget=0.05, swarm=IPSO(), weights=Weights(duration=1.0), interior_points=7),
        PlannerSettings(evaluations=None, convergence=10, threads=None, jerk_limit=3, time_law="time_optimal", islands=256),
    ],
)
def test_settings_are_plain_values_for_files_and_the_same_after_a_copy(made: PlannerSettings) -> None:
    plain = as_dict(made)
    assert json.loads(json.dumps(plain)) == plain
    assert (plain["weights"]["kind"], plain["swarm"]["kind"]) == ("Weights", type(made.swarm).__name__)
    for other in (pickle.loads(pickle.dumps(made)), copy.deepcopy(made)):
        assert other == made
        assert hash(other) == hash(made)


def test_settings_do_not_change() -> None:
    with pytest.raises(FrozenInstanceError):
        PlannerSettings().evaluations = 3  # type: ignore[misc]
    with pytest.raises(FrozenInstanceError):
        Weights().length = 3.0  # type: ignore[misc]


@pytest.mark.parametrize(
    ("budget", "most"),
    [
        ({"evaluations": 5}, 5),
        ({"time_budget": 1.0}, None),
        ({"convergence": 100}, None),
        ({"evaluations": 5, "time_budget": 1.0, "convergence": 100}, 5),
        ({"stop_at_first": True}, 20_000),
    ],
)
def test_another_budget_lifts_the_limit_that_nobody_set(budget: dict[str, Any], most: int | None) -> None:
    assert PlannerSettings(**budget).most_evaluations == most
