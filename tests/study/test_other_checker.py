"""The other checker: it finds what is there, and it looks closely enough."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from spacearm.motion import Motion
from spacearm.study.motionbenchmaker import Item, RobotFiles, find_items
from spacearm.study.other_checker import STEP, OtherChecker, dense_configurations, overlapping_pairs
from study.tiny_collection import box, request, scene, write_problem, write_robot

ACROSS = Motion([[-1.0, 0.0], [1.0, 0.0]])
JOINTS = ("shoulder", "elbow")


def checked(folder: Path, *objects: dict) -> tuple[OtherChecker, Item]:
    write_robot(folder)
    write_problem(folder / "one", 1, scene(*objects), request([-1, 0], [1, 0]))
    files = RobotFiles(urdf=folder / "arm.urdf", srdf=folder / "arm.srdf", group="arm")
    return OtherChecker(files, JOINTS), find_items(folder)[0]


@given(st.integers(0, 3), st.integers(0, 2**32 - 1), st.floats(0, 3))
def test_neighbours_are_at_most_a_step_apart(interior: int, seed: int, spread: float) -> None:
    points = np.random.default_rng(seed).normal(size=(interior + 2, 3)) * spread
    motion = Motion(points)
    q = dense_configurations(motion)
    np.testing.assert_allclose(q[[0, -1]], points[[0, -1]], rtol=0, atol=1e-12)
    gaps = np.linalg.norm(np.diff(q, axis=0), axis=1)
    assert gaps.max() <= STEP
    assert len(q) <= 10 + 3 * motion.length() / STEP


def test_a_sheet_of_a_tenth_of_a_millimetre_is_seen(tmp_path: Path) -> None:
    other, item = checked(tmp_path, box([0.3, 1e-4, 0.1], [1.0, 0.0, 0.0]))
    found = other.look(item, dense_configurations(ACROSS))
    assert found.collisions > 0
    assert "block" in found.first
    assert "fore" in found.first


def test_what_is_beside_the_way_is_not_hit(tmp_path: Path) -> None:
    """The last bead, of radius 0.05, ends at 1.15 m."""
    other, item = checked(tmp_path, box([0.1, 0.1, 0.1], [1.2001, 0.0, 0.0]))
    assert other.look(item, dense_configurations(ACROSS)).collisions == 0
    other, item = checked(tmp_path, box([0.1, 0.1, 0.1], [1.1999, 0.0, 0.0]))
    assert other.look(item, dense_configurations(ACROSS)).collisions > 0


def test_an_objects_own_pose_comes_first(tmp_path: Path) -> None:
    """Turned by a quarter and moved: the box stands at (1, 0, 0) in the world."""
    outer = {"position": {"x": 0.0, "y": 0.0, "z": 0.0}, "orientation": {"x": 0, "y": 0, "z": 0.5**0.5, "w": 0.5**0.5}}
    other, item = checked(tmp_path, box([0.1, 0.1, 0.1], [0.0, -1.0, 0.0], pose=outer))
    assert other.look(item, dense_configurations(ACROSS)).collisions > 0
    other, item = checked(tmp_path, box([0.1, 0.1, 0.1], [0.0, 1.0, 0.0], pose=outer))
    assert other.look(item, dense_configurations(ACROSS)).collisions == 0


def test_links_that_the_srdf_keeps_apart_may_not_meet(tmp_path: Path) -> None:
    """Folded together the arm's links pass through each other; allowed to touch, nothing is found."""
    folded = Motion([[0.0, 0.0], [0.0, np.pi - 0.3]])
    other, item = checked(tmp_path)
    assert other.look(item, dense_configurations(folded)).collisions == 0
    text = (tmp_path / "arm.srdf").read_text()
    (tmp_path / "arm.srdf").write_text(text.replace('link1="upper"', 'link1="base"'))
    strict = OtherChecker(RobotFiles(urdf=tmp_path / "arm.urdf", srdf=tmp_path / "arm.srdf", group="arm"), JOINTS)
    assert strict.look(item, dense_configurations(folded)).collisions > 0


def test_links_that_always_overlap_are_left_out_where_that_is_said(tmp_path: Path) -> None:
    """A bead of the forearm is in one of the upper arm, whatever the elbow does, and nobody allows them to touch."""
    other, item = checked(tmp_path)
    urdf, srdf = (tmp_path / "arm.urdf").read_text(), (tmp_path / "arm.srdf").read_text()
    at = urdf.index('<link name="fore"')
    upper, fore = urdf[:at].replace('xyz="0.5 0 0"', 'xyz="0.58 0 0"'), urdf[at:].replace('xyz="0.3 0 0"', 'xyz="0.02 0 0"', 1)
    (tmp_path / "arm.urdf").write_text(upper + fore)
    (tmp_path / "arm.srdf").write_text(srdf.replace('link1="upper"', 'link1="base"'))
    files = RobotFiles(urdf=tmp_path / "arm.urdf", srdf=tmp_path / "arm.srdf", group="arm")
    pairs = overlapping_pairs(files.load())
    assert [pair.links for pair in pairs] == [("fore", "upper")]
    q = dense_configurations(ACROSS)
    assert OtherChecker(files, JOINTS).look(item, q).collisions == len(q)
    assert OtherChecker(files, JOINTS, overlapping=pairs).look(item, q).collisions == 0
    assert other.look(item, q).collisions == 0


@pytest.mark.parametrize("seed", range(3))
def test_it_agrees_with_the_distance_of_spheres_and_a_box(tmp_path: Path, seed: int) -> None:
    rng = np.random.default_rng(seed)
    size, centre = rng.uniform(0.05, 0.3, 3), np.array([*rng.uniform(0.4, 1.0, 2), 0.0])
    motion = Motion(rng.uniform(-2, 2, (4, 2)))
    other, item = checked(tmp_path, box(size.tolist(), centre.tolist()))
    q = dense_configurations(motion)
    first, both = q[:, 0], q.sum(axis=1)
    gaps = []
    for x in (0.3, 0.4, 0.5):
        upper = x * np.stack([np.cos(first), np.sin(first), 0 * first], axis=1)
        fore = 0.6 / x * upper + x * np.stack([np.cos(both), np.sin(both), 0 * both], axis=1)
        gaps += [np.linalg.norm(np.maximum(np.abs(bead - centre) - size / 2, 0), axis=1) - 0.05 for bead in (upper, fore)]
    assert other.look(item, q).collisions == np.count_nonzero(np.min(gaps, axis=0) <= 0)
