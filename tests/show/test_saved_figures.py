"""Files of figures: the same bytes for the same figure, with their provenance, never over another file."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from spacearm.core.errors import OutputError
from spacearm.show import (
    ComparedMethod,
    figure_base_motion,
    figure_base_paths,
    figure_clearance,
    figure_comparison,
    figure_convergence,
    figure_joints,
    figure_joints_over_iterations,
    figure_pareto,
    figure_path_2d,
    figure_path_3d,
    save_figure,
)
from support.drawn_runs import SCENE, moved, run, two_joints
from support.floating_runs import POINTS, ROBOT, floating, front
from support.messages import assert_refused

PROVENANCE = {"Title": "a test", "seed": "7", "version": "1.2.3", "command": "spacearm paper --seed 7"}
ARM = two_joints()
RUNS = [run([3.0, 2.0, 1.5], [0.1, 0.0, 0.0]), run([4.0, 1.0, 1.0]), run([2.0, 2.0, 1.8])]

FIGURES: dict[str, Callable[[], object]] = {
    "convergence": lambda: figure_convergence(RUNS, best_known=0.9, reported=1.1, threshold=2.5),
    "joints over iterations": lambda: figure_joints_over_iterations(
        run([1.0, 1.0], positions=moved(ARM).motion.sample([0.0, 1.0])), robot=ARM
    ),
    "joints": lambda: figure_joints(moved(ARM)),
    "path in the plane": lambda: figure_path_2d(moved(ARM), robot=ARM, scene=SCENE, start=[0, 0], goal=(0.5, 0.5, 0)),
    "path in space": lambda: figure_path_3d(moved(ARM), robot=ARM, scene=SCENE, start=[0, 0], goal=(0.5, 0.5, 0)),
    "clearance": lambda: figure_clearance(moved(ARM), scene=SCENE),
    "base over time": lambda: figure_base_motion(floating()),
    "paths of tip and base": lambda: figure_base_paths(floating()),
    "path of a floating base": lambda: figure_path_3d(floating(), robot=ROBOT, scene=SCENE, start=POINTS[0]),
    "front": lambda: figure_pareto(front([10.0, 12.0, 14.0], [5.0, 3.0, 4.0], [True, True, False])),
    "comparison": lambda: figure_comparison([ComparedMethod(name="pso", runs=RUNS)], best_known=0.9),
}


@pytest.mark.usefixtures("few_dots")
@pytest.mark.parametrize("name", FIGURES)
def test_a_figure_drawn_twice_gives_the_same_bytes(name: str, tmp_path: Path) -> None:
    first = save_figure(FIGURES[name](), tmp_path / "first", provenance=PROVENANCE)  # type: ignore[arg-type]
    second = save_figure(FIGURES[name](), tmp_path / "second", provenance=PROVENANCE)  # type: ignore[arg-type]
    for a, b in zip(first, second, strict=True):
        assert a.read_bytes() == b.read_bytes()


@pytest.mark.usefixtures("few_dots")
def test_a_figure_saved_twice_gives_the_same_bytes(tmp_path: Path) -> None:
    figure = figure_convergence(RUNS, best_known=0.9)
    first = save_figure(figure, tmp_path / "first", provenance=PROVENANCE)
    second = save_figure(figure, tmp_path / "second", provenance=PROVENANCE)
    assert [path.read_bytes() for path in first] == [path.read_bytes() for path in second]


def test_the_bytes_depend_neither_on_the_process_nor_on_the_users_look(tmp_path: Path) -> None:
    program = (
        "import json, sys; sys.path.insert(0, sys.argv[1])\n"
        "import matplotlib; matplotlib.rcParams.update({'font.size': 17.0, 'axes.grid': True})\n"
        "from support.drawn_runs import run; from spacearm.show import figure_convergence, save_figure\n"
        "save_figure(figure_convergence([run([3.0, 2.0, 1.5])]), sys.argv[2], provenance=json.loads(sys.argv[3]))\n"
    )
    tests = str(Path(__file__).parents[1])
    command = [sys.executable, "-W", "error", "-c", program, tests, str(tmp_path / "there"), json.dumps(PROVENANCE)]
    subprocess.run(command, check=True, env={**os.environ, "PYTHONHASHSEED": "1", "MPLBACKEND": "agg"})
    save_figure(figure_convergence([run([3.0, 2.0, 1.5])]), tmp_path / "here", provenance=PROVENANCE)
    for ending in (".png", ".pdf"):
        assert (tmp_path / f"there{ending}").read_bytes() == (tmp_path / f"here{ending}").read_bytes()


def test_both_files_hold_the_provenance_and_no_date(tmp_path: Path) -> None:
    from PIL import Image

    png, pdf = save_figure(figure_convergence(RUNS), tmp_path / "a", provenance=PROVENANCE)
    with Image.open(png) as image:
        assert image.text == PROVENANCE  # type: ignore[attr-defined]
        assert image.info["dpi"][0] >= 200
    content = pdf.read_bytes()
    assert b"spacearm paper --seed 7" in content
    assert b"/Title (a test)" in content
    assert not re.search(rb"Date|Matplotlib", content)
    assert b"/FontFile2" in content
    assert b"/Type3" not in content


@pytest.mark.parametrize("ending", [".png", ".pdf"])
def test_an_existing_file_is_kept(ending: str, tmp_path: Path) -> None:
    there = tmp_path / f"figure_v1.5{ending}"
    there.write_bytes(b"mine")
    figure = figure_convergence(RUNS)
    assert_refused(
        "show",
        f"figure exists as {ending}",
        OutputError,
        lambda: save_figure(figure, tmp_path / "figure_v1.5", provenance={}),
        path=there,
    )
    assert [path.read_bytes() for path in tmp_path.iterdir()] == [b"mine"]


def test_a_missing_folder_is_told(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="cannot be written"):
        save_figure(figure_convergence(RUNS), tmp_path / "none" / "a", provenance={})


def test_drawing_leaves_no_global_state() -> None:
    import matplotlib

    before = dict(matplotlib.rcParams)
    for draw in FIGURES.values():
        draw()
    assert dict(matplotlib.rcParams) == before
    assert "matplotlib.pyplot" not in sys.modules or not sys.modules["matplotlib.pyplot"].get_fignums()
