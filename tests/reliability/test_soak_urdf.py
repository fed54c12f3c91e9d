"""A share of benchmarks/soak_urdf.py: a second reader looks at drawn robots; what is wrong can be seen."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from spacearm.robot import load_robot
from support.drawn_urdfs import drawn_files
from support.urdf_checker import _wrong_limits, complaints, own_limits


@pytest.mark.parametrize("block", range(4))
def test_a_second_reader_makes_the_same_of_drawn_robots(block: int, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    loaded = 0
    for number in range(12 * block, 12 * block + 12):
        what, wrong = complaints(drawn_files(7, number), tmp_path, np.random.default_rng(number))
        assert not wrong, (number, wrong)
        loaded += what == "loaded"
    assert loaded >= 6


def test_the_second_reader_sees_limits_that_are_too_wide_or_too_narrow(tmp_path: Path) -> None:
    drawn = replace(drawn_files(7, 0), options={"velocity_limit": 1.0, "acceleration_limit": 1.0, "tip": "link_1"})
    path = tmp_path / "arm.urdf"
    path.write_text(drawn.urdf)
    robot, own = load_robot(path, **drawn.options), own_limits(replace(drawn, limits="", srdf=""))
    assert _wrong_limits(robot, own) == []
    for factor in (0.9, 1.1):
        assert _wrong_limits(replace(robot, velocity=factor * robot.velocity), own)
        assert _wrong_limits(replace(robot, acceleration=factor * robot.acceleration), own)
