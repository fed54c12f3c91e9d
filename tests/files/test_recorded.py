"""Trajectories of other programs: read as they were meant or refused in a sentence, judged for every instant."""

from __future__ import annotations

import pickle
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import CubicHermiteSpline, CubicSpline

from spacearm.core.errors import FileFormatError, ProblemError, SpacearmError
from spacearm.files import load_trajectory
from spacearm.files.trajectory_file import save_trajectory
from spacearm.motion import Motion, PiecewisePath, RecordedTrajectory, TimeLaw, Trajectory, time_optimal
from spacearm.robot import Joint, Robot, load_robot
from support.messages import assert_refused
from support.small_robots import two_link

ARM = load_robot("zhang2022")
TURNER = two_link(lower=(-np.inf, -2.0), upper=(np.inf, 2.0))
TABLE = "t_s,shoulder,elbow\n0,0,0\n1,0.2,0.1\n2,0.3,0.5\n"


def written(directory: Path, content: str | bytes) -> Path:
    path = directory / "trajectory.csv"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


def sliding() -> Robot:
    """A turning and a sliding joint."""
    turner = two_link()
    joints = (turner.joints[0], Joint(name="slide", kind="prismatic", parent=0, T_parent_joint=np.eye(4)))
    frames = tuple(frame for frame in turner.frames if frame.joint < 1)
    return Robot(
        name="sliding",
        joints=joints,
        frames=frames,
        tip=frames[-1].name,
        lower=[-3, -1],
        upper=[3, 1],
        velocity=[1, 1],
        acceleration=[1, 1],
    )


def test_lines_have_infinite_accelerations_at_corners_only_where_a_joint_has_one() -> None:
    robot = two_link()
    trajectory = RecordedTrajectory(robot, PiecewisePath.from_linear([0, 1, 2], [[0, 0], [0.1, 0.2], [0.2, 0.1]]))
    margins = trajectory.limits
    assert margins.acceleration[0] == pytest.approx(0, abs=1e-9)
    assert margins.acceleration[1] == np.inf
    np.testing.assert_allclose(margins.velocity, np.array([0.1, 0.2]) / robot.velocity)
    assert not margins.holds
    assert margins.jerk is None
    jerk = trajectory.margins(jerk_limit=1.0).jerk
    assert jerk is not None
    assert jerk[1] == np.inf


@settings(max_examples=25)
@given(st.data())
def test_margins_are_those_of_dense_samples(data: st.DataObject) -> None:
    robot = two_link()
    rows = data.draw(st.integers(2, 5))
    number = st.floats(-0.9, 0.9, allow_subnormal=False)
    t = np.concatenate([[0.0], np.cumsum([data.draw(st.floats(0.1, 2.0)) for _ in range(rows - 1)])])
    q, dq, ddq = (np.array([[data.draw(number) for _ in range(2)] for _ in range(rows)]) for _ in range(3))
    for path in (PiecewisePath.from_cubic(t, q, dq), PiecewisePath.from_cubic(t, q), PiecewisePath.from_quintic(t, q, dq, ddq)):
        trajectory = RecordedTrajectory(robot, path)
        margins = trajectory.margins(jerk_limit=2.0)
        assert margins.jerk is not None
        u = (path.breaks[:-1, None] + np.linspace(1e-9, 1 - 1e-9, 601) * np.diff(path.breaks)[:, None]).ravel()
        samples = [path.sample(u, k) for k in range(4)]
        position = np.minimum(samples[0].min(axis=0) - robot.lower, robot.upper - samples[0].max(axis=0))
        np.testing.assert_allclose(margins.position, position, rtol=0, atol=2e-4)
        assert (margins.position <= position + 1e-12).all()
        for values, limit, margin in (
            (samples[1], robot.velocity, margins.velocity),
            (samples[2], robot.acceleration, margins.acceleration),
        ):
            share = np.abs(values).max(axis=0) / limit
            np.testing.assert_allclose(margin, share, rtol=3e-3, atol=1e-9)
            assert (margin >= share * (1 - 1e-9)).all()
        corner = path.jumps(2).any(axis=0)
        np.testing.assert_array_equal(np.isinf(margins.jerk), corner)
        np.testing.assert_allclose(margins.jerk[~corner], np.abs(samples[3]).max(axis=0)[~corner] / 2, rtol=1e-3, atol=1e-9)


