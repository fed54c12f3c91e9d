"""Trajectories in the formats of others, read back by readers written here after the formats' own texts."""

from __future__ import annotations

import json
from datetime import datetime, timedelta, timezone
from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import lagrange
from scipy.spatial.transform import Rotation

from spacearm.core.errors import OutputError, SettingsError
from spacearm.dynamics import Momentum
from spacearm.files import write_aem, write_ros_trajectory
from spacearm.motion import Motion, RecordedTrajectory, Trajectory
from spacearm.robot import load_robot
from support.messages import assert_refused

CREATED = "2026-02-03T04:05:06"
SRS7 = load_robot("srs7")


def floating(**given: object) -> Trajectory:
    """Return a motion of a small spacecraft's arm, the base turned and aside at the start."""
    start = np.eye(4)
    start[:3, :3] = Rotation.from_rotvec([0.3, -0.2, 1.1]).as_matrix()
    start[:3, 3] = 0.5, -1.0, 2.0
    points = np.array([[0, 0, 0, 0.4, 0, 0, 0], [0.5, 0.8, -0.3, 0.9, 0.2, -0.6, 0.4], [0.9, 0.3, 0.6, 1.5, -0.5, 0.4, 0.1]])
    return Trajectory(SRS7, Motion(points), **{"base": "floating", "base_start": start, **given})  # type: ignore[arg-type]


PLANNED = floating()


def resting(attitude: Rotation) -> Trajectory:
    """Return a motion whose base is held so."""
    start = np.eye(4)
    start[:3, :3] = attitude.as_matrix()
    return floating(base="fixed", base_start=start)


class Aem:
    """An attitude ephemeris message in KVN, read as strictly as CCSDS 504.0-B-2 has it."""

    HEADER = ("CCSDS_AEM_VERS", "CREATION_DATE", "ORIGINATOR")
    META = ("OBJECT_NAME", "OBJECT_ID", "REF_FRAME_A", "REF_FRAME_B", "ATTITUDE_DIR", "TIME_SYSTEM", "START_TIME", "STOP_TIME")
    META += ("ATTITUDE_TYPE", "QUATERNION_TYPE", "INTERPOLATION_METHOD", "INTERPOLATION_DEGREE")

    def __init__(self, path: Path) -> None:
        raw = path.read_bytes()
        assert raw.isascii()
        text = raw.decode("ascii")
        assert "\t" not in text
        lines = [line for line in text.split("\n") if line.strip()]
        assert all(len(line) <= 254 for line in lines)
        marks = [lines.index(mark) for mark in ("META_START", "META_STOP", "DATA_START", "DATA_STOP")]
        assert marks == sorted(marks)
        assert marks[2] == marks[1] + 1
        assert marks[3] == len(lines) - 1
        self.header, after_version = self._pairs(lines[: marks[0]], self.HEADER, comments_at=1)
        self.meta, self.comments = self._pairs(lines[marks[0] + 1 : marks[1]], self.META, comments_at=0)
        self.comments += after_version
        rows = [line.split() for line in lines[marks[2] + 1 : marks[3]]]
        assert {len(row) for row in rows} == {5}
        self.epochs = [self.moment(row[0]) for row in rows]
        assert all(b > a for a, b in zip(self.epochs, self.epochs[1:], strict=False))
        assert self.moment(self.meta["START_TIME"]) == self.epochs[0]
        assert self.moment(self.meta["STOP_TIME"]) == self.epochs[-1]
        self.quaternions = np.array([[float(value) for value in row[1:]] for row in rows])  # Q1 Q2 Q3 QC

    @staticmethod
    def _pairs(lines: list[str], order: tuple[str, ...], *, comments_at: int) -> tuple[dict[str, str], str]:
        comments = [i for i, line in enumerate(lines) if line.startswith("COMMENT ")]
        assert comments == list(range(comments_at, comments_at + len(comments)))
        pairs = [line.split(" = ") for i, line in enumerate(lines) if i not in comments]
        keys = [key for key, _ in pairs]
        assert keys == [key for key in order if key in keys]
        return dict(pairs), " ".join(lines[i].removeprefix("COMMENT ") for i in comments)  # type: ignore[arg-type]

    @staticmethod
    def moment(text: str) -> datetime:
        """Read YYYY-MM-DDThh:mm:ss[.d]."""
        return datetime.strptime(text, "%Y-%m-%dT%H:%M:%S.%f" if "." in text else "%Y-%m-%dT%H:%M:%S")

    @property
    def seconds(self) -> np.ndarray:
        """Since the first epoch."""
        return np.array([(epoch - self.epochs[0]) / timedelta(seconds=1) for epoch in self.epochs])


