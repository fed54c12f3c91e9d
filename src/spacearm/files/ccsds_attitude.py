"""The base's attitude as an Attitude Ephemeris Message of CCSDS (AEM), keyword = value notation.

CCSDS 504.0-B-2, Attitude Data Messages, January 2024: a header, metadata, and a line for each instant with its epoch and the
quaternion Q1 Q2 Q3 QC, the scalar last. The quaternion "from frame A to frame B" turns A's axes onto B's: with A inertial and
B the base that is our `attitude_wxyz` itself, in another order. In version 1.0 (504.0-B-1, 2008) the metadata says so with
ATTITUDE_DIR and QUATERNION_TYPE; version 2.0 has neither keyword, for there is one direction and one order.
"""

from __future__ import annotations

import os
from datetime import datetime, timedelta, timezone
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spacearm.core.checks import shown
from spacearm.core.errors import SettingsError
from spacearm.core.output import require_writable, write_out
from spacearm.core.version import version as spacearm_version
from spacearm.files.written_rows import instants
from spacearm.motion.recorded import AnyTrajectory, require_trajectory

LOCAL_FRAME = "LOCAL_INERTIAL"
VERSIONS = ("1.0", "2.0")

_PLACEHOLDER = "2000-01-01T00:00:00"
_TICKS = 1_000_000  # a second's, of Python's clock
_LONGEST = 200  # characters of a value: a line of the message has at most 254
_DEGREE = 5

# 6.10.3 of the standard: comments stand after the version, after META_START and after DATA_START, and nowhere else.


def write_aem(
    trajectory: AnyTrajectory,
    path: str | os.PathLike[str],
    *,
    object_name: str | None = None,
    object_id: str = "UNKNOWN",
    frame_a: str = LOCAL_FRAME,
    frame_b: str = "SC_BODY_1",
    start_epoch: str | datetime | None = None,
    time_system: str = "UTC",
    step: float | None = None,
    originator: str = "SPACEARM",
    creation_date: str | datetime | None = None,
    version: str = "2.0",
    overwrite: bool = False,
) -> None:
    """Write the attitude of a trajectory's base as an AEM of CCSDS 504.0-B, type QUATERNION.

    Args:
        trajectory: whose base turns, or rests.
        path: of the file, a new one.
        object_name: of the spacecraft; None: the robot's name.
        object_id: its international designator, as 2024-001A; UNKNOWN where there is none, as the standard has it.
        frame_a: what the inertial frame of the problem is, as EME2000 or ICRF; by default it is a frame of its own, and a
            comment says that it has to be agreed upon.
        frame_b: the base.
        start_epoch: when the motion begins, as 2026-03-01T12:00:00; an aware `datetime` is turned into UTC. None: midnight
            of 2000-01-01, and a comment says that it stands for no date.
        time_system: of the epochs. In UTC no leap second may fall into the motion: epochs are counted without it.
        step: between two lines [s], at least 1e-6; None: a 200th of the duration.
        originator: who made the message.
        creation_date: of the message, UTC; None: now.
        version: of the format, "2.0", or "1.0" for readers of 504.0-B-1.
        overwrite: replace a file that is there.

    Raises:
        OutputError: the file exists already, or cannot be written.
        SettingsError: an epoch, a step, a version or a name that cannot be.
    """
    require_trajectory(trajectory)
    if not isinstance(version, str) or version not in VERSIONS:
        raise SettingsError(f"version is {shown(version)}, expected one of {', '.join(map(repr, VERSIONS))}")
    named = {
        "object_name": (_ascii(trajectory.robot.name).strip() or "UNKNOWN") if object_name is None else object_name,
        "object_id": object_id,
        "frame_a": frame_a,
        "frame_b": frame_b,
        "time_system": time_system,
        "originator": originator,
    }
    values = {name: _value(name, given) for name, given in named.items()}
    start = as_epoch("start_epoch", _PLACEHOLDER if start_epoch is None else start_epoch)
    now = datetime.now(timezone.utc).replace(microsecond=0) if creation_date is None else creation_date
    created = _printed(as_epoch("creation_date", now))
    require_writable(path, overwrite=overwrite)
    at = instants(trajectory, step, ticks=_TICKS)
    try:
        epochs = [_printed(start + timedelta(microseconds=tick)) for tick in at.tolist()]
    except OverflowError:
        raise SettingsError(f"start_epoch is {shown(start_epoch)}, expected the motion to end before year 10000") from None
    lines = [
        f"CCSDS_AEM_VERS = {version}",
        f"COMMENT Base of robot '{_ascii(trajectory.robot.name)}' over a planned motion, by spacearm {spacearm_version()}.",
        f"CREATION_DATE = {created}",
        f"ORIGINATOR = {values['originator']}",
        "",
        "META_START",
        *(f"COMMENT {comment}" for comment in _comments(values["frame_a"], start_epoch, trajectory.base_model.sentence)),
        f"OBJECT_NAME = {values['object_name']}",
        f"OBJECT_ID = {values['object_id']}",
        f"REF_FRAME_A = {values['frame_a']}",
        f"REF_FRAME_B = {values['frame_b']}",
        *(["ATTITUDE_DIR = A2B"] if version == "1.0" else []),
        f"TIME_SYSTEM = {values['time_system']}",
        f"START_TIME = {epochs[0]}",
        f"STOP_TIME = {epochs[-1]}",
        "ATTITUDE_TYPE = QUATERNION",
        *(["QUATERNION_TYPE = LAST"] if version == "1.0" else []),
        *_interpolation(len(at)),
        "META_STOP",
        "",
        "DATA_START",
        *(f"{epoch} {_numbers(row)}" for epoch, row in zip(epochs, _scalar_last(trajectory, at), strict=True)),
        "DATA_STOP",
    ]
    write_out(path, "\n".join(lines) + "\n", overwrite=overwrite)


