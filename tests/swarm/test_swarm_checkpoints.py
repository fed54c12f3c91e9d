"""Checkpoints: going on is the same as never having stopped, and no file is taken or lost that should not be."""

from __future__ import annotations

import errno
import io
import json
import os
import shutil
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from spacearm.core.errors import FileFormatError, OutputError, SettingsError, SpacearmError, SwarmError
from spacearm.swarm import IPSO, PSO, FeasibleFirst, Penalty, Swarm, SwarmSettings, minimize
from support.messages import assert_refused
from support.swarm_boxes import SEEDS, SMALL_NAMED, Box, Hills, assert_same_run, boxes, by_hand, swarms

BOX = np.array([3.0, -9.0]), np.array([5.0, -8.5])
PLAIN = PSO(particles=10, iterations=20)
WITH_FILES = settings(max_examples=25, suppress_health_check=[HealthCheck.function_scoped_fixture])


class Crash(Exception):
    """What stops a run from outside."""


def crashing(f: Any, after: int) -> Any:
    """f, until it has been asked so often."""
    calls = []

    def asked(x: np.ndarray) -> Any:
        if len(calls) == after:
            raise Crash
        calls.append(1)
        return f(x)

    return asked


def checkpointed(path: Path, chosen: SwarmSettings = PLAIN, after: int = 7, **options: Any) -> Path:
    """A checkpoint of a run that crashed after so many iterations."""
    with pytest.raises(Crash):
        minimize(crashing(Hills(*BOX), after), *BOX, chosen, **{"rng": 3, "checkpoint": path, "checkpoint_every": 1, **options})
    return path


@pytest.mark.parametrize("constrained", [False, True])
@pytest.mark.parametrize("name", SMALL_NAMED)
def test_a_resumed_run_is_the_uninterrupted_one(name: str, constrained: bool, tmp_path: Path) -> None:
    f, chosen = Hills(*BOX, constrained=constrained), SMALL_NAMED[name]
    options: dict[str, Any] = {"rng": 3, "history": "positions", "checkpoint_every": 4}
    whole = minimize(f, *BOX, chosen, **options)
    for crash in (5, 9, 7):  # again and again, on the same file
        with pytest.raises(Crash):
            minimize(crashing(f, crash), *BOX, chosen, **options, checkpoint=tmp_path / "swarm.npz", resume=True)
    assert_same_run(minimize(f, *BOX, chosen, **options, checkpoint=tmp_path / "swarm.npz", resume=True), whole)


@WITH_FILES
@given(box=boxes(), chosen=swarms(), seed=SEEDS, rounds=st.integers(0, 12), constrained=st.booleans(), keep=st.booleans())
def test_a_loaded_swarm_goes_on_as_if_it_had_never_stopped(
    box: Box, chosen: SwarmSettings, seed: int, rounds: int, constrained: bool, keep: bool, tmp_path: Path
) -> None:
    f = Hills(*box, constrained=constrained)
    swarm = Swarm(*box, chosen, rng=seed, keep_positions=keep, initial=[box[1]])
    for _ in range(rounds):
        told: Any = f(swarm.ask())
        swarm.tell(*told) if constrained else swarm.tell(told)
    swarm.save(tmp_path / "swarm.npz")
    again = Swarm.load(tmp_path / "swarm.npz")
    assert again.settings == chosen
    assert_same_run(again.result(), swarm.result())
    assert_same_run(by_hand(again, f), by_hand(swarm, f))


def test_resume_without_a_file_begins_one(tmp_path: Path) -> None:
    path = tmp_path / "swarm.npz"
    run = minimize(Hills(*BOX), *BOX, PLAIN, rng=3, checkpoint=path, resume=True)
    assert_same_run(run, minimize(Hills(*BOX), *BOX, PLAIN, rng=3))
    assert Swarm.load(path).done


def test_resuming_what_was_finished_evaluates_nothing(tmp_path: Path) -> None:
    path = tmp_path / "swarm.npz"
    whole = minimize(Hills(*BOX), *BOX, PLAIN, rng=3, checkpoint=path)
    assert_same_run(minimize(crashing(None, 0), *BOX, PLAIN, rng=3, checkpoint=path, resume=True), whole)


@pytest.mark.parametrize("limit", [{"target": 1.02}, {"stall_iterations": 3}])
def test_what_stopped_a_run_stops_it_where_it_would_have_when_it_is_resumed(limit: dict[str, Any], tmp_path: Path) -> None:
    chosen = PSO(particles=6, iterations=60)
    whole = minimize(Hills(*BOX), *BOX, chosen, rng=1, **limit)
    assert whole.status != "budget"
    assert whole.iterations > 4
    for after in (whole.iterations - 1, whole.iterations - 2):
        path = tmp_path / f"{after}.npz"
        checkpointed(path, chosen, after, rng=1)
        for _ in range(2):  # the second time it is already stopped
            assert_same_run(minimize(Hills(*BOX), *BOX, chosen, rng=1, checkpoint=path, resume=True, **limit), whole)