@pytest.mark.parametrize("sliver", [2e-6, 1e-5, 1e-3])
def test_a_corner_in_short_pieces_is_seen(sliver: float) -> None:
    t = np.array([0, 1, 1 + sliver, 2])
    q = np.column_stack([0.1 * t, np.interp(t, [0, 1, 2], [0, 0.1, 0.3])])
    margins = RecordedTrajectory(two_link(), PiecewisePath.from_linear(t, q)).limits
    assert margins.acceleration[1] == np.inf
    assert margins.acceleration[0] < 1e-3


def test_it_has_the_face_of_a_trajectory() -> None:
    robot = two_link()
    path = PiecewisePath.from_cubic([0, 1, 3], [[0, 0], [0.2, 0.1], [0.3, 0.5]])
    trajectory = RecordedTrajectory(robot, path, notes=("from elsewhere",))
    assert trajectory.duration == 3
    assert trajectory.curve is path
    np.testing.assert_array_equal(trajectory.time_at([-1, 0.5, 9]), [0, 0.5, 3])
    for shape in ((), (1,), (3, 2), (0,)):
        t = np.full(shape, 0.2)
        assert all(values.shape == (*shape, 2) for values in trajectory.sample(t))
        assert trajectory.tip(t).shape == (*shape, 4, 4)
        assert trajectory.base_pose(t)[0].shape == (*shape, 3)
    before, after = (trajectory.sample(t) for t in (-1.0, 4.0))
    np.testing.assert_array_equal([before.q, after.q], [[0, 0], [0.3, 0.5]])
    assert not np.any([before.dq, before.ddq, after.dq, after.ddq])
    again = pickle.loads(pickle.dumps(trajectory))
    assert again == trajectory
    assert trajectory.margins(two_link(velocity=(1e-3, 1e-3))).velocity.max() > 1


# --- files ---


@pytest.mark.parametrize("law", [None, TimeLaw([0, 1], [[0, 0, 1, 1]])])
def test_our_own_file_comes_back_as_the_same_motion(tmp_path: Path, law: TimeLaw | None) -> None:
    original = Trajectory(ARM, Motion([np.zeros(7), np.full(7, 0.5), np.linspace(-0.3, 0.3, 7)]), time_law=law)
    save_trajectory(original, tmp_path / "trajectory.csv")
    read = load_trajectory(ARM, tmp_path / "trajectory.csv")
    assert read.path.degree == 5
    assert read.duration == pytest.approx(original.duration, rel=1e-11)
    t = np.linspace(0, read.duration, 1001)
    np.testing.assert_allclose(read.sample(t).q, original.sample(t).q, rtol=0, atol=1e-9)
    np.testing.assert_allclose(read.limits.acceleration, original.limits.acceleration, rtol=0, atol=6e-3)
    assert read.notes == ("quintic between rows: the file gives positions, rates and accelerations",)


def test_a_time_optimal_file_comes_back_too(tmp_path: Path) -> None:
    original = time_optimal(ARM, Motion([np.zeros(7), np.full(7, 0.5), np.linspace(-0.3, 0.3, 7)]))
    save_trajectory(original, tmp_path / "trajectory.csv", samples=1001)
    read = load_trajectory(ARM, tmp_path / "trajectory.csv")
    t = np.linspace(0, read.duration, 777)
    np.testing.assert_allclose(read.sample(t).q, original.sample(t).q, rtol=0, atol=1e-6)


def test_what_the_file_gives_decides_between_lines_and_cubics(tmp_path: Path) -> None:
    robot = two_link()
    t, q = np.array([0.0, 1, 2]), np.array([[0, 0], [0.2, 0.1], [0.3, 0.5]])
    lines = load_trajectory(robot, written(tmp_path, TABLE))
    u = np.linspace(0, 2, 101)
    np.testing.assert_allclose(lines.sample(u).q[:, 1], np.interp(u, t, q[:, 1]), atol=1e-15)
    assert lines.notes == ("linear between rows: the file gives positions only",)
    spline = load_trajectory(robot, written(tmp_path, TABLE), interpolation="cubic")
    np.testing.assert_allclose(spline.sample(u).q, CubicSpline(t, q, bc_type="clamped")(u), atol=1e-12)
    assert spline.notes == ("the file gives no rates: the cubics are those of the spline at rest at both ends",)
    rated = "t_s,q_shoulder,q_elbow,dq_elbow,dq_shoulder\n0,0,0,0,0\n1,0.2,0.1,0.4,0.3\n2,0.3,0.5,0.1,0\n"
    dq = np.array([[0, 0], [0.3, 0.4], [0, 0.1]])
    cubic = load_trajectory(robot, written(tmp_path, rated))
    np.testing.assert_allclose(cubic.sample(u).q, CubicHermiteSpline(t, q, dq)(u), atol=1e-12)
    assert cubic.notes == (
        "cubic between rows: the file gives positions and rates",
        "it ends at 0.1 per second of joint 'elbow', not at rest",
    )
    assert load_trajectory(robot, written(tmp_path, rated), interpolation="linear").path == lines.path


