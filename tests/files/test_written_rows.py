"""What we write is read back as the same motion, and keeps the limits that the motion keeps."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from spacearm.core.errors import SettingsError
from spacearm.dynamics import Momentum
from spacearm.files import load_trajectory, write_ros_trajectory
from spacearm.files.trajectory_file import save_trajectory
from spacearm.motion import AnyTrajectory, Motion, PiecewisePath, RecordedTrajectory, TimeLaw, Trajectory, time_optimal
from spacearm.robot import load_robot
from support.small_robots import two_link

ARM, SERVICER = load_robot("zhang2022"), load_robot("servicer7")
SMOOTH = TimeLaw([0, 1], [[0, 0, 0.5, 1, 1]])
CUBICS = "the accelerations jump, so only positions and rates are written; between rows they are cubics"
STEPS = TimeLaw([0, 0.5, 1], [[0, 0, 0.5], [0.5, 1, 1]])  # full throttle, then full brake: accelerations jump


def drawn(interior: int, *, size: float = 1.0, seed: int = 0) -> Motion:
    rng = np.random.default_rng(seed)
    low, high = (np.maximum(ARM.lower, -1), np.minimum(ARM.upper, 1))
    return Motion((low + high) / 2 + rng.uniform(-0.5, 0.5, size=(interior + 2, 7)) * size * (high - low))


def by_csv(trajectory: AnyTrajectory, folder: Path, **given: Any) -> tuple[RecordedTrajectory, tuple[str, ...]]:
    notes = save_trajectory(trajectory, folder / "t.csv", **given)
    return read(trajectory, folder / "t.csv"), notes


def by_ros(trajectory: AnyTrajectory, folder: Path, **given: Any) -> tuple[RecordedTrajectory, tuple[str, ...]]:
    notes = write_ros_trajectory(trajectory, folder / "t.json", **given)
    return read(trajectory, folder / "t.json"), notes


def read(trajectory: AnyTrajectory, path: Path) -> RecordedTrajectory:
    held = {"base": trajectory.base, "base_start": trajectory.base_start, "momentum": trajectory.momentum}
    return load_trajectory(trajectory.robot, path, **held)


@pytest.mark.parametrize("way", [by_csv, by_ros])
@pytest.mark.parametrize("interior", [0, 1, 4])
@pytest.mark.parametrize("law", ["uniform", "smooth", "steps", "time_optimal", "slow"])
def test_whatever_the_law_the_limits_are_kept_by_what_is_read(law: str, interior: int, way: Any, tmp_path: Path) -> None:
    motion = drawn(interior)
    if law == "time_optimal":
        trajectory = time_optimal(ARM, motion)
    elif law == "slow":
        trajectory = Trajectory(ARM, motion, duration=1e4)
    else:
        trajectory = Trajectory(ARM, motion, time_law={"uniform": None, "smooth": SMOOTH, "steps": STEPS}[law])
    back, notes = way(trajectory, tmp_path)
    assert back.limits.holds
    assert back.contradictions == ()
    assert back.duration == pytest.approx(trajectory.duration, rel=1e-8)
    assert len(back.path.breaks) > 190
    t = np.linspace(0, trajectory.duration, 997)
    np.testing.assert_allclose(back.sample(t).q, trajectory.sample(t).q, rtol=0, atol=1e-6)
    assert notes == ((CUBICS,) if law == "steps" else ())


@pytest.mark.parametrize("size", [1e-5, 1e-3])
def test_of_a_tiny_motion_too(size: float, tmp_path: Path) -> None:
    for i, trajectory in enumerate((Trajectory(ARM, drawn(1, size=size)), time_optimal(ARM, drawn(1, size=size)))):
        (tmp_path / f"{i}").mkdir()
        back, _ = by_csv(trajectory, tmp_path / f"{i}")
        assert back.limits.holds
        assert back.duration == pytest.approx(trajectory.duration, rel=1e-3)


@pytest.mark.parametrize("way", [by_csv, by_ros])
def test_a_base_that_tumbles_comes_back_where_it_was(way: Any, tmp_path: Path) -> None:
    start = np.eye(4)
    start[:3, 3] = (1.0, -2.0, 0.5)
    spin = Momentum(linear=(1, 2, 3), angular=(0.5, -0.2, 0.3))
    motion = Motion(SERVICER.configuration("home") + np.linspace(0, 0.1, 4)[:, None] * np.array([0, 1, 0, 1, 0, -1, 1]))
    trajectory = Trajectory(SERVICER, motion, duration=90.0, base="floating", base_start=start, momentum=spin)
    back, notes = way(trajectory, tmp_path)
    assert (back.contradictions, notes) == ((), ())
    assert back.limits.holds
    for mine, other in zip(back.base_pose(45.0), trajectory.base_pose(45.0), strict=True):
        np.testing.assert_allclose(mine, other, atol=1e-8)


def test_steps_are_equal_where_pieces_are(tmp_path: Path) -> None:
    trajectory = Trajectory(ARM, drawn(2))
    back, _ = by_csv(trajectory, tmp_path)
    np.testing.assert_allclose(np.diff(back.path.breaks), back.duration / back.path.pieces, rtol=1e-9)


def test_every_number_is_written_in_full(tmp_path: Path) -> None:
    trajectory = Trajectory(ARM, drawn(0))
    by_csv(trajectory, tmp_path)
    rows = np.genfromtxt(tmp_path / "t.csv", delimiter=",", skip_header=1)
    assert (rows[:, 1:8] == trajectory.sample(rows[:, 0]).q).all()


def test_a_motion_that_takes_no_time_is_a_short_rest(tmp_path: Path) -> None:
    back, notes = by_csv(Trajectory(ARM, Motion(np.zeros((2, 7)))), tmp_path)
    assert (back.duration, back.limits.holds) == (0.001, True)
    assert notes == ("the trajectory takes 0 s, and is written as 0.001 s of rest",)


@pytest.mark.parametrize("way", [by_csv, by_ros])
def test_a_jerk_limit_is_kept_if_it_is_named(way: Any, tmp_path: Path) -> None:
    trajectory = time_optimal(ARM, drawn(1), jerk_limit=3.0)
    back, _ = way(trajectory, tmp_path, jerk_limit=3.0)
    jerk = back.margins(jerk_limit=3.0).jerk
    assert jerk is not None
    assert jerk.max() <= 1


def test_lines_come_back_as_lines(tmp_path: Path) -> None:
    path = PiecewisePath.from_linear([0, 1, 2.5], [[0, 0], [0.1, 0.2], [0.2, 0.1]])
    recorded = RecordedTrajectory(two_link(), path)
    for way in (by_csv, by_ros):
        back, notes = way(recorded, tmp_path)
        assert back.path.degree == 1
        np.testing.assert_allclose(back.sample([0.5, 1.0, 1.7]).q, recorded.sample([0.5, 1.0, 1.7]).q, atol=1e-15)
        assert notes == ("the rates jump, so only positions are written; between rows they are lines",)


def test_too_few_rows_are_refused_and_too_wide_steps_told(tmp_path: Path) -> None:
    trajectory = time_optimal(ARM, drawn(1))
    with pytest.raises(SettingsError, match=r"samples is 0, expected a whole number from 1"):
        save_trajectory(trajectory, tmp_path / "t.csv", samples=0)
    assert len(save_trajectory(trajectory, tmp_path / "t.csv", samples=8)) == 1
    notes = write_ros_trajectory(trajectory, tmp_path / "t.json", step=trajectory.duration / 7)
    assert len(notes) == 1
    assert notes[0].startswith("what is read between its rows may pass a limit that the trajectory keeps, by ")
