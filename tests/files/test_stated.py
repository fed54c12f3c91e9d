"""What a file states is what its joints make of it, or its certificate fails."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from spacearm.core.errors import FileFormatError
from spacearm.dynamics import Momentum
from spacearm.files import load_trajectory
from spacearm.files.trajectory_file import save_trajectory
from spacearm.motion import Motion, RecordedTrajectory, Trajectory, time_optimal
from spacearm.motion.trajectory_values import trajectory_as_dict, trajectory_from_dict
from spacearm.planner import Problem
from spacearm.proof import certify
from spacearm.robot import load_robot

ARM, FLOATER = load_robot("zhang2022"), load_robot("srs7")
END = np.array([0.3, 0.2, -0.3, 0.2, -0.3, 0.1, 0.2])
Table = dict[str, NDArray[np.float64]]


def table(path: Path) -> Table:
    lines = path.read_text().splitlines()
    rows = np.array([[float(cell) for cell in line.split(",")] for line in lines[1:]])
    return dict(zip(lines[0].split(","), rows.T, strict=True))


def write(values: Table, path: Path, *, digits: str = "%.17g", head: str = "") -> None:
    rows = np.column_stack(list(values.values()))
    np.savetxt(path, rows, delimiter=",", header=head + ",".join(values), comments="", fmt=digits)


@pytest.fixture
def floating(tmp_path: Path) -> Path:
    motion = Motion([np.full(7, 0.1), np.full(7, 0.4), END])
    save_trajectory(Trajectory(FLOATER, motion, duration=20.0, base="floating"), tmp_path / "t.csv")
    return tmp_path / "t.csv"


def slower(values: Table) -> None:
    values["t_s"] = values["t_s"] * 2


def base_moved(values: Table) -> None:
    values["base_x"][50:] += 0.5


def base_held(values: Table) -> None:
    for name in ("base_x", "base_y", "base_z", "base_qw", "base_qx", "base_qy", "base_qz"):
        values[name][:] = values[name][0]


def base_mirrored(values: Table) -> None:
    for name in ("base_qx", "base_qy", "base_qz"):
        values[name] *= -1


def tip_elsewhere(values: Table) -> None:
    values["tip_z_m"] += 1e-4


def rates_stale(values: Table) -> None:
    for name in values:
        if name.startswith("dq_"):
            values[name] *= 1.5


def accelerations_opposite(values: Table) -> None:
    for name in values:
        if name.startswith("ddq_"):
            values[name] *= -1


def base_rate_of_another(values: Table) -> None:
    values.update({f"base_v{axis}": np.full(len(values["t_s"]), 0.1) for axis in "xyz"})


def base_turning_of_another(values: Table) -> None:
    values.update({f"base_w{axis}": np.full(len(values["t_s"]), 0.1) for axis in "xyz"})


CONTRADICTIONS: dict[Callable[[Table], None], str] = {
    slower: "the file's rates are not those of its positions: between line",
    rates_stale: "the file's rates are not those of its positions: between line",
    accelerations_opposite: "the file's accelerations are not those of its rates: between line",
    base_moved: "the base is 0.5 m and ",
    base_held: "rad from where momentum takes it",
    base_mirrored: "rad from where momentum takes it",
    tip_elsewhere: "the end effector is 0.0001 m from where the joints put 'tip'",
    base_rate_of_another: "the base moves at 0.1",
    base_turning_of_another: "the base turns at 0.1",
}


@pytest.mark.parametrize("change", CONTRADICTIONS, ids=lambda change: change.__name__)
def test_what_is_stated_and_is_not_so_fails(change: Callable[[Table], None], floating: Path) -> None:
    values = table(floating)
    change(values)
    write(values, floating)
    read = load_trajectory(FLOATER, floating)
    assert any(CONTRADICTIONS[change] in sentence for sentence in read.contradictions), read.contradictions
    assert trajectory_from_dict(FLOATER, trajectory_as_dict(read)) == read


def test_a_contradiction_fails_the_certificate(floating: Path) -> None:
    problem = Problem(FLOATER, [], start=np.full(7, 0.1), goal=END, base="floating")
    assert certify(problem, load_trajectory(FLOATER, floating)).holds
    values = table(floating)
    base_moved(values)
    write(values, floating)
    read = load_trajectory(FLOATER, floating)
    certificate = certify(problem, read)
    assert certificate.status == "fails"
    assert certificate.message == read.contradictions[0] == certificate.contradictions[0]


def test_what_is_so_holds(floating: Path) -> None:
    trajectory = load_trajectory(FLOATER, floating)
    t = trajectory.path.breaks
    values = table(floating)
    velocity, omega = trajectory.base_rate(t)
    values |= {f"base_v{axis}": velocity[:, i] for i, axis in enumerate("xyz")}
    values |= {f"base_w{axis}": omega[:, i] for i, axis in enumerate("xyz")}
    write(values, floating, head=f"# robot: {FLOATER.name}\n# duration_s: 20\n")
    read = load_trajectory(FLOATER, floating)
    assert read.contradictions == ()
    assert not any("left alone" in note for note in read.notes)
    assert any("the base moves by conservation of momentum" in note for note in read.notes)


@pytest.mark.parametrize("digits", ["%.4f", "%.6f", "%.9f"])
def test_a_last_digit_is_no_contradiction(digits: str, floating: Path) -> None:
    write(table(floating), floating, digits=digits)
    assert load_trajectory(FLOATER, floating).contradictions == ()


def test_a_fixed_base_that_moves_in_the_file_is_refused(floating: Path) -> None:
    with pytest.raises(FileFormatError, match=r"from where a fixed base stays; give base='floating', or leave the base's"):
        load_trajectory(FLOATER, floating, base="fixed")


def test_another_momentum_than_the_files_fails(floating: Path) -> None:
    read = load_trajectory(FLOATER, floating, base="floating", momentum=Momentum(angular=(0, 0, 0.1)))
    assert "from where momentum takes it" in read.contradictions[0]


@pytest.mark.parametrize(
    ("head", "sentence"),
    [
        ("# robot: panda\n", "the file is of robot 'panda', and this is 'srs7'"),
        ("# duration [s] = 21\n", "the file states a duration of 21 s, and its rows take 20 s"),
    ],
)
def test_a_comment_that_names_another_robot_or_duration_fails(head: str, sentence: str, floating: Path) -> None:
    write(table(floating), floating, head=head)
    assert load_trajectory(FLOATER, floating).contradictions == (sentence,)


def row(t: float, *values: float) -> str:
    return ",".join(map(str, (t, *values))) + "\n"


def test_stops_at_every_row_are_taken_at_their_word(tmp_path: Path) -> None:
    names = FLOATER.dof_names
    head = ",".join(["t", *names, *(f"dq_{name}" for name in names)]) + "\n"
    path = tmp_path / "stops.csv"
    path.write_text(head + "".join(row(10.0 * i, *[0.1 * (i % 3)] * 7, *[0.0] * 7) for i in range(12)))
    read = load_trajectory(FLOATER, path)
    assert read.contradictions == ()
    assert "the rates are 0 in every row, and taken at their word" in read.notes


def test_few_and_far_rows_of_a_good_motion_are_no_contradiction(tmp_path: Path) -> None:
    low, high = (np.maximum(ARM.lower, -1), np.minimum(ARM.upper, 1))
    motion = Motion(np.random.default_rng(3).uniform(low, high, size=(5, 7)))
    for trajectory in (Trajectory(ARM, motion), time_optimal(ARM, motion)):
        for rows in (3, 5, 7, 10, 20):
            t = np.linspace(0, trajectory.duration, rows)
            state = trajectory.sample(t)
            names = [f"{kind}_{name}" for kind in ("q", "dq", "ddq") for name in ARM.dof_names]
            np.savetxt(tmp_path / "few.csv", np.column_stack([t, *state]), delimiter=",", header=",".join(["t_s", *names]))
            assert load_trajectory(ARM, tmp_path / "few.csv").contradictions == ()


def read_text(path: Path, text: str, **given: object) -> RecordedTrajectory:
    path.write_text(text)
    return load_trajectory(ARM, path, **given)  # type: ignore[arg-type]


def body(scale: float, begin: float = 0.0) -> str:
    return "".join(row(begin + scale * i, *[0.1 * i] * 7) for i in range(3))


HEAD = ",".join(ARM.dof_names) + "\n"


@pytest.mark.parametrize(
    ("name", "unit", "scale"),
    [
        ("t_ms", None, 1e3), ("time [ms]", None, 1e3), ("time_us", None, 1e6), ("%time", None, 1e9), ("t", "ns", 1e9),
        ("time_from_start", None, 1.0), ("timestamp", "ms", 1e3), ("Time (s)", None, 1.0),
    ],
)  # fmt: skip
def test_times_are_in_the_unit_that_is_said(name: str, unit: str | None, scale: float, tmp_path: Path) -> None:
    read = read_text(tmp_path / "t.csv", f"{name},{HEAD}{body(scale)}", time_unit=unit)
    assert read.duration == pytest.approx(2.0)
    assert not any("are its times in" in note for note in read.notes)


def test_whole_seconds_and_nanoseconds_are_one_time(tmp_path: Path) -> None:
    rows = "".join(f"{i // 2},{(i % 2) * 500_000_000},{','.join([str(0.1 * i)] * 7)}\n" for i in range(5))
    read = read_text(tmp_path / "t.csv", f"header.stamp.sec,header.stamp.nanosec,{HEAD}{rows}")
    np.testing.assert_allclose(read.path.breaks, [0, 0.5, 1, 1.5, 2])


@pytest.mark.parametrize(("scale", "unit"), [(1e9, "ns"), (1e6, "us"), (1e3, "ms")])
def test_a_motion_that_takes_years_is_doubted(scale: float, unit: str, tmp_path: Path) -> None:
    read = read_text(tmp_path / "t.csv", f"t,{HEAD}{body(scale)}")
    assert read.duration == 2 * scale
    assert any(f"are its times in {unit}? Then give time_unit='{unit}' (--time-unit {unit})" in note for note in read.notes)


def test_a_beginning_that_is_a_date_is_told(tmp_path: Path) -> None:
    read = read_text(tmp_path / "t.csv", f"t,{HEAD}{body(1.0, begin=1_764_000_000.0)}")
    assert "time begins at 1.764e+09 s in the file (2025-11-24 if that is since 1970), at 0 here" in read.notes
