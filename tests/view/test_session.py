"""The state that browsers share: one plan at a time, cancelled or not, changes from many threads, and what is saved."""

from __future__ import annotations

import json
import threading
from pathlib import Path

import numpy as np
import pytest

import spacearm as sa
from house.source import REPOSITORY
from spacearm.core.errors import OutputError, ProblemError, SettingsError
from spacearm.files import load_problem, load_saved_plan
from spacearm.view.edited_problem import read_source
from spacearm.view.output_folder import OutputFolder
from spacearm.view.placements import as_handle
from spacearm.view.session import Session

FIRST = REPOSITORY / "examples" / "01_first_plan.yaml"
LONG = 300.0  # [s] more than any plan here takes


def session_of(path: Path, folder: Path) -> Session:
    return Session(read_source(path), OutputFolder(folder), seed=0)


def planned(session: Session) -> Session:
    assert session.plan()
    assert session.job is not None
    assert session.job.wait(LONG)
    return session


def test_a_plan_is_that_of_the_library(tmp_path: Path) -> None:
    session = planned(session_of(FIRST, tmp_path))
    source = read_source(FIRST)
    wanted = sa.plan(source.problem, source.settings, rng=0)
    motion = session.motion
    assert motion is not None
    assert motion.plan is not None
    assert motion.plan.trajectory == wanted.trajectory
    assert (motion.status, motion.tone) == ("found", "good")
    assert "Proven: at least" in motion.headline
    assert not session.outdated


def test_a_file_that_was_edited_is_not_said_to_be_proven(tmp_path: Path) -> None:
    session = planned(session_of(FIRST, tmp_path))
    path = session.save_plan("plan")
    assert "says that it is proven" in session_of(path, tmp_path).motion.headline  # type: ignore[union-attr]
    values = json.loads(path.read_text())
    values["motion"]["control_points"][1][0] += 1e-3
    (tmp_path / "edited.json").write_text(json.dumps(values))
    motion = session_of(tmp_path / "edited.json", tmp_path).motion
    assert motion is not None
    assert (motion.headline, motion.tone) == ("From a file that was edited: not proven", "bad")
    assert "it was edited" in motion.message


