"""Limits so wide, so narrow or so far off that float32 has few digits left: a search ends, and stays within them."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from kernel import objectives
from kernel.builds import Build

WIDTHS = st.sampled_from([0.0, 1e-30, 1e-6, 1.0, 1e3, 1e5, 9e5])  # [rad] of a joint's range
MIDDLES = st.sampled_from([0.0, -1.0, 3.0, 1e4, -9e4])  # [rad] of it
RATES = st.sampled_from([1e-12, 1e-3, 1.0, 1e6, 1e12])  # [rad/s], [rad/s^2]


@settings(max_examples=25)
@given(
    st.lists(st.tuples(MIDDLES, WIDTHS, RATES, RATES), min_size=7, max_size=7),
    st.lists(st.floats(0, 1), min_size=14, max_size=14),
    st.sampled_from(["length", "duration"]),
)
def test_a_search_within_wide_or_narrow_limits_ends_within_them(
    build: Build, joints: list[tuple[float, float, float, float]], shares: list[float], term: str
) -> None:
    middle, width, velocity, acceleration = map(np.array, zip(*joints, strict=True))
    lower, upper = (build.array(middle + side * width / 2).astype(np.float64) for side in (-1, 1))
    near = np.minimum(upper - lower, 2.0)  # a way of 1000 turns is no motion that anybody plans
    start, goal = np.clip(middle - near / 2 + np.array(shares).reshape(2, 7) * near, lower, upper)
    robot = objectives.thick_arm()
    search = objectives.motion_search(
        build,
        robot,
        objectives.CLUTTER,
        start,
        [goal],
        bounds=(lower, upper),
        rates=(velocity, acceleration),
        weights={term: 1.0},
        swarm={**objectives.MOTION_SWARM, "particles": 6},
    )
    objectives.run_motions(search, 60)
    assert search.evaluations <= 60 + 16
    found = [entry for entry in search.history if len(entry.points)]
    for entry in found:
        assert np.isfinite(entry.fitness)
        assert ((entry.points >= build.array(lower)) & (entry.points <= build.array(upper))).all()