def test_a_run_may_be_resumed_without_knowing_its_seed(tmp_path: Path) -> None:
    whole = minimize(Hills(*BOX), *BOX, PLAIN, rng=3)
    path = checkpointed(tmp_path / "swarm.npz")
    assert_same_run(minimize(Hills(*BOX), *BOX, PLAIN, checkpoint=path, resume=True), whole)


def test_a_checkpoint_is_written_every_so_often_and_at_the_end(tmp_path: Path) -> None:
    path, seen = tmp_path / "swarm.npz", []

    def callback(swarm: Swarm) -> None:
        seen.append(Swarm.load(path).iteration if path.exists() else 0)

    minimize(Hills(*BOX), *BOX, PLAIN, rng=0, checkpoint=path, checkpoint_every=6, callback=callback)
    assert seen == [0] * 5 + [6] * 6 + [12] * 6 + [18] * 3
    assert Swarm.load(path).iteration == PLAIN.iterations
    assert os.listdir(tmp_path) == ["swarm.npz"]


def test_after_ctrl_c_the_last_checkpoint_goes_on_to_the_same_end(tmp_path: Path) -> None:
    path, f = tmp_path / "swarm.npz", Hills(*BOX)

    def interrupted(x: np.ndarray) -> Any:
        if len(f.asked) == 9:
            raise KeyboardInterrupt
        return f(x)

    options: dict[str, Any] = {"rng": 0, "checkpoint": path, "checkpoint_every": 4}
    assert minimize(interrupted, *BOX, PLAIN, **options).iterations == 9
    assert Swarm.load(path).iteration == 8
    resumed = minimize(Hills(*BOX), *BOX, PLAIN, resume=True, **options)
    assert_same_run(resumed, minimize(Hills(*BOX), *BOX, PLAIN, rng=0))


def test_settings_in_numpys_numbers_are_kept(tmp_path: Path) -> None:
    chosen = PSO(particles=np.int64(10), iterations=np.int32(20), inertia=np.float32(0.5))  # type: ignore[arg-type]
    swarm = Swarm(*BOX, chosen, rng=0)
    swarm.save(tmp_path / "swarm.npz")
    assert Swarm.load(tmp_path / "swarm.npz").settings == chosen


# ---- files that are refused ------------------------------------------------------------------------------------------


def rewritten(path: Path, **changes: Any) -> Path:
    """A checkpoint with some of its arrays replaced, None for left out."""
    with np.load(path) as file:
        arrays: dict[str, Any] = {**file}
    for name, value in changes.items():
        arrays[name] = value(arrays[name].copy()) if callable(value) else value
    np.savez(path, **{name: value for name, value in arrays.items() if value is not None})
    return path


def header(**changes: Any) -> Any:
    def change(content: np.ndarray) -> np.ndarray:
        return np.frombuffer(json.dumps({**json.loads(content.tobytes()), **changes}).encode(), dtype=np.uint8)

    return change


def at(index: int, value: int) -> Any:
    def change(array: np.ndarray) -> np.ndarray:
        array[index] = value
        return array

    return change


FOREIGN = {
    "text": b"particles: 3\n",
    "JSON": b'{"format": "spacearm swarm checkpoint"}',
    "empty": b"",
    "zip of nothing": b"PK\x05\x06" + bytes(18),
}


@pytest.mark.parametrize("case", FOREIGN)
def test_a_file_that_is_no_checkpoint_is_refused_and_kept(case: str, tmp_path: Path) -> None:
    path = tmp_path / "notes.txt"
    path.write_bytes(FOREIGN[case])
    assert_refused("swarm", f"checkpoint: {case}", FileFormatError, lambda: Swarm.load(path), path=path)
    with pytest.raises(OutputError, match=r"is not a swarm's checkpoint|cannot"):
        Swarm(*BOX, PLAIN).save(path)
    with pytest.raises(SpacearmError):
        minimize(Hills(*BOX), *BOX, PLAIN, checkpoint=path)
    with pytest.raises(SpacearmError):
        minimize(Hills(*BOX), *BOX, PLAIN, checkpoint=path, resume=True)
    assert path.read_bytes() == FOREIGN[case]


def test_arrays_of_somebody_else_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "theirs.npz"
    np.savez(path, lower=np.zeros(2), upper=np.ones(2))
    with pytest.raises(FileFormatError, match="something else"):
        Swarm.load(path)
    np.save(tmp_path / "one.npy", np.zeros(3))
    with pytest.raises(FileFormatError, match="something else"):
        Swarm.load(tmp_path / "one.npy")