def test_plan_pressed_twice_is_one_job(tmp_path: Path) -> None:
    session = session_of(FIRST, tmp_path)
    session.set_budget(None, 60.0)
    began = []
    threads = [threading.Thread(target=lambda: began.append(session.plan())) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sorted(began) == [False] * 7 + [True]
    session.cancel()
    assert session.job is not None
    assert session.job.wait(LONG)
    assert not session.is_planning


def test_a_plan_that_is_cancelled_keeps_its_best_motion(tmp_path: Path) -> None:
    session = session_of(FIRST, tmp_path)
    session.set_budget(None, 120.0)
    seen = threading.Event()
    session.listen(lambda change: seen.set() if change == "candidate" and session.candidates() else None)
    assert session.plan()
    assert seen.wait(LONG)
    session.cancel()
    assert session.job is not None
    assert session.job.wait(LONG)
    assert session.job.seconds < 120
    assert session.motion is not None
    assert session.motion.plan is not None
    assert session.motion.plan.interrupted
    assert session.motion.plan.found
    fitness = [one.fitness for one in session.candidates()]
    assert fitness == sorted(fitness, reverse=True)


def test_a_plan_that_is_cancelled_at_once_says_so(tmp_path: Path) -> None:
    session = session_of(FIRST, tmp_path)
    session.set_budget(None, 120.0)
    session.plan()
    session.cancel()
    assert session.job is not None
    assert session.job.wait(LONG)
    assert session.job.state in ("cancelled", "done")
    assert session.job.message


def test_a_start_in_collision_is_a_verdict_and_no_crash(tmp_path: Path) -> None:
    session = session_of(FIRST, tmp_path)
    session.move_obstacle(0, as_handle([0.0, 0.6, 0.0], [1, 0, 0, 0]))
    near = session.nearest()
    assert near is not None
    assert near.tone == "bad"
    planned(session)
    assert session.job is not None
    assert session.job.state == "done"
    assert session.job.plan is not None
    assert session.job.plan.status == "start_in_collision"
    assert session.motion is None
    assert "penetrate" in session.job.message


def test_a_goal_out_of_reach_is_a_verdict_and_no_crash(tmp_path: Path) -> None:
    session = session_of(FIRST, tmp_path)
    session.set_goal_position([50.0, 0.0, 0.0])
    assert session.reachable().tone == "bad"
    planned(session)
    assert session.job is not None
    assert session.job.plan is not None
    assert session.job.plan.status == "goal_unreachable"


def test_a_change_makes_a_motion_outdated_and_undo_makes_it_no_newer(tmp_path: Path) -> None:
    session = planned(session_of(FIRST, tmp_path))
    session.set_clearance(0.02)
    assert session.outdated
    session.undo_changes()
    assert session.edited.problem is session.edited.source.problem
    assert session.outdated  # what is proven is known of the problem as it was then
    assert not session.edited.has_changes


def test_changes_are_refused_in_a_sentence_and_change_nothing(tmp_path: Path) -> None:
    session = session_of(FIRST, tmp_path)
    before = session.edited
    with pytest.raises(ProblemError):
        session.set_clearance(-1.0)
    with pytest.raises(SettingsError):
        session.set_budget(-5, None)
    with pytest.raises(SettingsError):
        session.set_seed(-1)
    with pytest.raises(ProblemError):
        session.set_goal_joint(0, 0.1)
    with pytest.raises(ProblemError):
        session.set_goal_pose([0, 0, 0], [1, 0, 0, 0])
    with pytest.raises(ProblemError):
        session.move_obstacle(17, as_handle([0, 0, 0], [1, 0, 0, 0]))
    assert session.edited is before


def test_one_joint_moves_and_the_others_keep_all_digits(tmp_path: Path) -> None:
    session = session_of(FIRST, tmp_path)
    q = np.linspace(0.1, 0.2, 7) / 3
    session.set_start(q)
    session.set_start_joint(3, 0.5)
    assert session.edited.problem.start.tolist() == [*q[:3], 0.5, *q[4:]]


def test_changes_from_many_threads_leave_one_of_them(tmp_path: Path) -> None:
    session = session_of(FIRST, tmp_path)
    told = []
    session.listen(told.append)
    failed: list[BaseException] = []

    def change(number: int) -> None:
        try:
            for i in range(20):
                value = 0.01 * number + 0.0001 * i
                session.set_start_joint(number % 7, value)
                session.move_obstacle(number % 3, as_handle([1.0 + value, 1.0, 0.0], [1, 0, 0, 0]))
                session.nearest()
                session.plan()
                session.cancel()
                assert session.outdated in (True, False)
        except BaseException as error:
            failed.append(error)

    threads = [threading.Thread(target=change, args=(i,)) for i in range(6)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    session.close()
    assert not failed
    assert session.edited.revision == 6 * 20 * 2
    for i in range(6):
        assert session.edited.problem.start[i] == pytest.approx(0.01 * i + 0.0019)
    assert told.count("problem") == 240


def test_an_error_of_ours_ends_the_job_and_not_the_session(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def broken(*_: object, **__: object) -> None:
        raise ZeroDivisionError("broken")

    monkeypatch.setattr("spacearm.view.plan_job.plan", broken)
    session = planned(session_of(FIRST, tmp_path))
    assert session.job is not None
    assert session.job.state == "failed"
    assert "an error of spacearm itself" in session.job.message
    assert "ZeroDivisionError: broken" in capsys.readouterr().err
    planned(session)


# ---- Files ------------------------------------------------------------------------------------------------------------


def test_what_is_saved_is_read_back(tmp_path: Path) -> None:
    session = session_of(FIRST, tmp_path)
    session.set_start_joint(0, 0.3)
    planned(session)
    problem, plan = session.save_problem("changed"), session.save_plan("motion")
    assert load_problem(problem) == session.edited.problem
    saved = load_saved_plan(plan)
    assert session.motion is not None
    assert saved.trajectory == session.motion.trajectory
    report = session.save_report("report").read_text(encoding="utf-8")
    assert report.startswith("<!doctype html>")
    assert session.saved == ("changed.yaml", "motion.json", "report.html")
    with pytest.raises(OutputError, match="exists"):
        session.save_problem("changed.yaml")


@pytest.mark.parametrize("name", ["../x", "/tmp/x", "a/b", "", "."])
def test_nothing_is_saved_outside_the_folder(name: str, tmp_path: Path) -> None:
    inside = tmp_path / "inside"
    inside.mkdir()
    session = planned(session_of(FIRST, inside))
    for save in (session.save_problem, session.save_plan, session.save_report):
        with pytest.raises(OutputError, match="the file's name is"):
            save(name)
    assert [path.name for path in tmp_path.iterdir()] == ["inside"]
    assert not list(inside.iterdir())


def test_without_a_plan_there_is_none_to_save(tmp_path: Path) -> None:
    session = session_of(FIRST, tmp_path)
    for save in (session.save_plan, session.save_report):
        with pytest.raises(OutputError, match="there is no plan"):
            save("x")


@pytest.fixture
def saved(tmp_path: Path) -> Path:
    return planned(session_of(FIRST, tmp_path)).save_plan("plan")


def test_the_motion_of_a_plan_file_is_shown_at_once_and_its_proof_not_believed(saved: Path, tmp_path: Path) -> None:
    session = session_of(saved, tmp_path)
    motion = session.motion
    assert motion is not None
    assert motion.plan is None
    assert motion.tone == "near"
    assert "not checked here" in motion.message
    q, T = motion.at(0.5 * motion.duration)
    np.testing.assert_array_equal(q, motion.trajectory.sample(0.5 * motion.duration).q)
    np.testing.assert_array_equal(T, np.eye(4))
    assert motion.tip_path().shape == (161, 3)
    least = motion.clearances()
    assert 0.01 < least.min() < 0.05
    assert session.save_report("of_file").exists()
    with pytest.raises(OutputError, match="no plan"):
        session.save_plan("again")


def test_a_plan_file_that_is_none_is_refused(tmp_path: Path) -> None:
    (tmp_path / "plan.json").write_text(json.dumps({"a": 1}))
    with pytest.raises(sa.SpacearmError, match="expected a plan file"):
        read_source(tmp_path / "plan.json")


def test_the_base_of_a_floating_motion_moves(tmp_path: Path) -> None:
    session = session_of(REPOSITORY / "examples" / "06_floating_truss.yaml", tmp_path)
    session.set_budget(3000, None)
    planned(session)
    motion = session.motion
    assert motion is not None
    _, first = motion.at(0.0)
    _, last = motion.at(motion.duration)
    np.testing.assert_allclose(first, session.edited.problem.base_start, atol=1e-9)
    assert np.linalg.norm(last - first) > 1e-3
    assert motion.base_path().shape == (161, 3)
    tip = motion.trajectory.tip(motion.duration)[:3, 3]
    np.testing.assert_allclose(motion.tip_path()[-1], tip, atol=1e-9)