SAME = {
    "columns in another order": "elbow,time,extra,shoulder\n0,0,9,0\n0.1,1,9,0.2\n0.5,2,9,0.3\n",
    "no header": "0,0,0\n1,0.2,0.1\n2,0.3,0.5\n",
    "semicolons": TABLE.replace(",", ";"),
    "tabs": TABLE.replace(",", "\t"),
    "spaces": TABLE.replace(",", "   "),
    "spaces after commas": TABLE.replace(",", ", "),
    "Windows": "\ufeff" + TABLE.replace("\n", "\r\n"),
    "old Mac": TABLE.replace("\n", "\r"),
    "blank lines and comments": "# made by hand, twice\n\n" + TABLE.replace("\n1", "\n\n# now\n1"),
    "quoted": TABLE.replace("shoulder", '"shoulder"').replace("0.2", '"0.2"'),
    "NumPy's header": "# " + TABLE,
    "exponents": TABLE.replace("0.2", "2e-1").replace("0.5", "+5.0E-1"),
    "no newline at the end": TABLE.rstrip(),
    "both names": "t_s,q_shoulder,elbow\n0,0,0\n1,0.2,0.1\n2,0.3,0.5\n",
    "later times": "t,shoulder,elbow\n1e3,0,0\n1001,0.2,0.1\n1002,0.3,0.5\n",
}


@pytest.mark.parametrize("case", SAME)
def test_a_table_is_read_in_any_of_its_forms(tmp_path: Path, case: str) -> None:
    robot = two_link()
    expected = PiecewisePath.from_linear([0, 1, 2], [[0, 0], [0.2, 0.1], [0.3, 0.5]])
    assert load_trajectory(robot, written(tmp_path, SAME[case])).path == expected


def test_what_was_assumed_is_told(tmp_path: Path) -> None:
    robot = two_link()
    assert load_trajectory(robot, written(tmp_path, SAME["no header"])).notes == (
        "no header: the columns are taken as time [s] and shoulder, elbow",
        "linear between rows: the file gives positions only",
    )
    assert (
        load_trajectory(robot, written(tmp_path, SAME["later times"])).notes[1]
        == "time begins at 1000 s in the file, at 0 here"
    )
    assert load_trajectory(robot, written(tmp_path, SAME["columns in another order"])).notes[0] == "columns left alone: extra"


def test_a_wrapped_angle_is_a_whole_turn_unless_told(tmp_path: Path) -> None:
    wrapped = written(tmp_path, "t_s,shoulder,elbow\n0,3,0\n1,3.1,0\n2,-3.1,0\n3,-3,0\n")
    literal = load_trajectory(TURNER, wrapped, interpolation="linear")
    np.testing.assert_allclose(literal.sample(1.5).q, [0, 0], atol=1e-15)  # all the way round
    assert literal.notes == (
        "joint 'shoulder' turns by -6.2 rad between lines 3 and 4, taken literally; unwrap takes the short way",
    )
    short = load_trajectory(TURNER, wrapped, interpolation="linear", unwrap=True)
    np.testing.assert_allclose(short.sample([0, 1.5, 3]).q[:, 0], [3, np.pi, 2 * np.pi - 3], atol=1e-12)
    assert short.notes == ()


def test_a_slide_is_never_unwrapped_nor_turned_into_radians(tmp_path: Path) -> None:
    robot = sliding()
    path = written(tmp_path, "t_s,shoulder,slide\n0,0,-4\n1,90,4\n")
    trajectory = load_trajectory(robot, path, degrees=True, unwrap=True)
    np.testing.assert_allclose(trajectory.sample([0, 1]).q, [[0, -4], [np.pi / 2, 4]])
    assert trajectory.limits.position[1] == pytest.approx(-3)
    with_rates = written(tmp_path, "t_s,shoulder,slide,dq_shoulder,dq_slide\n0,0,0,0,0\n1,90,0.4,180,1\n")
    dq = load_trajectory(robot, with_rates, degrees=True).sample(1.0).dq
    np.testing.assert_allclose(dq, [np.pi, 1])


