"""Settings of the experiment: what is refused, in which words, and what is taken."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from spacearm.core.errors import SettingsError, SpacearmError
from spacearm.core.records import as_dict
from spacearm.study.paper_problem import (
    NEAR,
    READINGS,
    REPORTED,
    REPORTED_FOR,
    THRESHOLD,
    PaperSettings,
    paper_objective,
    paper_scene,
)
from spacearm.swarm import NAMED_SETTINGS
from support.messages import assert_refused

WRONG: dict[str, dict[str, Any]] = {
    "runs zero": {"runs": 0},
    "runs too many": {"runs": 100_001},
    "runs a fraction": {"runs": 2.5},
    "runs true": {"runs": True},
    "methods a word": {"methods": "pso"},
    "methods a list": {"methods": ["pso"]},
    "methods none": {"methods": ()},
    "methods twice": {"methods": ("pso", "ring", "pso")},
    "method unknown": {"methods": ("pso", "ipso_m")},
    "method a number": {"methods": (1,)},
    "mode unknown": {"modes": ("gaol",)},
    "radius zero": {"radii": (0.1, 0)},
    "radius negative": {"radii": (-0.1,)},
    "radius NaN": {"radii": (float("nan"),)},
    "radius infinite": {"radii": (float("inf"),)},
    "radius text": {"radii": ("0.1",)},
    "radii a number": {"radii": 0.1},
    "tolerance zero": {"tolerance": 0.0},
    "tolerance NaN": {"tolerance": float("nan")},
    "link radius negative": {"link_radius": -0.01},
    "constraints unknown": {"constraints": "penalties"},
    "weights two": {"weights": (0.5, 0.5)},
    "weights negative": {"weights": (-0.5, 0.75, 0.75)},
    "weights above 1": {"weights": (1.5, -0.25, -0.25)},
    "weights NaN": {"weights": (0.5, float("nan"), 0.25)},
    "weights text": {"weights": (0.5, "0.25", 0.25)},
    "weights that sum to less": {"weights": (0.5, 0.25, 0.2)},
    "weights a number": {"weights": 1.0},
    "weights a list": {"weights": [0.5, 0.25, 0.25]},
    "methods unhashable": {"methods": (["pso"],)},
    "seed negative": {"seed": -1},
    "seed too large": {"seed": 2**63},
    "seed none": {"seed": None},
    "threads zero": {"threads": 0},
    "name unknown": {"radius": 0.1},
}


@pytest.mark.parametrize("case", WRONG)
def test_wrong_settings_are_refused(case: str) -> None:
    assert_refused("study", case, SettingsError, lambda: PaperSettings(**WRONG[case]))


def test_a_wrong_mode_or_radius_of_the_objective_is_refused() -> None:
    assert_refused("study", "mode of the objective", SettingsError, lambda: paper_objective(PaperSettings(), "gaol", 0.1))
    for call in (lambda: paper_objective(PaperSettings(), "goal", 0.0), lambda: paper_scene(float("nan"))):
        with pytest.raises(SpacearmError, match="radius"):
            call()


@given(st.tuples(st.floats(0, 1), st.floats(0, 1)).map(sorted))
def test_weights_from_0_to_1_that_sum_to_1_are_taken(cut: list[float]) -> None:
    weights = (cut[0], cut[1] - cut[0], 1 - cut[1])
    assert PaperSettings(weights=weights).weights == weights


@given(st.tuples(*[st.floats(0, 1)] * 3))
def test_other_weights_are_refused(weights: tuple[float, float, float]) -> None:
    if abs(sum(weights) - 1) > 1e-6:
        with pytest.raises(SettingsError, match="sum to"):
            PaperSettings(weights=weights)


def test_numbers_of_numpy_are_taken() -> None:
    settings = PaperSettings(runs=np.int64(3), radii=(np.float64(0.1),), seed=np.uint8(7))  # type: ignore[arg-type]
    assert settings == PaperSettings(runs=3, radii=(0.1,), seed=7)
    assert json.loads(json.dumps(as_dict(settings)))["runs"] == 3
    assert [type(value) for value in (settings.runs, settings.radii[0], settings.seed)] == [int, float, int]


def test_the_defaults_are_the_papers() -> None:
    settings = PaperSettings()
    assert (settings.runs, settings.weights, settings.radii) == (20, (0.5, 0.25, 0.25), (0.1,))
    assert (THRESHOLD, NEAR) == (4.33, 0.01)
    assert set(settings.methods) <= set(NAMED_SETTINGS)
    assert {REPORTED_FOR[method] for method in ("pso", "ipso-m", "ipso-s")} == set(REPORTED)
    rows = [(row.worst, row.best, row.mean, row.threshold_share) for row in REPORTED.values()]
    assert rows == [(4.3341, 3.3818, 4.2378, 0.70), (4.3296, 3.3760, 3.7699, 1.00)]


def test_every_reading_says_what_was_open_what_is_read_and_why() -> None:
    assert len({reading.open for reading in READINGS}) == len(READINGS) > 15
    assert all(reading.open and reading.reading and reading.why for reading in READINGS)