def matrix_ba(q: np.ndarray) -> np.ndarray:
    """Return the matrix that turns coordinates in frame A into those in frame B, annex F2.1 of the standard."""
    a, b, c, s = q
    return np.array(
        [
            [a * a - b * b - c * c + s * s, 2 * (a * b + c * s), 2 * (a * c - b * s)],
            [2 * (a * b - c * s), -a * a + b * b - c * c + s * s, 2 * (b * c + a * s)],
            [2 * (a * c + b * s), 2 * (b * c - a * s), -a * a - b * b + c * c + s * s],
        ]
    )


def test_an_aem_read_back_turns_inertial_coordinates_into_those_of_the_base(tmp_path: Path) -> None:
    trajectory = PLANNED
    write_aem(trajectory, tmp_path / "a.aem", start_epoch="2026-03-01T12:00:00Z", creation_date=CREATED)
    aem = Aem(tmp_path / "a.aem")
    assert aem.header == {"CCSDS_AEM_VERS": "2.0", "CREATION_DATE": CREATED, "ORIGINATOR": "SPACEARM"}
    assert aem.meta["OBJECT_NAME"] == "srs7"
    assert (aem.meta["OBJECT_ID"], aem.meta["TIME_SYSTEM"]) == ("UNKNOWN", "UTC")
    assert (aem.meta["REF_FRAME_A"], aem.meta["REF_FRAME_B"]) == ("LOCAL_INERTIAL", "SC_BODY_1")
    assert "LOCAL_INERTIAL is the inertial frame of the planning problem" in aem.comments
    assert aem.epochs[0] == datetime(2026, 3, 1, 12)
    assert len(aem.epochs) == 201
    assert 0 <= trajectory.duration - aem.seconds[-1] < 1e-6
    wxyz = trajectory.base_pose(aem.seconds)[1]
    R_w_b = Rotation.from_quat(wxyz[:, [1, 2, 3, 0]]).as_matrix()
    np.testing.assert_allclose([matrix_ba(q) for q in aem.quaternions], R_w_b.swapaxes(1, 2), atol=1e-14)


def test_the_standards_own_example_of_a_quarter_turn(tmp_path: Path) -> None:
    write_aem(resting(Rotation.from_rotvec([0, 0, np.pi / 2])), tmp_path / "a.aem")
    q = Aem(tmp_path / "a.aem").quaternions[0]
    np.testing.assert_allclose(q, [0, 0, np.sqrt(0.5), np.sqrt(0.5)], atol=1e-15)
    np.testing.assert_allclose(matrix_ba(q) @ [1, 0, 0], [0, -1, 0], atol=1e-15)


def test_between_its_lines_an_aem_is_interpolated_as_it_recommends(tmp_path: Path) -> None:
    trajectory = PLANNED
    write_aem(trajectory, tmp_path / "a.aem")
    aem = Aem(tmp_path / "a.aem")
    assert (aem.meta["INTERPOLATION_METHOD"], aem.meta["INTERPOLATION_DEGREE"]) == ("LAGRANGE", "5")
    for first in (0, 50, 97, 195):
        t, q = aem.seconds[first : first + 6], aem.quaternions[first : first + 6]
        at = float(t[2] + 0.4 * (t[3] - t[2]))
        found = np.array([lagrange(t - at, q[:, i])(0.0) for i in range(4)])
        expected = trajectory.base_pose(at)[1][[1, 2, 3, 0]]
        expected *= np.sign(expected @ found)
        np.testing.assert_allclose(found, expected, atol=2e-8)