def _scalar_last(trajectory: AnyTrajectory, at: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return Q1 Q2 Q3 QC, (m, 4), without jumps of the sign, so that they can be interpolated."""
    wxyz = trajectory.base_pose(at / _TICKS)[1]
    turned = np.sign((wxyz[1:] * wxyz[:-1]).sum(axis=1))
    wxyz[1:] *= np.cumprod(np.where(turned == 0, 1.0, turned))[:, None]
    return wxyz[:, [1, 2, 3, 0]]


def _numbers(row: NDArray[np.float64]) -> str:
    return " ".join(f"{value + 0.0:.15f}" for value in row.round(15))


def _interpolation(count: int) -> list[str]:
    """Recommend a degree that there are lines enough for."""
    if count > _DEGREE:
        return ["INTERPOLATION_METHOD = LAGRANGE", f"INTERPOLATION_DEGREE = {_DEGREE}"]
    return ["INTERPOLATION_METHOD = LINEAR", "INTERPOLATION_DEGREE = 1"] if count > 1 else []


def _comments(frame_a: str, start_epoch: Any, base: str) -> list[str]:
    comments = [
        "Each line: epoch, Q1, Q2, Q3, QC (scalar last); the quaternion turns the axes of REF_FRAME_A",
        "onto those of REF_FRAME_B.",
    ]
    if frame_a == LOCAL_FRAME:
        comments += [
            f"{LOCAL_FRAME} is the inertial frame of the planning problem, not one of the SANA registry:",
            "its axes have to be agreed upon, or the file written with the celestial frame that they are.",
        ]
    if start_epoch is None:
        comments.append("No epoch was given: START_TIME stands for the beginning of the motion and for no date.")
    return [*comments, base]


def _value(name: str, given: Any) -> str:
    """Check a value of the message: one line of printable ASCII, as the standard has it."""
    text = given.strip() if isinstance(given, str) else ""
    if not (text and text.isascii() and text.isprintable() and len(text) <= _LONGEST):
        raise SettingsError(
            f"{name} is {shown(given)}, expected a line of 1 to {_LONGEST} printable ASCII characters; write it so"
        )
    return text


def as_epoch(name: str, given: str | datetime) -> datetime:
    """Return a date without time zone; one with it is turned into UTC.

    Raises:
        SettingsError: no date and time.
    """
    moment: Any = given
    if isinstance(given, str):
        try:
            moment = datetime.fromisoformat(given.strip().removesuffix("Z"))
        except ValueError:
            moment = None
    if not isinstance(moment, datetime):
        raise SettingsError(f"{name} is {shown(given)}, expected a date and time as 2026-03-01T12:00:00")
    return moment if moment.tzinfo is None else moment.astimezone(timezone.utc).replace(tzinfo=None)


def _printed(moment: datetime) -> str:
    return moment.isoformat(timespec="microseconds" if moment.microsecond else "seconds")


def _ascii(name: str) -> str:
    return "".join(c if c.isascii() and c.isprintable() else "?" for c in name)[:100]
