"""`spacearm report`: the scene for other programs, and what is refused before a video is begun."""

from pathlib import Path

import numpy as np
import pytest
import trimesh

import spacearm as sa
from cli.conftest import Refused, Told


@pytest.fixture(scope="module")
def plan_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A plan of a few evaluations, whatever came of it."""
    robot = sa.load_robot("srs7")
    home = robot.configuration("home")
    problem = sa.Problem(robot, [sa.Sphere((0, 0, 3.0), 0.1, name="lamp")], start=home, goal=home + 0.1)
    path = tmp_path_factory.mktemp("plan") / "plan.json"
    sa.save_plan(sa.plan(problem, sa.PlannerSettings(evaluations=30), rng=0), path)
    return path


def test_the_scene_is_written_without_a_page(plan_file: Path, tmp_path: Path, told: Told) -> None:
    code, out, err = told(["report", str(plan_file), "--glb", str(tmp_path / "scene.glb")])
    assert (code, err) == (0, "")
    assert "scene.glb (" in out
    assert [path.name for path in tmp_path.iterdir()] == ["scene.glb"]
    names = trimesh.load_scene(tmp_path / "scene.glb").graph.nodes
    assert {"lamp", "z up", *(joint.name for joint in sa.load_robot("srs7").joints)} <= set(names)


def test_page_and_scene_at_once(plan_file: Path, tmp_path: Path, told: Told) -> None:
    files = ["-o", str(tmp_path / "a.html"), "--glb", str(tmp_path / "a.glb")]
    code, out, _ = told(["report", str(plan_file), *files])
    assert code == 0
    assert out.count("written") == 2
    again = tmp_path / "again.glb"
    sa.save_glb(sa.load_saved_plan(plan_file), again)
    one, other = (trimesh.load_scene(path) for path in (tmp_path / "a.glb", again))
    np.testing.assert_array_equal(one.bounds, other.bounds)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("", "report has nothing to write, expected -o, --glb or --video; add -o report.html"),
        ("--glb <new>.gltf", "expected a name that ends with .glb"),
        ("--video <new>.avi", "expected a name that ends with .mp4 or .gif"),
        ("-o <new> --fps 3.0", "--fps is that of a video, and none is asked for"),
        ("--video <new>.mp4 --size 1280", "--size is '1280', expected width and height in pixels, as in 1280x720"),
    ],
)
def test_what_cannot_be_written_is_refused(
    words: str, said: str, plan_file: Path, tmp_path: Path, refused: Refused, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("spacearm.report.video.find_chromium", lambda: "chromium")
    monkeypatch.setattr("shutil.which", lambda name: name)
    refused((said,), "report", str(plan_file), *words.replace("<new>", str(tmp_path / "new")).split())
    assert list(tmp_path.iterdir()) == []


def test_a_missing_program_is_told_before_the_work(
    plan_file: Path, tmp_path: Path, refused: Refused, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    refused(("a video needs ffmpeg",), "report", str(plan_file), "--video", str(tmp_path / "new.mp4"))


def test_a_file_that_is_there_stays(plan_file: Path, tmp_path: Path, refused: Refused) -> None:
    (tmp_path / "scene.glb").write_text("mine")
    refused(("exists",), "report", str(plan_file), "--glb", str(tmp_path / "scene.glb"))
    assert (tmp_path / "scene.glb").read_text() == "mine"