def test_a_tumbling_base_has_no_jumps_of_sign(tmp_path: Path) -> None:
    trajectory = floating(momentum=Momentum(angular=(0.0, 3.0, 8.0)), duration=60.0)
    write_aem(trajectory, tmp_path / "a.aem")
    q = Aem(tmp_path / "a.aem").quaternions
    assert np.ptp(q[:, 3]) > 1.5  # it turns by more than half a turn
    assert (q[1:] * q[:-1]).sum(axis=1).min() > 0.9


def test_version_1_states_direction_and_order_and_a_known_frame_needs_no_comment(tmp_path: Path) -> None:
    write_aem(
        PLANNED,
        tmp_path / "a.aem",
        version="1.0",
        object_name="SERVICER",
        object_id="2026-001A",
        frame_a="EME2000",
        time_system="TAI",
        start_epoch=datetime(2026, 1, 1, 1, tzinfo=timezone(timedelta(hours=1))),
        originator="A LAB",
        step=0.5,
    )
    aem = Aem(tmp_path / "a.aem")
    assert aem.header["CCSDS_AEM_VERS"] == "1.0"
    assert (aem.meta["ATTITUDE_DIR"], aem.meta["QUATERNION_TYPE"]) == ("A2B", "LAST")
    assert (aem.meta["REF_FRAME_A"], aem.meta["TIME_SYSTEM"], aem.meta["OBJECT_ID"]) == ("EME2000", "TAI", "2026-001A")
    assert "LOCAL" not in aem.comments
    assert aem.epochs[0] == datetime(2026, 1, 1)
    np.testing.assert_allclose(np.diff(aem.seconds)[:-1], 0.5, atol=1e-9)


def test_without_an_epoch_the_message_says_that_it_stands_for_no_date(tmp_path: Path) -> None:
    write_aem(PLANNED, tmp_path / "a.aem")
    assert "stands for the beginning of the motion and for no date" in Aem(tmp_path / "a.aem").comments


def test_a_recorded_trajectory_is_written_too(tmp_path: Path) -> None:
    planned = PLANNED
    recorded = RecordedTrajectory(SRS7, planned.path, base="floating", base_start=planned.base_start)
    write_aem(recorded, tmp_path / "a.aem", step=1.0)
    write_aem(planned, tmp_path / "b.aem", step=1.0)
    a, b = (Aem(tmp_path / name).quaternions for name in ("a.aem", "b.aem"))
    np.testing.assert_allclose(a, b, atol=1e-8)
    write_ros_trajectory(recorded, tmp_path / "a.json")


def seconds(stamp: dict[str, int]) -> float:
    """Return a ROS time in seconds."""
    assert set(stamp) == {"sec", "nanosec"}
    assert 0 <= stamp["nanosec"] < 10**9
    return stamp["sec"] + 1e-9 * stamp["nanosec"]