def test_pickled_objects_are_never_run(tmp_path: Path) -> None:
    path = checkpointed(tmp_path / "swarm.npz")
    rewritten(path, rows=np.array([Crash()], dtype=object))
    with pytest.raises(FileFormatError, match="broken"):
        Swarm.load(path)


def test_a_checkpoint_of_another_version_says_so(tmp_path: Path) -> None:
    path = checkpointed(tmp_path / "swarm.npz")
    rewritten(path, header=header(version=2))
    assert_refused("swarm", "checkpoint: another version", FileFormatError, lambda: Swarm.load(path), path=path)


BROKEN: dict[str, dict[str, Any]] = {
    "no header": {"header": None},
    "header no JSON": {"header": np.zeros(5, dtype=np.uint8)},
    "header without a seed": {
        "header": lambda content: np.frombuffer(
            json.dumps({k: v for k, v in json.loads(content.tobytes()).items() if k != "seed"}).encode(), dtype=np.uint8
        )
    },
    "seed below 0": {"header": header(seed=-1)},
    "settings unknown": {"header": header(settings={"kind": "PSO", "partickles": 3})},
    "settings of no kind": {"header": header(settings={"particles": 3})},
    "settings out of range": {"header": header(settings={"kind": "PSO", "particles": 0})},
    "settings of another swarm": {"header": header(settings={"kind": "PSO", "particles": 3000})},
    "bounds in the wrong order": {"lower": np.array([9.0, 9.0])},
    "bounds NaN": {"lower": np.array([np.nan, 0.0])},
    "bounds of one dimension": {"lower": np.zeros(1), "upper": np.ones(1)},
    "no positions": {"state_position": None},
    "positions cut short": {"state_position": np.zeros(3)},
    "velocity as rows": {"state_velocity": lambda x: x.reshape(2, -1)},
    "archive of half a row": {"state_archive": np.zeros(3)},
    "counters cut short": {"state_counters": np.zeros(2, dtype=np.int64)},
    "more active than there are": {"state_counters": at(3, 10**6)},
    "none active": {"state_counters": at(3, 0)},
    "a history entry beyond the last": {"state_counters": at(4, 10**6)},
    "evaluations below 0": {"state_counters": at(1, -5)},
    "rounds that are not in the history": {"state_counters": at(0, 3)},
    "history of two columns": {"rows": np.zeros((7, 2))},
    "kept positions of another length": {"positions": np.zeros((3, 2))},
    "initial outside": {"initial": np.zeros((1, 2))},
}


@pytest.mark.parametrize("case", BROKEN)
def test_a_checkpoint_that_was_tampered_with_is_refused(case: str, tmp_path: Path) -> None:
    path = checkpointed(tmp_path / "swarm.npz")
    rewritten(path, **BROKEN[case])
    with pytest.raises(FileFormatError, match="it is broken or something else"):
        Swarm.load(path)


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return checkpointed(tmp_path_factory.mktemp("written") / "swarm.npz", SMALL_NAMED["ipso-e"], history="positions")


@WITH_FILES
@given(data=st.data())
def test_a_truncated_checkpoint_is_refused(written: Path, tmp_path: Path, data: st.DataObject) -> None:
    content = written.read_bytes()
    path = tmp_path / "cut.npz"
    path.write_bytes(content[: data.draw(st.integers(0, len(content) - 1))])
    with pytest.raises(FileFormatError):
        Swarm.load(path)