def test_beyond_the_limits_is_read_and_judged(tmp_path: Path) -> None:
    trajectory = load_trajectory(two_link(), written(tmp_path, TABLE.replace("0.5", "3.5")))
    assert trajectory.limits.position[1] < 0
    assert not trajectory.limits.holds


def test_a_long_file_is_read(tmp_path: Path) -> None:
    t = np.arange(20_001) * 1e-3
    rows = np.column_stack([t, np.sin(t), np.cos(t)])
    np.savetxt(tmp_path / "long.csv", rows, delimiter=",", header="t_s,shoulder,elbow", fmt="%.9g")
    trajectory = load_trajectory(two_link(), tmp_path / "long.csv", interpolation="cubic")
    assert trajectory.path.pieces == 20_000
    np.testing.assert_allclose(trajectory.sample(10.00051).q, [np.sin(10.00051), np.cos(10.00051)], atol=1e-8)
    assert np.isfinite(trajectory.limits.acceleration).all()


BROKEN: dict[str, str | bytes] = {
    "empty": "",
    "blank": " \n\n",
    "one row": "t_s,shoulder,elbow\n0,0,0\n",
    "header only": "t_s,shoulder,elbow\n",
    "comments only": "# t_s,shoulder,elbow\n# nothing\n",
    "no time": "shoulder,elbow\n0,0\n1,1\n",
    "time in minutes": "t_min,shoulder,elbow\n0,0,0\n1,1,1\n",
    "joint by both its names": "t_s,shoulder,q_shoulder,elbow\n0,0,0,0\n1,1,1,1\n",
    "a joint of another robot moves": "t_s,q_shoulder,q_elbow,q_wrist\n0,0,0,0\n1,1,1,1\n",
    "accelerations without rates": "t_s,shoulder,elbow,ddq_shoulder,ddq_elbow\n0,0,0,0,0\n1,1,1,1,1\n",
    "base in part": "t_s,shoulder,elbow,base_x\n0,0,0,0\n1,1,1,1\n",
    "joint missing": "t_s,shoulder,ellbow\n0,0,0\n1,1,1\n",
    "joint twice": "t_s,shoulder,elbow,elbow\n0,0,0,0\n1,1,1,1\n",
    "rates of one joint": "t_s,shoulder,elbow,dq_elbow\n0,0,0,0\n1,1,1,1\n",
    "no header, too few columns": "0,0\n1,1\n",
    "no header, too many columns": "0,0,0,0\n1,1,1,1\n",
    "NaN": TABLE.replace("0.2", "nan"),
    "infinite": TABLE.replace("0.2", "-inf"),
    "beyond doubles": TABLE.replace("0.2", "1e999"),
    "word": TABLE.replace("0.2", "home"),
    "number with underscore": TABLE.replace("0.2", "1_0"),
    "empty cell": TABLE.replace("0.2", ""),
    "decimal commas": "t_s;shoulder;elbow\n0;0;0\n1;0,2;0,1\n",
    "row cut short": TABLE.replace(",0.5", ""),
    "row too long": TABLE.replace("0.5", "0.5,0.6"),
    "times the same": TABLE.replace("2,0.3", "1,0.3"),
    "times fall": TABLE.replace("2,0.3", "0.5,0.3"),
    "times too close": TABLE.replace("2,0.3", "1.0000000000001,0.3"),
    "degrees": TABLE.replace("0.5", "90"),
    "far away": TABLE.replace("0.2", "1e7"),
    "binary": b"\x7fELF\x00\x01",
    "no text": b"t_s,shoulder,elbow\n0,0,0\n1,\xff\xfe,1\n",
    "JSON": '{"spacearm-plan": 1}',
    "XML": "<robot name='arm'/>",
    "quote never closed": 't_s,shoulder,elbow\n0,0,"0\n1,1,1\n',
    "endless cell": "t_s,shoulder,elbow\n0,0," + "1" * 200_000 + "\n",
}


@pytest.mark.parametrize("case", BROKEN)
def test_broken_files_are_refused(tmp_path: Path, case: str) -> None:
    path = written(tmp_path, BROKEN[case])
    robot = TURNER if case == "far away" else two_link()
    error = ProblemError if case in ("far away", "times too close") else FileFormatError
    assert_refused("motion", f"file: {case}", error, lambda: load_trajectory(robot, path), path=path)