def test_ros_messages_hold_the_joints_over_time(tmp_path: Path) -> None:
    trajectory = floating(base="fixed", base_start=None)
    write_ros_trajectory(trajectory, tmp_path / "a.json", step=0.1)
    messages = json.loads((tmp_path / "a.json").read_text())
    assert list(messages) == ["joint_trajectory"]
    message = messages["joint_trajectory"]
    assert message["joint_names"] == list(SRS7.dof_names)
    assert message["header"] == {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": ""}
    points = message["points"]
    assert all(set(p) == {"positions", "velocities", "accelerations", "effort", "time_from_start"} for p in points)
    t = np.array([seconds(point["time_from_start"]) for point in points])
    assert (np.diff(t) > 0).all()
    assert t[0] == 0
    assert 0 <= trajectory.duration - t[-1] < 2e-9
    state = trajectory.sample(t)
    for key, expected in zip(("positions", "velocities", "accelerations"), state, strict=True):
        np.testing.assert_allclose([point[key] for point in points], expected, atol=1e-9)


def test_ros_messages_of_a_floating_base_are_in_the_inertial_frame(tmp_path: Path) -> None:
    trajectory = PLANNED
    write_ros_trajectory(trajectory, tmp_path / "a.json", frame_id="map")
    messages = json.loads((tmp_path / "a.json").read_text())
    assert list(messages) == ["joint_trajectory", "base_path", "base_twists"]
    poses, twists = messages["base_path"]["poses"], messages["base_twists"]
    assert messages["base_path"]["header"]["frame_id"] == "map"
    assert {stamped["header"]["frame_id"] for stamped in (*poses, *twists)} == {"map"}
    t = np.array([seconds(stamped["header"]["stamp"]) for stamped in poses])
    assert len(t) == len(messages["joint_trajectory"]["points"]) == 201
    position, wxyz = trajectory.base_pose(t)
    found = np.array([[stamped["pose"]["position"][axis] for axis in "xyz"] for stamped in poses])
    np.testing.assert_allclose(found, position, atol=1e-9)
    turned = Rotation.from_quat([[stamped["pose"]["orientation"][part] for part in "xyzw"] for stamped in poses])
    np.testing.assert_allclose(turned.as_matrix(), Rotation.from_quat(wxyz[:, [1, 2, 3, 0]]).as_matrix(), atol=1e-9)
    # The twists are the derivatives of the poses, in the axes of the header's frame.
    linear, angular = (np.array([[twist["twist"][kind][axis] for axis in "xyz"] for twist in twists]) for kind in KINDS)
    np.testing.assert_allclose(linear[1:-1], (found[2:] - found[:-2]) / (t[2:] - t[:-2])[:, None], atol=5e-5)
    steps = (turned[2:] * turned[:-2].inv()).as_rotvec() / (t[2:] - t[:-2])[:, None]
    np.testing.assert_allclose(angular[1:-1], steps, atol=5e-5)


KINDS = ("linear", "angular")


@pytest.mark.parametrize("write", [write_aem, write_ros_trajectory])
def test_an_export_is_never_written_over_a_file(write, tmp_path: Path) -> None:
    (tmp_path / "a").write_text("mine")
    assert_refused("motion", "export exists", OutputError, lambda: write(PLANNED, tmp_path / "a"), path=tmp_path / "a")
    assert (tmp_path / "a").read_text() == "mine"


WRONG = {
    "a version of no standard": {"version": "3.0"},
    "a name of two lines": {"object_name": "SAT\nSTOP_TIME = now"},
    "a name that is empty": {"object_id": " "},
    "a name in Greek": {"originator": "Ωmega"},
    "a frame that is no name": {"frame_a": 3},
    "an epoch that is none": {"start_epoch": "noon"},
    "an epoch that is a number": {"start_epoch": 0.0},
    "an epoch at the end of time": {"start_epoch": "9999-12-31T23:59:59"},
    "a creation date that is none": {"creation_date": "2026-13-01T00:00:00"},
    "a step of 0": {"step": 0.0},
    "a step too short": {"step": 1e-6},
}


@pytest.mark.parametrize("case", WRONG)
def test_an_aem_that_cannot_be_is_refused(case: str, tmp_path: Path) -> None:
    given = WRONG[case]
    assert_refused("motion", f"aem: {case}", SettingsError, lambda: write_aem(PLANNED, tmp_path / "a", **given))  # type: ignore[arg-type]
    assert not list(tmp_path.iterdir())


def test_a_ros_frame_without_a_name_is_refused(tmp_path: Path) -> None:
    call = lambda: write_ros_trajectory(PLANNED, tmp_path / "a", frame_id="")  # noqa: E731
    assert_refused("motion", "ros: frame_id is empty", SettingsError, call)