@settings(max_examples=30, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_a_checkpoint_with_a_wrong_byte_is_refused_or_harmless(written: Path, tmp_path: Path, data: st.DataObject) -> None:
    content = bytearray(written.read_bytes())
    content[data.draw(st.integers(0, len(content) - 1))] ^= data.draw(st.integers(1, 255))
    path = tmp_path / "spoiled.npz"
    path.write_bytes(content)
    try:
        again = Swarm.load(path)
    except FileFormatError:
        return
    assert_same_run(again.result(), Swarm.load(written).result())  # such as in a file's date


# ---- resuming something else -----------------------------------------------------------------------------------------

OTHER: dict[str, Any] = {
    "resume: other particles": {"settings": PSO(particles=11, iterations=20)},
    "resume: other iterations": {"settings": PSO(particles=10, iterations=30)},
    "resume: another swarm": {"settings": IPSO(particles=10, iterations=20)},
    "resume: other constraints": {"settings": PSO(particles=10, iterations=20, constraints=Penalty())},
    "resume: other forgiveness": {"settings": PSO(particles=10, iterations=20, constraints=FeasibleFirst(forgiven=0.1))},
    "resume: other bounds": {"upper": BOX[1] + 1},
    "resume: more dimensions": {"lower": np.zeros(3), "upper": np.ones(3)},
    "resume: another seed": {"rng": 4},
    "resume: another history": {"history": "positions"},
    "resume: another initial": {"initial": [BOX[0]]},
}


@pytest.mark.parametrize("case", OTHER)
def test_a_run_is_resumed_only_as_it_was_begun(case: str, tmp_path: Path) -> None:
    path = checkpointed(tmp_path / "swarm.npz")
    before = path.read_bytes()
    given_: dict[str, Any] = {"lower": BOX[0], "upper": BOX[1], "settings": PLAIN, "rng": 3, **OTHER[case]}
    call = lambda: minimize(crashing(None, 0), **given_, checkpoint=path, resume=True)  # noqa: E731
    assert_refused("swarm", case, SettingsError, call, path=path)
    assert path.read_bytes() == before


def test_an_existing_checkpoint_is_not_overwritten_unasked(tmp_path: Path) -> None:
    path = checkpointed(tmp_path / "swarm.npz")
    before = path.read_bytes()
    call = lambda: minimize(crashing(None, 0), *BOX, PLAIN, rng=3, checkpoint=path)  # noqa: E731
    assert_refused("swarm", "checkpoint exists", OutputError, call, path=path)
    assert path.read_bytes() == before


def test_resume_needs_a_checkpoint() -> None:
    call = lambda: minimize(Hills(*BOX), *BOX, PLAIN, resume=True)  # noqa: E731
    assert_refused("swarm", "resume without checkpoint", SettingsError, call)


def test_a_swarm_is_not_saved_between_ask_and_tell(tmp_path: Path) -> None:
    swarm = Swarm(*BOX, PLAIN)
    swarm.ask()
    assert_refused("swarm", "save after ask", SwarmError, lambda: swarm.save(tmp_path / "swarm.npz"))
    assert os.listdir(tmp_path) == []


# ---- disks -----------------------------------------------------------------------------------------------------------


def full(*_: Any) -> Any:
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


@pytest.mark.parametrize("step", ["fsync", "replace"])
def test_a_full_disk_leaves_the_last_checkpoint_as_it_was(step: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "swarm.npz"

    def callback(swarm: Swarm) -> None:
        if swarm.iteration == 5:
            monkeypatch.setattr(os, step, full)

    call = lambda: minimize(Hills(*BOX), *BOX, PLAIN, rng=3, checkpoint=path, checkpoint_every=4, callback=callback)  # noqa: E731
    assert_refused("swarm", "disk full", OutputError, call, path=path)
    monkeypatch.undo()
    assert os.listdir(tmp_path) == ["swarm.npz"]
    assert Swarm.load(path).iteration == 4
    resumed = minimize(Hills(*BOX), *BOX, PLAIN, rng=3, checkpoint=path, resume=True)
    assert_same_run(resumed, minimize(Hills(*BOX), *BOX, PLAIN, rng=3))


@pytest.mark.skipif(sys.platform != "linux", reason="sets a limit on a file's size")
def test_a_file_that_may_not_grow_leaves_the_last_checkpoint_as_it_was(tmp_path: Path) -> None:
    import resource
    import signal

    path = checkpointed(tmp_path / "swarm.npz")
    before = path.read_bytes()
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    try:
        resource.setrlimit(resource.RLIMIT_FSIZE, (1000, limits[1]))
        with pytest.raises(OutputError, match="cannot be written"):
            Swarm.load(path).save(path)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
        signal.signal(signal.SIGXFSZ, handler)
    assert path.read_bytes() == before
    assert os.listdir(tmp_path) == ["swarm.npz"]


def test_a_folder_that_is_missing_is_named(tmp_path: Path) -> None:
    path = tmp_path / "missing" / "swarm.npz"
    assert_refused("swarm", "no such folder", OutputError, lambda: Swarm(*BOX, PLAIN).save(path), path=path)
    assert_refused("swarm", "load: no such file", FileFormatError, lambda: Swarm.load(path), path=path)


def test_a_folder_is_no_checkpoint(tmp_path: Path) -> None:
    assert_refused("swarm", "save: a folder", OutputError, lambda: Swarm(*BOX, PLAIN).save(tmp_path), path=tmp_path)
    assert_refused("swarm", "load: a folder", FileFormatError, lambda: Swarm.load(tmp_path), path=tmp_path)


def test_a_checkpoint_can_be_moved_and_is_plain_arrays(tmp_path: Path) -> None:
    path = checkpointed(tmp_path / "swarm.npz")
    shutil.copy(path, tmp_path / "anything")
    assert Swarm.load(tmp_path / "anything").iteration == 7
    with np.load(io.BytesIO(path.read_bytes()), allow_pickle=False) as file:
        assert all(file[name].dtype.kind in "fiu" for name in file.files)