def test_missing_files_and_unknown_interpolations_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "nowhere.csv"
    assert_refused("motion", "file: missing", FileFormatError, lambda: load_trajectory(ARM, path), path=path)
    path = written(tmp_path, TABLE)
    choices: dict[str, Any] = {"file: interpolation mistyped": "spline", "file: quintics without rates": "quintic"}
    for case, interpolation in choices.items():
        assert_refused(
            "motion",
            case,
            FileFormatError,
            lambda i=interpolation: load_trajectory(two_link(), path, interpolation=i),
            path=path,
        )


FRAGMENTS = st.sampled_from(
    [
        "t_s",
        "shoulder",
        "q_elbow",
        "elbow",
        "dq_elbow",
        ",",
        ";",
        "\t",
        " ",
        "\n",
        "\r",
        '"',
        "#",
        "0",
        "1",
        "-1e9",
        "nan",
        "1e-320",
        "\0",
    ]
)


def read_or_refused(content: bytes, robot: Robot) -> RecordedTrajectory | None:
    """Read a file; a refusal must be of one line, and anything else than a refusal is raised."""
    with TemporaryDirectory() as directory:
        try:
            return load_trajectory(robot, written(Path(directory), content))
        except SpacearmError as refusal:
            if "\n" in str(refusal):
                pytest.fail(f"more than a line: {refusal}")
            return None


@settings(max_examples=40)
@given(st.one_of(st.binary(max_size=80), st.lists(FRAGMENTS, max_size=60).map(lambda parts: "".join(parts).encode())))
def test_whatever_a_file_holds_it_is_read_or_refused_in_a_sentence(content: bytes) -> None:
    trajectory = read_or_refused(content, TURNER)
    assert trajectory is None or np.isfinite(trajectory.limits.velocity).all()


@settings(max_examples=30)
@given(st.integers(0, len(TABLE) - 1), st.one_of(FRAGMENTS, st.characters(codec="utf-8")), st.booleans())
def test_a_file_with_one_wrong_character_is_read_or_refused_in_a_sentence(at: int, new: str, instead: bool) -> None:
    read_or_refused((TABLE[:at] + new + TABLE[at + instead :]).encode(), two_link())


REFUSED: dict[str, Any] = {
    "recorded, no path": lambda: RecordedTrajectory(ARM, "path"),  # type: ignore[arg-type]
    "recorded, another robot's": lambda: RecordedTrajectory(ARM, PiecewisePath.from_linear([0, 1], np.zeros((2, 2)))),
    "recorded, from later": lambda: RecordedTrajectory(two_link(), PiecewisePath.from_linear([5, 6], np.zeros((2, 2)))),
    "recorded, without end": lambda: RecordedTrajectory(
        two_link(), PiecewisePath.from_linear([0, 1e200], [[0.0, 0.0], [0.1, 0.1]])
    ),
    "recorded, jumping": lambda: RecordedTrajectory(
        two_link(), PiecewisePath([0, 1, 2], [[[0.0, 0.0], [0.1, 0.1]], [[0.1, 0.3], [0.1, 0.3]]])
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_recorded_trajectories_that_cannot_be_are_refused(case: str) -> None:
    assert_refused("motion", case, ProblemError, REFUSED[case])


def test_what_a_joints_jumps_add_up_to_is_part_of_the_path_and_said() -> None:
    """A stair of one joint, each step below the rounding of another one's numbers."""
    count, step = 400, 1.4e-8
    b = step * np.concatenate([np.arange(count), count - np.arange(count)])
    points = np.stack([np.full(2 * count, 9.9e5), b], axis=1)[:, None] * np.ones((2, 1))
    path = PiecewisePath(np.arange(2 * count + 1) * 1e-4, points)
    made = RecordedTrajectory(TURNER, path)
    assert np.abs(np.diff(made.sample(path.breaks).q[:, 1])).max() <= 1.01 * step
    assert made.limits.velocity[1] * TURNER.velocity[1] >= 0.99 * step / 1e-4
    assert made.limits.acceleration[1] == np.inf
    assert len(made.notes) == 1
    assert "joint 'elbow' at" in made.notes[0]
    again = RecordedTrajectory(TURNER, made.path, notes=made.notes)
    assert again == made
    joined = PiecewisePath.from_linear([0, 1, 2], [[9.9e5, 0], [9.9e5, 1e-3], [9.9e5, 0]])
    assert RecordedTrajectory(TURNER, joined).path is joined
    assert RecordedTrajectory(TURNER, joined).notes == ()
